"""Paths between frames: every kind of motion with a closed form, at rates that know nothing of it."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest

import movimentum as mv
from movimentum.drawing.picture_options import PictureOptions
from movimentum.rendering.prepare import Trace, prepare_drawing
from tests.broad import broad

OFF = 0.05


def _paths(text: str) -> tuple[Trace, ...]:
    motion = mv.loads(text).solve(on_failure="skip").solution.motion  # a pole is no solution
    chunk = motion.poses(0, motion.timeline.frame_count)
    return prepare_drawing(motion.timeline.scene, (chunk,), PictureOptions(motion=motion.path)).paths


def _path(x: str, y: str, fps: float = 10, end: float = 2) -> np.ndarray:
    text = f".config({fps},400,400); D:.disc(4) O=[0,0]; T:.trace D.O .whole; @0 D.O=[{x},{y}]; @{end}"
    (trace,) = _paths(text)
    return trace.path


def _off(path: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """How far the path is from the true points, and its own points and middles from them."""
    pieces = [(a[:2], b[:2] if b[2] else a[:2]) for a, b in zip(path, [*path[1:], path[-1]], strict=True) if a[2]]
    a, b = (np.array(ends) for ends in zip(*pieces, strict=True))
    drawn = np.concatenate([a + part * (b - a) for part in (0.0, 0.2, 0.5)])

    def farthest(places: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
        along = end - start
        worst = np.full(len(places), np.inf)
        for first, way in zip(start, along, strict=True):
            away = places - first
            part = np.clip(away @ way / max(way @ way, 1e-30), 0, 1)
            worst = np.minimum(worst, np.hypot(*(away - part[:, None] * way).T))
        return float(worst.max())

    near = np.hypot(*np.diff(truth, axis=0).T) < 5.0
    ends = np.where(near[:, None], truth[1:], truth[:-1])
    return farthest(truth, a, b), farthest(drawn, truth, np.concatenate([ends, truth[-1:]]))


def _truth(x, y, end: float = 2.0, breaks: tuple[float, ...] = ()) -> np.ndarray:
    times = np.linspace(0, end, 1201)
    near = [t + d for t in breaks for d in (-1e-9, 1e-9) if t + d <= end]
    times = np.sort(np.concatenate([times, near]))
    return np.array([(x(t), y(t)) for t in times.tolist()])


KINDS = {
    "line": ("20+100*.t", "30+50*.t", lambda t: 20 + 100 * t, lambda t: 30 + 50 * t, ()),
    "circle": (
        "200+150*.cos(180*.t)",
        "200+150*.sin(180*.t)",
        lambda t: 200 + 150 * math.cos(math.pi * t),
        lambda t: 200 + 150 * math.sin(math.pi * t),
        (),
    ),
    "kink": ("20+100*.t", "150+.abs(90*.t-77)", lambda t: 20 + 100 * t, lambda t: 150 + abs(90 * t - 77), ()),
    "jump": (
        "20+100*.t",
        "{ .t < 0.733 : 40; 200 }",
        lambda t: 20 + 100 * t,
        lambda t: 40 if t < 0.733 else 200,
        (0.733,),
    ),
    "jump on its way": (
        "20+100*.t + { .t < 0.733 : 0; 4 }",
        "50",
        lambda t: 20 + 100 * t + (0 if t < 0.733 else 4),
        lambda t: 50.0,
        (0.733,),
    ),
    "saw": (
        "20+100*.t",
        "20+.mod(700*.t, 100)",
        lambda t: 20 + 100 * t,
        lambda t: 20 + (700 * t) % 100,
        tuple(k / 7 for k in range(1, 15)),
    ),
    "steps that stand still": (
        "20+60*.floor(3*.t)",
        "50",
        lambda t: 20 + 60 * math.floor(3 * t + 1e-12),
        lambda t: 50.0,
        tuple(k / 3 for k in range(1, 6)),
    ),
    "many turns in a frame": (
        "200+30*.cos(2880*.t)+20*.t",
        "200+30*.sin(2880*.t)",
        lambda t: 200 + 30 * math.cos(16 * math.pi * t) + 20 * t,
        lambda t: 200 + 30 * math.sin(16 * math.pi * t),
        (),
    ),
}  # fmt: skip


@broad("fps", [7, 25, 60], first=1)
@pytest.mark.parametrize("kind", [kind for kind in KINDS if "still" not in kind])
def test_a_path_is_what_it_is_between_frames(kind: str, fps: float) -> None:
    x, y, fx, fy, breaks = KINDS[kind]
    end = math.floor(2 * fps) / fps
    path = _path(x, y, fps)
    missing, invented = _off(path, _truth(fx, fy, end, breaks))
    assert missing < OFF + 0.02
    assert invented < OFF + 0.02
    assert (path[:, 2] == 0).sum() == sum(0 < t <= end for t in breaks)


def test_the_drawing_is_the_same_at_every_rate_and_empty_where_a_point_jumps() -> None:
    """A linkage with a kink and a step at which its point is put elsewhere, both between frames."""
    text = (
        "C:.bar A=[0,0] B=[50,0]; R:.bar B=[0,0] S=[120,0]; D:.disc(4) O=[0,0]; T:.trace D.O .whole;"
        "@0 C.A=[150,150]; C.angle=360*.t; R.B=C.B; R.S=[_,150]; R.S.x > 150; D.O=(R.B+R.S)/2;"
        "@0.733 C.angle=263.88-200*.t; @1.313 D.O=[40,30*.t]; @2"
    )
    drawn = [_paths(f".config({fps},400,400); {text}")[0].path for fps in (7, 25, 60)]
    for path in drawn:
        (gap,) = np.flatnonzero(path[:, 2] == 0)
        assert abs(path[gap, 3] - 1.313) < 1e-6
        before, after = path[gap - 1], path[gap + 1]
        assert np.hypot(*(before[:2] - after[:2])) > 100
        assert np.hypot(*(after[:2] - (40, 0))) < OFF
        pieces = np.hypot(*np.diff(path[:, :2], axis=0).T)[(path[1:, 2] > 0) & (path[:-1, 2] > 0)]
        assert pieces.max() < 60  # nothing slanted across the jump
    for one, other in itertools.permutations(drawn, 2):
        a, b = (
            np.array([path[:-1, :2], path[1:, :2]])[:, (path[1:, 2] > 0) & (path[:-1, 2] > 0)] for path in (one, other)
        )
        middles = np.concatenate([a[0], (a[0] + a[1]) / 2])
        away = middles[:, None] - b[0]
        way = b[1] - b[0]
        part = np.clip((away * way).sum(-1) / np.maximum((way**2).sum(-1), 1e-30), 0, 1)
        assert np.hypot(*np.moveaxis(away - part[..., None] * way, -1, 0)).min(axis=1).max() < 2 * OFF


def test_what_stands_still_and_jumps_has_no_path() -> None:
    x, y, fx, fy, breaks = KINDS["steps that stand still"]
    path = _path(x, y, 10)
    for a, b in itertools.pairwise(path):
        assert (a[:2] == b[:2]).all() or not (a[2] and b[2])
    places = {(fx(t), fy(t)) for t in (0.0, *breaks)}
    assert {(round(x), round(y)) for x, y, shown, _ in path.tolist() if shown} == places | {(380, 50)}


@pytest.mark.parametrize("seed", range(12))
def test_random_pieces_of_lines(seed: int) -> None:
    random.seed(seed)
    count = random.randint(2, 5)
    cuts = sorted(round(random.uniform(0.1, 1.9), 3) for _ in range(count))
    pieces = [[round(random.uniform(-60, 60), 2) for _ in range(2)] for _ in range(count + 1)]
    heights = [round(random.uniform(50, 250), 1) for _ in pieces]

    def formula(axis: int) -> str:
        told = [f"{h} + {p[axis]}*.t" for h, p in zip(heights, pieces, strict=True)]
        return (
            "{" + "".join(f" .t < {cut} : {text};" for cut, text in zip(cuts, told, strict=False)) + f" {told[-1]} }}"
        )

    def value(axis: int, t: float) -> float:
        k = sum(cut <= t for cut in cuts)
        return heights[k] + pieces[k][axis] * t

    fps = random.choice([3, 7, 25, 29.97])
    path = _path(formula(0), formula(1), fps)
    end = path[-1, 3]
    missing, invented = _off(path, _truth(lambda t: value(0, t), lambda t: value(1, t), end, tuple(cuts)))
    assert missing < OFF + 0.02
    assert invented < OFF + 0.02


def test_a_path_through_infinity_has_a_gap_there() -> None:
    path = _path("100 + 5/(.t-0.7331)", "100*.t", 10)
    first, *more = np.flatnonzero(path[:, 2] == 0)
    last = [first, *more][-1]
    assert last - first == len(more)  # one after the other: a single gap
    assert abs(path[first, 3] - 0.7331) < 1e-6
    assert path[first - 1, 0] < -1e3 < 2e3 < path[last + 1, 0]


def test_a_path_begins_when_its_thing_appears_and_ends_where_there_is_no_solution() -> None:
    (trace,) = _paths(
        ".config(10,400,400); T:.trace D.O .whole; A:.bar P=[0,0] Q=[9,9]; D:.disc(4) O=[0,0]; "
        "@0 A.P=[9,9]; A.angle=9*.t; @0.333 D.O=[100*.t, 50]; @1"
    )
    shown = trace.path[trace.path[:, 2] > 0]
    assert shown[0, 3] == pytest.approx(1 / 3, abs=1e-3)


def test_a_linkage_goes_where_its_equations_say() -> None:
    text = (
        ".config(5,400,400); C:.bar A=[0,0] B=[50,0]; R:.bar B=[0,0] S=[120,0]; T:.trace M.O .whole;"
        " M:.disc(3) O=[0,0];"
        "@0 C.A=[150,150]; C.angle=360*.t; R.B=C.B; R.S.y=150; R.S.x > 150; M.O=(R.B+R.S)/2; @2 .loop;"
    )
    (trace,) = _paths(text)
    angle = np.linspace(0, 2 * np.pi, 2000)
    bx, by = 50 * np.cos(angle), 50 * np.sin(angle)
    sx = bx + np.sqrt(120**2 - by**2)
    truth = np.stack([150 + (bx + sx) / 2, 150 + by / 2], axis=1)
    missing, invented = _off(trace.path, truth)
    assert missing < OFF
    assert invented < OFF + 0.02
    np.testing.assert_allclose(trace.path[0, :2], trace.path[-1, :2], atol=1e-9)
