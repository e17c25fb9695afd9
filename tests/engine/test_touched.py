"""The first picture after an edit of one mechanism among many: what it does not touch is not solved again."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random

import pytest

from movimentum.solver.poses import Poses
from movimentum.source import SourceText
from movimentum.workflow.engine import Engine, Revision
from tests.broad import broad
from tests.engine.families import bars, dyads
from tests.engine.test_engine import _counting  # pyright: ignore[reportPrivateUsage]

TIME = 0.3


def _first_picture(engine: Engine, text: str) -> tuple[Revision, Poses]:
    revision = engine.revise(SourceText("x.mov", text))
    poses = revision.preview(Fraction("0.3"))
    assert poses is not None
    return revision, poses


def _place(revision: Revision, poses: Poses, thing: str, anchor: str) -> list[float]:
    found = next(each for each in revision.scene.things if each.name == thing)
    local = next(each.local for each in found.anchors if each.name == anchor)
    return poses.world(found.number, local)[0].tolist()


def _crank(number: int, spacing: float, length: float, speed: float) -> list[float]:
    turn = math.radians(speed * TIME)
    return [spacing * number + length * math.cos(turn), length * math.sin(turn)]


@broad("seed", range(4), first=3)
def test_driven_bars_stand_where_their_angles_say(seed: int) -> None:
    random, engine, count = Random(seed), Engine(), 8
    speeds, lengths = [60.0 + n for n in range(count)], [20.0] * count
    text = bars(count)
    assert engine.revise(SourceText("x.mov", text)).motion.segments
    for _ in range(6):
        n = random.randrange(count)
        if random.random() < 0.5:
            speed = float(random.randrange(10, 90))
            text = text.replace(f"B{n}.angle = {speeds[n]:g}*", f"B{n}.angle = {speed:g}*")
            speeds[n] = speed
        else:
            end = 40 * n + random.randrange(10, 30)
            text = text.replace(f" B=[{40 * n + lengths[n]:g},0];", f" B=[{end},0];")
            lengths[n] = end - 40.0 * n
        revision, poses = _first_picture(engine, text)
        for k in range(count):
            expected = _crank(k, 40.0, lengths[k], speeds[k])
            assert _place(revision, poses, f"B{k}", "B") == pytest.approx(expected, abs=1e-9)
        if random.random() < 0.7:  # else the next picture is next to an older motion
            assert revision.motion.segments


@pytest.mark.parametrize("seed", range(4))
def test_sliders_stand_where_the_law_of_the_slider_crank_says(seed: int) -> None:
    random, engine, count = Random(seed), Engine(), 5
    speeds = [60.0 + n for n in range(count)]
    text = dyads(count)
    assert engine.revise(SourceText("x.mov", text)).motion.segments
    for _ in range(6):
        n = random.randrange(count)
        speed = float(random.randrange(10, 90))
        text = text.replace(f"C{n}.angle = {speeds[n]:g}*", f"C{n}.angle = {speed:g}*")
        speeds[n] = speed
        revision, poses = _first_picture(engine, text)
        for k in range(count):
            pin = _crank(k, 80.0, 10.0, speeds[k])
            slider = [pin[0] + math.sqrt(40.0**2 - pin[1] ** 2), 0.0]
            assert _place(revision, poses, f"R{k}", "D") == pytest.approx(slider, abs=1e-9)
        assert revision.motion.segments


def test_a_variable_of_what_is_not_touched_keeps_its_value() -> None:
    text = (
        ".config(10);\nA : .bar P=[0,0] Q=[20,0];\nB : .bar P=[50,0] Q=[70,0];\n"
        "@0\nA.P = [0,0];  A.angle = 30*.t;  B.P = [50,0];  B.angle = 40*.t;  x = A.Q.x;\n@1\n"
    )
    engine = Engine()
    assert engine.revise(SourceText("x.mov", text)).motion.segments
    _, poses = _first_picture(engine, text.replace("40*", "41*"))
    assert "x" not in poses.missing
    assert poses.variables["x"][0] == pytest.approx(20.0 * math.cos(math.radians(30.0 * TIME)), abs=1e-9)
    _, ended = _first_picture(engine, text.replace("  x = A.Q.x;", ""))
    assert "x" not in ended.variables


def test_what_is_pinned_to_another_part_is_touched_with_it() -> None:
    text = (
        ".config(10);\nA : .bar P=[0,0] Q=[20,0];\nB : .bar P=[20,0] Q=[40,0];\nC : .bar P=[90,0] Q=[99,0];\n"
        "@0\nA.P = [0,0];  A.angle = 30*.t;  B.P = A.Q;  B.angle = 0;  C.P = [90,0];  C.angle = 50*.t;\n@1\n"
    )
    engine = Engine()
    assert engine.revise(SourceText("x.mov", text)).motion.segments
    revision, poses = _first_picture(engine, text.replace("30*", "80*"))
    x, y = _crank(0, 0.0, 20.0, 80.0)
    assert _place(revision, poses, "B", "Q") == pytest.approx([x + 20.0, y], abs=1e-9)
    assert _place(revision, poses, "C", "Q") == pytest.approx(
        [90.0 + 9.0 * math.cos(math.radians(15.0)), 9.0 * math.sin(math.radians(15.0))], abs=1e-9
    )


def test_an_edit_of_one_bar_of_sixty_solves_that_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    engine, text = Engine(), bars(60)
    assert engine.revise(SourceText("x.mov", text)).motion.segments
    begun = _counting(monkeypatch, "movimentum.solver.kinds.kernels", "begin")
    _first_picture(engine, text.replace("B30.angle = 90", "B30.angle = 91"))
    assert 0 < begun["begin"] <= 12  # its own blocks, tried as drawn, as shown and as they come
