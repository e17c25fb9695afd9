"""Start-up: every command imports only what it needs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.command import CRANK, environment

PROBE = """
import sys
from movimentum.cli import run_command_line
code = run_command_line(sys.argv[1:])
print("modules:", " ".join(sorted({name.partition(".")[0] for name in sys.modules})))
print("details:", " ".join(sorted(sys.modules)))
sys.exit(code)
"""

HEAVY = {"lark", "numpy", "PIL", "sympy", "scipy", "rich", "av", "multiprocessing", "mpmath"}


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
    done = subprocess.run(
        [sys.executable, "-c", PROBE, *arguments],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment(),
        timeout=120,
        check=False,
    )
    line = next(line for line in done.stdout.splitlines() if line.startswith("modules:"))
    assert set(line.split()) & HEAVY <= allowed, done.stderr
