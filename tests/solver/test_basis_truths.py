"""Poses, moments and what is carried on: against complex numbers, graphs, and motions known in closed form."""

from __future__ import annotations

import cmath
import math
from fractions import Fraction
from types import SimpleNamespace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.expressions import add, clock, mul, symbol
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.planning.lowering.unknowns import BodyUnknowns, PoseCos, PoseSin, PoseX, PoseY
from movimentum.records import replace
from movimentum.scene.leaves import Bearing, ContactPlace, StoredValue
from movimentum.scene.model import AnchorCoordinate, ThingAngle, ThingProperty, VariableComponent
from movimentum.solver.basis.body_pose import BodyPose, numbers_of, pose_part, solved_pose, values_in_poses
from movimentum.solver.basis.dependencies import blocks_for, unused_windings
from movimentum.solver.basis.partial_pose import PartialPose
from movimentum.solver.basis.pose_state import PoseState, Snapshot, as_drawn
from movimentum.solver.pose_assembly import at_rest
from tests.solver.scenes import plan_of, posed, scene_of, unknown

SIZES = st.sampled_from([1e-3, 1.0, 1e6])
ANGLES = st.floats(-400, 400)
PARTS = st.floats(-2, 2)


# --- poses


@settings(max_examples=60)
@given(SIZES, PARTS, PARTS, ANGLES, ANGLES, PARTS, PARTS)
def test_a_pose_turns_and_moves_as_complex_numbers_do(size, x, y, degrees, other, u, v):
    pose, before = posed(size * complex(x, y), degrees), posed(size * complex(v, x), other)
    point = size * complex(u, v)
    there, was = (complex(*each.world(point.real, point.imag)) for each in (pose, before))
    turn = cmath.exp(1j * math.radians(degrees))
    assert abs(there - (size * complex(x, y) + turn * point)) <= 1e-12 * size
    assert pose.far_from(before, point.real, point.imag) == pytest.approx(abs(there - was), abs=1e-12 * size)
    turned = pose.turned_from(before)
    assert abs(turned) <= math.pi
    assert cmath.exp(1j * turned) == pytest.approx(turn / cmath.exp(1j * math.radians(other)), abs=1e-12)
    assert pose.each(lambda value: 2 * value).world(0.0, 0.0) == (2 * pose.x, 2 * pose.y)


BODY = BodyUnknowns(0, 0, 1, 2, 3, 4)


def system_with(frame: BodyFrame, shift: tuple[float, float]) -> SimpleNamespace:
    return SimpleNamespace(frame=lambda thing: frame, shift=shift)


@settings(max_examples=60)
@given(SIZES, PARTS, PARTS, ANGLES, ANGLES, PARTS, PARTS, PARTS, PARTS)
def test_unknowns_of_a_frame_give_the_pose_that_they_are_read_from(size, x, y, degrees, axis, u, v, p, q):
    """The frame's origin is where the pose takes it, its direction is turned by as much: and back."""
    way, turn = cmath.exp(1j * math.radians(axis)), cmath.exp(1j * math.radians(degrees))
    frame = BodyFrame(origin=(size * u, size * v), axis=(way.real, way.imag))
    shift = (size * p, size * q)
    pose = posed(size * complex(x, y), degrees)
    values = [pose_part(part(0), numbers_of(frame), pose, shift) for part in (PoseX, PoseY, PoseCos, PoseSin)]
    place = size * complex(x, y) + turn * size * complex(u, v) - size * complex(p, q)
    exact = [place.real, place.imag, (turn * way).real, (turn * way).imag]
    assert values == pytest.approx(exact, abs=1e-11 * max(size, 1.0))

    def solved(body: BodyUnknowns, known: list, before: BodyPose) -> BodyPose:
        return solved_pose(
            system_with(frame, shift), body, numbers_of(frame), known.__getitem__, before,
            lambda angle: (math.sin(math.radians(angle)), math.cos(math.radians(angle))),
        )  # fmt: skip

    def same(one: BodyPose, other: BodyPose) -> None:
        for field in ("x", "y", "c", "s", "angle"):
            unit = size if field in "xy" else 1.0
            assert getattr(one, field) == pytest.approx(getattr(other, field), abs=1e-11 * unit)

    same(solved(BODY, [*values, degrees], BodyPose()), pose)
    same(solved(replace(BODY, c=None, s=None), [*values, degrees], BodyPose()), pose)  # from its angle
    same(solved(BODY, [None] * 5, pose), pose)  # nothing is known: as before
    same(solved(replace(BODY, x=None, y=None), [*values, degrees], replace(pose, c=1.0, s=0.0)), BodyPose(
        # the frame's origin stays where it was, the thing turns about it
        *(lambda z: (z.real, z.imag))(pose.x + 1j * pose.y + (1 - turn) * size * complex(u, v)), pose.c, pose.s, degrees
    ))  # fmt: skip


def test_what_is_read_off_poses():
    pose = posed(3 + 4j, 90)
    payloads = [
        AnchorCoordinate(0, 1, 0),
        AnchorCoordinate(0, 1, 1),
        ThingAngle(0),
        AnchorCoordinate(7, 0, 1),
        ThingAngle(7),
        "x",
    ]
    found = values_in_poses(
        payloads, {0: pose}, lambda thing, number: (10.0 * thing + number, 5.0), lambda name: name * 2
    )
    assert found[:5] == pytest.approx([3 - 5, 4 + 1, 90, 5, 0])
    assert found[5] == "xx"


# --- moments


LEVER = """.config(10); Arm : .bar P = [3, 4] Q = P + [5, 12]; Dot : .disc(4) C = [2, 2];
@0 Arm.P = [1, 2]; Arm.Q.x = 4 + x; x = 3*.t; Dot.C = Arm.Q; Dot.opacity = .t; @1
"""


@pytest.mark.parametrize("degrees", [0.0, 37.0, -120.0, 500.0])
@pytest.mark.parametrize("place", [0j, 1e3 - 2e3j])
def test_a_moment_gives_the_unknowns_of_any_plan(degrees, place):
    plan = plan_of(LEVER)
    poses = posed(place, degrees), posed(2j, 10.0)
    now = Snapshot(poses, {VariableComponent("x", None): 2.5})
    frame, turn = plan.system.frame(0), cmath.exp(1j * math.radians(degrees))
    origin = place + turn * complex(*frame.origin) - complex(*plan.system.shift)
    way = turn * complex(*frame.axis)
    exact = {PoseX(0): origin.real, PoseY(0): origin.imag, PoseCos(0): way.real, PoseSin(0): way.imag,
             ThingAngle(0): degrees, VariableComponent("x", None): 2.5, ThingProperty(1, "opacity"): None}  # fmt: skip
    seen = 0
    for each in plan.system.unknowns:
        if each.payload in exact:
            seen += 1
            value = now.value(plan.system, each.number)
            assert value == (None if exact[each.payload] is None else pytest.approx(exact[each.payload], abs=1e-11))
    assert seen >= 5
    kept = replace(now, solved={PoseX(0): 99.0}, frames={0: frame})
    assert kept.value(plan.system, plan.system.number_of[PoseX(0)]) == 99.0  # as it was solved, in the same frame
    moved = replace(kept, frames={0: replace(frame, origin=(0.5, 0.5))})
    assert moved.value(plan.system, plan.system.number_of[PoseX(0)]) == pytest.approx(origin.real, abs=1e-11)


def test_a_moment_reads_expressions_of_the_scene():
    scene = scene_of(LEVER)
    now = Snapshot((posed(1 + 2j, 90.0), posed(0j, 0.0)), {VariableComponent("x", None): 2.5})
    kept = StoredValue(symbol("old"), Fraction(1))
    x, y = symbol(AnchorCoordinate(0, 1, 0)), symbol(AnchorCoordinate(0, 1, 1))
    bearing = Bearing("here", 350.0, symbol(AnchorCoordinate(0, 0, 1)), symbol(AnchorCoordinate(0, 0, 0)))
    roots = [x, y, symbol(ThingAngle(0)), symbol(ThingProperty(1, "opacity")), symbol(VariableComponent("x", None)),
             symbol(VariableComponent("y", None)), symbol(kept), clock(Fraction(1, 4)),
             add(mul(x, y), clock(Fraction(0))),
             symbol(bearing)]  # fmt: skip
    end = 1 + 2j + 1j * complex(8, 16)
    place = 1 + 2j + 1j * complex(3, 4)
    found = now.read(scene, roots, Fraction(3, 4), {kept: 8.5})
    exact = [end.real, end.imag, 90.0, 1.0, 2.5, 0.0, 8.5, 0.5, end.real * end.imag + 0.75]
    assert found[:-1] == pytest.approx(exact)
    direction = math.degrees(cmath.phase(place))
    assert found[-1] == pytest.approx(direction + 360.0 * round((350.0 - direction) / 360.0))
    told = replace(now, others={bearing: 12.0})
    assert told.read(scene, [symbol(bearing)], Fraction(0), {}) == (12.0,)


@pytest.mark.parametrize("angle", [0.0, 50.0, 200.0, 359.0])
def test_a_place_of_contact_that_is_not_known_is_the_nearest(angle):
    """On a circle about the disc's centre that is in the direction of the other thing."""
    text = f"""
    .config(10); Round : .curve O = [0, 0] .polar(u, 30); Pin : .bar A = [{60 * math.cos(math.radians(angle))},
    {60 * math.sin(math.radians(angle))}] B = A + [5, 0];
    @0 Round.O = [0, 0]; Round.angle = 0; .on(Pin.A, Round) = 3; Pin.A.x = 5; Pin.angle = 0; @1
    """
    plan = plan_of(text)
    carry = as_drawn(plan.system.scene)
    places = [u for u in plan.system.unknowns if isinstance(u.payload, ContactPlace)]
    assert places
    for each in places:
        told = replace(carry.now, others={each.payload: 1.25})
        assert told.value(plan.system, each.number) == 1.25
        value = carry.now.value(plan.system, each.number)
        assert value is not None
        outline = each.payload.touch.outline
        at = outline.value_at(value) if each.payload.along and hasattr(outline, "value_at") else value
        x, y = (float(v[0]) for v in outline.values(np.array([at]))[:2])
        assert (x, y) == pytest.approx(
            (30 * math.cos(math.radians(angle)), 30 * math.sin(math.radians(angle))), abs=1e-6
        )


def test_a_rate_is_the_difference_over_the_span():
    plan = plan_of(LEVER)
    before, now = (Snapshot((posed(p, d), BodyPose())) for p, d in ((1j, 10.0), (1 + 1j, 16.0)))
    turned = unknown(plan, "x")
    n = plan.system.number_of[PoseX(0)]
    frame = complex(*plan.system.frame(0).origin)
    places = [p + cmath.exp(1j * math.radians(d)) * frame for p, d in ((1j, 10.0), (1 + 1j, 16.0))]
    assert PoseState(now, before, 0.5).rate(plan.system, n) == pytest.approx((places[1] - places[0]).real / 0.5)
    assert PoseState(now, None, 0.5).rate(plan.system, n) is None
    assert PoseState(now, before, 0.0).rate(plan.system, n) is None
    assert PoseState(now, before, 0.5).rate(plan.system, turned) is None  # has no value
    assert at_rest(PoseState(now, before, 0.5)).before is None
    assert at_rest(PoseState(now, before, 0.5)).now is now


def test_what_is_known_so_far_replaces_what_was():
    plan = plan_of(LEVER)
    base = Snapshot((posed(7 + 7j, 30.0), posed(-3j, 45.0)), {VariableComponent("x", None): 1.0})
    arm = posed(2 + 9j, 77.0)
    values = {}
    for part in (PoseX, PoseY, PoseCos, PoseSin):
        n = plan.system.number_of[part(0)]
        values[n] = np.array([Snapshot((arm, arm)).value(plan.system, n), 1e9])  # the first instant counts
    known = PartialPose.of(plan, values.get, base, Fraction(0))
    one, other = known.moment.things
    assert (one.x, one.y, one.c, one.s) == pytest.approx((arm.x, arm.y, arm.c, arm.s))
    assert one.angle == pytest.approx(77.0)
    assert (other.x, other.y) == pytest.approx((0.0, -3.0))
    assert known.moment.others[VariableComponent("x", None)] == 1.0
    numbered = PartialPose.of(plan, {unknown(plan, "x"): np.array([4.0, 5.0])}.get, base, Fraction(0))
    assert numbered.moment.others[VariableComponent("x", None)] == 4.0
    place = ContactPlace(None, (symbol(AnchorCoordinate(0, 0, 0)), clock(Fraction(0))))  # type: ignore[arg-type]
    timed = PartialPose(plan, base, Fraction(3))
    assert timed.pose_of(place) == pytest.approx(((7 + 7j + cmath.exp(1j * math.pi / 6) * (3 + 4j)).real, 3.0))
    assert timed.pose_of(replace(place, pose=(*place.pose, symbol(StoredValue(symbol("v"), Fraction(1)))))) is None


# --- dependencies


@pytest.mark.parametrize("seed", range(5))
def test_finders_are_all_ancestors(seed):
    rng = np.random.default_rng(seed)
    count = 60
    reads = [{int(n) for n in rng.choice(i, size=min(i, 2), replace=False)} if i else set() for i in range(count)]
    blocks = [
        SimpleNamespace(inputs={2 * n for n in some}, unknowns=(2 * i, 2 * i + 1)) for i, some in enumerate(reads)
    ]
    plan = SimpleNamespace(owner={n: i for i in range(count) for n in (2 * i, 2 * i + 1)}, blocks=blocks)
    graph = nx.DiGraph()
    graph.add_nodes_from(range(count))
    graph.add_edges_from((n, i) for i, some in enumerate(reads) for n in some)
    for some in ([5], [33, 9], [59, 1], []):
        exact = set(some).union(*(nx.ancestors(graph, n) for n in some))
        assert blocks_for(plan, [2 * n + 1 for n in some] + [999]) == tuple(sorted(exact))


def test_angles_that_nothing_reads_are_idle():
    plan = plan_of("""
    .config(10); A : .bar P = [0, 0] Q = P + [9, 0]; B : .bar P = [0, 0] Q = P + [9, 0];
    C : .bar P = [0, 0] Q = P + [9, 0];
    D : .bar P = [0, 0] Q = P + [9, 0];
    @0 A.P = [0, 0]; A.Q = [x, 3]; x > 0; B.P = [1, 1]; B.Q.y = 4; B.Q.x > 1; D.P = [0, 9]; D.angle = B.angle + 1;
       C.P = [5, 5]; C.Q = [y, 8]; y > 5; C.angle = c; c > 5; @1
    """)
    idle = unused_windings(plan)
    names = {plan.system.unknowns[n].name for number in idle for n in plan.blocks[number].unknowns}
    assert "A.angle" in names
    assert not names & {"B.angle", "C.angle"}
    angle = unknown(plan, "A.angle")
    assert not unused_windings(plan, {angle}) & {plan.owner[angle]}
