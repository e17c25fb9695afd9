"""Text as an output: in a whole file, or on standard output."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO, cast

from movimentum.errors import usage_error
from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file


def standard_output() -> TextIO:
    """Standard output for the text of a file, which is UTF-8 except on a terminal; `UsageError` if it is closed."""
    stream = sys.stdout
    if stream is None:  # pyright: ignore[reportUnnecessaryComparison]
        raise usage_error("output/unwritable", "there is no standard output to write to")
    if not isinstance(stream, io.TextIOWrapper):
        pass
    elif stream.isatty():
        cast("io.TextIOWrapper", stream).reconfigure(errors="backslashreplace")
    else:
        cast("io.TextIOWrapper", stream).reconfigure(encoding="utf-8", newline="\n")
    return cast("TextIO", stream)


def write_text(text: str, target: Path | None, inputs: Iterable[str]) -> None:
    """Write a whole text file, which is not one of ``inputs``, or to stdout."""
    if target is None:
        standard_output().write(text)
        return
    refuse_unwritable(target)
    refuse_overwriting(target, inputs)
    with whole_file(target) as part:
        part.write_text(text, encoding="utf-8", newline="\n")
