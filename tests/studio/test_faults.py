"""What goes wrong while a page is open: nothing that was typed is lost, and the page stays usable."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.command import LONG, ROOT, movimentum
from tests.studio.conftest import Studio, Tab, wait_for
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow

Opened = Callable[..., Tab]


@pytest.mark.slow
def test_a_server_that_ends_and_comes_back_finds_the_text_that_was_typed(
    opened: Opened, studio: Callable[..., Studio]
) -> None:
    first = studio(FOUR_BAR)
    tab = opened(first)
    tab.settled()
    first.process.kill()
    first.end()
    tab.page.wait_for_function("() => document.getElementById('link').textContent !== ''")
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("// typed without a server")
    tab.testid("save").click()
    assert "no connection" in tab.testid("told").inner_text()
    second = studio(FOUR_BAR, first.port)
    assert second.url == first.url
    tab.page.wait_for_function("() => document.getElementById('link').textContent === ''")
    state = tab.settled()
    assert state["shownRev"] == state["rev"]
    assert tab.text().endswith("// typed without a server")
    tab.testid("save").click()
    wait_for(lambda: "typed without a server" in second.script.read_text(encoding="utf-8"))


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


@pytest.mark.slow
def test_typing_goes_on_while_a_large_script_is_solved(opened: Opened) -> None:
    tab = opened(ROOT / "scripts" / "penrose-twenty.mov")
    tab.focus()
    tab.page.keyboard.press("Control+Home")
    for key in "// typed at once\n":
        tab.page.keyboard.insert_text(key)
    assert tab.text().startswith("// typed at once\n")
    state = tab.until("s.shownRev === s.rev && !s.glimpse", 60_000)
    assert state["rev"] > 10


@pytest.mark.slow
def test_what_takes_long_says_so_and_is_stopped(opened: Opened) -> None:
    text = (ROOT / "scripts" / "penrose-twenty.mov").read_text(encoding="utf-8")
    tab = opened(text)
    tab.until("s.shownRev === s.rev && !s.glimpse && s.settled", 120_000)
    tab.page.evaluate("movimentum.select(movimentum.text().length)")
    number = text.index("[", text.index("@")) + 1
    tab.page.evaluate("place => movimentum.select(place)", number)
    shown = tab.state["shownRev"]
    tab.page.keyboard.insert_text("7")  # another scene altogether
    busy = "() => !document.getElementById('busy').hidden || movimentum.state().shownRev > " + str(shown)
    tab.page.wait_for_function(busy)
    if not tab.page.evaluate("document.getElementById('busy').hidden"):
        tab.testid("stop").click()
        assert "Stopped" in tab.testid("told").inner_text()
    tab.focus()
    tab.page.keyboard.press("Control+z")
    state = tab.until("s.shownRev === s.rev && !s.glimpse", 120_000)
    assert state["shownRev"] > shown


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
