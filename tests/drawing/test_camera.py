"""The camera and insets, against closed forms, and in every way to draw them."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from movimentum.analysis.shown_numbers import with_shown_numbers
from movimentum.drawing.camera import _outer, camera  # pyright: ignore[reportPrivateUsage]
from movimentum.drawing.picture_options import PictureOptions
from movimentum.errors import ScriptError
from movimentum.geometry import View
from movimentum.rendering.painter import make_painter
from tests.drawing.films import EVERYTHING, FIGURES, everything, seen, shot_of_page, shot_of_svg
from tests.drawing.likeness import Tolerance, unlike

ENLARGED = Tolerance(160, 0.25)
"""Letters that are larger in a picture, and once more in its insets."""
SPOTS = """\
.config(20, 400, 300);
Spot : .disc(6) C = [0,0];
Far  : .disc(6) C = [300,220] .color('red');
Note : .label('still') at = [20,270];
"""


def _looks(steps: str, fps: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """(F,) times, and what world points [0,0] and [1,0] become: (F, 3) zoom, x, y."""
    motion = mv.loads(f".config({fps},400,300); Spot : .disc(6) C = [0,0]; {steps}").solve().solution.motion
    chunk = with_shown_numbers(motion, motion.poses(0, motion.timeline.frame_count))
    look = camera(chunk, View(0.0, 0.0, 400, 300, 1.0))
    assert look is not None
    return chunk.times, look


def _eased(u: np.ndarray) -> np.ndarray:
    u = np.clip(u, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


@pytest.mark.parametrize("zoom", [0.4, 1.0, 1.0000001, 3.0, 40.0])
@pytest.mark.parametrize("place", [(200.0, 150.0), (30.0, 260.0), (-500.0, 10.0)])
def test_a_view_is_reached_at_the_end_of_its_step(zoom: float, place: tuple[float, float]) -> None:
    x, y = place
    times, look = _looks(f"@0 Spot.C = [10*.t, 0]; @1 .view([{x},{y}], {zoom!r}); @3 .view(_, 1); @4")
    before, end, back = look[times <= 1.0], look[times == 3.0][0], look[-1]
    np.testing.assert_allclose(before, np.tile([1.0, 0.0, 0.0], (len(before), 1)), atol=1e-12)
    np.testing.assert_allclose(end, [zoom, 200 - zoom * x, 150 - zoom * y], rtol=1e-12)
    np.testing.assert_allclose(back, [1.0, 0.0, 0.0], atol=1e-12)
    # zooms in even ratios, eased; the corner of what is seen goes on a straight line
    u = _eased((times - 1.0) / 2.0)
    going = (times > 1.0) & (times < 3.0)
    np.testing.assert_allclose(look[going, 0], zoom ** u[going], rtol=1e-9)
    corner = -look[going, 1:] / look[going, :1]
    along = np.array([x - 200 / zoom, y - 150 / zoom])
    across = corner[:, 0] * along[1] - corner[:, 1] * along[0]
    assert np.abs(across).max() < 1e-6 * max(1.0, math.hypot(*along)) ** 2


def test_a_cut_and_a_first_view_are_there_at_once() -> None:
    times, look = _looks("@0 Spot.C = [10*.t, 0]; .view([100,100], 2); @1 .view([0,0], 4) .cut; @2")
    np.testing.assert_allclose(look[times < 1.0], np.tile([2.0, 0.0, -50.0], ((times < 1.0).sum(), 1)))
    np.testing.assert_allclose(look[times >= 1.0], np.tile([4.0, 200.0, 150.0], ((times >= 1.0).sum(), 1)))


def test_a_view_follows_a_thing_and_knows_how_far_its_step_is() -> None:
    times, look = _looks("@0 Spot.C = [10*.t, 30*.t^2]; .view(Spot.C, 1 + 3*.s); @2")
    zoom = 1 + 1.5 * times
    np.testing.assert_allclose(look[:, 0], zoom, rtol=1e-12)
    np.testing.assert_allclose(look[:, 1], 200 - zoom * 10 * times, atol=1e-9)
    np.testing.assert_allclose(look[:, 2], 150 - zoom * 30 * times**2, atol=1e-9)


def _spot(picture: Image.Image, box: tuple[int, int, int, int] | None = None) -> tuple[float, float, float]:
    """(x, y, radius) of what is darker than the ground, y up, from its area."""
    grey = 1.0 - np.asarray(picture.convert("L").crop(box or (0, 0, *picture.size)), dtype=np.float64) / 255.0
    rows, columns = np.indices(grey.shape)
    mass = grey.sum()
    x, y = (columns * grey).sum() / mass + 0.5, (rows * grey).sum() / mass + 0.5
    left, top = (0, 0) if box is None else box[:2]
    return x + left, picture.height - y - top, math.sqrt(mass / math.pi)


@pytest.mark.parametrize("zoom", [0.5, 2.0, 7.0])
def test_pixels_are_where_the_camera_puts_them(zoom: float, tmp_path: Path) -> None:
    text = ".config(10,400,300); S:.disc(6) C=[0,0] .color('black');"
    motion = mv.loads(f"{text} @0 S.C=[103,71]; .view([100,70], {zoom}); @1").solve()
    motion.render(tmp_path / "s.png", at=0)
    x, y, radius = _spot(Image.open(tmp_path / "s.png"))
    assert (x, y) == pytest.approx((200 + 3 * zoom, 150 + zoom), abs=0.05)
    assert radius == pytest.approx(6 * zoom, rel=0.01)


def test_an_inset_shows_its_point_in_its_middle(tmp_path: Path) -> None:
    text = (
        ".config(10,400,300); S:.disc(3) C=[0,0] .color('black'); I:.inset(S.C + [1,2], 5) at=[250,100] .size(100,60);"
    )
    motion = mv.loads(f"{text} @0 S.C=[60 + 20*.t,71]; @1").solve()
    for at in (0, 1):
        motion.render(tmp_path / "s.png", at=at)
        x, y, radius = _spot(Image.open(tmp_path / "s.png"), (252, 142, 348, 198))
        assert (x, y) == pytest.approx((300 - 5, 130 - 10), abs=0.1)
        assert radius == pytest.approx(15, rel=0.02)


def test_what_is_still_is_where_it_was(tmp_path: Path) -> None:
    text = SPOTS.replace(".color('red')", ".color('red') .still")
    plain, moved = (
        mv.loads(f"{text} @0 Spot.C = [10*.t, 0]; {view} @1").solve() for view in ("", ".view([1000,1000], 3);")
    )
    plain.render(tmp_path / "a.png", at=0)
    moved.render(tmp_path / "b.png", at=0)
    with Image.open(tmp_path / "a.png") as a, Image.open(tmp_path / "b.png") as b:
        assert a.crop((15, 0, 400, 300)).tobytes() == b.crop((15, 0, 400, 300)).tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("text", [EVERYTHING, pytest.param(FIGURES, marks=pytest.mark.slow)], ids=["things", "figures"])
def test_all_ways_to_draw_show_the_same(text: str, page: Any, tmp_path: Path) -> None:
    everything(tmp_path)  # its picture
    script = tmp_path / "seen.mov"
    script.write_text(seen(text), encoding="utf-8")
    motion = mv.load(script).solve()
    frames = (0, 12, 17)
    for name in ("film.svg", "film.html", "film.pdf"):
        motion.render(tmp_path / name)
    if (tool := shutil.which("pdftoppm")) is not None:
        subprocess.run([tool, "-r", "96", "-png", tmp_path / "film.pdf", tmp_path / "page"], check=True)
    pages = sorted(tmp_path.glob("page-*.png"))
    for frame in frames:
        motion.render(tmp_path / "one.png", frames=frame)
        with Image.open(tmp_path / "one.png") as opened:
            picture = opened.convert("RGB")
        page.goto((tmp_path / "film.svg").as_uri())
        shots = [shot_of_svg(page, frame / motion.timeline.fps, picture.size)]
        page.goto((tmp_path / "film.html").as_uri())
        shots.append(shot_of_page(page, frame, picture.size))
        for shot in (*shots, *(Image.open(each) for each in pages[frame : frame + 1])):
            worst, edges = unlike(shot.convert("RGB").crop((0, 0, *picture.size)), picture)
            assert (worst <= ENLARGED.worst, edges <= ENLARGED.edges) == (True, True), (frame, worst, edges)


@pytest.mark.parametrize(
    ("said", "code"),
    [
        (".view([1,2]);", "syntax/arguments"),
        (".view('a', 2);", "syntax/arguments"),
        (".view(2, [1,2]);", "kind/mismatch"),
        (".view([1,2], 0);", "kind/out-of-range"),
        (".view([1,2], -3);", "kind/out-of-range"),
        (".view([1,2], 1e9);", "kind/out-of-range"),
        (".view(Nope.A, 2);", "name/unknown-thing"),
        (".view([q,2], 2);", "name/unknown-variable"),
        (".view([.d(Spot.C.x),2], 2);", "kind/mismatch"),
        (".view([_,2], 2);", "kind/mismatch"),
        (".view(_, 2) .slow;", "syntax/misplaced-option"),
        (".view(_, 2); .view(_, 3);", "name/duplicate"),
    ],
)
def test_a_wrong_view_is_told(said: str, code: str) -> None:
    with pytest.raises(ScriptError) as found:
        mv.loads(f"{SPOTS} @0 Spot.C = [10*.t, 0]; {said} @1")
    assert found.value.diagnostics[0].code == code


def test_frames_are_the_same_in_any_order(tmp_path: Path) -> None:
    script = everything(tmp_path)
    script.write_text(seen(EVERYTHING), encoding="utf-8")
    motion = mv.load(script).solve()
    motion.render(tmp_path / "film-%02d.png")
    whole = [each.read_bytes() for each in sorted(tmp_path.glob("film-*.png"))]
    for frame in (9, 16):
        motion.render(tmp_path / "one.png", frames=frame)
        with Image.open(tmp_path / "one.png") as one, Image.open(tmp_path / f"film-{frame:02d}.png") as other:
            assert one.tobytes() == other.tobytes()
    assert len(set(whole)) == motion.timeline.frame_count


def test_poses_without_numbers_show_no_inset_and_no_camera(tmp_path: Path) -> None:
    script = everything(tmp_path)
    script.write_text(seen(EVERYTHING), encoding="utf-8")
    motion = mv.load(script).solve().solution.motion
    bare = motion.poses(0, 4)
    painter = make_painter(motion.timeline.scene, bare, PictureOptions(motion=motion.path))
    assert painter.frame(bare, 2).size == (360, 260)


@pytest.mark.parametrize("seed", range(20))
def test_lines_to_an_inset_leave_both_rectangles_on_one_side(seed: int) -> None:
    """Of any breadth and height, in any direction, as far apart as a corner."""
    made = np.random.default_rng(seed)
    sides, zoom = made.uniform(20.0, 200.0, 2), made.uniform(1.2, 8.0)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) - 0.5
    frame = made.uniform(-300.0, 300.0, (50, 1, 2)) + corners * sides
    detail = corners * sides / zoom
    apart = (np.abs(frame.mean(axis=1)) > (0.5 + 0.5 / zoom) * sides).any(axis=1)
    inside = np.broadcast_to(detail, frame.shape)
    for side, sign in zip(_outer(frame, inside), (1.0, -1.0), strict=True):
        begin, end = (np.take_along_axis(each, side[:, None, None], axis=1)[:, 0] for each in (inside, frame))
        way, rest = end - begin, np.concatenate([frame, inside], axis=1) - begin[:, None]
        across = sign * (way[:, None, 0] * rest[..., 1] - way[:, None, 1] * rest[..., 0])
        assert (across[apart] >= -1e-9 * 300.0**2).all()
