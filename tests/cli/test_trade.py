"""`movimentum trade`, and the tiers of accuracy as the command line has them."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import mpmath
import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from tests.broad import broad
from tests.command import BINDS, CRANK, environment, movimentum


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    return path


def column(text: str, name: str) -> list[str]:
    rows = list(csv.DictReader(text.splitlines()))
    return [row[name] for row in rows]


def truth(frame: int) -> mpmath.mpf:
    mp = mpmath.MPContext()
    mp.dps = 90
    angle = 9 * frame * mp.pi / 180
    return 30 + 20 * mp.cos(angle) + mp.sqrt(2500 - (20 * mp.sin(angle)) ** 2)


# --- solve and run ---


@pytest.mark.parametrize("digits", [None, 12, 80])
def test_exact_tables_carry_the_digits_asked_for(script: Path, digits: int | None) -> None:
    more = [] if digits is None else ["--digits", str(digits)]
    done = movimentum("solve", script, "-o", "-", "--accuracy", "exact", *more)
    assert (done.returncode, done.stderr) == (0, "")
    texts = column(done.stdout, "Rod.B.x")
    mp = mpmath.MPContext()
    mp.dps = 90
    for frame, text in enumerate(texts):
        assert abs(mp.mpf(text) - truth(frame)) <= mp.mpf(10) ** (3 - (digits or 50)) / 2
    assert max(len(text.replace(".", "")) for text in texts) == (digits or 50)
    assert texts[0] == "100.0"


def test_exact_json_holds_strings_and_npz_floats(script: Path, tmp_path: Path) -> None:
    for name in ("a.json", "a.npz"):
        assert movimentum("solve", script, "-o", tmp_path / name, "--accuracy", "exact").returncode == 0
    table = json.loads((tmp_path / "a.json").read_text())
    place = table["columns"].index("x")
    floats = np.load(tmp_path / "a.npz")["x"]
    assert floats.dtype == np.float64
    for frame, row in enumerate(table["rows"]):
        assert row[0] == frame
        assert isinstance(row[place], str)
        assert float(row[place]) == floats[frame] == float(truth(frame))


def test_high_is_the_nearest_float_in_its_shortest_form(script: Path) -> None:
    done = movimentum("solve", script, "-o", "-", "--accuracy", "high")
    assert done.returncode == 0, done.stderr
    assert column(done.stdout, "x") == [repr(float(truth(frame))) for frame in range(11)]


def test_a_draft_that_gains_nothing_is_the_standard(script: Path) -> None:
    """And is judged as that is; nothing is reported that does not hold."""
    draft = movimentum("solve", script, "-o", "-", "--accuracy", "draft")
    usual = movimentum("solve", script, "-o", "-")
    assert (draft.returncode, draft.stderr, draft.stdout) == (0, usual.stderr, usual.stdout)


def test_what_is_only_integrated_is_told(tmp_path: Path) -> None:
    path = tmp_path / "decay.mov"
    path.write_text(
        ".config(4, 60, 60); Bar : .bar A = [10,10] B = A + [20,0];"
        "@0 Bar.A = [10,10]; x = 10 - .i(x); Bar.angle = x; @1"
    )
    done = movimentum("solve", path, "-o", "-", "--accuracy", "exact")
    assert done.returncode == 0
    assert "note[solve/rough]" in done.stderr
    assert "solve/rough" not in movimentum("solve", path, "-o", "-").stderr


def test_pictures_of_high_and_exact_are_the_same(script: Path, tmp_path: Path) -> None:
    for tier in ("standard", "high", "exact"):
        done = movimentum("run", script, "-o", tmp_path / f"{tier}.gif", "--accuracy", tier)
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
    pictures = {(tmp_path / f"{tier}.gif").read_bytes() for tier in ("standard", "high", "exact")}
    assert len(pictures) == 1


@broad("tier", ["draft", "high", "exact"], first=1)
def test_every_tier_fails_as_standard_does(tmp_path: Path, tier: str) -> None:
    path = tmp_path / "binds.mov"
    path.write_text(BINDS)
    done = movimentum("solve", path, "-o", tmp_path / "poses.csv", "--accuracy", tier)
    assert (done.returncode, done.stdout) == (3, "")
    assert not (tmp_path / "poses.csv").exists()
    usual = movimentum("solve", path, "-o", "-", "--on-failure", "skip")
    other = movimentum("solve", path, "-o", "-", "--on-failure", "skip", "--accuracy", tier)
    assert (usual.returncode, other.returncode) == (3, 3)
    assert column(other.stdout, "frame") == column(usual.stdout, "frame")


# --- trade ---


def test_trade_prints_tables_and_lessons(script: Path) -> None:
    done = movimentum("trade", script)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    for word in ("draft", "standard", "high", "exact", "quality high", "palette (GIF)", "scale 2"):
        assert any(line.startswith(word) for line in lines), word
    assert "gain nothing" in done.stdout
    assert "\x1b" not in done.stdout


def test_trade_as_json_orders_the_tiers(script: Path) -> None:
    done = movimentum("trade", script, "--format", "json")
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads(done.stdout)
    tiers = {tier["accuracy"]: tier for tier in report["solver"]["tiers"]}
    assert list(tiers) == ["draft", "standard", "high", "exact"]
    errors = [tiers[name]["error"] for name in tiers]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == errors[1], "here a draft gains nothing"
    assert "claim" not in tiers["draft"]
    assert errors[1] < 1e-12
    assert errors[2] == 0.0
    assert tiers["exact"]["residual"] < 1e-55
    assert tiers["standard"]["residual"] < 1e-14
    rms = {cost["picture"]: cost["rms"] for cost in report["pictures"]["costs"]}
    assert rms["quality high"] < rms["quality standard"] < rms["quality draft"]
    assert report["pictures"]["size"] == [120, 80]
    steps = [rate["step"] for rate in report["rates"]]
    assert steps == sorted(steps, reverse=True)


@pytest.mark.slow
def test_trade_tells_the_error_of_free_motion_that_all_accuracies_share(tmp_path: Path) -> None:
    path = tmp_path / "tractrix.mov"
    path.write_text(".config(10); Tail : .bar P=[0,0] Q=[0,100]; @0 Tail.P = [50*.t, 0]; x = Tail.Q.x; @4")
    done = movimentum("trade", path, "--format", "json", "-q")
    trade = json.loads(done.stdout)
    motion = mv.load(path).solve(accuracy="exact")
    u = np.array(motion.times, dtype=float) / 2
    true = float(np.max(np.abs(np.array(motion["x"], dtype=float) - 100 * (u - np.tanh(u)))))
    assert 0.3 * true < trade["solver"]["integration"] < 3.0 * true
    assert trade["lessons"][0].startswith("No tier adds digits to the free motion of `Tail`")
    assert "`high` and `exact` gain nothing here." in trade["lessons"]


def test_trade_plots(script: Path, tmp_path: Path) -> None:
    done = movimentum("trade", script, "-o", tmp_path / "plot.svg", "--format", "json")
    assert done.returncode == 0, done.stderr
    assert "plot.svg: plotted" in done.stderr
    json.loads(done.stdout)
    root = ElementTree.parse(tmp_path / "plot.svg").getroot()
    texts = [item.text for item in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"draft", "standard", "high", "exact (the truth)", "quality high"} <= set(texts)
    assert len(list(root.iter("{http://www.w3.org/2000/svg}circle"))) == 10
    assert movimentum("trade", script, "-o", tmp_path / "plot.png", "-q").stderr == ""
    with Image.open(tmp_path / "plot.png") as picture:
        colors = picture.convert("RGB").getcolors(1 << 24)
        assert colors is not None
        assert len(colors) > 20


def test_what_cannot_be_solved_cannot_be_traded(tmp_path: Path) -> None:
    path = tmp_path / "binds.mov"
    path.write_text(BINDS)
    done = movimentum("trade", path, "-o", tmp_path / "plot.svg")
    assert (done.returncode, done.stdout) == (3, "")
    assert not (tmp_path / "plot.svg").exists()
    path.write_text("@0 Rod.A = ;")
    assert movimentum("trade", path).returncode == 1


@broad(
    ("tier", "expected"),
    [("draft", False), ("standard", False), ("high", False), ("exact", True)],
    fast=("high", "exact"),
)
def test_only_exact_pays_for_mpmath(script: Path, tier: str, expected: bool) -> None:
    probe = "import sys; from movimentum.cli.app import run_command_line as run; code = run(sys.argv[1:]);"
    probe += "print('mpmath' in sys.modules, 'sympy' in sys.modules, code)"
    done = subprocess.run(
        [sys.executable, "-c", probe, "solve", "crank.mov", "-o", "poses.csv", "--accuracy", tier],
        capture_output=True,
        text=True,
        cwd=script.parent,
        env=environment(),
        timeout=120,
        check=False,
    )
    assert done.stdout.split() == [str(expected), "False", "0"], done.stderr


def test_no_tier_is_said_to_add_digits_to_an_integral(tmp_path: Path) -> None:
    path = tmp_path / "swing.mov"
    path.write_text(
        ".config(10, 60, 40);\nA : .bar P = [0,0] Q = [10,0];\n@0 A.P = [0,0]; A.angle = 9 + .i(A.Q.y);\n@1"
    )
    told = movimentum("trade", path.name, "--format", "json", cwd=tmp_path)
    found = json.loads(told.stdout)
    assert found["solver"]["rough"] == ["an integral"]
    assert found["lessons"][0].startswith("No tier adds digits to an integral")
    assert "the truth" not in " ".join(found["lessons"][:3])
