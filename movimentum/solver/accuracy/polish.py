"""Solves one block's equations to the last digit of an arithmetic, from a float64 solution.

Residuals are evaluated in the arithmetic, from the equations as the script's numbers state them; the Jacobian is that
of float64, so each step gains some 16 digits less those that the condition number costs (iterative refinement).
Where two solutions meet the Jacobian is singular and no such step converges: the double root is then the regular root
of the *deflated* system F(x) = 0, F'(x) v = 0, h v = 1 (Ojika 1987). What is neither goes through Newton's method with
a Jacobian of all digits.

Multi-digit poses are rounded to float64 poses here, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.expressions import ONE, ZERO, Expr, add, mul, sub, symbol
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.body_frames import stated_point
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.model import Thing
from movimentum.solver.arithmetic.evaluation import Evaluator, Number, ordered_nodes
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import scaled
from movimentum.solver.poses import Poses
from movimentum.tolerances import (
    LEAST_DIVISOR,
    RANK_FOR_DEFLATION,
    RANK_OF_REDUNDANT_ROWS,
    RANK_OF_SQUARE,
    SAME_SOLUTION_POLISHED,
)


@dataclass(frozen=True, slots=True, eq=False)
class PolishRows:
    """Equations ``residuals`` (m) in the unknowns ``unknowns`` (n), and their Jacobian's ``entries`` as expressions
    (``slopes``) and compiled.
    """

    residuals: tuple[Expr, ...]
    nodes: list[Expr]
    unknowns: tuple[int, ...]
    entries: tuple[tuple[int, int], ...]
    slopes: tuple[Expr, ...]
    jacobian: Compiled


def make_rows(plan: Plan, residuals: Sequence[Expr], unknowns: Sequence[int]) -> PolishRows:
    """Differentiate and compile."""
    entries, slopes = slopes_of(residuals, unknowns)
    jacobian = compiled(slopes, Clocks(plan.clocks))
    return PolishRows(
        tuple(residuals), ordered_nodes(residuals), tuple(unknowns), tuple(entries), tuple(slopes), jacobian
    )


def deflated_rows(plan: Plan, rows: PolishRows, first: int) -> PolishRows:
    """F = 0, F' v = 0, h v = 1. The numbers ``first`` … stand for v and then for h, which is given."""
    n = len(rows.unknowns)
    v = [symbol(first + j) for j in range(n)]
    along = [ZERO] * len(rows.residuals)
    for (i, j), slope in zip(rows.entries, rows.slopes, strict=True):
        along[i] = add(along[i], mul(slope, v[j]))
    norm = sub(ONE, ONE)
    for j in range(n):
        norm = add(norm, mul(symbol(first + n + j), v[j]))
    unknowns = (*rows.unknowns, *range(first, first + n))
    return make_rows(plan, [*rows.residuals, *along, sub(norm, ONE)], unknowns)


@dataclass(slots=True, eq=False)
class RowContext:
    """What rows are evaluated in: ``wide`` and ``floats``, the unknowns by number, at F instants; ``clock`` the time
    since an instant (an Expr ``clock``), ``clocks`` the floats of the same.
    """

    evaluator: Evaluator
    wide: list[Number]
    floats: State
    clock: Callable[[Expr], Number]
    clocks: Sequence[FloatArray]

    def leaf(self, node: Expr) -> Number:
        """A symbol or a clock."""
        if node.op == "clock":
            return self.clock(node)
        assert isinstance(node.payload, int)
        return self.wide[node.payload]

    def values(self, rows: PolishRows) -> list[Number]:
        """The residuals."""
        return self.evaluator.values(rows.nodes, rows.residuals, self.leaf)

    def at(self, place: int) -> RowContext:
        """The same at one of the instants."""

        def one(value: Any) -> Any:
            return value if value is None or np.ndim(value) == 0 or len(value) == 1 else value[place : place + 1]

        def numbers(value: Number) -> Number:
            return value if value is None or len(value) == 1 else value[place : place + 1]

        return RowContext(
            self.evaluator,
            [numbers(value) for value in self.wide],
            [one(value) for value in self.floats],
            lambda node: numbers(self.clock(node)),
            [clock[place : place + 1] if len(clock) > 1 else clock for clock in self.clocks],
        )


def polish(plan: Plan, rows: PolishRows, context: RowContext, start: FloatArray, scale: FloatArray) -> FloatArray:
    """Solve ``rows`` from ``start`` (F, n), unknowns of sizes ``scale`` (n,), and leave the solution in
    ``context.wide`` and ``context.floats``.

    Returns (F,) how many digits are right, relative to those sizes; where no step led anywhere, the start stays.
    """
    sizes = np.maximum(scale, np.abs(start))
    for j, n in enumerate(rows.unknowns):
        context.wide[n] = context.evaluator.arithmetic.floats(start[:, j])
        context.floats[n] = start[:, j]
    with np.errstate(all="ignore"):
        right = _iterate(rows, context, sizes)
        right[_moved_far(rows, context, start, sizes)] = 0.0
        wanted = context.evaluator.arithmetic.digits
        for place in np.nonzero(right < wanted)[0]:
            right[place] = _singular(plan, rows, context, start, sizes, int(place), float(right[place]))
    return right


def _moved_far(rows: PolishRows, context: RowContext, start: FloatArray, sizes: FloatArray) -> NDArray[np.bool_]:
    now = np.stack([np.broadcast_to(context.floats[n], len(start)) for n in rows.unknowns], axis=1)
    return np.asarray(~(np.abs(now - start) <= SAME_SOLUTION_POLISHED * sizes).all(axis=1), dtype=np.bool_)


def _jacobian(rows: PolishRows, context: RowContext, count: int) -> FloatArray:
    result = np.zeros((count, len(rows.residuals), len(rows.unknowns)))
    for (i, j), value in zip(rows.entries, rows.jacobian(context.floats, context.clocks), strict=True):
        result[:, i, j] = value
    return result


def _inverse(rows: PolishRows, context: RowContext, sizes: FloatArray) -> FloatArray:
    """(F, n, m) what takes residuals to steps."""
    matrix, lengths = scaled(_jacobian(rows, context, len(sizes)), sizes)
    finite = np.isfinite(matrix).all(axis=(1, 2))
    result = np.full((len(sizes), matrix.shape[2], matrix.shape[1]), np.nan)
    if finite.any():
        square = matrix.shape[1] == matrix.shape[2]
        try:
            inverse = (
                np.linalg.inv(matrix[finite])
                if square
                else np.linalg.pinv(matrix[finite], rcond=RANK_OF_REDUNDANT_ROWS)
            )
        except np.linalg.LinAlgError:
            inverse = np.linalg.pinv(matrix[finite], rcond=RANK_OF_SQUARE)
        result[finite] = sizes[finite][:, :, None] * inverse / lengths[finite][:, None, :]
    return result


def _iterate(rows: PolishRows, context: RowContext, sizes: FloatArray, *, newton: bool = False) -> FloatArray:
    """Steps until they are as small as the arithmetic's digits ask or no longer shrink; returns (F,) the digits.

    The Jacobian is that of floats. ``newton``: it has all digits, at a single instant; steps may then shrink slowly, as
    they do from afar where two solutions nearly meet.
    """
    arithmetic = context.evaluator.arithmetic
    count = len(sizes)
    right = np.zeros(count)
    running = np.ones(count, dtype=np.bool_)
    inverse = np.zeros((0, 0, 0))
    least_gain = 0.0 if newton else 0.7
    for done in range(40 if newton else 8 + arithmetic.digits // 4):
        values = context.values(rows)
        if newton:
            step, exponents = _newton_step(rows, context, sizes, values)
        else:
            residuals, exponents = arithmetic.balanced(values, count)
            if done < 3:  # by then the point is as good as a float can be
                inverse = _inverse(rows, context, sizes)
            step = -np.einsum("fnm,fm->fn", inverse, residuals)
        largest = np.max(np.abs(step) / sizes, axis=1, initial=0.0)
        digits = -(np.log10(np.where(largest > 0.0, largest, LEAST_DIVISOR)) + exponents * np.log10(2.0))
        usable = np.isfinite(step).all(axis=1)
        gained = np.where(usable, digits, 0.0) - right
        moves = running & usable & ((gained > 0.0) | (done < 2))
        for j, n in enumerate(rows.unknowns):
            by = arithmetic.unbalanced(np.where(moves, step[:, j], 0.0), exponents)
            context.wide[n] = context.wide[n] + by
            context.floats[n] = arithmetic.rounded(context.wide[n])
        right = np.where(moves, np.maximum(right, digits), right)
        right[~usable] = 0.0
        # a step of size s leaves an error of s times the contraction; a singular Jacobian halves it at best
        running &= (right < arithmetic.digits) & usable & ((gained > least_gain) | (done < 2))
        if not running.any():
            break
    return right


def _newton_step(
    rows: PolishRows, context: RowContext, sizes: FloatArray, values: Sequence[Number]
) -> tuple[FloatArray, NDArray[np.int64]]:
    """The step (1, n) and its exponent (1,) with a Jacobian of all digits; nan where that is singular."""
    arithmetic = context.evaluator.arithmetic
    assert isinstance(arithmetic, DigitsArithmetic)
    mp = arithmetic.context
    matrix = mp.zeros(len(rows.residuals), len(rows.unknowns))
    slopes = context.evaluator.values(ordered_nodes(rows.slopes), rows.slopes, context.leaf)
    for (i, j), slope in zip(rows.entries, slopes, strict=True):
        matrix[i, j] = slope[0] * float(sizes[0, j])
    try:
        step = mp.lu_solve(matrix, mp.matrix([-value[0] for value in values]))
    except (ArithmeticError, ValueError):
        return np.full((1, len(rows.unknowns)), np.nan), np.zeros(1, dtype=np.int64)
    return arithmetic.balanced(
        [arithmetic.array([by * float(size)]) for by, size in zip(step, sizes[0], strict=True)], 1
    )


def _singular(
    plan: Plan, rows: PolishRows, context: RowContext, start: FloatArray, sizes: FloatArray, place: int, right: float
) -> float:
    """One instant at which steps do not converge: a double root, or nearly one. Returns the digits attained."""
    best = [context.wide[n][place : place + 1] for n in rows.unknowns]
    if right <= 0.0:
        best = [context.evaluator.arithmetic.floats(start[place : place + 1, j]) for j in range(start.shape[1])]
    here, size = context.at(place), sizes[place : place + 1]
    for attempt in (_double_root, _newton):
        for j, n in enumerate(rows.unknowns):
            here.wide[n] = context.evaluator.arithmetic.floats(start[place : place + 1, j])
            here.floats[n] = start[place : place + 1, j]
        digits = attempt(plan, rows, here, size)
        if digits > right and not _moved_far(rows, here, start[place : place + 1], size)[0]:
            best, right = [here.wide[n] for n in rows.unknowns], digits
        if right >= context.evaluator.arithmetic.digits:
            break
    for n, value in zip(rows.unknowns, best, strict=True):
        context.wide[n][place : place + 1] = value
        context.floats[n] = context.evaluator.arithmetic.rounded(context.wide[n])
    if right >= context.evaluator.arithmetic.digits:
        return right
    # steps that shrink by a constant factor leave several times the last one
    return max(right - 1.0, 0.0) if right > 0.0 else -float(np.log10(SAME_SOLUTION_POLISHED))


def _double_root(plan: Plan, rows: PolishRows, here: RowContext, size: FloatArray) -> float:
    """Deflation, where the Jacobian loses one rank; 0 where the point it leads to does not solve the equations."""
    n = len(rows.unknowns)
    matrix, _ = scaled(_jacobian(rows, here, 1), size)
    if not np.isfinite(matrix).all() or len(rows.residuals) < n:
        return 0.0
    _, singular, right = np.linalg.svd(matrix[0])
    if singular[-1] > RANK_FOR_DEFLATION * singular[0] or (n > 1 and singular[-2] < RANK_FOR_DEFLATION * singular[0]):
        return 0.0
    arithmetic = here.evaluator.arithmetic
    first = len(here.wide)
    direction = right[-1] * size[0]
    normal = right[-1] / size[0]
    both = deflated_rows(plan, rows, first)
    for value in (*direction, *normal):
        here.wide.append(arithmetic.floats(np.array([value])))
        here.floats.append(np.array([value]))
    digits = float(
        _iterate(both, here, np.concatenate([size, np.maximum(np.abs(direction), size[0])[None]], axis=1))[0]
    )
    del here.wide[first:], here.floats[first:]
    residuals, exponents = arithmetic.balanced(here.values(rows), 1)
    gradients = np.maximum(np.abs(_jacobian(rows, here, 1) * size[:, None, :]).max(axis=2, initial=0.0), LEAST_DIVISOR)
    off = float(np.max(np.abs(residuals) / gradients))
    left = np.inf if off == 0.0 else -(np.log10(off) + float(exponents[0]) * np.log10(2.0))
    return digits if left >= arithmetic.digits else 0.0


def _newton(_: Plan, rows: PolishRows, here: RowContext, size: FloatArray) -> float:
    """Newton's method with all digits in the Jacobian too, at one instant; 0 for numbers that are of fixed size."""
    possible = isinstance(here.evaluator.arithmetic, DigitsArithmetic) and len(rows.residuals) >= len(rows.unknowns)
    return float(_iterate(rows, here, size, newton=True)[0]) if possible else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class RefinedPoses(Poses):
    """`Poses` rounded from more digits, which ``pose`` (by thing), ``scalars`` (a variable's components by (name,
    axis)) and ``instants`` (the times) still have.
    """

    evaluator: Evaluator
    pose: tuple[BodyPose, ...]
    scalars: dict[tuple[str, int | None], Number]
    instants: Number
    size: float
    things: tuple[Thing, ...]

    @property
    def high_precision(self) -> RefinedPoses | None:
        """Itself, where more digits are asked for than a float has."""
        return None if self.evaluator.arithmetic.shown is None else self

    def turn(self, thing: int) -> Number:
        """(F,) a thing's turn in degrees, with all digits."""
        return self.pose[thing].angle

    def scalar(self, name: str, axis: int | None) -> Number:
        """(F,) a variable, or one component of it, with all digits."""
        return self.scalars[name, axis]

    def clock(self) -> Number:
        """(F,) the times, exactly."""
        return self.instants

    def coordinate(self, thing: int, local: tuple[float, float], axis: int) -> Number:
        """(F,) one world coordinate of a thing's point, with all digits."""
        x, y = (self.evaluator.constant(value) for value in stated_point(self.things[thing], local))
        return self.pose[thing].world(x, y)[axis]

    def world(self, thing: int, local: tuple[float, float]) -> FloatArray:
        """(F, 2) world positions of the point ``local`` of thing number ``thing``, rounded once."""
        rounded = self.evaluator.arithmetic.rounded
        return np.stack([rounded(self.coordinate(thing, local, axis)) for axis in (0, 1)], axis=-1)

    def texts(self, value: Number) -> list[str]:
        """(F,) numbers with the digits asked for; in `high`, the shortest text of the nearest float."""
        arithmetic = self.evaluator.arithmetic
        if isinstance(arithmetic, DigitsArithmetic):
            return [arithmetic.text(item, self.size) for item in value]
        return [repr(item) for item in (arithmetic.rounded(value) + 0.0).tolist()]

    def select(self, chosen: NDArray[np.int64] | slice) -> RefinedPoses:
        """The frames ``chosen`` (positions in these arrays, not frame numbers)."""
        plain = Poses.select(self, chosen)
        return RefinedPoses(
            **{name: getattr(plain, name) for name in Poses.__dataclass_fields__},
            evaluator=self.evaluator,
            pose=tuple(pose.each(lambda part: part[chosen]) for pose in self.pose),
            scalars={key: value[chosen] for key, value in self.scalars.items()},
            instants=self.instants[chosen],
            size=self.size,
            things=self.things,
        )
