"""Following one Newton block without freedom along its path.

`trace_path` takes the nodes of a smooth interval together (`strides`), and goes by single steps (`steps`) elsewhere.
Either way the Jacobian's determinant keeps its sign. Steps shrink where one does not count, and try to reach across a
singular point (a change point) with the velocity they came with.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Newton
from movimentum.records import replace
from movimentum.solver.block.block_at_instant import BlockAtInstant, OutlinePlace, Probe
from movimentum.solver.continuation.singular_poses import (
    SingularPose,
    before_kink,
    displacement_between,
    past_kink,
    path_end,
)
from movimentum.solver.continuation.steps import NODES_AT_A_TIME, PathPoint, initial_bend, strides, try_step
from movimentum.solver.continuation.tracks import NodeTrack, node_track
from movimentum.tolerances import (
    AWAY_FROM_SINGULAR,
    CROSSING_BLURRED,
    DEPARTED_FROM_SINGULAR,
    DEPARTURES_MIRRORED,
    FARTHEST_DEPARTURE,
    FIRST_JUMP_ACROSS,
    LANDING_PLACE_ROUNDING,
    LANDING_RATE_ROUNDING,
    LEAST_DIVISOR,
    NEAREST_DEPARTURE,
    RATE_DIFFERENCE_ON_PATH,
    SHORTEST_PATH_STEP,
    SINGULAR_ON_PATH,
)

STEPS_BACK = 200
SINGLE_STEP_NODES = 4
"""Nodes to which a path goes by single steps where it was not smooth, before it strides again; twice as many each time.
"""


def trace_path(
    block: Newton,
    probe: Probe,
    x: FloatArray,
    scale: FloatArray,
    nodes: FloatArray,
    until: float,
    rate: FloatArray | None = None,
    sizes: FloatArray | None = None,
    places: tuple[OutlinePlace, ...] = (),
) -> NodeTrack:
    """Follow the path from core values ``x`` at ``nodes[0]`` through (at least) ``nodes``, as far as ``until`` at most.

    ``rate`` is the velocity to begin with, where the first instant is singular and the block alone cannot tell;
    ``sizes`` are the natural sizes of all of the block's unknowns, ``places`` those of contact in its core.
    """
    low, high = float(nodes[0]), float(nodes[-1])
    total = high - low
    local = BlockAtInstant(
        block,
        probe,
        RATE_DIFFERENCE_ON_PATH * max(total / max(len(nodes) - 1, 1), LEAST_DIVISOR),
        low,
        high,
        sizes,
        places,
    )
    v, smallest = local.rate(low, x, scale)
    here = PathPoint(low, x, v if rate is None or smallest >= AWAY_FROM_SINGULAR else rate, np.zeros_like(x))
    walk = _PathWalk(local, scale, nodes, here)
    if smallest < AWAY_FROM_SINGULAR:
        if not walk.depart(carried=rate is not None):
            return walk.track(low)
    else:
        walk.begin()
    for number, target in enumerate(nodes[1:].tolist()):
        if walk.here.tau < target:
            walk.stride(number, until)
        while walk.here.tau < target:
            if walk.here.tau >= until:
                return walk.track(until)
            if not walk.step(target):
                return walk.track(path_end(local, walk.here.tau, walk.here.x, scale, total))
    return walk.track(max(until, high))


class _PathWalk:
    """A path as far as it has been followed. ``here``: its last point; ``side``: its Jacobian's orientation."""

    def __init__(self, local: BlockAtInstant, scale: FloatArray, nodes: FloatArray, here: PathPoint) -> None:
        self.local, self.scale, self.nodes, self.here = local, scale, nodes, here
        self.total = float(nodes[-1] - nodes[0])
        self.times, self.values, self.rates = [here.tau], [here.x], [here.v]
        self.side = local.orientation(here.tau, here.x, scale)
        self.length = float(nodes[1] - nodes[0])
        self._resting, self._rest = 0, SINGLE_STEP_NODES

    def track(self, until: float) -> NodeTrack:
        """What has been followed, as that of a path that ends at ``until``."""
        return node_track(self.times, self.values, self.rates, until)

    def begin(self) -> None:
        """Measure the acceleration with which the path begins."""
        bend = initial_bend(self.local, self.here, self.length, self.scale)
        if bend is not None:
            self.here = replace(self.here, acceleration=bend)

    def depart(self, *, carried: bool) -> bool:
        """Leave a singular pose: to the first point of a path from there that is far enough away for the block to tell
        its velocity. ``carried``: with the velocity there, else on the path that turns things least. False where no
        path leaves it.
        """
        pose = SingularPose.at(self.local, self.here.tau, self.here.x, self.scale)
        landing, ends = _depart_singular_pose(self.local, self.here, self.total, self.scale, pose, carried=carried)
        if landing is not None:
            self.length = landing.tau - self.here.tau
            if pose is not None and not carried:
                self.rates[0] = (landing.x - self.here.x) / self.length
            self._step_to(landing)
            self.side = self.local.orientation(landing.tau, landing.x, self.scale)
        return not ends

    def stride(self, number: int, until: float) -> None:
        """From the node with this ``number``, pass the nodes ahead that are before ``until`` together, if the path is
        smooth there; where it is not, not again for some nodes.
        """
        if number < self._resting or self.here.tau != self.nodes[number]:
            return
        ahead = self.nodes[number : int(np.searchsorted(self.nodes, until, side="right"))]
        passed = strides(self.local, self.here, ahead, self.scale, self.side)
        count = 0 if passed is None else len(passed.times)
        if passed is not None:
            self.times += passed.times.tolist()
            self.values += list(passed.values)
            self.rates += list(passed.rates)
            self.here = PathPoint(self.times[-1], self.values[-1], self.rates[-1], passed.bend)
            self.length = float(self.nodes[number + count] - self.nodes[number + count - 1])
        if count >= NODES_AT_A_TIME - 1 or count >= len(ahead) - 1:
            self._rest = SINGLE_STEP_NODES
        else:
            self._resting, self._rest = number + count + self._rest, 2 * self._rest

    def step(self, target: float) -> bool:
        """One step, as far as ``target`` at most; False where the path comes to its end."""
        while True:
            length = min(self.length, target - self.here.tau)
            landing = try_step(self.local, self.here, length, self.scale, self.side)
            if landing is not None:
                break
            if length <= SHORTEST_PATH_STEP * self.total:
                landing = past_kink(self.local, self.here, self.total, self.scale, self.side)
                if landing is not None:
                    break
                landing = _across_singular_point(
                    self.local, self.total, self.times, self.values, self.rates, self.scale
                )
                if landing is None:
                    return False
                self.side = 0.0
                break
            self.length = before_kink(self.local, self.here, length)
        self.length = landing.growth * (landing.tau - self.here.tau)
        self._step_to(landing)
        self.side = self.side or self._orientation(landing)
        return True

    def _step_to(self, landing: PathPoint) -> None:
        self.here = landing
        self.times.append(landing.tau)
        self.values.append(landing.x)
        self.rates.append(landing.v)

    def _orientation(self, there: PathPoint) -> float:
        return self.local.orientation(there.tau, there.x, self.scale)


def _depart_singular_pose(
    local: BlockAtInstant, here: PathPoint, total: float, scale: FloatArray, pose: SingularPose | None, *, carried: bool
) -> tuple[PathPoint | None, bool]:
    """The first point of a path that leaves the singular pose ``here``, far enough from there for the block to tell its
    velocity; and whether it is certain that no path does.
    """
    jump, ends, found = NEAREST_DEPARTURE * total, False, False
    while jump < FARTHEST_DEPARTURE * total:
        tau = here.tau + jump
        predicted = here.x + jump * here.v
        if pose is None:
            landed, converged = local.corrected(tau, predicted)
            points = [landed] if converged and np.max(np.abs(landed - here.x) / scale) <= 0.3 else []
        else:
            points, certain = pose.later(tau)
            found |= len(points) > 0
            ends = certain and not found
        landings: list[PathPoint] = []
        for x in points:
            v, smallest = local.rate(tau, x, scale)
            landing = PathPoint(tau, x, v, np.zeros_like(v))
            if smallest <= (SINGULAR_ON_PATH if pose is None else DEPARTED_FROM_SINGULAR):
                continue
            if pose.begins(tau, x) if pose is not None else _leads_back(local, landing, here.tau, total, scale):
                landings.append(landing)
        if landings and carried:
            return min(landings, key=lambda landing: float(np.max(np.abs(landing.x - predicted) / scale))), False
        if landings:
            ways = [displacement_between(local, here.tau, here.x, tau, landing.x) for landing in landings]
            # of two that mirror each other, the same one in every order of the statements
            least = min(float(way @ way) for way in ways) * (1.0 + DEPARTURES_MIRRORED)
            nearest = [i for i, way in enumerate(ways) if float(way @ way) <= least]
            return landings[max(nearest, key=lambda i: float(np.sum(ways[i])))], False
        jump *= 2.0
    return None, ends


def _across_singular_point(
    local: BlockAtInstant,
    total: float,
    times: list[float],
    values: list[FloatArray],
    rates: list[FloatArray],
    scale: FloatArray,
) -> PathPoint | None:
    """Past a singular point, along the motion's own continuation: a jump whose landing agrees with it in place and
    velocity.

    Extrapolates from nodes far enough before the singular point for their velocities to be trusted. The landing counts
    only if the path through it leads back to the singular point: else there is no solution on the way.
    """
    tau, jump = times[-1], FIRST_JUMP_ACROSS * total
    while jump < 0.02 * total and tau + jump <= local.high:
        base = len(times) - 1
        while base > 0 and times[base] > tau - jump:
            base -= 1
        back = max(base - 1, 0)
        h = tau + jump - times[base]
        x, v = values[base], rates[base]
        a = (v - rates[back]) / (times[base] - times[back]) if back < base else np.zeros_like(v)
        predicted = x + h * v + 0.5 * h * h * a
        landed, converged = local.corrected(tau + jump, predicted)
        if converged:
            moved = float(np.max(np.abs(landed - x) / scale))
            off = float(np.max(np.abs(landed - predicted) / scale))
            new_v, smallest = local.rate(tau + jump, landed, scale)
            change = float(np.max(np.abs(new_v - v - h * a) / scale))
            landing = PathPoint(tau + jump, landed, new_v, (new_v - rates[-1]) / jump, strain=0.0)
            if (
                off <= 0.05 * moved + LANDING_PLACE_ROUNDING
                and smallest > SINGULAR_ON_PATH
                and change <= 0.2 * float(np.max(np.abs(v) / scale)) + LANDING_RATE_ROUNDING
                and _leads_back(local, landing, tau, total, scale)
            ):
                return landing
        jump *= 2.0
    return None


def _leads_back(local: BlockAtInstant, landing: PathPoint, tau: float, total: float, scale: FloatArray) -> bool:
    """Whether the path through ``landing``, followed backwards, comes as near to the singular point at ``tau`` as
    rounding lets it.

    Two folds that nearly meet, with no solution between them, are told from a crossing by that: short of closing by a
    part d of its size, a mechanism has none over a part sqrt(d) of its way.
    """
    hole = CROSSING_BLURRED * min(total, 1.0 / max(float(np.max(np.abs(landing.v) / scale)), LEAST_DIVISOR))
    side = local.orientation(landing.tau, landing.x, scale)
    length = 0.5 * (landing.tau - tau)
    here = replace(landing, acceleration=np.zeros_like(landing.v))
    for _ in range(STEPS_BACK):
        if here.tau - tau <= hole:
            return True
        length = min(length, here.tau - tau - 0.5 * hole)
        step = try_step(local, here, -length, scale, side)
        if step is None:
            length *= 0.5
            if length <= SHORTEST_PATH_STEP * total:
                return False
            continue
        here = step
        length *= 2.0
    return False
