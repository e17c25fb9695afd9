"""What beginnings cost, where connected parts are laid, and which contacts are misplaced, against planted motions."""

from __future__ import annotations

import cmath
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.records import replace
from movimentum.scene.leaves import ContactPlace
from movimentum.scene.model import VariableComponent
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.pose_state import PoseState, Snapshot, as_drawn
from movimentum.solver.start.costs import StartCosts, at_both_instants, safe_square
from movimentum.solver.start.misplaced_contacts import misplaced_contacts
from movimentum.solver.start.part_fit import PartFit, RigidMotion, ThingConstraints
from movimentum.solver.start.placement import ConnectedParts, connected_parts, place_parts, rigid_motion, rigid_motions
from movimentum.tolerances import PLACED_ELSEWHERE, SAME_VALUE, SPELLING_WEIGHT
from tests.solver.scenes import ARMS, numbers, plan_of, posed, unknown

# --- costs


def state_of(plan, poses, later=None) -> list:
    now, then = Snapshot(tuple(poses)), Snapshot(tuple(later or poses))
    return [
        None if a is None else np.array([a, b])
        for a, b in ((now.value(plan.system, n), then.value(plan.system, n)) for n in range(len(plan.system.unknowns)))
    ]


@settings(max_examples=25)
@given(st.floats(-170, 170), st.floats(-170, 170), st.floats(-50, 50), st.booleans(), st.randoms())
def test_costs_are_sums_over_things(first, second, away, known, random):
    """Of what is carried over: the squared chord and way; of what is new: squared turn and squared displacement."""
    plan = plan_of(ARMS)
    before = posed(2 + 1j, 25.0), posed(-3j, 60.0)
    frames = [complex(*plan.system.frame(t).origin) for t in (0, 1)]
    poses = []
    for pose, degrees, frame in zip(
        before, (first, second), frames, strict=True
    ):  # the frame's origin goes by ``away``
        turn = cmath.exp(1j * math.radians(pose.angle + degrees))
        origin = complex(pose.x, pose.y) + complex(pose.c, pose.s) * frame + away
        poses.append(posed(origin - turn * frame, pose.angle + degrees))
    unknowns = [u.number for u in plan.system.unknowns if isinstance(u.payload, PoseX | PoseY | PoseCos | PoseSin)]
    random.shuffle(unknowns)
    carry = PoseState(Snapshot(before, known=frozenset({0, 1}) if known else frozenset()))
    found = StartCosts(plan, carry, 0.1).distances(unknowns, state_of(plan, poses))
    turns = [math.radians(degrees) for degrees in (first, second)]
    moved = sum((isinstance(plan.system.unknowns[n].payload, PoseX)) for n in unknowns) * (away / plan.size) ** 2
    chords = sum(4 * math.sin(turn / 2) ** 2 for turn in turns)
    exact = (chords + moved, 0.0, 0.0) if known else (0.0, sum(turn**2 for turn in turns), moved)
    assert found == pytest.approx(exact, abs=1e-6)


def test_spelled_values_count_by_their_size():
    plan = plan_of(ARMS.replace("x = 0;", "x = 0; a = A.angle; b = B.angle;"))
    measures = StartCosts(plan, as_drawn(plan.system.scene), 0.1)
    state: list = [None] * len(plan.system.unknowns)
    x, angle = unknown(plan, "x"), unknown(plan, "A.angle")
    state[x], state[angle] = 3.0 * plan.size, np.array([720.0, 720.0])
    assert measures.distances([x], state) == pytest.approx((0.0, 9.0 * SPELLING_WEIGHT, 0.0))
    assert measures.distances([angle], state) == pytest.approx((0.0, 4.0 * SPELLING_WEIGHT, 0.0))
    assert measures.distances([x, angle], state) == pytest.approx((0.0, 13.0 * SPELLING_WEIGHT, 0.0))


@pytest.mark.parametrize("speed", [0.0, 40.0, -7.0])
def test_a_break_is_of_place_or_of_velocity(speed):
    plan = plan_of(numbers("x = .t; Bar.A = [0, 0]; Bar.angle = 0;"))
    (block,) = [block for block in plan.blocks if unknown(plan, "x") in block.unknowns]
    poses = (BodyPose(),)
    now, before = (Snapshot(poses, {VariableComponent("x", None): value}) for value in (8.0, 8.0 - 0.5 * speed))
    ahead, x = 1e-3, unknown(plan, "x")
    state: list = [None] * len(plan.system.unknowns)

    def broken(carry: PoseState, value: float, rate: float) -> float:
        state[x] = np.array([value, value + rate * ahead])
        return StartCosts(plan, carry, ahead).discontinuity(block, state)

    moving = PoseState(now, before, 0.5)
    assert broken(PoseState(Snapshot(poses)), 99.0, 0.0) == 0.0  # nothing is carried over
    assert broken(moving, 8.0, speed) == pytest.approx(0.0, abs=1e-12)
    assert broken(moving, 8.1, speed) == 1.0
    assert broken(moving, math.nan, speed) == 1.0
    assert broken(moving, 8.0 + 2.0 * SAME_VALUE * plan.size, speed) == 1.0
    assert broken(moving, 8.0 - 0.5 * SAME_VALUE * plan.size, speed) < 1.0
    for more in (3.0, -50.0):
        assert broken(moving, 8.0, speed + more) == pytest.approx(abs(more) * ahead / plan.size, rel=1e-9)
    assert broken(moving, 8.0, speed + 1e9) == 0.5
    assert broken(PoseState(now), 8.0, speed + 50.0) == 0.0  # no velocity is known


def test_a_value_at_two_instants():
    assert at_both_instants(3) == (3.0, 3.0)
    assert at_both_instants(np.array([4.0])) == (4.0, 4.0)
    assert at_both_instants(np.array([4.0, 5.0])) == (4.0, 5.0)
    assert safe_square(1e200) == math.inf
    assert safe_square(np.float64(-3.0)) == 9.0


# --- rigid motions

SIZES = pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])


@SIZES
@pytest.mark.parametrize("degrees", [0.0, 1.0, 90.0, -179.0])
def test_planted_rigid_motions_are_found(size, degrees):
    rng = np.random.default_rng(5)
    turn, way = cmath.exp(1j * math.radians(degrees)), size * (3 - 7j)
    points = size * (rng.normal(size=5) + 1j * rng.normal(size=5))
    pins = [(p, turn * p + way, 0) for p in points]
    lie = rigid_motion(pins, size)
    assert lie is not None
    assert cmath.exp(1j * lie.turn) == pytest.approx(turn, abs=1e-12)
    assert complex(lie.x, lie.y) == pytest.approx(way, abs=1e-11 * size)
    assert rigid_motion([(p, p + 1e-14 * size, 0) for p in points], size) == RigidMotion()
    assert rigid_motion([], size) == RigidMotion()
    assert rigid_motion([(p, turn * p.conjugate() + way, 0) for p in points], size) is None
    assert rigid_motion([(p, 1.001 * turn * p + way, 0) for p in points], size) is None
    (still, _), (fits, lost), (turns, _), (aways, _) = rigid_motions(
        [(np.array([p, p]), np.array([turn * p + way, 2 * p])) for p in points], np.array([size, size])
    )
    assert (bool(still), bool(fits), bool(lost)) == (False, True, False)
    assert turns == pytest.approx(turn, abs=1e-12)
    assert aways == pytest.approx(way, abs=1e-11 * size)


TRIANGLE = """.config(10);
A : .bar P = [0, 0] Q = P + [{a}, 0]; B : .bar P = [{a}, 0] Q = P + [0, {b}]; C : .bar P = [0, 0] Q = P + [{a}, {b}];
@0 A.Q = B.P; B.Q = C.Q; C.P = A.P; {more} @1
"""


@SIZES
@pytest.mark.parametrize("degrees", [0.0, 30.0, 135.0, -100.0])
@pytest.mark.parametrize("pinned", ["two", "one and angle", "one and guide", "one"])
def test_a_part_is_laid_where_its_pins_want_it(size, degrees, pinned):
    """A triangle, drawn at the origin, belongs where a rigid motion takes it."""
    a, b = 40.0 * size, 30.0 * size
    turn, place = cmath.exp(1j * math.radians(degrees)), size * (200 + 90j)
    far, corner = place + turn * complex(a, b), place + turn * a
    pin = f"A.P = [{place.real!r}, {place.imag!r}];"
    if pinned == "one":
        turn, degrees = 1.0, 0.0
    more = {
        "two": f"B.Q = [{far.real!r}, {far.imag!r}];", "one and angle": f"B.angle = {degrees};",
        "one and guide": f"B.P.y = {corner.imag!r}; B.P.x {'>' if corner.real > place.real else '<'} {place.real!r};",
        "one": "",
    }[pinned]  # fmt: skip
    plan = plan_of(TRIANGLE.format(a=a, b=b, more=pin + more))
    carry = as_drawn(plan.system.scene)
    state: list = [None] * len(plan.system.unknowns)
    if pinned == "one and angle":
        state[unknown(plan, "B.angle")] = degrees
    clocks = [np.zeros(2) for _ in plan.clocks]
    moved = place_parts(plan, ConnectedParts.of(plan), state, clocks, carry)
    for pose in moved.now.things:
        assert complex(pose.x, pose.y) == pytest.approx(complex(place), abs=1e-7 * size)
        assert complex(pose.c, pose.s) == pytest.approx(complex(turn), abs=1e-9)
        assert math.remainder(pose.angle - degrees, 360.0) == pytest.approx(0.0, abs=1e-7)
    known = replace(carry, now=replace(carry.now, known=frozenset({1})))
    assert (
        place_parts(plan, ConnectedParts.of(plan), state, clocks, known) is known
    )  # what has a pose already is not laid anew


@pytest.mark.parametrize("far", [0.0, 1e7])
@pytest.mark.parametrize("begin", [0.0, 20.0])
@pytest.mark.parametrize("pins", [2, 1])
def test_a_part_is_laid_from_any_pose_and_far_from_the_origin(far, begin, pins):
    """Two pins, or one and an angle; poses are measured from a point near the pins."""
    turn, place = cmath.exp(2j), complex(200.0 + far, 90.0 - 2.0 * far)
    end = place + turn * complex(40, 30)
    other = f"B.Q = [{end.real!r}, {end.imag!r}];" if pins == 2 else f"B.angle = {math.degrees(2.0)!r};"
    plan = plan_of(TRIANGLE.format(a=40, b=30, more=f"A.P = [{place.real!r}, {place.imag!r}]; {other}"))
    assert (plan.system.shift != (0.0, 0.0)) is (far > 0.0)
    start = posed(3 - 8j, begin)
    carry = as_drawn(plan.system.scene)
    carry = replace(carry, now=replace(carry.now, things=(start,) * 3))
    state: list = [None] * len(plan.system.unknowns)
    if pins == 1:
        state[unknown(plan, "B.angle")] = math.degrees(2.0)
    moved = place_parts(plan, ConnectedParts.of(plan), state, [np.zeros(2)] * len(plan.clocks), carry)
    for pose in moved.now.things:
        assert complex(pose.x, pose.y) == pytest.approx(place, abs=1e-6)
        assert complex(pose.c, pose.s) == pytest.approx(turn, abs=1e-9)
        assert math.remainder(pose.angle - math.degrees(2.0), 360.0) == pytest.approx(0.0, abs=1e-7)


def test_a_part_that_fits_nowhere_stays_as_it_is_drawn():
    plan = plan_of(TRIANGLE.format(a=40, b=30, more="A.P = [0, 0]; B.Q = [90, 0];"))
    carry = as_drawn(plan.system.scene)
    assert place_parts(plan, ConnectedParts.of(plan), [None] * len(plan.system.unknowns), [np.zeros(2)], carry) is carry


def test_only_connected_things_are_one_part():
    more = " ".join(f"{name} : .bar P = [9, 9] Q = P + [1, 0];" for name in "DEF")
    text = TRIANGLE.format(a=40, b=30, more="D.P = E.P; E.angle = 5; F.P = [1, 1];")
    plan = plan_of(text.replace("@0", f"{more} @0"))
    names = {frozenset(plan.system.scene.things[t].name for t in part) for part in connected_parts(plan) if part}
    assert names >= {frozenset("ABC"), frozenset("DE")}
    parts = [{body.thing for body in part} for part in ConnectedParts.of(plan).bodies]
    assert sorted(map(sorted, parts)) == [[0, 1, 2], [3, 4]]
    assert [{b.thing for b in part} for part in ConnectedParts.of(plan, {4}).bodies] == [{3, 4}]


@pytest.mark.parametrize("seed", range(3))
def test_whether_a_part_meets_its_rows_somewhere(seed):
    rng = np.random.default_rng(seed)
    degrees, place = float(rng.uniform(-170, 170)), complex(*rng.uniform(-300, 300, 2))
    far = place + cmath.exp(1j * math.radians(degrees)) * complex(40, 30)
    pins = f"A.P = [{place.real!r}, {place.imag!r}]; B.Q = [{far.real!r}, {far.imag!r}];"
    plan = plan_of(TRIANGLE.format(a=40, b=30, more=pins))
    about = ThingConstraints.of(plan.system)
    rows = [e for e in plan.system.equations if e.form is Form.PLAIN and e.constraint is not None]
    fit = PartFit(
        plan, [None] * len(plan.system.unknowns), [np.zeros(1)], as_drawn(plan.system.scene), plan.bodies, rows, about
    )
    turn, middle = cmath.exp(1j * math.radians(degrees)), complex(*plan.system.shift)
    way = place + (turn - 1) * middle  # a pose is measured from there
    lie = RigidMotion(math.radians(degrees), way.real, way.imag)
    assert fit.is_met_by(lie)
    assert not fit.is_met_by(replace(lie, x=lie.x + 0.01))
    assert not fit.is_met_by(replace(lie, turn=lie.turn + 0.001))
    found = fit.best()
    assert found is not None
    assert math.remainder(found.turn - lie.turn, 2 * math.pi) == pytest.approx(0.0, abs=1e-7)
    assert (found.x, found.y) == pytest.approx((lie.x, lie.y), abs=1e-5)


def test_of_two_places_the_one_that_an_inequality_allows():
    """B.P lies on y = 20: above the pin to the right or to the left."""
    for sign, side in ((">", 1), ("<", -1)):
        text = TRIANGLE.format(a=40, b=30, more=f"A.P = [0, 0]; B.P.y = 20; B.P.x {sign} 0;")
        plan = plan_of(text)
        carry = as_drawn(plan.system.scene)
        moved = place_parts(plan, ConnectedParts.of(plan), [None] * len(plan.system.unknowns), [np.zeros(2)], carry)
        pose = moved.now.things[0]
        assert complex(pose.c, pose.s) == pytest.approx(complex(side * math.sqrt(0.75), 0.5), abs=1e-9)


# --- contacts

ROUND = """.config(10); Round : .curve O = [0, 0] .param(u, [20 + 30*.cos(u), 30*.sin(u) - 10]);
Pin : .bar A = [50, 0] B = A + [5, 0];
@0 Round.O = [0, 0]; Round.angle = 0; .on(Pin.A, Round) = 3; Pin.A.x = 5; Pin.angle = 0; @1
"""


@pytest.mark.parametrize("angle", [0.0, 100.0, 280.0])
def test_a_contact_elsewhere_than_the_nearest_is_misplaced(angle):
    """Across the circle's edge, a point at 33 from the centre is 33 cos(d) - 30 from a place that is d beside."""
    plan = plan_of(ROUND)
    (n,) = [u.number for u in plan.system.unknowns if isinstance(u.payload, ContactPlace)]
    outline = plan.system.unknowns[n].payload.touch.outline
    base = Snapshot((BodyPose(), posed(20 - 10j + 33 * cmath.exp(1j * math.radians(angle)) - 50, 0.0)))
    nearest = replace(as_drawn(plan.system.scene).now, things=base.things).value(plan.system, n)
    assert nearest is not None
    edge = math.degrees(math.acos(1.0 - PLACED_ELSEWHERE * outline.size / 33.0))
    for shift, count in ((0.0, 0), (0.95 * edge, 0), (1.05 * edge, 1), (-1.05 * edge, 1), (120.0, 1), (180.0, 1)):
        state: list = [None] * len(plan.system.unknowns)
        state[n] = np.array([nearest + shift * outline.period / 360.0, 0.0])
        assert misplaced_contacts(plan, state, base, [n], Fraction(0)) == count
        assert misplaced_contacts(plan, state, base, [], Fraction(0)) == 0


OVALS = """.config(10); One : .curve O = [0, 0] .param(u, [60*.cos(u), 30*.sin(u)]);
Other : .curve O = [0, 0] .param(u, [40*.cos(u), 20*.sin(u)]);
@0 One.O = [0, 0]; One.angle = 0; .gap(One, Other) = 0; Other.O.y = 0; Other.angle = 0; @1
"""


@pytest.mark.parametrize("turn", [0.0, 90.0])
@pytest.mark.parametrize("gap", [0.0, 7.0])
def test_two_outlines_touch_where_they_face_each_other(turn, gap):
    """An ellipse beside another, its long or its short axis towards it."""
    plan = plan_of(OVALS)
    half = 40.0 if turn == 0.0 else 20.0
    base = Snapshot((BodyPose(), posed(complex(60 + half + gap, 0), turn)))
    found = {u.payload.touch.which: u.number for u in plan.system.unknowns if isinstance(u.payload, ContactPlace)}
    assert sorted(found) == [0, 1]
    for one, other, count in (
        (0.0, 180.0 - turn, 0), (180.0, 180.0 - turn, 1), (0.0, -turn, 1), (90.0, 90.0 - turn, 1),
    ):  # fmt: skip
        state: list = [None] * len(plan.system.unknowns)
        for which, value in ((0, one), (1, other)):
            outline = plan.system.unknowns[found[which]].payload.touch.outline
            state[found[which]] = np.array([value * outline.period / 360.0, 0.0])
        assert misplaced_contacts(plan, state, base, found.values(), Fraction(0)) == count
