"""One Newton block at one instant of its path: its velocity there, and the step back onto its equations."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Newton
from movimentum.records import dataclass, field
from movimentum.solver.basis.effort import charge_effort
from movimentum.solver.block.newton import newton, newton_at_instant
from movimentum.solver.block.problem import BlockProblem, scaled
from movimentum.tolerances import BESIDE_AN_END, RANK_FOR_VELOCITY, SINGULAR_ON_PATH

Probe = Callable[[FloatArray], BlockProblem]
"""A block's problem at given offsets."""

ITERATIONS = 8
"""Newton steps onto a path from a prediction; one that needs more is too far from it."""


@dataclass(frozen=True, slots=True)
class OutlinePlace:
    """An unknown of a block's core (number ``index``) that is a place on an outline: its pieces lie between ``breaks``,
    which repeat with the ``period`` of a closed one (0: it is open). ``held``: it is that of a point on the outline,
    and does not jump.
    """

    index: int
    breaks: tuple[float, ...]
    period: float
    held: bool = False

    def until_break(self, x: FloatArray, v: FloatArray) -> float:
        """How long it is until a place at core values ``x`` (n,), of velocity ``v``, comes to the end of its piece."""
        place, speed = float(x[self.index]), float(v[self.index])
        turns = math.floor((place - self.breaks[0]) / self.period) * self.period if self.period else 0.0
        shifts = (turns - self.period, turns, turns + self.period)
        return min(
            (
                time
                for shift in shifts
                for each in self.breaks
                if speed and (time := (shift + each - place) / speed) > 0.0
            ),
            default=math.inf,
        )

    def beside(self, place: float) -> list[float]:
        """The middles of the pieces about a place, and places just beyond these, before and behind."""
        turns = math.floor((place - self.breaks[0]) / self.period) * self.period if self.period else 0.0
        every = [shift + each for shift in (turns - self.period, turns, turns + self.period) for each in self.breaks]
        edges = sorted(set(every))
        near = BESIDE_AN_END * (edges[-1] - edges[0])
        found: list[float] = []
        for way in (1, -1):
            ahead = [each for each in edges[::way] if (each - place) * way > near]
            if not ahead:
                continue
            at_edge = any(abs(each - place) <= near for each in edges)
            begin, end = place, ahead[0]
            found += [(begin + end) / 2.0, end + way * near] if at_edge else [end + way * near]
        return found


@dataclass(slots=True, eq=False)
class BlockAtInstant:
    """A block at one instant: Jacobian-related quantities from finite time differences of its inputs.

    ``delta`` is half the time between the instants compared; ``low`` and ``high`` bound the interval of the path.
    ``sizes`` are the natural sizes of the block's unknowns, where anyone asks; ``places``: those of contact in its
    core.
    """

    block: Newton
    probe: Probe
    delta: float
    low: float
    high: float
    sizes: FloatArray | None = None
    places: tuple[OutlinePlace, ...] = ()
    _around_cache: tuple[float, BlockProblem, float] | None = None
    _at_cache: tuple[float, BlockProblem] | None = None
    _linear: tuple[float, FloatArray, FloatArray, FloatArray] | None = None
    _prepared: dict[float, int] = field(default_factory=dict[float, int])
    _many: tuple[BlockProblem, FloatArray] | None = None

    def prepare(self, tau: FloatArray) -> tuple[BlockProblem, FloatArray]:
        """The problem at K instants ``tau``, then a little later each, then a little earlier; and the times (K,)
        between the latter two. `problem_around` takes it from there.
        """
        self._many = self._problem_near(tau)
        self._prepared = {instant: place for place, instant in enumerate(tau.tolist())}
        return self._many

    def _problem_near(self, tau: FloatArray) -> tuple[BlockProblem, FloatArray]:
        """As `prepare` gives it; inside [low, high] where possible."""
        later = np.minimum(tau + self.delta, np.maximum(self.high, tau))
        earlier = np.maximum(tau - self.delta, np.minimum(self.low, tau))
        narrow = later - earlier < 0.5 * self.delta  # about this long where only one side is on the path
        later, earlier = np.where(narrow, tau + self.delta, later), np.where(narrow, tau, earlier)
        return self.probe(np.concatenate([tau, later, earlier])), later - earlier

    def problem_around(self, tau: float) -> tuple[BlockProblem, float]:
        """The problem at [tau, later, earlier] and the time between the latter two. Looked up once for all that is
        asked of one instant.
        """
        if self._around_cache is not None and self._around_cache[0] == tau:
            return self._around_cache[1:]
        place = self._prepared.get(tau)
        if place is not None and self._many is not None:
            count = len(self._prepared)
            problem, spans = self._many[0].at(place + count * np.arange(3), 3 * count), self._many[1][place:]
        else:
            problem, spans = self._problem_near(np.array([tau]))
        self._around_cache = tau, problem, float(spans[0])
        return problem, float(spans[0])

    def at(self, tau: float) -> BlockProblem:
        """The problem at ``tau`` alone."""
        if self._at_cache is None or self._at_cache[0] != tau:
            self._at_cache = tau, self.problem_around(tau)[0].first()
        return self._at_cache[1]

    def rate(self, tau: float, x: FloatArray, scale: FloatArray) -> tuple[FloatArray, float]:
        """The velocity of the core unknowns (per unit of time), and the smallest singular value of the scaled Jacobian
        relative to its largest.
        """
        problem, span = self.problem_around(tau)
        repeated = np.repeat(x[None, :], 3, axis=0)
        residual = problem.residual(repeated)
        drift = (residual[1] - residual[2]) / span
        jacobian = problem.jacobian(repeated)[:1]
        rows, lengths = scaled(jacobian, scale)
        right = -drift / lengths[0]
        if not (np.isfinite(rows).all() and np.isfinite(right).all()):
            return np.full(len(x), np.nan), 0.0
        left, singular, turned = np.linalg.svd(rows[0], full_matrices=False)
        smallest = float(singular[-1] / singular[0]) if len(singular) and singular[0] > 0 else 0.0
        keep = singular > RANK_FOR_VELOCITY * singular[0]
        self._linear = tau, x, rows[0], singular
        y = turned[keep].T @ ((left[:, keep].T @ right) / singular[keep])
        return y * scale, smallest

    def orientation(self, tau: float, x: FloatArray, scale: FloatArray) -> float:
        """The sign of the Jacobian's determinant at core values ``x`` (n,); 0 where it is singular or not square.

        Along a path it changes at singular points only: a landing with the other sign, without one, is on another path.
        """
        if self.block.rows != len(self.block.core):
            return 0.0
        if self._linear is not None and self._linear[0] == tau and self._linear[1] is x:  # `rate` was just asked for
            charge_effort()
            _, _, rows, singular = self._linear
        else:
            (rows,), _ = scaled(self.at(tau).jacobian(x[None]), scale)
            if not np.isfinite(rows).all():
                return 0.0
            singular = np.linalg.svd(rows, compute_uv=False)
        if not singular[-1] > SINGULAR_ON_PATH * singular[0]:
            return 0.0
        return float(np.linalg.slogdet(rows)[0])

    def corrected(self, tau: float, x: FloatArray) -> tuple[FloatArray, bool]:
        """Newton from core values ``x`` (n,) at an instant: where it ends (n,), and whether that is a solution."""
        problem = self.at(tau)
        if self.block.is_square and problem.sparse is None and len(x):
            found = newton_at_instant(problem, x, ITERATIONS)
            if found is not None:
                return found
        outcome = newton(problem, x[None, :], iterations=ITERATIONS)
        return outcome.x[0], bool(outcome.converged[0])
