"""The mechanisms of the solver's benchmark: numbers, programs in the language, and where their points truly are.

A mechanism is a set of numbered points. One of them, the crank's tip, is driven on a circle; rigid bodies and sliders
tie the others. All but the triad can be built up by intersecting circles and lines, one point at a time: ``ops`` says
how, and gives the truth in closed form. Other solvers that are measured get the same object.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Point = tuple[float, float]
Op = tuple[Any, ...]


@dataclass(slots=True)
class Mechanism:
    """Points and what ties them.

    ``pts``      where the points are at the crank's angle ``th0`` (radians); ``fixed``: those that stay
    ``tip``      the driven point, at distance ``r`` from the point ``centre``
    ``bodies``   points that are rigidly connected, ground and crank apart; ``rods``: the same as (i, j, length)
    ``sliders``  (p, a, b): point p stays on the line through the fixed points a and b
    ``ops``      ("cc", t, a, ra, b, rb, side): t at distances ra from a and rb from b, left (+1) or right of a -> b;
                 ("cl", t, a, ra, p, q, side): t on the line p -> q at distance ra from a, ahead (+1) or behind;
                 None where the points cannot be found one by one
    ``arc``      the crank swings by that much (radians) to and fro at even speed; None: it turns once
    ``unk``      the points to be found
    """

    name: str
    pts: list[Point]
    fixed: list[int]
    tip: int
    centre: int
    r: float
    th0: float
    bodies: list[tuple[int, ...]]
    sliders: list[tuple[int, int, int]] = field(default_factory=list)
    ops: list[Op] | None = None
    arc: float | None = None
    rods: list[tuple[int, int, float]] = field(default_factory=list)
    unk: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        for body in self.bodies:
            self.rods += [(i, j, math.dist(self.pts[i], self.pts[j])) for i, j in combinations(body, 2)]
        self.unk = [i for i in range(len(self.pts)) if i not in self.fixed and i != self.tip]

    def json(self) -> dict[str, Any]:
        """All of it, for solvers that run in a process of their own."""
        return asdict(self)

    def thetas(self, frames: int) -> Array:
        """(F,) the crank's angle in each frame."""
        t = np.arange(frames) / frames
        if self.arc is None:
            return self.th0 + 2 * np.pi * t
        return self.th0 + self.arc * np.where(t < 0.25, 4 * t, np.where(t < 0.75, 2 - 4 * t, 4 * t - 4))

    def tips(self, theta: Array) -> Array:
        """(F, 2) the driven point."""
        x, y = self.pts[self.centre]
        return np.stack([x + self.r * np.cos(theta), y + self.r * np.sin(theta)], axis=-1)

    def residual(self, where: Array) -> float:
        """The largest relative error of a length in ``where`` (F, points, 2), missing frames apart; nan if all are."""
        if not np.isfinite(where).all(axis=(1, 2)).any():
            return math.nan
        worst = 0.0
        mean = sum(length for *_, length in self.rods) / len(self.rods)
        with np.errstate(all="ignore"):
            for i, j, length in [*self.rods, (self.tip, self.centre, self.r)]:
                d = np.hypot(*(where[:, i] - where[:, j]).T)
                worst = max(worst, _largest(np.abs(d - length) / length))
            for p, a, b in self.sliders:
                (ux, uy), (wx, wy) = (where[:, b] - where[:, a]).T, (where[:, p] - where[:, a]).T
                worst = max(worst, _largest(np.abs(ux * wy - uy * wx) / np.hypot(ux, uy) / mean))
        return worst

    def truth(self, theta: Array) -> Array:
        """(F, points, 2) where the points are on the branch that they start on."""
        if self.ops is not None:
            return closed_form(self.ops, {i: self.pts[i] for i in self.fixed}, self.tip, self.tips(theta))
        return _stepped(self, theta)


def _largest(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else math.nan


def closed_form(ops: Sequence[Op], fixed: Mapping[int, Point], tip: int, tips: Array) -> Array:
    """(F, points, 2) all points, given the driven one (F, 2); in extended precision, rounded at the end."""
    z: dict[int, Array] = {i: np.full(len(tips), complex(*p), dtype=np.clongdouble) for i, p in fixed.items()}
    z[tip] = tips[:, 0].astype(np.clongdouble) + 1j * tips[:, 1]
    with np.errstate(invalid="ignore"):
        for kind, t, a, ra, *rest in ops:
            if kind == "cc":
                b, rb, side = rest
                d = z[b] - z[a]
                d2 = (d * d.conj()).real
                along = ((ra * ra - rb * rb) / d2 + 1) / 2
                z[t] = z[a] + d * (along + 1j * side * np.sqrt(ra * ra / d2 - along * along))
            else:
                p, q, side = rest
                u = (z[q] - z[p]) / abs(z[q] - z[p])
                w = (z[a] - z[p]) * u.conj()
                z[t] = z[p] + u * (w.real + side * np.sqrt(ra * ra - w.imag**2))
    return np.stack([np.stack([z[i].real, z[i].imag], axis=-1) for i in range(len(z))], axis=1).astype(np.float64)


def _stepped(m: Mechanism, theta: Array, finest: float = math.radians(0.5)) -> Array:
    """The truth where there is no closed form: Newton's method in small steps of the crank."""
    place = {p: k for k, p in enumerate(m.unk)}
    x = np.array(m.pts)
    result = np.empty((len(theta), len(m.pts), 2))
    before = float(theta[0])
    for f, angle in enumerate(theta):
        steps = max(1, math.ceil(abs(angle - before) / finest))
        for step in range(1, steps + 1):
            x[m.tip] = m.tips(np.array(before + (angle - before) * step / steps))
            for _ in range(12):
                jacobian, off = np.zeros((len(m.rods), 2 * len(place))), np.zeros(len(m.rods))
                for e, (i, j, length) in enumerate(m.rods):
                    d = x[i] - x[j]
                    off[e] = d @ d - length * length
                    for p, sign in ((i, 2.0), (j, -2.0)):
                        if p in place:
                            jacobian[e, 2 * place[p] : 2 * place[p] + 2] = sign * d
                move = np.linalg.solve(jacobian, off).reshape(-1, 2)
                x[m.unk] -= move
                if np.abs(move).max() < 1e-12 * m.r:
                    break
        before = float(angle)
        result[f] = x
    return result


def program(m: Mechanism, frames: int) -> str:
    """The mechanism as a program of one second: a bar for the crank and for each body, a coincidence for each joint."""

    def at(i: int) -> str:
        x, y = m.pts[i]
        return f"[{x!r},{y!r}]"

    turn = "360*.t" if m.arc is None else f"{math.degrees(m.arc)!r}*.asin(.sin(360*.t))/90"
    things = [f".config({frames});", f"Crank : .bar O={at(m.centre)} P={at(m.tip)};"]
    step = [f"Crank.O={at(m.centre)}; Crank.angle={turn};"]
    first = {m.tip: "Crank.P"}
    for b, body in enumerate(m.bodies):
        things.append(f"B{b} : .bar " + " ".join(f"p{i}={at(i)}" for i in body) + ";")
        for i in body:
            if i in m.fixed:
                step.append(f"B{b}.p{i}={at(i)};")
            elif i in first:
                step.append(f"B{b}.p{i}={first[i]};")
            else:
                first[i] = f"B{b}.p{i}"
    step += [f"{first[p]}.y={m.pts[a][1]!r};" for p, a, _ in m.sliders]  # all lines here are level
    return "\n".join([*things, "@0", *step, "@1", ""])


def anchors(m: Mechanism) -> dict[int, tuple[str, str]]:
    """The thing and the anchor of `program` that stand for each point that moves."""
    result = {m.tip: ("Crank", "P")}
    for b, body in enumerate(m.bodies):
        for i in body:
            if i not in m.fixed:
                result.setdefault(i, (f"B{b}", f"p{i}"))
    return result


def _dyads(
    name: str,
    fixed: dict[int, Point],
    tip: int,
    centre: int,
    r: float,
    th0: float,
    ops: list[Op],
    bodies: list[tuple[int, ...]],
    sliders: Sequence[tuple[int, int, int]] = (),
    arc: float | None = None,
) -> Mechanism:
    x, y = fixed[centre]
    start = np.array([[x + r * math.cos(th0), y + r * math.sin(th0)]])
    pts = [(float(px), float(py)) for px, py in closed_form(ops, fixed, tip, start)[0]]
    return Mechanism(name, pts, sorted(fixed), tip, centre, r, th0, bodies, list(sliders), ops, arc)


def four_bar() -> Mechanism:
    """A crank-rocker with a coupler point."""
    ops = [("cc", 3, 2, 70, 1, 70, 1), ("cc", 4, 2, 40, 3, 40, 1)]
    return _dyads("four-bar", {0: (0, 0), 1: (90, 0)}, 2, 0, 35, 0.3, ops, [(2, 3, 4), (3, 1)])


def slider_crank() -> Mechanism:
    """An offset slider-crank."""
    fixed = {0: (0.0, 0.0), 1: (0.0, 5.0), 2: (100.0, 5.0)}
    return _dyads("slider-crank", fixed, 3, 0, 20, 0.3, [("cl", 4, 3, 70, 1, 2, 1)], [(3, 4)], [(4, 1, 2)])


def peaucellier() -> Mechanism:
    """Peaucellier's straight line, driven to and fro."""
    ops = [("cc", 3, 0, 100, 2, 40, 1), ("cc", 4, 0, 100, 2, 40, -1), ("cc", 5, 3, 40, 4, 40, 1)]
    bodies = [(0, 3), (0, 4), (2, 3), (2, 4), (3, 5), (4, 5)]
    return _dyads("Peaucellier", {0: (0, 0), 1: (35, 0)}, 2, 1, 35, 0.0, ops, bodies, arc=math.radians(50))


def jansen() -> Mechanism:
    """A leg of Jansen's beach animals."""
    ops = [
        ("cc", 3, 2, 50, 1, 41.5, -1),
        ("cc", 4, 2, 61.9, 1, 39.3, 1),
        ("cc", 5, 3, 55.8, 1, 40.1, -1),
        ("cc", 6, 5, 39.4, 4, 36.7, -1),
        ("cc", 7, 6, 65.7, 4, 49, -1),
    ]
    bodies = [(2, 3), (1, 3, 5), (2, 4), (1, 4), (5, 6), (4, 6, 7)]
    return _dyads("Jansen leg", {0: (0, 0), 1: (-38, -7.8)}, 2, 0, 15, 0.3, ops, bodies)


def triad() -> Mechanism:
    """A platform on three legs, one of them driven: six equations that do not come apart."""
    r = 15.280011403801902
    pts = [
        (0.0, 0.0),
        (95.07727271827241, 1.4369504902535226),
        (-34.85928242598776, -65.83539369902822),
        (r, 0.0),
        (67.7726327832382, 55.51222803168528),
        (21.876155387286033, 92.13981220062261),
        (-4.041788855142872, 42.42131485623513),
    ]
    return Mechanism("triad", pts, [0, 1, 2], 3, 0, r, 0.0, [(3, 4), (5, 1), (6, 2), (4, 5, 6)])


def chain(k: int) -> Mechanism:
    """``k`` four-bars, each driven by the rocker of the one before."""
    fixed: dict[int, Point] = {0: (0, 0), 1: (100, 0)}
    ops: list[Op] = [("cc", 3, 2, 95, 1, 60, 1)]
    bodies: list[tuple[int, ...]] = [(2, 3), (1, 3)]
    last = 3
    for i in range(1, k):
        ground, t = 2 * i + 2, 2 * i + 3
        fixed[ground] = (100.0 * (i + 1), 0.0)
        ops.append(("cc", t, last, 99.0 if i % 2 else 101.0, ground, 60, 1))
        bodies += [(last, t), (ground, t)]
        last = t
    return _dyads(f"chain of {k}", fixed, 2, 0, 20, 0.3, ops, bodies)


MECHANISMS = (four_bar, slider_crank, peaucellier, jansen, triad)
