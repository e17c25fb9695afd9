"""Themes, joints, texts with numbers, and anchors computed from others."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv
from movimentum.analysis.shown_numbers import with_shown_numbers
from movimentum.drawing.texts import number_text, written
from movimentum.scene.model import AnchorRef
from movimentum.scene.themes import THEMES
from tests.understand import scene_of

BARS = """.config(10, 400, 300)%s;
Crank   : .bar A = [110,80] B = A + [50,0]%s;
Coupler : .bar B = [0,0] P = B + [70,90] C = B + [150,0];
Rocker  : .bar C = [0,0] D = C - [0,130];
@0  Crank.A = [110,80];  Crank.angle = 90*.t;  Coupler.B = Crank.B;  Rocker.C = Coupler.C;
    Rocker.D = [290,80]; Rocker.C.y > Rocker.D.y;%s
@2
"""


def test_a_silent_script_of_links_looks_like_a_textbook():
    scene = scene_of(BARS % ("", "", ""))
    assert scene.config.theme == "textbook"
    assert scene.config.background is None
    assert set(scene.grounds) == {AnchorRef(0, 0), AnchorRef(2, 1)}
    assert scene.joints == {0: {0, 1}, 1: {0, 2}, 2: {0, 1}}
    assert all(thing.look.edge and thing.look.pins for thing in scene.things)
    assert len({thing.look.paint for thing in scene.things}) == 3


@pytest.mark.parametrize(
    ("config", "option", "statement"),
    [
        (" .background('white')", "", ""),
        ("", " .color('red')", ""),
        ("", " .width(4)", ""),
        ("", " .pins", ""),
        ("", "", " Crank.red = 100;"),
        ("", "; Pin : .disc(4) O = [0,0]", ""),
        ("", "; Rope : .line Crank.A Rocker.C", ""),
    ],
)
def test_a_script_that_says_something_is_drawn_as_it_always_was(config, option, statement):
    scene = scene_of(BARS % (config, option, statement))
    assert scene.config.theme is None
    assert not scene.grounds
    assert all(thing.look.edge is None for thing in scene.things)


@pytest.mark.parametrize("name", THEMES)
def test_a_theme_leaves_what_definitions_say(name):
    options = ".color('red') .width(20) .edge('blue') .pins(9)"
    scene = scene_of(BARS % (f" .theme('{name}')", f" {options}", ""))
    crank, coupler = scene.things[:2]
    assert crank.look.paint == (255, 0, 0)
    assert crank.look.width == 20
    assert crank.look.edge == (0, 0, 255)
    assert crank.look.pins == 9
    assert coupler.look.edge == THEMES[name].ink
    assert scene.config.background == THEMES[name].background
    assert scene_of(BARS % (f" .theme('{name}') .background('tan')", "", "")).config.background == (210, 180, 140)


@pytest.mark.parametrize(
    "statements",
    [
        "@1 Crank.A = [100,80];",
        "@1 Crank.A = _;",
        "@1 Crank.A = [110 + .t, 80];",
    ],
)
def test_a_pin_that_does_not_stay_has_no_support(statements):
    text = (BARS % ("", "", "")).replace("@2", f"{statements} @2")
    assert set(scene_of(text).grounds) == {AnchorRef(2, 1)}


def test_a_place_has_one_support():
    text = BARS % ("", "; G : .ground Crank.A", "")
    assert set(scene_of(text).grounds) == {AnchorRef(3, 1)}


def test_anchors_are_computed_from_earlier_ones():
    scene = scene_of(
        "A : .bar P = [10,20] Q = P + [30,0] M = (P + Q)/2 R = 2*P - M"
        "         S = P + [10,0].r(90) T = -P U = 3*(Q - P).r(180)/2; @0"
    )
    local = {anchor.name: anchor.local for anchor in scene.things[0].anchors}
    assert local["M"] == (25, 20)
    assert local["R"] == (-5, 20)
    assert local["S"] == pytest.approx((10, 30))
    assert local["T"] == (-10, -20)
    assert local["U"] == pytest.approx((-45, 0))


def test_texts_show_the_motion_in_every_frame():
    motion = mv.loads(
        ".config(4); A : .bar P = [0,0] Q = [10,0] .opacity(0.5);"
        "L : .label('{A.angle:.0f}° {x:+.1f} {A.opacity} {{}} {.t:.2f} {.T:.2f} {A.Q.y*2 + x:d}') at = [0,0];"
        "@1 A.P = [0,0]; A.angle = 90*.t; x = .t - 0.5; @2"
    ).solve()
    whole = motion.solution.motion
    poses = with_shown_numbers(whole, motion.poses())
    label = whole.timeline.scene.things[1]
    found = written(label.pieces, 1, poses)
    assert found[0] == "0° -0.5 0.5 {} 0.00 1.00 0"
    assert found[2] == "45° +0.0 0.5 {} 0.50 1.50 14"
    assert found[-1] == "90° +0.5 0.5 {} 1.00 2.00 20"


def test_a_variable_without_a_value_is_a_dash_and_zero_has_no_sign():
    assert number_text(float("nan"), ".1f") == "–"
    assert number_text(-0.04, ".1f") == "0.0"
    assert number_text(-0.04, "+.1f") == "+0.0"
    assert number_text(-0.06, ".1f") == "-0.1"
    assert number_text(2.6, "d") == "3"


def test_numbers_of_pictures_change_no_poses():
    motion = mv.loads(
        "A : .bar P = [0,0] Q = [10,0]; L : .label('{A.angle}') at = [0,0]; @0 A.P = [0,0]; A.angle = 9*.t; @1"
    ).solve()
    plain = motion.poses()
    shown = with_shown_numbers(motion.solution.motion, plain)
    assert not plain.properties
    assert np.array_equal(plain.origin, shown.origin)
