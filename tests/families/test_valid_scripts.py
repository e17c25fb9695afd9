"""Scripts that mean something, numbers at the ends of floats included: each is solved or told what is wrong with it,
with at most a gigabyte and twenty seconds.
"""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from movimentum.cli.app import run_command_line
from movimentum.errors import MovimentumError
from movimentum.source import SourceText
from movimentum.workflow.stages import understand
from tests.broad import broad
from tests.families.forked import tried_input, warm
from tests.families.valid_scripts import script

forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that cost nothing")


def is_understood(text: str) -> bool:
    try:
        understand(SourceText("<family>", text))
    except MovimentumError:
        return False
    return True


def test_most_of_them_pass_syntax_and_names() -> None:
    assert sum(is_understood(script(random.Random(f"share {seed}"))) for seed in range(100)) >= 80


@forks
@pytest.mark.slow
@pytest.mark.parametrize("block", range(4))
def test_many(tmp_path: Path, block: int) -> None:
    warm(tmp_path)
    for seed in range(20_000 + 30 * block, 20_030 + 30 * block):
        found = tried_input("valid", seed, tmp_path)
        assert not found.faults, (seed, found.faults, found.codes, found.said[-3000:])


@forks
@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("block", range(10))
def test_very_many(tmp_path: Path, block: int) -> None:
    warm(tmp_path)
    for seed in range(30_000 + 500 * block, 30_500 + 500 * block):
        found = tried_input("valid", seed, tmp_path)
        assert not found.faults, (seed, found.faults, found.codes, found.said[-3000:])


BARS = ".config(4, 60, 40);\nA:.bar P=[0,0] Q=[30,0]; B:.bar P=[0,9] Q=[30,9];\n"
PART = ".config(4, 60, 40);\n.part Leg(a = {0}) {{ A:.bar P=[0,0] Q=[a,0]; @0 A.P=[{0},0]; x = 2*A.Q.x + {0}; }}\n"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (PART + "L : Leg(3) .at([{0},0]) .turned({0}); @0 L.A.angle = 9*.t; @1", 1),
        (PART + "M : Leg(4) .mirrored .at([{0},{0}]); @1", 1),
        (BARS + "@0 A.P=[{0}*.t,0]; A.angle=90*.t; @{0}", 1),
        (".config(4);\nA:.polygon P=[{0},0] Q=[-{0},{0}] R=[0,{0}]; @0 A.angle=90*.t; @1", 1),
    ],
)
@pytest.mark.parametrize("number", ["1e308", "1e399", "1.7e308"])
def test_numbers_that_floats_hardly_hold_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, code: int, number: str
) -> None:
    (tmp_path / "a.mov").write_text(text.format(number))
    assert run_command_line(["check", str(tmp_path / "a.mov"), "--max-frames", "300"]) == code
    assert "error[" in capsys.readouterr().out


@broad(
    ("statements", "codes"),
    [
        ("@0 A.P=[.t,0]; @+1e-300 A.P=[.s,0]; @+1e-300 A.P=[1,0] -> [3,.s]; @+1e-290", (0, 3)),
        pytest.param("@0 A.P=[0,0]; A.Q=B.P; B.Q=[100*.exp(20*.t),60]; @1", (3,), marks=pytest.mark.slow),  # singular
        ("@0 x = .mod(1, y); y = 0; A.P=[x,0]; @1", (0, 1, 3)),
        ("@0 A.P=[0,0]; A.Q=B.P; B.Q=[-3e11,x]; @1", (1, 3)),
        ("L:.label('{.along(A.P, B.P, B.Q):.1f}') at=[1,1]; @0 A.P=[0,0]; @1", (0,)),
    ],
    every=3,
)
def test_what_once_was_a_bug(tmp_path: Path, statements: str, codes: tuple[int, ...]) -> None:
    (tmp_path / "a.mov").write_text(BARS + statements)
    assert run_command_line(["check", str(tmp_path / "a.mov"), "--max-frames", "300"]) in codes
