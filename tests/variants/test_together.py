"""Variants that are solved together come out as they do one by one: on gallery scripts with numbers that vary."""

from __future__ import annotations

import random

import numpy as np
import pytest

import movimentum as mv
from movimentum.errors import NoSolutionError, ScriptError
from movimentum.source import SourceText
from movimentum.variants.axes import Axis, VariantGrid
from movimentum.variants.family import Family
from movimentum.variants.measures import read_measures
from movimentum.variants.outcomes import VariantOutcome
from movimentum.variants.single import Variants
from movimentum.variants.sweep import SweepJob
from movimentum.variants.together.preparation import prepare
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import understand
from tests.broad import broad
from tests.command import ROOT

from .edited import varied

DYADS = ["four-bar", "hart", "hoecken", "klann", "slider-crank", "watt", "trammel", "pantograph"]
LARGER = ["jansen", "whitworth", "peaucellier", "excavator", "jansen-walker", "coupling-rods", "maximum", "scotch-yoke"]
OTHERS = ["stephenson", "oscillating-engine", "acceleration", "planetary", "geneva-slots", "walschaerts", "locomotive"]


def measured(source, choices=None) -> list[tuple[str, str]]:
    """A few measures of a script."""
    things = [t for t in understand(source, choices or Choices()).things if t.is_body and t.anchors]
    texts = [f".mean({t.name}.{t.anchors[-1].name}.x)" for t in things[:3]]
    texts += [f".at({t.name}.{t.anchors[0].name}.y, 1/3)" for t in things[-2:]]
    texts += [f".rms({t.name}.angle)" for t in things if len(t.anchors) > 1][:2]
    return [(f"m{k}", text) for k, text in enumerate(texts)]


def compared(name: str, seed: int, spread: float, count: int, each: int = 1) -> Family:
    """Solve random variants together, and one of ``each`` by itself; the family that solved them together."""
    generator = random.Random(f"{name} {seed}")
    for _ in range(20):
        source, names = varied(name, generator, generator.choice([1, 2, 3]))
        try:
            understand(source, Choices())
        except ScriptError:
            continue  # the number was one that must be whole, say
        break
    values = 1.0 + spread * np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(names)))
    job = SweepJob(source, Choices(), VariantGrid((Axis(names, values),)), read_measures(measured(source), names))
    family = job.family()
    rows = family.rows(np.arange(len(values)))
    alone = Variants(source, Choices(), names, job.measures)
    for k, row in list(enumerate(values.tolist()))[::each]:
        outcome, time, measures = alone.row(dict(zip(names, row, strict=True)))
        told = f"{names} = {row}"
        assert rows.outcomes[k] == outcome.code, told
        np.testing.assert_allclose(rows.times[k], time, rtol=0.0, atol=1e-9, err_msg=told)
        np.testing.assert_allclose(rows.measures[k], measures, rtol=1e-9, atol=1e-9, err_msg=told)
    return family


@broad("each", [4, pytest.param(1, marks=pytest.mark.slow)], first=1)
@broad("name", DYADS, fast=("four-bar", "trammel"))
def test_dyads_are_solved_together(name, each):
    family = compared(name, 0, 0.05, 16, each)
    assert family.together > family.alone, family.reasons


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", [*DYADS, *LARGER])
def test_variants_that_also_fail(name, seed):
    compared(name, seed, 0.25, 16)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", OTHERS)
def test_everything_else_is_solved_one_by_one_or_the_same(name):
    compared(name, 3, 0.1, 14)


TRIAD = """
.let L = 120; .let s = 1;
Base : .plate A=[0,0] B=[300,0] C=[150,260];   Plat : .plate A=[0,0] B=[60*s,0] C=[30*s,52*s];
R1 : .bar P=[0,0] Q=[L,0];   R2 : .bar P=[0,0] Q=[L,0];   R3 : .bar P=[0,0] Q=[L,0];
K1 : .bar P=[0,0] Q=[40,0];  K2 : .bar P=[0,0] Q=[40,0];  K3 : .bar P=[0,0] Q=[40,0];
@0 Base.A=[50,50]; Base.angle=0;
   K1.P=Base.A; K1.angle=30+40*.sin(90*.t); K2.P=Base.B; K2.angle=100+20*.sin(90*.t); K3.P=Base.C; K3.angle=250;
   R1.P=K1.Q; R2.P=K2.Q; R3.P=K3.Q; R1.Q=Plat.A; R2.Q=Plat.B; R3.Q=Plat.C;
@1
"""


@pytest.mark.slow
@pytest.mark.parametrize("each", [7, 3])
def test_an_irreducible_loop_has_the_same_assembly_mode_and_motion(each):
    script = mv.loads(TRIAD)
    measure = {"x": ".range(Plat.A.x)", "turn": ".max(Plat.angle)", "mean": ".mean(R1.angle)"}
    table = script.sweep(L=[118, 125, 131, 140], s=[0.85, 0.95, 1.1], measure=measure)
    for k in range(0, len(table), each):
        motion = mv.loads(TRIAD, L=table["L"][k], s=table["s"][k]).solve()
        found = [np.ptp(motion["Plat.A.x"]), motion["Plat.angle"].max(), motion["R1.angle"].mean()]
        np.testing.assert_allclose([table[name][k] for name in measure], found, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_a_loop_of_variants_is_solved_side_by_side():
    grid = VariantGrid((Axis(("L", "s"), np.random.default_rng(1).uniform([118, 0.85], [140, 1.1], (14, 2))),))
    job = SweepJob(mv.loads(TRIAD).source, Choices(), grid, read_measures(["x = .range(Plat.A.x)"]))
    family = job.family()
    family.rows(np.arange(14))
    assert family.together >= 12, family.reasons


STEPS = """
.let T = 1;  .let R = 50;  .let n = 3;
Arm[1..n] : .bar O = [0,0] P = [R,0];
@0  .for k = 1..n { Arm[k].O = [100*k, 100]; Arm[k].angle = 90*.t; }
@T  .for k = 1..n { Arm[k].angle = 90*T + 30*.t; }
@2*T
"""


@pytest.mark.slow
def test_constants_that_decide_times_and_numbers_of_things():
    script = mv.loads(STEPS)
    table = script.sweep(
        T=[0.5, 1, 1.5],
        n=[1, 2],
        R=np.linspace(40, 60, 5),
        measure={"y": ".max(Arm[1].P.y)", "x": ".min(Arm[1].P.x)/R"},
    )
    assert table.ok.all()
    for k in range(0, len(table), 7):
        constants = {name: table[name][k] for name in ("T", "n", "R")}
        motion = mv.loads(STEPS, **constants).solve()
        assert table["y"][k] == pytest.approx(motion["Arm[1].P.y"].max(), rel=1e-9)
        assert table["x"][k] == pytest.approx(motion["Arm[1].P.x"].min() / constants["R"], rel=1e-9)


def test_a_variant_that_binds_is_a_row_with_its_time():
    text = "Rod : .bar A=[0,0] B=[L,0]; @0 Rod.A=[0,0]; Rod.B=[30 + 40*.t, y]; y > 0; @1"
    table = mv.loads(f".let L = 80; {text}").sweep(L=np.linspace(21, 91, 15), measure={"y": ".min(y)"})
    for length, outcome, time, y in zip(table["L"], table.outcome, table.time, table["y"], strict=True):
        if length < 30:
            assert (outcome, time) == ("cannot be assembled", 0.0)
            with pytest.raises(NoSolutionError):
                mv.loads(f".let L = 80; {text}", L=length).solve()
        elif length < 70:
            assert outcome == "binds"
            assert time == pytest.approx((length - 30) / 40, abs=1e-9)
            assert np.isnan(y)
        elif length > 70:
            assert outcome == "ok"
            assert y == pytest.approx(np.sqrt(length**2 - 70**2), rel=1e-9)


def test_dyads_that_bind_are_solved_together():
    text = ".let L = 80; Rod : .bar A=[0,0] B=[L,0]; @0 Rod.A=[0,0]; Rod.B=[30 + 40*.t, y]; y > 0; @1"
    grid = VariantGrid((Axis(("L",), np.linspace(31, 69, 20)[:, None]),))
    family = SweepJob(mv.loads(text).source, Choices(), grid, read_measures([])).family()
    rows = family.rows(np.arange(20))
    assert (rows.outcomes == 1).all()
    assert family.alone <= 2, family.reasons


def gallery(name: str, *changes: tuple[str, str]) -> str:
    """A gallery script with constants in place of numbers."""
    text = (ROOT / "scripts" / f"{name}.mov").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


WHITWORTH = ".let e = 45; .let L = 190; .let q = 142; " + gallery(
    "whitworth", ("axle + [0, r/2]", "axle + [0, e]"), ("T + [190, 0]", "T + [L, 0]"), ("Q + [142, 0]", "Q + [q, 0]")
)
"""Where the pin would leave its slot, an inequality ends the motion."""
PLANETARY = ".let w = 240; .let q = 25; " + gallery("planetary", ("240*.t", "w*.t"), ("[0, 25]", "[0, q]"))
CLOCKWORK = ".let w = 450; .let q = 88; " + gallery("clockwork", ("450*.t", "w*.t"), ("C + [0, 88]", "C + [0, q]"))
GRAVITY = """
.let L = 110; .let g = 300; .let v0 = 90;
Bar : .bar P = [0,0]  M = P + [L/2,0]  Q = P + [L,0];   Link : .bar A = [0,0]  B = [140,0];
@0  Bar.angle = 20*.t;  Bar.M = [200,200] + .i(v + .i([0,-g]));  v = [v0, v0*.cos(30*.t)];
    Link.A = Bar.Q;  Link.B = [x, 100];  x > Bar.Q.x;
@0.7 Bar.angle = 14 + 40*.t;
@1
"""
PENDULUM = """
.let L = 100; .let a0 = 40; .let k = 0.3;
Rod : .bar O = [0,0]  P = [0,-L];   Link : .bar A = [0,0]  B = [2.2*L,0];
@0  Rod.O = [200,200];  Rod.angle = a;  w = .i(-981*180/.pi/L*.sin(a) - k*w);  a = a0 + .i(w);
    Link.A = Rod.P;  Link.B = [x, 200];  x > Rod.O.x;
@0.6 Rod.O = [200 + 10*.t, 200];
@1.5
"""
FAMILIES = {
    "inequality": (WHITWORTH, {"e": (20, 80), "L": (150, 230), "q": (120, 180)}, [".range(Ram.H.x)"]),
    "planets": (PLANETARY, {"w": (200, 260), "q": (20, 30)}, [".range(Planet[1].T.x)", ".last(Carrier.angle)"]),
    "clock": (CLOCKWORK, {"w": (400, 460), "q": (70, 90)}, [".range(Short.H.x)", ".last(Wheel.angle)"]),
    "integrals": (GRAVITY, {"L": (80, 120), "g": (200, 400), "v0": (60, 110)}, [".min(Bar.Q.y)", ".mean(x)"]),
    "pendulum": (PENDULUM, {"L": (80, 120), "a0": (20, 60), "k": (0, 1)}, [".range(Rod.P.x)", ".last(w)"]),
}


@broad("name", FAMILIES, fast=("clock",))
def test_families_are_solved_together_as_they_are_one_by_one(name):
    text, ranges, measures = FAMILIES[name]
    source, names = mv.loads(text).source, tuple(ranges)
    low, high = np.array(list(ranges.values()), dtype=float).T
    values = np.random.default_rng(1).uniform(low, high, (40, len(names)))
    measured = read_measures([(f"m{k}", measure) for k, measure in enumerate(measures)])
    family = SweepJob(source, Choices(), VariantGrid((Axis(names, values),)), measured).family()
    rows = family.rows(np.arange(len(values)))
    assert family.alone <= 4, family.reasons
    if name == "inequality":
        assert 5 < (rows.outcomes == VariantOutcome.BINDS.code).sum() < 35
    alone = Variants(source, Choices(), names, measured)
    for k in range(0, len(values), 8):
        outcome, time, found = alone.row(dict(zip(names, values[k].tolist(), strict=True)))
        assert rows.outcomes[k] == outcome.code
        np.testing.assert_allclose(rows.times[k], time, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(rows.measures[k], found, rtol=1e-12, atol=1e-11)


TEETH = """
.let a = 0;
A : .gear(20, 4)  C = [100,100]  T = C + [40,0];    B : .gear(30, 4)  C = [200,100]  T = C + [0,60];
@0  A.C = [100,100];  B.C = [200,100];  A.angle = a + 90*.t;  .mesh(A, B) = 0;
@1
"""


@pytest.mark.slow
def test_the_gap_that_a_tooth_comes_into_is_chosen_for_each_variant():
    values = np.linspace(0, 60, 25)
    table = mv.loads(TEETH).sweep(a=values, measure={"t": ".first(B.angle)"})
    for k in range(0, 25, 4):
        assert table["t"][k] == pytest.approx(mv.loads(TEETH, a=values[k]).solve()["B.angle"][0], abs=1e-9)
    assert np.ptp(table["t"] + values * 2 / 3) > 1.0, "not all are in the same gap"


FOLLOWS = """
.let R = 50;
Crank : .bar A = [130,110] B = A + [R,0];   Coupler : .plate B = [0,0] P = B + [70,90] C = B + [150,0];
Rocker : .bar C = [0,0] D = C - [0,130];    Hand : .bar O = [0,0] P = [20,0];
@0 Crank.A = [130,110]; Crank.angle = 180*.t; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [310,110];
   Rocker.C.y > Rocker.D.y;   Hand.O = [300,250]; Hand.angle = 3*Rocker.angle;
@2 .loop;
"""


def test_what_follows_a_continuous_angle():
    table = mv.loads(FOLLOWS).sweep(
        R=np.linspace(30, 60, 16), measure={"x": ".min(Hand.P.x)", "turn": ".max(Hand.angle)"}
    )
    for k in (0, 7, 15):
        motion = mv.loads(FOLLOWS, R=table["R"][k]).solve()
        assert table["x"][k] == pytest.approx(motion["Hand.P.x"].min(), rel=1e-9)
        assert table["turn"][k] == pytest.approx(motion["Hand.angle"].max(), rel=1e-9)


def test_several_steps_with_other_constraints_go_on_from_where_they_are():
    text = """
    .let L = 120;   .let T = 1;
    Arm : .bar O = [0,0] P = [100,0];   Fore : .bar P = [0,0] Q = [L,0];
    @0  Arm.O = [100,100];  Arm.angle = 60*.t;  Fore.P = Arm.P;  Fore.Q = [x, 100];  x > Arm.P.x;
    @1  x = .max(0, x0) ;   x0 = 60*.t + 100*.cos(60) + 100 + .q(L^2 - (100*.sin(60))^2); Arm.angle = _;  Arm.P.y > 100;
    @1.3
    """
    script = mv.loads(text)
    table = script.sweep(L=np.linspace(118, 125, 13), measure={"x": ".max(Fore.Q.x)", "y": ".last(Arm.P.y)"})
    for k in range(0, 13, 4):
        motion = mv.loads(text, L=table["L"][k]).solve(on_failure="hold")
        if table.outcome[k] == "ok":
            assert table["x"][k] == pytest.approx(motion["Fore.Q.x"].max(), rel=1e-9)
            assert table["y"][k] == pytest.approx(motion["Arm.P.y"][-1], rel=1e-9)
        else:
            assert not motion.solved.all() or table.outcome[k] == "jumps"


def test_an_inequality_that_is_violated_just_before_a_bind():
    """Between two instants of the grid: the height is half a pixel 6e-5 before the rod would not reach."""
    text = ".let L = 50; Rod : .bar A=[0,0] B=[L,0]; @0 Rod.A=[0,0]; Rod.B=[30 + 40*.t, y]; y > 0.5; @1"
    table = mv.loads(text).sweep(L=np.linspace(45, 60, 16))
    assert set(table.outcome) == {"binds"}
    np.testing.assert_allclose(table.time, (np.sqrt(table["L"] ** 2 - 0.25) - 30) / 40, rtol=0.0, atol=1e-9)


ROUND = """
.let L = 180;  .let r = 60;
Plat : .plate A=[r*.cos(40),-r*.sin(40)] B=[r*.cos(80),r*.sin(80)] C=[r*.cos(200),r*.sin(200)];
R1 : .bar P=[0,0] Q=[L,0];   R2 : .bar P=[0,0] Q=[L,0];   R3 : .bar P=[0,0] Q=[L,0];
@0 d = 200 + 60*.t;  R1.P = [d,0];  R2.P = [d*.cos(120),d*.sin(120)];  R3.P = [d*.cos(240),d*.sin(240)];
   R1.Q = Plat.A;  R2.Q = Plat.B;  R3.Q = Plat.C;
@1
"""


@pytest.mark.slow
def test_a_loop_binds_when_its_legs_are_stretched():
    """Three legs that are pulled outwards, 120 degrees apart: the platform turns about the centre and ends where its
    radius and a leg are in line, when the leg's other end is L + r from the centre.
    """
    lengths = np.linspace(125, 255, 50)
    grid = VariantGrid((Axis(("L",), lengths[:, None]),))
    family = SweepJob(mv.loads(ROUND).source, Choices(), grid, read_measures([])).family()
    rows = family.rows(np.arange(len(grid)))
    time = (lengths + 60 - 200) / 60
    binds = (time > 0.0) & (time < 1.0)
    assert binds.sum() > 20
    assert family.together >= 45, family.reasons
    assert (rows.outcomes[binds] == 1).all()
    np.testing.assert_allclose(rows.times[binds], time[binds], rtol=0.0, atol=1e-9)
    assert (rows.outcomes[time < 0.0] == 2).all()
    assert (rows.outcomes[time > 1.0] == 0).all()


SWUNG = TRIAD.replace("30+40*.sin", "30+A*.sin").replace("100+20*.sin", "100+B*.sin").replace("@1", "@2")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_loops_that_bind_come_out_as_they_do_one_by_one(seed):
    names = "L", "s", "A", "B"
    values = np.random.default_rng(seed).uniform((100, 0.85, 40, -80), (145, 1.15, 170, 80), (24, 4))
    source = mv.loads(".let A = 40; .let B = 20;" + SWUNG).source
    job = SweepJob(source, Choices(), VariantGrid((Axis(names, values),)), read_measures(["x = .range(Plat.A.x)"]))
    family = job.family()
    rows = family.rows(np.arange(len(values)))
    assert family.together >= 20, family.reasons
    assert set(rows.outcomes.tolist()) == {0, 1, 2}
    alone = Variants(source, Choices(), names, job.measures)
    for k, row in enumerate(values.tolist()):
        outcome, time, measures = alone.row(dict(zip(names, row, strict=True)))
        assert rows.outcomes[k] == outcome.code, row
        np.testing.assert_allclose(rows.times[k], time, rtol=0.0, atol=1e-9, err_msg=str(row))
        np.testing.assert_allclose(rows.measures[k], measures, rtol=1e-9, atol=1e-9, err_msg=str(row))


QUARTERED = """
.let r = 26;  .let d = 112;
Near : .bar  A = [0, 0]  B = A + [d, 0]  C = B + [d, 0];
Far : .bar  A = [0, 0]  B = A + [d, 0]  C = B + [d, 0];
Wheel[k = 0..2] : .disc(52)  C = [100 + d*k, 82]  N = C + [r, 0]  F = C + [0, r];
@0  .for k = 0..2 { Wheel[k].C = [100 + d*k, 82]; }
    Wheel[1].angle = -180*.t;
    Near.A = Wheel[0].N;  Near.B = Wheel[1].N;  Near.C = Wheel[2].N;
    Far.A = Wheel[0].F;  Far.B = Wheel[1].F;  Far.C = Wheel[2].F;
@2  .loop;
"""


def test_variants_that_cannot_be_determined_together_warn_of_nothing() -> None:
    """At the dead points of one side its poses are infinite; both sides together decide, for each variant alone."""
    source = SourceText("quartered.mov", QUARTERED)
    variants = Variants(source, Choices(), ("d",), read_measures([("m", ".mean(Near.A.x)")], ("d",)))
    batch = prepare(variants, {}, {"d": (111.0, 113.0)})
    _, unsure = batch.rows(np.array([[111.5], [112.5]]))
    assert unsure.all()
