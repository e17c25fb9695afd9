"""Fits whose requirements decide: sequential quadratic programming (Nocedal & Wright, Numerical Optimization, 18)."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.fitting.aims import Evaluation
from movimentum.fitting.search import Candidates, Search
from movimentum.tolerances import PROGRAM_SETTLED

ITERATIONS = 100
FAR = 10.0
"""In sizes of the scene: what is off where nothing moves."""


class Program:
    """Fits of ``search`` from one point (C,) of the unit box. All results are points; the point itself where none is
    found that is better.
    """

    def __init__(self, search: Search) -> None:
        self.search, self.merit = search, search.merit
        self.required = self.merit.required
        self.equal = self.merit.equal & self.merit.required
        self._known: dict[bytes, Evaluation] = {}

    def least_off(self, point: FloatArray) -> FloatArray:
        """Where the requirement that is off most is off least: min s, with all of them off by s at most."""
        merit, size = self.merit, self.search.size
        found = [float(merit.worst(self.search.at(point[None]).sides)[0]), point]

        def left(z: FloatArray) -> FloatArray:
            here = self._at(z[:-1])
            worst = float(merit.worst(here.sides)[0])
            if worst < found[0]:
                found[:] = [worst, self.search.inside(z[:-1])]
            return self._limits(here)[0] + z[-1]

        def slopes(z: FloatArray) -> FloatArray:
            changes = self._limits(self._at(z[:-1]))[1]
            return np.concatenate([changes, np.ones((len(changes), 1))], axis=1)

        end = np.append(np.zeros(len(point)), 1.0)
        start = np.append(point, found[0] / size)
        self._minimized(end.dot, lambda _: end, start, left, slopes, [(0.0, None)])
        return np.asarray(found[1])

    def nearest_goals(self, point: FloatArray) -> FloatArray:
        """Where goals are missed least, from a ``point`` at which all requirements are met. What is to be as small as
        can be is one more unknown each, which none of its sides may exceed.
        """
        merit = self.merit
        first = self.search.judged(point[None])
        count, extremes = len(point), merit.extremes
        found = [float(first.costs[0]) if first.worst[0] == 0.0 else np.inf, point]
        units = np.array([each.spread for each in extremes])
        linear = np.array([each.weight for each in extremes]) * units
        unit = float(np.sum(linear)) or self.search.size**2
        above = np.zeros((len(merit.scale), len(extremes)))
        for k, each in enumerate(extremes):
            above[each.sides, k] = units[k]
        chosen = above.any(axis=1)

        def squares(here: Evaluation) -> float:
            off = np.where(merit.goals, merit.missed(here.sides) * merit.scale, 0.0)
            return float(np.sum(np.nan_to_num(off, nan=FAR * self.search.size) ** 2))

        def cost(z: FloatArray) -> float:
            here = self._at(z[:count])
            value = float(merit.cost(np.nan_to_num(here.sides, nan=FAR * self.search.size))[0])
            if value < found[0] and merit.worst(here.sides)[0] == 0.0:
                found[:] = [value, self.search.inside(z[:count])]
            return (squares(here) + float(linear @ z[count:])) / unit

        def gradient(z: FloatArray) -> FloatArray:
            here = self._at(z[:count])
            assert here.slopes is not None
            off = np.where(merit.goals, merit.missed(here.sides) * merit.scale**2, 0.0)
            total = np.einsum("s,sc->c", np.nan_to_num(off[0]), np.nan_to_num(here.slopes[0]))
            return np.concatenate([2.0 * total, linear]) / unit

        def left(z: FloatArray) -> FloatArray:
            here = self._at(z[:count])
            sides = np.nan_to_num(here.sides[0], nan=FAR * self.search.size)
            return np.concatenate([self._limits(here)[0], ((above @ z[count:] - sides) / unit)[chosen]])

        def slopes(z: FloatArray) -> FloatArray:
            here = self._at(z[:count])
            assert here.slopes is not None
            limits = self._limits(here)[1]
            own = np.concatenate([-np.nan_to_num(here.slopes[0]), above], axis=1)[chosen] / unit
            return np.concatenate([np.pad(limits, ((0, 0), (0, len(extremes)))), own])

        sides = np.nan_to_num(self._at(point).sides)
        start = np.append(point, [each.greatest(sides)[0] / each.spread for each in extremes])
        self._minimized(cost, gradient, start, left, slopes, [(None, None)] * len(extremes))
        return np.asarray(found[1])

    def _at(self, u: FloatArray) -> Evaluation:
        inside = self.search.inside(u)
        key = inside.tobytes()
        if key not in self._known:
            self._known = {key: self.search.at(inside[None], slopes=True)}
        return self._known[key]

    def _limits(self, here: Evaluation) -> tuple[FloatArray, FloatArray]:
        """What requirements leave (not below 0 where they hold), in sizes of the scene, and its slopes."""
        merit, size = self.merit, self.search.size
        assert here.slopes is not None
        sides = np.nan_to_num(here.sides[0], nan=FAR * size)
        slopes = np.nan_to_num(here.slopes[0]) / size
        most = np.where(merit.equal, merit.allowed, -merit.shift)
        rows = np.concatenate([(most - sides)[self.required], (merit.allowed + sides)[self.equal]]) / size
        return rows, np.concatenate([-slopes[self.required], slopes[self.equal]])

    def _minimized(
        self,
        value: Callable[[FloatArray], float],
        gradient: Callable[[FloatArray], FloatArray],
        start: FloatArray,
        left: Callable[[FloatArray], FloatArray],
        slopes: Callable[[FloatArray], FloatArray],
        more: list[tuple[float | None, float | None]],
    ) -> None:
        minimize: Any = import_module("scipy.optimize").minimize
        limits: dict[str, Any] = {"type": "ineq", "fun": left, "jac": slopes}
        minimize(
            value,
            start,
            jac=gradient,
            bounds=[*zip(*self.search.bounds, strict=True), *more],
            constraints=[limits],
            method="SLSQP",
            options={"maxiter": ITERATIONS, "ftol": PROGRAM_SETTLED},
        )


def largest(search: Search, found: Candidates) -> Candidates:
    """Candidates brought to where what is to be largest is largest."""
    program = Program(search)
    return search.judged(np.array([program.nearest_goals(point) for point in found.points]).reshape(found.points.shape))
