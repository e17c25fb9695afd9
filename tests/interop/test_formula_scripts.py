"""Formulas imported by the command: what they become, what is told, and which reader a file gets."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from movimentum.errors import ScriptError
from movimentum.interop.formula_script import formula_script
from movimentum.interop.formulas import evaluate, read_formulas
from movimentum.interop.recognised import FileKind, kind_of
from movimentum.source import SourceText
from movimentum.workflow.stages import understand
from tests.command import ROOT, movimentum

FOUR_BAR = "PLAP[P0, L0, a0](P1); PLLP[P1, L1, L2, P2](P3); PLAP[P1, L3, a1, P3](P4)\n"
KNOWN = "P0 = [0, 0]; P2 = [90, 0]; L0 = 35; L1 = 70; L2 = 70; L3 = 40; a1 = 45\n"
LINKAGE = "v\n0 0\n10 0\ne\n0 1\n"
MECHANISM = "M[J[R, P[0, 0], L[ground, a]], J[R, P[9, 0], L[a]]]\n"


def script_of(text: str) -> str:
    return formula_script(read_formulas(SourceText("f.pyslvs", text)), "f.pyslvs")[0]


def table(script: Path) -> dict[str, list[float]]:
    """The columns of a script's poses, as the command writes them."""
    done = movimentum("solve", script, "-o", "-")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def test_an_angle_that_nothing_gives_turns_once_round(tmp_path: Path) -> None:
    (tmp_path / "f.pyslvs").write_text(FOUR_BAR + KNOWN)
    assert movimentum("import", tmp_path / "f.pyslvs", "-o", tmp_path / "f.mov").returncode == 0
    found = table(tmp_path / "f.mov")
    angles = 60.0 * np.array(found["time"])
    assert angles[-1] == 360.0
    truth = evaluate(read_formulas(SourceText("f.pyslvs", FOUR_BAR + KNOWN)), {"a0": angles})
    for column, point in (("P0_P1.P1", "P1"), ("P2_P3.P3", "P3"), ("P1_P3.P4", "P4")):
        for axis in (0, 1):
            assert found[f"{column}.{'xy'[axis]}"] == pytest.approx(truth[point][:, axis].tolist(), abs=1e-10)


def test_it_begins_where_there_is_a_point() -> None:
    text = "PLA[A, 10, a](B); PLLP[B, 12, 3, C](D); A = [0, 0]; C = [-12, 0]\n"
    with pytest.raises(ScriptError):
        evaluate(read_formulas(SourceText("f", text)), {"a": 0.0})
    script = script_of(text)
    start = float(script.split("a = ")[1].split(" ")[0])
    assert start > 0
    evaluate(read_formulas(SourceText("f", text)), {"a": start})


def test_names_that_the_language_has_other_uses_for() -> None:
    text = (
        "PLA[x, é, angle](l); PLA[l, 5, 0](_t); x = [0, 0]; é = 5\nangle = [0, 1]\nPPP[x, l, _t](red); red = [1, 1]\n"
    )
    scene = understand(SourceText("f.mov", script_of(text)))
    names = {anchor.name for thing in scene.things for anchor in thing.anchors}
    assert names == {"x_", "l_", "P_t", "red_"}


def test_a_drive_that_holds_and_runs_is_pieces_and_a_long_one_is_steps() -> None:
    courses = [[0.0] * 5 + [float(k) for k in range(6)] + [5.0] * 4, [float(k * k % 97) for k in range(400)]]
    for course, most in ((courses[0], 3), (courses[1], 400)):
        text = f"PLA[A, 10, a](B); A = [0, 0]\na = {course}\nfps = 10\n"
        script = script_of(text)
        assert script.count(" : ") - 2 <= most + len(course) // 100 + 1
        scene = understand(SourceText("f.mov", script))
        assert len(scene.steps) >= 2 + (len(course) - 2) // 400


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (FOUR_BAR, "formula/unknown", "the length `L0`"),
        (FOUR_BAR + KNOWN.replace("P2 = [90, 0];", ""), "formula/unknown", "the point `P2`"),
        (
            FOUR_BAR + KNOWN.replace("L2 = 70", "L2 = 1e-3").replace("L1 = 70", "L1 = 2"),
            "formula/unreachable",
            "do not meet",
        ),
        (FOUR_BAR + KNOWN + "a0 = [1, 2]\nb = 3\nPLA[P0, b, c](P9); c = [1, 2, 3]", "formula/counts", "has 2 values"),
        (FOUR_BAR + KNOWN + "a0 = []", "formula/counts", "no value"),
        ("a0 = 30\nL0 = 3\n", "formula/empty", "no formula"),
        (FOUR_BAR + KNOWN + "L3 = 5", "formula/twice", "`L3`"),
        ("PLOP[P0, L0](P1)", "formula/function", "PLOP"),
        ("PLA[P0, L0", "formula/syntax", "not a formula"),
        ("", "import/unknown", "empty"),
        ("# a comment\n#[ and\nanother #]\n", "import/unknown", "nothing in"),
        ("{'json': 1}", "import/unknown", "neither"),
        ("// Movimentum\n@0\n", "import/unknown", "neither"),
        ("1 2\n3 4\n", "import/unknown", "neither"),
    ],
)
def test_what_is_wrong_is_told_by_the_command(text: str, code: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "odd.txt").write_text(text)
    done = movimentum("import", "odd.txt", "-o", "odd.mov", cwd=tmp_path)
    assert done.returncode == 1
    assert f"error[{code}]" in done.stderr
    assert words in done.stderr
    assert not (tmp_path / "odd.mov").exists()


def test_a_later_frame_without_a_point_is_a_warning(tmp_path: Path) -> None:
    known = KNOWN.replace("L2 = 70", "L2 = 40") + "a0 = [0, 90, 180]\n"
    (tmp_path / "f.pyslvs").write_text(FOUR_BAR + known)
    done = movimentum("import", "f.pyslvs", "-o", "f.mov", cwd=tmp_path)
    assert done.returncode == 0
    assert "warning[formula/unreachable]" in done.stderr
    assert "at input 2 of 3" in done.stderr
    assert movimentum("import", "f.pyslvs", "--strict", "-o", "g.mov", cwd=tmp_path).returncode == 1
    assert not (tmp_path / "g.mov").exists()


@pytest.mark.parametrize("option", [["--snap"], ["--drive", "0,1"]])
def test_options_of_other_formats_are_refused(option: list[str], tmp_path: Path) -> None:
    (tmp_path / "f.txt").write_text(FOUR_BAR + KNOWN)
    done = movimentum("import", "f.txt", *option, "-o", "-", cwd=tmp_path)
    assert (done.returncode, "usage/import" in done.stderr) == (2, True)


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("comment", ["", "# M[ v\n", "#[ PLA[A](B)\n v #]\n", "\n \n"])
@pytest.mark.parametrize(
    ("text", "kind"),
    [
        (LINKAGE, FileKind.LINKAGE),
        ("vertices = 2\n0 0\n10 0\nedges [1]\n0 1\n", FileKind.LINKAGE),
        ("fixed\n0\nv\n1 1\n", FileKind.LINKAGE),
        (MECHANISM, FileKind.MECHANISM),
        (MECHANISM.replace("M[", "M [ "), FileKind.MECHANISM),
        (FOUR_BAR + KNOWN, FileKind.FORMULAS),
        (KNOWN + FOUR_BAR, FileKind.FORMULAS),
        ("a0 = 5; A = (1, 2)\npla[A, 3, a0](B)\n", FileKind.FORMULAS),
    ],
)
def test_the_content_tells_the_reader(
    text: str, kind: FileKind, comment: str, end: str, mark: str, tmp_path: Path
) -> None:
    path = tmp_path / "any.name"
    path.write_bytes((mark + (comment + text).replace("\n", end)).encode())
    from movimentum.workflow.read import read

    assert kind_of(read(str(path))) is kind


@pytest.mark.parametrize("form", ["pyslvs", "linkages"])
def test_what_the_command_exports_it_imports(form: str, tmp_path: Path) -> None:
    script = ROOT / "scripts" / ("four-bar.mov" if form == "pyslvs" else "peaucellier-linkage.mov")
    for start, target in ((script, "one.txt"), ("one.mov", "two.txt")):
        assert movimentum("export", start, "--format", form, "-o", target, cwd=tmp_path).returncode == 0
        made = target.replace("txt", "mov")
        assert movimentum("import", target, "-o", made, cwd=tmp_path).returncode == 0
    one, two = table(tmp_path / "one.mov"), table(tmp_path / "two.mov")
    assert sorted(len(column) for column in one.values()) == sorted(len(column) for column in two.values())

    def places(found: dict[str, list[float]]) -> set[tuple[float, ...]]:
        return {tuple(round(x, 7) + 0.0 for x in found[name]) for name in found if name.endswith((".x", ".y"))}

    assert places(one) == places(two)
