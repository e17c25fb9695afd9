"""Verdicts: theorems true and broken, on which branch, and never one that is wrong."""

import json
import random
import re

import pytest

from movimentum.analysis.diagnose.claims import broken_claims
from movimentum.errors import MovimentumError
from movimentum.proving.prove import ProofVerdict, Prover
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.prove import proofs
from movimentum.workflow.stages import arranged, moved, understand
from tests.command import ROOT, movimentum
from tests.proving.theorems import FALSE, TRUE, WATT

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


@pytest.mark.parametrize("name", FILMS)
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


def test_an_approximate_straight_line_is_not_proved():
    (one,) = judged(WATT.format(within="0.5"))
    assert one.verdict in (ProofVerdict.IN_FILM, ProofVerdict.UNKNOWN)
    (one,) = judged(WATT.format(within="1e-9"))
    assert one.verdict is ProofVerdict.FALSE


def test_all_lengths():
    (first, *_), names = proofs(SourceText("hart.mov", FILMS["hart"]), Choices(), 60.0, all_lengths=True)
    assert first.verdict in PROVED
    assert set(names) == {"L", "S", "q"}


def mutated(text, chance):
    """``text`` with one number or one sign changed."""
    text = re.sub(r"//.*", "", text)
    places = [
        m
        for m in re.finditer(r"(?<![\w.#@])\d+(\.\d+)?(?![\w.])", text)
        if "config" not in text[: m.start()].rpartition(";")[2]
    ]
    place = chance.choice(places)
    return f"{text[: place.start()]}{float(place[0]) * 1.01 + chance.choice((0, 0.01, -1)):.6g}{text[place.end() :]}"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_no_mutation_that_the_film_refutes_is_proved(seed):
    chance = random.Random(seed)
    scripts = list({**TRUE, **FILMS}.values())
    done = 0
    while done < 50:
        text = mutated(chance.choice(scripts), chance)
        try:
            motion = moved(arranged(understand(SourceText(str(ROOT / "scripts" / "mutation.mov"), text)), Choices()))
            broken = {one.claim.number: one for one in broken_claims(motion)}
        except MovimentumError:
            continue
        done += 1
        prover = Prover(motion)
        for held in motion.timeline.claims:
            found = broken.get(held.claim.number)
            if found is not None and found.worst > 1e-9 * max(map(abs, (*found.left, *found.right))):
                assert prover.judged(held).verdict not in PROVED, text


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
