"""What Python users see: scripts, motions, values by name, errors, pictures and tables."""

from __future__ import annotations

import json
import math
import pickle
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from tests.command import CRANK, movimentum

ARM = """
    .config(10);
    Arm : .bar O=[0,0] P=[10,0] .color('#102030');
    @0 Arm.O=[20,0]; Arm.angle = 90*.t; x = 3*.t; v = [x, 2]; Arm.opacity = 1 - .t/4;
    @2 late = 5; x = 1;
    @3
"""
BINDS = "Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A=[0,0]; Rod.B=[30 + 40*.t, y]; y > 0; @1"


@pytest.fixture(scope="module")
def arm() -> mv.Motion:
    return mv.loads(ARM, name="arm.mov").solve()


# --- reading


def test_a_file_and_its_text_are_one_script(tmp_path: Path):
    path = tmp_path / "crank.mov"
    path.write_text(CRANK, encoding="utf-8")
    script = mv.load(path)
    assert (script.text, script.path, script.name) == (CRANK, path, "crank.mov")
    assert mv.loads(CRANK).path is None
    assert np.array_equal(script.solve()["Rod.B"], mv.loads(CRANK).solve()["Rod.B"])


def test_pictures_are_found_from_the_folder_of_the_name(tmp_path: Path):
    Image.new("RGB", (40, 20), "red").save(tmp_path / "red.png")
    text = "Wing : 'red.png' O = [0,0]; @0 Wing.O = [50,50];"
    assert mv.loads(text, name=str(tmp_path / "wing.mov")).scene.things[0].picture.image_size == (40, 20)
    with pytest.raises(mv.ScriptError, match="asset/"):
        mv.loads(text, name="nowhere/wing.mov")


@pytest.mark.parametrize("name", ["R", "fps", "strict", "limits", "path", "text", "self"])
def test_a_keyword_is_a_constant_and_nothing_else(name: str):
    with pytest.raises(mv.UsageError) as caught:
        mv.loads(CRANK, **{name: 60})
    assert [item.code for item in caught.value.diagnostics] == ["usage/constant"]
    assert f"`{name}`" in str(caught.value)


def test_errors_print_as_in_a_terminal_and_keep_their_data():
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads("Rod : .bar A=[0,0] B=[9,0];\n@0 Rod.C = [0,0];", name="rod.mov")
    told = str(caught.value)
    for part in ("error[name/unknown-anchor]", "--> rod.mov:2:8", "@0 Rod.C = [0,0];", "^", "= help: "):
        assert part in told
    assert caught.value.diagnostics[0].helps
    assert "rod.mov:2:8" in str(pickle.loads(pickle.dumps(caught.value)))


def test_limits_are_given_before_the_keywords():
    with pytest.raises(mv.ScriptError, match="limit/nesting"):
        mv.loads("@0 x = ((((1))));", mv.Limits(nesting=2))
    with pytest.raises(mv.UsageError, match="limit/digits"):
        mv.loads("@0 x = 1;", mv.Limits(digits=60)).solve("exact", digits=61)


# --- diagnostics and solving


def test_diagnostics_are_what_check_says(tmp_path: Path):
    path = tmp_path / "loose.mov"
    path.write_text("Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A = [9,9]; @1", encoding="utf-8")
    told = json.loads(movimentum("check", str(path), "--format", "json").stdout)["diagnostics"]
    script = mv.load(path)
    assert [(d.code, d.severity.value, d.message, list(d.helps)) for d in script.diagnostics] == [
        (d["code"], d["severity"], d["message"], d["helps"]) for d in told
    ]
    assert told


def test_where_there_is_no_solution():
    script = mv.loads(BINDS)
    with pytest.raises(mv.NoSolutionError) as caught:
        script.solve()
    assert caught.value.diagnostics[0].code == "solve/unreachable"
    hold, skip = script.solve(on_failure="hold"), script.solve(on_failure=mv.FailurePolicy.SKIP)
    assert hold.solved.tolist() == [True] * 13 + [False] * 13
    assert skip.frames.tolist() == list(range(13))
    assert np.array_equal(hold["Rod.B"][:13], skip["Rod.B"])
    assert np.all(hold["Rod.B"][13:] == hold["Rod.B"][13])
    assert np.isnan(hold.velocity("Rod.B")[13:]).all()
    assert np.isfinite(hold.velocity("Rod.B")[:13]).all()
    assert hold.at(0.9).solved.tolist() is False
    assert any(item.severity is mv.Severity.ERROR for item in hold.diagnostics)
    assert any(item.code == "solve/unreachable" for item in script.diagnostics)


def test_strict_and_contradictions_are_the_scripts_fault():
    loose = mv.loads("Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A = [9,9]; @1")
    assert len(loose.solve()) == 26
    with pytest.raises(mv.ScriptError, match="constraint/free-motion"):
        loose.solve(strict=True)
    with pytest.raises(mv.ScriptError, match="constraint/conflict"):
        mv.loads("@0 x = 1; x + 0 = 2;").solve(on_failure="hold")


def test_choices_that_do_not_fit_are_refused():
    script = mv.loads(ARM)
    for call in (
        lambda: script.solve("hihg"),
        lambda: script.solve(on_failure="ignore"),
        lambda: script.solve(digits=30),
        lambda: script.solve("exact", digits=0),
        lambda: script.solve(fps=0),
        lambda: script.solve(fps="fast"),
        lambda: script.solve().at(-1),
        lambda: script.solve().at(math.inf),
    ):
        with pytest.raises(mv.UsageError) as caught:
            call()
        assert caught.value.diagnostics[0].code.startswith(("usage/", "limit/"))
    with pytest.raises(mv.UsageError, match="did you mean"):
        script.solve("hihg")


def test_every_accuracy_gives_the_same_motion_better_or_worse():
    script = mv.loads(CRANK)
    motions = {tier: script.solve(tier) for tier in mv.Accuracy}
    exact = motions[mv.Accuracy.EXACT]
    for tier, motion in motions.items():
        off = np.max(np.abs(motion["Rod.B"] - exact["Rod.B"]))
        assert off < 1e-11
        assert motion.accuracy is tier
        assert motion.solution.motion.size == exact.solution.motion.size
        assert np.array_equal(motion.velocity("Rod.B"), exact.velocity("Rod.B"))
        assert motion.poses(3, 5).angle.shape == (2, 2)
        assert motion.solution.motion.poses_at([Fraction(1, 3)]).solved.all()
    assert motions[mv.Accuracy.HIGH].solution.motion.notes == ()


@pytest.mark.slow
def test_a_draft_of_thousands_of_frames_tells_its_error():
    script = mv.loads("Arm : .bar O = [100,100] P = O + [60,0]; @0 Arm.O = [100,100]; Arm.P ~ [180, 100 + 60*.t]; @2")
    draft = script.solve("draft", fps=2000)
    assert [item.code for item in draft.solution.motion.notes] == ["solve/draft"]
    assert 0 < np.max(np.abs(draft["Arm.P"] - script.solve(fps=2000)["Arm.P"])) < 2e-3


def test_solving_again_costs_nothing(monkeypatch: pytest.MonkeyPatch):
    from movimentum.api import understood as module

    calls: list[object] = []
    examined = module.examined
    monkeypatch.setattr(module, "examined", lambda *a: calls.append(a) or examined(*a))
    script = mv.loads(BINDS)
    _ = script.diagnostics, script.solve(on_failure="hold"), script.solve(on_failure="skip"), script.diagnostics
    assert len(calls) == 1
    script.solve(fps=50, on_failure="hold")
    assert len(calls) == 2


# --- values


def test_values_by_name(arm: mv.Motion):
    assert len(arm) == 31
    assert arm.times.tolist() == [k / 10 for k in range(31)]
    assert arm.solved.dtype == np.bool_
    angle = arm["Arm.angle"]
    assert np.allclose(angle, 90 * arm.times, rtol=0, atol=1e-12)
    place = arm["Arm.P"]
    assert np.allclose(place, np.stack([20 + 10 * np.cos(np.radians(angle)), 10 * np.sin(np.radians(angle))], 1))
    assert np.array_equal(arm["Arm.P.x"], place[:, 0])
    assert np.array_equal(arm[" Arm.P.y "], place[:, 1])
    assert arm["v"].shape == (31, 2)
    assert np.array_equal(arm["v.x"], arm["x"])
    assert np.allclose(arm["Arm.opacity"], 1 - arm.times / 4)
    assert set(arm["Arm.red"]) == {16.0}
    assert np.isnan(arm["late"]).tolist() == [True] * 20 + [False] * 11


def test_values_of_expressions(arm: mv.Motion):
    assert np.allclose(arm["(Arm.P - Arm.O).l"], 10)
    assert np.allclose(arm["Arm.P + [1, 2]"], arm["Arm.P"] + [1, 2])
    assert np.allclose(arm[".sin(Arm.angle) + 2*x"], np.sin(np.radians(90 * arm.times)) + 2 * arm["x"])
    assert np.allclose(arm[".t"], arm.times)


def test_what_is_given_is_the_callers(arm: mv.Motion):
    for read in (lambda: arm["Arm.P"], lambda: arm.times, lambda: arm.velocity("Arm.P"), lambda: arm.frames):
        first = read()
        first += 7
        assert not np.array_equal(first, read())


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("Arm.Q", "did you mean `Arm.O`?"),
        ("Amr.P", "did you mean `Arm.P`?"),
        ("lat", "did you mean `late`?"),
        ("Arm.elbow", "there are `Arm.O`, `Arm.P` and `Arm.angle`"),
        ("Arm.P + Leg.Q", None),
    ],
)
def test_unknown_names(arm: mv.Motion, name: str, told: str | None):
    for read in (arm.__getitem__, arm.velocity, arm.at(1).__getitem__):
        with pytest.raises(KeyError) as caught:
            read(name)
        assert isinstance(caught.value, mv.UnknownNameError)
        if told is not None:
            assert caught.value.diagnostics[0].helps == (told,)
        assert str(caught.value).startswith("error[name/")


@pytest.mark.parametrize("text", ["", "Arm.P +", "Arm.P; x", "_", "Arm", ".d(x)", "Arm.P = x", "Arm.P.l < 3"])
def test_what_is_no_expression(arm: mv.Motion, text: str):
    with pytest.raises(mv.ScriptError) as caught:
        arm[text]
    assert not isinstance(caught.value, KeyError)


def test_moments_between_frames(arm: mv.Motion):
    assert arm.at(0.25)["Arm.angle"].shape == ()
    assert arm.at(0.25)["Arm.angle"] == pytest.approx(22.5)
    assert arm.at(Fraction(1, 3))["Arm.P"].shape == (2,)
    several = arm.at([1, 0.5, "1/3"])
    assert several.times.tolist() == [1.0, 0.5, 1 / 3]
    assert np.allclose(several["Arm.angle"], [90, 45, 30])
    assert several.velocity("Arm.P").shape == (3, 2)
    assert np.allclose(several.velocity("x"), 3)
    assert arm.at(np.array([0.1, 0.2]))["x"] == pytest.approx([0.3, 0.6])
    assert len(arm.at([]).times) == 0


def test_a_float_means_the_time_that_it_is_rounded_to():
    motion = mv.loads(".config(10); @0 x = .t; @0.3 x = 5; @+1/3 x = 7; @1").solve()
    assert motion.at(0.3)["x"] == 5
    assert motion.at(0.3 + 1 / 3)["x"] == 7
    assert motion.at(float(np.nextafter(0.3, 0)))["x"] == pytest.approx(0.3)


def test_velocities_of_everything_that_has_a_value(arm: mv.Motion):
    early = arm.times < 2
    assert np.allclose(arm.velocity("Arm.angle"), 90)
    assert np.allclose(arm.velocity("x"), np.where(early, 3, 0))
    assert np.allclose(arm.velocity("v"), np.stack([np.where(early, 3, 0), np.zeros(31)], 1))
    assert np.allclose(arm.velocity("Arm.opacity"), -0.25)
    assert np.allclose(arm.acceleration("Arm.P"), -((math.pi / 2) ** 2) * (arm["Arm.P"] - [20, 0]))
    way = "(Arm.P - [20, 20]).l"
    expected = np.sum(arm.velocity("Arm.P") * (arm["Arm.P"] - [20, 20]), axis=1) / arm[way]
    assert np.allclose(arm.velocity(way), expected)
    assert np.isnan(arm.velocity("late")).tolist() == [True] * 20 + [False] * 11


def test_a_wish_has_no_acceleration():
    motion = mv.loads("Arm : .bar O=[0,0] P=[9,0]; @0 Arm.O=[0,0]; Arm.P ~ [0,9] .speed(3); @1").solve()
    assert np.isfinite(motion.velocity("Arm.P")).all()
    with pytest.raises(mv.UsageError) as caught:
        motion.acceleration("Arm.P")
    assert caught.value.diagnostics[0].code == "usage/no-acceleration"


# --- pictures and tables


def test_a_picture_is_the_commands_byte_for_byte(tmp_path: Path):
    path = tmp_path / "arm.mov"
    path.write_text(ARM, encoding="utf-8")
    options = [
        "--frames",
        "3:9",
        "--scale",
        "2",
        "--trace",
        "Arm.P",
        "--show",
        "names,anchors",
        "--background",
        "white",
    ]
    movimentum(
        "run",
        str(path),
        "-o",
        str(tmp_path / "one.gif"),
        *options,
        "--loop",
        "2",
        "--background",
        "white",
        "--quality",
        "draft",
    )
    written = mv.load(path).solve().render(
        tmp_path / "two.gif", frames=slice(3, 9), scale=2, trace="Arm.P", show=["names", "anchors"],
        background="white", loop=2, quality="draft",
    )  # fmt: skip
    assert (written.path, written.frames) == (tmp_path / "two.gif", 6)
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()


def test_stills_and_other_choices_for_a_picture(tmp_path: Path):
    motion = mv.loads(ARM).solve()
    assert motion.render(tmp_path / "a.png", at=0.33).frames == 1
    assert motion.render(tmp_path / "a.gif", fps=20, frames="0:4", workers=1).frames == 4
    assert motion.render(str(tmp_path / "b.gif"), accuracy="draft", frames=range(2), workers=1).frames == 2
    hold = mv.loads(BINDS).solve(on_failure="hold")
    assert hold.render(tmp_path / "c.gif", workers=1).frames == 26
    assert hold.render(tmp_path / "c.gif", on_failure="skip", workers=1).frames == 13
    with pytest.raises(mv.NoSolutionError):
        hold.render(tmp_path / "d.gif", on_failure="stop")
    assert not (tmp_path / "d.gif").exists()


def test_pictures_that_cannot_be(tmp_path: Path):
    motion = mv.loads(ARM).solve()
    for options in (
        {"at": 1, "frames": 3}, {"scale": 0}, {"scale": math.nan}, {"quality": "best"}, {"show": "everything"},
        {"trace": "Arm.Q"}, {"background": "nocolour"}, {"frames": "5:5"}, {"frames": slice(0, 9, 2)}, {"at": 99},
    ):  # fmt: skip
        with pytest.raises(mv.MovimentumError):
            motion.render(tmp_path / "x.gif", **options)
    with pytest.raises(mv.UsageError):
        motion.render(tmp_path / "x.xyz")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".csv", ".json", ".npz"])
def test_a_table_is_the_commands(tmp_path: Path, suffix: str):
    path = tmp_path / "arm.mov"
    path.write_text(ARM, encoding="utf-8")
    movimentum("solve", str(path), "-o", str(tmp_path / f"one{suffix}"))
    assert mv.load(path).solve().save(tmp_path / f"two{suffix}").frames == 31
    assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()
    with pytest.raises(mv.UsageError):
        mv.load(path).solve().save(tmp_path / "arm.txt")


def test_a_data_frame_has_the_tables_columns(arm: mv.Motion, monkeypatch: pytest.MonkeyPatch):
    class Pandas:
        """As much of pandas as is used, for machines without it."""

        @staticmethod
        def Index(values, name):
            return list(values), name

        @staticmethod
        def DataFrame(table, index):
            return table, index

    monkeypatch.setitem(sys.modules, "pandas", Pandas)
    table, (frames, name) = arm.to_dataframe()
    assert name == "frame"
    assert frames == list(range(31))
    assert list(table)[:6] == ["time", "Arm.O.x", "Arm.O.y", "Arm.P.x", "Arm.P.y", "Arm.angle"]
    assert set(list(table)[6:]) == {"x", "v.x", "v.y", "late"}
    assert np.array_equal(table["Arm.P.x"], arm["Arm.P.x"])
    assert np.isnan(table["late"]).sum() == 20


def test_without_pandas_it_says_what_to_install(arm: mv.Motion, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        arm.to_dataframe()


def test_short_names_for_everything(arm: mv.Motion):
    assert repr(arm.script) == "Script(arm.mov: 1 thing, 3 steps)"
    assert repr(arm) == "Motion(arm.mov: 31 frames, 1 thing, 0 to 3)"
    assert repr(arm.at([0, 1])) == "Moments(arm.mov: 2 times)"
