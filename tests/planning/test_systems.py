"""Frames, lowered systems and their groups: against rigid motions, ranks of Jacobians, and matchings of networkx."""

from __future__ import annotations

import math
from types import SimpleNamespace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.expressions import ONE, add, const, mul, neg, sub, symbol
from movimentum.planning.inequality_reuse import introduced_by_inequalities, with_inequalities_of
from movimentum.planning.lowering.body_frames import BodyFrame, body_frames, scene_shift, with_constants_gathered
from movimentum.planning.lowering.equations import Equation, System
from movimentum.planning.lowering.polynomial import to_expression
from movimentum.planning.lowering.system import build_system, lowered_expressions, with_rates, with_rigidity
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, Rate
from movimentum.planning.planner import structure_of
from movimentum.planning.structure.decompose import decompose, driven_angles
from movimentum.scene.model import AnchorCoordinate, ThingAngle
from movimentum.timeline.arrange import arrange
from tests.planning.exact import OPERATIONS, valued
from tests.understand import scene_of

OPERATIONS.setdefault("tand", lambda a: math.tan(math.radians(a)))

# --- frames


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_a_frame_is_a_rigid_motion_that_brings_its_anchors_to_its_axis(scale):
    random = np.random.default_rng(3)
    for _ in range(5):
        p = (scale * random.normal(size=(3, 2))).tolist()
        scene = scene_of(
            f"A : .bar P = [{p[0][0]!r},{p[0][1]!r}] Q = [{p[1][0]!r},{p[1][1]!r}] R = [{p[2][0]!r},{p[2][1]!r}];"
            "B : .bar S = [0,0] T = [5,0]; @0 A.R = [3,4]; A.P = B.T; B.S = [0,0]; @1"
        )
        frame = body_frames(scene, arrange(scene).segments[0], {})[0]
        own = {anchor.name: anchor.local for anchor in scene.things[0].anchors}
        stated = {anchor.name: anchor.coordinates for anchor in scene.things[0].anchors}
        # its origin is the first anchor that an equation names on its own, its axis goes through the next one named so
        assert frame.origin == own["R"]
        assert frame.local(own["R"]) == (0.0, 0.0)
        long = math.dist(own["P"], own["R"])
        assert frame.local(own["P"]) == pytest.approx((long, 0.0), abs=1e-12 * scale)
        assert frame.distance.value == pytest.approx(long, rel=1e-12)
        assert frame.turned
        q, r = np.array(own["Q"]), np.array(own["R"])
        axis = (np.array(own["P"]) - r) / long
        truth = (q - r) @ axis, axis[0] * (q - r)[1] - axis[1] * (q - r)[0]
        assert frame.local(own["Q"]) == pytest.approx(truth, abs=1e-12 * scale)
        assert [each.value for each in frame.stated(stated["Q"], own["Q"])] == pytest.approx(truth, abs=1e-12 * scale)
        assert frame.stated(stated["R"], own["R"]) == (const(0.0), const(0.0))
        assert frame.stated(stated["P"], own["P"])[0].value == frame.distance.value
        # turned by a, the frame points by a more than the axis does in the drawing
        for a in (0.3, -2.0):
            lean = math.atan2(axis[1], axis[0]) + a
            c, s = math.cos(lean), math.sin(lean)
            assert frame.to_thing(c, s) == pytest.approx((math.cos(a), math.sin(a)), abs=1e-12)
            turned = frame.turn_of(symbol("c"), symbol("s"))
            assert [valued(each, {"c": c, "s": s}) for each in turned] == pytest.approx((math.cos(a), math.sin(a)))
            there = frame.to_thing(c, s, axis=(axis[0], axis[1]))
            assert there == pytest.approx((math.cos(a), math.sin(a)), abs=1e-12)
    plain = BodyFrame((2.0, 3.0))
    assert not plain.turned
    assert plain.local((5.0, 7.0)) == (3.0, 4.0)
    assert plain.to_thing(0.6, 0.8) == (0.6, 0.8)


def test_a_thing_whose_angle_is_stated_keeps_its_direction():
    scene = scene_of("A : .bar P = [1,2] Q = [4,6]; @0 A.P = [0,0]; A.angle = 30; @1")
    frame = body_frames(scene, arrange(scene).segments[0], {})[0]
    assert not frame.turned
    assert frame.origin == (1.0, 2.0)


@pytest.mark.parametrize(("far", "shifted"), [(0.0, False), (9e3, False), (2e4, True), (1e11, True)])
def test_a_scene_far_from_the_origin_is_shifted_there(far, shifted):
    at = f"[{far!r},{-far!r}]"
    scene = scene_of(f"A : .bar P = [0,0] Q = [10,0]; @0 A.P = {at}; A.Q.y = {-far!r}; @1")
    assert scene_shift(scene) == ((far, -far) if shifted else (0.0, 0.0))


@settings(max_examples=40)
@given(st.lists(st.integers(-50, 50), min_size=3, max_size=6), st.integers(-3, 3))
def test_gathered_sums_are_the_same_and_a_shift_cancels_exactly(numbers, factor):
    shift = const(1e17)
    total = symbol(0)
    for k, number in enumerate(numbers):
        total = (
            add(total, const(float(number))) if k % 2 else sub(mul(const(float(factor)), total), const(float(number)))
        )
    values = {0: 0.75}
    assert valued(with_constants_gathered(total), values) == pytest.approx(valued(total, values), rel=1e-12, abs=1e-9)
    moved = sub(add(symbol(0), shift), add(const(60.0), shift))
    assert valued(with_constants_gathered(moved), values) == -59.25  # which floats make 0 of, or -64
    twice = add(mul(const(2.0), add(symbol(0), shift)), neg(mul(shift, const(2.0))))
    assert valued(with_constants_gathered(twice), values) == 1.5


# --- systems


THINGS = """
    Crank : .bar O = [0,0] P = [30,10];   Rod : .bar A = [30,10] B = [100,40] C = [60,60];
    Rock : .bar D = [120,0] B = [100,40];
"""
LOOP = "Crank.O = [0,0]; Rod.A = Crank.P; Rock.D = [120,0]; Rock.B = Rod.B; "
FRAME = f"""{THINGS}
    Wheel : .gear(20,2) C = [200,0];   Pinion : .gear(10,2) C = [230,0];
    @0 {LOOP} Crank.angle = 90*.t + 5; h = Rod.C.y*2 + 1; Wheel.C = [200,0]; Wheel.angle = h; Pinion.C = [230,0];
       .mesh(Wheel, Pinion) = 0;
    @1
"""


def posed(system, places, turns):
    """The values of unknowns where things are: (x, y) of their local origin as drawn and turns, both by thing."""
    values = {}
    for unknown in system.unknowns:
        payload = unknown.payload
        if isinstance(payload, PoseX | PoseY | PoseCos | PoseSin):
            frame, (x, y), a = system.frame(payload.thing), places[payload.thing], turns[payload.thing]
            c, s = math.cos(math.radians(a)), math.sin(math.radians(a))
            (ox, oy), (ux, uy) = frame.origin, frame.axis
            found = {
                PoseX: x + c * ox - s * oy - system.shift[0],
                PoseY: y + s * ox + c * oy - system.shift[1],
                PoseCos: c * ux - s * uy,
                PoseSin: s * ux + c * uy,
            }
            values[unknown.number] = found[type(payload)]
        elif isinstance(payload, ThingAngle):
            values[unknown.number] = turns[payload.thing]
    return values


def system_of(text):
    scene = scene_of(text)
    return build_system(scene, arrange(scene).segments[0], {})


@pytest.mark.parametrize("offset", [0.0, 1e9])
def test_lowered_expressions_are_those_of_the_scene_at_any_pose(offset):
    random = np.random.default_rng(1)
    text = f"{THINGS} @0 {LOOP} @1".replace("[0,0]; Rod.A", f"[{offset!r},0]; Rod.A")
    system = with_rigidity(
        system_of(text.replace("D = [120,0]; Rock.B", f"D = [{120 + offset!r},0]; Rock.B")), frozenset()
    )
    assert system.shift[0] == (0.0 if offset == 0.0 else pytest.approx(offset + 120.0))
    things = system.scene.things
    places = {t: (offset + random.normal() * 50.0, random.normal() * 50.0) for t in range(3)}
    turns = {t: random.normal() * 100.0 for t in range(3)}
    values = posed(system, places, turns)
    for t in range(3):
        for n, anchor in enumerate(things[t].anchors):
            c, s = math.cos(math.radians(turns[t])), math.sin(math.radians(turns[t]))
            x, y = anchor.local
            truth = places[t][0] + c * x - s * y, places[t][1] + s * x + c * y
            found = lowered_expressions(system, [symbol(AnchorCoordinate(t, n, axis)) for axis in (0, 1)])
            assert [valued(each, values) for each in found] == pytest.approx(truth, abs=1e-12 * max(offset, 100.0))
            apart = sub(symbol(AnchorCoordinate(t, n, 0)), symbol(AnchorCoordinate(0, 0, 0)))
            (own,) = lowered_expressions(system, [apart])
            first = lowered_expressions(system, [symbol(AnchorCoordinate(0, 0, 0))])
            assert valued(own, values) == pytest.approx(truth[0] - valued(first[0], values), abs=1e-6)
    other = system_of("A : .bar P = [0,0] Q = [1,0]; B : .bar P = [0,0] Q = [1,0]; @0 A.P = [0,0]; @1")
    with pytest.raises(KeyError):
        lowered_expressions(other, [symbol(AnchorCoordinate(1, 0, 0))])
    with pytest.raises(ValueError, match=r"B.angle"):
        lowered_expressions(other, [symbol(ThingAngle(1))])


def jacobian(system, values):
    """By differences, and the residuals."""

    def at(now):
        return np.array([valued(e.residual, now, float) for e in system.equations if e.form == "plain"])

    rows = []
    for n in sorted(values):
        ahead, back = (at({**values, n: values[n] + h}) for h in (1e-6, -1e-6))
        rows.append((ahead - back) / 2e-6)
    return at(values), np.array(rows).T


def test_a_four_bar_that_is_closed_satisfies_all_rows_and_has_no_freedom():
    text = f"{THINGS} @0 {LOOP} Crank.angle = 0; @1"
    system = with_rigidity(system_of(text), frozenset({0}))
    values = posed(system, dict.fromkeys(range(3), (0.0, 0.0)), dict.fromkeys(range(3), 0.0))  # as it is drawn
    residual, rows = jacobian(system, values)
    assert residual == pytest.approx(np.zeros(len(residual)), abs=1e-9)
    directions = [
        n for n, u in enumerate(system.unknowns) if not isinstance(u.payload, ThingAngle) or u.payload.thing == 0
    ]
    assert np.linalg.matrix_rank(rows[:, directions], tol=1e-4) == len(directions)
    # without the drive there is one motion
    free = with_rigidity(system_of(text.replace("Crank.angle = 0;", "")), frozenset())
    values = posed(free, dict.fromkeys(range(3), (0.0, 0.0)), dict.fromkeys(range(3), 0.0))
    residual, rows = jacobian(free, values)
    assert residual == pytest.approx(np.zeros(len(residual)), abs=1e-9)
    directions = [n for n, u in enumerate(free.unknowns) if not isinstance(u.payload, ThingAngle)]
    assert np.linalg.matrix_rank(rows[:, directions], tol=1e-4) == len(directions) - 1


def test_what_keeps_a_thing_rigid_holds_in_every_pose():
    random = np.random.default_rng(4)
    base = system_of(f"{THINGS} @0 {LOOP} Crank.angle = 0; @1")
    for driven in (frozenset(), frozenset({0})):
        system = with_rigidity(base, driven)
        turns = {t: random.normal() * 100.0 for t in range(3)}
        values = posed(system, {t: tuple(random.normal(size=2) * 90.0) for t in range(3)}, turns)
        own = system.equations[len(base.equations) :]
        assert len(own) == 6
        for each in own:
            off = valued(each.residual, values)
            assert off - 360.0 * round(off / 360.0) == pytest.approx(0.0, abs=1e-9)
            # and it is about this thing, and no more: turned farther than it says, it does not hold
            assert {system.unknowns[n].thing for n in each.unknowns} == {each.thing}
            (n, *_) = each.targets
            assert abs(valued(each.residual, {**values, n: values[n] + 0.1})) > 1e-3


def test_what_cancels_in_a_row_is_no_unknown_of_it():
    system = system_of("@0 x + y - y = 3; z*(x + 1) - z*x = y; @1")
    names = [{system.unknowns[n].name for n in each.unknowns} for each in system.equations]
    assert names == [{"x"}, {"z", "y"}]


def test_rates_are_the_derivatives_of_rows_along_a_motion():
    """Of a bar that turns about a pin and slides on a line: by differences along its motion."""
    system = system_of(
        "B : .bar P = [0,0] Q = [30,40]; @0 B.P.y = 0; B.Q.x = 20*.t^2 + .sin(50*.t); x = B.P.x*B.Q.y; @1"
    )
    full = with_rates(with_rigidity(system, frozenset()), range(len(system.equations)), ())
    more = full.equations[len(with_rigidity(system, frozenset()).equations) :]
    assert len(more) == len(system.equations)

    def unknowns(t):
        return {n: math.sin(1.3 * n + 2.0 * t) for n, u in enumerate(full.unknowns) if not isinstance(u.payload, Rate)}

    def of(root, values, t):
        memo = {"clock": t}

        def go(node):
            if node.op == "clock":
                return memo["clock"]
            if node.op == "const":
                return node.payload
            if node.op == "symbol":
                return values[node.payload]
            if node.op == "pow":
                return go(node.args[0]) ** node.payload
            return OPERATIONS[node.op](*map(go, node.args))

        return go(root)

    t, h = 0.37, 1e-5
    ahead, back = unknowns(t + h), unknowns(t - h)
    values = unknowns(t)
    values |= {
        n: (ahead[u.payload.of] - back[u.payload.of]) / (2 * h)
        for n, u in enumerate(full.unknowns)
        if isinstance(u.payload, Rate)
    }
    for stated, derived in zip(system.equations, more, strict=True):
        truth = (of(stated.residual, ahead, t + h) - of(stated.residual, back, t - h)) / (2 * h)
        assert of(derived.residual, values, t) == pytest.approx(truth, rel=1e-5, abs=1e-5)
        assert all(isinstance(full.unknowns[n].payload, Rate) for n in derived.targets)


# --- groups


ROWS = st.integers(1, 9).flatmap(
    lambda columns: st.lists(
        st.lists(st.integers(0, columns - 1), min_size=1, max_size=4, unique=True), min_size=1, max_size=9
    ).map(lambda rows: (rows, columns))
)


@settings(max_examples=60)
@given(ROWS)
def test_groups_are_those_of_dulmage_and_mendelsohn(case):
    """What alternating paths from unmatched unknowns reach is free; the rest are strong components, in order."""
    rows, columns = case
    equations = []
    for i, row in enumerate(rows):
        # squares, so that no row gives an unknown by itself: nothing only hangs from what is free
        form = {(n, n): ONE for n in row} | {(): const(-1.0)}
        equations.append(
            Equation(i, to_expression(form), frozenset(row), tuple(sorted(row)), polynomial=form, constraint=0)
        )
    unknowns = tuple(SimpleNamespace(payload=f"v{n}", number=n, name=f"v{n}", thing=None) for n in range(columns))
    system = System(None, SimpleNamespace(active=()), unknowns, tuple(equations), (), (), {}, {})  # type: ignore[arg-type]
    found = decompose(system)
    graph = nx.Graph()
    graph.add_nodes_from([("r", i) for i in range(len(rows))])
    graph.add_nodes_from([("c", n) for n in range(columns)])
    graph.add_edges_from((("r", i), ("c", n)) for i, row in enumerate(rows) for n in row)
    matching = nx.bipartite.maximum_matching(graph, top_nodes=[("r", i) for i in range(len(rows))])
    loose, stack = set(), [("c", n) for n in range(columns) if ("c", n) not in matching]
    while stack:
        column = stack.pop()
        if column not in loose:
            loose.add(column)
            stack += [matching[row] for row in graph[column] if row in matching]
    free = {n for _, n in loose}
    assert {n for group in found.groups if group.free for n in group.unknowns} == free
    matched = sum(node[0] == "r" for node in matching)
    assert len(found.checks) == len(rows) - matched
    every = sorted(n for group in found.groups for n in group.unknowns)
    assert every == list(range(columns))
    used = sorted([*found.checks, *(e for group in found.groups for e in group.equations)])
    assert used == list(range(len(rows)))
    known: set[int] = set()
    for group in (group for group in found.groups if not group.free):
        assert len(group.unknowns) == len(group.equations)
        reads = {n for e in group.equations for n in rows[e]} - set(group.unknowns)
        assert reads <= known  # each is found from those before it
        known |= set(group.unknowns)
        part = graph.subgraph([*(("c", n) for n in group.unknowns), *(("r", e) for e in group.equations)])
        assert nx.is_connected(part)
    for group in (group for group in found.groups if group.free):
        assert len(group.unknowns) > len(group.equations)


def test_angles_are_driven_where_something_gives_them():
    scene = scene_of(FRAME)
    base = build_system(scene, arrange(scene).segments[0], {})
    assert driven_angles(base, with_rigidity) == {0, 3, 4}  # the crank, the wheel by a height, the pinion by the wheel
    structure = structure_of(scene, arrange(scene).segments[0], {})
    assert not structure.decomposition.checks
    assert not any(group.free for group in structure.decomposition.groups)


# --- what differs by inequalities only


def test_a_segment_with_other_inequalities_has_the_same_equations():
    text = "B : .bar P = [0,0] Q = [30,40]; @0 B.P = [0,0]; B.Q.y = 10 + .t; B.Q.x {} 0; {} @1"
    one, other, wider = (scene_of(text.format(*each)) for each in ((">", ""), ("<", ""), (">", "n < 3;")))
    segments = [arrange(scene).segments[0] for scene in (one, other, wider)]
    first = structure_of(one, segments[0], {})
    again = with_inequalities_of(first, other, segments[1])
    assert again is not None
    fresh = structure_of(other, segments[1], {})
    assert [e.residual for e in again.system.equations] == [e.residual for e in fresh.system.equations]
    assert [s.value for s in again.system.selectors] == [s.value for s in fresh.system.selectors]
    assert [s.value for s in again.system.selectors] != [s.value for s in first.system.selectors]
    assert again.system.scene is other
    assert again.system.segment is segments[1]
    frames = body_frames(one, segments[0], {})
    assert (
        introduced_by_inequalities(one, segments[0], frames)
        == introduced_by_inequalities(other, segments[1], frames)
        == ()
    )
    ((count, _),) = introduced_by_inequalities(wider, segments[2], frames)
    assert count == 2
    assert with_inequalities_of(first, wider, segments[2]) is None  # what it mentions is an unknown
    squared = scene_of(text.format(">", "B.Q.y*B.Q.y < n + B.Q.y;"))
    assert len(introduced_by_inequalities(squared, arrange(squared).segments[0], frames)) == 1
    # an inequality that comes first changes the numbers of all statements
    before = scene_of("B : .bar P = [0,0] Q = [30,40]; @0 B.Q.x > 0; B.P = [0,0]; B.Q.y = 10 + .t; @1")
    segment = arrange(before).segments[0]
    again, fresh = with_inequalities_of(first, before, segment), structure_of(before, segment, {})
    assert again is not None
    assert [e.constraint for e in again.system.equations] == [e.constraint for e in fresh.system.equations]
    assert [e.constraint for e in again.system.equations] != [e.constraint for e in first.system.equations]


def test_what_only_measures_a_free_motion_comes_after_it_and_has_no_say_in_it():
    text = "B : .bar P = [0,0] Q = [30,40]; @0 {} h = B.Q.y*2 + 1; g = h^2; far = B.P.x + k; k = 3*h; B.P.y = 5; @1"
    for stated, free in (("", True), ("B.Q = [30,45];", False)):
        scene = scene_of(text.format(stated))
        structure = structure_of(scene, arrange(scene).segments[0], {})
        names = [
            {structure.system.unknowns[n].name for n in group.unknowns} for group in structure.decomposition.groups
        ]
        moving = [own for own, group in zip(names, structure.decomposition.groups, strict=True) if group.free]
        assert bool(moving) == free
        if free:
            (own,) = moving
            assert own == {"B.x", "B.cos", "B.sin"}
            order = [name for own in names for name in sorted(own)]
            assert order.index("B.x") < order.index("h") < order.index("k") < order.index("far")
        for each in ("h", "g", "k", "far"):
            assert {each} in names
