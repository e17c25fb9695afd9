"""Converts the elements of our still SVGs to PDF page operators."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, Protocol
from xml.etree import ElementTree

from movimentum.records import dataclass, replace
from movimentum.vector.film import Film
from movimentum.vector.numbers import short
from movimentum.vector.pdf_letters import PdfLetters, Streams, path_operators
from movimentum.vector.svg import svg_document

Element = ElementTree.Element

SHARED = 160
"""Characters of operators that stand in the file once, even if several pages draw them."""
WIDE = 20_000
"""Pixels from its origin to what such a part may draw."""
ARC = 4.0 / 3.0 * math.tan(math.pi / 16.0)
"""Of its radius: the handles of an eighth of a circle, drawn as a Bézier curve (to 4e-6 of the radius)."""


class Objects(Streams, Protocol):
    """Where pictures are written to, too."""

    def add(self, body: bytes) -> int:
        """A new object's number."""
        ...

    def image(self, png: bytes, slopes: Sequence[float]) -> int:
        """A picture's number."""
        ...


@dataclass(frozen=True, slots=True)
class _Style:
    """Inherited properties of an element: paints (None: nothing), line, and the text that the element spells."""

    fill: str | None = None
    stroke: str | None = None
    color: str = "#000"
    width: str = "1"
    cap: str = "butt"
    dash: str = ""
    offset: str = "0"
    join: str = "round"
    miter: str = "4"
    tint: tuple[float, ...] = ()
    even: bool = False
    text: str | None = None


_KEPT = {
    "fill": "fill", "stroke": "stroke", "color": "color", "stroke-width": "width", "stroke-linecap": "cap",
    "stroke-linejoin": "join", "stroke-miterlimit": "miter",
    "stroke-dasharray": "dash", "stroke-dashoffset": "offset", "aria-label": "text",
    "data-drawn": "text",
}  # fmt: skip
_LINES = ("path", "polyline", "polygon", "circle")
_JOINS = {"miter": 0, "round": 1, "bevel": 2}
_CAPS = {"butt": 0, "round": 1, "square": 2}


class PdfPainter:
    """Draws frames, and collects what they share: ``file`` takes it, object ``shared`` names it."""

    def __init__(self, file: Objects, shared: int) -> None:
        self._file, self._shared = file, shared
        self._letters = PdfLetters()
        self._live = True
        self._forms: dict[tuple[str, bool], int] = {}
        self._images: dict[tuple[str, tuple[str, ...]], int] = {}
        self._alphas: dict[str, str] = {}
        self._shadings: dict[str, int] = {}
        self._ids: dict[str, Element] = {}

    def frame(self, film: Film) -> str:
        """The operators of a film's only frame, in its pixels, y down."""
        self._live = film.live
        root = ElementTree.fromstring("".join(svg_document(replace(film, live=False))))
        for each in root.iter():
            each.tag = each.tag.rpartition("}")[2]
        self._ids = {name: each for each in root.iter() if (name := each.get("id")) is not None}
        size = root.get("width", "0"), root.get("height", "0")
        drawn: list[str] = []
        for child in root:
            if child.tag == "rect":
                drawn.append(f"{_paint(child.get('fill', '#000'))} rg 0 0 {size[0]} {size[1]} re f\n")
            elif child.tag == "g":
                style = replace(self._inherited(child, _Style()), text=None)
                inside = "".join(self._drawn(each, style) for each in child)
                drawn.append(f"q {_matrix(child)}1 j\n{inside}Q\n")
        return "".join(drawn)

    def resources(self) -> str:
        """The dictionary of all that was shared."""
        forms = " ".join(f"/X{number} {number} 0 R" for number in (*self._forms.values(), *self._images.values()))
        alphas = " ".join(f"/{name} << /ca {value} /CA {value} >>" for value, name in self._alphas.items())
        fonts = self._letters.written(self._file)
        shadings = " ".join(f"/H{number} {number} 0 R" for number in self._shadings.values())
        shaded = f" /Shading << {shadings} >>" if shadings else ""
        return f"<< /XObject << {forms} >> /ExtGState << {alphas} >> /Font {fonts}{shaded} >>"

    # --- elements

    def _inherited(self, element: Element, style: _Style) -> _Style:
        changed: dict[str, Any] = {field: value for name, field in _KEPT.items() if (value := element.get(name))}
        if not self._live:
            changed.pop("text", None)
        if element.get("fill-rule") == "evenodd":
            changed["even"] = True
        return replace(style, **changed) if changed else style

    def _drawn(self, element: Element, style: _Style) -> str:
        """The operators of an element; "" if nothing of it is seen."""
        opacity = float(element.get("opacity", "1"))
        if element.tag in ("defs", "clipPath") or opacity <= 0.0:
            return ""
        style = self._inherited(element, style)
        match element.tag:
            case "g":
                inside = "".join(self._drawn(child, style) for child in element)
                clip = element.get("clip-path")
                if clip is not None and inside:
                    shapes = self._ids[clip[5:-1]]
                    outline = "".join(part for shape in shapes for part in _path(shape))
                    even = "*" if any(shape.get("clip-rule") == "evenodd" for shape in shapes) else ""
                    inside = f"q {outline}W{even} n\n{inside}Q\n"
            case "use":
                inside = self._used(element, style)
            case _:
                inside = self._outlined(element, style)
        if not inside:
            return ""
        if opacity < 1.0 and element.tag in _LINES and not (_color(style.fill, style) and _color(style.stroke, style)):
            inside = f"/{self._alpha(short(opacity, 4))} gs {inside}"
        elif opacity < 1.0:
            inside = f"/{self._alpha(short(opacity, 4))} gs {self._form(inside, grouped=True)}"
        elif len(inside) > SHARED and element.get("transform") is not None:
            inside = self._form(inside)
        place = _matrix(element)
        return f"q {place}{inside}Q\n" if place or opacity < 1.0 else inside

    def _used(self, element: Element, style: _Style) -> str:
        target = self._ids[element.get("href", "")[1:]]
        if target.tag == "image":
            return self._picture(target, element.get("filter"))
        if style.text is not None:
            return f"{_paint(_color(style.fill, style))} rg q {_matrix(target)}{self._letters.shown(style.text)} Q\n"
        if (tint := element.get("filter")) is not None:
            style = replace(style, tint=tuple(map(float, self._slopes(tint))))
        inside = self._drawn(target, style)
        x = element.get("x", "0")
        return f"q 1 0 0 1 {x} 0 cm {inside}Q\n" if inside and x != "0" else inside

    def _picture(self, element: Element, tint: str | None) -> str:
        slopes = () if tint is None else self._slopes(tint)
        data = element.get("href", "")
        if (data, slopes) not in self._images:
            png = base64.b64decode(data.partition(",")[2])
            self._images[data, slopes] = self._file.image(png, [float(each) for each in slopes])
        width, height = element.get("width"), element.get("height")
        return f"q {width} 0 0 -{height} 0 {height} cm /X{self._images[data, slopes]} Do Q\n"

    def _slopes(self, tint: str) -> tuple[str, ...]:
        """By what a filter multiplies the colours."""
        functions = self._ids[tint[5:-1]].iter()
        return tuple(each.get("slope", "1") for each in functions if each.tag.startswith("feFunc"))

    def _outlined(self, element: Element, style: _Style) -> str:
        fill, stroke = _color(style.fill, style), _color(style.stroke, style)
        if element.tag == "path" and style.text is not None:
            outline = f"{_stroked(style, stroke)}{path_operators(element.get('d', ''))}S\n" if stroke else ""
            return f"{outline}{_paint(fill)} rg {self._letters.shown(style.text)}\n"
        path = "".join(_path(element))
        if not path or not (fill or stroke):
            return ""
        if fill.startswith("url("):  # paths of drawings have a fill or a stroke
            shading = self._shading(self._ids[fill[5:-1]], style.tint)
            return f"q {path}W{'*' if style.even else ''} n\n{shading}Q\n"
        how = ("B" if fill and stroke else "f" if fill else "S") + ("*" if style.even and fill else "")
        painted = f"{_paint(fill, style.tint)} rg " if fill else ""
        drawn = f"{painted}{_stroked(style, stroke) if stroke else ''}{path}{how}\n"
        return (
            f"q {drawn}Q\n" if stroke and (style.dash or style.join != "round") else drawn
        )  # its dashes and joins are its own

    # --- what is shared

    def _shading(self, gradient: Element, tint: tuple[float, ...]) -> str:
        """The operators of a gradient; see ISO 32000-1, 8.7.4.5."""
        stops = [(float(stop.get("offset", "0")), stop.get("stop-color", "#000")) for stop in gradient]
        stops = [(0.0, stops[0][1]), *stops, (1.0, stops[-1][1])]
        pairs = [(a, b) for a, b in pairwise(stops) if b[0] > a[0]] or [((0.0, stops[-1][1]), (1.0, stops[-1][1]))]
        steps = " ".join(
            f"<< /FunctionType 2 /Domain [0 1] /C0 [{_paint(a[1], tint)}] /C1 [{_paint(b[1], tint)}] /N 1 >>"
            for a, b in pairs
        )
        bounds = " ".join(short(b[0], 4) for _, b in pairs[:-1])
        encode = " ".join("0 1" for _ in pairs)
        curve = f"<< /FunctionType 3 /Domain [0 1] /Functions [{steps}] /Bounds [{bounds}] /Encode [{encode}] >>"
        round_one = gradient.tag == "radialGradient"
        keys = ("fx", "fy", "", "cx", "cy", "r") if round_one else ("x1", "y1", "x2", "y2")
        places = " ".join(gradient.get(key, "0") for key in keys)
        shading = f"/ShadingType {3 if round_one else 2} /ColorSpace /DeviceRGB /Coords [{places}] /Extend [true true]"
        body = f"<< {shading} /Function {curve} >>"
        if body not in self._shadings:
            self._shadings[body] = self._file.add(body.encode("ascii"))
        return f"{_matrix(gradient, 'gradientTransform')}/H{self._shadings[body]} sh\n"

    def _form(self, inside: str, *, grouped: bool = False) -> str:
        """Operators that draw a part of the file; ``grouped``: faded as one."""
        if (inside, grouped) not in self._forms:
            group = " /Group << /S /Transparency >>" if grouped else ""
            box = f"/BBox [-{WIDE} -{WIDE} {WIDE} {WIDE}] /Resources {self._shared} 0 R"
            data = inside.encode("ascii")
            self._forms[inside, grouped] = self._file.stream(f"/Type /XObject /Subtype /Form {box}{group}", data)
        return f"/X{self._forms[inside, grouped]} Do "

    def _alpha(self, value: str) -> str:
        return self._alphas.setdefault(value, f"G{len(self._alphas)}")


def _color(paint: str | None, style: _Style) -> str:
    """A paint's colour, or nothing."""
    if paint is None or paint == "none":
        return ""
    return style.color if paint == "currentColor" else paint


def _paint(color: str, tint: tuple[float, ...] = ()) -> str:
    digits = color[1:] if len(color) == 7 else "".join(2 * digit for digit in color[1:])
    shares = [int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4)]
    return " ".join(short(share * factor, 4) for share, factor in zip(shares, tint or (1.0, 1.0, 1.0), strict=True))


def _stroked(style: _Style, color: str) -> str:
    dashes = [float(each) for each in style.dash.split()]
    dash = ""
    if dashes:
        period = sum(dashes) * (1 + len(dashes) % 2)
        phase = float(style.offset) % period if period else 0.0
        dash = f"[{' '.join(short(each, 4) for each in dashes)}] {short(phase, 4)} d " if period else ""
    join = "" if style.join == "round" else f"{_JOINS[style.join]} j {style.miter} M "
    return f"{_paint(color, style.tint)} RG {style.width} w {_CAPS[style.cap]} J {join}{dash}"


def _matrix(element: Element, name: str = "transform") -> str:
    """The operators of an element's transformation."""
    found: list[str] = []
    for kind, inside in re.findall(r"(\w+)\(([^)]*)\)", element.get(name, "")):
        numbers = [float(each) for each in inside.replace(",", " ").split()]
        if kind == "rotate":
            c, s = math.cos(math.radians(numbers[0])), math.sin(math.radians(numbers[0]))
            numbers = [c, s, -s, c, 0.0, 0.0]
        elif kind == "scale":
            numbers = [numbers[0], 0.0, 0.0, numbers[-1], 0.0, 0.0]
        elif kind == "translate":
            numbers = [1.0, 0.0, 0.0, 1.0, *numbers, 0.0][:6]
        elif kind == "scale":
            numbers = [numbers[0], 0.0, 0.0, numbers[-1], 0.0, 0.0]
        found.append(" ".join(short(each, 9) for each in numbers) + " cm ")
    return "".join(found)


def _path(element: Element) -> Iterator[str]:
    match element.tag:
        case "path":
            d = element.get("d", "")
            yield _curves(d) if "C" in d else path_operators(d)
        case "polyline" | "polygon":
            numbers = element.get("points", "").split()
            for place in range(0, len(numbers) - 1, 2):
                yield f"{numbers[place]} {numbers[place + 1]} {'l' if place else 'm'}\n"
            if element.tag == "polygon":
                yield "h\n"
        case "circle":
            x, y, r = (float(element.get(name, "0")) for name in ("cx", "cy", "r"))
            yield from _circle(x, y, r)
        case other:
            raise ValueError(other)


def _curves(path: str) -> str:
    """The operators of a path whose commands are absolute and all written (see `svg_paths.written`)."""
    operators = {"M": "m", "L": "l", "C": "c", "Z": "h"}
    return "".join(
        f"{numbers}{' ' if numbers else ''}{operators[letter]}\n" for letter, numbers in _COMMANDS.findall(path)
    )


_COMMANDS = re.compile("([MLCZ])([^MLCZ]*)")


def _circle(x: float, y: float, r: float) -> Iterator[str]:
    yield f"{short(x + r, 4)} {short(y, 4)} m\n"
    for k in range(8):
        a, b = math.pi / 4.0 * k, math.pi / 4.0 * (k + 1)
        ends = (
            (math.cos(a) - ARC * math.sin(a), math.sin(a) + ARC * math.cos(a)),
            (math.cos(b) + ARC * math.sin(b), math.sin(b) - ARC * math.cos(b)),
            (math.cos(b), math.sin(b)),
        )
        yield " ".join(f"{short(x + r * u, 4)} {short(y + r * v, 4)}" for u, v in ends) + " c\n"
    yield "h\n"
