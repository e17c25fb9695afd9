"""The metric of least motion: a quadratic form that measures how far anchors move."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

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

    @cached_property
    def unwhitening(self) -> FloatArray:
        """(n, n) what undoes W."""
        return np.asarray(np.linalg.cholesky(self.dense).T, dtype=np.float64)

    def among(self, some: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """The W (n, k) with W' M W = 1 that moves nothing but ``some`` (n,) of the unknowns, and the (k, n) that undoes
        it.
        """
        places = np.nonzero(some)[0]
        factor = np.asarray(np.linalg.cholesky(self.dense[np.ix_(places, places)]), dtype=np.float64)
        white, back = np.zeros((self.size, len(places))), np.zeros((len(places), self.size))
        white[places] = np.linalg.inv(factor).T
        back[:, places] = factor.T
        return white, back

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


Local = Callable[[int, int], tuple[Any, Any]]
"""Where an anchor (of a thing, by number) is in its thing's frame: floats, or arrays of one shape for variants."""


Points = Callable[[int], Iterable[tuple[Any, Any, float]]]
"""The points of a thing (by number) whose motion counts: where they are in its frame, and how much each counts."""


def anchors_of(system: System, local: Local) -> Points:
    """All anchors alike."""

    def points(number: int) -> Iterable[tuple[Any, Any, float]]:
        return ((*local(number, anchor), 1.0) for anchor in range(len(system.scene.things[number].anchors)))

    return points


def anchor_forms(
    system: System, core: Sequence[int], points: Points, linear: LinearMap | None = None
) -> tuple[dict[tuple[int, int], Any], dict[tuple[int, int], Any], tuple[int, ...]]:
    """The entries of M and C for a block with the unknowns ``core`` and the eliminated ones of ``linear``, and the
    unknowns of C's columns. See `Metric`; M is not definite yet.
    """
    eliminated = {} if linear is None else dict(zip(linear.targets, linear.slopes, strict=True))
    resting = set(eliminated) - (linear.driven if linear is not None else frozenset[int]())
    place = {n: k for k, n in enumerate(core)}
    mine = {*place, *eliminated}
    coupled: dict[int, int] = {}
    form: dict[tuple[int, int], Any] = {}
    coupling: dict[tuple[int, int], Any] = {}
    poses = (system.unknowns[n].payload for n in mine)
    for number in sorted({payload.thing for payload in poses if isinstance(payload, PosePart)}):
        numbers = [system.number_of.get(kind(number)) for kind in (PoseX, PoseY, PoseCos, PoseSin)]
        for dx, dy, weight in points(number):
            for row in ((1.0, 0.0, dx, -dy), (0.0, 1.0, dy, dx)):
                by_core: dict[int, Any] = {}
                by_coupled: dict[int, Any] = {}
                for factor, n in zip(row, numbers, strict=True):
                    if n is None or (isinstance(factor, float) and factor == 0.0):
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
                        form[i, j] = form.get((i, j), 0.0) + weight * a * b
                    for j, b in by_coupled.items():
                        coupling[i, j] = coupling.get((i, j), 0.0) + weight * a * b
    return form, coupling, tuple(coupled)


def anchor_metric(system: System, core: Sequence[int], linear: LinearMap | None = None) -> Metric:
    """The metric of a block with the unknowns ``core`` and the eliminated ones of ``linear``."""

    def local(thing: int, anchor: int) -> tuple[float, float]:
        return system.frame(thing).local(system.scene.things[thing].anchors[anchor].local)

    return metric_of(system, core, anchors_of(system, local), linear)


def metric_of(system: System, core: Sequence[int], points: Points, linear: LinearMap | None = None) -> Metric:
    """The metric in which the motion of ``points`` counts."""
    form, coupling, coupled = anchor_forms(system, core, points, linear)
    count = len(core)
    largest = max((form.get((k, k), 0.0) for k in range(count)), default=0.0) or 1.0
    for k in range(count):
        own = form.get((k, k), 0.0)
        form[k, k] = own * (1.0 + DEFINITE) if own > DEFINITE * largest else UNWEIGHTED * largest
    return Metric(count, _entries(form), _entries(coupling), coupled)


@dataclass(frozen=True, slots=True, eq=False)
class VariantMetrics:
    """`Metric` for V variants: ``dense`` (V, n, n), ``coupling`` (V, n, p); ``white``, ``scale`` and ``weighted``: see
    there, (V, n, n) and (V, n).
    """

    dense: FloatArray
    coupling: FloatArray
    coupled: tuple[int, ...]
    white: FloatArray
    scale: FloatArray
    weighted: NDArray[np.bool_]

    @staticmethod
    def of(system: System, core: Sequence[int], local: Local, count: int) -> VariantMetrics:
        """That of ``count`` variants, whose anchors are at ``local`` (numbers, or (V,))."""
        form, coupling, coupled = anchor_forms(system, core, anchors_of(system, local))
        n = len(core)
        dense, across = np.zeros((count, n, n)), np.zeros((count, n, len(coupled)))
        for (i, j), value in form.items():
            dense[:, i, j] = value
        for (i, j), value in coupling.items():
            across[:, i, j] = value
        own = np.einsum("vii->vi", dense).copy()
        largest = np.max(own, axis=1, keepdims=True)
        largest = np.where(largest > 0.0, largest, 1.0)
        heavy = own > DEFINITE * largest
        diagonal = np.where(heavy, own * (1.0 + DEFINITE), UNWEIGHTED * largest)
        dense[:, range(n), range(n)] = diagonal
        factor = np.asarray(np.linalg.inv(np.linalg.cholesky(dense)), dtype=np.float64)
        white = np.asarray(np.swapaxes(factor, 1, 2), dtype=np.float64)
        weighted = diagonal > 2.0 * UNWEIGHTED * np.max(diagonal, axis=1, keepdims=True)
        return VariantMetrics(dense, across, coupled, white, 1.0 / np.sqrt(diagonal), weighted)

    def at(self, who: NDArray[np.int64]) -> VariantMetrics:
        """That of some of the variants."""
        return VariantMetrics(
            self.dense[who], self.coupling[who], self.coupled, self.white[who], self.scale[who], self.weighted[who]
        )


def _entries(values: Mapping[tuple[int, int], float]) -> Entries:
    places = np.array(list(values), dtype=np.intp).reshape(-1, 2)
    return places[:, 0], places[:, 1], np.array(list(values.values()), dtype=np.float64)
