"""What the timeline makes of gears, belts, cords and directions: evaluated at poses whose truth is known without it."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from movimentum.expressions import const, symbol
from movimentum.scene.leaves import Bearing, cords_of
from movimentum.scene.model import AnchorCoordinate, AnchorRef, GearPair, Relation, ThingAngle
from movimentum.timeline.cords import CordParts, is_closed, read_cords
from movimentum.timeline.joints import Joints, value_at
from movimentum.timeline.trains import Trains
from tests.families.test_belts import round_trip
from tests.families.test_cords import length, tangent
from tests.planning.exact import OPERATIONS
from tests.understand import scene_of, timeline_of


def valued(root, places, turns, clock=0.0):
    """An expression of the scene where anchors (by thing and number) and turns (by thing) are these; what is followed
    is nearest to how it is drawn.
    """
    memo = {}

    def of(node):
        if node not in memo:
            payload = node.payload
            if node.op == "const":
                memo[node] = float(payload)
            elif node.op == "clock":
                memo[node] = clock
            elif node.op == "pow":
                memo[node] = of(node.args[0]) ** payload
            elif isinstance(payload, ThingAngle):
                memo[node] = turns[payload.thing]
            elif isinstance(payload, AnchorCoordinate):
                memo[node] = places[payload.thing, payload.anchor][payload.axis]
            elif isinstance(payload, Bearing):
                seen = math.degrees(math.atan2(of(payload.sine), of(payload.cosine)))
                memo[node] = seen + 360.0 * round((payload.drawn - seen) / 360.0)
            else:
                memo[node] = {**OPERATIONS, "floor": math.floor}[node.op](*map(of, node.args))
        return memo[node]

    return of(root)


def paired(timeline, segment=0):
    (found,) = [item for item in timeline.segments[segment].active if item.paired]
    return found


def follower(item, places, turns, thing):
    """How far a thing is turned where a linear equation holds."""

    def off(turn):
        return sum(sign * valued(side[0], places, {**turns, thing: turn})
                   for sign, side in ((1.0, item.left), (-1.0, item.right)))  # fmt: skip

    at_0, at_1 = off(0.0), off(1.0)
    return -at_0 / (at_1 - at_0)


def in_gaps(n1, a1, t1, n2, a2, t2, towards, *, inner):
    """How far, of a tooth, a tooth of one is from the middle of a gap of the other where pitch circles touch."""
    one = n1 * (towards - t1 - a1) / 360.0
    other = n2 * (towards + (0.0 if inner else 180.0) - t2 - a2) / 360.0
    off = (one - other if inner else one + other) - 0.5
    return off - round(off)


@pytest.mark.parametrize("seed", range(8))
def test_teeth_are_in_gaps_wherever_the_centres_are_and_the_drawing_is_turned_least(seed):
    random = np.random.default_rng(seed)
    n1, n2 = (int(n) for n in random.integers(8, 60, 2))
    inner = bool(seed % 2)
    if inner:
        n1 += n2
    m = round(float(random.uniform(0.5, 5.0)), 3)
    u, v = (random.integers(-5, 6, 2) + 0.5).tolist(), (random.integers(-5, 6, 2) + 0.5).tolist()
    far = m * (n1 - n2 if inner else n1 + n2) / 2.0
    order = "A, B" if seed % 3 else "B, A"
    start = round(float(random.uniform(-500.0, 500.0)), 2)
    timeline = timeline_of(
        f"A : .gear({n1}, {m}){' .inner' * inner} C = [1,2] T = C + [{u[0]},{u[1]}];"
        f"B : .gear({n2}, {m}) C = [{1 + far},2] T = C + [{v[0]},{v[1]}];"
        f"Arm : .bar O = [1,2] P = [{1 + far},2];"
        f"@0 A.C = [1,2]; A.angle = {start}; Arm.O = A.C; B.C = Arm.P; .mesh({order}) = 0; @1"
    )
    item = paired(timeline)
    assert item.relation is Relation.EQUAL
    a1, a2 = (math.degrees(math.atan2(w[1], w[0])) for w in (u, v))
    drawn = None
    for carrier in (0.0, *random.uniform(-400.0, 400.0, 3)):
        place = (1.0 + far * math.cos(math.radians(carrier)), 2.0 + far * math.sin(math.radians(carrier)))
        places = {(0, 0): (1.0, 2.0), (1, 0): place, (2, 0): (1.0, 2.0), (2, 1): place}
        turns = {0: start + float(random.uniform(-700.0, 700.0)) * (carrier != 0.0), 2: carrier}
        t2 = follower(item, places, turns, 1)
        assert in_gaps(n1, a1, turns[0], n2, a2, t2, carrier, inner=inner) == pytest.approx(0.0, abs=1e-9)
        if drawn is None:
            drawn = turns[0], t2
            assert abs(t2) <= 180.0 / n2 + 1e-9
        else:  # Willis: turns relative to the arm that carries the centres
            ratio = (n1 if inner else -n1) / n2
            assert t2 - carrier - drawn[1] == pytest.approx(ratio * (turns[0] - carrier - drawn[0]), abs=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_a_gear_rolls_on_a_rack_and_has_its_teeth_in_gaps(seed):
    random = np.random.default_rng(40 + seed)
    n, m = int(random.integers(8, 40)), round(float(random.uniform(0.5, 5.0)), 3)
    lean = math.radians(float(random.uniform(0.0, 360.0)))
    c, s = math.cos(lean), math.sin(lean)
    off = n * m / 2.0
    x, y = -s * off, c * off  # on the left of the rack
    timeline = timeline_of(
        f"R : .rack(30, {m}) A = [0,0] B = [{100 * c!r},{100 * s!r}];"
        f"G : .gear({n}, {m}) C = [{x!r},{y!r}] T = C + [3,1];"
        f"@0 R.A = [0,0]; R.angle = 0; G.C = [_, _]; .mesh(R, G) = 0; @1"
    )
    item, tooth = paired(timeline), math.degrees(math.atan2(1, 3))
    turned = []
    for along in (0.0, *(off * random.uniform(-9.0, 9.0, 3))):
        places = {(0, 0): (0.0, 0.0), (0, 1): (100 * c, 100 * s), (1, 0): (x + along * c, y + along * s)}
        t = follower(item, places, {0: 0.0}, 1)
        turned.append(t)
        # below the gear's centre: the rack has a tooth at whole multiples of its pitch from A, the gear a gap there
        rack = along / (math.pi * m)
        gear = n * (math.degrees(lean) - 90.0 - t - tooth) / 360.0
        off_gap = rack - gear - 0.5
        assert off_gap - round(off_gap) == pytest.approx(0.0, abs=1e-8)
        assert t - turned[0] == pytest.approx(-math.degrees(along / off), abs=1e-8)
    assert abs(turned[0]) <= 180.0 / n + 1e-9


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_turns_by_the_radii_relative_to_its_centres(crossed):
    random = np.random.default_rng(6)
    r1, r2 = 30.0, 12.5
    lean = math.radians(33.0)
    at = f"{80.0 * math.cos(lean)!r},{80.0 * math.sin(lean)!r}"
    timeline = timeline_of(
        f"A : .disc({r1}) C = [0,0] P = [5,0]; B : .disc({r2}) C = [{at}] P = [83,0]; Arm : .bar O = [0,0] P = [{at}];"
        f"@0 A.C = [0,0]; Arm.O = A.C; B.C = Arm.P; .belt(A, B){' .crossed' * crossed} = 0; @1"
    )
    item, ratio = paired(timeline), (-r1 if crossed else r1) / r2
    for carrier in random.uniform(-500.0, 500.0, 4):
        turned = lean + math.radians(carrier)
        place = (80.0 * math.cos(turned), 80.0 * math.sin(turned))
        places = {(0, 0): (0.0, 0.0), (1, 0): place, (2, 0): (0.0, 0.0), (2, 1): place}
        turns = {0: float(random.uniform(-700.0, 700.0)), 2: float(carrier)}
        t2 = follower(item, places, turns, 1)
        assert t2 - carrier == pytest.approx(ratio * (turns[0] - carrier), abs=1e-9)


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_that_is_laid_on_later_goes_on_from_how_its_wheels_are_turned(crossed):
    timeline = timeline_of(
        "A : .disc(30) C = [0,0] P = [5,0]; B : .disc(12) C = [80,0] P = [83,0];"
        "@0 A.C = [0,0]; B.C = [80,0]; A.angle = 40*.t; B.angle = 25 - 7*.t;"
        f"@2 B.angle = _; .belt(A, B){' .crossed' * crossed} = 0; @3"
    )
    item, ratio = paired(timeline, 1), (-30.0 if crossed else 30.0) / 12.0
    for turn in (80.0, 100.0, -33.0):
        assert follower(item, {}, {0: turn}, 1) == pytest.approx(25.0 - 14.0 + ratio * (turn - 80.0), abs=1e-9)


def test_what_is_read_of_teeth_is_how_far_they_are_from_the_nearest_gap():
    scene = scene_of("A : .gear(20,2) C = [0,0]; B : .gear(10,2) C = [30,0]; @0 A.C = [0,0]; B.C = [30,0]; x = 3; @1")
    trains, start = Trains(scene), scene.steps[0].time
    active = list(scene.constraints())
    trains.placed(active, start)
    pair = symbol(GearPair(0, 1, belt=False))
    (read,) = trains.read((pair,), active, start, aims=False)
    (seen,) = trains.read((pair,), active, start, aims=True)
    (plain,) = trains.read((symbol("x"),), active, start, aims=False)
    assert plain == symbol("x")
    for t1, t2 in ((0.0, 0.0), (7.0, -31.0), (100.0, 200.0), (3.0, 12.0)):
        off = 36.0 * in_gaps(20, 0.0, t1, 10, 0.0, t2, 0.0, inner=False)  # in degrees of the second
        for each in (read, seen):
            assert abs(valued(each, {}, {0: t1, 1: t2})) == pytest.approx(abs(off), abs=1e-9)


# --- directions


def test_directions_are_those_of_places_by_whatever_says_them():
    scene = scene_of(
        "A : .bar P = [0,0] Q = [30,10] R = [0,0]; B : .bar S = [0,0] T = [5,40]; C : .bar U = [9,9] V = [9,29];"
        "D : .bar W = [1,1] X = [2,3];"
        "E : .bar Y = [3,4] Z = [5,6];"
        "@0 x = 3; E.Y = A.P + [40,15].r(A.angle); E.Z = [10,20] + [30,0].r(9*.t);"
        "A.P = [10,20]; B.S = A.Q; C.U = [10,60]; D.W = A.P + [40,0].r(25 + 3*.t); B.T = C.V; D.X = B.S + [0,7];"
        "@2"
    )
    active = [item for item in scene.constraints() if item.relation is Relation.EQUAL]
    joints = Joints(scene, active, scene.steps[0].time)
    P, Q, R, S, T, U, V, W, X = (
        AnchorRef(thing, anchor)
        for thing, anchor in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1))
    )
    turns = {0: 12.0, 1: -31.0, 2: 100.0, 3: 7.0}

    def value(first, second, clock=0.0):
        return valued(joints.direction(first, second).value, {}, turns, clock)

    # both stand still: from (10, 20) to (10, 60), whichever anchor at that place is named
    assert value(P, U) == value(R, U) == 90.0
    assert value(U, P) == -90.0
    # a thing that has both, by an anchor that coincides: A from P to Q, B from S to T, C from U to V
    assert value(P, S) == pytest.approx(12.0 + math.degrees(math.atan2(10, 30)))
    assert value(S, R) == pytest.approx(12.0 + math.degrees(math.atan2(-10, -30)))
    assert value(Q, T) == value(Q, V) == pytest.approx(-31.0 + math.degrees(math.atan2(40, 5)))
    assert value(T, U) == pytest.approx(100.0 - 90.0)
    # what a statement turns about another one, and back
    assert value(P, W, 4.0) == pytest.approx(25.0 + 12.0)
    assert value(W, P, 4.0) == pytest.approx(25.0 + 12.0 + 180.0)
    assert value(Q, X) == 90.0
    assert abs(value(X, S)) == 270.0 or value(X, S) == -90.0
    for pair, drawn in (((P, W), 25.0), ((P, U), 90.0), ((P, S), math.degrees(math.atan2(10, 30)))):
        assert joints.direction(*pair).drawn == pytest.approx(drawn)
    # what is turned with a thing, and what is turned about a place
    Y, Z = AnchorRef(4, 0), AnchorRef(4, 1)
    assert value(P, Y) == pytest.approx(12.0 + math.degrees(math.atan2(15, 40)))
    assert value(Q, Y) == pytest.approx(12.0 + math.degrees(math.atan2(5, 10)))
    assert value(P, Z) == value(R, Z) == 0.0
    assert value(P, Z, 4.0) == pytest.approx(36.0)
    # what nothing says is seen
    seen = joints.direction(X, U)
    assert isinstance(seen.value.payload, Bearing)
    assert seen.drawn == pytest.approx(math.degrees(math.atan2(9 - 3, 9 - 2)))
    places = {(3, 1): (2.0, 1.0), (2, 0): (4.0, 5.0)}
    assert valued(seen.value, places, turns) == pytest.approx(math.degrees(math.atan2(4.0, 2.0)))
    # where something is
    assert joints.known(R) == (10.0, 20.0)
    assert joints.known(S) is None


def test_values_of_numbers_clocks_and_known_turns():
    timeline = timeline_of("B : .bar P = [0,0] Q = [9,0]; @1 B.P = [0,0]; x = B.angle*2 + 3*.t^2; B.angle = 5; @4")
    (item,) = [each for each in timeline.segments[0].active if not isinstance(each.left[0].payload, AnchorCoordinate)
               and not isinstance(each.left[0].payload, ThingAngle)]  # fmt: skip
    start = timeline.scene.steps[0].time
    assert value_at(item.right[0], start + 2, {0: 5.0}) == pytest.approx(10.0 + 12.0)
    assert value_at(item.right[0], start + 2, {1: 5.0}) is None
    assert value_at(item.right[0], start) is None
    assert value_at(const(0.0), start) == 0.0


# --- cords


def things_of(stops):
    return " ".join(
        f"W{n} : .disc({abs(r)!r}) O = [{c.real!r},{c.imag!r}] P = O + [1,0];" for n, (c, r) in enumerate(stops)
    )


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_a_cord_is_as_long_as_its_tangents_and_arcs(seed, scale):
    """From a point about wheels to a point; against tangents by complex numbers."""
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 5))
    stops = [(complex(120.0 * (k + 1), random.uniform(-40, 40)) * scale,
              float(random.choice([1, -1]) * random.uniform(5, 40)) * scale) for k in range(count)]  # fmt: skip
    begin, end = complex(0.0, 30.0) * scale, complex(120.0 * (count + 1), -20.0) * scale
    names = ", ".join(f"{'-' * (r < 0)}W{n}" for n, (_, r) in enumerate(stops))
    scene = scene_of(
        f"{things_of(stops)} @0 c = .cord([{begin.real!r},{begin.imag!r}], {names}, [{end.real!r},{end.imag!r}]); @1"
    )
    (cord,) = next(found for item in scene.constraints() if (found := cords_of(item)))
    parts = CordParts(scene, cord)
    places = {(n, 0): (c.real, c.imag) for n, (c, _) in enumerate(stops)}
    whole = [(begin, 0.0), *stops, (end, 0.0)]
    assert valued(parts.length, places, {}) == pytest.approx(length(whole), rel=1e-12)
    for part, one, other in zip(parts.straights, whole, whole[1:], strict=False):
        p, q = tangent(one, other)
        assert valued(part.length, places, {}) == pytest.approx(abs(q - p), rel=1e-9, abs=1e-9 * scale)
        way = complex(*(valued(each, places, {}) for each in part.along))
        assert way / abs(way) == pytest.approx((q - p) / abs(q - p), abs=1e-9)
    for wrap, (centre, r), came, left in zip(parts.wraps, stops, whole, whole[2:], strict=False):
        (_, b), (a, _) = tangent(came, (centre, r)), tangent((centre, r), left)
        turn = math.degrees(cmath.phase((b - centre) / (a - centre)) * math.copysign(1.0, r)) % 360.0
        assert valued(wrap.angle, places, {}) == pytest.approx(turn, abs=1e-7)
        assert wrap.radius == pytest.approx(abs(r))
        assert not wrap.drum
    assert not is_closed(cord)
    assert parts.drawn(parts.length) == 0.0 or parts.drawn(parts.straights[0].length) > 0.0
    (read,) = read_cords(scene, [next(item for item in scene.constraints() if cords_of(item)).right[0]])
    assert valued(read, places, {}) == pytest.approx(length(whole), rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_a_belt_of_cord_is_as_long_as_its_round_trip(seed):
    random = np.random.default_rng(seed)
    stops = [(200.0 * cmath.exp(-2j * math.pi * (k + random.uniform(-0.1, 0.1)) / 3), random.uniform(15.0, 35.0))
             for k in range(3)]  # fmt: skip
    scene = scene_of(f"{things_of(stops)} @0 c = .cord(W0, W1, W2, W0); @1")
    (cord,) = next(found for item in scene.constraints() if (found := cords_of(item)))
    places = {(n, 0): (c.real, c.imag) for n, (c, _) in enumerate(stops)}
    assert is_closed(cord)
    assert valued(CordParts(scene, cord).length, places, {}) == pytest.approx(round_trip(stops), rel=1e-12)


@pytest.mark.parametrize(("side", "end"), [("", "first"), ("-", "first"), ("", "last"), ("-", "last")])
def test_a_drum_winds_on_what_it_turns(side, end):
    """A hoist: what the drum of radius r has turned beyond how far its cord has swung is wound on it."""
    sign = -1.0 if side else 1.0
    names = f"{side}W0, Hook.P" if end == "first" else f"Hook.P, {side}W0"
    scene = scene_of(
        f"W0 : .disc(20) O = [0,0] P = [1,0]; Hook : .disc(3) P = [70,-90]; @0 c = .cord({names}); W0.O = [0,0]; @1"
    )
    (cord,) = next(found for item in scene.constraints() if (found := cords_of(item)))
    parts = CordParts(scene, cord)
    (wrap,) = parts.wraps
    assert wrap.drum

    def total(hook, turn):
        return valued(parts.length, {(0, 0): (0.0, 0.0), (1, 0): hook}, {0: turn})

    straight = math.sqrt(70.0**2 + 90.0**2 - 20.0**2)
    assert total((70.0, -90.0), 0.0) == pytest.approx(straight)
    # along the cord, from a drum on its right counter-clockwise turns wind on; at the end the other way round
    winds = sign if end == "first" else -sign
    assert total((70.0, -90.0), 90.0) == pytest.approx(straight + winds * 20.0 * math.pi / 2.0)
    # all of it swung about the drum's middle together: nothing is wound
    c, s = math.cos(math.radians(25.0)), math.sin(math.radians(25.0))
    assert total((70.0 * c + 90.0 * s, 70.0 * s - 90.0 * c), 25.0) == pytest.approx(straight)


def test_a_train_finds_its_pairs_and_leaves_other_statements_alone():
    scene = scene_of("A : .gear(20,2) C = [0,0]; B : .gear(10,2) C = [30,0]; @0 x = 3; .mesh(A, B) = 0; @1")
    trains = Trains(scene)
    constraints = list(scene.constraints())
    placed = trains.placed(constraints, scene.steps[0].time)
    assert [item.paired for item in placed] == [False, True]
    assert placed[0] is constraints[0]
    assert not any(isinstance(n.payload, GearPair) for side in (placed[1].left, placed[1].right) for n in side)
    plain = scene_of("x : .disc(3) C = [0,0]; @0 y = 3; @1")
    constraints = list(plain.constraints())
    assert Trains(plain).placed(constraints, plain.steps[0].time) == tuple(constraints)


@pytest.mark.parametrize("side", ["", "-"])
def test_wheels_that_are_gripped_turn_by_what_the_cord_runs(side):
    """The load moves by d along its straight part: the wheel turns by d/r, and its middle may stay."""
    r, sign = 20.0, -1.0 if side else 1.0
    timeline = timeline_of(
        f"W : .disc({r}) O = [100,100] P = [101,100]; A : .disc(3) P = [0,30]; B : .disc(3) P = [220,10];"
        f"@0 W.O = [100,100]; .cord(A.P, {side}W, B.P) = 300 .grips; A.P = [0, 30]; @1"
    )
    scene = timeline.scene
    number = next(item.number for item in scene.constraints() if cords_of(item))
    length_, grip = [item for item in timeline.segments[0].active if item.number == number]
    begin, middle, end = (complex(0, 30), 0.0), (complex(100, 100), sign * r), (complex(220, 10), 0.0)
    places = {(0, 0): (100.0, 100.0), (1, 0): (0.0, 30.0), (2, 0): (220.0, 10.0)}
    assert valued(length_.left[0], places, {0: 0.0}) == pytest.approx(length([begin, middle, end]))
    assert valued(length_.right[0], places, {}) == 300.0
    (touch, at) = tangent(begin, middle)
    way = (at - touch) / abs(at - touch)
    for d in (0.0, 7.0, -12.0):
        moved = touch + d * way
        there = {**places, (1, 0): (moved.real, moved.imag)}
        turn = -sign * math.degrees(d / r)  # on the right of the cord: what runs ahead turns it clockwise
        assert valued(grip.left[0], there, {0: turn}) == pytest.approx(0.0, abs=1e-9)
        assert abs(valued(grip.left[0], there, {0: turn + 1.0})) == pytest.approx(math.radians(r), rel=1e-9)
    assert valued(grip.right[0], places, {}) == 0.0
