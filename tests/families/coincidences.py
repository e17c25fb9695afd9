"""Mechanisms in which two circles become one for an instant, with their poses in closed form: kites, rhombuses, and
scissor lifts.

The motion is smooth there, although the equations of that instant leave a thing free: what must come out is the limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from tests.families.limits import crank_spelling, num, point

Places = Callable[[np.ndarray], dict[str, np.ndarray]]


@dataclass(frozen=True)
class Case:
    """``places``: from times (F,) to anchors (F, 2); ``whole``: inequalities as (anchor, axis, sign) that hold."""

    name: str
    text: str
    places: Places


def _unit(degrees):
    return np.stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))], axis=-1)


def turned(random) -> tuple[str, Callable[[np.ndarray], np.ndarray], float]:
    """An angle that passes or touches 0 (modulo a turn) at times that frames hit: expression, function, length."""
    which = random.integers(0, 5)
    first = float(random.choice([-90.0, -45.0, 30.0, 60.0, 135.0, 180.0]))
    if which == 0:
        speed = float(random.choice([90.0, 180.0, 360.0, -90.0, -360.0]))
        return f"{num(first)} + {num(speed)}*.t", lambda t: first + speed * t, 4.0
    if which == 1:
        wide = float(random.uniform(20, 80))
        return f"{num(wide)}*.cos(90*.t)", lambda t: wide * np.cos(np.radians(90 * t)), 8.0
    if which == 2:  # it comes to zero, and goes back
        wide = float(random.uniform(10, 60))
        return f"{num(wide)}*(1 + .cos(90*.t))", lambda t: wide * (1 + np.cos(np.radians(90 * t))), 8.0
    if which == 3:
        return f"{num(first)}*(1 - .t)^3", lambda t: first * (1 - t) ** 3, 1.5
    return f"{num(first)}*(1 - .t)", lambda t: first * (1 - t), 2.0


def kite(random) -> Case:
    """Crank and ground of one length, coupler and rocker of one length: the crank's pin passes the rocker's pivot."""
    a = float(random.uniform(30, 90))
    b = a if random.random() < 0.4 else float(a * random.uniform(1.1, 2.0))
    side = int(random.choice([-1, 1]))
    o = random.uniform(-100, 100, 2)
    ground = float(random.uniform(-180, 180)) if random.random() < 0.5 else 0.0
    expression, angle, length = turned(random)

    def places(t):
        half = angle(t) / 2.0
        pivot = o + a * _unit(ground)
        away = _unit(ground + half + 90.0)  # from the pivot to the pin, turning smoothly through their coincidence
        s, c = np.sin(np.radians(half))[..., None], np.cos(np.radians(half))[..., None]
        height = a * c if b == a else np.sqrt(b * b - (a * s) ** 2)
        normal = np.stack([-away[..., 1], away[..., 0]], axis=-1)
        return {"C.P": o + a * _unit(ground + angle(t)), "L.B": pivot + a * s * away + side * height * normal}

    first = {name: value[0] for name, value in places(np.zeros(1)).items()}
    # where two solutions meet, the drawing says which is meant
    meeting = _near(angle(0.0)) or (b == a and _near(angle(0.0) - 180.0))
    drawn = places(np.full(1, 1e-3)) if meeting else None
    p, j = (first if drawn is None else {k: v[0] for k, v in drawn.items()}).values()
    pivot = o + a * _unit(ground)
    text = (
        f".config(8);\nC : .bar O=[0,0] P=[{num(a)},0]; R : .bar O={point(*pivot)} P={point(*j)};"
        f" L : .bar A={point(*p)} B={point(*j)};\n@0 "
        + crank_spelling(random, "C", o, a, f"({num(ground)} + {expression})")
        + f" R.O={point(*pivot)}; L.A=C.P; L.B=R.P;\n@{num(length)}"
    )
    return Case("rhombus" if b == a else "kite", text, places)


def _near(angle: float) -> bool:
    return abs(math.remainder(float(angle), 360.0)) < 1.0


def scissor(random) -> Case:
    """A scissor lift of 1 to 4 cells, driven through or up to the level at which it is flat."""
    cells = int(random.integers(1, 5))
    bar = float(random.uniform(40, 120))
    while True:
        expression, angle, length = turned(random)
        if expression.count("cos"):
            break
    o = random.uniform(-50, 50, 2)
    drawn = float(angle(np.zeros(1))[0]) * float(random.choice([1.0, 0.8]))

    def at(k, u, v, theta):
        """A point of cell k: u along, v up, in units of the cell."""
        return o + np.stack([(k + u) * bar * np.cos(np.radians(theta)), v * bar * np.sin(np.radians(theta))], axis=-1)

    def places(t):
        theta = angle(t)
        found = {}
        for k in range(cells):
            found[f"U{k}.B"], found[f"D{k}.B"], found[f"U{k}.M"] = (
                at(k, 1, 1, theta),
                at(k, 1, 0, theta),
                at(k, 0.5, 0.5, theta),
            )
        return found

    things, joints = [], []
    for k in range(cells):

        def p(u, v, k=k):
            return point(*at(k, u, v, drawn))

        things.append(f"U{k} : .bar A={p(0, 0)} M={p(0.5, 0.5)} B={p(1, 1)};")
        things.append(f"D{k} : .bar A={p(0, 1)} M={p(0.5, 0.5)} B={p(1, 0)};")
        joints.append(f"U{k}.M = D{k}.M;")
        if k:
            joints.append(f"U{k}.A = D{k - 1}.B; D{k}.A = U{k - 1}.B;")
    which = random.integers(0, 3)
    if which == 0:
        drive = f"U0.angle = {expression} - {num(drawn)};"
    elif which == 1:
        drive = f"U0.B = U0.A + [{num(bar)},0].r({expression});"
    else:
        drive = f"th = {expression}; U0.B = {point(*o)} + [{num(bar)}*.cos(th), {num(bar)}*.sin(th)];"
    level = "D0.B.y = U0.A.y;" if random.random() < 0.5 else f"D0.A.x = {num(o[0])};"
    level_enough = np.max(np.abs(angle(np.linspace(0.0, length, 99)))) < 89.0
    sides = "".join(f" U{k}.M.x > {num(o[0])};" for k in range(cells)) if level_enough else ""
    text = ".config(8);\n" + " ".join(things) + f"\n@0 U0.A = {point(*o)}; {drive} {level} " + " ".join(joints) + sides
    return Case(f"scissor {cells}", f"{text}\n@{num(length)}", places)


def cases(count: int, seed: int) -> Iterator[Case]:
    """``count`` random cases."""
    random = np.random.default_rng(seed)
    for number in range(count):
        yield (kite, scissor)[number % 2](random)
