"""Equations of paths: degrees that the literature tells, and the film's path, which has to lie on them."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from mpmath import mp

from movimentum.proving.zero_lines import zero_lines
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.curve import curve
from movimentum.workflow.stages import arranged, solved, understand
from tests.broad import broad
from tests.command import ROOT, movimentum
from tests.proving.theorems import FOUR_BAR

ON_IT = 1e-9
"""Pixels."""


def script(name):
    path = ROOT / "scripts" / f"{name}.mov"
    return SourceText(str(path), path.read_text(encoding="utf-8"))


def off(source, anchor, equation, count=40):
    """How far the film's path is from the curve, at most: |F| / |grad F| with many digits."""
    scene = understand(source, Choices())
    motion = solved(arranged(scene, Choices()), Choices()).motion.path
    name, spot = anchor.split(".")
    thing = next(each for each in scene.things if each.name == name)
    place = next(each.local for each in thing.anchors if each.name == spot)
    segment = next(each.segment for each in motion.segments if each.segment.start < each.segment.end)
    times = [segment.start + (segment.end - segment.start) * Fraction(k, count) for k in range(count)]
    path = np.reshape(motion.poses_at(times).world(thing.number, place), (-1, 2))
    with mp.workdps(400):
        terms = [
            (i, j, mp.mpf(sympy.N(factor, 400)))
            for (i, j), factor in sympy.Poly(equation, *sympy.symbols("x y"), domain="EX").terms()
        ]
        worst = mp.mpf(0)
        for x, y in path:
            x, y = mp.mpf(float(x)), mp.mpf(float(y))
            f = mp.fsum(c * x**i * y**j for i, j, c in terms)
            u = mp.fsum(c * i * x ** (i - 1) * y**j for i, j, c in terms if i)
            v = mp.fsum(c * j * x**i * y ** (j - 1) for i, j, c in terms if j)
            worst = max(worst, abs(f) / mp.hypot(u, v))
        return float(worst)


PATHS = {
    "peaucellier AP.P": 1,
    "hart Up.Q": 1,
    "hart Crank.P": 2,
    "trammel Rod.P": 2,
    "four-bar Coupler.P": 6,
    "hoecken Coupler.P": 6,
    "pantograph AQ.Q": 12,  # twice a rose of degree 12; in another assembly it stands still
    "klann Leg.F": 18,
}


@broad("path", PATHS, fast=("peaucellier AP.P", "four-bar Coupler.P"))
def test_the_film_lies_on_the_curve(path):
    name, anchor = path.split()
    found = curve(script(name), Choices(), anchor, 120.0)
    assert found.degree == PATHS[path]
    assert off(script(name), anchor, found.equation) < ON_IT


@pytest.mark.slow
def test_jansens_toe_has_degree_28():
    """Its coefficients are no rational numbers: the triangles of the published lengths have areas with roots."""
    found = curve(script("jansen"), Choices(), "ghi.W", 600.0)
    assert found.degree == 28
    assert found.equation.has(sympy.sqrt(47876114))
    assert off(script("jansen"), "ghi.W", found.equation, count=12) < ON_IT


def test_the_curve_is_drawn_where_it_is(tmp_path):
    found = curve(script("four-bar"), Choices(), "Coupler.P", 60.0)
    lines = zero_lines(found.equation, (0.0, 0.0, 400.0, 320.0))
    assert sum(map(len, lines)) > 200
    x, y = sympy.symbols("x y")
    value = sympy.lambdify((x, y), found.equation, "mpmath")
    slopes = [sympy.lambdify((x, y), found.equation.diff(each), "mpmath") for each in (x, y)]
    for spot in lines[0][::7]:
        u, v = map(mp.mpf, spot)
        assert abs(value(u, v)) < 0.5 * mp.hypot(*(each(u, v) for each in slopes))  # half a pixel
    done = movimentum("curve", str(ROOT / "scripts" / "four-bar.mov"), "Coupler.P", "-o", "c.svg", cwd=tmp_path)
    assert done.returncode == 0
    assert (tmp_path / "c.svg").read_text(encoding="utf-8").startswith("<svg")
    done = movimentum("curve", str(ROOT / "scripts" / "four-bar.mov"), "Coupler.P", "-o", "c.gif", cwd=tmp_path)
    assert done.returncode == 2
    assert "-o curve.svg" in done.stderr


ROOTED = """
Arm : .bar A = [0,0] B = A + [.sqrt(2)*30, 0] P = B + [20, .sqrt(3)*10];
Rod : .bar B = [0,0] C = B + [120,0] P = C + [11,13];
Cog : .bar C = [0,0] D = C + [0,-80];
@0 Arm.A = [10,20]; Arm.angle = 50*.t; Rod.B = Arm.B; Cog.C = Rod.C; Cog.D = [130,40]; Cog.C.y > 30;
@2
"""


@pytest.mark.slow
def test_coefficients_with_roots():
    source = SourceText("rooted.mov", ROOTED)
    for anchor, degree in (("Arm.P", 2), ("Arm.B", 2), ("Rod.C", 2), ("Rod.P", 6)):
        found = curve(source, Choices(), anchor, 60.0)
        assert found.degree == degree
        assert off(source, anchor, found.equation) < ON_IT


def test_without_flint(monkeypatch):
    text = FOUR_BAR.format(
        ax=60, r=40, px=50, py=30, l=99, s=90, dx=180, dy=99, drive="90*.t", side="Rocker.C.y > 100;", claim=""
    )
    with_flint = curve(SourceText("four.mov", text), Choices(), "Coupler.P", 60.0)
    for module in ("rings", "samples"):
        monkeypatch.setattr(f"movimentum.proving.{module}.has_flint", lambda: False)
    without = curve(SourceText("four.mov", text), Choices(), "Coupler.P", 60.0)
    assert (without.degree, without.equation) == (with_flint.degree, with_flint.equation)
