"""Pulling with a hand: what is held together stays together, and what is not connected does not stir."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from benchmarks.penrose import transformable
from movimentum.analysis.interactive.drag import Grip
from movimentum.expressions import symbol
from movimentum.interop.linkages import linkage_script
from movimentum.planning.codegen.writing import structures_compiled
from movimentum.scene.model import AnchorCoordinate, Scene
from movimentum.solver.motion import PathMotion
from movimentum.solver.solver import solve
from tests.understand import timeline_of

CELL = """\
A : .bar O=[0,0] P=[120,50];    B : .bar O=[0,0] P=[120,-50];
C : .bar P=[120,50] Q=[60,0];   D : .bar P=[120,-50] Q=[60,0];
E : .bar P=[120,50] R=[180,0];  F : .bar P=[120,-50] R=[180,0];
Alone : .bar P=[300,300] Q=[340,300];
@0 A.O=[0,0]; B.O=[0,0]; C.P=A.P; D.P=B.P; D.Q=C.Q; E.P=A.P; F.P=B.P; F.R=E.R;
@1
"""


def motion_of(text: str) -> PathMotion:
    return solve(timeline_of(text))


def grip_of(motion: PathMotion, thing: str, anchor: int) -> Grip:
    scene = motion.timeline.scene
    number = next(each.number for each in scene.things if each.name == thing)
    left = [symbol(AnchorCoordinate(number, anchor, axis)) for axis in (0, 1)]
    segment_motion = motion.segments[0]
    return Grip(segment_motion, segment_motion.pieces[0], 0.0, left)  # pyright: ignore[reportArgumentType]


def world(scene: Scene, placed: np.ndarray, thing: int, anchor: int) -> np.ndarray:
    """An anchor's place, for what `Grip.placements` gives."""
    (x, y, c, s), (u, v) = placed[thing], scene.things[thing].anchors[anchor].local
    return np.array([x + c * u - s * v, y + s * u + c * v])


def worst(scene: Scene, placed: np.ndarray, joints: list[tuple[int, int, int, int]]) -> float:
    """The largest distance of what is joined."""
    return max(float(np.linalg.norm(world(scene, placed, a, i) - world(scene, placed, b, j))) for a, i, b, j in joints)


JOINTS = [(0, 1, 2, 0), (1, 1, 3, 0), (2, 1, 3, 1), (0, 1, 4, 0), (1, 1, 5, 0), (4, 1, 5, 1), (0, 0, 1, 0)]


@pytest.mark.slow
@pytest.mark.parametrize("moves", [150, pytest.param(1000, marks=pytest.mark.slow)])
def test_many_moves_keep_what_is_joined_joined(moves: int) -> None:
    motion = motion_of(CELL)
    scene = motion.timeline.scene
    grip = grip_of(motion, "E", 1)
    chance = random.Random(3)
    before = structures_compiled()
    still = grip.placements()[6].copy()
    for k in range(moves):
        grip.move((170 + 25 * math.sin(k / 30) + chance.random(), 40 * math.sin(k / 17)))
        placed = grip.placements()
        assert worst(scene, placed, JOINTS) < 1e-9 * 200
        assert np.allclose(np.hypot(placed[:, 2], placed[:, 3]), 1.0, atol=1e-10)
        assert np.array_equal(placed[6], still)
        # the inversor: the product of the distances is that of the links as they were drawn
        near, far = world(scene, placed, 2, 1), world(scene, placed, 4, 1)
        assert math.hypot(*near) * math.hypot(*far) == pytest.approx(120**2 + 50**2 - (60**2 + 50**2), rel=1e-9)
    assert structures_compiled() == before


def test_a_hand_that_stays_is_reached() -> None:
    grip = grip_of(motion_of(CELL), "E", 1)
    moves = 0
    while grip.move((150, 30)) and moves < 200:
        moves += 1
    assert grip.off() < 1e-6
    assert 0 < moves < 100
    assert not grip.stuck()


def test_placements_are_those_of_a_pose() -> None:
    grip = grip_of(motion_of(CELL), "A", 1)
    grip.move((100, 80))
    pose = grip.pose()
    expected = np.array([[thing.x, thing.y, thing.c, thing.s] for thing in pose.things])
    assert np.allclose(grip.placements(), expected, atol=1e-12)


def test_what_is_determined_is_fixed() -> None:
    motion = motion_of("A : .bar O=[0,0] P=[50,0]; @0 A.O = [0,0]; A.angle = 20; @1")
    grip = grip_of(motion, "A", 1)
    assert grip.fixed
    assert grip.move((70, 70)) == 0
    assert grip.off() == pytest.approx(
        math.hypot(70 - 50 * math.cos(math.radians(20)), 70 - 50 * math.sin(math.radians(20)))
    )


@pytest.mark.slow
@pytest.mark.parametrize("order", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_rods_of_a_tiling_keep_their_joints(order: int) -> None:
    motion = motion_of(linkage_script(transformable(order), "tiling"))
    scene = motion.timeline.scene
    last = scene.things[-1]
    grip = grip_of(motion, last.name, 1)
    x, y = last.anchors[1].local
    places: dict[str, tuple[int, int]] = {}
    joints: list[tuple[int, int, int, int]] = []
    for thing in scene.things:
        for i, anchor in enumerate(thing.anchors):
            if anchor.name in places:
                joints.append((*places[anchor.name], thing.number, i))
            else:
                places[anchor.name] = thing.number, i
    for k in range(20):
        assert grip.move((x + 2 * (k + 1), y - k)) > 0
        assert worst(scene, grip.placements(), joints) < 1e-7
