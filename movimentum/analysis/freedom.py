"""What can still move: the degrees of freedom of a scene's parts from the rank of their equations, the free motions in
the script's words, which things are rigid together, and what is said more often than it need be.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from movimentum.analysis.beside import RANK_TOLERANCE, at_one, beside, loosened, rank_at, values_of
from movimentum.analysis.words import number
from movimentum.plan.blocks import Block, Kernel
from movimentum.plan.graph import groups
from movimentum.plan.model import Plan
from movimentum.plan.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.scene.model import AnchorRef, ThingAngle
from movimentum.solve.kernels import State, fill_explicit
from movimentum.solve.moments import snapshot
from movimentum.solve.motion import Motion
from movimentum.solve.newton import jacobian_of, null_space, scaled, wishes_of
from movimentum.solve.stretches import Dead, Stretch
from movimentum.solve.tracks import Piece, scale_of

FloatArray = NDArray[np.float64]

STRESSED = 1e-6
"""Of the largest: a row that takes part in a dependence among rows."""
TOGETHER = 1e-6
"""Of the fastest: velocities that are the same."""


@dataclass(frozen=True, slots=True)
class FreeMotion:
    """One free motion: the ``things`` that move, unconstrained ``variables``, ``words`` that say it, and a ``remedy``
    to type.

    ``velocities``: of every anchor of what moves, in world directions; the fastest moves by one a time unit.
    ``twists``: of everything that moves, (turn, and the velocity of its point at the world's origin), in the same
    units. ``drawn``: a wish says where it goes.
    """

    things: tuple[int, ...]
    variables: tuple[str, ...]
    words: str
    remedy: str
    velocities: tuple[tuple[AnchorRef, tuple[float, float]], ...] = ()
    twists: tuple[tuple[int, tuple[float, float, float]], ...] = ()
    drawn: bool = False


@dataclass(frozen=True, slots=True)
class BlockRank:
    """Rank and freedom of one block at a generic pose (a dead centre makes no freedom), its free motions there and at
    another pose ``nearby``;
    ``dependent``: the equations that take part in a dependence, of which ``rows - rank`` say nothing new.
    """

    block: int
    rows: int
    rank: int
    freedom: int
    motions: tuple[FreeMotion, ...]
    nearby: tuple[FreeMotion, ...] = ()
    dependent: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Part:
    """Things that constraints connect, and what is known of them together.

    ``rigid``: groups of things that do not move against each other; ``fixed``: those that do not move at all (both in
    the free motions, and in the motion that there is). ``redundant`` equations follow from the others; any of the
    ``superfluous`` (things by number, constraints by number) is one.
    """

    things: tuple[int, ...]
    freedom: int
    redundant: int
    rigid: tuple[tuple[int, ...], ...]
    fixed: tuple[int, ...]
    superfluous_things: tuple[int, ...]
    superfluous_constraints: tuple[int, ...]


def generic_moment(stretch: Stretch) -> tuple[Piece, float] | None:
    """A moment of the stretch in general position: somewhere in the middle, at no round fraction."""
    for piece in stretch.pieces:
        if not isinstance(piece, Dead):
            gap = min((t.begin for t in stretch.troubles if t.kind == "gap"), default=piece.end)
            end = min(piece.end, gap)
            return piece, piece.begin + 0.37931 * (end - piece.begin)
    return None


def block_ranks(stretch: Stretch) -> list[BlockRank]:
    """Rank and freedom of each Newton block of a stretch; the closed-form kernels have full rank by construction.

    Counting equations would be wrong for every braced structure: the rank is that of the Jacobian in numbers, rows
    scaled to unit gradients, relative to its largest singular value.
    """
    moment = generic_moment(stretch)
    if moment is None:
        return []
    piece, tau = moment
    result: list[BlockRank] = []
    seen: set[int] = set()
    instants = piece.instants(np.array([tau]))
    with np.errstate(all="ignore"):
        state, _ = piece.evaluate(instants)
        for block in stretch.plan.blocks:
            if block.kernel is not Kernel.NEWTON:
                continue
            x = values_of(block, state)
            one = at_one(state)
            scale = scale_of(stretch.plan, block.core)
            rows, rank, free = rank_at(block, one, instants.clocks, x, scale)
            nearby: tuple[FreeMotion, ...] = ()
            if block.free and rank < len(x):
                # at a dead centre the rank drops, and nothing is free for that: look beside it too
                y, there = beside(stretch.plan, block, one, instants.clocks, x, free)
                more, higher, other = rank_at(block, there, instants.clocks, y, scale)
                nearby = _motions(stretch.plan, block, there, instants.clocks, y, other, scale)
                if higher > rank:
                    rows, rank, free, one, x = more, higher, other, there, y
            freedom = len(block.core) - rank if block.free else 0
            motions = _motions(stretch.plan, block, one, instants.clocks, x, free, scale) if block.free else ()
            if not block.free:
                motions, more = _loose_motions(stretch.plan, block, one, instants.clocks, x, free, seen)
                seen |= more
                freedom = len(motions)
                rank = min(len(x), block.rows) - freedom  # singular for another reason: checks tell what is left
            dependent = _dependent(rows, rank) if rank < block.rows else ()
            equations = tuple(sorted({block.row_equations[i] for i in dependent}))
            result.append(BlockRank(block.number, block.rows, rank, freedom, motions, nearby, equations))
    return result


def _motions_of(plan: Plan, block: Block, state: State, clocks: tuple[FloatArray, ...]) -> tuple[FreeMotion, ...]:
    """The free motions of a free block in a state."""
    return tuple(motion for motion, _ in free_directions(plan, block, at_one(state), clocks, values_of(block, state)))


def _loose_motions(
    plan: Plan,
    block: Block,
    one: State,
    clocks: tuple[FloatArray, ...],
    x: FloatArray,
    free: FloatArray,
    seen: set[int],
) -> tuple[tuple[FreeMotion, ...], set[int]]:
    """The free motions of a block that its count of equations determines (see `analysis.beside.loosened`), and the
    unknowns that have been looked at for that; ``seen`` are those that were before.
    """
    loose = None if seen & set(block.core) else loosened(plan, block, one, clocks, x, free)
    if loose is None:
        return (), set()
    again, whole, state, ticks = loose
    place = {unknown.payload: unknown.number for unknown in again.system.unknowns}
    counted = {
        place[plan.system.unknowns[n].payload]
        for other in plan.blocks
        if other.kernel is Kernel.NEWTON and not other.free
        for n in other.core
    }
    scale = float(np.max(scale_of(again, whole.core)))
    found: list[FreeMotion] = []
    for motion, velocity in free_directions(again, whole, at_one(state), ticks, values_of(whole, state)):
        speeds = _speeds(whole, velocity)
        if any(abs(speeds.get(n, 0.0)) > 1e-9 * scale for n in counted):  # else a free block has it
            found.append(motion)
    back = plan.system.number_of
    return tuple(found), {n for m in whole.unknowns if (n := back.get(again.system.unknowns[m].payload)) is not None}


def _motions(
    plan: Plan,
    block: Block,
    one: State,
    clocks: Sequence[FloatArray],
    x: FloatArray,
    free: FloatArray,
    scale: FloatArray,
) -> tuple[FreeMotion, ...]:
    """The free motions of a block with the null space ``free`` (n, p) at core values ``x`` (n,)."""
    basis = _basis(plan, block, one, clocks, x, free, scale) if free.shape[1] else []
    return tuple(_told(plan, block, one, v, drawn) for v, drawn in basis)


def _dependent(rows: FloatArray, rank: int) -> tuple[int, ...]:
    """The rows that take part in a dependence: those of which the left null space has anything."""
    left = np.linalg.svd(np.nan_to_num(rows))[0][:, rank:]
    size = np.sqrt(np.sum(left**2, axis=1))
    return tuple(np.nonzero(size > STRESSED * np.max(size, initial=0.0))[0].tolist())


def _basis(
    plan: Plan,
    block: Block,
    one: State,
    clocks: Sequence[FloatArray],
    x: FloatArray,
    free: FloatArray,
    scale: FloatArray,
) -> list[tuple[FloatArray, bool]]:
    """A canonical basis of a block's free velocities, each (n,), and whether wishes say where it goes.

    What wishes say nothing about comes first; both halves are canonical (`_reduced`).
    """
    velocities = (free * scale[:, None]).T
    if block.wishes is None:
        return [(v, False) for v in _reduced(plan, block, one, velocities)]
    slopes = wishes_of(block, one, clocks, x[None])[1][0]
    along = slopes @ velocities.T
    rank, loose, inverse = null_space(along / max(float(np.max(np.abs(along), initial=0.0)), 1e-300), RANK_TOLERANCE)
    drawn = np.linalg.svd(inverse.T)[2][:rank] if rank else np.zeros((0, len(velocities)))
    return [
        *((v, False) for v in _reduced(plan, block, one, loose.T @ velocities)),
        *((v, True) for v in _reduced(plan, block, one, drawn @ velocities)),
    ]


def free_directions(
    plan: Plan, block: Block, state: State, clocks: Sequence[FloatArray], x: FloatArray
) -> list[tuple[FreeMotion, FloatArray]]:
    """Each free motion of a block at core values ``x`` (n,), and its velocity (n,)."""
    scale = scale_of(plan, block.core)
    one = at_one(state)
    rows = scaled(jacobian_of(block, one, clocks, x[None]), scale)[0][0]
    rank, free, _ = null_space(rows, RANK_TOLERANCE)
    if rank == len(x):
        return []
    one = list(one)
    for n, value in zip(block.core, x, strict=True):
        one[n] = np.array([value])
    fill_explicit(block, one, clocks)
    return [(_told(plan, block, one, v, drawn), v) for v, drawn in _basis(plan, block, one, clocks, x, free, scale)]


def free_motions_at(motion: Motion, time: Fraction) -> list[FreeMotion]:
    """The free motions at one moment of a motion; none where there is no solution."""
    timeline = motion.timeline
    stretch = motion.stretches[timeline.segment_at(time)]
    tau = float(time - stretch.segment.start)
    piece = next((p for p in stretch.pieces if p.begin <= tau <= p.end), None)
    if piece is None or isinstance(piece, Dead):
        return []
    instants = piece.instants(np.array([tau]))
    found: list[FreeMotion] = []
    seen: set[int] = set()
    with np.errstate(all="ignore"):
        state, bad = piece.evaluate(instants)
        if bad.any():
            return []
        for block in stretch.plan.blocks:
            if block.kernel is not Kernel.NEWTON:
                continue
            if block.free:
                found += _motions_of(stretch.plan, block, state, instants.clocks)
                continue
            x, one = values_of(block, state), at_one(state)
            free = rank_at(block, one, instants.clocks, x, scale_of(stretch.plan, block.core))[2]
            motions, more = _loose_motions(stretch.plan, block, one, instants.clocks, x, free, seen)
            seen |= more
            found += motions
    return in_order(found)


def in_order(motions: Iterable[FreeMotion]) -> list[FreeMotion]:
    """Motions in the order of the things that they move, as they are numbered everywhere; of variables alone last."""
    return sorted(motions, key=lambda motion: (not motion.things, min(motion.things, default=0)))


def parts_of(stretch: Stretch, ranks: Sequence[BlockRank]) -> list[Part]:
    """The connected parts of a stretch's scene, in order of definition; ``ranks`` as `block_ranks` finds them."""
    plan = stretch.plan
    system = plan.system
    of_thing = [unknown.thing for unknown in system.unknowns]
    first_of: dict[int, int] = {}
    bodies = [unknown for unknown in system.unknowns if unknown.thing is not None]
    links = [(first_of.setdefault(unknown.thing or 0, unknown.number), unknown.number) for unknown in bodies]
    for equation in system.equations:
        members = sorted(equation.unknowns)
        links += [(members[0], other) for other in members[1:]]
    owner = {n: block.number for block in plan.blocks for n in block.unknowns}
    of_block = {rank.block: rank for rank in ranks}
    twists = _twists(stretch, ranks)
    parts: list[Part] = []
    for component in groups(len(system.unknowns), links):
        things = sorted({t for n in component if (t := of_thing[n]) is not None})
        if not things:
            continue
        members = set(component)
        found = [of_block[b] for b in sorted({owner[n] for n in component if n in owner}) if b in of_block]
        free = sum(rank.freedom for rank in found)
        checks = [e for e in plan.checks if system.equations[e].unknowns & members]
        dependent = [*(e for rank in found for e in rank.dependent), *checks]
        rods = {t for e in dependent if (t := system.equations[e].thing) is not None}
        stated = {c for e in dependent if (c := system.equations[e].constraint) is not None}
        rigid, fixed = _together({t: twists.get(t, np.zeros(0)) for t in things})
        parts.append(
            Part(
                tuple(things),
                free,
                len(checks) + sum(rank.rows - rank.rank for rank in found),
                rigid,
                fixed,
                tuple(sorted(rods)),
                tuple(sorted(stated)),
            )
        )
    return sorted(parts, key=lambda part: part.things)


def _twists(stretch: Stretch, ranks: Sequence[BlockRank]) -> dict[int, FloatArray]:
    """How every thing moves in each free motion and, at two moments, in the motion that there is: (motions * 3,)."""
    motions = [motion for rank in ranks for motion in (*rank.motions, *rank.nearby)]
    size = stretch.plan.size
    columns: list[dict[int, tuple[float, float, float]]] = [dict(motion.twists) for motion in motions]
    for piece in stretch.pieces:
        if isinstance(piece, Dead) or piece.end <= piece.begin:
            continue
        length = piece.end - piece.begin
        gap = min((t.begin for t in stretch.troubles if t.kind == "gap"), default=piece.end)
        for place in (0.37931, 0.71713):
            tau = piece.begin + place * (min(piece.end, gap) - piece.begin)
            with np.errstate(all="ignore"):
                state, bad = piece.evaluate(piece.instants(np.array([tau - 1e-6 * length, tau + 1e-6 * length])))
            if bad.any():
                continue
            before, after = (snapshot(stretch.plan, state, stretch.base.now, k).things for k in (0, 1))
            found: dict[int, tuple[float, float, float]] = {}
            for t, (a, b) in enumerate(zip(before, after, strict=True)):
                turn = a.c * b.s - a.s * b.c
                found[t] = (turn, b.x - a.x + turn * a.y, b.y - a.y - turn * a.x)
            columns.append(_unit(found, size))
        break
    mentioned = stretch.plan.system.mentioned()
    rest = (0.0, 0.0, 0.0)
    return {
        t: np.array([value for column in columns for value in _weighed(column.get(t, rest), size)]) for t in mentioned
    }


def _weighed(twist: tuple[float, float, float], size: float) -> tuple[float, float, float]:
    return twist[0] * size, twist[1], twist[2]


def _unit(twists: dict[int, tuple[float, float, float]], size: float) -> dict[int, tuple[float, float, float]]:
    largest = max((max(map(abs, _weighed(twist, size))) for twist in twists.values()), default=0.0)
    if not largest > 1e-9 * size:
        return {}
    return {t: (a / largest, b / largest, c / largest) for t, (a, b, c) in twists.items()}


def _together(twists: dict[int, FloatArray]) -> tuple[tuple[tuple[int, ...], ...], tuple[int, ...]]:
    """Groups of at least two things that move alike, and the things that do not move."""
    found: list[tuple[FloatArray, list[int]]] = []
    fixed: list[int] = []
    tolerance = TOGETHER * max((float(np.max(np.abs(v), initial=0.0)) for v in twists.values()), default=0.0)
    # what moves is seen to 1e-9 or so by differences of poses
    tolerance = max(tolerance, 1e-7)
    for t, twist in sorted(twists.items(), key=lambda item: (*item[1][:1].tolist(), item[0])):
        if float(np.max(np.abs(twist), initial=0.0)) <= tolerance:
            fixed.append(t)
            continue
        alike: list[int] | None = None
        for other, some in reversed(found):  # in order of the first number: what is alike is near by
            if twist[0] - other[0] > tolerance:
                break
            if float(np.max(np.abs(other - twist))) <= tolerance:
                alike = some
                break
        if alike is None:
            found.append((twist, [t]))
        else:
            alike.append(t)
    return tuple(sorted(tuple(sorted(some)) for _, some in found if len(some) > 1)), tuple(sorted(fixed))


def _reduced(plan: Plan, block: Block, one: State, rows: FloatArray) -> FloatArray:
    """A canonical basis of the space of core velocities that ``rows`` (p, n) span.

    Its anchors' velocities, in order of definition, are in reduced row echelon form: that depends on the space only,
    not on the unknowns that it is written in. Sparse, the same from run to run, its signs fixed by the first anchor.
    """
    if not len(rows):
        return rows
    seen = np.array([_seen(plan, block, one, row) for row in rows])
    size = float(np.max(np.abs(seen), initial=0.0))
    if size > 0.0:
        seen = seen / size
    whole = np.concatenate([seen, rows], axis=1)
    done = 0
    for column in range(seen.shape[1]):
        if done == len(whole):
            break
        pivot = done + int(np.argmax(np.abs(whole[done:, column])))
        if abs(whole[pivot, column]) < 1e-7 * np.max(np.abs(whole[done:, : seen.shape[1]])):
            continue
        whole[[done, pivot]] = whole[[pivot, done]]
        whole[done] /= whole[done, column]
        for other in range(len(whole)):
            if other != done:
                whole[other] -= whole[other, column] * whole[done]
        done += 1
    result = whole[:, seen.shape[1] :]
    largest = np.max(np.abs(result), axis=1, keepdims=True)
    return np.where(np.abs(result) < 1e-9 * largest, 0.0, result)


def _seen(plan: Plan, block: Block, one: State, velocity: FloatArray) -> FloatArray:
    """What a core velocity (n,) moves: the velocities of all anchors in order of definition, then the speeds of all
    other unknowns, by name, in their own units.
    """
    system = plan.system
    speeds = _speeds(block, velocity)
    values: list[float] = []
    for t in sorted({t for n in block.unknowns if (t := system.unknowns[n].thing) is not None}):
        _, anchors = _moved(plan, one, speeds, t)
        values += [part for anchor in anchors for part in anchor]
    others = [system.unknowns[n] for n in block.unknowns if system.unknowns[n].thing is None]
    values += [speeds.get(unknown.number, 0.0) for unknown in sorted(others, key=lambda unknown: unknown.name)]
    return np.array(values)


def _moved(
    plan: Plan, one: State, speeds: dict[int, float], thing: int
) -> tuple[tuple[float, ...], list[tuple[float, float]]]:
    """A thing's (x, y, cosine, sine, vx, vy, turn) and its anchors' velocities, given the speeds of its unknowns."""
    system = plan.system
    numbers = [system.number_of.get(kind(thing)) for kind in (PoseX, PoseY, PoseCos, PoseSin)]
    vx, vy, vc, vs = (0.0 if n is None else speeds.get(n, 0.0) for n in numbers)
    frame = system.frame(thing)
    pose = (0.0, 0.0, *frame.of_thing(1.0, 0.0))
    x, y, c, s = (pose[i] if n is None or one[n] is None else float(np.ravel(one[n])[0]) for i, n in enumerate(numbers))
    turn = c * vs - s * vc
    anchors: list[tuple[float, float]] = []
    for anchor in system.scene.things[thing].anchors:
        dx, dy = frame.local(anchor.local)
        anchors.append((vx - turn * (s * dx + c * dy), vy + turn * (c * dx - s * dy)))
    return (x + system.shift[0], y + system.shift[1], c, s, vx, vy, turn), anchors


def _told(plan: Plan, block: Block, one: State, velocity: FloatArray, drawn: bool) -> FreeMotion:
    """A velocity (n,) of a block's core at one instant in words; ``one`` has the values of its unknowns."""
    system = plan.system
    speeds = _speeds(block, velocity)
    largest = float(np.max(np.abs(velocity / scale_of(plan, block.core))))
    moving: list[tuple[int, str, str]] = []
    twists: dict[int, tuple[float, float, float]] = {}
    velocities: dict[AnchorRef, tuple[float, float]] = {}
    for t in sorted({t for n in block.unknowns if (t := system.unknowns[n].thing) is not None}):
        (x, y, c, s, vx, vy, turn), anchors = _moved(plan, one, speeds, t)
        if max(abs(vx), abs(vy), abs(turn) * plan.size) <= 1e-6 * largest * plan.size:
            continue
        twists[t] = (turn, vx + turn * y, vy - turn * x)
        velocities |= {AnchorRef(t, k): velocity for k, velocity in enumerate(anchors)}
        numbers = (system.number_of.get(PoseX(t)), system.number_of.get(PoseY(t)))
        here = tuple(None if n is None else v for n, v in zip(numbers, (x, y), strict=True))
        moving.append((t, *_way(plan, t, (vx, vy, turn), system.frame(t).to_thing(c, s), here)))
    variables = tuple(
        system.unknowns[n].name
        for n, speed in speeds.items()
        if abs(speed) > 1e-6 * largest
        and not isinstance(system.unknowns[n].payload, PoseX | PoseY | PoseCos | PoseSin | ThingAngle)
        and not system.unknowns[n].name.startswith(("_", "."))
    )
    if not moving:
        words = " and ".join(f"`{v}` can take any value" for v in variables) or "a `_` can take any value"
        remedy = f"`{variables[0]} = 0;` gives it a value" if variables else "name the `_` and give it a value"
        return FreeMotion((), variables, words, remedy, drawn=drawn)
    names = [f"`{system.scene.things[t].name}`" for t, _, _ in moving]
    first, remedy = moving[0][1:]
    if len(moving) == 1:
        words = f"{names[0]} can still {first}"
    else:
        others = ", ".join(names[1:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        words = f"{names[0]} can still {first}, and {others} with it"
    fastest = max((float(np.hypot(*v)) for v in velocities.values()), default=0.0) or 1.0
    return FreeMotion(
        tuple(t for t, _, _ in moving),
        variables,
        words,
        remedy,
        tuple((ref, (vx / fastest, vy / fastest)) for ref, (vx, vy) in velocities.items()),
        tuple((t, (a / fastest, b / fastest, c / fastest)) for t, (a, b, c) in twists.items()),
        drawn,
    )


def _speeds(block: Block, velocity: FloatArray) -> dict[int, float]:
    """The speed of every unknown of a block whose core has a ``velocity`` (n,)."""
    speeds = {n: float(v) for n, v in zip(block.core, velocity, strict=True)}
    if block.linear is not None:
        for n, slopes in zip(block.linear.targets, block.linear.slopes, strict=True):
            speeds[n] = sum(slope * float(velocity[place]) for place, slope in slopes)
    return speeds


def _way(
    plan: Plan,
    thing: int,
    velocity: tuple[float, float, float],
    direction: tuple[float, float],
    at: tuple[float | None, ...],
) -> tuple[str, str]:
    """How one thing moves (turning about one of its anchors or a point, or sliding), and a constraint that would stop
    it.
    """
    vx, vy, turn = velocity
    c, s = direction
    body = plan.system.scene.things[thing]
    rx, ry = plan.system.frame(thing).origin
    reference = next(a.name for a in body.anchors if a.local == (rx, ry))
    if abs(turn) * plan.size <= 1e-6 * max(abs(vx), abs(vy)):
        along = 0 if abs(vx) >= abs(vy) else 1
        place = at[along]
        remedy = f"`{body.name}.{reference}.{'xy'[along]} = {number(0.0 if place is None else place, 6)};` holds it"
        if abs(vy) <= 1e-6 * abs(vx):
            return "move along x", remedy
        if abs(vx) <= 1e-6 * abs(vy):
            return "move along y", remedy
        angle = float(np.degrees(np.arctan2(vy, vx))) % 180.0
        return f"move in the direction of {number(angle)} degrees", remedy
    angle = float(np.degrees(np.arctan2(s, c)))
    remedy = f"`{body.name}.angle = {number(angle if abs(angle) > 1e-9 else 0.0)};` holds it"
    for anchor in body.anchors:  # an anchor at reference + R d has the velocity v + turn * perp(R d)
        dx, dy = anchor.local[0] - rx, anchor.local[1] - ry
        wx, wy = c * dx - s * dy, s * dx + c * dy
        if np.hypot(vx - turn * wy, vy + turn * wx) <= 1e-6 * abs(turn) * plan.size:
            return f"turn about `{body.name}.{anchor.name}`", remedy
    return "turn and move", remedy
