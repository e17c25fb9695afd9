"""The progress bar: on a terminal, for work that takes longer than a second, and nothing of it stays."""

from __future__ import annotations

import io

import pytest

from movimentum import console
from movimentum.console import Console


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(console.time, "monotonic", lambda: now[0])
    monkeypatch.setenv("TERM", "xterm")
    return now


def shown(stream: io.StringIO, clock: list[float], *seconds: float, quiet: bool = False) -> str:
    with Console(stream=stream, quiet=quiet).progress("rendering") as update:
        for done, clock[0] in enumerate(seconds):
            update(done, len(seconds))
    return stream.getvalue()


def test_long_work_shows_how_far_it_is(clock: list[float]) -> None:
    said = shown(Terminal(), clock, 0.5, 1.5, 2.0, 2.5)
    assert "rendering" in said
    assert "3/4" in said
    assert said.endswith("\r\x1b[K\x1b[?25h"), "the line is empty, and the cursor is back"


def test_short_work_and_what_no_person_sees_show_nothing(clock: list[float]) -> None:
    assert shown(Terminal(), clock, 0.1, 0.2, 0.3) == ""
    assert shown(io.StringIO(), clock, 0.5, 1.5, 2.0) == ""
    assert shown(Terminal(), clock, 0.5, 1.5, 2.0, quiet=True) == ""
