"""What others make of our SVGs: librsvg, resvg, xmllint (and CairoSVG), compared with our own pixels."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image

import movimentum as mv
from movimentum.vector.numbers import joined
from tests.broad import broad
from tests.command import ROOT
from tests.drawing.films import everything
from tests.drawing.likeness import LETTERED, LETTERS, Tolerance, unlike

FINE = 4
"""Drawings are read so many times as large, and averaged: at their own size, resvg draws thin circles a tenth too dark.
Pictures are read as they are, for readers differ in how they make one larger.
"""


def _librsvg(path: Path, fine: int) -> bytes:
    if shutil.which("rsvg-convert") is None:
        pytest.skip("rsvg-convert is not installed")
    return subprocess.run(["rsvg-convert", "-z", str(fine), path], capture_output=True, check=True, timeout=60).stdout


def _resvg(path: Path, fine: int) -> bytes:
    resvg = pytest.importorskip("resvg_py")
    return bytes(resvg.svg_to_bytes(svg_string=path.read_text(encoding="utf-8"), zoom=fine))


def _cairosvg(path: Path, fine: int) -> bytes:
    cairosvg = pytest.importorskip("cairosvg")
    return cairosvg.svg2png(url=str(path), scale=fine)


EDGES = Tolerance(96, 0.05)
"""Where the letters of dimensions differ, the lines do by 0.02."""

READERS = {"librsvg": _librsvg, "resvg": _resvg, "cairosvg": _cairosvg}
SCRIPTS = ("four-bar", "locomotive", "planetary", "scissor-lift", "excavator")


def _same(script: Path, reader: Callable[[Path, int], bytes], folder: Path) -> None:
    motion = mv.load(script).solve()
    motion.render(folder / "a.svg")
    motion.render(folder / "a.png", frames=0)
    fine = 1 if "<image" in (folder / "a.svg").read_text(encoding="utf-8") else FINE
    image = Image.open(io.BytesIO(reader(folder / "a.svg", fine))).convert("RGBA").reduce(fine)
    read = Image.new("RGB", image.size, "white")
    read.paste(image, (0, 0), image)
    text = script.read_text(encoding="utf-8")
    like = LETTERS if any(word in text for word in LETTERED if word != ".dimension") else EDGES
    worst, edges = unlike(read, Image.open(folder / "a.png"))
    assert (worst <= like.worst, edges <= like.edges) == (True, True), (worst, edges)


@broad("reader", READERS, first=2)
@broad("name", SCRIPTS, first=1)
def test_other_readers_see_the_first_frame(name: str, reader: str, tmp_path: Path) -> None:
    _same(ROOT / "scripts" / f"{name}.mov", READERS[reader], tmp_path)


@broad("reader", READERS, first=2)
def test_other_readers_see_everything(reader: str, tmp_path: Path) -> None:
    _same(everything(tmp_path), READERS[reader], tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("script", sorted((ROOT / "scripts").glob("*.mov")), ids=lambda path: path.stem)
def test_other_readers_see_the_gallery(script: Path, reader: str, tmp_path: Path) -> None:
    _same(script, READERS[reader], tmp_path)


def test_numbers_have_separators(tmp_path: Path) -> None:
    assert joined(1.0, -2.0, -0.5, 0.0, decimals=2) == "1 -2 -.5 0"
    mv.load(everything(tmp_path)).solve().render(tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    lists = re.findall(r'(?:points|values|transform|stroke-dasharray)="([^"#]*)"', text)
    assert len(lists) > 30
    assert [part for part in lists if re.search(r"\d-|\.\d*\.", part)] == []


def test_the_file_is_well_formed(tmp_path: Path) -> None:
    if shutil.which("xmllint") is None:
        pytest.skip("xmllint is not installed")
    mv.load(everything(tmp_path)).solve().render(tmp_path / "a.svg")
    subprocess.run(["xmllint", "--noout", tmp_path / "a.svg"], check=True, timeout=60)


def test_a_film_has_a_description_and_stands_still_for_who_wants_that(tmp_path: Path) -> None:
    motion = mv.load(ROOT / "scripts" / "four-bar.mov").solve()
    motion.render(tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert re.search(r"<desc>A film of [^<]*Crank[^<]*: 2 s, again and again\.</desc>", text)
    assert "@media (prefers-reduced-motion:reduce){#film{display:none}#still{display:inline}}" in text
    still = text[text.index('<g id="still" display="none"') :]
    assert "<animate" not in still
    ids = re.findall(r' id="([^"]*)"', text)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'href="#([^"]*)"', text)) <= set(ids)
    motion.render(tmp_path / "b.svg", frames="0:1")
    one = (tmp_path / "b.svg").read_text(encoding="utf-8")
    assert "<desc>A drawing of " in one
    assert "<style" not in one
    assert sys.getsizeof(one) < sys.getsizeof(text)
