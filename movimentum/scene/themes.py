"""Themes: how everything looks that says nothing itself.

A script that says nothing about looks at all, and draws links only, looks like a figure of a textbook.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from movimentum.records import dataclass, replace
from movimentum.scene.appearance import Color
from movimentum.scene.looks import EDGE_WIDTH, FILLED
from movimentum.scene.model import AnchorRef, Shape, Thing


@dataclass(frozen=True, slots=True)
class Theme:
    """``ink``: of lines, edges and letters; ``paper``: inside pins and supports; ``fills``: of links, in turn;
    ``accent``: of traces and vectors.
    """

    ink: Color
    paper: Color
    fills: tuple[Color, ...]
    accent: Color
    background: Color | None = None


_COLORS: tuple[Color, ...] = ((174, 199, 232), (253, 205, 152), (170, 214, 168), (240, 172, 168), (204, 186, 226))

THEMES = {
    "textbook": Theme((38, 38, 46), (255, 255, 255), (*_COLORS, (219, 209, 194)), (190, 40, 40)),
    "print": Theme((0, 0, 0), (255, 255, 255), ((236, 236, 236), (206, 206, 206), (250, 250, 250)), (0, 0, 0)),
    "dark": Theme(
        (226, 229, 236),
        (30, 32, 38),
        ((74, 118, 173), (184, 120, 62), (82, 140, 92), (168, 80, 82), (124, 100, 168), (128, 120, 108)),
        (255, 186, 96),
        (30, 32, 38),
    ),
    "blueprint": Theme(
        (235, 242, 252), (22, 62, 118), ((46, 92, 154), (62, 110, 174), (36, 78, 138)), (255, 226, 130), (22, 62, 118)
    ),
}
"""The themes by name; `configuration.THEME_NAMES` are the same."""


def dressed(things: Iterable[Thing], theme: Theme, joints: frozenset[AnchorRef]) -> tuple[Thing, ...]:
    """The things as ``theme`` draws them; what a definition says itself stays."""
    things = tuple(things)
    width = _link_width(things)
    jointed = {ref.thing for ref in joints}
    made: list[Thing] = []
    filled = 0
    for thing in things:
        fill = theme.fills[filled % len(theme.fills)]
        filled += thing.shape in (*FILLED, Shape.BAR, Shape.DISC)
        made.append(_dressed(thing, theme, fill, width, thing.number in jointed))
    return tuple(made)


def _dressed(thing: Thing, theme: Theme, fill: Color, width: float, jointed: bool) -> Thing:
    look = replace(thing.look, ink=theme.ink, pin_fill=theme.paper)
    match thing.shape:
        case Shape.SPRITE:
            return replace(thing, look=look)
        case Shape.BAR | Shape.PLATE | Shape.POLYGON | Shape.GEAR | Shape.RACK | Shape.DISC:
            if look.dash:
                return replace(thing, look=look, color=thing.color or theme.ink)
            breadth = thing.width or (width if thing.shape is Shape.BAR else None)
            link = thing.shape in (Shape.BAR, Shape.PLATE, Shape.POLYGON)
            pins = look.pins if look.pins is not None or not (jointed and link) else max(2.0, 0.27 * (breadth or width))
            edge = look.edge or theme.ink
            outlined = thing.shape is not Shape.DISC or thing.width is None
            look = replace(
                look, edge=edge if outlined else look.edge, edge_width=look.edge_width or EDGE_WIDTH, pins=pins
            )
            if thing.shape is Shape.PLATE:
                breadth = thing.width or 1.7 * width
            return replace(thing, look=look, width=breadth, color=thing.color or (fill if outlined else theme.ink))
        case Shape.TRACE | Shape.VECTOR:
            return replace(thing, look=look, color=thing.color or theme.accent)
        case _:
            return replace(thing, look=look, color=thing.color or theme.ink)


def _link_width(things: Iterable[Thing]) -> float:
    """How broad a link is: less where links are short."""
    lengths = [
        max(math.dist(a.local, b.local) for a in thing.anchors for b in thing.anchors)
        for thing in things
        if thing.shape is Shape.BAR and thing.anchors and not thing.hidden
    ]
    return min(12.0, max(4.0, 0.14 * sorted(lengths)[len(lengths) // 2])) if lengths else 12.0


def supports(things: Sequence[Thing], fixed: Mapping[AnchorRef, tuple[float, float]]) -> tuple[AnchorRef, ...]:
    """The fixed anchors at which a theme draws a support, one for each place: those of links that show none yet."""
    shown = {ref for thing in things if thing.shape is Shape.GROUND for ref in thing.through}
    taken = {place for ref, place in fixed.items() if ref in shown or things[ref.thing].look.fixed}
    taken |= {anchor.local for thing in things if thing.shape is Shape.GROUND for anchor in thing.anchors}
    found: list[AnchorRef] = []
    for ref, place in fixed.items():
        thing = things[ref.thing]
        if (
            thing.shape in (Shape.BAR, Shape.PLATE, Shape.POLYGON, Shape.GEAR)
            and not thing.hidden
            and place not in taken
        ):
            taken.add(place)
            found.append(ref)
    return tuple(found)
