"""What is typed, as lines to carry out: lines that go on, several commands in one paste, files of commands."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from movimentum.repl.command import Command

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
    """What to carry out, in order: lines that go on are one, several statements on a line are several."""
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
