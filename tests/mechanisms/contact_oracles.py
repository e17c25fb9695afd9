"""Where the gallery's things are that touch: a roller on a cam, a tracer on its template, rollers, a belt."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.integrate import quad  # pyright: ignore[reportUnknownVariableType]
from scipy.optimize import minimize_scalar  # pyright: ignore[reportUnknownVariableType]

from tests.mechanisms.kinematics import Array, Columns, between, body, circle_circle, ease, merge, polar, root, still


def cam_radius(degrees: float | Array) -> Array:
    """How far the cam's outline is from its axle: 92 at 90 degrees and 32 opposite, and smooth between them."""
    return np.asarray(32 + 60 * ease(1 - np.abs(np.mod(np.asarray(degrees) + 90, 360) - 180) / 180))


def roller_height(turned: float) -> float:
    """How high above the axle the centre of a roller rests on the cam, which is ``turned`` by so many degrees: the
    highest of the centres from which a circle of radius 10 meets a place of the outline.
    """

    def centre(degrees: float | Array) -> Array:
        x, y = np.moveaxis(polar(cam_radius(degrees), np.asarray(degrees) + turned), -1, 0)
        return np.asarray(y + np.sqrt(np.maximum(100 - x * x, 0.0)))

    # only what is within 10 of the middle line can meet the roller; the cam is never less than 32 from the axle
    reach = float(np.rad2deg(np.arcsin(10 / 32)))
    grid = np.linspace(90 - turned - reach, 90 - turned + reach, 721)
    x = polar(cam_radius(grid), grid + turned)[:, 0]
    values = np.where(np.abs(x) < 10, centre(grid), -np.inf)
    best, step = float(grid[int(np.argmax(values))]), float(grid[1] - grid[0])
    found = minimize_scalar(
        lambda u: -float(centre(u)), bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-9}
    )
    return -float(found.fun)


def cam_follower(t: Array) -> Columns:
    """Axle (160, 120), half a turn a second; the rod stands on the roller's centre."""
    turned = 180 * t
    height = np.array([roller_height(float(degrees)) for degrees in turned])
    axle = still((160, 120), t)
    roller = axle + polar(height, 90)
    return merge(
        body("Cam", {"C": (0, 0), "P": (0, 30)}, "C", axle, turned),
        body("Rod", {"A": (0, 0), "B": (0, 130)}, "A", roller, 0),
        body("Roller", {"C": (0, 0)}, "C", roller, 0),
        {"lift": height - 42},
    )


def template_radius(radians: float | Array) -> Array:
    """How far the template's outline is from its middle."""
    return np.asarray(46 + 12 * np.cos(3 * np.asarray(radians)) + 5 * np.sin(2 * np.asarray(radians)))


def template_length(begin: float, end: float) -> float:
    """How long the template's outline is between two polar angles (radians)."""

    def speed(u: float) -> float:
        return float(np.hypot(template_radius(u), -36 * np.sin(3 * u) + 10 * np.cos(2 * u)))

    return float(quad(speed, begin, end, epsabs=1e-12)[0])


def tracer(t: Array) -> Columns:
    """The tracer goes round the template once in three seconds at a steady speed; arms 260 and 170, halved."""
    degrees = np.deg2rad(np.arange(361.0))
    parts = [template_length(float(begin), float(end)) for begin, end in pairwise(degrees)]
    lengths = np.concatenate([[0.0], np.cumsum(parts)])

    def place(share: float) -> float:
        """The polar angle (radians) to which the outline has such a share of its whole length."""
        sought = float((share % 1.0) * lengths[-1])
        k = int(np.searchsorted(lengths, sought, side="right")) - 1
        begin = float(degrees[k])
        middle = begin + np.deg2rad(0.5)
        return root(lambda u: float(lengths[k]) + template_length(begin, u) - sought, middle, np.deg2rad(1.0))

    angle = np.array([place(float(instant) / 3) for instant in t])
    tip = still((300, 150), t) + polar(template_radius(angle), np.rad2deg(angle))
    b, c = (171.18, 195.697), (146.82, -85.697)
    o = still((40, 40), t)
    elbow = circle_circle(o, float(np.hypot(*b)), tip, float(np.hypot(*c)), +1)
    a, d, p = (o + elbow) / 2, (elbow + tip) / 2, (o + tip) / 2
    half_b, half_c = (b[0] / 2, b[1] / 2), (c[0] / 2, c[1] / 2)
    return merge(
        between("Long", {"O": (0, 0), "A": half_b, "B": b}, "O", o, "B", elbow),
        between("Arm", {"B": (0, 0), "D": half_c, "T": c}, "B", elbow, "T", tip),
        between("Short", {"A": (0, 0), "P": half_c}, "A", a, "P", p),
        between("Link", {"P": (0, 0), "D": half_b}, "P", p, "D", d),
        body("Tip", {"C": (0, 0)}, "C", tip, 0),
    )


def scissor_rollers(t: Array) -> Columns:
    """Legs of 240 at 35 to 20 degrees; rollers of radius 12, which turn by the way they run."""
    lean = 35 - 7.5 * (1 - np.cos(np.pi * t))
    foot = still((70, 52), t)
    rise = 240 * np.sin(np.deg2rad(lean))
    run = 240 * np.cos(np.deg2rad(lean))
    zero = np.zeros_like(t)
    low = foot + np.stack([run, zero], axis=-1)
    high = foot + np.stack([run, rise], axis=-1)
    top = foot + np.stack([zero, rise], axis=-1)
    rolled = np.rad2deg((low[:, 0] - 266) / 12)
    m, end = polar(120, 35), polar(240, 35)
    one = {"A": (0.0, 0.0), "M": (float(m[0]), float(m[1])), "B": (float(end[0]), float(end[1]))}
    two = {anchor: (x, -y) for anchor, (x, y) in one.items()}
    plate = {"A": (0, 0), "B": (320, 0), "C": (320, 16), "D": (0, 16)}
    return merge(
        body("One", one, "A", foot, lean - 35),
        body("Two", two, "A", top, 35 - lean),
        body("Low", {"C": (0, 0), "P": (9, 0)}, "C", low, -rolled),
        body("High", {"C": (0, 0), "P": (9, 0)}, "C", high, rolled),
        body("Table", plate, "A", np.stack([zero + 40, 52 + rise + 12], axis=-1), 0),
    )


def belt_length(wheels: list[tuple[float, float, float]]) -> float:
    """Of a closed belt that goes clockwise about wheels (x, y, radius), counter-clockwise where the radius is negative:
    straight parts √(d² - (r₂ - r₁)²) and arcs.
    """
    total, headings = 0.0, list[float]()
    for (x, y, r), (u, v, s) in zip(wheels, wheels[1:] + wheels[:1], strict=True):
        d = np.hypot(u - x, v - y)
        total += float(np.sqrt(d**2 - (s - r) ** 2))
        headings.append(float(np.arctan2(v - y, u - x) + np.arcsin((s - r) / d)))
    for k, (_, _, r) in enumerate(wheels):
        total += abs(r) * float(np.mod(np.sign(r) * (headings[k - 1] - headings[k]), 2 * np.pi))
    return total


def belt_idler(t: Array) -> Columns:
    """Wheels 50 at (90, 110) and 28 at 299 + 6 cos; an idler 18 at x = 195 keeps the belt 685 long from below."""
    small = np.stack([299 + 6 * np.cos(np.pi * t), np.full_like(t, 110)], axis=-1)
    heights: list[float] = []
    for x, y in small:

        def excess(height: float, x: float = float(x), y: float = float(y)) -> float:
            return belt_length([(90, 110, 50), (x, y, 28), (195, height, -18)]) - 685

        heights.append(root(excess, 92.0, 22.0))
    idler = np.stack([np.full_like(t, 195), np.array(heights)], axis=-1)
    return merge(
        body("Big", {"C": (0, 0), "P": (38, 0)}, "C", still((90, 110), t), -180 * t),
        body("Small", {"C": (0, 0), "P": (20, 0)}, "C", small, -180 * t * 50 / 28),
        body("Idler", {"C": (0, 0)}, "C", idler, 0),
        body("Stem", {"A": (0, 0), "B": (0, -60)}, "A", idler, 0),
    )
