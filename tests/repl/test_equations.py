"""`plan --equations` and the lengths of rigid things: what is printed holds where the solver says things are."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import sympy

from movimentum.analysis.interactive.determination import block_equations, symbol_name
from movimentum.errors import MovimentumError
from movimentum.repl.session import opened
from movimentum.repl.shell import answer
from movimentum.workflow.choices import Choices
from tests.broad import broad

SCRIPTS = Path(__file__).parents[2] / "scripts"
FAR = """A : .bar P = [1e8, 50] Q = [1.00000003e8, 90];  B : .bar P = [0,0] Q = [70,0];
@0 A.P = [1e8, 50]; A.angle = 40*.t; B.P = A.Q; B.Q.y = 50; B.Q.x > A.Q.x;
@1
"""


@broad("name", ["four-bar", "slider-crank", "hart", "watt", "whitworth", "oscillating-engine", "far"], every=3)
def test_equations_and_solutions_hold_where_things_are(name: str, tmp_path: Path) -> None:
    path = SCRIPTS / f"{name}.mov"
    if name == "far":
        path = tmp_path / "far.mov"
        path.write_text(FAR)
    session = answer(opened(str(path), Choices()), "at 0.37")[0]
    segment_motion, (piece, tau) = session.segment_motion, session.piece
    system = segment_motion.plan.system
    state, _ = piece.evaluate(piece.instants([tau]))
    values = {sympy.Symbol("t", real=True): tau}
    assert len({symbol_name(system, unknown.number) for unknown in system.unknowns}) == len(system.unknowns)
    for unknown in system.unknowns:
        value = state[unknown.number]
        if value is not None:
            shift = {"x": system.shift[0], "y": system.shift[1]}.get(unknown.name.rpartition(".")[2], 0.0)
            moved = shift if unknown.thing is not None else 0.0
            values[sympy.Symbol(symbol_name(system, unknown.number), real=True)] = float(np.ravel(value)[0]) + moved
    size = segment_motion.plan.size + max(map(abs, system.shift))
    checked = 0
    for found in block_equations(segment_motion, piece, tau):
        for _, zero in found.equations:
            if zero is not None:
                assert float(zero.subs(values)) == pytest.approx(0.0, abs=1e-9 * size)
                checked += 1
        for unknown, formula in found.solutions:
            if formula is not None:
                truth = values[sympy.Symbol(unknown, real=True)]
                assert float(formula.subs(values)) == pytest.approx(truth, rel=1e-9, abs=1e-9 * size)
    assert checked >= len(segment_motion.plan.blocks) // 2
    text = answer(session, "plan --equations")[1]
    assert "too long" not in text or name != "slider-crank"
    assert len(re.findall(r"^ +\d+\. ", text, re.MULTILINE)) == len(segment_motion.plan.blocks)


def test_rigid_things_are_listed_with_their_lengths() -> None:
    session = opened(str(SCRIPTS / "four-bar.mov"), Choices())
    text = answer(session, "constraints")[1]
    assert re.search(r"^\|Rocker\.D - Rocker\.C\| = 130 +5 +always +the end +\S+$", text, re.MULTILINE)
    assert "|Coupler.Z" not in text  # it is drawn where Coupler.B is
    assert answer(session, "constraints Crank")[1].count("|Crank.B - Crank.A| = 50") == 1
    assert "|Coupler.C - Coupler.B| = 150" in answer(session, "residuals")[1]


def test_another_word_is_refused() -> None:
    with pytest.raises(MovimentumError):
        answer(opened(str(SCRIPTS / "four-bar.mov"), Choices()), "plan equations")


@broad("tool", [".bar A = [150,150] B = [150,250] .width(12)", ".disc(10) A = [150,150]"], first=1)
def test_equations_of_a_contact_are_shown(tool: str, tmp_path: Path) -> None:
    path = tmp_path / "cam.mov"
    path.write_text(f"""Cam : .curve C = [150,100] .polar(th, 40 + 9*.cos(2*th));   Rod : {tool};
@0 Cam.C = [150,100]; Cam.angle = 90*.t; Rod.A.x = 150; Rod.angle = 0; Rod.A.y > 100; .gap(Rod, Cam) = 0;
   lean = .a(.tangent(Cam, .where(Rod.A, Cam)), [-1, 0]);
@1
""")
    shown = answer(opened(str(path), Choices()), "plan --equations")[1]
    assert "solve" in str(shown)
    assert "internal" not in str(shown)
