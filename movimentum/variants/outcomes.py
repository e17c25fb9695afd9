"""What comes of a variant: it moves, it binds, it cannot be assembled, it jumps."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import FailureKind


class VariantOutcome(StrEnum):
    """In the order of their codes in arrays.

    ``ok``: it moves as the script says, all the time. ``binds``: from some time on it has no solution, or
    something is at infinity then. ``cannot be
    assembled``: it has none to begin with. ``jumps``: it moves, but something is suddenly elsewhere.
    """

    OK = "ok"
    BINDS = "binds"
    UNASSEMBLED = "cannot be assembled"
    JUMPS = "jumps"

    @property
    def code(self) -> int:
        """Its number in arrays of outcomes."""
        return tuple(VariantOutcome).index(self)

    @property
    def moves(self) -> bool:
        """Whether there is a motion, all the time."""
        return self in (VariantOutcome.OK, VariantOutcome.JUMPS)


OUTCOMES = tuple(VariantOutcome)


@dataclass(frozen=True, slots=True, eq=False)
class VariantRows:
    """V variants: the values of the constants (V, C), of the measures (V, M; nan where there is no motion), the
    outcomes' codes (V,), and the time (V,) at which a variant binds or jumps (nan where it does not).
    """

    constants: FloatArray
    measures: FloatArray
    outcomes: IntArray
    times: FloatArray

    def __len__(self) -> int:
        return len(self.outcomes)


def joined(parts: list[VariantRows]) -> VariantRows:
    """All rows of at least one part, in order."""
    return VariantRows(
        np.concatenate([part.constants for part in parts]),
        np.concatenate([part.measures for part in parts]),
        np.concatenate([part.outcomes for part in parts]),
        np.concatenate([part.times for part in parts]),
    )


def outcome_of(motion: PathMotion) -> tuple[VariantOutcome, float]:
    """The outcome of one motion, and its time (nan if it is ok). What only the drawing says (a claim that fails, a
    thing outside the picture) does not count.
    """
    from movimentum.analysis.diagnose.jumps import found_jumps
    from movimentum.analysis.diagnose.meshing import misplaced_gears
    from movimentum.analysis.diagnose.verify import first_shortfall

    start = float(motion.timeline.start)
    for number, segment_motion in enumerate(motion.segments):
        if segment_motion.troubles:
            trouble = min(segment_motion.troubles, key=lambda item: item.begin)
            first = number == 0 and trouble.kind is FailureKind.START and trouble.begin == 0.0
            kind = VariantOutcome.UNASSEMBLED if first else VariantOutcome.BINDS
            return kind, float(segment_motion.segment.start) + (trouble.begin if trouble.pole is None else trouble.pole)
    with np.errstate(all="ignore"):
        if next(iter(misplaced_gears(motion)), None) is not None:
            return VariantOutcome.UNASSEMBLED, start
        missing = first_shortfall(motion)
        if missing is not None:
            return VariantOutcome.BINDS, float(motion.timeline.frame_time(missing.frame))
        for number, segment_motion in enumerate(motion.segments):
            jump = next(found_jumps(motion, number), None)
            if jump is not None:
                return VariantOutcome.JUMPS, float(segment_motion.segment.start) + jump.beginning.time
    return VariantOutcome.OK, float("nan")
