"""The compressed pixels of a GIF, as Pillow decodes them, and how many there are."""

import io
import shutil
import struct
import subprocess

import numpy as np
import pytest
from PIL import Image

from movimentum.encoding.lzw import image_block
from tests.command import ROOT, movimentum

SCRIPTS = sorted(path.name for path in (ROOT / "scripts").glob("*.mov"))


def decoded(block, width, height):
    grey = bytes(value for k in range(256) for value in (k, k, k))
    image = struct.pack("<BHHHHB", 0x2C, 0, 0, width, height, 0)
    data = b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0) + grey + image + block + b";"
    return np.asarray(Image.open(io.BytesIO(data)).convert("L"))


def pictures(bits, size, rng):
    """Noise, and noise with more and more that is alike: a table of strings lasts shorter or longer."""
    noise = rng.integers(0, 1 << bits, (size, size)).astype(np.uint8)
    yield noise
    for step in (2, 5, 9):
        yield np.repeat(np.repeat(noise[::step, ::step], step, 0), step, 1)[:size, :size].copy()
    for share in (0.5, 0.9, 0.99):
        yield np.where(rng.random((size, size)) < share, 0, noise).astype(np.uint8)


@pytest.mark.parametrize("bits", range(1, 9))
@pytest.mark.parametrize("size", [1, 2, 7, 61, 62, 63, 90, 150, 260])
def test_the_pixels_are_the_same(bits, size):
    rng = np.random.default_rng(100 * size + bits)
    for picture in pictures(bits, size, rng):
        block = image_block([picture])
        assert block[0] == max(2, int(picture.max()).bit_length())
        assert (decoded(block, size, size) == picture).all()


def test_the_shortest_of_several_is_taken():
    rng = np.random.default_rng(1)
    long, short = rng.integers(0, 256, (50, 50)).astype(np.uint8), np.zeros((50, 50), dtype=np.uint8)
    assert image_block([long, short]) == image_block([short])


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gifsicle") is None, reason="needs gifsicle")
@pytest.mark.parametrize("script", SCRIPTS)
def test_no_larger_than_gifsicle_makes_it(script, tmp_path):
    ours, theirs = tmp_path / "ours.gif", tmp_path / "theirs.gif"
    done = movimentum("run", str(ROOT / "scripts" / script), "-o", str(ours), "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    subprocess.run(["gifsicle", "-O3", ours, "-o", theirs], check=True, capture_output=True)
    assert ours.stat().st_size <= theirs.stat().st_size
