"""All outlines of a block together: near parts, whole gaps and overlaps, against shapely in random poses."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from movimentum.memo import Memo
from movimentum.planning.blocks.block_cache import BlockCache
from movimentum.planning.blocks.kinds import Pushing
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.solver.pushing.contacts import contacts_of
from movimentum.solver.pushing.overlap import WholeDistance, overlapping_gaps
from movimentum.timeline.arrange import arrange
from tests.understand import scene_of

SHAPES = {
    "A": [(0, 0), (40, 0), (40, 10), (15, 12), (10, 40), (0, 40)],
    "B": [(0, 0), (30, 5), (25, 30), (-5, 25)],
    "D": [(0, 0), (20, 0), (10, 30)],
}


def contacts():
    things = " ".join(
        f"{name} : .polygon {' '.join(f'P{k} = [{x},{y}]' for k, (x, y) in enumerate(points))};"
        for name, points in SHAPES.items()
    )
    text = (
        f"{things} @0 A.P0 = [50*.t, 0]; A.angle = 0; B.P0 = [_, _]; D.P0 = [_, _]; B.angle = _; D.angle = _;"
        ".gap(A, B) >= 0 .pushes; .gap(B, D) >= 3 .pushes; .gap(A, D) >= 0 .pushes; @1"
    )
    scene = scene_of(text)
    plan = compile_structure(structure_of(scene, arrange(scene).segments[0], {}), 100.0, BlockCache(Memo(1)))
    (block,) = [block for block in plan.blocks if isinstance(block, Pushing)]
    return contacts_of(block)


@pytest.fixture(scope="module")
def made():
    return contacts()


def posed(made, random):
    """Random poses (4, B) of all outlines, and their polygons by thing: a thing's frame goes through its anchors."""
    bodies = made.bodies
    poses, drawn = np.empty((4, len(bodies.sides))), {}
    for b, body in enumerate(bodies.sides):
        name = "ABD"[body.thing]
        turn, (x, y) = random.uniform(-3, 3), random.uniform(-45, 45, 2)
        corners = np.array([body.frame.local(point) for point in SHAPES[name]])
        c, s = math.cos(turn), math.sin(turn)
        poses[:, b] = x, y, c, s
        drawn[body.thing] = shapely.Polygon(corners @ np.array([[c, s], [-s, c]]) + (x, y))
    return poses, drawn


@pytest.mark.parametrize("seed", range(6))
def test_whole_gaps_and_near_parts_are_as_far_apart_as_shapely_says(made, seed):
    random = np.random.default_rng(seed)
    bodies = made.bodies
    assert len(bodies.sides) == 3
    for _ in range(4):
        poses, drawn = posed(made, random)
        apart = bodies.apart(poses)
        for g, gap in enumerate(made.rows.gaps):
            one, other = drawn[gap.first.thing], drawn[gap.second.thing]
            truth = one.distance(other)
            assert apart[g] <= truth + 1e-9  # circles about both are no farther apart
            value = WholeDistance(gap).between(poses, (int(bodies.first[g]), int(bodies.second[g])))
            if truth > 0.0:
                assert value == pytest.approx(truth, abs=1e-6)
            else:
                assert value < 1e-9
        for within in (5.0, 30.0):
            pairs = bodies.near(poses, np.full(len(made.rows.gaps), within))
            assert (np.diff(pairs.kind) >= 0).all()
            if not len(pairs.gap):
                assert all(drawn[gap.first.thing].distance(drawn[gap.second.thing]) > within for gap in made.rows.gaps)
                continue
            touch = bodies.places(pairs).touch(poses[:, None])
            good = touch.is_near(1e-9)[0]
            for g, gap in enumerate(made.rows.gaps):
                truth = drawn[gap.first.thing].distance(drawn[gap.second.thing])
                own = np.where(good & (pairs.gap == g) & (touch.value[0] > 0.0), touch.value[0], np.inf)
                if 0.0 < truth <= within:
                    assert own.min() == pytest.approx(truth, abs=1e-9)
            assert not bodies.others(pairs, pairs).any()
            some = pairs.some(np.arange(1))
            assert bodies.others(pairs, some).sum() == len(pairs.gap) - 1
            assert some.one(0) == tuple(int(each[0]) for each in pairs)


def test_no_gap_is_near_where_everything_is_far(made):
    poses = np.zeros((4, 3))
    poses[0], poses[2] = (0.0, 1e4, -1e4), 1.0
    assert len(made.bodies.near(poses, np.full(3, 50.0)).gap) == 0


@pytest.mark.parametrize("seed", range(6))
def test_overlaps_are_told_deepest_first_with_what_is_added_to_their_distance(made, seed):
    """Of two convex ones: as deep as the sum of one and the other turned round says."""
    random = np.random.default_rng(50 + seed)
    for _ in range(4):
        poses, drawn = posed(made, random)
        margins = np.array([0.0, -3.0, 0.0])[: len(made.rows.gaps)]
        found = overlapping_gaps(made, poses, margins, 1e-6)
        assert [each.depth for each in found] == sorted((each.depth for each in found), reverse=True)
        told = {each.things: each.depth for each in found}
        for gap in made.rows.gaps:
            pair = gap.first.thing, gap.second.thing
            truth = drawn[pair[0]].distance(drawn[pair[1]]) + margins[gap.push]
            if truth > 1e-6:
                assert pair not in told
            elif truth < -1e-6 or drawn[pair[0]].intersection(drawn[pair[1]]).area > 1e-6:
                assert pair in told
                assert {each.push for each in found if each.things == pair} == {made.rows.numbers[gap.push]}
                if pair == (1, 2):
                    p, q = (np.array(drawn[t].exterior.coords)[:-1] for t in pair)
                    whole = shapely.MultiPoint((p[:, None] - q[None]).reshape(-1, 2)).convex_hull
                    origin = shapely.Point(0.0, 0.0)
                    depth = whole.exterior.distance(origin) * (1.0 if whole.contains(origin) else -1.0)
                    assert told[pair] == pytest.approx(depth + 3.0, abs=1e-6)
