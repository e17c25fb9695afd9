"""Whatever the grammar can spell is solved or told what is wrong with it: exit code 70 does not occur."""

from __future__ import annotations

import random
import subprocess
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from movimentum.cli.app import run_command_line
from movimentum.syntax.grammar import load_tables
from tests.command import ROOT, command, environment
from tests.families.grammar_scripts import Speller, grammar, mutated, script, scripts

GALLERY = sorted(path for path in (ROOT / "scripts").glob("*.mov") if path.stat().st_size < 3000)


def codes(text: str, folder: Path) -> list[int]:
    """The exit codes of looking at a script and of drawing a moment of it."""
    path = folder / "any.mov"
    path.write_text(text, encoding="utf-8")
    limits = ["-q", "--max-frames", "300"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as the command does
        return [
            run_command_line(["check", str(path), "--format", "json", "--freedom", *limits[1:]]),
            run_command_line(["run", str(path), "--at", "0.25", *limits, "--max-pixels", "1000000"]),
        ]


@pytest.mark.slow
@settings(
    max_examples=8,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(scripts())
def test_what_the_grammar_spells_is_no_bug(tmp_path: Path, capfd: pytest.CaptureFixture[str], text: str) -> None:
    assert 70 not in codes(text, tmp_path), (text, capfd.readouterr().err)


@pytest.mark.parametrize("number", range(4))
def test_gallery_scripts_with_slips_are_no_bug(tmp_path: Path, capfd: pytest.CaptureFixture[str], number: int) -> None:
    chance = random.Random(number)
    text = mutated(chance.choice(GALLERY).read_text(), chance)
    assert 70 not in codes(text, tmp_path), (text, capfd.readouterr().err)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(4))
def test_many_scripts_are_no_bug(tmp_path: Path, capfd: pytest.CaptureFixture[str], block: int) -> None:
    for seed in range(100_000 + 60 * block, 100_060 + 60 * block):
        chance = random.Random(seed)
        text = script(chance) if seed % 2 else mutated(chance.choice(GALLERY).read_text(), chance)
        assert 70 not in codes(text, tmp_path), (seed, text, capfd.readouterr().err)


@pytest.mark.slow
def test_nor_by_the_command(tmp_path: Path) -> None:
    for seed in range(200_000, 200_020):
        (tmp_path / "any.mov").write_text(script(random.Random(seed)), encoding="utf-8")
        for arguments in (["check"], ["run", "--at", "0"], ["solve", "-o", "-"], ["repl", "-c", "check; free; why x"]):
            line = command(arguments[0], "any.mov", *arguments[1:])
            done = subprocess.run(
                line, cwd=tmp_path, capture_output=True, text=True, env=environment(), timeout=120, check=False
            )
            assert done.returncode in (0, 1, 2, 3), (seed, arguments, done.stderr)
            assert "Traceback" not in done.stderr
            assert "Warning" not in done.stderr


@pytest.mark.slow
def test_every_rule_and_every_terminal_is_spelled() -> None:
    """The generator reaches all of the grammar, so that new syntax is tried the day it is added."""
    speller = Speller(random.Random(1))
    spelled: set[str] = set()
    whole, part = speller.spell, speller.terminal
    speller.spell = lambda symbol, deepest=14: (spelled.add(symbol), whole(symbol, deepest))[1]  # type: ignore[method-assign]
    speller.terminal = lambda name: (spelled.add(name), part(name))[1]  # type: ignore[method-assign]
    rules, terminals, _ = grammar()
    ignored = {name for name in terminals if name.startswith("__IGNORE")}
    wanted = {name for name in rules if not name.startswith("__")} | (set(terminals) - ignored)
    for _ in range(400):
        if spelled >= wanted:
            break
        speller.spell("start", 30)
        for symbol in (
            "statement",
            "definition",
            "claim",
            "goal",
            "requirement",
            "shape",
            "step",
            "config",
            "follower",
            "placed",
            "part",
            "copy",
            "loop",
            "let",
        ):
            speller.spell(symbol)
    assert spelled >= wanted
    assert {t.name for t in load_tables().terminals} - {"$END"} <= set(terminals)


# each of these once ended in "this is a bug in Movimentum"
THINGS = """\
.config(10, 60, 40);
A : .bar P = [0,0] Q = [10,0];  B : .bar P = [5,5] Q = [20,5];
C : .bar P = [1,2] Q = [9,3];   F : .bar P = [3,3] Q = [8,8];
@0 {}
@1
"""


def _cancelling(chance: random.Random) -> str:
    """An equation in which an unknown appears and cancels."""
    name = chance.choice(("x", "A.P.x", "B.angle", "C.Q.y"))
    zero = chance.choice(
        (f"{name} - {name}", f"2*{name} - {name} - {name}", f"({name} - {name})*3", f"-{name} + {name}")
    )
    other = chance.choice((".cos(B.angle)", "F.P.y", ".sin(30*.t)", "y^3", ".atan2(B.Q.x, 1)", "(F.P - F.P).l", "x"))
    left = chance.choice(("x", "y", "F.angle", "(F.P - F.P).l", "C.P.x"))
    return f"{left} = {other} + {zero}; {chance.choice(('', 'B.angle = 10;', 'F.angle = 0; y = 0;'))}"


def _enormous(chance: random.Random) -> str:
    """Numbers at the end of what floats hold."""
    big = chance.choice(("1e300", "-1e308", "1.7e308", "1e154", "1e-300", "5e-324"))
    return chance.choice(
        (
            "A.P = [{0}, 0]; A.angle = 0;",
            "A.P = [{0}, {0}]; A.Q.x = -{0};",
            "x = {0}; y = x*10; z = y - x*10;",
            "A.P = [{0}, 0]; (A.Q - B.P).l = {0}; B.angle = 10;",
            "(A.P - B.P).l = {0}; A.angle = {0}*.t;",
            "A.P = [{0}*.t, 0]; A.angle = 0; B.P ~ A.Q;",
            "A.P = [0,0]; A.angle = 45 + {0}*.t;",
            "y = (x + 1)^{1}; x = .t;",
            "x = (y + 1)^{1}*(y - 1)^{1}; y = 2;",
            "B.P ~ [{0}, {0}]; B.angle = x; x ~ {0} .speed({0});",
        )
    ).format(big, chance.choice((3, 400, 4000)))


def _wished(chance: random.Random) -> str:
    """Wishes whose targets wait for what they draw."""
    a, b, c = chance.sample("ABC", 3)
    return (
        f"{a}.angle = {chance.choice(('0', '30*.t', f'{a}.P.x'))};"
        f"{c}.Q ~ {a}.P .speed(1); {c}.Q = {b}.P; {c}.P = {b}.P;"
        + chance.choice(("", f"{a}.P ~ {c}.P;", f"{b}.Q ~ {a}.Q;"))
    )


def _clocks_apart(chance: random.Random) -> str:
    """Equations with clocks that their blocks do not read, beside what has no value at first."""
    name = chance.choice(("z", "_", "A.red"))
    clock = chance.choice((".T", ".T - 1", "2*.T", ".iv"))
    apart = chance.choice(("{0} + {1}^2 = .t;", "{0} + 2*{1}*{1} = .t;", "-{1}^2 = {0} - .t;")).format(clock, name)
    without = chance.choice(("A.Q = x/_*_/x;", "C.P = y/_*_/y;", "B.Q = x/_*_/x;"))
    return without + apart


@pytest.mark.slow
@pytest.mark.parametrize("family", [_cancelling, _enormous, _wished, _clocks_apart])
def test_families_that_once_were_bugs(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], family: Callable[[random.Random], str]
) -> None:
    assert_no_bug(family, 3, tmp_path, capfd)


def assert_no_bug(
    family: Callable[[random.Random], str], count: int, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for seed in range(count):
        text = THINGS.format(family(random.Random(seed)))
        assert 70 not in codes(text, folder), (text, capfd.readouterr().err)


@pytest.mark.slow
@pytest.mark.parametrize(
    "family", [_cancelling, _enormous, _wished, pytest.param(_clocks_apart, marks=pytest.mark.long)]
)
def test_many_of_those_families(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], family: Callable[[random.Random], str]
) -> None:
    assert_no_bug(family, 60, tmp_path, capfd)
