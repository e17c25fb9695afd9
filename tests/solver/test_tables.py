"""Tables as functions (`.table`), against SciPy's splines and closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import movimentum as mv
from movimentum.arrays import FloatArray
from movimentum.expressions.tables import Ends, Table
from movimentum.solver.arithmetic.double_double import WideArithmetic
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.solver.arithmetic.taylor import Taylor
from tests.broad import broad

FOLLOWER = ".config(10); F : .bar O = [0,0] T = [0,60];\n"


def written(folder: Path, x: FloatArray, name: str = "t.csv", **columns: FloatArray) -> None:
    rows = [
        ",".join(["x", *columns]),
        *(",".join(map(repr, row)) for row in np.column_stack([x, *columns.values()]).tolist()),
    ]
    (folder / name).write_text("\n".join(rows) + "\n", encoding="utf-8")


def motion(folder: Path, text: str, **options: Any) -> mv.Motion:
    (folder / "film.mov").write_text(FOLLOWER + text, encoding="utf-8")
    return mv.load(folder / "film.mov").solve(**options)


def spline(x: FloatArray, y: FloatArray, ends: Ends = Ends.NOTHING) -> CubicSpline:
    return CubicSpline(x, y, bc_type="periodic" if ends is Ends.PERIODIC else "not-a-knot")


@broad("ends", Ends, first=1)
@pytest.mark.parametrize("rows", [2, 3, 4, 5, 12, 200])
def test_a_smooth_table_is_scipys_spline_with_its_derivatives(rows: int, ends: Ends) -> None:
    chance = np.random.default_rng(rows)
    x, y = np.cumsum(chance.uniform(0.1, 2.0, rows)), chance.normal(size=rows)
    if ends is Ends.PERIODIC:
        y[-1] = y[0]
    truth, table = spline(x, y, ends), Table(x, y, smooth=True, ends=ends)
    u = np.sort(chance.uniform(x[0], x[-1], 60))
    digits, wide = DigitsArithmetic(40), WideArithmetic()
    for order in range(3):
        size = max(float(np.abs(truth(u, order)).max()), 1e-3)
        np.testing.assert_allclose(table.at(u), truth(u, order), atol=1e-12 * size)
        far = digits.call("table", table, [digits.floats(u)])
        np.testing.assert_allclose(digits.rounded(far), table.at(u), atol=1e-11 * size)
        near = wide.table(wide.floats(u), table)
        both = [
            digits.context.mpf(h) + digits.context.mpf(low)
            for h, low in zip(near.high.tolist(), near.low.tolist(), strict=True)
        ]
        assert max(abs(a - b) for a, b in zip(both, far, strict=True)) < 1e-24 * size
        following = table.derived()
        assert following is not None
        table = following


def test_digits_do_not_end_at_those_of_floats() -> None:
    chance = np.random.default_rng(7)
    table = Table(np.cumsum(chance.uniform(0.1, 2.0, 40)), chance.normal(size=40), smooth=True)
    places = table.x[[3, 20]] + 0.0625
    few, many = DigitsArithmetic(40), DigitsArithmetic(200)
    a, b = (each.call("table", table, [each.floats(places)]) for each in (few, many))
    assert max(abs(many.context.mpf(str(x)) - y) for x, y in zip(a, b, strict=True)) < 1e-45


def test_a_kink_has_the_slope_of_the_side_that_time_goes_to() -> None:
    table = Table(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, -3.0]))
    for ahead, rate, slope in ((True, 1.0, -4.0), (True, -1.0, -1.0), (False, 1.0, 1.0), (False, -1.0, 4.0)):
        found = Taylor(2, ahead=ahead).call("table", table, [(np.float64(1.0), np.float64(rate))])
        assert (float(found[0]), float(found[1])) == (1.0, slope)


def test_measured_lift_drives_a_follower_with_exact_rates(tmp_path: Path) -> None:
    x = np.linspace(0.0, 360.0, 37)
    y = 20.0 - 20.0 * np.cos(np.radians(x))
    y[-1] = y[0]
    written(tmp_path, x, lift=y)
    text = """W : .bar C = [0,0] P = [30,0];
        @0 W.C = [0,0]; W.angle = 300*.t; F.angle = 0; v = .d(F.O.y); a = .d(v);
           F.O = [0, .table('t.csv', 'lift', W.angle).smooth.periodic];  @3"""
    found, truth = motion(tmp_path, text), spline(x, y, Ends.PERIODIC)
    theta = 300.0 * found.times
    np.testing.assert_allclose(found["F.O.y"], truth(theta), atol=1e-11)
    np.testing.assert_allclose(found["v"], 300.0 * truth(theta, 1), atol=1e-9)
    np.testing.assert_allclose(found["a"], 9e4 * truth(theta, 2), atol=1e-7)
    np.testing.assert_allclose(found.velocity("F.T")[:, 1], found["v"], atol=1e-9)
    exact = motion(tmp_path, text, accuracy="exact")
    np.testing.assert_allclose(exact["F.O.y"], truth(theta), atol=1e-11)


def test_frames_do_not_matter_to_what_is_between_them(tmp_path: Path) -> None:
    """A needle between two frames stops a mechanism, and an integral counts it."""
    x, y = np.array([0.0, 1.04, 1.05, 1.06, 2.0]), np.array([0.0, 0.0, 9.0, 0.0, 0.0])
    written(tmp_path, x, needle=y)
    counted = motion(tmp_path, "@0 F.angle = 0; F.O = [.i(.table('t.csv', 'needle', .t)), 0];  @2")
    assert abs(counted["F.O.x"][-1] - 0.09) < 1e-10
    jammed = """R : .bar A = [0,0] B = [60,0];
        @0 F.O = [0,0]; R.A = F.T; R.B = [100 + 5*.table('t.csv', 'needle', .t), 0]; F.T.y > 0;  @2"""
    with pytest.raises(mv.NoSolutionError, match=r"t = 1\.04444"):
        motion(tmp_path, jammed)


@pytest.mark.parametrize("smooth", ["", ".smooth"])
def test_what_is_asked_of_a_table_can_be_an_unknown(tmp_path: Path, smooth: str) -> None:
    x = np.array([0.0, 20.0, 55.0, 90.0, 130.0, 180.0])
    y = np.array([0.0, 12.0, 40.0, 33.0, 10.0, 4.0])
    written(tmp_path, x, lift=y)
    curve = spline(x, y)

    def truth(u: FloatArray) -> FloatArray:
        return np.asarray(curve(u) if smooth else np.interp(u, x, y), dtype=np.float64)

    for side, low, high in (("<", 0.0, 55.0), (">", 60.0, 180.0)):
        text = f"""@0 F.O = [0,0]; .table('t.csv', 'lift', F.angle){smooth} = 15 + 3*.t; F.angle {side} 58; F.angle > 0;
            @2"""
        found = motion(tmp_path, text)
        angle = found["F.angle"]
        assert ((low < angle) & (angle < high)).all()
        np.testing.assert_allclose(truth(angle), 15.0 + 3.0 * found.times, atol=1e-9)


@pytest.mark.slow
def test_variants_and_fits_see_a_table(tmp_path: Path) -> None:
    x = np.linspace(0.0, 4.0, 9)
    written(tmp_path, x, lift=np.sin(x))
    (tmp_path / "film.mov").write_text(
        FOLLOWER
        + """.let k = 0.5 .range(0.1, 1); .let h = 10*.table('t.csv', 'lift', k).smooth;
        @0 F.angle = 0; F.O = [h, .table('t.csv', 'lift', k*.t).smooth]; .goal F.O.y.at(3) = 0.9;  @3""",
        encoding="utf-8",
    )
    script, truth = mv.load(tmp_path / "film.mov"), spline(x, np.sin(x))
    k = np.linspace(0.1, 1.0, 10)
    table = script.sweep({"k": k.tolist()}, measure={"x": ".last(F.O.x)", "y": ".last(F.O.y)"})
    np.testing.assert_allclose(table["x"], 10.0 * truth(k), atol=1e-12)
    np.testing.assert_allclose(table["y"], truth(3.0 * k), atol=1e-12)
    fitted = script.fit()
    assert abs(float(truth(3.0 * fitted.constants["k"])) - 0.9) < 1e-6


def test_held_ends_and_the_error_where_there_is_none(tmp_path: Path) -> None:
    written(tmp_path, np.array([1.0, 2.0]), lift=np.array([5.0, 7.0]))
    held = motion(tmp_path, "@0 F.angle = 0; F.O = [.table('t.csv', 'lift', .t).held, 0];  @3")
    np.testing.assert_allclose(held["F.O.x"], np.interp(held.times, [1, 2], [5, 7]), atol=1e-12)
    for text, told in ((".t", "begins at 1"), (".t + 1", "ends at 2, and from t = 1 on")):
        with pytest.raises(mv.MovimentumError, match=told) as caught:
            motion(tmp_path, f"@0 F.angle = 0; F.O = [.table('t.csv', 'lift', {text}), 0];  @3")
        assert caught.value.diagnostics[0].code == "table/outside"


def test_the_column_of_arguments_can_be_named_and_a_file_may_have_no_names(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("\ufeffn;time;lift\r\n# a comment\r\n\r\n0;1;5\r\n1;2;7\r\n", encoding="utf-8")
    (tmp_path / "bare.csv").write_text("0\t1\n4\t9\n", encoding="utf-8")
    text = """.let file = 't.csv';
        @0 F.angle = 0; F.O = [.table(file, 'lift', .t + 1).over('time'), .table('bare.csv', '2', .t)];  @1"""
    found = motion(tmp_path, text)
    np.testing.assert_allclose(found["F.O.x"], 5.0 + 2.0 * found.times)
    np.testing.assert_allclose(found["F.O.y"], 1.0 + 2.0 * found.times)


def test_a_part_finds_its_table_beside_its_file(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    written(tmp_path / "parts", np.array([0.0, 1.0]), lift=np.array([0.0, 3.0]))
    part = ".part Arm(which) { A : .bar O = [0,0] P = [9,0]; @0 A.O = [0, .table('t.csv', which, .t)]; A.angle = 0; }"
    (tmp_path / "parts" / "arm.mov").write_text(part, encoding="utf-8")
    found = motion(tmp_path, ".include 'parts/arm.mov'; L : Arm('lift'); @0 F.O = [0,0]; F.angle = 0;  @1")
    np.testing.assert_allclose(found["L.A.O.y"], 3.0 * found.times)


BAD = {
    "knee,x\n": ("table/column", "no column `lift`"),
    "x,lift,lift\n0,1,2\n1,2,3\n": ("table/column", "2 columns"),
    "x,lift\n0,1\n1,oh\n": ("table/value", "line 3: `oh`"),
    "x,lift\n0,1\n\n1\n": ("table/value", "line 4: there is no number for `lift`"),
    "x,lift\n0,1\n1,nan\n": ("table/value", "line 3: `nan`"),
    "x,lift\n0,1\n1," + "9" * 200_000 + "\n": ("table/value", "line 3 is no line of a table: field larger than"),
    "x," + "l" * 200_000 + "\n0,1\n": ("table/value", "line 1 is no line of a table"),
    "x,lift\n0,1\n1," + "o" * 100_000 + "\n": ("table/value", "o…` is not a number"),
    "x;lift\n0;1\n1;2,5\n": ("table/value", "line 3: `2,5` has a decimal comma"),
    "x,lift\n0,1\n2,2\n1,3\n": ("table/order", "line 4: `x` is 1 after 2"),
    "x,lift\n0,1\n0,2\n": ("table/order", "line 3: `x` is 0 again"),
    "x,lift\n0,1\n": ("table/short", "one row"),
    "x,lift\n": ("table/short", "no rows"),
    "": ("table/short", "no rows"),
}


@pytest.mark.parametrize("content", BAD)
def test_bad_files_are_told(tmp_path: Path, content: str) -> None:
    (tmp_path / "t.csv").write_text(content, encoding="utf-8")
    code, words = BAD[content]
    with pytest.raises(mv.ScriptError) as caught:
        motion(tmp_path, "@0 F.O = [.table('t.csv', 'lift', .t), 0];  @1")
    first = caught.value.diagnostics[0]
    assert first.code == code
    assert words in first.message
    assert first.span is not None


def test_files_that_are_no_tables(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_bytes("x,lift\n0,1\n".encode("utf-16"))
    for name, code in (("t.csv", "asset/unreadable"), (".", "asset/unreadable"), ("tt.csv", "asset/missing")):
        with pytest.raises(mv.ScriptError) as caught:
            motion(tmp_path, f"@0 F.O = [.table('{name}', 'lift', .t), 0];  @1")
        assert caught.value.diagnostics[0].code == code


@pytest.mark.slow
def test_a_million_rows(tmp_path: Path) -> None:
    x = np.arange(1_000_000) * 1e-5
    np.savetxt(tmp_path / "t.csv", np.column_stack([x, np.sin(x)]), "%.12g", ",", header="x,lift", comments="")
    found = motion(tmp_path, "@0 F.angle = 0; F.O = [.table('t.csv', 'lift', .t).smooth, 0];  @9")
    np.testing.assert_allclose(found["F.O.x"], np.sin(found.times), atol=1e-9)


def test_a_script_that_reads_one_prints_as_it_is_read() -> None:
    from movimentum.source import SourceText
    from movimentum.syntax.parser import parse
    from tests.syntax.scripts_of_trees import script_text

    text = "@0\nx = 2 * .table('a.csv', 'b', .t + 1).over('c').smooth.held.x;\n"
    assert script_text(parse(SourceText("x.mov", text))) == text
