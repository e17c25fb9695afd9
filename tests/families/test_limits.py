"""Driving past a reach: told as that, with the times in closed form; and no frame that violates anything."""

import re

import numpy as np
import pytest

from tests.families.judging import broken_promises, errors_of, solved_as_written
from tests.families.limits import cases

RATES = (8, 25, 72)
VISIBLE = 1e-4
"""Of the script's length: a gap that is shorter may pass for a limit that is just reached."""


def time_told(text, word):
    found = re.search(rf"{word} t = ([-+0-9.e]*[0-9])", text)
    return float(found.group(1)) if found else np.nan


def wrong_about(case, rate):
    """What is wrong about a case at a frame rate; empty where all is right."""
    examination, motion, poses = solved_as_written(case.text, rate)
    errors = errors_of(examination)
    wrong = broken_promises(motion, poses)
    if not case.gaps:
        return [*wrong, *(f"false: {error.message}" for error in errors)]
    begin, end = case.gaps[0]
    if end - begin < VISIBLE * case.end:
        return wrong
    if examination.fault != 3 or not errors or errors[0].code != "solve/unreachable":
        return [*wrong, f"fault {examination.fault}: {[error.message for error in errors]}"]
    message = errors[0].message
    if not abs(time_told(message, "at") - begin) <= 1.1e-9 * case.end:
        wrong.append(f"not {begin}: {message}")
    if case.cut:
        return wrong
    if end < case.end - 1e-9 and not abs(time_told(message, "until") - end) <= 2e-9 * case.end:
        wrong.append(f"not until {end}: {message}")
    inside, near = frames_inside(case, motion, poses.times)
    if ((poses.solved == inside) & ~near).any():
        wrong.append(f"frames {np.nonzero((poses.solved == inside) & ~near)[0][:5]}")
    return wrong


def frames_inside(case, motion, times):
    """The frames within gaps, and those too near to their ends to tell."""
    inside, near = np.zeros(len(times), bool), np.zeros(len(times), bool)
    steps = [float(segment.start) for segment in motion.timeline.segments]
    for begin, end in case.gaps:
        inside |= (times > begin) & (times < end)
        near |= (np.abs(times - begin) < 1e-8 * case.end) | (np.abs(times - end) < 1e-8 * case.end)
        if any(abs(begin - step) < 1e-12 for step in steps):  # a step's new constant: from its own frame on
            inside |= np.abs(times - begin) < 1e-12
            near &= ~(np.abs(times - begin) < 1e-12)
        if end == case.end:
            inside |= times > begin
            near &= ~(times > end - 1e-8)
    return inside, near


@pytest.mark.slow
@pytest.mark.parametrize(("count", "seed"), [(6, 1), pytest.param(60, 2, marks=pytest.mark.slow)])
def test_driven_past_a_reach(count, seed):
    wrong = {}
    for number, case in enumerate(cases(count, seed)):
        found = wrong_about(case, RATES[number % 3])
        if found:
            wrong[number, case.name] = found, case.text
    print(f"{count} mechanisms driven past their reach, {len(wrong)} wrong")
    assert not wrong


@pytest.mark.slow
def test_frame_rate_changes_nothing():
    for case in cases(12, 3):
        assert not [(rate, found) for rate in RATES if (found := wrong_about(case, rate))], case.text


def test_several_binds_between_two_nodes():
    """Two dyads that end shortly after each other, stated in either order: the earlier end is told."""
    first = "A : .bar O=[0,0] M=[50,40]; B : .bar M=[50,40] Q=[100,0];"
    second = "C : .bar O=[0,200] M=[50,240]; D : .bar M=[50,240] Q=[100,200];"
    reach = 2 * np.hypot(50, 40)
    for here, there in ((20.0, 20.001), (20.001, 20.0)):
        text = f""".config(8); {first} {second}
        @0 A.O=[0,0]; B.M=A.M; B.Q=[100+{here}*.t,0]; C.O=[0,200]; D.M=C.M; D.Q=[100+{there}*.t,200];
        @3"""
        examination, motion, poses = solved_as_written(text, 8)
        message = errors_of(examination)[0].message
        assert abs(time_told(message, "at") - (reach - 100) / 20.001) < 1e-9
        assert ("`C`" in message) == (there > here)
        assert not broken_promises(motion, poses)


def test_a_step_out_of_reach_says_until_when():
    text = """.config(8); A : .bar O=[0,0] M=[30,40]; B : .bar M=[30,40] Q=[60,0];
    @0 A.O=[0,0]; B.M=A.M; B.Q=[60,0];
    @1 B.Q=[120,0];
    @2 B.Q=[60,0];
    @3"""
    examination, motion, poses = solved_as_written(text, 8)
    (error,) = errors_of(examination)
    assert (error.code, examination.fault) == ("solve/unreachable", 3)
    assert (time_told(error.message, "at"), time_told(error.message, "until")) == (1.0, 2.0)
    assert (poses.solved == ((poses.times < 1.0) | (poses.times >= 2.0))).all()
    assert not broken_promises(motion, poses)
