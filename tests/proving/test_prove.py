"""Verdicts: theorems true and broken, on which branch, and never one that is wrong."""

import json

import pytest

from movimentum import loads
from movimentum.proving.prove import Prover
from movimentum.proving.verdicts import ProofVerdict
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.prove import proofs
from movimentum.workflow.stages import arranged, moved, understand
from tests.broad import broad
from tests.command import ROOT, movimentum
from tests.proving.theorems import ALL_LENGTHS, FALSE, TRUE, WATT

PROVED = {ProofVerdict.PROVED, ProofVerdict.ON_BRANCH}
FILMS = {
    name: (ROOT / "scripts" / f"{name}.mov").read_text(encoding="utf-8")
    for name in (
        "hart",
        "peaucellier",
        "pantograph",
        "trammel",
        "scotch-yoke",
        "clockwork",
        "scissor-lift",
        "locomotive",
        "planetary",
        "zeuner",
    )
}


def judged(text, accelerated=None, **more):
    found, _ = proofs(
        SourceText(str(ROOT / "scripts" / "theorem.mov"), text), Choices(), 60.0, accelerated=accelerated, **more
    )
    return list(found)


@pytest.mark.parametrize("name", TRUE)
def test_theorems_of_plane_geometry_are_proved(name):
    assert {one.verdict for one in judged(TRUE[name])} <= PROVED


@pytest.mark.parametrize("name", FALSE)
def test_a_broken_theorem_is_false_and_a_pose_breaks_it(name):
    found = judged(FALSE[name])
    assert any(one.verdict is ProofVerdict.FALSE and one.counterexample for one in found)


@broad("name", FILMS, fast=("hart", "pantograph", "scotch-yoke", "planetary"))
def test_exact_claims_of_the_gallery_are_proved(name):
    assert {one.verdict for one in judged(FILMS[name])} <= PROVED


@pytest.mark.parametrize("name", ["hart", "peaucellier", "trammel"])
def test_sympy_alone_gives_the_same_verdicts(name):
    with_flint, without = judged(FILMS[name]), judged(FILMS[name], accelerated=False)
    assert [(one.verdict, one.conditions) for one in with_flint] == [(one.verdict, one.conditions) for one in without]


@pytest.mark.parametrize("name", ["hart", "peaucellier", "pantograph"])
def test_what_holds_on_one_branch_only_is_told_so(name):
    assert {one.verdict for one in judged(FILMS[name])} == {ProofVerdict.ON_BRANCH}
    assert all(any("side" in condition for condition in one.conditions) for one in judged(FILMS[name]))


def test_a_claim_of_another_branch_is_false_and_names_the_branch():
    crossed = ".across(Up.C, pivot, Down.P) > 0;"
    assert crossed in FILMS["hart"]
    for one in judged(FILMS["hart"].replace(crossed, crossed.replace(">", "<"))):
        assert one.verdict is ProofVerdict.FALSE
        assert one.why.endswith("; it is proved where `Left` is on its other side")


FLAT = """
Crank : .bar A = [100,150] B = A + [60,0];
Coupler : .bar B = [0,0] C = B + [100,0];
Rocker : .bar D = [360,150] C = D + [{c},0];
@0 Crank.A = [100,150]; Crank.angle = {drive}; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [360,150];
   .claim Rocker.C.x = 260 .within({within}); .claim Rocker.C.y = 150 .within({within});
@2
"""


def test_a_mechanism_that_is_flat_for_ever_is_proved():
    assert [one.verdict for one in judged(FLAT.format(c=100, drive=0, within=0))] == [ProofVerdict.PROVED] * 2


@pytest.mark.slow
def test_a_degenerate_pose_is_named():
    almost = FLAT.format(c="100 + 1e-28*.sqrt(2)", drive=0, within=1)  # 1e-13 px apart
    assert [one.verdict for one in judged(almost)] == [ProofVerdict.UNKNOWN] * 2
    assert all("where two solutions for `Coupler` meet" in one.why for one in judged(almost))


def test_an_approximate_straight_line_is_not_proved():
    (one,) = judged(WATT.format(within="0.5"))
    assert one.verdict in (ProofVerdict.IN_FILM, ProofVerdict.UNKNOWN)
    (one,) = judged(WATT.format(within="1e-9"))
    assert one.verdict is ProofVerdict.FALSE


@broad("name", ALL_LENGTHS, first=3)
def test_all_lengths(name):
    found, names = proofs(SourceText("letters.mov", ALL_LENGTHS[name]), Choices(), 60.0, all_lengths=True)
    assert {one.verdict for one in found} <= PROVED
    assert len(names) >= 3


@pytest.mark.slow
def test_all_lengths_of_hart_and_what_holds_for_some_only():
    found, names = proofs(SourceText("hart.mov", FILMS["hart"]), Choices(), 60.0, all_lengths=True)
    assert {one.verdict for one in found} == {ProofVerdict.ON_BRANCH}
    assert set(names) == {"L", "S", "q"}
    one_length = ALL_LENGTHS["pantograph"].replace("C = A + [b,0]", "C = A + [(k-1)*b,0]")  # right for k = 2
    (one,), _ = proofs(SourceText("letters.mov", one_length), Choices(), 60.0)
    assert one.verdict in PROVED
    (one,), _ = proofs(SourceText("letters.mov", one_length), Choices(), 60.0, all_lengths=True)
    assert one.verdict is ProofVerdict.FALSE


DEGREES = """
Crank : .bar O = [0,0] P = O + [100,0];
@0 Crank.O = [0,0]; Crank.angle = 90*.t + {advance};
   .claim Crank.P.x = 100*.cos(90*.t)*.cos({advance}) - 100*.sin(90*.t)*.sin({advance});
   .claim Crank.P.x = 100*.sin(90*.t + {advance} + 450);
   .claim Crank.P.x = 100*.cos(90*.t + {advance} + 1) .within(2);
@2
"""


@pytest.mark.parametrize("advance", [35, 41, -7.5, 305])
def test_degrees_are_constants(advance):
    first, second, third = judged(DEGREES.format(advance=advance))
    assert (first.verdict, second.verdict) == (ProofVerdict.PROVED, ProofVerdict.PROVED)
    assert third.verdict is ProofVerdict.UNKNOWN  # no other position breaks it


def test_angles_of_known_cosine_are_exact():
    (side, half) = judged("""
.let bd = .acos((41.5^2 + 40.1^2 - 55.8^2)/(2*41.5*40.1));
T : .plate Z = [0,0] R = Z + [41.5,0] S = Z + [40.1,0].r(bd);
@0 T.Z = [10*.t,0]; T.angle = 30*.t; .claim (T.R - T.S).l = 55.8; .claim .cos(bd/2)^2 = (1 + .cos(bd))/2;
@2
""")
    assert side.verdict is ProofVerdict.PROVED
    assert half.verdict in PROVED


LENGTHS = """
Dot : .disc(3) O = [50,50];
@0 Dot.O = [220 + 15*.t, 160];
   .claim {claim};
@4
"""


@pytest.mark.parametrize(
    ("claim", "verdicts"),
    [
        ("(Dot.O - [200,160]).l + (Dot.O - [320,160]).l = 120", (ProofVerdict.IN_FILM, ProofVerdict.ON_BRANCH)),
        ("(Dot.O - [200,160]).l = Dot.O.x - 200", (ProofVerdict.IN_FILM, ProofVerdict.ON_BRANCH)),
        ("(Dot.O - [200,160]).l*2 = .abs(400 - 2*Dot.O.x)", (ProofVerdict.PROVED,)),
        (".abs(Dot.O.x)*.abs(Dot.O.x - 9) = .abs(Dot.O.x^2 - 9*Dot.O.x)", (ProofVerdict.PROVED,)),
    ],
)
def test_lengths_that_may_pass_zero(claim, verdicts):
    assert judged(LENGTHS.format(claim=claim))[0].verdict in verdicts


@pytest.mark.parametrize(
    ("claim", "same"),
    [
        (".sqrt(8)*Dot.O.x = 2*.sqrt(2)*Dot.O.x", True),
        ("(0.1 + 0.2)*Dot.O.x = 0.3*Dot.O.x", True),
        (".sqrt(2)*Dot.O.x = 1.4142135623730951*Dot.O.x", False),
        ("Dot.O.x + .sqrt(2)*.sqrt(8) = Dot.O.x + 4.000000000000001", False),
        ("Dot.O.x*.exp(.ln(2)) = Dot.O.x*2", False),  # nothing here knows it
        ("(1 + 5e-17)*Dot.O.x = Dot.O.x", False),
        ("(1 + 5e-17)*Dot.O.x - Dot.O.x = 5e-17*Dot.O.x", True),
        ("(1 + 5e-17 - 1)*Dot.O.x = 0", False),
        ("Dot.O.x + (1 + 5e-17 - 1) = Dot.O.x", False),
        ("Dot.O.x/(1 + 1/10^17) = Dot.O.x", False),
        ("1 + 5e-17 = 1", False),
        ("1e-400*Dot.O.x = 0", False),
        ("1.00000000000000000001*Dot.O.x = Dot.O.x", False),
        ("0.12345678901234567890123*Dot.O.x = 0.12345678901234568*Dot.O.x", False),
        ("100000000000000000001*Dot.O.x = 1e20*Dot.O.x", False),
        ("100000000000000000001*Dot.O.x = (1e20 + 1)*Dot.O.x", True),
        (".pi*Dot.O.x = 3.141592653589793*Dot.O.x", False),
        ("2*.pi*Dot.O.x = 6.283185307179586*Dot.O.x", False),
        (".pi*2*Dot.O.x = (.pi + .pi)*Dot.O.x", True),
        (".sqrt(2)*Dot.O.x - 1.4142135623730951*Dot.O.x = 0", False),
        ("Dot.O.x*(.sqrt(2) - 1.4142135623730951) = 0", False),
        ("Dot.O.x*(.sqrt(2)*.sqrt(3) - .sqrt(6)) = 0", True),
        ("Dot.O.x*.sqrt(1 + 1e-40) = Dot.O.x", False),
        ("(.sin(20)^2 + .cos(20)^2)*Dot.O.x = Dot.O.x", True),
        ("Dot.O.x^(2 + 5e-17) = Dot.O.x^2", False),
        ("Dot.O.x^(3 - 1) = Dot.O.x*Dot.O.x", True),
        ("Dot.O.x^(1 + 5e-17) = Dot.O.x", False),
        ("Dot.O.x^(1 + 5e-17 - 1) = 1", False),
        ("Dot.O.x*.cos(60.0000000000000000001) = Dot.O.x/2", False),
        ("Dot.O.x*.cos(360 + 1e-20) = Dot.O.x", False),
        ("Dot.O.x*.sin(1e-20) = 0", False),
        ("Dot.O.x*.sin(180) + .cos(90) = 0", True),
        (".sqrt(2)^2 = 2", True),
        ("Dot.O.x*.atan2(1, 1) = 45*Dot.O.x", True),
        ("Dot.O.x*.atan2(1, 1 + 1e-17) = 45*Dot.O.x", False),
        ("Dot.O.x*.max(1, 1 + 1e-17) = Dot.O.x", False),
        ("(1/3)*Dot.O.x = 0.3333333333333333*Dot.O.x", False),
        ("Dot.O.x*(1 + 5e-17) >= Dot.O.x*(1 + 5e-17)", True),
        ("Dot.O.x >= Dot.O.x*(1 + 5e-17)", False),
    ],
)
def test_no_constant_is_known_by_its_digits(claim, same):
    assert (judged(LENGTHS.format(claim=claim))[0].verdict in PROVED) is same


@pytest.mark.parametrize(
    "claim",
    [
        ".exp(1 + 1e-20)*Dot.O.x = .exp(1)*Dot.O.x",
        ".ln(2 + 1e-20)*Dot.O.x = .ln(2)*Dot.O.x",
        ".atan2(1, 3 + 1e-20)*Dot.O.x = .atan2(1, 3)*Dot.O.x",
        ".cos(.exp(1 + 1e-20))*Dot.O.x = .cos(.exp(1))*Dot.O.x",
        "2^(2 + 5e-17)*Dot.O.x = 4*Dot.O.x",
        ".exp(.t*(2 + 1e-20))*Dot.O.x = .exp(.t*2)*Dot.O.x",
        ".cos(.t*(2 + 1e-20))*Dot.O.x = .cos(.t*2)*Dot.O.x",
        ".mod(7 + 1e-20, 3)*Dot.O.x = .mod(7, 3)*Dot.O.x",
        ".exp(1 + 1e-20) = .exp(1)",
        ".exp(1 + 1e-20) <= .exp(1) + 1e-30",
    ],
)
def test_what_functions_are_of_is_not_known_by_its_digits(claim):
    assert judged(LENGTHS.format(claim=claim))[0].verdict not in PROVED


@pytest.mark.parametrize(
    ("claim", "verdict"),
    [
        ("(1 + 5e-17 - 1)*10^17 = 5", "proved"),
        ("(1 + 5e-17 - 1)*10^17 = 0", "false"),
        ("(1 + 5e-17 - 1)*10^17*Dot.O.x = 5*Dot.O.x", "proved"),
        ("1 < 1 + 1e-20", "proved"),
        ("1 + 1e-20 <= 1", "false"),
        ("1 + 1e-20 <= 1 .within(1e-19)", "proved"),
        ("1 + 1e-20 = 1 .within(1e-21)", "false"),
        ("10^17 + 1 = 10^17", "false"),
        ("[1/3, .sqrt(2)]*3 = [1, .sqrt(18)]", "proved"),
        ("[1/3, .sqrt(2)]*3 = [1, .sqrt(18 + 1e-30)]", "false"),
        (".sqrt(2)*.sqrt(3) = .sqrt(6)", "proved"),
        (".sqrt(2) + .sqrt(3) = .sqrt(5 + 2*.sqrt(6))", "proved"),
        (".sqrt(2) + .sqrt(3) < 3.14626436994197235", "proved"),
        (".sqrt(2) + .sqrt(3) < 3.14626436994197233", "false"),
        (".sqrt(2) = 1.4142135623730951", "false"),
        (".pi < 3.14159265358979324", "proved"),
        (".pi = 3.141592653589793", "false"),
        (".sin(30) = 0.50000000000000001", "false"),
        (".max(1, 1 + 1e-20) = 1 + 1e-20", "proved"),
        (".exp(.ln(2)) = 2", "unknown"),
    ],
)
def test_constants_are_decided_exactly(claim, verdict):
    (one,) = judged(LENGTHS.format(claim=claim))
    assert one.verdict.value == verdict


@pytest.mark.parametrize(
    ("claim", "verdicts"),
    [
        ("((Dot.O.x + 1e-14) - Dot.O.x)*1e16 = 100", PROVED),
        ("((Dot.O.x + 1e-14) - Dot.O.x)*1e16 < 101", PROVED),
        ("((Dot.O.x + 1e-14) - Dot.O.x)*1e16 = 101", (ProofVerdict.FALSE,)),
        ("(.sqrt(1 + 5e-17)^2 - 1)*10^17*Dot.O.x = 5*Dot.O.x", PROVED),
        ("(.sqrt(Dot.O.x^2 + 1e-12)^2 - Dot.O.x^2)*10^12 = 1", PROVED),
    ],
)
def test_what_the_film_rounds_is_not_false(claim, verdicts):
    assert judged(LENGTHS.format(claim=claim))[0].verdict in verdicts


@pytest.mark.parametrize(
    ("anchors", "claim"),
    [
        ("B = A + [100,0] C = A + [1 + 5e-17 - 1,0]", "Rod.C = Rod.A"),
        ("B = A + [100,0] C = A + [100 + 5e-17,0]", "Rod.C = Rod.B"),
        ("B = A + [100,1 + 5e-17 - 1] C = A + [50,0]", ".across(Rod.C, Rod.A, Rod.B) = 0"),
        ("B = A + [3.3333333333333335,0] C = A + [10/3,0]", "(Rod.C - Rod.A).l = 3.3333333333333335"),
    ],
)
def test_no_place_is_known_by_its_digits(anchors, claim):
    text = f"Rod : .bar A = [0,0] {anchors};\n@0 Rod.A = [10,20]; Rod.angle = 30*.t; .claim {claim};\n@2\n"
    assert [one.verdict for one in judged(text)] == [ProofVerdict.UNKNOWN]


def test_a_direction_is_that_of_an_angle_for_one_turn():
    text = BAR.format(claim=".claim .a([1,0], Rod.B - Rod.A) = Rod.angle;")
    assert [one.verdict for one in judged(text)] == [ProofVerdict.ON_BRANCH]
    text = BAR.format(claim=".claim .a(Rod.B - Rod.A, [0,1]) = 90 - .a([1,0], Rod.B - Rod.A);")
    assert [one.verdict for one in judged(text)] == [ProofVerdict.PROVED]


BAR = "Rod : .bar A = [100,200] B = A + [100,0];\n@0 Rod.A = [100,200]; Rod.angle = 60*.t;\n  {claim}\n@0.5\n"


@pytest.mark.parametrize(
    ("claim", "verdict", "code"),
    [
        (".claim (Rod.B - Rod.A).l = 100 .always;", "proved", 0),
        (".claim Rod.B.y >= 199.9;", "true in this film", 4),
        (".claim Rod.B.y >= 199.9 .within(0.01) .always;", "true in this film", 1),
        (".claim Rod.B.y >= 210 .always;", "false", 1),
        (".claim Rod.B.x <= 250 .always;", "unknown", 4),
    ],
)
def test_exit_codes_and_always(tmp_path, claim, verdict, code):
    (tmp_path / "rod.mov").write_text(BAR.format(claim=claim), encoding="utf-8")
    done = movimentum("prove", "rod.mov", cwd=tmp_path)
    assert (done.returncode, done.stdout.split("  ")[0].strip()) == (code, verdict)
    assert movimentum("fmt", "--check", "rod.mov", cwd=tmp_path).returncode in (0, 1)


def test_claims_that_need_more_variables_than_are_left():
    """Claims about the same bars share one tower, whose room is limited."""
    (*_, last) = judged("""
.let a = 137; .let b = 140; .let k = 1.5;
OA : .bar O = [60,70] B = O + [a,0] A = O + [k*a,0]; AQ : .bar A = [0,0] C = A + [(k-1)*b,0] Q = A + [k*b,0];
BP : .bar B = [0,0] P = B + [b,0]; CP : .bar C = [0,0] P = C + [a,0];
@0 OA.O = [60,70]; BP.P = [200,130] + [32, 0].r(69*.t); BP.B = OA.B; .across(OA.B, [60,70], BP.P) > 0;
   AQ.A = OA.A; CP.P = BP.P; CP.C = AQ.C; .across(AQ.C, BP.P, OA.A) < 0;
   .claim AQ.Q - OA.O = (BP.P - OA.O)*k .within(1000); .claim AQ.C - OA.B = BP.P - OA.B + (OA.A - OA.B) .within(1000);
@2
""")
    assert last.verdict in (ProofVerdict.UNKNOWN, ProofVerdict.IN_FILM)
    assert "variables" not in last.why


def test_whole_turns_count():
    text = BAR.format(claim=".claim Rod.angle = 60*.t + 360;")
    motion = moved(arranged(understand(SourceText("rod.mov", text)), Choices()))
    assert Prover(motion).judged(motion.timeline.claims[0]).verdict not in PROVED


def test_the_command(tmp_path):
    (tmp_path / "p.mov").write_text(FILMS["peaucellier"], encoding="utf-8")
    done = movimentum("prove", "p.mov", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout.splitlines() == ["proved on this branch  22:6  AP.P.x = 60 + (200^2 - 80^2)/(2*70)"]
    (tmp_path / "p.mov").write_text(FILMS["peaucellier"].replace("(2*70)", "(2*71)"), encoding="utf-8")
    done = movimentum("prove", "p.mov", "--format", "json", cwd=tmp_path)
    assert done.returncode == 1
    (claim,) = json.loads(done.stdout)["claims"]
    assert claim["verdict"] == "false"
    assert set(claim["counterexample"]) == {"AP.P"}


TABLE = """
Crank : .bar A = [100,100] B = A + [50,0];
Coupler : .plate B = [0,0] P = B + [60,40] C = B + [130,0];
Rocker : .bar D = [220,100] C = D + [110,0];
Dot : .disc(3) O = [40,50];   Far : .disc(3) O = [40,50];   Arm : .bar O = [300,200] E = O + [40,0];
@0 Crank.A = [100,100]; Crank.angle = 30 + 2*{law}(60*.t){more}; Coupler.B = Crank.B; Rocker.C = Coupler.C;
   Rocker.D = [220,100]; Rocker.C.y > 100; Arm.O = [300,200]; Arm.angle = {law}(Rocker.angle){more};
   Dot.O = [40, 60 + {law}(Crank.angle){more}]; Far.O = [60, 60 + 2*{law}(Crank.angle){more}];
   .claim {claim};
@2
"""
LAWS = {"table": (".table('law.csv', 'lift', ", ").periodic"),
        "smooth": (".table('law.csv', 'lift', ", ").periodic.smooth"),
        "max": (".max(3, ", ")"), "ease": ("40*.ease(1/100*", ")"), "exp": (".exp(0.01*", ")")}  # fmt: skip


@broad("law", LAWS, first=1)
@pytest.mark.parametrize(
    ("claim", "verdicts"),
    [
        ("(Coupler.P - Crank.B).l^2 = 60^2 + 40^2", PROVED),
        ("50*.cos(Crank.angle) + 130*.cos(Coupler.angle) = 120 + 110*.cos(Rocker.angle)", PROVED),
        ("50*.cos(Crank.angle) + 130*.cos(Coupler.angle) = 121 + 110*.cos(Rocker.angle)", (ProofVerdict.FALSE,)),
        ("Far.O.y - 60 = 2*(Dot.O.y - 60)", PROVED),
        ("Far.O.y - 60 = 2*(Dot.O.y - 61)", (ProofVerdict.FALSE,)),
        ("Dot.O.y - 60 = LAW(Crank.angle)MORE", PROVED),
        ("(Arm.E.x - 300)^2 + (Arm.E.y - 200)^2 = 40^2", PROVED),
        ("Arm.E.x - 300 = 40*.cos(LAW(Rocker.angle)MORE)", PROVED),
        ("Arm.E.x - 300 = 40*.cos(LAW(Rocker.angle + 1)MORE)", (ProofVerdict.FALSE,)),
        ("Dot.O.y >= -1000", (ProofVerdict.UNKNOWN,)),
    ],
)
def test_what_does_not_rest_on_a_table_is_proved(law, claim, verdicts, tmp_path):
    """Functions that are not algebraic are any numbers to a proof, equal ones of equal arguments."""
    (tmp_path / "law.csv").write_text(
        "angle,lift\n0,0\n60,12\n120,30\n180,22\n240,14\n300,5\n360,0\n", encoding="utf-8"
    )
    name, more = LAWS[law]
    text = TABLE.format(claim=claim.replace("LAW", "{law}").replace("MORE", "{more}"), law="{law}", more="{more}")
    text = text.replace("{law}(", name).replace("){more}", more)
    found, _ = proofs(SourceText(str(tmp_path / "law.mov"), text), Choices(), 60.0)
    (one,) = found
    assert one.verdict in verdicts, one


RANGE = """
Crank : .bar A = [100,100] B = A + [40,0];
Coupler : .bar B = [0,0] C = B + [130,0];
Rocker : .bar D = [220,100] C = D + [110,0];
@0 Crank.A = [100,100]; Crank.angle = 30 + 60*.t; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [220,100];
   Rocker.C.y > 100; w + 20*.sin(w) = 60*.t;
   .claim {claim};
@6
"""


@pytest.mark.parametrize(
    "claim",
    [
        "Rocker.angle <= 170",
        "Rocker.angle >= 10",
        "Coupler.angle*.pi/180 >= -2",
        ".abs(.sin(w)) <= 1",
        ".sin(w)^2 + .cos(w)^2 <= 1.001",
        ".abs(w - 60*.t) <= 20",
    ],
)
def test_no_position_is_told_that_the_mechanism_has_not(claim):
    """An angle that the mechanism finds has no other values than it finds."""
    (one,) = judged(RANGE.format(claim=claim))
    assert one.verdict in (ProofVerdict.UNKNOWN, *PROVED), one


@pytest.mark.parametrize(
    "claim", ["B.C.x = {x}", "B.C.x <= {x}", "B.C.x - {x} = 0", "2*B.C.x = 2*{x}", "(B.C - [{x}, 200]).l = 0"]
)
def test_a_value_that_is_kept_from_another_time_is_not_exact(claim):
    """100 + 50 cos 50° is no decimal: its float is none of the script's numbers."""
    text = """.config(10, 300, 300);
A : .bar O = [100,100] P = [150,100];   B : .disc(5) C = [200,200];
@0 A.O = [100,100];   A.angle = 100*.t;   B.C = [200,200];
@1 B.C = [A.P.x.at(0.5), 200];%s
@2"""
    (x,) = {float(each) for each in moved_places(text % "")}
    found = judged(text % f"\n   .claim {claim.format(x=repr(x))};")
    assert [one.verdict for one in found] == [ProofVerdict.UNKNOWN]


def moved_places(text):
    return set(loads(text).solve()["B.C.x"][-3:])
