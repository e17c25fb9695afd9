"""A process keeps plans by all that they depend on: what was solved before changes no bit."""

import random
import re

import numpy as np
import pytest

import movimentum as mv
from movimentum.solver import solver_cache
from tests.command import ROOT

NUMBER = re.compile(r"(?<=[\[,+ ])\d\d+(?=[\],])")


def poses(text):
    """Where the script's points are in all frames, or the code of what is wrong with it."""
    try:
        found = mv.loads(text, name=str(ROOT / "scripts" / "x.mov")).solve()
    except mv.MovimentumError as error:
        return error.diagnostics[0].code
    return np.stack([found[point] for point in ("Crank.B", "Coupler.P", "Rocker.C")])


@pytest.mark.parametrize("seed", range(3))
def test_plans_kept_from_other_numbers_change_no_bit(seed, monkeypatch):
    text = (ROOT / "scripts" / "four-bar.mov").read_text(encoding="utf-8")
    draw = random.Random(seed)
    for _ in range(6):
        edited = NUMBER.sub(
            lambda found: draw.choice([found[0], found[0], str(int(found[0]) + draw.randrange(4))]), text
        )
        kept = poses(edited)
        monkeypatch.setattr(solver_cache, "_PLANS", solver_cache._PlanCache())
        np.testing.assert_array_equal(poses(edited), kept)


def test_a_script_that_is_solved_again_is_not_planned_again(monkeypatch):
    monkeypatch.setattr(solver_cache, "_PLANS", solver_cache._PlanCache())
    script = mv.load(ROOT / "scripts" / "four-bar.mov")
    script.solve()
    made = solver_cache._PLANS.memo.made["plan"]
    assert made > 0
    script.solve()
    mv.load(ROOT / "scripts" / "four-bar.mov").solve()
    assert solver_cache._PLANS.memo.made["plan"] == made
