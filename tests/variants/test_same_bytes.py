"""A variant's row has the same bytes, whichever variants are asked for with it, and in whatever order."""

import numpy as np
import pytest

import movimentum as mv
from movimentum.variants.axes import Axis, VariantGrid
from movimentum.variants.measures import read_measures
from movimentum.variants.sweep import SweepJob
from movimentum.workflow.choices import Choices

FOUR_BAR = """
.config(300, 200, 24);
.let R = 40 .range(20, 60); .let L = 120 .range(90, 160); .let S = 0;
A:.bar O=[0,0] P=[R,0]; C:.bar P=[R,0] Q=[100,80] M=[60,60]; B:.bar Q=[100,80] E=[100,0];
@0 A.O=[0,0]; B.E=[L,0]; A.P=C.P; B.Q=C.Q; A.angle=360*.t;
@1
"""
LOOP = """
.config(300, 200, 12);
.let W = 0; .let H = 0;
D:.bar O=[0,0] Q=[40,0]; P:.bar A=[40,0] B=[120,40] C=[80,90];
L:.bar B=[120,40] S=[150+W,-20]; M:.bar C=[80,90] T=[30,120+H];
E:.bar C=[80,90] F=[150,130]; G:.bar F=[150,130] U=[190,60];
@0 D.O=[0,0]; P.A=D.Q; L.B=P.B; L.S=[150+W,-20]; M.C=P.C; M.T.y=120+H; E.C=P.C; G.F=E.F; G.U=[190,60];
D.angle = 30*.t;
@1
"""


def job_of(text: str, seed: int, names: tuple[str, ...], low: list[float], high: list[float], count: int) -> SweepJob:
    values = np.random.default_rng(seed).uniform(low, high, (count, len(names)))
    grid = VariantGrid((Axis(names, values),))
    point = "P.C" if "P:.bar" in text else "C.M"
    measures = read_measures([("a", f".mean({point}.x)"), ("b", f".at({point}.y, 1/3)")], names)
    return SweepJob(mv.loads(text).source, Choices(), grid, measures)


def in_parts(job: SweepJob, generator: np.random.Generator) -> list[bytes]:
    """All rows, asked for in random parts, by one family or by several, in random order."""
    total = len(job.grid)
    parts = np.split(np.arange(total), np.sort(generator.choice(total, generator.integers(1, 4), replace=False)))
    found = np.zeros((total, 2 + len(job.measures.measures)))
    family = job.family()
    for k in generator.permutation(len(parts)):
        family = job.family() if generator.random() < 0.5 else family
        rows = family.rows(parts[k])
        found[parts[k]] = np.column_stack([rows.outcomes, rows.times, rows.measures])
    return [row.tobytes() for row in found]


@pytest.mark.parametrize(
    ("text", "names", "low", "high", "count"),
    [
        pytest.param(FOUR_BAR, ("R", "L"), [20.0, 90.0], [60.0, 160.0], 150, marks=pytest.mark.slow),
        (FOUR_BAR, ("R",), [20.0], [60.0], 40),
        (LOOP, ("W", "H"), [-20.0, -20.0], [20.0, 20.0], 6),
        pytest.param(LOOP, ("W", "H"), [-20.0, -20.0], [20.0, 20.0], 48, marks=pytest.mark.slow),
    ],
)
def test_rows_do_not_depend_on_their_company(text, names, low, high, count):
    job = job_of(text, 1, names, low, high, count)
    generator = np.random.default_rng(5)
    whole = in_parts(job, generator)
    assert in_parts(job, generator) == whole
