"""The script's file and others beside it: read, watch, save and open; also the lists on the start page."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from movimentum.errors import MovimentumError, UsageError
from movimentum.output.files import write_script
from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.studio.messages import (
    FileOpened,
    LinkageRequest,
    Notice,
    PictureDropped,
    PictureStored,
    RenameFollowed,
    SaveDone,
    SaveRequest,
    TextOpened,
)
from movimentum.studio.security import OutsideFolder, inside, outside_files
from movimentum.terminal import visible
from movimentum.workflow.choices import Choices
from movimentum.workflow.exchange import Export, exported
from movimentum.workflow.read import mentioned_files, read
from movimentum.workflow.samples import gallery

UNTITLED = "untitled"
MOST_RECENT = 8
MOST_LISTED = 500


@dataclass(frozen=True, slots=True)
class FileState:
    """A script's file as it is. ``version`` tells texts apart; it is empty where there is no file, or none that can be
    read (``trouble`` says why).
    """

    text: str
    version: str
    trouble: str = ""


def version_of(text: str) -> str:
    """A short name for a text."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


def state_of(path: str) -> FileState:
    """The script at ``path``."""
    try:
        text = read(path).text
    except MovimentumError as error:
        return FileState("", "", error.diagnostics[0].message)
    return FileState(text, version_of(text))


def stamp(path: Path) -> tuple[int, int, int] | None:
    """A stamp that changes when the file is written; None without a file."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def renamed(path: Path, before: tuple[int, int, int] | None) -> str:
    """The new name of the file that was ``path`` before (see `stamp`), or nothing."""
    if before is None or path.exists():
        return ""
    try:
        beside = [other for other in path.parent.iterdir() if other.suffix.lower() == path.suffix.lower()]
    except OSError:
        return ""
    return next((other.name for other in beside if stamp(other) == before), "")


def free_name(folder: Path) -> Path:
    """A file that does not exist yet, for a script without a name."""
    names = (f"{UNTITLED}{'' if number == 1 else f'-{number}'}.mov" for number in range(1, 10**6))
    return next(path for name in names if not (path := folder / name).exists())


def copy_files_of(source: SourceText, folder: Path) -> None:
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


def state_file(name: str) -> Path:
    """A file of ours in the user's home."""
    home = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    return Path(home) / "movimentum" / name


def recent() -> tuple[Path, ...]:
    """The scripts that were last open and are still there."""
    try:
        names: object = json.loads(state_file("recent.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ()
    listed = [str(name) for name in names] if isinstance(names, list) else []  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    return tuple(path for name in listed[:MOST_RECENT] if (path := Path(name)).is_file())


def add_recent(path: Path) -> None:
    """Put a script at the head of the list; where that cannot be kept, it is not."""
    names = [str(path.resolve()), *(str(other) for other in recent() if other.resolve() != path.resolve())]
    record = state_file("recent.json")
    try:
        record.parent.mkdir(parents=True, exist_ok=True)
        record.write_text(json.dumps(names[:MOST_RECENT]), encoding="utf-8")
    except OSError:
        return


# --- what a page does to files ----------------------------------------------------------------------------

PICTURES: dict[str, Callable[[bytes], bool]] = {
    ".png": lambda data: data.startswith(b"\x89PNG\r\n"),
    ".jpg": lambda data: data.startswith(b"\xff\xd8\xff"),
    ".gif": lambda data: data.startswith((b"GIF87a", b"GIF89a")),
    ".webp": lambda data: data[:4] == b"RIFF" and data[8:12] == b"WEBP",
    ".svg": lambda data: b"<svg" in data[:2000],
}
"""The pictures that may be dropped on a page, by what their data begin with."""
SCRIPTS = (".mov", ".txt")
"""Suffixes of scripts."""


class ScriptFile:
    """The script's file. ``path`` is what the script is read as, ``file`` where it is saved (None: nowhere yet),
    ``known`` the file as the page knows it.
    """

    def __init__(self, script: str | None, folder: Path, send: Callable[[Any], None]) -> None:
        self.folder, self._send = folder, send
        self.file: Path | None = None if script is None else Path(script)
        self.path = script or str(folder / f"{UNTITLED}.mov")
        self.known = FileState("", "") if script is None else state_of(script)
        self.gallery, self.recent = gallery(), recent()
        if self.file is not None and not self.known.trouble:
            add_recent(self.file)

    def changed(self) -> FileState | None:
        """The file, if it is not any more what the page knows."""
        if self.file is None:
            return None
        found = state_of(str(self.file))
        if (found.version, found.trouble) == (self.known.version, self.known.trouble):
            return None
        self.known = found
        return found

    def follow(self, wanted: RenameFollowed) -> None:
        """Go on with the script's file under its new name; what the page has typed stays as it is."""
        try:
            target = self._target(wanted.name)
        except OutsideFolder as problem:
            self._send(Notice(str(problem), "error"))
            return
        self.file, self.path = target, str(target)
        self.known = state_of(str(target))
        add_recent(target)
        self._send(SaveDone("renamed", self._shown_name(target), self.known.version, self.known.text))

    def save(self, wanted: SaveRequest) -> None:
        """Write the script, unless its file is another one than the page knows."""
        try:
            target = self._target(wanted.name)
            there = state_of(str(target)) if target.exists() else FileState("", "")
            if not wanted.force and there.version not in ("", wanted.base) and there.text != wanted.text:
                words = "" if target == self.file else f"There is another {target.name} already."
                self._send(SaveDone("conflict", self._shown_name(target), there.version, there.text, words))
                return
            if self.file is None and Path(self.path).parent.resolve() != self.folder.resolve():
                copy_files_of(SourceText(self.path, wanted.text), self.folder)
            write_script(target, wanted.text)
        except (UsageError, OutsideFolder) as problem:
            words = problem.diagnostics[0].message if isinstance(problem, UsageError) else str(problem)
            self._send(SaveDone("failed", wanted.name, wanted.base, words=f"Not saved: {words}."))
            return
        self.file, self.path = target, str(target)
        self.known = FileState(wanted.text, version_of(wanted.text))
        add_recent(target)
        self._send(SaveDone("saved", self._shown_name(target), self.known.version))

    def _target(self, name: str) -> Path:
        if name == "":
            return self.file or free_name(self.folder)
        target = inside(self.folder, name)
        if target.suffix.lower() not in SCRIPTS:
            raise OutsideFolder("a script's name ends in .mov")
        return self.file if self.file is not None and target == self.file.resolve() else target

    def _shown_name(self, target: Path) -> str:
        try:
            return str(target.resolve().relative_to(self.folder.resolve()))
        except ValueError:
            return target.name

    def open(self, wanted: FileOpened) -> None:
        """Open another script; of another program's file, what it becomes as one."""
        listed = {"gallery": self.gallery, "recent": self.recent}.get(wanted.source)
        try:
            if wanted.source == "blank" or (listed is not None and not 0 <= wanted.number < len(listed)):
                self.file, self.known = None, FileState("", "")
                self.path = str(self.folder / f"{UNTITLED}.mov")
                self._send(TextOpened("", "", ""))
                return
            path = inside(self.folder, wanted.name) if listed is None else listed[wanted.number]
            text = script_from(path)
        except (MovimentumError, OutsideFolder) as problem:
            words = problem.diagnostics[0].message if isinstance(problem, MovimentumError) else str(problem)
            self._send(TextOpened("", "", "", words))
            return
        own = wanted.source != "gallery" and path.suffix.lower() == ".mov"
        if wanted.source == "recent":
            self.folder = path.resolve().parent
        self.file = path if own else None
        self.path = str(path if path.suffix.lower() == ".mov" else path.with_suffix(".mov"))
        self.known = FileState(text, version_of(text)) if own else FileState("", "")
        if own:
            add_recent(path)
        self._send(TextOpened(self._shown_name(path) if own else "", text, self.known.version))

    def add_picture(self, wanted: PictureDropped) -> None:
        """Write a picture beside the script, under a name that is free, or that the same picture has already."""
        try:
            data = base64.b64decode(wanted.data, validate=True)
            suffix = next((suffix for suffix, begins in PICTURES.items() if begins(data)), "")
            if not suffix:
                raise OutsideFolder("this is no picture that a script can have: PNG, JPEG, GIF, WebP or SVG")
            if self.file is None and Path(self.path).parent.resolve() != self.folder.resolve():
                raise OutsideFolder("this is an example: save it first, then add pictures")
            home = Path(self.path).parent
            stem = re.sub(r"[^\w.-]+", "-", Path(wanted.called.replace("\\", "/")).stem).strip("-.") or "picture"
            names = (f"{stem}{'' if number == 1 else f'-{number}'}{suffix}" for number in range(1, 10_000))
            free = (path for name in names if not (path := inside(home, name)).exists() or path.read_bytes() == data)
            target = next(free)
            if not target.exists():
                target.write_bytes(data)
        except (ValueError, OSError) as problem:
            self._send(PictureStored("", f"Not added: {problem}."))
            return
        self._send(PictureStored(target.name))

    def save_linkage(self, wanted: LinkageRequest, choices: Choices) -> None:
        """Write the scene as a linkage file."""
        source = SourceText(self.path, wanted.text)
        try:
            target = inside(self.folder, wanted.name)
            if target.suffix.lower() != ".txt":
                raise OutsideFolder("a linkage file's name ends in .txt")
            if outside_files(Path(self.path).parent, mentioned_files(source)):
                raise OutsideFolder("the script uses a file that is not below its folder")
            exported(source, target, Export("linkages", Fraction(wanted.time).limit_denominator(10**6)), choices)
        except (MovimentumError, OutsideFolder) as problem:
            words = problem.diagnostics[0].message if isinstance(problem, MovimentumError) else str(problem)
            self._send(Notice(f"Not saved: {words}.", "error"))
            return
        self._send(Notice(f"Saved {wanted.name}."))
