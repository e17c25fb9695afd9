"""Where paths begin: costs, rigid motions, order, choice and refusal, each against a planted or enumerated truth."""

from __future__ import annotations

import cmath
import math
from fractions import Fraction
from itertools import product

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.planning.planner import structure_of
from movimentum.records import replace
from movimentum.scene.leaves import ContactPlace
from movimentum.scene.model import VariableComponent
from movimentum.solver.assembly import placements
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.basis.pose_state import Carry, Snapshot, as_drawn
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.path.follow import follow, instant
from movimentum.solver.segment_motion import FailureKind
from movimentum.solver.start.candidates import (
    Candidate,
    decided_by,
    distinct,
    mirrored_settled,
    same_pose,
    solving_order,
    touching_first,
)
from movimentum.solver.start.costs import Measures, pair, squared
from movimentum.solver.start.judgements import Judgements, Rejection
from movimentum.solver.start.misplaced import misplaced
from movimentum.solver.start.mobile_groups import mobile_groups
from movimentum.solver.start.part_fit import AboutThings, Lie, PartFit
from movimentum.solver.start.placement import Parts, connected_parts, placed, rigid_motion, rigid_motions
from movimentum.solver.start.search import REMEMBERED, REMEMBERED_EACH, StartSearch, select
from movimentum.solver.start.violations import first_disagreement, first_violation
from movimentum.timeline.arrange import arrange
from movimentum.tolerances import INEQUALITY_MET, LOOK_AHEAD, PLACED_ELSEWHERE, SAME_VALUE, SPELLING_WEIGHT
from tests.solver.scenes import motion_of, plan_of, scene_of, unknown


def posed(place: complex, degrees: float) -> BodyPose:
    way = cmath.exp(1j * math.radians(degrees))
    return BodyPose(place.real, place.imag, way.real, way.imag, degrees)


def numbers(statements: str, end: float = 1) -> str:
    """A script about variables."""
    return f".config(10, 100, 100); Bar : .bar A = [0, 0] B = A + [100, 0];\n@0 {statements} @{end}"


# --- costs

ARMS = """.config(10); A : .bar P = [3, 4] Q = P + [5, 12]; B : .bar P = [30, 4] Q = P + [0, 20];
@0 A.P = [1, 2]; A.Q.x = 4 + x; B.P = A.Q; B.Q.y = 3; x = 0; @1
"""


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
    carry = Carry(Snapshot(before, known=frozenset({0, 1}) if known else frozenset()))
    found = Measures(plan, carry, 0.1).distances(unknowns, state_of(plan, poses))
    turns = [math.radians(degrees) for degrees in (first, second)]
    moved = sum((isinstance(plan.system.unknowns[n].payload, PoseX)) for n in unknowns) * (away / plan.size) ** 2
    chords = sum(4 * math.sin(turn / 2) ** 2 for turn in turns)
    exact = (chords + moved, 0.0, 0.0) if known else (0.0, sum(turn**2 for turn in turns), moved)
    assert found == pytest.approx(exact, abs=1e-6)


def test_spelled_values_count_by_their_size():
    plan = plan_of(ARMS.replace("x = 0;", "x = 0; a = A.angle; b = B.angle;"))
    measures = Measures(plan, as_drawn(plan.system.scene), 0.1)
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

    def broken(carry: Carry, value: float, rate: float) -> float:
        state[x] = np.array([value, value + rate * ahead])
        return Measures(plan, carry, ahead).break_of(block, state)

    moving = Carry(now, before, 0.5)
    assert broken(Carry(Snapshot(poses)), 99.0, 0.0) == 0.0  # nothing is carried over
    assert broken(moving, 8.0, speed) == pytest.approx(0.0, abs=1e-12)
    assert broken(moving, 8.1, speed) == 1.0
    assert broken(moving, math.nan, speed) == 1.0
    assert broken(moving, 8.0 + 2.0 * SAME_VALUE * plan.size, speed) == 1.0
    assert broken(moving, 8.0 - 0.5 * SAME_VALUE * plan.size, speed) < 1.0
    for more in (3.0, -50.0):
        assert broken(moving, 8.0, speed + more) == pytest.approx(abs(more) * ahead / plan.size, rel=1e-9)
    assert broken(moving, 8.0, speed + 1e9) == 0.5
    assert broken(Carry(now), 8.0, speed + 50.0) == 0.0  # no velocity is known


def test_a_value_at_two_instants():
    assert pair(3) == (3.0, 3.0)
    assert pair(np.array([4.0])) == (4.0, 4.0)
    assert pair(np.array([4.0, 5.0])) == (4.0, 5.0)
    assert squared(1e200) == math.inf
    assert squared(np.float64(-3.0)) == 9.0


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
    assert rigid_motion([(p, p + 1e-14 * size, 0) for p in points], size) == Lie()
    assert rigid_motion([], size) == Lie()
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
    moved = placed(plan, Parts.of(plan), state, clocks, carry)
    for pose in moved.now.things:
        assert complex(pose.x, pose.y) == pytest.approx(complex(place), abs=1e-7 * size)
        assert complex(pose.c, pose.s) == pytest.approx(complex(turn), abs=1e-9)
        assert math.remainder(pose.angle - degrees, 360.0) == pytest.approx(0.0, abs=1e-7)
    known = replace(carry, now=replace(carry.now, known=frozenset({1})))
    assert placed(plan, Parts.of(plan), state, clocks, known) is known  # what has a pose already is not laid anew


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
    moved = placed(plan, Parts.of(plan), state, [np.zeros(2)] * len(plan.clocks), carry)
    for pose in moved.now.things:
        assert complex(pose.x, pose.y) == pytest.approx(place, abs=1e-6)
        assert complex(pose.c, pose.s) == pytest.approx(turn, abs=1e-9)
        assert math.remainder(pose.angle - math.degrees(2.0), 360.0) == pytest.approx(0.0, abs=1e-7)


def test_a_part_that_fits_nowhere_stays_as_it_is_drawn():
    plan = plan_of(TRIANGLE.format(a=40, b=30, more="A.P = [0, 0]; B.Q = [90, 0];"))
    carry = as_drawn(plan.system.scene)
    assert placed(plan, Parts.of(plan), [None] * len(plan.system.unknowns), [np.zeros(2)], carry) is carry


def test_only_connected_things_are_one_part():
    more = " ".join(f"{name} : .bar P = [9, 9] Q = P + [1, 0];" for name in "DEF")
    text = TRIANGLE.format(a=40, b=30, more="D.P = E.P; E.angle = 5; F.P = [1, 1];")
    plan = plan_of(text.replace("@0", f"{more} @0"))
    names = {frozenset(plan.system.scene.things[t].name for t in part) for part in connected_parts(plan) if part}
    assert names >= {frozenset("ABC"), frozenset("DE")}
    parts = [{body.thing for body in part} for part in Parts.of(plan).bodies]
    assert sorted(map(sorted, parts)) == [[0, 1, 2], [3, 4]]
    assert [{b.thing for b in part} for part in Parts.of(plan, {4}).bodies] == [{3, 4}]


@pytest.mark.parametrize("seed", range(3))
def test_whether_a_part_meets_its_rows_somewhere(seed):
    rng = np.random.default_rng(seed)
    degrees, place = float(rng.uniform(-170, 170)), complex(*rng.uniform(-300, 300, 2))
    far = place + cmath.exp(1j * math.radians(degrees)) * complex(40, 30)
    pins = f"A.P = [{place.real!r}, {place.imag!r}]; B.Q = [{far.real!r}, {far.imag!r}];"
    plan = plan_of(TRIANGLE.format(a=40, b=30, more=pins))
    about = AboutThings.of(plan.system)
    rows = [e for e in plan.system.equations if e.form is Form.PLAIN and e.constraint is not None]
    fit = PartFit(
        plan, [None] * len(plan.system.unknowns), [np.zeros(1)], as_drawn(plan.system.scene), plan.bodies, rows, about
    )
    turn, middle = cmath.exp(1j * math.radians(degrees)), complex(*plan.system.shift)
    way = place + (turn - 1) * middle  # a pose is measured from there
    lie = Lie(math.radians(degrees), way.real, way.imag)
    assert fit.meets(lie)
    assert not fit.meets(replace(lie, x=lie.x + 0.01))
    assert not fit.meets(replace(lie, turn=lie.turn + 0.001))
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
        moved = placed(plan, Parts.of(plan), [None] * len(plan.system.unknowns), [np.zeros(2)], carry)
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
        assert misplaced(plan, state, base, [n], Fraction(0)) == count
        assert misplaced(plan, state, base, [], Fraction(0)) == 0


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
        assert misplaced(plan, state, base, found.values(), Fraction(0)) == count


# --- judgements


def judged(statements: str, name: str = "x") -> tuple[Judgements, int, int]:
    plan = plan_of(numbers(statements))
    owner = dict(plan.owner)
    judgements = Judgements(plan, [None] * len(plan.system.unknowns), [np.zeros(2)] * len(plan.clocks), owner)
    judgements.placed_after([False] * len(plan.blocks), list(range(len(plan.blocks))))
    number = unknown(plan, name)
    return judgements, number, owner[number]


@pytest.mark.parametrize(
    ("sign", "now", "later", "good"),
    [(">", 3, 3, True), (">", 1.9, 3, False), (">", 2, 2, False), (">", 2, 2.1, True), (">", 2, 1.9, False),
     (">=", 2, 2, True), (">=", 2, 1.9, False), (">=", 1.9, 2, False), ("<", 1, 1, True), ("<", 2, 2, False),
     ("<=", 2, 2, True), ("<=", 2.1, 2, False), ("<", math.nan, 1, False)],
)  # fmt: skip
def test_inequalities_are_judged_now_and_a_little_later(sign, now, later, good):
    judgements, x, block = judged(f"x = .t; x {sign} 2;")
    judgements.state[x] = np.array([now, later], dtype=np.float64)
    refused = judgements.refused(block)
    assert (refused is None) is good
    assert judgements.decisive == (set() if good else {0})
    if refused is not None and math.isfinite(now):
        assert refused.amount == pytest.approx(2 - now if "<" in sign else now - 2)
        assert judgements.read_by(refused) == {x}
    assert judgements.refused(-1) is None


def test_what_is_just_met_is_met():
    judgements, x, block = judged("x = .t; x > 2;")
    size = judgements.plan.size
    for off, good in ((-0.5, True), (-2.0, False)):
        judgements.state[x] = np.array([2 + off * INEQUALITY_MET * size, 3.0])
        assert (judgements.refused(block) is None) is good


def test_redundant_equations_and_wishes_are_judged():
    judgements, x, block = judged("x = 3; x = 3*.cos(0*.t); y = 2*.t; x + y ~ 13; x ~ 5;")
    plan = judgements.plan
    y = unknown(plan, "y")
    judgements.state[x], judgements.state[y] = np.array([3.0, 3.0]), np.array([4.0, 4.0])
    (last,) = {owner for n, owner in judgements.owner.items() if n == y}
    total = sum(judgements.wished(number) for number in {block, last})
    assert total == pytest.approx(((7 - 13) ** 2 + (3 - 5) ** 2) / plan.size**2)
    assert any(judgements.wishes_await(number) for number in (block, last))
    if plan.checks:
        for value, good in ((3.0, True), (3.0 + 1e-10, True), (3.001, False), (math.inf, False)):
            judgements.state[x] = np.array([value, value])
            refused = judgements.refused(block)
            assert (refused is None) is good
            assert refused is None or (refused.check is not None and judgements.read_by(refused) == {x})


# --- candidates


def candidate(*cost: float, values: dict | None = None, later: dict | None = None, wrong: int = 0) -> Candidate:
    values = values or {}
    return Candidate({}, values, later or dict(values), tuple([*cost, 0.0, 0.0, 0.0, 0.0, 0.0][:5]), wrong)


@pytest.mark.parametrize(
    ("first", "second", "name"),
    [((0, 1, 2), (1, 0, 0), "continuity"), ((0, 1, 2), (0, 2, 0), "wish"), ((0, 1, 2), (0, 1, 3), "carried"),
     ((0, 1, 2, 0), (0, 1, 2, 5), "drawn"), ((1, 1, 1), (1 + 1e-12, 1, 2), "carried")],
)  # fmt: skip
def test_what_decided(first, second, name):
    assert decided_by([candidate(*first), candidate(*second)]) == name
    assert decided_by([candidate(*first)]) == "only"


def test_contacts_at_the_nearest_places_come_first_after_continuity():
    a, b, c = candidate(0, 5), candidate(0, 1, wrong=1), candidate(1, 0)
    assert touching_first([c, b, a]) == [a, c]
    assert touching_first([candidate(1, 0), d := candidate(0, 9, wrong=2), e := candidate(1, 1, wrong=2)])[0] is d
    assert touching_first([e, d]) == [d, e]


def test_candidates_that_differ_in_nothing_visible_are_one():
    plan = plan_of(numbers("x*x = 4; y = _; y*y = x + 9; Bar.A = [0, 0]; Bar.angle = 0;"))
    x = unknown(plan, "x")
    hidden = [u.number for u in plan.system.unknowns if u.name.startswith("_")]
    values = {x: 2.0, **dict.fromkeys(hidden, 1.0)}
    one = candidate(0, 0, 1, values=values)
    same = candidate(0, 0, 2, values={**values, **dict.fromkeys(hidden, -1.0)})
    leaves = candidate(0, 0, 3, values=values, later={**values, x: 2.1})
    other = candidate(0, 0, 4, values={**values, x: -2.0})
    assert distinct(plan, [other, same, one, leaves]) == [one, leaves, other]
    assert same_pose(plan, one, same)
    assert same_pose(plan, one, leaves)
    assert not same_pose(plan, one, other)
    nothing = candidate(0, 0, 5, values={**values, x: math.inf})
    assert distinct(plan, [one, nothing]) == [one, nothing]


def test_of_mirrored_paths_the_same_is_first_in_any_order():
    plan = plan_of(ARMS)
    number_of = plan.system.number_of
    c, s = (number_of[part(1)] for part in (PoseCos, PoseSin))
    values = {c: 1.0, s: 0.0}
    left, right = (candidate(0, 0, 0, 1.0, values=values, later={c: 1.0, s: t}) for t in (1e-2, -1e-2))
    assert mirrored_settled(plan, [right, left])[0] is left  # counter-clockwise
    assert mirrored_settled(plan, [left, right])[0] is left
    half = math.sqrt(0.5)
    slanted = {c: half, s: half}
    one, other = (candidate(0, 0, 0, 1.0, values=slanted, later={c: half - t, s: half + t}) for t in (1e-2, -1e-2))
    assert mirrored_settled(plan, [other, one])[0] is one
    farther = candidate(0, 0, 0, 1.5, values=values, later={c: 1.0, s: 1e-2})
    assert mirrored_settled(plan, [right, farther])[0] is right
    elsewhere = candidate(0, 0, 0, 1.0, values={c: 0.6, s: 0.8}, later={c: 0.6, s: 0.9})
    assert mirrored_settled(plan, [right, elsewhere])[0] is right
    wished = candidate(0, 1, 0, 1.0, values=values, later={c: 1.0, s: 1e-2})
    assert mirrored_settled(plan, [right, wished])[0] is right
    x, y = (number_of.get(part(1)) for part in (PoseX, PoseY))
    if x is not None and y is not None:
        spot = {x: 0.0, y: 0.0}
        up, down = (candidate(0, 0, 0, 1.0, values=spot, later={x: 0.0, y: t}) for t in (1.0, -1.0))
        assert mirrored_settled(plan, [down, up])[0] is up


@settings(max_examples=40)
@given(st.lists(st.sets(st.integers(0, 8), max_size=3), min_size=1, max_size=9), st.sets(st.integers(0, 8)))
def test_the_order_of_solving_respects_what_is_needed(reads, branching):
    from types import SimpleNamespace

    count = len(reads)
    blocks = [SimpleNamespace(inputs={n for n in some if n < i}) for i, some in enumerate(reads)]
    rank = solving_order(blocks, {i: i for i in range(count)}, branching)
    assert sorted(rank) == list(range(count))
    order = sorted(range(count), key=rank.__getitem__)
    done: set[int] = set()
    for number in order:
        assert blocks[number].inputs <= done
        if number in branching:  # a choice is made only when nothing else can be solved
            waiting = set(range(count)) - done
            assert all(n in branching or not blocks[n].inputs <= done for n in waiting)
        done.add(number)


# --- search


def chosen(statements: str, **options):
    plan = plan_of(numbers(statements))
    found = select(plan, Fraction(0), 0.0, LOOK_AHEAD, as_drawn(plan.system.scene), {}, **options)
    return plan, found


def values_of(plan, found, names: str) -> list[tuple[float, ...]]:
    """What the candidates say about variables, part by part."""
    ways = [part.candidates for part in found.parts]
    result = []
    for some in product(*ways):
        values: dict = {}
        for each in some:
            values |= each.values
        result.append(tuple(round(values[unknown(plan, name)], 9) for name in names))
    return result


ROOTS = "a*a = 4; b*b = 9; c*c = 25; "


@pytest.mark.parametrize(
    ("more", "parts", "holds"),
    [("", 3, lambda a, b, c: True), ("a*b > 0;", 2, lambda a, b, c: a * b > 0),
     ("a + b > 0; b + c < 0;", 1, lambda a, b, c: a + b > 0 and b + c < 0),
     ("a + b + c = 4;", 1, lambda a, b, c: a + b + c == 4), ("c > 0; b < 0;", 3, lambda a, b, c: c > 0 > b),
     ("d = a*b*c; d > 0;", 1, lambda a, b, c: a * b * c > 0)],
)  # fmt: skip
def test_the_search_finds_all_solutions(more, parts, holds):
    plan, found = chosen(ROOTS + more)
    assert found.choices is not None
    assert len(found.parts) == parts
    assert all(part.complete for part in found.parts)
    exact = [(a, b, c) for a, b, c in product((2, -2), (3, -3), (5, -5)) if holds(a, b, c)]
    assert sorted(values_of(plan, found, "abc")) == sorted(exact)


@pytest.mark.parametrize("target", [(2, 3, -5), (-2, -3, -5), (2, -3, 5)])
def test_wishes_order_what_the_search_finds(target):
    """All of (±2, ±3, ±5) by their distance from the wish."""
    wish = sum(x * w for x, w in zip(target, (1, 10, 100), strict=True))
    plan, found = chosen(ROOTS + f"d = a + 10*b + 100*c; d ~ {wish};")
    (part,) = found.parts
    assert part.decided_by == "wish"
    order = values_of(plan, found, "abc")
    assert order[0] == target
    distances = [abs(a + 10 * b + 100 * c - wish) for a, b, c in order]
    assert distances == sorted(distances)
    for each, distance in zip(part.candidates, distances, strict=True):
        assert each.cost[1] == pytest.approx((distance / plan.size) ** 2)


def test_a_search_tells_what_was_turned_down():
    plan, found = chosen(ROOTS + "a + b + c = 99;")
    assert found.choices is None
    assert {r.amount < 0 or r.check is not None for r in found.rejections} == {True}
    assert found.turned_down
    assert found.tried > 0
    for item in found.turned_down:
        a, b, c = (item.values[unknown(plan, name)] for name in "abc")
        met = [
            abs(a) == pytest.approx(2),
            abs(b) == pytest.approx(3),
            abs(c or 0) == pytest.approx(5),
            a + b + (c or 0) == 99,
        ]
        assert sum(met) == 3  # all but one
    _, found = chosen(ROOTS + "a > 7;")
    assert found.choices is None
    assert found.decisive == {0}
    asked = []
    _, found = chosen(ROOTS + "a + b + c = 99;", doubt=lambda some: asked.append(len(some)) or "never")
    assert found.contradiction == "never"
    assert asked == [len(found.turned_down)]


FOUR_BAR = """.config(10);
A : .bar P = [0, 0] Q = P + [0, 40]; B : .bar P = [0, 40] Q = P + [{b}, 20]; C : .bar P = [100, 0] Q = P + [{c}, 60];
@0 A.P = [0, 0]; A.angle = {angle}; B.P = A.Q; B.Q = C.Q; C.P = [100, 0]; @1
"""


@pytest.mark.parametrize(
    ("b", "c", "angle", "how"),
    [(100, 0, 0, "closed"), (100, 0, 25, "drawn"), (90, 5, 0, "drawn"), (80, -20, 0, "closed")],
)
def test_the_drawing_is_taken_where_it_is_closed(b, c, angle, how):
    """Of both ways to put a four-bar together: the drawing as it stands, else the one that is turned least."""
    plan = plan_of(FOUR_BAR.format(b=b, c=c, angle=angle))
    found = select(plan, Fraction(0), 0.0, LOOK_AHEAD, as_drawn(plan.system.scene), {})
    parts = [part for part in found.parts if len(part.candidates) > 1 or part.decided_by == "closed"]
    assert [part.decided_by for part in parts] == [how]
    crank = 40j * cmath.exp(1j * math.radians(angle))
    rod, rocker = math.hypot(b, 20), math.hypot(c, 60)
    ways = []
    for sign in (1, -1):  # the law of cosines
        base = 100 - crank
        turn = sign * math.acos((rod**2 + abs(base) ** 2 - rocker**2) / (2 * rod * abs(base)))
        joint = crank + rod * base / abs(base) * cmath.exp(1j * turn)
        turns = [cmath.phase((joint - crank) / complex(b, 20)), cmath.phase((joint - 100) / complex(c, 60))]
        ways.append((sum(t * t for t in turns), joint))
    piece = instant(plan, Fraction(0), 0.0, found.choices)
    state, _ = piece.evaluate(piece.instants(np.zeros(1)))
    ((_, pose),) = [each for each in placements(plan, state, as_drawn(plan.system.scene).now) if each[0] == 1]
    x, y = pose.world(float(b), 60.0)
    assert complex(np.ravel(x)[0], np.ravel(y)[0]) == pytest.approx(min(ways)[1], abs=1e-9)


@pytest.mark.parametrize("degrees", [0.0, 40.0, -150.0])
@pytest.mark.parametrize("ahead", [1.0, 1.1])
def test_two_bodies_pinned_as_they_are_drawn_decide_whatever_drives_them(degrees, ahead):
    """A four-bar whose crank begins elsewhere than drawn is laid by its ground; where that is longer, it is not."""
    turn, place = cmath.exp(1j * math.radians(degrees)), complex(70, -20)
    ground = place + 100 * ahead * turn
    text = FOUR_BAR.format(b=100, c=0, angle=degrees + 65)
    text = text.replace("A.P = [0, 0]; A.angle", f"A.P = [{place.real!r}, {place.imag!r}]; A.angle")
    text = text.replace("C.P = [100, 0]; @1", f"C.P = [{ground.real!r}, {ground.imag!r}]; @1")
    plan = plan_of(text)
    state: list = [None] * len(plan.system.unknowns)
    state[unknown(plan, "A.angle")] = degrees + 65
    carry = as_drawn(plan.system.scene)
    moved = placed(plan, Parts.of(plan), state, [np.zeros(2)] * len(plan.clocks), carry)
    exact = (place, turn) if ahead == 1.0 else (0j, 1 + 0j)
    for pose in moved.now.things:
        assert complex(pose.x, pose.y) == pytest.approx(exact[0], abs=1e-9)
        assert complex(pose.c, pose.s) == pytest.approx(exact[1], abs=1e-9)


def test_only_some_poses_are_remembered():
    plan = plan_of(numbers(ROOTS))
    search = StartSearch(
        plan, at_offsets(plan.clocks, Fraction(0), np.array([0.0, 1e-6])), as_drawn(plan.system.scene), 1e-6, {}
    )
    for k in range(100):
        search._remember([Rejection(1.0, check=k % 30), Rejection(1.0, selector=3)])
    assert len(search.turned_down) == REMEMBERED
    search.turned_down.clear()
    search._remember([Rejection(1.0, check=1)] * 50)
    assert len(search.turned_down) == REMEMBERED_EACH
    assert search.begin == 0


# --- first solutions, violations


@pytest.mark.parametrize(
    ("equation", "onset", "off"),
    [*(("x*x = {t}; x > 0;", onset, 1e-9) for onset in (0.3, 1.0, 1.77)),
     *(("(x - 3)*(x - 3) + y*y = 4*{t}; x = y + 3; y > 0;", onset, 1e-9) for onset in (0.5, 1.3)),
     ("x*x*x*x + x*x + 1 = 1 + {t}; x > 0;", 0.1, 1e-6)],
)  # fmt: skip
def test_the_first_solution_is_found_where_it_begins(equation, onset, off):
    motion = motion_of(numbers(equation.format(t=f"(.t - {onset})") + "Bar.A = [x, 0]; Bar.angle = 0;", 2))
    segment = motion.segments[0]
    (trouble,) = segment.troubles
    assert trouble.kind is FailureKind.START
    assert trouble.until == pytest.approx(onset, abs=off)
    assert segment.pieces[-1].end == 2.0
    times = [Fraction(int(1000 * (onset + 0.2)), 1000)]
    poses = motion.poses_at([Fraction(0), *times])
    assert poses.solved.tolist() == [False, True]


def test_what_never_has_a_solution_is_told_for_the_whole_step():
    motion = motion_of(numbers("x*x = .t - 9; Bar.A = [x, 0]; Bar.angle = 0;", 2))
    (trouble,) = motion.segments[0].troubles
    assert (trouble.kind, trouble.until) == (FailureKind.START, 2.0)
    still = motion_of(numbers("x*x = -9; Bar.A = [x, 0]; Bar.angle = 0;", 2))
    assert still.segments[0].troubles[0].until == 2.0


def followed(statements: str, end: float = 2.0):
    plan = plan_of(numbers(statements, end))
    found = select(plan, Fraction(0), 0.0, LOOK_AHEAD, as_drawn(plan.system.scene), {})
    assert found.choices is not None
    piece, gaps = follow(plan, Fraction(0), 0.0, end, found.choices)
    return plan, piece, gaps


@pytest.mark.parametrize(
    ("statements", "number", "time"),
    [("x = .sin(90*.t); x < 0.5;", 0, 1 / 3), ("x = .t; x < 5; x < 1.25;", 1, 1.25),
     ("x = .t; x < 1.5; x < 0.7;", 1, 0.7),
     ("x = .t*.t; x*x < 4;", 0, math.sqrt(2)), ("x = 100*.cos(180*.t); x > -100*.cos(1);", 0, 1 - 1 / 180),
     ("x = .t; x < 9;", None, None), ("x = 1 - .t; x*x >= 0;", None, None), ("x = .t; x <= 2;", None, None)],
)  # fmt: skip
def test_the_first_violation_is_found_where_it_begins(statements, number, time):
    _, piece, _ = followed(statements)
    found = first_violation(piece, 2.0)
    if number is None:
        assert found is None
        return
    assert found is not None
    assert found[0] == number
    assert found[1] == pytest.approx(time, abs=1e-12)
    assert first_violation(piece, time - 1e-3) is None


@pytest.mark.parametrize(("speed", "bound"), [(90, 0.99), (720, 0.5), (720, -0.2), (3000, 0.999)])
def test_of_many_violations_the_first_is_found(speed, bound):
    """sin(v t - 30) leaves the bound for the first time at (asin(bound) + 30) / v, and comes back many times."""
    _, piece, _ = followed(f"x = .sin({speed}*.t - 30); x < {bound}; x > -2;")
    found = first_violation(piece, 2.0)
    assert found is not None
    time = (math.degrees(math.asin(bound)) + 30.0) / speed
    assert found == (0, pytest.approx(time, abs=1e-9 if time > 0 else 1e-6))


@pytest.mark.parametrize("middle", [0.3, 1.234, 1.9])
@pytest.mark.parametrize("width", [1e-2, 3e-4])
def test_a_short_violation_between_nodes_is_found(middle, width):
    """1 - k (t - m)² exceeds a half within ``width`` of m."""
    _, piece, _ = followed(f"x = 1 - {0.5 / width**2}*(.t - {middle})*(.t - {middle}); x < 0.5;")
    found = first_violation(piece, 2.0)
    assert found is not None
    assert found[1] == pytest.approx(middle - width, abs=1e-9)


@pytest.mark.parametrize("time", [0.7, 1.5])
@pytest.mark.parametrize("size", [1.0, 1e3])
def test_a_redundant_equation_holds_until_it_does_not(time, size):
    plan, piece, _ = followed(f"x = {size}*.t; x = {size}*.min(.t, {time});")
    assert plan.checks
    found = first_disagreement(piece, 2.0)
    assert found is not None
    assert found[0] == plan.checks[0]
    assert found[1] == pytest.approx(time, abs=1e-6)
    assert found[1] > time
    assert first_disagreement(piece, time - 0.1) is None
    _, piece, _ = followed(f"x = {size}*.t; x = {size}*.min(.t, 5);")
    assert first_disagreement(piece, 2.0) is None


# --- groups that move although they look determined

CRANKS = """.config(10);
A : .bar P = [0, 0] Q = P + [0, 50]; B : .bar P = [100, 0] Q = P + [0, 50]; C : .bar P = [60, 0] Q = P + [{dx}, {dy}];
Rod : .bar U = [0, 50] V = U + [100, 0] W = U + [{at}, {up}];
@0 A.P = [0, 0]; B.P = [100, 0]; C.P = [60, 0]; Rod.U = A.Q; Rod.V = B.Q; Rod.W = C.Q; @1
"""


def mobile(text: str) -> frozenset[int]:
    scene = scene_of(text)
    structure = structure_of(scene, arrange(scene).segments[0], {})
    return mobile_groups(structure, as_drawn(scene), scene_size(scene))


def test_a_third_parallel_crank_leaves_a_motion():
    assert len(mobile(CRANKS.format(dx=0, dy=50, at=60, up=0))) == 1  # three translations agree
    assert not mobile(CRANKS.format(dx=20, dy=50, at=80, up=0))  # a crank that is not parallel: rigid
    assert not mobile(CRANKS.format(dx=0, dy=40, at=60, up=-10))  # shorter: rigid
    assert not mobile(CRANKS.format(dx=0, dy=50, at=61, up=0))  # not closed as drawn
    moved = CRANKS.format(dx=0, dy=50, at=60, up=0)
    for here, there in (("[0, 0];", "[5, 7];"), ("[100, 0];", "[105, 7];"), ("C.P = [60, 0]", "C.P = [65, 7]")):
        moved = moved.replace(here, there)
    assert len(mobile(moved)) == 1  # pinned elsewhere than it is drawn, as a whole


def test_a_dead_centre_is_no_motion():
    """Two bars in line between fixed points: the rank is lost, and nothing can move."""
    text = """.config(10); A : .bar P = [0, 0] Q = P + [50, 0]; B : .bar P = [50, 0] Q = P + [40, 0];
    @0 A.P = [0, 0]; A.Q = B.P; B.Q = [90, 0]; @1"""
    assert not mobile(text)


def test_parts_that_nothing_ties_are_searched_apart():
    from movimentum.solver.start.late import _connected

    plan = plan_of(numbers("a*a = 4; b = a + 1; c*c = 9; d = c; e*e = 16; e*d > 0; f = 1; f ~ b;"))
    graph = nx.Graph([("a", "b"), ("c", "d"), ("e", "d"), ("f", "b")])
    for name in "abcdef":
        block = plan.owner[unknown(plan, name)]
        found = {
            plan.system.unknowns[n].name for number in _connected(plan, [block]) for n in plan.blocks[number].unknowns
        }
        assert found == nx.node_connected_component(graph, name)
