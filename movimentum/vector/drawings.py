"""SVG sprites as outlines in a film's SVG, page and PDF, sharp at any size.

A drawing is not copied but redrawn from the few elements that all readers and our own PDF support: groups with an
opacity or a clip, and filled or stroked paths in absolute coordinates. So nothing in its file can act, load anything,
or clash with names of the film. If it has anything that outlines cannot show (filters, masks, texts …), the whole
drawing stays a picture.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from xml.etree import ElementTree

from movimentum.errors import ScriptError
from movimentum.geometry import Affine
from movimentum.records import dataclass, replace
from movimentum.rendering.affines import transform_of
from movimentum.rendering.drawings import Drawing2D, drawing, id_of, length_of, view_box
from movimentum.tolerances import SAME_SCALE
from movimentum.vector.numbers import XmlElement, hex_color, joined, short
from movimentum.vector.svg_styles import (
    NotPlain,
    PathPiece,
    Sheet,
    gradient_of,
    inherited,
    moved,
    outline_of,
    paint_of,
    reach,
    share_of,
    written,
)

Element = ElementTree.Element

MOST_TEXT = 1_000_000
"""Characters of the outlines of one drawing: a larger one is a picture."""
_SVG = "{http://www.w3.org/2000/svg}"
_SHAPES = ("path", "line", "polyline", "polygon", "circle", "ellipse", "rect")
_NOTHING = ("defs", "title", "desc", "metadata", "style", "clipPath", "linearGradient", "radialGradient", "symbol",
            "pattern", "marker", "mask", "filter", "animate", "animateTransform", "animateMotion", "set")  # fmt: skip
"""Elements that draw nothing where they stand."""
_LEFT = Affine(1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@dataclass(frozen=True, slots=True)
class Outlines:
    """A drawing in its own pixels, y down, ``size`` (width, height); ``text`` is the inside of an SVG's group whose ids
    all begin with ``name``. ``reason``: why there is none (then ``text`` is empty).
    """

    text: str
    size: tuple[int, int]
    name: str
    reason: str = ""

    @property
    def document(self) -> str:
        """A whole SVG."""
        width, height = self.size
        size = f'width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
        return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{group(self.text)}</svg>'


def group(text: str, attributes: str = "") -> str:
    """The group in which outlines are drawn: it has the values that SVG begins with, whatever is around it."""
    plain = 'fill="#000" stroke="none" stroke-linecap="butt" stroke-linejoin="miter" stroke-miterlimit="4"'
    return f"<g {attributes}{' ' if attributes else ''}{plain}>{text}</g>"


def outlines(path: str, name: str, decimals: int) -> Outlines:
    """The drawing of a picture's path."""
    try:
        made = drawing(path)
    except ScriptError:  # it has been drawn a moment ago
        return Outlines("", (1, 1), name, "a fault")
    return _outlines(made, id_of(path), name, decimals)


@lru_cache(maxsize=64)
def _outlines(made: Drawing2D, element: str | None, name: str, decimals: int) -> Outlines:
    writer = _OutlineWriter(made, element, name, decimals)
    try:
        text = writer.whole()
    except NotPlain as found:
        return Outlines("", made.pixels, name, str(found))
    if len(text) > MOST_TEXT:
        return Outlines("", made.pixels, name, f"outlines of {len(text):,} characters")
    return Outlines(text, made.pixels, name)


@dataclass(frozen=True, slots=True)
class _Within:
    """Where an element is, its inherited style, and whether it is above the one element that is shown."""

    map: Affine
    style: dict[str, str]
    shown: bool


class _OutlineWriter:
    def __init__(self, made: Drawing2D, element: str | None, name: str, decimals: int) -> None:
        self._made, self._name, self._decimals = made, name, decimals
        self._sheet: Sheet | None = None
        self._clips = 0
        self._gradients: list[str] = []
        self._low, self._high = [math.inf] * 2, [-math.inf] * 2
        self._above: set[Element] = set()
        self._kept = None if element is None else made.ids[element]
        if self._kept is not None:
            here = made.above.get(self._kept)
            while here is not None:
                self._above.add(here)
                here = made.above.get(here)

    def whole(self) -> str:
        """All that is drawn, with its gradients."""
        text = self._page_of_it()
        return f"<defs>{''.join(self._gradients)}</defs>{text}" if self._gradients and text else text

    def _page_of_it(self) -> str:
        self._sheet = Sheet(self._made.root)
        style = inherited({}, self._sheet.of(self._made.root, "svg"))
        place = _Within(self._page(), style, self._kept is None or self._kept is self._made.root)
        text = "".join(self._element(child, place) for child in self._made.root)
        width, height = self._made.pixels
        if self._low[0] >= 0.0 and self._low[1] >= 0.0 and self._high[0] <= width and self._high[1] <= height:
            return text
        page = [PathPiece("L" if k else "M", (point,)) for k, point in
                enumerate((0j, complex(width), complex(width, height), complex(0.0, height)))]  # fmt: skip
        return self._clipped(text, [*page, PathPiece("Z")], "nonzero") if text else ""

    def _page(self) -> Affine:
        """From the user units of the root to pixels."""
        root, box = self._made.root, view_box(self._made.root)
        if root.get("transform") or root.get("opacity") or root.get("clip-path"):
            raise NotPlain("a page with a transform, an opacity or a clip")
        if box is None:
            return _LEFT
        wide, high = self._made.width / box[2], self._made.height / box[3]
        fit = (root.get("preserveAspectRatio") or "xMidYMid").split()
        if fit[0] == "none":
            return Affine(wide, 0.0, -wide * box[0], 0.0, high, -high * box[1])
        if fit not in (["xMidYMid"], ["xMidYMid", "meet"]) and abs(wide - high) > SAME_SCALE * wide:
            raise NotPlain("a `preserveAspectRatio`")
        unit = min(wide, high)
        x, y = (self._made.width - unit * box[2]) / 2.0, (self._made.height - unit * box[3]) / 2.0
        return Affine(unit, 0.0, x - unit * box[0], 0.0, unit, y - unit * box[1])

    def _element(self, element: Element, place: _Within) -> str:
        if not element.tag.startswith(_SVG):
            return ""  # what other programs have noted
        tag = element.tag.removeprefix(_SVG)
        if not place.shown and element is not self._kept and element not in self._above:
            return ""
        if tag in _NOTHING and element is not self._kept:
            return ""
        assert self._sheet is not None
        said = self._sheet.of(element, tag)
        if said.get("display") == "none":
            return ""
        inner = transform_of(element.get("transform") or "")
        if inner is None:
            raise NotPlain("a `transform` that is not understood")
        shown = place.shown or element is self._kept
        here = _Within(place.map @ inner, inherited(place.style, said), shown)
        if tag in ("g", "a"):
            inside = "".join(self._element(child, here) for child in element)
        elif tag == "use":
            inside = self._used(element, here)
        elif tag in _SHAPES:
            inside = self._shape(element, tag, here)
        else:
            raise NotPlain(f"`<{tag}>`")
        if not inside:
            return ""
        clip = said.get("clip-path", "none")
        if clip != "none":
            inside = self._clipped(inside, *self._clip(clip, here))
        opacity = share_of(said, "opacity")
        return inside if opacity >= 1.0 else f'<g opacity="{short(opacity, 4)}">{inside}</g>' if opacity > 0.0 else ""

    def _used(self, element: Element, place: _Within) -> str:
        href = element.get("href") or element.get("{http://www.w3.org/1999/xlink}href") or ""
        target = self._made.ids.get(href.strip()[1:])
        if target is None:
            return ""
        if target.tag not in (f"{_SVG}{tag}" for tag in ("g", "a", "use", *_SHAPES)):
            raise NotPlain("a `<use>` of something else than a shape or a group")
        x, y = (length_of(element.get(name) or "0") for name in ("x", "y"))
        if not math.isfinite(x + y):
            raise NotPlain("a `<use>` with a length that is not understood")
        return self._element(target, replace(place, map=place.map @ Affine(1.0, 0.0, x, 0.0, 1.0, y), shown=True))

    # --- shapes

    def _outline(self, element: Element, tag: str) -> list[PathPiece]:
        found = outline_of(element, tag)
        if found is None:
            raise NotPlain(f"a `<{tag}>` that is not understood")
        return found

    def _shape(self, element: Element, tag: str, place: _Within) -> str:
        style = place.style
        outline = self._outline(element, tag)
        if not outline or style.get("visibility", "visible") != "visible":
            return ""
        return "".join([*self._filled(outline, place), *self._stroked(outline, place)])

    def _filled(self, outline: list[PathPiece], place: _Within) -> Iterator[str]:
        style = place.style
        value = style.get("fill", "black")
        if value.lower().startswith("url("):
            assert self._sheet is not None
            shades = gradient_of(value, self._made.ids, self._sheet, outline, place.map)
            if shades is None:
                return
            self._gradients.append(shades.written(f"{self._name}g{len(self._gradients)}"))
            fill, opacity = f"url(#{self._name}g{len(self._gradients) - 1})", shades.opacity
        else:
            paint = paint_of(value, style)
            if paint is None:
                return
            fill, opacity = hex_color(paint[0]), paint[1]
        opacity *= share_of(style, "fill-opacity")
        if opacity <= 0.0:
            return
        there = moved(outline, place.map)
        self._grow(there, 0.0)
        even = ['fill-rule="evenodd"'] if style.get("fill-rule") == "evenodd" else []
        drawn = [f'fill="{fill}"', *even, *_opacity(opacity)]
        yield str(XmlElement("path", [f'd="{written(there, self._decimals)}"', *drawn]))

    def _stroked(self, outline: list[PathPiece], place: _Within) -> Iterator[str]:
        style = place.style
        paint = paint_of(style.get("stroke", "none"), style)
        width = _length(style, "stroke-width", "1")
        if paint is None or width <= 0.0 or (opacity := paint[1] * share_of(style, "stroke-opacity")) <= 0.0:
            return
        a, b, _, d, e, _ = place.map
        scale = math.sqrt(abs(a * e - b * d))
        even = abs(a * a + d * d - b * b - e * e) + abs(a * b + d * e) <= SAME_SCALE * (a * a + d * d)
        decimals, matrix = self._decimals, ""
        if even:
            there, factor = moved(outline, place.map), scale
        else:  # the pen is not round
            there, factor = outline, 1.0
            decimals += max(0, math.ceil(math.log10(max(abs(a) + abs(b), abs(d) + abs(e), 1.0))))
            matrix = f'transform="matrix({joined(a, d, b, e, place.map.c, place.map.f, decimals=8)})"'
        miter = max(1.0, _length(style, "stroke-miterlimit", "4"))
        join, cap = style.get("stroke-linejoin", "miter"), style.get("stroke-linecap", "butt")
        if join not in ("miter", "round", "bevel") or cap not in ("butt", "round", "square"):
            raise NotPlain("a join or a cap that is not understood")
        self._grow(moved(outline, place.map), width * max(abs(a) + abs(b), abs(d) + abs(e)) * max(miter, 1.5) / 2.0)
        drawn = [
            'fill="none"',
            f'stroke="{hex_color(paint[0])}"',
            f'stroke-width="{short(width * factor, decimals + 1)}"',
        ]
        drawn += [f'stroke-linejoin="{join}"'] if join != "miter" else []
        drawn += [f'stroke-miterlimit="{short(miter, 3)}"'] if miter != 4.0 and join == "miter" else []
        drawn += [f'stroke-linecap="{cap}"'] if cap != "butt" else []
        drawn += [*_dashes(style, factor, decimals), *_opacity(opacity)]
        yield str(XmlElement("path", [*([matrix] if matrix else []), f'd="{written(there, decimals)}"', *drawn]))

    def _grow(self, outline: list[PathPiece], margin: float) -> None:
        left, top, right, bottom = reach(outline)
        if not all(map(math.isfinite, (left, top, right, bottom, margin))):
            raise NotPlain("numbers that are too large")
        self._low = [min(self._low[0], left - margin), min(self._low[1], top - margin)]
        self._high = [max(self._high[0], right + margin), max(self._high[1], bottom + margin)]

    # --- clips

    def _clip(self, value: str, place: _Within) -> tuple[list[PathPiece], str]:
        """The outline of a clip that has a single shape, in pixels, and its rule."""
        name = value.removeprefix("url(").removesuffix(")").strip("'\" ")
        clip = self._made.ids.get(name[1:]) if name.startswith("#") else None
        shapes = [] if clip is None else [*clip]
        tag = shapes[0].tag.removeprefix(_SVG) if len(shapes) == 1 else ""
        assert self._sheet is not None
        if clip is None or clip.tag != f"{_SVG}clipPath" or tag not in _SHAPES:
            raise NotPlain("a clip of something else than one shape")
        if clip.get("clipPathUnits", "userSpaceOnUse") != "userSpaceOnUse" or "clip-path" in clip.attrib:
            raise NotPlain("a clip in other units, or of a clip")
        (shape,) = shapes
        said = self._sheet.of(shape, tag)
        outer, inner = (transform_of(each.get("transform") or "") for each in (clip, shape))
        if outer is None or inner is None or "clip-path" in said:
            raise NotPlain("a clip that is not understood")
        outline = moved(self._outline(shape, tag), place.map @ outer @ inner)
        return outline, said.get("clip-rule", "nonzero")

    def _clipped(self, inside: str, outline: list[PathPiece], rule: str) -> str:
        if not outline:
            return ""
        self._clips += 1
        name = f"{self._name}c{self._clips}"
        even = ' clip-rule="evenodd"' if rule == "evenodd" else ""
        clip = f'<clipPath id="{name}"><path d="{written(outline, self._decimals)}"{even}/></clipPath>'
        return f'<g clip-path="url(#{name})">{clip}{inside}</g>'


def _length(style: dict[str, str], name: str, default: str) -> float:
    value = length_of(style.get(name, default))
    if not math.isfinite(value):
        raise NotPlain(f"the {name} `{style.get(name, '')[:40]}`")
    return value


def _dashes(style: dict[str, str], factor: float, decimals: int) -> list[str]:
    text = style.get("stroke-dasharray", "none").strip()
    if text in ("none", ""):
        return []
    lengths = [length_of(word) for word in text.replace(",", " ").split()]
    offset = _length(style, "stroke-dashoffset", "0")
    if not all(math.isfinite(length) and length >= 0.0 for length in lengths):
        raise NotPlain("dashes that are not understood")
    if sum(lengths) <= 0.0:
        return []
    dash = " ".join(short(length * factor, decimals + 1) for length in lengths)
    start = [f'stroke-dashoffset="{short(offset * factor, decimals + 1)}"'] if offset else []
    return [f'stroke-dasharray="{dash}"', *start]


def _opacity(value: float) -> list[str]:
    return [] if value >= 1.0 else [f'opacity="{short(value, 4)}"']
