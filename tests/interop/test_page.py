"""What docs/formats.md shows is what the commands write."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from movimentum.interop.recognised import SHAPES
from tests.command import ROOT, movimentum

PAGE = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```[\w ]*\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def block(beginning: str) -> str:
    (found,) = [text for text in BLOCKS if text.startswith(beginning)]
    return found


@pytest.mark.parametrize(
    ("name", "beginning", "options", "shown"),
    [
        ("rhombus.txt", "vertices", [], "// rhombus.txt"),
        ("slider.pyslvs", "M[", ["--drive", "0,1"], "// slider.pyslvs"),
        ("crank.pyslvs", "PLAP[P0", [], "// crank.pyslvs"),
    ],
)
def test_imported_scripts(tmp_path: Path, name: str, beginning: str, options: list[str], shown: str) -> None:
    path = tmp_path / name
    path.write_text(block(beginning), encoding="utf-8")
    done = movimentum("import", path, *options, "-o", "-")
    assert done.returncode == 0, done.stderr
    assert done.stdout == block(shown)


def test_what_snapping_and_sliders_come_to(tmp_path: Path) -> None:
    path = tmp_path / "rhombus.txt"
    path.write_text(block("vertices"), encoding="utf-8")
    written = movimentum("import", path, "--snap", "-o", "-").stdout.splitlines()
    assert set(block("R0_1").splitlines()) - {"…"} <= set(written)
    path = tmp_path / "slider.pyslvs"
    path.write_text(block("M["), encoding="utf-8")
    written = movimentum("import", path, "--drive", "2,2", "-o", "-").stdout.splitlines()
    assert set(block("@0\nrod.P2").splitlines()) <= set(written)


def test_exported_formulas_and_what_a_linkage_cannot_say() -> None:
    script = "scripts/four-bar.mov"
    written = movimentum("export", script, "--format", "pyslvs", "-o", "-", cwd=ROOT).stdout.splitlines()
    for line, shown in zip(written, block("# four-bar").splitlines(), strict=True):
        assert line.startswith(shown.removesuffix("…]"))
    done = movimentum("export", script, "-o", "-", cwd=ROOT)
    assert block("warning[export/left-out]").strip() == done.stderr.strip()


def test_the_example_in_python_prints_what_it_shows() -> None:
    code = block("import numpy")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout in BLOCKS


def test_every_function_and_every_code_is_told() -> None:
    assert set(re.findall(r"^\| `(P[A-Z]+)\[", PAGE, re.MULTILINE)) == set(SHAPES)
    used = {
        code
        for path in (ROOT / "movimentum" / "interop").glob("*.py")
        for code in re.findall(
            r'"((?:import|export|mechanism|formula|pmks|linkage2)/[a-z-]+)"', path.read_text(encoding="utf-8")
        )
    }
    assert used == set(re.findall(r"[`\[]((?:import|export|mechanism|formula|pmks|linkage2)/[a-z-]+)[`\]]", PAGE)) | {
        "formula/unreachable"
    }
