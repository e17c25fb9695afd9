"""Which beginning is chosen, and what is refused: against all solutions, counted by hand, and known first times."""

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

from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.planning.planner import structure_of
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.path.follow import follow_path, instant_piece
from movimentum.solver.pose_assembly import placements
from movimentum.solver.segment_motion import FailureKind
from movimentum.solver.start.candidates import (
    Candidate,
    decided_by,
    order_by_contacts,
    order_mirrored,
    same_pose,
    solving_order,
    visibly_distinct,
)
from movimentum.solver.start.early_checks import EarlyChecks, Rejection
from movimentum.solver.start.mobile_groups import mobile_groups
from movimentum.solver.start.placement import ConnectedParts, place_parts
from movimentum.solver.start.search import KEPT_POSES, KEPT_POSES_EACH, StartSearch, select
from movimentum.solver.start.violations import first_disagreement, first_violation
from movimentum.timeline.arrange import arrange
from movimentum.tolerances import INEQUALITY_MET, LOOK_AHEAD
from tests.broad import broad
from tests.solver.scenes import ARMS, motion_of, numbers, plan_of, scene_of, unknown

# --- judgements


def judged(statements: str, name: str = "x") -> tuple[EarlyChecks, int, int]:
    plan = plan_of(numbers(statements))
    owner = dict(plan.owner)
    judgements = EarlyChecks(plan, [None] * len(plan.system.unknowns), [np.zeros(2)] * len(plan.clocks), owner)
    judgements.schedule([False] * len(plan.blocks), list(range(len(plan.blocks))))
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
    refused = judgements.rejection(block)
    assert (refused is None) is good
    assert judgements.decisive == (set() if good else {0})
    if refused is not None and math.isfinite(now):
        assert refused.amount == pytest.approx(2 - now if "<" in sign else now - 2)
        assert judgements.unknowns_of(refused) == {x}
    assert judgements.rejection(-1) is None


def test_what_is_just_met_is_met():
    judgements, x, block = judged("x = .t; x > 2;")
    size = judgements.plan.size
    for off, good in ((-0.5, True), (-2.0, False)):
        judgements.state[x] = np.array([2 + off * INEQUALITY_MET * size, 3.0])
        assert (judgements.rejection(block) is None) is good


def test_redundant_equations_and_wishes_are_judged():
    judgements, x, block = judged("x = 3; x = 3*.cos(0*.t); y = 2*.t; x + y ~ 13; x ~ 5;")
    plan = judgements.plan
    y = unknown(plan, "y")
    judgements.state[x], judgements.state[y] = np.array([3.0, 3.0]), np.array([4.0, 4.0])
    (last,) = {owner for n, owner in judgements.owner.items() if n == y}
    total = sum(judgements.wish_cost(number) for number in {block, last})
    assert total == pytest.approx(((7 - 13) ** 2 + (3 - 5) ** 2) / plan.size**2)
    assert any(judgements.has_wishes(number) for number in (block, last))
    if plan.checks:
        for value, good in ((3.0, True), (3.0 + 1e-10, True), (3.001, False), (math.inf, False)):
            judgements.state[x] = np.array([value, value])
            refused = judgements.rejection(block)
            assert (refused is None) is good
            assert refused is None or (refused.check is not None and judgements.unknowns_of(refused) == {x})


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
    assert order_by_contacts([c, b, a]) == [a, c]
    assert order_by_contacts([candidate(1, 0), d := candidate(0, 9, wrong=2), e := candidate(1, 1, wrong=2)])[0] is d
    assert order_by_contacts([e, d]) == [d, e]


def test_candidates_that_differ_in_nothing_visible_are_one():
    plan = plan_of(numbers("x*x = 4; y = _; y*y = x + 9; Bar.A = [0, 0]; Bar.angle = 0;"))
    x = unknown(plan, "x")
    hidden = [u.number for u in plan.system.unknowns if u.name.startswith("_")]
    values = {x: 2.0, **dict.fromkeys(hidden, 1.0)}
    one = candidate(0, 0, 1, values=values)
    same = candidate(0, 0, 2, values={**values, **dict.fromkeys(hidden, -1.0)})
    leaves = candidate(0, 0, 3, values=values, later={**values, x: 2.1})
    other = candidate(0, 0, 4, values={**values, x: -2.0})
    assert visibly_distinct(plan, [other, same, one, leaves]) == [one, leaves, other]
    assert same_pose(plan, one, same)
    assert same_pose(plan, one, leaves)
    assert not same_pose(plan, one, other)
    nothing = candidate(0, 0, 5, values={**values, x: math.inf})
    assert visibly_distinct(plan, [one, nothing]) == [one, nothing]


def test_of_mirrored_paths_the_same_is_first_in_any_order():
    plan = plan_of(ARMS)
    number_of = plan.system.number_of
    c, s = (number_of[part(1)] for part in (PoseCos, PoseSin))
    values = {c: 1.0, s: 0.0}
    left, right = (candidate(0, 0, 0, 1.0, values=values, later={c: 1.0, s: t}) for t in (1e-2, -1e-2))
    assert order_mirrored(plan, [right, left])[0] is left  # counter-clockwise
    assert order_mirrored(plan, [left, right])[0] is left
    half = math.sqrt(0.5)
    slanted = {c: half, s: half}
    one, other = (candidate(0, 0, 0, 1.0, values=slanted, later={c: half - t, s: half + t}) for t in (1e-2, -1e-2))
    assert order_mirrored(plan, [other, one])[0] is one
    farther = candidate(0, 0, 0, 1.5, values=values, later={c: 1.0, s: 1e-2})
    assert order_mirrored(plan, [right, farther])[0] is right
    elsewhere = candidate(0, 0, 0, 1.0, values={c: 0.6, s: 0.8}, later={c: 0.6, s: 0.9})
    assert order_mirrored(plan, [right, elsewhere])[0] is right
    wished = candidate(0, 1, 0, 1.0, values=values, later={c: 1.0, s: 1e-2})
    assert order_mirrored(plan, [right, wished])[0] is right
    x, y = (number_of.get(part(1)) for part in (PoseX, PoseY))
    if x is not None and y is not None:
        spot = {x: 0.0, y: 0.0}
        up, down = (candidate(0, 0, 0, 1.0, values=spot, later={x: 0.0, y: t}) for t in (1.0, -1.0))
        assert order_mirrored(plan, [down, up])[0] is up


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
    assert found.rejected_states
    assert found.tried > 0
    for item in found.rejected_states:
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
    assert asked == [len(found.rejected_states)]


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
    piece = instant_piece(plan, Fraction(0), 0.0, found.choices)
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
    moved = place_parts(plan, ConnectedParts.of(plan), state, [np.zeros(2)] * len(plan.clocks), carry)
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
    assert len(search.rejected_states) == KEPT_POSES
    search.rejected_states.clear()
    search._remember([Rejection(1.0, check=1)] * 50)
    assert len(search.rejected_states) == KEPT_POSES_EACH
    assert search.begin == 0


# --- first solutions, violations


@broad(
    ("equation", "onset", "off"),
    [*(("x*x = {t}; x > 0;", onset, 1e-9) for onset in (0.3, 1.0, 1.77)),
     *(("(x - 3)*(x - 3) + y*y = 4*{t}; x = y + 3; y > 0;", onset, 1e-9) for onset in (0.5, 1.3)),
     ("x*x*x*x + x*x + 1 = 1 + {t}; x > 0;", 0.1, 1e-6)],
    every=2,
)  # fmt: skip
def test_the_first_solution_is_found_where_it_begins(equation, onset, off):
    motion = motion_of(numbers(equation.format(t=f"(.t - {onset})") + "Bar.A = [x, 0]; Bar.angle = 0;", 2))
    segment = motion.segments[0]
    (trouble,) = segment.failures
    assert trouble.kind is FailureKind.START
    assert trouble.until == pytest.approx(onset, abs=off)
    assert segment.pieces[-1].end == 2.0
    times = [Fraction(int(1000 * (onset + 0.2)), 1000)]
    poses = motion.poses_at([Fraction(0), *times])
    assert poses.solved.tolist() == [False, True]


def test_what_never_has_a_solution_is_told_for_the_whole_step():
    motion = motion_of(numbers("x*x = .t - 9; Bar.A = [x, 0]; Bar.angle = 0;", 2))
    (trouble,) = motion.segments[0].failures
    assert (trouble.kind, trouble.until) == (FailureKind.START, 2.0)
    still = motion_of(numbers("x*x = -9; Bar.A = [x, 0]; Bar.angle = 0;", 2))
    assert still.segments[0].failures[0].until == 2.0


def followed(statements: str, end: float = 2.0):
    plan = plan_of(numbers(statements, end))
    found = select(plan, Fraction(0), 0.0, LOOK_AHEAD, as_drawn(plan.system.scene), {})
    assert found.choices is not None
    piece, gaps = follow_path(plan, Fraction(0), 0.0, end, found.choices)
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
    from movimentum.solver.start.delayed_start import _connected

    plan = plan_of(numbers("a*a = 4; b = a + 1; c*c = 9; d = c; e*e = 16; e*d > 0; f = 1; f ~ b;"))
    graph = nx.Graph([("a", "b"), ("c", "d"), ("e", "d"), ("f", "b")])
    for name in "abcdef":
        block = plan.owner[unknown(plan, name)]
        found = {
            plan.system.unknowns[n].name for number in _connected(plan, [block]) for n in plan.blocks[number].unknowns
        }
        assert found == nx.node_connected_component(graph, name)
