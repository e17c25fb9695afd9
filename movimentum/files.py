"""Output files that appear whole or not at all: written beside, then renamed."""

from __future__ import annotations

import errno
import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import UsageError

# What a write can fail with that has nothing to do with us; any other OSError in a stage is a bug and stays one.
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}


def unwritable(path: Path | str, reason: str, *helps: str) -> UsageError:
    """The error that says that ``path`` cannot be written, and why."""
    return UsageError([Diagnostic("output/unwritable", Severity.ERROR, f"cannot write {path}: {reason}", helps=helps)])


@contextmanager
def whole_file(path: Path) -> Generator[Path, None, None]:
    """A temporary path beside ``path`` (same suffix, already created and empty), renamed to it in the end.

    Whatever goes wrong in between, an interrupt included, leaves neither a new nor a changed file. A device or a pipe
    (``/dev/null``) is written directly, for a rename would replace it. Raises `UsageError` where the file cannot be
    created, before any work is done, and where the disk is full.
    """
    target = _target(path)
    if target.exists() and not target.is_file():
        with _explained(path, target):
            yield target
        return
    part = _beside(target)
    with _explained(path, part):
        part.open("xb").close()
        try:
            yield part
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)


@contextmanager
def whole_folder(pattern: Path) -> Generator[Path, None, None]:
    """A temporary folder beside ``pattern``; in the end the files written into it move to ``pattern``'s folder."""
    target = _target(pattern)
    part = _beside(target)
    with _explained(pattern, part):
        part.mkdir()
        try:
            yield part
            for file in sorted(part.iterdir()):
                file.replace(target.parent / file.name)
        finally:
            import shutil  # here, for hardly any command comes here

            shutil.rmtree(part, ignore_errors=True)


def refuse_unwritable(path: Path) -> None:
    """Raise `UsageError` now where `whole_file` or `whole_folder` would later, after the work."""
    target = _target(path)
    if target.exists() and not target.is_file():
        return
    part = _beside(target)
    with _explained(path, part):
        part.open("xb").close()
        part.unlink()


def _target(path: Path) -> Path:
    """Where the bytes end up: links are followed, so that a rename does not replace the link."""
    try:
        target = Path(os.path.realpath(path))
        folder, home = target.is_dir(), target.parent.is_dir()
    except OSError as problem:  # a name that is too long, a chain of links without end
        raise unwritable(path, (problem.strerror or str(problem)).lower()) from problem
    if folder:
        raise unwritable(path, "it is a folder", f"-o {path / 'movimentum.gif'}")
    if not home:
        raise unwritable(path, f"there is no folder {path.parent}", f"mkdir -p {path.parent}")
    return target


def _beside(target: Path) -> Path:
    return target.with_name(f".{target.stem[:40]}.{os.urandom(4).hex()}.part{target.suffix}")


@contextmanager
def _explained(path: Path, part: Path) -> Generator[None, None, None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as problem:
        if problem.errno in FULL or str(problem.filename).startswith(str(part)):
            raise unwritable(path, (problem.strerror or str(problem)).lower()) from problem
        raise
