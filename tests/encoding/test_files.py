"""Files as independent decoders see them: pixels, times, loops."""

import io
import os
import struct
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

import movimentum as mv
from movimentum.drawing.picture_options import PictureOptions
from movimentum.encoding.palette import Mapper, Samples, choose_palette
from movimentum.encoding.tints import tints
from movimentum.encoding.write import check_output, write_animation
from movimentum.errors import UsageError
from movimentum.rendering.painter import PaintSession, make_painter
from tests.encoding.films import FPS, bars_only, composed, moving
from tests.rendering.scenes import pixels, poses, scene, thing


def shown_frames(path, mode="RGB"):
    """[(pixels, duration in ms)] of every frame that a decoder finds."""
    with Image.open(path) as image:
        return [(pixels(frame.convert(mode)), frame.info.get("duration")) for frame in ImageSequence.Iterator(image)]


def gif_delays(path):
    """The delays in the file, in 1/100 s, read without any library."""
    data = path.read_bytes()
    at = 13 + (3 << (data[10] & 7) + 1)
    delays = []
    while data[at] != 0x3B:
        if data[at] == 0x21:
            if data[at + 1] == 0xF9:
                delays.append(struct.unpack_from("<H", data, at + 4)[0])
            at += 2
        else:
            at += 11
        while data[at]:
            at += data[at] + 1
        at += 1
    return delays


# --- GIF ----------------------------------------------------------------------------------------------------------


def test_gif_frames_are_the_composed_ones_in_the_palettes_colours(tmp_path):
    made, where = moving(tmp_path)
    painter = make_painter(made, where)
    images = [image.copy() for image in PaintSession(painter).frames(where)]
    known = tints(painter, where, 40)
    palette = choose_palette(Samples.of([images[k] for k in known.positions]), known.colors, painter.background)
    mapper, table = Mapper(palette), np.frombuffer(palette.table(), np.uint8).reshape(-1, 3).astype(int)
    write_animation(painter, where, tmp_path / "o.gif", fps=FPS, workers=1)
    decoded = shown_frames(tmp_path / "o.gif")
    expected = []
    for image in images:
        mapped = table[mapper.indices(image)]
        assert np.sqrt(((mapped - pixels(image)) ** 2).mean()) < 2.0
        if not expected or (mapped != expected[-1]).any():
            expected.append(mapped)
    assert len(decoded) == len(expected) == 40 - 6 - 4  # those alike are one longer frame
    assert all((ours == theirs).all() for (ours, _), theirs in zip(decoded, expected, strict=True))
    assert sum(duration for _, duration in decoded) == 1600
    assert decoded[5][1] == 7 * 40


def test_few_colours_are_exact(tmp_path):
    made, where = bars_only()
    painter = make_painter(made, where)
    write_animation(painter, where, tmp_path / "o.gif", fps=FPS)
    truth = composed(painter, where)
    sampled = {k * 12 // 8 for k in range(8)}
    for k, (image, _) in enumerate(shown_frames(tmp_path / "o.gif")):
        if k in sampled:
            assert (image == truth[k]).all()
        assert abs(image - truth[k]).max() <= 3


def test_the_background_is_exact_among_many_colours(tmp_path):
    rng = np.random.default_rng(5)
    Image.fromarray(rng.integers(0, 256, (60, 90, 3), dtype=np.uint8)).save(tmp_path / "noise.png")
    made = scene(thing("sprite", image=str(tmp_path / "noise.png")), background=(251, 250, 244))
    where = poses([[5, 5 + k, 0] for k in range(4)])
    write_animation(make_painter(made, where), where, tmp_path / "o.gif", fps=FPS)
    assert all((image[0, 0] == (251, 250, 244)).all() for image, _ in shown_frames(tmp_path / "o.gif"))


def test_the_nearest_colour_is_chosen(tmp_path):
    rng = np.random.default_rng(6)
    picture = Image.fromarray(rng.integers(0, 256, (80, 80, 3), dtype=np.uint8))
    palette = choose_palette(Samples.of([picture]))
    assert len(palette.colors) <= 255
    mapped = palette.colors[Mapper(palette).indices(picture) - 1].astype(int)
    error = ((mapped - pixels(picture)) ** 2).sum(axis=-1)
    best = ((palette.colors[None].astype(int) - pixels(picture).reshape(-1, 1, 3)) ** 2).sum(axis=-1).min(axis=1)
    # no worse than the nearest by what rounding to 6 bits can do
    assert (np.sqrt(error.ravel()) <= np.sqrt(best) + 2 * np.sqrt(3 * 4)).all()
    assert np.sqrt(error.mean()) < 1.15 * np.sqrt(best.mean())


@pytest.mark.parametrize(
    "fps",
    [Fraction(12), Fraction(24000, 1001), Fraction(30), Fraction(50), Fraction(60), Fraction(100), Fraction(7, 3)],
)
def test_gif_times(tmp_path, fps):
    frames = 61
    made, where = bars_only(frames)
    report = write_animation(make_painter(made, where), where, tmp_path / "o.gif", fps=fps)
    delays = gif_delays(tmp_path / "o.gif")
    assert min(delays) >= 2
    assert sum(delays) == round(100 * frames / fps)
    assert report.duration == Fraction(sum(delays), 100)
    if fps <= 50:
        assert len(delays) == report.frames == frames
        ends = np.cumsum(delays)
        assert all(end == round(100 * (k + 1) / fps) for k, end in enumerate(ends.tolist()))
        assert not report.diagnostics
    else:
        assert len(delays) == report.frames == int(frames / fps * 50)
        assert [item.code for item in report.diagnostics] == ["render/gif-rate"]


def test_a_rest_longer_than_a_delay_can_say(tmp_path):
    made, where = bars_only(3)
    still = where.select(np.array([0, 0, 0, 1, 2]))
    write_animation(make_painter(made, still), still, tmp_path / "o.gif", fps=Fraction(1, 300))
    delays = gif_delays(tmp_path / "o.gif")
    assert sum(delays) == 150000
    assert max(delays) <= 65535
    write_animation(make_painter(made, still), still, tmp_path / "o.apng", fps=Fraction(1, 300))
    assert sum(duration for _, duration in shown_frames(tmp_path / "o.apng")) == 1_500_000


@pytest.mark.parametrize(("loop", "stored"), [(0, 0), (1, None), (3, 2)])
def test_gif_loops(tmp_path, loop, stored):
    made, where = bars_only(3)
    write_animation(make_painter(made, where), where, tmp_path / "o.gif", fps=FPS, loop=loop)
    with Image.open(tmp_path / "o.gif") as image:
        assert image.info.get("loop") == stored


def test_transparent_gif(tmp_path):
    made, where = moving(tmp_path)
    painter = make_painter(made, where, PictureOptions(transparent=True))
    write_animation(painter, where, tmp_path / "o.gif", fps=FPS)
    truth = []
    for image in composed(painter, where):
        if not truth or (image != truth[-1]).any():
            truth.append(image)
    decoded = shown_frames(tmp_path / "o.gif", "RGBA")
    assert len(decoded) == len(truth)
    for (ours, _), theirs in zip(decoded, truth, strict=True):
        opaque = theirs[..., 3] >= 128
        assert ((ours[..., 3] == 255) == opaque).all()
        assert (ours[..., 3][~opaque] == 0).all()  # nothing of the frames before shines through
        assert abs(ours - theirs)[opaque][:, :3].max() <= 24
    assert sum(duration for _, duration in decoded) == 1600


# --- APNG, WebP ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize("suffix", ["apng", "webp"])
def test_lossless_formats_are_pixel_identical(tmp_path, suffix, transparent):
    made, where = moving(tmp_path)
    painter = make_painter(made, where, PictureOptions(transparent=transparent))
    path = tmp_path / f"o.{suffix}"
    write_animation(painter, where, path, fps=Fraction(24000, 1001), loop=4)
    truth = []
    for image in composed(painter, where):
        if not truth or (image != truth[-1]).any():
            truth.append(image)
    decoded = shown_frames(path, painter.mode)
    assert len(decoded) == len(truth)
    for (ours, _), theirs in zip(decoded, truth, strict=True):
        if transparent:  # under alpha 0 a colour means nothing
            ours, theirs = ours * (ours[..., 3:] > 0), theirs * (theirs[..., 3:] > 0)
        assert (ours == theirs).all()
    assert sum(duration for _, duration in decoded) == pytest.approx(40 * 1001 / 24, abs=1)
    with Image.open(path) as image:
        assert image.info["loop"] == 4


def apng_delays(path):
    data, at, delays = path.read_bytes(), 8, []
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        if data[at + 4 : at + 8] == b"fcTL":
            delays.append(Fraction(*struct.unpack_from(">HH", data, at + 8 + 20)))
        at += 12 + length
    return delays


@pytest.mark.parametrize(
    "fps", [Fraction(12), Fraction(24000, 1001), Fraction(30), Fraction(60), Fraction(100001, 997)]
)
def test_apng_times_are_exact(tmp_path, fps):
    made, where = bars_only(50)
    write_animation(make_painter(made, where), where, tmp_path / "o.apng", fps=fps)
    delays = apng_delays(tmp_path / "o.apng")
    if fps.numerator < 65536:
        assert sum(delays) == 50 / fps
    else:
        assert abs(sum(delays) - 50 / fps) <= Fraction(1, 1000)


def test_webp_times(tmp_path):
    made, where = bars_only(50)
    write_animation(make_painter(made, where), where, tmp_path / "o.webp", fps=Fraction(60))
    durations = [duration for _, duration in shown_frames(tmp_path / "o.webp")]
    assert sum(durations) == round(50 * 1000 / 60)
    assert set(durations) == {16, 17}


# --- PNG ----------------------------------------------------------------------------------------------------------


def test_a_still(tmp_path):
    made, where = bars_only(1)
    painter = make_painter(made, where)
    report = write_animation(painter, where, tmp_path / "o.png", fps=FPS)
    assert report.files == (tmp_path / "o.png",)
    with Image.open(tmp_path / "o.png") as image:
        assert (pixels(image) == pixels(painter.frame(where, 0))).all()


@pytest.mark.parametrize(("pattern", "first"), [("f%d.png", "f100.png"), ("f-%04d.png", "f-0100.png")])
def test_a_sequence(tmp_path, pattern, first):
    made, where = moving(tmp_path)
    painter = make_painter(made, where)
    where.frames[:] += 100
    folder = tmp_path / "out"
    folder.mkdir()
    report = write_animation(painter, where, folder / pattern, fps=FPS, workers=2)
    assert report.files[0] == folder / first
    assert sorted(os.listdir(folder)) == sorted(pattern % k for k in range(100, 140))
    for k, truth in enumerate(composed(painter, where)):
        with Image.open(folder / (pattern % (100 + k))) as image:
            assert (pixels(image) == truth).all()


# --- JPEG ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["o.jpg", "o.jpeg", "o.JPG"])
def test_a_jpeg_still_is_near_the_composed_picture(tmp_path, name):
    made, where = moving(tmp_path, frames=1, rest=False, size=(120, 90))
    painter = make_painter(made, where, PictureOptions(background=(250, 240, 200)))
    report = write_animation(painter, where, tmp_path / name, fps=FPS)
    assert report.files == (tmp_path / name,)
    with Image.open(tmp_path / name) as image:
        assert (image.format, image.mode, image.size) == ("JPEG", "RGB", painter.size)
        apart = np.abs(pixels(image).astype(int) - pixels(painter.frame(where, 0)))
    assert apart.mean() < 1.0  # measured 0.24
    assert (apart[0, 0] <= 2).all()  # what is clear is the background


@pytest.mark.parametrize(("pattern", "first"), [("f%d.jpg", "f100.jpg"), ("f-%04d.jpeg", "f-0100.jpeg")])
def test_a_jpeg_sequence_is_the_same_for_any_number_of_workers(tmp_path, pattern, first):
    made, where = moving(tmp_path)
    painter = make_painter(made, where)
    where.frames[:] += 100
    data = []
    for workers in (1, 2):
        folder = tmp_path / f"out{workers}"
        folder.mkdir()
        report = write_animation(painter, where, folder / pattern, fps=FPS, workers=workers)
        assert report.files[0] == folder / first
        assert sorted(os.listdir(folder)) == sorted(pattern % k for k in range(100, 140))
        data.append([file.read_bytes() for file in report.files])
    assert data[0] == data[1]
    for code, truth in zip(data[0], composed(painter, where), strict=True):
        with Image.open(io.BytesIO(code)) as image:
            assert np.abs(pixels(image).astype(int) - truth).mean() < 1.0


def test_a_jpeg_is_never_transparent(tmp_path):
    made, where = bars_only(1)
    painter = make_painter(made, where, PictureOptions(transparent=True))
    for name, other in (("o.jpg", "o.png"), ("f%04d.jpeg", "f%04d.png")):
        with pytest.raises(UsageError) as caught:
            write_animation(painter, where, tmp_path / name, fps=FPS)
        (found,) = caught.value.diagnostics
        assert (found.code, found.helps) == ("output/opaque", (f"-o {tmp_path / other}",))
    assert os.listdir(tmp_path) == []


# --- video --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["mp4", "webm"])
@pytest.mark.parametrize("fps", [Fraction(25), Fraction(24000, 1001)])
def test_video(tmp_path, suffix, fps):
    av = pytest.importorskip("av")
    made, where = moving(tmp_path, size=(101, 79))
    painter = make_painter(made, where)
    path = tmp_path / f"o.{suffix}"
    write_animation(painter, where, path, fps=fps)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == (102, 80)
        frames = list(container.decode(video=0))
        slack = 0 if suffix == "mp4" else Fraction(1, 1000)
        assert all(abs(frame.pts * frame.time_base - k / fps) <= slack for k, frame in enumerate(frames))
        assert container.duration / 1e6 == pytest.approx(float(40 / fps), abs=0.002)
    truth = composed(painter, where)
    assert len(frames) == len(truth)
    for frame, theirs in zip(frames[::7], truth[::7], strict=True):
        assert abs(frame.to_ndarray(format="rgb24").astype(int)[:79, :101] - theirs).mean() < 4


@pytest.mark.parametrize("suffix", ["mp4", "webm"])
@pytest.mark.parametrize("size", [(160, 120), (1280, 720)])
def test_the_colours_of_a_video_are_those_of_the_film(suffix, size, tmp_path):
    """As a player decodes them: by BT.709, as the file says."""
    av = pytest.importorskip("av")
    names = {"lime": (0, 255, 0), "red": (255, 0, 0), "blue": (0, 0, 255), "orange": (255, 165, 0), "gray": (128,) * 3}
    discs = "".join(f"D{k} : .disc(9) O=[{20 + 24 * k}, 60] .color('{name}'); " for k, name in enumerate(names))
    motion = mv.loads(f".config(10, {size[0]}, {size[1]}); {discs} @0 @1").solve()
    motion.render(tmp_path / f"o.{suffix}")
    with av.open(str(tmp_path / f"o.{suffix}")) as container:
        context = container.streams.video[0].codec_context
        assert (context.colorspace, context.color_primaries, context.color_trc, context.color_range) == (1, 1, 1, 1)
        frame = next(container.decode(video=0))
        pixels = frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray().astype(int)
    assert abs(pixels[5, 5] - 255).max() <= 2
    for k, color in enumerate(names.values()):
        assert abs(pixels[size[1] - 60, 20 + 24 * k] - color).max() <= 4, color


@pytest.mark.parametrize(("suffix", "scale"), [("png", 1.0), ("png", 2.0), ("apng", 2.0)])
def test_a_png_tells_its_colours_and_its_size(suffix, scale, tmp_path):
    motion = mv.loads(".config(10, 96, 48); D : .disc(9) O=[20,20]; @0 D.O = [20 + .t, 20]; @1").solve()
    motion.render(tmp_path / f"o.{suffix}", scale=scale)
    with Image.open(tmp_path / f"o.{suffix}") as image:
        assert image.info["srgb"] == 0
        inches = [pixels / dpi for pixels, dpi in zip(image.size, image.info["dpi"], strict=True)]
        assert inches == pytest.approx([1.0, 0.5], rel=2e-4)


@pytest.mark.slow
def test_the_same_pictures_are_the_same_video(tmp_path):
    """x264 chooses other bits now and then (for this film nearly every other time) unless it is told not to."""
    pytest.importorskip("av")
    script = mv.load(Path(__file__).parents[2] / "scripts" / "four-bar.mov")
    motion = script.solve()
    found = {motion.render(tmp_path / f"{k}.mp4").path.read_bytes() for k in range(3)}
    assert len(found) == 1


def test_without_pyav(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    made, where = bars_only(3)
    with pytest.raises(UsageError) as caught:
        write_animation(make_painter(made, where), where, tmp_path / "o.mp4", fps=FPS)
    assert caught.value.diagnostics[0].code == "output/video"
    assert caught.value.diagnostics[0].helps == ("pip install 'movimentum[video]'",)
    assert os.listdir(tmp_path) == []


def test_what_is_to_be_typed_names_the_file_that_was_asked_for() -> None:
    with pytest.raises(UsageError) as caught:
        check_output(Path("two words/$x.jpg"), transparent=True)
    assert caught.value.diagnostics[0].helps == ("-o 'two words/$x.png'",)
    with pytest.raises(UsageError) as caught:
        check_output(Path("a%s%d.png"))
    assert "`a%s%d.png` must have one %d" in caught.value.diagnostics[0].message
