"""Parts as solids for printing (STL), and the bill of parts."""

from __future__ import annotations

import csv
import io
import math
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import combinations, pairwise
from typing import Any

from movimentum.drawing.figure_outlines import Point
from movimentum.drawing.figures import drawn_points
from movimentum.interop.dxf import library
from movimentum.interop.shapes import Shape
from movimentum.scene.model import Thing
from movimentum.solver.poses import Poses
from movimentum.syntax.printer import float_text
from movimentum.things.kinds.toothed import Toothed

Triangle = tuple[tuple[float, float, float], ...]

FEW = 6
"""Anchors of a part all of whose distances are listed; of one with more, those from each to the next."""


def stl_text(shapes: Iterable[Shape], thickness: float, poses: Poses | None) -> str:
    """The shapes as solids, each ``thickness`` high, one upon the other in the first of ``poses``; without poses each
    in its own frame, from z = 0. A solid is closed, with its triangles counter-clockwise as seen from outside.
    """
    lines: list[str] = []
    for number, shape in enumerate(shapes):
        bottom = 0.0 if poses is None else number * thickness
        name = shape.thing.name
        lines.append(f"solid {name}")
        for triangle in _solid(shape, bottom, bottom + thickness, poses):
            lines += _facet(triangle)
        lines.append(f"endsolid {name}")
    return "\n".join(lines) + "\n"


def _solid(shape: Shape, low: float, high: float, poses: Poses | None) -> list[Triangle]:
    triangulation: Any = library("ezdxf.math.triangulation")
    math_: Any = library("ezdxf.math")

    def placed(point: Point) -> Point:
        if poses is None:
            return point
        x, y = poses.world(shape.thing.number, point)[0].tolist()
        return x, y

    outline = [placed(point) for point in shape.polygon()]
    holes = [[placed(point) for point in ring] for ring in shape.openings()]
    given = [math_.Vec2.list(ring) for ring in (outline, *holes)]
    faces = triangulation.mapbox_earcut_2d(given[0], given[1:])
    found: list[Triangle] = []
    for face in faces:
        a, b, c = ((point.x, point.y) for point in face)
        if (b[0] - a[0]) * (c[1] - a[1]) < (c[0] - a[0]) * (b[1] - a[1]):
            b, c = c, b
        found += [((*a, high), (*b, high), (*c, high)), ((*a, low), (*c, low), (*b, low))]
    for ring in (outline, *holes):
        for a, b in pairwise([*ring, ring[0]]):
            found += [((*a, low), (*b, low), (*b, high)), ((*a, low), (*b, high), (*a, high))]
    return found


def _facet(triangle: Triangle) -> list[str]:
    a, b, c = triangle
    u, v = ([q - p for p, q in zip(a, other, strict=True)] for other in (b, c))
    normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    length = math.hypot(*normal) or 1.0
    corners = [f"vertex {' '.join(float_text(value) for value in corner)}" for corner in triangle]
    head = f"facet normal {' '.join(float_text(value / length) for value in normal)}"
    return [head, "outer loop", *corners, "endloop", "endfacet"]


def bill_of_parts(things: Sequence[Thing]) -> str:
    """A table with a row for each body: its name, its kind, its width, radius or teeth, the distances between its
    anchors, and how many parts are equal to it, itself included. Texts are no parts.
    """
    parts = [thing for thing in things if thing.is_body and thing.kind.word != "label"]
    rows = [(thing.name, thing.kind.word, _size(thing), _lengths(thing)) for thing in parts]
    # which anchor has which name, and which side is up, makes no other part
    keys = [(kind, size, *sorted(length for _, length in lengths)) for _, kind, size, lengths in rows]
    alike = Counter(keys)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["name", "kind", "size", "lengths", "count"])
    for key, (name, kind, size, lengths) in zip(keys, rows, strict=True):
        writer.writerow([name, kind, size, "; ".join(f"{pins} {length}" for pins, length in lengths), alike[key]])
    return stream.getvalue()


def _size(thing: Thing) -> str:
    if isinstance(thing.own, Toothed):
        return f"{thing.own.teeth} teeth of {_number(thing.own.module)}"
    if thing.picture is not None:
        return os.path.basename(thing.picture.image)
    value = thing.look.width if thing.kind.word in ("bar", "plate") else thing.radius
    return "" if value is None else _number(value)


def _lengths(thing: Thing) -> list[tuple[str, str]]:
    drawn = {*drawn_points(thing)}
    anchors = [anchor for anchor in thing.anchors if anchor.local in drawn]
    pairs = combinations(anchors, 2) if len(anchors) <= FEW else pairwise(anchors)
    return [(f"{a.name}-{b.name}", _number(math.dist(a.local, b.local))) for a, b in pairs]


def _number(value: float) -> str:
    return float_text(float(f"{value:.12g}"))
