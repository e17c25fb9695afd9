"""How things look: from the definition, else the theme, else the kind, decided here and nowhere else.

A script that draws only links and states no looks at all looks like a textbook figure.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from typing import Any

from movimentum.records import dataclass, replace
from movimentum.scene.model import AnchorRef, Config, Thing
from movimentum.scene.themes import EDGE_WIDTH, Theme
from movimentum.syntax.tree import Definition, Option
from movimentum.things.colors import INK
from movimentum.things.kind import Color, Look, ThingKind
from movimentum.things.kinds.bar import BAR
from movimentum.things.kinds.disc import DISC
from movimentum.things.kinds.ground import GROUND
from movimentum.things.kinds.poles import POLODE
from movimentum.things.option_rules import COLOR
from movimentum.things.registry import kind_of

LINK_WIDTH = 12.0
"""World pixels: the breadth of the links of a theme, where they are not short."""
DARKER = 0.55
"""Of the colour of an inside: that of its edge."""
SPOKEN = frozenset({"color", "width", "fill", "edge", "dash", "cap", "opacity", "pins", "fixed", "supports"})
"""Options that say something about looks."""

Stated = Mapping[str, Any]
"""The looks in a definition: option -> value; ``drawn`` has the numbers of the anchors that it names in `.through`."""


@dataclass(frozen=True, slots=True)
class _Dress:
    """A theme's looks for one thing: ``fill`` is its turn, ``width`` that of links; ``jointed``: it has joints."""

    theme: Theme
    fill: Color
    width: float
    jointed: bool


def look_of(kind: ThingKind, stated: Stated, dress: _Dress | None = None) -> Look:
    """The look of a thing, in a theme or without one."""
    given = {
        name: stated[name] for name in ("dash", "cap", "opacity", "drawn", "arcs", "align", "layer") if name in stated
    }
    color, fill, edge = (stated.get(name) for name in ("color", "fill", "edge"))
    outline, pins, edge_width = stated.get("width"), stated.get("pins"), None
    if dress is not None:
        theme = dress.theme
        given |= {"ink": theme.ink, "pin_fill": theme.paper, "curves": theme.curves}
        if kind.filled and "dash" not in stated and "open" not in stated:
            circle = kind is DISC and outline is not None
            color = color or (theme.ink if circle else dress.fill)
            edge = edge if circle else edge or theme.ink
            edge_width = theme.edge_width
            if pins is None and dress.jointed and kind.link:
                pins = max(2.0, 0.27 * (outline if outline and kind.broad else dress.width))
            outline = outline or kind.broad * dress.width or None
        elif kind.surface:
            color = color or dress.fill
        elif COLOR in kind.options:
            color = color or (theme.accent if kind.accented else theme.ink)
    paint = (fill if kind.anchors is not None or kind.surface else None) or color or kind.main_ink
    if edge is None and kind.inside:
        edge = INK if fill is None and color is None else darker(paint)
    width = outline or kind.width
    return Look(
        paint=paint,
        color=color,
        fill=fill,
        edge=edge,
        edge_width=edge_width or (width if kind.inside and not kind.broad else EDGE_WIDTH),
        width=width,
        outline=outline,
        size=stated.get("size", kind.size),
        pins=pins,
        fixed="fixed" in stated,
        italic="italic" in stated,
        hidden="hidden" in stated,
        still="still" in stated,
        offstage="offstage" in stated,
        breadth=stated.get("width"),
        **given,
    )


def darker(color: Color) -> Color:
    """The same hue for an edge."""
    red, green, blue = (round(DARKER * value) for value in color)
    return red, green, blue


def dressed(
    things: Sequence[Thing], stated: Sequence[Stated], theme: Theme, jointed: Container[int]
) -> tuple[Thing, ...]:
    """The things as ``theme`` draws them; what a definition says itself (``stated``, for each thing) stays.
    ``jointed``: the numbers of those with joints.
    """
    width = theme.link_width or _link_width(things)
    made: list[Thing] = []
    filled = 0
    for thing, said in zip(things, stated, strict=True):
        own = _of_kind(theme, thing, said, thing.number in jointed)
        pinned = thing.number in jointed and own.get("pins") is not False
        own = {name: value for name, value in own.items() if value is not False}
        dress = _Dress(theme, theme.fills[filled % len(theme.fills)], width, pinned)
        filled += thing.kind.filled
        look = replace(look_of(thing.kind, {**own, **said}, dress), breadth=thing.look.breadth)
        made.append(replace(thing, look=look))
    return tuple(made)


def _of_kind(theme: Theme, thing: Thing, said: Stated, jointed: bool) -> dict[str, Any]:
    """A theme's looks for all things of a kind, less those that a definition overrides."""
    own = dict(theme.kinds.get(thing.kind.word, {}))
    if "color" in said:
        own.pop("fill", None)
    if own.get("italic") is False:
        del own["italic"]
    if own.get("pins") is True or not jointed:
        own.pop("pins", None)
    return own


def _link_width(things: Iterable[Thing]) -> float:
    """How broad a link is: less where links are short."""
    lengths = [
        max(math.dist(a.local, b.local) for a in thing.anchors for b in thing.anchors)
        for thing in things
        if thing.kind is BAR and thing.anchors and not thing.hidden
    ]
    return min(LINK_WIDTH, max(4.0, 0.14 * sorted(lengths)[len(lengths) // 2])) if lengths else LINK_WIDTH


def supports(things: Sequence[Thing], fixed: Mapping[AnchorRef, tuple[float, float]]) -> tuple[AnchorRef, ...]:
    """The fixed anchors at which a theme draws a support, one for each place: those of links that show none yet. Where
    several are at one place, the support is that of the last one that would cover it, else that of the first.
    """
    grounds = [thing for thing in things if thing.kind is GROUND]
    shown = {ref for thing in grounds for ref in thing.through if isinstance(ref, AnchorRef)}
    taken = {place for ref, place in fixed.items() if ref in shown or things[ref.thing].look.fixed}
    taken |= {anchor.local for thing in grounds for anchor in thing.anchors}
    found: dict[tuple[float, float], AnchorRef] = {}
    for ref, place in fixed.items():
        thing = things[ref.thing]
        if thing.kind.supported and not thing.hidden and place not in taken:
            before = found.setdefault(place, ref)
            if thing.kind.inside and (not things[before.thing].kind.inside or before.thing < ref.thing):
                found[place] = ref
    return tuple(found.values())


def says_nothing(definitions: Sequence[Definition], config: Config, painted: bool) -> bool:
    """Whether a script says nothing about looks and draws nothing but links, and what figures of links have.

    ``painted``: whether a statement is about a colour or an opacity.
    """
    options = {
        part.name
        for item in definitions
        for part in item.parts
        if isinstance(part, Option) and item.shape.word != POLODE.word
    }
    if config.background is not None or painted or options & SPOKEN:
        return False
    kinds = {
        kind_of(definition.shape.word)
        for definition in definitions
        if not any(isinstance(part, Option) and part.name == "hidden" for part in definition.parts)
    }
    return all(kind.plain for kind in kinds) and any(kind.broad for kind in kinds)
