"""The goals and requirements of a script for a fit, and by how much each is off.

They are written in terms of the varying constants and of values evaluated on variants.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, within_half
from movimentum.expressions import ONE, ZERO, Expr, mul, neg, ratio, sub, substitute, symbol, walk
from movimentum.fitting.slopes import Dual, SlopesOf, dual_function, full, units
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.calculus import differentiate
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, Purpose, Relation, ThingAngle, VariableComponent
from movimentum.timeline.model import TimedClaim, Timeline
from movimentum.variants.measures import influence, reduced
from movimentum.variants.tracing import OriginUnfolding, Reduced, Varied, payloads_read, places_from

READABLE = AnchorCoordinate | ThingAngle | VariableComponent
"""The payloads that can be read off many variants at once."""


@dataclass(frozen=True, slots=True, eq=False)
class ReducedExpr:
    """``kind`` (a word of `syntax.vocabulary.REDUCTIONS`) of ``inner``, whose frames are those of its aim; at the
    ``time``, an expression of the varied constants, for "at".
    """

    kind: str
    inner: Expr
    time: Expr | None
    aim: int


@dataclass(frozen=True, slots=True, eq=False)
class LoweredAim:
    """``sides``: what is left of each component when its right-hand side is taken away. In symbols of the scene, of the
    varied constants, and `Reduced` with numbers of `LoweredAims.reductions`. ``lasting``: whether it has a value in
    every frame (else one for the whole film). A goal to be largest or smallest is several of them, one for each term:
    what counts is the sum over these of their greatest sides.
    """

    timed_claim: TimedClaim
    sides: tuple[Expr, ...]
    lasting: bool

    @property
    def required(self) -> bool:
        """A requirement, and not a goal."""
        return self.timed_claim.claim.purpose is Purpose.REQUIREMENT

    @property
    def extreme(self) -> bool:
        """A goal that something is as large or as small as can be: its sides are to be as small as can be."""
        return self.timed_claim.claim.relation in _SIGNS

    @property
    def angular(self) -> bool:
        """Whether it counts modulo a turn."""
        claim = self.timed_claim.claim
        return claim.relation is Relation.EQUAL and claim.left[0].op == "atan2d"

    @property
    def sign(self) -> float:
        """0 for an equation; else the sign with which the side is what is too much."""
        return {Relation.BELOW: 1.0, Relation.ABOVE: -1.0}.get(self.timed_claim.claim.relation, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class LoweredAims:
    """All aims of a script, in the order written, and the reductions in them."""

    aims: tuple[LoweredAim, ...]
    reductions: tuple[ReducedExpr, ...]
    timeline: Timeline

    @property
    def payloads(self) -> tuple[Hashable, ...]:
        """The values needed from a motion."""
        roots = [*(side for aim in self.aims for side in aim.sides), *(part.inner for part in self.reductions)]
        return payloads_read(*roots)

    @property
    def equations(self) -> float:
        """How many scalar equations they state; infinite if one of them is stated in every frame, or never met."""
        stated = [aim for aim in self.aims if aim.timed_claim.claim.relation is Relation.EQUAL]
        if any(aim.lasting for aim in stated) or any(aim.extreme for aim in self.aims):
            return math.inf
        return sum(len(aim.sides) for aim in stated)


def lower_aims(timeline: Timeline) -> LoweredAims:
    """The aims of ``timeline``, which was read with traced constants."""
    unfolding = OriginUnfolding()
    reductions: list[ReducedExpr] = []
    aims: list[LoweredAim] = []
    for number, timed in enumerate(timeline.aims):
        sides: list[Expr] = []
        for left, right in zip(timed.claim.left, timed.claim.right, strict=True):
            outside = sub(_without(left, number, reductions, unfolding), _without(right, number, reductions, unfolding))
            sides.append(unfolding.unfolded(outside))
        sign = _SIGNS.get(timed.claim.relation)
        terms = [tuple(sides)] if sign is None else _terms(mul(sign, sides[0]), reductions)
        aims += [LoweredAim(timed, own, _lasting(own)) for own in terms]
    return LoweredAims(tuple(aims), tuple(reductions), timeline)


_SIGNS = {Relation.LARGEST: neg(ONE), Relation.SMALLEST: ONE}


def _lasting(sides: tuple[Expr, ...]) -> bool:
    return any(
        node.op == "clock" or (node.op == "symbol" and not isinstance(node.payload, Varied | Reduced))
        for node in walk(*sides)
    )


def _terms(root: Expr, reductions: Sequence[ReducedExpr]) -> Iterator[tuple[Expr, ...]]:
    """Terms of ``root``, which is to be as small as can be, as the sides of aims. The greatest value in the film, times
    a number above 0, becomes the value in every frame: which frame decides may change from step to step of a search,
    and where several do, they all must be seen.
    """
    rest: dict[Expr, Expr] = {}
    for node in walk(root):
        if node.op != "symbol" or not isinstance(node.payload, Reduced):
            continue
        part = reductions[node.payload.number]
        factor = differentiate(root, lambda other, node=node: ONE if other == node else ZERO).value
        if factor is None or part.kind not in ("max", "min", "range") or factor * (part.kind == "min") > 0.0:
            continue
        if factor < 0.0 and part.kind != "min":
            continue
        inner = mul(ratio(Fraction(factor)), part.inner)
        yield (inner,)
        if part.kind == "range":
            yield (neg(inner),)
        rest[node] = ZERO
    left = substitute(root, lambda node: None, rest) if rest else root
    if not rest or left != ZERO:
        yield (left,)


def _without(root: Expr, aim: int, reductions: list[ReducedExpr], unfolding: OriginUnfolding) -> Expr:
    """``root`` with a symbol for each reduction, which is added to ``reductions``."""
    found = [node for node in walk(root) if node.op == "reduction"]
    if not found:
        return root
    memo: dict[Expr, Expr] = {}
    for node in found:
        time = unfolding.unfolded(node.args[1]) if node.payload == "at" else None
        assert isinstance(node.payload, str)
        memo[node] = symbol(Reduced(len(reductions)))
        reductions.append(ReducedExpr(node.payload, unfolding.unfolded(node.args[0]), time, aim))
    return substitute(root, lambda node: None, memo)


def frames_of(timeline: Timeline, timed: TimedClaim) -> Sequence[int]:
    """The frames in which an aim stands; where it stands between two frames only, the one before."""
    if found := timeline.frames_under(timed):
        return found
    before = int((Fraction(timed.start) - timeline.start) * timeline.fps)
    return [min(max(before, 0), timeline.frame_count - 1)]


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """V variants. ``sides`` (V, S): by how much each side of each aim is off in each frame, in its own unit;
    ``slopes`` (V, S, C): how that changes with the constants. Inequalities: what is too much; below 0 where they hold.

    ``moves`` (V,): the variant can be assembled, and moves all the time without a jump; ``sure`` (V,): that is certain.
    What does not move has no sides (nan). ``reach`` (V,): the share of the film until it binds; 0 if it cannot begin.
    """

    sides: FloatArray
    slopes: FloatArray | None
    moves: BoolArray
    sure: BoolArray
    reach: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SideLayout:
    """The S sides: ``aim`` (S,) and ``frame`` (S,) of each (-1: the whole film), ``scale`` (S,): the root of its share
    in the sum of squares, a goal's weight over its frames.
    """

    aim: IntArray
    frame: IntArray
    scale: FloatArray


def layout_of(lowered: LoweredAims) -> SideLayout:
    """How the sides of ``lowered`` are laid out: aim by aim, component by component, frame by frame."""
    aims: list[int] = []
    frames: list[int] = []
    scales: list[float] = []
    for number, aim in enumerate(lowered.aims):
        own = list(frames_of(lowered.timeline, aim.timed_claim)) if aim.lasting else [-1]
        for _ in aim.sides:
            aims += [number] * len(own)
            frames += own
            scales += [float(np.sqrt(aim.timed_claim.claim.weight / len(own)))] * len(own)
    return SideLayout(np.array(aims), np.array(frames), np.array(scales))


@dataclass(eq=False)
class SideFormulas:
    """The formulas of all aims of variants whose constants are ``names``."""

    lowered: LoweredAims
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        lowered = self.lowered
        self.payloads = lowered.payloads
        self.layout = layout_of(lowered)
        place: dict[Hashable, int] = {payload: n for n, payload in enumerate(self.payloads)}
        place |= places_from(len(place), self.names)
        self.clocks = Clocks()
        self.inner = dual_function([part.inner for part in lowered.reductions], place, self.clocks)
        outside: dict[Hashable, int] = place | {Reduced(k): len(place) + k for k in range(len(lowered.reductions))}
        self.outer = [dual_function(aim.sides, outside, self.clocks) for aim in lowered.aims]
        timeline = lowered.timeline
        self.frames = [list(frames_of(timeline, aim.timed_claim)) for aim in lowered.aims]
        self.times = [timeline.frame_time(k) for k in range(timeline.frame_count)]

    def sides(
        self, constants: FloatArray, read: Sequence[Dual], at: dict[int, Dual], *, slopes: bool
    ) -> tuple[FloatArray, FloatArray | None]:
        """(V, S) by how much variants with these ``constants`` (V, C) are off, and how that changes (V, S, C).

        ``read``: `payloads` in all frames, (V, F) each; ``at``: the values (V, 1) of "at" reductions by number.
        """
        count, columns = constants.shape
        total = len(self.times)
        clocks = [np.array([float(time - start) for time in self.times]) for start in self.clocks.starts]
        inputs: list[Any] = [*(dual.value for dual in read), *(constants[:, k : k + 1] for k in range(columns))]
        slope_of: SlopesOf | None = None
        if slopes:
            slope_of = {n: dual.slope for n, dual in enumerate(read)} | units(len(read), columns)
        inner = self.inner.duals(inputs, clocks, slope_of)
        for k, part in enumerate(self.lowered.reductions):
            made = at.get(k)
            if made is None:
                made = _reduced(part.kind, full(inner[k], (count, total), columns + 1), self.frames[part.aim])
            inputs.append(made.value)
            if slope_of is not None:
                slope_of[len(inputs) - 1] = made.slope
        found: list[FloatArray] = []
        changes: list[FloatArray] = []
        for aim, outer, frames in zip(self.lowered.aims, self.outer, self.frames, strict=True):
            own = frames if aim.lasting else [0]
            for dual in outer.duals(inputs, clocks, slope_of):
                whole = full(dual, (count, total if aim.lasting else 1), columns + 1)
                side, sign = signed(aim, np.asarray(whole.value))
                found.append(side[:, own])
                change = np.zeros((*side.shape, columns + 1)) if whole.slope is None else whole.slope
                changes.append(sign * change[:, own, :columns])
        return np.concatenate(found, axis=1), None if slope_of is None else np.concatenate(changes, axis=1)


def signed(aim: LoweredAim, side: FloatArray) -> tuple[FloatArray, float]:
    """By how much a side is off: what is too much of an inequality, an angle within half a turn; and its sign."""
    if aim.angular:
        return within_half(side), 1.0
    sign = aim.sign or 1.0
    return sign * side, sign


def _reduced(kind: str, dual: Dual, frames: Sequence[int]) -> Dual:
    """(V, 1) what ``kind`` makes of (V, F) values in ``frames``."""
    values = np.asarray(dual.value)[:, list(frames)]
    found = reduced(kind, values)[:, None]
    if dual.slope is None:
        return Dual(found, None)
    weights, slope = influence(kind, values), dual.slope[:, list(frames)]
    change = np.einsum("vf,vfc->vc", weights, np.where(weights[..., None] != 0.0, slope, 0.0))
    return Dual(found, change[:, None, :])
