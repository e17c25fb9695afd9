"""Half-written files and folders: kept beside their target under a different name until they are whole.

A part is locked by its process. So a part without a lock belongs to a dead process (``kill -9``, a power cut), and the
next process that writes beside it removes it. A lock is visible only on its own machine, so the name says which one
that is.
"""

from __future__ import annotations

import os
import re
import stat
import zlib
from contextlib import suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # no such locks on this system: nothing is removed that a dead process left
    fcntl = None

TRIES = 8
"""Parts that could not be locked before a file system counts as one without locks."""

_PARTS: dict[str, int | None] = {}
"""The parts that this process is writing, and the handles that hold their locks."""


def beside(target: Path) -> Path:
    """A new name for what will become ``target``, with its suffix."""
    return target.with_name(f".{target.stem[:40]}.{_machine()}.{os.urandom(4).hex()}.part{target.suffix}")


def begin(target: Path, *, folder: bool = False) -> Path:
    """Create an empty file (or folder) beside ``target``, locked; `OSError` if that is refused."""
    sweep(target.parent)
    tries = 0
    while True:
        tries += 1
        part = beside(target)
        _PARTS[str(part)] = None
        try:
            if folder:
                part.mkdir()
            else:
                part.open("xb").close()
            handle = _PARTS[str(part)] = _lock(part)
            # a process that sweeps here may have been quicker, and is about to remove it; some systems have no locks
            if (handle is not None or fcntl is None or tries > TRIES) and part.exists():
                return part
        except BaseException:
            discard(str(part))
            raise
        discard(str(part))  # another process removed it before it was locked


def has_parts() -> bool:
    """Whether something half-written is left, after two signals in a row or for lack of memory to remove it."""
    return bool(_PARTS)


def discard(*parts: str) -> None:
    """Remove half-written files and folders; all of them if none is named."""
    for part in parts or tuple(_PARTS):
        _remove(part)
        handle = _PARTS.pop(part, None)
        if handle is not None:
            with suppress(OSError):
                os.close(handle)


def sweep(folder: Path) -> None:
    """Remove the parts in ``folder`` that processes of this machine began and did not finish."""
    if fcntl is None:
        return
    ours = re.compile(rf"\..*\.{_machine()}\.[0-9a-f]{{8}}\.part.*", re.DOTALL)
    with suppress(OSError):
        for name in os.listdir(folder):
            path = str(folder / name)
            if ours.fullmatch(name) and path not in _PARTS:
                handle = _lock(path)
                if handle is not None:
                    _remove(path)
                    os.close(handle)


def _lock(path: Path | str) -> int | None:
    """A handle that holds the lock of a file or folder; None if another process has it, or if there are no locks."""
    if fcntl is None:
        return None
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        mode = os.fstat(handle).st_mode
        if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return handle
    except OSError:
        pass
    os.close(handle)
    return None


def _remove(part: str) -> None:
    try:
        os.unlink(part)
    except (IsADirectoryError, PermissionError):  # which of the two a folder gives depends on the system
        import shutil  # here, for hardly any command comes here

        shutil.rmtree(part, ignore_errors=True)
    except OSError:  # it has got its name, or its folder is gone
        pass


def _machine() -> str:
    """Eight letters for this machine, for names of files."""
    name = os.uname().nodename if hasattr(os, "uname") else ""
    return f"{zlib.crc32(os.fsencode(name)):08x}"
