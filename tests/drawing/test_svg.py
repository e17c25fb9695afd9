"""An SVG is valid XML, needs no script, and holds exactly the frames."""

from __future__ import annotations

import io
import re
from fractions import Fraction
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from movimentum.vector.numbers import FilmClock, escaped, hex_color, joined, last_shown, short
from tests.broad import broad
from tests.command import CRANK, ROOT, STILL, movimentum
from tests.drawing.films import everything, shot_of_svg
from tests.drawing.likeness import ALIKE, SMALL, unlike

SVG = "{http://www.w3.org/2000/svg}"


def film(tmp_path: Path, text: str = CRANK, **options: Any) -> ElementTree.Element:
    path = tmp_path / "film.svg"
    mv.loads(text).solve().render(path, **options)
    return ElementTree.parse(path).getroot()


def test_an_svg_is_xml_with_no_script_and_no_other_place(tmp_path: Path) -> None:
    script = everything(tmp_path)
    mv.load(script).solve().render(tmp_path / "film.svg", show=["names", "free", "anchors"], trace="Late.B")
    root = ElementTree.parse(tmp_path / "film.svg").getroot()
    assert (root.tag, root.get("width"), root.get("height")) == (f"{SVG}svg", "360", "260")
    tags = {element.tag.removeprefix(SVG) for element in root.iter()}
    assert tags <= {
        "svg", "title", "desc", "style", "rect", "defs", "image", "filter", "feComponentTransfer", "feFuncR", "feFuncG",
        "feFuncB", "g", "use", "path", "polyline", "polygon", "circle", "animate", "animateTransform",
    }  # fmt: skip
    links = {value for element in root.iter() for name, value in element.attrib.items() if name.endswith("href")}
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in links)
    assert 'Größe </script>&"' in {element.get("aria-label") for element in root.iter()}


def test_the_picture_of_a_sprite_is_there_once(tmp_path: Path) -> None:
    mv.load(ROOT / "scripts" / "coupling-rods.mov").solve().render(tmp_path / "film.svg")
    text = (tmp_path / "film.svg").read_text(encoding="utf-8")
    assert text.count("<image ") == 3
    assert text[: text.index('<g id="still"')].count('<use href="#i') == 6


def test_a_letter_of_a_text_that_changes_is_there_once(tmp_path: Path) -> None:
    counting = "A : .disc(9) C=[20,20]; L : .label('x = {A.C.x:.1f} of 120') at=[5,50]; @0 A.C = [20 + 50*.t, 20]; @2"
    mv.loads(counting).solve().render(tmp_path / "film.svg")
    text = (tmp_path / "film.svg").read_text(encoding="utf-8")
    letters = set("x=of.0123456789")
    assert len(re.findall(r'<path id="w', text)) <= len(letters)
    assert len(re.findall(r'<g id="w', text)) == 51  # one for each frame
    assert len(text) < 40_000


def test_a_still_moves_nothing(tmp_path: Path) -> None:
    for options in ({"at": Fraction(1, 3)}, {"frames": 3}):
        tags = {element.tag for element in film(tmp_path, **options).iter()}
        assert not {f"{SVG}animate", f"{SVG}animateTransform"} & tags


def test_what_stands_still_is_not_animated(tmp_path: Path) -> None:
    assert not list(film(tmp_path, STILL).iter(f"{SVG}animateTransform"))
    animations = list(film(tmp_path).iter(f"{SVG}animateTransform"))
    assert [animation.get("type") for animation in animations] == ["rotate", "rotate", "translate"], "a crank turns"
    assert {animation.get("calcMode") for animation in animations} == {"discrete"}


def test_the_film_takes_as_long_as_its_frames_and_plays_as_often_as_it_should(tmp_path: Path) -> None:
    animation = next(film(tmp_path).iter(f"{SVG}animateTransform"))
    assert (animation.get("dur"), animation.get("repeatCount")) == ("1.1s", "indefinite")
    animation = next(film(tmp_path, loop=3).iter(f"{SVG}animateTransform"))
    assert (animation.get("repeatCount"), animation.get("fill")) == ("3", "freeze")


def test_a_transparent_svg_has_no_ground(tmp_path: Path) -> None:
    assert len(list(film(tmp_path).iter(f"{SVG}rect"))) == 1
    assert not list(film(tmp_path, transparent=True).iter(f"{SVG}rect"))


@broad("fps", [Fraction(24000, 1001), Fraction(7), Fraction(49), Fraction(60)], first=2)
def test_at_the_very_time_of_a_frame_the_frame_is_shown(page: Any, tmp_path: Path, fps: Fraction) -> None:
    path = tmp_path / "film.svg"
    motion = mv.loads(
        "Bar : .bar A = [50,50] B = A + [40,0] .width(7);\n@0 Bar.A = [50,50]; Bar.angle = 90*.t;\n@4"
    ).solve(fps=fps)
    motion.render(path)
    page.goto(path.as_uri())
    find = """([k, t]) => {
        const svg = document.documentElement;
        svg.pauseAnimations();
        svg.setCurrentTime(t);
        const all = [...document.querySelector("polyline").transform.animVal];
        return all[all.length - 1].angle;
    }"""
    for frame in range(motion.timeline.frame_count):
        angle = page.evaluate(find, [frame, float(frame / fps)])
        assert (angle - float(90 * frame / fps) + 180) % 360 - 180 == pytest.approx(0, abs=0.06), frame


def test_the_animation_plays_and_begins_again(page: Any, tmp_path: Path) -> None:
    path = tmp_path / "film.svg"
    motion = mv.loads(CRANK).solve()
    motion.render(path)
    motion.render(tmp_path / "4.png", frames=4)
    page.goto(path.as_uri())
    again = shot_of_svg(page, Fraction(11 + 4, 10), (120, 80))
    found = unlike(again, Image.open(tmp_path / "4.png").convert("RGB"))
    assert found[0] <= ALIKE.worst


def test_who_wants_less_motion_sees_the_first_frame(page: Any, tmp_path: Path) -> None:
    motion = mv.load(everything(tmp_path)).solve()
    motion.render(tmp_path / "film.svg")
    motion.render(tmp_path / "0.png", frames=0)
    picture = Image.open(tmp_path / "0.png").convert("RGB")
    page.goto((tmp_path / "film.svg").as_uri())
    page.emulate_media(reduced_motion="reduce")
    page.evaluate("document.documentElement.setCurrentTime(0.9)")
    data = page.screenshot(clip={"x": 0, "y": 0, "width": picture.width, "height": picture.height})
    assert unlike(Image.open(io.BytesIO(data)).convert("RGB"), picture)[0] <= SMALL.worst


def test_numbers_are_short_and_read_back() -> None:
    values = [0.0, -0.0, -0.001, 0.5, -0.5, 1.0, 100.0, -12.345, 1e-9, 12345.678]
    assert [short(value, 2) for value in values] == [
        "0", "0", "0", ".5", "-.5", "1", "100", "-12.35" if f"{-12.345:.2f}" == "-12.35" else "-12.34", "0", "12345.68",
    ]  # fmt: skip
    assert joined(3.0, -0.5, 7.0, 0.25, decimals=2) == "3 -.5 7 .25"
    generator = np.random.default_rng(3)
    for row in generator.normal(0.0, 100.0, (200, 4)).tolist():
        read = re.findall(r"-?(?:\d+\.?\d*|\.\d+)", joined(*row, decimals=3))
        assert np.allclose([float(part) for part in read], row, atol=6e-4)


def test_a_value_that_stays_is_written_once_with_its_time() -> None:
    changing = ["0"] * 900 + ["1"] * 100
    timed = FilmClock(1000, Fraction(25), 0).values(changing)
    assert timed == 'values="0;1" keyTimes="0;.9"'
    assert FilmClock(3, Fraction(25), 0).values(["1", "2", "3"]) == 'values="1;2;3"'
    for frames in (7, 13, 333, 1001):  # a time is never after its frame, nor before the middle of the one before
        for at in range(1, frames):
            text = FilmClock(frames, Fraction(25), 0).values(["a" * 30] * at + ["b" * 30] * (frames - at))
            key = float(re.search(r";([.\d]+)\"$", text).group(1)) if "keyTimes" in text else at / frames
            assert (at - 0.5) / frames < key <= at / frames


def test_what_is_not_seen_does_not_move() -> None:
    values = np.array([[1.0], [2.0], [3.0], [4.0], [5.0]])
    assert last_shown(values, np.array([0.0, 1.0, 0.0, 0.0, 1.0])).ravel().tolist() == [2.0, 2.0, 2.0, 2.0, 5.0]
    assert last_shown(values, np.zeros(5)).ravel().tolist() == [1.0] * 5


def test_texts_are_escaped_and_what_xml_cannot_hold_is_replaced() -> None:
    hostile = "\x00\x1b<a&b>\"'\ud800\ufffe]]>"
    read = ElementTree.fromstring(f'<a b="{escaped(hostile)}">{escaped(hostile)}</a>')
    assert read.text == read.get("b") == "\ufffd\ufffd<a&b>\"'\ufffd\ufffd]]>"
    assert (hex_color((255, 0, 17)), hex_color((1, 2, 3))) == ("#f01", "#010203")


def test_a_film_of_too_many_poses_is_refused_with_what_can_be_typed(tmp_path: Path) -> None:
    script = tmp_path / "long.mov"
    script.write_text(CRANK.replace("@1", "@60000"), encoding="utf-8")
    done = movimentum("run", script, "-o", tmp_path / "long.svg")
    assert done.returncode == 2
    assert "limit/poses" in done.stderr
    assert "--frames 0:500000" in done.stderr
    assert not (tmp_path / "long.svg").exists()
    assert movimentum("run", script, "-o", tmp_path / "some.svg", "--frames", "0:20").returncode == 0


def test_an_svg_moves_in_a_picture_of_a_page(page: Any, tmp_path: Path) -> None:
    mv.load(everything(tmp_path)).solve().render(tmp_path / "film.svg")
    (tmp_path / "page.html").write_text('<!DOCTYPE html><img src="film.svg">', encoding="utf-8")
    page.goto((tmp_path / "page.html").as_uri())
    before = page.screenshot()
    page.wait_for_timeout(400)
    assert page.screenshot() != before


LETTERED = """.config(10, 300, 200);
Crank : .bar A = [0,0]  B = A + [50,0];
Name  : .label('F_{12} & <b>') Crank.B .italic .offset(8,8);
Turn  : .label('{Crank.angle:5.1f}°') at = [150,180] .align('center');
Size  : .dimension Crank.A Crank.B .offset(20) .text('r');
@0  Crank.A = [70,80];   Crank.angle = 90*.t;
@1
"""


def test_texts_are_outlines_or_texts(tmp_path: Path) -> None:
    motion = mv.loads(LETTERED).solve()
    for form in (None, "outlines", "live"):
        for at in (None, 0.5):
            motion.render(tmp_path / "a.svg", at=at, text=form)
            root = ElementTree.parse(tmp_path / "a.svg").getroot()
            told = {"".join(each.itertext()) for each in root.iter("{http://www.w3.org/2000/svg}text")}
            assert {"F12 & <b>", "r", " 45.0°"} <= told if form == "live" else not told
            motion.render(tmp_path / "a.pdf", at=at, text=form)
            assert (b"/Subtype /Type3" in (tmp_path / "a.pdf").read_bytes()) is (form != "outlines")
    with pytest.raises(mv.UsageError):
        motion.render(tmp_path / "a.svg", text="alive")  # pyright: ignore
