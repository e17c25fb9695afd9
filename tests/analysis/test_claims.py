"""Claims: verified against motions whose course is known in closed form."""

import math
from fractions import Fraction

import pytest

from movimentum.analysis.diagnose.claims import broken_claims
from movimentum.analysis.examine import examine
from movimentum.errors import ScriptError
from tests.solver.scenes import motion_of, poses_of, scene_of

CRANK = """.config(10, 300, 300);
Crank : .bar O=[100,100] P=[140,100];
Rod   : .bar A=[0,0] B=[120,0];
@0 Crank.O=[100,100]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,100]; x > 100;
"""


def broken(claims: str, end: str = "@4"):
    return list(broken_claims(motion_of(CRANK + claims + end)))


@pytest.mark.parametrize(
    "claim",
    [
        "Crank.P = [100,100] + [40,0].r(90*.t)",
        "Crank.P = [_, 100 + 40*.sin(90*.t)]",
        "Crank.angle = 90*.t",
        ".a([1,0], Crank.P - Crank.O) = 90*.t",  # modulo a turn
        "(Rod.B - Crank.P).l = 120",
        "x = 100 + 40*.cos(90*.t) + .sqrt(120^2 - (40*.sin(90*.t))^2)",
        "x <= 260",
        "x > 179",
        "Crank.P.x = 140 .within(80)",
        "Crank.angle = 360*.t/.iv",
        "Rod.opacity = 1",
    ],
)
def test_what_is_true_may_be_claimed(claim):
    assert broken(f".claim {claim};") == []


def test_where_a_claim_begins_to_fail():
    # x falls from 260 through 250 at a time that is known
    (found,) = broken(".claim x > 250;")
    low, high = 0.0, 1.0
    for _ in range(100):
        t = (low + high) / 2
        s, c = math.sin(math.pi / 2 * t), math.cos(math.pi / 2 * t)
        low, high = (t, high) if 100 + 40 * c + math.sqrt(120**2 - (40 * s) ** 2) > 250 else (low, t)
    assert abs(found.time - low) < 1e-12
    assert found.frame == math.ceil(low * 10)
    assert abs(found.worst - (250 - 180)) < 1e-9
    assert abs(found.worst_time - 2) < 0.05


def test_what_fails_between_frames_is_seen():
    # at one frame a time unit the crank is level in every frame; between them it is not
    motion = motion_of(
        """.config(1, 300, 300); Crank : .bar O=[100,100] P=[140,100];
        @0 Crank.O=[100,100]; Crank.angle=180*.t; .claim Crank.P.y = 100 .within(1); @4"""
    )
    (found,) = broken_claims(motion)
    assert abs(found.time - math.degrees(math.asin(1 / 40)) / 180) < 1e-9


def test_a_claim_holds_until_it_is_restated_or_ended():
    claims = ".claim x > 150; .claim Crank.P.y >= 100; @1 .claim x > 100; @2 .claim Crank.P.y > _; "
    assert broken(claims) == []
    (found,) = broken(".claim Crank.P.y >= 100; @3 .claim Crank.P.y > _;")
    assert abs(found.time - 2) < 1e-6


def test_its_clock_is_the_claims_own():
    assert broken("@1 .claim Crank.angle = 90 + 90*.t; .claim Crank.angle = 90*.T;") == []


def test_a_claim_moves_nothing():
    plain = poses_of(CRANK + "@4")
    claimed = poses_of(CRANK + ".claim Rod.B = [1,2]; .claim Crank.angle < -3; @4")
    assert (plain.origin == claimed.origin).all()
    assert (plain.angle == claimed.angle).all()
    unmentioned = "Lamp : .disc(5) O=[5,5];"
    text = CRANK.replace("@0", f"{unmentioned} @0 ")
    assert scene_of(text + ".claim Lamp.O = [5,5]; @1 Lamp.O = [5,5]; @4").mentioned[2] == 1


def test_a_broken_claim_is_the_scripts_fault():
    examination = examine(motion_of(CRANK + ".claim x = 3 .within(1/2); @4"))
    assert examination.fault == 1
    (told,) = [d for d in examination.diagnostics if d.code == "claim/broken"]
    assert told.message.startswith("`x` is 260, not 3: the claim fails from t = 0 (frame 0)")
    assert not any(".within" in text for text in told.helps)  # 257 off is no matter of tolerance


def test_what_the_help_says_is_accepted():
    claim = ".claim (Rod.A - Crank.O).l = 39.96"
    (told,) = [d for d in examine(motion_of(f"{CRANK} {claim}; @4")).diagnostics if d.code == "claim/broken"]
    (within,) = [text.split("`")[1] for text in told.helps if "within" in text]
    assert broken(f"{claim} {within};") == []


@pytest.mark.parametrize(
    ("claim", "code"),
    [
        ("y = 3", "claim/undetermined"),
        ("Crank.P = [_,_]", "claim/empty"),
        ("x = 2*_", "claim/not-a-reading"),
        ("x = .i(3)", "claim/not-a-reading"),
        ("x = 3 .within(-1)", "kind/mismatch"),
        ("x = [1,2]", "kind/mismatch"),
        ("Crank.Q = [1,2]", "name/unknown-anchor"),
    ],
)
def test_what_cannot_be_claimed(claim, code):
    with pytest.raises(ScriptError) as caught:
        scene_of(CRANK + f".claim {claim}; @4")
    assert code in [d.code for d in caught.value.diagnostics]


def test_claims_do_not_depend_on_the_frame_rate():
    motions = [motion_of(CRANK + ".claim x > 200.5; @4", fps) for fps in (1, 7, Fraction(97, 3))]
    times = [found.time for motion in motions for found in broken_claims(motion)]
    assert len(times) == 3
    assert max(times) - min(times) < 1e-12


@pytest.mark.parametrize(("off", "offered"), [(270.0, False), (5.0, False), (0.01, True), (1e-6, True)])
def test_a_tolerance_is_offered_only_for_what_nearly_holds(off, offered):
    text = f""".config(10); Rod : .bar A=[0,0] B=[300,0];
    @0 Rod.A = [100,100]; Rod.angle = 0;  .claim Rod.B.x = {400 + off};
    @1"""
    (error,) = [d for d in examine(motion_of(text)).diagnostics if d.code == "claim/broken"]
    assert any(".within(" in line for line in error.helps) == offered


@pytest.mark.parametrize("claim", ["x = 3", "x < 20", "[x, 3] = [3, 3]", "3 = x"])
def test_what_has_no_value_yet_fulfils_no_claim(claim):
    text = f""".config(10); Rod : .bar A=[0,0] B=[300,0];
    @0 Rod.A = [100,100]; Rod.angle = 0;  .claim {claim};
    @1 x = 3;
    @2"""
    (error,) = [d for d in examine(motion_of(text)).diagnostics if d.code == "claim/broken"]
    assert "has no value: the claim fails from t = 0" in error.message
    assert "nan" not in error.message


@pytest.mark.parametrize(
    ("claim", "holds"),
    [
        (".a(P.C - [100,100], [1,0]) = 45", True),
        (".a(.d(P.C), [1,0]) = 45", True),
        (".abs(.a(P.C - [100,100], [1,0])) > 44", True),
        (".a(P.C - [100,100], [1,0]) = 30", False),
    ],
)
def test_a_claim_about_an_angle_says_nothing_where_the_vector_is_zero(claim, holds):
    head = "P : .disc(3) C = [100,100]; @0 P.angle = 0; P.C = [100 + 50*.t^2,100 - 50*.t^2]; "
    assert (not list(broken_claims(motion_of(f"{head}.claim {claim}; @1")))) is holds
