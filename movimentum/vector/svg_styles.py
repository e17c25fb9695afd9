"""The content of an SVG that is read: shapes as lines and Bézier curves, their styles, and gradients, in pixels."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from xml.etree import ElementTree

from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.rendering.affines import transform_of
from movimentum.rendering.drawings import length_of
from movimentum.rendering.path_data import PathFault, PathPiece, numbers_of, path_pieces
from movimentum.things.colors import color
from movimentum.vector.numbers import hex_color, joined, short

Element = ElementTree.Element

INHERITED = frozenset(
    {
        "fill", "fill-opacity", "fill-rule", "stroke", "stroke-width", "stroke-opacity", "stroke-linecap",
        "stroke-linejoin", "stroke-miterlimit", "stroke-dasharray", "stroke-dashoffset", "color", "visibility",
        "clip-rule", "marker", "marker-start", "marker-mid", "marker-end", "paint-order",
    }
)  # fmt: skip
OWN = frozenset(
    {
        "opacity", "display", "clip-path", "filter", "mask", "mix-blend-mode", "transform", "vector-effect",
        "stop-color", "stop-opacity",
    }
)  # fmt: skip
"""Properties that are not inherited."""
PLAIN = {
    "filter": ("none",), "mask": ("none",), "mix-blend-mode": ("normal",), "vector-effect": ("none",),
    "marker": ("none",), "marker-start": ("none",), "marker-mid": ("none",), "marker-end": ("none",),
    "paint-order": ("normal", "fill", "fill stroke", "fill stroke markers"),
}  # fmt: skip
"""Values of properties that change nothing; any other value is more than outlines can show."""
_SELECTOR = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][A-Za-z_][\w-]*)*)")


class NotPlain(Exception):
    """A drawing has something that outlines cannot show; the message says what."""


class Sheet:
    """The rules of a drawing's style sheets."""

    def __init__(self, root: Element) -> None:
        self._rules: list[tuple[tuple[int, int, int], int, str, list[str], dict[str, str]]] = []
        for style in root.iter("{http://www.w3.org/2000/svg}style"):
            self._read("".join(style.itertext()))
        self._rules.sort(key=lambda rule: rule[:2])

    def _read(self, text: str) -> None:
        text = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
        if "@" in text or "!" in text:
            raise NotPlain("a style sheet with `@` or `!`")
        place = 0
        for match in re.finditer(r"\s*([^{}]*)\{([^{}]*)\}\s*", text):
            if match.start() != place:
                break
            place = match.end()
            for selector in match[1].split(","):
                simple = _SELECTOR.fullmatch(selector.strip())
                if simple is None or not selector.strip():
                    raise NotPlain(f"a style sheet with the selector `{selector.strip()[:40]}`")
                names = re.findall(r"[.#][\w-]+", simple[2])
                ids = sum(name[0] == "#" for name in names)
                weight = (ids, len(names) - ids, int((simple[1] or "*") != "*"))
                self._rules.append((weight, len(self._rules), simple[1] or "*", names, _declared(match[2])))
        if text[place:].strip():
            raise NotPlain("a style sheet that is not understood")

    def of(self, element: Element, tag: str) -> dict[str, str]:
        """All that is said about an element itself."""
        known = {"." + name for name in element.get("class", "").split()} | {"#" + element.get("id", "")}
        found = {name: value.strip() for name, value in element.attrib.items() if name in INHERITED | OWN}
        for _, _, kind, names, said in self._rules:
            if kind in ("*", tag) and known.issuperset(names):
                found |= said
        style = _declared(element.get("style", ""))
        if "transform" in style or any("transform" in said for *_, said in self._rules):
            raise NotPlain("a `transform` in a style")
        return found | style


def _declared(text: str) -> dict[str, str]:
    pairs = (each.partition(":") for each in text.split(";"))
    if "!" in text:
        raise NotPlain("a style with `!`")
    return {name.strip().lower(): value.strip() for name, _, value in pairs if name.strip()}


def inherited(above: dict[str, str], said: dict[str, str]) -> dict[str, str]:
    """The style of an element below another one; `NotPlain` for what outlines cannot show."""
    found = dict(above)
    for name, value in said.items():
        if name in PLAIN and value.lower() not in PLAIN[name]:
            raise NotPlain(f"a `{name}`")
        if name in INHERITED and value != "inherit":
            found[name] = value
    return found


def paint_of(value: str, style: dict[str, str]) -> tuple[tuple[int, int, int], float] | None:
    """(colour, opacity) of a paint; None for no paint."""
    value = value.strip()
    if value.lower() in ("none", "transparent"):
        return None
    if value.lower() == "currentcolor":
        value = style.get("color", "black")
    if value.lower().startswith("url("):
        raise NotPlain("a gradient or a pattern as a line")
    found = color(value)
    if found is not None:
        return found, 1.0
    if (digits := re.fullmatch(r"#([0-9a-fA-F]{4}|[0-9a-fA-F]{8})", value)) is not None:
        text = digits[1] if len(digits[1]) == 8 else "".join(2 * digit for digit in digits[1])
        red, green, blue, alpha = (int(text[k : k + 2], 16) for k in (0, 2, 4, 6))
        return (red, green, blue), alpha / 255.0
    if (match := re.fullmatch(r"rgba?\(([^()]*)\)", value, re.IGNORECASE)) is not None:
        parts, mixed = [*_parts(match[1])], match[1].count("%")
        if len(parts) in (3, 4) and mixed in (0, 1, 3, 4) and (mixed != 1 or match[1].rstrip().endswith("%")):
            red, green, blue = (round(255.0 * min(max(part, 0.0), 1.0)) for part in parts[:3])
            return (red, green, blue), parts[3] if len(parts) == 4 else 1.0
    raise NotPlain(f"the colour `{value[:40]}`")


def _parts(text: str) -> Iterator[float]:
    for place, word in enumerate(re.split(r"[\s,/]+", text.strip())):
        try:
            yield float(word[:-1]) / 100.0 if word.endswith("%") else float(word) / (255.0 if place < 3 else 1.0)
        except ValueError as error:
            raise NotPlain(f"the colour `rgb({text[:40]})`") from error


def share_of(style: dict[str, str], name: str) -> float:
    """An opacity from 0 to 1."""
    text = style.get(name, "1")
    try:
        value = float(text[:-1]) / 100.0 if text.endswith("%") else float(text)
    except ValueError as error:
        raise NotPlain(f"the {name} `{text[:40]}`") from error
    return min(max(value, 0.0), 1.0)


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


ROUND = 4.0 / 3.0 * (math.sqrt(2.0) - 1.0)
"""Of its radius: the handles of a quarter of a circle."""


def outline_of(element: Element, tag: str) -> list[PathPiece] | None:
    """The outline of a shape in its own coordinates; None if it is not understood. What is not drawn is empty."""
    try:
        return _outline(element, tag)
    except PathFault:
        return None


def _outline(element: Element, tag: str) -> list[PathPiece] | None:
    def value(name: str, default: float = 0.0) -> float:
        text = element.get(name)
        return default if text is None or text.strip() == "auto" else length_of(text)

    lengths = ("x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "rx", "ry", "width", "height")
    if any(not math.isfinite(value(name)) for name in lengths):
        return None
    match tag:
        case "path":
            return list(path_pieces(element.get("d", "")))
        case "line":
            return [
                PathPiece("M", (complex(value("x1"), value("y1")),)),
                PathPiece("L", (complex(value("x2"), value("y2")),)),
            ]
        case "polyline" | "polygon":
            numbers = numbers_of(element.get("points", ""))
            pairs = [complex(*pair) for pair in zip(numbers[::2], numbers[1::2], strict=False)]
            found = [PathPiece("L" if k else "M", (point,)) for k, point in enumerate(pairs)]
            return [*found, PathPiece("Z")] if tag == "polygon" and found else found
        case "circle":
            r = value("r")
            return _ellipse(complex(value("cx"), value("cy")), r, r)
        case "ellipse":
            rx, ry = value("rx", math.nan), value("ry", math.nan)
            rx, ry = (ry if math.isnan(rx) else rx), (rx if math.isnan(ry) else ry)
            return _ellipse(complex(value("cx"), value("cy")), rx, ry)
        case "rect":
            rx, ry = value("rx", math.nan), value("ry", math.nan)
            rx, ry = (ry if math.isnan(rx) else rx), (rx if math.isnan(ry) else ry)
            return _rectangle(value("x"), value("y"), value("width"), value("height"), rx, ry)
        case _:
            return None


def _ellipse(c: complex, rx: float, ry: float) -> list[PathPiece]:
    return _rectangle(c.real - rx, c.imag - ry, 2.0 * rx, 2.0 * ry, rx, ry) if rx > 0.0 and ry > 0.0 else []


def _rectangle(x: float, y: float, w: float, h: float, rx: float, ry: float) -> list[PathPiece]:
    if not (w > 0.0 and h > 0.0):
        return []
    rx, ry = min(max(rx, 0.0), w / 2.0), min(max(ry, 0.0), h / 2.0)
    if not (rx > 0.0 and ry > 0.0):
        corners = [complex(x, y), complex(x + w, y), complex(x + w, y + h), complex(x, y + h)]
        return [*(PathPiece("L" if k else "M", (corner,)) for k, corner in enumerate(corners)), PathPiece("Z")]
    found = [PathPiece("M", (complex(x + rx, y),))]
    corners = [complex(x + w, y), complex(x + w, y + h), complex(x, y + h), complex(x, y)]
    for corner, way in zip(corners, (1 + 0j, 1j, -1 + 0j, -1j), strict=True):
        turn = way * 1j
        before = corner - complex(way.real * rx, way.imag * ry)
        after = corner + complex(turn.real * rx, turn.imag * ry)
        found += [
            PathPiece("L", (before,)),
            PathPiece("C", (before + ROUND * (corner - before), after + ROUND * (corner - after), after)),
        ]
    return [*found, PathPiece("Z")]


def moved(outline: Sequence[PathPiece], place: Affine) -> list[PathPiece]:
    """An outline under a map."""
    return [
        PathPiece(each.command, tuple(complex(*place.apply(point.real, point.imag)) for point in each.points))
        for each in outline
    ]


def reach(outline: Sequence[PathPiece]) -> tuple[float, float, float, float]:
    """(left, top, right, bottom) around an outline and its handles."""
    points = [point for each in outline for point in each.points]
    xs, ys = [point.real for point in points], [point.imag for point in points]
    return min(xs), min(ys), max(xs), max(ys)


def box(outline: Sequence[PathPiece]) -> tuple[float, float, float, float]:
    """(left, top, right, bottom) of an outline itself, to a thousandth of its curves."""
    points: list[complex] = []
    for each in outline:
        if each.command == "C":
            a, (b, c, d) = points[-1], each.points
            shares = (k / 32.0 for k in range(1, 32))
            points += [(1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t * t * (1 - t) * c + t**3 * d for t in shares]
        points += each.points[-1:]
    xs, ys = [point.real for point in points], [point.imag for point in points]
    return min(xs), min(ys), max(xs), max(ys)


def written(outline: Sequence[PathPiece], decimals: int) -> str:
    """An outline as the ``d`` of a path: absolute, each command with its letter."""
    return "".join(
        each.command
        + joined(*(value for point in each.points for value in (point.real, point.imag)), decimals=decimals)
        for each in outline
    )
