"""Several shapes as one thing (`.body`), and several things in a gap (`.gap(P, Tooth[0..7])`)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum as mv
from movimentum.errors import ScriptError
from movimentum.outlines.boolean_operations import (
    difference_of,
    disc_region,
    outlines_of,
    region_of,
    transformed,
    union_of,
)
from movimentum.outlines.lines import polygon, there_and_back

HERE = (1.0, 0.0, 0.0, 1.0)


def area(region):
    """What a region covers: exact lines, and arcs to rounding (Green's theorem by Gauss's rule)."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    total = 0.0
    for ring in region:
        for edge in ring:
            half = (edge.end - edge.begin) / 2.0
            x, y, dx, dy = edge.at(edge.begin + half * (1.0 + nodes))
            total += float(half * np.sum(weights * (x * dy - y * dx))) / 2.0
    return total


def lens(r, s, d):
    """The area that two circles share whose centres are d apart."""
    a = r * r * math.acos((d * d + r * r - s * s) / (2 * d * r))
    b = s * s * math.acos((d * d + s * s - r * r) / (2 * d * s))
    return a + b - 0.5 * math.sqrt((-d + r + s) * (d + r - s) * (d - r + s) * (d + r + s))


def box(x, y, u, v):
    return region_of(polygon([(x, y), (u, y), (u, v), (x, v)]))


@pytest.mark.parametrize("seed", range(12))
def test_areas_of_circles_that_are_joined_or_cut(seed):
    random = np.random.default_rng(seed)
    r, s = random.uniform(5, 40, 2)
    d = random.uniform(abs(r - s) + 0.5, r + s - 0.5)
    turn = random.uniform(0, 2 * math.pi)
    other = transformed(disc_region(s), HERE, (d * math.cos(turn), d * math.sin(turn)))
    both = math.pi * (r * r + s * s)
    assert area(union_of(disc_region(r), other)) == pytest.approx(both - lens(r, s, d), rel=1e-12)
    assert area(difference_of(disc_region(r), other)) == pytest.approx(math.pi * r * r - lens(r, s, d), rel=1e-12)


def test_edges_that_lie_on_each_other_leave_no_seam():
    two = union_of(box(0, 0, 10, 5), box(10, 0, 20, 5))
    assert [len(piece) for piece in outlines_of(two)] == [1]
    assert area(two) == 100.0
    beside = union_of(box(0, 0, 10, 5), box(10, 1, 20, 3))
    assert area(beside) == 70.0
    assert len(outlines_of(beside)) == 1
    assert area(union_of(disc_region(10.0), disc_region(10.0))) == pytest.approx(100 * math.pi)
    assert difference_of(disc_region(10.0), disc_region(10.0)) == []
    assert area(difference_of(box(0, 0, 10, 5), box(3, 0, 5, 2))) == 46.0  # a notch with its edge on the edge


def test_holes_and_pieces():
    frame = union_of(union_of(box(0, 0, 30, 5), box(0, 25, 30, 30)), union_of(box(0, 0, 5, 30), box(25, 0, 30, 30)))
    assert [len(piece) for piece in outlines_of(frame)] == [2]
    assert area(frame) == 500.0
    apart = union_of(disc_region(5.0), transformed(disc_region(5.0), HERE, (40.0, 0.0)))
    assert [len(piece) for piece in outlines_of(apart)] == [1, 1]
    halves = difference_of(disc_region(10.0), box(-1, -20, 1, 20))
    assert [len(piece) for piece in outlines_of(halves)] == [1, 1]


def test_a_bent_line_of_some_breadth():
    bent = region_of(there_and_back([(0, 0), (30, 0), (30, 20)], 5.0))
    # two lines, a quarter of a disc at the bend, half a disc at each end, less what both lines cover
    assert area(bent) == pytest.approx(300 + 200 - 25 + 25 * math.pi * 1.25, rel=1e-12)


WHEEL = """
.config(10, 300, 260);
Hub : .disc(40) C = [150,130];
Tooth[k = 0..7] : .polygon A = [150,130] + [38,-6].r(45*k) B = A + [17,3].r(45*k) D = A + [17,9].r(45*k)
                  E = A + [0,12].r(45*k);
Hole[k = 0..3] : .disc(8) C = [150,130] + [22,0].r(90*k);
.body W = Hub + Tooth[0..7] - Hole[0..3] .layer(2);
P : .disc(3) O = [150,130];
@0 W.C = [150,130];   W.angle = 30*.t;   P.O = [150 + 22*.t,130];
"""


def test_a_body_moves_as_one_and_has_the_anchors_of_its_shapes():
    motion = mv.loads(WHEEL + "q = Tooth[3].B;   h = Hole[1].C;   a = Hub.angle;\n@1").solve()
    turn = np.radians(30 * np.linspace(0, 1, 11) + 135)
    x, y = motion["q"].T
    assert x == pytest.approx(150 + 55 * np.cos(turn) + 3 * np.sin(turn), abs=1e-9)
    assert y == pytest.approx(130 + 55 * np.sin(turn) - 3 * np.cos(turn), abs=1e-9)
    assert motion["a"] == pytest.approx(30 * np.linspace(0, 1, 11), abs=1e-9)


def test_a_shape_may_be_named_behind_its_body():
    """As messages and tables name it."""
    script = """.config(10, 400, 400);
Rim : .disc(50) C = [200,200];
Slot[k = 0..3] : .bar A = [200,200] + [60,0].r(90*k) B = [200,200] + [20,0].r(90*k) .width(9);
Hub : .disc(9) M = [200,200];
.body Wheel = Rim - Slot[0..3] + Hub;
D : .disc(3) C = [0,0];
@0 Wheel.C = [200,200]; Wheel.angle = 30*.t; D.C = Wheel.Slot[0].A + (Wheel.Hub.M - Slot[2].B);
   d = (Wheel.Slot[1].A - D.C).l;   e = (Slot[1].A - D.C).l;
@1"""
    motion = mv.loads(script).solve()
    assert motion["D.C"] == pytest.approx(motion["Slot[0].A"] + motion["Hub.M"] - motion["Slot[2].B"], abs=1e-9)
    assert motion["d"] == pytest.approx(motion["e"], abs=1e-12)


def test_every_column_of_a_body_can_be_asked_of_a_motion():
    text = "Hub : .disc(20) C = [100,100]; Arm[k = 0..2] : .bar A = [100,100] B = A + [50,0].r(120*k) .width(8); "
    motion = mv.loads(f"{text} .body W = Hub + Arm[0..2]; @0 W.C = [100,100]; W.angle = 90*.t; @1").solve()
    (body,) = motion.timeline.scene.things
    assert {"C", "Arm[1].B"} <= {anchor.name for anchor in body.anchors}
    for anchor in body.anchors:
        assert motion[f"W.{anchor.name}"].shape == (len(motion.times), 2)
        assert motion[f"W.{anchor.name}.x"].shape == (len(motion.times),)
    with pytest.raises(mv.UnknownNameError):
        motion["W.Arm[3].B"]


@pytest.mark.slow
def test_a_gap_to_a_body_knows_its_holes():
    motion = mv.loads(WHEEL.replace("30*.t", "0*.t") + "g = .gap(P, W);\n@1").solve()
    # from the middle of the hub, into a hole: as deep as it is from its edge; in its middle free by 8 - 3
    assert motion["g"][0] == pytest.approx(-(14 + 3), abs=1e-6)
    assert motion["g"][-1] == pytest.approx(5.0, abs=1e-9)


def test_a_gap_to_several_is_the_least():
    text = """
A[k = 0..4] : .disc(4) C = [40*k, 10*k*k];
P : .disc(3) O = [0,80];
@0 .for k = 0..4 { A[k].C = [40*k, 10*k*k]; } P.O = [160*.t, 80];
g = .gap(P, A[1..3]);   all = .gap(P, A);   d = .on(P.O, A[1..3]);
.claim .gap(P, A[1..3]) = .min(.gap(P, A[1]), .gap(P, A[2]), .gap(P, A[3]));
@1
"""
    motion = mv.loads(".config(10, 200, 200);" + text).solve()
    at = np.stack([160 * np.linspace(0, 1, 11), np.full(11, 80.0)], axis=-1)
    away = np.stack([np.hypot(*(at - [40 * k, 10 * k * k]).T) for k in range(5)])
    assert motion["g"] == pytest.approx(away[1:4].min(axis=0) - 7)
    assert motion["all"] == pytest.approx(away.min(axis=0) - 7)
    assert motion["d"] == pytest.approx(away[1:4].min(axis=0) - 4)
    assert not [item for item in motion.diagnostics if item.code.startswith("claim")]


SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="100" height="80">
<path id="rim" d="M10,10 L60,10 L60,40 L10,40 Z"/><circle id="dot" cx="80" cy="60" r="10"/></svg>"""


def test_pictures_have_the_outline_that_is_stated(tmp_path):
    (tmp_path / "d.svg").write_text(SVG)
    (tmp_path / "o.mov").write_text("""
.config(2, 300, 260);
A : 'd.svg#rim' P = [10,40];
B : 'd.svg' P = [10,40] .outline('#dot') .scale(2);
W : 'd.svg' C = [20,20] .outline([0,0], [40,0], [40,40], [0,40]);
V : 'd.svg' C = [20,20] .outline([0,0], [40,0], [40,40], [0,40]) .topleft;
D : .disc(5) C = [200,100];
@0 A.P = [100,100]; A.angle = 90*.t; B.P = [100,100]; B.angle = 0; W.C = [50,200]; W.angle = 0;
V.C = [50,200]; V.angle = 0;   D.C = [200,100];
a = .gap(D, A);  b = .gap(D, B);  w = .gap(D, W);  v = .gap(D, V);
@1
""")
    motion = mv.load(tmp_path / "o.mov").solve()
    assert motion["a"][0] == pytest.approx(45)
    assert motion["a"][-1] == pytest.approx(95)  # turned about [100,100]
    assert motion["b"][0] == pytest.approx(math.hypot(40, 40) - 25)
    assert motion["w"][0] == motion["v"][0] == pytest.approx(math.hypot(130, 80) - 5)


@pytest.mark.parametrize(
    ("text", "code", "help_"),
    [
        ("A[k=0..3] : .disc(4) C = [0,0]; @0 A[0..2].C = [1,1];", "kind/mismatch", ".gap(A, A[0..2])"),
        ("A[k=0..3] : .disc(4) C = [0,0]; P : .disc(1) C = [9,9]; @0 g = .gap(P, A[2..9]);", "name/index", "`3`"),
        ("A[k=0..3] : .disc(4) C = [0,0]; P : .disc(1) C = [9,9]; @0 g = .gap(P, A[3..1]);", "name/index", "1..3"),
        ("A[k=0..3] : .disc(4) C = [0,0]; P : .disc(1) C = [9,9]; @0 g = .gap(P, B[0..1]);", "name/unknown-thing", ""),
        ("A : .disc(4) C=[0,0]; B : .disc(4) C=[5,0]; .body W = A + B; @0 g = .gap(A, W);", "body/shape", "`W`"),
        ("A : .disc(4) C=[0,0]; B : .disc(4) C=[5,0]; .body W = A + B; .body V = A; @0 W.C = [0,0];", "body/shape", ""),
        ("A : .bar P=[0,0] Q=[9,0]; B : .disc(4) C=[5,0]; .body W = A + B; @0 W.P = [0,0];", "body/shape", ".width"),
        ("A : .disc(4) C=[0,0]; B : .disc(9) C=[0,0]; .body W = A - B; @0 W.C = [0,0];", "body/shape", ""),
        ("A : .disc(4) C=[0,0]; .body W = A + Bx; @0 W.C = [0,0];", "name/unknown-thing", ""),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(text, code, help_):
    with pytest.raises(ScriptError) as caught:
        mv.loads(".config(10, 200, 200);" + text)
    told = [item for item in caught.value.diagnostics if item.code == code]
    assert told, [item.code for item in caught.value.diagnostics]
    assert help_ in " ".join(str(each) for each in told[0].helps) + str(told[0])
