"""Small parts of the solver, each against a value that is known."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import movimentum as mv
from movimentum.solver.accuracy.polish import RefinedPoses
from movimentum.solver.basis.bisection import bisected
from movimentum.solver.basis.instants import at_frames, at_times

BAR = ".config(10); Bar : .bar A = [0, 0] B = A + [20, 0]; @0 {} Bar.angle = 0; @2"


@pytest.mark.parametrize("drive", ["1 - 3*.t", "1 - 6*.sin(30*.t)", "1 - .t*.t*3"])
def test_a_path_ends_exactly_at_its_fold(drive):
    """s^3 - 3 s has its least value for s > 0 at s = 1: -2, which each drive reaches at t = 1."""
    text = BAR.format(f"Bar.A = [10*s, 0]; s*s*s - 3*s = {drive}; s > 0;")
    motion = mv.loads(text).solve(on_failure="hold").solution.motion
    (trouble,) = motion.segments[0].failures
    assert trouble.begin == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize(("formula", "value"), [(".sin(180*.t)/(.t - 1)", -np.pi), ("(.t*.t - 1)/(.t - 1)", 2.0)])
def test_one_instant_without_a_value_is_filled_in(formula, value):
    """0/0 at t = 1, which is a frame."""
    motion = mv.loads(BAR.format(f"Bar.A = [x, 0]; x = {formula};")).solve()
    assert not motion.solution.motion.segments[0].failures
    assert motion["x"][10] == pytest.approx(value, abs=1e-6)


@pytest.mark.parametrize("step", [Fraction(1, 25), Fraction(1, 3**40), Fraction(10**15 + 1, 7), Fraction(3**35, 2**60)])
def test_clocks_in_frames_are_exact_fractions_rounded_once(step):
    starts = (Fraction(0), Fraction(1, 3), Fraction(-22, 7))
    frames = np.arange(1000)
    found = at_frames(starts, Fraction(1, 9), Fraction(5, 11), step, frames)
    exact = at_times(starts, Fraction(1, 9), [Fraction(5, 11) + int(k) * step for k in frames])
    assert found.tau.tolist() == exact.tau.tolist()
    for one, other in zip(found.clocks, exact.clocks, strict=True):
        assert one.tolist() == other.tolist()
    plain = at_frames((Fraction(0),), Fraction(0), Fraction(0), step, frames)
    assert plain.tau.tolist() == [float(int(k) * step) for k in frames]


def test_zero_has_no_sign_in_text():
    motion = mv.loads(BAR.format("Bar.A = [x, 0]; x = 0*(-1 - .t);")).solve(accuracy="high")
    poses = motion.solution.motion.poses(0, 3)
    assert isinstance(poses, RefinedPoses)
    assert poses.texts(-poses.scalars["x", None]) == ["0.0", "0.0", "0.0"]


@pytest.mark.parametrize("end", [0.1, 1.0 / 3.0, 2.5, 7.0 - 1e-12])
def test_what_ends_is_located_to_the_last_digit(end):
    good, bad = bisected(lambda tau: tau <= end, 0.0, 7.0)
    assert (good, bad) == (end, np.nextafter(end, np.inf))
