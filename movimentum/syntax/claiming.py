"""What was probably meant where a claim, a goal or a requirement is misspelt."""

from __future__ import annotations

import re

from movimentum.diagnostics import Fix, replacement
from movimentum.source import Edit, Span
from movimentum.syntax.suggest import dotted

_STATEMENT = re.compile(r"\.(claim|goal|require)\b([^;@]*)\Z")
_ARGUMENTS = re.compile(r"\s*\([^();]*\)")
_TIME = re.compile(r"(?:\d+\.?\d*|\.\d+|[A-Za-z][A-Za-z0-9_]*)(?:\s*/\s*\d+)?")
_EXTENT = re.compile(r"\.(?:weight|within)\s*\([^();]*\)\s*\Z")
_WORDS = ("at", "weight", "within")


def claim_meant(text: str, before: int, place: int, found: str) -> str | Fix | None:
    """What to write instead of ``found`` at ``place``, in a claim, a goal or a requirement; the text before it ends at
    ``before``. None elsewhere, and for other things.
    """
    line = text[max(0, before - 1000) : before]
    statement = _STATEMENT.search(line)
    if statement is None:
        return None
    word, here = statement[1], Span(place, place + len(found))
    arguments = _ARGUMENTS.match(text, here.end)
    if found in _WORDS and arguments is not None:
        return dotted(f"{found}(…)", place)
    if found == ".at" and arguments is not None and (extent := _EXTENT.search(line)) is not None:
        start = before - len(line) + extent.start()
        moved = f"{text[place : arguments.end()]} {extent[0].strip()}"
        return Fix("the time comes first", (Edit(Span(start, arguments.end()), moved),))
    if line.endswith(".at") and (time := _TIME.match(text, place)) is not None:
        edits = (Edit(Span(before, place), "("), Edit(Span(time.end(), time.end()), ")"))
        return Fix(f"write `.at({time[0]})`", edits)
    if found == "~":
        more = "a goal is met as closely as possible" if word == "goal" else "`.within(…)` says how far it may be off"
        return replacement(f"write `=`: {more}", here, "=")
    if found == ";" and not re.search(r"[=<>~]", statement[2]):
        side = statement[2].strip() or "Rod.P.y"
        return f"say what it should be: `.{word} {side} = 100;`, or `> 100`"
    return None
