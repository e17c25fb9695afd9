"""Wishes and free motion of many variants at once: as each variant by itself, and as closed forms say."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest

import movimentum as mv
from movimentum.planning.blocks.kinds import Free
from movimentum.planning.structure.metric import VariantMetrics
from movimentum.solver.kinds.variant_free_law import _weights, pseudo_inverses
from movimentum.solver.kinds.variant_free_motion import _advance, _bend
from movimentum.source import SourceText
from movimentum.variants.axes import Axis, VariantGrid
from movimentum.variants.measures import read_measures
from movimentum.variants.single import Variants
from movimentum.variants.sweep import SweepJob
from movimentum.workflow.choices import Choices
from tests.broad import broad
from tests.solver.scenes import motion_of

from .test_together import measured

SCENES = {
    "a rope on a trolley": """.let h = 90 .range(70,110); .let e = 300 .range(250,330);
        Trolley : .plate A=[0,0] B=[20,0] P=[10,-5];  Rope : .bar P=[0,0] Q=P-[0,h];
        @0 Trolley.A=[60,160] -> [e,160]; Trolley.angle=0; Rope.P=Trolley.P; Rope.Q ~ Rope.P-[0,90] .speed(90);
        @1""",
    "pendant bars": """.let s = 1 .range(0.8,1.2);
        Crank : .bar A=[100,100] B=[140*s,100];  Upper : .bar A=[0,0] B=[90,0];
        @0 Crank.A=[100,100]; Crank.angle=90*.t; Upper.A=Crank.B;
        @1""",
    "an arm": """.let L = 80 .range(60,100);  Arm : .bar O=[0,0] P=[L,0];  Hand : .bar O=[0,0] P=[60,0];
        @0 Arm.O=[60,60]; Hand.O=Arm.P; Hand.P ~ [110,170] .speed(60);
        @1 Hand.P ~ [100,120];
        @2""",
    "out of reach": """.let L = 80 .range(60,100);  Bar : .bar O=[0,0] P=[L,0];
        @0 Bar.O=[0,0]; Bar.P ~ [130, 100+20*.t];
        @1""",
    "two ways to be met": """.let L = 50 .range(45,60);  A : .bar a=[0,0] b=[L,0];  B : .bar a=[50,0] b=[100,0];
        @0 A.a=[0,0]; B.a=A.b; B.b ~ [60+10*.t, 30];
        @1""",
    "a wish that moves": """.let s = 1 .range(0.8,1.2);  Goal : .disc(4) C=[0,0];
        Upper : .bar A=[0,0] B=[90*s,0];  Lower : .bar B=[0,0] C=[70,0];
        @0 Upper.A=[60,60]; Lower.B=Upper.B; Goal.C=[150,150] -> [200,100]; Lower.C ~ Goal.C .speed(150);
        @1""",
}
FAST = ["a rope on a trolley", "pendant bars"]


def compared(text: str, count: int, each: int, seed: int = 3) -> None:
    """Solve random variants in the ranges of their constants together, and one of ``each`` by itself."""
    source = SourceText("free.mov", text)
    ranges = re.findall(r"\.let (\w+) = [^;]*?\.range\(([^,]*),([^)]*)\)", text)
    names = tuple(name for name, _, _ in ranges)
    random = np.random.default_rng(seed)
    values = np.column_stack([random.uniform(float(low), float(high), count) for _, low, high in ranges])
    job = SweepJob(source, Choices(), VariantGrid((Axis(names, values),)), read_measures(measured(source), names))
    family = job.family()
    rows = family.rows(np.arange(count))
    assert family.together > 0.7 * count, family.reasons
    alone = Variants(source, Choices(), names, job.measures)
    for k in range(0, count, each):
        outcome, time, measures = alone.row(dict(zip(names, values[k].tolist(), strict=True)))
        assert rows.outcomes[k] == outcome.code
        np.testing.assert_allclose(rows.times[k], time, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(rows.measures[k], measures, rtol=1e-9, atol=1e-8)


@broad("name", [n if n in FAST else pytest.param(n, marks=pytest.mark.slow) for n in SCENES], first=1)
def test_free_motions_come_out_as_by_themselves(name):
    compared(SCENES[name], 14, 5)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", range(6))
def test_random_chains_with_random_wishes(seed):
    generator = random.Random(seed)
    count = generator.choice([1, 2, 3])
    things, said = [], ["B1.A = [50, 60];"]
    for k in range(1, count + 1):
        length = generator.randint(40, 90)
        things.append(f"B{k} : .bar A=[0,0] B=[{length}*s,{generator.randint(-30, 30)}];")
        said += [f"B{k}.A = B{k - 1}.B;"] if k > 1 else []
    speed = f" .speed({generator.randint(30, 120)})" if generator.random() < 0.5 else ""
    goal = f"[{generator.randint(60, 200)}, {generator.randint(-50, 160)} + {generator.randint(-40, 40)}*.t]"
    if generator.random() < 0.8:
        said.append(f"B{count}.B ~ {goal}{speed};")
    else:
        said[0] = f"B1.A = [50, 60] -> {goal.split('+')[0]}];"
    compared(f".let s = 1 .range(0.9,1.1);\n{' '.join(things)}\n@0 {' '.join(said)}\n@1", 14, 5, seed)


@pytest.mark.slow
def test_a_wish_that_leads_along_a_line_is_followed_as_the_closed_form_says():
    script = mv.loads(""".let X = 100; .config(50);  Slide : .bar O=[0,0] P=[50,0];
        @0 Slide.O.y=0; Slide.angle=0;
        @1 Slide.O.x ~ X;
        @2""")
    targets = np.linspace(10.0, 30.0, 14)
    table = script.sweep(X=targets.tolist(), measure={"x": ".at(Slide.O.x, 1.5)"})
    np.testing.assert_allclose(table["x"], targets * (1.0 - np.exp(-8.0 * 0.5)), rtol=1e-7)


@pytest.mark.parametrize("known", [1, 2, 3, 4, 5])
def test_steps_integrate_polynomials_exactly(known):
    times = np.array([[-0.9, -0.5, -0.2, 0.0, 0.3], [-4.0, -3.0, -1.5, -1.0, 2.0]])
    step = np.array([0.3, 2.0])
    rates = np.stack([times ** (known - 1), 3.0 * times**0], axis=2)
    found = _advance(times, rates, np.array([known, known]), step)
    np.testing.assert_allclose(found[:, 0], step**known / known, rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], 3.0 * step, rtol=1e-12)


def test_the_third_derivative_is_that_of_a_cubic():
    times, step = np.array([[-3.0, -2.0, -0.5, 0.0, 0.7]]), np.array([0.7])
    rates = np.stack([2.0 * times**3 + times], axis=2)
    np.testing.assert_allclose(_bend(times, rates, np.array([5]), step), [[12.0 * 0.7**3]], rtol=1e-12)


def test_derivatives_of_polynomials_are_exact_wherever_they_are_asked_for():
    offsets = np.array([-3.0, -1.0, 0.0, 2.0, -6.0])[:, None] * 0.1 + 0.1 * np.arange(7)
    found = np.einsum("np,np->n", _weights(offsets), 4.0 + 5.0 * offsets + offsets**2 - offsets**6)
    np.testing.assert_allclose(found, 5.0, rtol=1e-10)


def test_what_rows_leave_free_is_the_null_space():
    generator = np.random.default_rng(1)
    rows = generator.normal(size=(20, 3, 5))
    rows[7, 2] = rows[7, 0]  # redundant
    rows /= np.linalg.norm(rows, axis=2, keepdims=True)
    inverse, free = pseudo_inverses(rows)
    for k in range(20):
        np.testing.assert_allclose(inverse[k], np.linalg.pinv(rows[k], rcond=1e-8), atol=1e-10)
        np.testing.assert_allclose(free[k] @ free[k], free[k], atol=1e-10)
        assert round(np.trace(free[k])) == (3 if k == 7 else 2)


@pytest.mark.slow
def test_metrics_of_variants_are_those_of_each():
    plan = motion_of(SCENES["an arm"]).segments[0].plan
    block = next(block for block in plan.blocks if isinstance(block, Free))
    system = plan.system

    def local(thing, anchor):
        x, y = system.frame(thing).local(system.scene.things[thing].anchors[anchor].local)
        return np.full(2, x), np.full(2, y)

    across = VariantMetrics.of(system, block.core, local, 2)
    white, scale = block.metric.whitening
    for k in range(2):
        np.testing.assert_allclose(across.dense[k], block.metric.dense, rtol=1e-14)
        np.testing.assert_allclose(across.white[k], white, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(across.scale[k], scale, rtol=1e-14)
