"""The last word: every frame's solution against the constraints as the script states them, not as compiled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from movimentum.plan.codegen import Clocks, compiled
from movimentum.plan.equations import Form
from movimentum.plan.unknowns import Rate, symbol_numbers
from movimentum.solve.moments import evaluated
from movimentum.solve.motion import Motion
from movimentum.solve.stretches import Dead, Stretch

CHUNK = 8192
TOLERANCE = 1e-7
"""Relative to the scene's size. Far above what rounding makes of a well-posed frame (1e-14), far below what can be
seen.
"""


@dataclass(frozen=True, slots=True)
class Shortfall:
    """The first frame that is not solved: ``unknown`` has no finite value there, or ``constraint`` is off by
    ``amount``.
    """

    frame: int
    stretch: Stretch
    unknown: int | None = None
    constraint: int | None = None
    amount: float = 0.0


def first_shortfall(motion: Motion) -> Shortfall | None:
    """Evaluate every frame; None where all is well. Frames for which a path already has no solution are not counted."""
    count = motion.timeline.frame_count
    for first in range(0, count, CHUNK):
        for stretch, low, high in motion.spans(first, min(first + CHUNK, count)):
            found = _of_stretch(motion, stretch, low, high)
            if found is not None:
                return found
    return None


def _of_stretch(motion: Motion, stretch: Stretch, low: int, high: int) -> Shortfall | None:
    plan = stretch.plan
    system = plan.system
    rows = [
        e
        for e in system.equations
        if e.form is Form.PLAIN and not any(isinstance(system.unknowns[n].payload, Rate) for n in e.unknowns)
    ]
    clocks = Clocks(plan.clocks)
    instants = motion.instants(stretch, low, high)
    solved_for = {n for block in plan.blocks for n in block.unknowns}
    rows = [e for e in rows if symbol_numbers(e.original or e.residual) <= solved_for]
    function = compiled([e.original or e.residual for e in rows], clocks)
    # clocks that only the constraints as they are stated read
    more = [float(stretch.segment.start - start) + instants.tau for start in clocks.starts[len(plan.clocks) :]]
    known = instants.clocks
    for piece in stretch.pieces:
        if isinstance(piece, Dead):
            continue
        with np.errstate(all="ignore"):
            state, bad = evaluated(piece, instants)
            inside = (instants.tau >= piece.begin) & (instants.tau <= piece.end)
            worst = np.where(bad & inside, np.inf, 0.0)
            values = function(state, (*known, *more))
            for row, value in zip(rows, values, strict=True):
                size = 1.0 if row.constraint is None else motion.size
                off = np.abs(np.broadcast_to(value, len(worst))) / size
                if row.original is not None and row.original.op in ("add", "atan2d"):  # angles agree modulo a turn
                    off = np.minimum(off, np.abs(off - 360.0 / size))
                worst = np.where(inside, np.fmax(worst, np.where(np.isfinite(off), off, np.inf)), worst)
        if not (worst > TOLERANCE).any():
            continue
        place = int(np.argmax(worst > TOLERANCE))
        for n in sorted(solved_for):
            if not np.isfinite(np.broadcast_to(state[n], len(worst))[place]):
                return Shortfall(low + place, stretch, unknown=n)
        offs = [float(abs(np.broadcast_to(value, len(worst))[place])) for value in values]
        chosen = int(np.argmax(offs)) if offs else None
        constraint = rows[chosen].constraint if chosen is not None else None
        return Shortfall(
            low + place, stretch, constraint=constraint, amount=offs[chosen] if chosen is not None else 0.0
        )
    return None
