"""The engine answers as a fresh start would, whatever was typed before; and does only what it has to."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from movimentum.cancellation import Cancelled
from movimentum.source import SourceText
from movimentum.workflow.engine import Engine, Revision, Stage
from tests.broad import broad
from tests.command import ROOT
from tests.engine.edits import edited

GALLERY = sorted((ROOT / "scripts").glob("*.mov"))
SMALL = [path for path in GALLERY if path.stem not in ("penrose-five", "penrose-twenty", "peaucellier-linkage")]

STEPS = """\
.config(10);
Crank : .bar O=[0,0] P=[30,0];  Coupler : .bar A=[0,0] B=[100,0];  Rocker : .bar B=[90,60] D=[90,0];
@0 Crank.O = [0,0];  Crank.angle = 60*.t;  Coupler.A = Crank.P;  Coupler.B = Rocker.B;  Rocker.D = [90,0];
@1 Crank.angle = 60;
@2 Crank.angle = 60 - 20*(.t);
@3
"""


FREE = """\
.config(10);
Arm : .bar A=[0,0] B=[60,0];  Fore : .bar B=[60,0] C=[60,50];  Hand : .bar C=[60,50] D=[30,80];
@0 Arm.A = [0,0];  Fore.B = Arm.B;  Hand.C = Fore.C;  Hand.D ~ [40 + 20*.cos(90*.t), 60 + 20*.sin(90*.t)];
@1 Arm.angle = 10*.sin(90*.t);
@2 Hand.D ~ [50, 70] .speed(30);
@3
"""


def answer(revision: Revision) -> tuple[object, ...]:
    """Everything that a revision says, bit for bit."""
    told = revision.diagnostics
    if not revision.moves:
        return (told,)
    try:
        motion = revision.motion
    except Exception as error:
        return told, repr(error)
    poses = motion.poses(0, min(motion.timeline.frame_count, 200))
    arrays = (poses.origin, poses.direction, poses.angle, poses.visible, poses.solved)
    named = (*sorted(poses.variables.items()), *sorted(poses.properties.items()))
    return told, *(array.tobytes() for array in arrays), *((str(name), array.tobytes()) for name, array in named)


def _same_as_fresh(path: Path, text: str, seed: int, count: int) -> None:
    engine = Engine()
    chance = random.Random(seed)
    with np.errstate(all="ignore"):
        engine.revise(SourceText(str(path), text)).diagnostics  # noqa: B018
        for number, after in enumerate(edited(chance, text, count)):
            source = SourceText(str(path), after)
            revision = engine.revise(source)
            if chance.random() < 0.3 and revision.moves:
                revision.preview(Fraction(chance.randrange(20), 10))
            assert answer(revision) == answer(Engine().revise(source)), (number, after)


@broad("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))], first=1)
def test_answers_do_not_depend_on_what_was_typed_before(seed: int) -> None:
    _same_as_fresh(Path("steps.mov"), STEPS, seed, 12)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 5))])
def test_nor_do_they_where_motion_is_free(seed: int) -> None:
    _same_as_fresh(Path("free.mov"), FREE, seed, 8)


@broad(
    "path",
    [
        pytest.param(path, marks=[pytest.mark.slow] * (number % 16 != 0))
        for number, path in enumerate(SMALL)
        if number % 4 == 0
    ],
    ids=lambda path: path.stem,
    first=1,
)
def test_nor_do_they_for_mechanisms(path: Path) -> None:
    _same_as_fresh(path, path.read_text(encoding="utf-8"), 7, 4)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("path", SMALL, ids=lambda path: path.stem)
def test_nor_for_any_of_the_gallery(path: Path, seed: int) -> None:
    _same_as_fresh(path, path.read_text(encoding="utf-8"), seed, 20)


# --- what is kept ---------------------------------------------------------------------------------------------


def _engine(text: str = STEPS) -> Engine:
    engine = Engine()
    engine.revise(SourceText("x.mov", text)).diagnostics  # noqa: B018
    return engine


def _counting(monkeypatch: pytest.MonkeyPatch, module: str, *names: str) -> Counter[str]:
    """How often the functions ``names`` of a module are called."""
    calls: Counter[str] = Counter()
    found = import_module(module)

    def counted(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def counting(*args: Any, **more: Any) -> Any:
            calls[name] += 1
            return function(*args, **more)

        return counting

    for name in names:
        monkeypatch.setattr(found, name, counted(name, getattr(found, name)))
    return calls


def _solved_for(engine: Engine, text: str) -> int:
    before = engine.known.memo.made["motion"]
    engine.revise(SourceText("x.mov", text)).diagnostics  # noqa: B018
    return engine.known.memo.made["motion"] - before


def test_a_comment_a_color_or_the_frame_rate_solve_nothing() -> None:
    engine = _engine()
    assert engine.known.memo.made["motion"] == 4
    assert _solved_for(engine, "// first\n" + STEPS.replace("@1", "/* é 🙂 */\n@1")) == 0
    assert _solved_for(engine, STEPS.replace(": .bar O", ": .bar .color('red') O")) == 0
    assert _solved_for(engine, STEPS.replace(".config(10)", ".config(25)")) == 0


def test_an_edit_in_a_step_solves_from_there_on() -> None:
    engine = _engine()
    assert _solved_for(engine, STEPS.replace("20*(.t)", "25*(.t)")) == 2  # the step, and the last instant
    assert _solved_for(engine, STEPS.replace("= 60;", "= 60.0;")) == 3
    assert _solved_for(engine, STEPS) == 0  # as `undo` makes it


def test_another_number_plans_no_more_than_a_restatement() -> None:
    from movimentum.planning.codegen.writing import structures_compiled

    engine = _engine()
    before = structures_compiled()
    assert _solved_for(engine, STEPS.replace("P=[30,0]", "P=[31,0]")) == 4
    assert structures_compiled() == before


@broad(
    ("name", "asked", "more"),
    [("walschaerts", "Radius.F.y", 2), ("stephenson", "Link.S.x", 2), ("peaucellier-linkage", "R2_3.V3.y", 4)],
    fast=("stephenson",),
)
def test_who_asks_for_one_more_value_has_nothing_followed_again(
    name: str, asked: str, more: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    followed = _counting(monkeypatch, "movimentum.solver.kinds.newton", "trace_path", "integrate_free_motion")
    path = ROOT / "scripts" / f"{name}.mov"
    text = path.read_text(encoding="utf-8")
    engine = Engine()
    before = engine.revise(SourceText(str(path), text)).motion
    made, steps = engine.known.memo.made["block"], len(before.segments)
    assert followed.total() > 0
    followed.clear()
    first = text.index("\n@1") if "\n@1" in text else text.rindex("\n@")
    after = engine.revise(SourceText(str(path), f"{text[:first]} asked = {asked};{text[first:]}")).motion
    assert not followed
    assert engine.known.memo.made["block"] - made <= more * steps
    one, two = (motion.poses(0, motion.timeline.frame_count) for motion in (before, after))
    assert one.origin.tobytes() == two.origin.tobytes()
    assert one.direction.tobytes() == two.direction.tobytes()


@broad(
    "name",
    ["four-bar", "geneva-slots", "locomotive", "peaucellier-linkage"],
    fast=("four-bar", "geneva-slots"),
)
def test_another_inequality_leaves_the_equations_as_they_were(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = _counting(monkeypatch, "movimentum.solver.solver_cache", "structure_of")
    searched = _counting(monkeypatch, "movimentum.solver.solutions.newton_starts", "random_starts")
    path = ROOT / "scripts" / f"{name}.mov"
    text = path.read_text(encoding="utf-8")
    thing = next(thing.name for thing in Engine().revise(SourceText(str(path), text)).scene.things if thing.is_body)
    place = text.rindex("\n@")
    first, second = (
        SourceText(str(path), f"{text[:place]} {thing}.angle > -{number}; {text[place:]}") for number in (5000, 6000)
    )
    fresh = answer(Engine().revise(second))
    engine = Engine()
    engine.revise(first).diagnostics  # noqa: B018
    made.clear()
    searched.clear()
    assert answer(engine.revise(second)) == fresh
    assert not made
    assert not searched


@pytest.mark.slow
def test_what_was_not_used_for_long_is_forgotten() -> None:
    engine = _engine()
    kept: list[int] = []
    for first in (31, 41, 31):
        for number in range(8):
            _solved_for(engine, STEPS.replace("P=[30,0]", f"P=[{first + number},0]"))
        kinds = Counter(kind for kind, _ in engine.known.memo._values)  # pyright: ignore[reportPrivateUsage]
        assert kinds["motion"] <= 5 * 4
        kept.append(kinds["found"])
    assert kept[2] == kept[0]
    assert _solved_for(engine, STEPS) == 4


# --- places ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_places_follow_the_text() -> None:
    text = STEPS.replace("Rocker.D = [90,0];", "")
    engine = _engine(text)
    moved = "// é 🙂\n\n" + text.replace("@0", "/* one\n two */ @0")
    source = SourceText("x.mov", moved)
    warned = [item for item in engine.revise(source).diagnostics if item.span is not None]
    assert warned
    assert warned == [item for item in Engine().revise(source).diagnostics if item.span is not None]


@pytest.mark.slow
def test_the_first_picture_looks_for_no_pose_but_the_one_next_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also of a mechanism with more equations than unknowns, of which a path lists all poses."""
    path = ROOT / "scripts" / "locomotive.mov"
    text = path.read_text(encoding="utf-8")
    engine = Engine()
    engine.revise(SourceText(str(path), text)).motion  # noqa: B018
    searched = _counting(monkeypatch, "movimentum.solver.solutions.newton_starts", "random_starts")
    after = engine.revise(SourceText(str(path), text.replace("= -180*.t;", "= -181*.t;")))
    assert after.source.text != text
    shown = after.preview(Fraction(1, 2))
    assert not searched
    assert shown is not None
    exact = after.motion.poses_at([Fraction(1, 2)])
    assert searched
    assert np.allclose(shown.origin, exact.origin, atol=1e-9 * after.motion.size)
    assert np.allclose(shown.direction, exact.direction, atol=1e-9)


# --- in stages, and given up ----------------------------------------------------------------------------------


def test_findings_come_in_stages_with_the_number_of_their_text() -> None:
    engine = _engine()
    revision = engine.revise(SourceText("x.mov", STEPS.replace("60*.t", "50*.t")))
    found = list(revision.reports(Fraction(1, 2)))
    assert [item.stage for item in found] == list(Stage)
    assert {item.revision for item in found} == {2}
    assert [item.final for item in found] == [False] * 4 + [True]
    first = found[2].poses
    assert first is not None
    exact = revision.motion.poses_at([Fraction(1, 2)])
    assert np.allclose(first.origin, exact.origin, atol=1e-9)
    assert np.allclose(first.direction, exact.direction, atol=1e-11)


@pytest.mark.parametrize(
    ("wrong", "stage", "code"),
    [
        ("@1 Crank.angle = ;", Stage.SYNTAX, "syntax/"),
        ("@1 Crunk.angle = 3;", Stage.SCENE, "name/"),
        ("@1 Crank.P = [500,0];", Stage.EXAMINATION, "constraint/conflict"),
    ],
)
def test_errors_come_with_the_stage_that_finds_them(wrong: str, stage: Stage, code: str) -> None:
    revision = _engine().revise(SourceText("x.mov", STEPS.replace("@1", wrong, 1)))
    last = list(revision.reports())[-1]
    assert (last.stage, last.final) == (stage, True)
    assert any(item.code.startswith(code) for item in last.diagnostics)


def test_a_newer_text_ends_the_work_on_an_older_one() -> None:
    engine = _engine()
    old = engine.revise(SourceText("x.mov", STEPS.replace("60*.t", "50*.t")))
    reports = old.reports()
    assert next(reports).stage is Stage.SYNTAX
    new = engine.revise(SourceText("x.mov", STEPS))
    assert old.outdated
    with pytest.raises(Cancelled):
        list(reports)
    assert not new.outdated
    assert answer(new) == answer(Engine().revise(new.source))


def test_work_in_another_thread_ends_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    from threading import Event, Thread

    from movimentum.solver.basis import effort

    engine = Engine()
    text = (ROOT / "scripts" / "stephenson.mov").read_text(encoding="utf-8")
    old = engine.revise(SourceText(str(ROOT / "scripts" / "stephenson.mov"), text))
    started, ended = Event(), Event()
    steps = 0
    original = effort.look

    def look() -> None:
        nonlocal steps
        steps += 1
        started.set()
        original()

    monkeypatch.setattr(effort, "look", look)

    def work() -> None:
        try:
            list(old.reports())
        except Cancelled:
            ended.set()

    thread = Thread(target=work)
    thread.start()
    assert started.wait(30)
    engine.revise(SourceText("x.mov", STEPS))
    thread.join(30)
    assert ended.is_set()
    assert steps < 500  # the whole film takes thousands


def test_a_film_rendered_again_has_the_same_bytes(tmp_path: Path) -> None:
    """As `run --watch` renders it: with what the text before has left."""
    from movimentum.solver.solver_cache import SolverCache
    from movimentum.workflow.animate import animate
    from movimentum.workflow.choices import Choices, Picture

    def rendered(name: str, text: str, known: SolverCache | None) -> bytes:
        target = tmp_path / f"{name}.gif"
        source = SourceText(str(tmp_path / "x.mov"), text)
        animate(source, target, Choices(), Picture(workers=1), lambda _done, _of: None, known=known)
        return target.read_bytes()

    known = SolverCache()
    rendered("first", STEPS, known)
    recolored = STEPS.replace(": .bar O", ": .bar .color('red') O").replace("20*(.t)", "21*(.t)")
    again = rendered("again", recolored, known)
    assert known.memo.made["motion"] == 4 + 2
    assert again == rendered("fresh", recolored, None)
