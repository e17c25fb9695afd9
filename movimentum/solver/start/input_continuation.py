"""Finds a Newton block's solution on the branch of a path that ended long before.

Meanwhile the block's inputs may have gone far away and come back from elsewhere, so Newton's method from the last pose
finds nothing, or another branch. So the block is led there: starting from a pose of the path, its inputs go straight to
their values at the other time, and the pose is continued along with them (a parameter homotopy: Sommese & Wampler 2005,
*The Numerical Solution of Systems of Polynomials*, ch. 7).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.expressions import Expr, rebuild, symbol, symbols, walk
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.lowering.unknowns import unknown_number
from movimentum.records import replace
from movimentum.solver.basis.block_memo import code_of
from movimentum.solver.block.block_at_instant import ITERATIONS
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.newton import newton
from movimentum.solver.block.problem import BlockProblem, scaled, track_scale
from movimentum.solver.continuation.steps import CERTAIN_STEP
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import (
    FOLD_CLOSED,
    LEADING_DIFFERENCE,
    LEAST_DIVISOR,
    RESTING_ON_PATH,
    SHORTEST_LEADING_STEP,
    SINGULAR_ON_PATH,
    STRAIGHT_DRIVE,
)

LARGEST_BLOCK = 24
"""Unknowns of a block that is led; of a larger one every look costs too much."""
SOUND_CONDITION = 0.1
"""Of the best conditioned pose of a path: those that it is led on from are as well conditioned as that."""
POSES_TO_CHOOSE_FROM = 33
"""Poses of a path to choose from."""
_EXACT = {"add", "mul", "neg"}


def follow_inputs(
    piece: Piece, block: Newton, track: NodeTrack, core: FloatArray, times: FloatArray
) -> tuple[FloatArray, BoolArray] | None:
    """Core values (F, n) of ``block`` at ``times`` (F,), and where (F,) they are a solution.

    They are led there from a pose of the ``track``, else found by Newton's method from ``core`` (n,), the last pose.
    None where the block is free or large, or what it depends on is itself not solved for at these times.
    """
    upstream = piece.upstream(block.number)
    ended = (t.until < times[-1] for n in upstream if isinstance(t := piece.tracks[n], NodeTrack))
    if not block.is_square or block.residual is None or len(core) > LARGEST_BLOCK or any(ended):
        return None
    nodes = np.unique(np.linspace(0, len(track.tau) - 1, POSES_TO_CHOOSE_FROM).astype(np.int64))
    count, total, scale = len(times), len(times) + len(nodes), track_scale(piece.plan, block)
    instants = piece.instants(np.concatenate([times, track.tau[nodes]]))
    x, good = np.repeat(core[None], count, axis=0), np.zeros(count, dtype=np.bool_)
    with np.errstate(all="ignore"):
        state, bad = piece.evaluate(instants, upstream)
        problem = BlockProblem.of(block, state, instants.clocks, scale)
        moved, drives = _with_inputs(piece, block, state, instants.clocks, total)
        if not _are_collinear(drives):  # straight is not how it goes: what Newton's method finds counts, too
            outcome = newton(problem.at(np.arange(count), total), x, iterations=30, limit=0.1)
            x, good = outcome.x, ~bad[:count] & (outcome.error <= FOLD_CLOSED)
        jacobians = problem.at(np.arange(count, total), total).jacobian(track.values[nodes])
        nearest = _nearest(drives, count, jacobians, scale)
        asked = np.nonzero(~bad[:count] & np.isfinite(drives[:, :count]).all(axis=0))[0]
        way = _InputPath(moved, drives[:, count + nearest[asked]], drives[:, asked], scale)
        found, arrived = way.followed(track.values[nodes[nearest[asked]]])
    x[asked[arrived]] = found[arrived]
    good[asked[arrived]] = True
    return x, good


def _nearest(drives: FloatArray, count: int, jacobians: FloatArray, scale: FloatArray) -> IntArray:
    """For each of the first ``count`` columns of ``drives`` (D, F), the number of the one nearest to it among the
    others, if well conditioned: their ``jacobians`` are (F - count, n, n).
    """
    singular = np.linalg.svd(np.nan_to_num(scaled(jacobians, scale)[0]), compute_uv=False)
    conditions = np.nan_to_num(singular[:, -1] / singular[:, 0])
    sound = np.nonzero(conditions >= SOUND_CONDITION * np.max(conditions))[0]
    ends, poses = drives[:, :count], drives[:, count:]
    units = np.maximum(np.ptp(poses, axis=1), LEAST_DIVISOR)[:, None, None]
    away = np.sum(np.square((ends[:, :, None] - poses[:, None, sound]) / units), axis=0)
    return np.asarray(sound[np.argmin(np.where(np.isfinite(away), away, np.inf), axis=1)], dtype=np.int64)


def _are_collinear(drives: FloatArray) -> bool:
    """Whether the numbers (D, F) that drive a block keep to one line: then it has no solution on its branch where it is
    not led to one.
    """
    ways = (drives - drives[:, -1:])[:, np.isfinite(drives).all(axis=0)]
    lengths = np.max(np.abs(ways), axis=0, initial=0.0)
    told = lengths > STRAIGHT_DRIVE * np.max(np.abs(drives[:, -1]), initial=0.0)
    singular = np.linalg.svd(ways[:, told] / lengths[told], compute_uv=False)
    return len(singular) < 2 or bool(singular[1] <= STRAIGHT_DRIVE * singular[0])


def _with_inputs(
    piece: Piece, block: Newton, state: State, clocks: Sequence[FloatArray], count: int
) -> tuple[Newton, FloatArray]:
    """``block`` as one that reads no clocks, but the numbers that drive it, and these numbers (D, F) at F instants."""
    first = len(piece.plan.system.unknowns)
    atoms: dict[Expr, Expr] = {}
    residuals, slopes = (_without_time(roots, atoms, first) for roots in (block.residuals, block.slopes))
    starts = piece.plan.clocks
    asked = symbols(*residuals)
    driving = {n: value for n in block.inputs if (value := state[n]) is not None}
    for atom, named in atoms.items():
        if asked.issuperset(symbols(named)):
            (driving[unknown_number(named.payload)],) = code_of((atom,), starts)(state, clocks)
    moved = replace(
        block,
        inputs=frozenset(driving),
        residuals=residuals,
        slopes=slopes,
        residual=code_of(residuals, starts),
        jacobian=code_of(slopes, starts),
    )
    return moved, np.array([np.broadcast_to(driving[n], count) for n in moved.inputs]).reshape(-1, count)


def _without_time(roots: Sequence[Expr], atoms: dict[Expr, Expr], first: int) -> tuple[Expr, ...]:
    """``roots`` with symbols (numbered from ``first``) for the ``atoms``: what depends on time alone, but for sums and
    products of that, so that the rows stay what they are for any values.
    """
    memo: dict[Expr, Expr] = {}
    for node in walk(*roots):
        memo[node] = rebuild(node, tuple(memo[arg] for arg in node.args))
        polynomial = node.op in _EXACT or (node.op == "div" and not node.args[1].timed)
        if node.timed and not symbols(node) and not polynomial:
            memo[node] = atoms.setdefault(node, symbol(first + len(atoms)))
    return tuple(memo[root] for root in roots)


class _InputPath:
    """F ways of ``block`` from the numbers ``begin`` (D, F) that drive it to the numbers ``end``."""

    def __init__(self, block: Newton, begin: FloatArray, end: FloatArray, scale: FloatArray) -> None:
        self.block, self.begin, self.end, self.scale = block, begin, end, scale

    def at(self, ways: IntArray, part: FloatArray) -> BlockProblem:
        """The problem of some ``ways`` (K,), each this ``part`` (K,) of it on."""
        begin, end = self.begin[:, ways], self.end[:, ways]
        values = (1.0 - part) * begin + part * end
        return BlockProblem(self.block, dict(zip(self.block.inputs, values, strict=True)), (), self.scale)

    def rates(self, ways: IntArray, part: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The velocities (K, n) of core values ``x`` (K, n) on the way, and the signs (K,) of the Jacobians there (0:
        singular).
        """
        drift = self.at(ways, part + LEADING_DIFFERENCE).residual(x) - self.at(
            ways, part - LEADING_DIFFERENCE
        ).residual(x)
        rows, lengths = scaled(self.at(ways, part).jacobian(x), self.scale)
        right = -drift / (2.0 * LEADING_DIFFERENCE) / lengths
        velocity, sign = np.zeros_like(x), np.zeros(len(x))
        known = np.nonzero(np.isfinite(rows).all(axis=(1, 2)) & np.isfinite(right).all(axis=1))[0]
        singular = np.linalg.svd(rows[known], compute_uv=False)
        known = known[singular[:, -1] > SINGULAR_ON_PATH * singular[:, 0]]
        velocity[known] = np.linalg.solve(rows[known], right[known][..., None])[..., 0] * self.scale
        sign[known] = np.linalg.slogdet(rows[known])[0]
        return velocity, sign

    def followed(self, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Core values (F, n) at the ends of the ways that begin at ``x`` (F, n), and where (F,) they are a solution."""
        x = x.copy()
        count = len(x)
        part, length = np.zeros(count), np.ones(count)
        velocity, sides = self.rates(np.arange(count), part, x)
        going = sides != 0.0
        while going.any():
            ways = np.nonzero(going)[0]
            ahead = np.minimum(part[ways] + length[ways], 1.0)
            predicted = x[ways] + (ahead - part[ways])[:, None] * velocity[ways]
            moved = np.max(np.abs(predicted - x[ways]) / self.scale, axis=1)
            near = moved <= CERTAIN_STEP.far
            good = np.zeros(len(ways), dtype=np.bool_)
            some = ways[near]
            outcome = newton(self.at(some, ahead[near]), predicted[near], iterations=ITERATIONS)
            off = np.max(np.abs(outcome.x - predicted[near]) / self.scale, axis=1)
            rates, sign = self.rates(some, ahead[near], outcome.x)
            right = (
                outcome.converged
                & (off <= CERTAIN_STEP.correction * moved[near] + RESTING_ON_PATH)
                & (sign == sides[some])
            )
            good[near] = right
            x[some[right]], velocity[some[right]] = outcome.x[right], rates[right]
            part[ways[good]] = ahead[good]
            length[ways] *= np.where(good, 2.0, 0.5)
            going[ways] = (part[ways] < 1.0) & (length[ways] > SHORTEST_LEADING_STEP)
        return x, part >= 1.0
