"""Repairs a linkage with rounded coordinates: makes lengths equal and angles whole, and fits the coordinates to them.

If a linkage is overdetermined (as every rhombus of a tiling is), rounded coordinates contradict each other by the
amount of the rounding. Such a linkage can be drawn but cannot move.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from movimentum.advice import Advised, Choose
from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.interop.linkages import Linkage, turn
from movimentum.records import dataclass, replace
from movimentum.tolerances import (
    LEAST_DIVISOR,
    NEARLY_EQUAL_LENGTHS,
    REPAIR_RANK,
    REPAIRED,
    SAME_LENGTHS,
    STATED_ANGLE_DEG,
)

NEARLY_WHOLE = 0.5
"""Degrees by which an angle may differ from the multiple that it should be."""


@dataclass(frozen=True, slots=True)
class Snapped:
    """The repaired linkage: its ``degrees`` are whole multiples where possible. ``moved``: how far the farthest vertex
    was moved; ``diagnostics``: what could not be done.
    """

    linkage: Linkage
    moved: float
    diagnostics: tuple[Diagnostic, ...]


def snapped(linkage: Linkage, angle: float = 36.0) -> Snapped:
    """``linkage`` with nearly equal lengths equal and its angles multiples of ``angle`` degrees.

    Coordinates are moved as little as possible: Gauss–Newton steps of least norm from where they are; fixed vertices
    stay.
    """
    found: list[Diagnostic] = []
    lengths = np.array(equalised([linkage.length(rod) for rod in range(len(linkage.rods))]))
    degrees: list[float] = []
    for corner, is_now in zip(linkage.angles, linkage.degrees, strict=True):
        whole = angle * round(is_now / angle)
        if abs(whole - is_now) > NEARLY_WHOLE:
            found.append(
                Diagnostic(
                    "import/angle",
                    Severity.WARNING,
                    f"the angle {corner[0]} {corner[1]} {corner[2]} is {is_now:.6g} degrees, which is not a multiple of"
                    f" {angle:g}: left as it is",
                    helps=(Advised(Choose.SNAP_ANGLE.to(), f" {_divisor(is_now):g} makes it a multiple"),),
                )
            )
            whole = is_now
        degrees.append(-whole if whole <= -180.0 else whole)
    before = np.array(linkage.vertices, dtype=np.float64).reshape(-1, 2)
    after, off = _fitted(linkage, before, lengths, np.radians(degrees))
    if off > REPAIRED * max(float(np.max(lengths, initial=0.0)), LEAST_DIVISOR):
        found.append(
            Diagnostic(
                "import/unrepaired",
                Severity.WARNING,
                f"equal lengths and whole angles contradict each other by {off:.2g}: this is as near as possible",
                helps=(Advised("leave out ", Choose.SNAP.to(), ", or give another ", Choose.SNAP_ANGLE.to()),),
            )
        )
    vertices = tuple((float(x), float(y)) for x, y in after)
    degrees = [
        whole
        if abs((turn(vertices, corner) - whole + 180.0) % 360.0 - 180.0) < STATED_ANGLE_DEG
        else turn(vertices, corner)
        for corner, whole in zip(linkage.angles, degrees, strict=True)
    ]
    moved = float(np.max(np.hypot(*(after - before).T), initial=0.0))
    return Snapped(replace(linkage, vertices=vertices, degrees=tuple(degrees)), moved, tuple(found))


def equalised(lengths: Iterable[float]) -> list[float]:
    """Each length replaced by one for all that are nearly equal: a round number among them, or their mean."""
    values = list(lengths)
    result = values.copy()
    order = sorted(range(len(values)), key=values.__getitem__)
    begin = 0
    for place in range(1, len(order) + 1):
        if (
            place < len(order)
            and values[order[place]] - values[order[place - 1]] <= NEARLY_EQUAL_LENGTHS * values[order[place]]
        ):
            continue
        alike = [values[k] for k in order[begin:place]]
        common = _round_between(alike)
        for k in order[begin:place]:
            result[k] = common
        begin = place
    return result


def _round_between(values: list[float]) -> float:
    """The number with the fewest digits that is as near to the mean as the values are to one another."""
    mean = sum(values) / len(values)
    spread = max(values) - min(values)
    if spread <= SAME_LENGTHS * mean:
        return mean
    for digits in range(1, 17):
        short = float(f"{mean:.{digits}g}")
        if abs(short - mean) <= spread:
            return short
    return mean


def _divisor(degrees: float) -> float:
    """The largest common angle that an angle is nearly a multiple of, else the angle itself."""
    return next(
        (d for d in (90.0, 60.0, 45.0, 36.0, 30.0, 22.5, 18.0, 15.0, 10.0, 5.0, 1.0)
         if abs(degrees - d * round(degrees / d)) <= NEARLY_WHOLE and round(degrees / d)),
        abs(degrees),
    )  # fmt: skip


def _fitted(
    linkage: Linkage, vertices: FloatArray, lengths: FloatArray, radians: FloatArray
) -> tuple[FloatArray, float]:
    """Coordinates (V, 2) that have the ``lengths`` and the angles, and their remaining error (pixels)."""
    rods = np.array(linkage.rods, dtype=np.intp).reshape(-1, 2)
    corners = np.array(linkage.angles, dtype=np.intp).reshape(-1, 3)
    free = np.setdiff1d(np.arange(len(vertices)), linkage.fixed)
    columns = (2 * free[:, None] + np.arange(2)).reshape(-1)
    p = vertices.copy()
    off = np.inf
    best = p
    for _ in range(20):
        residual, jacobian = rows_of(p, rods, corners, lengths, radians)
        worst = float(np.max(np.abs(residual), initial=0.0))
        if worst >= 0.5 * off:
            break
        off, best = worst, p.copy()
        if len(columns) == 0 or worst == 0.0:
            break
        p = p.copy()
        p.reshape(-1)[columns] -= _least_norm(jacobian[:, columns], residual)
    return best, off if np.isfinite(off) else 0.0


def rows_of(
    p: FloatArray, rods: NDArray[np.intp], corners: NDArray[np.intp], lengths: FloatArray, radians: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The errors of rods and angles (in pixels), (M,), and their derivatives by all coordinates, (M, 2 V).

    An angle's row is the sine of its error, times the mean length of its sides: it keeps its rank at 0 and 180 degrees,
    where that of a cosine vanishes.
    """
    count = len(rods)
    residual = np.zeros(count + len(corners))
    jacobian = np.zeros((len(residual), p.size))
    d = p[rods[:, 1]] - p[rods[:, 0]]
    now = np.hypot(d[:, 0], d[:, 1])
    residual[:count] = now - lengths
    unit = d / np.where(now > 0.0, now, 1.0)[:, None]
    for axis in range(2):
        jacobian[np.arange(count), 2 * rods[:, 1] + axis] += unit[:, axis]
        jacobian[np.arange(count), 2 * rods[:, 0] + axis] -= unit[:, axis]
    u, v = p[corners[:, 1]] - p[corners[:, 0]], p[corners[:, 2]] - p[corners[:, 0]]
    size = np.sqrt(np.hypot(u[:, 0], u[:, 1]) * np.hypot(v[:, 0], v[:, 1]))
    size = np.where(size > 0.0, size, 1.0)
    c, s = np.cos(radians), np.sin(radians)
    residual[count:] = (
        (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) * c - (u[:, 0] * v[:, 0] + u[:, 1] * v[:, 1]) * s
    ) / size
    by_u = np.stack([v[:, 1] * c - v[:, 0] * s, -v[:, 0] * c - v[:, 1] * s], axis=1) / size[:, None]
    by_v = np.stack([-u[:, 1] * c - u[:, 0] * s, u[:, 0] * c - u[:, 1] * s], axis=1) / size[:, None]
    rows = count + np.arange(len(corners))
    for axis in range(2):
        jacobian[rows, 2 * corners[:, 1] + axis] += by_u[:, axis]
        jacobian[rows, 2 * corners[:, 2] + axis] += by_v[:, axis]
        jacobian[rows, 2 * corners[:, 0] + axis] -= by_u[:, axis] + by_v[:, axis]
    return residual, jacobian


def _least_norm(jacobian: FloatArray, residual: FloatArray) -> FloatArray:
    """The smallest step with jacobian @ step = residual, as nearly as possible."""
    return np.asarray(np.linalg.lstsq(jacobian, residual, rcond=REPAIR_RANK)[0], dtype=np.float64)
