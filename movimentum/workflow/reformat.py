"""Formats script files, each completely or not at all."""

from __future__ import annotations

import os
import shutil
from codecs import BOM_UTF8
from contextlib import suppress
from pathlib import Path

from movimentum.errors import errors_in, usage_error
from movimentum.formatting.columns import formatted
from movimentum.output.files import unwritable, whole_file
from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.terminal import typed
from movimentum.workflow.choices import LARGEST_NESTING
from movimentum.workflow.read import decoded, read_bytes


@dataclass(frozen=True, slots=True)
class Reformatted:
    """A script as it is in its file (``data``), and formatted (``text``); ``path`` is ``-`` for stdin."""

    path: str
    data: bytes
    source: SourceText
    text: str

    @property
    def changes(self) -> bool:
        """Whether it was not formatted yet."""
        return self.text != self.source.text

    @property
    def output(self) -> bytes:
        """The bytes of the formatted file; a mark at the beginning of the file stays."""
        return (BOM_UTF8 if self.data.startswith(BOM_UTF8) else b"") + self.text.encode("utf-8")


def reformat(path: str) -> Reformatted:
    """The script at ``path``, formatted; nothing is written. `ScriptError` for a syntax error, `UsageError` for what
    cannot be read.
    """
    data = read_bytes(path)
    source = decoded(data, path)
    with errors_in(source):
        return Reformatted(path, data, source, formatted(source, max_nesting=LARGEST_NESTING))


def write_back(made: Reformatted) -> None:
    """Write a formatted script into its file, with the permissions it had; `UsageError` if that cannot be done, or if
    somebody else has changed the file since it was read.
    """
    path = Path(made.path)
    if not path.is_file():
        raise unwritable(path, "it is not a regular file", f"movimentum fmt - < {typed(path)}")
    with whole_file(path) as part:
        part.write_bytes(made.output)
        with suppress(OSError):
            shutil.copymode(os.path.realpath(path), part)
        if read_bytes(made.path) != made.data:
            raise usage_error(
                "output/changed", f"{path} has changed while it was formatted: it stays as it is now", "run it again"
            )
