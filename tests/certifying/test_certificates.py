"""Certificates, against closed forms and Newton's method in many digits, and films that are not what they should be."""

from __future__ import annotations

import json
import math
import random

import numpy as np
import pytest
from mpmath import mp, mpf

from movimentum.certifying.bounds import BoundVerdict
from movimentum.certifying.certificate import Certificate, certificate
from movimentum.certifying.wording import as_data, certificate_diagnostics
from movimentum.settings import Accuracy
from movimentum.solver.accuracy.refinement import refine
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, understand
from tests.broad import broad
from tests.command import ROOT, movimentum

GALLERY = sorted(path.stem for path in (ROOT / "scripts").glob("*.mov"))
DRAWN_BY_WISHES = {"peaucellier-linkage", "penrose-five", "penrose-twenty"}
FREE = {"geneva", "geneva-play", "escapement", "ratchet"}
FREE |= {"combination-lock", "vending-latch", "walking-toy"}
CHANGE_POINTS = {"coupling-rods": [1 / 3, 4 / 3], "antiparallelogram": [5 / 3, 25 / 6]}


def film(text: str) -> PathMotion:
    source = SourceText(str(ROOT / "scripts" / "film.mov"), text)
    return moved(arranged(understand(source, Choices()), Choices()))


def of_gallery(name: str) -> PathMotion:
    return film((ROOT / "scripts" / f"{name}.mov").read_text(encoding="utf-8"))


def arm(angle: str, claim: str = "", end: str = "2") -> Certificate:
    return certificate(film(f"A : .bar O = [0,0] P = O + [50,0];\n@0 A.O = [0,0]; A.angle = {angle}; {claim}\n@{end}"))


def four_bar(a: str, b: str, c: str, d: str, angle: str, claim: str = "") -> str:
    return (
        f"Crank : .bar A = [0,0] B = A + [{a},0];  Cp : .bar B = [{a},0] C = B + [{b},0];"
        f"Rk : .bar D = [{d},0] C = D + [0,{c}];\n"
        f"@0 Crank.A = [0,0]; Crank.angle = {angle}; Rk.D = [{d},0]; Cp.B = Crank.B; Cp.C = Rk.C; {claim}\n@2"
    )


def joint(lengths: tuple[str, ...], angle: object, side: int) -> tuple[object, object]:
    """Where the coupler and the rocker meet, by the intersection of two circles, in mpmath's digits."""
    a, b, c, d = map(mpf, lengths)
    turn = mpf(angle) * mp.pi / 180  # type: ignore[arg-type]
    x, y = a * mp.cos(turn), a * mp.sin(turn)
    dx, dy = d - x, -y
    square = dx * dx + dy * dy
    along = (square + b * b - c * c) / (2 * square)
    height = side * mp.sqrt(b * b / square - along * along)
    return x + along * dx - height * dy, y + along * dy + height * dx


@pytest.mark.parametrize("films", [3, pytest.param(12, marks=pytest.mark.slow)])
def test_random_four_bars_are_as_near_to_the_closed_form_as_is_said(films: int) -> None:
    rng = random.Random(31)
    done = 0
    with mp.workdps(40):
        while done < films:
            lengths = tuple(f"{rng.uniform(20, 120):.{rng.randrange(1, 5)}f}" for _ in range(4))
            first, speed = rng.randrange(20, 160), rng.randrange(5, 30)
            try:
                motion = film(four_bar(*lengths, f"{first} + {speed}*.t"))
                found = certificate(motion)
            except Exception:  # no four-bar
                continue
            if not found.complete:
                assert found.breaks
                continue
            count = motion.timeline.frame_count
            poses = motion.poses(0, count)
            shown = poses.world(1, (float(lengths[0]) + float(lengths[1]), 0.0))
            side = next(s for s in (-1, 1) if abs(float(joint(lengths, first, s)[0]) - shown[0, 0]) < 1e-6)  # type: ignore[arg-type]
            for k in range(count):
                x, y = joint(lengths, first + mpf(speed) * k / 25, side)
                off = mp.hypot(mpf(float(shown[k, 0])) - x, mpf(float(shown[k, 1])) - y)
                assert off <= found.distance
            assert found.distance < 1e-9
            assert found.tubes >= 32
            done += 1


@pytest.mark.slow
@pytest.mark.parametrize("films", [1, pytest.param(4, marks=pytest.mark.slow)])
def test_a_bound_is_the_closed_form_s_largest_value_between_frames(films: int) -> None:
    rng = random.Random(5)
    for _ in range(films):
        crank, rod = rng.randrange(20, 60), rng.randrange(90, 200)
        text = (
            f"A : .bar O = [0,0] P = O + [{crank},0];  B : .bar P = [{crank},0] Q = P + [{rod},0];"
            f"S : .bar Q = [{crank + rod},0] R = Q + [20,0];\n"
            f"@0 A.O = [0,0]; A.angle = 37 + {rng.randrange(71, 99)}*.t;"
            " B.P = A.P; B.Q = S.Q; S.Q = [x,0]; x > 0; S.angle = 0; .claim S.Q.x <= {};\n@6"
        )
        for more, verdict in (("+ 0.000001", "proved"), ("+ 0.000000001", "proved"), ("- 0.00001", "false")):
            motion = film(text.replace("{}", f"{crank + rod} {more}"))
            (bound,) = certificate(motion).bounds
            assert bound.verdict.value == verdict
            margin = float(more.replace(" ", ""))
            assert margin - 3e-10 - 0.002 * abs(margin) <= bound.margin
            assert bound.margin <= margin + 0.002 * abs(margin)
        (bound,) = certificate(film(text.replace("<= {}", f"< {crank + rod}"))).bounds
        assert bound.verdict is BoundVerdict.UNDECIDED  # it is reached, but not passed


@broad("name", ["jansen", "klann", "oscillating-engine"], first=1)
def test_films_of_the_gallery_are_as_exact_as_is_said(name: str) -> None:
    motion = of_gallery(name)
    found = certificate(motion)
    assert found.complete
    assert {bound.verdict for bound in found.bounds} <= {BoundVerdict.PROVED}
    exact = refine(motion, Accuracy.EXACT, 30).poses(0, motion.timeline.frame_count)
    shown = motion.poses(0, motion.timeline.frame_count)
    for thing in motion.timeline.scene.things:
        for anchor in thing.anchors:
            apart = exact.world(thing.number, anchor.local) - shown.world(thing.number, anchor.local)
            assert np.max(np.hypot(apart[:, 0], apart[:, 1])) <= found.distance + 1e-12
    assert found.distance < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("name", GALLERY)
def test_the_gallery(name: str) -> None:
    found = certificate(of_gallery(name))
    if name in DRAWN_BY_WISHES:
        assert found.refused
        assert all("wish" in one.why for one in found.refused)
    elif name in FREE:
        assert found.refused
        assert all(one.why.startswith("it is not shown that equations determine") for one in found.refused)
    elif name in CHANGE_POINTS:
        assert all(one.change for one in found.breaks)
        assert [0.5 * (one.begin + one.end) for one in found.breaks] == pytest.approx(CHANGE_POINTS[name], abs=1e-5)
    else:
        assert found.complete
    assert not any(bound.verdict is BoundVerdict.FALSE for bound in found.bounds)
    assert not any(bound.counts for bound in found.bounds)


@pytest.mark.parametrize(("slack", "passes"), [("1", True), ("0.0001", True), ("0", False)])
def test_a_four_bar_at_grashof_s_border_is_refused_where_it_folds(slack: str, passes: bool) -> None:
    """Crank and ground together are as long as coupler and rocker: they fold at 180 degrees, t = 7/9."""
    found = certificate(film(four_bar("40", "90", f"(70 + {slack})", "120", "40 + 180*.t")))
    assert found.complete is passes
    if not passes:
        (one,) = found.breaks
        assert one.change
        assert one.begin <= 7 / 9 <= one.end < one.begin + 1e-5
        assert found.frames == found.whole  # none of them is there


def shifted(motion: PathMotion, frame: int, change: object) -> Certificate:
    def poses(first: int, stop: int) -> Poses:
        found = motion.poses(first, stop)
        if first <= frame < stop:
            change(found, frame - first)  # type: ignore[operator]
        return found

    return certificate(motion, poses)


def test_a_frame_that_is_off_is_told_with_its_distance() -> None:
    motion = film(four_bar("40", "90", "70", "110", "40 + 180*.t"))
    for off in (1e-9, 1e-3, 1.0):

        def moved_by(poses: Poses, k: int, off: float = off) -> None:
            poses.origin[1, k, 0] += off

        found = shifted(motion, 20, moved_by)
        assert found.complete is (off < 1e-4)
        told = found.distance if found.complete else float(found.breaks[0].why.split(" px")[0].split()[-1])
        assert told == pytest.approx(off, rel=1e-2)


def test_a_frame_on_the_other_branch_is_told() -> None:
    motion = film(four_bar("40", "90", "70", "110", "40 + 180*.t"))

    def folded(poses: Poses, k: int) -> None:
        pin = poses.world(0, (40.0, 0.0))[k]
        line = 2.0 * math.atan2(-pin[1], 110.0 - pin[0])
        for thing in (1, 2):
            other = complex(math.cos(line), math.sin(line)) * complex(*poses.direction[thing, k]).conjugate()
            poses.direction[thing, k] = other.real, other.imag

    found = shifted(motion, 20, folded)
    assert not found.complete
    assert found.frames == found.whole - 1
    assert "frame 20" in found.breaks[0].why


@pytest.mark.parametrize(
    ("angle", "kept"),
    [
        ("90*.abs(.t - 0.7312)", True),
        (".min(90*.t, 60) + 20*.ease(.t/1.3)", True),
        ("{ .t < 1.1 : 10*.t; 11 }", True),
        ("{ .t < 1.1 : 10*.t; 50 }", False),
        (".exp(.t)*10 + (.t + 1)^1.4 + .ln(.t + 2)", True),
        (".i(30*.sin(30*.t))", True),
        ("3600*.t", True),
    ],
)
def test_a_drive_may_have_kinks_but_no_jumps(angle: str, kept: bool) -> None:
    found = arm(angle)
    assert found.complete is kept
    assert kept or (len(found.breaks) == 1 and "jumps" in found.breaks[0].why and found.breaks[0].begin < 1.1)


def test_steps_are_stretches_and_a_jump_between_them_is_told() -> None:
    text = "A : .bar O = [0,0] P = O + [50,0];\n@0 A.O = [0,0]; A.angle = 10*.t;\n@1 A.angle = {};\n@2"
    kept, broken = (certificate(film(text.replace("{}", value))) for value in ("10", "50"))
    assert kept.complete
    assert [interval.begin for interval in kept.intervals] == [0.0, 1.0, 2.0]
    (jump,) = broken.jumps
    assert jump.time == 1.0
    assert jump.span is not None
    assert jump.distance == pytest.approx(100.0 * math.sin(math.radians(20.0)))


@pytest.mark.parametrize(
    ("statement", "word"),
    [
        ("A.P ~ [100*.t,40]", "wish"),
        ("A.P.x - A.O.x < 60", "freely"),
        ("A.angle = .i(.exp(.sin(30*.t)))", "integral"),
    ],
)
def test_what_cannot_be_certified_is_told(statement: str, word: str) -> None:
    found = certificate(film(f"A : .bar O = [0,0] P = O + [50,0];\n@0 A.O = [10*.t,0]; {statement};\n@1"))
    assert [word in one.why for one in found.refused] == [True]
    assert not found.complete


def test_two_drives_that_have_no_common_measure() -> None:
    found = certificate(
        film(
            "A : .bar O = [0,0] P = O + [50,0];  B : .bar O = [200,0] P = O + [30,0];"
            "L : .bar P = [50,0] Q = P + [150,0];  M : .bar P = [230,0] Q = P + [140,30];\n"
            "@0 A.O = [0,0]; B.O = [200,0]; A.angle = 90*.t; B.angle = 30.001*.t + 40*.sin(50*.t);"
            "   L.P = A.P; M.P = B.P; L.Q = M.Q;\n@3"
        )
    )
    assert found.complete
    assert found.distance < 1e-9


@pytest.mark.slow
def test_a_chain_of_dyads_takes_tubes_as_one_does() -> None:
    """Blocks one after another: the number of tubes does not grow with their number."""
    count = 15
    bars = "".join(
        f"A{i} : .bar O = [{40 * i},0] P = O + [50.3,0];  B{i} : .bar P = [{40 * i - 40},50] Q = P + [40.2,0];\n"
        for i in range(1, count)
    )
    joints = "".join(f" A{i}.O = [{40 * i},0]; B{i}.P = A{i - 1}.P; B{i}.Q = A{i}.P;" for i in range(1, count))
    text = f"A0 : .bar O = [0,0] P = O + [50,0];\n{bars}@0 A0.O = [0,0]; A0.angle = 70 + 10*.sin(90*.t);{joints}\n@2"
    found = certificate(film(text))
    assert found.complete
    assert found.tubes <= 64


def test_a_broken_bound_is_no_complete_certificate() -> None:
    motion = film(
        "A : .bar O = [0,0] P = O + [40,0];\n@0 A.O = [0,0]; A.angle = 11 + 117.7*.t; .claim A.P.y <= 39.99999;\n@1"
    )
    found = certificate(motion)
    assert found.complete
    assert as_data(found, motion.timeline.scene.source)["complete"] is False
    assert [item.code for item in certificate_diagnostics(found)] == ["certify/broken-claim"]


# --- the command


def test_the_command_says_what_it_proved() -> None:
    done = movimentum("check", "--certify", "--format", "json", str(ROOT / "scripts" / "hoecken.mov"))
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["certificate"]
    assert found["complete"] is True
    assert found["certified"] == found["frames"] == 50
    assert 0.0 < found["distance"] < 1e-9
    assert [claim["verdict"] for claim in found["claims"]] == ["proved", "proved"]
    assert found["claims"][1]["margin"] == pytest.approx(0.000313, abs=1e-5)


def test_exit_codes() -> None:
    done = movimentum("check", "--certify", str(ROOT / "scripts" / "coupling-rods.mov"))
    assert done.returncode == 4
    assert "certify/change-point" in done.stdout
    assert "0.33333" in done.stdout
    assert "not certified" in done.stdout


def test_claims_of_other_times_and_rates_stay_undecided() -> None:
    claims = ".claim A.P.at(1).x <= A.P.x + 200; .claim .abs(.d(A.P.x)) <= 100; .claim A.P.x <= 51;"
    found = certificate(film(f"A : .bar O = [0,0] P = [50,0];\n@0 A.O = [0,0]; A.angle = 40*.t; {claims}\n@2"))
    assert [bound.verdict.value for bound in found.bounds] == ["undecided", "undecided", "proved"]
    assert "other times" in found.bounds[0].why
    assert "rate" in found.bounds[1].why
