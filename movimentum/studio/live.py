"""The studio in a notebook: its page talks with Python through the notebook's own channel, and needs no port."""

from __future__ import annotations

from importlib.resources import files
from importlib.util import find_spec
from typing import Any, Protocol

from movimentum.errors import usage_error
from movimentum.source import SourceText


class LiveScript(Protocol):
    """What the studio asks of a script."""

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
