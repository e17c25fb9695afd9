"""What runs far away or through infinity: told with the time, at any frame rate; frames are right on both sides."""

import math
import re

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from movimentum.analysis.invariance import at_other_rate, frame_rate_diagnostics
from movimentum.diagnostics import Severity
from tests.broad import broad
from tests.families.judging import errors_of, solved_as_written
from tests.families.runaways import cases
from tests.solver.scenes import anchor

RATES = (10, 24, 7)
CLOSE = 1e-6
"""Of a film: frames this near to an end of a gap, or to infinity, are not judged."""
FAR = 1e7
"""Of the scene's size: what is as good as at infinity."""


def first_trouble(case):
    """What is to be told first, and when."""
    binds, poles = [gap[0] for gap in case.gaps], list(case.poles)
    found = [*((time, "solve/unreachable") for time in binds), *((time, "solve/runs-away") for time in poles)]
    return min(found, default=(None, None))


def wrong_about(case, rate):
    """What is wrong about a case at a frame rate; empty where all is right."""
    examination, motion, poses = solved_as_written(case.text, rate)
    with np.errstate(all="ignore"):  # truth is infinite, too
        where = {name: place(poses.times) for name, place in case.places.items()}
    errors = errors_of(examination)
    time, code = first_trouble(case)
    wrong = []
    if time is None:
        wrong += [f"false: {error.message}" for error in errors]
    elif not errors or errors[0].code != code or examination.fault != 3:
        wrong.append(f"not {code} at {time}: {[error.message for error in errors]}")
    else:
        told = float(re.search(r"at t = ([-0-9.e]+\d)", errors[0].message)[1])
        if not abs(told - time) <= 2e-9:
            wrong.append(f"not at {time}: {errors[0].message}")
        until = re.search(r"until t = ([-0-9.e]+\d)", errors[0].message)
        back = next((end for begin, end in case.gaps if begin == time), None)
        if until is not None and not (back is not None and abs(float(until[1]) - back) <= 2e-9):
            wrong.append(f"not until {back}: {errors[0].message}")
    times = poses.times
    inside = np.zeros(len(times), bool)
    for begin, end in case.gaps:
        inside |= (times > begin) & (times < end)
    ends = [*(end for gap in case.gaps for end in gap), *case.poles]
    near = np.min(np.abs(times[:, None] - np.array([*ends, 9.0])), axis=1) < CLOSE
    for there in where.values():
        near |= ~inside & ~(np.hypot(*there.T) < FAR * motion.size)
    at = np.min(np.abs(times[:, None] - np.array([*case.poles, 9.0])), axis=1) < 1e-12
    if (bad := ~near & (poses.solved == inside)).any():
        wrong.append(f"frames {np.nonzero(bad)[0].tolist()} are {'lost' if inside[bad].sum() == 0 else 'false'}")
    if (at & poses.solved).any():
        wrong.append(f"frames at infinity: {np.nonzero(at & poses.solved)[0]}")
    judged = np.nonzero(poses.solved & ~near & ~inside)[0]
    for name, there in where.items():
        there = there[judged]
        off = np.hypot(*(anchor(motion, poses, name)[judged] - there).T) / (motion.size + np.hypot(*there.T))
        if (off > 1e-8).any():
            wrong.append(f"{name} is off by {np.max(off):.1e}, first in frame {judged[np.argmax(off > 1e-8)]}")
    return wrong


@pytest.mark.slow
@pytest.mark.parametrize(("count", "seed"), [(6, 1), pytest.param(400, 2, marks=[pytest.mark.slow, pytest.mark.long])])
def test_what_runs_away_is_told_and_comes_back(count, seed):
    wrong = {}
    for number, case in enumerate(cases(count, seed)):
        found = wrong_about(case, RATES[number % 3])
        if found:
            wrong[number, case.name] = found, case.text
    print(f"{count} mechanisms with something that runs away, {len(wrong)} wrong")
    assert not wrong


PIN = """Arm : .bar O=[0,0] A=[60,20]; Pin : .disc(4) C=[20,100];
@0 Arm.O=[0,0]; Arm.angle={start}+100*.t; Pin.C=[_,100]; .across(Pin.C, Arm.O, Arm.A)=0; @2"""


@broad("rate", [7, 10, 20, 100], first=1)
@pytest.mark.parametrize("at", [0.0, 0.3, 1.5, 1.5656505])
def test_one_message_at_any_frame_rate(rate, at):
    start = 180.0 - np.degrees(np.arctan2(20, 60)) - 100.0 * at
    examination, motion, poses = solved_as_written(PIN.format(start=repr(float(start))), rate)
    (error,) = errors_of(examination)
    assert (error.code, examination.fault) == ("solve/runs-away", 3)
    told = re.fullmatch(r"`Pin` runs away to infinity at t = (.*)", error.message)
    assert told is not None
    assert float(told[1]) == pytest.approx(at, abs=1e-9)
    assert poses.solved.tolist() == [min(abs(time - at), abs(time - at - 1.8)) > 1e-9 for time in poses.times.tolist()]
    other = at_other_rate(motion)
    (same,) = frame_rate_diagnostics(motion, other, examination.diagnostics, examine(other).diagnostics)
    assert same.severity is Severity.NOTE
    (differs,) = frame_rate_diagnostics(motion, other, (), examine(other).diagnostics)
    assert differs.severity is Severity.ERROR
    assert error.message in differs.message


@pytest.mark.parametrize(
    ("statements", "message"),
    [
        ("D.C = [x, 0]; x = 9/(1 - 2*.t);", "`x` runs away to infinity at t = 0.5, and `D` with it"),
        ("D.C = [x, 0]; (0.5-.t)^2*x^2 + 30*x*(.t-0.5) - 900 = 0;", "`x` runs away to infinity at t = 0.5, and `D`"),
        ("D.C = [9, 0]; D.angle = 9/(1 - 2*.t);", "`D.angle` runs away to infinity at t = 0.5"),
        ("D.C = [9/.t, 0];", "`D` runs away to infinity at t = 0"),
        ("D.C = [9/(1 - .t), 0];", "`D` runs away to infinity at t = 1"),
    ],
)
def test_what_runs_away_is_named(statements, message):
    examination, _, _ = solved_as_written(f"D : .disc(4) C=[0,0]; @0 {statements} @1", 10)
    (error,) = errors_of(examination)
    assert error.message.startswith(message)


@pytest.mark.parametrize("rate", [10, 7])
@pytest.mark.parametrize(
    ("formula", "limit"),
    [
        (".sin(50*(.t-0.5))/(.t-0.5)", math.radians(50)),
        ("((.t-0.5)^3 + 3*(.t-0.5))/(.t-0.5)", 3.0),
        ("(.exp(2*(.t-0.5))-1)/(.t-0.5)", 2.0),
    ],
)
@pytest.mark.parametrize(
    "scene",
    [
        "A:.bar O=[0,0] P=[60,0]; @0 A.O=[0,0]; A.angle={}; @1",
        "A:.disc(4) P=[60,0]; @0 A.P=[{},10]; @1",
        "A:.bar O=[0,0] P=[60,0]; L:.bar P=[60,0] X=[100,60]; @0 A.O=[0,0]; L.P=A.P; L.X=[100+{},60]; @1",
    ],
)
def test_what_has_no_value_at_one_instant_has_the_limit(scene, formula, limit, rate):
    examination, motion, poses = solved_as_written(scene.format(formula), rate)
    assert errors_of(examination) == []
    assert poses.solved.all()
    _, _, exact = solved_as_written(scene.format(repr(limit)), rate)
    if rate == 10:
        place = anchor(motion, poses, "A.P")[5]
        # extrapolated from twelve points beside, to what rounding there leaves
        assert place == pytest.approx(anchor(motion, exact, "A.P")[0], abs=1e-9)
