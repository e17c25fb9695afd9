"""Timeline -> Motion: each segment planned, begun, followed, and solved for its frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.codegen import Compiled
from movimentum.plan.compile import compile_segment
from movimentum.plan.model import Plan
from movimentum.scene.model import Scene
from movimentum.solve.candidates import Selection
from movimentum.solve.carry import Carry, as_drawn
from movimentum.solve.change_points import find_events
from movimentum.solve.following import Choice, Gap, follow
from movimentum.solve.moments import carry_at, held
from movimentum.solve.motion import Motion
from movimentum.solve.selection import SELECTOR_TOLERANCE, select
from movimentum.solve.stretches import Beginning, Dead, Stretch, Trouble
from movimentum.solve.tracks import Piece
from movimentum.timeline.model import Segment, Timeline

FloatArray = NDArray[np.float64]

MAXIMAL_PIECES = 64


def scene_size(scene: Scene) -> float:
    """The scene's size in world pixels: the largest distance between two anchors of a thing, along an axis (else
    between any two anchors as drawn, else a disc's radius, else the canvas' size, else 100).

    Only used for scaling and tolerances; taken from the things themselves, so that a scaled scene is solved alike.
    """
    everything: list[tuple[float, float]] = []
    size = 0.0
    for thing in scene.things:
        points = [anchor.local for anchor in thing.anchors]
        everything += points
        size = max(size, _extent(points))
    size = size or _extent(everything) or max((thing.radius or 0.0 for thing in scene.things), default=0.0)
    if size > 0.0:
        return size
    return float(max(scene.config.size)) if scene.config.size else 100.0


def _extent(points: list[tuple[float, float]]) -> float:
    """The largest difference of a coordinate."""
    if len(points) < 2:
        return 0.0
    return max(max(p[axis] for p in points) - min(p[axis] for p in points) for axis in (0, 1))


def solve(timeline: Timeline, begin: Carry | None = None) -> Motion:
    """Find the motion of a whole timeline; it begins with the pose nearest to ``begin`` (None: as drawn).

    Never raises for what a scene may do: where there is no solution the `Motion` says so in ``troubles`` and its poses
    mark the frames. Raises `plan.compile.CyclicRateError` for a derivative that depends on itself.
    """
    scene = timeline.scene
    size = scene_size(scene)
    carry = begin or as_drawn(scene)
    stretches: list[Stretch] = []
    for segment in timeline.segments:
        earlier = stretches[-1].plan if stretches else None
        stretch, carry = _solve_segment(scene, segment, size, carry, earlier)
        stretches.append(stretch)
    return Motion(timeline, tuple(stretches), size)


def _solve_segment(
    scene: Scene, segment: Segment, size: float, carry: Carry, earlier: Plan | None
) -> tuple[Stretch, Carry]:
    length = float(segment.end - segment.start)
    ahead = 1e-4 * length if length > 0.0 else 1e-4
    plan, selection = _begin(scene, segment, size, carry, ahead, earlier)
    stretch = Stretch(segment, plan, carry, [], [], [])
    stretch.beginnings.append(Beginning(0.0, selection, carry, "step"))
    if selection.choices is None:
        stretch.troubles.append(Trouble("start", 0.0, selection=selection))
        stretch.pieces.append(Dead(0.0, length, carry))
        return stretch, held(carry)
    begin = 0.0
    choices: list[Choice] | None = selection.choices
    while choices is not None:
        piece, gaps = follow(plan, segment.start, begin, length, choices)
        stretch.pieces.append(piece)
        if length <= begin:
            break
        choices, begin = _continue(stretch, piece, gaps, length, ahead)
    last = stretch.pieces[-1]
    if isinstance(last, Dead):
        return stretch, held(last.carry)
    return stretch, carry_at(stretch, last, length, carry)


def _begin(
    scene: Scene, segment: Segment, size: float, carry: Carry, ahead: float, earlier: Plan | None
) -> tuple[Plan, Selection]:
    """Plan a segment and choose where it begins; what proves singular by its geometry is planned again as one block."""
    if earlier is not None and earlier.system.segment.active == segment.active:  # a step that only ends the timeline
        plan = replace(earlier, system=replace(earlier.system, segment=segment))
    else:
        plan = compile_segment(scene, segment, size)
    selection = select(plan, segment.start, 0.0, ahead, carry, totals_of(plan, carry))
    first = plan, selection
    merged: set[int] = set()
    while selection.choices is None:
        before = len(merged)
        for rejection in selection.rejections:
            if rejection.block is not None and rejection.amount == -np.inf:
                merged |= set(plan.blocks[rejection.block].unknowns)
            elif rejection.check is not None:
                merged |= plan.system.equations[rejection.check].unknowns
        if len(merged) == before:  # nothing else to try; the first plan tells best what is wrong
            return first
        plan = compile_segment(scene, segment, size, frozenset(merged))
        selection = select(plan, segment.start, 0.0, ahead, carry, totals_of(plan, carry))
    return plan, selection


def totals_of(plan: Plan, carry: Carry) -> dict[int, float]:
    """What each integral has come to so far, by unknown number."""
    return {
        unknown.number: carry.now.others.get(unknown.payload, 0.0)
        for unknown in plan.system.unknowns
        if unknown.payload in carry.now.others
    }


def _continue(
    stretch: Stretch, piece: Piece, gaps: list[Gap], length: float, ahead: float
) -> tuple[list[Choice] | None, float]:
    """What comes after ``piece``: nothing (it reaches the end), or another piece from where an inequality is violated
    or a path ended.
    """
    plan = piece.plan
    stretch.troubles.extend(Trouble("gap", gap.begin, until=gap.end, block=gap.block) for gap in gaps)
    violated = _first_violation(piece, gaps)
    if violated is None or len(stretch.pieces) >= MAXIMAL_PIECES:
        return None, length
    selector, time = violated
    carry = carry_at(stretch, piece, time, stretch.base)
    resume = min(time + max(1e-9 * length, 1e-15), length)
    with np.errstate(all="ignore"):
        for _ in range(40):  # just far enough for the violation to be seen
            instants = piece.instants(np.array([resume]))
            state, _ = piece.evaluate(instants)
            value = float(np.ravel(plan.selectors[selector](state, instants.clocks)[0])[0])
            if value < -2.0 * SELECTOR_TOLERANCE * plan.size or resume >= length:
                break
            resume = min(time + 2.0 * (resume - time), length)
    selection = select(plan, stretch.segment.start, resume, ahead, carry, totals_of(plan, carry))
    piece.end = time
    stretch.troubles[:] = [t for t in stretch.troubles if t.kind != "gap" or t.begin < time]
    if selection.choices is None:
        stretch.troubles.append(Trouble("selector", time, until=length, selector=selector, selection=selection))
        stretch.pieces.append(Dead(time, length, carry))
        return None, length
    stretch.beginnings.append(Beginning(resume, selection, carry, "inequality", selector))
    return selection.choices, resume


def _first_violation(piece: Piece, gaps: list[Gap]) -> tuple[int, float] | None:
    """The first time at which an inequality is violated along the piece, with its number."""
    plan = piece.plan
    best: tuple[int, float] | None = None
    horizon = min((gap.begin for gap in gaps), default=piece.end)
    nodes = piece.nodes[piece.nodes <= horizon]
    if len(nodes) < 2 or not plan.selectors:
        return None
    with np.errstate(all="ignore"):
        instants = piece.instants(nodes)
        state, _ = piece.evaluate(instants)
        for i, function in enumerate(plan.selectors):

            def slack(tau: FloatArray, function: Compiled = function) -> FloatArray:
                moments = piece.instants(tau)
                values = function(piece.evaluate(moments)[0], moments.clocks)[0]
                return np.broadcast_to(values, len(tau)) / plan.size + SELECTOR_TOLERANCE

            values = np.broadcast_to(function(state, instants.clocks)[0], len(nodes)) / plan.size + SELECTOR_TOLERANCE
            if np.nanmin(values) > 0.3 * (np.nanmax(values) - np.nanmin(values)):
                continue
            events = find_events(slack, nodes, values)
            for low, _ in events.gaps:
                if best is None or low < best[1]:
                    best = i, low
    return best
