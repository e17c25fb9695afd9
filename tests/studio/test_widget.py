"""The studio as a widget: its page in a cell, what is typed there in Python, and nothing left when it is closed."""

from __future__ import annotations

import base64
import json
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import movimentum as mv

ARM = "Arm : .bar O=[0,0] P=[90,0];\n@0 Arm.O=[100,100]; Arm.angle=90*.t;\n@1\n"
CELL = """<!DOCTYPE html><body><div id="cell"></div><script type="module">
const heard = [];
const model = {
  get: (name) => ({height: 500})[name],
  send: (message) => window.toPython(JSON.stringify(message)),
  on: (kind, act) => heard.push(act),
  off: (kind, act) => heard.splice(heard.indexOf(act), 1),
};
window.fromPython = (text) => heard.forEach((act) => act(JSON.parse(text)));
const made = await import("data:text/javascript;base64," + "%s");
window.leave = made.default.render({model, el: document.getElementById("cell")});
</script>"""


@pytest.fixture
def left_running() -> Callable[[], list[str]]:
    """The studio's threads that were started since the test began: those of tests before it may still be ending."""
    before = set(threading.enumerate())
    return lambda: [
        each.name for each in threading.enumerate() if each.name.startswith("studio") and each not in before
    ]


class Cell:
    """A widget in a page; the test is the notebook between them."""

    def __init__(self, browser: Any, widget: Any) -> None:
        self.widget, self.sent, self.said = widget, [], []
        self.waiting: list[dict[str, Any]] = []
        widget.send = lambda message, buffers=None: self.waiting.append(message)
        self.page = browser.new_page()
        self.requests: list[str] = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.expose_function("toPython", lambda text: self.sent.append(json.loads(text)))
        self.page.set_content(CELL % base64.b64encode(widget._esm.encode()).decode())

    def pump(self, until: Any, patience: float = 20.0) -> None:
        end = time.monotonic() + patience
        while not until():
            assert time.monotonic() < end, (self.said, self.sent[-3:])
            self.page.wait_for_timeout(20)
            while self.sent:
                self.widget._receive(self.widget, self.sent.pop(0), [])
            while self.waiting:
                self.page.evaluate("text => window.fromPython(text)", json.dumps(self.waiting.pop(0)))

    def state(self) -> dict[str, Any]:
        frame = next((each for each in self.page.frames if each.parent_frame is not None), None)
        if frame is None:
            return {}
        try:
            return frame.evaluate("window.movimentum ? movimentum.state() : {}")
        except Exception:  # the page is just being loaded
            return {}


@pytest.fixture
def widget() -> Any:
    pytest.importorskip("anywidget")
    made = mv.studio(mv.loads(ARM))
    yield made
    made.close()


@pytest.mark.slow
def test_what_is_typed_comes_to_python_and_back(left_running: Callable[[], list[str]], browser: Any, widget: Any):
    cell = Cell(browser, widget)
    cell.pump(lambda: cell.state().get("shownRev", 0) > 0)
    frame = next(each for each in cell.page.frames if each.parent_frame is not None)
    assert frame.evaluate("movimentum.text()") == ARM
    frame.locator(".cm-content").focus()
    cell.page.keyboard.press("Control+End")
    cell.page.keyboard.insert_text("// more\n")
    cell.pump(lambda: widget.text.endswith("// more\n"))
    assert widget.script.solve()["Arm.P"].shape == (26, 2)
    widget.text = ARM.replace("90,0", "50,0")
    cell.pump(lambda: frame.evaluate("movimentum.text()") == widget.text)
    cell.pump(lambda: cell.state()["shownRev"] == cell.state()["rev"] and cell.state()["settled"])
    assert cell.state()["anchors"]["Arm.P"] == pytest.approx([150, 100])
    assert cell.said == []
    assert [url for url in cell.requests if not url.startswith(("data:", "about:"))] == []
    cell.page.evaluate("window.leave()")
    cell.pump(lambda: not widget._views)
    cell.page.close()
    assert left_running() == []


def test_closing_ends_the_work(left_running: Callable[[], list[str]], widget: Any):
    widget.send = lambda message, buffers=None: None
    for name in "ab":
        widget._receive(widget, {"view": name, "movimentum": "open"}, [])
    assert len(widget._views) == 2
    widget._receive(widget, {"view": "a", "movimentum": "message", "data": "no message"}, [])
    widget._receive(widget, "no message", [])
    assert len(widget._views) == 1
    widget.close()
    end = time.monotonic() + 5
    while left_running() and time.monotonic() < end:
        time.sleep(0.02)
    assert left_running() == []


@pytest.mark.slow
def test_it_saves_to_the_scripts_file_and_shows_a_player_where_there_are_no_widgets(tmp_path: Path):
    pytest.importorskip("anywidget")
    path = tmp_path / "arm.mov"
    path.write_text(ARM)
    widget = mv.load(path).studio()
    data, *_ = widget._repr_mimebundle_()
    assert "data-movimentum-film" in data["text/html"]
    widget.close()


def test_without_anywidget_it_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch):
    import movimentum.studio.widget as live

    monkeypatch.setattr(live, "find_spec", lambda name: None)
    with pytest.raises(mv.UsageError, match=r"pip install 'movimentum\[notebook\]'"):
        mv.loads(ARM).studio()
    import movimentum.studio.server  # noqa: F401 - the package does not hide the verb

    with pytest.raises(mv.UsageError, match="usage/extra"):
        mv.studio(mv.loads(ARM))
