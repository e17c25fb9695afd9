"""Completion, what a name is, other names and the layout, in the page."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from movimentum.formatting.columns import formatted
from movimentum.messages import explanations
from movimentum.source import SourceText
from tests.studio.conftest import Tab
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow
Opened = Callable[..., Tab]
SMILES = "// \U0001f642 \U0001f642\n"
"""Two characters beyond the first 65,536: offsets of the page and the server differ."""


def end(tab: Tab) -> None:
    tab.page.evaluate("movimentum.select(movimentum.text().length)")


def labels(tab: Tab) -> list[str]:
    tab.testid("completion").wait_for()
    tab.page.wait_for_timeout(120)  # a list that has just opened takes no key
    return tab.testid("completion").locator(".cm-completionLabel").all_inner_texts()


def test_completion_by_keys_is_one_step_to_undo(opened: Opened) -> None:
    tab = opened(SMILES + FOUR_BAR)
    tab.settled()
    end(tab)
    tab.page.keyboard.type("    Coup")
    assert labels(tab) == ["Coupler"]
    before = tab.text()
    tab.page.keyboard.press("Tab")
    tab.page.wait_for_function("() => movimentum.text().endsWith('    Coupler')")
    tab.testid("completion").wait_for(state="detached")
    tab.page.keyboard.press("Control+z")
    assert tab.text() == before
    tab.page.keyboard.press("Control+y")
    tab.page.keyboard.type(".")
    tab.page.wait_for_function("() => document.querySelector('[data-testid=completion]')?.innerText.includes('angle')")
    assert labels(tab)[:4] == ["B", "P", "C", "Z"]
    tab.page.keyboard.press("ArrowDown")
    tab.page.wait_for_timeout(100)
    tab.page.keyboard.press("Enter")
    tab.page.wait_for_function("() => movimentum.text().endsWith('    Coupler.P')")
    tab.page.keyboard.type("; // Cr")
    tab.page.wait_for_timeout(300)
    assert tab.testid("completion").count() == 0, "a comment"
    tab.page.keyboard.press("Control+Space")
    tab.page.keyboard.press("Enter")
    assert tab.text().rstrip(" ").endswith("// Cr\n"), "Enter is a new line where there is no list"


def test_escape_closes_the_list_and_leaves_the_editor_only_then(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    end(tab)
    tab.page.keyboard.type("Cr")
    assert labels(tab) == ["Crank"]
    tab.page.keyboard.press("Escape")
    tab.testid("completion").wait_for(state="detached")
    assert tab.page.evaluate("document.activeElement.className").startswith("cm-content")
    tab.page.keyboard.press("Escape")
    assert tab.page.evaluate("document.activeElement.id") == "stage"


def test_a_colour_is_completed_within_its_quotes(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    place = tab.text().index("steelblue")
    tab.page.evaluate("p => movimentum.select(p)", place + 5)
    tab.page.keyboard.press("Control+Space")
    assert labels(tab) == ["steelblue"]
    tab.page.keyboard.press("Backspace")
    tab.page.keyboard.press("Control+Space")
    tab.page.wait_for_function("() => !!document.querySelector('[data-testid=completion]')")
    tab.page.wait_for_timeout(100)
    tab.page.keyboard.press("Enter")
    tab.page.wait_for_function("() => movimentum.text().includes(\".color('steelblue');\")")


def test_what_a_name_is_by_mouse_and_by_key(opened: Opened) -> None:
    tab = opened(SMILES + FOUR_BAR)
    tab.settled()
    tab.until("s.claims !== null")
    tab.page.wait_for_timeout(500)
    word = tab.page.locator(".cm-line", has_text="Coupler.B = Crank.B").get_by_text("Coupler", exact=False).first
    box = word.bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + 60, box["y"] + box["height"] / 2)
    told = tab.testid("explained")
    told.wait_for()
    assert "Coupler : .bar" in told.inner_text()
    tab.page.mouse.move(5, 5)
    told.wait_for(state="detached")
    tab.page.evaluate("p => movimentum.select(p)", tab.page.evaluate("movimentum.text().indexOf('Crank.B;')") + 6)
    tab.page.keyboard.press("F1")
    told.wait_for()
    assert "At the beginning: Crank.B = [180, 110]" in told.inner_text()
    tab.page.keyboard.press("Escape")
    told.wait_for(state="detached")


def test_another_name_in_one_step(opened: Opened) -> None:
    tab = opened(SMILES + FOUR_BAR, viewport={"width": 390, "height": 800})
    tab.settled()
    before = tab.text()
    tab.page.evaluate("p => movimentum.select(p)", before.index("Coupler.B") + 3)
    tab.page.keyboard.press("F2")
    field = tab.testid("new-name")
    field.wait_for()
    box = field.bounding_box()
    assert box is not None
    assert 0 <= box["x"] <= box["x"] + box["width"] <= 390
    assert field.input_value() == "Coupler"
    field.fill("Crank")
    field.press("Enter")
    tab.page.wait_for_function(
        "() => document.querySelector('[data-testid=rename-words]').innerText.includes('already')"
    )
    assert tab.text() == before
    field.fill("Link")
    field.press("Enter")
    tab.page.wait_for_function("() => movimentum.text().includes('Link')")
    assert tab.text() == before.replace("Coupler", "Link")
    assert field.count() == 0
    tab.page.keyboard.press("Control+z")
    assert tab.text() == before
    tab.testid("rename").click()
    field.press("Escape")
    field.wait_for(state="detached")
    assert tab.page.evaluate("document.activeElement.className").startswith("cm-content")
    tab.page.evaluate("movimentum.select(0)")
    tab.page.keyboard.press("F2")
    tab.page.wait_for_function("() => document.getElementById('hint').innerText.includes('no name of its own')")


def test_the_layout_in_one_step_and_the_cursor_where_it_was(opened: Opened) -> None:
    text = SMILES + FOUR_BAR.replace(" = ", "=").replace("    ", " ")
    tab = opened(text)
    tab.settled()
    tab.page.evaluate("p => movimentum.select(p)", tab.page.evaluate("movimentum.text().indexOf('Rocker.D')") + 6)
    tab.page.keyboard.press("Shift+Alt+F")
    wanted = formatted(SourceText("x.mov", text))
    tab.page.wait_for_function("wanted => movimentum.text() === wanted", arg=wanted)
    place = tab.page.evaluate("movimentum.cursor()")
    assert tab.page.evaluate("p => movimentum.text().slice(p - 6, p + 2)", place) == "Rocker.D"
    tab.page.keyboard.press("Control+z")
    assert tab.text() == text
    tab.testid("format").click()
    tab.page.wait_for_function("wanted => movimentum.text() === wanted", arg=wanted)
    tab.write("A : .bar\n@0 A.P = ;")
    tab.testid("format").click()
    tab.page.wait_for_function("() => document.getElementById('hint').innerText.includes('without errors')")


def test_an_answer_for_an_older_text_is_dropped(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.page.evaluate("p => movimentum.select(p)", FOUR_BAR.index("Coupler.B") + 3)
    tab.page.evaluate(
        "() => { const key = (k) => document.querySelector('.cm-content').dispatchEvent("
        "new KeyboardEvent('keydown', {key: k, keyCode: 113, bubbles: true, cancelable: true})); key('F2');"
        " document.execCommand('insertText', false, 'x'); }"
    )
    tab.page.wait_for_timeout(400)
    assert tab.testid("new-name").count() == 0
    assert "Couxpler.B" in tab.text()


def test_a_message_tells_what_its_code_means(opened: Opened) -> None:
    tab = opened(FOUR_BAR + "    Crank.Q = [0,0];\n")
    box = tab.testid("meaning-name/unknown-anchor")
    box.wait_for()
    box.locator("summary").click()
    text = box.locator("pre")
    tab.page.wait_for_function("() => document.querySelector('.meaning pre').innerText.length > 20")
    assert text.inner_text().strip() == explanations()["name/unknown-anchor"].text.strip()
    end(tab)
    tab.page.keyboard.type("// more")  # what is open stays open
    tab.page.wait_for_timeout(600)
    assert tab.testid("meaning-name/unknown-anchor").evaluate("box => box.open")
    assert text.inner_text().strip() == explanations()["name/unknown-anchor"].text.strip()
