"""The studio as a notebook widget: its page talks to Python through the notebook's own channel, not a port."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from threading import Lock, Thread
from typing import Any, Protocol, cast

import anywidget
import traitlets

from movimentum.errors import usage_error
from movimentum.source import SourceText
from movimentum.studio import messages as m
from movimentum.studio.page import Page
from movimentum.studio.protocol import BadMessage, received, sent
from movimentum.workflow.choices import Choices


class _View:
    """The page of one place where the widget is shown. ``sent_text`` is the text that Python sent last."""

    def __init__(self, page: Page) -> None:
        self.page, self.sent_text = page, page.text
        self._loop = asyncio.new_event_loop()
        self._watching: asyncio.Task[None] | None = None
        self._thread = Thread(target=self._watch, name="studio-files", daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        """Look at the script's file until the page is closed."""
        asyncio.set_event_loop(self._loop)
        self._watching = self._loop.create_task(self.page.watch())
        with suppress(asyncio.CancelledError):
            self._loop.run_until_complete(self._watching)
        self._loop.close()

    def show(self, text: str) -> None:
        self.sent_text = text
        self.page.show(text)

    def close(self) -> None:
        self.page.close()

        def end() -> None:
            if self._watching is not None:
                self._watching.cancel()

        with suppress(RuntimeError):  # it has ended
            self._loop.call_soon_threadsafe(end)
        self._thread.join(5.0)


class StudioWidget(anywidget.AnyWidget):
    """The studio in a cell: ``text`` is the script as it is by now, and can be set; ``script`` what it means.

    The page is the studio's own. It needs no server and no network but the notebook's. `close` ends its work, as does
    clearing the cell.
    """

    _esm = files("movimentum.studio").joinpath("web/widget.js").read_text(encoding="utf-8")
    text = traitlets.Unicode().tag(sync=True)
    height = traitlets.Int(600).tag(sync=True)

    def __init__(self, script: LiveScript, choices: Choices, **more: Any) -> None:
        super().__init__(text=script.source.text, **more)
        self._begun, self._choices = script, choices
        path = script.source.path
        self._path = None if path.startswith("<") or not Path(path).is_file() else path
        self._folder = Path.cwd() if self._path is None else Path(path).resolve().parent
        self._views: dict[str, _View] = {}
        self._sending = Lock()
        self.on_msg(self._receive)
        self.observe(self._shown, "text")

    @property
    def script(self) -> Any:
        """The script as it is by now; raises what `movimentum.loads` raises."""
        return self._begun.with_text(self.text)

    def close(self) -> None:
        """End the work for every place where it is shown, and the widget."""
        while self._views:
            self._views.popitem()[1].close()
        super().close()

    def _receive(self, _widget: object, message: Any, _buffers: object) -> None:
        """Handles a page's message, in the kernel's thread."""
        if not isinstance(message, dict):
            return
        fields = cast("dict[str, Any]", message)
        name, kind = str(fields.get("view")), fields.get("movimentum")
        view = self._views.get(name)
        if kind == "page":
            self.send({"view": name, "page": page_text()})
        elif kind in ("open", "closed"):
            if view is not None:
                self._views.pop(name).close()
            if kind == "open":
                self._views[name] = _View(
                    Page(self._path, self._folder, self._choices, lambda each: self._say(name, each), self.text)
                )
        elif kind == "message" and view is not None:
            try:
                said = received(str(fields.get("data")))
                view.page.take(said)
            except BadMessage:
                self._views.pop(name).close()
                return
            if isinstance(said, m.TextTyped) and said.text != view.sent_text:
                view.sent_text = said.text
                self.text = said.text

    def _say(self, name: str, message: Any) -> None:
        """From any thread."""
        with self._sending:
            self.send({"view": name, "data": sent(message)})

    def _shown(self, _change: object) -> None:
        """Have the pages take the text, but for the one that it comes from."""
        for view in tuple(self._views.values()):
            if view.sent_text != self.text:
                view.show(self.text)

    def _repr_mimebundle_(self, **given: Any) -> Any:
        """Beside the widget, the player, for where no widget can be shown."""
        found = cast("Any", super()._repr_mimebundle_(**given))
        if found is None:
            return None
        data, *rest = found
        with suppress(Exception):  # the text may be no script by now
            data = {**data, "text/html": self.script._repr_html_()}
        return (data, *rest)


class LiveScript(Protocol):
    """A script, as the studio needs it."""

    @property
    def source(self) -> SourceText:
        """Its text, and where it is."""
        ...

    def studio(self) -> Any:
        """The widget."""
        ...

    def with_text(self, text: str, /) -> Any:
        """The script that the text is."""
        ...


def studio(script: LiveScript) -> Any:
    """`Script.studio` of a script."""
    return script.studio()


def refuse_missing() -> None:
    """`UsageError` (``usage/extra``) without anywidget."""
    if find_spec("anywidget") is None:
        message = "the studio in a notebook needs anywidget, which is not installed"
        raise usage_error("usage/extra", message, "pip install 'movimentum[notebook]'")


def page_text() -> str:
    """The studio's page in one piece, with `bridge.js` in the place of its socket."""

    def text(package: str, name: str) -> str:
        return files(package).joinpath(name).read_text(encoding="utf-8")

    page = text("movimentum.studio", "web/index.html").replace("{nonce}", "")
    painter = text("movimentum.studio", "web/bridge.js") + text("movimentum.vector", "painter.js")
    for before, after in (
        ('<link rel="stylesheet" href="studio.css">', f"<style>{text('movimentum.studio', 'web/studio.css')}</style>"),
        ('<script src="painter.js"></script>', f"<script>{painter}</script>"),
        (
            '<script type="module" src="studio.js"></script>',
            f'<script type="module">{text("movimentum.studio", "web/studio.js")}</script>',
        ),
    ):
        assert before in page, before
        page = page.replace(before, after)
    return page
