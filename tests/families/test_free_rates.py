"""The derivative of what is free, trails or follows a wish, against differences of its path and closed forms."""

from math import cos, radians, sin

import numpy as np
import pytest

import movimentum as mv
from movimentum.errors import ScriptError
from tests.families.free_rates import scripts

TIMES = (0.371, 1.317, 1.871)
STEP = 1e-3
ROD = ".config(10); Rod : .bar P=[0,0] Q=[100,0]; Tail : .bar P=[0,0] Q=[100,0];"


def difference(motion, name, time):
    """Of order four."""
    first, before, after, last = motion.at([time + k * STEP for k in (-2, -1, 1, 2)])[name]
    return (8.0 * (after - before) - (last - first)) / (12.0 * STEP)


def judge(seed, kinds=slice(None)):
    for text, moved, accelerated in list(scripts(seed))[kinds]:
        motion = mv.loads(text).solve()
        for k, anchor in enumerate(moved):
            said = np.asarray(motion[f"v{k}"])
            np.testing.assert_allclose(said, motion.velocity(anchor), atol=1e-9, rtol=1e-9, err_msg=text)
            for time in TIMES:  # a path that is integrated to 1e-10 has differences to 1e-6 or so
                told = motion.at(time)[f"v{k}"]
                off = np.max(np.abs(difference(motion, anchor, time) - told))
                assert off <= 5e-6 * (1.0 + np.max(np.abs(told))), text
        for k, anchor in enumerate(accelerated):
            said = np.asarray(motion[f"a{k}"])
            np.testing.assert_allclose(said, motion.acceleration(anchor), atol=1e-8, rtol=1e-8, err_msg=text)
            name = f"v{moved.index(anchor)}"
            told = motion.at(TIMES[0])[f"a{k}"]
            assert np.max(np.abs(difference(motion, name, TIMES[0]) - told)) <= 2e-6 * (1.0 + np.max(np.abs(told))), (
                text
            )


@pytest.mark.slow
def test_derivatives_are_those_of_the_path():
    judge(0, slice(1, None, 6))  # what trails, and what follows a velocity


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(9))
def test_derivatives_are_those_of_the_path_in_many_scripts(seed):
    judge(seed)


def test_a_tractrix_has_its_closed_form():
    """A bar that is dragged along a line at speed u: its end moves along the bar at u cos(angle)."""
    tail = "Tail : .bar P=[0,0] Q=[0,100];"
    text = f".config(10); {tail} @0 Tail.P = [50*.t, 0]; v = .d(Tail.Q); w = .d(Tail.angle); a = .d(.d(Tail.Q)); @4"
    motion = mv.loads(text).solve()
    for time in (0.3, 1.0, 3.7):
        here = motion.at(time)
        phi = radians(float(here["Tail.angle"]) + 90.0)  # of the bar, from the end that is dragged
        # tan(phi / 2) grows as exp(u t / L), from 1
        assert 2.0 * np.degrees(np.arctan(np.exp(0.5 * time))) == pytest.approx(np.degrees(phi), abs=1e-8)
        assert here["v"] == pytest.approx([50 * cos(phi) * cos(phi), 50 * cos(phi) * sin(phi)], abs=1e-8)
        turning = 0.5 * sin(phi)  # radians per time unit
        assert here["w"] == pytest.approx(np.degrees(turning), abs=1e-8)
        assert here["a"] == pytest.approx([-50 * sin(2 * phi) * turning, 50 * cos(2 * phi) * turning], abs=1e-8)


def test_a_wish_with_a_speed_is_followed_as_its_velocity_says():
    """An anchor that nothing holds goes straight to its goal, at the wish's speed."""
    motion = mv.loads(".config(10); Dot : .disc(5) O=[0,0]; @0 Dot.O ~ [300,400] .speed(50); v = .d(Dot.O); @2").solve()
    np.testing.assert_allclose(motion["v"], np.tile([30.0, 40.0], (21, 1)), atol=1e-9)


def test_a_derivative_is_one_sided_at_a_kink_in_all_its_parts():
    text = (
        ROD
        + "@0 Rod.P=[0,0]; Rod.angle=30*.abs(.t-1); Tail.P=Rod.Q; v=.d(Tail.Q); w=.d(Rod.Q); u=.d(.min(.t,1)); @1.5 @2"
    )
    motion = mv.loads(text).solve()
    np.testing.assert_allclose(motion["v"], motion.velocity("Tail.Q"), atol=1e-9)
    np.testing.assert_allclose(motion["w"], motion.velocity("Rod.Q"), atol=1e-9)
    assert list(motion["u"][8:12]) == [1.0, 1.0, 0.0, 0.0]
    last = mv.loads(".config(10); @0 u = .d(.min(.t, 2)); w = .d(.abs(.t - 2)); @2").solve()
    assert (float(last["u"][-1]), float(last["w"][-1])) == (1.0, -1.0)  # in the last frame: as it came there


@pytest.mark.slow
def test_the_length_of_the_way_is_the_integral_of_the_speed():
    text = ROD + "@0 Rod.P=[0,0]; Rod.angle=40*.t; Tail.P=Rod.Q; v=.d(Tail.Q); way=.i(v.l); @1"
    motion = mv.loads(text.replace(".config(10)", ".config(100)")).solve()
    steps = np.diff(np.asarray(motion["Tail.Q"]), axis=0)
    assert float(motion["way"][-1]) == pytest.approx(float(np.sum(np.hypot(*steps.T))), rel=2e-5)


def test_claims_read_the_same_velocity():
    text = ROD + "@0 Rod.P=[0,0]; Rod.Q ~ [0,100] .speed(30); v=.d(Rod.Q); .claim v.l < 10; @2"
    with pytest.raises(ScriptError, match=r"`v\.l` is 21\.21, not below 10"):
        mv.loads(text).solve()


@pytest.mark.parametrize(
    ("code", "statements"),
    [
        ("cyclic-derivative", "Rod.P=[x,0]; Rod.angle=0; .d(x) = 10 - x;"),
        ("cyclic-derivative", "Rod.P=[0,0]; Rod.Q ~ [0,100] + 0.1*.d(Rod.Q);"),
        ("demanded-velocity", "Rod.P=[0,0]; Rod.Q ~ [0,100]; v = .d(Rod.Q); v.l = 20;"),
        ("demanded-velocity", "Rod.P=[0,0]; .d(Rod.Q) ~ [0,100];"),
        ("demanded-velocity", "Rod.P=[0,0]; v = .d(Rod.Q); v ~ [0,100];"),
        ("no-acceleration", "Rod.P=[0,0]; Rod.Q ~ [0,100]; a = .d(.d(Rod.Q));"),
        ("no-velocity", "Rod.P=[20*.t,y]; y = .i(Rod.Q.x/100 - y); v = .d(Rod.Q);"),
    ],
)
def test_a_derivative_that_nothing_tells_is_told(code, statements):
    with pytest.raises(ScriptError) as caught:
        mv.loads(f"{ROD} @0 {statements} @2").solve()
    (found,) = (item for item in caught.value.diagnostics if item.code == f"constraint/{code}")
    assert found.span is not None
    assert "'" not in found.message  # no unknown of the solver


@pytest.mark.slow
def test_variants_have_the_rates_of_their_own_scripts():
    text = ".let R = 60; " + ROD + "@0 Rod.P=[0,0]; Rod.Q ~ [0,R]; v=.d(Rod.Q); .claim v.l < 1e6; @2"
    swept = mv.loads(text).sweep({"R": [60, 80]}, measure={"top": ".max(v.l)"})
    for place, value in enumerate((60, 80)):
        alone = mv.loads(text, R=value).solve()
        top = float(np.max(np.hypot(*np.asarray(alone["v"]).T)))
        assert float(swept["top"][place]) == pytest.approx(top, rel=1e-9)
