"""Where the gallery's scenes about motion in time are: school physics."""

from __future__ import annotations

import numpy as np

from tests.mechanisms.engine_oracles import slide
from tests.mechanisms.kinematics import Array, Columns, between, body, merge, polar, still


def falling_bar(t: Array) -> Columns:
    """A bar 110 long turns about (310, 220) at 200°/s for 2 s, then flies: s = s₀ + v₀ u - g u²/2 with g = 300."""
    angle = 200 * t
    pinned = np.array([310.0, 220.0]) + polar(55, angle)
    u = np.maximum(t - 2, 0.0)[:, None]
    speed = 55 * np.deg2rad(200)
    release = np.deg2rad(400)
    start = np.array([310 + 55 * np.cos(release), 220 + 55 * np.sin(release)])
    velocity = speed * np.array([-np.sin(release), np.cos(release)])
    thrown = start + velocity * u - np.array([0.0, 150.0]) * u**2
    m = np.where((t < 2)[:, None], pinned, thrown)
    return body("Bar", {"P": (0, 0), "M": (55, 0), "Q": (110, 0)}, "M", m, angle)


def acceleration(t: Array) -> Columns:
    """180°/s² for two seconds, then -180°/s²; crank 55, rod 200, axle (110, 130)."""
    late = t > 2
    u = np.where(late, t - 2, 0.0)
    speed = np.where(late, 360 - 180 * u, 180 * t)
    angle = np.where(late, 360 + 360 * u - 90 * u**2, 90 * t**2)
    c = still((110, 130), t)
    p = c + polar(55, angle)
    o = slide(p, 200, 130)
    return merge(
        body("Wheel", {"C": (0, 0), "P": (55, 0)}, "C", c, angle),
        between("Rod", {"A": (0, 0), "B": (200, 0)}, "A", p, "B", o),
        body("Block", {"L": (-25, 0), "O": (0, 0), "R": (25, 0)}, "O", o, 0),
        {"speed": speed, "acceleration": np.where(t < 2, 180.0, -180.0), "x": o[:, 0]},
    )


def maximum(t: Array) -> Columns:
    """Pins 40 about (150, 110) and (330, 110), turning once and twice; the plate 19 above the higher."""
    left, right = still((150, 110), t), still((330, 110), t)
    p, q = left + polar(40, 180 * t), right + polar(40, 360 * t + 90)
    o = np.stack([np.full_like(t, 240), np.maximum(p[:, 1], q[:, 1]) + 19], axis=-1)
    plate = {"L": (-160, 0), "O": (0, 0), "T": (0, 90), "U": (0, 0), "R": (160, 0)}
    return merge(
        body("Left", {"C": (0, 0), "P": (40, 0)}, "C", left, 180 * t),
        body("Right", {"C": (0, 0), "Q": (40, 0)}, "C", right, 360 * t + 90),
        body("RollP", {"O": (0, 0)}, "O", p, 0),
        body("RollQ", {"O": (0, 0)}, "O", q, 0),
        body("Plate", plate, "O", o, 0),
    )
