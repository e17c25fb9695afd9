"""One open page: routes its messages to its worker, its dragging or its files."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from movimentum.source import SourceText
from movimentum.studio import messages as m
from movimentum.studio.dragging import Dragging
from movimentum.studio.files import ScriptFile, openable, renamed, stamp
from movimentum.studio.protocol import BadMessage
from movimentum.studio.questions import Assistant, answer, plot, rates, still
from movimentum.studio.renders import FORMATS, Recorder, Rendering, Thumbnails, Work, film_work, recording_work
from movimentum.studio.tools import use
from movimentum.studio.worker import Worker
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import mentioned_files

WATCH_S = 0.25
"""How often the disk is looked at."""
MOST_WATCHED = 200


class Page:
    """A page that is open. ``send`` takes messages from any thread; ``text``: what it has instead of the file's."""

    def __init__(
        self,
        script: str | None,
        folder: Path,
        choices: Choices,
        send: Callable[[Any], None],
        text: str | None = None,
    ) -> None:
        self._choices, self._send = choices, send
        self._files = ScriptFile(script, folder, send)
        self._worker = Worker(self._files.path, folder, send, choices)
        self._assistant = Assistant(self._worker, send)
        self._dragging = Dragging(self._worker)
        self._recorder = Recorder(self._worker, self._dragging)
        self._text = self._files.known.text
        self._renderings: dict[int, Rendering] = {}
        worker, dragging, recorder = self._worker, self._dragging, self._recorder
        self._answers: dict[type, Callable[[Any], None]] = {
            m.HandMoved: dragging.move,
            m.PartGrabbed: dragging.grab,
            m.TimeLooked: dragging.look,
            m.PoseReset: dragging.leave,
            m.ToolUsed: partial(use, worker, dragging),
            m.NameRequest: partial(answer, worker),
            m.PlotRequest: partial(plot, worker),
            m.RatesRequest: partial(rates, worker),
            m.StillRequest: partial(still, worker, dragging),
            m.RecordingBegun: recorder.begin,
            m.ShotTaken: recorder.shoot,
        }
        self._welcome()
        self._thumbnails = Thumbnails(self._lists() if script is None else {}, send)
        if text is not None and text != self._text:
            self.show(text)

    def _lists(self) -> dict[str, tuple[Path, ...]]:
        return {"gallery": self._files.gallery, "recent": self._files.recent}

    @property
    def text(self) -> str:
        """The script as the page has it."""
        return self._text

    def show(self, text: str) -> None:
        """Have the page take another text."""
        self._text, file = text, self._files.file
        self._send(m.TextOpened("" if file is None else file.name, text, self._files.known.version))

    def _welcome(self) -> None:
        files = self._files
        self._send(
            m.Welcome(
                name="" if files.file is None else files.file.name,
                text=files.known.text,
                version=files.known.version,
                folder=str(files.folder),
                gallery=tuple(path.stem for path in files.gallery),
                recent=tuple(str(path) for path in files.recent),
                formats=FORMATS,
                trouble=files.known.trouble,
            )
        )

    def close(self) -> None:
        """The page is gone."""
        self._worker.close()
        self._assistant.close()
        self._thumbnails.stop()
        for rendering in self._renderings.values():
            rendering.cancel()

    def take(self, message: m.FromPage) -> None:
        """Answer a message; what takes time is done elsewhere."""
        answered = self._answers.get(type(message))
        if answered is not None:
            self._worker.soon(partial(answered, message))
            return
        if self._assistant.take(message):
            return
        match message:
            case m.TextTyped():
                self._text = message.text
                if message.text.strip():
                    self._thumbnails.stop()
                self._worker.typed(message)
                self._assistant.typed(message)
            case m.WorkStopped():
                self._worker.stop(message)
            case m.OverlapsRequest():
                self._worker.soon(lambda: self._worker.show_overlaps(message))
            case _:
                self._take_file(message)

    def _take_file(self, message: Any) -> None:
        files, worker = self._files, self._worker
        match message:
            case m.SaveRequest():
                files.save(message)
                worker.moved_to(files.path, files.folder)
            case m.FileOpened():
                self._thumbnails.stop()
                files.open(message)
                worker.moved_to(files.path, files.folder if files.file else Path(files.path).parent)
            case m.RenameFollowed():
                files.follow(message)
                worker.moved_to(files.path, files.folder)
            case m.LinkageRequest():
                worker.soon(lambda: files.save_linkage(message, self._choices))
            case m.RenderRequest():
                self._render(message.job, message.name, film_work(message, files.path, self._choices))
            case m.RecordingRequest():
                worker.soon(
                    lambda: self._render(message.job, message.name, recording_work(message, self._recorder.end()))
                )
            case m.PictureDropped():
                files.add_picture(message)
            case m.StartRequest():
                self._thumbnails.stop()
                self._thumbnails = Thumbnails(self._lists(), self._send)
            case m.FilesRequest():
                self._send(m.FilesListed(openable(files.folder)))
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
            now = (file, None if file is None else stamp(file))
            if now != last:
                found = self._files.changed()
                if found is not None and file is not None:
                    other = renamed(file, last[1]) if last[0] == file else ""
                    self._send(m.DiskChanged(found.text, found.version, found.trouble, other))
                last = now
            mentioned = mentioned_files(SourceText(self._files.path, self._text))[:MOST_WATCHED]
            stamps = {path: stamp(path) for path in mentioned}
            if any(path in used and used[path] != stamp for path, stamp in stamps.items()):
                self._worker.again()
                self._assistant.disk_changed()
            used = stamps
