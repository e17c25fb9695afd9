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
from movimentum.studio.messages import RenderWanted
from movimentum.studio.security import OutsideFolder, inside, outside_files
from movimentum.workflow.choices import Choices, Picture
from movimentum.workflow.read import mentioned_files

OFTEN_S = 0.1
"""How often progress is told."""


class Rendering:
    """One rendering. It writes ``name`` below ``folder``, whole or not at all."""

    def __init__(
        self, wanted: RenderWanted, path: str, folder: Path, choices: Choices, send: Callable[[Any], None]
    ) -> None:
        self.wanted, self._folder, self._choices, self._send = wanted, folder, choices, send
        self._source = SourceText(path, wanted.text)
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
            target = inside(self._folder, self.wanted.name)
            words = self._rendered(target)
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

    def _rendered(self, target: Path) -> str:
        from movimentum.workflow.animate import animate

        if target.suffix.lower() not in FORMATS:
            raise OutsideFolder(f"a film ends in one of {', '.join(FORMATS)}")
        if outside_files(Path(self._source.path).parent, mentioned_files(self._source)):
            raise OutsideFolder("the script uses a file that is not below its folder")
        at = None if self.wanted.at is None else Fraction(self.wanted.at).limit_denominator(10**6)
        picture = Picture(scale=self.wanted.scale, at=at)
        with cancellable(self._given_up.is_set):
            outcome = animate(self._source, target, self._choices, picture, self._advanced)
        warned = sum(item.severity is Severity.WARNING for item in outcome.diagnostics)
        return f"{outcome.frames} frames{f', {warned} warnings' if warned else ''}."

    def _advanced(self, done: int, total: int) -> None:
        if self._given_up.is_set():
            raise Cancelled
        now = time.monotonic()
        if now - self._told >= OFTEN_S:
            self._told = now
            self._say("running", done, total)

    def _say(self, state: str, done: int, total: int, words: str = "") -> None:
        self._send(RenderAdvanced(self.wanted.job, state, done, total, self.wanted.name, words))
