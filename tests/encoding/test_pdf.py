"""PDFs of films, read by Poppler and qpdf."""

from __future__ import annotations

import re
import shutil
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import movimentum as mv

SCRIPT = """.config(10, 200, 120);
Crank : .bar O = [0,0] P = [40,0] .color('firebrick') .width(8);
Box   : 'box.png' C = [0,0] .scale(2);
Seen  : .label('θ = {Crank.angle:.0f}° — grün') at = [10,100];
Ghost : .disc(15) C = [0,0] .opacity(0.5);
Path  : .trace Crank.P .tail(1);
@0 Crank.O = [60,60]; Crank.angle = 90*.t; Box.C = [140,20]; Box.angle = 20*.t; Ghost.C = [60,60]; Box.opacity = 0.8;
@2
"""


def tool(name: str, *arguments: str | Path) -> str:
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not here")
    done = subprocess.run([name, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pdf")
    picture = Image.new("RGBA", (30, 20), (20, 90, 200, 255))
    picture.paste((0, 0, 0, 0), (10, 5, 20, 15))
    picture.save(folder / "box.png")
    (folder / "film.mov").write_text(SCRIPT, encoding="utf-8")
    motion = mv.load(folder / "film.mov").solve()
    motion.render(folder / "film.pdf")
    motion.render(folder / "again.pdf")
    motion.render(folder / "png-%02d.png")
    motion.render(folder / "still.pdf", at="1/3", transparent=True)
    return folder


def test_it_is_sound_has_a_page_a_frame_and_the_exact_size(film: Path) -> None:
    tool("qpdf", "--check", film / "film.pdf")
    about = tool("pdfinfo", film / "film.pdf")
    assert re.search(r"Pages: +21\n", about)
    assert re.search(r"Page size: +150 x 90 pts", about)
    assert "Title:           film" in about
    assert "Date" not in about
    assert re.search(r"Pages: +1\n", tool("pdfinfo", film / "still.pdf"))


def test_the_same_film_gives_the_same_bytes_and_shares_what_pages_have_in_common(film: Path) -> None:
    data = (film / "film.pdf").read_bytes()
    assert data == (film / "again.pdf").read_bytes()
    assert data.count(b"/Subtype /Image") == 2  # the picture and its mask
    assert len(data) < 21 * 2000


@pytest.mark.slow
def test_texts_are_texts_with_their_numbers_and_characters(film: Path) -> None:
    pages = tool("pdftotext", film / "film.pdf", "-").split("\f")
    assert [page.split("\n")[0] for page in pages[:21]] == [f"θ = {9 * k}° — grün" for k in range(21)]


@pytest.mark.slow
def test_pages_look_like_the_frames(film: Path) -> None:
    tool("pdftoppm", "-r", "384", "-png", film / "film.pdf", film / "page")
    for k in (0, 7, 20):
        page = Image.open(film / f"page-{k + 1:02d}.png").convert("RGB").reduce(4)
        frame = Image.open(film / f"png-{k:02d}.png").convert("RGB")
        assert page.size == frame.size
        off = np.abs(np.asarray(page, float) - np.asarray(frame, float)).max(axis=-1)
        assert off[:, :100].mean() < 2.0
        assert np.percentile(off[:, :100], 99) < 60
        assert off.mean() < 4.0  # Poppler makes pictures up to a pixel larger


def test_the_operators_have_no_exponents(film: Path) -> None:
    data = (film / "film.pdf").read_bytes()
    streams = re.findall(rb"<< +/Filter /FlateDecode[^>]*>>\nstream\n(.*?)\nendstream", data, re.DOTALL)
    drawn = [zlib.decompress(stream) for stream in streams]
    assert len(drawn) >= 21
    assert not any(re.search(rb"\d[eE][-+]?\d|nan|inf", each) for each in drawn)
