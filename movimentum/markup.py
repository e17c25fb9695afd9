"""Terminal output as HTML for a notebook: the same text and colours, on light and dark backgrounds."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable

_ESCAPE = re.compile(r"\x1b\[([\d;]*)m")
_COLORS = {
    "31": ("error-color1", "errorForeground", "#d6423b"),
    "33": ("warn-color1", "editorWarning-foreground", "#b3720a"),
    "36": ("info-color1", "editorInfo-foreground", "#1b87a3"),
    "34": ("brand-color1", "textLink-foreground", "#3b7edb"),
    "32": ("success-color1", "testing-iconPassed", "#3a8f3e"),
}
"""Colours of a terminal: what JupyterLab and Visual Studio Code have for them, and one for light and dark ground."""
_PRE = (
    "margin: 0; padding: 4px 0; background: none; color: inherit; white-space: pre; overflow-x: auto; line-height: 1.35"
)


def text_html(text: str) -> str:
    """A text with the escapes of a terminal."""
    parts, begun, place = list[str](), False, 0
    for found in _ESCAPE.finditer(text):
        parts.append(html.escape(text[place : found.start()]))
        place = found.end()
        if begun:
            parts.append("</span>")
        styles = [style for code in found[1].split(";") if (style := _style(code))]
        begun = bool(styles)
        if begun:
            parts.append(f'<span style="{"; ".join(styles)}">')
    parts.append(html.escape(text[place:]))
    return f'<pre style="{_PRE}">{"".join(parts)}{"</span>" if begun else ""}</pre>'


def _style(code: str) -> str:
    if code == "1":
        return "font-weight: bold"
    if code not in _COLORS:
        return ""
    jupyter, code_editor, plain = _COLORS[code]
    return f"color: var(--jp-{jupyter}, var(--vscode-{code_editor}, {plain}))"


def table_html(
    titles: Iterable[str], rows: Iterable[Iterable[str]], bad: Iterable[bool], gap: tuple[int, int], caption: str
) -> str:
    """A table of texts. ``bad`` rows are in the colour of errors; ``gap``: after how many rows how many are missing."""
    cell = "padding: 1px 10px; text-align: right; font-variant-numeric: tabular-nums; background: none"
    head = "".join(f'<th style="{cell}">{html.escape(title)}</th>' for title in titles)
    body = [
        f'<tr style="background: none; {_style("31" if is_bad else "")}">'
        + "".join(f'<td style="{cell}">{html.escape(text)}</td>' for text in row)
        + "</tr>"
        for row, is_bad in zip(rows, bad, strict=True)
    ]
    if gap[1]:
        body.insert(gap[0], f'<tr style="background: none"><td style="{cell}">… {gap[1]:,} more</td></tr>')
    return (
        f'<table style="color: inherit; border-collapse: collapse; margin: 0"><thead><tr>{head}</tr></thead>'
        f'<tbody>{"".join(body)}</tbody></table><div style="opacity: .7">{html.escape(caption)}</div>'
    )
