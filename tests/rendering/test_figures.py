"""Figures as pixels: exact edges, no jumps, no seams, nothing outside the canvas."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from movimentum.drawing.figure_outlines import dashes, rounded
from movimentum.drawing.picture_options import PictureOptions, Quality
from movimentum.rendering.coverage import Outline
from movimentum.rendering.painter import PaintSession, make_painter
from movimentum.scene.model import AnchorRef
from tests.rendering.scenes import BLACK, capsule, covered, pixels, poses, scene, thing, truth, whole

STAR = [
    (
        50 + (30 if k % 2 else 12) * math.cos(0.3 + k * math.pi / 5),
        40 + (30 if k % 2 else 12) * math.sin(0.3 + k * math.pi / 5),
    )
    for k in range(10)
]


def outline(rings, size):
    return covered(Outline.of(rings), size)


def inside_of(corners):
    def inside(x, y):
        x, y = np.broadcast_arrays(x, y)
        found = np.zeros(x.shape, dtype=bool)
        for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
            crosses = (ay > y) != (by > y)
            with np.errstate(divide="ignore", invalid="ignore"):
                found ^= crosses & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
        return found

    return inside


@pytest.mark.parametrize("corners", [STAR, STAR[::-1], [(10.3, 5.2), (90.9, 30.1), (20.5, 70.7)]])
@pytest.mark.parametrize("moved", [(0, 0), (-35, 0), (45, 10), (0, -20), (10, 45)])
def test_the_coverage_of_an_outline_is_its_area(corners, moved):
    corners = [(x + moved[0], y + moved[1]) for x, y in corners]
    found = whole(outline([corners], (100, 80)), (100, 80))
    assert abs(found - truth(inside_of(corners), (100, 80), 16)).max() < 0.06
    ours = whole(outline([[(x + 200, y + 200) for x, y in corners]], (400, 400)), (400, 400))
    area = (
        abs(sum(ax * by - bx * ay for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True))) / 2
    )
    assert ours.sum() == pytest.approx(area, rel=2e-3)


def test_an_outline_that_is_elsewhere_or_far_too_large_is_no_trouble():
    assert outline([[(-50, -50), (-20, -50), (-20, -20)]], (100, 80)) == []
    assert whole(outline([[(0, 0), (1, 1)]], (100, 80)), (100, 80)).max() == 0
    large = outline([[(-1e12, -1e12), (1e12, -1e12), (1e12, 1e12), (-1e12, 1e12)]], (100, 80))
    assert (whole(large, (100, 80)) == 1).all()


def test_a_hole_is_a_hole():
    ring = [(20, 20), (80, 20), (80, 60), (20, 60)]
    hole = [(40, 50), (60, 50), (60, 30), (40, 30)]
    found = whole(outline([ring, hole], (100, 80)), (100, 80))
    assert found[40, 50] == 0
    assert found[25, 25] == 1
    assert found.sum() == pytest.approx(60 * 40 - 20 * 20)


def test_dashes_have_the_lengths_of_their_pattern():
    pieces = dashes([(0, 0), (10, 0), (10, 10)], (4, 2))
    lengths = [sum(math.dist(p, q) for p, q in pairwise(piece)) for piece in pieces]
    assert lengths == pytest.approx([4, 4, 4, 2])
    assert pieces[1] == [(6, 0), (10, 0)]


def test_a_plate_is_everything_near_its_anchors():
    outside = rounded([(30, 30), (70, 30), (50, 60), (50, 40)], 10)

    def near(x, y):
        within = inside_of([(30, 30), (70, 30), (50, 60)])(x, y)
        for p, q in (((30, 30), (70, 30)), ((70, 30), (50, 60)), ((50, 60), (30, 30))):
            within = within | capsule(p, q, 10)(x, y)
        return within

    found = whole(outline([outside], (100, 80)), (100, 80))
    assert abs(found - truth(near, (100, 80))).max() < 0.12
    assert len(rounded([(5, 5), (5, 5)], 3)) > 10


FIGURES = {
    "plate": thing("plate", (30, 30), (70, 30), (50, 60)),
    "polygon": thing("polygon", (30, 30), (70, 30), (50, 60)),
    "gear": thing("gear", (50, 40), teeth=9, module=6.0),
    "rack": thing("rack", (20, 40), (40, 40), teeth=4, module=4.0),
    "ground": thing("ground", (50, 50)),
    "link": thing("bar", (30, 30), (70, 50), width=14.0, edge=BLACK, fill=(250, 200, 100), pins=4.0),
    "disc": thing("disc", (50, 40), radius=20.0, edge=BLACK, fill=(250, 200, 100)),
    "dashed": thing("bar", (20, 20), (80, 60), width=6.0, dash=(8.0, 5.0), cap="butt"),
}


@pytest.mark.parametrize("name", FIGURES)
def test_a_slow_motion_does_not_hop(name):
    """A tenth of a pixel further, no pixel changes by more than an edge can."""
    made = scene(FIGURES[name])
    where = poses([[0.1 * k, 0.07 * k, 0.0] for k in range(12)])
    frames = [pixels(image) for image in PaintSession(make_painter(made, where)).frames(where)]
    steps = [abs(a - b).max() for a, b in pairwise(frames)]
    assert 0 < max(steps) <= 70


@pytest.mark.parametrize("name", FIGURES)
def test_a_faded_figure_is_a_mixture_of_itself_and_the_ground(name):
    made = scene(FIGURES[name])
    solid, clear, half = (
        pixels(make_painter(made, where).frame(where, 0))
        for where in (poses([0, 0, 0], properties={(0, "opacity"): [value]}) for value in (1.0, 0.0, 0.5))
    )
    assert (clear == 255).all()
    assert abs(half - (solid + clear) / 2).max() <= 1


@pytest.mark.parametrize("name", FIGURES)
def test_a_transparent_background_makes_no_halo(name):
    """Laid over a colour, it looks as if it had been drawn on that colour."""
    made, where = (
        scene(FIGURES[name], background=(40, 90, 200)),
        poses([0.3, 0.2, 5.0], properties={(0, "opacity"): [0.6]}),
    )
    drawn = pixels(make_painter(made, where).frame(where, 0))
    clear = pixels(make_painter(made, where, PictureOptions(transparent=True)).frame(where, 0))
    alpha = clear[..., 3:] / 255.0
    assert abs(clear[..., :3] * alpha + np.array([40, 90, 200]) * (1 - alpha) - drawn).max() <= 3


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize("quality", list(Quality))
def test_the_canvas_holds_everything(name, quality):
    made, where = scene(FIGURES[name], size=None), poses([[0, 0, 10.0 * k] for k in range(6)])
    for image in PaintSession(make_painter(made, where, PictureOptions(quality=quality))).frames(where):
        found = pixels(image)
        assert (np.concatenate([found[0], found[-1], found[:, 0], found[:, -1]]) == 255).all()
        assert (found != 255).any()


SYMBOLS = {
    "spring": {"coils": 6},
    "damper": {},
    "cylinder": {},
    "slide": {},
    "dimension": {"offset": 15.0, "text": ""},
    "arc": {"radius": 15.0, "text": ""},
    "line": {"dash": (5.0, 3.0)},
}


def between(name):
    ends = [AnchorRef(0, 0), AnchorRef(1, 0), AnchorRef(2, 0)][: 3 if name == "arc" else 2]
    dots = [thing("disc", (0, 0), radius=2.0) for _ in range(3)]
    return scene(*dots, thing(name, through=tuple(ends), **SYMBOLS[name]), size=None)


@pytest.mark.parametrize("name", SYMBOLS)
def test_symbols_are_held_by_the_canvas_and_do_not_hop(name):
    made = between(name)
    path = [[0.1 * k, 0.05 * k, 0] for k in range(10)]
    where = poses(path, [[70 + 0.1 * k, 20, 0] for k in range(10)], [10, 60, 0], [0, 0, 0], frames=10)
    frames = [pixels(image) for image in PaintSession(make_painter(made, where)).frames(where)]
    edges = np.concatenate([np.concatenate([f[0], f[-1], f[:, 0], f[:, -1]]) for f in frames])
    assert (edges == 255).all()
    assert 0 < max(abs(a - b).max() for a, b in pairwise(frames)) <= 90


@pytest.mark.parametrize("name", SYMBOLS)
def test_symbols_wait_for_what_they_are_drawn_at_and_fade_as_one(name):
    made = between(name)
    at = ([10, 10, 0], [70, 20, 0], [20, 60, 0], [0, 0, 0])
    fading = {(n, "opacity"): [0.0] for n in range(3)}
    solid, half = (
        pixels(make_painter(made, where).frame(where, 0))
        for where in (poses(*at, properties={**fading, (3, "opacity"): [value]}) for value in (1.0, 0.5))
    )
    assert (solid != 255).any()
    assert abs(half - (solid + 255) / 2).max() <= 1
    away = poses(*at, visible=[[True], [False], [True], [True]], properties=fading)
    assert (pixels(make_painter(made, poses(*at)).frame(away, 0)) == 255).all()


def test_a_path_is_drawn_from_the_first_frame_on_and_a_tail_fades():
    where = poses([[10 + 4 * k, 40, 0] for k in range(20)], [0, 0, 0], frames=20)
    dot = thing("disc", (0, 0), radius=1.0, hidden=True)
    through = (AnchorRef(0, 0),)
    whole = scene(dot, thing("trace", through=through, width=5.0, color=BLACK, whole=True))
    first = pixels(make_painter(whole, where).frame(where, 0))
    assert first[40, 80, 0] == pytest.approx(255 * 0.65, abs=2)
    assert (first == pixels(make_painter(whole, where).frame(where, 19))).all()
    tail = scene(dot, thing("trace", through=through, width=5.0, color=BLACK, tail=0.4))
    painter = make_painter(tail, where)
    last = pixels(painter.frame(where, 19))[40, :, 0]
    assert last[20] == 255
    assert last[84] < 30
    assert (np.diff(last[50:84]) <= 0).all()
    frames = [pixels(image) for image in PaintSession(painter).frames(where)]
    assert (frames[19][40, :, 0] == last).all()
