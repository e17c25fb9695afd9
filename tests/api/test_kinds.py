"""Every function and method of the package, with arguments of every kind: an error is one of ours, and speaks Python.

What is tried is read from the signatures, so a new method or a new keyword is tried too.
"""

from __future__ import annotations

import gc
import inspect
import pickle
import re
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import movimentum as mv
from movimentum.advice import Advised, Choose, ScriptCommand
from movimentum.api.arguments import _SPARING, QualityWord, ShowWord, in_python
from movimentum.cli.app import commands
from movimentum.diagnostics import Diagnostic
from movimentum.drawing.picture_options import Quality, Show
from movimentum.settings import AccuracyWord, FailureWord
from tests.broad import broad

SCRIPT = """.let R = 30 .range(10, 80);
.config(10, 60, 60);
Arm : .bar O = [0,0] P = [R,0];
@0 Arm.O = [9,9]; Arm.angle = 90*.t;  .goal .max(Arm.P.y) = 50;
@0.3
"""
NUMBERS: list[Any] = [
    None, True, 0, -1, 7, 10**30, 1.5, -0.0, float("nan"), float("inf"), 1e300, 2 + 3j, Fraction(1, 3), Decimal("0.1"),
    np.int64(1), np.float64(0.1), np.array(0.1), np.array([0.1, 0.2]), np.array(["a"]), np.bool_(True),
]  # fmt: skip
TEXTS: list[Any] = [
    "", "a", "Arm.P", "0:3", "1/3", "1/0", "\0", "\ud800", "x" * 300, "..", b"Arm.P", ".gif", ".csv", "a/", "%d.png",
    "x\0.gif", "x\0.csv", "x\ud800.gif", "x\ud800.csv", "x\0.mov", "y%q.png", "n/x.csv", Path("no/such/folder/x.gif"),
]  # fmt: skip
SEVERAL: list[Any] = [
    [], [1, 2], ["a"], ["Arm.P", 5], [[1]], (), (1, "b"), {}, {"R": 5}, {5: "R"}, {"a b": 1}, {"R": (1, 2)},
    {"R": None}, {"R": "abc"}, set(), range(3), range(9, 0, -1), slice(0, 2), slice("a", None), slice(1.5, None),
    slice(None, None, 0), (n for n in [0.1]),
]  # fmt: skip
ODD = [*NUMBERS, *TEXTS, *SEVERAL, object(), int, len, mv.Accuracy.HIGH, mv.Limits(), Ellipsis]

BINDS = "Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A=[0,0]; Rod.B=[30 + 40*.t, y]; y > 0; @1"


def tried(owner: object) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Every function of the package or public method of an object, with those that subscripts call."""
    for name, value in inspect.getmembers(type(owner) if owner is not mv else mv, inspect.isfunction):
        if not name.startswith("_") or name in ("__getitem__", "__contains__"):
            yield name, value if owner is mv else getattr(owner, name)


def owners() -> list[object]:
    script = mv.loads(SCRIPT)
    motion = script.solve()
    fit, sweep = script.fit(), script.sweep(R=[20, 30], measure={"top": ".max(Arm.P.y)"})
    return [mv, script, motion, motion.at(0.1), motion.at([0, "0.2"]), sweep, fit]


def good(name: str, folder: Path) -> Any:
    """An argument that fits, for parameters without a default."""
    known = {"path": folder / "x.csv", "text": SCRIPT, "name": "Arm.P", "time": 0.1, "constants": {"R": 40}}
    return known.get(name)


OPTION = re.compile(r"(?<![\w-])--[a-z]")


def calls(called: str, function: Callable[..., Any], folder: Path) -> Iterator[tuple[str, Any, Callable[[], object]]]:
    """Every call with one argument of an odd kind: the parameter, the argument, and what makes the call."""
    parameters = inspect.signature(function).parameters
    for name, parameter in parameters.items():
        for value in ODD:
            if name in ("effort", "workers") and str(value) in ("7", str(10**30)):
                continue  # good, and long
            given = {p.name: good(p.name, folder) for p in parameters.values() if p.default is p.empty}
            given[name] = value
            if parameter.kind is parameter.VAR_KEYWORD:
                given["R"] = given.pop(name)
            given.pop("intervals", None)
            ahead = [given.pop(p.name) for p in parameters.values() if p.kind is p.POSITIONAL_ONLY and p.name in given]
            ahead += [given.pop(p.name) for p in parameters.values() if p.kind is p.VAR_POSITIONAL and p.name in given]
            yield name, value, partial(function, *ahead, **given)


def found(*_: object, **__: object) -> None:
    """In place of a fit, which would take long."""
    raise mv.UsageError([])


@broad("place", range(7), every=3)
def test_an_argument_of_any_kind_is_understood_or_refused(place: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("click.launch", lambda *_: None)
    owner, wrong = owners()[place], list[object]()
    monkeypatch.setattr("movimentum.fitting.fit.fit", found)
    for called, function in tried(owner):
        for name, value, call in calls(called, function, tmp_path):
            try:
                call()
            except mv.MovimentumError as error:
                if OPTION.search(str(error)):
                    wrong.append((called, name, value, str(error)))
            except ImportError:
                assert called == "to_dataframe"
            except Exception as error:
                wrong.append((called, name, value, repr(error)))
    assert wrong == []


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda m: m[0], '`motion[…]` takes a text, not 0\n   = help: `motion["…"][0]`: first the name, then the row'),
        (lambda m: m.render("x.gif", workers="a"), "`workers` is a whole number or None, not 'a'"),
        (
            lambda m: m.render("x.gif", frames=[1, 2]),
            "`frames` is a slice, a range, a whole number, a text or None",
        ),
        (
            lambda m: m.render("x.gif", frames="9:9"),
            "frames chooses none of the 4 frames (0 to 3)",
        ),
        (lambda m: m.render("x.gif", scale="x"), "`scale` is a number or None, not 'x'"),
        (lambda m: m.render("x.gif", quality=5), '`quality` is "draft", "standard" or "high", not 5'),
        (lambda m: m.render("x.bmp"), 'help: "x.png"'),
        (lambda m: m.render("x.gif", trace=["Arm.Q"]), 'help: trace="Arm.'),
        (lambda m: m.render("x.gif", trace="Arm.Q"), 'help: trace="Arm.O"'),
        (lambda m: m.render("x.gif", background="whit"), 'help: background="white"'),
        (lambda m: m.poses(-1), "`poses`: there are no frames -1 to 4: there are 4, and the first is frame 0"),
        (lambda m: m.poses(0, 5), "there are no frames 0 to 5"),
        (lambda m: m.script.fit(client=5), "`client` is a `distributed.Client`, not 5"),
        (lambda m: m.script.fit(R=(5, 1)), "help: R=(10, 20)"),
        (lambda m: mv.Limits(frames=0), "`Limits`: `frames` is a whole number of at least 1, not 0"),
        (lambda m: mv.loads(SCRIPT, mv.Limits(frames=2)).solve(), "raise the limit with `Limits(frames="),
        (lambda m: mv.loads(SCRIPT, mv.Limits(operations=2)), "`Limits(operations="),
        (lambda m: mv.loads(BINDS).solve(), '`on_failure="hold"` keeps the last good pose, `on_failure="skip"` leaves'),
    ],
)
def test_errors_name_keywords(call: Callable[[mv.Motion], object], told: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(mv.MovimentumError) as caught:
        call(mv.loads(SCRIPT).solve())
    assert told in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_diagnostics_name_keywords_too() -> None:
    (item, *_) = mv.loads(BINDS).diagnostics
    assert '`on_failure="hold"` keeps the last good pose' in item.helps[0]


def test_every_option_that_python_has_too_is_worded_so() -> None:
    """An option of `run`, `solve`, `sweep` or `fit` whose name is a keyword here is one in advice; all that advice
    names are options of some command.
    """
    keywords = {name for kind in (mv.Script, mv.Motion) for _, call in inspect.getmembers(kind, inspect.isfunction)
                for name in inspect.signature(call).parameters}  # fmt: skip
    keywords |= {"set", "output", "dask", "vary"}
    of: dict[str, set[str]] = {}
    for name, command in commands.commands.items():
        for parameter in command.params:
            for option in parameter.opts:
                of.setdefault(option.removeprefix("--"), set()).add(name)
    for choice in Choose:
        assert choice.value in of, choice
        if of[choice.value] & {"run", "solve", "sweep", "fit"} and choice.value.replace("-", "_") in keywords:
            said = Diagnostic("x", mv.Severity.ERROR, Advised("`", choice.to(), "`"), helps=(choice.to(5),))
            (item,) = in_python([said])
            assert not OPTION.search(item.message + item.helps[0]), choice


@pytest.mark.parametrize(
    ("advice", "shell", "python"),
    [
        (Choose.MAX_FRAMES.to(400), "--max-frames 400", "Limits(frames=400)"),
        (Choose.MAX_FRAMES.to(), "--max-frames", "Limits(frames=…)"),
        (Choose.SET.to("R=9"), "--set R=9", 'with_constants({"R": 9})'),
        (Choose.VARY.to("R=20:80:61"), "--vary R=20:80:61", "R=np.linspace(20, 80, 61)"),
        (Choose.VARY.to("R=20:80"), "--vary R=20:80", "R=(20, 80)"),
        (Choose.VARY.to("R=20,35"), "--vary R=20,35", "R=[20,35]"),
        (Choose.ON_FAILURE.to("skip"), "--on-failure skip", 'on_failure="skip"'),
        (Choose.MEASURE.to("'a = .max(x)'"), "--measure 'a = .max(x)'", 'measure="a = .max(x)"'),
        (Choose.LIVE.to("R,L"), "--live R,L", 'live("R", "L")'),
        (Choose.OUTPUT.to("'a b.png'"), "-o 'a b.png'", '"a b.png"'),
        (Choose.FPS.to(25), "--fps 25", "fps=25"),
        (Choose.SNAP.to(), "--snap", "--snap"),
        (Advised("say ", ScriptCommand.CHECK, ", or `", Choose.AT.to(0), "`"), "say `movimentum check`, or `--at 0`",
         "say `script.check`, or `at=0`"),
    ],
)  # fmt: skip
def test_advice_is_worded_by_each_front_end(advice: Advised, shell: str, python: str) -> None:
    assert advice == shell
    (item,) = in_python([Diagnostic("x", mv.Severity.ERROR, "x", helps=(pickle.loads(pickle.dumps(advice)),))])
    assert item.helps == (python,)


def test_what_a_script_says_is_no_option() -> None:
    (item,) = in_python([Diagnostic("x", mv.Severity.ERROR, "`--fps 25` in a caption")])
    assert item.message == "`--fps 25` in a caption"


def test_words_are_literals_for_type_checkers() -> None:
    for word, kind in (
        (AccuracyWord, mv.Accuracy),
        (FailureWord, mv.FailurePolicy),
        (QualityWord, Quality),
        (ShowWord, Show),
    ):
        assert set(get_args(word)) == {each.value for each in kind}
    for function in (mv.Script.solve, mv.Motion.render):
        for name, parameter in inspect.signature(function).parameters.items():
            if name in ("accuracy", "on_failure", "quality", "show"):
                assert "Word" in parameter.annotation, name


# --- what it has


def test_a_motion_is_asked_by_name() -> None:
    motion = mv.loads(SCRIPT + "", R=40).solve()
    assert list(motion) == motion.keys() == ["Arm.O", "Arm.P", "Arm.angle"]
    assert all(motion[name].shape[0] == len(motion) for name in motion)
    for name, there in {
        "Arm.P": True,
        "Arm.P.x": True,
        "2*Arm.P.x": True,
        "Arm": False,
        "Arm.Q": False,
        0: False,
        "": False,
    }.items():
        assert (name in motion) is (name in motion.at(0)) is there, name
    assert (motion.things, motion.constants) == (("Arm",), {"R": 40.0})
    sweep = motion.script.sweep(R=[20, 30], measure={"top": ".max(Arm.P.y)"})
    assert list(sweep) == sweep.keys() == ["R", "top"]
    assert ("top" in sweep, "pot" in sweep, 3 in sweep) == (True, False, False)


@pytest.mark.slow
def test_goals_are_told_in_short() -> None:
    (goal,) = mv.loads(SCRIPT).fit().goals
    assert repr(goal).startswith("AimOutcome(text='.max(Arm.P.y) = 50', line=4, rms=")
    assert len(repr(goal)) < 160


def test_calls_look_for_garbage_rarely_and_leave_it_as_it_was():
    before = gc.get_threshold()
    with pytest.raises(mv.MovimentumError):
        mv.loads("Crank : .bar")
    assert gc.get_threshold() == before
    with _SPARING, _SPARING:
        assert gc.get_threshold()[0] == _SPARING.THRESHOLD
    assert gc.get_threshold() == before
