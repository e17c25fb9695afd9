"""Rendering for a page: in a thread of its own, with progress, given up on request."""

from __future__ import annotations

import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from threading import Event, Thread
from typing import Any

from movimentum.cancellation import Cancelled, cancellable
from movimentum.diagnostics import Severity
from movimentum.errors import MovimentumError
from movimentum.source import SourceText
from movimentum.studio.answers import FORMATS, RenderAdvanced
from movimentum.studio.messages import RecordingWanted, RenderWanted
from movimentum.studio.recorder import Shot, write_recording
from movimentum.studio.security import OutsideFolder, inside, outside_files
from movimentum.workflow.choices import Choices, Picture, Progress
from movimentum.workflow.read import mentioned_files

OFTEN_S = 0.1
"""How often progress is told."""

Work = Callable[[Path, Progress], str]
"""Writes a file, and says how it was."""


class Rendering:
    """One rendering. It writes ``name`` below ``folder``, whole or not at all; ``work`` does it."""

    def __init__(self, job: int, name: str, folder: Path, work: Work, send: Callable[[Any], None]) -> None:
        self._job, self._name, self._folder, self._make, self._send = job, name, folder, work, send
        self._given_up = Event()
        self._told = 0.0
        self._thread = Thread(target=self._work, name="studio-render", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """It is not wanted any more."""
        self._given_up.set()

    def join(self, seconds: float) -> None:
        """Wait until it has ended."""
        self._thread.join(seconds)

    def _work(self) -> None:
        state, words = "done", ""
        try:
            target = inside(self._folder, self._name)
            if target.suffix.lower() not in FORMATS:
                raise OutsideFolder(f"a film ends in one of {', '.join(FORMATS)}")
            with cancellable(self._given_up.is_set):
                words = self._make(target, self._advanced)
        except Cancelled:
            state = "cancelled"
        except OutsideFolder as problem:
            state, words = "failed", str(problem)
        except MovimentumError as error:
            first = next((d for d in error.diagnostics if d.severity is Severity.ERROR), error.diagnostics[0])
            state, words = "failed", first.message
        except Exception as problem:
            state, words = "failed", f"a bug in Movimentum: {type(problem).__name__}: {problem}"
        self._say(state, 0, 0, words)

    def _advanced(self, done: int, total: int) -> None:
        if self._given_up.is_set():
            raise Cancelled
        now = time.monotonic()
        if now - self._told >= OFTEN_S:
            self._told = now
            self._say("running", done, total)

    def _say(self, state: str, done: int, total: int, words: str = "") -> None:
        self._send(RenderAdvanced(self._job, state, done, total, self._name, words))


def film_work(wanted: RenderWanted, path: str, choices: Choices) -> Work:
    """Renders a script, which is read as ``path``."""

    def work(target: Path, progress: Progress) -> str:
        from movimentum.workflow.animate import animate

        source = SourceText(path, wanted.text)
        if outside_files(Path(path).parent, mentioned_files(source)):
            raise OutsideFolder("the script uses a file that is not below its folder")
        at = None if wanted.at is None else Fraction(wanted.at).limit_denominator(10**6)
        outcome = animate(source, target, choices, Picture(scale=wanted.scale, at=at), progress)
        warned = sum(item.severity is Severity.WARNING for item in outcome.diagnostics)
        return f"{outcome.frames} frames{f', {warned} warnings' if warned else ''}."

    return work


def recording_work(wanted: RecordingWanted, shots: tuple[Shot, ...]) -> Work:
    """Renders what was recorded."""

    def work(target: Path, progress: Progress) -> str:
        return f"{write_recording(shots, wanted.at, target, Picture(scale=wanted.scale), progress)} frames."

    return work
