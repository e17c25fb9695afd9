"""Frame rates and time's direction, on motions that keep and that break the promise."""

import dataclasses

import pytest

from movimentum.analysis.invariance import at_other_rate, frame_rate_diagnostics, reverse_diagnostics
from movimentum.diagnostics import Severity
from tests.solver.scenes import motion_of

PARALLELOGRAM = """.config(7);
A : .bar O=[0,0] P=[50,0]; B : .bar O=[120,0] P=[170,0]; C : .bar P=[50,0] Q=[170,0];
@0 A.O=[0,0]; A.angle=100*.t; B.O=[120,0]; C.P=A.P; C.Q=B.P;
@2 A.angle = 200 + 50*.t^2;
@4"""


def test_a_parallelogram_keeps_both_through_its_change_points():
    motion = motion_of(PARALLELOGRAM)
    (told,) = frame_rate_diagnostics(motion, at_other_rate(motion), (), ())
    assert (told.code, told.severity) == ("check/fps-invariance", Severity.NOTE)
    (told,) = reverse_diagnostics(motion)
    assert (told.code, told.severity) == ("check/reverse", Severity.NOTE)
    assert "the motion is the same" in told.message


@pytest.mark.parametrize(
    ("statement", "word"), [("x = .i(3*.t);", "integrals"), ("B.P ~ [1,1];", "wishes"), ("D.O = [9*.t,9];", "freely")]
)
def test_what_cannot_be_reversed_is_not_tried(statement, word):
    text = PARALLELOGRAM.replace("@0 ", "D : .bar O=[0,0] P=[9,9];\n@0 " + statement)
    (told,) = reverse_diagnostics(motion_of(text))
    assert told.severity is Severity.NOTE
    assert "cannot be run backwards" in told.message
    assert word in told.message


def test_another_motion_is_told_with_where_and_when():
    # a motion whose poses are those of another crank: what a solver that depends on the frame rate would give
    motion = motion_of(PARALLELOGRAM)
    wrong = dataclasses.replace(motion_of(PARALLELOGRAM.replace("100*.t", "100*.t^1.001")), timeline=motion.timeline)
    (told,) = frame_rate_diagnostics(wrong, at_other_rate(wrong), (), ())
    assert told.severity is Severity.ERROR
    assert "the motion differs from t = 0" in told.message
