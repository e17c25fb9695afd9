"""Start-up: every command imports only what it needs."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from movimentum.cli.app import MODULES
from tests.command import CRANK, ROOT, environment

PROBE = """
import sys
from movimentum.cli.app import run_command_line
code = run_command_line(sys.argv[1:])
print("modules:", " ".join(sorted({name.partition(".")[0] for name in sys.modules})))
print("details:", " ".join(sorted(sys.modules)))
sys.exit(code)
"""


def python(folder: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A Python of its own runs ``code``."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        cwd=folder,
        env=environment(),
        timeout=120,
        check=False,
    )


HEAVY = {"lark", "numpy", "PIL", "sympy", "scipy", "av", "multiprocessing", "mpmath"}


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [
        (["--version"], set()),
        (["run", "--help"], set()),
        (["run", "missing.mov"], set()),
        (["check", "broken.mov"], {"lark"}),
        (["check", "crank.mov"], {"lark", "numpy"}),
        (["solve", "crank.mov", "-o", "poses.csv"], {"lark", "numpy"}),
        (["run", "crank.mov", "-o", "crank.gif"], {"lark", "numpy", "PIL"}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_a_command_imports(tmp_path: Path, arguments: list[str], allowed: set[str]) -> None:
    (tmp_path / "crank.mov").write_text(CRANK)
    (tmp_path / "broken.mov").write_text("@0 Rod.A = ;")
    done = python(tmp_path, PROBE, *arguments)
    line = next(line for line in done.stdout.splitlines() if line.startswith("modules:"))
    assert set(line.split()) & HEAVY <= allowed, done.stderr


@pytest.mark.parametrize("command", [["check"], ["run", "-o", "crank.gif"], ["solve", "-o", "poses.csv"]])
def test_what_takes_longer_to_load_than_a_small_scene_to_solve(tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "crank.mov").write_text(CRANK)
    done = python(tmp_path, PROBE, command[0], "crank.mov", *command[1:])
    line = next(line for line in done.stdout.splitlines() if line.startswith("details:"))
    assert not set(line.split()) & {"numpy.ma", "movimentum.analysis.diagnose.failure"}, done.stderr


RARELY_NEEDED = {
    "analysis.diagnose.differential",
    "analysis.freedom.motions",
    "api.pictures",
    "outlines.contour",
    "planning.lowering.pushes",
    "planning.structure.linear_rows",
    "scene.text_edits",
    "scene.wholes",
    "solver.block.newton",
    "solver.continuation.coincidences",
    "solver.start.leading",
    "timeline.joints",
}
"""What a linkage of dyads, which is fully driven and right, has no use for: gears, contact, freedom, Newton's method,
what helps with errors.
"""


def test_a_first_solve_imports_what_its_scene_has() -> None:
    solve = "import sys, movimentum; movimentum.load('scripts/four-bar.mov').solve(); print(*sys.modules)"
    done = python(ROOT, solve)
    assert done.returncode == 0, done.stderr
    own = {name.removeprefix("movimentum.") for name in done.stdout.split() if name.startswith("movimentum.")}
    assert "solver.solver" in own
    assert not own & RARELY_NEEDED


@pytest.mark.parametrize(
    ("arguments", "module"),
    [(["--version"], None), (["check", "missing.mov"], "check"), (["golden", "check", "missing.mov"], "golden")],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_only_the_command_that_is_called_is_imported(tmp_path: Path, arguments: list[str], module: str | None) -> None:
    done = python(tmp_path, PROBE, *arguments)
    line = next(line for line in done.stdout.splitlines() if line.startswith("details:"))
    commands = {home.partition(":")[0] for home in MODULES.values()}
    assert {name for name in commands if f"movimentum.cli.{name}" in line.split()} == ({module} - {None}), done.stderr


def test_nothing_is_imported_before_an_interrupt_is_dealt_with() -> None:
    program = "import sys; before = set(sys.modules); import movimentum.__main__; print(set(sys.modules) - before)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=environment(), timeout=60, check=True
    )
    assert ast.literal_eval(done.stdout) <= {"__future__", "movimentum", "movimentum.__main__"}


def test_every_library_that_the_package_imports_is_declared() -> None:
    imported: set[str] = set()
    for file in (ROOT / "movimentum").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                imported.add(node.module.partition(".")[0])
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    optional = project["optional-dependencies"]
    studio = [line for line in optional["studio"] if not line.startswith("websockets")]  # uvicorn imports that
    declared = [
        *project["dependencies"],
        *optional["video"],
        *optional["highlight"],
        *optional["lsp"],
        *optional["notebook"],
        *optional["prove"],
        *studio,
    ]
    names = {re.split(r"[^\w-]", line)[0].replace("-", "_") for line in declared}
    names = {{"pillow": "PIL", "python_flint": "flint"}.get(name, name) for name in names}
    # pytest loads the golden plugin, and nothing else does; anywidget brings traitlets
    assert imported - set(sys.stdlib_module_names) - {"movimentum", "pytest", "traitlets"} == names
