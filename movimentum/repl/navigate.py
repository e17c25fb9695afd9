"""Commands that choose the moment to look at."""

from __future__ import annotations

import re
from fractions import Fraction

from movimentum.repl.answers import AnswerWithData
from movimentum.repl.command import Answer, CommandTable, plain, table
from movimentum.repl.expressions import times_of
from movimentum.repl.inspect import shown_values
from movimentum.repl.session import Session, refused
from movimentum.text import counted, rational, time_text

COMMANDS = CommandTable()


def where(session: Session) -> str:
    """The moment in words, and what is watched."""
    timeline = session.work.timeline
    exact = timeline.frame_time(session.frame) == session.time
    frame = f"frame {session.frame}" if exact else f"between frames {session.frame} and {session.frame + 1}"
    step = session.work.scene.steps[session.step]
    line = session.work.scene.source.position(step.span.start).line
    lines = [f"t = {time_text(float(session.time))} ({frame}), in step @{time_text(float(step.time))} (line {line})"]
    standing = session.standing
    if not standing.solved:
        shown = "things are shown as drawn" if standing.last is None else "the last good pose is shown"
        lines.append(f"there is no solution here; {shown} (`conflicts` says why)")
    if session.watches and session.ask is None:  # a terminal has them above its prompt
        lines.append(shown_values(session, session.watches))
    return "\n".join(lines)


def moved(session: Session, time: Fraction) -> Answer:
    """The session at another time, and where that is."""
    session = session.at(time)
    place = {"time": session.time, "frame": session.frame, "step": session.step, "solved": session.standing.solved}
    return session, AnswerWithData(where(session), place)


@COMMANDS.add("at T")
def at(session: Session, argument: str) -> Answer:
    """go to a time: `at 1.5`, `at 4/3`"""
    timeline = session.work.timeline
    if not argument.strip():
        return session, where(session)
    time = rational(argument, exponents=True)
    if time is None:
        raise refused("time", f"`{argument.strip()}` is not a time", "at 1.5", "at 4/3")
    if not timeline.start <= time <= timeline.end:
        first, last = time_text(float(timeline.start)), time_text(float(timeline.end))
        raise refused("time", f"time {argument.strip()} is outside the film, from {first} to {last}", f"at {last}")
    return moved(session, time)


@COMMANDS.add("frame N")
def frame(session: Session, argument: str) -> Answer:
    """go to a frame, from 0; -1 is the last"""
    timeline = session.work.timeline
    count = timeline.frame_count
    if not re.fullmatch(r"\s*-?\d{1,9}\s*", argument):
        raise refused("frame", f"`{argument.strip()}` is not a frame number", "frame 0", f"frame {count - 1}")
    number = int(argument)
    if not -count <= number < count:
        raise refused("frame", f"there is no frame {number}: they go from 0 to {count - 1}", f"frame {count - 1}")
    return moved(session, timeline.frame_time(number % count))


@COMMANDS.add("next")
def following(session: Session, argument: str) -> Answer:
    """one frame forward"""
    plain(argument, "next")
    timeline = session.work.timeline
    if session.frame + 1 >= timeline.frame_count:
        raise refused("frame", "this is the last frame", "back", "frame 0")
    return moved(session, timeline.frame_time(session.frame + 1))


@COMMANDS.add("back [until CONDITION]")
def back(session: Session, argument: str) -> Answer:
    """one frame back; or to the last time before at which a condition holds, exactly: `back until Rod.B.x = 300`"""
    words = argument.split(None, 1)
    if words[:1] == ["until"]:
        found = times_of(session, words[1] if len(words) > 1 else "", "back until Rod.B.x = 300")
        time = max((end for end in found.ends if end < session.time), default=None)
        if time is None:
            raise refused("never", f"`{words[1]}` does not hold at any earlier time", f"when {words[1]}")
        return moved(session, time)
    plain(argument, "back")
    timeline = session.work.timeline
    before = session.frame - (1 if timeline.frame_time(session.frame) == session.time else 0)
    if before < 0:
        raise refused("frame", "this is the first frame", "next")
    return moved(session, timeline.frame_time(before))


@COMMANDS.add("steps")
def steps(session: Session, argument: str) -> Answer:
    """the steps, with their lines"""
    plain(argument, "steps")
    work = session.work
    rows: list[list[str]] = []
    for segment in work.timeline.segments:
        step = work.scene.steps[segment.step]
        rows.append(
            [
                "->" if segment.step == session.step else "",
                f"@{time_text(float(segment.start))}",
                f"line {work.scene.source.position(step.span.start).line}",
                counted(len(step.statements), "statement"),
                f"{len(segment.active)} in force",
            ]
        )
    return session, table(rows)
