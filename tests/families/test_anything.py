"""Whatever is handed over, the answer is an exit code and a message: no traceback, no 70, no hang, no gigabytes."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import click
import pytest

from movimentum.repl.shell import COMMANDS
from tests.broad import broad
from tests.families.anything import ENDLESS, KINDS, command_line, debugger_line, kind_of, leaves, made
from tests.families.forked import Tried, tried, tried_input, warm

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that cost nothing")


def assert_sound(found: Tried, about: object) -> None:
    assert not found.faults, (about, found.faults, found.codes, found.said[-3000:])


@broad("kind", [kind for kind in KINDS if kind not in ("grammar", "character")], every=4)
def test_a_few_inputs_of_each_kind(tmp_path: Path, kind: str) -> None:
    for seed in range(3):
        assert_sound(tried_input(kind, seed, tmp_path), (kind, seed))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("block", range(4))
def test_many_inputs(tmp_path: Path, block: int) -> None:
    warm(tmp_path)
    for seed in range(300_000 + 100 * block, 300_100 + 100 * block):
        kind = kind_of(seed)
        assert_sound(tried_input(kind, seed, tmp_path), (kind, seed))


@broad("kind", KINDS, every=3)
def test_an_input_is_the_same_whenever_it_is_made(tmp_path: Path, kind: str) -> None:
    folders = [tmp_path / name for name in "ab"]
    lines: list[Sequence[Sequence[str]]] = []
    for folder in folders:
        folder.mkdir()
        lines.append(made(kind, 5, folder))
    assert lines[0] == lines[1]
    files = [{path.relative_to(f): path.read_bytes() for path in f.rglob("*") if path.is_file()} for f in folders]
    assert files[0] == files[1]


def test_every_option_and_every_command_of_the_debugger_is_tried() -> None:
    import random

    lines = [command_line(random.Random(seed)) for seed in range(3000)]
    for words, command in leaves():
        mine = [line for line in lines if tuple(line[: len(words)]) == words]
        for parameter in command.params:
            if isinstance(parameter, click.Option) and parameter.name not in ENDLESS:
                assert any(set(parameter.opts) & set(line) for line in mine), (words, parameter.name)
    typed = {debugger_line(random.Random(seed)).partition(" ")[0] for seed in range(3000)}
    assert set(COMMANDS) <= typed


@pytest.mark.slow
def test_what_must_not_be_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The judge itself: a fault of ours, an endless loop and a lot of memory do not pass."""
    import tests.families.forked as forked

    folder = tmp_path / "input"
    folder.mkdir()

    def broken(line: Sequence[str], watched: bool) -> int:
        print("a/b: RuntimeWarning: overflow", file=sys.stderr)
        return 70

    def endless(line: Sequence[str], watched: bool) -> int:
        while True:
            pass

    def large(line: Sequence[str], watched: bool) -> int:
        return len(bytearray(b"1" * 30_000_000)) and 0

    monkeypatch.setattr(forked, "run_command_line", broken)
    assert tried([["check"]], folder).faults == ("bug", "warning")
    monkeypatch.setattr(forked, "run_command_line", endless)
    monkeypatch.setattr(forked, "LONG_S", 1)
    assert tried([["check"]], folder, limit_s=2).faults == ("killed", "long")
    monkeypatch.setattr(forked, "run_command_line", large)
    monkeypatch.setattr(forked, "LARGE_MB", 20)
    assert tried([["check"]], folder).faults == ("large",)
