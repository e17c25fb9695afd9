"""Commands that show the moment, or the whole motion."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from movimentum.analysis.diagnose.undetermined import missing_spans
from movimentum.arrays import FloatArray
from movimentum.output.files import whole_file
from movimentum.planning.blocks.kinds import method_of
from movimentum.query import reader
from movimentum.repl.expressions import query
from movimentum.repl.session import Answer, AnswerWithData, CommandTable, Session, plain, refused, split_output, table
from movimentum.source import SourceText
from movimentum.text import number, time_text
from movimentum.workflow.animate import animate

if TYPE_CHECKING:
    from movimentum.workflow.choices import Choices

COMMANDS = CommandTable()

DIGITS = 10
COLUMNS, ROWS = 64, 12


def shown_values(session: Session, texts: Sequence[str]) -> str:
    """``EXPR = value``, one on each line; if there is no value, the reason."""
    poses = session.poses()
    found = {text: query(session, text).values(poses)[0].tolist() for text in texts}
    lines = [_shown(session, text, components) for text, components in found.items()]
    return _with_caveat(session, AnswerWithData("\n".join(lines), found))


def _with_caveat(session: Session, text: str) -> str:
    caveat = session.caveat
    if not caveat or not text:
        return text
    said = f"{caveat}\n{text}"
    return AnswerWithData(said, {"caveat": caveat, "shown": text.data}) if isinstance(text, AnswerWithData) else said


def _shown(session: Session, text: str, components: Sequence[float]) -> str:
    if not np.isnan(components).all():
        return f"{text} = {_value(components)}"
    when = time_text(float(session.time))
    lacking = [lack for name in _named(session, text) if (lack := _lack(session, name)) is not None]
    return f"{text} has no value at t = {when}{': ' if lacking else ''}{', '.join(lacking)}"


def _named(session: Session, text: str) -> list[str]:
    """The variables that an expression mentions."""
    words = set(re.findall(r"(?<![.\w])[A-Za-z]\w*", text))
    return [name for name in session.work.scene.variables if name in words]


def _lack(session: Session, name: str) -> str | None:
    """Why a variable has no value now; None if it has one."""
    mask = session.poses().missing.get(name)
    if mask is None or not mask[0]:
        return None
    spans = missing_spans(session.work.motion, name)
    now = float(session.time)
    here = next((lack for lack in reversed(spans) if lack.begin is None or lack.begin <= now), None)
    if here is None or (here.begin is None and here.end is None):
        return f"no statement ever gives `{name}` one"
    if here.end is not None:
        return f"the next statement about `{name}` comes at t = {time_text(here.end)}"
    return f"no statement about `{name}` is in force from t = {time_text(here.begin or 0.0)} on"


def _value(components: Sequence[float]) -> str:
    parts = [number(float(part), DIGITS) if np.isfinite(part) else "no value" for part in components]
    return parts[0] if len(parts) == 1 else f"[{', '.join(parts)}]"


@COMMANDS.add("show [NAME|EXPR]")
def show(session: Session, argument: str) -> Answer:
    """everything, a thing, or the value of any expression"""
    scene, poses = session.work.scene, session.poses()
    text = argument.strip()
    things = [t for t in scene.things if t.is_body and (not text or t.name == text)]
    if text and not things:
        return session, shown_values(session, (text,))
    rows: list[list[str]] = []
    for thing in things:
        for anchor in thing.anchors:
            x, y = poses.world(thing.number, anchor.local)[0]
            rows.append([f"{thing.name}.{anchor.name}", f"[{number(x, DIGITS)}, {number(y, DIGITS)}]"])
        rows.append([f"{thing.name}.angle", number(float(poses.angle[thing.number, 0]), DIGITS)])
    if not text:
        for name in scene.variables:
            lacking = name in poses.missing and bool(poses.missing[name][0])
            value = _value(np.atleast_1d(poses.variables[name][0]).tolist())
            rows.append([name, "no value" if lacking else value])
    return session, _with_caveat(session, table(rows))


@COMMANDS.add("constraints [KEY]")
def constraints(session: Session, argument: str) -> Answer:
    """what is in force, since when, until when, and how well it is satisfied"""
    rows = _constraint_rows(session, argument)
    head = ["constraint", "line", "since", "until", "off by"]
    shown = table([head, *([row[0], *row[1:5]] for row in rows)], right=frozenset({1}))
    return session, _with_caveat(session, shown)


@COMMANDS.add("residuals")
def residuals(session: Session, argument: str) -> Answer:
    """the same, with the worst first"""
    plain(argument, "residuals")
    if session.no_pose and (found := session.contradicting()) is not None:
        head = ["off by where the others hold", "line", "constraint"]
        amounts = [["" if off is None else number(off), str(line), text] for line, text, off in found.statements]
        return session, f"{session.no_pose}\n{table([head, *amounts])}"
    rows = sorted(_constraint_rows(session, ""), key=lambda row: -float(row[5]))
    shown = table([["off by", "line", "constraint"], *([row[4], row[1], row[0]] for row in rows)])
    return session, _with_caveat(session, shown)


def _constraint_rows(session: Session, key: str) -> list[list[str]]:
    work, poses = session.work, session.poses()
    segment = work.timeline.segments[work.timeline.segment_at(session.time)]
    wanted = key.strip().removesuffix(";").strip()
    rows: list[list[str]] = []
    for item in segment.active:
        text = work.scene.source.statement(item.span)
        if wanted and wanted not in (item.key, f"{item.key} {item.relation}") and not text.startswith(wanted):
            continue
        begin = work.scene.steps[item.step].time
        end = begin + work.timeline.lifetimes[item.number]
        off = ""
        amount = -1.0
        try:
            values = reader(work.scene, (*item.left, *item.right))(poses)
        except (NotImplementedError, KeyError):
            off = "solved for" if item.relation == "=" else ""
        else:
            half = len(values) // 2
            apart = [float(a[0] - b[0]) for a, b in zip(values[:half], values[half:], strict=True)]
            if item.relation in ("<", ">"):
                met = apart[0] <= 0.0 if item.relation == "<" else apart[0] >= 0.0
                off = f"holds, by {number(abs(apart[0]))}" if met else f"violated, by {number(abs(apart[0]))}"
                amount = 0.0 if met else abs(apart[0])
            else:
                amount = float(np.hypot.reduce(apart))
                if item.left[0].op == "atan2d":
                    amount = min(amount % 360.0, -amount % 360.0)
                off = number(amount, 2)
        until = "the end" if end >= work.timeline.end else f"@{time_text(float(end))}"
        line = str(work.scene.source.position(item.span.start).line)
        rows.append([text, line, f"@{time_text(float(begin))}", until, off, repr(amount)])
    rows += _rigid_rows(session, wanted)
    if not rows:
        raise refused(
            "key", f"nothing is in force under `{wanted}` now" if wanted else "nothing is in force now", "steps"
        )
    return rows


PAIRS = 3
"""Of a thing with more anchors than this, only the distances from the first anchor are listed."""


def _rigid_rows(session: Session, wanted: str) -> list[list[str]]:
    """The language's own constraints: the anchors of every thing that is solved for keep their distances."""
    scene, poses = session.work.scene, session.poses()
    rows: list[list[str]] = []
    for thing in sorted(session.segment_motion.plan.system.frames):
        body = scene.things[thing]
        line = str(scene.source.position(body.span.start).line)
        firsts = body.anchors if len(body.anchors) <= PAIRS else body.anchors[:1]
        for a, first in enumerate(firsts):
            for second in body.anchors[a + 1 :]:
                length = math.dist(first.local, second.local)
                text = f"|{body.name}.{second.name} - {body.name}.{first.name}| = {number(length, 10)}"
                if length == 0.0 or (wanted and wanted not in (body.name, text)):
                    continue
                apart = poses.world(thing, second.local)[0] - poses.world(thing, first.local)[0]
                off = abs(float(np.hypot(*apart)) - length)
                rows.append([text, line, "always", "the end", number(off, 2), repr(off)])
    return rows


@COMMANDS.add("plan")
def plan(session: Session, argument: str) -> Answer:
    """the blocks in which this step is solved, and their kernels"""
    if argument.strip() == "--equations":
        return session, _equations(session)
    if argument.strip():
        raise refused(
            "argument", f"`plan` takes `--equations` or nothing, found `{argument.strip()}`", "plan --equations"
        )
    the_plan = session.segment_motion.plan
    names = [unknown.name for unknown in the_plan.system.unknowns]
    rows = [["", "kernel", "finds", "moves", "from"]]
    for block in the_plan.blocks:
        lines = sorted({_line(session, e) for e in block.equations})
        rows.append(
            [
                str(block.number),
                method_of(block) + (" (free)" if block.free else ""),
                ", ".join(names[n] for n in block.unknowns),
                "yes" if block.moving else "",
                ", ".join(lines),
            ]
        )
    left = len(the_plan.system.unknowns) - sum(len(block.unknowns) for block in the_plan.blocks)
    note = f"\n{left} more not solved for, because nothing needs them" if left else ""
    checks = f"\n{len(the_plan.checks)} equations only checked" if the_plan.checks else ""
    return session, table(rows) + note + checks


def _equations(session: Session) -> str:
    """The scalar equations of every block, and what each block puts into the later ones."""
    from sympy import sstr

    from movimentum.analysis.interactive.determination import block_equations

    piece, tau = session.piece
    lines = ["in the order in which they are solved; angles in radians inside; t counts from this step"]
    for found in block_equations(session.segment_motion, piece, tau):
        lines.append(f"{found.block.number:3}. {method_of(found.block)}{' (free)' if found.block.free else ''}")
        for equation, zero in found.equations:
            text = "an integral" if zero is None else f"{sstr(zero, full_prec=False)} = 0"
            lines.append(f"     {_line(session, equation)}: {text}")
        for name, value in found.solutions:
            lines.append(f"       {name} = {'(too long to show)' if value is None else sstr(value, full_prec=False)}")
    return "\n".join(lines)


def _line(session: Session, equation: int) -> str:
    system = session.segment_motion.plan.system
    row = system.equations[equation]
    if row.constraint is None:
        return f"{system.scene.things[row.thing].name} is rigid" if row.thing is not None else "the language"
    span = next(c.span for c in system.scene.constraints() if c.number == row.constraint)
    return f"line {session.work.scene.source.position(span.start).line}"


@COMMANDS.add("plot EXPR [-o FILE]")
def plot(session: Session, argument: str) -> Answer:
    """its values over the film, here or as .svg or .png"""
    text, target = split_output(argument, (".svg", ".png"))
    if not text:
        raise refused("argument", "`plot` needs an expression", "plot Rod.B.x")
    work = session.work
    poses = work.motion.poses(0, work.timeline.frame_count)
    values = query(session, text).values(poses)
    values[~poses.solved] = np.nan
    if target is not None:
        from movimentum.encoding.plot import write_curves

        names = ("",) if values.shape[1] == 1 else ("x", "y")
        curves = [(name, values[:, axis].tolist()) for axis, name in enumerate(names)]
        with whole_file(session.refuse_overwriting(target)) as part:
            write_curves(text, poses.times.tolist(), curves, part, Path(target).suffix)
        return session, f"wrote {target}"
    if session.draw is not None:
        from movimentum.encoding.plot import write_curves

        names = ("",) if values.shape[1] == 1 else ("x", "y")
        curves = [(name, values[:, axis].tolist()) for axis, name in enumerate(names)]
        with tempfile.TemporaryDirectory(prefix="movimentum-") as folder:
            path = Path(folder) / "plot.png"
            write_curves(text, poses.times.tolist(), curves, path, ".png")
            session.draw(path.read_bytes())
        return session, ""
    parts = [_drawn(poses.times, values[:, axis]) for axis in range(values.shape[1])]
    heads = [text] if len(parts) == 1 else [f"{text}, {axis}" for axis in "xy"]
    return session, "\n".join(f"{head}\n{part}" for head, part in zip(heads, parts, strict=True))


def _drawn(times: FloatArray, values: FloatArray) -> str:
    """A curve in Braille: two by four dots per character."""
    good = np.isfinite(values)
    if not good.any():
        return "no value at any time"
    low, high = float(values[good].min()), float(values[good].max())
    span = high - low or 1.0
    fine: FloatArray = np.linspace(float(times[0]), float(times[-1]), 8 * COLUMNS) if len(times) > 1 else times
    at = np.interp(fine, times[good], values[good])
    at[np.interp(fine, times, good.astype(float)) < 1.0] = np.nan
    width = (times[-1] - times[0]) or 1.0
    cells = [[0] * COLUMNS for _ in range(ROWS)]
    bits = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))
    for t, v in zip(fine, at, strict=True):
        if np.isfinite(v):
            x = min(2 * COLUMNS - 1, int((t - times[0]) / width * (2 * COLUMNS - 1) + 0.5))
            y = min(4 * ROWS - 1, int((high - v) / span * (4 * ROWS - 1) + 0.5))
            cells[y // 4][x // 2] |= bits[x % 2][y % 4]
    left = max(len(number(high, 6)), len(number(low, 6)))
    labels = [number(high, 6), *[""] * (ROWS - 2), number(low, 6)]
    lines = [
        f"{label.rjust(left)} |{''.join(chr(0x2800 + c) for c in row)}"
        for label, row in zip(labels, cells, strict=True)
    ]
    first, last = time_text(float(times[0])), time_text(float(times[-1]))
    return "\n".join([*lines, " " * (left + 2) + first + last.rjust(COLUMNS - len(first))])


@COMMANDS.add("picture [FILE]")
def picture(session: Session, argument: str) -> Answer:
    """this moment as a .png, with names, anchors and free motions; without FILE, on terminals that show pictures"""  # noqa: D404
    if not argument.strip() and session.draw is not None:
        session.draw(moment_picture(session.work.engine.choices, session.file, session.text, session.time))
        return session, _with_caveat(session, "`picture FILE` writes it")
    name = argument.strip().removeprefix("-o").strip() or f"{Path(session.file).stem or 'moment'}.png"
    if not name.lower().endswith(".png"):
        raise refused("file", f"`{name}` is not a .png file", f"picture {Path(name).stem}.png")
    write_moment(session.work.engine.choices, session.file, session.text, session.time, Path(name))
    return session, _with_caveat(session, f"wrote {name}")


def write_moment(choices: Choices, name: str, text: str, time: Fraction, path: Path) -> None:
    """A moment of a script as a .png, with names, anchors and free motions."""
    from movimentum.workflow.choices import Picture

    show_all = Picture(at=time, show=frozenset({"names", "anchors", "free"}), workers=1)
    animate(SourceText(name, text), path, choices, show_all, lambda _done, _all: None)


def moment_picture(choices: Choices, name: str, text: str, time: Fraction) -> bytes:
    """The same in memory."""
    with tempfile.TemporaryDirectory(prefix="movimentum-") as folder:
        path = Path(folder) / "moment.png"
        write_moment(choices, name, text, time, path)
        return path.read_bytes()
