"""Constants, parts, copies, loops and includes: what is written out is what somebody would have written by hand."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import movimentum as mv
from movimentum.errors import MovimentumError, UsageError
from tests.broad import broad

STAGES = """
.part Stage(len = 120) {
  A : .bar P = [0,0]  M = P + [len/2, 0]  Q = P + [len, 0]  .width(6);
  B : .bar P = [0,40] M = P + [len/2, 0]  Q = P + [len, 0]  .width(6);
  @0  A.M = B.M;
}
S[1..3] : Stage(100);
@0  S[1].A.P = [60,60];  S[1].B.P = [60, h];
    .for k = 2..3 { S[k].A.P = S[k-1].B.Q;   S[k].B.P = S[k-1].A.Q; }
    h = 100 + 20*.t;
@2
"""

BY_HAND = (
    "".join(
        f"S{k}A : .bar P = [0,0] M = [50,0] Q = [100,0]; S{k}B : .bar P = [0,40] M = [50,40] Q = [100,40];"
        for k in (1, 2, 3)
    )
    + """
@0 S1A.M = S1B.M; S2A.M = S2B.M; S3A.M = S3B.M; S1A.P = [60,60]; S1B.P = [60, h];
   S2A.P = S1B.Q; S2B.P = S1A.Q; S3A.P = S2B.Q; S3B.P = S2A.Q; h = 100 + 20*.t;
@2
"""
)


def test_a_scissor_lift_is_the_one_written_by_hand() -> None:
    made, hand = mv.loads(STAGES).solve(), mv.loads(BY_HAND).solve()
    for k in (1, 2, 3):
        for bar in "AB":
            for anchor in "PMQ":
                np.testing.assert_array_equal(made[f"S[{k}].{bar}.{anchor}"], hand[f"S{k}{bar}.{anchor}"])


def test_constants_in_any_order_everywhere() -> None:
    script = mv.loads(
        """
        .let L = 3*R; .let R = 50; .let O = [R, 2*R]; .let last = .sqrt(4); .let rate = 5*last;
        .config(rate, 8*R, L + 50) .background('white');
        A : .disc(R/5) C = O + [L, 0]; B : .bar P = O Q = P + [R, 0].r(90) .width(R/10);
        @0 A.C = [O.x + R*.t, L]; @last
        """
    )
    scene = script.scene
    assert scene.config.fps == 10
    assert scene.config.size == (400, 200)
    assert scene.things[0].anchors[0].local == (200, 100)
    assert scene.things[1].anchors[1].local == (50, 150)
    assert scene.steps[-1].time == 2
    assert {item.name: [float(part.value) for part in item.value] for item in scene.constants} == {
        "L": [150], "R": [50], "O": [50, 100], "last": [2], "rate": [10],
    }  # fmt: skip


def test_places_of_constants_in_anchors() -> None:
    """Coordinates of a vector constant, and an anchor with a constant's name."""
    script = mv.loads(
        ".let O = [20, 30]; .let at = O; A : .bar O = O P = O + [at.y, 1] Q = [at.x/2, -at.y + 12]; @0 A.O = O; @1"
    )
    assert [anchor.local for anchor in script.scene.things[0].anchors] == [(20, 30), (50, 31), (10, -18)]


def test_a_constant_is_exact() -> None:
    script = mv.loads(".let third = 1/3; .let t2 = 3*third; A : .disc(3) C=[0,0]; @0 A.C=[t2,0]; @third @third*2 @t2")
    assert [str(step.time) for step in script.scene.steps] == ["0", "1/3", "2/3", "1"]


def test_a_slider_has_a_range_and_a_unit() -> None:
    (phase,) = mv.loads(".let phase = 90 .range(0, 2*180) .unit('°'); A : .disc(3) C=[phase,0]; @0").scene.constants
    assert (phase.least, phase.most, phase.unit) == (0.0, 360.0, "°")


def test_constants_are_set_from_outside(tmp_path: Path) -> None:
    text = ".let R = 50; .let L = 3*R; A : .disc(3) C=[R,L]; @0"
    assert mv.loads(text, R=60).scene.things[0].anchors[0].local == (60, 180)
    assert mv.loads(text, L="R/2").scene.things[0].anchors[0].local == (50, 25)
    with pytest.raises(UsageError, match="did you mean `R`"):
        mv.loads(text, r=3)
    with pytest.raises(UsageError, match="not a constant expression"):
        mv.loads(text, R="3; @0")


# --- copies that are placed ---------------------------------------------------------------------------

FOUR_BAR = """
.part Linkage(speed = 90) {
  Crank : .bar O = [0,0] P = [30,0];
  Rod   : .bar P = [30,0] Q = [110,20] K = P + [20,45];
  Rocker : .bar Q = [110,20] R = [100,-40];
  @0 Crank.O = [0,0]; Rocker.R = [100,-40]; Rod.P = Crank.P; Rod.Q = Rocker.Q;
     Crank.angle = speed*.t; low = Rod.K.y - 3; side = (Rod.K - Crank.O).l;  lean = .a(Rod.Q - Rod.P, [1,0]);
     across = .across(Rod.K, Crank.O, Rocker.R); along = .along(Rod.K, Crank.O, [0,1] + [3,4]);
     middle = (Rod.P + Rod.Q)/2; seen = .d(Rod.K);
  @2 Crank.angle = 180 - 30*.t; @3
}
"""
MEASURES = ("low", "side", "lean", "across", "along")


@cache
def plain_linkage() -> mv.Motion:
    return mv.loads(FOUR_BAR + "A : Linkage(); @0 @3").solve()


@pytest.mark.slow
@settings(max_examples=10)
@given(st.floats(-300, 300), st.floats(-300, 300), st.floats(-180, 180), st.booleans(), st.booleans())
def test_a_placed_copy_moves_like_the_part_carried_along(
    x: float, y: float, turned: float, mirrored: bool, nested: bool
) -> None:
    plain = plain_linkage()
    placing = f".at([{x!r}, {y!r}]) .turned({turned!r}) {'.mirrored' if mirrored else ''}"
    inside = ".part Two() { In : Linkage() .at([10,20]) .turned(30) .mirrored; } " if nested else ""
    copy = "C : Two()" if nested else "C : Linkage()"
    name = "C.In" if nested else "C"
    placed = mv.loads(f"{FOUR_BAR} {inside} {copy} {placing}; @0 @3").solve()

    def carried(points: np.ndarray, at: tuple[float, float], degrees: float, flip: bool) -> np.ndarray:
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        u = -points[:, 0] if flip else points[:, 0]
        return np.stack([at[0] + c * u - s * points[:, 1], at[1] + s * u + c * points[:, 1]], axis=1)

    for anchor in ("Crank.P", "Rod.K", "Rocker.Q"):
        points = plain[f"A.{anchor}"]
        if nested:
            points = carried(points, (10, 20), 30, True)
        points = carried(points, (x, y), turned, mirrored)
        np.testing.assert_allclose(placed[f"{name}.{anchor}"], points, atol=1e-9)
    turn = -1 if mirrored != nested else 1
    np.testing.assert_allclose(placed[f"{name}.Crank.angle"], turn * plain["A.Crank.angle"], atol=1e-9)
    for measure in MEASURES:
        np.testing.assert_allclose(placed[f"{name}.{measure}"], plain[f"A.{measure}"], atol=1e-8)
    for vector in ("middle", "seen"):
        np.testing.assert_allclose(placed[f"{name}.{vector}"], plain[f"A.{vector}"], atol=1e-7)


@pytest.mark.parametrize("right", ["[30, 80 -> 20]", "[5*.t -> 40, 7]", "[1 -> 2, 3 -> -4*.t]"])
@pytest.mark.parametrize("placed", ["", ".at([9,5]) .turned(35) .mirrored"])
def test_a_component_that_moves_is_the_eased_vector(right: str, placed: str) -> None:
    def ends(k: int) -> str:
        return f"[{', '.join(part.split('->')[k * (len(part.split('->')) - 1)] for part in right[1:-1].split(','))}]"

    def path(said: str) -> np.ndarray:
        text = (
            f".part Lift {{ Cup : .bar H=[0,0] G=[9,0]; @0 Cup.H = {said}; Cup.angle = 0; }} @0 @2 A : Lift() {placed};"
        )
        return mv.loads(text).solve().at([0, "1/3", 1, 2])["A.Cup.H"]

    np.testing.assert_allclose(path(right), path(f"{ends(0)} + ({ends(1)} - {ends(0)})*.ease(.s)"), atol=1e-12)


def test_a_statement_of_a_placed_copy_keeps_its_key() -> None:
    text = FOUR_BAR + "C : Linkage() .at([100, 50]); @0 C.Rocker.R = [210, 20]; @3"
    with pytest.raises(MovimentumError, match="constraint/conflict"):
        mv.loads(text).solve()  # both hold together: they are stated in one step
    later = FOUR_BAR + "C : Linkage() .at([100, 50]); @0 @1 C.Rocker.R = [201, 11]; @3"
    assert mv.loads(later).solve()["C.Rocker.R"][-1].tolist() == pytest.approx([201, 11])


# --- steps --------------------------------------------------------------------------------------------


def test_steps_of_parts_count_from_the_first_step() -> None:
    script = mv.loads(
        """
        .part Door() { D : .bar O=[0,0] P=[50,0]; D.O = [0,0]; @0 D.angle = 0; @1 D.angle = 30*.t; @+1 D.angle = 30; }
        A : Door(); B : .disc(3) C = [0,9];
        @5 B.C = [9, 9]; @6 B.C = [.t, 0]; @9
        """
    )
    assert [float(step.time) for step in script.scene.steps] == [5, 6, 7, 9]
    motion = script.solve()
    times = motion.times
    np.testing.assert_allclose(motion["A.D.angle"], np.clip(30 * (times - 6), 0, 30), atol=1e-9)


def test_the_example_of_the_index() -> None:
    script = mv.loads(
        """
        .part Leg(phase) { F : .bar O=[0,0] P=[20,0]; @0 F.O = [0,0]; F.angle = phase; }
        Leg[k = 0..5] : Leg(60*k) .at([100*k, 0]);
        @0
        """
    )
    motion = script.solve()
    for k in range(6):
        assert motion[f"Leg[{k}].F.O"][0].tolist() == [100 * k, 0]
        assert motion[f"Leg[{k}].F.angle"][0] == 60 * k


def test_things_in_loops_and_arrays_of_things() -> None:
    script = mv.loads(
        """
        .let n = 3;
        Dot[i = 1..n] : .disc(2*i) C = [10*i, 0];
        .for k = 1..n { Rod[k] : .bar A = [0, 10*k] B = [50, 10*k]; .for j = 1..2 { Pin[k][j] : .disc(j) C = [k, j]; } }
        L : .line Dot[1].C Rod[n].B .width(2);
        @0 .for k = 1..n { w[k] = 5*k; Rod[k].A = [0, 10*k]; Rod[k].angle = 0; Dot[k].C = Rod[k].B + [w[k], 0]; }
        """
    )
    assert [thing.name for thing in script.scene.things] == [
        "Dot[1]", "Dot[2]", "Dot[3]", "Rod[1]", "Pin[1][1]", "Pin[1][2]", "Rod[2]", "Pin[2][1]", "Pin[2][2]",
        "Rod[3]", "Pin[3][1]", "Pin[3][2]", "L",
    ]  # fmt: skip
    motion = script.solve()
    assert motion["Dot[3].C"][0].tolist() == [65, 30]
    assert motion["w[2]"][0] == 10


# --- files --------------------------------------------------------------------------------------------


def test_parts_of_another_file(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "leg.mov").write_text(
        ".include 'sizes.mov'; .part Leg() { F : .bar O=[0,0] P=[len,0]; S : 'dot.png' C=[1,1]; @0 F.O=[7,7]; "
        "S.C = F.P; } X : .bar A=[0,0] B=[1,1]; @0"
    )
    (tmp_path / "parts" / "sizes.mov").write_text(".let len = 40; .include 'leg.mov';")
    from PIL import Image

    Image.new("RGB", (4, 4)).save(tmp_path / "parts" / "dot.png")
    main = tmp_path / "main.mov"
    main.write_text(".include 'parts/leg.mov'; A : Leg(); @0 A.F.angle = 90; @1")
    with pytest.raises(MovimentumError, match="includes itself"):
        mv.load(main)
    (tmp_path / "parts" / "sizes.mov").write_text(".let len = 40;")
    motion = mv.load(main).solve()
    np.testing.assert_allclose(motion["A.F.P"][0], [7, 47], atol=1e-12)
    assert mv.load(main, len=50).solve()["A.F.P"][0].tolist() == pytest.approx([7, 57])
    (tmp_path / "parts" / "sizes.mov").write_text(".let len = 4*;")
    with pytest.raises(MovimentumError, match=r"sizes\.mov:1:14"):
        mv.load(main)


# --- what is wrong ------------------------------------------------------------------------------------

PART = ".part P(a) { A : .bar X=[0,0] Y=[a,0]; @0 A.X = [0,0]; } "
WRONG = {
    "name/cycle": (".let a = b; .let b = a + 1; D : .disc(a) C=[0,0]; @0", "`a` → `b` → `a`"),
    "name/index": (PART + "S[1..3] : P(5); @0 S[4].A.X = [0,0];", "`S` has 1 to 3"),
    "name/outside": (".part Q() { A : .bar X=[0,0] Y=[5,0]; @0 A.X = O.C; } O : .disc(3) C=[0,0]; q : Q(); @0", "`O`"),
    "name/unknown-part": (PART.replace("P(a)", "Stage(a)") + "S : Stag(3); @0", "did you mean `Stage`"),
    "name/unknown-constant": (".let a = bb; D : .disc(a) C=[0,0]; @0", "bb"),
    "limit/copies": (PART + "S[1..1000000] : P(5); @0", "100,000"),
    "syntax/arguments": (PART + "S : P(); @0", "needs its argument `a`"),
    "syntax/unknown-option": (PART + "S : P(3) .tuned(4); @0", "did you mean `.turned`"),
    "name/duplicate": (PART + "S : P(3); S : .disc(3) C=[0,0]; @0", "two things called `S`"),
    "kind/mismatch": (PART + "S : P(3); @0 x = S;", "a copy of a part, not a value"),
    "name/unknown-thing": (PART + "S : P(3); @0 x = S.B;", "`S` has no `B`"),
    "asset/missing": (".include 'nowhere.mov'; @0", "nowhere.mov"),
}


@pytest.mark.parametrize("code", WRONG)
def test_what_is_wrong_is_told(code: str) -> None:
    text, said = WRONG[code]
    with pytest.raises(MovimentumError) as caught:
        mv.loads(text)
    assert code in {item.code for item in caught.value.diagnostics}, caught.value
    assert said in str(caught.value)


def test_a_part_made_of_itself_is_refused() -> None:
    with pytest.raises(MovimentumError, match="`P` is made of itself: `P` → `Q` → `P`"):
        mv.loads(".part P() { a : Q(); } .part Q() { b : P(); } x : P(); @0")


def test_an_error_in_a_part_is_told_with_its_copy() -> None:
    with pytest.raises(MovimentumError) as caught:
        mv.loads(PART.replace("A.X = [0,0];", "A.Z = [0,0];") + "S[1..2] : P(5); @0")
    first, second = caught.value.diagnostics
    assert first.span == second.span
    assert [label.message for label in first.labels if "copy" in label.message] == ["for the copy `S[1]`"]
    assert [label.message for label in second.labels if "copy" in label.message] == ["for the copy `S[2]`"]


@pytest.mark.parametrize("count", [20, 40])
def test_a_long_chain_of_constants_and_nested_loops(count: int) -> None:
    lets = "".join(f".let a{k} = a{k + 1} + a{k + 1}/a{k + 2};" for k in range(count))
    script = mv.loads(f"{lets} .let a{count} = 1; .let a{count + 1} = 1; D : .disc(3) C=[a0/a0, 0]; @0")
    assert script.scene.things[0].anchors[0].local == (1, 0)


def test_a_cycle_of_ten_thousand_constants() -> None:
    lets = "".join(f".let a{k} = a{(k + 1) % 10_000};" for k in range(10_000))
    with pytest.raises(MovimentumError, match="name/cycle"):
        mv.loads(f"{lets} D : .disc(a0) C=[0,0]; @0")


HUGE = {
    "copies in copies": "".join(f".part P{k}() {{ a : P{k + 1}(); b : P{k + 1}(); }} " for k in range(30))
    + ".part P30() { D : .disc(3) C=[0,0]; } x : P0(); @0",
    "deep parts": "".join(f".part P{k}() {{ a : P{k + 1}(); }} " for k in range(3000)) + "x : P0(); @0",
    "loops in loops": "@0 " + ".for k = 1..9 { " * 50 + "x = 1;" + "}" * 50,
    "turns": "@0 .for i = 1..99999 { .for j = 1..99999 { .for k = 1..2 { x = 1; } } }",
    "a range": "@0 .for i = 1..10^300 { x = 1; }",
    "long text": "@0 .for i = 1..5000 { x = 1; /*" + "long " * 20_000 + "*/ y = 2; }",
    "an array": "D[i = 1..10^9][j = 1..10^9] : .disc(3) C = [i, j]; @0",
}


@broad("name", HUGE, fast=("deep parts", "loops in loops", "a range", "long text", "an array"))
def test_what_would_be_huge_is_refused(name: str) -> None:
    with pytest.raises(MovimentumError, match="limit/"):
        mv.loads(HUGE[name])


def test_a_picture_of_a_placed_copy_is_where_its_anchors_are(tmp_path: Path) -> None:
    from PIL import Image

    image = Image.new("RGBA", (60, 20), (0, 0, 0, 0))
    image.paste((255, 0, 0, 255), (0, 0, 12, 12))  # the upper left corner of the picture
    image.save(tmp_path / "mark.png")
    (tmp_path / "a.mov").write_text(
        ".config(5, 300, 200) .background('white'); .part P() { S : 'mark.png' A = [6, 14] B = [50, 5] .scale(2); } "
        "X : P() .at([40, 30]); Y : P() .at([200, 40]) .turned(90); Z : P() .at([160, 120]) .mirrored; @0"
    )
    script = mv.load(tmp_path / "a.mov")
    script.solve().render(tmp_path / "a.png", at=0)
    picture = Image.open(tmp_path / "a.png").convert("RGB")
    for copy in "XYZ":
        x, y = script.solve()[f"{copy}.S.A"][0].tolist()
        assert picture.getpixel((round(x), round(200 - y))) == (255, 0, 0), copy
    assert script.diagnostics == ()
