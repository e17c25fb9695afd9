"""What was probably meant where a claim, a goal or a requirement is misspelt."""

from __future__ import annotations

import re

from movimentum.diagnostics import Fix, replacement
from movimentum.source import Edit, Span
from movimentum.syntax.suggest import dotted, nearest

_STATEMENT = re.compile(r"\.(claim|goal|require)\b([^;@]*)\Z")
_ARGUMENTS = re.compile(r"\s*\([^();]*\)")
_TIME = re.compile(r"(?:\d+\.?\d*|\.\d+|[A-Za-z][A-Za-z0-9_]*)(?:\s*/\s*\d+)?")
_EXTENT = re.compile(r"\.(?:weight|within)\s*\([^();]*\)\s*\Z")
_EXTREMES = (".largest", ".smallest")
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
    if found in _EXTREMES and word != "goal":
        begin = before - len(line) + statement.start()
        return replacement(f"only a goal is `{found}`", Span(begin, begin + len(word) + 1), ".goal")
    if found == ".within" and line.rstrip().endswith(_EXTREMES):
        return "a goal comes as near as can be; what must hold whatever it costs stands in `.require …;`"
    last = re.search(r"\.[a-z]+\Z", statement[2])
    if found == ";" and word == "goal" and last is not None and (guess := nearest(last[0], _EXTREMES)):
        return replacement(f"did you mean `{guess}`?", Span(before - len(last[0]), before), guess)
    if found == ";" and not re.search(r"[=<>~]", statement[2]):
        side = statement[2].strip() or "Rod.P.y"
        more = "`> 100`, `.largest` or `.smallest`" if word == "goal" else "or `> 100`"
        return f"say what it should be: `.{word} {side} = 100;`, {more}"
    return None
