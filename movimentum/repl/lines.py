"""Splits input into lines to run: continued lines, several commands in one paste, command files. Also has the commands
about earlier lines.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping

from movimentum.records import replace
from movimentum.repl.session import Answer, AnswerWithData, Command, CommandTable, Session, refused
from movimentum.workflow.read import read as read_text

_RELATION = re.compile(r"\s*[=<>~]|\.")
_OF_EXPRESSIONS = re.compile(r"EXPR|CONDITION|VALUE|\[x,y\]")
_WHOLE = re.compile(r"\s*(?:\.[a-z]|@|//|/\*|[A-Za-z]\w*(?:\[[^\]]*\])?\s*:)")
_TOKEN = re.compile(r"//[^\r\n]*|/\*.*?(?:\*/|\Z)|'[^'\r\n]*'?|.", re.DOTALL)
_GOES_ON = "=+-*/^<>~,{([:"


def command_of(text: str, commands: Mapping[str, Command]) -> tuple[Command, str] | None:
    """The command that a line begins with, and its arguments; None for a statement (`free = 3` is about a variable of
    that name, `free` is the command).
    """
    line = text.strip()
    word = line.split(None, 1)[0].rstrip("?;") if line else ""
    rest = line[len(word) :]
    if word in commands and not _RELATION.match(rest) and (not rest or rest[0] in " \t\n;"):
        return commands[word], rest.strip().removesuffix(";").rstrip()
    return None


def _takes_text(text: str, commands: Mapping[str, Command]) -> bool:
    """Whether the line is a command about something else than expressions: a key, a file, a line of the script."""
    found = command_of(text, commands)
    words = text.split()
    return (found is not None and not _OF_EXPRESSIONS.search(found[0].usage)) or words[:1] in (["help"], ["quit"])


def _tokens(text: str) -> Iterator[tuple[str, int, int]]:
    """The signs of ``text`` without comments: each with its place, and how many brackets are open behind it."""
    depth = 0
    for match in _TOKEN.finditer(text):
        token = match[0]
        if token.startswith(("//", "/*")) and len(token) > 1:
            if token.startswith("/*") and not token.endswith("*/"):
                yield "/*", match.start(), depth + 1
            continue
        if token in ("(", "[", "{"):
            depth += 1
        elif token in (")", "]", "}"):
            depth = max(0, depth - 1)
        yield token, match.start(), depth


def unfinished(text: str, commands: Mapping[str, Command]) -> bool:
    """Whether the line goes on: a bracket is open, or it ends in an operator, a ``{`` or a comma."""
    if not text.strip() or _takes_text(text, commands):
        return False
    last, depth = "", 0
    for token, _, open_ in _tokens(text):
        depth = open_
        last = "'" if token[0] == "'" else token if token.strip() else last
    return depth > 0 or (bool(last) and last[-1] in _GOES_ON)


def logical_lines(text: str, commands: Mapping[str, Command]) -> list[str]:
    """The commands to run, in order: continued lines are joined, several statements on a line are split."""
    found: list[str] = []
    held = ""
    for line in text.splitlines():
        held = f"{held}\n{line}" if held else line
        if not unfinished(held, commands):
            found += _parts(held, commands)
            held = ""
    return [*found, *_parts(held, commands)]


def _parts(line: str, commands: Mapping[str, Command]) -> list[str]:
    """The commands and statements of one line; definitions, steps and comments stay whole."""
    if not line.strip():
        return []
    if _WHOLE.match(line) or _takes_text(line, commands):
        return [line.strip()]
    begin, end, parts = 0, 0, list[str]()
    for token, place, depth in _tokens(line):
        if token == ";" and depth == 0:
            parts.append(line[begin:end].strip() if end > begin else "")
            begin = place + 1
        elif token.strip():
            end = place + len(token)
    rest = line[begin:end] if end > begin else ""
    return [part for part in (*parts, rest.strip()) if part]


COMMANDS = CommandTable()
SHOWN = 30
MOST_NESTED = 16


@COMMANDS.add("history [N]")
def history(session: Session, argument: str) -> Answer:
    """the last lines that were typed, in a terminal those of earlier sessions too (30, or N)"""
    text = argument.strip()
    if text and not (text.isdecimal() and len(text) < 7 and int(text) > 0):
        raise refused("argument", f"`history` takes how many lines to show, found `{text}`", "history 50")
    lines = session.lines[:-1][-int(text or SHOWN) :]  # not the question itself
    first = len(session.lines) - len(lines)
    rows = [f"{number:4}  {line}".replace("\n", "\n      ") for number, line in enumerate(lines, first)]
    return session, AnswerWithData("\n".join(rows) or "nothing was typed before", list(lines))


@COMMANDS.add("read FILE")
def read(session: Session, argument: str) -> Answer:
    """carry out the commands and statements in a file, up to the first that fails; # begins a comment"""
    name = argument.strip()
    if len(name) > 1 and name[0] == name[-1] and name[0] in "'\"":
        name = name[1:-1]
    if not name or name == "-":
        raise refused("argument", "`read` needs a file of commands", "read commands.txt")
    path = os.path.realpath(os.path.expanduser(name))
    if path in session.reading or len(session.reading) >= MOST_NESTED:
        raise refused("file", f"`{name}` is being read already: it would read itself endlessly", "help read")
    text = read_text(os.path.expanduser(name)).text
    kept = "\n".join("" if line.lstrip().startswith("#") else line for line in text.splitlines())
    if not kept.strip():
        return session, f"there is nothing in {name}"
    return replace(session, pending=kept, reading=(*session.reading, path)), f"reading {name}"
