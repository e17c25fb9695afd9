"""Recognises texts with the same statements: they differ only in white space and comments between statements.

Results for one are valid for the other, at other places.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from typing import TYPE_CHECKING

from movimentum.diagnostics import Diagnostic, Label
from movimentum.records import dataclass, replace
from movimentum.source import FarSpan, SourceText, Span, UnfoldedText

if TYPE_CHECKING:
    from movimentum.analysis.examine import Examination

_PART = re.compile(r"\s+|//[^\r\n]*|/\*.*?\*/|(?>'(?:[^'\r\n]|'')*'|//[^\r\n]*|/\*.*?\*/|[^;])++;|.+", re.DOTALL)
"""Nothing in it is tried twice: otherwise each comment behind the last ``;`` would double the time."""


@dataclass(frozen=True, slots=True)
class Items:
    """The statements of a text, each up to its ``;``, with the offset at which each begins."""

    texts: tuple[str, ...]
    starts: tuple[int, ...]
    elsewhere: tuple[str, ...] = ()
    """The texts of included files."""

    def same_as(self, other: Items) -> bool:
        """Whether the texts state the same."""
        return self.texts == other.texts and self.elsewhere == other.elsewhere

    def place_in(self, other: Items, span: Span) -> Span:
        """A span of this text in the ``other``, which states the same."""
        if isinstance(span, FarSpan):
            return span
        item = max(bisect_right(self.starts, span.start) - 1, 0)
        last = max(bisect_right(self.starts, max(span.end - 1, span.start)) - 1, 0)
        return Span(
            span.start + other.starts[item] - self.starts[item], span.end + other.starts[last] - self.starts[last]
        )


def items_of(source: SourceText) -> Items:
    """The statements of a script. (After its last ``;``, whatever else there is counts as one.)"""
    text = source.script.text
    files = source.files if isinstance(source, UnfoldedText) else ()
    found = [match for match in _PART.finditer(text) if not match[0].isspace() and match[0][:2] not in ("//", "/*")]
    return Items(
        tuple(match[0] for match in found), tuple(match.start() for match in found), tuple(file.text for file in files)
    )


def shifted(examination: Examination, old: Items, new: Items) -> Examination:
    """The diagnostics of one text, moved to another with the same statements; without fixes, whose edits depend on
    white space and comments too.
    """
    return replace(examination, diagnostics=tuple(_shifted(item, old, new) for item in examination.diagnostics))


def _shifted(item: Diagnostic, old: Items, new: Items) -> Diagnostic:
    labels = tuple(Label(old.place_in(new, label.span), label.message) for label in item.labels)
    span = None if item.span is None else old.place_in(new, item.span)
    return replace(item, span=span, labels=labels, fixes=())
