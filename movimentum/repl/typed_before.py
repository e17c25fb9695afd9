"""Commands about lines that were typed or written before: the history, and files of commands."""

from __future__ import annotations

import os

from movimentum.records import replace
from movimentum.repl.answers import AnswerWithData
from movimentum.repl.command import Answer, CommandTable
from movimentum.repl.session import Session, refused
from movimentum.workflow.read import read as read_text

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
        raise refused("file", f"`{name}` is being read already: it would read itself for ever", "help read")
    text = read_text(os.path.expanduser(name)).text
    kept = "\n".join("" if line.lstrip().startswith("#") else line for line in text.splitlines())
    if not kept.strip():
        return session, f"there is nothing in {name}"
    return replace(session, pending=kept, reading=(*session.reading, path)), f"reading {name}"
