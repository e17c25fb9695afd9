"""What a person looks at when golden frames differ: expected, actual and difference, side by side in a page."""

from __future__ import annotations

from html import escape
from pathlib import Path

from movimentum.diagnostics import render_text
from movimentum.files import whole_folder
from movimentum.golden import pictures
from movimentum.golden.check import Outcome
from movimentum.source import SourceText

_STYLE = """
body { font-family: sans-serif; margin: 2em } td { vertical-align: top; padding: 4px }
img { border: 1px solid #bbb } pre { background: #f4f4f4; padding: 1em }
"""


def report_folder(outcome: Outcome) -> Path:
    """Where the page and its pictures go: beside the golden frames."""
    return outcome.golden.folder.with_suffix(".golden-failed")


def write_report(outcome: Outcome) -> Path:
    """Write the page and its pictures; returns the page's path."""
    folder = report_folder(outcome)
    folder.mkdir(parents=True, exist_ok=True)
    for file in folder.glob("*.png"):
        file.unlink()
    name = escape(outcome.golden.script.name)
    said = render_text(outcome.diagnostics, SourceText(str(outcome.golden.script), ""))
    rows = [
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{name}</title><style>{_STYLE}</style>',
        f"<h1>{name}</h1><pre>{escape(said)}</pre><table><tr><th><th>expected<th>actual<th>difference",
    ]
    with whole_folder(folder / "page") as part:
        for frame, expected, actual in outcome.pictures:
            cells = [f"<tr><td>frame {frame}"]
            kinds = {"expected": expected, "actual": actual}
            if expected is not None and expected.size == actual.size:
                kinds["difference"] = pictures.shown(expected, actual)
            for kind in ("expected", "actual", "difference"):
                image = kinds.get(kind)
                if image is None:
                    cells.append("<td>none")
                    continue
                file = f"frame-{frame:05d}-{kind}.png"
                image.save(part / file, "PNG")
                cells.append(f'<td><img src="{file}" alt="{kind}">')
            rows.append("".join(cells))
        (part / "index.html").write_text("\n".join([*rows, "</table>", ""]), encoding="utf-8", newline="\n")
    return folder / "index.html"
