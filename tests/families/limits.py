"""Mechanisms driven past their reach, with the times at which they bind in closed form.

Each mechanism is solvable while a driven quantity lies in known intervals; each way of driving it is a function of
time whose crossings of the intervals' ends are known. Nothing here is taken from the solver.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Interval = tuple[float, float]


@dataclass(frozen=True)
class Mechanism:
    """Definitions, constraints, and how it is driven by a quantity ``U``. ``reach``: intervals of that in which
    it can be assembled; ``period`` of the quantity (0: none); ``surely``: beyond all other solutions too, where there
    may be others beyond the end of the path; ``cut``: an inequality may end the reach.
    """

    name: str
    things: str
    constraints: str
    drive: str
    reach: tuple[Interval, ...]
    period: float = 0.0
    surely: float | None = None
    cut: bool = False

    def solvable(self, u: float) -> bool:
        if self.period:
            return any(low <= u - k * self.period <= high for low, high in self.reach for k in range(-9, 10))
        return any(low <= u <= high for low, high in self.reach)

    def ends(self) -> list[float]:
        found = [end for interval in self.reach for end in interval if math.isfinite(end)]
        if self.period:
            found = [end + k * self.period for end in found for k in range(-9, 10)]
        return found


@dataclass(frozen=True)
class Profile:
    """A driven quantity over [0, end]: ``steps`` (time, expression), ``value(t)``, ``crossings(u)``: times at which it
    passes u, beginnings of steps included.
    """

    name: str
    steps: tuple[tuple[float, str], ...]
    value: Callable[[float], float]
    crossings: Callable[[float], list[float]]
    end: float


@dataclass(frozen=True)
class Case:
    name: str
    text: str
    gaps: tuple[Interval, ...]
    end: float
    cut: bool


def num(value: float) -> str:
    return repr(float(value))


def point(x: float, y: float) -> str:
    return f"[{num(x)},{num(y)}]"


def _cosine_intervals(low: float, high: float) -> tuple[Interval, ...]:
    """Angles (degrees) within a turn whose cosine lies in [low, high]."""
    inner = math.degrees(math.acos(min(high, 1.0))) if high < 1.0 else 0.0
    outer = math.degrees(math.acos(max(low, -1.0))) if low > -1.0 else 180.0
    if inner == 0.0:
        return ((-outer, outer),)
    if outer == 180.0:
        return ((inner, 360.0 - inner),)
    return ((-outer, -inner), (inner, outer))


# --- mechanisms -----------------------------------------------------------------------------------------------------


def circle(p, q, a, b, side):
    """Where circles about p and q of radii a and b meet."""
    p, q = np.array(p, float), np.array(q, float)
    d = q - p
    square = float(d @ d)
    along = (a * a - b * b + square) / (2 * square)
    height = side * math.sqrt(max(a * a / square - along * along, 0.0))
    return p + along * d + height * np.array([-d[1], d[0]])


def crank_spelling(random, thing, o, length, u):
    """Definitions and constraints by which a crank's angle is ``u``."""
    which = random.integers(0, 7)
    pivot = f"{thing}.O = {point(*o)};"
    if which == 0:
        return f"{pivot} {thing}.angle = {u};"
    if which == 1:
        return f"{pivot} {thing}.P = {thing}.O + [{num(length)},0].r({u});"
    if which == 2:
        turned = f".a([1,0].r(th), {thing}.P - {thing}.O)"
        return f"{pivot} th = {u}; {thing}.P = {thing}.O + [_,0].r(th); {turned} < 90; {turned} > -90;"
    if which == 3:
        return f"{pivot} th = {u}; {thing}.angle = th;"
    if which == 4:
        return f"{pivot} {thing}.P = {point(*o)} + [{num(length)}*.cos({u}), {num(length)}*.sin({u})];"
    if which == 5:
        return f"{pivot} th = {u}; {thing}.angle - th = 0;"
    return f"p = {point(*o)} + [{num(length)},0].r({u}); {thing}.P = p; {pivot}"


def four_bar(random) -> Mechanism:
    """A crank that cannot turn fully: its pin and the rocker's pivot must stay within reach of coupler and rocker."""
    while True:
        a, b, c, d = random.uniform(20, 120, 4)
        near, far = abs(b - c), b + c
        low, high = (a * a + d * d - far**2) / (2 * a * d), (a * a + d * d - near**2) / (2 * a * d)
        if high < -0.95 or low > 0.95 or high - low < 0.1 or (low < -1.001 and high > 1.001):
            continue
        if min(abs(abs(low) - 1), abs(abs(high) - 1)) < 1e-3:
            continue
        break
    o, turn = random.uniform(-100, 100, 2), random.uniform(-180, 180)
    reach = tuple((turn + lo, turn + hi) for lo, hi in _cosine_intervals(low, high))
    lo, hi = reach[-1]
    begin = lo + random.uniform(0.3, 0.7) * (hi - lo)
    pivot = o + d * np.array([math.cos(math.radians(turn)), math.sin(math.radians(turn))])
    p = o + a * np.array([math.cos(math.radians(begin)), math.sin(math.radians(begin))])
    joint = circle(p, pivot, b, c, random.choice([-1, 1]))
    things = (
        f"C : .bar O=[0,0] P=[{num(a)},0]; R : .bar O={point(*pivot)} P={point(*joint)};"
        f" L : .bar A={point(*p)} B={point(*joint)};"
    )
    drive = crank_spelling(random, "C", o, a, "U")
    constraints = f"R.O={point(*pivot)}; L.A=C.P; L.B=R.P;"
    return Mechanism("four-bar", things, constraints, drive, reach, 360.0)


def _on_side(r, rod, e, side, reach):
    """The parts of ``reach`` (degrees) in which the slider at level e is on ``side`` of the crank's centre."""
    # it is at the centre's abscissa where the pin is a rod's length from there: |(r cos u, r sin u - e)| = rod
    edges = []
    if e != 0.0 and abs(r * r + e * e - rod * rod) <= 2 * r * abs(e):
        first = math.degrees(math.asin((r * r + e * e - rod * rod) / (2 * r * e)))
        edges = [a + 360 * k for a in (first, 180.0 - first) for k in (-2, -1, 0, 1, 2)]
    found = []
    for low, high in reach:
        cuts = [low, *sorted(a for a in edges if low < a < high), high]
        for a, b in itertools.pairwise(cuts):
            u = math.radians(0.5 * (a + b))
            if side * (r * math.cos(u) + side * math.sqrt(max(rod**2 - (r * math.sin(u) - e) ** 2, 0.0))) > 0:
                if found and found[-1][1] == a:
                    found[-1] = found[-1][0], b
                else:
                    found.append((a, b))
    return tuple(found)


def slider_crank(random) -> Mechanism:
    """A rod too short for its crank: |r sin(u) - e| must not exceed it."""
    while True:
        r, rod, e = random.uniform(30, 80), random.uniform(15, 100), random.uniform(-30, 30)
        low, high = (e - rod) / r, (e + rod) / r
        if -0.97 < low < high < 1.5 or -1.5 < low < high < 0.97:
            break
    # sin(u) in [low, high]: cos(u - 90) in [low, high]
    reach = tuple((90.0 + lo, 90.0 + hi) for lo, hi in _cosine_intervals(low, high))
    lo, hi = reach[-1]
    begin = lo + random.uniform(0.3, 0.7) * (hi - lo)
    o = random.uniform(-100, 100, 2)
    p = o + r * np.array([math.cos(math.radians(begin)), math.sin(math.radians(begin))])
    side = random.choice([-1, 1])
    b = (p[0] + side * math.sqrt(rod**2 - (p[1] - o[1] - e) ** 2), o[1] + e)
    things = f"C : .bar O=[0,0] P=[{num(r)},0]; R : .bar A={point(*p)} B={point(*b)};"
    slide = random.integers(0, 3)
    cut = False
    if slide == 0:
        end = f"R.B = [x, {num(b[1])}];"
    elif slide == 1:
        end = f"R.B.y = {num(b[1])};"
    else:
        end = f"R.B = [_, {num(b[1])}];"
    if slide == 0 and random.random() < 0.5:  # an inequality that the selected branch comes to violate after its end
        relation = ">" if side > 0 else "<"
        if random.random() < 0.5:
            end += f" x {relation} C.P.x;"
        else:  # met by the path up to its end, and no longer where the rod comes within reach again
            end += f" x {relation} {num(o[0])};"
            cut = True
            reach = _on_side(r, rod, e, side, reach)
            lo, hi = (
                next((lo, hi) for lo, hi in reach if lo <= begin <= hi)
                if any(lo <= begin <= hi for lo, hi in reach)
                else (0.0, 0.0)
            )
            if hi - lo < 10.0 or not lo + 0.1 * (hi - lo) < begin < hi - 0.1 * (hi - lo):
                return slider_crank(random)
            reach = (*(i for i in reach if i != (lo, hi)), (lo, hi))
    drive = crank_spelling(random, "C", o, r, "U")
    return Mechanism("slider-crank", things, f"R.A = C.P; {end}", drive, reach, 360.0, None, cut)


def slider_driven(random) -> Mechanism:
    """The slider drives the crank: its distance from the crank's centre must lie between |r - l| and r + l."""
    r, rod = random.uniform(30, 80, 2)
    o = random.uniform(-50, 50, 2)
    e = random.uniform(-0.5, 0.5) * (r + rod)
    far = math.sqrt((r + rod) ** 2 - e * e)
    near = math.sqrt((r - rod) ** 2 - e * e) if abs(e) < abs(r - rod) else 0.0
    reach = ((near, far), (-far, -near)) if near > 0 else ((-far, far),)
    lo, hi = reach[0]
    begin = lo + random.uniform(0.3, 0.7) * (hi - lo)
    b = o + np.array([begin, e])
    p = circle(o, b, r, rod, random.choice([-1, 1]))
    things = f"C : .bar O={point(*o)} P={point(*p)}; R : .bar A={point(*p)} B={point(*b)};"
    which = random.integers(0, 4)
    if which == 0:
        drive = f"R.B = {point(*o)} + [U, {num(e)}];"
    elif which == 1:
        drive = f"R.B.y = {num(o[1] + e)}; R.B.x = {num(o[0])} + U;"
    elif which == 2:
        drive = f"x = U; R.B = {point(*o)} + [x, {num(e)}];"
    else:
        drive = f"R.B - C.O = [U, {num(e)}];"
    return Mechanism("slider-driven", things, f"C.O={point(*o)}; R.A = C.P;", drive, reach)


def dyad(random) -> Mechanism:
    """Two bars between a fixed point and a point whose distance from it is driven: |a - b| to a + b."""
    a, b = random.uniform(30, 90, 2)
    o, way = random.uniform(-100, 100, 2), random.uniform(-180, 180)
    begin = abs(a - b) + random.uniform(0.3, 0.7) * (a + b - abs(a - b))
    direction = np.array([math.cos(math.radians(way)), math.sin(math.radians(way))])
    q = o + begin * direction
    m = circle(o, q, a, b, random.choice([-1, 1]))
    things = f"A : .bar O={point(*o)} M={point(*m)}; B : .bar M={point(*m)} Q={point(*q)};"
    which = random.integers(0, 4)
    if which == 0:
        drive = f"B.Q = {point(*o)} + [U,0].r({num(way)});"
    elif which == 1:
        drive = f"(B.Q - A.O).l = U; B.Q = A.O + [_,0].r({num(way)});"
    elif which == 2:
        drive = f"d = U; B.Q = A.O + [d,0].r({num(way)});"
    else:
        drive = f"B.Q = A.O + {point(*direction)}*(U);"
    reach = ((abs(a - b), a + b), (-a - b, -abs(a - b)))
    if which == 1:  # a length cannot be negative
        reach = ((abs(a - b), a + b),)
        name = "dyad by length"
    else:
        name = "dyad"
    return Mechanism(name, things, f"A.O={point(*o)}; B.M=A.M;", drive, reach)


def slot(random) -> Mechanism:
    """A bar with one end fixed and the other on a level that is driven: no farther away than the bar is long."""
    length = random.uniform(30, 120)
    o = random.uniform(-100, 100, 2)
    way = random.uniform(-70, 70)
    begin = random.uniform(-0.6, 0.6) * length
    side = random.choice([-1, 1])
    angle = math.radians(way)
    across, along = np.array([-math.sin(angle), math.cos(angle)]), np.array([math.cos(angle), math.sin(angle)])
    b = o + begin * across + side * math.sqrt(length**2 - begin**2) * along
    things = f"S : .bar A={point(*o)} B={point(*b)};"
    which = random.integers(0, 3)
    if which == 0:
        drive = f"S.B = {point(*o)} + [_, U].r({num(way)});"
    elif which == 1:
        drive = f"h = U; S.B = {point(*o)} + [s, h].r({num(way)});"
    else:
        drive = f"S.B = {point(*o)} + {point(*along)}*s + {point(*across)}*(U);"
    return Mechanism("slot", things, f"S.A={point(*o)};", drive, ((-length, length),))


def triad(random) -> Mechanism:
    """A four-bar driven by a coordinate of its coupler: one irreducible loop. The reach ends where that coordinate has
    an extremum along the coupler's curve, found here from the crank's angle.
    """
    while True:
        a, b, c, d = random.uniform(30, 120, 4)
        u, v = random.uniform(0.2, 0.8), random.uniform(-0.8, 0.8)
        side = random.choice([-1, 1])

        def joint(theta, a=a, b=b, c=c, d=d, u=u, v=v, side=side):
            p = a * np.array([math.cos(theta), math.sin(theta)])
            q = np.array([d, 0.0])
            gap = float(np.hypot(*(q - p)))
            if not abs(b - c) * 1.02 < gap < (b + c) * 0.98:
                return None
            j = circle(p, q, b, c, side)
            k = j - p
            return p, j, p + u * k + v * np.array([-k[1], k[0]])

        grid = np.radians(np.arange(0, 360, 2.0))
        heights = [joint(t) for t in grid]
        best = None
        start = int(random.integers(0, 180))
        for i in range(start, start + 170):
            here = [heights[j % 180] for j in (i - 1, i, i + 1)]
            if any(h is None for h in here):
                continue
            y0, y1, y2 = (float(h[2][1]) for h in here)
            if y1 > y0 and y1 >= y2:
                best = i
                break
        if best is None:
            continue

        def slope(t, joint=joint):
            h = 1e-5
            return (joint(t + h)[2][1] - joint(t - h)[2][1]) / (2 * h)

        low, high = math.radians(2.0 * (best - 1)), math.radians(2.0 * (best + 1))
        if slope(low) <= 0 or slope(high) >= 0:
            continue
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if slope(middle) > 0 else (low, middle)
        top = float(
            joint(0.5 * (low + high))[2][1]
        )  # an extremum: its height is exact to the square of the angle's error
        where = 0.5 * (low + high) - math.radians(random.uniform(8, 20))
        first = joint(where)
        if first is None:
            continue
        steps = [joint(t) for t in np.linspace(where, 0.5 * (low + high), 12)]
        if any(s is None for s in steps) or any(t[2][1] <= s[2][1] for s, t in itertools.pairwise(steps)):
            continue
        if top - first[2][1] < 2.0:
            continue
        bottom = float(first[2][1]) - 0.2 * (top - float(first[2][1]))
        break
    p, j, m = first
    # positions are as drawn, so that the block begins on the branch meant
    local = np.array([math.hypot(*(j - p)), 0.0])
    things = (
        f"C : .bar O=[0,0] P={point(*p)}; R : .bar O=[{num(d)},0] P={point(*j)};"
        f" L : .plain A={point(*p)} B={point(*j)} M={point(*m)};"
    ).replace(".plain", ".bar")
    del local
    constraints = f"C.O=[0,0]; R.O=[{num(d)},0]; L.A=C.P; L.B=R.P;"
    which = random.integers(0, 3)
    drive = ["L.M.y = U;", "h = U; L.M.y = h;", "L.M = [_, U];"][which]
    # below the drawing the quantity is not driven farther than the curve is known to be monotonic
    del bottom
    surely = a + math.hypot(u, v) * b + 1.0
    return Mechanism("triad", things, constraints, drive, ((float(m[1]) - 1e-9, top),), 0.0, surely)


MECHANISMS = (four_bar, slider_crank, slider_driven, dyad, slot, triad)


# --- ways of driving ------------------------------------------------------------------------------------------------


def linear(u0: float, u1: float, end: float) -> Profile:
    """From u0 to u1 at constant speed."""
    v = (u1 - u0) / end
    return Profile("linear", ((0.0, f"{num(u0)} + {num(v)}*.t"),), lambda t: u0 + v * t, lambda u: [(u - u0) / v], end)


def sine(u0: float, amplitude: float, rate: float, end: float) -> Profile:
    """Around u0, beginning there."""

    def crossings(u: float) -> list[float]:
        ratio = (u - u0) / amplitude
        if not -1.0 <= ratio <= 1.0:
            return []
        first = math.degrees(math.asin(ratio))
        return [(base + 360 * k) / rate for base in (first, 180 - first) for k in range(-2, 50)]

    return Profile(
        "sine",
        ((0.0, f"{num(u0)} + {num(amplitude)}*.sin({num(rate)}*.t)"),),
        lambda t: u0 + amplitude * math.sin(math.radians(rate * t)),
        crossings,
        end,
    )


def stepped(u0: float, u1: float, at: float, end: float) -> Profile:
    """u0 until ``at``, u1 from then on."""
    return Profile(
        "stepped",
        ((0.0, num(u0)), (at, num(u1))),
        lambda t: u0 if t < at else u1,
        lambda u: [at] if min(u0, u1) <= u <= max(u0, u1) else [],
        end,
    )


def later(u0: float, u1: float, at: float, end: float) -> Profile:
    """u0 until ``at``, then on to u1 at constant speed."""
    v = (u1 - u0) / (end - at)
    return Profile(
        "later",
        ((0.0, num(u0)), (at, f"{num(u0)} + {num(v)}*.t")),
        lambda t: u0 if t < at else u0 + v * (t - at),
        lambda u: [at + (u - u0) / v],
        end,
    )


def back(u0: float, u1: float, end: float) -> Profile:
    """From u1, which is out of reach, to u0, at constant speed."""
    return replace_name(linear(u1, u0, end), "back")


def replace_name(profile: Profile, name: str) -> Profile:
    return Profile(name, profile.steps, profile.value, profile.crossings, profile.end)


def gaps_of(mechanism: Mechanism, profile: Profile) -> tuple[Interval, ...]:
    """The times without a solution, in closed form."""
    times = sorted({t for end in mechanism.ends() for t in profile.crossings(end) if 0.0 < t < profile.end})
    edges = [0.0, *times, profile.end]
    gaps: list[Interval] = []
    for low, high in itertools.pairwise(edges):
        if high - low < 1e-12:
            continue
        if not mechanism.solvable(profile.value(0.5 * (low + high))):
            if gaps and gaps[-1][1] == low:
                gaps[-1] = gaps[-1][0], high
            else:
                gaps.append((low, high))
    return tuple(gaps)


def made(mechanism: Mechanism, profile: Profile) -> Case:
    drive = mechanism.drive
    body = []
    for place, (time, expression) in enumerate(profile.steps):
        chosen = drive.replace("U", f"({expression})")
        body.append(f"@{num(time)} " + (mechanism.constraints if place == 0 else "") + " " + chosen)
    text = f".config(8);\n{mechanism.things}\n" + "\n".join(body) + f"\n@{num(profile.end)}"
    return Case(f"{mechanism.name} {profile.name}", text, gaps_of(mechanism, profile), profile.end, mechanism.cut)


def cases(count: int, seed: int):
    """``count`` random cases: every mechanism, every way of driving, limits missed by 1e-12 to 50 %."""
    random = np.random.default_rng(seed)
    ways = ["linear", "sine", "stepped", "later", "beyond", "back", "touch", "hair"]
    made_so_far = 0
    while made_so_far < count:
        mechanism = MECHANISMS[made_so_far % len(MECHANISMS)](random)
        way = ways[int(random.integers(0, len(ways)))]
        if mechanism.cut:
            way = ("linear", "later")[made_so_far % 2]
        if mechanism.surely is not None and way == "back":
            way = "sine"
        low, high = next((lo, hi) for lo, hi in (mechanism.reach[-1:] if mechanism.period else mechanism.reach[:1]))
        width = high - low
        u0 = low + random.uniform(0.3, 0.7) * width
        if mechanism.name == "triad":
            u0 = low + 1e-9
        down = random.random() < 0.4 and mechanism.name != "triad"
        limit = low if down else high
        past = (
            (limit - u0) * 10.0 ** random.uniform(-9, -0.3)
            if random.random() < 0.5
            else (limit - u0) * random.uniform(0.02, 0.5)
        )
        end = float(random.choice([1.0, 2.0, 3.7]))
        if mechanism.surely is not None and way in ("stepped", "beyond"):
            past = mechanism.surely * 1.2 - limit if way == "stepped" else 20.0 * mechanism.surely
        if way == "linear":
            profile = linear(u0, limit + past, end)
        elif way == "sine":
            profile = sine(u0, limit + past - u0, float(random.uniform(60, 400)) / end, end)
            if mechanism.name == "triad":
                profile = sine(u0, limit + past - u0, float(random.uniform(80, 175)) / end, end)
        elif way == "stepped":
            profile = stepped(u0, limit + past, end / 2, end)
        elif way == "later":
            profile = later(u0, limit + past, end / 3, end)
        elif way == "beyond":
            profile = replace_name(linear(limit + 0.1 * past, limit + past, end), "beyond")
        elif way == "back":
            profile = back(u0, limit + past, end)
        elif way == "touch":
            rate = 100.0 if mechanism.surely is not None else float(random.choice([90, 180, 360]))
            profile = replace_name(sine(u0, limit - u0, rate / end, end), "touch")
        else:  # the drive comes within a hair of the limit, or passes it by one
            past = (limit - u0) * 10.0 ** random.uniform(-12, -6) * random.choice([-1, 1])
            rate = 100.0 if mechanism.surely is not None else 180.0
            profile = replace_name(sine(u0, limit + past - u0, rate / end, end), "hair")
        made_so_far += 1
        yield made(mechanism, profile)
