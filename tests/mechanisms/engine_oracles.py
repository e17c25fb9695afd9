"""Where the gallery's engines and valve gears are, from their dimensions alone.

Slider-cranks are closed forms. The two valve gears contain loops that no closed form opens: each is reduced, by
elimination on paper, to one equation in one unknown, whose zero Brent's method finds to the last bits.
"""

from __future__ import annotations

import numpy as np

from tests.mechanisms.kinematics import (
    Array,
    Columns,
    between,
    body,
    circle_circle,
    ease,
    merge,
    polar,
    root,
    still,
)


def slide(crank: Array, rod: float, y: float) -> Array:
    """The point at ``rod`` from ``crank`` on the level ``y``, to the right of it."""
    rise = y - crank[:, 1]
    return np.stack([crank[:, 0] + np.sqrt((rod - rise) * (rod + rise)), np.full(len(crank), y)], axis=-1)


def slider_crank(t: Array) -> Columns:
    """Crank 45, rod 165; eccentric 14 at 127° ahead, its rod 200 to a spindle 62 higher; axle (110, 150)."""
    angle = 180 * t
    c = still((110, 150), t)
    # x = r cos θ + √(l² - r² sin² θ)
    radians = np.deg2rad(angle)
    h = np.stack([110 + 45 * np.cos(radians) + np.sqrt(165**2 - (45 * np.sin(radians)) ** 2), np.full_like(t, 150)], -1)
    e = c + polar(14, 127 + angle)
    v = slide(e, 200, 212)
    eccentric = tuple(polar(14, 127))
    return merge(
        body("Wheel", {"C": (0, 0), "P": (45, 0), "E": eccentric}, "C", c, angle),
        body("Piston", {"H": (0, 0)}, "H", h, 0),
        body("Valve", {"V": (0, 0)}, "V", v, 0),
        between("Rod", {"A": (0, 0), "B": (165, 0)}, "A", c + polar(45, angle), "B", h),
        between("EccentricRod", {"E": (0, 0), "V": (200, 0)}, "E", e, "V", v),
        {"x": h[:, 0], "y": v[:, 0]},
    )


def oscillating_engine(t: Array) -> Columns:
    """Crank 45 about (200, 300); the rod points to the trunnion (200, 110)."""
    angle = 90 + 180 * t
    c, trunnion = still((200, 300), t), still((200, 110), t)
    p = c + polar(45, angle)
    # tan α = r cos θ / (D + r sin θ), and the law of cosines
    radians = np.deg2rad(angle)
    lean = -np.rad2deg(np.arctan2(45 * np.cos(radians), 190 + 45 * np.sin(radians)))
    return merge(
        body("Wheel", {"C": (0, 0), "P": (45, 0)}, "C", c, angle),
        body("Piston", {"P": (0, 0)}, "P", p, lean),
        body("Cylinder", {"T": (0, 0)}, "T", trunnion, lean),
        {"d": np.sqrt(190**2 + 45**2 + 2 * 190 * 45 * np.sin(radians))},
    )


def coupling_rods(t: Array) -> Columns:
    """Three wheels 150 apart, scaled by 0.65, so the throw is 26; all cranks stay parallel for ever."""
    angle = 60 - 180 * t
    drawn = {"C": (0.0, 0.0), "P": (26.0, 0.0)}
    centers = [still((x, 89.2), t) for x in (130, 280, 430)]
    pins = [c + polar(26, angle) for c in centers]
    rod = {"A": (0.0, 0.0), "B": (150.0, 0.0)}
    rolled = np.stack([-np.pi * 57.2 * t, np.full_like(t, 32)], axis=-1)
    return merge(
        *(body(name, drawn, "C", c, angle) for name, c in zip(("Rear", "Middle", "Front"), centers, strict=True)),
        body("RearRod", rod, "A", pins[0], 0),
        body("FrontRod", rod, "A", pins[1], 0),
        body("Track", {"O": (0, 0)}, "O", rolled, 0),
    )


def scotch_yoke(t: Array) -> Columns:
    """Throw 50 about (260, 110): x = 260 + 50 cos θ exactly."""
    yoke = np.stack([260 + 50 * np.cos(np.pi * t), np.full_like(t, 110)], axis=-1)
    return merge(
        body("Disc", {"C": (0, 0), "P": (50, 0)}, "C", still((260, 110), t), 180 * t),
        body("Yoke", {"O": (0, 0)}, "O", yoke, 0),
    )


def gear_setting(t: Array) -> Array:
    """The reverser in both valve gears: full forward, to mid-gear, there, to full reverse, there, and back."""
    return np.select(
        [t < 1, t < 2, t < 3, t < 4, t < 5],
        [np.ones_like(t), 1 - ease(t - 1), np.zeros_like(t), -ease(t - 3), -np.ones_like(t)],
        2 * ease(t - 5) - 1,
    )


LAP_AND_LEAD = 7.0
"""Walschaerts: 40 · 18.2/104."""


def walschaerts(t: Array, gear: Array | None = None) -> Columns:
    """The whole gear, at times ``t`` with the reverser at ``gear`` (by default as in the script).

    The lever's lean is the one unknown: with it and the crosshead, the union link gives its foot B and the spindle's
    height its pins V and F; the lifter and the radius rod then give J; and D, in line with F and J, must be 175 from K.
    """
    gear = gear_setting(t) if gear is None else gear
    angle = -360 * t
    c = still((100, 130), t)
    p, e = c + polar(40, angle), c + polar(22, angle - 90)
    h = slide(p, 230, 130)
    u = h - np.array([0.0, 36.0])
    trunnion = still((230, 190), t)
    g = circle_circle(e, 122, trunnion, float(np.hypot(10, 60)), -1)
    link_drawn = {"T": (0.0, 0.0), "G": (-10.0, -60.0), "K": (175.0, 0.0)}
    link = between("Link", link_drawn, "T", trunnion, "G", g)
    k = trunnion + polar(175, link["Link.angle"])
    w = still((315, 240), t)
    arm_end = w - polar(45, 30 * gear)
    spindle = 206.8

    def pins(i: int, lean_deg: float) -> tuple[Array, Array, Array]:
        down = polar(1.0, lean_deg - 90)
        foot_y = spindle + 122.2 * down[1]
        foot = np.array([u[i, 0] + np.sqrt(75**2 - (foot_y - u[i, 1]) ** 2), foot_y])
        front = foot - 104 * down
        lifted = circle_circle(front, 135, arm_end[i], 50, +1)
        return foot, front, front + (lifted - front) * (175 / 135)

    lean, b, f, d = np.empty(len(t)), np.empty((len(t), 2)), np.empty((len(t), 2)), np.empty((len(t), 2))
    for i in range(len(t)):
        guess = float(np.rad2deg(np.arcsin(40 * np.cos(np.deg2rad(angle[i])) / 104)))
        lean[i] = root(lambda x, i=i: float(np.hypot(*(pins(i, x)[2] - k[i]))) - 175, guess, 12.0)
        b[i], f[i], d[i] = pins(i, lean[i])
    lever = {"V": (0.0, 0.0), "F": (0.0, -18.2), "B": (0.0, -122.2)}
    v = f + (f - b) * (18.2 / 104)
    return merge(
        link,
        body("Wheel", {"C": (0, 0), "P": (40, 0), "E": (0, -22)}, "C", c, angle),
        between("Rod", {"A": (0, 0), "B": (230, 0)}, "A", p, "B", h),
        body("Piston", {"H": (0, 0), "U": (0, -36)}, "H", h, 0),
        between("EccRod", {"E": (0, 0), "G": (120, 22)}, "E", e, "G", g),
        between("Radius", {"D": (0, 0), "J": (40, 0), "F": (175, 0)}, "D", d, "F", f),
        between("Lifter", {"J": (0, 0), "K": (0, 50)}, "K", arm_end, "J", d + (f - d) * (40 / 175)),
        body("Arm", {"W": (0, 0), "K": (-45, 0)}, "W", w, 30 * gear),
        body("Die", {"O": (0, 0)}, "O", d, 0),
        body("Lever", lever, "V", v, lean),
        between("Union", {"U": (0, 0), "B": (75, 0)}, "U", u, "B", b),
        body("Valve", {"V": (0, 0)}, "V", v, 0),
        {"gear": gear, "x": h[:, 0]},
    )


def stephenson(t: Array, gear: Array | None = None) -> Columns:
    """Two eccentrics 20 at ∓104°, rods 220, a link of half-length 45 and radius 220 on a hanger 80 long.

    The link's tilt is the one unknown: with it, its middle S is 80 from the hanger's upper end and 220 from the forward
    eccentric less the tilted half-link; the backward rod's length is the equation that is left.
    """
    gear = gear_setting(t) if gear is None else gear
    angle = -360 * t
    c, w = still((90, 130), t), still((350, 210), t)
    forward, backward = c + polar(20, angle - 104), c + polar(20, angle + 104)
    hung = w - polar(45, 40 * gear)

    def middle(i: int, tilt_deg: float) -> Array:
        return circle_circle(forward[i] - polar(45, tilt_deg + 90), 220, hung[i], 80, -1)

    tilt, s = np.empty(len(t)), np.empty((len(t), 2))
    for i in range(len(t)):
        # in full gear the near rod's pin hardly moves along the link's chord; the tilt is roughly this
        guess = float(np.rad2deg(-(forward[i, 0] - backward[i, 0]) / 90)) - 7.5 * gear[i]
        tilt[i] = root(
            lambda x, i=i: float(np.hypot(*(middle(i, x) - polar(45, x + 90) - backward[i]))) - 220, guess, 16.0
        )
        s[i] = middle(i, tilt[i])
    a, b = s + polar(45, tilt + 90), s - polar(45, tilt + 90)
    k = s - polar(220, tilt)
    d = slide(k, 220, 130)
    rod = {"E": (0.0, 0.0), "L": (220.0, 0.0)}
    link = {"S": (0.0, 0.0), "A": (0.0, 45.0), "B": (0.0, -45.0), "K": (-220.0, 0.0)}
    axle = {"C": (0.0, 0.0), "F": tuple(polar(20, -104)), "B": tuple(polar(20, 104))}
    return merge(
        body("Axle", axle, "C", c, angle),
        between("Forward", rod, "E", forward, "L", a),
        between("Backward", rod, "E", backward, "L", b),
        body("Link", link, "S", s, tilt),
        between("Hanger", {"S": (0, 0), "H": (0, 80)}, "S", s, "H", hung),
        body("Arm", {"W": (0, 0), "H": (-45, 0)}, "W", w, 40 * gear),
        body("Valve", {"D": (0, 0)}, "D", d, 0),
        {"gear": gear, "x": d[:, 0]},
    )


def wankel(t: Array) -> Columns:
    """The shaft (eccentric 16) turns three times, the rotor (112 to its corners) once; its corners are on an
    epitrochoid, since 120 degrees for the rotor are a whole turn for the shaft.
    """
    shaft, rotor = 540 * t, 180 * t
    axle = still((180, 160), t)
    middle = axle + polar(16, shaft)
    corners: dict[str, tuple[float, float]] = {"C": (0.0, 0.0)}
    for k in range(3):
        x, y = polar(112, 120 * k)
        corners[f"P[{k}]"] = (float(x), float(y))
    return merge(
        body("Axle", {"C": (0, 0), "P": (16, 0)}, "C", axle, shaft),
        body("Shaft", {"C": (0, 0)}, "C", middle, shaft),
        body("Rotor", corners, "C", middle, rotor),
        body("Mark", {"C": (0, 0)}, "C", middle + polar(88, rotor), 0),
    )
