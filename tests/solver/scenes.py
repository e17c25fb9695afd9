"""Helpers of the solver's tests: scripts to motions, and an evaluation of the scene's constraints that shares no code
with the solver.

Positions come from `Poses`, expressions are interpreted node by node in extended precision (numpy longdouble).
"""

from __future__ import annotations

import cmath
import math
from fractions import Fraction
from functools import cache

import numpy as np

from movimentum.expressions import Expr, walk
from movimentum.planning.plan import Plan
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.scene.build import build
from movimentum.scene.model import (
    AnchorCoordinate,
    Anonymous,
    Relation,
    Scene,
    ThingAngle,
    ThingProperty,
    VariableComponent,
)
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.solver.solver import solve
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.timeline.arrange import arrange

WIDE = np.longdouble
DEGREE = np.arctan(WIDE(1)) / 45

ARMS = """.config(10); A : .bar P = [3, 4] Q = P + [5, 12]; B : .bar P = [30, 4] Q = P + [0, 20];
@0 A.P = [1, 2]; A.Q.x = 4 + x; B.P = A.Q; B.Q.y = 3; x = 0; @1
"""
"""Two bars that hang together; a script for its unknowns."""


def scene_of(text: str) -> Scene:
    """A scene from a script's text; every sprite is 100 x 100 pixels."""
    source = SourceText("test.mov", text)
    return build(parse(source), source, lambda _path: (100, 100))


def motion_of(text: str, fps: int | Fraction | None = None) -> PathMotion:
    """The motion of a script's text."""
    return solve(arrange(scene_of(text), fps=fps, max_frames=2_000_000))


@cache
def plan_of(text: str, step: int = 0) -> Plan:
    """The plan of one step of a script's text, which is not solved."""
    scene = scene_of(text)
    segment = arrange(scene).segments[step]
    return compile_structure(structure_of(scene, segment, {}), scene_size(scene), None)


def unknown(plan: Plan, name: str) -> int:
    """The number of the unknown with that name."""
    return next(each.number for each in plan.system.unknowns if each.name == name)


def numbers(statements: str, end: float = 1) -> str:
    """A script about variables, for a scene of 100 pixels."""
    return f".config(10, 100, 100); Bar : .bar A = [0, 0] B = A + [100, 0];\n@0 {statements} @{end}"


def posed(place: complex, degrees: float) -> BodyPose:
    """The pose of a thing that is turned by so much and whose origin is at ``place``."""
    way = cmath.exp(1j * math.radians(degrees))
    return BodyPose(place.real, place.imag, way.real, way.imag, degrees)


def poses_of(text: str, fps: int | Fraction | None = None) -> Poses:
    """All frames of a script's text."""
    motion = motion_of(text, fps)
    return motion.poses(0, motion.timeline.frame_count)


def anchor(motion: PathMotion, poses: Poses, name: str) -> np.ndarray:
    """(F, 2) world positions of ``Thing.Anchor``."""
    thing_name, anchor_name = name.split(".")
    thing = next(t for t in motion.timeline.scene.things if t.name == thing_name)
    point = next(a for a in thing.anchors if a.name == anchor_name)
    return poses.world(thing.number, point.local)


def residuals(motion: PathMotion, poses: Poses) -> dict[int, float]:
    """Constraint number -> largest |left - right| / size over the frames at which it holds (equations that can be read
    off the poses).
    """
    timeline = motion.timeline
    result: dict[int, float] = {}
    for frame in range(len(poses.frames)):
        if not poses.solved[frame]:
            continue
        time = timeline.frame_time(int(poses.frames[frame]))
        segment = timeline.segments[timeline.segment_at(time)]
        for constraint in segment.active:
            if constraint.relation is not Relation.EQUAL:
                continue
            for left, right in zip(constraint.left, constraint.right, strict=True):
                nodes = list(walk(left, right))
                if any(n.op in ("integral", "derivative") or isinstance(n.payload, Anonymous) for n in nodes):
                    continue
                scene = timeline.scene
                a, b = (value(e, scene, poses, frame, time) for e in (left, right))
                off = a - b
                if left.op == "atan2d":
                    off = off - 360 * np.rint(off / 360)
                result[constraint.number] = max(result.get(constraint.number, 0.0), float(abs(off)) / motion.size)
    return result


def rigidity(motion: PathMotion, poses: Poses) -> float:
    """The largest |c^2 + s^2 - 1|."""
    d = poses.direction.astype(WIDE)
    return float(np.max(np.abs(d[..., 0] ** 2 + d[..., 1] ** 2 - 1)))


def value(root: Expr, scene: Scene, poses: Poses, frame: int, time: Fraction):
    """An expression's value at one frame."""
    memo: dict[Expr, object] = {}
    for node in walk(root):
        args = [memo[a] for a in node.args]
        memo[node] = _node(node, args, scene, poses, frame, time)
    return memo[root]


def _node(node, a, scene, poses, frame, time):
    match node.op:
        case "const":
            return WIDE(node.payload)
        case "clock":
            exact = time - node.payload
            return WIDE(exact.numerator) / WIDE(exact.denominator)
        case "symbol":
            return WIDE(_symbol(node.payload, scene, poses, frame))
        case "add":
            return a[0] + a[1]
        case "mul":
            return a[0] * a[1]
        case "div":
            return a[0] / a[1]
        case "neg":
            return -a[0]
        case "pow":
            return a[0] ** WIDE(node.payload)
        case "sqrt":
            return np.sqrt(a[0])
        case "sind":
            return np.sin(np.fmod(a[0], WIDE(360)) * DEGREE)
        case "cosd":
            return np.cos(np.fmod(a[0], WIDE(360)) * DEGREE)
        case "atan2d":
            return np.arctan2(a[0], a[1]) / DEGREE
        case "le":
            return a[2] if a[0] <= a[1] else a[3]
        case "min":
            return min(a)
        case "max":
            return max(a)
        case "abs":
            return abs(a[0])
        case "exp":
            return np.exp(a[0])
        case "ln":
            return np.log(a[0])
        case "ease":
            u = min(max(a[0], WIDE(0)), WIDE(1))
            return u * u * (3 - 2 * u)
        case op:
            raise NotImplementedError(op)


def _symbol(payload, scene, poses, frame):
    match payload:
        case AnchorCoordinate(thing, number, axis):
            x, y = (WIDE(v) for v in scene.things[thing].anchors[number].local)
            c, s = (WIDE(v) for v in poses.direction[thing, frame])
            ox, oy = (WIDE(v) for v in poses.origin[thing, frame])
            return ox + c * x - s * y if axis == 0 else oy + s * x + c * y
        case ThingAngle(thing):
            return poses.angle[thing, frame]
        case ThingProperty(thing, name):
            return poses.properties[thing, name][frame]
        case VariableComponent(name, None):
            return poses.variables[name][frame]
        case VariableComponent(name, axis):
            return poses.variables[name][frame, axis]
        case _:
            raise NotImplementedError(payload)
