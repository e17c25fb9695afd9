"""Mechanism expressions: the mechanisms and end points that Pyslvs publishes, solved by importing them."""

from __future__ import annotations

import math
import re
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from movimentum.errors import ScriptError, UsageError
from movimentum.interop.mechanisms import mechanism_script, read_mechanism
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, understand
from tests.command import movimentum

# Published examples of Pyslvs (Chang): the mechanisms, and where their last joint is at the inputs given
# in its tests (test_core.py).
JANSEN = """M[  # Theo Jansen's linkage, one leg
 J[R, color[Green], P[0.0, 0.0], L[ground, L1]], J[R, color[Green], P[9.61, 11.52], L[L1, L2, L4]],
 J[R, color[Blue], P[-38.0, -7.8], L[ground, L3, L5]], J[R, color[Green], P[-35.24, 33.61], L[L2, L3]],
 J[R, color[Green], P[-77.75, -2.54], L[L3, L6]], J[R, color[Green], P[-20.1, -42.79], L[L4, L5, L7]],
 J[R, color[Green], P[-56.05, -35.42], L[L6, L7]], J[R, color[Green], P[-22.22, -91.74], L[L7]]]"""
CRANK_SLIDER = """M[J[R, color[Green], P[-67.38, 36.13], L[ground, L1]], J[R, P[-68.925, 55.925], L[L1, L2]],
 #[ a slot
 in the frame #]
 J[RP, A[0.0], color[Green], P[11.88, 0.0], L[ground, L2, L3]], J[R, P[50.775, 24.7908], L[L3, L4]],
 J[R, color[(10, 20, 30)], P[74.375, 7.625], L[ground, L4]], J[R, P[95.1972, 52.8805], L[L3]]]"""
PARALLEL = """M[J[R, P[0, 0], L[ground, link_1]], J[R, P[100, 0], L[ground, link_3]],
 J[R, P[0, 100], L[link_1, link_2]], J[R, P[100, 100], L[link_2, link_3]],]"""
INVERTED = """M[J[R, P[0, 0], L[ground, L1]], J[R, P[56, 0], L[ground, L3]], J[R, P[7, 25], L[L1, L2]],
 J[P, A[0.0], color[Green], P[59, 41], L[L3, L2]]]"""
STEPHENSON = """M[J[R, P[0.25, -0.625], L[ground, L1]], J[R, P[15.375, 41.125], L[L1, L2]],
 J[R, P[61.375, 95.125], L[L2, L3]], J[R, P[102.875, 84.375], L[L3, L4]], J[R, P[117.125, 23.375], L[ground, L4]],
 J[R, P[134.625, 119.875], L[L3, L5]], J[R, P[138.875, 33.125], L[ground, L5]]]"""


@cache
def driven(text: str, drive: tuple[int, int]) -> tuple[PathMotion, float]:
    """The imported mechanism's motion, and the input that it begins with."""
    joints = read_mechanism(SourceText("test.pyslvs", text))
    script = mechanism_script(joints, [drive], "test")
    first = float(re.search(r"input_\d+_\d+ = (\S+) \+ 60\*\.t", script)[1])  # pyright: ignore[reportOptionalSubscript]
    return moved(arranged(understand(SourceText("test.mov", script)), Choices())), first


def places(text: str, drive: tuple[int, int], value: float) -> dict[str, np.ndarray]:
    """All joints, (2,) each, as ``link.joint``, where the input has ``value`` degrees."""
    motion, first = driven(text, drive)
    poses = motion.poses_at([Fraction(((value - first) % 360.0) / 60.0)])
    assert poses.solved.all()
    return {
        f"{thing.name}.{anchor.name}": poses.world(thing.number, anchor.local)[0]
        for thing in motion.timeline.scene.things
        for anchor in thing.anchors
    }


@pytest.mark.parametrize(
    ("text", "drive", "value", "joint", "expected"),
    [
        (JANSEN, (0, 1), 0.0, "L7.P7", (-43.170055, -91.753226)),
        (JANSEN, (0, 1), 45.0, "L7.P7", (-24.406394, -91.789596)),
        (CRANK_SLIDER, (0, 1), 0.0, "L3.P5", (103.801126, 78.393173)),
        (PARALLEL, (0, 2), 0.0, "link_3.P3", (200.0, 0.0)),
    ],
)
def test_published_end_points(
    text: str, drive: tuple[int, int], value: float, joint: str, expected: tuple[float, float]
) -> None:
    assert places(text, drive, value)[joint] == pytest.approx(expected, abs=1e-6)


def test_a_rhombus_goes_on_through_both_of_its_folded_poses() -> None:
    for degrees in range(0, 360, 5):
        found = places(PARALLEL, (0, 2), float(degrees))
        turned = 100.0 * np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
        assert found["link_3.P3"] - [100.0, 0.0] == pytest.approx(turned, abs=1e-8)


def test_a_slot_that_moves_keeps_its_pin_and_its_angle() -> None:
    # L2 slides along a direction of L3 and does not turn in it
    for degrees in (10.0, 130.0, 250.0):
        found = places(INVERTED, (0, 2), degrees)
        slot = found["L3.S3"] - found["L3.P3"]
        pin = found["L2.P3"] - found["L3.P3"]
        assert slot[0] * pin[1] - slot[1] * pin[0] == pytest.approx(0.0, abs=1e-8)
        assert found["L2.S3"] - found["L2.P3"] == pytest.approx(slot, abs=1e-9)
        assert math.hypot(*(found["L2.P2"] - found["L2.P3"])) == pytest.approx(math.hypot(52, 16))


def test_what_no_triangle_order_solves_is_solved_as_well() -> None:
    for degrees in (0.0, 90.0, 200.0, 300.0):
        found = places(STEPHENSON, (0, 1), degrees)
        assert found["L3.P3"] == pytest.approx(found["L4.P3"], abs=1e-9)
        assert found["L5.P5"] == pytest.approx(found["L3.P5"], abs=1e-9)
        for link, a, b, length in [("L4", 3, 4, math.dist((102.875, 84.375), (117.125, 23.375))),
                                   ("L5", 5, 6, math.dist((134.625, 119.875), (138.875, 33.125))),
                                   ("L3", 2, 5, math.dist((61.375, 95.125), (134.625, 119.875)))]:  # fmt: skip
            assert math.dist(found[f"{link}.P{a}"], found[f"{link}.P{b}"]) == pytest.approx(length, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "found the end where `M`"),
        ("M[]", "no joint"),
        ("M[J[R, P[0, 0], L[ground]]", "the end"),
        ("M[J[Q, P[0, 0], L[ground]]]", "`R` or `P` or `RP`"),
        ("M[J[R, P[0 0], L[ground]]]", "`,`"),
        ("M[J[R, P[a, 0], L[ground]]]", "a number"),
        ("M[J[P, P[0, 0], L[ground, a]]]", "`A`"),
        ("M[J[RP, A[0], P[0, 0], L[ground]]]", "one that slides"),
        ("M[J[R, P[0, 0], L[a, a]]]", "named twice"),
        ("M[J[R, P[1e999, 0], L[a]]]", "too large"),
        ("M[J[R, P[0, 0], L[ground]]] M", "something follows"),
        ("M[J[R; P[0, 0], L[ground]]]", "`;` has no meaning"),
    ],
)
def test_what_is_wrong_has_its_place(text: str, words: str) -> None:
    with pytest.raises(ScriptError) as raised:
        read_mechanism(SourceText("test.pyslvs", text))
    (found,) = raised.value.diagnostics
    assert words in found.message
    assert found.span is not None


@pytest.mark.parametrize("drive", [(0, 9), (0, 2), (0, 0), (0, 7)])
def test_a_drive_that_is_none_is_told(drive: tuple[int, int]) -> None:
    with pytest.raises(UsageError):
        mechanism_script(read_mechanism(SourceText("test.pyslvs", JANSEN)), [drive], "jansen")


def test_links_may_have_names_that_the_language_does_not_allow() -> None:
    text = "M[J[R, P[0, 0], L[ground, _a-1, _a_1]], J[R, P[9, 0], L[_a-1]], J[R, P[0, 9], L[_a_1]]]"
    script = mechanism_script(read_mechanism(SourceText("x", text)), [(0, 1)], "names")
    moved(arranged(understand(SourceText("test.mov", script)), Choices()))
    assert "L_a_1 : .bar" in script
    assert "L_a_1_ : .bar" in script


def test_a_slider_can_be_driven() -> None:
    text = """M[J[RP, A[0.0], P[0.0, 0.0], L[ground, L2]], J[R, P[50.0, 0.0], L[ground, L1]],
              J[R, P[25.0, 27.0], L[L1, L2]]]"""
    script = mechanism_script(read_mechanism(SourceText("x", text)), [(0, 0)], "slider")
    motion = moved(arranged(understand(SourceText("test.mov", script)), Choices()))
    poses = motion.poses_at([Fraction(3, 2)])
    assert poses.variables["slide_0"][0] == pytest.approx(5.0)
    assert poses.world(0, (0.0, 0.0))[0] == pytest.approx([5.0, 0.0])


def test_the_command_imports(tmp_path: Path) -> None:
    source, script = tmp_path / "jansen.pyslvs", tmp_path / "jansen.mov"
    source.write_text(JANSEN)
    assert movimentum("import", str(source), "--drive", "0,1", "-o", str(script)).returncode == 0
    assert movimentum("check", str(script)).returncode == 0
    assert movimentum("import", str(source), "-o", str(script)).returncode == 0
    assert movimentum("import", str(source), "--drive", "0", "-o", str(script)).returncode == 2
    assert movimentum("import", str(source), "--snap", "-o", str(script)).returncode == 2
    source.write_text(JANSEN.replace("L[ground, L1]", "L[ground L1]", 1))
    assert movimentum("import", str(source), "-o", str(script)).returncode == 1
