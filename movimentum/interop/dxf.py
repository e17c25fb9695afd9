"""Drawings in DXF, by the library ezdxf (extra ``dxf``): exports parts with holes, and imports layers of lines."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable
from importlib import import_module
from typing import Any

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.figure_outlines import Point
from movimentum.errors import ScriptError, usage_error
from movimentum.geometry import hull
from movimentum.interop.shapes import Shape, rounded
from movimentum.records import dataclass, field
from movimentum.solver.poses import Poses
from movimentum.source import SourceText
from movimentum.syntax.printer import float_text
from movimentum.tolerances import SAME_PLACE_OF_DRAWING

MILLIMETRES = 4
DIGITS = 12
"""Significant digits that are taken from a file: what is beyond them is rounding."""


def library(name: str = "ezdxf") -> Any:
    """ezdxf, or a module of it; `UsageError` (``usage/extra``) where it is not installed."""
    try:
        return import_module(name)
    except ImportError as problem:
        message = "DXF and STL need ezdxf, which is not installed"
        raise usage_error("usage/extra", message, "pip install 'movimentum[dxf]'") from problem


def dxf_text(shapes: Iterable[Shape], poses: Poses) -> str:
    """The shapes in the first of ``poses``: a layer for each thing, one pixel a millimetre; the same each time."""
    ezdxf = library()
    fixed = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True  # no date, no random name
    try:
        document = ezdxf.new("R2010", units=MILLIMETRES)
        space = document.modelspace()
        for shape in shapes:
            layer = layer_name(shape.thing.name)
            if layer not in document.layers:
                document.layers.add(layer)
            at = {"layer": layer}

            def world(point: Point, body: int = shape.thing.number) -> Point:
                x, y = poses.world(body, point)[0].tolist()
                return _clean(x), _clean(y)

            if shape.circle is not None:
                space.add_circle(world(shape.circle[0]), shape.circle[1], dxfattribs=at)
            else:
                corners = [(*world((x, y)), bulge) for x, y, bulge in shape.corners]
                space.add_lwpolyline(corners, format="xyb", close=True, dxfattribs=at)
            for window in shape.windows:
                corners = [(*world((x, y)), bulge) for x, y, bulge in window]
                space.add_lwpolyline(corners, format="xyb", close=True, dxfattribs=at)
            for centre, radius in shape.holes:
                space.add_circle(world(centre), radius, dxfattribs=at)
        stream = io.StringIO()
        document.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = fixed
    return stream.getvalue()


def layer_name(name: str) -> str:
    """A thing's name as a layer's: some signs are not allowed there."""
    return re.sub(r"[<>/\\\":;?*|=`,\[\]]", "_", name).rstrip("_")


def _clean(value: float) -> float:
    """Without the last digits, which are rounding."""
    return float(f"{value:.13g}") + 0.0


@dataclass(slots=True)
class _Layer:
    """The contents of a layer: lines (open or closed) with the radius of their arcs, and circles."""

    lines: list[tuple[list[Point], bool, float]] = field(default_factory=list[tuple[list[Point], bool, float]])
    circles: list[tuple[Point, float]] = field(default_factory=list[tuple[Point, float]])


def dxf_script(source: SourceText, title: str) -> tuple[str, tuple[Diagnostic, ...]]:
    """The script of a drawing, and warnings about what it leaves out: an open line is a bar, a closed one with circles
    a plate with an anchor in each, any other closed one a polygon, a circle alone a disc. Anchors at one place are
    joined, and what is on a layer called ground, frame or base stands still. `ScriptError` if there is nothing.
    """
    ezdxf = library()
    try:
        space = ezdxf.read(io.StringIO(source.text)).modelspace()
    except (ezdxf.DXFError, ValueError, KeyError, IndexError, TypeError, AttributeError, AssertionError) as problem:
        message = f"{source.path} is not a whole DXF file: {problem}"
        helps = ("save it again as DXF (text, R2000 or later)",)
        raise ScriptError([Diagnostic("import/dxf", Severity.ERROR, message, helps=helps)]) from problem
    layers: dict[str, _Layer] = {}
    skipped: dict[str, int] = {}
    for entity in space:
        drawn = layers.setdefault(str(entity.dxf.layer), _Layer())
        if not _take(entity, drawn):
            skipped[entity.dxftype()] = skipped.get(entity.dxftype(), 0) + 1
    things = _things(layers)
    if not things:
        message = f"{source.path} has no lines, polylines or circles in its model space"
        raise ScriptError([Diagnostic("import/dxf", Severity.ERROR, message)])
    messages = [f"{count} × {kind}: a script has no counterpart" for kind, count in sorted(skipped.items())]
    messages += [f"`{thing.name}`: {thing.lost}" for thing in things if thing.lost]
    return _script(things, title), tuple(Diagnostic("import/left-out", Severity.WARNING, each) for each in messages)


def _take(entity: Any, drawn: _Layer) -> bool:
    match entity.dxftype():
        case "LINE":
            drawn.lines.append(([_point(entity.dxf.start), _point(entity.dxf.end)], False, 0.0))
        case "LWPOLYLINE":
            rows = [(row[0], row[1], row[2]) for row in entity.get_points("xyb")]
            _polyline(rows, bool(entity.closed), drawn)
        case "POLYLINE" if entity.is_2d_polyline:
            rows = [(*_point(each.dxf.location), float(each.dxf.get("bulge", 0.0))) for each in entity.vertices]
            _polyline(rows, bool(entity.is_closed), drawn)
        case "CIRCLE":
            drawn.circles.append((_point(entity.dxf.center), _short(entity.dxf.radius)))
        case _:
            return False
    return True


def _polyline(rows: list[tuple[float, float, float]], closed: bool, drawn: _Layer) -> None:
    points = [(_short(x), _short(y)) for x, y, _ in rows]
    radii: list[float] = []
    for (x, y, bulge), (u, v, _) in zip(rows, [*rows[1:], rows[0]], strict=True):
        if bulge:
            radii.append(math.hypot(u - x, v - y) * (1.0 + bulge * bulge) / (4.0 * abs(bulge)))
    if len(points) > 2 and points[0] == points[-1]:
        points, closed = points[:-1], True
    if len(points) > 1:
        drawn.lines.append((points, closed, _short(sum(radii) / len(radii)) if radii else 0.0))


def _point(place: Any) -> Point:
    return _short(place.x), _short(place.y)


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}") + 0.0


@dataclass(frozen=True, slots=True)
class _Thing:
    """A thing of the script: the words between its name and its anchors, and the places of these."""

    name: str
    words: str
    places: tuple[Point, ...]
    options: str
    still: bool
    lost: str = ""
    """The features of the drawing that the thing loses."""


def _things(layers: dict[str, _Layer]) -> list[_Thing]:
    found: list[_Thing] = []
    taken: set[str] = set()
    for layer, drawn in layers.items():
        still = layer.lower() in ("ground", "frame", "base")
        circles = list(drawn.circles)
        for points, closed, radius in drawn.lines:
            lost = "its arcs are straight lines" if radius else ""
            centres = (centre for centre, _ in circles if closed and _within(centre, points, radius))
            inside = list(dict.fromkeys(centres))
            if closed and len(inside) > 1:
                places = tuple(inside)
                words = ".bar" if len(hull(places)) == 2 else ".plate"  # a line with round ends
                options = f" .width({float_text(_short(2.0 * radius))})" if radius else ""
                lost = "" if _is_around(points, places, radius) else "it has its circles, but not its outline"
            elif closed and len(points) > 2:
                held = [each for each in inside if each not in points]
                words, places = ".polygon", (*points, *held)
                corners = ", ".join(f"P{k}" for k in range(1, len(points) + 1))
                options = f" .through({corners})" if held else ""
            else:
                words, places, options = ".bar", tuple(points), ""
            pins = {*inside, *places}
            circles = [each for each in circles if each[0] not in pins]
            found.append(_Thing(_named(layer, taken), words, places, options, still, lost))
        alone: dict[Point, float] = {}
        for centre, radius in circles:
            alone[centre] = max(radius, alone.get(centre, 0.0))
        for centre, radius in alone.items():
            words = f".disc({float_text(radius)})"
            found.append(_Thing(_named(layer, taken), words, (centre,), "", still))
    return found


def _is_around(points: list[Point], places: tuple[Point, ...], radius: float) -> bool:
    """Whether an outline is what the film shows of a bar or a plate with these anchors."""
    drawn = rounded(hull(places), radius)
    near = SAME_PLACE_OF_DRAWING * max(1.0, *(abs(value) for point in points for value in point))
    return all(any(math.dist(point, corner[:2]) <= near for corner in drawn) for point in points)


def _within(place: Point, points: list[Point], radius: float) -> bool:
    """Whether a point is inside a polygon, or within ``radius`` of a corner (the ends of a rounded bar)."""
    x, y = place
    inside = False
    for (ax, ay), (bx, by) in zip(points, [*points[1:], points[0]], strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
    return inside or any(math.dist(place, point) <= radius * (1.0 + SAME_PLACE_OF_DRAWING) for point in points)


def _named(layer: str, taken: set[str]) -> str:
    stem = re.sub(r"\W", "_", layer, flags=re.ASCII).strip("_") or "Part"
    stem = stem if stem[0].isalpha() else f"L{stem}"
    name, number = stem, 1
    while name in taken:
        number += 1
        name = f"{stem}_{number}"
    taken.add(name)
    return name


def _script(things: list[_Thing], title: str) -> str:
    size = max((abs(value) for each in things for place in each.places for value in place), default=1.0) or 1.0
    lines = [f"// {title}"]
    first: dict[Point, str] = {}
    joined: list[str] = []
    for thing in things:
        names = ["C"] if thing.words.startswith(".disc") else [f"P{k}" for k in range(1, len(thing.places) + 1)]
        anchors = "  ".join(f"{name} = {_place(place)}" for name, place in zip(names, thing.places, strict=True))
        lines.append(f"{thing.name} : {thing.words}  {anchors}{thing.options};")
        for name, place in zip(names, thing.places, strict=True):
            beside = next((known for known in first if math.dist(known, place) <= SAME_PLACE_OF_DRAWING * size), None)
            if beside is None:
                first[place] = f"{thing.name}.{name}"
            elif not first[beside].startswith(f"{thing.name}."):
                joined.append(f"{first[beside]} = {thing.name}.{name};")
        if thing.still:
            held = list(zip(names, thing.places, strict=True))[:2]
            joined += [f"{thing.name}.{name} = {_place(place)};" for name, place in held[:1]]
            joined.append(f"{thing.name}.angle = 0;")
    return "\n".join([*lines, "@0", *(f"  {line}" for line in joined)]) + "\n"


def _place(place: Point) -> str:
    return f"[{float_text(place[0])}, {float_text(place[1])}]"
