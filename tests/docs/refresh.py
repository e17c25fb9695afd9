"""Writes into the pages what their sessions print today: ``python -m tests.docs.refresh [PAGE …]``. Then read them."""

from __future__ import annotations

import contextlib
import re
import sys
import tempfile
from pathlib import Path

from tests.docs.pages import DOCS, MADE, PAGES, alike, answer, blocks, name_of
from tests.docs.test_pages import furnish


def refresh(path: Path) -> None:
    """One page. What is shown and still right, with its `…`, stays."""
    page, place = path.read_text(encoding="utf-8"), 0
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        furnish(path, Path(folder))
        for block in blocks(path):
            if "." in block.title:
                Path(folder, block.title).write_text(block.text, encoding="utf-8")
            if block.language != "console":
                continue
            new = ""
            for exchange in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
                line, _, shown = exchange.partition("\n")
                said = answer(line)
                new += f"$ {line}\n" + (shown if alike(shown, said) else said.rstrip() + "\n" * bool(said.strip()))
            old = f"```console\n{block.text}```"
            place = page.index(old, place)
            if new != block.text:
                print(f"{name_of(path)}:{block.line}\n{new}")
                page = f"{page[:place]}```console\n{new}```{page[place + len(old) :]}"
            place += len(new)
    path.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    chosen = [DOCS / name for name in sys.argv[1:]] or [path for path in PAGES if name_of(path) not in MADE]
    for each in chosen:
        refresh(each)
