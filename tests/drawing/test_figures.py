"""Figures against what they should be: teeth, angles, distances, ends, paths, arrows."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum as mv
from movimentum.analysis.shown_numbers import with_shown_numbers
from movimentum.drawing.compose import compose
from movimentum.drawing.gears import gear_outline, rack_outline
from movimentum.drawing.model import FigureMark, SymbolMark
from movimentum.drawing.picture_options import PictureOptions
from movimentum.drawing.symbols import caption, moving_parts
from movimentum.rendering.prepare import prepare_drawing


def solved(text):
    motion = mv.loads(text).solve()
    whole = motion.solution.motion
    return whole.timeline.scene, with_shown_numbers(whole, motion.poses())


def symbol(scene, poses, shape):
    return symbols(shape, (item.mark for item in prepare_drawing(scene, (poses,)).things))[0]


def symbols(shape, marks):
    return [mark for mark in marks if isinstance(mark, SymbolMark) and mark.kind.word == shape]


def involute_half_angle(teeth, r, module):
    """Half the angle of a tooth at a radius, from the definition of the involute."""
    base = module * teeth / 2 * math.cos(math.radians(20))
    inv = lambda a: math.tan(a) - a  # noqa: E731
    return math.pi / (2 * teeth) + inv(math.radians(20)) - inv(math.acos(base / r))


@pytest.mark.parametrize("teeth", [8, 12, 17, 40, 90])
def test_teeth_are_involutes(teeth):
    module, pitch = 6.0, 3.0 * teeth
    scene, _ = solved(f"G : .gear({teeth}, 6) C = [300,300] D = C + [0,50]; @0")
    gear = scene.things[0]
    assert gear.tooth_direction == pytest.approx(90)
    outline, holes = gear_outline(gear)
    assert not holes
    polar = [(math.hypot(x - 300, y - 300), math.degrees(math.atan2(y - 300, x - 300))) for x, y in outline]
    assert max(r for r, _ in polar) == pytest.approx(pitch + module)
    assert min(r for r, _ in polar) == pytest.approx(pitch - 1.25 * module)
    base = pitch * math.cos(math.radians(20))
    dense = [  # points on the chords, too
        (x + (u - x) * k / 8, y + (v - y) * k / 8)
        for (x, y), (u, v) in zip(outline, [*outline[1:], outline[0]], strict=True)
        for k in range(8)
        if abs(math.hypot(x - 300, y - 300) - math.hypot(u - 300, v - 300)) > 1e-6
    ]
    checked = 0
    for x, y in dense:
        r = math.hypot(x - 300, y - 300)
        if not base * 1.0001 < r < pitch + module - 1e-9:
            continue
        turn = math.radians(math.degrees(math.atan2(y - 300, x - 300)) - 90)
        off = (turn + math.pi / teeth) % (2 * math.pi / teeth) - math.pi / teeth  # from the nearest tooth's middle
        assert abs(abs(off) - involute_half_angle(teeth, r, module)) * r < 0.02 * module
        checked += 1
    assert checked > 10 * teeth
    area = sum(x * v - u * y for (x, y), (u, v) in zip(outline, [*outline[1:], outline[0]], strict=True)) / 2
    assert math.pi * (pitch - 1.25 * module) ** 2 < area < math.pi * (pitch + module) ** 2


def test_few_teeth_are_pointed_and_do_not_cross():
    scene, _ = solved("G : .gear(3, 10) C = [0,0]; @0")
    outline, _ = gear_outline(scene.things[0])
    angles = np.unwrap([math.atan2(y, x) for x, y in outline])
    assert (np.diff(angles) > -1e-9).all()


def test_a_ring_has_a_tooth_in_its_direction_that_points_inwards():
    scene, _ = solved("R : .gear(30, 4) .inner C = [0,0] D = [10,10]; @0")
    rim, (hole,) = gear_outline(scene.things[0])
    pitch = 60.0
    distance = {round(math.degrees(math.atan2(y, x)), 3): math.hypot(x, y) for x, y in hole}
    tip = min(hole, key=lambda p: abs(math.degrees(math.atan2(p[1], p[0])) - 45.0))
    assert math.hypot(*tip) == pytest.approx(pitch - 4, abs=0.05)
    assert max(distance.values()) == pytest.approx(pitch + 5)
    assert min(math.hypot(x, y) for x, y in rim) > pitch + 5


def test_a_rack_has_a_tooth_at_its_first_anchor_and_its_teeth_on_the_left():
    scene, _ = solved("R : .rack(4, 5) A = [10,20] B = A + [0,30]; @0")
    outline = rack_outline(scene.things[0])
    # it runs up, so left is -x: the tip of the first tooth is above A
    tips = sorted((x, y) for x, y in outline if x == pytest.approx(5.0))
    assert len(tips) == 8
    assert (tips[0][1] + tips[1][1]) / 2 == pytest.approx(20)
    assert tips[2][1] - tips[0][1] == pytest.approx(5 * math.pi)
    assert max(x for x, _ in outline) == pytest.approx(10 + 3.25 * 5)


FILM = """.config(10, 300, 200);
A : .bar P = [50,50] Q = [130,50] .width(4);
B : .disc(3) O = [200,100];
S : .spring A.Q B.O .coils(5);   D : .dimension A.P A.Q .places(2);   N : .arc B.O A.P A.Q .places(1);
W : .arc A.Q A.P B.O .whole;     C : .cylinder A.Q B.O;               V : .vector A.Q .velocity(0.5) .text('v');
E : .vector A.Q .acceleration(0.1);
@0  A.P = [50,50];  A.angle = 90*.t;  B.O = [200, 100];
@2
"""


def test_values_are_those_of_the_motion():
    scene, poses = solved(FILM)
    mark = symbol(scene, poses, "dimension")
    assert set(caption(mark, poses).texts) == {"80.00"}
    arc = symbols("arc", compose(scene, PictureOptions()).things)
    slope = math.degrees(math.atan2(50, 150))
    for k, text in enumerate(caption(arc[0], poses).texts):
        assert text == f"{abs((9 * k - slope + 180) % 360 - 180):.1f}°"
    for k, text in enumerate(caption(arc[1], poses).texts):
        assert text == f"{(slope - 9 * k) % 360:.0f}°"


def test_the_arc_begins_and_ends_on_its_sides():
    scene, poses = solved(FILM)
    (part,) = moving_parts(symbol(scene, poses, "arc"), poses)
    for k in range(len(poses.frames)):
        first, last = part.points[k, 0] - (50, 50), part.points[k, -1] - (50, 50)
        assert math.atan2(first[1], first[0]) == pytest.approx(math.atan2(50, 150))
        assert (math.degrees(math.atan2(last[1], last[0])) - 9 * k + 180) % 360 == pytest.approx(180)
        assert np.hypot(*first) == pytest.approx(28)


def test_a_spring_ends_at_its_anchors():
    scene, poses = solved(FILM)
    mark = symbol(scene, poses, "spring")
    (part,) = moving_parts(mark, poses)
    assert part.points[:, 0] == pytest.approx(poses.world(0, (130.0, 50.0)))
    assert part.points[:, -1] == pytest.approx(poses.world(1, (200.0, 100.0)))
    x, y = np.moveaxis(part.points - part.points[:, :1], -1, 0)
    u, v = (part.points[:, -1] - part.points[:, 0]).T[..., None]
    away = abs(x * v - y * u) / np.hypot(u, v)
    assert away.max(axis=1) == pytest.approx(mark.size / 2)


def test_a_barrel_keeps_its_length():
    scene, poses = solved(FILM)
    parts = moving_parts(symbol(scene, poses, "cylinder"), poses)
    (barrel,) = [part for part in parts if part.style.closed]
    lengths = np.hypot(*(barrel.points[:, 1] - barrel.points[:, 0]).T)
    assert np.ptp(lengths) == pytest.approx(0, abs=1e-9)
    least = np.hypot(*(poses.world(0, (130.0, 50.0)) - (200, 100)).T).min()
    assert lengths[0] < least


def test_arrows_are_exact():
    scene, poses = solved(FILM)
    marks = [
        m for m in compose(scene, PictureOptions()).things if isinstance(m, SymbolMark) and m.kind.word == "vector"
    ]
    turn, rate = np.radians(90 * poses.times), math.radians(90)
    tips = [moving_parts(mark, poses)[1].points[:, 0] - poses.world(0, (130.0, 50.0)) for mark in marks]
    assert tips[0] == pytest.approx(0.5 * 80 * rate * np.stack([-np.sin(turn), np.cos(turn)], axis=1), abs=1e-9)
    assert tips[1] == pytest.approx(-0.1 * 80 * rate**2 * np.stack([np.cos(turn), np.sin(turn)], axis=1), abs=1e-9)


@pytest.mark.parametrize("loop", [True, False])
def test_the_whole_path_of_a_film_that_begins_again_is_closed(loop, tmp_path):
    text = ".config(10,120,120); A : .bar P=[0,0] Q=[50,0] .hidden; T : .trace A.Q .whole; @0 A.P=[60,60];"
    motion = mv.loads(f"{text} A.angle=40*.t; @9 {'.loop;' if loop else ''}").solve()
    motion.render(tmp_path / "a.png", frames=0)
    scene, whole = motion.solution.motion.timeline.scene, motion.solution.motion
    (path,) = prepare_drawing(scene, (motion.poses(),), PictureOptions(motion=whole)).paths
    assert path.path[-1, 3] == 9
    assert path.path[-1, :2] == pytest.approx(path.path[0, :2])


def test_pins_are_at_joints_only():
    scene, _ = solved(
        "A : .bar P=[0,0] M=[20,0] Q=[50,0] .pins(3); B : .bar P=[50,0] Q=[90,0] .pins .through(P,Q);"
        "@0 A.P=[0,0]; A.angle=.t; B.P=A.Q; B.angle=0; @1"
    )
    first, second = [item for item in compose(scene, PictureOptions()).things if isinstance(item, FigureMark)]
    assert {part.points for part in first.parts} == {((0.0, 0.0),), ((50.0, 0.0),)}
    assert {part.points for part in second.parts} == {((50.0, 0.0),)}


def test_an_acceleration_that_a_wish_leaves_open_is_told():
    text = (
        "A : .bar P = [0,0] Q = [50,0]; V : .vector A.Q .acceleration(0.1); @0 A.P = [0,0]; A.Q ~ [0,90] .speed(30); @1"
    )
    codes = [item.code for item in mv.loads(text).solve().diagnostics]
    assert "vector/undefined" in codes
    still = text.replace("A.Q ~ [0,90] .speed(30)", "A.angle = 9*.t")
    assert "vector/undefined" not in [item.code for item in mv.loads(still).solve().diagnostics]
