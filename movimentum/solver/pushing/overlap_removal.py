"""Finds the nearest pose in which nothing overlaps any more, and all equations hold."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.structure.metric import Metric
from movimentum.records import dataclass
from movimentum.solver.block.newton import newton
from movimentum.solver.block.problem import BlockProblem, null_space, scaled
from movimentum.solver.pushing.contacts import Contacts
from movimentum.solver.pushing.overlap import WholeDistance
from movimentum.solver.pushing.push_law import PushedInstant, pushed_velocity
from movimentum.tolerances import LEAST_DIVISOR, PUSH_CLOSED, PUSH_LOOK, PUSH_OVERLAP, PUSH_SETTLED

STEPS = 40
LONGEST_STEP = 0.25
"""In units of the unknowns' scale: a step of quadratic programming."""
FREE_MOTION_STEP_LENGTH = 0.04
"""The same of a step along a free motion, of which there are `FREE_MOTION_STEPS` each way at most."""
FREE_MOTION_STEPS = 120
MOST_FREE_MOTIONS = 6
"""Free motions that are gone along."""
MOST_GAPS = 24
"""More pairs that overlap, or nearly, are too many to look for a pose."""
NEARBY_DISTANCE = 0.01
"""Of the scene's size: what is no farther apart may come to overlap in the next step."""
HALVINGS = 40
LEAST_SLOPE = 0.1
"""A slope that is less: two circles with one centre, for which any way is as good."""


@dataclass(frozen=True, slots=True)
class FreePlace:
    """Where a ``thing`` would be free: its first anchor at ``place``, turned by ``turn`` degrees; ``moves``, ``turns``:
    whether it would have to.
    """

    thing: int
    place: tuple[float, float]
    turn: float
    moves: bool
    turns: bool


class OverlapRemoval:
    """A block at one instant, in which outlines overlap."""

    def __init__(self, contacts: Contacts, problem: BlockProblem, metric: Metric, size: float) -> None:
        self.contacts, self.problem, self.metric, self.size = contacts, problem, metric, size
        self.gaps = [WholeDistance(gap) for gap in contacts.rows.gaps]
        bodies = contacts.bodies
        self.bodies: list[tuple[int, int]] = list(zip(bodies.first.tolist(), bodies.second.tolist(), strict=True))

    def pose(self, x: FloatArray) -> FloatArray | None:
        """Core values (n,) in which nothing overlaps, near to ``x``; None where none is found."""
        if len(self._near(x)) > MOST_GAPS:
            return None
        best = self._by_quadratic_programming(x)
        if best is not None:
            return best
        found = [each for each in self._along_free_motions(x) if each is not None]
        return min(found, key=lambda each: self.metric.square(each - x), default=None)

    def places(self, x: FloatArray, free: FloatArray) -> tuple[FreePlace, ...]:
        """Where things are in a free pose that are elsewhere in pose ``x``."""
        found: dict[int, FreePlace] = {}
        for value, bodies in zip(self.gaps, self.bodies, strict=True):
            for body, b in zip((value.gap.first, value.gap.second), bodies, strict=True):
                before, after = (value.placed(body, self._poses(each)[:, b].tolist()) for each in (x, free))
                turn = after[2] - before[2]
                turn -= 360.0 * math.floor(turn / 360.0 + 0.5)
                moves = math.dist(before[:2], after[:2]) > PUSH_OVERLAP * self.size
                turns = abs(turn) > PUSH_OVERLAP * 360.0
                if moves or turns:
                    found[body.thing] = FreePlace(body.thing, after[:2], before[2] + turn, moves, turns)
        return tuple(found.values())

    # --- what is asked of a pose

    def _poses(self, x: FloatArray) -> FloatArray:
        return self.contacts.bodies.poses(self.problem.inputs, x[None])[:, 0]

    def _margins(self, x: FloatArray) -> FloatArray:
        return self.contacts.values(self.problem, x[None])[0]

    def _near(self, x: FloatArray, within: float = 0.0) -> list[int]:
        """The gaps that may be smaller than that."""
        bodies = self.contacts.bodies
        return np.nonzero(bodies.apart(self._poses(x)) + self._margins(x)[bodies.push] <= within)[0].tolist()

    def _value(self, g: int, x: FloatArray, poses: FloatArray | None = None) -> float:
        """How far two outlines are apart, with what is added to it."""
        value, poses = self.gaps[g], self._poses(x) if poses is None else poses
        return value.between(poses, self.bodies[g]) + float(self._margins(x)[value.gap.push])

    def _is_free(self, x: FloatArray) -> bool:
        plain = [contact.kind for contact in self.contacts.plain]
        if (self._margins(x)[plain] < -PUSH_OVERLAP * self.size).any():
            return False
        return all(self._value(g, x) >= -PUSH_CLOSED * self.size for g in self._near(x))

    def _row(self, g: int, x: FloatArray) -> FloatArray:
        """(n,) the slopes of a gap, by differences of both sides: where one way is as good as the other, neither is
        taken.
        """
        found = np.zeros(len(x))
        poses, step = self._poses(x), PUSH_LOOK * self.size
        for b in self.bodies[g]:
            columns = self.contacts.columns[:, b]
            for axis in (0, 1):
                if 0 <= columns[axis] < len(x):
                    both = poses.copy(), poses.copy()
                    both[0][axis, b] += step
                    both[1][axis, b] -= step
                    high, low = (self._value(g, x, each) for each in both)
                    found[columns[axis]] += (high - low) / (2.0 * step)
            if not all(0 <= column < len(x) for column in columns[2:]):
                continue
            c, s = poses[2:, b]
            angle = PUSH_LOOK
            both = poses.copy(), poses.copy()
            for each, way in zip(both, (angle, -angle), strict=True):
                each[2:, b] = c * math.cos(way) - s * math.sin(way), s * math.cos(way) + c * math.sin(way)
            high, low = (self._value(g, x, each) for each in both)
            rate = (high - low) / (2.0 * angle)
            found[columns[2]] -= s * rate
            found[columns[3]] += c * rate
        if np.hypot.reduce(found) < LEAST_SLOPE:
            columns = self.contacts.columns[:2, list(self.bodies[g])].T.ravel()
            found[columns[(columns >= 0) & (columns < len(x))][:1]] = 1.0
        return found

    # --- the ways to one

    def _by_quadratic_programming(self, origin: FloatArray) -> FloatArray | None:
        """By steps of sequential quadratic programming, as from a pose that breaks no more than a stop."""
        x = origin
        for _ in range(STEPS):
            gaps = self._near(x, NEARBY_DISTANCE * self.size)
            if len(gaps) > MOST_GAPS:
                return None
            plain = self.contacts.lines(self.contacts.plain, self.problem, x[None]).first()
            slopes = np.array([*plain.slopes, *(self._row(g, x) for g in gaps)]).reshape(-1, len(x))
            values = np.array([*plain.values, *(self._value(g, x) for g in gaps)])
            jacobian, off = self.problem.jacobian(x[None])[0], self.problem.residual(x[None])[0]
            away = self.metric.applied(x - origin)
            found = pushed_velocity(PushedInstant(self.metric, jacobian, -off, away, (), slopes, -values))
            if found.v is None or not np.isfinite(found.v).all():
                return None
            step = float(np.max(np.abs(found.v) / self.problem.scale, initial=0.0))
            x = x + found.v * min(1.0, LONGEST_STEP / max(step, LEAST_DIVISOR))
            if step <= PUSH_SETTLED:
                break
        return self._restored(x)

    def _restored(self, x: FloatArray) -> FloatArray | None:
        """The pose brought back onto the equations, if nothing overlaps there."""
        found = newton(self.problem, x[None], limit=0.1)
        return found.x[0] if found.converged[0] and self._is_free(found.x[0]) else None

    def _along_free_motions(self, origin: FloatArray) -> Iterator[FloatArray | None]:
        """Along each free motion, both ways, to where nothing overlaps."""
        for k in range(MOST_FREE_MOTIONS):
            frame = self._free_directions(origin)
            if k >= frame.shape[1]:
                return
            for way in (1.0, -1.0):
                yield self._along_direction(origin, way * frame[:, k])

    def _free_directions(self, x: FloatArray) -> FloatArray:
        """(n, f): the free motions at a pose, a step of one in units of the unknowns' scale."""
        white, _ = self.metric.whitening
        rows, _ = scaled(self.problem.jacobian(x[None]) @ white, np.ones(len(white)))
        _, free, _ = null_space(rows[0])
        frame = white @ free
        largest = np.max(np.abs(frame) / self.problem.scale[:, None], axis=0, initial=0.0)
        return np.asarray(frame / np.maximum(largest, LEAST_DIVISOR), dtype=np.float64)

    def _along_direction(self, origin: FloatArray, way: FloatArray) -> FloatArray | None:
        x, before = origin, origin
        for _ in range(FREE_MOTION_STEPS):
            found = newton(self.problem, (x + FREE_MOTION_STEP_LENGTH * way)[None], limit=0.1)
            if not found.converged[0]:
                return None
            before, x = x, found.x[0]
            if self._is_free(x):
                return self._first_free(before, x)
            frame = self._free_directions(x)
            units = frame / self.problem.scale[:, None]
            ahead = (x - before) / self.problem.scale
            way = np.asarray(frame @ np.linalg.lstsq(units, ahead, rcond=None)[0], dtype=np.float64)
            way = way / max(float(np.max(np.abs(way) / self.problem.scale)), LEAST_DIVISOR)
        return None

    def _first_free(self, deep: FloatArray, free: FloatArray) -> FloatArray | None:
        """Between a pose that is not free and one that is: where it begins to be."""
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = (low + high) / 2.0
            if self._restored(deep + middle * (free - deep)) is None:
                low = middle
            else:
                high = middle
        return self._restored(deep + high * (free - deep))
