"""What goes wrong while a page is open: nothing that was typed is lost, and the page stays usable."""

from __future__ import annotations

import gc
import threading
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.penrose import transformable
from movimentum.interop.linkages import linkage_script
from movimentum.studio.messages import FilmShown, StageDone, TextTyped
from movimentum.studio.page import Page
from movimentum.studio.worker import Worker
from movimentum.workflow.choices import Choices
from tests.command import LONG, movimentum
from tests.studio.conftest import Studio, Tab, wait_for
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow

Opened = Callable[..., Tab]


def test_a_page_comes_back_by_itself_when_the_socket_breaks(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.page.evaluate("movimentum.disconnect()")
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("// while it was away")
    tab.page.wait_for_function("() => document.getElementById('link').textContent === ''")
    state = tab.settled()
    assert state["shownRev"] == state["rev"]
    assert tab.text().endswith("// while it was away")
    tab.testid("save").click()
    wait_for(lambda: "while it was away" in tab.studio.script.read_text(encoding="utf-8"))


def test_a_script_that_goes_away_stays_in_the_page(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    script: Path = tab.studio.script
    script.unlink()
    tab.page.wait_for_selector("[data-testid=choice-0]")
    assert "cannot read" in tab.page.locator("#notice").inner_text()
    assert tab.text() == FOUR_BAR
    tab.testid("choice-0").click()
    tab.testid("save").click()
    wait_for(script.exists)
    assert script.read_text(encoding="utf-8") == FOUR_BAR
    script.write_bytes(b"\xff\xfe\x00")  # no text any more
    tab.page.wait_for_selector("[data-testid=choice-0]")
    assert tab.text() == FOUR_BAR


def test_two_pages_on_one_script_do_not_overwrite_each_other(opened: Opened) -> None:
    one = opened(FOUR_BAR)
    one.settled()
    two = opened(one.studio)
    two.settled()
    for tab, words in ((one, "// one"), (two, "// two")):
        tab.focus()
        tab.page.keyboard.press("Control+End")
        tab.page.keyboard.type(words)
    one.testid("save").click()
    script: Path = one.studio.script
    wait_for(lambda: "// one" in script.read_text(encoding="utf-8"))
    two.page.wait_for_selector("[data-testid=choice-0]")
    two.page.wait_for_timeout(400)
    assert two.text().endswith("// two")
    assert "// two" not in script.read_text(encoding="utf-8")
    two.testid("choice-1").click()
    assert two.text() == one.text()


@pytest.mark.slow
def test_rendering_shows_how_far_it_is_and_is_cancelled_while_the_page_lives_on(opened: Opened) -> None:
    tab = opened(LONG.replace("@1000", "@60"))
    tab.until("s.shownRev === s.rev && !s.glimpse", 60_000)
    tab.testid("render").click()
    tab.testid("dialog-ok").click()
    tab.page.wait_for_function(
        "() => (document.querySelector('[data-testid=progress]') || {value: 0}).value > 0", timeout=60_000
    )
    rev = tab.state["rev"]
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("//")
    tab.until(f"s.shownRev > {rev}")
    tab.testid("cancel-render").click()
    tab.page.wait_for_function("() => document.getElementById('notice').dataset.state === 'cancelled'", timeout=30_000)
    assert [path.name for path in tab.studio.folder.glob("*.gif")] == []


def test_a_script_that_takes_a_minute_says_so_lets_one_type_and_is_stopped(opened: Opened) -> None:
    """A tiling of more than a thousand vertices."""
    tab = opened(linkage_script(transformable(5), "tiling"))
    busy = tab.testid("busy")
    tab.page.wait_for_function("() => !document.getElementById('busy').hidden")
    tab.page.wait_for_function("() => /[1-9] s/.test(document.getElementById('busy').innerText)")  # it counts
    tab.focus()
    tab.page.keyboard.press("Control+Home")
    tab.page.keyboard.type("// at once\n")
    assert tab.text().startswith("// at once\n")
    tab.page.wait_for_function("() => !document.getElementById('busy').hidden")
    tab.testid("stop").click()
    assert "Stopped" in tab.testid("told").inner_text()
    assert busy.is_hidden()
    tab.write(FOUR_BAR)  # which would have to wait for the other one, were it not given up
    assert tab.until("s.shownRev === s.rev && !s.glimpse", 5_000)["frames"] == 51


def test_a_script_that_is_renamed_goes_on_under_its_new_name(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("// not saved yet")
    script: Path = tab.studio.script
    other = script.with_name("another.mov")
    script.rename(other)
    tab.page.wait_for_selector("[data-testid=choice-0]")
    assert "drawn.mov is called another.mov now" in tab.page.locator("#notice").inner_text()
    tab.testid("choice-0").click()
    tab.page.wait_for_function("() => document.getElementById('name').textContent === 'another.mov'")
    assert tab.text().endswith("// not saved yet")
    assert not tab.state["saved"]
    tab.testid("save").click()
    wait_for(lambda: other.read_text(encoding="utf-8").endswith("// not saved yet"))
    assert not script.exists()


def test_a_page_that_was_asleep_for_an_hour_finds_its_server_again(
    opened: Opened, studio: Callable[..., Studio]
) -> None:
    """The lid is closed for an hour, and the server was killed and started again: what was typed is there."""
    first = studio(FOUR_BAR)
    tab = opened(first)
    tab.settled()
    tab.page.clock.install()
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("// before")
    first.process.kill()
    first.end()
    tab.page.clock.fast_forward("01:00:00")
    tab.page.keyboard.type(" and after")
    tab.testid("save").click()
    assert "no connection" in tab.testid("told").inner_text()
    second = studio(FOUR_BAR, first.port)
    assert second.url == first.url
    tab.page.clock.fast_forward(3000)
    tab.page.wait_for_function("() => document.getElementById('link').textContent === ''")
    state = tab.until("s.shownRev === s.rev")
    assert state["rev"] > 1
    assert tab.text().endswith("// before and after")
    tab.testid("save").click()
    wait_for(lambda: "// before and after" in second.script.read_text(encoding="utf-8"))


# --- what stays behind, without a browser ---------------------------------------------------------------------


def texts(count: int) -> Iterator[str]:
    """A four-bar whose coupler's point goes up and down."""
    return (FOUR_BAR.replace("[70,90]", f"[70,{90 + number % 7}]") for number in range(count))


def test_pages_that_were_closed_leave_nothing_behind(tmp_path: Path) -> None:
    script = tmp_path / "x.mov"
    script.write_text(FOUR_BAR, encoding="utf-8")
    threads = threading.active_count()
    left: list[weakref.ref[Any]] = []
    for number in range(10):
        said: list[Any] = []
        page = Page(str(script), tmp_path, Choices(), said.append)
        page.take(TextTyped(1, FOUR_BAR, 0.0))
        if number % 2:  # some in the middle of their work
            wait_for(lambda said=said: any(isinstance(item, FilmShown) for item in said))
        page.close()
        left += [weakref.ref(page), weakref.ref(page._worker), weakref.ref(page._dragging)]
        del page, said
    wait_for(lambda: threading.active_count() <= threads)
    gc.collect()
    assert [ref for ref in left if ref() is not None] == []


def test_edits_leave_no_objects_behind(tmp_path: Path) -> None:
    """Counted, not timed: after each thirty quick edits there are as many objects as before."""
    shown, done = threading.Event(), threading.Event()
    said: list[int] = []

    def send(message: Any) -> None:
        if isinstance(message, FilmShown) and not message.glimpse:
            said.append(message.rev)
            shown.set()
        elif isinstance(message, StageDone) and message.final:
            done.set()

    worker = Worker(str(tmp_path / "x.mov"), tmp_path, send)
    counts: list[int] = []
    try:
        rev = 0
        for _ in range(3):
            for number, text in enumerate((*texts(30), *texts(7))):
                rev += 1
                shown.clear()
                done.clear()
                worker.typed(TextTyped(rev, text, 0.0))
                assert shown.wait(20)
                # what is kept of the last texts depends on how far each of them came: these come to their end
                assert number < 29 or done.wait(20)
            gc.collect()
            counts.append(len(gc.get_objects()))
    finally:
        worker.close()
    assert said == sorted(said)
    assert said[-1] == rev
    assert counts[2] - counts[1] < 30, counts  # less than one for each edit


def test_a_film_of_a_hundred_thousand_frames_is_shown_in_two_steps(tmp_path: Path) -> None:
    said: list[Any] = []
    worker = Worker(str(tmp_path / "x.mov"), tmp_path, said.append)
    try:
        worker.typed(TextTyped(1, LONG, 0.0))
        wait_for(lambda: any(isinstance(item, StageDone) and item.final for item in said), 60)
        films = [item for item in said if isinstance(item, FilmShown) and not item.glimpse]
        assert [film.scene["frames"] for film in films] == [20_000, 100_001]
        assert all(film.film["frames"] == film.scene["frames"] for film in films)
        said.clear()
        worker.typed(TextTyped(2, LONG.replace("7.3", "7.4"), 900.0))  # the time looked at is among the first ones
        wait_for(lambda: any(isinstance(item, FilmShown) and not item.glimpse for item in said), 60)
        first = next(item for item in said if isinstance(item, FilmShown) and not item.glimpse)
        assert first.scene["frames"] == 90_001
    finally:
        worker.close()


def test_without_the_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from movimentum.cli import studio as command
    from movimentum.cli.app import run_command_line

    monkeypatch.setattr(command, "find_spec", lambda name: None if name == "starlette" else object())
    assert run_command_line(["studio", "--no-open"]) == 2
    said = capsys.readouterr()
    assert "pip install 'movimentum[studio]'" in said.err
    assert said.out == ""


def test_usage(tmp_path: Path) -> None:
    missing = movimentum("studio", "missing.mov", "--no-open", cwd=tmp_path)
    assert missing.returncode == 2
    assert "cannot read missing.mov" in missing.stderr
    assert missing.stdout == ""
    assert movimentum("studio", "-", "--no-open", cwd=tmp_path).returncode == 2
    assert movimentum("studio", "--port", "70000", cwd=tmp_path).returncode == 2


def test_the_port_of_another_server_is_refused(studio: Callable[..., Studio], tmp_path: Path) -> None:
    first = studio(FOUR_BAR)
    done = movimentum("studio", "--no-open", "--port", str(first.port), cwd=tmp_path)
    assert done.returncode == 2
    assert "usage/port" in done.stderr


def test_the_first_line_is_the_address_and_an_interrupt_ends_it(studio: Callable[..., Studio]) -> None:
    first = studio(FOUR_BAR)
    assert first.url.startswith("http://127.0.0.1:")
    assert "token=" in first.url
    assert first.end() == 130
