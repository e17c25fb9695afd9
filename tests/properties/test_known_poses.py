"""Scenes grown from a known pose: they are solved there, move alike when moved, and report the freedom they have."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.analysis.examine import examine
from movimentum.expressions import walk
from movimentum.scene.model import AnchorCoordinate, Relation, ThingAngle, VariableComponent
from tests.properties.scenes import grown, known_poses
from tests.solver.scenes import motion_of, residuals, rigidity, value

STEADY = settings(derandomize=True, max_examples=10)


def frames(text, fps=None):
    motion = motion_of(text, fps)
    return motion, motion.poses(0, motion.timeline.frame_count)


@STEADY
@given(known_poses())
def test_the_known_pose_is_found_and_the_motion_satisfies_its_constraints(built):
    motion, poses = frames(built.script())
    assert poses.solved.all()
    assert max(residuals(motion, poses).values()) < 1e-12
    assert rigidity(motion, poses) < 1e-13
    # at t = 0 everything stands as drawn
    assert np.max(np.abs(poses.direction[:, 0] - [1, 0])) < 1e-9
    assert np.max(np.abs(poses.origin[:, 0])) < 1e-7
    assert examine(motion).fault == 0


@pytest.mark.slow
@STEADY
@given(
    st.integers(0, 10**6),
    st.integers(1, 4),
    st.floats(-180, 180),
    st.sampled_from([1e-6, 0.37, 1.0, 1e5]),
    st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
)
def test_a_scene_moved_turned_and_scaled_moves_alike(seed, count, turn, factor, offset):
    offset = (factor * offset[0], factor * offset[1])
    plain, a = frames(grown(seed, count).script())
    moved, b = frames(grown(seed, count, factor, turn, offset).script())
    assert a.solved.all()
    assert b.solved.all()
    assert np.max(np.abs(a.angle - b.angle)) < 1e-7
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    for thing, other in zip(plain.timeline.scene.things, moved.timeline.scene.things, strict=True):
        for anchor, same in zip(thing.anchors, other.anchors, strict=True):
            p, q = a.world(thing.number, anchor.local), b.world(thing.number, same.local)
            expected = factor * np.stack([c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1]], axis=-1) + offset
            assert np.max(np.abs(q - expected)) < 1e-8 * factor


@pytest.mark.slow
@STEADY
@given(known_poses(), st.integers(2, 5))
def test_more_frames_keep_those_there_were(built, times):
    _, coarse = frames(built.script(), 60)
    _, fine = frames(built.script(), 60 * times)
    assert np.max(np.abs(fine.angle[:, ::times] - coarse.angle)) < 1e-8
    assert np.max(np.abs(fine.origin[:, ::times] - coarse.origin)) < 1e-9


@pytest.mark.slow
@STEADY
@given(known_poses(), st.randoms(use_true_random=False))
def test_the_order_of_statements_does_not_matter(built, random):
    shuffled = list(built.statements)
    random.shuffle(shuffled)
    _, a = frames(built.script())
    _, b = frames(built.script(statements=tuple(shuffled)))
    assert np.max(np.abs(a.origin - b.origin)) < 1e-8
    assert np.max(np.abs(a.angle - b.angle)) < 1e-7


def null_space_size(motion, poses, frame):
    """Unknowns minus rank of the scene's own equations, as a function of each thing's (x, y, angle) and of the
    variables, by central differences in extended precision: no code shared with the planner.
    """
    scene = motion.timeline.scene
    time = motion.timeline.frame_time(frame)
    active = motion.timeline.segments[motion.timeline.segment_at(time)].active
    rows = [
        (a, b)
        for constraint in active
        if constraint.relation is Relation.EQUAL
        for a, b in zip(constraint.left, constraint.right, strict=True)
    ]
    things, names = set(), set()
    for a, b in rows:
        for node in walk(a, b):
            match node.payload if node.op == "symbol" else None:
                case AnchorCoordinate(thing, _, _) | ThingAngle(thing):
                    things.add(thing)
                case VariableComponent(name, None):
                    names.add(name)
    columns = [(t, k) for t in sorted(things) for k in range(3)] + [(n, None) for n in sorted(names)]
    size = np.longdouble(motion.size)

    def evaluate(column, step):
        moved = SimpleNamespace(
            direction=poses.direction.astype(np.longdouble),
            origin=poses.origin.astype(np.longdouble),
            angle=poses.angle.astype(np.longdouble),
            variables={k: v.astype(np.longdouble) for k, v in poses.variables.items()},
            properties=poses.properties,
        )
        key, part = column
        if part is None:
            moved.variables[key][frame] += step * size
        elif part < 2:
            moved.origin[key, frame, part] += step * size
        else:
            # about the first anchor, so that columns are of one size
            x, y = (np.longdouble(v) for v in scene.things[key].anchors[0].local)
            c, s = moved.direction[key, frame]
            turned = c * np.cos(step) - s * np.sin(step), s * np.cos(step) + c * np.sin(step)
            ox, oy = moved.origin[key, frame]
            moved.origin[key, frame] = (
                ox + (c - turned[0]) * x - (s - turned[1]) * y,
                oy + (s - turned[1]) * x + (c - turned[0]) * y,
            )
            moved.direction[key, frame] = turned
            moved.angle[key, frame] += step * 180 / np.pi
        return [value(a, scene, moved, frame, time) - value(b, scene, moved, frame, time) for a, b in rows]

    h = np.longdouble(1e-6)
    jacobian = np.array(
        [[(p - m) / (2 * h) for p, m in zip(evaluate(c, h), evaluate(c, -h), strict=True)] for c in columns],
        dtype=np.float64,
    ).T
    jacobian /= np.maximum(np.linalg.norm(jacobian, axis=1, keepdims=True), 1e-300)
    singular = np.linalg.svd(jacobian, compute_uv=False)
    return len(columns) - int(np.sum(singular > 1e-6 * singular[0]))


@pytest.mark.slow
@settings(derandomize=True, max_examples=10)
@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(0, 3))
def test_the_reported_freedom_is_the_null_space_of_an_independent_jacobian(seed, count, dropped):
    built = grown(seed, count)
    equations = [s for s in built.statements if "~" not in s]
    for k in range(dropped):  # what is left free
        equations.pop((seed // (k + 1)) % len(equations))
    motion, poses = frames(built.script(end="0.02", statements=tuple(equations)))
    report = examine(motion).steps[0]
    expected = null_space_size(motion, poses, 0)
    assert report.freedom == expected, built.script(statements=tuple(equations))
