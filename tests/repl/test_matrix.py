"""`free --matrix`: the matrix by hand, by finite differences, and against rigidity matrices of our own."""

import random
import re

import numpy as np
import pytest

from movimentum.analysis.interactive.matrix import part_matrices
from movimentum.errors import MovimentumError
from movimentum.interop.linkages import linkage_script, read_linkage
from movimentum.repl.session import opened
from movimentum.repl.shell import answer
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from tests.families.frameworks import framework

HAND = """.config(20, 300, 300);
Rod : .bar A = [30,40] B = [130,40];
@0 Rod.A = [30,40];  Rod.B.y = 40 + y;
"""


def session_of(folder, text):
    path = folder / "scene.mov"
    path.write_text(text)
    return opened(str(path), Choices())


def say(session, line):
    return answer(session, line)[1]


def parts_of(session):
    return part_matrices(session.segment_motion, session.segment_motion.pieces[0], 0.0)


def test_a_matrix_by_hand(tmp_path):
    session = session_of(tmp_path, HAND)
    (part,) = parts_of(session)
    assert part.columns == ("Rod.x", "Rod.y", "Rod.cos", "Rod.sin", "y")
    size = session.segment_motion.plan.size
    # Rod.A.x = 30; Rod.A.y = 40; Rod.A.y + 100 sin - y = 40; cos^2 + sin^2 = 1, whose gradient here is (2, 0)
    raw = np.array([[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 1, 0, 100, -1], [0, 0, 2, 0, 0]], dtype=float)
    raw *= [size, size, 1, 1, size]
    truth = raw / np.linalg.norm(raw, axis=1, keepdims=True)
    signs = np.sign(np.sum(part.jacobian * truth, axis=1, keepdims=True))
    assert part.jacobian * signs == pytest.approx(truth, abs=1e-12)
    assert part.rank == 4
    assert part.singular == pytest.approx(np.linalg.svd(truth, compute_uv=False), abs=1e-12)
    assert part.null[:, 0] == pytest.approx(np.array([0, 0, 0, 1, 100 / size]) / max(1, 100 / size), abs=1e-9)
    text = say(session, "free --matrix")
    assert "Rod: 4 equations, 5 unknowns, rank 4: 1 free motion" in text
    rows = [re.split(r"\s{2,}", line)[0] for line in text.splitlines()[4:8]]
    assert rows == [
        "line 3: Rod.A = [30,40] .x",
        "line 3: Rod.A = [30,40] .y",
        "line 3: Rod.B.y = 40 + y",
        "Rod is rigid",
    ]


@pytest.mark.parametrize("seed", range(6))
def test_ranks_are_those_of_rigidity_matrices(seed, tmp_path):
    made = framework(seed)
    linkage, _ = read_linkage(SourceText("drawn.txt", made.text(random.Random(seed))))
    parts = parts_of(session_of(tmp_path, linkage_script(linkage, "drawn.txt")))
    # a rod that is free to be anywhere is said so by two variables, which are as free as it
    assert sum(part.null.shape[1] for part in parts) == made.freedom()
    for part in parts:
        assert part.rank + part.null.shape[1] == len(part.columns)
        assert np.abs(part.jacobian @ part.null).max(initial=0.0) < 1e-9
        assert part.singular == pytest.approx(np.linalg.svd(part.jacobian, compute_uv=False), abs=1e-12)
        assert len(part.rows) == len(part.jacobian)


ANGLES = """A : .bar P = [60,60] Q = [100,170];
B : .bar P = [60,60] Q = [140,200];
W : .disc(4) C = [200,200];
@0 A.P = [60,60]; B.P = A.P; B.angle = 2*A.angle; W.C = [x,y]; x + y = 400 + .i(u); u = 1; W.opacity = 0.5;
   v = .d(A.Q.x);  q + r = 3;
@1
"""


def test_angles_have_rows_and_integrals_rates_and_opacities_have_none(tmp_path):
    session = session_of(tmp_path, ANGLES)
    first, second, third = parts_of(session)
    assert first.columns == (
        *("A.x", "A.y", "A.cos", "A.sin", "A.angle"),
        *("B.x", "B.y", "B.cos", "B.sin", "B.angle"),
    )
    assert first.null.shape[1] == 1
    turn = dict(zip(first.columns, first.null[:, 0], strict=True))
    assert turn["B.angle"] == pytest.approx(2 * turn["A.angle"])
    assert second.columns == ("W.x", "W.y", "x", "y")
    assert third.columns == ("q", "r")
    assert "A: cos from its angle" in say(session, "free --matrix A")
    assert say(session, "free --matrix q").count("rank") == 1


def test_a_large_matrix_is_not_shown_but_told(tmp_path):
    bars = "".join(f"R{n} : .bar A = [{50 * n},0] B = [{50 * n + 50},{n % 2}];\n" for n in range(9))
    joints = "R0.A = [0,0];" + "".join(f"R{n}.A = R{n - 1}.B;" for n in range(1, 9))
    text = say(session_of(tmp_path, f"{bars}@0 {joints}\n"), "free --matrix")
    assert "27 equations, 36 unknowns, rank 27: 9 free motions" in text
    assert "27 x 36: too large to show" in text
    assert len(text.splitlines()) < 20
    assert "and 1 more" in text


def test_every_line_fits(tmp_path):
    text = say(session_of(tmp_path, ANGLES), "free --matrix")
    assert max(map(len, text.splitlines())) <= 100


@pytest.mark.parametrize(
    ("text", "line", "code"),
    [
        (HAND, "free --matrix Other", "repl/name"),
        (HAND, "free matrix", "repl/argument"),
        (HAND.replace("Rod.B.y = 40 + y", "Rod.B = [30,41]"), "free --matrix", "repl/no-solution"),
    ],
)
def test_what_cannot_be_shown_is_refused(text, line, code, tmp_path):
    with pytest.raises(MovimentumError) as caught:
        say(session_of(tmp_path, text), line)
    assert caught.value.diagnostics[0].code == code


def test_nothing_stated_is_no_matrix(tmp_path):
    text = "Rod : .bar A = [30,40] B = [130,40];\n@0\n"
    assert say(session_of(tmp_path, text), "free --matrix") == "nothing is stated at this moment, so there is no matrix"
