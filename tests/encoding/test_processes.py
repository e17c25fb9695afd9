"""Workers change nothing; failures leave nothing; memory does not grow."""

import errno
import multiprocessing
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from movimentum.drawing.picture_options import PictureOptions
from movimentum.encoding import runs, write
from movimentum.encoding.pieces import Coder
from movimentum.encoding.write import check_output, write_animation
from movimentum.errors import MovimentumError, UsageError
from movimentum.rendering.painter import make_painter
from movimentum.rendering.stream import Spool
from movimentum.scene.model import AnchorRef
from tests.broad import broad
from tests.encoding.films import FPS, bars_only, moving
from tests.rendering.scenes import poses, scene, thing

# --- workers ------------------------------------------------------------------------------------------------------


@broad("suffix", ["gif", "apng", "webp"], fast=("webp",))
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


@pytest.mark.slow
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


@pytest.mark.slow
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


class Failure(Exception):
    pass


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("error", [Failure, KeyboardInterrupt])
@broad("name", ["o.gif", "o.apng", "o.webp", "o-%d.png", "o.mp4"], every=2)
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


class BrokenCoder(Coder):
    def code(self, frame):
        raise Failure("in a worker")


def test_what_goes_wrong_in_a_worker_is_told(tmp_path, monkeypatch):
    monkeypatch.setitem(write.FORMATS, ".apng", replace(write.FORMATS[".apng"], coder=BrokenCoder))
    made, where = bars_only(100)
    with pytest.raises(Failure, match="in a worker"):
        write_animation(make_painter(made, where), where, tmp_path / "o.apng", fps=FPS, workers=2)
    assert os.listdir(tmp_path) == []


class DyingCoder(Coder):
    def code(self, frame):
        os._exit(9)


def test_a_worker_that_dies_is_told(tmp_path, monkeypatch):
    monkeypatch.setitem(write.FORMATS, ".apng", replace(write.FORMATS[".apng"], coder=DyingCoder))
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
        ("o-%s.jpg", "output/pattern"),
        ("o.jpeg", "output/one-picture"),
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
from movimentum.encoding.write import write_animation
from movimentum.rendering.painter import make_painter
from tests.rendering.scenes import poses, scene, thing
frames = int(sys.argv[1])
made = scene(thing("bar", (0, 0), (40, 0), color=(10, 20, 90), width=6.0), size=(400, 300))
where = poses(np.stack([np.full(frames, 200.0), np.full(frames, 150.0), np.arange(frames) * 3.7], axis=1))
write_animation(make_painter(made, where), where, Path(sys.argv[2]), fps=Fraction(25), workers=1)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the unit of ru_maxrss differs")
@broad("suffix", ["gif", "apng", "webp"], fast=("gif",))
def test_memory_does_not_grow_with_the_length(tmp_path, suffix):
    def peak(frames):
        command = [sys.executable, "-c", LONG, str(frames), str(tmp_path / f"o.{suffix}")]
        root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
        return int(subprocess.run(command, check=True, capture_output=True, text=True, cwd=root).stdout)

    short, long = peak(60), peak(600)
    # 540 frames more of 360 kB each would be 190 MB
    assert long - short < 12_000
