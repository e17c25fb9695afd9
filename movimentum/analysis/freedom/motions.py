"""A canonical basis of the free motions, described in the script's own names."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import lru_cache

import numpy as np

from movimentum.analysis.freedom.rank import at_one, rank_at, values_of
from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.lowering.builder import can_be_seen_turning
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, symbol_numbers, unknown_number
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.model import AnchorRef, ThingAngle
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.problem import BlockProblem, null_space, scale_of
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import UnsolvedInterval
from movimentum.text import number
from movimentum.tolerances import LEAST_DIVISOR, RANK_TOLERANCE, SEEMS_ZERO, ZERO_ENTRY, ZERO_PIVOT


@dataclass(frozen=True, slots=True)
class FreeMotion:
    """One free motion: the ``things`` that move, unconstrained ``variables``, ``words`` that describe it, and
    ``holds``: statements each of which may take it away, the likeliest first (see `remedy`).

    ``velocities``: of every anchor of what moves, in world directions; the fastest moves by one per time unit.
    ``twists``: of everything that moves, (turn, and the velocity of its point at the world's origin), in the same
    units. ``drawn``: a wish says where it goes.
    """

    things: tuple[int, ...]
    variables: tuple[str, ...]
    words: str
    holds: tuple[str, ...]
    velocities: tuple[tuple[AnchorRef, tuple[float, float]], ...] = ()
    twists: tuple[tuple[int, tuple[float, float, float]], ...] = ()
    drawn: bool = False


def described_by(plan: Plan, block: Newton) -> set[int]:
    """The unknowns that describe a block's free motions: its pose, and what is measured of it."""
    return plan.unknowns_read_by(block) | {unknown_number(name.payload) for name in plan.measured}


def motions_of(
    plan: Plan,
    block: Newton,
    one: State,
    clocks: Sequence[FloatArray],
    x: FloatArray,
    free: FloatArray,
    scale: FloatArray,
) -> tuple[FreeMotion, ...]:
    """The free motions of a block with the null space ``free`` (n, p) at core values ``x`` (n,)."""
    if not free.shape[1]:
        return ()
    moment = _FreeMoment(plan, block, one)
    return tuple(_free_motion(moment, v, drawn) for v, drawn in _basis(moment, clocks, x, free, scale))


def _basis(
    moment: _FreeMoment, clocks: Sequence[FloatArray], x: FloatArray, free: FloatArray, scale: FloatArray
) -> list[tuple[FloatArray, bool]]:
    """A canonical basis of a block's free velocities, each (n,), and whether wishes say where it goes.

    The motions without a wish come first; both halves are canonical (`_reduced`). Velocities beyond the range of a
    float (in a scene of 1e300, or where a wish has no gradient) are left out.
    """
    found = _spanned(moment, clocks, x, (free * scale[:, None]).T)
    return [(v, drawn) for v, drawn in found if np.isfinite(v).all()]


def _spanned(
    moment: _FreeMoment, clocks: Sequence[FloatArray], x: FloatArray, velocities: FloatArray
) -> list[tuple[FloatArray, bool]]:
    plan, block, one = moment.plan, moment.block, moment.one
    if block.wishes is None:
        return [(v, False) for v in _reduced(moment, velocities)]
    slopes = BlockProblem.of(block, one, clocks, scale_of(plan, block.core)).wishes(x[None])[1][0]
    along = slopes @ velocities.T
    if not np.isfinite(along).all():
        return [(v, False) for v in _reduced(moment, velocities)]
    rank, loose, inverse = null_space(
        along / max(float(np.max(np.abs(along), initial=0.0)), LEAST_DIVISOR), RANK_TOLERANCE
    )
    drawn = np.linalg.svd(inverse.T)[2][:rank] if rank else np.zeros((0, len(velocities)))
    return [
        *((v, False) for v in _reduced(moment, loose.T @ velocities)),
        *((v, True) for v in _reduced(moment, drawn @ velocities)),
    ]


def free_directions(
    plan: Plan, block: Newton, state: State, clocks: Sequence[FloatArray], x: FloatArray
) -> list[tuple[FreeMotion, FloatArray]]:
    """Each free motion of a block at core values ``x`` (n,), and its velocity (n,)."""
    scale = scale_of(plan, block.core)
    one = at_one(state, described_by(plan, block))
    _, rank, free = rank_at(block, one, tuple(clocks), x, scale)
    if rank == len(x):
        return []
    one = list(one)
    for n, value in zip(block.core, x, strict=True):
        one[n] = np.array([value])
    fill_explicit(block, one, clocks)
    moment = _FreeMoment(plan, block, one)
    return [(_free_motion(moment, v, drawn), v) for v, drawn in _basis(moment, clocks, x, free, scale)]


def free_motions_at(motion: PathMotion, time: Fraction) -> list[FreeMotion]:
    """The free motions at one moment of a motion; none if there is no solution."""
    timeline = motion.timeline
    segment_motion = motion.segments[timeline.segment_at(time)]
    tau = float(time - segment_motion.segment.start)
    piece = next((p for p in segment_motion.pieces if p.begin <= tau <= p.end), None)
    if piece is None or isinstance(piece, UnsolvedInterval):
        return []
    instants = piece.instants(np.array([tau]))
    found: list[FreeMotion] = []
    with np.errstate(all="ignore"):
        state, bad = piece.evaluate(instants)
        if bad.any():
            return []
        for block in segment_motion.plan.free_rows:
            x = values_of(block, state)
            found += [item for item, _ in free_directions(segment_motion.plan, block, state, instants.clocks, x)]
    return in_order(found)


def in_order(motions: Iterable[FreeMotion]) -> list[FreeMotion]:
    """Motions in the order of the things that they move, as they are numbered everywhere; of variables alone last."""
    return sorted(motions, key=lambda motion: (not motion.things, min(motion.things, default=0)))


def _reduced(moment: _FreeMoment, rows: FloatArray) -> FloatArray:
    """A canonical basis of the space of core velocities that ``rows`` (p, n) span.

    What it moves (`_seen`) is in reduced row echelon form. That depends only on the space, not on the unknowns in which
    it is written. The basis is sparse, and the same from run to run. Turns come first, counter-clockwise: the arrows of
    a crank keep their sense all the way round.
    """
    if not len(rows):
        return rows
    seen = np.array([_seen(moment, row) for row in rows])
    size = float(np.max(np.abs(seen), initial=0.0))
    if size > 0.0:
        seen = seen / size
    columns = seen.shape[1]
    whole = np.concatenate([seen, rows], axis=1)
    reduce_rows(whole, columns, lambda left: ZERO_PIVOT * float(np.max(np.abs(left[:, :columns]))))
    result = whole[:, columns:]
    largest = np.max(np.abs(result), axis=1, keepdims=True)
    return np.where(np.abs(result) < ZERO_ENTRY * largest, 0.0, result)


def reduce_rows(rows: FloatArray, columns: int, least: Callable[[FloatArray], float]) -> None:
    """Bring the first ``columns`` of ``rows`` into reduced echelon form. ``least``: of the rows that are left, what a
    pivot has at least.
    """
    done = 0
    for column in range(columns):
        if done == len(rows):
            break
        pivot = done + int(np.argmax(np.abs(rows[done:, column])))
        if abs(rows[pivot, column]) < least(rows[done:]):
            continue
        rows[[done, pivot]] = rows[[pivot, done]]
        rows[done] /= rows[done, column]
        others = np.arange(len(rows)) != done
        rows[others] -= rows[others, column][:, None] * rows[done]
        done += 1


def _seen(moment: _FreeMoment, velocity: FloatArray) -> FloatArray:
    """What a core velocity (n,) moves: how each thing turns (times the scene's size) and the velocities of its anchors,
    in order of definition, then the speeds of all other unknowns, by name, in their own units.
    """
    plan, unknowns = moment.plan, moment.plan.system.unknowns
    speeds = _speeds(moment.block, velocity)
    values: list[float] = []
    for body in moment.bodies:
        vx, vy, turn = body.moved(speeds)
        values.append(turn * plan.size)
        values += [part for anchor in body.anchors(vx, vy, turn) for part in anchor]
    others = [unknowns[n] for n in moment.block.unknowns if unknowns[n].thing is None]
    values += [speeds.get(unknown.number, 0.0) for unknown in sorted(others, key=lambda unknown: unknown.name)]
    return np.array(values)


@dataclass(frozen=True, slots=True)
class _FreeBody:
    """A ``thing`` at one instant: the numbers of the unknowns (x, y, cosine, sine) of its pose, their values, and for
    each of its anchors the way there from its origin.
    """

    thing: int
    numbers: tuple[int | None, ...]
    pose: tuple[float, float, float, float]
    arms: tuple[tuple[float, float], ...]

    def moved(self, speeds: dict[int, float]) -> tuple[float, float, float]:
        """(vx, vy, turn), given the speeds of its unknowns."""
        vx, vy, vc, vs = (0.0 if n is None else speeds.get(n, 0.0) for n in self.numbers)
        _, _, c, s = self.pose
        return vx, vy, c * vs - s * vc

    def anchors(self, vx: float, vy: float, turn: float) -> list[tuple[float, float]]:
        """The velocities of its anchors."""
        return [(vx - turn * wy, vy + turn * wx) for wx, wy in self.arms]


class _FreeMoment:
    """A block at one instant, ``one`` being the values of its unknowns; ``bodies``: its things, in order."""

    def __init__(self, plan: Plan, block: Newton, one: State) -> None:
        self.plan, self.block, self.one = plan, block, one
        of_thing = {body.thing: (body.x, body.y, body.c, body.s) for body in plan.bodies}
        unknowns = plan.system.unknowns
        things = sorted({t for n in block.unknowns if (t := unknowns[n].thing) is not None})
        # of some things only a property is an unknown
        self.bodies = [self._body(t, of_thing.get(t, (None, None, None, None))) for t in things]

    def _body(self, thing: int, numbers: tuple[int | None, ...]) -> _FreeBody:
        system, one = self.plan.system, self.one
        frame = system.frame(thing)
        pose = (0.0, 0.0, *frame.axis)
        x, y, c, s = (pose[i] if n is None or one[n] is None else first_of(one[n]) for i, n in enumerate(numbers))
        local = [frame.local(anchor.local) for anchor in system.scene.things[thing].anchors]
        arms = tuple((c * dx - s * dy, s * dx + c * dy) for dx, dy in local)
        return _FreeBody(thing, numbers, (x + system.shift[0], y + system.shift[1], c, s), arms)


@lru_cache(maxsize=8)
def _measured_by(plan: Plan) -> dict[int, list[int]]:
    """By an unknown, those that are measured of it."""
    found: dict[int, list[int]] = {}
    for name, of in plan.measured.items():
        for n in symbol_numbers(of):
            found.setdefault(n, []).append(unknown_number(name.payload))
    return found


def _free_motion(moment: _FreeMoment, velocity: FloatArray, drawn: bool) -> FreeMotion:
    """A velocity (n,) of a block's core at one instant, in words."""
    plan, block, one = moment.plan, moment.block, moment.one
    system = plan.system
    speeds = _speeds(block, velocity)
    largest = float(np.max(np.abs(velocity / scale_of(plan, block.core))))
    moving: list[tuple[_FreeBody, tuple[float, float, float]]] = []
    for body in moment.bodies:
        vx, vy, turn = velocity_of = body.moved(speeds)
        if not max(abs(vx), abs(vy), abs(turn) * plan.size) <= SEEMS_ZERO * largest * plan.size:
            moving.append((body, velocity_of))
    fast = {n for n, speed in speeds.items() if abs(speed) > SEEMS_ZERO * largest}
    measured = sorted({name for n in fast for name in _measured_by(plan).get(n, ())})
    variables = tuple(
        system.unknowns[n].name
        for n in (*(n for n in speeds if n in fast), *measured)
        if not isinstance(system.unknowns[n].payload, PoseX | PoseY | PoseCos | PoseSin | ThingAngle)
        and not system.unknowns[n].name.startswith(("_", "."))
    )
    if not moving:
        words = " and ".join(f"`{v}` can take any value" for v in variables) or "a `_` can take any value"
        return FreeMotion((), variables, words, _values_for(plan, one, variables[:1]), drawn=drawn)
    names = [f"`{system.scene.things[body.thing].name}`" for body, _ in moving]
    first, hold = _way(plan, *moving[0])
    if len(moving) == 1:
        words = f"{names[0]} can still {first}"
    else:
        others = ", ".join(names[1:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        words = f"{names[0]} can still {first}, and {others} with it"
    anchors = [(AnchorRef(body.thing, k), v) for body, way in moving for k, v in enumerate(body.anchors(*way))]
    fastest = max((float(np.hypot(*v)) for _, v in anchors), default=0.0) or 1.0
    twists = [
        (body.thing, (turn, vx + turn * body.pose[1], vy - turn * body.pose[0])) for body, (vx, vy, turn) in moving
    ]
    return FreeMotion(
        tuple(body.thing for body, _ in moving),
        variables,
        words,
        (*hold, *_values_for(plan, one, variables)),
        tuple((ref, (vx / fastest, vy / fastest)) for ref, (vx, vy) in anchors),
        tuple((t, (a / fastest, b / fastest, c / fastest)) for t, (a, b, c) in twists),
        drawn,
    )


def _values_for(plan: Plan, one: State, variables: Sequence[str]) -> tuple[str, ...]:
    """Statements that give a variable (or a component) a value: 0, its present value, and other round numbers."""
    texts: list[str] = []
    for unknown in plan.system.unknowns if variables else ():
        if unknown.name in variables:
            now = one[unknown.number]
            value = 0.0 if now is None else first_of(now)
            numbers = ("0", number(value), *(number(sign * scale) for scale in (1.0, plan.size) for sign in (1, -1)))
            texts += [f"{unknown.name} = {text};" for text in numbers]
    return tuple(dict.fromkeys(texts))


def remedy(motion: FreeMotion, statement: str | None) -> str:
    """Help in words: ``statement`` (one of `FreeMotion.holds`; None: none of them works) takes the motion away."""
    if motion.things:
        return "another statement about it takes the freedom away" if statement is None else f"`{statement}` holds it"
    if not motion.variables:
        return "name the `_` and give it a value"
    return "give it a value" if statement is None else f"`{statement}` gives it a value"


def _speeds(block: Newton, velocity: FloatArray) -> dict[int, float]:
    """The speed of every unknown of a block whose core has a ``velocity`` (n,)."""
    speeds = {n: float(v) for n, v in zip(block.core, velocity, strict=True)}
    if block.linear is not None:
        for n, slopes in zip(block.linear.targets, block.linear.slopes, strict=True):
            speeds[n] = sum(slope * float(velocity[place]) for place, slope in slopes)
    return speeds


def _way(plan: Plan, moving: _FreeBody, velocity: tuple[float, float, float]) -> tuple[str, tuple[str, ...]]:
    """How one thing moves (turning about one of its anchors or a point, or sliding), and constraints, each of which
    would stop it.
    """
    vx, vy, turn = velocity
    thing = moving.thing
    body, frame = plan.system.scene.things[thing], plan.system.frame(thing)
    (c, s), (rx, ry) = frame.to_thing(*moving.pose[2:]), frame.origin
    reference = next(a.name for a in body.anchors if a.local == (rx, ry))
    if abs(turn) * plan.size <= SEEMS_ZERO * max(abs(vx), abs(vy)):
        along = 0 if abs(vx) >= abs(vy) else 1
        point = f"{body.name}.{reference}"
        if can_be_seen_turning(body):
            place = None if moving.numbers[along] is None else moving.pose[along]
            remedy = (f"{point}.{'xy'[along]} = {number(0.0 if place is None else place, 6)};",)
        else:  # a point alone is meant where it is drawn, wherever it has been taken
            x, y = number(rx, 12), number(ry, 12)
            remedy = (f"{point} = [{x}, {y}];", f"{point}.{'xy'[along]} = {(x, y)[along]};")
        if abs(vy) <= SEEMS_ZERO * abs(vx):
            return "move along x", remedy
        if abs(vx) <= SEEMS_ZERO * abs(vy):
            return "move along y", remedy
        angle = float(np.degrees(np.arctan2(vy, vx))) % 180.0
        return f"move in the direction of {number(angle)} degrees", remedy
    angle = float(np.degrees(np.arctan2(s, c)))
    remedy = (f"{body.name}.angle = {number(angle if abs(angle) > ZERO_ENTRY else 0.0)};",)
    for anchor in body.anchors:  # an anchor at reference + R d has the velocity v + turn * perp(R d)
        dx, dy = anchor.local[0] - rx, anchor.local[1] - ry
        wx, wy = c * dx - s * dy, s * dx + c * dy
        if np.hypot(vx - turn * wy, vy + turn * wx) <= SEEMS_ZERO * abs(turn) * plan.size:
            return f"turn about `{body.name}.{anchor.name}`", remedy
    return "turn and move", remedy
