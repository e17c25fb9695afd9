"""The equations of one block, given its inputs: residuals and Jacobians as functions of its core unknowns alone.

Rows and unknowns are scaled by their natural sizes before any decision, and damped in directions that lose their
strength.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Block, Free, Newton
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import ThingAngle
from movimentum.solver.basis.effort import charge_effort
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import LEAST_DIVISOR, RANK_OF_ROWS, WISH_DIRECTION_FOUND, WISH_DIRECTION_LOST, WISH_ROUNDING

if TYPE_CHECKING:
    from movimentum.planning.structure.linear_rows import SparseRows

Values = Mapping[int, FloatArray]
"""By unknown number: (F,), or what broadcasts to it."""


@dataclass(frozen=True, slots=True, eq=False)
class BlockProblem:
    """The rows of ``block`` at F instants: ``inputs`` are the values that it reads of earlier blocks, ``clocks`` (F,)
    each, ``scale`` (n,) the natural sizes of its n core unknowns; (F, n) where the "instants" are variants.

    Core values ``x`` are (F, n) throughout. Nothing that is passed in is ever written to.
    """

    block: Newton
    inputs: Values
    clocks: Sequence[FloatArray]
    scale: FloatArray

    @staticmethod
    def of(block: Newton, state: State, clocks: Sequence[FloatArray], scale: FloatArray) -> BlockProblem:
        """The problem in a solved state of all blocks before it."""
        inputs = {n: value for n in block.inputs if (value := state[n]) is not None}
        return BlockProblem(block, inputs, clocks, scale)

    def given(self, more: Values) -> BlockProblem:
        """The same with more inputs, or others."""
        return replace(self, inputs={**self.inputs, **more})

    def first(self, copies: int = 1) -> BlockProblem:
        """The first of the instants, ``copies`` times."""

        def repeated(value: FloatArray) -> FloatArray:
            return np.full(copies, first_of(value))

        inputs = {n: repeated(value) for n, value in self.inputs.items()}
        return replace(self, inputs=inputs, clocks=tuple(map(repeated, self.clocks)))

    def at(self, places: NDArray[np.int64], count: int) -> BlockProblem:
        """Some of ``count`` instants."""

        def some(value: FloatArray) -> FloatArray:
            return value[places] if len(value) == count else np.broadcast_to(value, count)[places]

        inputs = {n: value if np.ndim(value) == 0 else some(value) for n, value in self.inputs.items()}
        clocks = [some(np.atleast_1d(clock)) for clock in self.clocks]
        scale = self.scale if self.scale.ndim == 1 else self.scale[places]
        return replace(self, inputs=inputs, clocks=clocks, scale=scale)

    def every(self, step: int) -> BlockProblem:
        """The first of its instants, and every one that is so many after."""

        def some(value: FloatArray) -> FloatArray:
            return value[::step] if np.ndim(value) else value

        inputs = {n: some(value) for n, value in self.inputs.items()}
        return replace(self, inputs=inputs, clocks=tuple(map(some, self.clocks)))

    def values(self, x: FloatArray) -> dict[int, FloatArray]:
        """The inputs and the core, by unknown number."""
        return {**self.inputs, **dict(zip(self.block.core, x.T, strict=True))}

    def residual(self, x: FloatArray) -> FloatArray:
        """(F, m) residuals."""
        rows = self.sparse
        if rows is not None:
            return self.sparse_residual(rows, x)
        assert self.block.residual is not None
        found = self.block.residual(self.values(x), self.clocks)
        result = np.empty((len(x), len(found)))
        for i, value in enumerate(found):
            result[:, i] = value
        return result

    def jacobian(self, x: FloatArray) -> FloatArray:
        """(F, m, n) derivatives of the residuals by the core."""
        block = self.block
        rows = self.sparse
        if rows is not None:
            return _filled(rows, self.sparse_slopes(rows, x), len(block.core))
        assert block.jacobian is not None
        result = np.zeros((len(x), block.rows, len(block.core)))
        for (i, j), value in zip(block.entries, block.jacobian(self.values(x), self.clocks), strict=True):
            result[:, i, j] = value
        return result

    def wishes(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The errors (F, p) of the wishes that draw the block, and their Jacobian (F, p, n)."""
        block = self.block
        wishes = block.wishes
        count = 0 if wishes is None else wishes.count
        errors = np.zeros((len(x), count))
        jacobian = np.zeros((len(x), count, len(block.core)))
        if wishes is not None:
            values = dict(self.inputs)  # and of the core what the wishes read: a large block has a thousand unknowns
            for j in {j for _, j in wishes.entries}:
                values[block.core[j]] = x[:, j]
            for i, value in enumerate(wishes.errors(values, self.clocks)):
                errors[:, i] = value
            for (i, j), value in zip(wishes.entries, wishes.slopes(values, self.clocks), strict=True):
                jacobian[:, i, j] = value
            # where it has no gradient (the distance of two places that are one), a wish draws nothing
            jacobian[~np.isfinite(jacobian).all(axis=2)] = 0.0
        return errors, jacobian

    def completed(self, x: FloatArray) -> dict[int, FloatArray]:
        """The inputs, the core, and the unknowns that are eliminated, by unknown number."""
        values = self.values(x)
        if self.block.explicit is not None:
            found = self.block.explicit(values, self.clocks)
            values.update(zip(self.block.targets, map(np.asarray, found), strict=True))
        return values

    @property
    def free_block(self) -> Free:
        """The block, where it leaves freedom."""
        rows = self.block.free_rows
        assert rows is not None
        return rows

    @property
    def sparse(self) -> SparseRows | None:
        """The rows of a large block by their terms."""
        return self.block.sparse

    def _coefficients(self, rows: SparseRows, count: int) -> FloatArray:
        """(F, T) coefficients of the terms at F instants."""
        values = np.repeat(rows.constants[None], count, axis=0)
        if rows.coefficients is not None:
            for t, value in zip(rows.varying, rows.coefficients(self.inputs, self.clocks), strict=True):
                values[:, t] = value
        return values

    def sparse_residual(self, rows: SparseRows, x: FloatArray) -> FloatArray:
        """(F, m) residuals of a large block."""
        values = self._coefficients(rows, len(x))
        for d in range(rows.factors.shape[1]):
            values = values * _with_gap_row(x)[:, rows.factors[:, d]]
        return np.array([np.bincount(rows.row, some, rows.rows) for some in values], dtype=np.float64)

    def sparse_slopes(self, rows: SparseRows, x: FloatArray) -> FloatArray:
        """(F, entries) of a large block's Jacobian, in the order of `SparseRows.indices`."""
        coefficients = self._coefficients(rows, len(x))
        chosen = [_with_gap_row(x)[:, rows.factors[:, d]] for d in range(rows.factors.shape[1])]
        result = np.zeros((len(x), len(rows.indices) + 1))
        for d in range(len(chosen)):
            slope = coefficients
            for other, value in enumerate(chosen):
                if other != d:
                    slope = slope * value
            for f, some in enumerate(slope):
                result[f] += np.bincount(rows.slots[:, d], some, result.shape[1])
        return result[:, :-1]


def _filled(rows: SparseRows, slopes: FloatArray, columns: int) -> FloatArray:
    """(F, m, n) from the (F, entries) of a sparse Jacobian."""
    result = np.zeros((len(slopes), rows.rows, columns))
    result[:, np.repeat(np.arange(rows.rows), np.diff(rows.indptr)), rows.indices] = slopes
    return result


def _with_gap_row(x: FloatArray) -> FloatArray:
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)


@dataclass(frozen=True, slots=True)
class Damping:
    """How `damped` bounds what it finds. ``weak``: of the strongest direction, how much weaker another may be and still
    be followed exactly; ``near``: wanted in a weak direction, more than this is damped the more; ``far``: wanted and
    not to be had, it counts for no more than this. Of several systems, ``near`` and ``far`` are (…, 1).
    """

    weak: float = 0.2
    near: float | FloatArray = np.inf
    far: float | FloatArray = np.inf


WEAK_DIRECTION = 0.5
"""Of what an error's own gradient promises, for the speed of the fastest anchor: how much less than that a direction
may bring and still count as strong.
"""


def damped_least_squares(rows: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
    """The least-squares solution of rows @ step = want, `damped`: as far as the rows let it, bounded where they do
    not.
    """
    if not np.isfinite(rows).all() or not np.isfinite(want).all():
        return np.zeros(int(rows.shape[1]), dtype=np.float64)
    reach = np.asarray(rows @ rows.T, dtype=np.float64)
    return np.asarray(rows.T @ damped(reach, want, damping), dtype=np.float64)


def damped(
    reach: FloatArray,
    want: FloatArray,
    damping: Damping,
    moves: FloatArray | None = None,
    slopes: FloatArray | None = None,
) -> FloatArray:
    """The y (p,) with ``reach`` y = ``want`` for a symmetric matrix (p, p), damped in its weak directions; or (…, p)
    for several.

    Directions that are strong are followed exactly. Where a direction loses its strength (an arm that comes to be
    stretched) damping sets in smoothly, so that speeds stay bounded (Nakamura & Hanafusa 1986, J. Dyn. Syst. Meas.
    Control 108; Maciejewski & Klein 1988, J. Robotic Syst. 5), the more of it the more is wanted there. What cannot be
    followed counts for only so much in the other directions: an arm would point ever more stiffly at a place ever
    farther out of its reach. The result depends on no basis.

    How strong a direction is, is measured against the strongest; and where ``moves`` (n, p) are given, what each error
    would move, and ``slopes`` (p, n), the errors' gradients in what moves anchors, both in units of what moves these by
    one, against how fast anything moves for it: one wish alone has no other direction to be weaker than.

    What is wanted in a lost direction shows in the others, by as much as rounding turns these. That is left out: it
    would grow where a straight chain is pushed along its line, or a bar turned away from its wish, and choose a side.
    """
    if not want.shape[-1]:
        return want
    squares, directions = np.linalg.eigh(reach)
    across = np.swapaxes(directions, -1, -2)
    largest = np.maximum(squares[..., -1:], 0.0)
    squares = np.maximum(squares, 0.0)
    part = squares / np.maximum(largest, LEAST_DIVISOR)
    if moves is not None and slopes is not None:
        promised = np.linalg.norm(across @ slopes, axis=-1) * np.max(np.abs(moves @ directions), axis=-2)
        part = np.minimum(part, np.square(squares / (WEAK_DIRECTION * np.maximum(promised, LEAST_DIVISOR))))
    wanted = (across @ want[..., None])[..., 0]
    edge = damping.weak**2
    added = np.hypot(edge, wanted / damping.near) * np.maximum(1.0 - part / edge, 0.0) ** 2
    known = np.clip((np.sqrt(part) - WISH_DIRECTION_LOST) / (WISH_DIRECTION_FOUND - WISH_DIRECTION_LOST), 0.0, 1.0)
    gains = known**2 * (3.0 - 2.0 * known) * part / np.maximum(part + added, LEAST_DIVISOR)
    left = np.square(wanted * (1.0 - gains))
    elsewhere = np.sqrt(np.maximum(np.sum(left, axis=-1, keepdims=True) - left, 0.0))
    told = np.abs(wanted) > WISH_ROUNDING * elsewhere
    followed = gains * np.where(told, wanted, 0.0) * np.minimum(1.0, damping.far / np.maximum(elsewhere, LEAST_DIVISOR))
    found = (directions @ (followed / np.maximum(squares, LEAST_DIVISOR))[..., None])[..., 0]
    return np.where(largest > 0.0, found, 0.0)


def scaled(jacobian: FloatArray, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The Jacobian with unknowns in units of ``scale`` (n,) or (F, n) and rows of unit length, and those rows' lengths
    (F, m).

    Counted as one linearization (see `solver.basis.effort`).
    """
    charge_effort()
    wide = jacobian * scale[..., None, :]
    lengths = np.sqrt(np.einsum("fmn,fmn->fm", wide, wide))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    return wide / lengths[..., None], lengths


def relative_error(residual: FloatArray, jacobian: FloatArray, scale: FloatArray) -> FloatArray:
    """(F,) largest residual, each row in units of its own gradient over unknowns of size ``scale``."""
    if residual.shape[1] == 0:
        return np.zeros(len(residual))
    wide = np.abs(jacobian) * scale[..., None, :]
    return np.max(np.abs(residual) / np.maximum(wide.max(axis=2, initial=0.0), LEAST_DIVISOR), axis=1)


def null_space(matrix: FloatArray, tolerance: float = RANK_OF_ROWS) -> tuple[int, FloatArray, FloatArray]:
    """Rank, the null space (n, n - rank) and the pseudo-inverse (n, m) of one scaled matrix (m, n)."""
    m, n = matrix.shape
    if m == 0:
        return 0, np.eye(n), np.zeros((n, 0))
    left, singular, right = np.linalg.svd(np.nan_to_num(matrix, posinf=0.0, neginf=0.0))
    rank = int(np.sum(singular > tolerance * max(singular[0], LEAST_DIVISOR))) if len(singular) else 0
    inverse = (right[:rank].T / singular[:rank]) @ left[:, :rank].T
    return rank, right[rank:].T, inverse


DEGREES_OF_RADIAN = math.degrees(1.0)


def scale_of(plan: Plan, unknowns: Sequence[int], size: FloatArray | None = None) -> FloatArray:
    """The natural size of each unknown (n,): 1 for a direction, a radian for an angle, else the scene's size.

    (V, n) for V variants whose scenes have the sizes ``size`` (V,).
    """
    sizes: list[float] = []
    for n in unknowns:
        payload = plan.system.unknowns[n].payload
        sizes.append(
            1.0
            if isinstance(payload, PoseCos | PoseSin)
            else DEGREES_OF_RADIAN
            if isinstance(payload, ThingAngle | Bearing)
            else 0.0
        )
    fixed = np.array(sizes)
    return np.where(fixed > 0.0, fixed, plan.size if size is None else size[:, None])


def track_scale(plan: Plan, block: Block) -> FloatArray:
    """`scale_of` of the block's core."""
    return scale_of(plan, block.core)


def sizes_at(x: FloatArray, scale: FloatArray) -> FloatArray:
    """What errors and steps near core values ``x`` (…, n) are measured in: what is far away changes in proportion to
    that, and an angle, however large, by radians.
    """
    return np.where(scale == DEGREES_OF_RADIAN, scale, np.maximum(scale, np.abs(x)))
