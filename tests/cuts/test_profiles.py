"""What is cut, against closed forms: position, pressure angle and curvature; and law, cut, touch, law again."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad

CENTRE = 150.0 + 130.0j


def law(seed: int) -> tuple[str, float, list[tuple[float, int, float]]]:
    """A random lift in terms of the turn `w` (its text and its terms), and an offset of the follower."""
    random = np.random.default_rng(seed)
    waves = [(round(random.uniform(0.5, 4.0), 3), int(k), round(random.uniform(0.0, 360.0), 2)) for k in (1, 2, 3)]
    return " + ".join(f"{a}*.sin({k}*w + {p})" for a, k, p in waves), round(random.uniform(-8.0, 8.0), 3), waves


def lifts(waves: list[tuple[float, int, float]], turn: np.ndarray, base: float) -> list[np.ndarray]:
    """The lift and its first two derivatives by the turn (radians)."""
    phases = [(a, k, k * turn + np.radians(p)) for a, k, p in waves]
    return [
        base + sum(a * np.sin(q) for a, k, q in phases),
        sum(a * k * np.cos(q) for a, k, q in phases),
        -sum(a * k * k * np.sin(q) for a, k, q in phases),
    ]


def cam(seed: int, radius: float = 12.0) -> str:
    text, offset, _ = law(seed)
    return f"""
.config(90, 300, 300);
Shaft  : .disc(8) C = [150,130];
Roller : .disc({radius}) C = [150,195];
Cam    : .cut Roller .in Shaft;
@0  Shaft.C = [150,130];   w = 90*.t;   Shaft.angle = w;
    Roller.C = [150 + {offset}, 195 + {text}];   Roller.angle = 0;
"""


SEEDS = [pytest.param(seed, marks=[pytest.mark.slow] * (seed > 0)) for seed in range(24)]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_roller_cuts_the_profile_of_its_law(seed: int) -> None:
    radius = 12.0
    motion = mv.loads(cam(seed, radius) + "@4").solve()
    _, offset, waves = law(seed)
    turn = np.radians(90.0 * np.asarray(motion.times, dtype=float))
    h, rise, bend = lifts(waves, turn, 65.0)
    # the centre's path in the turning frame, times e^(i turn)
    z = offset + 1j * h
    first = 1j * rise - 1j * z
    second = 1j * bend + rise - 1j * first
    curvature = np.imag(np.conj(first) * second) / abs(first) ** 3  # the path goes clockwise
    assert np.abs(motion[".gap(Roller, Cam)"]).max() < 1e-9
    pressure = motion[".a(.tangent(Cam, .where(Roller.C, Cam)), [1,0])"]
    off = np.degrees(np.angle(np.exp(1j * np.radians(pressure)) * -first / abs(first)))
    assert np.abs(off).max() < 1e-9
    of_cam = 1.0 / (1.0 / -curvature - radius)
    told = motion[".curvature(Cam, .where(Roller.C, Cam))"]
    assert np.abs(told - of_cam).max() < 1e-9 * np.abs(of_cam).max()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_flat_face_cuts_the_profile_of_its_law(seed: int) -> None:
    text, _, waves = law(seed)
    script = f"""
.config(90, 300, 300);
Shaft : .disc(8) C = [150,130];
Face  : .bar A = [20,220] B = [280,220];
Cam   : .cut Face .in Shaft;
@0  Shaft.C = [150,130];   w = 90*.t;   Shaft.angle = w;
    Face.A = [20, 220 + {text}];   Face.angle = 0;
@4
"""
    motion = mv.loads(script).solve()
    h, rise, _ = lifts(waves, np.radians(90.0 * np.asarray(motion.times, dtype=float)), 90.0)
    assert np.abs(motion[".gap(Face, Cam)"]).max() < 1e-9
    s = ".where([150 + {}, 220 + {}], Cam)".format(
        " + ".join(f"{a * k}*.cos({k}*90*.t + {p})" for a, k, p in waves),
        " + ".join(f"{a}*.sin({k}*90*.t + {p})" for a, k, p in waves),
    )
    place = motion[f".point(Cam, {s})"]
    assert np.abs(place - np.stack([150.0 + rise, 130.0 + h], axis=-1)).max() < 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_law_cut_touch_law(seed: int) -> None:
    """Another roller that is only held to the profile moves by the law, through 360 places."""
    _text, offset, _ = law(seed)
    script = (
        cam(seed).replace("@0", "Other : .disc(12) C = [150,195];\n@0")
        + f"""
    Other.C.x = 150 + {offset};   Other.angle = 0;   Other.C.y > 130;   .gap(Other, Cam) = 0;
@4
"""
    )
    motion = mv.loads(script).solve()
    assert len(motion.times) == 361
    assert np.abs(motion["Other.C"] - motion["Roller.C"]).max() < 1e-9


@broad("pressure", [20.0, 14.5, 25.0], first=1)
def test_a_flank_of_a_rack_cuts_an_involute(pressure: float) -> None:
    """Its normals touch the base circle."""
    script = f"""
.config(25, 400, 400);
Wheel : .disc(5) C = [200,200];
Flank : .bar A = [200,300] B = A + [0,60].r({pressure});
Tooth : .cut Flank .in Wheel;
@0  Wheel.C = [200,200];   Wheel.angle = -40 + 20*.t;
    Flank.A = [200 - 100*.pi/180*(-40 + 20*.t) + 20*.sin({pressure}), 300 - 20*.cos({pressure})];   Flank.angle = 0;
@4
"""
    scene = mv.loads(script).solve().timeline.scene
    outline = scene.things[2].own.outline
    lengths = np.linspace(0.05, 0.95, 200) * outline.period
    x, y, dx, dy = outline.values(lengths)[:4]
    arm = abs(x * dx + y * dy) / np.hypot(dx, dy)
    base = 100.0 * np.cos(np.radians(pressure))
    assert np.sum(abs(arm - base) < 1e-7) > 60


def test_a_pin_on_a_rotor_cuts_a_housing() -> None:
    """The apex of a Wankel rotor goes along an epitrochoid; a round apex leaves its parallel curve."""
    script = """
.config(30, 400, 400);
House : .disc(5) C = [200,200];
Apex  : .disc(10) C = [320,200];
Hull  : .cut Apex .in House .outer;
@0  House.C = [200,200];   House.angle = 0;
    Apex.C = [200 + 18*.cos(360*.t) + 105*.cos(120*.t), 200 + 18*.sin(360*.t) + 105*.sin(120*.t)];   Apex.angle = 0;
@3
"""
    motion = mv.loads(script).solve()
    assert np.abs(motion[".on(Apex.C, Hull)"] - 10.0).max() < 1e-9
    turn = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    z = 18.0 * np.exp(3j * turn) + 105.0 * np.exp(1j * turn)
    rate = 54.0j * np.exp(3j * turn) + 105.0j * np.exp(1j * turn)
    outside = z - 10.0j * rate / abs(rate)
    drawn = np.array(motion.timeline.scene.things[2].own.outline.polyline) @ [1.0, 1.0j]
    assert np.abs(outside[:, None] - drawn).min(axis=1).max() < 2.0  # no part is missing


def test_constant_width() -> None:
    """A face whose law and its opposite sum up to a constant cuts a cam between two parallel faces."""
    script = """
.config(30, 400, 400);
Shaft : .disc(8) C = [200,200];
Face  : .bar A = [50,260] B = [350,260];
Low   : .bar A = [50,140] B = [350,140];
Cam   : .cut Face .in Shaft;
@0  Shaft.C = [200,200];   Shaft.angle = 120*.t;
    Face.A = [50, 260 + 5*.sin(3*120*.t) + 12*.cos(120*.t)];   Face.angle = 0;
    Low.A.x = 50;   Low.angle = 0;   Low.A.y < 200;   .gap(Low, Cam) = 0;
@3
"""
    motion = mv.loads(script).solve()
    assert np.abs(motion["Face.A.y - Low.A.y"] - 120.0).max() < 1e-7


@broad("lift", [26.0, 32.0], first=1)
def test_undercut_is_told_with_the_radius_that_would_do(lift: float) -> None:
    script = f"""
.config(25, 400, 400);
Shaft  : .disc(8)  C = [200,200];
Roller : .disc(30) C = [200,260];
Cam    : .cut Roller .in Shaft;
@0  Shaft.C = [200,200];   Shaft.angle = 90*.t;
    Roller.C = [200, 260 + {lift}*(1 - .cos(360*.t))];   Roller.angle = 0;
@4
"""
    loaded = mv.loads(script)
    (told,) = [item for item in loaded.diagnostics if item.code == "contact/undercut"]
    radius = float(told.helps[0].split()[3])
    turn = np.linspace(0.0, 2.0 * np.pi, 100_001)
    h, rise, bend = 60.0 + lift * (1 - np.cos(4 * turn)), 4 * lift * np.sin(4 * turn), 16 * lift * np.cos(4 * turn)
    least = np.min(((h**2 + rise**2) ** 1.5 / (h**2 + 2 * rise**2 - h * bend))[h**2 + 2 * rise**2 > h * bend])
    assert radius == pytest.approx(least, rel=2e-3)
    assert radius < least
    mended = script.replace("disc(30)", f"disc({radius})")
    assert all(item.code != "contact/undercut" for item in mv.loads(mended).diagnostics)


@broad("seed", [4, 0, 1, *range(6, 30)], first=3)
def test_the_radius_that_would_do_does_and_no_larger_one(seed: int) -> None:
    """Of random laws; also where the way of the roller comes near itself elsewhere, and where the roller as drawn goes
    over the shaft.
    """
    random = np.random.default_rng(seed)
    scale = [1.0, 0.01, 30.0, 1000.0][seed % 4]
    waves = [(round(random.uniform(8, 25), 3) / k * scale, k, round(random.uniform(0, 360), 2)) for k in (1, 2, 3, 4)]
    lift = " + ".join(f"{a!r}*.sin({k}*w + {p})" for a, k, p in waves)
    radius, offset = (random.uniform((25.0, -8.0), (60.0, 8.0)) * scale).tolist()

    def told(size: float) -> list[float]:
        script = mv.loads(f""".config(25, 300, 300);
Shaft : .disc({8 * scale!r}) C = [0,0]; Roller : .disc({size!r}) C = [0,{80 * scale!r}]; Cam : .cut Roller .in Shaft;
@0 Shaft.C = [0,0]; w = 90*.t; Shaft.angle = {(-1) ** seed}*w; Roller.C = [{offset!r}, {80 * scale!r} + {lift}];
@4""")
        helps = [item.helps[0] for item in script.diagnostics if item.code == "contact/undercut"]
        return [float(each.split()[3]) for each in helps]

    if not (found := told(radius)):
        return  # this one does
    assert told(found[0]) == []
    for larger in (1.03, 1.1):  # a little larger one cuts away less than can be seen
        assert told(found[0] * larger) == pytest.approx(found, rel=1e-3)


def test_a_flat_face_that_comes_too_near() -> None:
    """The radius of curvature of the profile is 32 + 36 cos: at the least -4."""
    script = """
.config(25, 300, 300);
Shaft : .disc(8)  C = [150,130];
Face  : .bar A = [50,150] B = [250,150];
Cam   : .cut Face .in Shaft;
@0  Shaft.C = [150,130];   Shaft.angle = 90*.t;   Face.A = [50, 150 + 12*(1 - .cos(180*.t))];   Face.angle = 0;
@4
"""
    (told,) = [item for item in mv.loads(script).diagnostics if item.code == "contact/undercut"]
    assert "by 4 px" in told.helps[0]


def test_frames_do_not_matter() -> None:
    """The profile is the same at any rate, and moved."""
    outlines = [
        mv.loads(cam(3).replace("config(90", f"config({fps}") + "@4").solve().timeline.scene.things[2].own.outline
        for fps in (1, 7)
    ]
    assert outlines[0].polyline == outlines[1].polyline
