"""The possible lengths of a cord: the shortest and the longest over all poses that meet everything else."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

import numpy as np

from movimentum.analysis.diagnose.cords import numbered_symbol
from movimentum.arrays import FloatArray, least_squares
from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.expressions import neg, substitute, symbol, symbols
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.records import dataclass
from movimentum.scene.leaves import Bearing, Cord, Wheel, cords_of
from movimentum.scene.model import Constraint
from movimentum.scene.names import symbol_name
from movimentum.solver.block.closed_form import State
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.start.best_fit import RowFit
from movimentum.solver.start.contradictions import part_rows
from movimentum.solver.start.requirements import (
    OutOfEffortError,
    Requirements,
    WorkBudget,
    random_poses,
    requirements_at,
)
from movimentum.source import Edit
from movimentum.text import number
from movimentum.timeline.cords import CordParts
from movimentum.tolerances import CORD_ENDS, FIT_ROW_MET, INEQUALITY_MET, UNWRAPPED_DEG

EFFORT = 4e8
"""Work for both lengths, see `WorkBudget`."""
STARTS = 8
"""Poses from which each is looked for: the one that is drawn, and random ones about it."""
STEPS, CORRECTIONS = 80, 4
FIRST_STEP, LONGEST_STEP = 0.05, 0.5
"""In units of the unknowns' scale."""
LARGEST_LENGTH = 12.0
"""Of the scene's size, and of the cord: one that can be longer has no longest length that anybody asks for."""
SUGGESTION_MARGIN = 1e-2
"""Of the length, or of the room for it: how far inside a length is that is offered."""
STATED = re.compile(r"([^=]*=)[^=;]*?((?:\s*\.grips\b[^;]*)?\s*;?)", re.DOTALL)
"""What states a length: up to the length, and after it."""


@dataclass(frozen=True, slots=True)
class LengthRange:
    """``shortest`` and ``longest`` (infinite where there is none) length of a cord in pixels."""

    shortest: float
    longest: float


def too_long_or_short(segment_motion: SegmentMotion, block: Block, chosen: Sequence[Constraint]) -> Diagnostic | None:
    """An error where a cord among the constraints of a block without a solution is to have a length that it cannot have
    where the segment begins, whatever is moved; None where that is not so, or not known.
    """
    scene = segment_motion.plan.system.scene
    numbers = {item.number for item in chosen}
    stated = [(item, cord) for item in scene.constraints() if item.number in numbers for cord in cords_of(item)]
    found = (_length_diagnostic(segment_motion, block, item, cord) for item, cord in stated)
    return next((each for each in found if each is not None), None)


def _length_diagnostic(segment_motion: SegmentMotion, block: Block, item: Constraint, cord: Cord) -> Diagnostic | None:
    scene = segment_motion.plan.system.scene
    sides = [side for side in (*item.left, *item.right) if side.value is not None]
    if len(sides) != 1 or len(item.left) != 1 or not any(isinstance(stop, Wheel) for stop in cord.stops):
        return None
    wanted = float(sides[0].value)  # type: ignore[arg-type]
    found = possible_lengths(segment_motion, block, item, cord, wanted)
    if found is None or found.shortest <= wanted <= found.longest:
        return None
    written, short = symbol_name(scene, cord), wanted < found.shortest
    low, high = number(found.shortest), number(found.longest)
    span = f"between {low} and {high} px" if np.isfinite(found.longest) else f"{low} px or more"
    nearest, room = (found.shortest if short else found.longest), found.longest - found.shortest
    value = f"{nearest + (SUGGESTION_MARGIN if short else -SUGGESTION_MARGIN) * min(room, nearest):.5g}"
    text = STATED.fullmatch(scene.source.slice(item.span))
    typed = " ".join(f"{text[1]} {value}{text[2]}".split()) if text else f"{written} = {value}"
    edits = () if text is None else (Edit(item.span, f"{text[1]} {value}{text[2]}"),)
    return Diagnostic(
        code="cord/length",
        severity=Severity.ERROR,
        message=f"a cord of {number(wanted)} px is too {'short' if short else 'long'} for `{written}`",
        span=item.span,
        notes=(f"with all else that is stated, {span} are possible",),
    ).advised(Fix(f"`{typed}` is possible", edits))


def possible_lengths(
    segment_motion: SegmentMotion, block: Block, item: Constraint, cord: Cord, stated: float
) -> LengthRange | None:
    """Along the poses that meet all but the cord's length, uphill and downhill by projected gradients; None where no
    such pose is found.
    """
    plan = segment_motion.plan
    with np.errstate(all="ignore"):
        try:
            requirements = requirements_at(plan, 0.0, segment_motion.base, WorkBudget(EFFORT))
            rows, _ = part_rows(requirements, plan, frozenset(block.unknowns))
            requirements = requirements.restricted(rows)
            own = [
                i
                for i, row in enumerate(requirements.rows)
                if row.member == ("constraint", item.number) and not row.side and i >= requirements.linear
            ]
            if not own:
                return None
            row = max(own, key=lambda i: max(requirements.rows[i].equations))  # before it those of its turns
            walk = _WithoutCord(requirements, row, cord, stated if item.left[0].value is None else -stated)
            starts = walk.starts()
            far = LARGEST_LENGTH * max([plan.size, *(walk.length(start) for start in starts)])
            shortest, longest = ([walk.end(start, way, far) for start in starts] for way in (-1.0, 1.0))
        except OutOfEffortError:
            return None
    if not starts:
        return None
    # where only some ways go on without end, they go round a wheel over and over
    ended = [each for each in longest if each <= far]
    return LengthRange(min(shortest), max(ended, default=np.inf))


class _WithoutCord:
    """Poses that meet all of some demands but ``row``, the length of a cord less ``stated``."""

    def __init__(self, requirements: Requirements, row: int, cord: Cord, stated: float) -> None:
        self.requirements, self.stated = requirements, stated
        self.fitting = RowFit(requirements, [i for i in range(len(requirements.rows)) if i != row])
        self.place = row - requirements.linear
        system = requirements.plan.system
        wraps = [wrap.angle for wrap in CordParts(system.scene, cord).wraps if not wrap.drum]
        known = [angle for angle in wraps if {*symbols(angle)} <= system.number_of.keys()]
        renamed = [substitute(angle, partial(numbered_symbol, system.number_of)) for angle in known]
        self.wraps = compiled(renamed, Clocks(requirements.plan.clocks)) if renamed else None
        chosen = [each.value for each in system.selectors if each.constraint is not None]
        self.sides = compiled(chosen, Clocks(requirements.plan.clocks)) if chosen else None
        turning = [
            (equation.original, unknown.number, unknown.payload.drawn - 180.0)
            for equation in system.equations
            for unknown in system.unknowns
            if isinstance(unknown.payload, Bearing)
            and equation.original is not None
            and equation.original.args[-1:] == (neg(symbol(unknown.number)),)
        ]
        self.bearings = [(n, first) for _, n, first in turning]
        self.turns = compiled([root for root, _, _ in turning], Clocks(requirements.plan.clocks)) if turning else None

    def starts(self) -> list[FloatArray]:
        """Coordinates of poses to begin with."""
        requirements, fitting = self.requirements, self.fitting
        poses = np.concatenate([requirements.first[None], random_poses(requirements, STARTS)[1:]])
        poses[1:] = fitting.fit(poses[1:]).u
        found: list[FloatArray] = []
        for z in fitting.brought(poses):
            u = self._turned(self._pose(z))
            met = self._met(fitting.brought(u[None])[0])
            if met is not None:
                found.append(met)
        return found

    def _turned(self, u: FloatArray) -> FloatArray:
        """A pose with the turns of the cords that its places make."""
        u, scale = u.copy(), self.requirements.scale
        if self.turns is not None:
            angles = self.turns([np.array([value]) for value in u * scale], self.requirements.clocks)
            for (n, first), off in zip(self.bearings, angles, strict=True):
                turn = float(np.ravel(off)[0]) + u[n] * scale[n]
                u[n] = (first + (turn - first) % 360.0) / scale[n]
        return u

    def _pose(self, z: FloatArray) -> FloatArray:
        u = self.requirements.first.copy()
        u[self.fitting.columns] = self.fitting.origin + self.fitting.basis @ z
        return u

    def _at(self, z: FloatArray) -> tuple[FloatArray, FloatArray, float, FloatArray]:
        """Residuals of the other rows, their slopes, the length and its slopes."""
        u = self._pose(z)[None]
        residual, slopes = self.requirements.values(u)
        wide = np.zeros((slopes.shape[1], len(self.fitting.columns)))
        wide[:, self.fitting.into] = slopes[0][:, self.fitting.from_]
        wide = wide @ self.fitting.basis
        weight = float(self.requirements.weights[self.place])
        length = float(residual[0, self.place]) / weight + self.stated
        others = self.fitting.others
        return residual[0, others], wide[others], length, wide[self.place] / weight

    def _met(self, z: FloatArray) -> FloatArray | None:
        """The nearest coordinates that meet the other rows; None where there are none near."""
        for _ in range(CORRECTIONS):
            left, slopes, length, _ = self._at(z)
            if not (np.isfinite(left).all() and np.isfinite(slopes).all() and np.isfinite(length)):
                return None
            if not len(left) or float(np.max(np.abs(left))) <= FIT_ROW_MET:
                return z if self._allowed(z) else None
            z = z - least_squares(slopes, left[:, None])[:, 0]
        return None

    def _allowed(self, z: FloatArray) -> bool:
        """Whether no wheel is left by the cord, and inequalities hold."""
        state: State = [np.array([value]) for value in self._pose(z) * self.requirements.scale]
        least = -INEQUALITY_MET * self.requirements.plan.size

        def above(function: Compiled | None, lowest: float) -> bool:
            values = () if function is None else function(state, self.requirements.clocks)
            return all(float(np.ravel(value)[0]) >= lowest for value in values)

        return above(self.wraps, -UNWRAPPED_DEG) and above(self.sides, least)

    def length(self, z: FloatArray) -> float:
        """That of the cord at coordinates ``z``."""
        return abs(self._at(z)[2])

    def end(self, z: FloatArray, sign: float, far: float) -> float:
        """The longest length (``sign`` 1) or the shortest one (-1) on the way from coordinates ``z``, which ends where
        it is more than ``far``.
        """
        step = FIRST_STEP
        _, slopes, length, uphill = self._at(z)
        for _ in range(STEPS):
            if not np.isfinite(uphill).all():
                break
            across = least_squares(slopes, (slopes @ uphill)[:, None])[:, 0] if len(slopes) else np.zeros_like(uphill)
            way = sign * (uphill - across)
            size = float(np.hypot.reduce(way)) if len(way) else 0.0
            if size <= CORD_ENDS * self.requirements.plan.size or abs(length) > far:
                break
            moved = self._met(z + step * way / size)
            reached = None if moved is None else self._at(moved)
            if moved is None or reached is None or not sign * (reached[2] - length) > 0.0:
                step /= 3.0
                if step <= CORD_ENDS:
                    break
                continue
            z, (_, slopes, length, uphill) = moved, reached
            step = min(1.6 * step, LONGEST_STEP)
        return length
