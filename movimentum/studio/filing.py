"""What a page does to files: saving, opening, linkage files."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from movimentum.errors import MovimentumError, UsageError
from movimentum.source import SourceText
from movimentum.studio import disk
from movimentum.studio.answers import SaveDone, TextOpened, Told
from movimentum.studio.disk import OnDisk
from movimentum.studio.messages import FileOpened, LinkageWanted, RenameFollowed, SaveWanted
from movimentum.studio.security import OutsideFolder, inside, outside_files
from movimentum.workflow.choices import Choices
from movimentum.workflow.exchange import exported
from movimentum.workflow.read import mentioned_files

SCRIPTS = (".mov", ".txt")
"""What a script may be called."""


class Filing:
    """The script's file. ``path`` is what the script is read as, ``file`` where it is saved (None: nowhere yet),
    ``known`` the file as the page knows it.
    """

    def __init__(self, script: str | None, folder: Path, send: Callable[[Any], None]) -> None:
        self.folder, self._send = folder, send
        self.file: Path | None = None if script is None else Path(script)
        self.path = script or str(folder / f"{disk.UNTITLED}.mov")
        self.known = OnDisk("", "") if script is None else disk.on_disk(script)
        self.gallery, self.recent = disk.gallery(), disk.recent()
        if self.file is not None and not self.known.trouble:
            disk.remember(self.file)

    def changed(self) -> OnDisk | None:
        """The file, if it is not any more what the page knows."""
        if self.file is None:
            return None
        found = disk.on_disk(str(self.file))
        if (found.version, found.trouble) == (self.known.version, self.known.trouble):
            return None
        self.known = found
        return found

    def follow(self, wanted: RenameFollowed) -> None:
        """Go on with the script's file under its new name; what the page has typed stays as it is."""
        try:
            target = self._target(wanted.name)
        except OutsideFolder as problem:
            self._send(Told(str(problem), "error"))
            return
        self.file, self.path = target, str(target)
        self.known = disk.on_disk(str(target))
        disk.remember(target)
        self._send(SaveDone("renamed", self._told(target), self.known.version, self.known.text))

    def save(self, wanted: SaveWanted) -> None:
        """Write the script, unless its file is another one than the page knows."""
        try:
            target = self._target(wanted.name)
            there = disk.on_disk(str(target)) if target.exists() else OnDisk("", "")
            if not wanted.force and there.version not in ("", wanted.base) and there.text != wanted.text:
                words = "" if target == self.file else f"There is another {target.name} already."
                self._send(SaveDone("conflict", self._told(target), there.version, there.text, words))
                return
            if self.file is None and Path(self.path).parent.resolve() != self.folder.resolve():
                disk.take_along(SourceText(self.path, wanted.text), self.folder)
            disk.write_script(target, wanted.text)
        except (UsageError, OutsideFolder) as problem:
            words = problem.diagnostics[0].message if isinstance(problem, UsageError) else str(problem)
            self._send(SaveDone("failed", wanted.name, wanted.base, words=f"Not saved: {words}."))
            return
        self.file, self.path = target, str(target)
        self.known = OnDisk(wanted.text, disk.version_of(wanted.text))
        disk.remember(target)
        self._send(SaveDone("saved", self._told(target), self.known.version))

    def _target(self, name: str) -> Path:
        if name == "":
            return self.file or disk.free_name(self.folder)
        target = inside(self.folder, name)
        if target.suffix.lower() not in SCRIPTS:
            raise OutsideFolder("a script's name ends in .mov")
        return self.file if self.file is not None and target == self.file.resolve() else target

    def _told(self, target: Path) -> str:
        try:
            return str(target.resolve().relative_to(self.folder.resolve()))
        except ValueError:
            return target.name

    def open(self, wanted: FileOpened) -> None:
        """Open another script; of another program's file, what it becomes as one."""
        listed = {"gallery": self.gallery, "recent": self.recent}.get(wanted.source)
        try:
            if wanted.source == "blank" or (listed is not None and not 0 <= wanted.number < len(listed)):
                self.file, self.known = None, OnDisk("", "")
                self.path = str(self.folder / f"{disk.UNTITLED}.mov")
                self._send(TextOpened("", "", ""))
                return
            path = inside(self.folder, wanted.name) if listed is None else listed[wanted.number]
            text = disk.script_from(path)
        except (MovimentumError, OutsideFolder) as problem:
            words = problem.diagnostics[0].message if isinstance(problem, MovimentumError) else str(problem)
            self._send(TextOpened("", "", "", words))
            return
        own = wanted.source != "gallery" and path.suffix.lower() == ".mov"
        if wanted.source == "recent":
            self.folder = path.resolve().parent
        self.file = path if own else None
        self.path = str(path if path.suffix.lower() == ".mov" else path.with_suffix(".mov"))
        self.known = OnDisk(text, disk.version_of(text)) if own else OnDisk("", "")
        if own:
            disk.remember(path)
        self._send(TextOpened(self._told(path) if own else "", text, self.known.version))

    def save_linkage(self, wanted: LinkageWanted, choices: Choices) -> None:
        """Write the scene as a linkage file."""
        source = SourceText(self.path, wanted.text)
        try:
            target = inside(self.folder, wanted.name)
            if target.suffix.lower() != ".txt":
                raise OutsideFolder("a linkage file's name ends in .txt")
            if outside_files(Path(self.path).parent, mentioned_files(source)):
                raise OutsideFolder("the script uses a file that is not below its folder")
            exported(source, target, "linkages", Fraction(wanted.time).limit_denominator(10**6), choices)
        except (MovimentumError, OutsideFolder) as problem:
            words = problem.diagnostics[0].message if isinstance(problem, MovimentumError) else str(problem)
            self._send(Told(f"Not saved: {words}.", "error"))
            return
        self._send(Told(f"Saved {wanted.name}."))
