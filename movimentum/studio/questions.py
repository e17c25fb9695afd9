"""Questions about what somebody clicks: why it is where it is, its formula, its other solutions, its values."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from movimentum.repl.session import Refused, Session, Work
from movimentum.repl.sheet import poses_of
from movimentum.repl.shell import answer
from movimentum.solver.segment_motion import Unsolved
from movimentum.studio.answers import Answered, Plotted
from movimentum.studio.desk import Desk, TextJob, exact_time
from movimentum.studio.messages import NameAsked, PlotAsked
from movimentum.studio.moments import piece_at
from movimentum.studio.pictures import frames_shown, some_pictures

if TYPE_CHECKING:
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses

MOST_PLOTTED = 2000
"""Frames that a plot has."""
MOST_SHOWN = 24
"""Solutions that are shown as pictures."""
QUESTIONS = ("why", "formula", "solutions", "free")


def session_of(job: TextJob, time: Fraction) -> Session:
    """A debugging session at an instant of a text."""
    source = job.revision.source
    session = Session(source.path, source.text, Work(job.revision))
    return session.at(time) if job.revision.moves else session


def asked(job: TextJob, question: str, name: str, time: Fraction) -> tuple[str, tuple[str, ...]]:
    """The debugger's answer, and the statements that it suggests."""
    try:
        session, words = answer(session_of(job, time), f"{question} {name}".strip())
    except Refused as error:
        return (error.diagnostics[0].message if error.diagnostics else "there is no answer"), ()
    return words, tuple(item for item in session.suggestions if isinstance(item, str))


def tell(desk: Desk, message: NameAsked) -> None:
    """Answer a question of a page."""
    job = desk.known(message.rev)
    if job is None or not job.moved or message.question not in QUESTIONS:
        desk.send(Answered(message.rev, message.question, message.name, "the motion is not known yet", []))
        return
    if message.question == "solutions":
        desk.send(_solutions(job, message))
        return
    words, suggested = asked(job, message.question, message.name, exact_time(message.time))
    choices: list[dict[str, Any]] = [{"statement": text, "frame": None} for text in suggested]
    desk.send(Answered(message.rev, message.question, message.name, words, choices))


def _solutions(job: TextJob, message: NameAsked) -> Answered:
    """Every solution at an instant, with its picture and what selects it."""
    from movimentum.analysis.interactive.all_solutions import alternatives

    session = session_of(job, exact_time(message.time))
    piece, tau = piece_at(job.motion, session.time)
    if isinstance(piece, Unsolved):
        return Answered(message.rev, message.question, message.name, "there is no solution at this moment", [])
    parts = [part for part in alternatives(session.segment_motion, piece, tau) if len(part.solutions) > 1]
    found = [solution for part in parts for solution in part.solutions][:MOST_SHOWN]
    if not found:
        return Answered(message.rev, message.question, message.name, "there is one solution only at this moment", [])
    film = some_pictures(job.motion.timeline, poses_of(session, [solution.pose for solution in found]))
    choices: list[dict[str, Any]] = [
        {"statement": solution.selects or "", "words": solution.words, "current": solution.current, "frame": frame}
        for frame, solution in enumerate(found)
    ]
    more = "" if all(part.complete for part in parts) else "; found by a search, there may be more"
    words = f"{len(found)} solutions at this moment{more}"
    return Answered(message.rev, message.question, message.name, words, choices, film)


def _spread(motion: PathMotion) -> Poses:
    """The poses of every frame; of a long film, of some that are spread over it."""
    timeline = motion.timeline
    last = frames_shown(timeline) - 1
    if last < MOST_PLOTTED:
        return motion.poses(0, last + 1)
    chosen = [round(k * last / (MOST_PLOTTED - 1)) for k in range(MOST_PLOTTED)]
    return motion.poses_at([timeline.frame_time(frame) for frame in chosen])


def plot(desk: Desk, message: PlotAsked) -> None:
    """The values of an expression over the film."""
    from movimentum.repl.expressions import reading

    job = desk.known(message.rev)
    if job is None or not job.moved:
        return
    motion = job.motion
    try:
        read = reading(session_of(job, motion.timeline.start), message.expression)
        values = read.values(_spread(motion))
    except Refused as error:
        words = error.diagnostics[0].message if error.diagnostics else "it has no value"
        desk.send(Plotted(message.rev, message.expression, [], words))
        return
    rows = [[value if math.isfinite(value) else None for value in row] for row in values.tolist()]
    desk.send(Plotted(message.rev, message.expression, rows))
