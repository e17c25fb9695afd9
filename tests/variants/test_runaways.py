"""Variants in which something runs away come out as they do one by one."""

import numpy as np

from movimentum.source import SourceText
from movimentum.variants.axes import Axis, VariantGrid
from movimentum.variants.measures import read_measures
from movimentum.variants.single import Variants
from movimentum.variants.sweep import SweepJob
from movimentum.workflow.choices import Choices
from tests.broad import broad

PIN = """.config(10, 60, 40); .let S = 5; Arm : .bar O=[0,0] A=[60,20]; Pin : .disc(4) C=[20,100];
@0 Arm.O=[0,0]; Arm.angle=S+40*.t; Pin.C=[_,100]; .across(Pin.C,Arm.O,Arm.A)=0; @2"""
DYAD = """.config(10, 60, 40); .let S = 5; A : .bar O=[0,0] P=[60,0]; L : .bar P=[60,0] X=[100,60];
@0 A.O=[0,0]; L.P=A.P; L.X=[S/(1-2*.t),60]; @1"""
FORMULA = """.config(10, 60, 40); .let S = 5; D : .disc(4) C=[0,0]; @0 D.C=[100*.tan(S + 40*.t),60]; @1"""
FIRST = {  # which variants bind, and when: the closed form
    PIN: lambda s: (180.0 - s - np.degrees(np.arctan2(20, 60))) / 40.0,
    FORMULA: lambda s: (90.0 - s) / 40.0,
}


@broad("text", [PIN, DYAD, FORMULA], first=1)
def test_what_runs_away_is_the_same_one_by_one(text):
    source, names = SourceText("a.mov", text), ("S",)
    values = np.linspace(5.0, 160.0, 24)[:, None]
    read = "Pin.C.x" if text == PIN else "L.X.x" if text == DYAD else "D.C.x"
    job = SweepJob(
        source, Choices(), VariantGrid((Axis(names, values),)), read_measures([("m", f".max({read})")], names)
    )
    rows = job.family().rows(np.arange(len(values)))
    alone = Variants(source, Choices(), names, job.measures)
    end = 2.0 if text == PIN else 1.0
    for k, (value,) in enumerate(values.tolist()):
        outcome, time, measured = alone.row({"S": value})
        assert rows.outcomes[k] == outcome.code, value
        np.testing.assert_allclose(rows.times[k], time, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(rows.measures[k], measured, rtol=1e-9, atol=1e-9)
        if text in FIRST and FIRST[text](value) > 0.0:
            first = FIRST[text](value)
            assert outcome.value == ("binds" if first < end else "ok")
            assert np.isnan(time) if first > end else abs(time - first) < 1e-9
