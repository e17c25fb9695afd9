"""A script in the layout of the gallery: the same script, with the same comments, in other white space."""

from __future__ import annotations

import difflib
import re

from movimentum.formatting.columns import lines_of
from movimentum.formatting.elements import LINE_END
from movimentum.formatting.rows import rows_of
from movimentum.source import Edit, SourceText, Span
from movimentum.syntax.parser import MAX_NESTING, parse

MOST_PASSES = 12
"""Columns depend on where text stood, so a second pass may still move some; it takes three at most in practice."""


def formatted(source: SourceText, *, max_nesting: int = MAX_NESTING) -> str:
    """The script's text, formatted: its tree and its comments are the same, and formatting it again changes nothing.

    Lines end as they do in the script. Raises ScriptError as `movimentum.syntax.parser.parse` does.
    """
    parse(source, max_nesting=max_nesting)
    text = LINE_END.sub("\n", source.text)
    for _ in range(MOST_PASSES):
        before, text = text, "".join(line + "\n" for line in lines_of(rows_of(text)))
        if text == before:
            break
    return text.replace("\n", source.newline)


# --- from one layout of a text to another


LINES = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")


def line_edits(before: str, after: str) -> list[Edit]:
    """The edits of whole lines that make ``after`` of ``before``."""
    old, new = LINES.findall(before), LINES.findall(after)
    starts = [0]
    for line in old:
        starts.append(starts[-1] + len(line))
    matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
    return [
        Edit(Span(starts[i], starts[j]), "".join(new[k:m]))
        for tag, i, j, k, m in matcher.get_opcodes()
        if tag != "equal"
    ]
