"""A script from a file."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.source import SourceText
from movimentum.syntax.parser import MAX_CHARACTERS

STDIN = "-"
"""The path that stands for standard input."""


def read_source(path: str | os.PathLike[str], *, max_characters: int = MAX_CHARACTERS) -> SourceText:
    """The script at ``path`` (``"-"``: standard input, shown as ``<stdin>``).

    Raises ScriptError: ``asset/missing`` or ``asset/unreadable`` for what the system says, ``limit/text`` for a file
    that is too long, ``syntax/encoding`` for one that is not UTF-8. A byte order mark is dropped.
    """
    shown = os.fspath(path)
    limit = 4 * max_characters + 4  # bytes: no character of UTF-8 takes more than four
    try:
        if shown == STDIN:
            shown = "<stdin>"
            data = sys.stdin.buffer.read(limit)
        else:
            with Path(shown).open("rb") as file:
                data = file.read(limit)
    except FileNotFoundError:
        raise _failure("asset/missing", f"there is no script `{shown}`", _neighbours(shown)) from None
    except IsADirectoryError:
        raise _failure("asset/unreadable", f"`{shown}` is a folder, not a script") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _failure("asset/unreadable", f"`{shown}` cannot be read: {reason}") from None
    return decode(data, shown)


def decode(data: bytes, shown: str) -> SourceText:
    """The text of a script from its bytes; raises ScriptError (``syntax/encoding``, ``syntax/binary``)."""
    try:
        return SourceText(shown, data.decode("utf-8").removeprefix("\ufeff"))
    except UnicodeDecodeError as error:
        if b"\x00" in data[:4096]:
            raise _failure("syntax/binary", f"`{shown}` is no script: it is a binary file") from None
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - (data.rfind(b"\n", 0, error.start) + 1) + 1
        message = f"`{shown}` is not UTF-8: byte 0x{data[error.start]:02X} on line {line}, byte {column} of the line"
        raise _failure("syntax/encoding", message, ("save it as UTF-8",)) from None


def _neighbours(path: str) -> tuple[str, ...]:
    from movimentum.syntax.suggest import nearest

    folder, name = os.path.split(path)
    try:
        guess = nearest(name, os.listdir(folder or "."))
    except OSError:
        return ()
    return (f"did you mean `{os.path.join(folder, guess)}`?",) if guess else ()


def _failure(code: str, message: str, helps: tuple[str, ...] = ()) -> ScriptError:
    return ScriptError([Diagnostic(code, Severity.ERROR, message, helps=helps)])
