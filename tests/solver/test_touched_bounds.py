"""Bounds that are touched exactly where two solutions meet: the motion goes over to the other one, and stays legal."""

import math

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad

HEAD = """.config(20,400,300);
Crank : .bar C=[100,50] P=C+{along};
Rod : .bar A=[0,0] B=A+{along};
@0 Crank.C=[100,50]; Crank.angle={turn}*.t; Rod.A=Crank.P; Rod.B=[100,50]+x*{unit}; {bound};
@{end}
"""
"""An isosceles slider-crank: x is 2 L cos(turn t), or 0 for good; the two meet where the crank stands upright."""

PARALLELOGRAM = """.config(20,400,300);
Crank : .bar C=[100,50] P=C+{up};
Coup : .bar A=[0,0] B=A+2*{along};
Rock : .bar D=[0,0] Q=D+{up};
@0 Crank.C=[100,50]; Crank.angle={turn}*.t; Coup.A=Crank.P; Rock.D=[100,50]+2*{along}; Rock.Q=Coup.B; {bound};
@{end}
"""


def errors(script):
    return [item for item in script.diagnostics if item.severity is mv.Severity.ERROR]


def filled(text, length, direction, turn, end, bound):
    c, s = math.cos(math.radians(direction)), math.sin(math.radians(direction))
    values = {"length": length, "turn": turn, "end": end, "c": repr(c), "s": repr(s)}
    along, up = f"[{length * c!r},{length * s!r}]", f"[{-length * s!r},{length * c!r}]"
    return text.format(along=along, up=up, unit=f"[{c!r},{s!r}]", bound=bound.format(**values), **values)


SCENES = [(80, 0, 90, 4), (12.3, 30, 90, 7.3), (80, 217, -47, 4), (1700, 90, 90, 4)]


@pytest.mark.parametrize("scene", SCENES)
@broad("bound", ["x >= 0", "2*x >= 0; x/3 + 5 >= 5", "(Rod.B - Crank.P).l >= {length}"], every=2)
def test_a_slider_stops_at_the_bound_that_it_touches(scene, bound):
    length, _, turn, end = scene
    script = mv.loads(filled(HEAD, *scene, bound))
    assert not errors(script)
    motion = script.solve()
    for t in np.linspace(0, end, 23):
        x = float(np.ravel(motion.at(float(t))["x"])[0])
        moves = abs(turn * t) <= 90 or not bound.startswith(("x", "2"))
        assert abs(x - (2 * length * math.cos(math.radians(turn * t)) if moves else 0.0)) < 1e-8 * length


@pytest.mark.parametrize("scene", SCENES)
def test_a_strict_bound_does_not_allow_to_stay_on_it(scene):
    (error,) = errors(mv.loads(filled(HEAD, *scene, "x > 0")))
    assert error.code == "solve/unreachable"


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(
    "bound", ["-{s}*(Rock.Q.x-Rock.D.x) + {c}*(Rock.Q.y-Rock.D.y) >= 0", "Coup.angle >= 0", "Rod_angle <= 90"]
)
def test_a_parallelogram_goes_over_where_it_is_flat(scene, bound):
    bound = bound.replace("Rod_angle", "Rock.angle")
    assert not errors(mv.loads(filled(PARALLELOGRAM, *scene, bound)))


@pytest.mark.parametrize("places", [0, 1, 2])
def test_bounds_that_are_exceeded_are_still_refused(places):
    """A little more than what is touched is too much."""
    text = filled(HEAD, 80, 0, 90, 4, "x >= " + repr(10.0 ** -(places + 2)))
    (error,) = errors(mv.loads(text))
    assert error.code == "solve/unreachable"
