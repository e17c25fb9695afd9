"""Rows of pushed and wished blocks: signs of pushes, how much things count, angles as directions."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from movimentum.expressions import add, const, mul, symbol
from movimentum.memo import Memo
from movimentum.planning.blocks.block_cache import BlockCache
from movimentum.planning.blocks.kinds import Free, Pushing, Velocity
from movimentum.planning.blocks.pushed_groups import as_points, moments_of, unknowns_read_by
from movimentum.planning.blocks.velocities import rate_blocks_of, rows_of
from movimentum.planning.blocks.wishes import dependent_formulas, independent_form, with_directions
from movimentum.planning.lowering.system import build_system, with_rigidity
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.planning.structure.decompose import Group
from movimentum.scene.model import ThingAngle
from movimentum.timeline.arrange import arrange
from tests.planning.exact import valued
from tests.planning.test_systems import posed
from tests.understand import scene_of

SCALES = (1e-2, 1.0, 1e4)


def plan_of(text):
    scene = scene_of(text)
    return compile_structure(structure_of(scene, arrange(scene).segments[0], {}), 100.0, BlockCache(Memo(1)))


# --- how much things count


@pytest.mark.parametrize("scale", SCALES)
def test_four_points_have_the_moments_of_the_whole(scale):
    random = np.random.default_rng(2)
    for _ in range(10):
        root = random.normal(size=(2, 2))
        xx, xy, _, yy = (scale**4 * root @ root.T).ravel()
        area, (x, y) = scale**2 * random.uniform(0.5, 3.0), scale * random.normal(size=2)
        points = np.array(as_points((area, x, y, xx, xy, yy)))
        assert len(points) == 4
        weight = points[:, 2]
        assert weight.sum() == pytest.approx(area)
        assert weight @ points[:, :2] / area == pytest.approx([x, y], abs=1e-9 * scale)
        off = points[:, :2] - (x, y)
        truth = np.array([[xx, xy], [xy, yy]])
        assert (weight * off.T) @ off == pytest.approx(truth, rel=1e-9, abs=1e-9 * scale**4)


@pytest.mark.parametrize("scale", SCALES)
def test_things_count_by_the_area_of_their_outline(scale):
    corners = scale * np.array([[0.0, 0.0], [30.0, 5.0], [25.0, 30.0], [-5.0, 25.0]])
    said = " ".join(f"P{k} = [{x!r},{y!r}]" for k, (x, y) in enumerate(corners.tolist()))
    scene = scene_of(f"A : .polygon {said}; B : .disc({3.0 * scale}) C = [{scale},{2.0 * scale}]; @0 A.P0 = [0,0]; @1")
    area, x, y, xx, xy, yy = moments_of(scene.things[0], 100.0 * scale)
    shape = shapely.Polygon(corners)
    assert area == pytest.approx(shape.area)
    assert (x, y) == pytest.approx((shape.centroid.x, shape.centroid.y), abs=1e-9 * scale)
    # the second moments by triangles about the middle
    off = corners - (shape.centroid.x, shape.centroid.y)
    p, q = off, np.roll(off, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    truth = [
        float(
            np.sum(cross * (p[:, a] * p[:, b] + q[:, a] * q[:, b] + (p[:, a] + q[:, a]) * (p[:, b] + q[:, b]))) / 24.0
        )
        for a, b in ((0, 0), (0, 1), (1, 1))
    ]
    assert (xx, xy, yy) == pytest.approx(truth, rel=1e-9, abs=1e-9 * scale**4)
    area, x, y, xx, xy, yy = moments_of(scene.things[1], 100.0 * scale)
    r = 3.0 * scale
    assert (area, x, y) == pytest.approx((math.pi * r**2, scale, 2.0 * scale))
    assert (xx, xy, yy) == pytest.approx((math.pi * r**4 / 4.0, 0.0, math.pi * r**4 / 4.0), abs=1e-9 * scale**4)


# --- pushes


def test_pushes_are_what_must_not_be_negative_whichever_way_they_are_written():
    scene = scene_of(
        "A : .bar P = [0,0] Q = [30,40]; @0 A.P.y = 1; A.Q.x >= 7 .pushes; A.Q.y <= 90 .pushes;"
        ".d(A.P.x) >= 5 .pushes; .d(A.P.x) <= 8 .pushes; @1"
    )
    system = build_system(scene, arrange(scene).segments[0], {})
    values = posed(system, {0: (10.0, 20.0)}, {0: 25.0})
    c, s = math.cos(math.radians(25.0)), math.sin(math.radians(25.0))
    q = 10.0 + c * 30.0 - s * 40.0, 20.0 + s * 30.0 + c * 40.0
    found = [valued(push.value, values) for push in system.pushes]
    assert found[:2] == pytest.approx([q[0] - 7.0, 90.0 - q[1]])
    assert found[2:] == pytest.approx([10.0, -10.0])
    assert [push.rate and push.rate.value for push in system.pushes] == [None, None, 5.0, -8.0]
    for push in system.pushes:  # it reads what changes it, and nothing else
        now = valued(push.value, values)
        changes = {n for n in values if valued(push.value, {**values, n: values[n] + 0.5}) != now}
        assert push.reads == changes


def test_a_gap_reads_the_poses_of_both_and_a_distance_is_taken_off():
    scene = scene_of(
        "A : .disc(5) C = [0,0]; B : .polygon P = [20,0] Q = [40,0] R = [30,20];"
        "@0 A.C = [9*.t, 0]; B.P = [_, _]; B.angle = _; .gap(A, B) >= 4 .pushes; @1"
    )
    system = build_system(scene, arrange(scene).segments[0], {})
    (push,) = system.pushes
    assert push.value.value == -4.0
    names = {system.unknowns[n].name for n in push.reads}
    assert names >= {"A.x", "A.y", "B.x", "B.y", "B.cos", "B.sin"}
    plan = plan_of(
        "A : .disc(5) C = [0,0]; B : .polygon P = [20,0] Q = [40,0] R = [30,20];"
        "@0 A.C = [9*.t, 0]; B.P = [_, _]; B.angle = _; .gap(A, B) >= 4 .pushes; .d(B.P.y) >= 0 .pushes; @1"
    )
    (block,) = [block for block in plan.blocks if isinstance(block, Pushing)]
    rows = block.pushes
    assert rows.count == 2
    assert rows.fixed.tolist() == [-4.0, 0.0]
    assert rows.rates == rows.clutches == frozenset({1})
    assert [gap.push for gap in rows.gaps] == [0]
    driven = {plan.system.unknowns[n].name for n in block.inputs}
    assert {"A.x", "A.y"} <= driven
    assert unknowns_read_by(Group(block.unknowns, block.equations), plan.system) >= set(block.core)


# --- wishes, and rates


def test_an_angle_is_a_direction_but_for_whole_turns_where_it_stands_alone():
    scene = scene_of("A : .bar P = [1,2] Q = [31,42]; @0 A.P = [0,0]; A.Q.x = 5; w = A.angle; @1")
    system = with_rigidity(build_system(scene, arrange(scene).segments[0], {}), frozenset())
    angle = next(n for n, u in enumerate(system.unknowns) if u.payload == ThingAngle(0))
    for turn in (10.0, 170.0, -300.0, 725.0):
        values = posed(system, {0: (0.0, 0.0)}, {0: turn})
        near = turn - 360.0 * round(turn / 360.0)
        alone = with_directions(system, frozenset(), add(symbol(angle), const(-3.0)))
        off = near - 3.0
        assert valued(alone, values) == pytest.approx(off - 360.0 * round(off / 360.0), abs=1e-9)
        twice = with_directions(system, frozenset(), mul(const(2.0), symbol(angle)))
        assert valued(twice, values) == pytest.approx(2.0 * near, abs=1e-9)
    kept = add(symbol(angle), const(1.0))
    assert with_directions(system, frozenset({0}), kept) is kept


def test_what_is_measured_of_a_free_motion_is_put_in_terms_of_it():
    text = "B : .bar P = [0,0] Q = [30,40]; @0 B.P.y = 5; h = B.Q.y*2 + 1; g = 3*h - .t; @1"
    scene = scene_of(text)
    structure = structure_of(scene, arrange(scene).segments[0], {})
    system, number = structure.system, {u.name: n for n, u in enumerate(structure.system.unknowns)}
    found = dependent_formulas(system, structure.decomposition.groups)
    values = posed(system, {0: (3.0, 5.0)}, {0: 0.0})
    values = {n: values.get(n) for n in range(len(system.unknowns))}
    moved = independent_form(system, frozenset(), found, symbol(number["h"]))
    assert valued(moved, values) == pytest.approx(2.0 * 45.0 + 1.0)
    assert symbol(number["g"]) in found
    assert number["h"] not in {node.payload for node in found[symbol(number["g"])].args if node.op == "symbol"}


def test_rates_of_a_free_motion_depend_on_what_drives_it_and_on_nothing_else():
    plan = plan_of(
        "B : .bar P = [0,0] Q = [0,-40]; C : .bar R = [90,0] S = [95,0];"
        "@0 B.P = [20*.t, 0]; C.R = [90, .t]; C.angle = 0; v = .d(B.Q.x); @1"
    )
    (block,) = [block for block in plan.blocks if isinstance(block, Velocity)]
    law = plan.blocks[block.law]
    assert isinstance(law, Free)
    assert block.order == 1
    owner = {n: each.number for each in plan.blocks for n in each.unknowns}
    number = {u.payload: n for n, u in enumerate(plan.system.unknowns)}
    assert {owner[number[PoseCos(0)]], owner[number[PoseSin(0)]]} == {law.number}
    assert law.number in block.upstream
    other = {owner[n] for n, u in enumerate(plan.system.unknowns) if u.thing == 1 and n in owner}
    assert not other & set(block.upstream)
    assert rate_blocks_of(plan.system, plan.blocks, owner, [number[PoseCos(0)]]) == block.upstream
    rows = rows_of(plan.system, law)
    assert len(rows.residuals) == len(law.equations)
    assert {j for _, j in rows.entries} <= set(range(len(law.unknowns)))
