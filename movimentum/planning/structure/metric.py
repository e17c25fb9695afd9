"""How far anchors move: the quadratic form that least motion minimises."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import PoseCos, PosePart, PoseSin, PoseX, PoseY
from movimentum.planning.structure.linear_rows import LinearMap
from movimentum.records import dataclass
from movimentum.tolerances import DEFINITE, UNWEIGHTED

Entries = tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]
"""Rows, columns and values of a sparse matrix, each place at most once."""


@dataclass(frozen=True, eq=False)
class Metric:
    """The sum of squared speeds of all anchors of the things in a block, as v' M v + 2 v' C w + (what v does not
    change): v (n,) are the speeds of the block's core, w (p,) those that the unknowns ``coupled`` have if the core
    stands still (known poses, and what is eliminated).

    ``form`` has the entries of M (n, n), ``coupling`` those of C (n, p).
    """

    size: int
    form: Entries
    coupling: Entries
    coupled: tuple[int, ...]

    @cached_property
    def dense(self) -> FloatArray:
        """M."""
        result = np.zeros((self.size, self.size))
        result[self.form[0], self.form[1]] = self.form[2]
        return result

    @cached_property
    def weighted(self) -> NDArray[np.bool_]:
        """(n,) which unknowns move an anchor."""
        on = self.form[0] == self.form[1]
        diagonal = np.zeros(self.size)
        diagonal[self.form[0][on]] = self.form[2][on]
        return diagonal > 2.0 * UNWEIGHTED * np.max(diagonal, initial=0.0)

    @cached_property
    def whitening(self) -> tuple[FloatArray, FloatArray]:
        """(n, n) the W with W' M W = 1, and how much of each unknown moves the anchors by one (n,)."""
        factor = np.asarray(np.linalg.cholesky(self.dense), dtype=np.float64)
        return np.asarray(np.linalg.inv(factor).T, dtype=np.float64), 1.0 / np.sqrt(np.diag(self.dense))

    def applied(self, v: FloatArray) -> FloatArray:
        """M v (n,) for v (n,)."""
        rows, columns, values = self.form
        return np.asarray(np.bincount(rows, values * v[columns], self.size), dtype=np.float64)

    def square(self, v: FloatArray) -> float:
        """v' M v."""
        return float(v @ self.applied(v))

    def pull(self, speeds: FloatArray) -> FloatArray:
        """C w (n,) for w (p,)."""
        rows, columns, values = self.coupling
        return np.asarray(np.bincount(rows, values * speeds[columns], self.size), dtype=np.float64)


def anchor_metric(system: System, core: Sequence[int], linear: LinearMap | None = None) -> Metric:
    """The metric of a block with the unknowns ``core`` and the eliminated ones of ``linear``."""
    eliminated = {} if linear is None else dict(zip(linear.targets, linear.slopes, strict=True))
    resting = set(eliminated) - (linear.driven if linear is not None else frozenset[int]())
    place = {n: k for k, n in enumerate(core)}
    mine = {*place, *eliminated}
    count = len(core)
    coupled: dict[int, int] = {}
    form: dict[tuple[int, int], float] = {}
    coupling: dict[tuple[int, int], float] = {}
    poses = (system.unknowns[n].payload for n in mine)
    for number in sorted({payload.thing for payload in poses if isinstance(payload, PosePart)}):
        thing = system.scene.things[number]
        numbers = [system.number_of.get(kind(number)) for kind in (PoseX, PoseY, PoseCos, PoseSin)]
        frame = system.frame(thing.number)
        for anchor in thing.anchors:
            dx, dy = frame.local(anchor.local)
            for row in ((1.0, 0.0, dx, -dy), (0.0, 1.0, dy, dx)):
                by_core: dict[int, float] = {}
                by_coupled: dict[int, float] = {}
                for factor, n in zip(row, numbers, strict=True):
                    if n is None or factor == 0.0:
                        continue
                    if n in place:
                        by_core[place[n]] = by_core.get(place[n], 0.0) + factor
                        continue
                    if n not in resting:
                        by_coupled[coupled.setdefault(n, len(coupled))] = factor
                    for k, slope in eliminated.get(n, ()):
                        by_core[k] = by_core.get(k, 0.0) + factor * slope
                for i, a in by_core.items():
                    for j, b in by_core.items():
                        form[i, j] = form.get((i, j), 0.0) + a * b
                    for j, b in by_coupled.items():
                        coupling[i, j] = coupling.get((i, j), 0.0) + a * b
    largest = max((form.get((k, k), 0.0) for k in range(count)), default=0.0) or 1.0
    for k in range(count):
        own = form.get((k, k), 0.0)
        form[k, k] = own * (1.0 + DEFINITE) if own > DEFINITE * largest else UNWEIGHTED * largest
    return Metric(count, _entries(form), _entries(coupling), tuple(coupled))


def _entries(values: Mapping[tuple[int, int], float]) -> Entries:
    places = np.array(list(values), dtype=np.intp).reshape(-1, 2)
    return places[:, 0], places[:, 1], np.array(list(values.values()), dtype=np.float64)
