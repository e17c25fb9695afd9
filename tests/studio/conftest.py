"""A studio for the tests: the command as a user starts it, and its page in a browser without any other network."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from tests.command import environment
from tests.studio.bench import Bench

PATIENCE_MS = 20_000


class Studio:
    """A running `movimentum studio`."""

    def __init__(self, folder: Path, script: Path | None, port: int = 0) -> None:
        self.folder, self.script = folder, script
        arguments = [] if script is None else [str(script)]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "movimentum", "studio", *arguments, "--no-open", "--port", str(port)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            env=environment({"XDG_STATE_HOME": str(folder / ".state"), "OPENBLAS_NUM_THREADS": "1"}),
        )
        assert self.process.stdout is not None
        self.url = self.process.stdout.readline().strip()
        self.port = urlsplit(self.url).port or 0

    def end(self) -> int:
        if self.process.stdout is None or self.process.stdout.closed:
            return self.process.returncode
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(10)
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate(timeout=10)
        return self.process.returncode


class Tab:
    """A page of a studio, with what the tests ask of it."""

    def __init__(self, page: Any, studio: Studio) -> None:
        self.page, self.studio = page, studio
        self.said: list[str] = []
        self.requests: list[str] = []
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("console", lambda message: self.said.append(message.text))
        page.on("request", lambda request: self.requests.append(request.url))
        page.goto(studio.url)
        self.until("s.rev > 0")

    @property
    def state(self) -> dict[str, Any]:
        return self.page.evaluate("movimentum.state()")

    def until(self, condition: str, patience: int = PATIENCE_MS) -> dict[str, Any]:
        """Wait for a condition on the state ``s``."""
        self.page.wait_for_function(
            f"() => {{ if (!window.movimentum) return false; const s = movimentum.state(); return ({condition}); }}",
            timeout=patience,
        )
        return self.state

    def settled(self) -> dict[str, Any]:
        """Wait until everything is known about the text as it is."""
        return self.until(
            "s.settled && (s.shownRev === s.rev && !s.glimpse || s.diagnostics.some(d => d.severity === 'error'))"
        )

    def text(self) -> str:
        return self.page.evaluate("movimentum.text()")

    def testid(self, name: str) -> Any:
        return self.page.get_by_test_id(name)

    def focus(self) -> None:
        self.page.locator(".cm-content").focus()

    def write(self, text: str) -> None:
        """Another text by the keyboard's ways."""
        self.focus()
        self.page.keyboard.press("Control+A")
        self.page.keyboard.insert_text(text)

    def at(self, point: tuple[float, float] | list[float]) -> tuple[float, float]:
        x, y = self.page.evaluate("p => movimentum.toScreen(p)", list(point))
        return x, y

    def click(self, point: tuple[float, float] | list[float]) -> None:
        self.page.mouse.click(*self.at(point))

    def drag(self, start: Any, end: Any, steps: int = 8) -> None:
        self.page.mouse.move(*self.at(start))
        self.page.mouse.down()
        self.page.mouse.move(*self.at(end), steps=steps)
        self.page.mouse.up()

    def has_changed(self, rev: int) -> dict[str, Any]:
        """Wait for a newer text, and everything that is known about it."""
        self.until(f"s.rev > {rev}")
        return self.settled()


@pytest.fixture
def studio(tmp_path: Path) -> Iterator[Callable[..., Studio]]:
    """Starts studios, which end with the test. A script that is a text is written to a file first."""
    pytest.importorskip("starlette", reason="no studio: pip install 'movimentum[studio]'")
    pytest.importorskip("uvicorn", reason="no studio: pip install 'movimentum[studio]'")
    running: list[Studio] = []

    def start(script: str | Path | None, port: int = 0) -> Studio:
        path = script
        if isinstance(script, str):
            path = tmp_path / "drawn.mov"
            path.write_text(script, encoding="utf-8", newline="")
        running.append(Studio(tmp_path, path, port))
        return running[-1]

    yield start
    for each in running:
        each.end()


@pytest.fixture
def opened(browser: Any, studio: Callable[..., Studio]) -> Iterator[Callable[..., Tab]]:
    """Opens pages; at the end none of them may have said anything, nor asked for anything elsewhere."""
    tabs: list[Tab] = []
    contexts: list[Any] = []

    def open_page(script: str | Path | Studio | None, **options: Any) -> Tab:
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **options})
        contexts.append(context)
        found = script if isinstance(script, Studio) else studio(script)
        tabs.append(Tab(context.new_page(), found))
        return tabs[-1]

    yield open_page
    said = [text for tab in tabs for text in tab.said if "WebSocket" not in text and "ERR_CONNECTION" not in text]
    asked = [url for tab in tabs for url in tab.requests if not url.startswith(("http://127.0.0.1:", "data:", "blob:"))]
    for context in contexts:
        context.close()
    assert said == []
    assert asked == []


@pytest.fixture
def bench() -> Iterator[Callable[[str], Bench]]:
    made: list[Bench] = []

    def begin(text: str) -> Bench:
        made.append(Bench(text))
        return made[-1]

    yield begin
    for each in made:
        each.worker.close()


def wait_for(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    """Wait until something is true that no page knows."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not happen"
        time.sleep(0.02)
