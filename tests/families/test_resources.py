"""What a script can cost: linear in its text, or refused with the limit and the option that raises it."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from movimentum.diagnostics import MOST_OF_A_CODE, Diagnostic, Severity, limited
from movimentum.errors import ScriptError
from movimentum.expressions import Expr, add, mul, symbol
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.workflow.check import check
from movimentum.workflow.choices import Choices
from tests.broad import broad
from tests.command import command, environment, movimentum
from tests.work import calls

HEAD = ".config(10, 60, 40);\nA : .bar P = [0,0] Q = [10,0];\n"


def work(text: str, folder: Path) -> int:
    """Function calls of `check`."""
    path = folder / "a.mov"
    path.write_text(text)

    def checked() -> None:
        report, _ = check(str(path), Choices())
        assert report.exit_code in (0, 1)

    return calls(checked)


def misspelled(count: int) -> str:
    things = "".join(f"Thing{i} : .bar P = [0,0];\n" for i in range(count))
    return HEAD + things + "@0 " + "\n".join(f"Thng{i}.P = [1,{i}];" for i in range(count))


def empty_steps(count: int) -> str:
    return HEAD + "@0 A.P = [0,0]; A.angle = 0;\n" + "\n".join(f"@{i}" for i in range(1, count))


def shared(count: int) -> str:
    """Products of one value with itself, named once each: 2^count leaves, count nodes."""
    names = "".join(f"x{i} = x{i - 1}*x{i - 1} - 0.1;\n" for i in range(1, count))
    return HEAD + f"@0 A.P = [0,0]; A.angle = 0; x0 = 0.5*.t;\n{names}@1"


def rates(count: int) -> str:
    inside = ".sin(20*.t)*.exp(.t)"
    return HEAD + "@0 A.P = [0,0]; A.angle = 0;\n" + f"x = {'.d(' * count}{inside}{')' * count}; @1"


@broad(
    ("family", "small"),
    [(misspelled, 150), (empty_steps, 100), (shared, 8), (rates, 3)],
    fast=(shared, rates),
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_four_times_the_text_costs_hardly_more_than_four_times(
    tmp_path: Path, family: Callable[[int], str], small: int
) -> None:
    work(family(2), tmp_path)  # what is imported once
    assert work(family(4 * small), tmp_path) < 4.4 * work(family(small), tmp_path)


def drawn_bars(count: int) -> str:
    """Bars that turn about their pins, each with a wish of its own."""
    bars = range(count)
    things = "".join(f"B{i} : .bar P = [{i},0] Q = [{i},10];\n" for i in bars)
    stated = "".join(f"B{i}.P = [{i},0]; B{i}.Q ~ [{i + 20},5] .speed(10);\n" for i in bars)
    return f".config(10, 60, 40);\n{things}@0 {stated}@1"


@pytest.mark.slow
def test_wishes_that_are_not_connected_are_followed_and_told_each_for_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from movimentum.solver.block.problem import BlockProblem
    from movimentum.solver.kinds import kernels

    calls = 0
    values = 0
    plain = kernels.evaluate, BlockProblem.at

    def counted(*arguments: Any) -> Any:
        nonlocal calls
        calls += 1
        return plain[0](*arguments)

    def copied(problem: BlockProblem, places: Any, count: int) -> BlockProblem:
        nonlocal values
        values += len(problem.inputs)
        return plain[1](problem, places, count)

    monkeypatch.setattr(kernels, "evaluate", counted)
    monkeypatch.setattr(BlockProblem, "at", copied)

    def cost(count: int) -> tuple[int, int]:
        nonlocal calls, values
        calls = values = 0
        path = tmp_path / "a.mov"
        path.write_text(drawn_bars(count))
        report, _ = check(str(path), Choices())
        assert report.exit_code == 0
        return calls, values

    few, many = cost(2), cost(8)
    assert few[0] > 0
    assert many[0] <= 5 * few[0]
    assert many[1] <= 5 * few[1]


@pytest.mark.parametrize("opening", ["-", "(", ".sin(", "1^", "[", "{1:", "-(", ".min(1,"])
def test_deep_nesting_is_refused_before_it_is_collected(opening: str) -> None:
    text = HEAD + "@0 x = " + opening * (3_000_000 // len(opening)) + "1;"
    caught: list[ScriptError] = []

    def refused() -> None:
        with pytest.raises(ScriptError) as error:
            parse(SourceText("a.mov", text))
        caught.append(error.value)

    assert calls(refused) < 100_000  # of three million characters
    assert caught[0].diagnostics[0].code == "limit/nesting"
    assert any("--max-nesting" in text for text in caught[0].diagnostics[0].helps)


@broad("nesting", [5, 100, 300], first=2)
def test_what_is_just_not_too_deep_is_read(nesting: int) -> None:
    for opening, closing in (("-", ""), ("(", ")"), (".sin(2*", ")"), ("1+2*3^(", ")"), (".min(1,-", ")")):
        told: set[str] = set()
        depth, text = 0, ""
        for depth in range(1, nesting + 2):
            text = "@0 x = " + opening * depth + "1" + closing * depth + ";"
            try:
                parse(SourceText("a.mov", text), max_nesting=nesting)
            except ScriptError as error:
                told = {item.code for item in error.diagnostics}
                break
        # the parser's own stack is never the limit: the tree is as deep as is said
        assert told == {"limit/nesting"}
        assert (text.count("(") + text.count("-")) * 4 >= nesting, (opening, depth)


@pytest.mark.parametrize(
    ("term", "each"),
    [("1.5*.t", 3), (".sin(3*y)", 3), ("-x", 2), ("A.P.x", 3), ("[1, 2].l", 3), ("1e-5 /* a + b */", 1)],
)
def test_long_expressions_are_refused_before_a_tree_is_made_of_them(term: str, each: int) -> None:
    def text(terms: int) -> SourceText:
        before = "x = 1 + 2; // 1 + 1\n.claim 'a+b' = 3;\n"
        return SourceText("a.mov", f"{HEAD}@0 {before}y = {'+'.join([term] * terms)}; z = 1 + 1; @1")

    terms = 300
    operations = each * terms - 1
    with pytest.raises(ScriptError) as caught:
        parse(text(terms), max_operations=operations - 1)
    (told,) = caught.value.diagnostics
    assert told.code == "limit/operations"
    assert f"{operations:,} operations" in told.message
    assert any(f"`--max-operations {operations}`" in help_ for help_ in told.helps)
    assert told.span is not None
    assert text(terms).text[told.span.start :].startswith(term)
    with pytest.raises(ScriptError) as other:  # one more is let through: the strange claim is what is left
        parse(text(terms), max_operations=operations)
    assert all(item.code.startswith("syntax/") for item in other.value.diagnostics)


def test_the_command_refuses_long_expressions_and_lets_them_through_when_told(tmp_path: Path) -> None:
    path = tmp_path / "a.mov"
    path.write_text(HEAD + "@0 A.P = [0,0]; A.angle = 0; x = " + " + ".join(["1.5*.t"] * 7000) + "; @1")
    refused = movimentum("check", path)
    assert refused.returncode == 1
    assert "limit/operations" in refused.stderr + refused.stdout
    assert movimentum("check", path, "--max-operations", "20999").returncode == 0


def test_equal_expressions_that_share_their_parts_are_compared_in_one_pass() -> None:
    def tower(height: int) -> Expr:
        node = symbol(0)
        for _ in range(height):
            node = add(mul(node, node), symbol(1))
        return node

    one, other = tower(60), tower(60)
    assert calls(lambda: one == other) < 60 * 100
    assert one == other


@pytest.mark.slow
def test_ten_thousand_notes_are_told_as_a_few_and_a_number(tmp_path: Path) -> None:
    notes = [Diagnostic("a/b", Severity.NOTE, str(k)) for k in range(1000)]
    errors = [Diagnostic("a/c", Severity.ERROR, str(k)) for k in range(300)]
    told = limited([*notes, *errors])
    assert sum(item.code == "a/b" for item in told) == MOST_OF_A_CODE
    assert sum(item.code == "a/c" for item in told) == 300
    assert [item.message for item in told if item.code == "limit/messages"] == [
        "and 900 more `a/b`, which are not shown"
    ]
    things = "\n".join(f"B{i} : .bar P = [{i},0] Q = [1,2];" for i in range(150))
    path = tmp_path / "a.mov"
    path.write_text(f"{HEAD}{things}\n@0 " + " ".join(f"B{i}.P = [{i},0];" for i in range(150)))
    assert len(movimentum("check", path).stdout) < 200_000


@pytest.mark.skipif(sys.platform != "linux", reason="what a process holds is told elsewhere otherwise")
def test_memory_has_a_limit_and_an_option_that_raises_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mov"
    path.write_text(HEAD + "@0 A.P = [0,0]; A.angle = 0; x = " + " + ".join(["1.5*.t"] * 60_000) + "; @1")
    refused = movimentum("check", path, "--max-memory", "110", "--max-operations", "200000", cwd=tmp_path)
    assert refused.returncode == 1
    assert "limit/memory" in refused.stderr
    assert "--max-memory 220" in refused.stderr
    assert movimentum("check", path, "--max-memory", "99").returncode == 2


@pytest.mark.skipif(sys.platform != "linux", reason="what a process holds is told elsewhere otherwise")
def test_what_workers_hold_counts() -> None:
    from movimentum import budget

    class Small:
        megabytes = 10**6

        def tick(self) -> None:
            pass

    program = (
        "import sys; held = bytearray(120_000_000); held[::1024] = b'x' * len(held[::1024]);"
        "print('here', flush=True); sys.stdin.read()"
    )
    before = budget.memory_of_workers()
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as worker:
        assert worker.stdout is not None
        worker.stdout.readline()
        assert 120_000_000 < budget.memory_of_workers() - before < 180_000_000
        small = Small()
        with pytest.raises(budget.OverBudget), budget.watched(small):
            small.megabytes = (budget.memory_used() + before) // 1_000_000 + 60
            for _ in range(100):
                time.sleep(0.02)
        worker.communicate()
    assert budget.memory_of_workers() <= before


def test_no_more_workers_are_chosen_than_memory_is_for(monkeypatch: pytest.MonkeyPatch) -> None:
    from movimentum.encoding import runs

    monkeypatch.setattr(runs.os, "sched_getaffinity", lambda _: set(range(64)), raising=False)
    assert runs.workers_that_pay(1.0, 10_000, 0) == 64
    assert 10 <= runs.workers_that_pay(1.0, 10_000, 80_000_000) < 20
    assert runs.workers_that_pay(1.0, 10_000, 300_000_000) == 1
    assert runs.workers_that_pay(1.0, 10_000, 5_000_000_000) == 1


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="what a process holds is told elsewhere otherwise")
@pytest.mark.parametrize("count", [9, 11])
def test_no_script_takes_much_more_than_a_gigabyte(tmp_path: Path, count: int) -> None:
    inside = ".t*.sin(30*.t)*.t^3"
    path = tmp_path / "a.mov"
    path.write_text(HEAD + f"@0 A.P = [0,0]; A.angle = 0;\nx = {'.i(' * count}{inside}{')' * count}; @1")
    program = (
        "import resource, subprocess, sys; code = subprocess.call(sys.argv[1:]);"
        "print(code, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *command("check", path)],
        capture_output=True,
        text=True,
        env=environment(),
        timeout=300,
        check=False,
    )
    code, kilobytes = map(int, done.stdout.split()[-2:])
    assert code in (0, 1)
    assert kilobytes < 1_400_000


def test_long_work_says_a_word(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from movimentum import console as module

    console = module.Console()
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    with console.working("checking"):
        for now[0] in (0.5, 9.9, 10.0, 10.2, 30.0, 60.1):
            console.tick()
    console.tick()
    said = capfd.readouterr().err.splitlines()
    assert said == [f"still checking after {seconds} s; Ctrl-C ends it" for seconds in (10, 60)]
    quiet = module.Console(quiet=True)
    now[0] = 0.0
    with quiet.working("checking"):
        now[0] = 10.0
        quiet.tick()
    assert capfd.readouterr().err == ""


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of another kind")
def test_on_a_terminal_the_seconds_are_shown_and_wiped() -> None:
    import os
    import pty

    from movimentum.console import Console

    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stream:
        console = Console(stream=stream)
        with console.working("checking"):
            console._busy = "checking", time.monotonic() - 3.2
            console.tick()
            console.tick()
            console.say("said")
    shown = b""
    while not shown.endswith(b"said\r\n"):  # a terminal gives what it has so far
        shown += os.read(ours, 1000)
    assert shown.decode() == "\rchecking: 3 s\x1b[K\r\x1b[Ksaid\r\n"
    os.close(ours)


@pytest.mark.parametrize("digits", [1001, 10_000, 10**12])
def test_more_digits_than_the_limit_are_refused_before_any_work(tmp_path: Path, digits: int) -> None:
    path = tmp_path / "a.mov"
    path.write_text(HEAD + "@0 A.P = [0,0]; A.angle = 0; x^2 + x = 1; @100")
    exact = ["solve", path, "-o", "-", "--accuracy", "exact", "--digits", str(digits)]
    refused = movimentum(*exact)
    assert refused.returncode == 2
    assert refused.stdout == ""
    assert "limit/digits" in refused.stderr
    assert f"`--max-digits {digits}`" in refused.stderr


def test_a_raised_limit_lets_more_digits_through(tmp_path: Path) -> None:
    path = tmp_path / "a.mov"
    path.write_text(HEAD + "@0 A.P = [0,0]; A.angle = 0; x > 0; x^2 + x = 1;")
    done = movimentum("solve", path, "-o", "-", "--accuracy", "exact", "--digits", "1100", "--max-digits", "1100")
    assert done.returncode == 0
    value = done.stdout.splitlines()[1].split(",")[-1]
    assert len(value) == 1102  # 0.618…


@pytest.mark.parametrize("stated", [None, "3"])
def test_linear_algebra_has_one_thread_unless_the_surroundings_say_otherwise(
    monkeypatch: pytest.MonkeyPatch, stated: str | None
) -> None:
    import os

    names = [f"{library}_NUM_THREADS" for library in ("OPENBLAS", "MKL", "OMP")]
    for name in names:
        if stated is None:
            monkeypatch.delenv(name, raising=False)
        else:
            monkeypatch.setenv(name, stated)
    program = (
        "import os, sys; from movimentum.cli.app import main\n"
        "assert 'numpy' not in sys.modules  # which reads the surroundings when it is imported\n"
        "try: main(['--debug', '--version'])  # without, the process ends at once\n"
        f"except SystemExit: print(*[os.environ[name] for name in {names!r}])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=dict(os.environ), check=False
    )
    assert done.stdout.split()[-3:] == [stated or "1"] * 3
