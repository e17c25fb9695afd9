"""Programs in other languages give what `solve` gives, and curves hold the paths."""

import csv
import io
import json
import shutil
import subprocess

import numpy as np
import pytest

from movimentum.equations import code, formulas, wording
from movimentum.errors import ScriptError
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.equations import program_of
from movimentum.workflow.read import read
from tests.broad import broad
from tests.command import ROOT, movimentum

SCRIPTS = ROOT / "scripts"
QUICK = ("four-bar", "slider-crank", "hart", "oscillating-engine")
GALLERY = sorted(path.stem for path in SCRIPTS.glob("*.mov"))


def program_of_script(name):
    """A gallery script's program; the test is skipped where it has none."""
    try:
        return program_of(read(str(SCRIPTS / f"{name}.mov")), Choices(), ())
    except ScriptError as error:
        pytest.skip(str(error).partition("\n")[0])


def poses(name):
    """(times, names, values) of a gallery script, as `solve` writes them."""
    done = movimentum("solve", str(SCRIPTS / f"{name}.mov"), "-o", "-", "-q")
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    columns = [column for column in rows[0] if column not in ("frame", "time")]
    return [row["time"] for row in rows], columns, np.array([[float(row[c]) for c in columns] for row in rows])


def by_python(program, times, columns):
    space = {}
    exec(compile(code.python_code(program), "pose.py", "exec"), space)
    found = [space["pose"](float(time)) for time in times]
    return np.array([[one[column] for column in columns] for one in found])


def by_numpy(program, times, columns):
    space = {}
    exec(compile(code.numpy_code(program), "pose.py", "exec"), space)
    found = space["poses"](np.array(times, dtype=float))
    return np.stack([found[column] for column in columns], axis=1)


def by_c(program, times, columns, folder):
    (folder / "pose.c").write_text(code.c_code(program), encoding="utf-8")
    warned = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run(["cc", "-O1", *warned, "-DMAIN", "-o", "pose", "pose.c", "-lm"], cwd=folder, check=True)
    done = subprocess.run([folder / "pose", *times], capture_output=True, text=True, check=True)
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    return np.array([[float(row[column]) for column in columns] for row in rows])


def by_node(program, times, columns, folder):
    ask = "\nfor (const t of process.argv.slice(2)) console.log(JSON.stringify(pose(Number(t))));\n"
    (folder / "pose.js").write_text(code.javascript_code(program) + ask, encoding="utf-8")
    done = subprocess.run(["node", "pose.js", *times], cwd=folder, capture_output=True, text=True, check=True)
    return np.array([[json.loads(line)[column] for column in columns] for line in done.stdout.splitlines()])


def by_octave(program, times, columns, folder):
    (folder / "pose.m").write_text(code.matlab_code(program), encoding="utf-8")
    ask = f"for t = [{' '.join(times)}], printf('%.17g ', pose(t)); printf('\\n'); end"
    done = subprocess.run(["octave-cli", "-qf", "--eval", ask], cwd=folder, capture_output=True, text=True, check=True)
    places = [program.names.index(column) for column in columns]
    return np.array([[float(line.split()[place]) for place in places] for line in done.stdout.splitlines()])


@broad("name", GALLERY, fast=QUICK)
def test_code_agrees_with_solve(name, tmp_path):
    program = program_of_script(name)
    times, columns, values = poses(name)
    columns_known = [k for k, column in enumerate(columns) if column in program.names]
    columns, values = [columns[k] for k in columns_known], values[:, columns_known]
    allowed = 1e-12 * max(np.abs(values).max(), 1.0)
    assert np.abs(by_numpy(program, times, columns) - values).max() < allowed
    assert np.abs(by_python(program, times[::5], columns) - values[::5]).max() < allowed
    if shutil.which("cc"):
        assert np.abs(by_c(program, times, columns, tmp_path) - values).max() < allowed
    if shutil.which("node"):
        assert np.abs(by_node(program, times, columns, tmp_path) - values).max() < allowed
    if shutil.which("octave-cli"):
        assert np.abs(by_octave(program, times, columns, tmp_path) - values).max() < allowed


@broad("name", ["tracer", "cam-follower", "elliptic-gears", "scissor-rollers"], first=1)
def test_what_touches_a_curve_has_no_program(name):
    with pytest.raises(ScriptError, match="follows a curve, or a long table") as caught:
        program_of(read(str(SCRIPTS / f"{name}.mov")), Choices(), ())
    assert caught.value.diagnostics[0].span


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="TeX is not installed")
@broad("name", GALLERY, fast=("hart",))
def test_latex_is_compiled(name, tmp_path):
    compiled(wording.latex(program_of_script(name)), tmp_path)


def compiled(text, folder):
    """What TeX makes of a file, or of lines for one."""
    if r"\documentclass" not in text:
        text = rf"\documentclass{{article}}\usepackage{{amsmath}}\begin{{document}}{text}\end{{document}}"
    (folder / "told.tex").write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "told.tex"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-2000:]


CRANK = """
.let R = 50;  .let L = 50.5;  .let k = 120;
Crank : .bar O = [0,0] P = O + [R, 0];
Rod   : .bar P = [0,0] B = P + [k, 0] M = P + [L, 9];
@0 Crank.O = [0,0]; Crank.angle = 90*.t; Rod.P = Crank.P; Rod.B = [x, 0]; x > 0;
@2
"""


def test_constants_stay_names():
    program = program_of(SourceText("crank.mov", CRANK), Choices(), ("x", "Rod.M"))
    assert program.constants == (("R", 50.0), ("L", 50.5), ("k", 120.0))
    space = {}
    exec(compile(code.python_code(program), "pose.py", "exec"), space)
    for t, r, k in ((0.3, 50.0, 120.0), (1.1, 30.0, 95.0)):
        found = space["pose"](t, R=r, k=k)
        turn = np.radians(90 * t)
        assert found["x"] == pytest.approx(r * np.cos(turn) + np.sqrt(k**2 - (r * np.sin(turn)) ** 2), rel=1e-13)
    assert set(found) == {"x", "Rod.M.x", "Rod.M.y"}


@pytest.mark.parametrize("language", ["geogebra", "desmos", "excel", "julia", "matlab", "text", "latex", "mathml"])
def test_every_language_is_written(language):
    program = program_of(SourceText("crank.mov", CRANK), Choices(), ("x",))
    function = (
        getattr(wording, language, None) or getattr(formulas, language, None) or getattr(code, f"{language}_code")
    )
    assert function(program).count("\n") > 5


def test_geogebra_read_back():
    import sympy

    program = program_of(SourceText("crank.mov", CRANK), Choices(), ("x",))
    values = {"t": sympy.Rational(3, 10)}
    for line in formulas.geogebra(program).splitlines()[1:]:
        name, _, text = line.partition(" = ")
        values[name] = sympy.sympify(text.replace("^", "**"), locals={**values, "R": values.get("R")})
    turn = np.radians(27)
    assert float(values["outX"]) == pytest.approx(
        50 * np.cos(turn) + np.sqrt(120**2 - (50 * np.sin(turn)) ** 2), rel=1e-13
    )


@pytest.mark.slow
def test_what_follows_a_wish_has_no_program():
    with pytest.raises(ScriptError, match="follows a wish"):
        program_of(read(str(SCRIPTS / "peaucellier-linkage.mov")), Choices(), ())


def test_a_curve_on_the_command_line():
    done = movimentum("curve", str(SCRIPTS / "peaucellier.mov"), "AP.P")
    assert done.stdout == "degree 1\nx - 300 = 0\n"
    done = movimentum("curve", str(SCRIPTS / "peaucellier.mov"), "AP.Nowhere")
    assert done.returncode == 1
    assert "name/unknown-anchor" in done.stderr
