"""Where a quadratic's two roots meet: change points, to be passed through, and binds, beyond which there is no
solution.

Along a path the root is u = (-b + h) / 2a with h^2 = D, the discriminant. Where D has a zero of order two, h is a
smooth function that passes through zero: the sign of the square root must flip there, else the motion would turn back
on itself. (A parallelogram linkage whose sign does not flip becomes an antiparallelogram.) Where D only comes near
zero, it must not flip. So the branch is decided by the zeros of D, which are located and classified; no extrapolation
is involved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MARGIN_TOLERANCE = 4e-12
"""How far below zero a relative discriminant may come by rounding; nearer to zero than this, two solutions meet."""

SAMPLES = 9
ROUNDS = 16


@dataclass(frozen=True, slots=True)
class Events:
    """``flips``: the times at which the sign changes, ascending. ``gaps``: intervals (from, to) without a solution."""

    flips: tuple[float, ...]
    gaps: tuple[tuple[float, float], ...]


def find_events(margin: Callable[[FloatArray], FloatArray], tau: FloatArray, values: FloatArray) -> Events:
    """Classify the zeros of ``margin`` (the relative discriminant), known as ``values`` at the nodes ``tau``."""
    values = np.where(np.isfinite(values), values, -1.0)
    flips: list[float] = []
    gaps = _gaps(margin, tau, values)
    for low, middle, high in _minima(tau, values):
        kind, place = _refine(margin, low, middle, high)
        if kind == "touch":
            if _passes_through(margin, place, min(place - low, high - place)):
                flips.append(_located(margin, place, min(place - low, high - place)))
        elif kind == "gap":
            left = _crossing(margin, low, place)
            right = _crossing(margin, high, place)
            gaps.append((left, right))
    return Events(tuple(sorted(flips)), tuple(sorted(gaps)))


def _gaps(margin: Callable[[FloatArray], FloatArray], tau: FloatArray, values: FloatArray) -> list[tuple[float, float]]:
    below = values < -MARGIN_TOLERANCE
    gaps: list[tuple[float, float]] = []
    i = 0
    while i < len(tau):
        if not below[i]:
            i += 1
            continue
        j = i
        while j + 1 < len(tau) and below[j + 1]:
            j += 1
        left = tau[i] if i == 0 else _crossing(margin, tau[i - 1], tau[i])
        right = tau[j] if j == len(tau) - 1 else _crossing(margin, tau[j + 1], tau[j])
        gaps.append((float(left), float(right)))
        i = j + 1
    return gaps


def _minima(tau: FloatArray, values: FloatArray) -> list[tuple[float, float, float]]:
    """Brackets of local minima that may reach zero between nodes."""
    n = len(tau)
    if n < 2:
        return []
    result: list[tuple[float, float, float]] = []
    v = values
    if n >= 3:
        left, middle, right = v[:-2], v[1:-1], v[2:]
        # a minimum, far enough below a neighbour or near enough to zero to be worth a closer look;
        # a flat run at zero (a mechanism at rest in its dead centre) is none
        low = (middle <= left) & (middle <= right) & (middle > -MARGIN_TOLERANCE)
        worth = (middle < 0.5 * np.maximum(left, right)) | (middle < 0.02)
        flat = np.maximum(left, right) <= MARGIN_TOLERANCE
        for i in np.nonzero(low & worth & ~flat)[0]:
            if middle[i] == left[i] and i > 0 and v[i - 1] >= left[i] and left[i] <= MARGIN_TOLERANCE:
                continue  # the second of two equal nodes
            result.append((float(tau[i]), float(tau[i + 1]), float(tau[i + 2])))
    # a dip inside the first or last interval, seen from its end only
    if -MARGIN_TOLERANCE < v[0] < 0.25 * v[1] and v[0] > MARGIN_TOLERANCE:
        result.append((float(tau[0]), float(0.75 * tau[0] + 0.25 * tau[1]), float(tau[1])))
    if n >= 2 and MARGIN_TOLERANCE < v[-1] < 0.25 * v[-2]:
        result.append((float(tau[-2]), float(0.75 * tau[-1] + 0.25 * tau[-2]), float(tau[-1])))
    return result


def _refine(margin: Callable[[FloatArray], FloatArray], low: float, middle: float, high: float) -> tuple[str, float]:
    """Close in on a minimum: "touch" (zero), "gap" (below zero) or "clear" (above), with its place."""
    a, b = low, high
    place = middle
    for _ in range(ROUNDS):
        points = np.linspace(a, b, SAMPLES + 2)
        values = margin(points)
        values = np.where(np.isfinite(values), values, -1.0)
        i = int(np.argmin(values))
        place = float(points[i])
        if values[i] < -MARGIN_TOLERANCE:
            return "gap", place
        left, right = max(i - 1, 0), min(i + 1, len(points) - 1)
        bend = (
            abs(values[left] - 2.0 * values[i] + values[right])
            if 0 < i < len(points) - 1
            else abs(values[left] - values[right])
        )
        if values[i] > 10.0 * max(bend, MARGIN_TOLERANCE):
            return "clear", place
        if bend < 0.1 * MARGIN_TOLERANCE:
            return ("touch" if values[i] <= MARGIN_TOLERANCE else "clear"), place
        a, b = float(points[left]), float(points[right])
    return ("touch" if margin(np.array([place]))[0] <= MARGIN_TOLERANCE else "clear"), place


def _passes_through(margin: Callable[[FloatArray], FloatArray], place: float, width: float) -> bool:
    """Whether the zero's order is 2, 6, …: h = sqrt(D) then changes sign."""
    if width <= 0.0:
        return False
    w = width / 16.0
    values = margin(np.array([place - w, place - w / 2, place + w / 2, place + w]))
    with np.errstate(all="ignore"):
        orders = np.log2(np.array([values[0] / values[1], values[3] / values[2]]))
    orders = orders[np.isfinite(orders)]
    if len(orders) == 0:
        return False
    return round(float(np.mean(orders)) / 2.0) % 2 == 1


def _located(margin: Callable[[FloatArray], FloatArray], place: float, width: float) -> float:
    """The zero of h, far more accurately than D's minimum shows it: h is smooth, so a cubic through four signed values
    of it.
    """
    w = width / 16.0
    x = np.array([-1.0, -0.5, 0.5, 1.0])
    h = np.sign(x) * np.sqrt(np.maximum(margin(place + w * x), 0.0))
    coefficients = np.linalg.solve(np.stack([np.ones(4), x, x**2, x**3], axis=-1), h)
    root = 0.0
    for _ in range(8):
        slope = coefficients[1] + root * (2 * coefficients[2] + 3 * coefficients[3] * root)
        value = coefficients[0] + root * (coefficients[1] + root * (coefficients[2] + root * coefficients[3]))
        if slope == 0.0:
            break
        root -= value / slope
    return place + w * root if abs(root) < 0.5 else place


def _crossing(margin: Callable[[FloatArray], FloatArray], good: float, bad: float) -> float:
    """The time between ``good`` (solvable) and ``bad`` at which the solution ends, by repeated sectioning."""
    for _ in range(18):
        points = np.linspace(good, bad, SAMPLES + 2)
        values = margin(points)
        below = np.nonzero(~(values >= -MARGIN_TOLERANCE))[0]
        first = int(below[0]) if len(below) else len(points) - 1
        if first == 0:
            return float(good)
        good, bad = float(points[first - 1]), float(points[first])
        if abs(bad - good) <= 1e-15 * max(abs(good), abs(bad)):
            break
    return good
