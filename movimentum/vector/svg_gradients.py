"""Gradients of an SVG, in pixels: linear and radial ones that go on with their last colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree import ElementTree

from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.rendering.affines import transform_of
from movimentum.vector.elements import hex_color
from movimentum.vector.numbers import joined, short
from movimentum.vector.svg_paths import PathPiece, box
from movimentum.vector.svg_styles import NotPlain, Sheet, paint_of, share_of

Element = ElementTree.Element

_SVG = "{http://www.w3.org/2000/svg}"
_HREFS = ("href", "{http://www.w3.org/1999/xlink}href")
_DEFAULTS = {
    "linearGradient": {"x1": "0%", "y1": "0%", "x2": "100%", "y2": "0%"},
    "radialGradient": {"cx": "50%", "cy": "50%", "r": "50%"},
}
_MOST_STEPS = 20


@dataclass(frozen=True, slots=True)
class Gradient:
    """``kind``: its element's name; ``places``: its attributes under ``map``, which leads to pixels; ``stops``: offset
    and colour each, ``opacity`` that of all of them.
    """

    kind: str
    places: tuple[tuple[str, float], ...]
    map: Affine
    stops: tuple[tuple[float, tuple[int, int, int]], ...]
    opacity: float

    def written(self, name: str) -> str:
        """The element."""
        a, b, c, d, e, f = self.map
        said = "".join(f' {key}="{short(value, 6)}"' for key, value in self.places)
        stops = "".join(f'<stop offset="{short(at, 4)}" stop-color="{hex_color(each)}"/>' for at, each in self.stops)
        matrix = f'gradientTransform="matrix({joined(a, d, b, e, c, f, decimals=8)})"'
        return f'<{self.kind} id="{name}" gradientUnits="userSpaceOnUse" {matrix}{said}>{stops}</{self.kind}>'


def gradient_of(
    value: str, ids: dict[str, Element], sheet: Sheet, outline: Sequence[PathPiece], place: Affine
) -> Gradient | None:
    """The gradient that a paint names, on a shape's own ``outline`` under ``place``; None where it shows nothing."""
    name = value.strip()[4:].partition(")")[0].strip("'\" ")
    chain: list[Element] = []
    here = ids.get(name[1:]) if name.startswith("#") else None
    while here is not None and len(chain) < _MOST_STEPS:
        if here.tag.removeprefix(_SVG) not in _DEFAULTS:
            raise NotPlain("a pattern")
        chain.append(here)
        href = next((here.get(key, "") for key in _HREFS if here.get(key)), "")
        here = ids.get(href.strip()[1:]) if href.strip().startswith("#") else None
    if not chain or here is not None:
        raise NotPlain("a gradient that is not there")

    def said(key: str) -> str | None:
        return next((each.get(key) for each in chain if each.get(key) is not None), None)

    kind = chain[0].tag.removeprefix(_SVG)
    if (said("spreadMethod") or "pad") != "pad":
        raise NotPlain("a gradient that repeats")
    boxed = (said("gradientUnits") or "objectBoundingBox") == "objectBoundingBox"
    keys = dict(_DEFAULTS[kind])
    if kind == "radialGradient":
        keys |= {"fx": said("cx") or "50%", "fy": said("cy") or "50%"}
        if said("fr") is not None:
            raise NotPlain("a gradient with `fr`")
    places = tuple((key, _place(said(key) or default, boxed)) for key, default in keys.items())
    turned = transform_of(said("gradientTransform") or "")
    if turned is None:
        raise NotPlain("a gradient with a transform that is not understood")
    left, top, right, bottom = box(outline)
    if boxed:
        if right <= left or bottom <= top:
            return None
        place = place @ Affine(right - left, 0.0, left, 0.0, bottom - top, top)
    stops, opacity = _stops(next((each for each in chain if any(True for _ in each.iter(f"{_SVG}stop"))), None), sheet)
    return Gradient(kind, places, place @ turned, stops, opacity)


def _place(text: str, boxed: bool) -> float:
    try:
        if text.strip().endswith("%"):
            if not boxed:
                raise NotPlain("a gradient in shares of the page")
            return float(text.strip()[:-1]) / 100.0
        value = float(text)
    except ValueError as error:
        raise NotPlain("a gradient that is not understood") from error
    if not math.isfinite(value):
        raise NotPlain("a gradient that is not understood")
    return value


def _stops(element: Element | None, sheet: Sheet) -> tuple[tuple[tuple[float, tuple[int, int, int]], ...], float]:
    found: list[tuple[float, tuple[int, int, int]]] = []
    opacities: set[float] = set()
    for stop in () if element is None else element.iter(f"{_SVG}stop"):
        style = sheet.of(stop, "stop")
        at = min(max(share_of({"offset": stop.get("offset", "0")}, "offset"), found[-1][0] if found else 0.0), 1.0)
        paint = paint_of(style.get("stop-color", "black"), style)
        if paint is None:
            raise NotPlain("a gradient that fades")
        found.append((at, paint[0]))
        opacities.add(round(paint[1] * share_of(style, "stop-opacity"), 4))
    if len(opacities) != 1:
        raise NotPlain("a gradient that fades" if found else "a gradient without colours")
    return tuple(found), opacities.pop()
