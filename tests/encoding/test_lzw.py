"""The compressed pixels of a GIF, as Pillow decodes them, and how many there are."""

import io
import shutil
import struct
import subprocess

import numpy as np
import pytest
from PIL import Image

from movimentum.encoding.gif import Ways, written
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
        block = image_block(picture)
        assert block[0] == max(2, int(picture.max()).bit_length())
        assert (decoded(block, size, size) == picture).all()


def frames_of(kind, rng):
    """Indices of frames, one after the other."""
    ground = rng.integers(1, 200, (120, 160)).astype(np.uint8) if kind == "photo" else np.full((120, 160), 9, np.uint8)
    for k in range(12):
        frame = ground.copy()
        frame[20 + k : 60 + k, 3 * k : 3 * k + 50] = np.arange(1, 51, dtype=np.uint8)
        yield frame


@pytest.mark.parametrize("kind", ["flat", "photo"])
def test_what_is_not_changed_is_clear_or_as_it_was_and_the_way_is_about_the_shortest(kind):
    """Laid over the frame before, the pixels are those of the frame; frames between trials are near the best way."""
    ways, length, best = Ways(), 0, 0
    before = None
    for frame in frames_of(kind, np.random.default_rng(3)):
        if before is not None:
            changed = frame != before
            block = ways.shortest(frame, changed)
            shown = decoded(block, 160, 120)
            assert (np.where(shown == 0, before, shown) == frame).all()
            length += len(block)
            best += min(len(image_block(written(frame, changed, way))) for way in range(5))
        before = frame
    assert length <= 1.01 * best


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gifsicle") is None, reason="needs gifsicle")
@pytest.mark.parametrize("script", SCRIPTS)
def test_gifsicle_makes_it_hardly_smaller(script, tmp_path):
    """It keeps tables of strings that are full, which takes it as long as drawing takes us."""
    ours, theirs = tmp_path / "ours.gif", tmp_path / "theirs.gif"
    done = movimentum("run", str(ROOT / "scripts" / script), "-o", str(ours), "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    subprocess.run(["gifsicle", "-O3", ours, "-o", theirs], check=True, capture_output=True)
    assert ours.stat().st_size <= 1.1 * theirs.stat().st_size
