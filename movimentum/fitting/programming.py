"""Fits whose requirements decide: sequential quadratic programming (Nocedal & Wright, Numerical Optimization, 18)."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.fitting.search import Search
from movimentum.fitting.sides import Evaluation

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
                found[:] = [worst, np.clip(z[:-1], 0.0, 1.0)]
            return self._limits(here)[0] + z[-1]

        def slopes(z: FloatArray) -> FloatArray:
            changes = self._limits(self._at(z[:-1]))[1]
            return np.concatenate([changes, np.ones((len(changes), 1))], axis=1)

        end = np.append(np.zeros(len(point)), 1.0)
        start = np.append(point, found[0] / size)
        self._minimized(end.dot, lambda _: end, start, left, slopes, [(0.0, None)])
        return np.asarray(found[1])

    def nearest_goals(self, point: FloatArray) -> FloatArray:
        """Where goals are missed least, from a ``point`` at which all requirements are met."""
        merit, size = self.merit, self.search.size
        first = self.search.judged(point[None])
        found = [float(first.costs[0]), point]

        def cost(u: FloatArray) -> float:
            here = self._at(u)
            value = float(merit.cost(np.nan_to_num(here.sides, nan=FAR * size))[0])
            if value < found[0] and merit.worst(here.sides)[0] == 0.0:
                found[:] = [value, np.clip(u, 0.0, 1.0)]
            return value / size**2

        def gradient(u: FloatArray) -> FloatArray:
            here = self._at(u)
            assert here.slopes is not None
            off = np.where(merit.goals, merit.missed(here.sides) * merit.scale**2, 0.0)
            total = np.einsum("s,sc->c", np.nan_to_num(off[0]), np.nan_to_num(here.slopes[0]))
            return 2.0 * total / size**2

        def left(u: FloatArray) -> FloatArray:
            return self._limits(self._at(u))[0]

        def slopes(u: FloatArray) -> FloatArray:
            return self._limits(self._at(u))[1]

        self._minimized(cost, gradient, point, left, slopes, [])
        return np.asarray(found[1])

    def _at(self, u: FloatArray) -> Evaluation:
        inside = np.clip(u, 0.0, 1.0)
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
        rows = np.concatenate([(merit.allowed - sides)[self.required], (merit.allowed + sides)[self.equal]]) / size
        return rows, np.concatenate([-slopes[self.required], slopes[self.equal]])

    @staticmethod
    def _minimized(
        value: Callable[[FloatArray], float],
        gradient: Callable[[FloatArray], FloatArray],
        start: FloatArray,
        left: Callable[[FloatArray], FloatArray],
        slopes: Callable[[FloatArray], FloatArray],
        more: list[tuple[float, float | None]],
    ) -> None:
        minimize: Any = import_module("scipy.optimize").minimize
        limits: dict[str, Any] = {"type": "ineq", "fun": left, "jac": slopes}
        minimize(
            value,
            start,
            jac=gradient,
            bounds=[(0.0, 1.0)] * (len(start) - len(more)) + more,
            constraints=[limits],
            method="SLSQP",
            options={"maxiter": ITERATIONS, "ftol": 1e-12},
        )
