"""One open page: what it sends goes to its desk, its hands or its files."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from movimentum.source import SourceText
from movimentum.studio import answers as a
from movimentum.studio import disk
from movimentum.studio import messages as m
from movimentum.studio.desk import Desk
from movimentum.studio.filing import Filing
from movimentum.studio.gestures import use
from movimentum.studio.hands import Hands
from movimentum.studio.questions import plot, rates, still, tell
from movimentum.studio.recorder import Recorder
from movimentum.studio.renders import Rendering, Work, film_work, recording_work
from movimentum.studio.thumbnails import Thumbnails
from movimentum.studio.wire import BadMessage
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import mentioned_files

WATCH_S = 0.25
"""How often the disk is looked at."""
MOST_WATCHED = 200


class Page:
    """A page that is open. ``send`` takes messages from any thread."""

    def __init__(self, script: str | None, folder: Path, choices: Choices, send: Callable[[Any], None]) -> None:
        self._choices, self._send = choices, send
        self._files = Filing(script, folder, send)
        self._desk = Desk(self._files.path, folder, send, choices)
        self._hands = Hands(self._desk)
        self._recorder = Recorder(self._desk, self._hands)
        self._text = self._files.known.text
        self._renderings: dict[int, Rendering] = {}
        self._welcome()
        lists = {"gallery": self._files.gallery, "recent": self._files.recent} if script is None else {}
        self._thumbnails = Thumbnails(lists, send)

    def _welcome(self) -> None:
        files = self._files
        self._send(
            a.Welcome(
                name="" if files.file is None else files.file.name,
                text=files.known.text,
                version=files.known.version,
                folder=str(files.folder),
                gallery=tuple(path.stem for path in files.gallery),
                recent=tuple(str(path) for path in files.recent),
                trouble=files.known.trouble,
            )
        )

    def close(self) -> None:
        """The page is gone."""
        self._desk.close()
        self._thumbnails.stop()
        for rendering in self._renderings.values():
            rendering.cancel()

    def take(self, message: Any) -> None:
        """Answer a message; what takes time is done elsewhere."""
        desk, hands = self._desk, self._hands
        match message:
            case m.TextTyped():
                self._text = message.text
                if message.text.strip():
                    self._thumbnails.stop()
                desk.typed(message)
            case m.WorkStopped():
                desk.stop(message)
            case m.HandMoved():
                desk.soon(lambda: hands.move(message))
            case m.PartGrabbed():
                desk.soon(lambda: hands.grab(message))
            case m.TimeLooked():
                desk.soon(lambda: hands.look(message))
            case m.PoseLeft():
                desk.soon(lambda: hands.leave(message))
            case m.ToolUsed():
                desk.soon(lambda: use(desk, hands, message))
            case m.NameAsked():
                desk.soon(lambda: tell(desk, message))
            case m.PlotAsked():
                desk.soon(lambda: plot(desk, message))
            case m.RatesAsked():
                desk.soon(lambda: rates(desk, message))
            case m.StillAsked():
                desk.soon(lambda: still(desk, hands, message))
            case m.RecordingBegun():
                desk.soon(self._recorder.begin)
            case m.ShotTaken():
                desk.soon(lambda: self._recorder.shoot(message))
            case _:
                self._take_file(message)

    def _take_file(self, message: Any) -> None:
        files, desk = self._files, self._desk
        match message:
            case m.SaveWanted():
                files.save(message)
                desk.moved_to(files.path, files.folder)
            case m.FileOpened():
                self._thumbnails.stop()
                files.open(message)
                desk.moved_to(files.path, files.folder if files.file else Path(files.path).parent)
            case m.RenameFollowed():
                files.follow(message)
                desk.moved_to(files.path, files.folder)
            case m.LinkageWanted():
                desk.soon(lambda: files.save_linkage(message, self._choices))
            case m.RenderWanted():
                self._render(message.job, message.name, film_work(message, files.path, self._choices))
            case m.RecordingWanted():
                desk.soon(
                    lambda: self._render(message.job, message.name, recording_work(message, self._recorder.end()))
                )
            case m.FilesAsked():
                self._send(a.FilesListed(disk.openable(files.folder)))
            case m.RenderCancelled():
                if message.job in self._renderings:
                    self._renderings[message.job].cancel()
            case _:
                raise BadMessage("unknown message")

    def _render(self, job: int, name: str, work: Work) -> None:
        for old in self._renderings.values():
            old.cancel()
        self._renderings = {job: Rendering(job, name, self._files.folder, work, self._send)}

    async def watch(self) -> None:
        """Look at the script and at what it uses, again and again."""
        used: dict[Path, Any] = {}
        last: tuple[Any, Any] = (None, None)
        while True:
            await asyncio.sleep(WATCH_S)
            file = self._files.file
            now = (file, None if file is None else disk.stamp(file))
            if now != last:
                found = self._files.changed()
                if found is not None and file is not None:
                    other = disk.renamed(file, last[1]) if last[0] == file else ""
                    self._send(a.DiskChanged(found.text, found.version, found.trouble, other))
                last = now
            mentioned = mentioned_files(SourceText(self._files.path, self._text))[:MOST_WATCHED]
            stamps = {path: disk.stamp(path) for path in mentioned}
            if any(path in used and used[path] != stamp for path, stamp in stamps.items()):
                self._desk.again()
            used = stamps
