"""Where the things of the gallery's figures are: an antiparallelogram, an engine, perpendiculars, an umbrella."""

from __future__ import annotations

import numpy as np

from tests.mechanisms.kinematics import Array, Columns, between, body, merge, polar, still


def antiparallelogram(t: Array) -> Columns:
    """Base 80 and cranks 150: the figure is its own mirror image in the bisector of the line from A to Q."""
    o, q = still((210, 235), t), still((290, 235), t)
    a = o + polar(150, 60 + 72 * t)
    across = (q - a) / np.linalg.norm(q - a, axis=1)[:, None]
    b = o - 2 * ((o - (a + q) / 2) * across).sum(axis=1)[:, None] * across
    return merge(
        body("Left", {"O": (0, 0), "A": (150, 0)}, "O", o, 60 + 72 * t),
        between("Right", {"Q": (0, 0), "B": (150, 0)}, "Q", q, "B", b),
        between("Link", {"A": (0, 0), "B": (80, 0)}, "A", a, "B", b),
    )


def pressure_volume(t: Array) -> Columns:
    """A slider-crank: crank 42, rod 130, clockwise; and the pressure of the gas, adiabatic but for its burning."""
    o = still((100, 110), t)
    p = o + polar(42, -180 * t)
    x = p[:, 0] + np.sqrt(130**2 - (p[:, 1] - 110) ** 2)
    h = np.stack([x, np.full(len(t), 110.0)], axis=1)
    corners = {"H": (0, 0), "T": (26, 44), "F": (26, -44), "U": (-20, -44), "V": (-20, 44)}
    return merge(
        body("Crank", {"O": (0, 0), "P": (42, 0)}, "O", o, -180 * t),
        between("Rod", {"P": (0, 0), "H": (130, 0)}, "P", p, "H", h),
        body("Piston", corners, "H", h, 0 * t),
    )


def simson_line(t: Array) -> Columns:
    """Projections of a point on a circle of radius 140."""
    m = np.array([230.0, 215.0])
    a, b, c = (m + polar(140, np.full(len(t), degrees)) for degrees in (110.0, 205.0, 330.0))
    p = m + polar(140, 60 + 45 * t)

    def foot(first: Array, second: Array) -> Array:
        along = second - first
        part = ((p - first) * along).sum(axis=1) / (along**2).sum(axis=1)
        return first + part[:, None] * along

    feet = {"FootA": foot(b, c), "FootB": foot(c, a), "FootC": foot(a, b), "Point": p}
    return {
        f"{name}.{'P' if name == 'Point' else 'F'}.{axis}": place[:, k]
        for name, place in feet.items()
        for k, axis in enumerate("xy")
    }


def umbrella(t: Array) -> Columns:
    """Ribs of 190, held at 95 by stretchers of 80 from the runner, which goes from 162 to 262 and back."""
    top = still((220, 330), t)
    part = np.clip(t / 2, 0, 1) - np.clip((t - 2.6) / 2, 0, 1)
    high = 330 - (162 + 100 * part**2 * (3 - 2 * part))
    half = np.arccos((95**2 + high**2 - 80**2) / (2 * 95 * high))
    runner = top - np.stack([0 * high, high], axis=1)
    found: Columns = body("Run", {"U": (0, 0), "L": (0, -18)}, "U", runner, 0 * t)
    for side, name, push in ((1, "Right", "PushR"), (-1, "Left", "PushL")):
        along = np.stack([side * np.sin(half), -np.cos(half)], axis=1)
        held = top + 95 * along
        found |= between(name, {"T": (0, 0), "M": (95 * side, 0), "E": (190 * side, 0)}, "T", top, "M", held)
        found |= between(push, {"U": (0, 0), "M": (80 * side, 0)}, "U", runner, "M", held)
    return found
