"""A path that ends where it begins, over and over, is given up after a few beginnings, and that is told; so is help
that would take long to try.
"""

from __future__ import annotations

import math
import random

import pytest

from movimentum.analysis.diagnose import trials
from movimentum.solver.basis.effort import EffortExceeded, charge_effort, limit_effort
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.solver import MAXIMAL_PIECES, PIECES_WITHOUT_PROGRESS
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, moved, understand
from tests.broad import broad

SCENE = """\
.config(10, 60, 40);
A : .bar P = [0,0] Q = [10,0];
@0 A.P = [0,0]; A.angle = 0;
@1 {}
@+1
"""


def motion_of(text: str) -> PathMotion:
    return moved(arranged(understand(SourceText("a.mov", text)), Choices()))


def _drawn_across(seed: int) -> tuple[str, bool]:
    """A wish for a number and an inequality, and whether the wish is on the inequality's side all along."""
    chance = random.Random(seed)
    name = chance.choice(("A.opacity", "A.red", "A.green"))
    limit, wish = chance.uniform(1.1, 1.4), chance.uniform(1.5, 3.0)
    good = chance.random() < 0.3
    if good:
        limit, wish = wish, limit
    moving = chance.choice(("", " + 0.05*.t", " + .t - 1"))
    relation = chance.choice((f"{name} < {limit}{moving}", f"{limit}{moving} > {name}"))
    if moving == " + .t - 1" and good:
        relation = f"{name} < {limit} + 0.01*.t"
    return f"{relation}; {name} ~ {wish};", good


def _at_single_instants(seed: int) -> str:
    """What is asked for has a value at the beginning of each piece only: a wish for 0/0."""
    chance = random.Random(seed)
    name = chance.choice(("A.red", "A.opacity"))
    return f"(-{name} - .t) ~ -.t/_; -{name} - .t = {chance.choice('xyz')};"


def assert_soon_told(text: str, good: bool) -> None:
    motion = motion_of(SCENE.format(text))
    assert all(len(segment_motion.pieces) <= 2 * PIECES_WITHOUT_PROGRESS + 4 for segment_motion in motion.segments), (
        text
    )
    found = examined(motion.timeline, Choices())
    assert found.fault == (0 if good else 3), (text, found.diagnostics)
    if not good:
        assert any(item.code.startswith(("solve/", "limit/paths")) for item in found.diagnostics), text


def _binding_crank(seed: int, turns: int) -> tuple[str, list[tuple[float, float]]]:
    """A crank that makes many turns in one step before two bars that do not reach all the way round, and the times
    (from, to) at which they do not, by the cosine rule.
    """
    chance = random.Random(seed)
    a, g = chance.uniform(30, 60), chance.uniform(90, 150)
    reach = g + a * chance.uniform(-0.6, 0.6)
    b = reach * chance.uniform(0.45, 0.55)
    c = reach - b
    angle = math.degrees(math.acos((a * a + g * g - reach * reach) / (2 * a * g)))
    d = g - a
    x = (b * b - c * c + d * d) / (2 * d)
    joint = f"[{a + x!r}, {math.sqrt(b * b - x * x)!r}]"
    text = f"""A : .bar O = [0,0] P = [{a!r},0]; B : .bar P = [{a!r},0] Q = {joint}; C : .bar Q = {joint} X = [{g!r},0];
@0 A.O = [0,0]; B.P = A.P; C.Q = B.Q; C.X = [{g!r},0]; A.angle = {360 * turns}*.t;
@1"""
    return text, [((k + angle / 360) / turns, (k + 1 - angle / 360) / turns) for k in range(turns)]


@broad(("seed", "turns"), [(1, 30), (2, 60), pytest.param(3, 190, marks=pytest.mark.slow)], first=1)
def test_many_binds_are_all_found_and_take_work_in_proportion(seed: int, turns: int) -> None:
    text, gaps = _binding_crank(seed, turns)
    (segment_motion, *_) = motion_of(text).segments
    found = [(trouble.begin, trouble.until) for trouble in segment_motion.failures]
    assert len(found) == turns
    # the ends are simple zeros of the margin, which is known to 1e-13
    assert found == [pytest.approx(pair, abs=1e-11) for pair in gaps]
    nodes = [len(piece.nodes) for piece in segment_motion.pieces if isinstance(piece, Piece)]
    assert sum(nodes) <= 30 * turns * 2 + 200 * turns  # the first path is followed all the way, the others some turns


@pytest.mark.slow
def test_binds_beyond_the_limit_are_told_as_not_looked_at() -> None:
    text, gaps = _binding_crank(4, 400)
    found = examined(motion_of(text).timeline, Choices())
    assert found.fault == 3
    (limit,) = [item for item in found.diagnostics if item.code == "limit/paths"]
    assert f"{MAXIMAL_PIECES // 2 + 1} times" in limit.message
    assert f"`@{gaps[MAXIMAL_PIECES // 2][1]:.9g}"[:8] in limit.helps[0]


@broad("seed", range(4), first=3)
def test_a_wish_across_an_inequality_is_soon_told(seed: int) -> None:
    assert_soon_told(*_drawn_across(seed))


@pytest.mark.slow
@pytest.mark.long
def test_many_wishes_across_inequalities() -> None:
    for seed in range(100, 112):
        assert_soon_told(*_drawn_across(seed))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_solutions_at_single_instants_are_soon_told(seed: int) -> None:
    assert_soon_told(_at_single_instants(seed), good=False)


def test_help_is_given_up_after_counted_work(monkeypatch: pytest.MonkeyPatch) -> None:
    text = SCENE.format("") + "\n@4 A.P ~ [3,4]; A.red ~ 0.5; x*x = 2 + A.green;\n@5"
    whole = trials.Trials(motion_of(text))
    assert whole.with_statement(2, "A.blue = 0.5;") is not None
    monkeypatch.setattr(trials, "EFFORT", 5)
    short = trials.Trials(motion_of(text))
    assert short.can_try(0)
    assert short.with_statement(2, "A.blue = 0.5;") is None
    assert not short.can_try(0)


def test_work_is_counted_inside_only() -> None:
    charge_effort(10**9)
    with pytest.raises(EffortExceeded), limit_effort(3) as left:
        for _ in range(4):
            charge_effort()
    assert left == [-1]
    charge_effort(10**9)
    with limit_effort(10) as around:
        with limit_effort(5):
            charge_effort(3)
        assert around == [7]
        with pytest.raises(EffortExceeded), limit_effort(100):
            charge_effort(101)
        assert around[0] < 0
