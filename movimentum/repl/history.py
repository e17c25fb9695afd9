"""Typed lines: stored on disk for the next session if possible, and shown by `history`."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from prompt_toolkit.history import FileHistory, History, InMemoryHistory

MOST_BYTES = 1_000_000
"""A longer history is cut when it is opened: half of this is left."""
_OWN = 0o600


def history_file() -> Path:
    """The file: in the directory that the system has for the state of programs. `RuntimeError` if there is no home."""
    if os.name == "nt":
        home = os.environ.get("LOCALAPPDATA")
        return (Path(home) if home else Path.home() / "AppData" / "Local") / "movimentum" / "repl-history"
    home = os.environ.get("XDG_STATE_HOME")
    base = Path(home) if home and os.path.isabs(home) else Path.home() / ".local" / "state"
    return base / "movimentum" / "repl-history"


class KeptHistory(FileHistory):
    """A history on disk; where it cannot be read or written any more, it goes on in memory."""

    def load_history_strings(self) -> Iterable[str]:
        """See `History`."""
        with suppress(OSError):
            return list(super().load_history_strings())
        return []

    def store_string(self, string: str) -> None:
        """See `History`."""
        with suppress(OSError, ValueError):
            super().store_string(string)


def opened_history() -> History:
    """The history of earlier sessions, which only its owner can read; one in memory if there can be no file."""
    try:
        path = history_file()
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        os.close(os.open(path, os.O_RDWR | os.O_CREAT, _OWN))
        if not path.is_file():
            return InMemoryHistory()
        if os.name != "nt":
            path.chmod(_OWN)
        if path.stat().st_size > MOST_BYTES:
            _cut(path)
    except (OSError, RuntimeError, ValueError):
        return InMemoryHistory()
    return KeptHistory(str(path))


def _cut(path: Path) -> None:
    """Leave the end, from the beginning of an entry on."""
    data = path.read_bytes()
    begin = data.find(b"\n# ", len(data) - MOST_BYTES // 2)
    part = path.with_name(f"{path.name}.part{os.getpid()}")
    try:
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, _OWN), "wb") as stream:
            stream.write(data[begin:] if begin >= 0 else b"")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
