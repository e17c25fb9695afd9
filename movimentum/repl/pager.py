"""Shows long answers a page at a time in a terminal."""

from __future__ import annotations

import os
import shutil
import sys

from movimentum.console import is_terminal

_LESS = "-FRX"
"""What `difference_of` needs to leave the text on the screen, to show colours, and to end by itself where all fits."""


def is_long(text: str) -> bool:
    """Whether an answer is longer than the terminal, and somebody wants a pager: `PAGER` is not empty and not `cat`."""
    wanted = os.environ.get("PAGER", "less").strip() not in ("", "cat")
    if not wanted or not is_terminal(sys.stdout) or not is_terminal(sys.stdin):
        return False
    size = shutil.get_terminal_size()
    rows = sum(1 + max(0, len(line) - 1) // max(1, size.columns) for line in text.splitlines())
    return rows > size.lines - 1


def in_pager(text: str) -> None:
    """Show a text through the pager of `PAGER`, or the system's."""
    from click import echo_via_pager

    before = os.environ.get("LESS")
    if before is None:
        os.environ["LESS"] = _LESS
    try:
        echo_via_pager(text)
    finally:
        if before is None:
            os.environ.pop("LESS", None)
