"""Output files that appear whole or not at all, and never replace an input; text output to a file or to stdout.

Files are written beside their target and then renamed. Foreign files are read here too, with a size limit.
"""

from __future__ import annotations

import errno
import io
import os
import re
import stat
import sys
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO, cast

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import UsageError, usage_error
from movimentum.output import partial_files
from movimentum.terminal import typed

WINDOWS = os.name == "nt"
_DEVICE = re.compile(r"(?i)(con|prn|aux|nul|(com|lpt)[0-9¹²³]) *(\.|$)")
# The errors of a write that are not our fault; any other OSError in a stage is a bug and stays one.
_WINDOWS_MARK = b"\xef\xbb\xbf"
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}


def unwritable(path: Path | str, reason: str, *helps: str) -> UsageError:
    """The error that says that ``path`` cannot be written, and why."""
    return UsageError([Diagnostic("output/unwritable", Severity.ERROR, f"cannot write {path}: {reason}", helps=helps)])


@contextmanager
def whole_file(path: Path) -> Generator[Path, None, None]:
    """A temporary path beside ``path`` (same suffix, already created and empty), renamed to it at the end.

    Whatever goes wrong in between, an interrupt included, leaves neither a new nor a changed file. A device or a pipe
    (``/dev/null``) is written directly, because a rename would replace it. Raises `UsageError` if the file cannot be
    created, before any work is done, and if the disk is full.
    """
    target = _target(path)
    if target.exists() and not target.is_file():
        with explained(path, target):
            yield target
        return
    part = _begun(path, target)
    with explained(path, part):
        try:
            yield part
            part.replace(target)
        finally:
            partial_files.discard(str(part))


def write_script(path: Path, text: str) -> None:
    """Write a script, whole or not at all; `UsageError` if that cannot be done. A mark at its beginning stays."""
    try:
        with path.open("rb") as stream:
            marked = stream.read(3) == _WINDOWS_MARK
    except (OSError, ValueError):
        marked = False
    with whole_file(path) as part:
        part.write_bytes((_WINDOWS_MARK if marked else b"") + text.encode("utf-8"))


@contextmanager
def whole_folder(pattern: Path, inputs: Iterable[str | Path] = ()) -> Generator[Path, None, None]:
    """A temporary folder beside ``pattern``; at the end the files written into it move to ``pattern``'s folder.

    Raises `UsageError` if one of them would overwrite one of ``inputs``; then none moves.
    """
    target = _target(pattern)
    part = _begun(pattern, target, folder=True)
    with explained(pattern, part):
        try:
            yield part
            written = sorted(part.iterdir())
            for file in written:
                refuse_overwriting(target.parent / file.name, inputs)
            for file in written:
                file.replace(target.parent / file.name)
        finally:
            partial_files.discard(str(part))


def refuse_unwritable(path: Path) -> None:
    """Raise `UsageError` now if `whole_file` or `whole_folder` would raise it later, after the work."""
    target = _target(path)
    if target.exists() and not target.is_file():
        return
    partial_files.discard(str(_begun(path, target)))


def refuse_overwriting(path: Path, inputs: Iterable[str | Path], numbers: range = range(0)) -> None:
    """Raise `UsageError` if writing ``path`` would change one of the ``inputs``, the files that are read.

    Files are compared, not names, so a different spelling, a link or a hard link makes no difference. A ``path`` with a
    ``%d`` means its files with ``numbers``. Inputs that do not exist are left out.
    """
    read = {identity: name for name in inputs if (identity := _identity(name)) is not None}
    for output in _outputs(path, numbers) if read else ():
        found = read.get(_identity(output) or (0, 0))
        if found is not None:
            raise _overwriting(path, output, found)


def _identity(path: str | Path) -> tuple[int, int] | None:
    """The identity of a regular file; None if there is none."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return (status.st_dev, status.st_ino) if stat.S_ISREG(status.st_mode) else None


def _outputs(path: Path, numbers: range) -> Iterator[Path]:
    """``path``, or those of the files ``path % number`` that exist."""
    if not numbers:
        yield path
        return
    before, number, after = re.split(r"(%0?\d*d)", path.name, maxsplit=1)
    pattern = re.compile(f"{re.escape(before)}( *[0-9]+){re.escape(after)}")
    try:
        names = sorted(os.listdir(path.parent))
    except OSError:
        return
    for name in names:
        match = pattern.fullmatch(name)
        if match and int(match[1]) in numbers and number % int(match[1]) == match[1]:
            yield path.with_name(name)


def _overwriting(path: Path, output: Path, found: str | Path) -> UsageError:
    same = "" if os.path.abspath(found) == os.path.abspath(output) else f" (it is the same file as {found})"
    free = path.with_name(f"out-{path.name}")
    while free.exists():
        free = free.with_name(f"out-{free.name}")
    return UsageError(
        [
            Diagnostic(
                "usage/overwrites-input",
                Severity.ERROR,
                f"{output} is read by this command{same}: input files are never overwritten",
                helps=(Choose.OUTPUT.to(typed(free)),),
            )
        ]
    )


@contextmanager
def made_folder(folder: Path) -> Generator[None, None, None]:
    """The folder, with those above it; `UsageError` if it cannot be made. Those that were made for it go again if
    nothing has come into them.
    """
    try:
        missing = [each for each in (folder, *folder.parents) if not each.exists()]
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise unwritable(folder, (problem.strerror or str(problem)).lower()) from problem
    try:
        yield
    finally:
        with suppress(OSError):
            for each in missing:
                each.rmdir()


def remove_own(path: Path, inputs: Iterable[str | Path] = ()) -> None:
    """Remove a file that we wrote earlier, if it is still there; never one of ``inputs``, nor anything that is not a
    file.
    """
    try:
        refuse_overwriting(path, inputs)
        if stat.S_ISREG(os.lstat(path).st_mode):
            path.unlink()
    except (OSError, UsageError):
        pass


def read_limited(path: Path, limit: int, *, lines: int | None = None) -> bytes:
    """The bytes of a regular file (or of its first ``lines``), at most ``limit``; `OSError` for anything else.

    A pipe or a device is not waited for.
    """
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with open(handle, "rb") as stream:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", str(path))
        data = stream.read(limit + 1) if lines is None else b"".join(stream.readline(limit + 1) for _ in range(lines))
    if len(data) > limit:
        raise OSError(errno.EFBIG, f"it is larger than {limit:,} bytes", str(path))
    return data


def _target(path: Path) -> Path:
    """The file that receives the bytes: links are followed, so that a rename does not replace the link."""
    try:
        target = Path(os.path.realpath(path))
        folder, home = target.is_dir(), target.parent.is_dir()
        protected = target.is_file() and not (os.stat(target).st_mode & 0o222 and os.access(target, os.W_OK))
    except OSError as problem:  # a name that is too long, a chain of links without end
        raise unwritable(path, (problem.strerror or str(problem)).lower()) from problem
    except ValueError as problem:  # a name with a null byte, or with what no name can hold
        raise unwritable(ascii(str(path)), "no file has such a name") from problem
    if WINDOWS and _DEVICE.match(path.name):
        raise unwritable(
            path,
            "Windows keeps this name for a device",
            Choose.OUTPUT.to(typed(path.with_name(f"my-{path.name}"))),
        )
    if folder:
        raise unwritable(path, "it is a folder", Choose.OUTPUT.to(typed(path / "movimentum.gif")))
    if protected:
        raise unwritable(path, "it is write-protected", f"chmod u+w {typed(path)}")
    if not home:
        raise unwritable(path, f"there is no folder {path.parent}", f"mkdir -p {typed(path.parent)}")
    return target


def _begun(path: Path, target: Path, *, folder: bool = False) -> Path:
    """The part that will become ``target``; `UsageError` if it cannot be created."""
    try:
        return partial_files.begin(target, folder=folder)
    except OSError as problem:
        raise unwritable(path, (problem.strerror or str(problem)).lower()) from problem


@contextmanager
def explained(path: Path, part: Path) -> Generator[None, None, None]:
    """An error in writing ``part``, or a full disk, is reported as one of ``path``."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as problem:
        if problem.errno in FULL or str(problem.filename).startswith(str(part)):
            if isinstance(problem, PermissionError) and problem.filename2 is not None:  # Windows, at the last moment
                reason = "it cannot be replaced; perhaps another program has it open"
                raise unwritable(path, reason, Choose.OUTPUT.to(typed(path.with_stem(f"{path.stem}-2")))) from problem
            raise unwritable(path, (problem.strerror or str(problem)).lower()) from problem
        raise


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
