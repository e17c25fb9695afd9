"""Plain kinematics for the oracles: arrays of points (F, 2), angles in degrees, nothing of Movimentum."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq  # pyright: ignore[reportUnknownVariableType]

Array = NDArray[np.float64]
Columns = dict[str, Array]
Drawn = Mapping[str, tuple[float, float]]


def polar(length: float | Array, degrees: float | Array) -> Array:
    """(…, 2) vectors of ``length`` in direction ``degrees``."""
    angle = np.deg2rad(degrees)
    return np.stack(np.broadcast_arrays(length * np.cos(angle), length * np.sin(angle)), axis=-1)


def turn(vector: Array | tuple[float, float], degrees: float | Array) -> Array:
    """``vector`` turned counter-clockwise by ``degrees``."""
    v = np.asarray(vector, dtype=float)
    angle = np.deg2rad(degrees)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(np.broadcast_arrays(c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1]), axis=-1)


def distance(a: Array, b: Array) -> Array:
    """Distances between points."""
    return np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1])


def circle_circle(a: Array, radius_a: float, b: Array, radius_b: float, side: int) -> Array:
    """The point at ``radius_a`` from a and ``radius_b`` from b, on the left (``side`` +1) of the way from a to b."""
    a, b = np.broadcast_arrays(np.asarray(a, float), np.asarray(b, float))
    d = distance(a, b)
    along = (d**2 + radius_a**2 - radius_b**2) / (2 * d)
    # (r - u)(r + u) instead of r² - u²: half the digits are not lost where the circles nearly touch
    across = side * np.sqrt((radius_a - along) * (radius_a + along))
    unit = (b - a) / d[..., None]
    normal = np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
    return a + along[..., None] * unit + across[..., None] * normal


def direction(a: Array, b: Array) -> Array:
    """The continuous direction from a to b over the frames, in degrees."""
    return np.rad2deg(np.unwrap(np.arctan2(b[..., 1] - a[..., 1], b[..., 0] - a[..., 0])))


def body(name: str, drawn: Drawn, anchor: str, at: Array, angle: float | Array) -> Columns:
    """The table's columns of a rigid body that is turned by ``angle`` degrees and whose ``anchor`` is ``at``."""
    angle = np.broadcast_to(np.asarray(angle, float), at.shape[:-1])
    columns: Columns = {f"{name}.angle": angle}
    for other, (x, y) in drawn.items():
        point = at + turn((x - drawn[anchor][0], y - drawn[anchor][1]), angle)
        columns[f"{name}.{other}.x"], columns[f"{name}.{other}.y"] = point[..., 0], point[..., 1]
    return columns


def between(name: str, drawn: Drawn, first: str, at: Array, second: str, towards: Array) -> Columns:
    """The same for a body that is known by the positions of two of its anchors."""
    dx, dy = drawn[second][0] - drawn[first][0], drawn[second][1] - drawn[first][1]
    angle = direction(at, towards) - np.rad2deg(np.arctan2(dy, dx))
    return body(name, drawn, first, at, angle)


def point(columns: Columns, anchor: str) -> Array:
    """(F, 2) positions of ``Thing.Anchor``."""
    return np.stack([columns[f"{anchor}.x"], columns[f"{anchor}.y"]], axis=-1)


def still(where: tuple[float, float], like: Array) -> Array:
    """A fixed point, once a frame."""
    return np.broadcast_to(np.asarray(where, float), (*like.shape, 2))


def root(function: Callable[[float], float], guess: float, reach: float) -> float:
    """The zero of ``function`` within ``reach`` of ``guess``, to the last bits; there must be exactly one."""
    grid = np.linspace(guess - 0.97 * reach, guess + 1.03 * reach, 9)  # off centre: the guess may be the zero itself
    values = [function(u) for u in grid]
    brackets = [k for k in range(8) if values[k] * values[k + 1] <= 0]
    assert len(brackets) == 1, f"{len(brackets)} sign changes near {guess}"
    k = brackets[0]
    found = brentq(function, float(grid[k]), float(grid[k + 1]), xtol=1e-15, rtol=np.float64(1e-15))
    return float(found)  # pyright: ignore[reportArgumentType]


def ease(u: float | Array) -> Array:
    """The smooth step 3u² - 2u³."""
    v = np.clip(u, 0.0, 1.0)
    return v * v * (3.0 - 2.0 * v)


def merge(*parts: Columns) -> Columns:
    """All columns in one."""
    result: Columns = {}
    for part in parts:
        result.update(part)
    return result
