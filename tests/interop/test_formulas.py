"""Triangular formulas: against numbers that Pyslvs publishes in its tests, and against the poses of scenes."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from movimentum.errors import ScriptError
from movimentum.interop.formulas import Formula, Formulas, evaluate, evaluate_each, formulas_text, read_formulas
from movimentum.interop.triangles import Triangles, triangles_of
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read
from movimentum.workflow.stages import arranged, moved, understand
from tests.command import ROOT, movimentum


def formulas(text: str) -> Formulas:
    return read_formulas(SourceText("test.pyslvs", text))


def point(text: str) -> list[float]:
    """The point that the only formula gives."""
    read = formulas(text)
    return evaluate(read)[read.formulas[-1].target].tolist()


# the values of Pyslvs' own test_core.py (Chang, AGPL; numbers only)
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("PXY[A, 40, -20](B); A = (80, 90)", (120, 70)),
        ("PPP[A, B, C](D); A=[0,0]; B=[0,90]; C=[90,0]", (90, 90)),
        (f"PLAP[A, {50 * sqrt(2)}, 45, B](C); A=[0,0]; B=[50,0]", (50, 50)),
        ("PLLP[A, 50, 50, B](C); A=[-30,0]; B=[30,0]", (0, 40)),
        ("PLLP[A, 30, 30, B](C); A=[-30,0]; B=[30,0]", (0, 0)),
        ("PLLP[A, 90, 30, B](C); A=[-30,0]; B=[30,0]", (60, 0)),
        (f"PLPP[A, {sqrt(5)}, B, C](D); A=[0,0]; B=[0,-3]; C=[1.5,0]", (2, 1)),
        ("PALP[A, 15, 20, B](C); A=[0,0]; B=[60,10]", (42.253221, 19.222356)),
    ],
)
def test_published_values(text: str, expected: tuple[float, float]) -> None:
    assert point(text) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("PLA[A, 10, 90](B); A=[1,2]", (1, 12)),
        ("PLA[A, 10, 90, T](B); A=[1,2]", (1, -8)),
        ("PLAP[A, 10, 90, B, T](C); A=[0,0]; B=[0,7]", (10, 0)),
        ("PLLP[A, 50, 50, B, T](C); A=[-30,0]; B=[30,0]", (0, -40)),
        ("PLLP[A, 50, 50, B, F](C); A=[-30,0]; B=[30,0]", (0, 40)),
        ("PLPP[A, 5, B, C, T](D); A=[0,3]; B=[0,0]; C=[9,0]", (-4, 0)),
        ("plpp[A,5,B,C](D);A=[0,3];B=[0,0];C=[9,0]", (4, 0)),
        ("PALP[A, 0, 5, B, T](C); A=[0,0]; B=[20,0]", (25, 0)),
        ("PALP[A, 0, 5, B](C); A=[0,0]; B=[-20,0]", (-25, 0)),
        ("PLAP[A, 10, 90](B); A=[1,2]", (1, 12)),  # from the x axis
        ("PLAP[A, 10, 90, T](B); A=[1,2]", (1, -8)),
        ("PLAP[A, 10, 90, false](B); A=[1,2]", (1, 12)),
        ("PLAP[A, 10, 90, T](B); A=[0,0]; T=[0,7]", (-10, 0)),  # T is a point here
        ("PLAP[A, 10, 90, T, T](B); A=[0,0]; T=[0,7]", (10, 0)),
    ],
)
def test_both_choices(text: str, expected: tuple[float, float]) -> None:
    assert point(text) == pytest.approx(expected, abs=1e-12)


def test_targets_are_arguments_of_later_formulas_over_arrays_of_inputs() -> None:
    chain = formulas(
        """PLA[P0, L0, a0](P1);  # the crank
           PLLP[P1, L1, L2, P2](P3); #[ a block
           comment #]
           PLAP[P1, L3, a1, P3](P4)
           P0 = [0, 0]
           P2 = [90, 0]
           L0 = 35; L1 = 70; L2 = 70; L3 = 40; a1 = 45"""
    )
    angles = np.linspace(0.0, 720.0, 97)
    found = evaluate(chain, {"a0": angles})
    crank = 35.0 * np.exp(1j * np.radians(angles))
    assert found["P1"] @ [1, 1j] == pytest.approx(crank, abs=1e-12)
    p3, p4 = found["P3"] @ [1, 1j], found["P4"] @ [1, 1j]
    assert abs(p3 - crank) == pytest.approx(np.full(97, 70.0))
    assert abs(p3 - 90.0) == pytest.approx(np.full(97, 70.0))
    assert ((90.0 - crank).conjugate() * (p3 - crank)).imag.min() > 0.0  # to the left of P1 to P2
    assert (p4 - crank) / (p3 - crank) == pytest.approx(np.full(97, 40.0 / 70.0 * np.exp(0.25j * np.pi)))


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("PLLP[A, 10, 10, B](C); A=[0,0]; B=[30,0]", "formula/unreachable", "PLLP[A, 10, 10, B](C)"),
        ("PLLP[A, 50, 10, B](C); A=[0,0]; B=[30,0]", "formula/unreachable", "by 10"),
        ("PLLP[A, 10, 10, B](C); A=[0,0]; B=[[1,0],[2,0],[30,0]]", "formula/unreachable", "at input 2 of 3"),
        ("PLPP[A, 1, B, C](D); A=[0,3]; B=[0,0]; C=[9,0]", "formula/unreachable", "by 2"),
        ("PLPP[A, 5, B, B](D); A=[0,3]; B=[0,0]", "formula/unreachable", "PLPP[A, 5, B, B](D)"),
        ("PLAP[A, 1, 5, A](D); A=[0,3]", "formula/unreachable", "A and A coincide"),
        ("PLLP[A, 5, 5, B](C); A=[1,2]; B=[1,2]", "formula/unreachable", "A and B coincide, and so do the circles"),
        ("PLLP[A, 5, 7, B](C); A=[1,2]; B=[1,2]", "formula/unreachable", "A and B coincide, and the circles"),
        ("PLLP[A, 5, 7, B](C); A=[1,2]; B=[1,2]", "formula/unreachable", "do not meet, by 2"),
        (
            "PLLP[A, 5, 5, B](C); A=[1,2]; B=[[1,3],[1,2.000000000000001]]",
            "formula/unreachable",
            "input 1 of 2: A and B",
        ),
        ("PLPP[A, 5, B, C](D); A=[0,0]; B=[1,1]; C=[1,1]", "formula/unreachable", "B and C coincide, and give no line"),
        ("PALP[A, 30, 5, B](D); A=[1,1]; B=[1,1]", "formula/unreachable", "A and B coincide, and give no direction"),
        ("PLA[A, L, 0](B); A=[0,0]; L=[1,2]; PLA[B, M, 0](C); M=[1,2,3]", "formula/counts", "`B` has 2, `M` has 3"),
        ("PLA[A, 1, 0](B); PLA[A, 2, 0](B); A=[0,0]", "formula/twice", "`B`"),
        ("PLA[A, 1, 0](B); A=[0,0]; A=[0,1]", "formula/twice", "`A`"),
        ("PLAP[A, 1](B); A=[0,0]", "formula/arguments", "the last one may be left out"),
        ("PLLP[A, L1, 10, B](C); A=[0,0]; B=[30,0]", "formula/unknown", "the length `L1`"),
        ("PLLP[A, 10, 10, B](C); A=[0,0]", "formula/unknown", "the point `B`"),
        ("PLA[A, 10, 10](C); A=7", "formula/kind", "`A` is not a point"),
        ("PLLP[A, 10, 10](C)", "formula/arguments", "point, length, length, point"),
        ("PLOP[A, 10, 10](C)", "formula/function", "PLOP"),
        ("PLA[A, 10, 10]", "formula/syntax", "not a formula"),
        ("A = [1, 2", "formula/value", "not a number"),
        ("A = [NaN, 2]", "formula/value", "not a number"),
    ],
)
def test_what_is_wrong_is_told_by_name(text: str, code: str, words: str) -> None:
    with pytest.raises(ScriptError) as raised:
        evaluate(formulas(text))
    (found,) = raised.value.diagnostics
    assert found.code == code
    assert words in found.message


def test_formulas_are_written_as_they_are_read() -> None:
    text = "PLA[P0, L0, a0](P1);\nPLPP[P1, L1, P2, P3, T](P4);\nP0 = [0.1, 2.0]\na0 = [0.0, 1.5]\n"
    read = formulas(text)
    assert read.formulas[1] == Formula("PLPP", ("P1", "L1", "P2", "P3"), "P4", inverse=True)
    assert formulas_text(read) == text


# --- scenes as formulas -----------------------------------------------------------------------------------


def triangles(script: str) -> Triangles:
    source = read(str(ROOT / "scripts" / f"{script}.mov"))
    return triangles_of(moved(arranged(understand(source), Choices())))


@pytest.mark.parametrize(
    ("script", "functions"),
    [
        ("four-bar", ["PLA", "PLLP", "PLAP"]),
        ("slider-crank", ["PLA", "PLPP"]),
        ("jansen", ["PLA", *["PLLP"] * 5]),
        ("peaucellier", ["PLA", "PLLP", "PLLP", "PLLP"]),
        ("watt", ["PLA", "PLLP", "PLAP"]),
        ("hoecken", ["PLA", "PLLP", "PLAP"]),
        ("coupling-rods", ["PLA", "PXY", "PXY"]),
        ("trammel", None),
        ("pantograph", None),
    ],
)
def test_formulas_give_the_positions_of_scenes(script: str, functions: list[str] | None) -> None:
    source = read(str(ROOT / "scripts" / f"{script}.mov"))
    motion = moved(arranged(understand(source), Choices()))
    found = triangles_of(motion)
    again = formulas(formulas_text(found.formulas, ["read back"]))
    places = evaluate(again) | {name: v for name, v in again.values.items() if v.shape[-1:] == (2,)}
    poses = motion.poses(0, motion.timeline.frame_count)
    scene = motion.timeline.scene
    thing_of = {thing.name: thing for thing in scene.things}
    compared = 0
    for name, told in found.names:
        for anchor_name in told.split(" = "):
            thing = thing_of[anchor_name.split(".")[0]]
            anchor = next(a for a in thing.anchors if a.name == anchor_name.split(".")[1])
            world = poses.world(thing.number, anchor.local)
            assert np.max(np.abs(world - places[name])) <= 1e-12 * motion.size
            compared += 1
    assert compared >= 3
    if functions is not None:
        used = [f.function for f in found.formulas.formulas]
        assert [name for name in functions if name in used] == functions
        assert used[: len(functions)] == functions or set(functions) <= set(used)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("@0 A.P = [0,0]; A.Q = B.P; B.Q = [15,0];\n", None),
        ("@0 A.P = [0,0]; A.Q = B.P;\n", "export/not-triangular"),
        ("@0 A.P = [0,0]; A.angle = 90*.t;\n@1 A.angle = 90;\n@2\n", "export/steps"),
    ],
)
def test_what_no_triangle_gives_is_refused(text: str, code: str | None) -> None:
    bars = ".config(4);\nA : .bar P = [0,0] Q = [10,0];\nB : .bar P = [10,0] Q = [15,-9];\n"
    motion = moved(arranged(understand(SourceText("test.mov", bars + text)), Choices()))
    if code is None:
        assert triangles_of(motion).error < 1e-12
        return
    with pytest.raises(ScriptError) as raised:
        triangles_of(motion)
    assert raised.value.diagnostics[-1].code == code


def test_the_command_exports_formulas() -> None:
    done = movimentum("export", str(ROOT / "scripts" / "four-bar.mov"), "--format", "pyslvs", "-o", "-")
    assert done.returncode == 0
    places = evaluate(formulas(done.stdout))
    assert places["P2"].shape == (len(formulas(done.stdout).values["a0"]), 2)
    assert (
        movimentum("export", str(ROOT / "scripts" / "walschaerts.mov"), "--format", "pyslvs", "-o", "-").returncode == 1
    )


def test_inputs_without_points_are_told_and_the_others_computed() -> None:
    formulas = read_formulas(SourceText("x", "PLA[P0, 35, a0](P1); PLLP[P1, 30, 70, P2](P3); P0 = [0,0]; P2 = [90,0]"))
    angles = np.linspace(0.0, 360.0, 25)
    found = evaluate_each(formulas, {"a0": angles})
    distance = np.hypot(35.0 * np.cos(np.radians(angles)) - 90.0, 35.0 * np.sin(np.radians(angles)))
    bad = distance > 100.0
    assert 0 < bad.sum() < 25
    assert (np.isnan(found.points["P3"]).any(axis=1) == bad).all()
    assert (np.isnan(found.points["P1"]).any(axis=1) == bad).all()
    (unreachable,) = found.unreachable
    assert unreachable.rows.tolist() == np.flatnonzero(bad).tolist()
    assert f"at {bad.sum()} of 25 inputs, the first is input {np.argmax(bad)}: " in unreachable.diagnostic.message
    good = evaluate(formulas, {"a0": angles[~bad]})
    assert (found.points["P3"][~bad] == good["P3"]).all()
    held = evaluate_each(formulas, {"a0": angles}, "hold").points["P3"]
    last = int(np.argmax(bad)) - 1
    assert (held[bad] == held[last]).all()
    assert (held[~bad] == good["P3"]).all()
    with pytest.raises(ScriptError):
        evaluate_each(formulas, {"a0": angles}, "stop")


def test_two_reasons_are_told_apart_and_no_input_twice() -> None:
    text = "PLAP[A, 10, 30, B](T); PLLP[T, 5, 5, C](U); A = [0,0]; C = [30, 0]"
    b = [[0, 0], [1, 0], [1, -1], [0, 0], [1, -0.577]]
    found = evaluate_each(
        read_formulas(SourceText("x", text)), {"B": b, "C": [[0, 0], [12, 5], [30, 0], [1, 1], [15, 0]]}
    )
    assert [each.rows.tolist() for each in found.unreachable] == [[0, 3], [2]]
    assert "coincide" in found.unreachable[0].diagnostic.message
    assert "do not meet" in found.unreachable[1].diagnostic.message
    assert np.isfinite(found.points["U"][[1, 4]]).all()


def test_a_hold_before_the_first_point_is_nan() -> None:
    formulas = read_formulas(SourceText("x", "PLLP[A, L, 10, B](T); A = [0,0]; B = [15, 0]"))
    held = evaluate_each(formulas, {"L": [1.0, 10.0, 1.0]}, "hold").points["T"]
    assert np.isnan(held[0]).all()
    assert (held[1] == held[2]).all()
