"""Questions from a page: about a motion, and, while somebody types, about names, completions and layout.

A thread of their own answers them while the worker solves. Only questions about the newest text are answered.
"""

from __future__ import annotations

import base64
import math
import os
import sys
import traceback
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum import messages
from movimentum.diagnostics import Diagnostic
from movimentum.editing import about, completion
from movimentum.editing.project import Project, text_on_disk
from movimentum.errors import MovimentumError
from movimentum.expressions import symbol
from movimentum.formatting.columns import formatted, line_edits
from movimentum.scene.model import AnchorCoordinate
from movimentum.source import Edit, SourceText
from movimentum.studio import messages as m
from movimentum.studio.descriptions import frames_shown, some_pictures, why
from movimentum.studio.dragging import Dragging
from movimentum.studio.messages import (
    Answered,
    NameRequest,
    PlotRequest,
    Plotted,
    RatesRequest,
    RatesSent,
    StillMade,
    StillRequest,
)
from movimentum.studio.worker import TextWork, Worker, exact_time
from movimentum.workflow.inspector import Inspector

if TYPE_CHECKING:
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses


MOST_PLOTTED = 2000
"""Frames that a plot has."""
MOST_SHOWN = 24
"""Solutions that are shown as pictures."""
MOST_RATES = 20_000
"""Velocities in one answer: some tenths of a second."""
PATIENCE_S = 1.4
"""The time for finding a formula: the user waits two seconds in all."""


def answer(worker: Worker, message: NameRequest) -> None:
    """Answer a question of a page."""
    job = worker.known(message.rev)
    words, choices, film = "the motion is not known yet", list[dict[str, Any]](), None
    if job is not None and job.moved:
        inspector = Inspector(job.revision, exact_time(message.time))
        try:
            match message.question:
                case "why":
                    words = why(inspector, message.name)
                case "formula":
                    words = _formula(inspector, message.name)
                case "solutions":
                    words, choices, film = _solutions(inspector)
                case _:
                    words = "there is no answer"
        except MovimentumError as error:
            words = error.diagnostics[0].message
    worker.send(Answered(message.rev, message.question, message.name, words, choices, film))


def _formula(inspector: Inspector, name: str) -> str:
    from movimentum.analysis.interactive.formula import UNREASONABLE, Obstacle

    formulas = inspector.formulas(name, PATIENCE_S)
    from movimentum.analysis.interactive.spelling import in_language

    lines: list[str] = []
    for label, found in formulas:
        if not isinstance(found, Obstacle):
            written = in_language(found)
            lines.append(f"{label} = {written}" if written else f"{label} has a formula that no statement can have")
        elif found.words == UNREASONABLE:
            lines.append(f"{label} has {found.words}")
        else:
            lines.append(f"{label} has no closed form: {found.words}")
    since = float(inspector.segment_motion.segment.start)
    begun = f" .t counts from {since:g}, where this step begins." if since else ""
    return "\n".join([*lines, f"Angles are in degrees, as in the script.{begun}"])


def _solutions(inspector: Inspector) -> tuple[str, list[dict[str, Any]], dict[str, Any] | None]:
    """Every solution, with its picture and what selects it."""
    parts = [part for part in inspector.solutions() if len(part.solutions) > 1]
    found = [solution for part in parts for solution in part.solutions][:MOST_SHOWN]
    if not found:
        return "there is one solution only at this moment", [], None
    film = some_pictures(inspector.work.timeline, inspector.poses_of([solution.pose for solution in found]))
    choices: list[dict[str, Any]] = [
        {"statement": solution.selects or "", "words": solution.words, "current": solution.current, "frame": frame}
        for frame, solution in enumerate(found)
    ]
    more = "" if all(part.complete for part in parts) else "; found by a search, there may be more"
    return f"{len(found)} solutions at this moment{more}", choices, film


# --- over the whole film ----------------------------------------------------------------------------------


def plot(worker: Worker, message: PlotRequest) -> None:
    """The values of an expression over the film."""
    job = worker.known(message.rev)
    if job is None or not job.moved:
        return
    try:
        query = Inspector(job.revision, job.motion.timeline.start).query(message.expression)
        poses = _spread(job.motion)
        values = query.values(poses)
    except MovimentumError as error:
        worker.send(Plotted(message.rev, message.expression, [], error.diagnostics[0].message))
        return
    values[~poses.solved] = np.nan
    rows = [[value if math.isfinite(value) else None for value in row] for row in values.tolist()]
    worker.send(Plotted(message.rev, message.expression, rows))


def _spread(motion: PathMotion) -> Poses:
    """The poses of every frame; of a long film, of some that are spread over it."""
    timeline = motion.timeline
    last = frames_shown(timeline) - 1
    if last < MOST_PLOTTED:
        return motion.poses(0, last + 1)
    chosen = [round(k * last / (MOST_PLOTTED - 1)) for k in range(MOST_PLOTTED)]
    return motion.poses_at([timeline.frame_time(frame) for frame in chosen])


def rates(worker: Worker, message: RatesRequest) -> None:
    """Answer with the velocities of all anchors in the frames asked for, not too many at a time."""
    from movimentum.solver.rates.rates import rates_at

    job = worker.known(message.rev)
    if job is None or not job.moved:
        return
    timeline = job.motion.timeline
    anchors = [(thing.number, n) for thing in timeline.scene.things for n in range(len(thing.anchors))]
    expressions = [symbol(AnchorCoordinate(thing, n, axis)) for thing, n in anchors for axis in (0, 1)]
    first = min(max(0, message.first), frames_shown(timeline) - 1)
    count = min(frames_shown(timeline) - first, max(1, MOST_RATES // max(1, len(expressions))))
    times = [timeline.frame_time(frame) for frame in range(first, first + count)]
    values = np.ascontiguousarray(rates_at(job.motion, expressions, 1, times).T, dtype="<f4")
    worker.send(RatesSent(message.rev, first, count, base64.b64encode(values.tobytes()).decode("ascii")))


# --- the picture ------------------------------------------------------------------------------------------


def still(worker: Worker, dragging: Dragging, message: StillRequest) -> None:
    """Answer with the picture on show as an SVG; without a hand in it, it is what ``run -o x.svg --at`` writes."""
    job = worker.known(message.rev)
    if job is None or not job.moved:
        worker.send(StillMade(message.rev, "", "the motion is not known yet"))
        return
    try:
        worker.send(StillMade(message.rev, _svg(job, dragging, exact_time(message.time))))
    except MovimentumError as error:
        worker.send(StillMade(message.rev, "", error.diagnostics[0].message))


def _svg(job: TextWork, dragging: Dragging, instant: Fraction) -> str:
    from movimentum.drawing.picture_options import PictureOptions
    from movimentum.rendering.prepare import prepare_drawing
    from movimentum.vector.film import make_film
    from movimentum.vector.svg import svg_document
    from movimentum.workflow.frames import PoseChunks

    motion, timeline = job.motion, job.motion.timeline
    every = PoseChunks(motion, range(timeline.frame_count), skip=False, drawn=True)
    prepared = prepare_drawing(timeline.scene, every, PictureOptions(motion=motion, until=instant))
    (poses,) = PoseChunks(motion, (instant,), skip=False, drawn=True)
    poses = dragging.shown(job, instant) or poses
    title = job.film.title if job.film is not None else ""
    return "".join(svg_document(make_film(timeline.scene, prepared, poses, title, timeline.fps, 0)))


MOST_PROPOSALS = 400
"""More are cut: nobody reads them, and the next letter leaves fewer."""


class Assistant:
    """The help for one page. ``worker`` has the script's path and folder, and what is known of names."""

    def __init__(self, worker: Worker, send: Callable[[Any], None]) -> None:
        self._worker, self._send = worker, send
        self._rev, self._text = 0, ""
        self._path = ""
        self._project = Project(self._read)
        self._waiting: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._answers: dict[type, Callable[[Any], None]] = {
            m.ProposalsRequest: self._complete,
            m.AboutRequest: self._explain,
            m.MeaningRequest: self._mean,
            m.NamingRequest: self._name,
            m.RenameRequest: self._rename,
            m.FormatRequest: self._format,
        }
        self._thread = Thread(target=self._work, name="studio-assistant", daemon=True)
        self._thread.start()

    # --- called from the server's thread

    def typed(self, message: m.TextTyped) -> None:
        """The script has another text."""
        self._rev, self._text = message.rev, message.text
        self._waiting.put(lambda: self._take(message.rev, message.text))

    def disk_changed(self) -> None:
        """A file that the script uses is another one."""
        self._waiting.put(self._forget)

    def take(self, message: m.FromPage) -> bool:
        """Answer a message, if it is a question about the text."""
        answer = self._answers.get(type(message))
        if answer is not None:
            self._waiting.put(lambda: self._answer(answer, message))
        return answer is not None

    def close(self) -> None:
        """The page is gone."""
        self._waiting.put(None)

    # --- the assistant's thread

    def _work(self) -> None:
        while (task := self._waiting.get()) is not None:
            try:
                task()
            except Exception as problem:  # the editor goes on
                traceback.print_exception(problem, file=sys.stderr)
                self._send(m.Notice(f"a bug in Movimentum: {type(problem).__name__}: {problem}", "error"))

    def _take(self, rev: int, text: str) -> None:
        if rev != self._rev:
            return  # a newer one follows
        self._follow()
        self._project.changed(self._path)
        completion.proposals(self._project, self._path, len(text), self._names)  # before somebody asks

    def _follow(self) -> None:
        """The script may be another file by now."""
        path = os.path.abspath(self._worker.path)
        if path != self._path:
            self._path = path
            self._forget()

    def _forget(self) -> None:
        self._project = Project(self._read)

    def _read(self, path: str) -> str | None:
        """The script's text is the page's; of other files only those below its folder are read."""
        if path == self._path:
            return self._text
        return text_on_disk(path) if self._inside(path) else None

    def _inside(self, path: str) -> bool:
        try:
            return Path(path).resolve().is_relative_to(self._worker.folder.resolve())
        except (OSError, RuntimeError, ValueError):
            return False

    def _names(self, folder: str) -> list[str]:
        return completion.names_in(folder) if self._inside(folder) else []

    def _answer(self, answer: Callable[[Any], None], message: Any) -> None:
        if message.rev == self._rev:
            self._follow()
            answer(message)

    def _complete(self, asked: m.ProposalsRequest) -> None:
        found = completion.proposals(self._project, self._path, asked.place, self._names)[:MOST_PROPOSALS]
        span = found[0].span if found else None
        data = [
            {"label": each.label, "what": each.kind, "text": each.text, "detail": each.detail, "help": each.help}
            for each in found
            if each.span == span
        ]
        place = (asked.place, asked.place) if span is None else (span.start, span.end)
        self._send(m.ProposalsReply(asked.rev, asked.place, place, data))

    def _explain(self, asked: m.AboutRequest) -> None:
        found = about.about(self._project, self._path, asked.place, self._worker.facts)
        if found is None:
            self._send(m.AboutReply(asked.rev, asked.place, (asked.place, asked.place), "", []))
            return
        span = (found.span.start, found.span.end)
        self._send(m.AboutReply(asked.rev, asked.place, span, found.written, list(found.paragraphs)))

    def _mean(self, asked: m.MeaningRequest) -> None:
        text = "\n\n\n".join(each.text for each in messages.find(asked.code))
        self._send(m.MeaningReply(asked.rev, asked.code, text or "Nothing is written about this code."))

    def _name(self, asked: m.NamingRequest) -> None:
        use = about.renamable(self._project, self._path, asked.place)
        if use is None or use.symbol is None:
            words = "There is no name here: move the cursor to the name of a thing, an anchor or a value."
            self._send(m.NamingReply(asked.rev, asked.place, "", [], words))
            return
        uses = [each.piece for each in self._project.all_uses(use.symbol) if each.path == self._path]
        spans = [(piece.start, piece.end) for piece in uses]
        self._send(m.NamingReply(asked.rev, asked.place, use.symbol.name, spans))

    def _rename(self, asked: m.RenameRequest) -> None:
        try:
            edits = dict(about.renamed(self._project, self._path, asked.place, asked.name))
        except MovimentumError as error:
            self._edit(asked.rev, [], _words(error.diagnostics[0]))
            return
        here = edits.pop(self._path, [])
        if edits:
            names = " and ".join(sorted(os.path.basename(path) for path in edits))
            words = f"{names} has this name too, and the studio changes no other file: rename it in an editor"
            self._edit(asked.rev, [], f"{words} (`movimentum lsp`).")
            return
        self._edit(asked.rev, here)

    def _format(self, asked: m.FormatRequest) -> None:
        source = SourceText(self._path, self._text)
        try:
            edits = line_edits(source.text, formatted(source))
        except MovimentumError as error:
            found = error.diagnostics[0]
            line = f"line {source.position(found.span.start).line}: " if found.span is not None else ""
            self._edit(asked.rev, [], f"Only a script without errors can be laid out. {line}{found.message}")
            return
        self._edit(asked.rev, edits, "" if edits else "The layout is as it should be.")

    def _edit(self, rev: int, edits: list[Edit], words: str = "") -> None:
        data = [{"from": edit.span.start, "to": edit.span.end, "text": edit.text} for edit in edits]
        self._send(m.TextEdited(rev, data, [], words))


def _words(found: Diagnostic) -> str:
    return "; ".join([found.message, *found.helps])
