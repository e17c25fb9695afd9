"""Doing something again whenever one of a few files changes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path

PERIOD_S = 0.25


def watch(
    files: Iterable[Path], action: Callable[[], Iterable[Path]], *, sleep: Callable[[float], None] = time.sleep
) -> None:
    """Call ``action``, then again after every change of ``files`` or of the files that it returned; never returns.

    Files are checked four times a second by modification time and size. This works on every file system (including
    network drives) and costs nothing for the few files of a script. A file that disappears counts as a change, because
    editors save by replacing. ``action`` handles its own errors.
    """
    watched = set(files)
    while True:
        # The state before the work: an edit made while it was going on starts it again.
        states = {path: _state(path) for path in watched}
        watched.update(action())
        states.update({path: _state(path) for path in watched - states.keys()})
        while all(_state(path) == state for path, state in states.items()):
            sleep(PERIOD_S)


def _state(path: Path) -> tuple[int, int] | None:
    """Modification time (ns) and size, None for a file that is not there."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
