"""A mechanism is the same mechanism wherever it stands and however large it is: directions agree with those at the
origin, to what the script's own numbers are rounded by.
"""

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from movimentum.arrays import least_squares, solutions
from movimentum.solver.start.best_fit import _levenberg_marquardt
from movimentum.solver.start.requirements import WorkBudget
from tests.solver.scenes import motion_of

FOUR_BAR = """A:.bar O={d0,0} P={d35,0}; R:.bar O={d90,0} P={d90,60}; C:.bar A={d35,0} B={d90,60};
    @0 A.O=%s; A.angle=90*.t; R.O=%s; C.A=A.P; C.B=R.P; @4"""
SCENES = {
    "two pins": "A:.bar O={d0,0} P={d60,0}; @0 A.O={0,0}; A.P={60,0}; @1",
    "four-bar": FOUR_BAR % ("{0,0}", "{90,0}"),
    "relative": FOUR_BAR % ("{0,0}", "A.O + [(90),0]"),
    "variable": (FOUR_BAR % ("o", "o + [(90),0]")).replace("@0", "@0 o={0,0};"),
    "constant": ".let o={0,0}; " + FOUR_BAR % ("o", "o + [(90),0]"),
    "slider": """A:.bar O={d0,0} P={d35,0}; R:.bar A={d35,0} B={d125,0};
    @0 A.O={0,0}; A.angle=90*.t; R.A=A.P; R.B=[x,(Y)]; x > A.O.x; @4""",
    "coordinates": """A:.bar O={d0,0} P={d35,0}; R:.bar A={d35,0} B={d125,0};
    @0 A.O.x=(X); A.O.y=(Y); A.angle=90*.t; R.A=A.P; R.B.y=A.O.y; R.B.x > A.O.x; @4""",
    "slot": """A:.bar O={d0,0} P={d35,0}; S:.bar A={d-50,0} B={d80,0};
    @0 A.O={0,0}; A.angle=90*.t; S.A={-50,0}; .across(A.P,S.A,S.B)=0; @4""",
    "distances": """C:.bar O={d0,0} P={d35,0}; D:.disc((1)) c={d60,60};
    @0 C.O={0,0}; C.angle=90*.t; (D.c-C.P).l=(80); (D.c-{100,0}).l=(90); D.c.y > (Y); @4""",
    "turned arrow": """A:.bar O={d0,0} P={d35,0}; R:.bar A={d35,0} B={d125,0};
    @0 A.O={0,0}; A.P=A.O+[(35),0].r(90*.t); R.A=A.P; R.B.y=(Y); R.B.x > A.P.x; @4""",
    "direction": "A:.bar O={d0,0} P={d35,0}; @0 A.O={0,0}; .a([1,0], A.P - A.O) = 150 + 90*.t; @4",
    "direction first": "A:.bar O={d0,0} P={d35,0}; @0 A.O={0,0}; 10 + 90*.t = .a(A.P - A.O, [3,4]); @4",
    "moving": "A:.bar O={d0,0} P={d35,0}; @0 A.O={0,0}+[(30),0]*.t; A.angle=90*.t; @4",
    "eased": "A:.bar O={d0,0} P={d35,0}; @0 A.O={0,0} -> {50,20}; A.angle=0 -> 90; @4",
    "wished": "A:.bar O={d0,0} P={d35,0}; @0 A.O={0,0}; A.P ~ {0,100} .speed((20)); @4",
    "free": "A:.bar O={d0,0} P={d35,0}; R:.bar A={d35,0} B={d125,0}; @0 A.O={0,0}; A.angle=90*.t; R.A=A.P; @4",
}
"""``{x,y}`` is a place, ``{dx,y}`` one in a definition, ``(l)`` a length, ``(X)`` and ``(Y)`` where the origin is."""


def script(name, size=1.0, place=(0.0, 0.0), drawn_there=True):
    import re

    def number(match, axis, away=True):
        return repr(size * float(match) + (place[axis] if away else 0.0))

    def at(found):
        away = drawn_there or not found[1]
        return f"[{number(found[2], 0, away)}, {number(found[3], 1, away)}]"

    text = re.sub(r"\{(d?)([-\d.]+),([-\d.]+)\}", at, SCENES[name])
    text = text.replace("(X)", repr(place[0])).replace("(Y)", repr(place[1]))
    return ".config(6); " + re.sub(r"\(([\d.]+)\)(?!\*)", lambda found: number(found[1], 0, False), text)


def directions(text):
    motion = motion_of(text)
    examined = examine(motion)
    assert not examined.fault, (text, [item.message for item in examined.diagnostics])
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all(), text
    return poses.direction


def assert_the_same(name, size, place, drawn_there):
    off = np.max(np.abs(directions(script(name, size, place, drawn_there)) - directions(script(name))))
    assert off < (1e-8 if name in ("free", "wished") else 1e-12) + 1e-15 * max(map(abs, place)) / size / 35, name


@pytest.mark.parametrize("name", [name for name in SCENES if name not in ("free", "wished")])
def test_a_translation_is_no_contradiction(name):
    assert_the_same(name, 1.0, (3e11, -1e12), drawn_there=name != "variable")


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("drawn_there", [True, False])
def test_wherever_and_however_large(name, drawn_there):
    for size, place in [
        *((1.0, (x, -x)) for x in (1e9, 1e11, 1e13, 1e15)),
        *((size, (0.0, 0.0)) for size in (1e-12, 3e8, 1e100)),
        (1e-6, (1e3, 1e3)),
    ]:
        assert_the_same(name, size, place, drawn_there)


@pytest.mark.parametrize("far", [1e7, 1e10, pytest.param(1e15, marks=pytest.mark.slow)])
def test_stated_lengths_may_be_much_larger_than_what_is_drawn(far):
    directions(
        f""".config(6); A:.disc(4) P=[0,0]; B:.disc(4) P=[1,2];
        @0 A.P=[{0.3 * far!r}*.t,0]; (B.P-A.P).l={3 * far!r}; (B.P-[{3 * far!r},0]).l={2 * far!r}; B.P.y>0; @1"""
    )


def test_a_singular_matrix_is_one_solution_less():
    matrices = np.array([np.eye(2), np.zeros((2, 2)), [[2.0, 0.0], [0.0, 4.0]]])
    found = solutions(matrices, np.ones((3, 2)))
    assert np.array_equal(np.isnan(found).all(axis=1), [False, True, False])
    assert np.array_equal(found[[0, 2]], [[1.0, 1.0], [0.5, 0.25]])
    assert np.isnan(least_squares(np.full((2, 2), np.nan), np.ones(2))).all()


def test_a_fit_survives_slopes_that_outgrow_its_damping():
    def at(z):
        slopes = np.full((len(z), 2, 2), 1e30)  # of rank one, and 1e-3 vanishes beside their squares
        return np.full((len(z), 2), 1.0), slopes

    assert np.isfinite(_levenberg_marquardt(at, np.zeros((3, 2)), 10, WorkBudget(1e9))).all()
