"""`sweep`: its options, its measures, its tables, what it says."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

import movimentum as mv
from movimentum.cli.app import run_command_line
from movimentum.variants.measures import read_measures

SCRIPT = """
.let R = 50 .range(20, 80);  .let L = 150;  .let at = [130, 110];
Crank : .bar A = at B = A + [R,0];   Coupler : .plate B = [0,0] P = B + [70,90] C = B + [L,0];
Rocker : .bar C = [0,0] D = C - [0,130];
@0 Crank.A = at; Crank.angle = 180*.t; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = at + [180,0];
   Rocker.C.y > Rocker.D.y;   .claim Coupler.P.x < 190;
@2 .loop;
"""


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "four-bar.mov"
    path.write_text(SCRIPT)
    return str(path)


def table(capsys, *arguments: str) -> list[dict[str, str]]:
    assert run_command_line(["sweep", *arguments]) == 0
    return list(csv.DictReader(io.StringIO(capsys.readouterr().out)))


def test_every_reduction_is_that_of_the_frames(script):
    motion = mv.load(script).solve()
    x = motion["Coupler.P.x"]
    measures = {
        ".min(Coupler.P.x)": x.min(), ".max(Coupler.P.x)": x.max(), ".mean(Coupler.P.x)": x.mean(),
        ".rms(Coupler.P.x)": np.sqrt(np.mean(x * x)), ".range(Coupler.P.x)": np.ptp(x),
        ".first(Coupler.P.x)": x[0], ".last(Coupler.P.x)": x[-1],
        ".at(Coupler.P.x, 1/3)": motion.at("1/3")["Coupler.P.x"],
        "Coupler.P.x.at(0.25)": motion.at(0.25)["Coupler.P.x"],
        "(Coupler.P - Rocker.D).l.at(1)": np.hypot(*(motion.at(1)["Coupler.P"] - motion.at(1)["Rocker.D"])),
        ".max(Coupler.P.x) - .min(Coupler.P.x)": np.ptp(x), ".q(.range(Coupler.P.x)/R)": np.sqrt(np.ptp(x) / 50),
        ".max(.min(Coupler.P.x), 60)": max(x.min(), 60.0), ".max(.max(Coupler.P.x, Rocker.C.y))":
            np.maximum(x, motion["Rocker.C.y"]).max(), ".margin(1)": (190 - x).min(), ".margin()": (190 - x).min(),
        ".max(.abs(Crank.angle - 90))": np.abs(motion["Crank.angle"] - 90).max(), "R + L": 200.0,
    }  # fmt: skip
    found = mv.load(script).sweep(R=[50], L=[150], measure={f"m{k}": text for k, text in enumerate(measures)})
    for k, (text, expected) in enumerate(measures.items()):
        assert found[f"m{k}"][0] == pytest.approx(float(expected), rel=1e-12), text


def test_all_combinations_are_rows_the_last_constant_fastest(capsys, script):
    rows = table(capsys, script, "--vary", "R=20:40:3", "--vary", "L=150,160", "--measure", "w = .range(Coupler.P.x)")
    assert [(row["R"], row["L"]) for row in rows] == [
        ("20.0", "150.0"), ("20.0", "160.0"), ("30.0", "150.0"), ("30.0", "160.0"), ("40.0", "150.0"), ("40.0", "160.0")
    ]  # fmt: skip
    assert list(rows[0]) == ["R", "L", "w", "outcome", "time"]
    for row in rows:
        motion = mv.load(script, R=float(row["R"]), L=float(row["L"]))
        x = motion.sweep(R=[float(row["R"])], measure={"w": ".range(Coupler.P.x)"})["w"][0]
        assert (float(row["w"]), row["outcome"], row["time"]) == (pytest.approx(x, rel=1e-9), "ok", "")


@pytest.mark.slow
def test_files_samples_and_ranges_of_constants(capsys, script, tmp_path):
    values = tmp_path / "values.csv"
    values.write_text("L,unused,R\n150,1,50\n\n170,2,30\n")
    rows = table(capsys, script, "--vary", f"R=@{values}", "--vary", f"L=@{values}")
    assert [(row["R"], row["L"]) for row in rows] == [("50.0", "150.0"), ("30.0", "170.0")]
    assert len(table(capsys, script, "--vary", "R")) == 11
    rows = table(capsys, script, "--sample", "sobol:16", "--vary", "L=140:160")
    r, length = (np.array([float(row[name]) for row in rows]) for name in ("R", "L"))
    assert len(rows) == 16
    assert (r > 20).all()
    assert (r < 80).all()
    assert np.histogram(length, 4, (140, 160))[0].tolist() == [4, 4, 4, 4]
    assert rows == table(capsys, script, "--sample", "sobol:16", "--vary", "L=140:160")


@pytest.mark.parametrize(
    ("arguments", "code", "message", "help_"),
    [
        (["--vary", "Q=1:2:3"], "usage/constant", "no constant `Q`", "its constants are"),
        (["--vary", "RR=1:2:3"], "usage/constant", "no constant `RR`", "did you mean `R`?"),
        (["--vary", "at=1:2:3"], "usage/vary", "is a vector", "`atx`"),
        (["--vary", "L"], "usage/vary", "has no `.range`", "--vary L=20:80:61"),
        (["--vary", "R=20:80:0"], "usage/vary", "is not a number of values", "R=20:80:61"),
        (["--vary", "R=20:80:1"], "usage/vary", "one value cannot go", "R=20:80:2"),
        (["--vary", "R=20,,3"], "usage/vary", "nothing is not a value", "--vary R=20,35,50"),
        (["--vary", "R=nan"], "usage/vary", "`nan` is not a value", "--vary R=20,35,50"),
        (["--vary", "R=1", "--vary", "R=2"], "usage/vary", "varied twice", "R=a,b,c"),
        (["--vary", "=3"], "usage/vary", "does not say which constant", "--vary R=20:80:61"),
        (["--vary", "R=@none.csv"], "usage/vary", "cannot read none.csv", None),
        ([], "usage/vary", "nothing is varied", "--vary R"),
        (["--sample", "halton:8"], "usage/sample", "is not a sample", "--sample sobol:4096"),
        (["--vary", "R=1:9:5000", "--vary", "L=1:9:5000"], "limit/variants", "25,000,000", "--max-variants 25000000"),
        (["--vary", "R=1", "--measure", "w = Coupler.P.x"], "usage/measure", "changes with time", ".max(Coupler.P.x)"),
        (["--vary", "R=1", "--measure", "w = .max(Coupler.P)"], "usage/measure", "is a vector", ".l`"),
        (["--vary", "R=1", "--measure", "w = .max(Couper.P.x)"], "name/unknown-thing", "Couper", "`Coupler.P"),
        (["--vary", "R=1", "--measure", "w = .max(.min(Coupler.P.x))"], "usage/measure", "already one value", None),
        (["--vary", "R=1", "--measure", "w = .at(Coupler.P.x, 7)"], "usage/measure", "outside the film", None),
        (["--vary", "R=1", "--measure", "w = .at(Coupler.P.x, R)"], "usage/measure", "is not a time", "0.5"),
        (["--vary", "R=1", "--measure", "w = max(Coupler.P.x)"], "usage/measure", "an operator", "write `.max(…)`"),
        (["--vary", "R=1", "--measure", "w = .rms(Crank.P.x) > 3"], "usage/measure", "compares", "'.rms(Crank.P.x)'"),
        (["--vary", "R=1", "--measure", "w = .margin(2)"], "usage/measure", "1 claim", None),
        (["--vary", "R=1", "--measure", "w = .max(Coupler.P.x"], "usage/measure", "expected `)`", None),
        (["--vary", "R=1", "--measure", "R = .max(Coupler.P.x)"], "usage/measure", "a constant that varies", "my_R"),
        (["--vary", "R=1", "--measure", "time = .max(Rocker.C.x)"], "usage/measure", "jumps is called", "my_time"),
        (["--vary", "R=1", "-o", "table.xls"], "usage/output", ".parquet", "-o table.csv"),
        (["--vary", "R=1:2:3", "--plot", "R,w"], "usage/plot", "no measure `w`", "--plot"),
        (["--vary", "R=1:2:3", "--sheet", "s.gif"], "usage/output", "a sheet is a .png", "--sheet s.png"),
        (["--vary", "R=1:2:3", "--dask", "remote"], "usage/dask", "is not the address of a cluster", "--dask local"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(capsys, script, arguments, code, message, help_, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_command_line(["sweep", script, *arguments]) in (1, 2)
    told = capsys.readouterr().err
    assert f"error[{code}]" in told
    assert message in told
    assert help_ is None or help_ in told


@pytest.mark.parametrize("name", ["time", "outcome"])
@pytest.mark.parametrize("asked", [["--vary", "{}=1:3:3"], ["--sample", "sobol:4"]])
def test_a_constant_with_the_name_of_a_column_gets_another_as_told(capsys, tmp_path, name, asked):
    arguments = [word.format(name) for word in asked]
    text = f".let {name} = 2 .range(1, 3);  A : .bar P=[0,0] Q=[{name},0];  @0 A.P=[0,0]; A.angle=90*.t; @2"
    path = tmp_path / "arm.mov"
    path.write_text(text)
    assert run_command_line(["sweep", str(path), *arguments]) == 2
    told = capsys.readouterr().err
    assert "error[usage/vary]" in told
    fix = f".let my_{name} = 2; .let {name} = my_{name};"
    assert fix in told
    path.write_text(text.replace(f".let {name} = 2 .range(1, 3);", fix))
    rows = table(capsys, str(path), "--vary", f"my_{name}=1:3:3", "--measure", "reach = .max(A.Q.x)")
    assert [(float(row["reach"]), row["outcome"], row["time"]) for row in rows] == [(k, "ok", "") for k in (1, 2, 3)]


@pytest.mark.parametrize("bad", ["R\n1\nx\n", "R\n1\n\nnan\n", "Q\n1\n", "R\n", "", "1,2\n3,4\n"])
def test_a_file_of_values_with_a_fault(capsys, script, tmp_path, bad):
    (tmp_path / "values.csv").write_text(bad)
    assert run_command_line(["sweep", script, "--vary", f"R=@{tmp_path / 'values.csv'}"]) == 2
    assert "error[usage/vary]" in capsys.readouterr().err


@pytest.mark.slow
def test_tables_of_every_kind_hold_the_same(script, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    options = ["--vary", "R=20:100:9", "--vary", "L=60,150", "--measure", "w = .range(Coupler.P.x)"]
    for suffix in ("csv", "npz", "parquet"):
        assert run_command_line(["sweep", script, *options, "-o", str(tmp_path / f"t.{suffix}"), "-q"]) == 0
    with (tmp_path / "t.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    arrays = np.load(tmp_path / "t.npz")
    columns = parquet.read_table(tmp_path / "t.parquet").to_pydict()
    assert list(columns) == list(arrays) == list(rows[0])
    for name in ("R", "L", "w", "time"):
        texts = [float(row[name]) if row[name] else np.nan for row in rows]
        np.testing.assert_array_equal(arrays[name], texts)
        np.testing.assert_array_equal([np.nan if v is None else v for v in columns[name]], texts)
    assert arrays["outcome"].tolist() == columns["outcome"] == [row["outcome"] for row in rows]
    assert {"ok", "binds"} <= set(columns["outcome"])
    assert not list(tmp_path.glob("*.unfinished"))


@pytest.mark.slow
def test_a_sweep_goes_on_where_it_was_interrupted(script, tmp_path, monkeypatch, capsys):
    from movimentum.variants.family import Family

    options = [script, "--vary", "R=20:60:400", "--measure", "w = .range(Coupler.P.x)", "-o", str(tmp_path / "t.csv")]
    assert run_command_line(["sweep", *options]) == 0
    whole = (tmp_path / "t.csv").read_bytes()
    (tmp_path / "t.csv").unlink()
    solved: list[int] = []
    rows = Family.rows

    def some(self, constants):
        if len(solved) == 2:
            raise KeyboardInterrupt
        solved.append(len(constants))
        return rows(self, constants)

    monkeypatch.setattr(Family, "rows", some)
    capsys.readouterr()
    assert run_command_line(["sweep", *options]) == 130
    assert "--resume" in capsys.readouterr().err
    assert not (tmp_path / "t.csv").exists()
    monkeypatch.setattr(
        Family, "rows", lambda self, constants: (solved.append(len(constants)), rows(self, constants))[1]
    )
    assert run_command_line(["sweep", *options, "--resume"]) == 0
    assert (tmp_path / "t.csv").read_bytes() == whole
    assert sum(solved) == 400


def test_another_sweep_is_not_resumed(script, tmp_path, capsys):
    target = tmp_path / "t.csv"
    (tmp_path / "t.csv.unfinished").write_text("something else\n")
    assert run_command_line(["sweep", script, "--vary", "R=20:30:3", "-o", str(target), "--resume"]) == 2
    assert "error[usage/resume]" in capsys.readouterr().err
    assert run_command_line(["sweep", script, "--vary", "R=20:30:3", "-o", str(target)]) == 0


def test_no_variant_moves(script, capsys):
    assert run_command_line(["sweep", script, "--vary", "L=5:20:4"]) == 3
    assert "4 variants" in capsys.readouterr().err


@pytest.mark.slow
def test_pictures_of_a_sweep(script, tmp_path):
    image = pytest.importorskip("PIL.Image")
    options = ["--vary", "R=20:60:3", "--vary", "L=70,150", "--measure", "w = .range(Coupler.P.x)", "-q"]
    sheet, out = tmp_path / "sheet.png", tmp_path / "t.csv"
    plots = ["--plot", "R,L,w", "--sheet", str(sheet), "-o", str(out)]
    assert run_command_line(["sweep", script, *options, *plots]) == 0
    with image.open(sheet) as picture:
        assert picture.width < picture.height  # two columns, three rows
    with image.open(tmp_path / "t-w.png") as picture:
        assert (225, 225, 225) in {color for _, color in picture.convert("RGB").getcolors(1 << 20)}  # what binds


def test_measures_are_split_once():
    found = read_measures(["a = .max(P.x) - .min(P.x)", "b = 2*.max(P.x)", ".range(P.y)"])
    assert found.names == ("a", "b", ".range(P.y)")
    assert len(found.parts) == 3
