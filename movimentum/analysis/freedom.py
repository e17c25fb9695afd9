"""What can still move: the free motions of a scene, counted and told in the script's words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.analysis.words import number
from movimentum.plan.blocks import Block, Kernel
from movimentum.plan.model import Plan
from movimentum.plan.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.scene.model import ThingAngle
from movimentum.solve.kernels import State
from movimentum.solve.newton import jacobian_of, null_space, scaled
from movimentum.solve.stretches import Dead, Stretch
from movimentum.solve.tracks import Piece, scale_of

FloatArray = NDArray[np.float64]

RANK_TOLERANCE = 1e-5
"""Of the largest singular value, rows scaled to unit gradients."""


@dataclass(frozen=True, slots=True)
class Way:
    """Thing number ``thing`` can turn about its ``local`` point or, with a ``direction``, slide along that unit vector.

    Both in the thing's local frame.
    """

    thing: int
    local: tuple[float, float]
    direction: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class FreeMotion:
    """One free motion: the ``things`` that move, unconstrained ``variables``, ``words`` that say it, and a ``remedy``
    to type.

    ``ways``: how each of the things moves, for a picture.
    """

    things: tuple[int, ...]
    variables: tuple[str, ...]
    words: str
    remedy: str
    ways: tuple[Way, ...] = ()


@dataclass(frozen=True, slots=True)
class BlockRank:
    """Rank and freedom of one block at a generic pose."""

    block: int
    rank: int
    freedom: int
    motions: tuple[FreeMotion, ...]


def generic_moment(stretch: Stretch) -> tuple[Piece, float] | None:
    """A moment of the stretch in general position: somewhere in the middle, at no round fraction."""
    for piece in stretch.pieces:
        if not isinstance(piece, Dead):
            gap = min((t.begin for t in stretch.troubles if t.kind == "gap"), default=piece.end)
            end = min(piece.end, gap)
            return piece, piece.begin + 0.37931 * (end - piece.begin)
    return None


def block_ranks(stretch: Stretch) -> list[BlockRank]:
    """Rank and freedom of each Newton block of a stretch; the closed-form kernels have full rank by construction."""
    moment = generic_moment(stretch)
    if moment is None:
        return []
    piece, tau = moment
    result: list[BlockRank] = []
    instants = piece.instants(np.array([tau]))
    with np.errstate(all="ignore"):
        state, _ = piece.evaluate(instants)
        for block in stretch.plan.blocks:
            if block.kernel is not Kernel.NEWTON:
                continue
            x = np.array([[float(np.ravel(state[n])[0]) for n in block.core]])
            one = [None if v is None else np.array([float(np.ravel(v)[0])]) for v in state]
            scale = scale_of(stretch.plan, block.core)
            rows, _ = scaled(jacobian_of(block, one, instants.clocks, x), scale)
            rank, free, _ = null_space(rows[0], RANK_TOLERANCE)
            freedom = len(block.core) - rank
            motions = _motions(stretch.plan, block, x[0], free * scale[:, None]) if freedom and block.free else ()
            result.append(BlockRank(block.number, rank, freedom, motions))
    return result


def free_directions(
    plan: Plan, block: Block, state: State, clocks: Sequence[FloatArray], x: FloatArray
) -> list[tuple[FreeMotion, FloatArray]]:
    """Each free motion of a block at core values ``x`` (n,), and its velocity (n,)."""
    scale = scale_of(plan, block.core)
    one = [None if v is None else np.array([float(np.ravel(v)[0])]) for v in state]
    rows, _ = scaled(jacobian_of(block, one, clocks, x[None]), scale)
    rank, free, _ = null_space(rows[0], RANK_TOLERANCE)
    if rank == len(x):
        return []
    return [(_told(plan, block, x, row), row) for row in _reduced((free * scale[:, None]).T, scale)]


def _motions(plan: Plan, block: Block, x: FloatArray, free: FloatArray) -> tuple[FreeMotion, ...]:
    basis = _reduced(free.T, scale_of(plan, block.core))
    return tuple(_told(plan, block, x, row) for row in basis)


def _reduced(rows: FloatArray, scale: FloatArray) -> FloatArray:
    """Row echelon form with column pivots in order: a sparse, stable, sign-fixed basis of the same space."""
    rows = rows / scale
    done = 0
    for column in range(rows.shape[1]):
        if done == len(rows):
            break
        pivot = done + int(np.argmax(np.abs(rows[done:, column])))
        if abs(rows[pivot, column]) < 1e-7 * np.max(np.abs(rows)):
            continue
        rows[[done, pivot]] = rows[[pivot, done]]
        rows[done] /= rows[done, column]
        for other in range(len(rows)):
            if other != done:
                rows[other] -= rows[other, column] * rows[done]
        done += 1
    rows[np.abs(rows) < 1e-9] = 0.0
    return rows * scale


def _told(plan: Plan, block: Block, x: FloatArray, velocity: FloatArray) -> FreeMotion:
    system = plan.system
    place = {system.unknowns[n].payload: j for j, n in enumerate(block.core)}
    largest = float(np.max(np.abs(velocity / scale_of(plan, block.core))))
    moving: list[tuple[int, str, str]] = []
    ways: list[Way] = []
    for thing in system.scene.things:
        t = thing.number
        columns = [place.get(kind(t)) for kind in (PoseX, PoseY, PoseCos, PoseSin)]
        if all(j is None for j in columns):
            continue
        vx, vy, vc, vs = (0.0 if j is None else float(velocity[j]) for j in columns)
        frame = system.frame(t)
        drawn = frame.of_thing(1.0, 0.0)
        c, s = (drawn[i] if j is None else float(x[j]) for i, j in enumerate(columns[2:]))
        turn = c * vs - s * vc
        c, s = frame.to_thing(c, s)
        small = 1e-6 * largest * plan.size
        if max(abs(vx), abs(vy), abs(turn) * plan.size) <= small:
            continue
        at = tuple(float(x[j]) if j is not None else None for j in columns[:2])
        moving.append((t, *_way(plan, t, (vx, vy, turn), (c, s), at)))
        ways.append(_seen(plan, t, (vx, vy, turn), (c, s)))
    things = tuple(t for t, _, _ in moving)
    variables = tuple(
        system.unknowns[n].name
        for j, n in enumerate(block.core)
        if abs(velocity[j]) > 1e-6 * largest
        and not isinstance(system.unknowns[n].payload, PoseX | PoseY | PoseCos | PoseSin | ThingAngle)
        and not system.unknowns[n].name.startswith(("_", "."))
    )
    if not moving:
        words = " and ".join(f"`{v}` can take any value" for v in variables) or "a `_` can take any value"
        return FreeMotion(
            (),
            variables,
            words,
            f"`{variables[0]} = 0;` gives it a value" if variables else "name the `_` and give it a value",
        )
    names = [f"`{system.scene.things[t].name}`" for t, _, _ in moving]
    first, remedy = moving[0][1:]
    if len(moving) == 1:
        words = f"{names[0]} can still {first}"
    else:
        others = ", ".join(names[1:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        words = f"{names[0]} can still {first}, and {others} with it"
    return FreeMotion(things, variables, words, remedy, tuple(ways))


def _seen(plan: Plan, thing: int, velocity: tuple[float, float, float], direction: tuple[float, float]) -> Way:
    """Where to draw how one thing moves: the point that it turns about, unless that is far away: then it slides."""
    vx, vy, turn = velocity
    c, s = direction
    rx, ry = plan.system.frame(thing).origin
    speed = float(np.hypot(vx, vy))
    if abs(turn) * 4.0 * plan.size > speed:
        # the point at w from the reference has the velocity v + turn * perp(w), which is 0 at the pivot
        wx, wy = -vy / turn, vx / turn
        return Way(thing, (rx + c * wx + s * wy, ry - s * wx + c * wy))
    return Way(thing, (rx, ry), ((c * vx + s * vy) / speed, (-s * vx + c * vy) / speed))


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
    remedy = f"`{body.name}.angle = {number(float(np.degrees(np.arctan2(s, c))))};` holds it"
    for anchor in body.anchors:  # an anchor at reference + R d has the velocity v + turn * perp(R d)
        dx, dy = anchor.local[0] - rx, anchor.local[1] - ry
        wx, wy = c * dx - s * dy, s * dx + c * dy
        if np.hypot(vx - turn * wy, vy + turn * wx) <= 1e-6 * abs(turn) * plan.size:
            return f"turn about `{body.name}.{anchor.name}`", remedy
    return "turn and move", remedy
