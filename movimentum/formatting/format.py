"""A script in the layout of the gallery: the same script, with the same comments, in other white space."""

from __future__ import annotations

from movimentum.formatting.columns import lines_of
from movimentum.formatting.elements import LINE_END
from movimentum.formatting.rows import rows_of
from movimentum.source import SourceText
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
