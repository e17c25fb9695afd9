"""Exports the plan of a scene as Pyslvs' triangular formulas, if all of its blocks are triangles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.interop.formulas import FPS, Formula, Formulas, evaluate
from movimentum.interop.linkage_export import Joint, scene_joints
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.scene.model import Scene
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.text import listed
from movimentum.tolerances import CONSTANT, SHORT_LINE, STRAIGHT, TURNED_OVER


@dataclass(frozen=True, slots=True)
class Triangles:
    """``formulas`` with all known values (an angle or a point that time drives has a value for each frame); ``names``:
    the name of each joint in the formulas and in the script. ``error``: the largest distance of a formula's point from
    the scene's point, in pixels.
    """

    formulas: Formulas
    names: tuple[tuple[str, str], ...]
    error: float


def triangles_of(motion: PathMotion) -> Triangles:
    """The formulas that give the scene's joints at all of its frames.

    Raises `ScriptError` if a block is not a triangle, if steps change the constraints, or if a triangle turns over on
    its way.
    """
    timeline = motion.timeline
    plan = _only_plan(motion)
    builder = _TriangleBuilder(timeline.scene, plan, motion.poses(0, timeline.frame_count), motion.size)
    builder.values[FPS] = np.asarray(float(timeline.fps))
    for block in plan.blocks:
        builder.solve(block)
    return builder.finished()


def _only_plan(motion: PathMotion) -> Plan:
    scene = motion.timeline.scene
    plans = [s.plan for s in motion.segments if s.segment.end > s.segment.start] or [motion.segments[-1].plan]
    other = next((p for p in plans if p.system.segment.active != plans[0].system.segment.active), None)
    if other is not None:
        step = scene.steps[other.system.segment.step]
        raise _refused(
            scene, "export/steps", "formulas are the same all the time, and this step changes them", step.span
        )
    for block in plans[0].blocks:
        if block.iterative:
            numbers = {plans[0].system.unknowns[n].thing for n in block.unknowns} - {None}
            names = listed([f"`{scene.things[t].name}`" for t in sorted(n for n in numbers if n is not None)])
            spans = [scene.constraints()[c].span for e in block.equations
                     if (c := plans[0].system.equations[e].constraint) is not None]  # fmt: skip
            why = "can still move" if block.free else "must be solved together, not triangle by triangle"
            raise _refused(scene, "export/not-triangular", f"{names or 'variables'} {why}", spans[0] if spans else None)
    return plans[0]


def _refused(scene: Scene, code: str, message: str, span: object = None) -> ScriptError:
    from movimentum.source import Span

    place = span if isinstance(span, Span) else None
    return ScriptError([*scene.diagnostics, Diagnostic(code, Severity.ERROR, f"no formulas: {message}", place)])


@dataclass(frozen=True, slots=True, eq=False)
class _End:
    """A point (F, 2) of a line: at rest, or a point of the body that two known joints are on."""

    place: FloatArray
    base: tuple[int, int] | None = None


@dataclass(slots=True, eq=False)
class _TriangleBuilder:
    """Names points in the order in which the plan finds them."""

    scene: Scene
    plan: Plan
    poses: Poses
    size: float
    joints: tuple[Joint, ...] = ()
    places: list[FloatArray] = field(default_factory=list[FloatArray])
    of_body: dict[int, list[int]] = field(default_factory=dict[int, list[int]])
    names: dict[int, str] = field(default_factory=dict[int, str])
    formulas: list[Formula] = field(default_factory=list[Formula])
    values: dict[str, FloatArray] = field(default_factory=dict[str, FloatArray])
    solved: set[int] = field(default_factory=set[int])
    measured: set[int] = field(default_factory=set[int])

    def __post_init__(self) -> None:
        """The places of all joints in all frames, and the joints of each body."""
        self.joints = scene_joints(self.scene, self.plan.system.segment.active)
        for joint in self.joints:
            anchor = self.scene.things[joint.first.thing].anchors[joint.first.anchor]
            self.places.append(self.poses.world(joint.first.thing, anchor.local))
            for ref in joint.anchors:
                self.of_body.setdefault(ref.thing, []).append(joint.number)

    # --- which joints are known when ------------------------------------------------------------------

    def solve(self, block: Block) -> None:
        """Name every joint that is determined once ``block`` has been solved."""
        self.solved |= set(block.unknowns)
        if block.two_valued or block.inputs & self.measured:
            self.measured |= set(block.unknowns)
        progress = True
        while progress:
            progress = False
            for joint in self.joints:
                if joint.number not in self.names and self._determined(joint) and self._found(joint.number):
                    progress = True

    def _determined(self, joint: Joint) -> bool:
        return any(self._needs(ref.thing, ref.anchor) <= self.solved for ref in joint.anchors)

    def _needs(self, thing: int, anchor: int) -> set[int]:
        """The unknowns that an anchor's place depends on."""
        body = next((b for b in self.plan.bodies if b.thing == thing), None)
        if body is None:
            return set()
        dx, dy = self.plan.system.frame(thing).local(self.scene.things[thing].anchors[anchor].local)
        turned = (body.c, body.s) if (dx, dy) != (0.0, 0.0) else ()
        return {n for n in (body.x, body.y, *turned) if n is not None}

    def finished(self) -> Triangles:
        """The formulas, tested against the scene."""
        missing = [joint for joint in self.joints if joint.number not in self.names]
        if missing:
            anchor = missing[0].first
            span = self.scene.things[anchor.thing].anchors[anchor.anchor].span
            label = missing[0].label(self.scene)
            raise _refused(self.scene, "export/not-triangular", f"no triangle gives `{label}`", span)
        formulas = Formulas(tuple(self.formulas), self.values)
        found = evaluate(formulas)
        found |= {name: value for name, value in self.values.items() if value.shape[-1:] == (2,)}
        known = [joint.number for joint in self.joints if self.names[joint.number] in found]
        error = max((float(np.max(_lengths(found[self.names[j]] - self.places[j]))) for j in known), default=0.0)
        names = tuple((self.names[joint.number], joint.label(self.scene)) for joint in self.joints)
        return Triangles(formulas, names, error)

    # --- which formula gives a joint --------------------------------------------------------------------

    def _found(self, j: int) -> bool:
        return (
            self._still(j)
            or self._on_body(j)
            or self._translated(j)
            or self._driven(j)
            or self._dyad(j)
            or self._slider(j)
            or self._given(j)
        )

    def _still(self, j: int) -> bool:
        place = self.places[j]
        if np.max(np.ptp(place, axis=0)) > CONSTANT * self.size:
            return False
        self.values[self._point(j)] = place[0]
        return True

    def _on_body(self, j: int) -> bool:
        """From two known joints of the same body."""
        for _, known in self._bodies(j):
            for a, b in combinations(known, 2):
                base, arm = self.places[b] - self.places[a], self.places[j] - self.places[a]
                if np.min(_lengths(base)) < SHORT_LINE * np.max(_lengths(arm)):
                    continue
                self._plap(self._point(j), a, b, self.places[j])
                return True
        return False

    def _plap(self, target: str, a: int, b: int, place: FloatArray) -> None:
        base, arm = self.places[b] - self.places[a], place - self.places[a]
        cross = base[:, 0] * arm[:, 1] - base[:, 1] * arm[:, 0]
        angle = self._angle(math.degrees(math.atan2(float(np.sum(cross)), float(np.sum(base * arm)))))
        self._add("PLAP", target, self.names[a], self._length(arm), angle, self.names[b])

    def _translated(self, j: int) -> bool:
        """From a known joint of a body that does not turn."""
        for _, known in self._bodies(j):
            for a in known:
                offset = self.places[j] - self.places[a]
                if np.max(np.ptp(offset, axis=0)) <= CONSTANT * self.size:
                    x, y = (self._scalar("x", float(np.mean(offset[:, axis]))) for axis in (0, 1))
                    self._add("PXY", self._point(j), self.names[a], x, y)
                    return True
        return False

    def _driven(self, j: int) -> bool:
        """From a known joint of a body whose direction time gives."""
        for thing, known in self._bodies(j):
            body = next((b for b in self.plan.bodies if b.thing == thing), None)
            directions = {n for n in (body.c, body.s) if n is not None} if body is not None else set[int]()
            if not known or not directions or not directions <= self.solved or directions & self.measured:
                continue
            arm = self.places[j] - self.places[known[0]]
            angle = np.degrees(np.unwrap(np.arctan2(arm[:, 1], arm[:, 0])))
            self._add("PLA", self._point(j), self.names[known[0]], self._length(arm), self._angle(angle))
            return True
        return False

    def _dyad(self, j: int) -> bool:
        """From two known joints of two bodies."""
        bodies = [(thing, known) for thing, known in self._bodies(j) if known]
        for (_, first), (_, second) in combinations(bodies, 2):
            for a in first:
                for b in second:
                    if a == b:
                        continue
                    base, arm = self.places[b] - self.places[a], self.places[j] - self.places[a]
                    side = base[:, 0] * arm[:, 1] - base[:, 1] * arm[:, 0]
                    near, far = float(np.min(side)), float(np.max(side))
                    reach = TURNED_OVER * self.size**2
                    if near < -reach and far > reach:
                        label = self.joints[j].label(self.scene)
                        message = f"the triangle of `{label}` turns over on its way (a change point)"
                        raise _refused(self.scene, "export/turns-over", message)
                    a, b = (b, a) if far + near < 0.0 else (a, b)
                    one, two = (self._length(self.places[j] - self.places[k]) for k in (a, b))
                    self._add("PLLP", self._point(j), self.names[a], one, two, self.names[b])
                    return True
        return False

    def _slider(self, j: int) -> bool:
        """From a known joint of a body, and a line that the joint stays on: a fixed one, or one of another body."""
        for thing, known in self._bodies(j):
            for a in known:
                for b, c in self._lines(j, thing):
                    line = c.place - b.place
                    unit = line / np.hypot(line[:, 0], line[:, 1])[:, None]
                    ahead = np.einsum("fk,fk->f", self.places[j] - self.places[a], unit)
                    reach = TURNED_OVER * self.size
                    if np.min(ahead) < -reach and np.max(ahead) > reach:
                        continue
                    if np.min(ahead) + np.max(ahead) < 0.0:
                        b, c = c, b
                    length = self._length(self.places[j] - self.places[a])
                    self._add("PLPP", self._point(j), self.names[a], length, self._end(b), self._end(c))
                    return True
        return False

    def _given(self, j: int) -> bool:
        """A point that time gives by itself."""
        needs = [self._needs(ref.thing, ref.anchor) for ref in self.joints[j].anchors]
        if not any(need <= self.solved and not need & self.measured for need in needs):
            return False
        self.values[self._point(j)] = self.places[j]
        return True

    # --- lines ------------------------------------------------------------------------------------------

    def _lines(self, j: int, thing: int) -> Iterator[tuple[_End, _End]]:
        """Pairs of points of lines that joint ``j`` stays on: a fixed one, then those of bodies with known joints."""
        ends = _straight(self.places[j], self.size)
        if ends is not None:
            first, last = (_End(np.broadcast_to(end, self.places[j].shape)) for end in ends)
            yield first, last
        for other, members in self.of_body.items():
            known = [n for n in members if n in self.names]
            for a, b in combinations(known, 2):
                base = self.places[b] - self.places[a]
                length = np.hypot(base[:, 0], base[:, 1])
                if other == thing or np.min(length) <= 0.0:
                    continue
                unit = base / length[:, None]
                arm = self.places[j] - self.places[a]
                seen = np.stack(
                    [np.einsum("fk,fk->f", arm, unit), unit[:, 0] * arm[:, 1] - unit[:, 1] * arm[:, 0]], axis=-1
                )
                ends = _straight(seen, self.size)
                if ends is not None:
                    turned = np.stack([-unit[:, 1], unit[:, 0]], axis=-1)
                    first, last = (_End(self.places[a] + x * unit + y * turned, (a, b)) for x, y in ends)
                    yield first, last

    def _end(self, end: _End) -> str:
        """The name of a point of a line: a known value, or a point of a body."""
        name = f"S{sum(n.startswith('S') for n in (*self.values, *(f.target for f in self.formulas)))}"
        if end.base is None:
            self.values[name] = end.place[0]
        else:
            self._plap(name, *end.base, end.place)
        return name

    # --- names ------------------------------------------------------------------------------------------

    def _bodies(self, j: int) -> list[tuple[int, list[int]]]:
        """The bodies that joint ``j`` is on, each with its known joints."""
        things = dict.fromkeys(ref.thing for ref in self.joints[j].anchors)
        return [(t, [n for n in self.of_body[t] if n in self.names and n != j]) for t in things]

    def _point(self, j: int) -> str:
        self.names[j] = f"P{j}"
        return self.names[j]

    def _length(self, arm: FloatArray) -> str:
        return self._scalar("L", float(np.mean(_lengths(arm))))

    def _angle(self, angle: FloatArray | float) -> str:
        return self._scalar("a", angle)

    def _scalar(self, letter: str, value: FloatArray | float) -> str:
        name = f"{letter}{sum(known[0] == letter for known in self.values)}"
        self.values[name] = np.asarray(value, dtype=np.float64)
        return name

    def _add(self, function: str, target: str, *arguments: str) -> None:
        self.formulas.append(Formula(function, arguments, target))


def _lengths(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(vectors[:, 0], vectors[:, 1]), dtype=np.float64)


def _straight(path: FloatArray, size: float) -> Sequence[FloatArray] | None:
    """The ends of the straight line that ``path`` (F, 2) is on; None if it is not straight, or is a point."""
    first = path[int(np.argmax(np.hypot(*(path - path[0]).T)))]
    last = path[int(np.argmax(np.hypot(*(path - first).T)))]
    line = last - first
    length = float(np.hypot(*line))
    if length <= SHORT_LINE * size:
        return None
    off = ((path - first)[:, 0] * line[1] - (path - first)[:, 1] * line[0]) / length
    return (first, last) if np.max(np.abs(off)) <= STRAIGHT * size else None
