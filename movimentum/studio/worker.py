"""The server's work for one page: a thread that reads, solves and examines one text after the other.

The page owns the text. Each text it sends is answered stage by stage, the newest first: work on an older one is
cancelled. Drags are answered in between, as soon as the motion is known.
"""

from __future__ import annotations

import gc
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from threading import Condition, Lock, Thread
from typing import TYPE_CHECKING, Any

from movimentum.cancellation import Cancelled, cancellable
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.editing.about import NO_FACTS, Facts
from movimentum.editing.facts import KnownFacts
from movimentum.errors import MovimentumError
from movimentum.records import dataclass, field
from movimentum.source import SourceText
from movimentum.studio.messages import (
    ClaimsChecked,
    FilmShown,
    Notice,
    OverlapsFound,
    OverlapsRequest,
    PictureSame,
    StageDone,
    TextTyped,
    WorkStopped,
)
from movimentum.studio.security import outside_files
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine, Revision
from movimentum.workflow.read import mentioned_files
from movimentum.workflow.same_statements import Items, items_of

if TYPE_CHECKING:
    from movimentum.solver.motion import PathMotion
    from movimentum.vector.film import Film

ADVICE_S = 3.0
"""How long fixes are tried: nobody waits for them."""
PATIENT = ("examine", "rest", "advise", "prove", "overlaps")
STAGES = ("read", "begin", "path", *PATIENT)
"""What is done for a text, in this order; "rest": the frames of a very long film that were not shown at once. The
patient ones can wait for a hand.
"""
QUICK_S = 0.03
"""Where the last motion took no longer, the next one is not worth a glimpse before it."""
TIDY = 50
"""After so many motions, memory is tidied. They refer to themselves in circles, and Python by itself looks at old
objects only when there are a quarter more of them: 10,000 edits would take 40 MB (this costs 15 ms in three seconds).
"""
QUIET_S = 0.3
"""So long after a hand has moved, nothing is examined."""


@dataclass(slots=True)
class TextWork:
    """A text of the page, with what is still to be done for it. ``moved``: its motion is known, and the ``film`` of
    its first ``frames``.
    """

    rev: int
    revision: Revision
    time: Fraction
    todo: deque[str] = field(default_factory=lambda: deque(STAGES))
    moved: bool = False
    frames: int = 0
    film: Film | None = None

    @property
    def patient(self) -> bool:
        """Whether the next stage can wait for a drag."""
        return bool(self.todo) and self.todo[0] in PATIENT

    @property
    def motion(self) -> PathMotion:
        """Its motion, which is known."""
        return self.revision.motion


class Worker:
    """One page's work. ``send`` takes messages from any thread; ``folder``: below it are all files."""

    def __init__(self, path: str, folder: Path, send: Callable[[Any], None], choices: Choices | None = None) -> None:
        self.path, self.folder, self.send = path, folder, send
        self.engine = Engine(choices)
        self.job: TextWork | None = None
        self.shown: TextWork | None = None
        """The last text whose motion is known."""
        self.facts: Callable[[str], Facts] = lambda _name: NO_FACTS
        """The facts about a name in the text."""
        self._overlaps = False  # whether the page shows them
        self._items: Items | None = None
        self._own_items: Items | None = None  # those of the script itself, without what it includes
        self._pending: TextWork | None = None
        self._urgent: deque[Callable[[], None]] = deque()
        self._quiet = 0.0
        self._took = 1.0
        self._solved = 0
        self._closed = False
        self._condition = Condition()
        self._thread = Thread(target=self._work, name="studio", daemon=True)
        self._thread.start()

    # --- called from the server's thread

    def typed(self, message: TextTyped) -> None:
        """Another text; what is done for the one before is given up."""
        revision = self.engine.revise(SourceText(self.path, message.text))
        with self._condition:
            self._pending = TextWork(message.rev, revision, exact_time(message.time))
            self._condition.notify()

    def soon(self, work: Callable[[], None]) -> None:
        """Do ``work`` in the page's thread, before what can wait."""
        with self._condition:
            self._urgent.append(work)
            self._quiet = time.monotonic() + QUIET_S
            self._condition.notify()

    def stop(self, message: WorkStopped) -> None:
        """Give up what is being done for a text."""
        job = self._pending or self.job
        if job is not None and job.rev == message.rev:
            self.engine.revise(job.revision.source)

    def show_overlaps(self, message: OverlapsRequest) -> None:
        """Look for what overlaps, also in the text on show; called in the page's thread."""
        self._overlaps = message.wanted
        job = self.job
        if message.wanted and job is not None and job.moved and "overlaps" not in job.todo:
            job.todo.append("overlaps")

    def moved_to(self, path: str, folder: Path) -> None:
        """The script is another file from now on."""
        self.path, self.folder = path, folder

    def again(self) -> None:
        """A file that the script uses is another one: the same text, from nothing."""
        job = self._pending or self.job
        if job is None:
            return
        self._items = self._own_items = None
        revision = self.engine.revise(SourceText(self.path, job.revision.source.text))
        with self._condition:
            self._pending = TextWork(job.rev, revision, job.time)
            self._condition.notify()

    def close(self) -> None:
        """The page is gone."""
        with self._condition:
            self._closed = True
            self._condition.notify()
        self.engine.revise(SourceText(self.path, ""))  # gives up what is being done

    def known(self, rev: int) -> TextWork | None:
        """The text with that number, if it is the newest one or the one shown."""
        return next((job for job in (self.job, self.shown) if job is not None and job.rev == rev), None)

    # --- the page's thread

    def _work(self) -> None:
        while True:
            with self._condition:
                while not (self._closed or self._pending or self._urgent or self._ready()):
                    self._condition.wait(self._patience())
                if self._closed:
                    return
                if self._pending is not None:
                    self.job, self._pending = self._pending, None
                    continue
                task = self._urgent.popleft() if self._urgent else None
            try:
                if task is not None:
                    task()
                elif self.job is not None:
                    self._advance(self.job)
            except Cancelled:
                pass
            except Exception as problem:
                self._bug(problem, None if task is not None else self.job)

    def _ready(self) -> bool:
        job = self.job
        if job is None or not job.todo or job.revision.outdated:
            return False
        return not job.patient or time.monotonic() >= self._quiet

    def _patience(self) -> float | None:
        job = self.job
        return max(0.01, self._quiet - time.monotonic()) if job is not None and job.patient else None

    def _advance(self, job: TextWork) -> None:
        stage = job.todo[0]
        done = {
            "read": self._read,
            "begin": self._begin,
            "path": self._path,
            "examine": self._examine,
            "rest": self._rest,
            "advise": self._advise,
            "prove": self._prove,
            "overlaps": self._find_overlaps,
        }[stage]

        def unwanted() -> bool:
            return self._closed or job.revision.outdated or (job.patient and bool(self._urgent))

        with cancellable(unwanted), _tidied_later(hurried=not job.patient):
            done(job)
        if job.todo and job.todo[0] == stage:
            job.todo.popleft()

    def _say(self, job: TextWork, stage: str, found: tuple[Diagnostic, ...], *, final: bool = False) -> None:
        from movimentum.studio.descriptions import diagnostics_data

        data = diagnostics_data(found, job.revision.source)
        self.send(StageDone(job.rev, stage, data, final, job.revision.moves))

    def _read(self, job: TextWork) -> None:
        revision = job.revision
        away = outside_files(self.folder, mentioned_files(revision.source))
        if away:
            job.todo.clear()
            message = f"{away[0]} is not below the script's folder: the studio reads no file elsewhere"
            self._say(job, "read", (Diagnostic("asset/outside", Severity.ERROR, message),), final=True)
            return
        if self._own_items is not None and self._own_items.same_as(items_of(revision.source)):
            self.send(PictureSame(job.rev, None))  # at once; where its parts stand follows
        if not revision.moves:
            if not revision.source.text.strip():
                self._items = self._own_items = None  # the page is empty now: no picture to keep
            job.todo = deque(("read", "advise"))
            self._say(job, "read", revision.diagnostics, final=True)
            return
        items = items_of(revision.timeline.scene.source)
        if self._items is not None and self.shown is not None and self._items.same_as(items):
            from movimentum.studio.descriptions import scene_data

            assert revision.motion is not None  # the same, found at once
            job.moved, job.film, job.frames, self.shown = True, self.shown.film, self.shown.frames, job
            job.todo = deque(("read", *PATIENT))
            self.send(PictureSame(job.rev, scene_data(revision.timeline, job.frames, revision.motion)))
        self._say(job, "read", revision.scene.diagnostics)

    def _begin(self, job: TextWork) -> None:
        from movimentum.studio.descriptions import scene_data, some_pictures

        timeline = job.revision.timeline
        if self._took <= QUICK_S:
            return
        try:
            poses = job.revision.preview(job.time)
            if poses is None:
                return
            film = some_pictures(timeline, poses)
        except (MovimentumError, ArithmeticError, ValueError):
            return  # the motion says what is wrong
        self.send(FilmShown(job.rev, True, float(poses.times[0]), scene_data(timeline), film))

    def _path(self, job: TextWork) -> None:
        from movimentum.studio.descriptions import frames_soon, scene_data, whole_film

        begun = time.perf_counter()
        try:
            motion = job.revision.motion
            job.frames = frames_soon(motion.timeline, job.time)
            film, job.film = whole_film(motion, job.frames)
        except MovimentumError as error:
            job.todo = deque(("path", "advise"))
            self._say(job, "path", error.diagnostics, final=True)
            return
        self._took = time.perf_counter() - begun
        self._items = items_of(motion.timeline.scene.source)
        self._own_items = items_of(job.revision.source)
        job.moved, self.shown = True, job
        self.send(FilmShown(job.rev, False, float(job.time), scene_data(motion.timeline, job.frames, motion), film))
        self._solved += 1
        if self._solved % TIDY == 0:
            gc.collect()

    def _rest(self, job: TextWork) -> None:
        from movimentum.studio.descriptions import frames_shown, scene_data, whole_film

        timeline = job.motion.timeline
        if job.frames >= frames_shown(timeline):
            return
        film, job.film = whole_film(job.motion)
        job.frames = frames_shown(timeline)
        self.send(FilmShown(job.rev, False, float(job.time), scene_data(timeline, motion=job.motion), film))

    def _examine(self, job: TextWork) -> None:
        from movimentum.studio.descriptions import claims_data

        facts = KnownFacts(job.revision)
        facts.prepare()
        self.facts = facts
        self._say(job, "examine", job.revision.diagnostics)
        self.send(ClaimsChecked(job.rev, claims_data(job.motion)))

    def _advise(self, job: TextWork) -> None:
        self._say(job, "advise", job.revision.advice(ADVICE_S), final=True)

    def _prove(self, job: TextWork) -> None:
        if not job.motion.timeline.claims:
            return
        from movimentum.studio.descriptions import claims_data
        from movimentum.workflow.prove import verdicts

        proofs = {number: one.verdict.value for number, one in verdicts(job.motion).items()}
        self.send(ClaimsChecked(job.rev, claims_data(job.motion, proofs)))

    def _find_overlaps(self, job: TextWork) -> None:
        if not self._overlaps:
            return
        from movimentum.studio.descriptions import overlaps_data

        self.send(OverlapsFound(job.rev, overlaps_data(job.motion)))

    def _bug(self, problem: Exception, job: TextWork | None) -> None:
        """Tell it, and go on with the next text."""
        traceback.print_exception(problem, file=sys.stderr)
        words = f"{type(problem).__name__}: {problem}"
        if job is None:
            self.send(Notice(f"a bug in Movimentum: {words}", "error"))
            return
        job.todo.clear()
        self._say(
            job, "bug", (Diagnostic("internal/bug", Severity.ERROR, f"a bug in Movimentum: {words}"),), final=True
        )


_hurried: list[bool] = []  # for each page that somebody waits for, whether memory was tidied by itself before
_hurry = Lock()


@contextmanager
def _tidied_later(hurried: bool) -> Generator[None]:
    """Where a picture is waited for, Python does not look for unused memory meanwhile: a text of a thousand things
    makes so many objects that it would do so several times, for 0.3 s each.
    """
    if not hurried:
        yield
        return
    with _hurry:
        _hurried.append(gc.isenabled() if not _hurried else _hurried[0])
        gc.disable()
    try:
        yield
    finally:
        with _hurry:
            before = _hurried.pop()
            if before and not _hurried:
                gc.enable()


def exact_time(time: float) -> Fraction:
    """A time from a page, which counts frames in floats."""
    return Fraction(time).limit_denominator(10**6)
