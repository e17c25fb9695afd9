"""Commands that show the script and edit it line by line: any script text can be typed."""

from __future__ import annotations

import difflib
import os
import re
import shlex
import subprocess
import tempfile
from pathlib import Path

from movimentum.diagnostics import Severity
from movimentum.errors import ScriptError
from movimentum.repl.edit import changed
from movimentum.repl.session import Answer, AnswerWithData, CommandTable, Session, refused, typed
from movimentum.scene.expansion.product import NamedConstant
from movimentum.scene.text_edits import added, in_script
from movimentum.source import Edit, SourceText, Span, edited
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import ClaimStatement, StepHeader
from movimentum.text import rational

COMMANDS = CommandTable()
_WHOLE = re.compile(r"\s*(\.let\b|\.claim\b|\.config\b|\.include\b|\.part\b|@|//|/\*|[A-Za-z]\w*(\[[^\]]*\])?\s*:)")


@COMMANDS.add("list [LINE | FROM-TO]")
def listed(session: Session, argument: str) -> Answer:
    """the script as it is now, with line numbers; `>` marks the step in force, `!` lines that a message is about"""
    source = session.work.source
    lines = source.text.splitlines()
    given = re.fullmatch(r"\s*(?:(\d{1,6})(?:\s*-\s*(\d{1,6}))?)?\s*", argument)
    if given is None or (given[1] and not 1 <= int(given[1]) <= len(lines)):
        raise refused("argument", f"`list` takes lines from 1 to {len(lines)}, found `{argument.strip()}`", "list 1-9")
    first, last = (int(given[1]), int(given[2] or given[1])) if given[1] else (1, len(lines))
    here: tuple[int, int] = (0, 0)
    if session.work.moves:
        steps = session.work.scene.steps
        after = [step.span.start for step in steps if step.number > session.step]
        begin = source.position(steps[session.step].span.start).line
        here = begin, (source.position(min(after)).line - 1 if after else len(lines))
    noted = {
        source.position(item.span.start).line
        for item in session.work.diagnostics
        if item.span is not None and item.severity is not Severity.NOTE
    }
    width = len(str(len(lines)))
    rows = [
        f"{'!' if number in noted else '>' if here[0] <= number <= here[1] else ' '} {number:{width}} | {text}".rstrip()
        for number, text in enumerate(lines, 1)
        if first <= number <= last
    ]
    return session, AnswerWithData("\n".join(rows), lines[first - 1 : last])


@COMMANDS.add("edit [LINE [TEXT]]")
def edit(session: Session, argument: str) -> Answer:
    """put TEXT in the place of a line; without TEXT, the line is asked for; alone: the whole script in $EDITOR"""
    given = re.fullmatch(r"\s*(?:(\d{1,6})(?:\s(.*))?)?", argument, re.DOTALL)
    if given is None:
        raise refused("argument", f"`edit` takes a line's number and its text, found `{argument.strip()}`", "edit 3 …")
    if not given[1]:
        return _in_editor(session)
    source, number = session.work.source, int(given[1])
    count = len(source.text.splitlines())
    if not 1 <= number <= count:
        raise refused("argument", f"there is no line {number}: they go from 1 to {count}", "list")
    text = given[2]
    if text is None:
        if session.ask is None:
            raise refused("argument", "`edit LINE` needs its text: no terminal can ask for it", f"edit {number} TEXT")
        text = session.ask(f"line {number} is `{source.line(number)}`; new text: ")
        if not text:
            return session, "nothing is changed"
    start = source.line_start(number)
    return changed(session.edited(edited(source.text, [Edit(Span(start, start + len(source.line(number))), text)])))


def _in_editor(session: Session) -> Answer:
    """The script in the user's editor."""
    program = os.environ.get("VISUAL") or os.environ.get("EDITOR")
    if session.ask is None or not program:
        reason = "no editor is named" if not program else "there is no terminal for an editor"
        raise refused("editor", f"{reason}: set $EDITOR, or change a line with `edit LINE TEXT`", "edit 3 TEXT")
    with tempfile.TemporaryDirectory(prefix="movimentum-") as folder:
        path = Path(folder) / (Path(session.file).name if session.file.endswith(".mov") else "script.mov")
        path.write_text(session.text, encoding="utf-8", newline="")
        try:
            done = subprocess.run([*shlex.split(program), str(path)], check=False)
            text = path.read_bytes().decode("utf-8-sig")
        except (OSError, ValueError) as problem:
            raise refused("editor", f"the editor `{program}` cannot be used: {problem}", "edit 3 TEXT") from problem
    if done.returncode != 0 or text == session.text:
        return session, "nothing is changed"
    return changed(session.edited(text))


@COMMANDS.add("set NAME VALUE")
def assign(session: Session, argument: str) -> Answer:
    """give a constant (`.let`) another value: `set r 70`"""
    given = re.fullmatch(r"\s*([A-Za-z]\w*)\s*=?\s*(.+?)\s*;?\s*", argument, re.DOTALL)
    if given is None:
        raise refused("argument", "`set` needs a constant and its value", "set r 70")
    scene = session.work.scene
    constant = constant_named(session, given[1])
    if constant is None:
        names = [item.name for item in scene.constants]
        near = difflib.get_close_matches(given[1], names, 3) or names[:3]
        raise refused("name", f"there is no constant `{given[1]}`", *(f"set {name} {given[2]}" for name in near))
    edit_ = in_script(scene, Edit(constant.expression, given[2]))
    if edit_ is None:
        raise refused("elsewhere", f"`{given[1]}` is set in another file", "edit that file")
    return changed(session.edited(edited(session.text, [edit_])))


def constant_named(session: Session, name: str) -> NamedConstant | None:
    """The constant of that name; None where there is none, or the script is not understood."""
    scene = session.work.scene if session.work.moves else None
    return next((item for item in scene.constants if item.name == name), None) if scene is not None else None


def typed_part(session: Session, text: str) -> Answer | None:
    """Other typed script text: a definition, a constant, a claim, a step, a comment. None for anything else."""
    named = re.match(r"\s*([A-Za-z]\w*)\s*=(?!=)\s*(.+)", text, re.DOTALL)
    if named is not None and (constant := constant_named(session, named[1])) is not None:
        value = named[2].strip().removesuffix(";")
        is_now = session.work.scene.source.slice(constant.expression).strip()
        message = f"`{named[1]}` is a constant (`.let {named[1]} = {is_now}`): a statement cannot change it"
        raise refused("constant", message, f"set {named[1]} {value}")
    if _WHOLE.match(text) is None:
        return None
    line = text.strip()
    source = session.work.source
    if line.startswith(("//", "/*")):
        return changed(session.edited(_before_steps(source, session, line, here=True)))
    if not line.endswith((";", "}")) and not re.fullmatch(r"@\s*[\d./*+-]+", line):
        line += ";"
    try:
        items = parse(SourceText("<typed>", line)).items
    except ScriptError as error:
        raise ScriptError(error.diagnostics[:1], typed(line)) from error
    if items and isinstance(items[0], StepHeader):
        return changed(session.edited(_with_step(source, line)))
    if items and isinstance(items[0], ClaimStatement):
        if not session.work.moves:
            raise refused("argument", "a claim needs a script without errors to stand in", "check")
        return changed(session.edited(edited(source.text, [added(session.work.scene, session.step, line)])))
    return changed(session.edited(_before_steps(source, session, line, here=False)))


def _steps(source: SourceText) -> list[tuple[str, int]]:
    """The times of the script's steps, as they are written, and where these begin."""
    found = re.finditer(r"(?m)^[ \t]*@\s*([\d./]+)?", source.text)
    return [(match[1] or "", match.start() + match[0].index("@")) for match in found]


def _before_steps(source: SourceText, session: Session, line: str, *, here: bool) -> str:
    """The script with a line before the first step, or (``here``) before the step in force."""
    places = [place for _, place in _steps(source)]
    place = places[0] if places else len(source.text)
    if here and session.work.moves:
        place = min(session.work.scene.steps[session.step].span.start, len(source.text))
    start = max(source.text.rfind("\n", 0, place), source.text.rfind("\r", 0, place)) + 1
    return edited(source.text, [Edit(Span(start, start), line + source.newline)])


def _with_step(source: SourceText, line: str) -> str:
    """The script with another step, at its place in time."""
    wanted = re.match(r"@\s*([\d./]+)", line)
    time = None if wanted is None else rational(wanted[1])
    later = [
        place
        for written, place in _steps(source)
        if time is not None and written and (other := rational(written)) is not None and other > time
    ]
    if later:
        start = max(source.text.rfind("\n", 0, later[0]), source.text.rfind("\r", 0, later[0])) + 1
        return edited(source.text, [Edit(Span(start, start), line + source.newline)])
    end = len(source.text)
    before = "" if source.text.endswith(("\n", "\r")) or not source.text else source.newline
    return edited(source.text, [Edit(Span(end, end), before + line + source.newline)])
