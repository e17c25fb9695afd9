"""From one layout of a text to another."""

from __future__ import annotations

import difflib
import re

from movimentum.source import Edit, Span

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
