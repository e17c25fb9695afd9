"""How pushed things move: of all velocities that the equations and the touching inequalities allow, those that follow
the wishes; of these, those that follow the lower-ranking wishes, level by level; and of these the least.

The unknowns' velocities are measured in the block's metric: v = W y, with W' M W = 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.structure.metric import Metric
from movimentum.records import dataclass, field, replace
from movimentum.solver.block.problem import Damping, damped, null_space, scaled
from movimentum.solver.pushing.quadratic_program import Rows, non_negative_least_squares, row_numbers, shortest_vector
from movimentum.tolerances import (
    LEAST_DIVISOR,
    PUSH_DAMPING,
    PUSH_HOLDS,
    PUSH_MOVES,
    PUSH_RANK,
    PUSH_RESTS,
    PUSH_UNSEEN,
    RANK_OF_ROWS,
)


@dataclass(frozen=True, slots=True, eq=False)
class WishLevel:
    """Wishes of one rank: their ``slopes`` (p, n), and how fast their values should change (p,)."""

    slopes: FloatArray
    want: FloatArray
    damping: Damping


@dataclass(frozen=True, slots=True, eq=False)
class PushedInstant:
    """A block at an instant: the rows J v = ``want`` (m, n), the ``pull`` (n,) of what is known (see `Metric.pull`),
    the ``levels`` of its wishes, the higher ones first, and the k inequalities ``pushes`` (k, n) v >= ``least`` (k,).
    """

    metric: Metric
    rows: FloatArray
    want: FloatArray
    pull: FloatArray | None
    levels: Sequence[WishLevel]
    pushes: FloatArray
    least: FloatArray
    rounding_rate: float = 0.0
    """How fast a value may change that stands still, by rounding."""
    whitened_by_active: dict[bytes, WhitenedInstant] = field(default_factory=dict[bytes, "WhitenedInstant"])

    def without(self, gone: Sequence[int]) -> PushedInstant:
        """The same without some of the inequalities, which keep their numbers."""
        least, rows = self.least.copy(), self.pushes.copy()
        rows[gone] = 0.0
        least[gone] = 0.0
        return PushedInstant(self.metric, self.rows, self.want, self.pull, self.levels, rows, least, self.rounding_rate)

    def whitened(self, which: Rows) -> WhitenedInstant:
        """With the inequalities ``which`` kept as equations; made once."""
        key = which.tobytes()
        found = self.whitened_by_active.get(key)
        if found is None:
            found = self.whitened_by_active[key] = WhitenedInstant(self, which)
        return found


@dataclass(frozen=True, slots=True, eq=False)
class PushedVelocity:
    """A velocity ``v`` (n,), how fast each inequality opens (k,), and which of them ``active`` it. ``tolerance`` (k,):
    slower is not moving. Where no velocity is allowed, ``v`` is None, and those that hold are the ones that jam.
    ``is_certain``: it is the one with these as equations. Where a wish is hardly felt, as long as it is, none may be.
    """

    v: FloatArray | None
    opening_rates: FloatArray
    active: Rows
    tolerance: FloatArray
    is_certain: bool = True


class WhitenedInstant:
    """An instant in the whitened unknowns: everything that is asked of it."""

    def __init__(self, now: PushedInstant, active: Rows) -> None:
        """``active``: the inequalities that are kept as equations."""
        self.now = now
        self.white, self.scale = now.metric.whitening
        rows = np.concatenate([now.rows, now.pushes[active]])
        want = np.concatenate([now.want, now.least[active]])
        wide, lengths = scaled((rows @ self.white)[None], np.ones(len(self.scale)))
        self.finite = bool(np.isfinite(wide).all() and np.isfinite(want).all())
        rank, self.free, self.inverse = null_space(wide[0])
        wanted = np.nan_to_num(want) / lengths[0]
        y = self.inverse @ wanted
        self.agrees = True
        if rank < len(rows):  # rows that depend on each other may contradict each other
            off = float(np.max(np.abs(wide[0] @ y - wanted)))
            self.agrees = off <= max(PUSH_MOVES * float(np.max(np.abs(wanted))), now.rounding_rate)
        self.still = np.zeros_like(y) if now.pull is None else self.white.T @ now.pull
        self.least = y - self.free @ (self.free.T @ self.still)
        self.pushes = now.pushes @ self.white
        self.reference = np.linalg.norm(self.pushes, axis=1)

    @cached_property
    def following_wishes(self) -> FloatArray:
        """The y (n,) that follows the wishes level by level, whatever the inequalities say that are not held."""
        y, free = self.least, self.free
        for level in self.now.levels:
            if not free.shape[1]:
                break
            slopes = level.slopes @ self.white
            along = _without_rounding_rows(slopes @ free, slopes)
            missing = level.want - slopes @ y
            moves = self.white @ (free @ along.T)
            gradients = level.slopes * np.where(self.now.metric.weighted, self.scale, 0.0)
            reach = np.asarray(along @ along.T, dtype=np.float64)
            change = damped(reach, missing, level.damping, moves / self.scale[:, None], gradients)
            y = y + free @ (along.T @ change)
            free = free @ _unaffected_directions(along, slopes)
        return y

    def lexicographic(self, guess: Rows | None) -> tuple[FloatArray | None, Rows]:
        """The y (n,) that follows the wishes level by level as far as the inequalities let it, and those that hold it;
        None, and those that contradict each other, where there is none.
        """
        now = self.now
        y, free = self.least, self.free
        none = np.zeros(0, dtype=np.intp)
        holding: list[Rows] = [none]
        open_ = self._relevant(free)
        blocked = np.setdiff1d(np.arange(len(now.least)), open_)
        lengths = np.maximum(self.reference, LEAST_DIVISOR)
        lacking = (now.least - self.pushes @ y) / lengths
        most = max(float(np.max(np.abs(now.least) / lengths, initial=0.0)), float(np.linalg.norm(y)))
        jams = blocked[lacking[blocked] > np.maximum(PUSH_MOVES * most, now.rounding_rate / lengths[blocked])]
        if len(jams):
            return None, jams
        first = shortest_vector(
            self.pushes[open_] @ free, now.least[open_] - self.pushes[open_] @ y, _places(open_, guess)
        )
        if first.y is None:
            return None, open_[first.active]
        place = first.y  # in the free directions
        for level in now.levels:
            if not free.shape[1]:
                break
            slopes = level.slopes @ self.white
            along = _without_rounding_rows(slopes @ free, slopes)
            missing = level.want - slopes @ y
            if not along.any():
                continue
            strongest = float(np.max(np.linalg.norm(slopes, axis=1), initial=0.0))
            reach = np.asarray(along @ along.T, dtype=np.float64)
            target = along @ (along.T @ damped(reach, missing, level.damping))
            soft = PUSH_DAMPING * strongest
            # |along p - target|^2 + soft^2 |p|^2 least: the shortest vector again, about the unhindered place
            hessian = np.asarray(along.T @ along, dtype=np.float64) + soft * soft * np.eye(free.shape[1])
            root = np.asarray(np.linalg.cholesky(hessian), dtype=np.float64)
            centre = np.asarray(np.linalg.solve(hessian, along.T @ target), dtype=np.float64)
            open_ = self._relevant(free)
            there = self.pushes[open_] @ free
            back = np.asarray(np.linalg.solve(root, there.T), dtype=np.float64).T
            found = shortest_vector(back, now.least[open_] - self.pushes[open_] @ y - there @ centre)
            if found.y is None:
                break
            holding.append(open_[found.active])
            place = centre + np.asarray(np.linalg.solve(root.T, found.y), dtype=np.float64)
            left = _unaffected_directions(along, slopes)
            y = y + free @ (place - left @ (left.T @ place))
            place = left.T @ place
            free = free @ left
        open_ = self._relevant(free)
        found = shortest_vector(
            self.pushes[open_] @ free, now.least[open_] - self.pushes[open_] @ y, _places(open_, guess)
        )
        if found.y is not None:
            place = found.y
            holding.append(open_[found.active])
        y = y + free @ place
        return y, np.unique(np.concatenate(holding)).astype(np.intp)

    def releasable(self, y: FloatArray, which: Rows) -> Rows:
        """Of the inequalities ``which`` hold ``y`` (n,), those that would have to pull: a way leads off them on which a
        level gains, with no loss to the levels above, and along which all the others of ``which`` hold.
        """
        free = self.free
        for level in self.now.levels:
            slopes = level.slopes @ self.white
            along = _without_rounding_rows(slopes @ free, slopes)
            missing = slopes @ y - level.want
            large = np.linalg.norm(slopes, axis=1) * np.linalg.norm(y) + np.abs(level.want)
            missing = np.where(np.abs(missing) > PUSH_UNSEEN * large, missing, 0.0)
            gradient = along.T @ missing
            if np.linalg.norm(gradient) <= PUSH_UNSEEN * np.linalg.norm(along) * np.linalg.norm(missing):
                gradient = np.zeros_like(gradient)  # what is missing is not to be had
            off = self._releasable_at(free, gradient, which)
            if len(off):
                return off
            free = free @ _unaffected_directions(along, slopes)
        return self._releasable_at(free, free.T @ (y + self.still), which)

    def _releasable_at(self, free: FloatArray, gradient: FloatArray, which: Rows) -> Rows:
        """Those of ``which`` that open along the steepest way in the ``free`` directions that they leave."""
        rows = _without_rounding_rows(self.pushes[which] @ free, self.pushes[which])
        lengths = np.linalg.norm(rows, axis=1)
        some = lengths > 0.0
        unit = rows[some] / lengths[some, None]
        if not len(unit):
            return which[:0]
        forces = np.asarray(np.linalg.lstsq(unit.T, gradient, rcond=PUSH_RANK)[0], dtype=np.float64)
        borne = np.asarray(unit.T @ forces, dtype=np.float64)  # the rest is free to be followed
        size = float(np.linalg.norm(borne))
        if size <= PUSH_HOLDS * float(np.linalg.norm(gradient)):
            return which[:0]
        every = np.arange(len(unit))
        opening: FloatArray = unit @ (unit.T @ non_negative_least_squares(unit.T, borne / size, every) - borne / size)
        return which[some][opening > PUSH_HOLDS]

    def _relevant(self, free: FloatArray) -> Rows:
        """The inequalities that restrict the free directions."""
        seen = np.linalg.norm(self.pushes @ free, axis=1) > PUSH_UNSEEN * self.reference
        return np.nonzero(seen)[0]


def _places(some: Rows, guess: Rows | None) -> Rows | None:
    """Where among ``some`` those of the ``guess`` are."""
    return None if guess is None else np.nonzero(np.isin(some, guess))[0]


def _without_rounding_rows(along: FloatArray, slopes: FloatArray) -> FloatArray:
    """The values' slopes ``along`` what is free, without those that are rounding."""
    seen = np.linalg.norm(along, axis=1) > PUSH_UNSEEN * np.linalg.norm(slopes, axis=1)
    return np.where(seen[:, None], along, 0.0)


def _unaffected_directions(along: FloatArray, slopes: FloatArray) -> FloatArray:
    """The free directions (n, k) that values do not see: ``along`` are their ``slopes`` in these."""
    lengths = np.linalg.norm(along, axis=1)
    seen = lengths > PUSH_UNSEEN * np.linalg.norm(slopes, axis=1)
    return null_space(along[seen] / lengths[seen, None], RANK_OF_ROWS)[1]


def velocity_with_active(now: PushedInstant, which: Rows) -> FloatArray:
    """The velocity (n,) with the inequalities ``which`` kept as equations, and no others."""
    linear = now.whitened(which)
    if not linear.finite:
        return np.full(len(linear.scale), np.nan)
    return without_rounding(linear.white @ linear.following_wishes, linear.scale)


def without_rounding(v: FloatArray, scale: FloatArray) -> FloatArray:
    """``v`` (n,) without what rounding makes of a zero beside what is large: what nothing moves stays."""
    size = np.abs(v) / scale
    return np.where(size > PUSH_RESTS * float(np.max(size, initial=0.0)), v, 0.0)


def pushed_velocity(now: PushedInstant, guess: Rows | None = None) -> PushedVelocity:
    """The velocity that all inequalities allow; ``guess``: which of them may hold it."""
    none = np.zeros(0, dtype=np.intp)
    free = now.whitened(none)
    if not free.finite:
        nowhere = np.full(len(now.least), np.nan)
        return PushedVelocity(np.full(len(free.scale), np.nan), nowhere, none, nowhere)
    lengths = np.maximum(free.reference, LEAST_DIVISOR)
    demanded = float(np.max(np.abs(now.least) / lengths, initial=0.0))

    def judged(y: FloatArray, holds: Rows) -> PushedVelocity:
        tolerance = np.maximum(PUSH_MOVES * max(float(np.linalg.norm(y)), demanded), now.rounding_rate / lengths)
        return PushedVelocity(free.white @ y, (free.pushes @ y - now.least) / lengths, holds, tolerance)

    def settled(which: Rows) -> PushedVelocity | None:
        """Beginning with these that hold, others are taken, or let go, until it is the velocity that is looked for."""
        seen: set[tuple[int, ...]] = set()
        while tuple(row_numbers(which)) not in seen:
            seen.add(tuple(row_numbers(which)))
            if not now.whitened(which).agrees:
                return None
            y = now.whitened(which).following_wishes
            found = judged(y, which)
            low = found.opening_rates < -found.tolerance
            if low[which].any():
                return None
            if low.any():
                which = np.union1d(which, np.argmin(found.opening_rates + found.tolerance)).astype(np.intp)
                continue
            loose = free.releasable(y, which)
            if not len(loose):
                return found
            which = np.setdiff1d(which, loose)
        return None

    found = settled(none if guess is None else guess)
    if found is not None:
        return found
    y, holding = free.lexicographic(guess)
    if y is None:
        return PushedVelocity(
            None, judged(free.following_wishes, none).opening_rates, holding, judged(free.least, none).tolerance
        )
    found = judged(y, holding)
    holding = holding[found.opening_rates[holding] <= found.tolerance[holding]]  # a level below may have opened others
    return settled(holding) or replace(found, active=holding, is_certain=False)


def opening_rates(now: PushedInstant, v: FloatArray) -> FloatArray:
    """How fast each inequality opens (k,), in the metric's units, with a velocity ``v`` (n,)."""
    white, _ = now.metric.whitening
    lengths = np.linalg.norm(now.pushes @ white, axis=1)
    return (now.pushes @ v - now.least) / np.maximum(lengths, LEAST_DIVISOR)


def not_opening(holds: Rows, opening: FloatArray, tolerance: FloatArray) -> Rows:
    """The active inequalities, and all others that do not open."""
    return np.union1d(holds, np.nonzero(opening <= tolerance)[0]).astype(np.intp)
