"""Assembly from anywhere: scenes that have a known pose, drawn elsewhere."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from movimentum.solver.motion import PathMotion
from movimentum.solver.solver import solve
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, understand
from tests.broad import broad
from tests.families.scattered import Places, Scattered, scattered, script
from tests.families.tilings import at_another_place, tiling_script

SIZE = 100.0


def begun(text: str) -> PathMotion:
    return solve(arranged(understand(SourceText("scene.mov", text)), Choices()))


def places_of(motion: PathMotion) -> tuple[bool, Places]:
    """Whether the first frame has a solution, and where everything is there."""
    poses = motion.poses(0, 1)
    things = {thing.name: thing for thing in motion.timeline.scene.things}

    def at(thing: str, anchor: str) -> complex:
        body = things[thing]
        local = next(item.local for item in body.anchors if item.name == anchor)
        return complex(*poses.world(body.number, local)[0])

    return bool(poses.solved[0]), at


def check_assembled(seed: int, things: int, drawn: str) -> None:
    scene = scattered(seed, things)
    solved, at = places_of(begun(script(scene, seed, drawn)))
    assert solved, f"seed {seed}: no pose found"
    off, statement = scene.worst(at)
    assert off <= 1e-8 * SIZE, f"seed {seed}: {statement} is off by {off}"


def farthest(scene: Scattered, at: Places) -> float:
    """How far anything is from the known pose."""
    return max(abs(at(name, anchor) - z) for name, anchors in scene.things.items() for anchor, z in anchors.items())


@broad("seed", range(24), first=6)
def test_bars_drawn_at_their_own_origins_are_assembled(seed):
    check_assembled(seed, 5 + seed % 12, "origin")


@broad("seed", range(100, 108), first=2)
def test_bars_drawn_anywhere_are_assembled(seed):
    check_assembled(seed, 14, "anywhere")


@pytest.mark.slow
@pytest.mark.parametrize(("first", "things"), [(1000, 6), (1100, 12), (1200, 20), (1300, 30), (1400, 45), (1500, 60)])
def test_many_scattered_scenes(first, things):
    for seed in range(first, first + max(6, 240 // things)):
        check_assembled(seed, things, "origin")


@broad("seed", range(16), first=5)
def test_a_drawing_pinned_elsewhere_is_the_drawing_moved(seed):
    scene = scattered(3000 + seed, 4 + seed % 9)
    solved, at = places_of(begun(script(scene, seed, "together")))
    assert solved
    assert farthest(scene, at) <= 1e-8 * SIZE


@pytest.mark.slow
@pytest.mark.long
def test_many_drawings_pinned_elsewhere():
    for seed in range(4000, 4100):
        scene = scattered(seed, 3 + seed % 25)
        solved, at = places_of(begun(script(scene, seed, "together")))
        assert solved, seed
        assert farthest(scene, at) <= 1e-8 * SIZE, seed


@broad(
    ("order", "turn", "shift"),
    [
        (1, 0.0, 0j), (1, 40.0, 300 - 20j), (1, 180.0, 5 + 5j), (1, -77.0, 0j), (1, None, 100 + 1000j),
        (2, None, -250 + 10j), (2, 123.0, 80 + 900j),
    ], first=5,
)  # fmt: skip
def test_tilings_are_assembled_at_any_place_and_angle(order, turn, shift):
    check_tiling(order, turn, shift)


@pytest.mark.slow
@pytest.mark.parametrize(("order", "turn", "shift"), [(3, 61.0, 10 + 10j), (3, None, 1e4 + 0j), (4, -100.0, 500 + 0j)])
def test_large_tilings_are_assembled_at_any_place_and_angle(order, turn, shift):
    check_tiling(order, turn, shift)


def check_tiling(order: int, turn: float | None, shift: complex) -> None:
    text, points = tiling_script(order)
    motion = begun(text + at_another_place(order, turn, shift))
    solved, at = places_of(motion)
    assert solved
    first = points[0][2]
    by = cmath.rect(1.0, math.radians(turn or 0.0))
    worst = max(abs(at(thing, anchor) - ((z - first) * by + first + shift)) for thing, anchor, z in points)
    assert worst <= 1e-6, worst


def test_an_angle_that_the_scene_does_not_fix_stays_as_drawn():
    """One vertex placed elsewhere: the tiling is moved there, and not turned."""
    text, _ = tiling_script(1)
    poses = begun(text + at_another_place(1, None, 33 - 7j)).poses(0, 1)
    assert np.allclose(poses.direction[:, 0], [1.0, 0.0], atol=1e-9)
