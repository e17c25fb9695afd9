"""Files as independent decoders see them: pixels, times, loops; nothing left behind when something fails."""

import errno
import multiprocessing
import os
import struct
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image, ImageSequence

from movimentum.encode import runs, write
from movimentum.encode.palette import Mapper, choose_palette
from movimentum.encode.write import check_output, write_animation
from movimentum.errors import UsageError
from movimentum.render.options import PictureOptions
from movimentum.render.painter import Session, make_painter
from movimentum.render.stream import Spool
from movimentum.scene.model import AnchorRef
from tests.render.scenes import disc_file, pixels, poses, scene, thing

FPS = Fraction(25)


def moving(tmp_path, frames=40, rest=True, **fields):
    """A turning sprite and a swinging bar; some frames alike."""
    made = scene(
        thing("sprite", image=disc_file(tmp_path / "d.png", 40)),
        thing("bar", (0, 0), (40, 0), color=(10, 20, 90), width=6.0),
        **fields,
    )
    t = np.arange(frames, dtype=float)
    if rest:
        t[5:12] = t[5]  # nothing moves for a while
        t[28:33] = t[28]  # across the border of two runs
    sprite = np.stack([5 + t, 10 + 0.3 * t, 7.3 * t], axis=1)
    bar = np.stack([50 + 0 * t, 40 + 0 * t, 11 * t], axis=1)
    return made, poses(sprite, bar)


def bars_only(frames=12):
    made = scene(thing("bar", (0, 0), (40, 0), color=(10, 20, 90), width=6.0))
    return made, poses([[50, 40, 13 * k] for k in range(frames)])


def composed(painter, where):
    return [pixels(image) for image in Session(painter).frames(where)]


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
    images = [image.copy() for image in Session(painter).frames(where)]
    positions = sorted({k * 40 // 8 for k in range(8)})
    palette = choose_palette([images[k] for k in positions], painter.background)
    mapper, table = Mapper(palette), np.frombuffer(palette.table(), np.uint8).reshape(256, 3).astype(int)
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
    palette = choose_palette([picture], None)
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


def test_without_pyav(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    made, where = bars_only(3)
    with pytest.raises(UsageError) as caught:
        write_animation(make_painter(made, where), where, tmp_path / "o.mp4", fps=FPS)
    assert caught.value.diagnostics[0].code == "output/video"
    assert caught.value.diagnostics[0].helps == ("pip install 'movimentum[video]'",)
    assert os.listdir(tmp_path) == []


# --- workers ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["gif", "apng", "webp"])
def test_bytes_do_not_depend_on_workers_nor_on_chunks(tmp_path, suffix):
    made, where = moving(tmp_path, frames=130)
    options = PictureOptions(traces=(AnchorRef(1, 1),), transparent=suffix != "gif")
    painter = make_painter(made, where, options)
    made_by = {}
    for workers in (1, 2, 3):
        path = tmp_path / f"{workers}.{suffix}"
        report = write_animation(painter, where, path, fps=FPS, workers=workers)
        assert report.workers == workers
        made_by[workers] = path.read_bytes()
    assert made_by[1] == made_by[2] == made_by[3]
    with Spool(where.select(slice(a, a + 17)) for a in range(0, 130, 17)) as spool:
        write_animation(painter, spool, tmp_path / f"s.{suffix}", fps=FPS, workers=2)
    assert (tmp_path / f"s.{suffix}").read_bytes() == made_by[1]
    assert multiprocessing.active_children() == []


def test_many_things_and_large_pieces_do_not_block_each_other(tmp_path):
    # a run of 300 things is more than a pipe holds, and so are its pieces
    rng = np.random.default_rng(7)
    Image.fromarray(rng.integers(0, 256, (120, 150, 3), dtype=np.uint8)).save(tmp_path / "noise.png")
    made = scene(
        thing("sprite", image=str(tmp_path / "noise.png")),
        *[thing("bar", (0, 0), (3, 0), width=1.0, hidden=True) for _ in range(299)],
        size=(200, 200),
    )
    where = poses([[k % 7, k % 5, k] for k in range(240)], *[[0, 0, 0]] * 299)
    write_animation(make_painter(made, where), where, tmp_path / "o.apng", fps=FPS, workers=2)
    with Image.open(tmp_path / "o.apng") as image:
        assert image.n_frames == 240


def test_spawned_workers_do_the_same(tmp_path, monkeypatch):
    made, where = moving(tmp_path, frames=70)
    painter = make_painter(made, where, PictureOptions(traces=(AnchorRef(1, 1),)))
    write_animation(painter, where, tmp_path / "a.gif", fps=FPS, workers=1)
    monkeypatch.setattr(runs, "_FORKS", False)
    write_animation(painter, where, tmp_path / "b.gif", fps=FPS, workers=2)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_progress_is_told(tmp_path):
    made, where = bars_only(100)
    heard = []
    write_animation(
        make_painter(made, where), where, tmp_path / "o.gif", fps=FPS, workers=2, progress=lambda *n: heard.append(n)
    )
    assert heard[-1] == (100, 100)
    assert [done for done, _ in heard] == sorted(done for done, _ in heard)


# --- failures -----------------------------------------------------------------------------------------------------


class Trouble(Exception):
    pass


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("error", [Trouble, KeyboardInterrupt])
@pytest.mark.parametrize("name", ["o.gif", "o.apng", "o.webp", "o-%d.png", "o.mp4"])
def test_nothing_is_left_after_an_exception(tmp_path, workers, error, name):
    if name.endswith("mp4"):
        pytest.importorskip("av")
    made, where = bars_only(100)
    out = tmp_path / "out"
    out.mkdir()
    (out / "o.gif").write_bytes(b"what was there before")

    def stop(done, total):
        raise error

    with pytest.raises(error):
        write_animation(make_painter(made, where), where, out / name, fps=FPS, workers=workers, progress=stop)
    assert os.listdir(out) == ["o.gif"]
    assert (out / "o.gif").read_bytes() == b"what was there before"
    assert multiprocessing.active_children() == []


class BrokenCoder:
    def code(self, image, previous):
        raise Trouble("in a worker")


def test_what_goes_wrong_in_a_worker_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(write, "ApngCoder", BrokenCoder)
    made, where = bars_only(100)
    with pytest.raises(Trouble, match="in a worker"):
        write_animation(make_painter(made, where), where, tmp_path / "o.apng", fps=FPS, workers=2)
    assert os.listdir(tmp_path) == []


class DyingCoder:
    def code(self, image, previous):
        os._exit(9)


def test_a_worker_that_dies_is_told(tmp_path, monkeypatch):
    from movimentum.errors import MovimentumError

    monkeypatch.setattr(write, "ApngCoder", DyingCoder)
    made, where = bars_only(100)
    with pytest.raises(MovimentumError) as caught:
        write_animation(make_painter(made, where), where, tmp_path / "o.apng", fps=FPS, workers=2)
    assert caught.value.diagnostics[0].code == "render/worker"
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("workers", [1, 2])
def test_a_full_disk(tmp_path, monkeypatch, workers):
    made, where = bars_only(100)

    def full(self, piece, first, end):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(write.GifWriter, "add", full)
    with pytest.raises(UsageError) as caught:
        write_animation(make_painter(made, where), where, tmp_path / "o.gif", fps=FPS, workers=workers)
    assert caught.value.diagnostics[0].code == "output/unwritable"
    assert os.listdir(tmp_path) == []


def test_where_nothing_can_be_written(tmp_path):
    made, where = bars_only(3)
    painter = make_painter(made, where)
    for path in (tmp_path / "none" / "o.gif", tmp_path / "folder.gif"):
        (tmp_path / "folder.gif").mkdir(exist_ok=True)
        with pytest.raises(UsageError) as caught:
            write_animation(painter, where, path, fps=FPS)
        assert caught.value.diagnostics[0].code == "output/unwritable"


def test_names_that_say_no_format(tmp_path):
    for name, code in (
        ("o.bmp", "output/format"),
        ("o", "output/format"),
        ("o-%d-%d.png", "output/pattern"),
        ("o-%s.png", "output/pattern"),
        ("o-%999999999d.png", "output/pattern"),
    ):
        with pytest.raises(UsageError) as caught:
            check_output(tmp_path / name, 5)
        assert caught.value.diagnostics[0].code == code
    with pytest.raises(UsageError) as caught:
        check_output(tmp_path / "o.png", 5)
    assert caught.value.diagnostics[0].code == "output/one-picture"
    assert check_output(tmp_path / "o.png", 1) == "png"
    assert check_output(tmp_path / "O.GIF") == "gif"
    made, where = bars_only(3)
    with pytest.raises(UsageError) as caught:
        write_animation(make_painter(made, where), where.select(slice(0, 0)), tmp_path / "o.gif", fps=FPS)
    assert caught.value.diagnostics[0].code == "output/no-frames"


# --- memory -------------------------------------------------------------------------------------------------------

LONG = """
import resource, sys
from fractions import Fraction
from pathlib import Path
import numpy as np
from movimentum.encode.write import write_animation
from movimentum.render.painter import make_painter
from tests.render.scenes import poses, scene, thing
frames = int(sys.argv[1])
made = scene(thing("bar", (0, 0), (40, 0), color=(10, 20, 90), width=6.0), size=(400, 300))
where = poses(np.stack([np.full(frames, 200.0), np.full(frames, 150.0), np.arange(frames) * 3.7], axis=1))
write_animation(make_painter(made, where), where, Path(sys.argv[2]), fps=Fraction(25), workers=1)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the unit of ru_maxrss differs")
@pytest.mark.parametrize("suffix", ["gif", "apng", "webp"])
def test_memory_does_not_grow_with_the_length(tmp_path, suffix):
    def peak(frames):
        command = [sys.executable, "-c", LONG, str(frames), str(tmp_path / f"o.{suffix}")]
        root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
        return int(subprocess.run(command, check=True, capture_output=True, text=True, cwd=root).stdout)

    short, long = peak(60), peak(600)
    # 540 frames more of 360 kB each would be 190 MB
    assert long - short < 12_000
