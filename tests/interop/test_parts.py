"""Parts as drawings, solids and lists; scripts from drawings."""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest

from movimentum.cli.app import run_command_line
from tests.broad import broad

ezdxf = pytest.importorskip("ezdxf")

SCRIPT = """Crank : .bar A = [0,0] B = [40,0] .width(10);
Plate : .plate P = [0,0] Q = [100,0] R = [50,60] .pins(4);
Wheel : .disc(30) C = [0,0];
Poly  : .polygon A = [0,0] M = [20,0] B = [40,0] C = [40,30] D = [0,30];
Ring  : .polygon A = [0,0] B = [10,0] C = [10,10] D = [5,3];
Gear  : .gear(20, 3) C = [0,0];
Twin  : .bar A = [5,5] B = [45,5] .width(10);
Seen  : .label('x') at = [0,0];
@0 Crank.A = [50,50]; Crank.angle = 90*.t + 17; Plate.P = Crank.B; Plate.angle = 10; Wheel.C = [200,50];
   Wheel.angle = 0; Poly.A = [10,10]; Poly.angle = 3; Ring.A = [0,0]; Ring.angle = 0; Gear.C = [300,300];
   Gear.angle = 11; Twin.A = [9,9]; Twin.angle = 0;
@2
"""


def run(folder: Path, *words: str) -> int:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return run_command_line(list(words))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "m.mov").write_text(SCRIPT, encoding="utf-8")
    return tmp_path


def capsule(length: float, width: float) -> float:
    return length * width + math.pi * width**2 / 4.0


AREAS = {
    "Crank": capsule(40.0, 10.0) - 2 * math.pi * 1.5**2,
    "Twin": capsule(40.0, 10.0) - 2 * math.pi * 1.5**2,
    "Plate": 3000.0 + 10.0 * (100.0 + 2.0 * math.hypot(50.0, 60.0)) + 100.0 * math.pi - 3 * 16.0 * math.pi,
    "Wheel": math.pi * (900.0 - 9.0),
    "Poly": 1200.0,
    "Ring": 40.0,
}
"""Closed forms."""


def solids(path: Path) -> dict[str, list[list[tuple[float, ...]]]]:
    found: dict[str, list[list[tuple[float, ...]]]] = {}
    for name, body in re.findall(r"solid (\S+)\n(.*?)endsolid", path.read_text(), re.DOTALL):
        corners = [tuple(map(float, line.split()[1:])) for line in body.splitlines() if line.startswith("vertex")]
        found[name] = [corners[k : k + 3] for k in range(0, len(corners), 3)]
    return found


@broad("target", ["all.stl", "part-%s.stl"], first=1)
def test_solids_are_closed_and_have_their_volume(folder: Path, target: str) -> None:
    assert run(folder, "export", "m.mov", "-o", target, "--thickness", "3", "-q") == 0
    found = {name: triangles for path in folder.glob("*.stl") for name, triangles in solids(path).items()}
    assert set(found) == {*AREAS, "Gear"}
    for name, triangles in found.items():
        edges = Counter(edge for t in triangles for edge in pairwise([*t, t[0]]))
        assert all(count == 1 and edges[b, a] == 1 for (a, b), count in edges.items()), name
        volume = sum(
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
            for a, b, c in triangles
        )
        assert volume > 0.0
        if name in AREAS:
            assert volume / 6.0 == pytest.approx(3.0 * AREAS[name], rel=1e-9)


def test_a_drawing_passes_the_audit_and_has_the_pose_of_its_time(folder: Path) -> None:
    assert run(folder, "export", "m.mov", "-o", "m.dxf", "--at", "1", "-q") == 0
    document = ezdxf.readfile(folder / "m.dxf")
    assert not document.audit().errors
    assert document.header["$INSUNITS"] == 4
    space = document.modelspace()
    (outline,) = space.query('LWPOLYLINE[layer=="Crank"]')
    assert sum(abs(point[2]) > 0.0 for point in outline.get_points("xyb")) == 2
    holes = [circle.dxf.center for circle in space.query('CIRCLE[layer=="Crank"]')]
    turn = math.radians(107.0)
    expected = {(50.0, 50.0), (round(50 + 40 * math.cos(turn), 9), round(50 + 40 * math.sin(turn), 9))}
    assert {(round(hole.x, 9), round(hole.y, 9)) for hole in holes} == expected
    before = (folder / "m.dxf").read_bytes()
    assert run(folder, "export", "m.mov", "-o", "m.dxf", "--at", "1", "-q") == 0
    assert (folder / "m.dxf").read_bytes() == before


@pytest.mark.slow
def test_what_was_drawn_is_read_back(folder: Path) -> None:
    assert run(folder, "export", "m.mov", "-o", "m.dxf", "-q") == 0
    assert run(folder, "import", "m.dxf", "-o", "back.mov", "-q") == 0
    text = (folder / "back.mov").read_text(encoding="utf-8")
    assert re.search(r"Crank : \.bar +P1 = \[50, 50\] .* \.width\(10\);", text)
    assert re.search(r"Plate : \.plate .* \.width\(20\);", text)
    assert "Wheel : .disc(30)  C = [200, 50];" in text
    assert "Crank.P2 = Plate.P1;" in text
    assert run(folder, "check", "back.mov", "-q") == 0


def test_lines_of_layers_become_bars_that_are_joined(folder: Path) -> None:
    document = ezdxf.new()
    space = document.modelspace()
    space.add_line((0, 0), (100.00000000000001, 0), dxfattribs={"layer": "ground"})
    space.add_line((0, 0), (30, 40), dxfattribs={"layer": "crank"})
    space.add_lwpolyline([(30, 40), (100, 90), (130, 90)], dxfattribs={"layer": "rod 1"})
    space.add_text("a note")
    document.saveas(folder / "other.dxf")
    assert run(folder, "import", "other.dxf", "-o", "other.mov", "-q") == 0
    lines = (folder / "other.mov").read_text(encoding="utf-8").splitlines()
    assert "ground : .bar  P1 = [0, 0]  P2 = [100, 0];" in lines
    assert "rod_1 : .bar  P1 = [30, 40]  P2 = [100, 90]  P3 = [130, 90];" in lines
    assert {line.strip() for line in lines} >= {
        "ground.P1 = crank.P1;", "crank.P2 = rod_1.P1;", "ground.P1 = [0, 0];", "ground.angle = 0;"
    }  # fmt: skip
    assert run(folder, "check", "other.mov", "-q") == 0


def test_half_a_file_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "half.dxf").write_text("  0\nSECTION\n  2\nENTITIES\n  0\nLINE\n 10\nabc\n", encoding="utf-8")
    assert run(folder, "import", "half.dxf", "-o", "half.mov", "-q") == 1
    assert "import/dxf" in capsys.readouterr().err
    assert not (folder / "half.mov").exists()


def test_a_hole_in_a_polygon_is_an_anchor(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    space = (document := ezdxf.new()).modelspace()
    slider = [(0, 0), (44, 0), (44, 26), (0, 26)]
    space.add_lwpolyline(slider, close=True, dxfattribs={"layer": "slider"})
    for radius in (2, 3):  # a hole and its rim
        space.add_circle((22, 13), radius, dxfattribs={"layer": "slider"})
    space.add_line((22, 13), (90, 13), dxfattribs={"layer": "rod"})
    document.saveas(folder / "s.dxf")
    assert run(folder, "import", "s.dxf", "-o", "s.mov", "-q", "--strict") == 0
    text = (folder / "s.mov").read_text(encoding="utf-8")
    assert "slider : .polygon  P1 = [0, 0]" in text
    assert "P5 = [22, 13] .through(P1, P2, P3, P4);" in text
    assert "slider.P5 = rod.P1;" in text
    assert run(folder, "check", "s.mov", "-q") == 0


@pytest.mark.parametrize(
    ("corners", "lost"),
    [
        ([(0, 0), (80, 0), (80, 50), (0, 50)], "its circles, but not its outline"),
        ([(0, 0), (80, 0), (80, 50), (60, 50), (60, 20), (0, 20)], "its circles, but not its outline"),
    ],
)
def test_an_outline_about_circles_that_no_plate_has_is_told(
    folder: Path, corners: list[tuple[float, float]], lost: str, capsys: pytest.CaptureFixture[str]
) -> None:
    space = (document := ezdxf.new()).modelspace()
    space.add_lwpolyline(corners, close=True)
    for place in ((10, 10), (70, 10), (70, 40)):
        space.add_circle(place, 3)
    document.saveas(folder / "p.dxf")
    assert run(folder, "import", "p.dxf", "-o", "p.mov") == 0
    said = capsys.readouterr().err
    assert "warning[import/left-out]" in said
    assert lost in said
    assert run(folder, "import", "p.dxf", "-o", "q.mov", "--strict") == 1
    assert not (folder / "q.mov").exists()


def test_arcs_of_a_polygon_are_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    space = (document := ezdxf.new()).modelspace()
    space.add_lwpolyline([(0, 0, 0), (80, 0, 0.5), (80, 50, 0)], format="xyb", close=True)
    document.saveas(folder / "p.dxf")
    assert run(folder, "import", "p.dxf", "-o", "p.mov") == 0
    assert "its arcs are straight lines" in capsys.readouterr().err


def test_what_was_exported_is_read_back_without_a_warning(folder: Path) -> None:
    for name in ("four-bar", "klann", "peaucellier"):
        script = Path(__file__).parents[2] / "scripts" / f"{name}.mov"
        assert run(folder, "export", str(script), "-o", "m.dxf", "-q") == 0
        assert run(folder, "import", "m.dxf", "-o", f"{name}.mov", "-q", "--strict") == 0


def test_the_shape_of_a_bent_bar_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = ".bar P = [0,0] Q = [50,0] R = [50,30]; @0 A.P = [9,9]; A.angle = 0;"
    (folder / "bent.mov").write_text(f"A : {script}", encoding="utf-8")
    for target in (["a.dxf"], ["a.stl", "--thickness", "2"], ["a-%s.stl", "--thickness", "2"]):
        assert run(folder, "export", "bent.mov", "-o", *target) == 0
        assert "`A` has a bend" in capsys.readouterr().err


@pytest.mark.parametrize(("page", "encoding"), [("ANSI_1252", "cp1252"), ("ANSI_936", "gbk"), ("ANSI_1251", "cp1251")])
def test_an_old_drawing_is_read_in_its_code_page(folder: Path, page: str, encoding: str) -> None:
    name = {"cp1252": "Träger", "gbk": "曲柄", "cp1251": "рычаг"}[encoding]
    document = ezdxf.new("R2000")
    document.header["$DWGCODEPAGE"] = page
    document.modelspace().add_line((0, 0), (30, 40), dxfattribs={"layer": name})
    document.encoding = encoding
    document.saveas(folder / "old.dxf")
    with pytest.raises(UnicodeDecodeError):
        (folder / "old.dxf").read_text(encoding="utf-8")
    assert run(folder, "import", "old.dxf", "-o", "old.mov", "-q") == 0
    assert ".bar  P1 = [0, 0]  P2 = [30, 40];" in (folder / "old.mov").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("data", "words"), [(b"AutoCAD Binary DXF\r\n\x1a\0\xff", "binary DXF"), (b"AC1032\0\0\xff", "DWG")]
)
def test_drawings_that_are_no_text_are_told(
    folder: Path, data: bytes, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "b.dxf").write_bytes(data)
    assert run(folder, "import", "b.dxf", "-o", "b.mov") == 1
    said = capsys.readouterr().err
    assert "import/dxf" in said
    assert words in said


def test_a_list_of_parts_counts_equal_ones(folder: Path) -> None:
    assert run(folder, "export", "m.mov", "-o", "parts.csv", "-q") == 0
    with (folder / "parts.csv").open(encoding="utf-8") as stream:
        rows = {row["name"]: row for row in csv.DictReader(stream)}
    assert rows["Crank"]["count"] == rows["Twin"]["count"] == "2"
    assert rows["Plate"]["lengths"] == "P-Q 100; P-R 78.1024967591; Q-R 78.1024967591"
    assert rows["Wheel"]["size"] == "30"


def test_parts_are_equal_whatever_their_anchors_are_called_and_only_then(folder: Path) -> None:
    script = """A : .plate A = [0,0] B = [30,0] C = [10,20];
    B : .plate P = [10,20] Q = [0,0] R = [30,0];
    Flipped : .plate P = [10,-20] Q = [0,0] R = [30,0];
    Other : .plate P = [10,21] Q = [0,0] R = [30,0];
    Small : .gear(12, 3) C = [0,0];
    Large : .gear(24, 3) C = [0,0];
    Says : .label('x') at = [0,0];
    @0 A.A = [0,0]; A.angle = 0;"""
    (folder / "equal.mov").write_text(script, encoding="utf-8")
    assert run(folder, "export", "equal.mov", "-o", "equal.csv", "-q") == 0
    with (folder / "equal.csv").open(encoding="utf-8") as stream:
        counts = {row["name"]: int(row["count"]) for row in csv.DictReader(stream)}
    assert counts == {"A": 3, "B": 3, "Flipped": 3, "Other": 1, "Small": 1, "Large": 1}


@pytest.mark.slow
def test_a_hole_as_wide_as_its_part_is_left_out_and_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(folder, "export", "m.mov", "-o", "m.stl", "--thickness", "3", "--hole", "10") == 0
    said = capsys.readouterr().err
    assert said.count("holes of 10 are left out") == 2  # Crank and Twin; the plate is 20 wide
    assert "help: --hole 5" in said
    (crank, plate) = (solids(folder / "m.stl")[name] for name in ("Crank", "Plate"))
    assert len(crank) < len(plate)
    assert run(folder, "export", "m.mov", "-o", "m.stl", "--thickness", "3", "--hole", "9.9", "--strict", "-q") == 0


@pytest.mark.parametrize(
    "words", [("--hole", "nan"), ("--hole", "inf"), ("--thickness", "nan"), ("--thickness", "inf")]
)
def test_numbers_without_an_end_are_refused(
    folder: Path, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(folder, "export", "m.mov", "-o", "x.stl", "--thickness", "3", *words) == 2
    assert "is not a finite number" in capsys.readouterr().err
    for scale in ("nan", "inf"):
        assert run(folder, "run", "m.mov", "--for", "web", "--scale", scale) == 2


@pytest.mark.parametrize("words", [("-o", "x.stl"), ("-o", "x.dxf", "--thickness", "3"), ("-o", "x.csv", "--at", "1")])
def test_wrong_options_are_told(folder: Path, words: tuple[str, ...]) -> None:
    assert run(folder, "export", "m.mov", *words, "-q") == 2
    assert not list(folder.glob("x.*"))


@pytest.mark.parametrize("name", ["klann", "jansen", "hart", "peaucellier"])
def test_an_exported_linkage_is_the_same_after_an_import(tmp_path: Path, name: str) -> None:
    script = Path(__file__).parents[2] / "scripts" / f"{name}.mov"
    assert run(tmp_path, "export", str(script), "-o", "one.txt", "-q") == 0
    assert run(tmp_path, "import", "one.txt", "-o", "one.mov", "-q") == 0
    assert run(tmp_path, "export", "one.mov", "-o", "two.txt", "-q") == 0
    assert (tmp_path / "one.txt").read_text() == (tmp_path / "two.txt").read_text()
