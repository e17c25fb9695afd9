"""Where the gallery's bar linkages are, from their dimensions alone: chains of circle intersections in NumPy."""

from __future__ import annotations

import numpy as np

from tests.mechanisms.kinematics import (
    Array,
    Columns,
    between,
    body,
    circle_circle,
    merge,
    polar,
    still,
    turn,
)


def four_bar(t: Array) -> Columns:
    """Crank 50, coupler 150 with P 70 along and 90 across, rocker 130; pivots (130, 110) and (310, 110)."""
    a, d = still((130, 110), t), still((310, 110), t)
    b = a + polar(50, 180 * t)
    c = circle_circle(b, 150, d, 130, +1)
    return merge(
        body("Crank", {"A": (0, 0), "B": (50, 0)}, "A", a, 180 * t),
        between("Coupler", {"B": (0, 0), "P": (70, 90), "C": (150, 0), "Z": (0, 0)}, "B", b, "C", c),
        between("Rocker", {"C": (0, 130), "D": (0, 0)}, "D", d, "C", c),
    )


HOLY = {
    "a": 38.0, "b": 41.5, "c": 39.3, "d": 40.1, "e": 55.8, "f": 39.4, "g": 36.7,
    "h": 65.7, "i": 49.0, "j": 50.0, "k": 61.9, "l": 7.8, "m": 15.0,
}  # fmt: skip


def jansen_points(crank_deg: Array) -> dict[str, Array]:
    """Theo Jansen's leg in his units about the crank's axle, by circle intersections only (no triangle as a body)."""
    n = HOLY
    z = still((-n["a"], -n["l"]), crank_deg)
    p = polar(n["m"], crank_deg)
    r = circle_circle(p, n["j"], z, n["b"], -1)
    u = circle_circle(p, n["k"], z, n["c"], +1)
    s = circle_circle(r, n["e"], z, n["d"], -1)
    v = circle_circle(s, n["f"], u, n["g"], -1)
    w = circle_circle(v, n["h"], u, n["i"], -1)
    return {"P": p, "Z": z, "R": r, "U": u, "S": s, "V": v, "W": w}


def _corner(first: float, second: float, opposite: float) -> float:
    """The angle in degrees between the sides ``first`` and ``second`` of a triangle."""
    return float(np.rad2deg(np.arccos((first**2 + second**2 - opposite**2) / (2 * first * second))))


def jansen(t: Array) -> Columns:
    """The leg at 3 pixels to the unit, axle at (330, 290), half a turn a second, clockwise."""
    points = {name: 3 * p + np.array([330.0, 290.0]) for name, p in jansen_points(-180 * t).items()}
    n = {letter: 3 * length for letter, length in HOLY.items()}
    z, p, r, u, s, v, w = (points[name] for name in "ZPRUSVW")
    top = 105 + _corner(n["b"], n["d"], n["e"])
    low = 180 + _corner(n["g"], n["i"], n["h"])
    upper = {"Z": (0.0, 0.0), "R": tuple(polar(n["b"], 105)), "S": tuple(polar(n["d"], top)), "Z2": (0.0, 0.0)}
    lower = {"U": (0.0, 0.0), "V": tuple(polar(n["g"], 180)), "W": tuple(polar(n["i"], low)), "U2": (0.0, 0.0)}
    # S and W are not taken from the bodies' shapes but from the circles: they must agree
    bde, ghi = between("bde", upper, "Z", z, "R", r), between("ghi", lower, "U", u, "V", v)
    bde["bde.S.x"], bde["bde.S.y"] = s[:, 0], s[:, 1]
    ghi["ghi.W.x"], ghi["ghi.W.y"] = w[:, 0], w[:, 1]
    return merge(
        bde,
        ghi,
        body("m", {"O": (0, 0), "P": (n["m"], 0)}, "O", still((330, 290), t), -180 * t),
        between("j", {"P": (0, 0), "R": (-n["j"], 0)}, "P", p, "R", r),
        between("k", {"P": (0, 0), "U": (-n["k"], 0)}, "P", p, "U", u),
        between("c", {"Z": (0, 0), "U": (0, -n["c"])}, "Z", z, "U", u),
        between("f", {"S": (0, 0), "V": (0, -n["f"])}, "S", s, "V", v),
    )


def peaucellier(t: Array) -> Columns:
    """O (60, 210), Q (130, 210), long bars 200, short bars 80: P from inversion alone, not from the bars."""
    swing = 50 * np.sin(np.pi * t)
    o, q = still((60, 210), t), still((130, 210), t)
    m = q + polar(70, swing)
    # inversion: |OM| |OP| = 200² - 80², P on the ray from O through M
    p = o + (m - o) * ((200**2 - 80**2) / ((m - o) ** 2).sum(axis=-1))[:, None]
    # the rhombus' other diagonal is perpendicular to MP at its middle
    middle = (m + p) / 2
    half = np.sqrt(80**2 - ((p - m) ** 2).sum(axis=-1) / 4)[:, None]
    across = turn((m - o) / np.linalg.norm(m - o, axis=-1)[:, None], 90.0)
    a, b = middle + half * across, middle - half * across
    long_up, long_down = tuple(polar(200, 15)), tuple(polar(200, -15))
    up, down = tuple(polar(80, 45)), tuple(polar(80, -45))
    return merge(
        body("Crank", {"Q": (0, 0), "M": (70, 0)}, "Q", q, swing),
        between("Upper", {"O": (0, 0), "A": long_up}, "O", o, "A", a),
        between("Lower", {"O": (0, 0), "B": long_down}, "O", o, "B", b),
        between("MA", {"M": (0, 0), "A": up}, "M", m, "A", a),
        between("MB", {"M": (0, 0), "B": down}, "M", m, "B", b),
        between("AP", {"A": (0, 0), "P": down}, "A", a, "P", p),
        between("BP", {"B": (0, 0), "P": up}, "B", b, "P", p),
    )


def hoecken(t: Array) -> Columns:
    """Crank 1, frame 2, coupler and rocker 2.5, pen at 5; 50 pixels to the unit, crank's axle at (110, 60)."""
    o, c = still((110, 60), t), still((210, 60), t)
    a = o + polar(50, 180 * t)
    b = circle_circle(a, 125, c, 125, +1)
    return merge(
        body("Crank", {"O": (0, 0), "A": (50, 0)}, "O", o, 180 * t),
        between("Coupler", {"A": (0, 0), "B": (0, 125), "P": (0, 250)}, "A", a, "B", b),
        between("Rocker", {"C": (0, 0), "B": (0, 125)}, "C", c, "B", b),
    )


def watt(t: Array) -> Columns:
    """Rockers 120, coupler 100; pivots (120, 220) and (360, 120); the left rocker swings 32° to either side."""
    swing = 32 * np.sin(np.pi * t)
    a, d = still((120, 220), t), still((360, 120), t)
    b = a + polar(120, swing)
    c = circle_circle(b, 100, d, 120, -1)
    return merge(
        body("Left", {"A": (0, 0), "B": (120, 0)}, "A", a, swing),
        between("Coupler", {"B": (0, 0), "P": (0, -50), "C": (0, -100)}, "B", b, "C", c),
        between("Right", {"C": (0, 0), "D": (120, 0)}, "D", d, "C", c),
    )


def trammel(t: Array) -> Columns:
    """Slides on the axes of the point (200, 200), 70 apart; P 100 beyond the second."""
    angle = 180 * t
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    a = np.stack([np.full_like(t, 200), 200 - 70 * s], axis=-1)
    b = np.stack([200 + 70 * c, np.full_like(t, 200)], axis=-1)
    return merge(
        body("Rod", {"A": (0, 0), "B": (70, 0), "P": (170, 0)}, "A", a, angle),
        body("North", {"O": (0, 0)}, "O", a, 90),
        body("East", {"O": (0, 0)}, "O", b, 0),
    )


def pantograph(t: Array) -> Columns:
    """Four bars of side 100√2; Q is P enlarged twice about O = (60, 70), and the rest follows from that."""
    o = still((60, 70), t)
    p = np.array([220.0, 130.0]) + polar(32 + 11 * np.cos(np.deg2rad(900 * t)), 180 * t)
    q = o + 2 * (p - o)
    side = 100 * np.sqrt(2.0)
    a = circle_circle(o, 2 * side, q, 2 * side, +1)
    b, c = (o + a) / 2, (a + q) / 2
    return merge(
        between("OA", {"O": (0, 0), "B": (100, 100), "A": (200, 200)}, "O", o, "A", a),
        between("AQ", {"A": (0, 0), "C": (100, -100), "Q": (200, -200)}, "A", a, "Q", q),
        between("BP", {"B": (0, 0), "P": (100, -100)}, "B", b, "P", p),
        between("CP", {"C": (0, 0), "P": (-100, -100)}, "C", c, "P", p),
    )
