"""Watching: an action again after every change, and only then."""

from __future__ import annotations

from pathlib import Path

import pytest

from movimentum.cli.run import watch


class Enough(Exception):
    """The test has seen what it came for."""


def test_a_change_of_the_script_or_of_what_it_uses_starts_again(tmp_path: Path) -> None:
    script, sprite = tmp_path / "a.mov", tmp_path / "a.png"
    script.write_text("1")
    sprite.write_text("1")
    story: list[str] = []
    edits = iter([None, (script, "22"), None, None, (sprite, "333"), (script, None), (script, "4444")])

    def action() -> list[Path]:
        story.append("run")
        return [sprite]

    def sleep(_: float) -> None:
        try:
            edit = next(edits)
        except StopIteration:
            raise Enough from None
        story.append("wait")
        if edit is not None:
            path, text = edit
            path.unlink() if text is None else path.write_text(text)

    with pytest.raises(Enough):
        watch([script], action, sleep=sleep)
    assert story == ["run", "wait", "wait", "run", "wait", "wait", "wait", "run", "wait", "run", "wait", "run"]


def test_an_edit_during_the_work_is_not_missed(tmp_path: Path) -> None:
    script = tmp_path / "a.mov"
    script.write_text("1")
    runs: list[str] = []

    def action() -> list[Path]:
        runs.append(script.read_text())
        if len(runs) == 1:
            script.write_text("22")
        return []

    def sleep(_: float) -> None:
        raise Enough

    with pytest.raises(Enough):
        watch([script], action, sleep=sleep)
    assert runs == ["1", "22"]


def test_ctrl_c_does_not_say_that_nothing_was_written_after_writing(tmp_path: Path) -> None:
    import signal
    import subprocess
    import sys
    import time

    script = tmp_path / "a.mov"
    script.write_text(".config(10, 50, 50); A : .bar P=[0,0] Q=[9,9]; @0 A.P=[9,9]; A.angle=9*.t; @1")
    target = tmp_path / "a.gif"
    command = [sys.executable, "-m", "movimentum", "run", str(script), "--watch"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("watching"):
                break
        assert target.exists()
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        said = process.stderr.read()
        assert process.wait(20) == 130
    assert "nothing was written" not in said
    assert "a.gif is as it was last written" in said
