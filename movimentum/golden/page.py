"""The report page for golden frames that differ: expected, actual and difference, side by side."""

from __future__ import annotations

import json
import re
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import cast

from movimentum.diagnostics import render_text
from movimentum.golden import check
from movimentum.golden.check import GoldenResult
from movimentum.golden.record import MANIFEST_BYTES
from movimentum.output.files import made_folder, read_limited, remove_own, whole_folder
from movimentum.source import SourceText
from movimentum.terminal import visible

_STYLE = """
body { font-family: sans-serif; margin: 2em } td { vertical-align: top; padding: 4px }
img { border: 1px solid #bbb } pre { background: #f4f4f4; padding: 1em }
"""


MANIFEST = "pictures.json"
"""Names the pictures beside a page, so that the next page removes these and no others."""
_OURS = re.compile(r"frame-\d{5,9}-(expected|actual|difference)\.png")


def report_folder(outcome: GoldenResult) -> Path:
    """Where the page and its pictures go: beside the golden frames."""
    return outcome.golden.folder.with_suffix(".golden-failed")


def write_report(outcome: GoldenResult) -> Path:
    """Write the page and its pictures; returns the page's path."""
    folder = report_folder(outcome)
    for name in _own_pictures(folder):  # other files in this folder are not ours
        remove_own(folder / name, outcome.inputs)
    pictures_written: list[str] = []
    name = escape(visible(outcome.golden.script.name))
    said = render_text(outcome.diagnostics, SourceText(str(outcome.golden.script), ""))
    rows = [
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{name}</title><style>{_STYLE}</style>',
        f"<h1>{name}</h1><pre>{escape(said)}</pre><table><tr><th><th>expected<th>actual<th>difference",
    ]
    with made_folder(folder), whole_folder(folder / "page", outcome.inputs) as part:
        for frame, expected, actual in outcome.pictures:
            cells = [f"<tr><td>frame {frame}"]
            kinds = {"expected": expected, "actual": actual}
            if expected is not None and expected.size == actual.size:
                kinds["difference"] = check.shown(expected, actual)
            for kind in ("expected", "actual", "difference"):
                image = kinds.get(kind)
                if image is None:
                    cells.append("<td>none")
                    continue
                file = f"frame-{frame:05d}-{kind}.png"
                pictures_written.append(file)
                image.save(part / file, "PNG")
                cells.append(f'<td><img src="{file}" alt="{kind}">')
            rows.append("".join(cells))
        (part / "index.html").write_text("\n".join([*rows, "</table>", ""]), encoding="utf-8", newline="\n")
        (part / MANIFEST).write_text(json.dumps(pictures_written, indent=1) + "\n", encoding="utf-8", newline="\n")
    return folder / "index.html"


def remove_report(outcome: GoldenResult) -> None:
    """Remove an earlier page with its pictures; other files in its folder stay, and so does the folder then."""
    folder = report_folder(outcome)
    if (folder / MANIFEST).is_file():
        for name in (*_own_pictures(folder), "index.html", MANIFEST):
            remove_own(folder / name, outcome.inputs)
        with suppress(OSError):
            folder.rmdir()


def _own_pictures(folder: Path) -> list[str]:
    """The pictures that an earlier page here wrote, by its manifest; a name that we do not give is left out."""
    try:
        names = json.loads(read_limited(folder / MANIFEST, MANIFEST_BYTES))
    except (OSError, ValueError, RecursionError):
        return []
    if not isinstance(names, list):
        return []
    return [name for name in cast("list[object]", names) if isinstance(name, str) and _OURS.fullmatch(name)]
