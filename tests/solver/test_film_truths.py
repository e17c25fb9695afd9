"""Pieces, frames, kept values, edits and glimpses of films that are known in closed form."""

from __future__ import annotations

import math
from fractions import Fraction

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import movimentum as mv
from movimentum.expressions import add, symbol, symbols, walk
from movimentum.planning.lowering.unknowns import PoseX, PoseY
from movimentum.records import replace
from movimentum.scene.leaves import StoredValue
from movimentum.scene.model import ThingProperty, VariableComponent
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import PoseState, Snapshot
from movimentum.solver.edited_parts import connected_parts_of, edited_part
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import PoseAssembly, carried_at, placements, snapshot
from movimentum.solver.preview import carried_to_scene, pose_at_rest, preview_pose
from movimentum.solver.segment_motion import Failure, FailureKind, SegmentMotion, UnsolvedInterval
from movimentum.solver.solver_cache import process_plan_cache
from movimentum.solver.stored_values import (
    StoredValues,
    claims_with_stored_values,
    first_value,
    has_value,
    with_stored_values,
)
from movimentum.timeline.arrange import arrange
from tests.solver.scenes import anchor, motion_of, posed, scene_of

# --- pieces of a segment


def segment_with(begins: list[float], unsolved: set[int]) -> SegmentMotion:
    ends = [*begins[1:], begins[-1] + 1.0]
    pieces = [
        UnsolvedInterval(b, e, PoseState(Snapshot(()))) if i in unsolved else Piece(None, Fraction(0), b, e)  # type: ignore[arg-type]
        for i, (b, e) in enumerate(zip(begins, ends, strict=True))
    ]
    return SegmentMotion(None, None, PoseState(Snapshot(())), pieces, [], [])  # type: ignore[arg-type]


@settings(max_examples=30)
@given(
    st.lists(st.integers(1, 40), min_size=1, max_size=6, unique=True),
    st.lists(st.floats(-1, 50), min_size=1, max_size=20),
)
def test_each_instant_is_in_the_last_piece_that_has_begun(begins, tau):
    begins = sorted(map(float, begins))
    motion = segment_with(begins, {1})
    tau_array = np.array([*tau, *begins])
    numbers = motion.piece_numbers(tau_array)
    for t, number in zip(tau_array, numbers, strict=True):
        assert number == max((i for i, b in enumerate(begins) if b <= t), default=0)
    instants = Instants(tau_array, (10.0 + tau_array,))
    seen = np.zeros(len(tau_array), dtype=int)
    for piece, places, part in motion.by_piece(instants):
        seen[places] += 1
        assert all(motion.pieces[numbers[p]] is piece for p in places)
        assert part.tau.tolist() == tau_array[places].tolist()
        assert part.clocks[0].tolist() == (10.0 + tau_array[places]).tolist()
    assert seen.tolist() == [1] * len(seen)


def test_a_path_is_found_by_when_it_begins():
    motion = segment_with([0.0, 1.0, 2.0], {1})
    assert motion.piece_from(2.0) is motion.pieces[2]
    assert motion.piece_from(2.0 + 1e-15) is motion.pieces[2]
    assert motion.piece_from(1.0) is None  # there is no path
    assert motion.piece_from(1.9) is None
    assert not motion.ended
    assert segment_with([0.0, 1.0], {1}).ended
    assert not segment_with([0.0, 1.0], {0}).ended


# --- from states to poses


ORBIT = """.config(10); Arm : .bar P = [0, 0] Q = P + [10, 0]; Rest : .bar P = [7, 8] Q = P + [1, 0];
@0 Arm.P = [100 + 3*.t*.t, 50]; Arm.angle = 90*.t; v = [.t, 2*.t]; {more} @2
"""


def test_placements_and_snapshots_are_the_poses_of_the_film():
    motion = motion_of(ORBIT.format(more=""))
    segment = motion.segments[0]
    (piece,) = segment.pieces
    tau = np.array([0.0, 0.7, 1.9])
    state, _ = piece.evaluate(piece.instants(tau))
    ((number, pose),) = placements(piece.plan, state, segment.base.now)
    assert number == 0
    np.testing.assert_allclose(pose.x + 1j * pose.y, 100 + 3 * tau**2 + 50j, rtol=1e-13)
    np.testing.assert_allclose(pose.c + 1j * pose.s, np.exp(0.5j * np.pi * tau), atol=1e-13)
    now = snapshot(piece.plan, state, segment.base.now, 1)
    assert now.things[0].x == pytest.approx(100 + 3 * 0.49)
    assert now.things[0].angle == pytest.approx(63.0)
    assert now.things[1] is segment.base.now.things[1]
    assert now.known == {0}
    assert [now.others[VariableComponent("v", axis)] for axis in (0, 1)] == pytest.approx([0.7, 1.4])
    for part in (PoseX(0), PoseY(0)):
        if part in piece.plan.system.number_of:
            assert now.solved[part] == np.broadcast_to(state[piece.plan.system.number_of[part]], 3)[1]


@pytest.mark.parametrize("time", [0.5, 1.0, 2.0])
def test_the_velocity_that_is_carried_on_is_the_derivative(time):
    motion = motion_of(ORBIT.format(more=""))
    segment = motion.segments[0]
    carry = carried_at(segment, segment.pieces[0], time, segment.base)
    assert carry.now.things[0].x == pytest.approx(100 + 3 * time**2)
    assert carry.before is not None
    assert (carry.now.things[0].x - carry.before.things[0].x) / carry.span == pytest.approx(6 * time, rel=1e-4)
    assert (carry.now.things[0].angle - carry.before.things[0].angle) / carry.span == pytest.approx(90, rel=1e-6)
    checked = replace(segment, failures=[Failure(FailureKind.CHECK, 0.2, until=2.0)])  # no gap: the path goes on
    assert carried_at(checked, segment.pieces[0], time, segment.base).before is not None
    first = carried_at(segment, segment.pieces[0], 0.0, segment.base)
    assert first.before is None
    assert first.now.things[0].x == pytest.approx(100)


def test_frames_without_a_solution_hold_the_last_pose():
    """x² = 100 - 100 t² ends at t = 1; in the second step only y is stated."""
    motion = (
        mv.loads(""".config(10, 300, 300); Arm : .bar P = [0, 0] Q = P + [10, 0];
    @0 Arm.P = [x, 5]; x*x = 100 - 100*.t*.t; x > 0; Arm.angle = 0; @2 x*x = _; x > _; Arm.P = [y, 6]; y = 4; @3
    """)
        .solve(on_failure="hold")
        .solution.motion
    )
    poses = motion.poses(0, motion.timeline.frame_count)
    times = poses.times
    assert poses.solved.tolist() == [t <= 1.0 or t >= 2.0 for t in times]
    early = times <= 1.0
    np.testing.assert_allclose(poses.origin[0, early, 0], 10 * np.sqrt(np.maximum(1 - times[early] ** 2, 0)), atol=1e-5)
    between = (times > 1.0) & (times < 2.0)
    np.testing.assert_allclose(poses.origin[0, between], [[0.0, 5.0]] * int(between.sum()), atol=1e-2)
    assert np.ptp(poses.origin[0, between, 0]) == 0.0
    assert np.ptp(poses.variables["x"][between]) == 0.0
    np.testing.assert_allclose(poses.origin[0, times >= 2.0], [[4.0, 6.0]] * 11)
    assert poses.missing["x"].tolist() == [t >= 2.0 for t in times]
    assert poses.missing["y"].tolist() == [t < 2.0 for t in times]
    assert poses.variables["y"].tolist() == pytest.approx([4.0] * len(times))  # the first that it will have
    np.testing.assert_allclose(poses.variables["x"][times >= 2.0], poses.variables["x"][19])
    segments = motion.segments
    assert [has_value(s, "x", False) for s in segments[:2]] == [True, False]
    assert not has_value(segments[0], "x", True)
    assert first_value(segments, "y", False) == (4.0,)
    assert first_value(segments, "x", False) == pytest.approx((10.0,))
    assert first_value(segments, "z", True) == (0.0, 0.0)
    left = carried_at(segments[0], segments[0].pieces[0], 1.5, segments[0].base)  # in the gap: where it begins
    assert left.before is None
    assert left.now.things[0].x == pytest.approx(0.0, abs=1e-5)


def test_what_is_not_finite_is_no_solution():
    motion = motion_of(ORBIT.format(more=""))
    times = np.array([0.0, 1.0, 2.0])
    assembly = PoseAssembly(motion.timeline.scene, motion.segments, np.arange(3), times)
    assembly.add(motion.segments[0], slice(0, 3), motion.instants(motion.segments[0], 0, 3))
    assembly.origin[0, 1, 0] = np.inf
    assembly.variables["v"][2, 1] = np.nan
    poses = assembly.finished()
    assert poses.solved.tolist() == [True, False, False]
    assert poses.origin[0, 1, 0] == 0.0
    assert poses.variables["v"][2].tolist() == [pytest.approx(0.2), 0.0]
    assert poses.origin[1].tolist() == [[0.0, 0.0]] * 3
    assert poses.direction[1].tolist() == [[1.0, 0.0]] * 3


def test_what_is_let_go_rests_as_it_was():
    motion = motion_of(""".config(10); Arm : .bar P = [0, 0] Q = P + [10, 0]; Dot : .bar U = [0, 0] V = U + [1, 0];
    @0 Arm.P = [4, 5]; Arm.angle = 30*.t; Dot.U = [1, 1]; @1 Arm.P = _; Arm.angle = _; @2""")
    poses = motion.poses_at([Fraction(1, 2), Fraction(3, 2), Fraction(2)])
    assert poses.angle[0].tolist() == pytest.approx([15, 30, 30])
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    np.testing.assert_allclose(poses.direction[0, 1:], [[c, s]] * 2)
    np.testing.assert_allclose(poses.origin[0], [[4, 5]] * 3)
    alone = motion.poses_at([Fraction(3, 2)])  # of the second step only
    assert alone.angle[0].tolist() == pytest.approx([30])
    np.testing.assert_allclose(alone.direction[0], [[c, s]])
    np.testing.assert_allclose(alone.origin[0], [[4, 5]])


def test_frames_are_judged_by_what_is_stated_where_that_is_doubted():
    motion, other = motion_of(ORBIT.format(more="")), motion_of(ORBIT.format(more="").replace("50]", "50 + .t]"))
    assert replace(motion, uncertain=True).poses(0, 21).solved.all()
    (piece,) = motion.segments[0].pieces
    system = replace(piece.plan.system, equations=other.segments[0].plan.system.equations)  # it is not at y = 50 + t
    mixed = replace(motion.segments[0], pieces=[replace(piece, plan=replace(piece.plan, system=system))])
    mixed = replace(motion, segments=(mixed, *motion.segments[1:]), uncertain=True)
    assert mixed.poses(0, 20).solved.tolist() == [True] + [False] * 19
    assert replace(mixed, uncertain=False).poses(0, 20).solved.all()


@pytest.mark.parametrize(("value", "seen"), [("0.49", False), ("0.5", True), ("1", True), ("0", False)])
def test_a_thing_is_seen_from_a_half_on(value, seen):
    motion = motion_of(ORBIT.format(more=f"Rest.visible = {value};"))
    assert motion.poses(0, 3).visible.tolist() == [[True] * 3, [seen] * 3]


# --- values that are kept


KEPT = """.config(10); Arm : .bar P = [0, 0] Q = P + [10, 0];
@0 Arm.P = [5*.t, 0]; Arm.angle = 0; x = 3*.t + 1; @1 Arm.P = [y, 1]; y = x.at(1)*.t + 2; x = 9; .claim Arm.P.x > 0; @3
"""


def test_kept_values_are_numbers_where_they_are_read():
    motion = motion_of(KEPT)
    (kept,) = motion.timeline.stored_values or arrange(scene_of(KEPT)).stored_values
    assert motion.stored_values == {kept: pytest.approx(4.0)}
    poses = motion.poses_at([Fraction(1), Fraction(3, 2), Fraction(3)])
    np.testing.assert_allclose(poses.variables["y"], 4 * np.array([0, 0.5, 2]) + 2)
    timeline = arrange(scene_of(KEPT))
    segment = timeline.segments[1]
    assert with_stored_values(timeline.segments[0], {}) is timeline.segments[0]
    with pytest.raises(KeyError):
        with_stored_values(segment, {})
    placed = with_stored_values(segment, {kept: 11.0})
    values = [c.right[0] for c in placed.active if c.key.startswith("y")]
    assert not any(isinstance(p, StoredValue) for c in placed.active for p in symbols(*c.left, *c.right))
    assert any(node.value == 11.0 for value in values for node in walk(value))
    (plain,) = timeline.claims
    reading = replace(plain, claim=replace(plain.claim, right=(symbol(kept),)))
    assert claims_with_stored_values((plain, reading), {}) == (plain,)
    plain, claim = claims_with_stored_values((plain, reading), {kept: 11.0})
    assert claim.claim.right[0].value == 11.0
    assert not any(isinstance(p, StoredValue) for p in symbols(*claim.claim.left, *claim.claim.right))


def test_kept_values_come_one_after_the_other():
    timeline = arrange(scene_of(KEPT))
    (first,) = timeline.stored_values
    second = StoredValue(add(symbol(first), symbol(VariableComponent("x", None))), Fraction(5))
    values = StoredValues(replace(timeline, stored_values=(first, second)))
    assert [values.is_due(Fraction(t)) for t in (0, 1, 9)] == [False, True, True]
    values.record(Snapshot((BodyPose(),), {VariableComponent("x", None): 4.0}), Fraction(1))
    assert values.values == {first: 4.0}
    assert [values.is_due(Fraction(t)) for t in (1, 5)] == [False, True]
    values.record(Snapshot((BodyPose(),), {VariableComponent("x", None): 0.5}), Fraction(5))
    assert values.values == {first: 4.0, second: 4.5}
    assert not values.is_due(Fraction(9))


def test_the_first_value_is_that_of_the_first_path():
    """x = 2 until the inequality makes it go over to -2."""
    motion = motion_of(ORBIT.format(more="x*x = 4; x < 3 - .t; x ~ 2; u = [3 + .t, 5];"))
    assert len(motion.segments[0].pieces) > 1
    assert first_value(motion.segments, "x", False) == pytest.approx((2.0,))
    assert first_value(motion.segments, "u", True) == pytest.approx((3.0, 5.0))
    poses = motion.poses_at([Fraction(0), Fraction(19, 20), Fraction(21, 20), Fraction(2)])
    assert poses.variables["x"].tolist() == pytest.approx([2, 2, -2, -2])


# --- what an edit touches


def chain_script(count: int, links: list[tuple[int, int]], numbers: list[float]) -> str:
    """``count`` bars, of which the linked ones share an anchor; bar k turns with number k."""
    bars = "\n".join(f"B{k} : .bar P = [{20 * k}, 0] Q = P + [9, 0];" for k in range(count))
    first = {max(i, j): min(i, j) for i, j in links}
    pins = "\n".join(f"B{k}.P = B{first[k]}.Q;" if k in first else f"B{k}.P = [{20 * k}, 5];" for k in range(count))
    turns = "\n".join(f"B{k}.angle = {numbers[k]}*.t + a{k}; a{k} = 1;" for k in range(count))
    return f".config(10);\n{bars}\n@0\n{pins}\n{turns}\n@1\n"


@settings(max_examples=8)
@given(st.data())
def test_an_edit_touches_the_connected_parts(data):
    count = 6
    links = [(data.draw(st.integers(0, k - 1)), k) for k in range(1, count) if data.draw(st.booleans())]
    edited = data.draw(st.sets(st.integers(0, count - 1), max_size=2))
    graph = nx.Graph(links)
    graph.add_nodes_from(range(count))
    old, new = ([1.0 + (k in some) for k in range(count)] for some in (set(), edited))
    one, other = (arrange(scene_of(chain_script(count, links, some))) for some in (old, new))
    found = edited_part((one.scene, one.segments[0]), (other.scene, other.segments[0]))
    assert found is not None
    dirty = set().union(*(nx.node_connected_component(graph, k) for k in edited)) if edited else set()
    number = {thing.name: thing.number for thing in other.scene.things}
    exact = {f"B{k}" for k in dirty}
    mentioned = {other.scene.things[c.anchor.thing].name for c in found.active if c.anchor is not None}
    assert mentioned == exact
    assert len([c for c in found.active if "angle" in c.key]) == len(dirty)
    for start in range(count):
        kept, things = connected_parts_of(other.scene, other.segments, [number[f"B{start}"]])
        part = {f"B{k}" for k in nx.node_connected_component(graph, start)}
        assert {thing.name for thing in things} == part
        assert len(kept[0].active) == 3 * len(part)


def test_edits_of_the_drawing_and_of_what_is_gone_touch_too():
    text = chain_script(3, [(0, 1)], [1, 1, 1])
    before = arrange(scene_of(text))

    def names(after_text: str) -> set[str] | None:
        after = arrange(scene_of(after_text))
        found = edited_part((before.scene, before.segments[0]), (after.scene, after.segments[0]))
        return None if found is None else {c.key.split(".")[0] for c in found.active if "." in c.key}

    assert names(text) == set()
    assert names(text.replace("B2 : .bar P = [40, 0] Q = P + [9, 0]", "B2 : .bar P = [40, 0] Q = P + [8, 0]")) == {"B2"}
    assert names(text.replace("B1.P = B0.Q;", "")) == {"B0", "B1"}  # what was tied by what is gone
    assert names(text.replace("a2 = 1;", "")) == {"B2"}
    assert names(text.replace("B2 :", "C2 :").replace("B2.", "C2.")) is None
    assert names(text.replace("\n@1\n", "\n@9\n").replace("@0", "@3")) is None
    pushing = text.replace("a2 = 1;", "a2 = 1; B1.Q.x < 90 .pushes;")
    assert names(pushing) is None  # it may push anything
    scene = scene_of(pushing)
    assert connected_parts_of(scene, arrange(scene).segments, [0]) is None


# --- a pose at once


SLIDER = """.config(10); Crank : .bar A = [0, 0] B = A + [{a}, 0];   Rod : .bar P = [0, 0] Q = P + [100, 0];
@0  Crank.A = [0, 0]; Crank.angle = 40*.t;   Rod.P = Crank.B;   Rod.Q = [x, 0];   x > 0; {more} @2
"""


@pytest.mark.parametrize("time", [Fraction(0), Fraction(1, 3), Fraction(2)])
def test_a_glimpse_of_an_edited_script_is_its_pose(time):
    """x = a cos t + sqrt(100² - a² sin² t), seen from the pose of another a."""
    shown = motion_of(SLIDER.format(a=40, more=""))
    after = arrange(scene_of(SLIDER.format(a=30, more="")))
    near = carried_to_scene(pose_at_rest(shown, time), shown.timeline.scene, after.scene)
    for known in (None, shown):
        poses = preview_pose(after, time, near, process_plan_cache(after.scene), known)
        assert poses is not None
        angle = math.radians(40 * float(time))
        x = 30 * math.cos(angle) + math.sqrt(100**2 - (30 * math.sin(angle)) ** 2)
        assert poses.variables["x"][0] == pytest.approx(x, rel=1e-12)
    impossible = arrange(scene_of(SLIDER.format(a=30, more="x = 500;")))
    assert preview_pose(impossible, time, near, process_plan_cache(impossible.scene)) is None
    other_side = arrange(scene_of(SLIDER.format(a=30, more="").replace("x > 0", "x < 0")))
    poses = preview_pose(other_side, time, near, process_plan_cache(other_side.scene))
    assert poses is not None
    assert poses.variables["x"][0] < 0.0


def test_a_glimpse_solves_only_what_an_edit_touches():
    text = SLIDER.format(a=40, more="").replace(
        "@0", "Other : .bar U = [0, 0] V = U + [9, 0]; @0 Other.U = [u, 7]; u = 5;"
    )
    shown = motion_of(text)
    after = arrange(scene_of(text.replace("40*.t", "60*.t")))
    near = carried_to_scene(pose_at_rest(shown, Fraction(1)), shown.timeline.scene, after.scene)
    poses = preview_pose(after, Fraction(1), near, process_plan_cache(after.scene), shown)
    assert poses is not None
    assert not any(rows.any() for rows in poses.missing.values())  # `u` is stated, although it is not solved again
    assert poses.variables["u"].tolist() == [5.0]
    assert poses.origin[2].tolist() == [[5.0, 7.0]]
    assert poses.angle[0].tolist() == pytest.approx([60.0])


def test_a_glimpse_uses_the_values_that_are_kept():
    timeline = arrange(scene_of(KEPT))
    motion = motion_of(KEPT)
    near, known = pose_at_rest(motion, Fraction(2)), process_plan_cache(timeline.scene)
    for shown, kept in ((motion, None), (None, {timeline.stored_values[0]: 4.0})):
        poses = preview_pose(timeline, Fraction(2), near, known, shown, kept)
        assert poses is not None
        assert poses.variables["y"].tolist() == pytest.approx([6.0])
    assert preview_pose(timeline, Fraction(2), near, known) is None  # that has to be awaited


def test_where_nothing_is_solved_the_last_pose_is_on_show():
    motion = motion_of(SLIDER.format(a=40, more="x = 500;"))
    assert isinstance(motion.segments[0].pieces[0], UnsolvedInterval)
    carry = pose_at_rest(motion, Fraction(1))
    assert carry.now.things == motion.segments[0].base.now.things


def test_a_pose_on_show_is_at_rest_and_clipped_to_the_film():
    motion = motion_of(ORBIT.format(more=""))
    for time, at in ((Fraction(-5), 0.0), (Fraction(1), 1.0), (Fraction(9), 2.0)):
        carry = pose_at_rest(motion, time)
        assert carry.before is None
        assert carry.now.things[0].x == pytest.approx(100 + 3 * at * at)
    found = anchor(motion, motion.poses_at([Fraction(1)]), "Arm.Q")[0]
    assert found == pytest.approx([103, 60])


def test_things_are_the_same_by_their_names():
    names = [f"T{k}" for k in range(4)]
    scenes = {}
    for order in ([0, 1, 2, 3], [2, 0, 3], [1, 2]):
        things = "".join(f"{names[k]} : .bar P = [{k}, 0] Q = P + [9, 0];" for k in order)
        scenes[tuple(order)] = scene_of(f".config(10); {things} @0 T2.P = [0, 0]; @1")
    whole = scenes[0, 1, 2, 3]
    now = Snapshot(
        tuple(posed(k + 0j, 10.0 * k) for k in range(4)),
        {ThingProperty(2, "opacity"): 0.5, ThingProperty(1, "red"): 7.0, VariableComponent("x", None): 1.0},
        frozenset({0, 2}),
    )
    for order, scene in scenes.items():
        found = carried_to_scene(PoseState(now), whole, scene).now
        assert [pose.x for pose in found.things] == [float(k) for k in order]
        assert found.known == {order.index(k) for k in (0, 2) if k in order}
        exact = {ThingProperty(order.index(2), "opacity"): 0.5, VariableComponent("x", None): 1.0}
        if 1 in order:
            exact[ThingProperty(order.index(1), "red")] = 7.0
        assert found.others == exact
    back = carried_to_scene(PoseState(Snapshot((posed(5j, 3.0), posed(6j, 4.0)))), scenes[1, 2], whole).now
    assert [pose.y for pose in back.things] == [0.0, 5.0, 6.0, 0.0]  # new ones are as drawn
