"""The page: one file that plays by itself, by mouse and by keyboard, and that asks nobody for anything."""

from __future__ import annotations

import base64
import io
import json
import re
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from tests.command import BINDS, CRANK, STILL, movimentum
from tests.drawing.films import everything
from tests.drawing.likeness import levels

EVIL = """\
.config(10, 200, 100);
Bar  : .bar A = [20,30] B = A + [50,0];
Text : .label('</script><!-- <script>alert(1)</script> \u2028 & "') A = [10,60];
@0 Bar.A = [20,30]; Bar.angle = 90*.t; Text.A = [10,60];
@1
"""
"""A text that would end the script, begin a comment, or end a line of a program."""


def film(tmp_path: Path, text: str = CRANK, **options: Any) -> Path:
    path = tmp_path / "film.html"
    mv.loads(text).solve().render(path, **options)
    return path


class Scripts(HTMLParser):
    """The scripts of a page with their attributes, and the elements that it has."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self.tags: list[str] = []
        self._inside = False
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: Any) -> None:
        self.tags.append(tag)
        self._inside = tag == "script"
        if self._inside:
            self.scripts.append((dict(attributes), ""))

    def handle_endtag(self, tag: str) -> None:
        self._inside = False

    def handle_data(self, data: str) -> None:
        if self._inside:
            attributes, before = self.scripts[-1]
            self.scripts[-1] = attributes, before + data


def data_of(path: Path) -> dict[str, Any]:
    (attributes, text), _ = Scripts(path.read_text(encoding="utf-8")).scripts
    assert attributes["type"] == "application/json"
    found: dict[str, Any] = json.loads(text)
    return found


def state(page: Any) -> dict[str, Any]:
    found: dict[str, Any] = page.evaluate("movimentum.state()")
    return found


def eventually(page: Any, expression: str) -> None:
    """Wait until an expression is true (Playwright's own way evaluates texts in the page, which its policy forbids)."""
    end = time.monotonic() + 10.0
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(15)


def test_a_page_is_one_file_with_two_scripts_and_names_no_other_place(tmp_path: Path) -> None:
    text = film(tmp_path, EVIL).read_text(encoding="utf-8")
    parsed = Scripts(text)
    assert len(parsed.scripts) == 2
    assert not {"link", "img", "iframe", "base", "object"} & set(parsed.tags)
    assert re.findall(r"(?:https?:)?//[\w.-]+\.\w+", text) == []
    assert "default-src 'none'" in text


def test_a_text_that_ends_a_script_stays_a_text(tmp_path: Path, page: Any) -> None:
    path = film(tmp_path, EVIL)
    (mark,) = [mark for mark in data_of(path)["marks"] if mark["kind"] == "text"]
    assert mark["text"] == '</script><!-- <script>alert(1)</script> \u2028 & "'
    assert path.read_text(encoding="utf-8").count("</script>") == 2
    page.goto(path.as_uri())
    assert state(page)["frames"] == 11


def test_the_poses_are_floats_of_32_bits(tmp_path: Path) -> None:
    motion = mv.loads(CRANK).solve()
    motion.render(tmp_path / "film.html")
    data = data_of(tmp_path / "film.html")
    poses = np.frombuffer(base64.b64decode(data["poses"]), "<f4")
    (crank,) = [body for body in data["bodies"] if body["name"] == "Crank"]
    assert (crank["x"], crank["y"]) == (30, 40), "the pivot stands still"
    (offset,) = crank["angle"]
    assert np.allclose(poses[offset : offset + 11], 9.0 * np.arange(11), atol=1e-4)


@pytest.mark.slow
def test_the_same_film_has_the_same_bytes(tmp_path: Path) -> None:
    script = everything(tmp_path)
    for name in ("a.html", "b.html", "a.svg", "b.svg"):
        options = ["--show", "names,free", "--trace", "Wheel.P"]
        done = movimentum("run", script, "-o", tmp_path / name, *options, fresh=name.startswith("b"))
        assert done.returncode == 0, done.stderr
    for kind in ("html", "svg"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_no_request_is_made_and_anchors_are_where_the_solver_has_them(tmp_path: Path, page: Any) -> None:
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    script = everything(tmp_path)
    motion = mv.load(script).solve()
    motion.render(tmp_path / "film.html")
    page.goto((tmp_path / "film.html").as_uri())
    page.evaluate("movimentum.ready")
    assert [url for url in requests if not url.startswith("data:")] == [(tmp_path / "film.html").as_uri()]
    for frame in (0, 7, 20):
        page.evaluate("k => movimentum.seek(k)", frame)
        found = state(page)
        assert found["time"] == pytest.approx(motion.times[frame])
        for name in ("Wheel.P", "Arm.C", "Text.A", "Late.B"):
            assert np.allclose(found["anchors"][name], motion[name][frame], atol=1e-3), (frame, name)


def test_the_page_knows_where_a_point_is_on_the_screen(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path).as_uri())
    box = page.get_by_test_id("stage").bounding_box()
    assert page.evaluate("movimentum.toScreen([30, 40])") == pytest.approx([box["x"] + 30, box["y"] + 80 - 40])


def test_the_film_plays_and_pauses(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path).as_uri())
    assert not state(page)["playing"], "who asked for less motion starts it"
    page.get_by_test_id("play").click()
    eventually(page, "movimentum.state().frame >= 3")
    eventually(page, "movimentum.state().frame < 3")  # it begins again
    page.get_by_test_id("play").click()
    frame = state(page)["frame"]
    page.wait_for_timeout(300)
    assert (state(page)["playing"], state(page)["frame"]) == (False, frame)


def test_the_film_plays_at_once_where_nobody_asked_for_less_motion(tmp_path: Path, browser: Any) -> None:
    context = browser.new_context(offline=True, reduced_motion="no-preference")
    page = context.new_page()
    page.goto(film(tmp_path).as_uri())
    eventually(page, "movimentum.state().frame >= 2")
    context.close()


def test_a_film_that_is_played_twice_ends_at_its_last_frame(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path, CRANK.replace("(10,", "(50,"), loop=2).as_uri())
    page.evaluate("movimentum.play()")
    eventually(page, "!movimentum.state().playing")
    assert state(page)["frame"] == 50
    assert page.get_by_test_id("loop").get_attribute("aria-pressed") == "false"


def test_speed_is_a_half_and_a_quarter(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path).as_uri())
    assert page.get_by_test_id("speed").locator("option").count() == 3
    page.get_by_test_id("speed").select_option("0.25")
    page.clock.install()
    page.evaluate("movimentum.play()")
    page.clock.run_for(1000)
    assert state(page)["frame"] in (2, 3)


def test_keys_play_step_and_jump(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path).as_uri())
    for key, frame in [("ArrowRight", 1), ("ArrowRight", 2), ("ArrowLeft", 1), ("End", 10), ("ArrowRight", 0)]:
        page.keyboard.press(key)
        assert state(page)["frame"] == frame
    page.keyboard.press("ArrowLeft")
    assert state(page)["frame"] == 10
    page.keyboard.press("Home")
    page.keyboard.press(" ")
    assert state(page)["playing"]
    page.keyboard.press(" ")
    assert not state(page)["playing"]
    page.get_by_test_id("scrubber").focus()  # an arrow key is one frame here too, not two
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    assert state(page)["frame"] == 1


def test_the_scrubber_seeks_while_it_is_dragged(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path).as_uri())
    box = page.get_by_test_id("scrubber").bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, y)
    page.mouse.down()
    assert state(page)["frame"] == 5
    before = page.get_by_test_id("stage").screenshot()
    page.mouse.move(box["x"] + box["width"] - 2, y)
    assert state(page)["frame"] == 10
    assert page.get_by_test_id("stage").screenshot() != before
    page.mouse.up()
    assert "11/11" in page.get_by_test_id("time").inner_text()


def test_traces_can_be_switched(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path, trace="Crank.P").as_uri())
    page.evaluate("movimentum.seek(10)")
    button = page.get_by_test_id("traces")
    assert button.get_attribute("aria-pressed") == "true"
    traced = page.get_by_test_id("stage").screenshot()
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    assert page.get_by_test_id("stage").screenshot() != traced


def test_a_page_without_traces_offers_those_of_all_anchors(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path).as_uri())
    assert page.get_by_test_id("traces").get_attribute("aria-pressed") == "false"
    page.get_by_test_id("traces").click()
    assert page.evaluate("movimentum.traces.length") == 4


def test_everything_that_is_used_has_a_name_for_those_who_do_not_see_it(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path).as_uri())
    for name in ("stage", "scrubber", "play", "speed", "loop", "traces", "back", "forward"):
        assert page.get_by_test_id(name).get_attribute("aria-label"), name
    assert "frame 1 of 11" in page.get_by_test_id("scrubber").get_attribute("aria-valuetext")


def test_a_still_has_no_player(tmp_path: Path, page: Any) -> None:
    page.goto(film(tmp_path, STILL, at=0).as_uri())
    assert not page.get_by_test_id("play").is_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_is_light_or_dark_and_the_picture_is_the_same(tmp_path: Path, browser: Any, scheme: str) -> None:
    context = browser.new_context(color_scheme=scheme, reduced_motion="reduce")
    page = context.new_page()
    page.goto(film(tmp_path).as_uri())
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert ground == {"light": "rgb(244, 244, 244)", "dark": "rgb(28, 28, 30)"}[scheme]
    shot = levels(Image.open(io.BytesIO(page.get_by_test_id("stage").screenshot())))
    assert shot[5, 5].tolist() == [255, 255, 255]
    context.close()


def test_frames_that_are_left_out_leave_no_gap(tmp_path: Path) -> None:
    script = tmp_path / "binds.mov"
    script.write_text(BINDS, encoding="utf-8")
    done = movimentum("run", script, "-o", tmp_path / "film.html", "--on-failure", "skip")
    assert done.returncode == 3
    data = data_of(tmp_path / "film.html")
    assert (data["frames"], data["times"]) == (6, [0, 0.1, 0.2, 0.3, 0.4, 0.5])
