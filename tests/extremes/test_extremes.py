"""The solver's promises at the far ends of what a script may state, with the numbers printed (pytest -s)."""

from fractions import Fraction

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from movimentum.errors import ScriptError
from movimentum.planning.blocks.kinds import method_of
from tests.broad import broad
from tests.solver.scenes import anchor, motion_of, residuals, rigidity


def p(x, y, factor=1.0, offset=(0.0, 0.0)):
    return f"[{float(factor * x + offset[0])!r},{float(factor * y + offset[1])!r}]"


def four_bar(factor=1.0, offset=(0.0, 0.0), *, fps="24", drive="90*.t", end="4", crank=35.0):
    def at(x, y):
        return p(x, y, factor, offset)

    return f""".config({fps});
    Crank : .bar O={at(0, 0)} P={at(crank, 0)};  Rocker : .bar O={at(90, 0)} P={at(90, 60)};
    Coupler : .bar A={at(crank, 0)} B={at(90, 60)} C={at(60, 60)};
    @0 Crank.O={at(0, 0)}; Crank.angle={drive}; Rocker.O={at(90, 0)}; Coupler.A=Crank.P; Coupler.B=Rocker.P;
       Coupler.angle ~ 0;
    @{end}"""


def slider_crank(factor=1.0, offset=(0.0, 0.0)):
    def at(x, y):
        return p(x, y, factor, offset)

    return f""".config(24);
    Crank : .bar O={at(0, 0)} P={at(35, 0)};  Rod : .bar A={at(35, 0)} B={at(125, 0)};
    @0 Crank.O={at(0, 0)}; Crank.P=Crank.O + [{35 * factor!r},0].r(90*.t); Rod.A=Crank.P; Rod.B=[x,{offset[1]!r}];
       x > Crank.O.x;
    @4"""


def distances(factor=1.0, offset=(0.0, 0.0)):
    def at(x, y):
        return p(x, y, factor, offset)

    return f""".config(24);
    C : .bar O={at(0, 0)} P={at(35, 0)};  D : .disc({factor!r}) c={at(60, 60)};
    @0 C.O={at(0, 0)}; C.angle=90*.t; (D.c - C.P).l = {80 * factor!r}; (D.c - {at(100, 0)}).l = {90 * factor!r};
       D.c.y > {offset[1]!r};
    @4"""


def triad(factor=1.0, offset=(0.0, 0.0)):
    def at(x, y):
        return p(x, y, factor, offset)

    return f""".config(24);
    Crank : .bar O={at(0, 0)} P={at(15.28, 0)};  Leg1 : .bar A={at(15.28, 0)} B={at(67.77, 55.51)};
    Leg2 : .bar A={at(95.08, 1.44)} B={at(21.88, 92.14)};  Leg3 : .bar A={at(-34.86, -65.84)} B={at(-4.04, 42.42)};
    Body : .bar X={at(67.77, 55.51)} Y={at(21.88, 92.14)} Z={at(-4.04, 42.42)};
    @0 Crank.O={at(0, 0)}; Crank.angle=90*.t; Leg1.A=Crank.P; Leg2.A={at(95.08, 1.44)}; Leg3.A={at(-34.86, -65.84)};
       Leg1.B=Body.X; Leg2.B=Body.Y; Leg3.B=Body.Z; Body.X ~ {at(67.77, 55.51)}; Body.Y ~ {at(21.88, 92.14)};
    @4"""


def trailing(factor=1.0, offset=(0.0, 0.0)):
    def at(x, y):
        return p(x, y, factor, offset)

    return f""".config(24);
    C : .bar O={at(0, 0)} P={at(35, 0)};  R : .bar A={at(35, 0)} B={at(125, 0)};
    @0 C.O={at(0, 0)}; C.angle=90*.t; R.A=C.P;
    @4"""


SCENES = [four_bar, slider_crank, distances, triad, trailing]


def solved(text, fps=None):
    motion = motion_of(text, fps)
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    assert np.isfinite(poses.origin).all()
    return motion, poses


FACTORS = (1e-150, 1e-100, 1e-30, 1e-9, 1e9, 1e30, 1e100, 1e150)


@pytest.mark.parametrize(
    "factors", [(1e-150, 1e-9, 1e9, 1e150), pytest.param(FACTORS, marks=pytest.mark.slow)], ids=len
)
@broad("scene", SCENES, first=3)
def test_scales(scene, factors):
    _, reference = solved(scene())
    worst = 0.0
    for factor in factors:
        motion, poses = solved(scene(factor))
        off = max(
            float(np.max(np.abs(poses.origin / factor - reference.origin))) / 100,
            float(np.max(np.abs(poses.direction - reference.direction))),
        )
        print(
            f"{scene.__name__} x {factor:g}: differs by {off:.1e},"
            f" residual {max(residuals(motion, poses).values()):.1e}"
        )
        assert examine(motion).fault == 0
        worst = max(worst, off)
    # a free motion is an integral: as good as its quadrature
    assert worst < (1e-8 if scene is trailing else 1e-12)


@pytest.mark.parametrize("factor", [pytest.param(1e-320, marks=pytest.mark.slow), 1e-200, 1e200, 1e306])
def test_beyond_all_scales_there_is_a_diagnostic_and_no_nan(factor):
    if factor > 1e153:  # drawn so far away that squares of distances overflow
        with pytest.raises(ScriptError, match="drawn too far away"):
            motion_of(four_bar(factor))
        return
    motion = motion_of(four_bar(factor))
    poses = motion.poses(0, motion.timeline.frame_count)
    examination = examine(motion)
    print(f"x {factor:g}: {poses.solved.mean():.0%} solved, fault {examination.fault}")
    assert np.isfinite(poses.origin).all()
    assert np.isfinite(poses.direction).all()
    if poses.solved.all():
        _, reference = solved(four_bar())
        assert np.max(np.abs(poses.direction - reference.direction)) < 1e-6
    else:
        assert examination.fault in (1, 3)
        assert examination.diagnostics[0].severity.name == "ERROR"


@broad("scene", SCENES, first=4)
def test_size_one_at_a_hundred_million(scene):
    _, reference = solved(scene(0.01))
    _, poses = solved(scene(0.01, (1e8, -1e8)))
    # the script's own numbers are rounded to 1.5e-8 there: a turn is known to about that
    off = float(np.max(np.abs(poses.direction - reference.direction)))
    print(f"{scene.__name__}, size 1 at (1e8, -1e8): directions differ by {off:.1e}")
    assert off < 3e-7


def test_whole_numbers_far_away_lose_nothing():
    def scene(x):
        return f""".config(24);
        C : .bar O=[{x},0] P=[{x + 3},0];  R : .bar A=[{x + 3},0] B=[{x + 11},0];
        @0 C.O=[{x},0]; C.angle=90*.t; R.A=C.P; R.B=[s,0]; s > {x};
        @4"""

    _, reference = solved(scene(0))
    for x in (100_000_000, 1_000_000_000_000):
        _, poses = solved(scene(x))
        off = float(np.max(np.abs(poses.direction - reference.direction)))
        print(f"at {x:g}: directions differ by {off:.1e}")
        assert off < 1e-13


@pytest.mark.parametrize("crank", [35.0, 1e-3, 35e-6])
def test_link_ratios_of_a_million(crank):
    motion, poses = solved(four_bar(crank=crank))
    angle = np.radians(90 * poses.times)
    pin = crank * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    d = np.array([90.0, 0.0]) - pin
    coupler, rocker, square = np.hypot(90 - crank, 60), 60.0, np.sum(d * d, axis=1)
    along = (coupler**2 - rocker**2 + square) / (2 * square)
    height = np.sqrt(coupler**2 / square - along**2)
    expected = pin + along[:, None] * d + height[:, None] * np.stack([-d[:, 1], d[:, 0]], axis=-1)
    off = float(np.max(np.abs(anchor(motion, poses, "Coupler.B") - expected)))
    print(f"ratio {90 / crank:.1e}: off by {off:.1e}")
    assert off < 1e-12


def test_a_rod_a_million_times_its_crank():
    _, poses = solved(
        """.config(24); C : .bar O=[0,0] P=[1,0]; R : .bar A=[1,0] B=[1000001,0];
        @0 C.O=[0,0]; C.angle=90*.t; R.A=C.P; R.B=[x,0]; x > 0; @4"""
    )
    angle = np.pi / 2 * poses.times.astype(np.longdouble)
    expected = np.cos(angle) + np.sqrt(np.longdouble(1e12) - np.sin(angle) ** 2)
    off = float(np.max(np.abs(poses.variables["x"] - expected))) / 1e6
    print(f"relative error {off:.1e}")
    assert off < 5e-16


# --- dead centres and change points


@pytest.mark.parametrize(("miss", "bound"), [(0.0, 1e-12), (1e-12, 1e-4), (-1e-12, 1e-4)])
def test_a_dead_centre_hit_and_missed_by_a_trillionth(miss, bound):
    # crank and rod of one length: x = 2 r cos(angle); missed by e, x differs by up to sqrt(2 r e)
    _, poses = solved(
        f""".config(36); C : .bar O=[0,0] P=[50,0]; R : .bar A=[50,0] B=[100,0];
        @0 C.O=[0,0]; C.angle=90*.t; R.A=C.P; R.B=[x,{50 * miss!r}]; x ~ 100; @4"""
    )
    off = float(np.max(np.abs(poses.variables["x"] - 100 * np.cos(np.pi / 2 * poses.times))))
    print(f"missed by {miss:g}: x off by {off:.1e}")
    assert off < bound


def test_a_dead_centre_missed_by_a_billionth_is_found_out():
    motion = motion_of(
        """.config(36); C : .bar O=[0,0] P=[50,0]; R : .bar A=[50,0] B=[100,0];
        @0 C.O=[0,0]; C.angle=90*.t; R.A=C.P; R.B=[x,5e-8]; x ~ 100; @4"""
    )
    examination = examine(motion)
    assert examination.fault == 3
    assert examination.diagnostics[0].code == "solve/unreachable"
    trouble = min(t.begin for t in motion.segments[0].failures)
    # |50 sin(angle) - 5e-8| = 50 just before 270 degrees
    expected = (270 - np.degrees(np.sqrt(2 * 5e-8 / 50))) / 90
    print(f"binds at {trouble:.12f}, expected {expected:.12f}")
    assert abs(trouble - expected) < 1e-9 * 4


@pytest.mark.parametrize("excess", [0.0, 1e-12, -1e-12])
def test_a_reach_stretched_to_its_end(excess):
    # a two-link arm, its hand at most 90 away: exactly stretched at t = 1
    motion, poses = solved(
        f""".config(10); C : .bar O=[0,0] P=[40,0]; R : .bar A=[40,0] B=[{40 + 50 * (1 + excess)!r},0];
        @0 C.O=[0,0]; R.A=C.P; R.B=[90 - 20*(.t - 1)^2,0]; C.P.y >= -1e-3; @2"""
    )
    worst = max(residuals(motion, poses).values())
    print(f"excess {excess:g}: residual {worst:.1e}")
    assert worst < 1e-12


PARALLELOGRAM = """.config(1);
Crank : .bar O=[0,0] P=[40,0];  Rocker : .bar O=[100,0] P=[140,0];  Coupler : .bar A=[40,0] B=[140,0];
@0 Crank.O=[0,0]; Crank.angle=10 + {speed}*.t; Rocker.O=[100,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P;
   Coupler.angle ~ 0;
@{end}"""


def test_ten_thousand_turns_a_frame_through_change_points():
    motion, poses = solved(PARALLELOGRAM.format(speed=3_600_100, end=1))
    print(
        f"{len(motion.segments[0].pieces[0].nodes)} nodes;"
        f" coupler off by {np.max(np.abs(poses.angle[2])):.1e} degrees,"
        f" rocker by {np.max(np.abs(poses.angle[1] - poses.angle[0])):.1e} after {poses.angle[0, -1] / 360:.1f} turns"
    )
    assert np.max(np.abs(poses.angle[2])) < 1e-6
    assert np.max(np.abs(poses.angle[1] - poses.angle[0])) < 1e-6


@pytest.mark.slow
def test_what_is_too_fast_to_be_followed_is_told():
    motion = motion_of(PARALLELOGRAM.format(speed=36_000_100, end=1))
    found = [d for d in examine(motion).diagnostics if d.code == "solve/too-fast"]
    print(found[0].message, *found[0].notes)
    assert len(found) == 1


def test_ten_thousand_turns_a_frame():
    motion, poses = solved(four_bar(fps="1", drive="360*1e4*.t + 30*.t", end="3"))
    _, slow = solved(four_bar(fps="1", drive="30*.t", end="3"))
    off = float(np.max(np.abs(poses.direction - slow.direction)))
    print(f"1e4 turns a frame: directions off by {off:.1e}, residual {max(residuals(motion, poses).values()):.1e}")
    assert off < 1e-10


# --- nearly singular


@pytest.mark.parametrize("slope", [1e-3, 1e-6, 1e-9, 1e-12])
def test_nearly_parallel_lines(slope):
    _, poses = solved(
        f""".config(10); D : .disc(1) c=[0,0];
        @0 D.c=[0,10 + .t] + [1,0]*u; D.c=[0,0] + [1,{slope}]*v; @2"""
    )
    expected = (10 + poses.times) / slope
    off = float(np.max(np.abs(poses.variables["u"] / expected - 1)))
    print(f"slope {slope:g}: relative error {off:.1e}")
    assert off < 1e-14


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
def test_nearly_coincident_anchors(gap):
    motion, poses = solved(
        f""".config(10); B : .bar a=[0,0] b=[{gap},0] c=[100,0];
        @0 B.a=[0,0]; B.b=[{gap},0].r(90*.t); @4"""
    )
    expected = 100 * np.stack([np.cos(np.pi / 2 * poses.times), np.sin(np.pi / 2 * poses.times)], axis=-1)
    off = float(np.max(np.abs(anchor(motion, poses, "B.c") - expected)))
    print(f"anchors {gap:g} apart: an anchor at 100 is off by {off:.1e}")
    assert off < 1e-12


# --- time


@pytest.mark.parametrize("length", ["0.000000001", "1000000000"])
def test_intervals_of_a_billionth_and_a_billion(length):
    text = four_bar(fps=str(1e-9), drive="360*.t/.iv", end=length)
    motion = motion_of(text)
    times = [Fraction(length) * k / 36 for k in range(37)]
    poses = motion.poses_at(times)
    reference = motion_of(four_bar(drive="360*.t/.iv", end="1")).poses_at([Fraction(k, 36) for k in range(37)])
    off = float(np.max(np.abs(poses.direction - reference.direction)))
    print(f".iv of {length}: directions differ by {off:.1e}")
    assert poses.solved.all()
    assert off < 1e-12


def test_a_segment_of_a_trillionth():
    _, poses = solved(
        """.config(10); C : .bar O=[0,0] P=[35,0]; R : .bar A=[35,0] B=[125,0];
        @0 C.O=[0,0]; C.angle=90*.t; R.A=C.P; R.B=[x,0]; x > C.O.x;
        @1 x > _;
        @1.000000000001 C.angle=90 + 90*.t;
        @2"""
    )
    angle = np.pi / 2 * poses.times
    off = float(
        np.max(np.abs(poses.variables["x"] - (35 * np.cos(angle) + np.sqrt(90**2 - (35 * np.sin(angle)) ** 2))))
    )
    print(f"off by {off:.1e}")
    assert off < 1e-8


@pytest.mark.slow
def test_hundreds_of_steps():
    steps = " ".join(f"@{k} C.angle={(k % 2) * 90} + {90 * (1 - 2 * (k % 2))}*.t;" for k in range(1, 200))
    _, poses = solved(
        f""".config(4); C : .bar O=[0,0] P=[35,0]; R : .bar A=[35,0] B=[125,0];
        @0 C.O=[0,0]; C.angle=90*.t; R.A=C.P; R.B=[x,0]; x > C.O.x; {steps} @200"""
    )
    angle = np.radians(90 * np.abs((poses.times + 1) % 2 - 1))
    off = float(
        np.max(np.abs(poses.variables["x"] - (35 * np.cos(angle) + np.sqrt(90**2 - (35 * np.sin(angle)) ** 2))))
    )
    print(f"200 steps: off by {off:.1e}")
    assert off < 1e-12


@pytest.mark.slow
def test_a_million_frames_do_not_drift():
    motion = motion_of(four_bar(fps="1000", drive="360*.t", end="1000"))
    count = motion.timeline.frame_count
    first = motion.poses(0, 1001)
    worst = 0.0
    for begin in range(0, count - 1000, 50_000):
        poses = motion.poses(begin, begin + 1001)
        worst = max(worst, float(np.max(np.abs(poses.direction - first.direction))), rigidity(motion, poses))
    print(f"{count} frames: the last turn differs from the first by {worst:.1e}")
    assert count == 1_000_001
    assert worst < 1e-12


# --- many things


def chain(count):
    things = " ".join(f"L{i} : .bar a=[{10 * i},0] b=[{10 * i + 10},0];" for i in range(count))
    places = " ".join(f"L{i}.a = L{i - 1}.b; L{i}.angle={(i * 37) % 50}*.sin(90*.t);" for i in range(1, count))
    return f".config(10); {things} @0 L0.a=[0,0]; L0.angle=90*.t; {places} @1"


@pytest.mark.slow
def test_a_thousand_things_in_a_chain():
    sizes = {}
    for count in (100, 1000):
        motion, poses = solved(chain(count))
        plan = motion.segments[0].plan
        largest = max(len(block.unknowns) for block in plan.blocks)
        sizes[count] = len(plan.system.unknowns)
        print(f"{count} things: {sizes[count]} unknowns, {len(plan.blocks)} blocks, the largest of {largest}")
        assert largest <= 2
        ends = 10 * np.ones((count, len(poses.times)))
        turns = np.radians([[(i * 37) % 50] for i in range(count)] * np.sin(np.pi / 2 * poses.times))
        turns[0] = np.pi / 2 * poses.times
        tip = np.stack([(ends * np.cos(turns)).sum(axis=0), (ends * np.sin(turns)).sum(axis=0)], axis=-1)
        assert np.max(np.abs(anchor(motion, poses, f"L{count - 1}.b") - tip)) < 1e-9
    assert 9.9 < sizes[1000] / sizes[100] < 10.1


def strip(count):
    """Equilateral triangles side by side, each standing on two corners of the ones before."""
    things, places, corners = ["C : .bar O=[0,0] P=[100,0];"], ["C.O=[0,0]; C.angle=20*.sin(90*.t);"], ["C.O", "C.P"]
    for i in range(count):
        u, v = corners[-2:]
        things.append(f"A{i} : .bar p=[0,0] q=[100,0];  B{i} : .bar p=[0,0] q=[100,0];")
        side = "><"[i % 2]
        places.append(f"A{i}.p={u}; B{i}.p={v}; A{i}.q=B{i}.q; .a({v} - {u}, A{i}.q - {u}) {side} 0;")
        corners.append(f"A{i}.q")
    return f".config(10); {' '.join(things)} @0 {' '.join(places)} @1"


@pytest.mark.slow
def test_a_strip_of_dyads_is_solved_one_after_the_other():
    sizes = {}
    for count in (50, 500):
        motion, poses = solved(strip(count))
        blocks = motion.segments[0].plan.blocks
        quadratic = sum(method_of(block) in ("dyad", "polynomial") for block in blocks)
        sizes[count] = sum(len(block.unknowns) for block in blocks)
        angle = np.radians(20 * np.sin(np.pi / 2 * poses.times))
        tip = anchor(motion, poses, f"A{count - 1}.q")
        length = np.hypot(tip[:, 0], tip[:, 1])
        off = float(np.ptp(np.arctan2(tip[:, 1], tip[:, 0]) - angle))
        print(
            f"{2 * count + 1} things: {sizes[count]} unknowns, {quadratic} dyads; the tip's direction off by {off:.1e}"
        )
        assert quadratic == count
        assert np.ptp(length) < 1e-8
        assert off < 1e-11
        assert not any(method_of(block) == "newton" for block in blocks)
    assert 9.5 < sizes[500] / sizes[50] < 10.5


@pytest.mark.slow
def test_ten_thousand_still_things_beside_a_four_bar():
    still = "\n".join(
        f"S{i} : .bar a=[{i % 100 * 10},{i // 100 * 10}] b=[{i % 100 * 10 + 5},{i // 100 * 10}];" for i in range(10_000)
    )
    plain = examine(motion_of(four_bar())).steps[0]
    motion, poses = solved(four_bar().replace("@0", f"{still}\n@0"))
    examination = examine(motion)
    with_still = examination.steps[0]
    print(
        f"unknowns {plain.unknowns} and {with_still.unknowns}, equations {plain.equations} and {with_still.equations}"
    )
    assert (with_still.unknowns, with_still.equations) == (plain.unknowns, plain.equations)
    # a backdrop is not worth a note; the three that are drawn where a joint begins may have been forgotten
    told = [item for item in examination.diagnostics if item.code != "loop/possible"]
    assert len(told) == 3
    assert all("was it forgotten?" in note for item in told for note in item.notes)
    assert np.ptp(poses.origin[3:], axis=1).max() == 0.0
