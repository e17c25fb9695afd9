"""The script on the disk: read, watched, saved; and the lists of the start page."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from pathlib import Path

from movimentum.errors import MovimentumError
from movimentum.output.files import whole_file
from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.studio.security import inside, outside_files
from movimentum.terminal import visible
from movimentum.workflow.read import mentioned_files, read

UNTITLED = "untitled"
MOST_RECENT = 8
MOST_LISTED = 500
_WINDOWS_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True, slots=True)
class OnDisk:
    """A script's file as it is. ``version`` tells texts apart; it is empty where there is no file, or none that can be
    read (``trouble`` says why).
    """

    text: str
    version: str
    trouble: str = ""


def version_of(text: str) -> str:
    """A short name for a text."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


def on_disk(path: str) -> OnDisk:
    """The script at ``path``."""
    try:
        text = read(path).text
    except MovimentumError as error:
        return OnDisk("", "", error.diagnostics[0].message)
    return OnDisk(text, version_of(text))


def stamp(path: Path) -> tuple[int, int, int] | None:
    """What changes when a file is written; None if there is none."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def renamed(path: Path, before: tuple[int, int, int] | None) -> str:
    """What a file beside ``path`` is called that was ``path`` before (see `stamp`), or nothing."""
    if before is None or path.exists():
        return ""
    try:
        beside = [other for other in path.parent.iterdir() if other.suffix.lower() == path.suffix.lower()]
    except OSError:
        return ""
    return next((other.name for other in beside if stamp(other) == before), "")


def write_script(path: Path, text: str) -> None:
    """Write a script, whole or not at all; `UsageError` if that cannot be done. A mark at its beginning stays."""
    try:
        marked = path.read_bytes()[:3] == _WINDOWS_MARK
    except OSError:
        marked = False
    with whole_file(path) as part:
        part.write_bytes((_WINDOWS_MARK if marked else b"") + text.encode("utf-8"))


def free_name(folder: Path) -> Path:
    """A file that does not exist yet, for a script without a name."""
    names = (f"{UNTITLED}{'' if number == 1 else f'-{number}'}.mov" for number in range(1, 10**6))
    return next(path for name in names if not (path := folder / name).exists())


def take_along(source: SourceText, folder: Path) -> None:
    """Copy the files that a script of the gallery uses to where it was saved, unless they are there."""
    home = Path(source.path).parent
    for found in mentioned_files(source):
        if found.is_file() and not outside_files(home, (found,)):
            target = inside(folder, str(found.relative_to(home)))
            if not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(found, target)


def script_from(path: Path) -> str:
    """A script, or what another program's file becomes as one; `MovimentumError` if it is neither."""
    source = read(str(path))
    if path.suffix.lower() == ".mov":
        return source.text
    from movimentum.interop.scripts import script_of

    return script_of(source, visible(path.name))[0]


OPENED = (".mov", ".txt", ".linkage2", ".pyslvs")


def openable(folder: Path) -> tuple[str, ...]:
    """The files of a folder that may be scripts, linkages or mechanisms, by name."""
    try:
        found = sorted(path.name for path in folder.iterdir() if path.suffix.lower() in OPENED and path.is_file())
    except OSError:
        return ()
    return tuple(found[:MOST_LISTED])


# --- the start page ---------------------------------------------------------------------------------------


def gallery() -> tuple[Path, ...]:
    """The scripts that come with the program."""
    here = Path(__file__).resolve().parent
    for folder in (here / "gallery", here.parent.parent / "scripts"):
        found = tuple(sorted(folder.glob("*.mov")))
        if found:
            return found
    return ()


def kept(name: str) -> Path:
    """A file of ours in the user's home."""
    home = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    return Path(home) / "movimentum" / name


def recent() -> tuple[Path, ...]:
    """The scripts that were last open and are still there."""
    try:
        names: object = json.loads(kept("recent.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ()
    listed = [str(name) for name in names] if isinstance(names, list) else []  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    return tuple(path for name in listed[:MOST_RECENT] if (path := Path(name)).is_file())


def remember(path: Path) -> None:
    """Put a script at the head of the list; where that cannot be kept, it is not."""
    names = [str(path.resolve()), *(str(other) for other in recent() if other.resolve() != path.resolve())]
    record = kept("recent.json")
    try:
        record.parent.mkdir(parents=True, exist_ok=True)
        record.write_text(json.dumps(names[:MOST_RECENT]), encoding="utf-8")
    except OSError:
        return
