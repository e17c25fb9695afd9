"""Variants one by one, each solved as a script of its own: what cannot be solved together, and the last word."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.errors import ScriptError
from movimentum.expressions import Expr, symbol
from movimentum.fitting.dual import Dual
from movimentum.fitting.moments import times_of
from movimentum.fitting.sides import Evaluation, SideFormulas
from movimentum.query import reader
from movimentum.records import dataclass, field, replace
from movimentum.solver.motion import PathMotion
from movimentum.timeline.model import Timeline
from movimentum.variants.outcomes import VariantOutcome, outcome_of
from movimentum.variants.single import Variants, structure_key
from movimentum.variants.tracing import with_values
from movimentum.workflow.frames import PoseChunks
from movimentum.workflow.stages import arranged, moved

STEP = 1e-6
"""Of a constant's interval: how far apart the variants are of which slopes are differences."""


REMEMBERED = 4096
"""Variants whose sides are known still."""


@dataclass(frozen=True, slots=True, eq=False)
class SingleMotion:
    """One variant: its ``motion`` (None where it makes no sense) and the ``sides`` (S,) of its aims, nan where it does
    not move.
    """

    motion: PathMotion | None
    outcome: VariantOutcome
    time: float
    sides: FloatArray


@dataclass(eq=False)
class SingleEvaluator:
    """Evaluates variants by themselves; slopes are central differences within ``intervals`` (C, 2)."""

    variants: Variants
    formulas: SideFormulas
    intervals: FloatArray
    _known: dict[bytes, FloatArray] = field(default_factory=dict[bytes, FloatArray])

    def motion(self, constants: FloatArray) -> SingleMotion:
        """The variant with these constants (C,)."""
        none = np.full(len(self.formulas.layout.aim), np.nan)
        values = dict(zip(self.formulas.names, constants.tolist(), strict=True))
        try:
            scene = self.variants.scene(values)
            timeline = replace(arranged(scene, self.variants.choices), claims=(), aims=())
            motion = moved(timeline, resumes=False)
        except ScriptError:
            return SingleMotion(None, VariantOutcome.UNASSEMBLED, float("nan"), none)
        outcome, time = outcome_of(motion)
        if not outcome.moves or structure_key(timeline) != structure_key(self.formulas.lowered.timeline):
            return SingleMotion(motion, outcome, time, none)
        return SingleMotion(motion, outcome, time, self._sides(motion, timeline, constants))

    def _sides(self, motion: PathMotion, timeline: Timeline, constants: FloatArray) -> FloatArray:
        formulas = self.formulas
        payloads = [symbol(payload) for payload in formulas.payloads]
        read = reader(timeline.scene, payloads)
        frames = [read(poses) for poses in PoseChunks(motion, range(timeline.frame_count), skip=False)]
        duals = [Dual(np.concatenate(column)[None, :]) for column in zip(*frames, strict=True)]
        return formulas.sides(constants[None], duals, self._moments(motion, timeline, constants), slopes=False)[0][0]

    def _moments(self, motion: PathMotion, timeline: Timeline, constants: FloatArray) -> dict[int, Dual]:
        formulas = self.formulas
        found: dict[int, Dual] = {}
        times = times_of(formulas, constants)
        values = dict(zip(formulas.names, constants.tolist(), strict=True))
        for number, time in times.items():
            moment = min(max(Fraction(time), timeline.start), timeline.end)
            inner: Expr = formulas.lowered.reductions[number].inner
            (value,) = reader(timeline.scene, with_values([inner], values))(motion.poses_at([moment]))
            found[number] = Dual(np.asarray(value)[None, :])
        return found

    def sides(self, constants: FloatArray) -> FloatArray:
        """(S,) the sides of the variant with these constants (C,), which is not solved again if it was lately."""
        key = constants.tobytes()
        if key not in self._known:
            if len(self._known) >= REMEMBERED:
                self._known.clear()
            self._known[key] = self.motion(constants).sides
        return self._known[key]

    def __call__(self, constants: FloatArray, *, slopes: bool = True) -> Evaluation:
        """(V, C) constants -> their `Evaluation`."""
        sides = np.array([self.sides(row) for row in constants])
        moves = np.asarray(np.isfinite(sides).all(axis=1), dtype=np.bool_)
        if not slopes:
            return Evaluation(sides, None, moves, moves, moves.astype(np.float64))
        changes = np.full((*sides.shape, constants.shape[1]), np.nan)
        for v in np.nonzero(moves)[0]:
            for c, (low, high) in enumerate(self.intervals.tolist()):
                step = STEP * (high - low)
                ends: list[tuple[float, FloatArray]] = [(0.0, sides[v])]
                for way in (-step, step):
                    moved_by = constants[v].copy()
                    moved_by[c] += way
                    found = self.sides(moved_by)
                    if np.isfinite(found).all():
                        ends.append((way, found))
                if len(ends) > 1:  # on the edge of what moves, the difference to one side
                    (a, first), (b, last) = min(ends, key=_way), max(ends, key=_way)
                    changes[v, :, c] = (last - first) / (b - a)
        return Evaluation(sides, np.nan_to_num(changes), moves, moves, moves.astype(np.float64))


def _way(end: tuple[float, FloatArray]) -> float:
    return end[0]
