"""Gears, racks and belts against the ratios that every textbook has, and teeth against the gaps they should be in."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import pytest

import movimentum as mv

NEAR = 1e-9
TURNS = 12


@dataclass(frozen=True)
class Wheel:
    """What the test knows of a gear: its teeth, its kind, and where one of them is centred as it is drawn."""

    teeth: int
    tooth: float = 0.0
    inner: bool = False


def solved(text: str) -> mv.api.motion.Motion:
    script = mv.loads(text)
    motion = script.solve()
    assert not [item for item in motion.diagnostics if item.severity is not mv.Severity.NOTE], motion.diagnostics
    return motion


def tooth_phase(motion, name: str, wheel: Wheel, direction):
    """How many teeth a gear has between its first tooth and a world direction (degrees): whole where one is centred."""
    return wheel.teeth * (direction - motion[f"{name}.angle"] - wheel.tooth) / 360.0


def misfit(motion, first: tuple[str, Wheel], second: tuple[str, Wheel]) -> float:
    """How far teeth are from the middle of gaps where two pitch circles touch, in teeth: the worst of all frames."""
    (a, one), (b, two) = first, second
    if two.inner:
        (a, one), (b, two) = (b, two), (a, one)
    apart = motion[f"{b}.C"] - motion[f"{a}.C"]
    towards = np.degrees(np.arctan2(apart[:, 1], apart[:, 0]))
    phase = tooth_phase(motion, a, one, towards)
    # along the common tangent, the rims of two gears run in opposite senses, those of a ring and its planet in the same
    other = tooth_phase(motion, b, two, towards if one.inner else towards + 180.0)
    together = phase - other if one.inner else phase + other
    off = together - 0.5
    return float(np.abs(off - np.round(off)).max())


def smooth(motion, name: str, most: float) -> bool:
    return bool(np.abs(np.diff(motion[f"{name}.angle"])).max() < most)


@pytest.mark.parametrize(("n1", "n2"), [(20, 20), (17, 40), (40, 9)])
@pytest.mark.parametrize("place", [(1.0, 0.0), (0.0, -1.0), (0.6, 0.8), (-0.8, 0.6)])
def test_two_gears(n1: int, n2: int, place: tuple[float, float]) -> None:
    distance = 2.5 * (n1 + n2) / 2
    x, y = 100 + distance * place[0], 90 + distance * place[1]
    motion = solved(
        f".config(10); A : .gear({n1}, 2.5) C = [3,4] T = C + [1,5]; B : .gear({n2}, 2.5) C = [0,0];"
        f"@0 A.C = [100,90]; B.C = [{x}, {y}]; A.angle = 37 + 90*.t; .mesh(A, B) = 0; @{4 * TURNS}"
    )
    turned = motion["A.angle"] - 37.0
    assert np.abs(motion["B.angle"] - motion["B.angle"][0] + turned * n1 / n2).max() < NEAR
    assert abs(motion["B.angle"][0]) <= 180.0 / n2 + NEAR  # least turned
    tooth = math.degrees(math.atan2(5, 1))
    assert misfit(motion, ("A", Wheel(n1, tooth)), ("B", Wheel(n2))) < NEAR


@pytest.mark.parametrize("statement", [".mesh(R, P) = 0;", ".mesh(P, R) = 0;"])
@pytest.mark.parametrize("driven", ["R", "P"])
def test_a_ring_and_a_gear_in_it(statement: str, driven: str) -> None:
    motion = solved(
        ".config(10); R : .gear(61, 2) .inner C = [0,0] T = C + [0,-4]; P : .gear(20, 2) C = [0,0] T = C + [3,3];"
        f"@0 R.C = [100,90]; P.C = [100, 131]; {driven}.angle = 90*.t; {statement} @{4 * TURNS}"
    )
    assert (
        np.abs(motion["P.angle"] - motion["P.angle"][0] - (motion["R.angle"] - motion["R.angle"][0]) * 61 / 20).max()
        < NEAR
    )
    assert misfit(motion, ("R", Wheel(61, -90.0, inner=True)), ("P", Wheel(20, 45.0))) < NEAR


def test_a_train_of_five() -> None:
    teeth, x, text = [12, 30, 18, 40, 15], 100.0, ""
    for k, n in enumerate(teeth):
        if k:
            x += 3 * (teeth[k - 1] + n) / 2
        text += f"G{k} : .gear({n}, 3) C = [{x}, 100] T = C + [{k}, 1];"
    text += "@0 G0.angle = 90*.t;"
    x = 100.0
    for k, n in enumerate(teeth):
        if k:
            x += 3 * (teeth[k - 1] + n) / 2
        text += f"G{k}.C = [{x}, 100];" + (f".mesh(G{k - 1}, G{k}) = 0;" if k else "")
    motion = solved(f".config(10); {text} @{4 * TURNS}")
    wheels = [Wheel(n, math.degrees(math.atan2(1, k))) for k, n in enumerate(teeth)]
    for k in range(1, 5):
        ratio = (-1) ** k * teeth[0] / teeth[k]
        assert np.abs(motion[f"G{k}.angle"] - motion[f"G{k}.angle"][0] - ratio * motion["G0.angle"]).max() < NEAR
        assert misfit(motion, (f"G{k - 1}", wheels[k - 1]), (f"G{k}", wheels[k])) < NEAR


PLANETARY = """.config(10);
Sun : .gear(20,3) C=[0,0] T=C+[30,0];    Ring : .gear(70,3) .inner C=[0,0] T=C+[0,90];
P1 : .gear(25,3) C=[67.5,0] T=C+[1,2];   P2 : .gear(25,3) C=[67.5,0] T=C+[-1,2];   P3 : .gear(25,3) C=[67.5,0];
Arm : .bar O=[0,0] A=O+[67.5,0] B=O+[67.5*.cos(120), 67.5*.sin(120)] D=O+[67.5*.cos(240), 67.5*.sin(240)];
@0 Sun.C=[150,150]; Ring.C=Sun.C; Arm.O=Sun.C; P1.C=Arm.A; P2.C=Arm.B; P3.C=Arm.D;
"""
MESHES = [".mesh(Sun,P1)=0;", ".mesh(Sun,P2)=0;", ".mesh(Sun,P3)=0;"]
MESHES += [".mesh(Ring,P1)=0;", ".mesh(P2,Ring)=0;", ".mesh(Ring,P3)=0;"]
DRIVES = [
    ("Ring.angle=0; Sun.angle=90*.t;", "Sun", "Arm", 20 / 90),
    ("Sun.angle=0; Ring.angle=90*.t;", "Ring", "Arm", 70 / 90),
    ("Arm.angle=0; Sun.angle=90*.t;", "Sun", "Ring", -20 / 70),
    ("Arm.angle=0; Ring.angle=90*.t;", "Ring", "Sun", -70 / 20),
    ("Ring.angle=0; Arm.angle=90*.t;", "Arm", "Sun", 90 / 20),
    ("Sun.angle=0; Arm.angle=-90*.t;", "Arm", "Ring", 90 / 70),
]


@pytest.mark.parametrize("order", range(3))
@pytest.mark.parametrize(("drive", "by", "of", "ratio"), DRIVES)
def test_a_planetary_gear(drive: str, by: str, of: str, ratio: float, order: int) -> None:
    meshes = (
        MESHES if order == 0 else [*reversed(MESHES)] if order == 1 else [*MESHES[::3], *MESHES[1::3], *MESHES[2::3]]
    )
    motion = solved(f"{PLANETARY} {''.join(meshes)} {drive} @{4 * TURNS}")
    turned = motion[f"{by}.angle"] - motion[f"{by}.angle"][0]
    assert np.abs(motion[f"{of}.angle"] - motion[f"{of}.angle"][0] - ratio * turned).max() < NEAR
    wheels = {"Sun": Wheel(20), "Ring": Wheel(70, 90.0, inner=True), "P1": Wheel(25, math.degrees(math.atan2(2, 1)))}
    wheels |= {"P2": Wheel(25, math.degrees(math.atan2(2, -1))), "P3": Wheel(25)}
    for planet in ("P1", "P2", "P3"):
        for centre in ("Sun", "Ring"):
            assert misfit(motion, (centre, wheels[centre]), (planet, wheels[planet])) < NEAR
    assert all(smooth(motion, name, 60.0) for name in wheels)


@pytest.mark.parametrize("planet", ["Arm.M", "Arm.O + [40,0].r(Arm.angle)", "A.C + [40,0].r(Arm.angle)"])
def test_a_differential(planet: str) -> None:
    """Two suns, a carrier with two planets that mesh with each other: the carrier has the mean of both."""
    motion = solved(
        f""".config(10); A : .gear(24,2) C=[0,0] T=C+[9,0]; B : .gear(24,2) C=[0,0] T=C+[0,9];
        P : .gear(16,2) C=[0,0]; Q : .gear(16,2) C=[0,0]; Arm : .bar O=[0,0] M=[40,0] N=[27.2, 29.32848444777155];
        @0 A.C=[100,100]; Arm.O=A.C; B.C=A.C; P.C={planet}; Q.C=Arm.N;
        .mesh(A,P)=0; .mesh(P,Q)=0; .mesh(Q,B)=0; A.angle = 50*.t; B.angle = 20*.t; @20"""
    )
    assert np.abs(motion["Arm.angle"] - motion["Arm.angle"][0] - 35.0 * motion.times).max() < NEAR


def test_a_differential_held_by_two_distances() -> None:
    """Nothing rigid joins the second planet's centre to the first's: directions are solved for with everything else.
    The arm may stand in two ways (300 degrees apart) in which teeth are in gaps; the wish chooses one.
    """
    motion = solved(
        """.config(10); A : .gear(24,2) C=[0,0] T=C+[9,0]; B : .gear(24,2) C=[0,0] T=C+[0,9];
        P : .gear(16,2) C=[0,0]; Q : .gear(16,2) C=[0,0]; Arm : .bar O=[0,0] M=[40,0];
        @0 A.C=[100,100]; Arm.O=A.C; B.C=A.C; P.C=Arm.M; (Q.C-Arm.O).l = 40; (Q.C-P.C).l = 32;
        .across(Q.C, Arm.O, Arm.M) > 0;
        .mesh(A,P)=0; .mesh(P,Q)=0; .mesh(Q,B)=0; A.angle = 50*.t; B.angle = 20*.t;
        P.angle ~ -282; @20"""
    )
    assert np.abs(motion["Arm.angle"] - motion["Arm.angle"][0] - 35.0 * motion.times).max() < NEAR
    assert misfit(motion, ("P", Wheel(16)), ("Q", Wheel(16))) < NEAR
    assert misfit(motion, ("Q", Wheel(16)), ("B", Wheel(24, 90.0))) < NEAR


def test_gears_laid_into_each_other_later() -> None:
    """What has been turned by numbers counts as it stands; the other turns by less than half a tooth."""
    motion = mv.loads(
        ".config(10); A : .gear(20, 2) C=[0,0]; B : .gear(31, 2) C=[51,0]; M : .disc(9) C=[0,0];"
        "@0 A.C=[100,100]; B.C=[151,100]; M.C=[9,9]; M.angle=77*.T; A.angle = M.angle; B.angle=0;"
        "@3 B.angle=_; .mesh(A, B)=0; @7"
    ).solve()
    assert np.abs(motion["B.angle"][motion.times < 3]).max() == 0.0
    assert abs(motion["B.angle"][30]) <= 180 / 31 + NEAR


@pytest.mark.parametrize("accuracy", ["draft", "high", "exact"])
def test_every_accuracy_knows_gears(accuracy: str) -> None:
    motion = mv.loads(
        ".config(2); S : .gear(20, 3) C=[0,0]; P : .gear(30, 3) C=[75,0] Q=[80,0]; @0 S.C=[150,150]; S.angle=0;"
        "P.C.x = 150 + 75*.cos(60*.t); P.C.y = 150 + 75*.sin(60*.t); .mesh(S, P) = 0; w = .d(P.angle);"
        "@6 P.opacity = 0.5; @24"
    ).solve(accuracy=accuracy)
    assert np.abs(motion["P.angle"] - motion["P.angle"][0] - 100 * motion.times).max() < 1e-8
    assert np.abs(motion["w"] - 100).max() < 1e-8


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("B.C=[65,10];", ("55", "50")),
        ("B.C=[60 + 3*.t,10];", ("50.", "50")),
    ],
)
def test_centres_that_do_not_fit_are_told_with_both_numbers(text: str, numbers: tuple[str, str]) -> None:
    script = mv.loads(
        "A : .gear(20, 2) C=[0,0]; B : .gear(30, 2) C=[0,0]; @0 A.C=[10,10]; A.angle=90*.t; .mesh(A,B)=0;" + text + "@4"
    )
    (found,) = [item for item in script.diagnostics if item.severity is mv.Severity.ERROR]
    assert found.code == "mesh/distance"
    assert all(each in found.message for each in numbers)


def test_centres_may_have_a_little_play() -> None:
    script = mv.loads(
        "A : .gear(20, 2) C=[0,0]; B : .gear(30, 2) C=[0,0]; @0 A.C=[10,10]; B.C=[60.09,10]; A.angle=9; .mesh(A,B)=0;"
    )
    assert not [item for item in script.diagnostics if item.severity is mv.Severity.ERROR]


def test_claims_compare_teeth_with_the_nearest_gap() -> None:
    text = (
        ".config(10); A : .gear(20, 2) C=[0,0]; B : .gear(30, 2) C=[0,0]; @0 A.C=[10,10]; B.C=[60,10]; A.angle=90*.t;"
        "B.angle = {} - 60*.t; .claim .mesh(A, B) = 0; @8"
    )
    assert [item.code for item in mv.loads(text.format("18")).diagnostics if item.severity is mv.Severity.ERROR] == []
    assert [item.code for item in mv.loads(text.format("17")).diagnostics if item.severity is mv.Severity.ERROR] == [
        "claim/broken"
    ]


@pytest.mark.parametrize("statement", [".mesh(R, G) = 0;", ".mesh(G, R) = 0;"])
@pytest.mark.parametrize("turn", [0, 30, -115])
def test_a_rack_and_a_pinion(statement: str, turn: float) -> None:
    u = np.array([math.cos(math.radians(turn)), math.sin(math.radians(turn))])
    centre = 18 * 2.0 / 2 * np.array([-u[1], u[0]]) + 20 * u
    pinion = np.array([100.0, 100.0]) + centre
    motion = solved(
        f".config(10); R : .rack(30, 2) A=[0,0] B=A+[50,0]; G : .gear(18, 2) C=[0,0] T=C+[2,1];"
        f"@0 R.angle = {turn}; R.A = [100,100] + [{u[0]},{u[1]}]*(9*.sin(90*.t));"
        f"G.C = [{pinion[0]},{pinion[1]}]; {statement} @8"
    )
    way = (motion["R.A"] - [100, 100]) @ u
    # a rack that moves forward under its pinion turns it clockwise... seen from the left of the rack
    assert np.abs(motion["G.angle"] - motion["G.angle"][0] - np.degrees(way / 18.0)).max() < NEAR
    along = (motion["G.C"] - motion["R.A"]) @ u / (math.pi * 2.0)
    phase = 18 * (turn - 90.0 - motion["G.angle"] - math.degrees(math.atan2(1, 2))) / 360.0
    off = along - phase - 0.5
    assert np.abs(off - np.round(off)).max() < NEAR


def test_a_pinion_rolls_on_a_rack() -> None:
    motion = solved(
        ".config(10); R : .rack(30, 2) A=[0,0] B=A+[50,0]; G : .gear(18, 2) C=[0,0] T=C+[2,1];"
        "@0 R.A = [10,10]; R.angle = 0; G.C.y = 28; G.angle = -90*.t; .mesh(R, G) = 0; @8"
    )
    way = motion["G.C"][:, 0] - motion["G.C"][0, 0]
    assert np.abs(way - 18 * np.radians(90 * motion.times)).max() < NEAR


@pytest.mark.parametrize(("crossed", "sign"), [("", 1.0), (".crossed", -1.0)])
@pytest.mark.parametrize("form", [".belt(A, B) {} = 0;", ".belt(A, B) = 0 {};"])
@pytest.mark.parametrize("held", [True, False])
def test_belts(crossed: str, sign: float, form: str, held: bool) -> None:
    statement = form.format(crossed)
    arm = "Arm.angle = 0;" if held else "Arm.angle = -40*.t;"
    motion = solved(
        ".config(10); A : .disc(30) C=[0,0] P=[30,0]; B : .disc(12) C=[90,0] P=[95,0]; Arm : .bar O=[0,0] E=[90,0];"
        f"@0 A.C=[100,100]; Arm.O=A.C; B.C=Arm.E; {arm} A.angle = 10 + 90*.t; {statement} @{4 * TURNS}"
    )
    carrier = motion["Arm.angle"]
    assert np.abs((motion["B.angle"] - carrier) - sign * 30 / 12 * (motion["A.angle"] - carrier)).max() < NEAR


@pytest.mark.parametrize(("begin", "rate", "crossed"), [(0, 10, ""), (25, -40, ""), (7, 15, ".crossed")])
def test_a_belt_that_is_laid_on_and_taken_off_goes_on_from_where_things_are(begin, rate, crossed) -> None:
    """A clutch: first each by itself, then together, at rest, and together again; so does a belt behind it."""
    ratio = (-1 if crossed else 1) * 30 / 12
    rest = begin + rate + 180 * ratio
    motion = solved(
        ".config(10); A : .disc(30) C=[0,0] P=[9,0]; B : .disc(12) C=[90,0] P=[95,0]; D : .disc(20) C=[180,0];"
        "@0 A.C=[0,0]; B.C=[90,0]; D.C=[180,0]; A.angle = 10 + 90*.T; D.angle = 5;"
        f"B.angle = {begin} + {rate}*.T; @1 B.angle = _; .belt(A, B) {crossed} = 0; @2 D.angle = _; .belt(B, D) = 0;"
        f"@3 .belt(A, B) = _; B.angle = {rest}; @4 B.angle = _; .belt(A, B) = 0; @5"
    )
    together, again = np.clip(motion.times, 1, 3) - 1, np.clip(motion.times, 4, 5) - 4
    turn = begin + rate * np.clip(motion.times, 0, 1) + 90 * (ratio * together + 30 / 12 * again)
    assert np.abs(motion["B.angle"] - turn).max() < NEAR
    since = np.where(motion.times > 2, turn - turn[20], 0)
    assert np.abs(motion["D.angle"] - 5 - 12 / 20 * since).max() < NEAR


@pytest.mark.parametrize(("begin", "rate"), [(0, 50), (0, -70), (33, 200)])
def test_gears_that_come_into_mesh_turn_to_the_next_gap_from_where_they_are(begin, rate) -> None:
    motion = solved(
        ".config(10); A : .gear(20, 5) C=[0,0]; B : .gear(12, 5) C=[80,0]; @0 A.C=[0,0]; B.C=[80,0];"
        f"A.angle = 30*.T; B.angle = {begin} + {rate}*.T; @1 B.angle = _; .mesh(A, B) = 0; @2"
    )
    assert abs(motion["B.angle"][10] - begin - rate) <= 180 / 12 + NEAR
    assert np.abs(np.diff(motion["B.angle"][10:]) + 20 / 12 * 3).max() < NEAR


def test_a_gear_on_a_slider_that_goes_round() -> None:
    """Nothing rigid joins the centres: the direction between them is followed over whole turns."""
    motion = solved(
        ".config(20); S : .gear(20, 3) C=[0,0]; P : .gear(30, 3) C=[75,0];"
        "@0 S.C=[150,150]; S.angle=0; P.C.x = 150 + 75*.cos(60*.t); P.C.y = 150 + 75*.sin(60*.t); .mesh(S, P) = 0; @24"
    )
    assert np.abs(motion["P.angle"] - motion["P.angle"][0] - (1 + 20 / 30) * 60 * motion.times).max() < NEAR
    assert misfit(motion, ("S", Wheel(20)), ("P", Wheel(30))) < NEAR


def test_a_gear_that_rolls_about_another() -> None:
    """Its turn is given, and so where it is."""
    motion = solved(
        ".config(20); S : .gear(20, 3) C=[0,0]; P : .gear(30, 3) C=[75,0];"
        "@0 S.C=[150,150]; S.angle=0; (P.C - S.C).l = 75; P.angle = 100*.t; .mesh(S, P) = 0; @12"
    )
    apart = motion["P.C"] - motion["S.C"]
    towards = np.degrees(np.unwrap(np.arctan2(apart[:, 1], apart[:, 0])))
    assert np.abs(towards - towards[0] - 60 * motion.times).max() < NEAR
    assert misfit(motion, ("S", Wheel(20)), ("P", Wheel(30))) < NEAR


def test_a_train_goes_on_over_a_step() -> None:
    """A step about something else chooses no other teeth."""
    motion = solved(
        ".config(10); A : .gear(20, 2) C=[0,0]; B : .gear(31, 2) C=[51,0]; D : .disc(5) C=[0,0];"
        "@0 A.C=[100,100]; B.C=[151,100]; A.angle=77*.T; .mesh(A, B)=0; D.C=[9,9]; @3.3 D.opacity = 0.5; @7"
    )
    assert np.abs(motion["B.angle"] - motion["B.angle"][0] + motion["A.angle"] * 20 / 31).max() < NEAR


@pytest.mark.parametrize(
    "place", ["B.C = A.C + [51,0];", "A.C = B.C - [51,0]; B.C = [151,100];", "B.C - A.C = [51,0];"]
)
def test_a_centre_beside_another(place: str) -> None:
    fixed = "" if "B.C = [151" in place else "A.C=[100,100];"
    motion = solved(
        ".config(10); A : .gear(20, 2) C=[0,0] T=C+[1,1]; B : .gear(31, 2) C=[0,0];"
        f"@0 {fixed} {place} A.angle=77*.T; .mesh(A, B)=0; @9"
    )
    assert np.abs(motion["B.angle"] - motion["B.angle"][0] + motion["A.angle"] * 20 / 31).max() < NEAR
    assert misfit(motion, ("A", Wheel(20, 45.0)), ("B", Wheel(31))) < NEAR


@pytest.mark.parametrize("seed", range(12))
def test_trains_of_any_gears_on_an_arm_that_turns(seed: int) -> None:
    """Willis' formula: about the arm, each gear turns as if the arm stood still."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 7))
    teeth = [int(n) for n in random.integers(9, 60, count)]
    module = float(random.choice([0.5, 2.0, 3.25]))
    centre, places, wheels, text = np.zeros(2), [np.zeros(2)], [], ""
    for a, b in itertools.pairwise(teeth):
        way = random.uniform(0, 2 * math.pi)
        centre = centre + module * (a + b) / 2 * np.array([math.cos(way), math.sin(way)])
        places.append(centre)
    anchors = " ".join(f"A{k} = {place.tolist()}" for k, place in enumerate(places))
    statements = ["Arm.A0 = [300, 200];", "Arm.angle = 15 - 25*.t;", "G0.angle = 70*.t;"]
    for k, n in enumerate(teeth):
        tooth = [float(x) for x in random.normal(size=2)]
        wheels.append(Wheel(n, math.degrees(math.atan2(tooth[1], tooth[0]))))
        text += f"G{k} : .gear({n}, {module}) C = [0,0] T = C + {tooth};"
        statements.append(f"G{k}.C = Arm.A{k};")
        if k:
            statements.append(f".mesh(G{k - 1}, G{k}) = 0;" if random.random() < 0.5 else f".mesh(G{k}, G{k - 1}) = 0;")
    random.shuffle(statements)
    motion = solved(f".config(5); {text} Arm : .bar {anchors}; @0 {''.join(statements)} @30")
    about = [motion[f"G{k}.angle"] - motion["Arm.angle"] for k in range(count)]
    for k in range(1, count):
        ratio = (-1) ** k * teeth[0] / teeth[k]
        turned = about[k] - about[k][0] - ratio * (about[0] - about[0][0])
        assert np.abs(turned).max() < NEAR
        assert misfit(motion, (f"G{k - 1}", wheels[k - 1]), (f"G{k}", wheels[k])) < NEAR
