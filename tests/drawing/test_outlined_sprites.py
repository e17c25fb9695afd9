"""SVGs as sprites stay outlines: drawn anew they look as resvg draws the file, and nothing else of it gets through."""

from __future__ import annotations

import io
import random
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import movimentum as mv
from movimentum.rendering.drawings import cut, drawing
from movimentum.vector.drawings import outlines
from tests.drawing.films import shot_of_page, shot_of_svg
from tests.drawing.likeness import Tolerance, unlike

resvg_py = pytest.importorskip("resvg_py")

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
SAME = Tolerance(160, 0.12)
"""One renderer, the same outlines but for their last digits, which decide single pixels at corners, and where the
dashes on a parabola are, which is a cubic here.
"""


def _picture(text: str) -> Image.Image:
    with Image.open(io.BytesIO(bytes(resvg_py.svg_to_bytes(svg_string=text)))) as image:
        paper = Image.new("RGBA", image.size, "white")
        paper.alpha_composite(image.convert("RGBA"))
        return paper.convert("RGB")


def _compare(folder: Path, text: str) -> None:
    (folder / "a.svg").write_text(text, encoding="utf-8")
    path = str(folder / "a.svg")
    found = outlines(path, "d", 3)
    assert (found.reason, bool(found.text)) == ("", True)
    made = drawing(path)
    worst, edges = unlike(_picture(found.document), _picture(cut(made, None, *made.pixels)))
    assert (worst <= SAME.worst, edges <= SAME.edges) == (True, True), (worst, edges, text)


def _path(pick: random.Random) -> str:
    def numbers(count: int, low: float = -40.0, high: float = 40.0) -> str:
        values = (f"{pick.uniform(low, high):.{pick.randint(0, 3)}f}" for _ in range(count))
        return " " + "".join(value + pick.choice([" ", ",", " , "]) for value in values).rstrip(" ,")

    parts = [f"M{pick.uniform(60, 140):.2f},{pick.uniform(60, 140):.2f}"]
    for _ in range(pick.randint(3, 9)):
        letter = pick.choice("lhvcsqta" * 3 + "LHVCSQTAz")
        if letter in "zZ":
            parts.append(letter)
        elif letter in "aA":
            flags = pick.choice(["0 1", "00", "1,1", "10", "01", "11"])
            end = numbers(2) if letter == "a" else numbers(2, 30.0, 170.0)
            parts.append(f"{letter}{numbers(2, 5.0, 60.0)}{numbers(1, 0.0, 360.0)} {flags}{end}")
        else:
            count = {"l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2}[letter.lower()] * pick.choice([1, 1, 2])
            parts.append(letter + (numbers(count) if letter.islower() else numbers(count, 30.0, 170.0)))
    return "".join(parts)


@pytest.mark.parametrize("seed", range(6))
def test_random_paths_are_drawn_as_they_are(seed: int, tmp_path: Path) -> None:
    pick = random.Random(seed)
    said = {
        "transform": ["rotate(20 100 100)", "skewX(12)", "scale(.8 1.1)", "matrix(1 .2 -.1 .9 4 3)"],
        "opacity": ["1", ".5", "60%"],
        "stroke-width": ["3", "2px", "1.5"],
        "fill": ["teal", "#c84", "none", "rgb(20%,40%,90%)", "#2468"],
        "stroke": ["black", "none", "rgba(0,0,0,.5)", "currentColor"],
        "color": ["purple"],
        "fill-rule": ["evenodd", "nonzero"],
        "stroke-linejoin": ["round", "miter", "bevel"],
        "stroke-linecap": ["round", "butt", "square"],
        "stroke-dasharray": ["none", "9 4", "7,3,2"],
        "fill-opacity": ["1", ".4"],
    }
    shapes = [
        f'<path d="{_path(pick)}" ' + " ".join(f'{name}="{pick.choice(some)}"' for name, some in said.items()) + "/>"
        for _ in range(4)
    ]
    _compare(tmp_path, f'{HEAD} width="200" height="200">{"".join(shapes)}</svg>')


SHAPES = """
<style>/* .x{} */ .b, rect.c { fill: #c33; stroke: black; stroke-width: 3 } #hub{fill:gold}
*{stroke-miterlimit:3}</style>
<defs><clipPath id="cp" transform="translate(2 0)"><circle cx="60" cy="60" r="40"/></clipPath>
<path id="sp" d="M60 60L60 22"/><linearGradient id="base"><stop offset="10%" stop-color="gold"/>
<stop offset=".5" style="stop-color:#c33"/><stop offset="1" stop-color="navy"/></linearGradient>
<linearGradient id="lin" xlink:href="#base" x1="130" y1="20" x2="230" y2="60" gradientUnits="userSpaceOnUse"
 gradientTransform="rotate(5)"/><radialGradient id="rad" href="#base" cx=".4" cy="40%" r=".6" fx=".3"/></defs>
<g id="wheel" transform="translate(4 6)"><circle class="b" cx="60" cy="60" r="50"/>
<g clip-path="url(#cp)" opacity=".7"><rect x="30" y="30" width="60" height="60" rx="8" fill="skyblue" stroke="navy"
 stroke-width="4" transform="rotate(20 60 60)"/></g>
<use xlink:href="#sp" stroke="green" stroke-width="5"/>
<use href="#sp" transform="rotate(120 60 60)" x="3" stroke="rgb(0,200,0)" stroke-width="5" stroke-linecap="round"/>
<ellipse id="hub" cx="60" cy="60" rx="14" ry="9" fill-opacity="0.8" stroke="#0008" stroke-width="2"/></g>
<g style="fill:none;stroke:#246;stroke-width:6"><polyline points="130,120 160,150 190,118 220 150"/>
<polygon points="150 20 230 30 200 90" style="fill:#fe8;visibility:visible"/><line x1="10" y1="150" x2="-30" y2="90"/>
<ellipse cx="190" cy="140" rx="40" ry="15" style="fill:url(#rad);stroke:none" fill-opacity=".8" transform="rotate(9)"/>
<path d="M120 60h50v20l-50 9z" style="fill:url('#lin') red;stroke-width:1"/>
<rect class="c" x="180" y="60" width="50" height="30" ry="9"/><rect display="none" width="90" height="90"/></g>
"""


@pytest.mark.parametrize(
    "page",
    [
        'width="240" height="160"', 'width="60mm" height="40mm" viewBox="0 0 240 160"',
        'width="300" height="300" viewBox="0 0 240 160"', 'viewBox="-20 -10 260 180"',
        'width="200" height="90" viewBox="0 0 240 160" preserveAspectRatio="none"', 'width="120" height="100"',
    ],
)  # fmt: skip
def test_shapes_styles_uses_and_clips(page: str, tmp_path: Path) -> None:
    _compare(tmp_path, f"{HEAD} {page}>{SHAPES}</svg>")


@pytest.mark.parametrize(
    ("inside", "reason"),
    [
        (
            '<filter id="f"><feGaussianBlur stdDeviation="3"/></filter><rect width="50" height="50" filter="url(#f)"/>',
            "`filter`",
        ),
        ('<pattern id="g"/><rect width="50" height="50" fill="url(#g)"/>', "pattern"),
        ('<linearGradient id="g"/><rect width="50" height="50" fill="url(#g)"/>', "gradient"),
        (
            '<foreignObject width="50" height="50"><p xmlns="http://www.w3.org/1999/xhtml">x</p></foreignObject>',
            "foreignObject",
        ),
        ('<text y="40">hello</text>', "<text>"),
        ('<mask id="m"><rect width="9" height="9"/></mask><rect width="50" height="50" mask="url(#m)"/>', "`mask`"),
        ('<style>g > rect {fill:red}</style><rect width="50" height="50"/>', "selector"),
        ('<style>@media print {rect{fill:red}}</style><rect width="50" height="50"/>', "style sheet"),
        (
            '<marker id="m"><path d="M0 0L9 9"/></marker><path d="M0 0L50 50" stroke="red" marker-end="url(#m)"/>',
            "marker",
        ),
        ('<path d="M0 0L50 50 fifty" stroke="red"/>', "not understood"),
        ('<rect width="50%" height="50"/>', "not understood"),
        ('<rect width="50" height="50" transform="rotate(a)"/>', "transform"),
        ('<rect width="50" height="50" fill="hsl(9,9%,9%)"/>', "colour"),
    ],
)
def test_what_outlines_cannot_show_is_pixels_and_told(inside: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "a.svg").write_text(f'{HEAD} width="60" height="60"><circle r="20"/>{inside}</svg>', encoding="utf-8")
    found = outlines(str(tmp_path / "a.svg"), "d", 3)
    assert found.text == ""
    assert reason in found.reason


def _film(folder: Path, drawing_text: str) -> mv.Motion:
    (folder / "a.svg").write_text(drawing_text, encoding="utf-8")
    script = folder / "film.mov"
    script.write_text(
        ".config(10, 400, 300); W : 'a.svg#wheel' C = [64,94] P = C + [40,0]; B : 'a.svg' C = [0,0] .scale(0.7);\n"
        "F : 'a.svg' C = [0,0] .scale(0.5) .opacity(0.5);\n"
        "@0 W.C = [120,180]; W.angle = 50*.t; B.C = [200,150]; B.red = 255 - 200*.t; F.C = [10,10];\n"
        "F.angle = 10*.t; @1",
        encoding="utf-8",
    )
    return mv.load(script).solve()


@pytest.mark.slow
def test_films_show_outlines_everywhere(page: Any, tmp_path: Path) -> None:
    motion = _film(tmp_path, f'{HEAD} width="240" height="160">{SHAPES}</svg>')
    for name in ("film.svg", "film.html", "film.pdf"):
        motion.render(tmp_path / name)
        assert b"image/png" not in (tmp_path / name).read_bytes()
    assert b"/Subtype /Image" not in (tmp_path / "film.pdf").read_bytes()
    pages: list[Path] = []
    if (tool := shutil.which("pdftoppm")) is not None:
        subprocess.run([tool, "-r", "96", "-png", tmp_path / "film.pdf", tmp_path / "page"], check=True)
        pages = sorted(tmp_path.glob("page-*.png"))
    for frame in (0, 7):
        motion.render(tmp_path / "one.png", frames=frame)
        with Image.open(tmp_path / "one.png") as opened:
            picture = opened.convert("RGB")
        page.goto((tmp_path / "film.svg").as_uri())
        shots = [shot_of_svg(page, frame / motion.timeline.fps, picture.size)]
        page.goto((tmp_path / "film.html").as_uri())
        shots.append(shot_of_page(page, frame, picture.size))
        for shot in (*shots, *(Image.open(each) for each in pages[frame : frame + 1])):
            worst, edges = unlike(shot.convert("RGB").crop((0, 0, *picture.size)), picture)
            assert (worst <= 128, edges <= 0.25) == (True, True), (frame, worst, edges)
    if (tool := shutil.which("rsvg-convert")) is not None:
        motion.render(tmp_path / "still.svg", frames=0)
        subprocess.run([tool, tmp_path / "still.svg", "-o", tmp_path / "r.png"], check=True)
        motion.render(tmp_path / "one.png", frames=0)
        with Image.open(tmp_path / "r.png") as one, Image.open(tmp_path / "one.png") as other:
            worst, edges = unlike(one.convert("RGB"), other.convert("RGB"))
        assert (worst <= 128, edges <= 0.25) == (True, True), (worst, edges)


def test_nothing_of_a_hostile_drawing_gets_through(tmp_path: Path) -> None:
    hostile = (
        "<a href=\"javascript:alert(1)\"><circle id=\"film\" class='x\"&lt;' cx='80' cy='80' r='30' data-x='evil' "
        "xmlns:h='urn:evil' h:evil='evil' fill='red'/></a><title>evil</title><metadata>evil</metadata>"
        "<g id='wheel' aria-label='evil' role='evil' style='fill:blue;evil:url(#film)'>"
        "<rect id='still' width='50' height='50'/>"
        "<set attributeName='href' to='javascript:evil'/></g><evil:thing xmlns:evil='urn:evil'/>"
    )
    motion = _film(tmp_path, f'{HEAD} width="240" height="160">{hostile}</svg>')
    for name in ("film.svg", "film.html"):
        motion.render(tmp_path / name)
    text = (tmp_path / "film.svg").read_text(encoding="utf-8")
    assert "image/png" not in text
    assert "evil" not in text
    assert "javascript" not in text
    names = re.findall(r'\bid="([^"]*)"', text)
    assert len(set(names)) == len(names)


def test_a_drawing_that_becomes_pixels_is_told(tmp_path: Path) -> None:
    text = '<text y="40">hello</text><g id="wheel"><rect width="50" height="50"/></g>'
    motion = _film(tmp_path, f'{HEAD} width="60" height="60">{text}</svg>')
    for suffix in ("svg", "html", "pdf"):
        report = motion.render(tmp_path / f"film.{suffix}")
        told = [item for item in report.diagnostics if item.code == "asset/raster"]
        assert [item.severity.value for item in told] == ["note"]
        assert "<text>" in told[0].message
    report = motion.render(tmp_path / "film.gif")
    assert [item.code for item in report.diagnostics if item.code == "asset/raster"] == []
