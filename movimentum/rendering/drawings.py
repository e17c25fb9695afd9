"""SVG drawings as pictures: read defensively, reduced to one element, and refused if they are more than a drawing.

A drawing may be hostile. Entities, scripts, references to anything outside the file, and too many elements (including
elements that use each other) are diagnostics, before anything is drawn. The drawing itself is in `rasters`.
"""

from __future__ import annotations

import base64
import binascii
import copy
import io
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from xml.parsers import expat

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.rendering.affines import transform_of
from movimentum.source import drawing_file
from movimentum.tolerances import PART_OF_A_PIXEL, SAME_SCALE

MOST_BYTES = 16_000_000
MOST_ELEMENTS = 50_000
"""Elements of a drawing, counted as often as others use them."""
MOST_LEVELS = 200
MOST_SIDE = 20_000
"""Pixels of a drawing's width and height."""
MOST_OCTAVES = 12
_SVG = "{http://www.w3.org/2000/svg}"
_HREFS = ("href", "{http://www.w3.org/1999/xlink}href")
_UNITS = {"": 1.0, "px": 1.0, "pt": 4 / 3, "pc": 16.0, "in": 96.0, "cm": 96 / 2.54, "mm": 96 / 25.4, "q": 96 / 101.6}
_URL = re.compile(r"url\(\s*['\"]?\s*([^)'\"\s]*)", re.IGNORECASE)
_DATA = re.compile(r"data:image/(?:png|jpeg|jpg|gif|webp);base64,", re.IGNORECASE)
_BEHIND = frozenset({"defs", "style", "title", "desc", "metadata"})


@dataclass(frozen=True, slots=True, eq=False)
class Drawing2D:
    """A drawing that may be drawn: its ``root``, what is above each element, elements by id, and its size in pixels."""

    path: str
    root: ET.Element
    above: dict[ET.Element, ET.Element]
    ids: dict[str, ET.Element]
    width: float
    height: float

    @property
    def pixels(self) -> tuple[int, int]:
        """(width, height) in whole pixels."""
        return max(1, math.ceil(self.width - PART_OF_A_PIXEL)), max(1, math.ceil(self.height - PART_OF_A_PIXEL))


def id_of(path: str) -> str | None:
    """The element that a picture's path names, if it names one."""
    file = drawing_file(path)
    return None if file == path else path[len(file) + 1 :]


def drawing(path: str) -> Drawing2D:
    """The drawing of a picture's path; `ScriptError` with what is wrong with it or with the element that it names."""
    file = drawing_file(path)
    try:
        status = Path(file).stat()
    except FileNotFoundError as error:
        raise fault("asset/missing", f"there is no file `{file}`") from error
    except OSError as error:
        raise fault("asset/unreadable", f"`{file}` cannot be read: {error.strerror}") from error
    if not Path(file).is_file():
        raise fault("asset/unreadable", f"`{file}` is not a regular file")
    if status.st_size > MOST_BYTES:
        message = f"the drawing `{file}` is too large: {status.st_size:,} bytes; the limit is {MOST_BYTES:,}"
        raise fault("limit/drawing", message, "make it smaller, or draw it as PNG")
    made = _read(file, status.st_mtime_ns, status.st_size)
    name = id_of(path)
    if name is not None:
        element_of(made, name)
    return made


def element_of(made: Drawing2D, name: str) -> ET.Element:
    """The element with an id; `ScriptError` if there is none."""
    found = made.ids.get(name)
    if found is None:
        from difflib import get_close_matches

        near = get_close_matches(name, made.ids, 1) or list(made.ids)[:6]
        helps = (f"did you mean `#{near[0]}`?",) if len(near) == 1 else ()
        helps = helps or (
            (f"it has {', '.join(f'`#{each}`' for each in near)}",) if near else ("it has no ids at all",)
        )
        raise fault("asset/element", f"`{Path(made.path).name}` has no element `#{name}`", *helps)
    return found


def fault(code: str, message: str, *helps: str) -> ScriptError:
    """An error in a drawing."""
    return ScriptError([Diagnostic(code, Severity.ERROR, message, helps=helps)])


# --- reading --------------------------------------------------------------------------------------


@lru_cache(maxsize=32)
def _read(file: str, changed: int, size: int) -> Drawing2D:
    del changed, size  # another file of that name
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        raise fault("asset/unreadable", f"`{file}` cannot be read: {error.strerror}") from error
    _look_through(file, data)
    root = ET.fromstring(data)
    if _tag(root) != "svg":
        raise fault("asset/unreadable", f"`{file}` is not an SVG: it begins with `<{_tag(root)}>`")
    above = {child: parent for parent in root.iter() for child in parent}
    ids: dict[str, ET.Element] = {}
    for element in root.iter():
        if "id" in element.attrib:
            ids.setdefault(element.attrib["id"], element)
        _check(file, element)
    _check_uses(file, root, ids)
    return Drawing2D(file, root, above, ids, *_size(file, root))


def _look_through(file: str, data: bytes) -> None:
    """Refuse what a parser must not even take in: entities, too many or too deeply nested elements."""
    count = level = 0

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal count, level
        count, level = count + 1, level + 1
        if count > MOST_ELEMENTS:
            raise _too_many(file)
        if level > MOST_LEVELS:
            raise fault("limit/drawing", f"`{file}` is nested deeper than {MOST_LEVELS} elements")

    def end(name: str) -> None:
        nonlocal level
        level -= 1

    def entity(*about: object) -> None:
        raise fault("asset/unsafe", f"`{file}` declares entities, which are not read", "save it as a plain SVG")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise fault("asset/unreadable", f"`{file}` is not an SVG: {error}") from error
    except ValueError as error:  # an unknown encoding
        raise fault("asset/unreadable", f"`{file}` cannot be read: {error}") from error


def _too_many(file: str) -> ScriptError:
    message = f"`{file}` draws more than {MOST_ELEMENTS:,} elements"
    return fault("limit/drawing", message, "join paths, or draw it as PNG")


def _tag(element: ET.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _check(file: str, element: ET.Element) -> None:
    """Refuse an element that acts, or that refers to anything outside the file."""
    tag = _tag(element)
    if tag == "script" or any(name.lower().startswith("on") for name in element.attrib):
        raise fault("asset/unsafe", f"`{file}` has a script, which is not run", "save it as a plain SVG")
    texts = [element.text or ""] if tag == "style" else []
    for name, value in element.attrib.items():
        if name in _HREFS and tag != "a":
            _check_reference(file, tag, value.strip())
        texts.append(value)
    for text in texts:
        if "@import" in text.lower():
            raise _outside(file, "@import")
        for match in _URL.finditer(text):
            _check_reference(file, tag, match[1])
    if tag == "feTurbulence" and _number(element.get("numOctaves", "1")) > MOST_OCTAVES:
        raise fault("limit/drawing", f"`{file}` has a turbulence of more than {MOST_OCTAVES} octaves")


def _check_reference(file: str, tag: str, value: str) -> None:
    if not value or value.startswith("#"):
        return
    if not _DATA.match(value):
        raise _outside(file, value)
    from PIL import Image

    from movimentum.drawing.picture_options import MAX_SPRITE_PIXELS

    try:
        with Image.open(io.BytesIO(base64.b64decode(value.partition(",")[2]))) as image:
            width, height = image.size
    except (OSError, ValueError, binascii.Error, Image.DecompressionBombError) as error:
        raise fault("asset/unreadable", f"a picture in `{file}` cannot be read") from error
    if width * height > MAX_SPRITE_PIXELS:
        raise fault("limit/pixels", f"a picture in `{file}` is too large: {width} x {height}")


def _outside(file: str, value: str) -> ScriptError:
    shown = value if len(value) < 60 else f"{value[:57]}…"
    message = f"`{file}` refers to `{shown}`, which is outside it and is not read"
    return fault("asset/unsafe", message, "embed it in the drawing")


def _check_uses(file: str, root: ET.Element, ids: dict[str, ET.Element]) -> None:
    """Refuse drawings whose elements use each other so often that too much would be drawn, or for ever."""
    costs: dict[ET.Element, int] = {}
    active: set[ET.Element] = set()
    everywhere = [ids[name] for style in root.iter(f"{_SVG}style") for name in _names(style.text or "") if name in ids]
    stack: list[tuple[ET.Element, bool]] = [(root, False)]
    while stack:
        element, done = stack.pop()
        needs = [*element, *_used(element, ids), *(everywhere if len(element) == 0 else ())]
        if done:
            active.discard(element)
            costs[element] = 1 + sum(costs.get(each, 0) for each in needs)
            if costs[element] > MOST_ELEMENTS:
                raise _too_many(file)
            continue
        if element in costs or element in active:
            continue
        active.add(element)
        stack.append((element, True))
        for each in needs:
            if each in active and each not in everywhere:
                raise fault("asset/unsafe", f"`{file}` has an element that uses itself", "save it as a plain SVG")
            if each not in costs:
                stack.append((each, False))


def _used(element: ET.Element, ids: dict[str, ET.Element]) -> Iterator[ET.Element]:
    if _tag(element) in ("a", "animate", "animateTransform", "animateMotion", "set"):
        return
    for name, value in element.attrib.items():
        for used in [value.strip()[1:]] if name in _HREFS and value.strip().startswith("#") else _names(value):
            if used in ids:
                yield ids[used]


def _names(text: str) -> list[str]:
    return [match[1][1:] for match in _URL.finditer(text) if match[1].startswith("#")]


# --- sizes ----------------------------------------------------------------------------------------


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _length(text: str | None) -> float | None:
    match = re.fullmatch(r"\s*([-+0-9.eE]+?)\s*([a-zA-Z]*)\s*", text or "")
    if match is None or match[2].lower() not in _UNITS:
        return None
    value = _number(match[1]) * _UNITS[match[2].lower()]
    return value if value > 0.0 else None


def length_of(text: str) -> float:
    """A length in pixels; nan for what depends on something else (a percentage) or is none."""
    match = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*)\s*", text)
    unit = None if match is None else _UNITS.get(match[2].lower())
    return math.nan if match is None or unit is None else float(match[1]) * unit


def view_box(root: ET.Element) -> tuple[float, float, float, float] | None:
    """The rectangle that an SVG shows, if it says so."""
    numbers = [_number(part) for part in re.split(r"[\s,]+", (root.get("viewBox") or "").strip())]
    if len(numbers) != 4 or not all(map(math.isfinite, numbers)) or min(numbers[2:]) <= 0.0:
        return None
    return numbers[0], numbers[1], numbers[2], numbers[3]


def _size(file: str, root: ET.Element) -> tuple[float, float]:
    box = view_box(root)
    width, height = _length(root.get("width")), _length(root.get("height"))
    if box is not None:
        width = width or (box[2] if height is None else height * box[2] / box[3])
        height = height or width * box[3] / box[2]
    if width is None or height is None:
        raise fault(
            "asset/unreadable", f"`{file}` does not say how large it is", "give it a `width`, a `height`, a `viewBox`"
        )
    if not max(width, height) <= MOST_SIDE:
        message = f"the drawing `{file}` is too large: {width:,.0f} x {height:,.0f} pixels"
        raise fault("limit/pixels", message, f"at most {MOST_SIDE:,} each way; change its `width` and `height`")
    return width, height


# --- one element ----------------------------------------------------------------------------------


def cut(made: Drawing2D, name: str | None, width: int, height: int) -> str:
    """The text of an SVG, ``width`` by ``height`` pixels, of the drawing or of only the element called ``name``.

    What is not above or inside that element only stays where others can use it.
    """
    root = copy.deepcopy(made.root)
    if name is not None:
        above = {child: parent for parent in root.iter() for child in parent}
        kept = next(element for element in root.iter() if element.get("id") == name)
        while kept in above:
            parent = above[kept]
            for place, child in enumerate(list(parent)):
                if child is not kept and _tag(child) not in _BEHIND:
                    aside = ET.Element(f"{_SVG}defs")
                    aside.append(child)
                    parent[place] = aside
            kept = parent
    inner_width, inner_height = made.pixels
    root.set("width", repr(made.width))
    root.set("height", repr(made.height))
    box = {"viewBox": f"0 0 {inner_width} {inner_height}", "preserveAspectRatio": "none"}
    sheet = ET.Element(f"{_SVG}svg", {"width": str(width), "height": str(height), **box})
    sheet.append(root)
    return ET.tostring(sheet, encoding="unicode")


def tag_of(element: ET.Element) -> str:
    """An element's word, such as ``path``."""
    return _tag(element)


def number_of(element: ET.Element, name: str) -> float:
    """A length that an attribute states; 0 without it."""
    return (_length(element.get(name)) or _number(element.get(name) or "0")) if element.get(name) else 0.0


def centre_by_shape(made: Drawing2D, element: ET.Element) -> tuple[float, float] | None:
    """The centre of a circle, an ellipse, a rectangle or a line in the drawing's pixels, y down; None where its shape
    or what is around it does not tell.
    """

    def value(name: str) -> float:
        return number_of(element, name)

    match _tag(element):
        case "circle" | "ellipse":
            point = value("cx"), value("cy")
        case "rect":
            point = value("x") + value("width") / 2.0, value("y") + value("height") / 2.0
        case "line":
            point = (value("x1") + value("x2")) / 2.0, (value("y1") + value("y2")) / 2.0
        case _:
            return None
    place = placed(made, element)
    point = None if place is None else place(*point)
    return point if point is not None and all(map(math.isfinite, point)) else None


def placed(made: Drawing2D, element: ET.Element) -> Callable[[float, float], tuple[float, float]] | None:
    """From an element's own coordinates to the drawing's pixels, y down; None where what is around it does not tell."""
    found = Affine(1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    here: ET.Element | None = element
    while here is not None and here is not made.root:
        place = transform_of(here.get("transform") or "")
        if place is None or "transform" in (here.get("style") or "") or _tag(here) not in ("g", "a", _tag(element)):
            return None
        found = place @ found
        here = made.above.get(here)
    box = view_box(made.root)
    if any("transform" in (style.text or "") for style in made.root.iter(f"{_SVG}style")) or made.root.get("transform"):
        return None
    if box is None:
        return found.apply
    wide, high = made.width / box[2], made.height / box[3]
    if abs(wide - high) > SAME_SCALE * wide and (made.root.get("preserveAspectRatio") or "").strip() not in (
        "",
        "xMidYMid",
    ):
        return None
    unit = min(wide, high)
    x, y = (made.width - unit * box[2]) / 2.0, (made.height - unit * box[3]) / 2.0
    return (Affine(unit, 0.0, x - unit * box[0], 0.0, unit, y - unit * box[1]) @ found).apply
