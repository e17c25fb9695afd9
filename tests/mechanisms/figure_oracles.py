"""Where the things of the gallery's figures are."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from tests.mechanisms.kinematics import (
    Array,
    Columns,
    between,
    body,
    circle_circle,
    direction,
    ease,
    merge,
    polar,
    still,
    turn,
)


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


def axle_path(t: Array) -> Columns:
    """Four bars: chain stay and rocker turn about points of the frame; the pole of the seat stay is on both."""
    m, f = still((276, 142), t), still((274, 226), t)
    angle = 8 * np.cos(np.deg2rad(90 * t + 1.8)) - 8
    h = m + turn((170 - 276, 128 - 142), angle)
    r = circle_circle(h, float(np.hypot(82, 108)), f, float(np.hypot(22, 10)), 1)
    stay = between("Stay", {"H": (170, 128), "X": (150, 140), "R": (252, 236)}, "H", h, "R", r)
    a, b = h - m, r - f
    across = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    part = ((f - m)[:, 0] * b[:, 1] - (f - m)[:, 1] * b[:, 0]) / across
    pole = m + part[:, None] * a
    return merge(
        body("Chain", {"A": (276, 142), "H": (170, 128)}, "A", m, angle),
        stay,
        between("Rocker", {"F": (274, 226), "R": (252, 236), "K": (300, 236)}, "F", f, "R", r),
        {"Pole.C.x": pole[:, 0], "Pole.C.y": pole[:, 1], "Wheel.C.x": stay["Stay.X.x"], "Wheel.C.y": stay["Stay.X.y"]},
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


def crane(t: Array) -> Columns:
    """Jib of 200 and stay of 194 from (140, 150) and (110, 174), 18 apart on the nose; its tip is 104 from the stay."""

    def moved(begin: float, end: float, low: float, high: float) -> Array:
        return (high - low) * ease((t - begin) / (end - begin))

    angle = 45 + moved(1.6, 3.8, 0, 30) + moved(6.2, 8.4, 0, -30)
    fall = 202 - moved(0, 1.6, 0, 72) + moved(3.8, 5, 0, 54) - moved(5, 6.2, 0, 54) + moved(8.4, 10, 0, 72)
    jib, stay = still((140, 150), t), still((110, 174), t)
    b = jib + polar(200, angle)
    c = circle_circle(stay, 194, b, 18, 1)
    tip = c + 104 / 18 * (b - c)
    hook = tip + np.stack([np.full(len(t), 7.0), -fall], axis=1)
    return merge(
        body("Jib", {"A": (0, 0), "B": (200, 0)}, "A", jib, angle),
        between("Stay", {"D": (0, 0), "C": (194, 0), "W": (0, 7), "V": (194, 7)}, "D", stay, "C", c),
        between("Nose", {"C": (0, 0), "P": (104, 0), "V": (0, 7), "W": (104, 7)}, "C", c, "P", tip),
        body("Hook", {"T": (0, 0), "H": (0, -14)}, "T", hook, 0 * t),
        body("Crate", {"M": (0, 0), "A": (-20, -2)}, "M", hook - np.array([0, 26]), 0 * t),
        body("Top", {"O": (0, 0)}, "O", c, 0 * t),
        body("Wheel", {"O": (0, 0), "R": (7, 0)}, "O", tip, 0 * t),
        {"Spoke.angle": np.rad2deg((180 - fall) / 7)},
    )


def two_stroke(t: Array) -> Columns:
    """A slider-crank: crank 40, rod 140, clockwise from the upper dead centre."""
    o = still((150, 110), t)
    p = o + polar(40, 90 - 180 * t)
    h = np.stack([o[:, 0], p[:, 1] + np.sqrt(140**2 - (p[:, 0] - 150) ** 2)], axis=1)
    return merge(
        body("Web", {"O": (0, 0), "P": (0, 40), "Q": (0, -18)}, "O", o, -180 * t),
        between("Rod", {"P": (0, 0), "H": (0, 140)}, "P", p, "H", h),
        body("Piston", {"H": (0, 0), "L": (-39, 26), "SR": (39, -64)}, "H", h, 0 * t),
    )


def velocity_polygon(t: Array) -> Columns:
    """A four-bar: crank 62, coupler 170, rocker 120, base 180."""
    a, d = still((110, 90), t), still((290, 90), t)
    b = a + polar(62, 90 * t)
    c = circle_circle(b, 170, d, 120, 1)
    return merge(
        body("Crank", {"A": (0, 0), "B": (62, 0)}, "A", a, 90 * t),
        between("Coupler", {"B": (0, 0), "P": (82, 76), "C": (170, 0)}, "B", b, "C", c),
        between("Rocker", {"C": (0, 0), "D": (0, -120)}, "C", c, "D", d),
    )


def zeuner(t: Array) -> Columns:
    """Crank 38 and rod 110; the eccentric of 34 is 125 degrees ahead, and the valve has its x."""
    o = still((330, 100), t)
    p = o + polar(38, 180 + 90 * t)
    x = np.stack([p[:, 0] - np.sqrt(110**2 - (p[:, 1] - 100) ** 2), o[:, 1]], axis=1)
    valve = np.stack([116 + 34 * np.sin(np.deg2rad(90 * t + 35)), np.full(len(t), 170.0)], axis=1)
    return merge(
        body("Crank", {"O": (0, 0), "P": (38, 0)}, "O", o, 180 + 90 * t),
        between("Rod", {"P": (0, 0), "X": (-110, 0)}, "P", p, "X", x),
        body("Piston", {"X": (0, 0), "H": (-104, 0)}, "X", x, 0 * t),
        body("Valve", {"M": (0, 0), "A": (-63, 0), "B": (-25, 0)}, "M", valve, 0 * t),
        body("Yoke", {"R": (0, 0), "B": (0, -132)}, "R", valve + np.array([214, 18]), 0 * t),
        body("Cam", {"O": (0, 0), "P": (34, 0)}, "O", o, 305 + 90 * t),
        body("Hand", {"O": (0, 0), "P": (118, 0)}, "O", still((574, 176), t), 180 + 90 * t),
    )


def bicycle_suspension(t: Array) -> Columns:
    """Four links: chain stay from (243, 122), rocker from (250, 200), and the carrier of the axle between them."""
    a, d = still((243, 122), t), still((250, 200), t)
    b = a + turn((-77, -16), -11 - 11 * np.sin(np.deg2rad(150 * t)))
    c = circle_circle(b, np.hypot(48, 100), d, np.hypot(36, 10), 1)
    u, v = b - a, c - d
    part = ((d - a)[:, 0] * v[:, 1] - (d - a)[:, 1] * v[:, 0]) / (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return merge(
        between("Chain", {"A": (0, 0), "B": (-77, -16)}, "A", a, "B", b),
        between("Carrier", {"B": (0, 0), "P": (-17, 6), "C": (48, 100)}, "B", b, "C", c),
        between("Rocker", {"D": (0, 0), "C": (-36, 10), "E": (20, 22)}, "D", d, "C", c),
        body("Pole", {"M": (0, 0)}, "M", a + part[:, None] * u, 0 * t),
        body("Rear", {"C": (0, 0)}, "C", b + turn((-17, 6), direction(b, c) - np.rad2deg(np.arctan2(100, 48))), 0 * t),
    )


def _eased(t: Array, begin: float, end: float) -> Array:
    part = np.clip((t - begin) / (end - begin), 0, 1)
    return part**2 * (3 - 2 * part)


def _strokes(t: Array, places: list[tuple[float, tuple[float, float]]]) -> Array:
    """Through the places at their times, eased from each to the next."""
    found = still(places[0][1], t)
    for (begin, here), (end, there) in pairwise(places):
        found = found + _eased(t, begin, end)[:, None] * (np.array(there) - np.array(here))
    return found


def drafting_pantograph(t: Array) -> Columns:
    """Four links with joints 100 times the square root of 2 apart: O, P and Q in line, Q twice as far as P."""
    letter = [(0, (195, 60)), (0.8, (220, 130)), (1.6, (245, 60)), (2.2, (205, 88)), (2.8, (235, 88))]
    o, p = still((50, 40), t), _strokes(t, [*letter, (3.2, (235, 88)), (3.9, (195, 60))])
    reach = p - o
    half = np.hypot(*reach.T) / 2
    up = np.stack([-reach[:, 1], reach[:, 0]], axis=1) / (2 * half)[:, None]
    b = (o + p) / 2 + up * np.sqrt(20000 - half**2)[:, None]
    a, q = 2 * b - o, 2 * p - o
    return merge(
        between("OA", {"O": (0, 0), "B": (100, 100), "A": (200, 200)}, "O", o, "A", a),
        between("AQ", {"A": (0, 0), "C": (100, -100), "Q": (200, -200)}, "A", a, "Q", q),
        between("BP", {"B": (0, 0), "P": (100, -100)}, "B", b, "P", p),
        between("CP", {"C": (0, 0), "P": (-100, -100)}, "C", (a + q) / 2, "P", p),
        body("Point", {"C": (0, 0)}, "C", p, 0 * t),
        body("Pen", {"C": (0, 0)}, "C", q, 0 * t),
    )


def governor(t: Array) -> Columns:
    """Arms of 130 whose cosine is 36745 over the square of the speed; a lever and a rod turn the flap."""
    turn = np.radians(240 * t) - 36 / 60 * np.sin(np.radians(60 * t))
    speed = 240 - 36 * np.cos(np.radians(60 * t))
    cosine = 36745 / speed**2
    out, high = 130 * np.sqrt(1 - cosine**2) * np.cos(turn), 130 * cosine
    found: Columns = {}
    for name, side, part in (("BallR", 1, 1), ("BallL", -1, 1), ("ElbowR", 1, 0.5), ("ElbowL", -1, 0.5)):
        found |= body(name, {"C": (0, 0)}, "C", np.stack([150 + side * part * out, 300 - part * high], axis=1), 0 * t)
    sleeve = np.stack([0 * t + 150, 300 - high], axis=1)
    collar, pivot, centre = sleeve - [0, 13], still((300, 173), t), still((380, 93), t)
    v = pivot - 80 * (collar - pivot) / np.hypot(*(collar - pivot).T)[:, None]
    c, s = 32 * np.cos(np.radians(35)), 32 * np.sin(np.radians(35))
    reach = v - centre
    square = (reach**2).sum(axis=1)
    part = (32**2 - c**2 - (s - 80) ** 2 + square) / (2 * square)
    away = np.stack([reach[:, 1], -reach[:, 0]], axis=1)
    h = centre + part[:, None] * reach + np.sqrt(32**2 / square - part**2)[:, None] * away
    return found | merge(
        body("Sleeve", {"A": (0, -26), "B": (0, 0)}, "B", sleeve, 0 * t),
        body("Collar", {"C": (0, 0)}, "C", collar, 0 * t),
        between("Lever", {"F": (0, 0), "P": (-150, 0), "V": (80, 0)}, "F", pivot, "V", v),
        between("Rod", {"V": (0, 0), "H": (c, s - 80)}, "V", v, "H", h),
        between("Flap", {"C": (0, 0), "H": (c, s)}, "C", centre, "H", h),
    )


def writing(t: Array) -> Columns:
    """A pen from stroke to stroke; about the O, and along a cubic Bézier curve."""
    m = [(0, (60, 100)), (0.3, (60, 200)), (0.55, (100, 140)), (0.8, (140, 200)), (1.1, (140, 100)), (1.4, (220, 200))]
    v = [(2.2, (220, 200)), (2.5, (285, 200)), (2.8, (325, 100)), (3.1, (365, 200)), (3.6, (50, 62)), (4.5, (50, 62))]
    p = _strokes(t, [*m, *v, (4.5 + 1e-9, (370, 66)), (5.2, (400, 20))])
    p = p + (polar(50, 90 + 360 * _eased(t, 1.4, 2.2)) - [0, 50])
    u = _eased(t, 3.6, 4.5)[:, None]
    corners = [np.array(place) for place in ((50, 62), (150, 92), (250, 30), (370, 66))]
    curve = sum(math.comb(3, k) * (1 - u) ** (3 - k) * u**k * corner for k, corner in enumerate(corners))
    p = np.where(((t >= 3.6) & (t <= 4.5))[:, None], curve, p)
    return merge(body("Pen", {"P": (0, 0)}, "P", p, 0 * t), body("Nib", {"P": (0, 0)}, "P", p, 0 * t))
