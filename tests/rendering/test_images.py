"""Image files of all kinds, and files that are none: refused before they cost anything."""

import os
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from movimentum.diagnostics import Diagnostic
from movimentum.errors import ScriptError
from movimentum.rendering.images import image_size, load_rgba
from movimentum.rendering.painter import make_painter
from movimentum.source import Span
from tests.rendering.scenes import pixels, poses, scene, thing

HERE = Span(3, 9)


def bomb(path, width=60000, height=60000):
    """A PNG whose header promises far more pixels than its few bytes hold."""
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(bytes(1000))), (b"IEND", b"")]
    packed = b"".join(struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + packed)
    return str(path)


def code_of(path):
    found = image_size(str(path), HERE)
    assert isinstance(found, Diagnostic)
    assert found.span == HERE
    with pytest.raises(ScriptError) as caught:
        load_rgba(str(path), HERE)
    assert caught.value.diagnostics[0].code == found.code
    return found.code


def test_what_is_refused(tmp_path):
    assert code_of(tmp_path / "none.png") == "asset/missing"
    assert code_of(tmp_path) == "asset/unreadable"
    assert code_of(bomb(tmp_path / "bomb.png")) == "limit/pixels"
    assert code_of(bomb(tmp_path / "wide.png", 100_000_000, 3)) == "limit/pixels"
    assert code_of(bomb(tmp_path / "just_over.png", 8001, 8001)) == "limit/pixels"
    (tmp_path / "text.png").write_text("hello")
    assert code_of(tmp_path / "text.png") == "asset/unreadable"
    (tmp_path / "empty.png").write_bytes(b"")
    assert code_of(tmp_path / "empty.png") == "asset/unreadable"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    assert code_of(tmp_path / "pipe.png") == "asset/unreadable"


@pytest.mark.parametrize("suffix", ["png", "jpg", "gif", "webp", "bmp", "tiff"])
def test_truncated_files(tmp_path, suffix):
    rng = np.random.default_rng(2)
    whole = tmp_path / f"w.{suffix}"
    Image.fromarray(rng.integers(0, 256, (90, 70, 3), dtype=np.uint8)).save(whole)
    cut = tmp_path / f"c.{suffix}"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with pytest.raises(ScriptError) as caught:
        load_rgba(str(cut), HERE)
    assert caught.value.diagnostics[0].code == "asset/unreadable"


def test_all_bad_sprites_are_told_at_once(tmp_path):
    bad = scene(
        thing("sprite", image=str(tmp_path / "none.png")),
        thing("sprite", image=str(tmp_path)),
        thing("sprite", image=bomb(tmp_path / "b.png")),
    )
    with pytest.raises(ScriptError) as caught:
        make_painter(bad, poses([0, 0, 0], [0, 0, 0], [0, 0, 0]))
    assert [item.code for item in caught.value.diagnostics] == ["asset/missing", "asset/unreadable", "limit/pixels"]


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("suffix", ["jpg", "png", "tiff", "webp"])
def test_orientation_is_obeyed(tmp_path, orientation, suffix):
    # stored so that, turned as the tag says, the upper-left quarter is red, the upper-right green
    upright = Image.new("RGB", (48, 32), (0, 0, 0))
    upright.paste((255, 0, 0), (0, 0, 24, 16))
    upright.paste((0, 255, 0), (24, 0, 48, 16))
    undo = {
        1: None,
        2: Image.Transpose.FLIP_LEFT_RIGHT,
        3: Image.Transpose.ROTATE_180,
        4: Image.Transpose.FLIP_TOP_BOTTOM,
        5: Image.Transpose.TRANSPOSE,
        6: Image.Transpose.ROTATE_90,
        7: Image.Transpose.TRANSVERSE,
        8: Image.Transpose.ROTATE_270,
    }[orientation]
    stored = upright if undo is None else upright.transpose(undo)
    exif = Image.Exif()
    exif[0x0112] = orientation
    path = str(tmp_path / f"o.{suffix}")
    options = {"jpg": {"quality": 95}, "webp": {"lossless": True}}.get(suffix, {})
    stored.save(path, exif=exif, **options)
    assert image_size(path) == (48, 32)
    image = pixels(load_rgba(path))
    assert image.shape == (32, 48, 4)
    assert abs(image[4, 4] - (255, 0, 0, 255)).max() < 12
    assert abs(image[4, 43] - (0, 255, 0, 255)).max() < 12


def test_modes(tmp_path):
    gradient = np.tile(np.linspace(0, 65535, 64).astype(np.uint16), (8, 1))
    Image.fromarray(gradient).save(tmp_path / "16.png")
    assert abs(pixels(load_rgba(str(tmp_path / "16.png")))[0, :, 0] - gradient[0] / 257).max() <= 0.5
    Image.fromarray(gradient).save(tmp_path / "16.tiff")
    assert abs(pixels(load_rgba(str(tmp_path / "16.tiff")))[0, :, 1] - gradient[0] / 257).max() <= 0.5

    palette = Image.new("P", (10, 10), 1)
    palette.putpalette([0, 0, 0, 250, 120, 30])
    palette.paste(0, (0, 0, 5, 10))
    palette.save(tmp_path / "p.png", transparency=0)
    image = pixels(load_rgba(str(tmp_path / "p.png")))
    assert image[2, 2, 3] == 0
    assert tuple(image[2, 7]) == (250, 120, 30, 255)

    Image.new("CMYK", (10, 10), (0, 255, 255, 0)).save(tmp_path / "c.jpg", quality=95)
    assert abs(pixels(load_rgba(str(tmp_path / "c.jpg")))[5, 5] - (255, 0, 0, 255)).max() < 12

    Image.new("LA", (10, 10), (77, 128)).save(tmp_path / "la.png")
    assert tuple(pixels(load_rgba(str(tmp_path / "la.png")))[5, 5]) == (77, 77, 77, 128)
    Image.new("1", (10, 10), 1).save(tmp_path / "1.png")
    assert tuple(pixels(load_rgba(str(tmp_path / "1.png")))[5, 5]) == (255, 255, 255, 255)
    Image.new("L", (10, 10), 90).save(tmp_path / "l.png", transparency=90)
    assert pixels(load_rgba(str(tmp_path / "l.png")))[5, 5, 3] == 0


def test_of_an_animated_file_the_first_picture(tmp_path):
    frames = [Image.new("RGB", (12, 12), color) for color in ((255, 0, 0), (0, 0, 255))]
    for suffix in ("gif", "png", "webp"):
        path = tmp_path / f"a.{suffix}"
        options = {"lossless": True} if suffix == "webp" else {}
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=100, **options)
        assert image_size(str(path)) == (12, 12)
        assert abs(pixels(load_rgba(str(path)))[5, 5] - (255, 0, 0, 255)).max() <= 1


def test_size_needs_only_the_header(tmp_path):
    Image.fromarray(np.random.default_rng(3).integers(0, 256, (300, 400, 3), dtype=np.uint8)).save(tmp_path / "w.png")
    cut = tmp_path / "cut.png"
    cut.write_bytes((tmp_path / "w.png").read_bytes()[:200])
    assert image_size(str(cut)) == (400, 300)
