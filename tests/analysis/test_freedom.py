"""Degrees of freedom, what moves as one and what is superfluous, against what is known of linkages by hand."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from movimentum.analysis.freedom.degrees import BlockRank, ConnectedPart, block_ranks, parts_of
from movimentum.interop.linkages import Linkage, linkage_script, turn
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, understand
from tests.command import movimentum


def motion_of(text: str) -> PathMotion:
    return moved(arranged(understand(SourceText("test.mov", text)), Choices()))


def found(text: str) -> tuple[list[BlockRank], list[ConnectedPart], PathMotion]:
    motion = motion_of(text)
    ranks = block_ranks(motion.segments[0])
    return ranks, parts_of(motion.segments[0], ranks), motion


def linkage(vertices: list[tuple[float, float]], rods: list[tuple[int, int]], fixed: tuple[int, ...] = ()) -> str:
    return linkage_script(Linkage(tuple(vertices), tuple(rods), fixed), "test")


SQUARE = [(0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (0.0, 60.0)]
RIM = [(0, 1), (1, 2), (2, 3), (3, 0)]


@pytest.mark.parametrize(
    ("text", "freedom", "redundant"),
    [
        (linkage(SQUARE, RIM, (0, 1)), 1, 1),  # a parallelogram; the rod between fixed vertices says nothing new
        (linkage(SQUARE, RIM), 4, 0),  # floating
        (linkage(SQUARE, [*RIM, (0, 2)]), 3, 0),  # braced
        (linkage(SQUARE, [*RIM, (0, 2), (1, 3)]), 3, 1),  # braced twice
        (linkage(SQUARE, [*RIM, (0, 2), (1, 3)], (0, 1)), 0, 2),
        (linkage([(0, 0), (40, 80), (150, 90), (180, 0)], RIM[:3], (0, 3)), 1, 0),  # a four-bar
        (linkage([(0, 0), (30, 80), (90, 120), (150, 80), (180, 0)], [(0, 1), (1, 2), (2, 3), (3, 4)], (0, 4)), 2, 0),
        # a third bar, parallel to two others: Grübler counts 0
        (linkage([(0, 0), (60, 0), (120, 0), (0, 50), (60, 50), (120, 50)],
                 [(0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (3, 5)], (0, 1, 2)), 1, 1),
        (linkage([(0, 0), (50, 0), (20, 40)], [(0, 1), (1, 2), (2, 0)]), 3, 0),
        (linkage([(0, 0), (50, 0)], [(0, 1)], (0,)), 1, 0),
    ],
)  # fmt: skip
def test_known_structures(text: str, freedom: int, redundant: int) -> None:
    _, parts, _ = found(text)
    assert [part.freedom for part in parts] == [freedom]
    assert [part.redundant for part in parts] == [redundant]
    assert bool(parts[0].superfluous_things or parts[0].superfluous_constraints) == bool(redundant)


def test_parts_that_nothing_connects_are_counted_apart() -> None:
    one = linkage(SQUARE, RIM, (0,))
    other = linkage([(200.0, 0.0), (260.0, 0.0)], [(0, 1)]).replace("R0_1", "Other")
    definitions = [line for line in other.splitlines() if line.startswith("Other")]
    text = one.replace("@0", "\n".join([*definitions, "@0", "Other.V0 = [200, 0];"]))
    _, parts, motion = found(text)
    names = [[motion.timeline.scene.things[t].name for t in part.things] for part in parts]
    assert sorted(map(len, names)) == [1, 4]
    assert {part.freedom for part in parts} == {1, 2}


@pytest.mark.parametrize("degrees", [0, 36, 90, 180, -90, 179.999, -144])
def test_a_fixed_angle_takes_one_freedom_whatever_it_is(degrees: float) -> None:
    end = [100 + 60 * math.cos(math.radians(degrees)), 100 + 60 * math.sin(math.radians(degrees))]
    text = f""".config(12);
        A : .bar P = [100,100] Q = [160,100];
        B : .bar P = [100,100] R = {end};
        @0 B.P = A.P; A.P = [100,100]; .a(A.Q - A.P, B.R - B.P) = {degrees};"""
    _, parts, _ = found(text)
    assert [(part.freedom, part.redundant, len(part.rigid)) for part in parts] == [(1, 0, 1)]


@pytest.mark.parametrize(
    ("vertices", "freedom"),
    [
        ([(0, 0), (40, 0), (140, 0), (100, 0)], 1),  # all rods in a line
        ([(0, 0), (0, 60), (100, 60), (100, 0)], 1),
    ],
)
def test_a_dead_centre_frees_nothing(vertices: list[tuple[float, float]], freedom: int) -> None:
    _, parts, _ = found(linkage(vertices, RIM[:3], (0, 3)))
    assert parts[0].freedom == freedom


def test_what_turns_together_only_where_it_is_drawn_is_not_rigid() -> None:
    # Peaucellier's cell in its symmetric pose: the whole cell turns about one point, for a moment
    vertices = [(50.0, 300.0), (150.0, 300.0), (250.0, 300.0), (400.0, 400.0), (400.0, 200.0), (550.0, 300.0)]
    rods = [(0, 3), (0, 4), (1, 2), (2, 3), (2, 4), (3, 5), (4, 5)]
    _, parts, _ = found(linkage(vertices, rods, (0, 1)))
    assert (parts[0].freedom, parts[0].rigid, parts[0].fixed) == (1, (), ())


def test_a_triangle_of_rods_moves_as_one() -> None:
    vertices = [(0.0, 0.0), (60.0, 0.0), (20.0, 50.0), (120.0, 40.0)]
    _, parts, motion = found(linkage(vertices, [(0, 1), (1, 2), (2, 0), (1, 3)], (0,)))
    names = [{motion.timeline.scene.things[t].name for t in some} for some in parts[0].rigid]
    assert names == [{"R0_1", "R1_2", "R2_0"}]
    assert parts[0].freedom == 2


def test_what_a_clock_moves_is_free_of_nothing_and_not_fixed() -> None:
    text = """.config(4);
        A : .bar P = [0,0] Q = [30,0];  B : .bar P = [30,0] Q = [90,0];  C : .bar P = [0,-50] Q = [10,-50];
        @0 A.P = [0,0]; A.angle = 90*.t; B.P = A.Q; B.angle = A.angle; C.P = [0,-50]; C.angle = 0;
        @1"""
    _, parts, motion = found(text)
    of = {motion.timeline.scene.things[t].name: part for part in parts for t in part.things}
    assert of["A"].freedom == 0
    assert [len(some) for some in of["A"].rigid] == [2]
    assert of["A"].fixed == ()
    assert of["C"].fixed != ()


def braced(seed: int) -> tuple[list[tuple[float, float]], list[tuple[int, int]]]:
    generator = np.random.default_rng(seed)
    count = 7
    vertices = [(float(x), float(y)) for x, y in generator.uniform(0, 200, (count, 2))]
    pairs = [(i, j) for i in range(count) for j in range(i)]
    chosen = generator.permutation(len(pairs))[: int(generator.integers(5, 14))]
    return vertices, [pairs[k] for k in chosen]


@pytest.mark.parametrize("seed", range(12))
def test_random_structures_have_the_rank_of_their_rigidity_matrix(seed: int) -> None:
    vertices, rods = braced(seed)
    used = sorted({n for rod in rods for n in rod})
    matrix = np.zeros((len(rods), 2 * len(vertices)))
    points = np.array(vertices)
    for row, (i, j) in enumerate(rods):
        d = points[i] - points[j]
        matrix[row, 2 * i : 2 * i + 2], matrix[row, 2 * j : 2 * j + 2] = d, -d
    rank = np.linalg.matrix_rank(matrix / np.linalg.norm(matrix, axis=1)[:, None], tol=1e-6)
    ranks, parts, motion = found(linkage(vertices, rods))
    moving = [part for part in parts if any(len(motion.timeline.scene.things[t].anchors) > 1 for t in part.things)]
    assert sum(part.freedom for part in moving) == 2 * len(used) - rank
    assert sum(part.redundant for part in moving) == len(rods) - rank
    # every motion keeps the lengths of all rods, to first order
    for motion_found in (m for r in ranks for m in r.motions):
        velocity = dict(motion_found.velocities)
        assert max(math.hypot(*v) for v in velocity.values()) == pytest.approx(1.0)
        by_vertex: dict[int, list[tuple[float, float]]] = {}
        for ref, v in velocity.items():
            name = motion.timeline.scene.things[ref.thing].anchors[ref.anchor].name
            by_vertex.setdefault(int(name[1:]), []).append(v)
        for some in by_vertex.values():
            assert np.ptp(np.array(some), axis=0) == pytest.approx([0, 0], abs=1e-9)
        still = (0.0, 0.0)
        for i, j in rods:
            relative = np.subtract(by_vertex.get(i, [still])[0], by_vertex.get(j, [still])[0])
            assert relative @ (points[i] - points[j]) / np.linalg.norm(points[i] - points[j]) == pytest.approx(
                0, abs=1e-9
            )


def test_the_basis_is_the_same_from_run_to_run_and_for_another_order_of_statements(tmp_path: Path) -> None:
    text = linkage(SQUARE, RIM, (0,))
    head, body = text.split("@0\n")
    lines = [line for line in body.splitlines() if not line.startswith("//")]
    (tmp_path / "a.mov").write_text(text)
    (tmp_path / "b.mov").write_text(head + "@0\n" + "\n".join(reversed(lines)) + "\n")
    made = []
    for name, fresh in (("a", False), ("a", True), ("b", False)):
        done = movimentum("check", tmp_path / f"{name}.mov", "--freedom", "--format", "json", fresh=fresh)
        report = json.loads(done.stdout)
        made.append(report["steps"][0]["motions"])
    assert made[0] == made[1]
    for one, other in zip(made[0], made[2], strict=True):
        a, b = one["velocities"], other["velocities"]
        assert a.keys() == b.keys()
        for name, v in a.items():
            assert v == pytest.approx(b[name], abs=1e-9)


def test_the_report_for_programs_and_people(tmp_path: Path) -> None:
    path = tmp_path / "square.mov"
    path.write_text(linkage(SQUARE, [*RIM, (0, 2), (1, 3)]))
    plain = json.loads(movimentum("check", path, "--format", "json").stdout)
    assert "parts" not in plain["steps"][0]  # the agreed form, to the letter
    step = json.loads(movimentum("check", path, "--format", "json", "--freedom").stdout)["steps"][0]
    (part,) = step["parts"]
    assert (part["freedom"], part["redundant"]) == (3, 1)
    assert sorted(part["rigid"][0]) == sorted(part["things"])
    assert len(part["superfluous"]) >= 6
    assert len(step["motions"]) == 3
    text = movimentum("check", path, "--freedom").stdout
    assert "3 degrees of freedom" in text
    assert "one of these is superfluous" in text
    assert "motion 3" in text


def test_angles_count_as_constraints_of_a_linkage() -> None:
    vertices = ((0.0, 0.0), (60.0, 0.0), (0.0, 60.0))
    corner = (0, 1, 2)
    text = linkage_script(Linkage(vertices, ((0, 1), (0, 2)), (), (corner,), (turn(vertices, corner),)), "corner")
    _, parts, _ = found(text)
    assert (parts[0].freedom, len(parts[0].rigid)) == (3, 1)


def test_a_free_opacity_is_no_degree_of_freedom() -> None:
    text = ".config(20, 400, 400);\nD : .disc(3) c = [50,50];\n@0 D.c.y = 50; D.opacity ~ 0.5;\n@1\n"
    assert [(part.things, part.freedom) for part in found(text)[1]] == [((0,), 1)]
