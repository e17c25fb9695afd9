"""Commands that choose the moment to look at, and whole-film commands that go to where a condition holds."""

from __future__ import annotations

import re
from fractions import Fraction

from movimentum.records import replace
from movimentum.repl.expressions import at_the_prompt, condition, times_of
from movimentum.repl.inspect import shown_values
from movimentum.repl.session import Answer, AnswerWithData, CommandTable, Session, plain, refused, table
from movimentum.text import counted, number, rational, time_text
from movimentum.workflow.inspector import extremes

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


def go_to(session: Session, time: Fraction) -> Answer:
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
    return go_to(session, time)


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
    return go_to(session, timeline.frame_time(number % count))


@COMMANDS.add("next")
def following(session: Session, argument: str) -> Answer:
    """one frame forward"""
    plain(argument, "next")
    timeline = session.work.timeline
    if session.frame + 1 >= timeline.frame_count:
        raise refused("frame", "this is the last frame", "back", "frame 0")
    return go_to(session, timeline.frame_time(session.frame + 1))


@COMMANDS.add("back [until CONDITION]")
def back(session: Session, argument: str) -> Answer:
    """one frame back; or to the last time before at which a condition holds, exactly: `back until Rod.B.x = 300`"""
    words = argument.split(None, 1)
    if words[:1] == ["until"]:
        found = times_of(session, words[1] if len(words) > 1 else "", "back until Rod.B.x = 300")
        time = max((end for end in found.ends if end < session.time), default=None)
        if time is None:
            raise refused("never", f"`{words[1]}` does not hold at any earlier time", f"when {words[1]}")
        return go_to(session, time)
    plain(argument, "back")
    timeline = session.work.timeline
    before = session.frame - (1 if timeline.frame_time(session.frame) == session.time else 0)
    if before < 0:
        raise refused("frame", "this is the first frame", "next")
    return go_to(session, timeline.frame_time(before))


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


CHUNK = 2048
DIGITS = 13
"""Of a time that is found; the last of them is below 1e-12 of a film of some minutes."""


def exact(time: Fraction) -> str:
    """A time to its last digits."""
    return number(float(time), DIGITS)


@COMMANDS.add("when CONDITION")
def when(session: Session, argument: str) -> Answer:
    """every time at which it holds, exactly, and which way it is passed: `when Rocker.angle = 20`, `when x < 100`"""
    found = times_of(session, argument, "when Rod.B.x = 300")
    lines: list[str] = []
    for item in found.crossings:
        until = f" until {exact(item.until)}" if item.until != item.time else ""
        lines.append(f"t = {exact(item.time)}{until}  {item.way}")
    for first, last in found.holding:
        lines.append(f"from t = {exact(first)} to {exact(last)}")
    text = argument.strip().removesuffix(";")
    return session, AnswerWithData("\n".join(lines) or f"`{text}` never holds; {_range(session, text)}", found)


def _range(session: Session, text: str) -> str:
    """The extremes of a condition's left side."""
    left = text.partition("=")[0].partition("<")[0].partition(">")[0].strip()
    parts = [extremes(session, left, largest=largest) for largest in (False, True)]
    words = [
        f"from {number(low.value, 10)} to {number(high.value, 10)}"
        for low, high in zip(*parts, strict=True)
        if low is not None and high is not None
    ]
    return f"`{left}` goes {' and '.join(words)}" if words else f"`{left}` never has a value"


@COMMANDS.add("until CONDITION")
def until(session: Session, argument: str) -> Answer:
    """go to the next time at which it comes to hold, exactly: `until Rod.B.x = 300`"""
    text = argument.strip()
    found = times_of(session, text, "until Rod.B.x = 300")
    time = min((begin for begin in found.begins if begin > session.time), default=None)
    if time is None:
        raise refused("never", f"`{text}` does not come to hold at any later time", f"when {text}")
    return go_to(session, time)


@COMMANDS.add("run [until CONDITION]")
def run_until(session: Session, argument: str) -> Answer:
    """go on to the first frame where it holds: `run until Rod.B.x < 300`; alone: to the next `break`"""
    words = argument.split(None, 1)
    if not words:
        return _run(session)
    if len(words) != 2 or words[0] != "until":
        raise refused("argument", "`run` continues until a condition holds", "run until Rod.B.x < 300")
    holds = condition(session, words[1])
    work = session.work
    count = work.timeline.frame_count
    for first in range(session.frame + 1, count, CHUNK):
        poses = work.motion.poses(first, min(first + CHUNK, count))
        places = (holds(poses) & poses.solved).nonzero()[0]
        if len(places):
            return go_to(session, work.timeline.frame_time(int(poses.frames[places[0]])))
    raise refused("never", f"`{words[1]}` does not hold in any later frame", "frame 0")


def _run(session: Session) -> Answer:
    """On to the next time at which one of the breaks comes to hold, or to the end."""
    if not session.breaks:
        raise refused("argument", "`run` stops where a condition holds", "run until Rod.B.x < 300", "break when x = 3")
    begins = [
        (begin, text)
        for text in session.breaks
        for begin in times_of(session, text, "break when Rod.B.x = 300").begins
        if begin > session.time
    ]
    if not begins:
        after, said = go_to(session, session.work.timeline.end)
        return after, f"no breakpoint is reached\n{said}"
    time, text = min(begins)
    after, said = go_to(session, time)
    return after, f"`{text}` comes to hold\n{said}"


@COMMANDS.add("break [when CONDITION]")
def break_when(session: Session, argument: str) -> Answer:
    """stop `run` where it comes to hold; alone: forget all breaks"""
    words = argument.split(None, 1)
    if not words:
        return replace(session, breaks=()), "there are no breakpoints any more"
    if len(words) != 2 or words[0] != "when":
        raise refused("argument", "`break` needs a condition", "break when Rod.B.x = 300")
    text = words[1].strip().removesuffix(";")
    found = times_of(session, text, "break when Rod.B.x = 300")
    breaks = tuple(dict.fromkeys((*session.breaks, text)))
    return replace(session, breaks=breaks), f"`{text}` comes to hold {counted(len(found.begins), 'time')} in the film"


@COMMANDS.add("max EXPR")
def largest(session: Session, argument: str) -> Answer:
    """its largest value in the film, and when: `max Rod.B.y`"""
    return _extreme(session, argument, "max", largest=True)


@COMMANDS.add("min EXPR")
def smallest(session: Session, argument: str) -> Answer:
    """its smallest value in the film, and when"""
    return _extreme(session, argument, "min", largest=False)


def _extreme(session: Session, argument: str, command: str, *, largest: bool) -> Answer:
    text = argument.strip()
    if not text:
        raise refused("argument", f"`{command}` needs an expression", f"{command} Rod.B.y")
    with at_the_prompt(session, text):
        found = extremes(session, text, largest=largest)
    names = [text] if len(found) == 1 else [f"{text}, {axis}" for axis in "xy"]
    word = "largest" if largest else "smallest"
    lines = [
        f"{name} has no value at any time" if item is None
        else f"{name} is {word} at t = {exact(item.time)}: {number(item.value, 13)}"
        for name, item in zip(names, found, strict=True)
    ]  # fmt: skip
    return session, AnswerWithData("\n".join(lines), dict(zip(names, found, strict=True)))


@COMMANDS.add("watch [EXPR]")
def watch(session: Session, argument: str) -> Answer:
    """show an expression with every prompt, and after every move; alone: stop watching"""
    text = argument.strip()
    if not text:
        return replace(session, watches=()), "nothing is watched now"
    shown = shown_values(session, (text,))
    watches = tuple(dict.fromkeys((*session.watches, text)))
    return replace(session, watches=watches), shown


@COMMANDS.add("contacts")
def contacts(session: Session, argument: str) -> Answer:
    """what touches what that pushes it, from when to when, and what jams"""
    plain(argument, "contacts")
    from movimentum.analysis.contact_events import contacts as happened

    found = happened(session.work.motion.path)
    if not found:
        return session, "nothing that pushes touches anything"
    rows = [["", "t", "contact", "statement"]]
    for each in found:
        here = "->" if each.time <= float(session.time) else ""
        rows.append([here, time_text(each.time), each.words, each.statement])
    return session, AnswerWithData(table(rows), found)
