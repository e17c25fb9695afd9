"""Several anchors at once: `P[k = 0..9] = …`."""

from __future__ import annotations

import pytest

import movimentum as mv

RANGE = """
.let n = 3;
.part Spider(m = 4) {{ W : .polygon {anchors} .through({through}); L : .line W.P[1] W.P[m-1]; }}
S : Spider() .at([10,20]);   Z[i = 1..2] : Spider(5) .turned(30*i);
B : .bar P[0] = [0,0] P[k = 1..n] = P[k-1] + [10*k,0] Q = P[2] + [0,5];
@0 B.P[n] = [100,0]; B.angle = 0; S.W.angle = 10*.t; x = Z[2].W.P[3].y;
@1
"""


@pytest.mark.slow
def test_a_range_is_its_anchors_written_out() -> None:
    ranged = RANGE.format(anchors="C = [0,0] P[k = 1..m] = C + [30,0].r(360*k/m)", through="P")
    for m in (4, 5):
        written = " ".join(f"P[{k}] = C + [30,0].r(360*{k}/{m})" for k in range(1, m + 1))
        names = ", ".join(f"P[{k}]" for k in range(1, m + 1))
        plain = RANGE.format(anchors=f"C = [0,0] {written}", through=names).replace("Spider(5)", f"Spider({m})")
        one, other = (
            mv.loads(ranged.replace("Spider()", f"Spider({m})").replace("(5)", f"({m})")),
            mv.loads(plain.replace("Spider()", f"Spider({m})")),
        )
        first, second = one.solve(), other.solve()
        for name in ("S.W.P[2]", "B.P[3]", "B.Q", "Z[1].W.P[1].x", "x"):
            assert (first[name] == second[name]).all()
    assert first["B.Q"][0].tolist() == [70.0, 5.0]


@pytest.mark.parametrize(
    ("text", "code", "help_"),
    [
        ("S : .bar P[k=0..1] = [k,0];\n@0 S.P[5] = [1,1];", "name/unknown-anchor", "P[0]"),
        ("S : .bar P[k=0..1] = [k,0];\n@0 S.P = [1,1];", "name/unknown-anchor", "P[0]"),
        ("S : .bar P[k=0..-1] = [k,0];\n@0", "kind/anchors", ""),
        ("S : .bar P[k=0..1e9] = [k,0];\n@0", "limit/copies", ""),
        ("S : .bar P[k=0..1.5] = [k,0];\n@0", "kind/mismatch", ""),
        ("S : .bar P[k=0..1] = [k,0] P[1] = [3,3];\n@0", "name/duplicate", ""),
        ("S : .bar P[k=1..3] = P[k-1] + [5,0] P[0] = [0,0];\n@0", "name/unknown-anchor", "before"),
        ("S : .bar P[k=0..1] = [k,0];\nL : .line S.P[0] S.P[.t];\n@0", "kind/not-constant", ""),
        ("S : .bar P[k=0..1] = [k,0] .through(Q);\n@0", "syntax/arguments", ""),
    ],
)
def test_ranges_that_there_are_not_are_told(text: str, code: str, help_: str) -> None:
    with pytest.raises(mv.ScriptError) as error:
        mv.loads(text).solve()
    first = error.value.diagnostics[0]
    assert first.code == code
    assert help_ in " ".join(str(each) for each in first.helps)
