"""What is free, against rigidity theory: mobility by measures alone, braced grids, frameworks in general position."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from movimentum.analysis.report import StepReport
from tests.analysis.rods import Points, Rods, examined_script, rigidity_freedom, rod_script, step_of
from tests.broad import broad
from tests.command import environment, movimentum

FOUR_BAR: Points = [(0, 0), (30, 80), (150, 110), (130, 0)]
CHAIN: Rods = [(0, 1), (1, 2), (2, 3)]
SQUARE: Points = [(0, 0), (100, 0), (100, 100), (0, 100)]
RING: Rods = [(0, 1), (1, 2), (2, 3), (0, 3)]
THIRD_CRANK = """.config(10);
A : .bar o = [0,0]   p = [40,90];
B : .bar o = [200,0] p = [240,90];
C : .bar o = [80,0]  p = [120,90];
K : .bar a = [40,90] b = [240,90] c = [120,90];
@0 A.o = [0,0]; B.o = [200,0]; C.o = [80,0]; K.a = A.p; K.b = B.p; K.c = C.p;
"""
PEAUCELLIER: Points = [(0, 0), (70, 0), (140, 0), (220, 60), (220, -60), (300, 0)]
PEAUCELLIER_RODS: Rods = [(0, 3), (0, 4), (2, 3), (2, 4), (4, 5), (3, 5), (1, 2)]


def grubler(points: Points, rods: Rods, fixed: int) -> int:
    return 2 * len(points) - len(rods) - 2 * fixed


@pytest.mark.parametrize(
    ("text", "freedom"),
    [
        (rod_script(FOUR_BAR, CHAIN, [0, 3]), 1),
        (rod_script([*FOUR_BAR[:3], (190, 60), (130, 0)], [*CHAIN, (3, 4)], [0, 4]), 2),
        (rod_script(SQUARE, RING), 4),
        (rod_script(SQUARE, [*RING, (0, 2)]), 3),
        (rod_script(SQUARE, RING[1:], [0, 1]), 1),
        (rod_script(SQUARE, [*RING[1:], (0, 2)], [0, 1]), 0),
        (rod_script([(0, 0), (100, 0), (50, 70)], [(0, 1), (1, 2), (0, 2)]), 3),
        (THIRD_CRANK, 1),
        (rod_script(PEAUCELLIER, PEAUCELLIER_RODS, [0, 1]), 1),
        (rod_script([(0, 0), (50, 70)], [(0, 1)], [0]), 1),
        (rod_script([(0, 0), (50, 70)], [(0, 1)], [0], "R0_1.angle = 10*.t;\n@1"), 0),
        (rod_script(FOUR_BAR, CHAIN, [0, 3], "R0_1.angle = 10*.t;\n@1"), 0),
    ],
    ids=[
        *("four-bar", "five-bar", "square", "braced square", "square on the ground", "braced on the ground"),
        *("triangle", "third crank", "Peaucellier", "held rod", "stated", "driven four-bar"),
    ],
)
def test_mechanisms_that_everybody_knows(text: str, freedom: int) -> None:
    step = step_of(text)
    assert step.freedom == freedom
    assert len(step.motions) == freedom
    assert sum(part.freedom for part in step.parts) == freedom


def test_a_square_with_both_diagonals_has_one_too_many() -> None:
    one, two = (step_of(rod_script(SQUARE, [*RING[1:], *more], [0, 1])) for more in ([(0, 2)], [(0, 2), (1, 3)]))
    assert (one.freedom, one.redundant) == (0, 0)
    assert (two.freedom, two.redundant) == (0, 1)
    (part,) = two.parts
    assert part.redundant == 1
    assert part.superfluous
    # what is named is superfluous: without any one of them all is as rigid, and nothing redundant
    rods = [rod for rod in [*RING[1:], (0, 2), (1, 3)] if f"R{rod[0]}_{rod[1]}" in part.superfluous]
    assert rods
    for rod in rods:
        left = [other for other in [*RING[1:], (0, 2), (1, 3)] if other != rod]
        assert rigidity_freedom(SQUARE, left, [0, 1]) == 0


@pytest.mark.slow
def test_a_third_crank_is_mobile_by_its_measures_only() -> None:
    mobile, stuck = step_of(THIRD_CRANK), step_of(THIRD_CRANK.replace("c = [120,90]", "c = [120,80]"))
    assert (mobile.freedom, mobile.redundant) == (1, 1)  # 4 moving bodies, 6 pins: 3*4 - 2*6 = 0
    assert set(mobile.motions[0].things) == {"A", "B", "C", "K"}
    velocity = dict(mobile.motions[0].velocities)
    assert velocity["A.p"] == pytest.approx(velocity["C.p"], abs=1e-9)
    assert velocity["K.c"] == pytest.approx(velocity["B.p"], abs=1e-9)
    assert stuck.freedom == 0


def test_what_hangs_from_a_third_crank_is_counted_once() -> None:
    more = "H : .bar a = [240,90] b = [240,20];\nI : .bar a = [240,20] b = [270,20];\n"
    hung = THIRD_CRANK.replace("@0", more + "@0 H.a = K.b; I.a = H.b;")
    step = step_of(hung)
    assert (step.freedom, step.redundant, len(step.motions)) == (3, 1, 3)
    assert step.parts[0].freedom == 3


def test_two_third_cranks_are_each_mobile() -> None:
    second = {"A ": "D ", "B ": "E ", "C ": "F ", "K ": "L ", "A.": "D.", "B.": "E.", "C.": "F.", "K.": "L."}
    things, stated = THIRD_CRANK.split("@0")
    things2, stated2 = things.removeprefix(".config(10);"), stated
    for old, new in second.items():
        things2, stated2 = things2.replace(old, new), stated2.replace(old, new)
    step = step_of(f"{things}{things2}@0 {stated}{stated2}")
    assert [part.freedom for part in step.parts] == [1, 1]
    assert [motion.things for motion in step.motions] == [("A", "B", "C", "K"), ("D", "E", "F", "L")]


def test_two_linkages_are_two_parts() -> None:
    points = [*FOUR_BAR, (300, 0), (370, 80), (420, 90), (460, 40), (500, 0)]
    rods = [*CHAIN, (4, 5), (5, 6), (6, 7), (7, 8)]
    step = step_of(rod_script(points, rods, [0, 3, 4, 8]))
    assert [(part.things, part.freedom) for part in step.parts] == [
        (("R0_1", "R1_2", "R2_3"), 1),
        (("R4_5", "R5_6", "R6_7", "R7_8"), 2),
    ]
    for motion in step.motions:
        assert len({int(name[1]) < 4 for name in motion.things}) == 1  # no motion of both


# --- against the rigidity matrix ------------------------------------------------------------------------


def generic(seed: int) -> tuple[Points, Rods, list[int]]:
    """A connected framework in general position."""
    choose = random.Random(seed)
    count = choose.randint(4, 7)
    points = [(choose.uniform(0, 200), choose.uniform(0, 200)) for _ in range(count)]
    tree = [(choose.randrange(n), n) for n in range(1, count)]
    others = [pair for pair in combinations(range(count), 2) if pair not in tree]
    rods = [*tree, *choose.sample(others, choose.randint(0, min(len(others), count)))]
    return points, rods, choose.sample(range(count), choose.randint(0, 2))


@broad("seed", [0, 2, 3, 6, 8, 9, 11, 13, 17, 24], every=3)
def test_frameworks_in_general_position(seed: int) -> None:
    points, rods, fixed = generic(seed)
    step = step_of(rod_script(points, rods, fixed))
    freedom = rigidity_freedom(points, rods, fixed)
    assert step.freedom == freedom
    assert step.redundant == freedom - grubler(points, rods, len(fixed))


def grid(rows: int, columns: int, braces: list[tuple[int, int]]) -> tuple[Points, Rods]:
    """A grid of squares; the square in row r and column c is braced where (r, c) is in ``braces``."""
    number = {(r, c): r * (columns + 1) + c for r in range(rows + 1) for c in range(columns + 1)}
    points = [(40.0 * c, 40.0 * r) for r, c in number]
    rods = [(number[r, c], number[r, c + 1]) for r, c in number if (r, c + 1) in number]
    rods += [(number[r, c], number[r + 1, c]) for r, c in number if (r + 1, c) in number]
    rods += [(number[r, c], number[r + 1, c + 1]) for r, c in braces]
    return points, rods


def pieces(rows: int, columns: int, braces: list[tuple[int, int]]) -> int:
    """How many pieces the graph has whose vertices are rows and columns, and whose edges are braces."""
    group = list(range(rows + columns))
    for r, c in braces:
        old, new = group[r], group[rows + c]
        group = [new if other == old else other for other in group]
    return len(set(group))


@broad(
    ("rows", "columns", "braces"),
    [
        (1, 1, []),
        (2, 2, []),
        (2, 2, [(0, 0), (0, 1), (1, 0)]),
        (2, 2, [(0, 0), (0, 1), (1, 0), (1, 1)]),
        (2, 2, [(0, 0), (1, 1)]),
        (2, 3, [(0, 0), (0, 1), (1, 1), (1, 2)]),
        (2, 3, [(0, 0), (0, 1), (1, 0), (1, 1)]),  # as many braces, and a column free: Grübler sees no difference
        (3, 3, [(0, 0), (0, 1), (1, 0), (1, 1), (2, 2)]),
        (3, 3, [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2)]),
    ],
    every=3,
)
def test_braced_grids_are_as_rigid_as_the_graph_of_their_braces_is_connected(
    rows: int, columns: int, braces: list[tuple[int, int]]
) -> None:
    """Bolker and Crapo, Bracing rectangular frameworks, SIAM J. Appl. Math. 36 (1979)."""
    points, rods = grid(rows, columns, braces)
    assert step_of(rod_script(points, rods)).freedom == 3 + pieces(rows, columns, braces) - 1


# --- dead centres ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("points", "rods", "fixed"),
    [
        ([(0, 0), (100, 0), (200, 0), (150, 0)], CHAIN, [0, 3]),
        ([(0, 0), (50, 0), (250, 0), (200, 0)], CHAIN, [0, 3]),  # a parallelogram: a change point
        (PEAUCELLIER, PEAUCELLIER_RODS, [0, 1]),
        ([(0, 0), (100, 0), (180, 0), (250, 0)], CHAIN, [0]),
    ],
    ids=["folded", "parallelogram", "Peaucellier", "straight chain"],
)
def test_drawn_in_a_dead_centre_the_freedom_is_the_usual_one(points: Points, rods: Rods, fixed: list[int]) -> None:
    choose = random.Random(3)
    moved = [(x + choose.uniform(-9, 9), y + choose.uniform(-9, 9)) for x, y in points]
    assert step_of(rod_script(points, rods, fixed)).freedom == rigidity_freedom(moved, rods, fixed)


# --- motions --------------------------------------------------------------------------------------------


def motions_of(step: StepReport) -> list[dict[str, tuple[float, float]]]:
    return [dict(motion.velocities) for motion in step.motions]


@pytest.mark.parametrize("seed", [100, 103])
def test_the_basis_does_not_depend_on_the_order_of_statements(seed: int) -> None:
    points, rods, fixed = generic(seed)
    there, back = (motions_of(step_of(rod_script(points, rods, fixed, backwards=b))) for b in (False, True))
    assert len(there) == len(back) > 0
    for one, other in zip(there, back, strict=True):
        assert one.keys() == other.keys()
        for name, velocity in one.items():
            assert velocity == pytest.approx(other[name], abs=1e-7)


def test_the_basis_is_a_basis() -> None:
    points, rods, fixed = [*FOUR_BAR[:3], (190, 60), (130, 0)], [*CHAIN, (3, 4)], [0, 4]
    motions = motions_of(step_of(rod_script(points, rods, fixed)))
    names = sorted({name for motion in motions for name in motion})
    rows = np.array([[c for name in names for c in motion.get(name, (0.0, 0.0))] for motion in motions])
    assert np.linalg.matrix_rank(rows, tol=1e-3) == len(motions) == 2


PATIENT = """
from functools import partial
from movimentum.cli.app import main
from movimentum.workflow import check
check.with_fixes = partial(check.with_fixes, seconds=300.0)
main()
"""
"""The command, with time to try all fixes: how many are tried must not depend on how busy the machine is."""


@pytest.mark.slow
def test_the_report_is_the_same_in_every_process(tmp_path: Path) -> None:
    script = tmp_path / "linkage.mov"
    script.write_text(rod_script(*generic(103)))
    line = [sys.executable, "-c", PATIENT, "check", str(script), "--format", "json", "--freedom"]
    first, second = (
        subprocess.run(
            line, capture_output=True, text=True, env=environment({"PYTHONHASHSEED": seed}), check=False
        ).stdout
        for seed in ("1", "2")
    )
    assert first == second
    (step,) = json.loads(first)["steps"]
    assert step["freedom"] == len(step["motions"]) > 0
    assert set(step["parts"][0]) == {"things", "freedom", "redundant", "rigid", "fixed", "superfluous"}
    assert set(step["motions"][0]) == {"words", "things", "variables", "velocities", "drawn"}


def test_a_variable_that_is_free_is_told_as_one() -> None:
    step = step_of(".config(4);\nR : .bar A = [0,0] B = [9,0];\n@0 R.A = [x, 0]; R.angle = 0; u + v = 3;\n")
    assert step.freedom == 2
    slide, numbers = sorted(step.motions, key=lambda motion: not motion.things)
    assert slide.things == ("R",)
    assert dict(slide.velocities) == {"R.A": pytest.approx((1, 0)), "R.B": pytest.approx((1, 0))}
    assert slide.variables == ("x",)
    assert numbers.variables
    assert set(numbers.variables) <= {"u", "v"}


def test_people_are_told_the_same(tmp_path: Path) -> None:
    script = tmp_path / "third.mov"
    script.write_text(THIRD_CRANK)
    done = movimentum("check", script)
    assert done.returncode == 0
    assert "1 free motion" in done.stdout
    assert "1 degree of freedom" in done.stdout
    assert "`A` can still turn about `A.o`, and `B`, `C`, `K` with it" in done.stdout + done.stderr


def test_what_is_free_at_first_may_be_held_later() -> None:
    text = rod_script(FOUR_BAR, CHAIN, [0, 3], "@1 R0_1.angle = 10*.t;\n@2")
    steps = examined_script(text)[1].steps
    assert [step.freedom for step in steps[:2]] == [1, 0]
