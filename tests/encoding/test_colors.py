"""The colours of a GIF, as Pillow and ffmpeg decode it: those that a film declares or comes to are in it, wherever they
are; what is not as it was drawn is told.
"""

import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image

from movimentum.drawing.picture_options import PictureOptions
from movimentum.encoding.gif import SEEN
from movimentum.encoding.palette import CLOSE, Samples, choose_palette, packed
from movimentum.encoding.write import write_animation
from movimentum.errors import UsageError
from movimentum.rendering.painter import make_painter
from tests.broad import broad
from tests.encoding.films import FPS, composed, moving
from tests.encoding.test_files import gif_delays, shown_frames
from tests.rendering.scenes import disc_file, poses, scene, thing


def disc(at, color, radius=9.0):
    return thing("disc", at, color=color, radius=radius)


def written(path, made, where, lossy=0, matte=None, **options):
    """(what was written, the frames as they are drawn, the frames as a decoder shows them, one for each drawn)."""
    painter = make_painter(made, where, PictureOptions(**options))
    report = write_animation(painter, where, path, fps=FPS, lossy=lossy, matte=matte)
    times = [0, *np.cumsum(gif_delays(path)).tolist()]
    decoded = [pixels for pixels, _ in shown_frames(path, painter.mode)]
    shown = [decoded[np.searchsorted(times, 4 * k, side="right") - 1] for k in range(len(where.frames))]
    return report, composed(painter, where), shown


def codes(report):
    return [item.code for item in report.diagnostics]


@broad("frame", [1, 13, 30, 54, 77, 98], every=3)
@pytest.mark.parametrize("change", ["opacity", "appears", "color"])
def test_a_colour_that_one_frame_has(tmp_path, frame, change):
    count = 100
    here = np.arange(count) == frame
    lamp, color = disc((30, 40), (250, 20, 30)), {}
    shown = np.ones((2, count), dtype=bool)
    if change == "opacity":
        color = {(0, "opacity"): here * 1.0}
    elif change == "appears":
        shown[0] = here
    else:
        color = {(0, "red"): 40.0 + 210.0 * here, (0, "green"): [20.0] * count, (0, "blue"): [30.0] * count}
    bar = thing("bar", (0, 0), (30, 0), color=(10, 90, 60), width=6.0)
    turning = [[70, 40, 3 * k] for k in range(count)]
    made, where = scene(lamp, bar), poses([[0, 0, 0]], turning, visible=shown, properties=color, frames=count)
    report, drawn, decoded = written(tmp_path / "x.gif", made, where)
    assert (drawn[frame][40, 30] == (250, 20, 30)).all()
    assert (decoded[frame][40, 30] == (250, 20, 30)).all()
    assert not codes(report)


@pytest.mark.parametrize("count", [254, 255, 256, 300])
def test_a_palette_has_at_most_255_colours_however_many_are_known(count):
    shades = np.stack([np.arange(count) % 250, np.arange(count) // 250 * 90, np.arange(count) % 7 * 30], axis=1)
    picture = Image.fromarray(shades[None].astype(np.uint8))
    palette = choose_palette(Samples.of([picture]), packed(shades[:100].astype(np.uint8)))
    assert len(palette.colors) <= 255
    assert len(palette.table()) <= 768


@pytest.mark.parametrize("period", [40, 90, 180])
def test_colours_that_change_smoothly(tmp_path, period):
    count = 180
    turn = 2.0 * np.pi * np.arange(count) / period
    course = {name: 127.5 + 120.0 * np.sin(turn + k * 2.0) for k, name in enumerate(("red", "green", "blue"))}
    made = scene(disc((0, 0), (0, 0, 0), 20.0))
    where = poses(
        [[40 + 0.1 * k, 40, 0] for k in range(count)],
        properties={(0, name): values for name, values in course.items()},
    )
    report, drawn, decoded = written(tmp_path / "x.gif", made, where)
    for k in range(count):
        assert (decoded[k][40, 42] == drawn[k][40, 42]).all()
        assert np.median(np.abs(decoded[k] - drawn[k])[30:50, 30:60]) == 0.0
    assert not codes(report)


def test_a_hundred_and_fifty_declared_colours(tmp_path):
    rng = np.random.default_rng(3)
    colors = [tuple(color) for color in rng.integers(0, 256, (150, 3)).tolist()]
    places = [(8 + 12 * (k % 15), 8 + 12 * (k // 15)) for k in range(150)]
    made = scene(*(disc(at, color, 5.0) for at, color in zip(places, colors, strict=True)), size=(190, 130))
    where = poses(*([[0, 0, 0]] for _ in places), frames=3)
    _, drawn, decoded = written(tmp_path / "x.gif", made, where)
    for (x, y), color in zip(places, colors, strict=True):
        assert tuple(drawn[0][129 - y, x]) == tuple(decoded[0][129 - y, x]) == color


def test_more_colours_than_a_gif_has_are_told(tmp_path):
    rng = np.random.default_rng(5)
    Image.fromarray(rng.integers(0, 256, (60, 60, 3), dtype=np.uint8)).save(tmp_path / "noise.png")
    made = scene(thing("sprite", image=str(tmp_path / "noise.png")))
    where = poses([[10 + k, 10, 0] for k in range(5)])
    report, drawn, decoded = written(tmp_path / "x.gif", made, where)
    (told,) = report.diagnostics
    off = [np.abs(a - b).max(axis=2) for a, b in zip(drawn, decoded, strict=True)]
    assert told.code == "render/gif-colors"
    assert f"up to {max(each.max() for each in off)} of 255" in told.message
    assert f"{max((each > SEEN).sum() for each in off):,}".replace(",", "") in told.message.replace(",", "")
    assert told.helps[0].endswith("x.webp")


# --- no background ------------------------------------------------------------------------------------------------


def test_half_transparent_pixels_are_told(tmp_path):
    made, where = scene(disc((30, 40), (200, 30, 30))), poses([[k, 0, 0] for k in range(4)])
    report, _, _ = written(tmp_path / "x.gif", made, where, transparent=True)
    (told,) = report.diagnostics
    assert told.code == "render/gif-alpha"
    assert "--background white" in told.helps


@pytest.mark.parametrize("matte", [(255, 255, 255), (20, 30, 90)])
def test_edges_are_blended_with_the_colour_of_the_page(tmp_path, matte):
    """On a page of that colour, it looks as if it had been drawn there."""
    made = scene(disc((30, 40), (200, 30, 30)), thing("bar", (0, 0), (40, 0), color=(10, 90, 60), width=6.0))
    where = poses([[k, 0, 0] for k in range(6)], [[40, 40, 9 * k] for k in range(6)])
    report, _, decoded = written(tmp_path / "x.gif", made, where, matte=matte, transparent=True)
    truth = composed(make_painter(made, where, PictureOptions(background=matte)), where)
    assert not codes(report)
    for shown, right in zip(decoded, truth, strict=True):
        clear = shown[..., 3:] == 0
        on_page = np.where(clear, np.array(matte), shown[..., :3])
        # what is left out has less than 8 of 255 of a colour; a palette may be off by 2, blending rounds twice
        assert np.abs(on_page - right).max() <= 8 + CLOSE + 2


# --- lossy --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lossy", [4, 8, 16, 32])
def test_a_lossy_gif_is_smaller_by_a_stated_error(tmp_path, lossy):
    made, where = moving(tmp_path, 40)
    exact, _, _ = written(tmp_path / "x.gif", made, where)
    report, drawn, decoded = written(tmp_path / "y.gif", made, where, lossy=lossy)
    off = np.array([np.abs(a - b).max(axis=2) for a, b in zip(drawn, decoded, strict=True)])
    assert (off <= lossy + CLOSE).mean() > 0.9995  # but for colours that no sampled frame has
    assert off.max() <= lossy + SEEN
    assert not codes(report)
    assert not codes(exact)
    assert (tmp_path / "y.gif").stat().st_size < (tmp_path / "x.gif").stat().st_size


def test_only_a_gif_is_lossy(tmp_path):
    made, where = moving(tmp_path, 3, rest=False)
    with pytest.raises(UsageError) as caught:
        write_animation(make_painter(made, where), where, tmp_path / "x.webp", fps=FPS, lossy=8)
    assert caught.value.diagnostics[0].code == "output/lossy"


# --- another decoder ----------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg")
@pytest.mark.parametrize("size", [40, 300])
def test_ffmpeg_sees_the_same_frames(tmp_path, size):
    """Large frames: the table of strings is full several times."""
    made = scene(
        thing("sprite", image=disc_file(tmp_path / "d.png", size)),
        *(thing("bar", (0, 0), (size, 0), color=(10, 20 * k, 90), width=3.0) for k in range(9)),
        size=(2 * size, 2 * size),
    )
    turns = [[[size, size, 40 * n + 3.7 * k] for k in range(12)] for n in range(9)]
    where = poses([[k, 10 + 0.3 * k, 7.3 * k] for k in range(12)], *turns)
    _, drawn, decoded = written(tmp_path / "x.gif", made, where)
    raw = subprocess.run(
        ["ffmpeg", "-loglevel", "error", "-i", tmp_path / "x.gif", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    theirs = np.frombuffer(raw, dtype=np.uint8).reshape(-1, 2 * size, 2 * size, 3)
    assert len(theirs) == len(drawn)
    assert all((a == b).all() for a, b in zip(theirs, decoded, strict=True))


@pytest.mark.parametrize("suffix", [".gif", ".webp", ".apng"])
def test_a_coder_that_was_timed_begins_the_film_with_a_whole_picture(tmp_path, monkeypatch, suffix):
    """To choose the number of workers, a later frame is coded once: nothing of it may be left in the film."""
    monkeypatch.setattr("movimentum.encoding.write.workers_that_pay", lambda *_: 1)
    bar = thing("bar", (0, 0), (30, 0), color=(10, 90, 60), width=6.0)
    made, where = scene(disc((30, 40), (250, 20, 30)), bar), poses([[0, 0, 0]], [[70, 40, 3 * k] for k in range(80)])
    painter = make_painter(made, where, PictureOptions())
    write_animation(painter, where, tmp_path / f"timed{suffix}", fps=FPS)
    write_animation(painter, where, tmp_path / f"one{suffix}", fps=FPS, workers=1)
    assert (tmp_path / f"timed{suffix}").read_bytes() == (tmp_path / f"one{suffix}").read_bytes()
