"""No verdict is wrong: each is compared with positions of the mechanism that nobody proved anything about."""

import random
import re
from fractions import Fraction

import pytest

from movimentum.errors import MovimentumError
from movimentum.proving.prove import Prover
from movimentum.proving.verdicts import ProofVerdict
from movimentum.scene.model import Relation
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.prove import breaks
from movimentum.workflow.stages import arranged, moved, understand
from tests.broad import broad
from tests.command import ROOT
from tests.proving.positions import REFUTED, NoPosition, off_at, positions_off
from tests.proving.random_theorems import script

PROVED = (ProofVerdict.PROVED, ProofVerdict.ON_BRANCH)
GALLERY = ("hart", "peaucellier", "pantograph", "trammel", "scotch-yoke", "clockwork", "scissor-lift", "planetary",
           "antiparallelogram", "simson-line")  # fmt: skip


def film(text):
    """The motion, and what its claims are off by where they fail."""
    motion = moved(arranged(understand(SourceText(str(ROOT / "scripts" / "random.mov"), text)), Choices()))
    return motion, breaks(motion, None)


def looked_at(text, chance):
    """Compare each verdict; how many claims there were."""
    try:
        motion, broken = film(text)
    except MovimentumError:
        return 0
    prover = Prover(motion)
    for held in motion.timeline.claims:
        found, judged = broken.get(held.claim.number), prover.judged(held)
        conditional = any("passes" in condition for condition in judged.conditions)
        part = next(s for s in motion.segments if s.segment.start <= held.start and held.start < s.segment.end)
        low, high = held.start - part.segment.start, min(part.segment.end, held.end) - part.segment.start
        tau = float(low + (high - low) * Fraction(37, 100))
        told = text, held.claim.side_texts, judged, found
        if judged.verdict in PROVED:
            assert found is None or conditional, told
            amounts = positions_off(held, part, tau, chance, sides_kept=conditional)
            assert all(amount <= REFUTED for amount, _ in amounts), told
        elif judged.verdict is ProofVerdict.IN_FILM and held.claim.relation is Relation.EQUAL:
            amounts = positions_off(held, part, tau, chance)
            refuted = found is not None or any(amount > REFUTED for amount, _ in amounts)  # `found` is tried below
            assert len(amounts) < 3 or refuted, told
        if found is not None:
            when = Fraction(found[0])
            part = next((s for s in motion.segments if s.segment.start <= when < s.segment.end), motion.segments[-1])
            try:
                assert off_at(held, part, float(when - part.segment.start)) > found[1] / 2, told
            except NoPosition:
                continue
    return len(motion.timeline.claims)


@broad("seed", range(60), first=1)
def test_no_verdict_is_wrong(seed):
    others = [
        re.sub(r"\.config\(\d+", ".config(6", (ROOT / "scripts" / f"{name}.mov").read_text(encoding="utf-8"))
        for name in GALLERY
    ]
    claims = 0
    for number in range(2 if seed == 0 else 50):
        chance = random.Random(1000 * seed + number)
        claims += looked_at(script(chance, others), chance)
    assert claims


@pytest.mark.parametrize(
    ("claim", "holds"), [("Rod.B.x^2 + Rod.B.y^2 = 10000", True), ("Rod.B.x^2 + Rod.B.y^2 = 10000 + 10*.t^9", False)]
)
def test_other_positions_tell_what_the_film_does_not(claim, holds):
    rod = "Rod : .bar A = [0,0] B = A + [100,0];\n@0 Rod.A = [0,0]; Rod.angle = 60*.t;\n"
    text = f"{rod}  .claim {claim} .within(1);\n@0.5\n"
    motion, broken = film(text)
    assert not broken
    amounts = positions_off(motion.timeline.claims[0], motion.segments[0], 0.2, random.Random(1))
    assert len(amounts) >= 2
    assert all(amount <= REFUTED for amount, _ in amounts) is holds
