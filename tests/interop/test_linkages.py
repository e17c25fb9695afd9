"""Linkage files: what is read is what is there, what is wrong is told, and what comes out is a script that means it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from movimentum.errors import ScriptError
from movimentum.interop.linkage_export import linkage_of
from movimentum.interop.linkages import Linkage, linkage_script, linkage_text, read_linkage
from movimentum.interop.snapping import equalised, snapped
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, understand
from tests.command import movimentum

SHARED = Path(__file__).parents[3] / "shared" / "data" / "linkages"
FILES = sorted(SHARED.glob("*.txt")) if SHARED.is_dir() else []

SQUARE = """v
0 0
10 0
10 10
0 10
f
0
1
e
0 1
1 2
2 3
3 0
a
0 1 3
"""


def solved_script(text: str) -> PathMotion:
    return moved(arranged(understand(SourceText("test.mov", text)), Choices()))


def read(text: str) -> tuple[Linkage, list[str]]:
    linkage, found = read_linkage(SourceText("square.txt", text))
    return linkage, [item.code for item in found]


def test_reads_all_sections() -> None:
    linkage, codes = read(SQUARE)
    assert codes == []
    assert linkage.vertices == ((0, 0), (10, 0), (10, 10), (0, 10))
    assert linkage.rods == ((0, 1), (1, 2), (2, 3), (3, 0))
    assert linkage.fixed == (0, 1)
    assert linkage.angles == ((0, 1, 3),)
    assert linkage.degrees == (90.0,)


def test_sections_repeat_in_any_order_and_headers_may_say_more() -> None:
    linkage, codes = read("edges 2\n0 1\nf\n\n0\nvertices follow\n1 2\na\nv\n3.5 -4e1\n")
    assert codes == []
    assert linkage.vertices == ((1, 2), (3.5, -40))
    assert linkage.rods == ((0, 1),)
    assert linkage.fixed == (0,)


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("e\n0 9\n", "import/index"),
        ("e\n0 -1\n", "import/index"),
        ("f\n4\n", "import/index"),
        ("a\n0 1 17\n", "import/index"),
        ("e\n1 0\n", "import/duplicate"),
        ("f\n1\n", "import/duplicate"),
        ("a\n0 3 1\n", "import/duplicate"),
        ("e\n2 2\n", "import/degenerate"),
        ("a\n0 0 1\n", "import/degenerate"),
        ("v\n10 10\ne\n2 4\n", "import/degenerate"),
        ("v\n1 2 3\n", "import/line"),
        ("v\nnan 2\n", "import/line"),
        ("v\n1e999 2\n", "import/line"),
        ("e\n0 1.5\n", "import/line"),
        ("e\n?\n", "import/line"),
        ("a\n0 1\n", "import/line"),
    ],
)
def test_what_makes_no_sense_is_left_out_and_told_with_its_place(line: str, code: str) -> None:
    whole, _ = read(SQUARE)
    text = SQUARE + line
    linkage, found = read_linkage(SourceText("square.txt", text))
    assert [item.code for item in found] == [code]
    assert found[0].span is not None
    assert text[found[0].span.start : found[0].span.end] == line.strip().splitlines()[-1]
    assert (linkage.rods, linkage.fixed, linkage.angles) == (whole.rods, whole.fixed, whole.angles)


def test_a_line_before_any_section_is_told() -> None:
    assert read("7 8\n" + SQUARE)[1] == ["import/line"]


@pytest.mark.parametrize("text", ["", "v\n", "\n\n", "e\n0 1\n", "hello\n"])
def test_a_file_without_vertices_is_an_error(text: str) -> None:
    with pytest.raises(ScriptError) as raised:
        read(text)
    assert raised.value.diagnostics[-1].code == "import/empty"


def test_text_reads_back_exactly() -> None:
    linkage, _ = read(SQUARE.replace("10 10", "10.1 9.87654321098765432"))
    again, codes = read(linkage_text(linkage))
    assert codes == []
    assert again == linkage


def test_equal_lengths_become_one_round_number() -> None:
    lengths = equalised([59.9999993, 60.0000002, 100.0, 59.99999991, 364.005494])
    assert lengths == [60.0, 60.0, 100.0, 60.0, 364.005494]


def rounded_rhombus() -> Linkage:
    """Two rhombuses of side 60 and angle 36 degrees at a common vertex, with the digits that a file has."""
    angles = np.radians([0.0, 36.0, 72.0])
    rim = 60.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = np.concatenate([np.zeros((1, 2)), rim, [rim[0] + rim[1], rim[1] + rim[2]]])
    vertices = tuple((round(float(x), 6), round(float(y), 6)) for x, y in points)
    rods = ((0, 1), (0, 2), (0, 3), (1, 4), (2, 4), (2, 5), (3, 5))
    text = linkage_text(Linkage(vertices, rods, (0,), ((0, 1, 2), (0, 2, 3), (2, 0, 4), (4, 1, 2))))
    return read(text)[0]


def test_snapping_repairs_lengths_and_angles_and_hardly_moves_anything() -> None:
    rough = rounded_rhombus()
    result = snapped(rough)
    assert result.diagnostics == ()
    assert result.moved < 2e-6
    assert result.linkage.vertices[0] == rough.vertices[0]
    assert result.linkage.degrees == (36.0, 36.0, 144.0, -36.0)
    for rod in range(len(result.linkage.rods)):
        assert result.linkage.length(rod) == pytest.approx(60.0, abs=3e-14)


def test_snapping_leaves_what_is_no_multiple_and_says_so() -> None:
    result = snapped(rounded_rhombus(), angle=25.0)
    assert [item.code for item in result.diagnostics] == ["import/angle"] * 4
    assert "--snap-angle 36" in result.diagnostics[0].helps[0]
    assert result.linkage.degrees == pytest.approx((36.0, 36.0, 144.0, -36.0), abs=1e-5)


def test_snapping_tells_what_cannot_be_repaired() -> None:
    # an equilateral triangle whose angles are all fixed, two as they are and one as 72 degrees would have it
    vertices = ((0.0, 0.0), (10.0, 0.0), (5.0, 8.660254))
    triangle = Linkage(vertices, ((0, 1), (1, 2), (2, 0)), (), ((0, 1, 2),), (71.8,))
    assert [item.code for item in snapped(triangle, 36.0).diagnostics] == ["import/unrepaired"]


def test_a_script_states_rods_joints_fixed_vertices_and_angles() -> None:
    text = linkage_script(read(SQUARE)[0], "square.txt")
    assert "R1_2 : .bar  V1 = [10, 0]  V2 = [10, 10];" in text
    assert "R1_2.V1 = R0_1.V1;" in text
    assert "R0_1.V0 = [0, 0];" in text
    assert ".a(R0_1.V1 - R0_1.V0, R3_0.V3 - R3_0.V0) = 90;" in text
    motion = solved_script(text)
    assert motion.poses(0, 1).solved.all()


def test_a_vertex_without_rods_is_still_there() -> None:
    text = linkage_script(read("v\n1 2\n3 4\ne\nf\n1\n")[0], "points.txt")
    assert "P0 : .disc(3)  V0 = [1, 2];" in text
    assert "P1.V1 = [3, 4];" in text


def test_export_gives_back_what_was_imported() -> None:
    linkage = rounded_rhombus()
    motion = solved_script(linkage_script(linkage, "rhombus.txt"))
    scene, active = motion.timeline.scene, motion.timeline.segments[0].active
    back, names, left_out = linkage_of(scene, active, motion.poses(0, 1))
    assert left_out == ()
    number = {int(name.split(".V")[-1]): k for k, name in enumerate(names)}
    order = [number[k] for k in range(len(linkage.vertices))]
    assert np.array(back.vertices)[order] == pytest.approx(np.array(linkage.vertices), abs=1e-9)
    assert {frozenset(rod) for rod in back.rods} == {frozenset((number[i], number[j])) for i, j in linkage.rods}
    assert sorted(back.fixed) == sorted(number[i] for i in linkage.fixed)
    assert back.angles == tuple((number[i], number[j], number[k]) for i, j, k in linkage.angles)


def test_export_tells_what_rods_cannot_say() -> None:
    motion = solved_script(".config(4);\nR : .bar A = [0,0] B = [9,0];\n@0 R.A = [1,1]; R.angle = 90*.t;\n@1\n")
    scene, active = motion.timeline.scene, motion.timeline.segments[0].active
    linkage, _, left_out = linkage_of(scene, active, motion.poses(0, 1))
    assert linkage.rods == ((0, 1),)
    assert [item.code for item in left_out] == ["export/left-out"]
    assert scene.source.text[left_out[0].span.start : left_out[0].span.end] == "R.angle = 90*.t"  # pyright: ignore[reportOptionalMemberAccess]


def test_a_body_of_many_anchors_becomes_rods_and_angles() -> None:
    text = ".config(4);\nT : .bar A = [0,0] B = [9,0] C = [0,5] D = [18,0];\n@0 T.A = [1,1];\n"
    motion = solved_script(text)
    scene, active = motion.timeline.scene, motion.timeline.segments[0].active
    linkage, _, _ = linkage_of(scene, active, motion.poses(0, 1))
    assert linkage.rods == ((0, 1), (0, 2), (0, 3))
    assert linkage.angles == ((0, 1, 2), (0, 1, 3))
    assert linkage.degrees == pytest.approx((90.0, 0.0))


@pytest.mark.skipif(not FILES, reason="the linkage files are not here")
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_facts_of_published_files(path: Path) -> None:
    facts = json.loads(path.with_suffix(".invariants.json").read_text())
    linkage, found = read_linkage(SourceText(path.name, path.read_text()))
    assert found == ()
    assert len(linkage.vertices) == facts["vertices"]
    assert len(linkage.rods) == facts["edges"]
    assert list(linkage.fixed) == facts["fixed"]
    assert len(linkage.angles) == facts["angles"]
    assert [linkage.length(rod) for rod in range(len(linkage.rods))] == pytest.approx(facts["edge_lengths"], abs=1e-6)
    assert list(linkage.degrees) == pytest.approx(facts["angles_deg"], abs=1e-5)
    assert list(linkage.rods[0]) == facts["first_edge"]
    assert list(linkage.rods[-1]) == facts["last_edge"]


LARGE = {"penrose2t", "penrose3"}


@pytest.mark.skipif(not FILES, reason="the linkage files are not here")
@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[pytest.mark.slow] if path.stem in LARGE else []) for path in FILES],
    ids=lambda path: path.stem,
)
@pytest.mark.parametrize("snap", [False, True])
def test_the_degrees_of_freedom_of_published_files(path: Path, snap: bool, tmp_path: Path) -> None:
    facts = json.loads(path.with_suffix(".invariants.json").read_text())
    script = tmp_path / "linkage.mov"
    arguments = ["import", str(path), "-o", str(script), *(["--snap"] if snap else [])]
    assert movimentum(*arguments).returncode == 0
    report = json.loads(movimentum("check", str(script), "--format", "json").stdout)
    step = report["steps"][0]
    assert step["freedom"] == facts["dof_rel_1e5"]
    assert step["redundant"] == facts["redundant_rows_python"]


def test_the_command_imports_and_exports(tmp_path: Path) -> None:
    source = tmp_path / "square.txt"
    source.write_text(SQUARE)
    script, back = tmp_path / "square.mov", tmp_path / "back.txt"
    assert movimentum("import", str(source), "-o", str(script)).returncode == 0
    assert movimentum("check", str(script)).returncode == 0
    assert movimentum("export", str(script), "-o", str(back)).returncode == 0
    assert len(read(back.read_text())[0].rods) == 4
    done = movimentum("import", str(source), "-o", "-")
    assert done.stdout == script.read_text()
    assert movimentum("import", str(source), "-o", str(source)).returncode == 2
    assert movimentum("import", str(source), "-o", str(script), "--snap-angle", "30").returncode == 2
    assert movimentum("import", str(source), "-o", str(script), "--drive", "0,1").returncode == 2
    assert movimentum("import", str(tmp_path / "none.txt"), "-o", str(script)).returncode == 2
    source.write_text("nothing")
    assert movimentum("import", str(source), "-o", str(script)).returncode == 1
    source.write_text(SQUARE + "e\n0 1\n")
    assert movimentum("import", str(source), "-o", str(script)).returncode == 0
    assert movimentum("import", str(source), "-o", str(script), "--strict").returncode == 1
