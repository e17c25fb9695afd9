"""The state of a debugging session: a script as it was and as it is now, a moment, and what is known about them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.errors import MovimentumError
from movimentum.output.files import refuse_overwriting
from movimentum.records import dataclass, field, replace
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine, Revision
from movimentum.workflow.read import read, reads

if TYPE_CHECKING:
    from movimentum.analysis.examine import Examination
    from movimentum.repl.reading import Reading
    from movimentum.scene.model import Scene
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.path.piece import Piece
    from movimentum.solver.poses import Poses
    from movimentum.solver.segment_motion import SegmentMotion
    from movimentum.timeline.model import Timeline

PATIENCE_S = 2.0
"""The limit for trying all fixes of a script: the user waits for them."""


class Refused(Exception):
    """The typed command cannot be done; ``diagnostics`` are about ``source`` (None: about no text)."""

    def __init__(self, diagnostics: Sequence[Diagnostic], source: SourceText | None = None) -> None:
        self.diagnostics = tuple(diagnostics)
        self.source = source
        super().__init__(self.diagnostics[0].message if diagnostics else "")


def refused(code: str, message: str, *helps: str) -> Refused:
    """A `Refused` with one message."""
    return Refused([Diagnostic(f"repl/{code}", Severity.ERROR, message, helps=helps)])


class Work:
    """A script, read and solved as far as possible by an `Engine`; each part when it is first needed.

    Asking for a part that cannot be had raises `Refused` with the reasons.
    """

    def __init__(self, revision: Revision) -> None:
        self.revision = revision
        self.readings: dict[tuple[int, str], Reading] = {}
        """Expressions already used, by step and text."""

    @property
    def source(self) -> SourceText:
        """The script's text."""
        return self.revision.source

    @property
    def choices(self) -> Choices:
        """How it is solved."""
        return self.revision.engine.choices

    def edited(self, text: str) -> Work:
        """The same script with another text."""
        return Work(self.revision.engine.revise(SourceText(self.source.path, text)))

    @property
    def moves(self) -> bool:
        """Whether the script is understood."""
        return self.revision.moves

    @property
    def scene(self) -> Scene:
        """The scene."""
        with self._refusing():
            return self.revision.scene

    @property
    def timeline(self) -> Timeline:
        """The scene in time."""
        with self._refusing():
            return self.revision.timeline

    @property
    def motion(self) -> PathMotion:
        """The motion, as far as there is one."""
        with self._refusing():
            return self.revision.motion

    @property
    def examination(self) -> Examination:
        """The diagnostics of the motion."""
        with self._refusing():
            return self.revision.examination

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Everything that `check` would say."""
        return self.revision.diagnostics

    @contextmanager
    def _refusing(self) -> Generator[None, None, None]:
        try:
            yield
        except MovimentumError as error:
            raise Refused(error.diagnostics, self.source) from error

    @cached_property
    def advice(self) -> tuple[Diagnostic, ...]:
        """The diagnostics with the fixes that work."""
        return self.revision.advice(PATIENCE_S)


@dataclass(frozen=True, slots=True)
class Session:
    """``file`` is the script's path, ``original`` its text there; ``work`` has the text as it is now.

    ``time`` is the moment looked at. ``watches`` are expressions shown after every move. ``past`` and ``future`` are
    the texts that undo and redo go to. ``suggestions`` are what `apply` does, numbered from 1: fixes, and statements
    that it puts in at this step.
    """

    file: str
    original: str
    work: Work
    time: Fraction = Fraction(0)
    watches: tuple[str, ...] = ()
    past: tuple[str, ...] = ()
    future: tuple[str, ...] = ()
    suggestions: tuple[str | Fix, ...] = ()
    ended: bool = field(default=False)
    tell: Callable[[str], None] | None = None
    """In a terminal: shows a part of an answer before the whole of it is known."""

    @property
    def text(self) -> str:
        """The script as it is now."""
        return self.work.source.text

    def refuse_overwriting(self, name: str, *, script: bool = True) -> Path:
        """The file ``name`` as an output; `UsageError` if it is one of the script's pictures or the script."""
        read = reads(self.work.source, self.work.scene if self.work.moves else None)
        refuse_overwriting(Path(name), read if script else read[1:])
        return Path(name)

    @property
    def segment_motion(self) -> SegmentMotion:
        """The part of the motion that contains the moment."""
        return self.work.motion.segments[self.work.timeline.segment_at(self.time)]

    @property
    def piece(self) -> tuple[Piece, float]:
        """The part of the path that contains the moment, and how long after the segment's start the moment is; refused
        where there is no solution.
        """
        from movimentum.solver.segment_motion import Unsolved

        segment_motion = self.segment_motion
        tau = float(self.time - segment_motion.segment.start)
        piece = next((p for p in reversed(segment_motion.pieces) if p.begin <= tau), segment_motion.pieces[0])
        if isinstance(piece, Unsolved):
            raise refused("no-solution", "there is no solution at this moment", "conflicts")
        return piece, tau

    @property
    def step(self) -> int:
        """The number of the step that the moment belongs to."""
        return self.work.timeline.segments[self.work.timeline.segment_at(self.time)].step

    @property
    def frame(self) -> int:
        """The number of the last frame not after the moment."""
        timeline = self.work.timeline
        return int((self.time - timeline.start) * timeline.fps // 1)

    def poses(self) -> Poses:
        """The poses at the moment (F = 1)."""
        return self.work.motion.poses_at([self.time])

    def at(self, time: Fraction) -> Session:
        """The session at another moment, inside the animation."""
        timeline = self.work.timeline
        return replace(self, time=min(max(time, timeline.start), timeline.end))

    def edited(self, text: str) -> Session:
        """The session with another text, which `undo` takes back."""
        return replace(self._with(text), past=(*self.past, self.text), future=())

    def undone(self) -> Session:
        """The text before the last change."""
        if not self.past:
            raise refused("nothing-to-undo", "there is nothing to undo")
        return replace(self._with(self.past[-1]), past=self.past[:-1], future=(self.text, *self.future))

    def redone(self) -> Session:
        """The text before the last undo."""
        if not self.future:
            raise refused("nothing-to-redo", "there is nothing to redo")
        return replace(self._with(self.future[0]), past=(*self.past, self.text), future=self.future[1:])

    def _with(self, text: str) -> Session:
        session = replace(self, work=self.work.edited(text), suggestions=())
        try:
            return session.at(self.time)
        except Refused:
            return session


def opened(path: str, choices: Choices) -> Session:
    """A session with the script at ``path``; `UsageError` or `ScriptError` if it cannot be read as text."""
    source = read(path)
    session = Session(source.path, source.text, Work(Engine(choices).revise(source)))
    try:
        return session.at(session.work.timeline.start)
    except Refused:
        return session
