"""The exact derivatives of a solved segment with respect to the constants, by the implicit function theorem.

A block's equations F(x, y, k, t) = 0 in its unknowns x, given those y of earlier blocks and the constants k, hold for
all variants, so their derivatives do: J x_k = -(F_k + F_y y_k) with J = F_x. Block after block in the plan's order. A
last column does the same for time, J x_t = -(F_t + F_y y_t), for what is read at a time that varies itself.

Arrays of values broadcast to (V, F): V variants at F instants; slopes have one axis more at the end, of length C + 1.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import ONE, ZERO, Expr, symbols, walk
from movimentum.expressions.arrays import sincosd
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import differentiate
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import BodyUnknowns
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, Scene, ThingAngle
from movimentum.solver.basis.body_pose import AS_DRAWN, BodyPose, solved_pose, values_in_poses
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.variants import column
from movimentum.tolerances import SINGULAR_FOR_SLOPES
from movimentum.variants.tracing import OriginUnfolding, numbered, places_from


@dataclass(frozen=True, slots=True, eq=False)
class Dual:
    """``value`` broadcasts to (V, F), ``slope`` to (V, F, C); None: it changes with none of the constants."""

    value: Any
    slope: FloatArray | None = None

    def __add__(self, other: Dual) -> Dual:
        return Dual(self.value + other.value, _plus(self.slope, other.slope))

    def __sub__(self, other: Dual) -> Dual:
        return Dual(self.value - other.value, _plus(self.slope, None if other.slope is None else -other.slope))

    def __mul__(self, other: Dual) -> Dual:
        return Dual(self.value * other.value, _plus(times(other.value, self.slope), times(self.value, other.slope)))


def _plus(one: FloatArray | None, other: FloatArray | None) -> FloatArray | None:
    if one is None:
        return other
    return one if other is None else one + other


def times(value: Any, slope: FloatArray | None) -> FloatArray | None:
    """A slope times a value."""
    if slope is None:
        return None
    product: FloatArray = np.asarray(value)[..., None] * slope if np.ndim(value) else float(value) * slope
    return product


TIME = "time"
"""Stands for time among what expressions are differentiated by."""

SlopesOf = dict[Hashable, FloatArray | None]
"""The slopes of what expressions read, by the number of the input, and of `TIME`. Their last column is by time."""


def units(first: int, count: int) -> SlopesOf:
    """The slopes (1, 1, count + 1) of what nothing else decides: constants, as inputs number ``first`` on, and time."""
    rows = np.eye(count + 1)
    found: SlopesOf = {first + k: rows[k][None, None, :] for k in range(count)}
    found[TIME] = rows[count][None, None, :]
    return found


def full(dual: Dual, shape: tuple[int, int], columns: int) -> Dual:
    """With arrays of full shape (V, F) and (V, F, columns); no slope stays none."""
    slope = None if dual.slope is None else np.broadcast_to(dual.slope, (*shape, columns))
    return Dual(np.broadcast_to(dual.value, shape), slope)


@dataclass(frozen=True, slots=True, eq=False)
class DualFunction:
    """Expressions and all their partial derivatives, compiled together.

    ``reads``: what they depend on: numbers of inputs, and `TIME`. ``slopes``: (expression, place in ``reads``) of each
    derivative that is not zero everywhere.
    """

    function: Callable[..., tuple[Any, ...]]
    plain: Callable[..., tuple[Any, ...]]
    count: int
    reads: tuple[Hashable, ...]
    slopes: tuple[tuple[int, int], ...]

    def __call__(self, inputs: Sequence[Any], clocks: Sequence[FloatArray]) -> tuple[list[Any], list[Any]]:
        """The values, and the derivatives in the order of ``slopes``."""
        found = self.function(inputs, clocks)
        return list(found[: self.count]), list(found[self.count :])

    def duals(self, inputs: Sequence[Any], clocks: Sequence[FloatArray], slope_of: SlopesOf | None) -> list[Dual]:
        """The values with their slopes, given those of what they read; None: no slopes are asked for."""
        if slope_of is None:
            return [Dual(value) for value in self.plain(inputs, clocks)]
        values, partials = self(inputs, clocks)
        totals: list[FloatArray | None] = [None] * self.count
        for (i, j), partial in zip(self.slopes, partials, strict=True):
            totals[i] = _plus(totals[i], times(partial, slope_of.get(self.reads[j])))
        return [Dual(value, total) for value, total in zip(values, totals, strict=True)]


def dual_function(expressions: Sequence[Expr], place: Mapping[Hashable, int], clocks: Clocks) -> DualFunction:
    """Compile ``expressions``, whose symbols' payloads are inputs number ``place``. Their clocks are added to
    ``clocks``.
    """
    roots = [numbered(each, place) for each in expressions]
    reads: dict[Hashable, int] = {}
    slopes: list[tuple[int, int]] = []
    outputs: list[Expr] = []
    for i, root in enumerate(roots):
        timed = any(node.op == "clock" for node in _leaves(root))
        for what in (*sorted(n for n in symbols(root) if isinstance(n, int)), *((TIME,) if timed else ())):
            slope = differentiate(root, lambda node, what=what: ONE if _is(node, what) else ZERO)
            if slope != ZERO:
                slopes.append((i, reads.setdefault(what, len(reads))))
                outputs.append(slope)
    function = compiled([*roots, *outputs], clocks)
    return DualFunction(function, compiled(roots, clocks), len(roots), tuple(reads), tuple(slopes))


def _is(node: Expr, what: Hashable) -> bool:
    return node.op == "clock" if what == TIME else node.op == "symbol" and node.payload == what


def _leaves(root: Expr) -> list[Expr]:
    return [node for node in walk(root) if not node.args]


DRAWN_DUAL = AS_DRAWN.each(Dual)


@dataclass(frozen=True, slots=True, eq=False)
class _BlockSlopes:
    """The stated equations of a block, differentiated."""

    unknowns: tuple[int, ...]
    rows: int
    function: DualFunction


class SegmentSlopes:
    """One segment's ``plan``, read with traced constants ``names``, differentiated as far as ``payloads`` depend on it.
    ``clocks`` begin with those that count from ``starts``. ``exact``: they depend on nothing but the equations of an
    instant, and not on free motion, integrals or differential equations, whose slopes are not known here.
    """

    def __init__(
        self,
        plan: Plan,
        starts: Sequence[Fraction],
        names: Sequence[str],
        unfolding: OriginUnfolding,
        payloads: Sequence[Hashable],
    ) -> None:
        self.plan, self.names = plan, names
        self.clocks = Clocks(starts)
        self.unknowns = len(plan.system.unknowns)
        self.place = places_from(self.unknowns, names)
        system = plan.system
        unfold = unfolding.unfolded
        things = {p.thing for p in payloads if isinstance(p, AnchorCoordinate | ThingAngle)}
        self.bodies = [body for body in plan.bodies if body.thing in things]
        needed = _needed(plan, self.bodies, payloads)
        self.blocks: list[_BlockSlopes] = []
        needed_blocks = [block for block in plan.blocks if block.number in needed]
        self.exact = not any(
            block.free or any(system.equations[e].form not in (Form.PLAIN, Form.WINDING) for e in block.equations)
            for block in needed_blocks
        )
        for block in needed_blocks if self.exact else ():
            rows = [unfold(system.equations[e].residual) for e in block.equations]
            self.blocks.append(
                _BlockSlopes(tuple(block.unknowns), len(rows), dual_function(rows, self.place, self.clocks))
            )
        self.frames = {
            body.thing: dual_function([unfold(each) for each in _frame(plan, body.thing)], self.place, Clocks())
            for body in self.bodies
        }

    def state_slopes(
        self, state: State, clocks: Sequence[FloatArray], shape: tuple[int, int]
    ) -> dict[Hashable, FloatArray | None]:
        """The slopes (V, F, C + 1) of all unknowns of a solved ``state``; the last column is by time."""
        slope_of = units(self.unknowns, len(self.names))
        columns = len(self.names) + 1
        for block in self.blocks:
            if not block.unknowns:
                continue
            place = {n: j for j, n in enumerate(block.unknowns)}
            _, partials = block.function(state, clocks)
            if all(read in place or slope_of.get(read) is None for read in block.function.reads):
                slope_of.update(dict.fromkeys(block.unknowns))
                continue
            jacobian = np.zeros((*shape, block.rows, len(place)))
            right = np.zeros((*shape, block.rows, columns))
            for (i, j), partial in zip(block.function.slopes, partials, strict=True):
                read = block.function.reads[j]
                if isinstance(read, int) and read in place:
                    jacobian[..., i, place[read]] = partial
                else:
                    change = times(partial, slope_of.get(read))
                    if change is not None:
                        right[..., i, :] -= change
            found = _solved(jacobian, right)
            for n, j in place.items():
                slope_of[n] = found[..., j, :]
        return slope_of

    def poses(self, state: State, slope_of: SlopesOf | None, before: dict[int, BodyPose]) -> dict[int, BodyPose]:
        """The pose of each thing that the segment's constraints mention (as `Places.solved` has it)."""
        system = self.plan.system
        dx, dy = map(Dual, system.shift)

        def value(n: int) -> Dual | None:
            return None if state[n] is None else Dual(state[n], None if slope_of is None else slope_of.get(n))

        def placed(body: BodyUnknowns) -> BodyPose:
            rx, ry, ax, ay = self.frames[body.thing].duals(state, (), slope_of)
            old = before.get(body.thing, DRAWN_DUAL)
            return solved_pose(system, body, (rx, ry, ax, ay), value, old, _sine_and_cosine, (dx, dy))

        return {body.thing: placed(body) for body in self.bodies}


class AnchorSlopes:
    """Anchors as drawn, with how they change with the constants."""

    def __init__(
        self, scene: Scene, names: Sequence[str], unfolding: OriginUnfolding, payloads: Sequence[Hashable]
    ) -> None:
        wanted = {(p.thing, p.anchor) for p in payloads if isinstance(p, AnchorCoordinate)}
        self.anchors = sorted(wanted)
        unfold, things = unfolding.unfolded, scene.things
        places = [unfold(part) for thing, anchor in self.anchors for part in things[thing].anchors[anchor].coordinates]
        self.function = dual_function(places, places_from(0, names), Clocks())
        self.columns = len(names)

    def duals(self, varied: Sequence[FloatArray], *, slopes: bool) -> dict[tuple[int, int], tuple[Dual, Dual]]:
        """The local place of each anchor, for constants (V, 1) each."""
        slope_of = units(0, self.columns) if slopes else None
        found = self.function.duals(list(varied), (), slope_of)
        return {anchor: (found[2 * k], found[2 * k + 1]) for k, anchor in enumerate(self.anchors)}


def read_duals(
    payloads: Sequence[Hashable],
    plan: Plan,
    state: State,
    slope_of: SlopesOf | None,
    poses: dict[int, BodyPose],
    local: dict[tuple[int, int], tuple[Dual, Dual]],
) -> list[Dual]:
    """What is read off a solved segment; nan for a variable that it does not mention."""

    def other(payload: Hashable) -> Dual:
        n = plan.system.number_of.get(payload)
        return Dual(np.nan) if n is None else Dual(state[n], None if slope_of is None else slope_of.get(n))

    return values_in_poses(payloads, poses, lambda thing, anchor: local[thing, anchor], other, DRAWN_DUAL)


def _needed(plan: Plan, bodies: Sequence[BodyUnknowns], payloads: Sequence[Hashable]) -> set[int]:
    """The numbers of the blocks that decide where ``bodies`` are, and the variables among ``payloads``."""
    turning = {payload.thing for payload in payloads if isinstance(payload, ThingAngle)}
    wanted = [plan.system.number_of[payload] for payload in payloads if payload in plan.system.number_of]
    for body in bodies:
        turns = body.angle if body.thing in turning or body.c is None or body.s is None else None
        wanted += [n for n in (body.x, body.y, body.c, body.s, turns) if n is not None]
    return set(plan.rate_blocks(wanted))


def _frame(plan: Plan, thing: int) -> tuple[Expr, ...]:
    frame = plan.system.frame(thing)
    return *frame.stated_origin, *frame.stated_axis


def _sine_and_cosine(angle: Dual) -> tuple[Dual, Dual]:
    s, c = sincosd(np.asarray(angle.value))
    factor = np.pi / 180.0
    return Dual(s, times(factor * c, angle.slope)), Dual(c, times(-factor * s, angle.slope))


def at_end(part: Dual) -> Dual:
    """As it is at the last instant."""
    slope = part.slope
    if slope is not None and slope.shape[-2] > 1:
        slope = slope[..., -1:, :]
    return Dual(column(part.value, -1), slope)


def _solved(jacobian: FloatArray, right: FloatArray) -> FloatArray:
    """J x = b for many J (…, m, n), m >= n, and b (…, m, k); nan where J is singular."""
    if jacobian.shape[-2:] == (1, 1):
        return np.where(jacobian == 0.0, np.nan, right / jacobian)
    lengths = np.sqrt(np.einsum("...ij,...ij->...i", jacobian, jacobian))
    lengths = np.where((lengths > 0.0) & np.isfinite(lengths), lengths, 1.0)
    matrix, wanted = jacobian / lengths[..., None], right / lengths[..., None]
    columns = np.sqrt(np.einsum("...ij,...ij->...j", matrix, matrix))
    columns = np.where((columns > 0.0) & np.isfinite(columns), columns, 1.0)
    matrix = matrix / columns[..., None, :]
    if matrix.shape[-1] != matrix.shape[-2]:
        wanted = np.einsum("...ji,...jk->...ik", matrix, wanted)
        matrix = np.einsum("...ji,...jk->...ik", matrix, matrix)
    size = matrix.shape[-1]
    good = np.asarray(np.isfinite(matrix).all(axis=(-2, -1)), dtype=np.bool_)
    matrix = np.where(good[..., None, None], matrix, np.eye(size))
    good = good & (np.abs(np.linalg.det(matrix)) > SINGULAR_FOR_SLOPES)
    matrix = np.where(good[..., None, None], matrix, np.eye(size))
    found = np.linalg.solve(matrix, wanted) / columns[..., :, None]
    return np.where(good[..., None, None], found, np.nan)


def differences(
    sides: Callable[[FloatArray], FloatArray], constants: FloatArray, intervals: FloatArray, step: float
) -> tuple[FloatArray, FloatArray]:
    """The ``sides`` (V, S) of variants with these ``constants`` (V, C), and how they change with them (V, S, C), by
    central differences, ``step`` of the ``intervals`` (C, 2) to either side; to one side on the edge of what moves, nan
    where neither moves.
    """
    count, columns = constants.shape
    steps = step * (intervals[:, 1] - intervals[:, 0])
    ways = np.concatenate([np.zeros((1, columns)), np.diag(-steps), np.diag(steps)])
    found = sides((constants[:, None] + ways).reshape(-1, columns)).reshape(count, 2 * columns + 1, -1)
    here, *ends = found[:, 0], found[:, 1 : columns + 1], found[:, columns + 1 :]
    known: list[BoolArray] = [np.asarray(np.isfinite(end).all(axis=2), dtype=np.bool_) for end in ends]
    low, high = (np.where(k[..., None], end, here[:, None]) for k, end in zip(known, ends, strict=True))
    width = steps * np.sum(known, axis=0)
    with np.errstate(all="ignore"):
        return here, np.moveaxis((high - low) / width[..., None], 1, 2)
