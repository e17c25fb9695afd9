"""Poles, polodes, inflection circles, polygons of velocities and skeletons, against closed forms."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import movimentum as mv
from movimentum.analysis.shown_numbers import inflection_circle, place_of, pole_of
from movimentum.drawing.compose import compose
from movimentum.drawing.model import FigureMark, PolodeMark, SymbolMark
from movimentum.drawing.picture_options import PictureOptions
from movimentum.drawing.polodes import polode
from movimentum.drawing.symbols import caption, moving_parts
from movimentum.rendering.prepare import prepare_drawing
from tests.broad import broad
from tests.command import ROOT
from tests.drawing.test_figures import solved

TRAMMEL = """.config(10, 500, 500);
Rod : .bar A = [0,0] B = A + [200,0];
F : .polode Rod .fixed;   M : .polode Rod .moving;   C : .centre Rod;   W : .inflection Rod;
@0  Rod.A = [0, y];  Rod.B = [x, 0];  Rod.angle = -30 - 36*.t;  Rod.B.x > -300;
@1
"""

CROSSED = """.config(20);
Base : .bar O = [0,0] Q = O + [60,0] .hidden;
One  : .bar O = [0,0] A = O + [0,100];
Two  : .bar Q = [60,0] B = Q + [0,100];
Link : .bar A = [0,0] B = A + [60,0];
F : .polode Link .fixed;   M : .polode Link .moving;
@0  Base.O = [0,0];  Base.angle = 0;  One.O = Base.O;  One.angle = -20 + 36*.t;
    Two.Q = Base.Q;  Link.A = One.A;  Link.B = Two.B;
    .across(Link.B, One.O, One.A) > 0;
@1
"""


def instants(motion, count=23):
    timeline = motion.timeline
    return [timeline.start + (timeline.end - timeline.start) * Fraction(k + 1, count + 1) for k in range(count)]


def motion_of(text):
    return mv.loads(text).solve().solution.motion


def number(motion, name):
    return next(thing.number for thing in motion.timeline.scene.things if thing.name == name)


def path(motion, name):
    scene = motion.timeline.scene
    (mark,) = (m for m in compose(scene, PictureOptions()).things
               if isinstance(m, PolodeMark) and m.paint.thing == number(motion, name))  # fmt: skip
    figure = polode(mark, scene, [motion.poses(0, motion.timeline.frame_count)], motion)
    return figure, np.concatenate([np.array(part.points) for part in figure.parts])


def test_the_pole_of_a_trammel_is_over_its_ends() -> None:
    motion = motion_of(TRAMMEL)
    times = instants(motion)
    poses = motion.poses_at(times)
    place = place_of(pole_of(motion, (0,), poses, times))
    a, b = (poses.world(0, anchor.local) for anchor in motion.timeline.scene.things[0].anchors)
    assert place == pytest.approx(np.stack([b[:, 0], a[:, 1]], axis=1), abs=1e-9)
    assert np.hypot(*place.T) == pytest.approx(np.full(len(times), 200.0), abs=1e-9)
    # every point of the moving polode goes on a straight line: it is the inflection circle
    middle, radius = inflection_circle(motion, 0, poses, times)
    assert middle == pytest.approx((a + b) / 2, abs=1e-8)
    assert radius == pytest.approx(np.full(len(times), 100.0), abs=1e-8)


def test_the_polodes_of_a_trammel_are_circles() -> None:
    motion = motion_of(TRAMMEL)
    fixed, points = path(motion, "F")
    assert np.hypot(*points.T) == pytest.approx(np.full(len(points), 200.0), abs=1e-9)
    moving, points = path(motion, "M")
    assert np.hypot(*(points - [100, 0]).T) == pytest.approx(np.full(len(points), 100.0), abs=1e-9)
    assert (fixed.body, moving.body) == (number(motion, "F"), 0)


def test_the_polodes_of_an_antiparallelogram_are_ellipses() -> None:
    motion = motion_of(CROSSED)
    _, points = path(motion, "F")
    assert len(points) > 3
    far = np.hypot(*points.T) + np.hypot(*(points - [60, 0]).T)
    assert far == pytest.approx(np.full(len(points), 100.0), abs=1e-9)
    _, points = path(motion, "M")
    assert np.hypot(*points.T) + np.hypot(*(points - [60, 0]).T) == pytest.approx(np.full(len(points), 100), abs=1e-9)


@pytest.mark.parametrize("text", [TRAMMEL, CROSSED], ids=["trammel", "antiparallelogram"])
def test_the_moving_polode_rolls_and_does_not_slip(text: str) -> None:
    motion = motion_of(text)
    body = number(motion, "Link" if "Link" in text else "Rod")
    timeline = motion.timeline
    times = [timeline.start + (timeline.end - timeline.start) * Fraction(k, 4000) for k in range(4001)]
    poses = motion.poses_at(times)
    fixed = place_of(pole_of(motion, (body,), poses, times))
    away = fixed - poses.origin[body]
    c, s = np.moveaxis(poses.direction[body], -1, 0)
    moving = np.stack([c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]], axis=1)
    steps = [np.hypot(*np.diff(curve, axis=0).T) for curve in (fixed, moving)]
    assert steps[0].sum() == pytest.approx(steps[1].sum(), rel=1e-7)
    assert steps[0] == pytest.approx(steps[1], rel=1e-5, abs=1e-9)


@broad("name", ["four-bar", "hoecken", "watt", "slider-crank", "whitworth"], first=4)
def test_three_poles_are_on_a_line(name: str) -> None:
    """Kennedy's theorem."""
    motion = mv.load(ROOT / "scripts" / f"{name}.mov").solve().solution.motion
    things = motion.timeline.scene.things
    moving = [thing.number for thing in things if thing.is_body and thing.anchors and thing.number
              in motion.timeline.scene.mentioned]  # fmt: skip
    times = instants(motion, 11)
    poses = motion.poses_at(times)
    for first in moving:
        for second in moving:
            for third in moving:
                if not first < second < third:
                    continue
                poles = [np.stack(pole_of(motion, pair, poses, times), axis=-1)
                         for pair in ((first, second), (second, third), (first, third))]  # fmt: skip
                sizes = [np.maximum(np.linalg.norm(pole, axis=1), 1e-6) for pole in poles]
                unit = [pole / size[:, None] for pole, size in zip(poles, sizes, strict=True)]
                assert np.abs(np.linalg.det(np.stack(unit, axis=1))).max() < 1e-9


ROLLING = """.config(10, 400, 200) .background('white');
W : .disc(40) C = [0,0] P = C + [40,0];
V : .velocities(W.C, W.P) at = [300,100] .scale(0.5);
C : .centre W .text('P');   D : .centre W Far;
Far : .bar A = [0,0] B = [10,0];
@0  W.C = [60 + 40*.t, 60];  W.angle = -180/.pi*.t;   Far.A = [10*.t, 0];  Far.angle = -180/.pi*.t;
@2
"""


def test_a_wheel_turns_about_the_point_where_it_touches() -> None:
    motion = motion_of(ROLLING)
    times = instants(motion)
    poses = motion.poses_at(times)
    place = place_of(pole_of(motion, (0,), poses, times))
    assert place == pytest.approx(np.stack([poses.origin[0, :, 0], np.full(len(times), 20.0)], axis=1), abs=1e-9)
    assert pole_of(motion, (0, number(motion, "Far")), poses, times)[2] == pytest.approx(
        np.zeros(len(times)), abs=1e-12
    )


EASED = """.config(10, 400, 300);
Rod : .bar A = [0,0] B = A + [140,0];   Arm : .bar A = [200,100] B = A + [0,90];
@0  Rod.A = [100 + 60*.ease(.t), 50];   Rod.B = [220, _];   Rod.B.y > 60;
    Arm.A = [200,100];   Arm.angle = 50*.ease(.t);
@1
"""


def test_a_pole_is_known_where_its_thing_begins_to_move() -> None:
    motion = motion_of(EASED).path
    times = [Fraction(0), Fraction(1, 2), Fraction(1)]
    poses = motion.poses_at(times)
    rod = place_of(pole_of(motion, (0,), poses, times))
    a, b = (poses.world(0, local) for local in ((0, 0), (140, 0)))
    assert rod == pytest.approx(np.stack([a[:, 0], b[:, 1]], axis=1), abs=1e-9)  # over A, beside B
    between = place_of(pole_of(motion, (0, 1), poses, times))
    # relative to the arm: on the line of both poles (Kennedy), where their angular velocities are as the distances
    ways = [between - rod, between - np.array([200.0, 100.0])]
    assert ways[0][:, 0] * ways[1][:, 1] == pytest.approx(ways[0][:, 1] * ways[1][:, 0], rel=1e-9, abs=1e-6)
    slope = 60 / np.array([b[k, 1] - a[k, 1] for k in range(3)])  # of the rod's angle, for d(ease) = 1
    arm = np.deg2rad(50)
    assert np.abs(slope * np.hypot(*ways[0].T)) == pytest.approx(np.abs(arm * np.hypot(*ways[1].T)), rel=1e-9)


def test_a_pole_at_infinity_is_an_arrow_at_the_edge() -> None:
    scene, poses = solved(ROLLING)
    marks = {item.mark.paint.thing: item.mark for item in prepare_drawing(scene, (poses,)).things
             if isinstance(item.mark, SymbolMark)}  # fmt: skip
    names = {thing.name: thing.number for thing in scene.things}
    near, far = (moving_parts(marks[names[name]], poses) for name in "CD")
    assert near[0].shown.all()
    assert not near[-1].shown.any()
    assert not far[0].shown.any()
    assert far[-1].shown.all()
    tip = far[-1].points[:, 0]
    assert (np.minimum(np.abs(tip - [200, 100]), [190, 90]) == np.abs(tip - [200, 100])).all()
    words = caption(marks[names["C"]], poses)
    assert words is not None
    assert words.texts[0] == "P"


def test_a_polygon_of_velocities_has_their_scale_and_names() -> None:
    scene, poses = solved(ROLLING)
    marks = [item.mark for item in prepare_drawing(scene, (poses,)).things
             if isinstance(item.mark, SymbolMark) and item.mark.kind.word == "velocities"]  # fmt: skip
    tips = [moving_parts(mark, poses)[-1].points[:, 0] for mark in marks]
    assert tips[0] == pytest.approx(np.tile([300 + 20, 100], (21, 1)), abs=1e-9)
    turn = -poses.times
    along = np.stack([40 + 40 * np.sin(turn), -40 * np.cos(turn)], axis=1)
    assert tips[1] == pytest.approx([300, 100] + 0.5 * along, abs=1e-9)
    assert [caption(mark, poses).texts[0] for mark in marks] == ["c", "p"]


def test_a_skeleton_draws_lines_between_joints(tmp_path: Path) -> None:
    text = (ROOT / "scripts" / "four-bar.mov").read_text("utf-8").replace("@0", "S : .skeleton;\n@0", 1)
    scene, poses = solved(text)
    marks = [item.mark for item in prepare_drawing(scene, (poses,)).things if isinstance(item.mark, FigureMark)]
    assert {len(part.points) for mark in marks for part in mark.parts if str(part.form) == "stroke"} <= {2, 3, 4}
    assert all(str(part.form) != "fill" or len(part.points) < 5 for mark in marks for part in mark.parts)
    assert math.isfinite(float(poses.times[0]))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("C : .centre R.A; @0", "about the whole thing: write `R`"),
        ("C : .centre; @0", "is about 1 or 2 things"),
        ("C : .centre R R; @0", "names a thing twice"),
        ("C : .centre Q; @0", "no thing called `Q`"),
        ("L : .line R.A R.B; C : .centre L; @0", "does not move by itself"),
        ("C : .inflection R S; @0", "is about 1 thing"),
        ("V : .velocities(R.A.x) at = [0,0]; @0", "a point has a velocity, and this is a number"),
        ("V : .velocities(R.A); @0", "needs at least 1 anchor"),
        ("C : .polode R .moving .moving; @0", "given twice"),
        ("C : .polode R .movng; @0", "did you mean `.moving`?"),
    ],
)
def test_what_has_no_pole_is_told(text: str, told: str) -> None:
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads(f"R : .bar A = [0,0] B = [9,0]; S : .bar A = [0,0] B = [9,0]; {text}")
    assert told in str(caught.value)


def test_a_pole_of_what_stands_still_is_not_drawn(tmp_path: Path) -> None:
    text = (
        ".config(5, 90, 90); R : .bar A = [20,20] B = [60,20]; C : .centre R; P : .polode R; I : .inflection R; @0 @1"
    )
    mv.loads(text).solve().render(tmp_path / "a.png", frames=0)
