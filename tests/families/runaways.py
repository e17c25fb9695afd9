"""Mechanisms that a point drives that runs far away, or to infinity and back from the other side, in closed form: when
they bind, when they come back, and where everything is in every frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from tests.families.limits import num, point

Function = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Run:
    """``value`` of times (F,), as the script's ``text`` says it, and its ``poles`` (``even``: they do not change its
    sign).
    """

    text: str
    value: Function
    poles: tuple[float, ...] = ()
    even: bool = False


@dataclass(frozen=True)
class Case:
    """``places``: from times (F,) to anchors (F, 2). ``gaps``: times without a solution. ``poles``: the times at which
    something is at infinity, outside of gaps.
    """

    name: str
    text: str
    places: dict[str, Function]
    gaps: tuple[tuple[float, float], ...]
    poles: tuple[float, ...]
    end: float = 1.0


def run(random, size: float) -> Run:
    """Something of about ``size`` at the beginning, that goes far away within one time unit."""
    b = float(size * random.uniform(0.6, 1.4) * random.choice([-1, 1]))
    p = float(random.choice([0.5, 0.25, round(random.uniform(0.15, 0.9), 3), random.uniform(0.15, 0.9)]))
    which = random.integers(0, 7)
    if which == 0:
        return Run(f"{num(b)}/(1 - .t/{num(p)})", lambda t: b / (1 - t / p), (p,))
    if which == 1:
        return Run(f"{num(b)}/(1 - .t/{num(p)})^2", lambda t: b / (1 - t / p) ** 2, (p,), even=True)
    if which == 2:
        w, s = float(random.uniform(100, 700)), float(random.uniform(20, 70))
        poles = tuple(q for k in range(9) if 0 < (q := (90.0 + 180 * k - s) / w) < 1)
        factor = b / math.tan(math.radians(s))
        return Run(
            f"{num(factor)}*.tan({num(s)} + {num(w)}*.t)", lambda t: factor * np.tan(np.radians(s + w * t)), poles
        )
    if which == 3:
        w = float(random.uniform(3, 30))
        return Run(f"{num(b)}*.exp({num(w)}*.t)", lambda t: b * np.exp(w * t))
    if which == 4:
        w = float(random.uniform(3, 30))
        return Run(f"{num(b)}*.exp({num(w)}*.sin(180*.t))", lambda t: b * np.exp(w * np.sin(np.pi * t)))
    if which == 5:
        near = float(10 ** random.uniform(-7, -2))
        c = b * (near + p * p)
        return Run(f"{num(c)}/({num(near)} + (.t - {num(p)})^2)", lambda t: c / (near + (t - p) ** 2))
    k = float(random.uniform(0.5, 3))
    return Run(
        f"{num(b * p**k)}/.abs({num(p)} - .t)^{num(k)}", lambda t: b * p**k / np.abs(p - t) ** k, (p,), even=True
    )


def gaps_of(slack: Function, poles: tuple[float, ...], end: float) -> tuple[tuple[float, float], ...]:
    """Where ``slack`` is negative, between 0 and ``end``."""
    beside = [p + s * w for p in poles for s in (-1, 1) for w in np.geomspace(1e-12, 0.3, 400)]
    times = np.unique(np.clip(np.concatenate([np.linspace(0, end, 20001), beside]), 0, end))
    with np.errstate(all="ignore"):
        good = slack(times) >= 0
    edges = [
        brentq(lambda t: float(slack(np.array([t]))[0]), times[i], times[i + 1], xtol=1e-15, rtol=1e-15)
        for i in np.nonzero(good[1:] != good[:-1])[0]
    ]
    edges = [*([] if good[0] else [0.0]), *edges, *([] if good[-1] else [end])]
    return tuple(zip(edges[::2], edges[1::2], strict=True))


def _lengths(random, distance: float) -> tuple[float, float]:
    """Two lengths that reach over a distance, with room to both sides."""
    while True:
        a, b = random.uniform(0.3, 1.6, 2) * distance
        if abs(a - b) < 0.9 * distance and a + b > 1.1 * distance and abs(a - b) > 0.05 * distance:
            return float(a), float(b)


def _met(o, x, a, b, side):
    """Where circles about ``o`` (2,) and ``x`` (F, 2) meet, (F, 2); nan where they do not."""
    d = x - o
    square = np.sum(d * d, axis=1)
    along = (a * a - b * b + square) / (2 * square)
    with np.errstate(all="ignore"):
        height = side * np.sqrt(a * a / square - along * along)
    return o + along[:, None] * d + height[:, None] * np.stack([-d[:, 1], d[:, 0]], axis=1)


def _dyad(random, name: str, x: Function, poles, things: str, statements: str, end: str) -> Case:
    """Two bars between a fixed point and the point ``x`` of times, which ``end`` says of `L.X`."""
    first = x(np.zeros(1))[0]
    o = first + random.uniform(40, 120) * _unit(random.uniform(0, 360))
    a, b = _lengths(random, float(np.hypot(*(first - o))))
    side = int(random.choice([-1, 1]))

    def joint(t):
        return _met(o, x(t), a, b, side)

    def slack(t):
        d = np.hypot(*(x(t) - o).T)
        return np.minimum((a + b) / d - 1.0, d / abs(a - b) - 1.0)

    m = joint(np.zeros(1))[0]
    bars = f"A : .bar O={point(*o)} P={point(*m)}; L : .bar P={point(*m)} X={point(*first)};"
    said = [f"A.O={point(*o)};", "L.P=A.P;", end]
    random.shuffle(said)
    gaps = gaps_of(slack, poles, 1.0)
    inside = tuple(p for p in poles if not any(low <= p <= high for low, high in gaps))
    return Case(name, f"{things} {bars}\n@0 {statements} {' '.join(said)}\n@1", {"A.P": joint, "L.X": x}, gaps, inside)


def _unit(degrees: float) -> np.ndarray:
    return np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])


def dyad(random) -> Case:
    """The dyad's end is driven along a line."""
    u = run(random, float(random.uniform(50, 150)))
    way, base = float(random.choice([0.0, 90.0, random.uniform(-180, 180)])), random.uniform(-100, 100, 2)
    e = _unit(way)
    which = random.integers(0, 5)
    if which == 0:
        end = f"L.X = {point(*base)} + [{u.text},0].r({num(way)});"
    elif which == 1:
        way, e = 0.0, _unit(0)
        end = f"L.X = [{num(base[0])} + {u.text}, {num(base[1])}];"
    elif which == 2:
        end = f"d = {u.text}; L.X = {point(*base)} + d*{point(*e)};"
    elif which == 3:
        way, e = 0.0, _unit(0)
        end = f"L.X.y = {num(base[1])}; L.X.x - {num(base[0])} = {u.text};"
    else:
        end = f"L.X = q; q = {point(*base)} + {point(*e)}*({u.text});"
    return _dyad(random, f"dyad {u.text}", lambda t: base + u.value(t)[:, None] * e, u.poles, "", "", end)


def _pin(random) -> tuple[str, str, Function, tuple[float, ...]]:
    """A pin on a guide and in the slot of an arm that turns parallel to it: things, statements, place, poles."""
    o, h = random.uniform(-80, 80, 2), float(random.uniform(40, 120) * random.choice([-1, 1]))
    s, w = float(random.uniform(40, 140)), float(random.choice([90, 120, 200, random.uniform(60, 400)]))
    w *= int(random.choice([-1, 1]))
    poles = tuple(sorted(t for k in range(-5, 6) if 0 < (t := (180.0 * k - s) / w) < 1))

    def place(t):
        angle = np.radians(s + w * t)
        return np.stack([o[0] + h / np.tan(angle), np.full(len(t), o[1] + h)], axis=1)

    first = place(np.zeros(1))[0]
    things = f"Arm : .bar O={point(*o)} A={point(o[0] + 60, o[1])}; Pin : .disc(4) C={point(*first)};"
    drive = f"Arm.O={point(*o)}; Arm.angle={num(s)} + {num(w)}*.t;"
    guide = random.choice([f"Pin.C = [_, {num(o[1] + h)}];", f"Pin.C.y = {num(o[1] + h)};"])
    return things, f"{drive} {guide} .across(Pin.C, Arm.O, Arm.A) = 0;", place, poles


def pin_dyad(random) -> Case:
    """The pin drives a dyad."""
    things, said, place, poles = _pin(random)
    return _dyad(random, "dyad at a pin", place, poles, things, said, "L.X = Pin.C;")


def pin(random) -> Case:
    """A pin alone."""
    things, said, place, poles = _pin(random)
    return Case("pin", f"{things}\n@0 {said}\n@1", {"Pin.C": place}, (), poles)


def formula(random) -> Case:
    """A disc where a formula says."""
    u, base = run(random, 100.0), random.uniform(-50, 50, 2)
    text = f"D : .disc(4) C=[0,0];\n@0 D.C = [{num(base[0])} + {u.text}, {num(base[1])}];\n@1"
    return Case(f"formula {u.text}", text, {"D.C": lambda t: base + u.value(t)[:, None] * _unit(0)}, (), u.poles)


def crossing(random) -> Case:
    """A point where two lines cross that both turn."""
    while True:
        (o, q), (s, r) = random.uniform(-100, 100, (2, 2)), random.uniform(0, 180, 2)
        w, v = random.uniform(-300, 300, 2)
        if abs(w - v) > 60 and 20 < abs(s - r) % 180 < 160 and np.hypot(*(o - q)) > 40:
            break
    poles = tuple(sorted(t for k in range(-9, 10) if 0 < (t := (180.0 * k - (s - r)) / (w - v)) < 1))

    def place(t):
        a, b = np.radians(s + w * t), np.radians(r + v * t)
        d = q - o
        along = (d[0] * np.sin(b) - d[1] * np.cos(b)) / np.sin(b - a)
        return o + along[:, None] * np.stack([np.cos(a), np.sin(a)], axis=1)

    first = place(np.zeros(1))[0]
    text = (
        f"A : .bar O={point(*o)} P={point(o[0] + 50, o[1])}; B : .bar O={point(*q)} P={point(q[0] + 50, q[1])};"
        f" M : .disc(4) C={point(*first)};\n@0 A.O={point(*o)}; A.angle={num(s)} + {num(w)}*.t; B.O={point(*q)};"
        f" B.angle={num(r)} + {num(v)}*.t; .across(M.C, A.O, A.P)=0; .across(M.C, B.O, B.P)=0;\n@1"
    )
    return Case("crossing", text, {"M.C": place}, (), poles)


def pointer(random) -> Case:
    """A bar that points at a pin: through infinity it swings on evenly."""
    things, said, place, poles = _pin(random)
    at, length = random.uniform(-150, 150, 2), float(random.uniform(30, 80))
    side = int(random.choice([-1, 1]))

    def end(t):
        d = place(t) - at
        passed = np.sum(t[:, None] > np.array(poles)[None], axis=1) if poles else 0
        sign = side * (1 - 2 * (passed % 2))
        return at + (length * sign / np.hypot(*d.T))[:, None] * d

    first = end(np.zeros(1))[0]
    bar = f"L : .bar P={point(*at)} Q={point(*first)};"
    text = f"{things} {bar}\n@0 {said} L.P={point(*at)}; .across(Pin.C, L.P, L.Q)=0;\n@1"
    return Case("pointer", text, {"L.Q": end, "Pin.C": place}, (), poles)


def slider(random) -> Case:
    """A bar's end on the line from a fixed point to a pin, within reach all the time."""
    things, said, place, poles = _pin(random)
    at, base = random.uniform(-100, 100, 2), random.uniform(-60, 60, 2)
    length, side = float(np.hypot(*(at - base)) * random.uniform(1.2, 2.0)), int(random.choice([-1, 1]))

    def end(t):
        d = place(t) - base
        passed = np.sum(t[:, None] > np.array(poles)[None], axis=1) if poles else 0
        u = d * ((1 - 2 * (passed % 2)) / np.hypot(*d.T))[:, None]
        foot = (at - base) @ u.T
        height = np.sqrt(length**2 - np.sum((at - base) ** 2) + foot**2)
        return base + (foot + side * height)[:, None] * u

    first = end(np.zeros(1))[0]
    bar = f"L : .bar P={point(*at)} Q={point(*first)}; S : .disc(3) C={point(*base)};"
    text = f"{things} {bar}\n@0 {said} L.P={point(*at)}; S.C={point(*base)}; .across(L.Q, S.C, Pin.C)=0;\n@1"
    return Case("slider", text, {"L.Q": end}, (), poles)


@dataclass(frozen=True)
class Platform:
    """A plate that two bars hold, of which the first turns about ``o`` by the angle (degrees) that its pose is told by;
    a third bar of the length ``c`` goes from the plate to the line through ``base`` along ``e``.
    """

    o: np.ndarray
    q: np.ndarray
    a: float
    b: float
    width: float
    side: int
    corner: np.ndarray
    base: np.ndarray
    e: np.ndarray
    c: float
    which: int

    def joints(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The plate's three joints (F, 2)."""
        turned = np.radians(angle)
        p = self.o + self.a * np.stack([np.cos(turned), np.sin(turned)], axis=1)
        q = _met(self.q, p, self.b, self.width, self.side)
        x = (q - p) / self.width
        y = np.stack([-x[:, 1], x[:, 0]], axis=1)
        return p, q, p + self.corner[0] * x + self.corner[1] * y

    def away(self, angle: np.ndarray) -> np.ndarray:
        """How far (F,) the corner is from the line, of the third bar's length."""
        return (self.joints(angle)[2] - self.base) @ np.array([-self.e[1], self.e[0]]) / self.c

    def along(self, angle: np.ndarray) -> np.ndarray:
        """Where (F,) on the line the third bar ends."""
        with np.errstate(all="ignore"):
            reach = self.c * np.sqrt(1.0 - self.away(angle) ** 2)
        return (self.joints(angle)[2] - self.base) @ self.e + self.which * reach

    def room(self, angle: float) -> tuple[float, float] | None:
        """The angles about this one between which the third bar's end moves one way; None where that is not for all of
        the branch: another joint stretches first.
        """
        angles = angle + np.linspace(-180, 180, 3601)
        there = self.along(angles)
        steps = np.diff(there)
        i = j = 1800
        sign = np.sign(steps[i])
        while j < 3599 and steps[j] * sign > 0:
            j += 1
        while i > 0 and steps[i - 1] * sign > 0:
            i -= 1
        some = angles[max(i - 2, 0) : j + 3]
        if i < 3 or j > 3590 or not np.isfinite(there[i - 2 : j + 3]).all():
            return None
        distance = np.hypot(*(self.joints(some)[0] - self.q).T)
        least, most = abs(self.b - self.width), self.b + self.width
        if distance.max() > 0.98 * most or distance.min() < 1.02 * least or np.abs(self.away(some)).max() > 0.97:
            return None

        def farthest(k: int, up: float) -> float:
            found = minimize_scalar(
                lambda x: -up * float(self.along(np.array([x]))[0]),
                bounds=(angles[k - 1], angles[k + 1]),
                method="bounded",
                options={"xatol": 1e-10},
            )
            return float(found.x)

        return farthest(i, -sign), farthest(j, sign)


def _platform(random) -> tuple[Platform, float, tuple[float, float]]:
    """A platform, the angle it is drawn at, and its room."""
    while True:
        o, q = random.uniform(-60, 60, 2), random.uniform(-60, 60, 2) + 120 * _unit(0)
        a, b, width = (float(v) for v in random.uniform(30, 115, 3))
        side, which = (int(v) for v in random.choice([-1, 1], 2))
        way, c = float(random.choice([0, 90, random.uniform(-180, 180)])), float(random.uniform(50, 150))
        e, angle = _unit(way), float(random.uniform(0, 360))
        drawn = Platform(o, q, a, b, width, side, random.uniform(-60, 90, 2), o, e, c, which)
        corner = drawn.joints(np.array([angle]))[2][0]
        if not np.isfinite(corner).all():
            continue
        base = corner + random.uniform(-0.8, 0.8) * c * np.array([-e[1], e[0]])
        drawn = replace(drawn, base=base)
        room = drawn.room(angle)
        if room is None:
            continue
        low, here, high = sorted(drawn.along(np.array([*room, angle])))
        if high - low > 20 and min(high - here, here - low) > 0.05 * (high - low):
            return drawn, angle, room


def triad(random) -> Case:
    """The third bar of a plate on three bars is driven along a line: a loop that only iteration solves."""
    k, first, room = _platform(random)
    low, high = sorted(k.along(np.array(room)).tolist())
    u = run(random, max(30.0, (high - low) * random.uniform(0.3, 2.0)))
    offset = float(k.along(np.array([first]))[0] - u.value(np.zeros(1))[0])

    def driven(t):
        return offset + u.value(t)

    def slack(t):
        return np.minimum(high - driven(t), driven(t) - low) / (high - low)

    def angle(t):
        found = np.full(len(t), np.nan)
        for n, value in enumerate(driven(t)):
            if low < value < high:
                found[n] = brentq(lambda x, v=value: float(k.along(np.array([x]))[0]) - v, *room, xtol=1e-13)
        return found

    p, q, r = (joint[0] for joint in k.joints(np.array([first])))
    x = k.base + k.along(np.array([first]))[0] * k.e
    way = num(float(np.degrees(np.arctan2(k.e[1], k.e[0]))))
    end = random.choice(
        [
            f"C.X = {point(*k.base)} + {point(*k.e)}*({num(offset)} + {u.text});",
            f"C.X = {point(*k.base)} + [{num(offset)} + {u.text}, 0].r({way});",
            f"d = {num(offset)} + {u.text}; C.X = {point(*k.base)} + d*{point(*k.e)};",
        ]
    )
    said = [f"A.O={point(*k.o)};", f"B.O={point(*k.q)};", "K.P=A.P;", "K.Q=B.P;", "C.R=K.R;", end]
    random.shuffle(said)
    text = (
        f"A:.bar O={point(*k.o)} P={point(*p)}; B:.bar O={point(*k.q)} P={point(*q)}; K:.plate P={point(*p)}"
        f" Q={point(*q)} R={point(*r)}; C:.bar R={point(*r)} X={point(*x)};"
        f"\n@0 {' '.join(said)}\n@1"
    )
    gaps = gaps_of(slack, u.poles, 1.0)
    inside = tuple(pole for pole in u.poles if not any(begin <= pole <= end for begin, end in gaps))
    places = {"A.P": lambda t: k.joints(angle(t))[0], "K.R": lambda t: k.joints(angle(t))[2]}
    return Case(f"triad {u.text}", text, places, gaps, inside)


def coupled(random) -> Case:
    """A disc in the slot of an arm that turns parallel to the way that the disc nearly keeps: how high it is depends on
    where a bar points that points at it, so that only iteration solves for both.
    """
    o, h, e = random.uniform(-60, 60, 2), float(random.uniform(60, 120)), float(random.uniform(2, 8))
    s, w = float(random.uniform(40, 140)), float(random.choice([-1, 1]) * random.uniform(60, 170))
    at = o + np.array([random.uniform(-40, 40), -random.uniform(20, 80)])
    poles = tuple(sorted(t for k in range(-2, 3) if 0 < (t := (180.0 * k - s) / w) < 1))

    def place(t):
        angle, y = np.radians(s + w * t), np.full(len(t), h)
        sign = 1 - 2 * (np.sum(t[:, None] > np.array(poles)[None], axis=1) % 2)
        for _ in range(60):  # contracts: where the disc is a little higher, the bar hardly turns
            d = np.stack([o[0] + y / np.tan(angle) - at[0], o[1] + y - at[1]], axis=1)
            y = h + e * sign * d[:, 1] / np.hypot(*d.T)
        return np.stack([o[0] + y / np.tan(angle), o[1] + y], axis=1)

    first = place(np.zeros(1))[0]
    drawn = num(math.degrees(math.atan2(*(first - at)[::-1])))
    text = (
        f"Arm : .bar O={point(*o)} A={point(o[0] + 60, o[1])}; M : .disc(4) C={point(*first)};"
        f" N : .bar P={point(*at)} Q={point(*(at + 0.5 * (first - at)))};\n@0 Arm.O={point(*o)};"
        f" Arm.angle={num(s)} + {num(w)}*.t; N.P={point(*at)}; .across(M.C, N.P, N.Q)=0;"
        f" M.C.y={num(float(o[1]) + h)} + {num(e)}*.sin(N.angle + {drawn}); .across(M.C, Arm.O, Arm.A)=0;\n@1"
    )
    return Case("coupled", text, {"M.C": place}, (), poles)


KINDS = (dyad, pin_dyad, pin, formula, crossing, pointer, slider, triad, coupled)


def cases(count: int, seed: int) -> Iterator[Case]:
    random = np.random.default_rng(seed)
    for number in range(count):
        yield KINDS[number % len(KINDS)](random)
