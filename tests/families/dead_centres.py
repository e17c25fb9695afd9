"""Linkages that are drawn at singular poses, and what can leave them: told by Newton's method from many starts, for the
places of the joints, on its own equations. A solution belongs to a path from the pose if its distance from there goes
to zero with the drive's travel.
"""

from __future__ import annotations

import itertools
import math
import random
from dataclasses import dataclass, field

import numpy as np

Place = tuple[float, float]


@dataclass(frozen=True)
class Linkage:
    """``places`` of joints; ``bodies`` with their joints; joints of the ``ground``; what is driven: the first body of
    ``bodies`` turns about its first joint, or ``pushed`` joint moves along the direction that is given; ``guides`` are
    lines through joints, as directions.
    """

    places: dict[str, Place]
    bodies: dict[str, tuple[str, ...]]
    ground: tuple[str, ...]
    pushed: tuple[str, Place] | None = None
    guides: dict[str, Place] = field(default_factory=dict)

    def moved(self, by: Place = (0.0, 0.0), turn: float = 0.0, size: float = 1.0, mirror: bool = False) -> Linkage:
        c, s, k = math.cos(math.radians(turn)), math.sin(math.radians(turn)), -1.0 if mirror else 1.0

        def turned(p: Place) -> Place:
            return (size * (c * k * p[0] - s * p[1]), size * (s * k * p[0] + c * p[1]))

        places = {j: (by[0] + turned(p)[0], by[1] + turned(p)[1]) for j, p in self.places.items()}
        pushed = self.pushed and (self.pushed[0], turned(self.pushed[1]))
        return Linkage(places, self.bodies, self.ground, pushed, {j: turned(d) for j, d in self.guides.items()})

    def text(self, rate: float, order: int = 0, fps: float = 20.0, seconds: float = 0.5) -> str:
        """The script that drives it, at ``rate`` degrees (or percent of the push) per second."""
        rng = random.Random(order)

        def at(p: Place) -> str:
            return f"[{p[0]:.17g},{p[1]:.17g}]"

        definitions: list[str] = []
        statements: list[str] = []
        first: dict[str, str] = {}
        names = list(self.bodies)
        if order:
            rng.shuffle(names)
        for body in names:
            joints = self.bodies[body]
            definitions.append(f"{body}: .bar " + " ".join(f"{j}={at(self.places[j])}" for j in joints) + ";")
            for j in joints:
                if j in self.ground:
                    statements.append(f"{body}.{j} = {at(self.places[j])};")
                elif j in first:
                    pair = [f"{body}.{j}", f"{first[j]}.{j}"]
                    if order:
                        rng.shuffle(pair)
                    statements.append(" = ".join(pair) + ";")
                else:
                    first[j] = body
        for j, d in self.guides.items():
            p = self.places[j]
            statements.append(f".across({first[j]}.{j}, {at(p)}, {at((p[0] + d[0], p[1] + d[1]))}) = 0;")
        if self.pushed:
            j, d = self.pushed
            p = self.places[j]
            ways = [f"{a:.17g}{b * rate / 100.0:+.17g}*.t" for a, b in zip(p, d, strict=True)]
            statements.append(f"{first[j]}.{j} = [{ways[0]},{ways[1]}];")
        else:
            statements.append(f"{next(iter(self.bodies))}.angle = {rate:.17g}*.t;")
        if order:
            rng.shuffle(statements)
        return (
            f".config({fps:g});\n" + "\n".join(definitions) + "\n@0 " + "\n   ".join(statements) + f"\n@{seconds:g}\n"
        )

    @property
    def size(self) -> float:
        places = np.array(list(self.places.values()))
        return float(np.max(np.ptp(places, axis=0)))

    def equations(self):
        """``residual(x, s)`` (S, m) and ``jacobian(x, s)`` (S, m, n), without unit, for free joints' places x (S, n) at
        the travel s (rad, or part of the push), and the drawn x (n,).
        """
        size, names = self.size, list(self.places)
        drawn = np.array([self.places[j] for j in names], dtype=float)
        crank = () if self.pushed else next(iter(self.bodies.values()))
        led = {*self.ground, *crank, *([self.pushed[0]] if self.pushed else [])}
        free = [n for n, j in enumerate(names) if j not in led]
        rows = [joints for n, joints in enumerate(self.bodies.values()) if self.pushed or n]
        # three bars for a ternary body, two more for each joint more
        pairs = [(a, b) for js in rows for a, b in itertools.combinations(js, 2) if a in js[:2]]
        first, second = (np.array([names.index(p[k]) for p in pairs]) for k in (0, 1))
        guided = [names.index(j) for j in self.guides]
        across = np.array([(d[1], -d[0]) for d in self.guides.values()]).reshape(-1, 2)
        across = across / np.hypot(*across.T)[:, None]
        numbers = np.arange(len(pairs))

        def at(x, s):
            where = np.repeat(drawn[None], len(x), axis=0)
            c, q = math.cos(s), math.sin(s)
            for j in crank[1:]:
                o = drawn[names.index(crank[0])]
                where[:, names.index(j)] = o + np.array([[c, -q], [q, c]]) @ (drawn[names.index(j)] - o)
            if self.pushed:
                where[:, names.index(self.pushed[0])] += s * np.array(self.pushed[1])
            where[:, free] = x.reshape(len(x), -1, 2)
            return where

        def residual(x, s):
            where = at(x, s)
            now, then = where[:, second] - where[:, first], drawn[second] - drawn[first]
            lengths = ((now + then) * (now - then)).sum(axis=2) / size**2
            return np.concatenate([lengths, ((where - drawn)[:, guided] * across).sum(axis=2) / size], axis=1)

        def jacobian(x, s):
            """Times the size."""
            where = at(x, s)
            found = np.zeros((len(x), len(pairs) + len(guided), len(names), 2))
            found[:, numbers, second] = 2.0 * (where[:, second] - where[:, first]) / size
            found[:, numbers, first] = -found[:, numbers, second]
            found[:, len(pairs) + np.arange(len(guided)), guided] = across
            return found[:, :, free].reshape(len(x), found.shape[1], -1)

        return residual, jacobian, drawn[free].ravel()

    def distances(self, travel: float, starts: int = 80) -> list[float]:
        """How far from the drawn pose, of its size, the solutions near by are after the drive's ``travel``."""
        residual, jacobian, drawn = self.equations()
        rng, size = np.random.default_rng(0), self.size
        radii = np.array([0.0, *(abs(travel) ** p * k for p in (1.0, 0.5, 1 / 3) for k in (0.3, 1.0, 3.0))])
        x = drawn + rng.normal(size=(starts, len(drawn))) * np.resize(radii, starts)[:, None] * size
        most = np.ones(starts)
        for _ in range(40):
            step = (np.linalg.pinv(jacobian(x, travel), rcond=1e-13) @ residual(x, travel)[..., None])[..., 0]
            most = np.max(np.abs(step), axis=1)
            x = x - size * step * np.minimum(1.0, 0.3 / np.maximum(most, 1e-300))[:, None]
        good = (np.max(np.abs(residual(x, travel)), axis=1) < 1e-13) & (most < 1e-10)
        found: list[np.ndarray] = []
        for one in x[good]:
            if not any(np.max(np.abs(one - other)) < 1e-7 * size for other in found):
                found.append(one)
        return sorted(float(np.max(np.abs(one - drawn))) / size for one in found)

    def lasting(self, sign: int) -> bool:
        """Whether all paths that leave the drawn pose go on for a while."""
        known = self.paths(sign)
        return all(sum(d < 0.3 for d in self.distances(sign * travel)) >= known for travel in (1e-4, 1e-3, 1e-2))

    def paths(self, sign: int) -> int:
        """How many paths leave the drawn pose with this sign of the drive."""
        far, near, nearest = (self.distances(sign * travel) for travel in (1e-3, 1e-5, 1e-6))
        if not any(
            d < 0.2 for d in far
        ):  # what solves the equations to rounding near by, and not farther on, is no path
            return 0
        return sum(d < 0.2 and not any(abs(d - e) < 0.25 * d for e in nearest) for d in near)


def fourbar(rng: random.Random) -> Linkage:
    """Coupler and rocker in one line: a fold, or a change point where the drive passes it."""
    a, d = (rng.randint(-80, 80), rng.randint(30, 90)), (rng.randint(-4, 4), rng.randint(1, 5))
    k, m = rng.choice([5, 10, 15, 20, -5, -10]), rng.choice([5, 7, 12, -7, -12, -17, 25])
    b = (a[0] + k * d[0], a[1] + k * d[1])
    places = {"O": (0, 0), "A": a, "B": b, "C": (b[0] + m * d[0], b[1] + m * d[1])}
    return Linkage(places, {"K": ("O", "A"), "L": ("A", "B"), "M": ("B", "C")}, ("O", "C"))


def slidercrank(rng: random.Random) -> Linkage:
    """Driven by its crank, with the rod square to the guide; or by its slide, crank and rod in one line."""
    a, d = (rng.randint(-60, 60), rng.randint(20, 80)), (rng.randint(-4, 4), rng.randint(1, 5))
    k = rng.choice([8, 12, 20, -10, -15, 25])
    if rng.random() < 0.5:
        places = {"O": (0, 0), "A": a, "B": (a[0] + k * d[0], a[1] + k * d[1])}
        return Linkage(places, {"K": ("O", "A"), "L": ("A", "B")}, ("O",), guides={"B": (-d[1], d[0])})
    m = rng.choice([3, 6, 30, 40, -7])
    places = {"O": (0, 0), "A": (m * d[0], m * d[1]), "B": ((m + k) * d[0], (m + k) * d[1])}
    way = (d[0] * 10, d[1] * 10) if rng.random() < 0.7 else (rng.randint(-50, 50), rng.randint(10, 60))
    return Linkage(places, {"K": ("O", "A"), "L": ("A", "B")}, ("O",), pushed=("B", way))


def toggle(rng: random.Random) -> Linkage:
    """A crank drives the knee's rod; the toggle's two links stand in one line (a press at its closed pose), or the
    crank's rod and one of them.
    """
    h, m = rng.randint(40, 90), rng.randint(40, 90)
    knee, top, ram = (0, 0), (0, h), (0, -m)
    crank = (rng.randint(80, 140), rng.randint(-40, 40))
    pin = (crank[0] + rng.randint(-30, 30), crank[1] + rng.choice([-30, -20, 20, 30]))
    bodies = {"K": ("O", "A"), "R": ("A", "B"), "U": ("C", "B"), "V": ("B", "D")}
    if rng.random() < 0.5:  # the rod along the upper link
        f = rng.choice([0.5, 1.5, 2.0, -0.5, -1.25])
        pin = (knee[0] + f * (knee[0] - top[0]), knee[1] + f * (knee[1] - top[1]))
        crank = (pin[0] + rng.randint(20, 60), pin[1] + rng.randint(-40, 40))
        ram = (rng.randint(-90, -40), rng.randint(-60, 30))
    places = {"O": crank, "A": pin, "B": knee, "C": top, "D": ram}
    return Linkage(places, bodies, ("O", "C"), guides={"D": (0, 10)})


def sixbar(rng: random.Random) -> Linkage:
    """A four-bar with a ternary coupler or rocker that carries a dyad, which is in one line; or the four-bar is."""
    base = fourbar(rng)
    p = base.places
    d = (rng.randint(-4, 4), rng.randint(1, 5))
    x = (p["B"][0] + rng.randint(-70, 70), p["B"][1] + rng.randint(-70, 70))
    k, m = rng.choice([8, 12, -9]), rng.choice([7, 11, -14, 20])
    if rng.random() < 0.5:  # the first loop is in no special pose
        p = {**p, "C": (p["C"][0] + rng.choice([-45, 40, 55]), p["C"][1] + rng.choice([-30, 25]))}
    else:
        k, m, d = 1, 1, (rng.randint(40, 70), rng.randint(-30, 30))
    y = (x[0] + k * d[0], x[1] + k * d[1])
    z = (y[0] + m * d[0], y[1] + m * d[1] + (0 if abs(k) > 1 else 50))
    places = {**p, "X": x, "Y": y, "Z": z}
    bodies = {**base.bodies, "S": ("X", "Y"), "T": ("Y", "Z")}
    holder = rng.choice("LM")
    bodies[holder] = (*bodies[holder], "X")
    return Linkage(places, bodies, ("O", "C", "Z"))


def triad(rng: random.Random, parallel: bool = False) -> Linkage:
    """A platform on three bars that meet in a point, or are parallel."""
    while True:
        d = (rng.randint(-3, 3), rng.randint(1, 4))
        k = (rng.randint(-60, 60), rng.randint(-60, 60))
        tops, feet = [], []
        for _ in range(3):
            if parallel:
                p = (rng.randint(-100, 100), rng.randint(-100, 100))
                n = rng.choice([-30, -20, -12, 10, 15, 25, 40])
                tops.append(p)
                feet.append((p[0] + n * d[0], p[1] + n * d[1]))
            else:
                way, far = (rng.randint(-8, 8), rng.randint(-8, 8)), rng.sample([-12, -8, -5, 4, 7, 10, 13], 2)
                tops.append((k[0] + far[0] * way[0], k[1] + far[0] * way[1]))
                feet.append((k[0] + far[1] * way[0], k[1] + far[1] * way[1]))
        foot = feet[0]
        o = (foot[0] + rng.randint(-60, 60), foot[1] + rng.randint(-60, 60))
        places = dict(zip("OABCDEF", (o, *tops, *feet), strict=True))
        bodies = {"K": ("O", "D"), "L": ("D", "A"), "P": ("A", "B", "C"), "M": ("E", "B"), "N": ("F", "C")}
        a, b, c = tops
        if abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) > 500:
            return Linkage(places, bodies, ("O", "E", "F"))


def mirrored_triad(rng: random.Random) -> Linkage:
    a, c = rng.randint(20, 60), rng.randint(20, 110)
    h, k = rng.randint(-40, 90), rng.randint(-60, 60)
    e, o = rng.randint(-100, 100), rng.randint(-140, 140)
    places = {"O": (0, o), "A": (-a, h), "B": (a, h), "C": (0, k), "D": (0, e), "E": (-c, 0), "F": (c, 0)}
    bodies = {"K": ("O", "D"), "L": ("D", "C"), "P": ("A", "B", "C"), "M": ("E", "A"), "N": ("F", "B")}
    return Linkage(places, bodies, ("O", "E", "F"))


def butterfly(rng: random.Random) -> Linkage:
    """A double butterfly, mirrored about a line: ternary base O E F, ternary platform A B C, crank and one bar on the
    line between them, and on each side a ternary wing, which hangs on the base by a bar; the wings meet on the line.
    """

    def pair(names: str) -> dict[str, Place]:
        x, y = rng.randint(2, 12) * 10, rng.randint(-12, 12) * 10
        return {names[0]: (-x, y), names[1]: (x, y)}

    places = {j: (0, rng.randint(-12, 12) * 10) for j in "ODCY"} | pair("EF") | pair("WX") | pair("AB")
    bodies = {"K": "OD", "L": "DC", "P": "CAB", "R": "EW", "S": "FX", "M": "WAY", "N": "XBY"}
    return Linkage(places, {name: tuple(joints) for name, joints in bodies.items()}, ("O", "E", "F"))


def eightbar(rng: random.Random) -> Linkage:
    """Any eight-bar without a dyad that has a mirror: its chain has an involution that keeps base and crank."""
    while True:
        inverse = {0: 0, 1: 1}
        rest = [2, 3, 4, 5, 6, 7]
        rng.shuffle(rest)
        pairs = rng.choice([2, 3, 3, 3])
        for a, b in zip(rest[: 2 * pairs : 2], rest[1 : 2 * pairs : 2], strict=True):
            inverse |= {a: b, b: a}
        inverse |= {a: a for a in rest[2 * pairs :]}
        edges, pool = {(0, 1)}, list(itertools.combinations(range(8), 2))
        rng.shuffle(pool)
        for a, b in pool:
            both = {(a, b), tuple(sorted((inverse[a], inverse[b])))}
            if len(edges | both) <= 10:
                edges |= both
        degree = [sum(v in e for e in edges) for v in range(8)]
        if len(edges) != 10 or min(degree) < 2 or degree[1] != 2 or max(degree) > 4:
            continue
        if any(degree[a] == degree[b] == 2 and a > 1 for a, b in edges):
            continue
        subsets = (s for k in range(3, 8) for s in itertools.combinations(range(8), k))
        if any(3 * (len(s) - 1) - 2 * sum(a in s and b in s for a, b in edges) < 1 for s in subsets):
            continue
        places: dict[str, Place] = {}
        for a, b in sorted(edges):
            image = sorted((inverse[a], inverse[b]))
            if [a, b] == image:
                places[f"J{a}{b}"] = (0, rng.randint(-12, 12) * 10)
            elif f"J{a}{b}" not in places:
                x, y = rng.choice([-1, 1]) * rng.randint(1, 12) * 10, rng.randint(-12, 12) * 10
                places |= {f"J{a}{b}": (x, y), f"J{image[0]}{image[1]}": (-x, y)}
        bodies = {f"B{n}": tuple(f"J{a}{b}" for a, b in sorted(edges) if n in (a, b)) for n in range(1, 8)}
        return Linkage(places, bodies, tuple(f"J{a}{b}" for a, b in sorted(edges) if a == 0))


KINDS = {
    "four-bar": fourbar,
    "slider-crank": slidercrank,
    "toggle": toggle,
    "six-bar": sixbar,
    "triad": triad,
    "parallel": lambda rng: triad(rng, parallel=True),
    "mirrored": mirrored_triad,
    "butterfly": butterfly,
    "eight-bar": eightbar,
}


def linkage(kind: str, seed: int) -> Linkage:
    """The linkage with this seed, at a pose where one rank, and no more, is lost; moved, turned or scaled too."""
    rng = random.Random(f"{kind}{seed}")
    while True:
        made = KINDS[kind](rng)
        sides = [
            math.dist(made.places[a], made.places[b])
            for b in made.bodies.values()
            for a, b in itertools.combinations(b, 2)
        ]
        if min(sides) < 12 or len(set(made.places.values())) < len(made.places):
            continue
        _, jacobian, x = made.equations()
        singular = np.linalg.svd(jacobian(x[None], 0.0)[0])[1]
        if singular[-1] > 1e-9 * singular[0] or (len(singular) > 1 and singular[-2] < 2e-3 * singular[0]):
            continue
        if seed % 2:
            turn = rng.choice([0.0, 90.0, 180.0, 37.0, 211.5])
            made = made.moved(
                (rng.randint(-300, 300), 77.0), turn, rng.choice([1.0, 0.25, 3.0, 40.0]), rng.random() < 0.5
            )
        return made
