"""What scripts, motions, tables and errors show in a notebook."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import movimentum as mv

ROOT = Path(__file__).parents[2]
GALLERY = sorted((ROOT / "scripts").glob("*.mov"))
ARM = "Arm : .bar O=[0,0] P=[40,0]; @0 Arm.O=[50,50]; Arm.angle=90*.t; @1"
BINDS = "Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A=[0,0]; Rod.B=[30 + 40*.t, y]; y > 0; @1"
QUICK = ("four-bar", "slider-crank", "trammel")


def shown(value: Any) -> str:
    return value._repr_html_()


def page(*cells: str) -> str:
    foreign = "button {font-size: 50px; position: fixed} canvas {display: none} .controls {color: red}"
    parts = "".join(f'<div class="output" tabindex="0">{cell}</div>' for cell in cells)
    return f"<!DOCTYPE html><meta charset=utf-8><style>{foreign}</style><body><h1>a notebook</h1>{parts}"


@pytest.mark.parametrize("path", [pytest.param(p, marks=[] if p.stem in QUICK else pytest.mark.slow) for p in GALLERY])
def test_every_script_of_the_gallery_is_at_most_300_kb(path: Path):
    html = shown(mv.load(path))
    assert len(html.encode()) <= 300_000
    assert not re.search(r"(src|href)=.?(https?:)?//", html)


def test_a_long_film_shows_some_of_its_frames():
    html = shown(mv.loads(".config(100, 100, 100);" + ARM.replace("@1", "@900")).solve())
    assert len(html) <= 400_000
    assert "of 4 frames, one is shown" in html


def test_several_play_in_one_page_and_do_not_meet(browser: Any):
    arm = mv.loads(ARM)
    opened = browser.new_page()
    said: list[str] = []
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.on("console", lambda message: said.append(message.text))
    opened.set_content(page(shown(arm), shown(arm), shown(arm.solve())))
    stages = opened.get_by_test_id("stage")
    stages.nth(2).wait_for()
    assert stages.count() == 3
    frames = "[...document.querySelectorAll('[data-movimentum-film]')].map((cell) => cell.player.state())"
    opened.wait_for_function(f"{frames}.every((state) => state.frame > 0)")
    opened.evaluate("document.querySelectorAll('[data-movimentum-film]').forEach((cell) => cell.player.pause())")
    stages.nth(1).click()
    opened.keyboard.press("Home")
    opened.keyboard.press("ArrowRight")
    assert opened.evaluate(f"{frames}[1].frame") == 1
    before = opened.evaluate(f"{frames}.map((state) => state.frame)")
    opened.locator(".output").nth(0).focus()
    opened.keyboard.press("ArrowRight")  # the notebook's, not a player's
    assert opened.evaluate(f"{frames}.map((state) => state.frame)") == before
    assert opened.evaluate(f"{frames}[1].anchors['Arm.P'][1]") == pytest.approx(50 + 40 * 0.0627905, abs=1e-3)
    assert opened.evaluate("document.querySelectorAll('[id]').length") == 0
    assert opened.evaluate("Object.keys(window).filter((name) => /movimentum|^STYLE$|player/i.test(name))") == []
    assert opened.get_by_test_id("play").first.evaluate("(b) => getComputedStyle(b).position") == "static"
    assert said == []
    opened.close()


def test_a_film_that_is_not_seen_is_not_drawn(browser: Any):
    opened = browser.new_page()
    opened.set_content(page(shown(mv.loads(ARM)), '<div style="height: 5000px"></div>', shown(mv.loads(ARM))))
    opened.get_by_test_id("stage").nth(1).wait_for()
    last = "document.querySelectorAll('[data-movimentum-film]')[1].player"
    opened.wait_for_function(f"{last}.playing && !{last}.ticking")
    opened.get_by_test_id("stage").nth(1).scroll_into_view_if_needed()
    opened.wait_for_function(f"{last}.ticking")
    opened.close()


def test_without_scripts_the_first_frame_is_seen(browser: Any):
    context = browser.new_context(java_script_enabled=False)
    opened = context.new_page()
    opened.set_content(page(shown(mv.loads(ARM))))
    assert opened.locator("img").bounding_box()["width"] > 50
    stripped = re.sub(r"<script.*?</script>", "", shown(mv.loads(ARM)), flags=re.DOTALL)
    assert '<img src="data:image/png;base64,' in stripped
    context.close()


def luminance(color: str) -> float:
    channels = [int(part) / 255 for part in re.findall(r"\d+", color)[:3]]
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


@pytest.mark.parametrize(("ground", "ink"), [("rgb(255, 255, 255)", "#111"), ("rgb(17, 17, 17)", "#eee")])
def test_colours_are_read_on_light_and_dark_ground(browser: Any, ground: str, ink: str):
    table = mv.loads(".let R = 50;" + BINDS.replace("[50,0]", "[R,0]")).sweep(R=[40, 90])
    noted = mv.loads("Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A = [9,9]; @1").diagnostics
    opened = browser.new_page()
    parts = "".join(map(shown, (mv.loads(BINDS).diagnostics, table, noted)))
    opened.set_content(f'<body style="background: {ground}; color: {ink}">{parts}')
    colors = opened.evaluate("[...document.querySelectorAll('span, td, th')].map((e) => getComputedStyle(e).color)")
    assert len(set(colors)) >= 4
    for color in set(colors):
        light, dark = sorted((luminance(color), luminance(ground)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) >= 3, color
    opened.close()


def test_what_is_wrong_is_shown_and_nothing_raises():
    html = shown(mv.loads(BINDS))
    assert "data-movimentum-film" in html  # as far as it moves
    assert "solve/unreachable" in html
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads("@0 x = <b>;")
    assert "&lt;b&gt;" in shown(caught.value)
    assert "<b>" not in shown(caught.value)
    assert shown(mv.loads(ARM).diagnostics) is None


def test_an_error_ends_a_cell_as_in_a_terminal(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads("@0 Arm.O = [0,0];", name="arm.mov")
    lines = caught.value._render_traceback_()
    assert lines[0].startswith("line ")
    assert "mv.loads" in lines[0]
    assert any("\x1b[1;31merror[name/unknown-thing]" in line for line in lines)
    assert any("arm.mov:1:4" in line for line in lines)


def test_a_long_table_shows_its_ends():
    html = shown(mv.loads(".let R = 40;" + ARM.replace("[40,0]", "[R,0]")).sweep(R=range(1, 101)))
    assert "… 80 more" in html
    assert html.count("<tr") == 22
    assert ">100<" in html
