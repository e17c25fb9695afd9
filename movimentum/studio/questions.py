"""Questions about what somebody clicks: why it is where it is, its formula, its other solutions, its values."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from movimentum.repl.session import Refused, Session, Work
from movimentum.repl.shell import answer
from movimentum.studio.desk import Desk, TextJob, exact_time
from movimentum.studio.messages import Answered, NameAsked, PlotAsked, Plotted

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
    words, suggested = asked(job, message.question, message.name, exact_time(message.time))
    choices: list[dict[str, Any]] = [{"statement": text} for text in suggested]
    desk.send(Answered(message.rev, message.question, message.name, words, choices))


def plot(desk: Desk, message: PlotAsked) -> None:
    """The values of an expression at every frame."""
    from movimentum.repl.expressions import reading

    job = desk.known(message.rev)
    if job is None or not job.moved:
        return
    motion = job.motion
    try:
        read = reading(session_of(job, motion.timeline.start), message.expression)
        values = read.values(motion.poses(0, min(motion.timeline.frame_count, 5000)))
    except Refused as error:
        words = error.diagnostics[0].message if error.diagnostics else "it has no value"
        desk.send(Plotted(message.rev, message.expression, [], words))
        return
    rows = [[value if math.isfinite(value) else None for value in row] for row in values.tolist()]
    desk.send(Plotted(message.rev, message.expression, rows))
