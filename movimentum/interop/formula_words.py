"""The words and the comments of Pyslvs' triangular formulas (see `movimentum.interop.formulas`)."""

from __future__ import annotations

import re

SHAPES = {
    "PLA": "PLa",
    "PLAP": "PLaP",
    "PLLP": "PLLP",
    "PLPP": "PLPP",
    "PALP": "PaLP",
    "PXY": "PLL",
    "PPP": "PPP",
}
"""What each function takes: points (P), lengths (L) and angles (a). PLAP is also written without its last point."""
_LINE_END = re.compile(r"[\r\n]")


def without_comments(text: str) -> str:
    """The text with its comments blanked out; the rest keeps its place."""
    parts: list[str] = []
    place, closed = 0, True
    while (begin := text.find("#", place)) >= 0:
        end = text.find("#]", begin + 2) if closed and text.startswith("#[", begin) else begin
        if end < 0:  # then no later one ends either, so it is not searched again
            closed, end = False, begin
        line_end = _LINE_END.search(text, end)
        end = len(text) if line_end is None else line_end.start()
        parts += [text[place:begin], re.sub(r"[^\r\n]", " ", text[begin:end])]
        place = end
    return "".join([*parts, text[place:]])
