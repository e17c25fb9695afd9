"""Guesses the intended form of a misspelt constant, part, copy, loop, claim or goal."""

from __future__ import annotations

import re

from movimentum.diagnostics import Fix, insertion, replacement
from movimentum.source import Edit, Span
from movimentum.syntax.suggest import dotted, nearest
from movimentum.things.registry import SHAPES

WORDS = ("config", "let", "part", "for", "include", "claim", "goal", "require", "loop")
"""Tokens that may begin an item, besides names."""

_OTHERS = {
    "const": "let", "constant": "let", "define": "let", "set": "let", "var": "let", "def": "part", "module": "part",
    "block": "part", "group": "part", "import": "include", "use": "include", "repeat": "for", "foreach": "for",
}  # fmt: skip
_HEAD = re.compile(r"\.(let|for)\s+[A-Za-z][A-Za-z0-9_]*\s*(?:=[^;{}=]*)?\Z")
_BARE = re.compile(r"(?<![.A-Za-z0-9_])(let|part|for|include)\s*\Z")
_FILE = re.compile(r"[^\s;'\"]+")
_INDEX = re.compile(r"\(\s*([A-Za-z0-9_+\-* ]+?)\s*\)(?=\s*\.\s*[A-Za-z])")
_GEAR = re.compile(r"\.(gear|rack)\s*\([^(),;]*\Z")
_CASE = re.compile(r"\{[^{}]*:[^{}]*;[^{};:]*\Z")
_POINT = re.compile(
    r"\.(?:trace|vector|dimension|arc|spring|damper|cylinder|slide|line|area|right|ticks|parallel|label)\b[^;]*?([A-Za-z]\w*)\s*\Z"
)


def other_word(word: str) -> str | None:
    """The word that another language's ``word`` is in this one."""
    return _OTHERS.get(word.lower()) or nearest(word, WORDS)


def meant(text: str, before: int, place: int, found: str, accepted: frozenset[str]) -> str | Fix | None:
    """What to write instead of ``found`` at ``place``; the text before it ends at ``before``. None for other things."""
    here = Span(place, place + len(found))
    line = text[max(0, before - 200) : before]
    if (bare := _BARE.search(line)) is not None and (found[0].isalpha() or found[0] == "'"):
        start = before - len(line) + bare.start()
        return dotted(bare[1], start)
    if (head := _HEAD.search(line)) is not None:
        return _in_head(head[1], text, before, here, found, accepted)
    if "STRING" in accepted and line.endswith(".include") and (file := _FILE.match(text, place)) is not None:
        name = f"'{file[0]}'"
        return replacement(f"write the file's name as a text: `.include {name};`", Span(*file.span()), name)
    if found == "(" and (index := _INDEX.match(text, place)) is not None and index[1].strip():
        edits = (Edit(here, "["), Edit(Span(index.end() - 1, index.end()), "]"))
        return Fix(f"write an index as `[{index[1]}]`", edits)
    if found == ")" and (gear := _GEAR.search(line)) is not None:
        return insertion(f"write `.{gear[1]}(teeth, module)`, such as `.{gear[1]}(20, 5)`", place, ", 5")
    if found == ":" and "RBRACE" in accepted and _CASE.search(line):
        return "the last value stands alone: `{ a < 3 : 4; a < 5 : 6; 7 }`"
    if accepted <= {"LSQB", "WORD"} and (point := _POINT.search(line)) is not None:
        return f"name one of its anchors: `{point[1]}.P`"
    return None


def _in_head(word: str, text: str, before: int, here: Span, found: str, accepted: frozenset[str]) -> str | Fix | None:
    """In ``.let name = …`` and ``.for name = …``."""
    if "EQUAL" in accepted and "DOTS" not in accepted:
        if found in (":", "in", "of", "to", ":="):
            return replacement("write `=`", here, "=")
        if word == "let" and (found[0].isdigit() or found[0] in "[('"):
            return insertion(f"write `= {found}`", before, " =")
    if word == "for" and "DOTS" in accepted and found in (":", ",", "to", "-", ".", "until"):
        return replacement("a range is written `1..5`", here, "..")
    if word == "for" and "LBRACE" in accepted and "DOTS" not in accepted:
        end = text.find(";", here.end)
        title = "put what is repeated into braces: `.for k = 1..5 { … }`"
        if end < 0:
            return title
        return Fix(title, (Edit(Span(here.start, here.start), "{ "), Edit(Span(end + 1, end + 1), " }")))
    return None


def copied(text: str, place: int, end: int) -> Fix | None:
    """For a name where a shape should be (it is up to ``end``): a copy of a part, if nothing else stands there."""
    word = text[place:end]
    rest = text[end:].lstrip()
    if nearest(word, SHAPES) is not None or rest[:1] not in (";", "."):
        return None
    return insertion(f"a copy of a part is written `{word}()`", end, "()")


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
        return "a goal is met as closely as possible; if it must hold at any cost, write `.require …;`"
    last = re.search(r"\.[a-z]+\Z", statement[2])
    if found == ";" and word == "goal" and last is not None and (guess := nearest(last[0], _EXTREMES)):
        return replacement(f"did you mean `{guess}`?", Span(before - len(last[0]), before), guess)
    if found == ";" and not re.search(r"[=<>~]", statement[2]):
        side = statement[2].strip() or "Rod.P.y"
        more = "`> 100`, `.largest` or `.smallest`" if word == "goal" else "or `> 100`"
        return f"say what it should be: `.{word} {side} = 100;`, {more}"
    return None
