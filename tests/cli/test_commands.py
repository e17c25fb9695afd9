"""What the commands promise: exit codes, what goes to stdout and what to stderr, which files appear."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from movimentum import __version__
from tests.command import BINDS, CRANK, STILL, movimentum


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    return path


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def frames(path: Path) -> int:
    with Image.open(path) as picture:
        return getattr(picture, "n_frames", 1)


# --- the program itself ---


def test_version() -> None:
    done = movimentum("--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"movimentum, version {__version__}\n", "")


@pytest.mark.parametrize("arguments", [[], ["run"], ["check"], ["solve"]])
@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_has_examples_and_exit_codes(arguments: list[str], flag: str) -> None:
    done = movimentum(*arguments, flag)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Examples:" in done.stdout
    assert "Exit codes:" in done.stdout


def test_help_lists_every_option_of_the_contract() -> None:
    promised = (
        "--output --fps --frames --at --scale --trace --show --background --accuracy --quality --loop --transparent"
    )
    text = movimentum("run", "--help").stdout
    for option in [*promised.split(), "--strict", "--on-failure", "--workers", "--watch", "--open"]:
        assert option in text
    text = movimentum("solve", "--help").stdout
    for option in ["--output", "--fps", "--frames", "--accuracy", "--digits", "--strict", "--on-failure"]:
        assert option in text


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shell_completion(shell: str) -> None:
    done = movimentum(env={"_MOVIMENTUM_COMPLETE": f"{shell}_source"})
    assert done.returncode in (0, 1)  # bash: click asks the shell for its version, which may be too old or missing
    assert shell != "zsh" or "compdef" in done.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        ["paint", "crank.mov"],
        ["run"],
        ["run", "crank.mov", "--fps", "0"],
        ["run", "crank.mov", "--fps", "fast"],
        ["run", "crank.mov", "--frames", "1:2:3"],
        ["run", "crank.mov", "--frames", "50:"],
        ["run", "crank.mov", "--frames", "3:3"],
        ["run", "crank.mov", "--at", "0.5", "--frames", "0:2"],
        ["run", "crank.mov", "--at", "1.5"],
        ["run", "crank.mov", "--at", "-1"],
        ["run", "crank.mov", "--scale", "0"],
        ["run", "crank.mov", "--scale", "nan"],
        ["run", "crank.mov", "--scale", "inf"],
        ["run", "crank.mov", "--trace", "Rod.Z"],
        ["run", "crank.mov", "--trace", "Rod"],
        ["run", "crank.mov", "--show", "everything"],
        ["run", "crank.mov", "--background", "no such colour"],
        ["run", "crank.mov", "--accuracy", "wild"],
        ["run", "crank.mov", "--quality", "best"],
        ["run", "crank.mov", "--loop", "-1"],
        ["run", "crank.mov", "--on-failure", "pray"],
        ["run", "crank.mov", "--workers", "0"],
        ["run", "crank.mov", "--no-such-option"],
        ["run", "crank.mov", "-o", "out.tiff"],
        ["run", "crank.mov", "-o", "out"],
        ["run", "crank.mov", "-o", "crank.mov"],
        ["run", "-"],
        ["run", "-", "-o", "x.gif", "--watch"],
        ["check", "crank.mov", "--format", "xml"],
        ["solve", "crank.mov"],
        ["solve", "crank.mov", "-o", "poses.xls"],
        ["solve", "crank.mov", "-o", "-", "--digits", "20"],
        ["solve", "crank.mov", "-o", "-", "--accuracy", "exact", "--digits", "0"],
        ["trade"],
        ["trade", "missing.mov"],
        ["trade", "crank.mov", "-o", "plot.jpg"],
        ["trade", "crank.mov", "-o", "crank.mov"],
        ["trade", "crank.mov", "--format", "xml"],
        ["trade", "crank.mov", "-o", "no/such/folder/plot.svg"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_2_and_writes_nothing(script: Path, arguments: list[str]) -> None:
    done = movimentum(*arguments, cwd=script.parent)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert len(done.stderr) > 10
    assert os.listdir(script.parent) == ["crank.mov"]
    assert script.read_text() == CRANK


def test_an_unknown_suffix_is_answered_with_the_list(script: Path) -> None:
    done = movimentum("run", script, "-o", script.with_suffix(".tiff"))
    assert done.returncode == 2
    for suffix in (".gif", ".png", ".apng", ".webp", ".mp4", ".webm"):
        assert suffix in done.stderr


# --- run ---


def test_run_writes_a_gif_beside_the_script(script: Path, tmp_path: Path) -> None:
    done = movimentum("run", script, cwd=tmp_path.parent)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert sorted(os.listdir(tmp_path)) == ["crank.gif", "crank.mov"]
    assert frames(tmp_path / "crank.gif") == 11
    with Image.open(tmp_path / "crank.gif") as picture:
        assert picture.size == (120, 80)
    assert "11 frames" in done.stderr


def test_quiet_says_nothing_when_all_is_well(script: Path) -> None:
    done = movimentum("run", script, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize(
    ("chosen", "expected"), [("0:4", 4), (":", 11), ("8:", 3), (":-1", 10), ("-2:", 2), ("5", 1), ("3:100", 8)]
)
def test_frames_count_as_python_slices(script: Path, chosen: str, expected: int) -> None:
    done = movimentum("run", script, "--frames", chosen, "-o", script.with_name("f%03d.png"))
    assert done.returncode == 0, done.stderr
    assert len(list(script.parent.glob("f*.png"))) == expected


def test_at_is_a_still_between_frames_too(script: Path, tmp_path: Path) -> None:
    done = movimentum("run", script, "--at", "1/3")
    assert done.returncode == 0, done.stderr
    assert sorted(os.listdir(tmp_path)) == ["crank.mov", "crank.png"]
    # the same instant as frame 1 at fps 3
    assert movimentum("run", script, "--fps", "3", "--frames", "1", "-o", tmp_path / "b.png").returncode == 0
    with Image.open(tmp_path / "crank.png") as one, Image.open(tmp_path / "b.png") as other:
        assert one.convert("RGB").tobytes() == other.convert("RGB").tobytes()


def test_a_png_without_number_is_the_first_of_the_chosen_frames(script: Path, tmp_path: Path) -> None:
    assert movimentum("run", script, "--frames", "4:8", "-o", tmp_path / "a.png").returncode == 0
    assert movimentum("run", script, "--at", "2/5", "-o", tmp_path / "b.png").returncode == 0
    with Image.open(tmp_path / "a.png") as one, Image.open(tmp_path / "b.png") as other:
        assert one.convert("RGB").tobytes() == other.convert("RGB").tobytes()


@pytest.mark.parametrize(("suffix", "form"), [(".gif", "GIF"), (".png", "PNG"), (".apng", "PNG"), (".webp", "WEBP")])
def test_the_suffix_picks_the_format(script: Path, suffix: str, form: str) -> None:
    done = movimentum("run", script, "-o", script.with_suffix(suffix))
    assert done.returncode == 0, done.stderr
    with Image.open(script.with_suffix(suffix)) as picture:
        assert picture.format == form
    assert frames(script.with_suffix(suffix)) == (1 if suffix == ".png" else 11)


def test_options_of_the_picture_are_heeded(script: Path, tmp_path: Path) -> None:
    def picture(name: str, *options: str) -> np.ndarray:
        done = movimentum("run", script, "--at", "0.5", "-o", tmp_path / f"{name}.png", *options)
        assert done.returncode == 0, done.stderr
        with Image.open(tmp_path / f"{name}.png") as image:
            return np.asarray(image.convert("RGBA")).astype(int)

    plain = picture("plain")
    assert plain.shape == (80, 120, 4)
    assert picture("large", "--scale", "2").shape == (160, 240, 4)
    assert picture("blue", "--background", "blue")[0, 0].tolist() == [0, 0, 255, 255]
    assert picture("clear", "--transparent")[0, 0, 3] == 0
    for option in (["--trace", "Rod.B"], ["--show", "names"], ["--show", "anchors"], ["--quality", "draft"]):
        assert (picture("other", *option) != plain).any(), option


def test_what_is_free_is_shown_while_it_is(tmp_path: Path) -> None:
    path = tmp_path / "free.mov"
    path.write_text(
        ".config(10, 120, 80);\nRod : .bar A = [60,40] B = A + [40,0];\n@0 Rod.A = [60,40];\n@1 Rod.angle = 0;\n@2\n"
    )

    def pixels(at: str, *options: str) -> np.ndarray:
        done = movimentum("run", path, "--at", at, "-o", tmp_path / "x.png", *options)
        assert done.returncode == 0, done.stderr
        with Image.open(tmp_path / "x.png") as image:
            return np.asarray(image.convert("RGB")).astype(int)

    changed = (pixels("0.5") != pixels("0.5", "--show", "free")).any(axis=2)
    rows_of, columns_of = np.nonzero(changed)
    # it can turn about A: an arrow straight up from B, (100, 80 - 40), and none at A
    assert len(rows_of) > 50
    assert abs(columns_of + 0.5 - 100).max() < 7
    assert rows_of.max() < 44
    assert rows_of.min() < 10
    assert (pixels("1.5") == pixels("1.5", "--show", "free")).all()


def test_the_canvas_and_the_traces_do_not_depend_on_which_frames_are_drawn(tmp_path: Path) -> None:
    path = tmp_path / "fit.mov"
    path.write_text(CRANK.replace(".config(10, 120, 80)", ".config(10)"))
    options = ["--trace", "Rod.B", "--trace", "Crank.P"]
    assert movimentum("run", path, *options, "-o", tmp_path / "all%d.png").returncode == 0
    assert movimentum("run", path, *options, "--frames", "7:9", "-o", tmp_path / "some%d.png").returncode == 0
    assert movimentum("run", path, *options, "--at", "7/10", "-o", tmp_path / "still.png").returncode == 0
    assert movimentum("run", path, "--at", "7/10", "-o", tmp_path / "bare.png").returncode == 0

    def pixels(name: str) -> tuple[tuple[int, int], bytes]:
        with Image.open(tmp_path / name) as image:
            return image.size, image.convert("RGB").tobytes()

    assert pixels("some7.png") == pixels("all7.png") == pixels("still.png")
    assert pixels("some8.png") == pixels("all8.png") != pixels("all7.png")
    assert pixels("bare.png")[0] == pixels("still.png")[0]
    assert pixels("bare.png") != pixels("still.png")


def test_workers_do_not_change_a_byte(script: Path, tmp_path: Path) -> None:
    for workers in ("1", "2"):
        done = movimentum("run", script, "--fps", "40", "--workers", workers, "-o", tmp_path / f"{workers}.gif")
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "1.gif").read_bytes() == (tmp_path / "2.gif").read_bytes()


def test_a_script_can_come_from_stdin(tmp_path: Path) -> None:
    done = movimentum("run", "-", "-o", "out.gif", cwd=tmp_path, stdin=CRANK)
    assert done.returncode == 0, done.stderr
    assert frames(tmp_path / "out.gif") == 11


# --- check ---


def test_check_json_is_one_object_as_agreed(script: Path) -> None:
    done = movimentum("check", script, "--format", "json")
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads(done.stdout)
    assert list(report) == ["diagnostics", "steps", "frames", "duration"]
    assert (report["frames"], report["duration"]) == (11, 1.0)
    assert [item for item in report["diagnostics"] if item["severity"] != "note"] == []
    for step in report["steps"]:
        assert list(step) == ["time", "end", "unknowns", "equations", "rank", "freedom", "redundant", "blocks"]
        for block in step["blocks"]:
            assert block["kernel"] in {"assign", "linear", "polynomial", "dyad", "newton"}
    assert report["steps"][0]["freedom"] == 0


def test_check_finds_all_faults_and_says_where(tmp_path: Path) -> None:
    path = tmp_path / "bad.mov"
    path.write_text(
        ".config(10, 60, 40);\nRod : .bar A = [1,2] B = A + [3,0];\n@0 Rad.A = [1,1];\n   Rod.Q = [2,2];\n@1\n"
    )
    done = movimentum("check", path, "--format", "json")
    assert done.returncode == 1
    report = json.loads(done.stdout)
    found = {item["code"]: item for item in report["diagnostics"]}
    assert {"name/unknown-thing", "name/unknown-anchor"} <= found.keys()
    assert (found["name/unknown-thing"]["line"], found["name/unknown-thing"]["column"]) == (3, 4)
    assert found["name/unknown-anchor"]["line"] == 4
    assert found["name/unknown-thing"]["file"] == str(path)
    assert (report["steps"], report["frames"], report["duration"]) == ([], None, None)
    text = movimentum("check", path)
    assert text.returncode == 1
    assert "error[name/unknown-thing]" in text.stdout
    assert "bad.mov:3:4" in text.stdout


def test_check_sums_up(script: Path) -> None:
    done = movimentum("check", script)
    assert (done.returncode, done.stderr) == (0, "")
    assert "step @0 to @1:" in done.stdout
    assert "11 frames" in done.stdout


def test_strict_turns_warnings_into_errors(tmp_path: Path) -> None:
    path = tmp_path / "free.mov"
    path.write_text(".config(10, 60, 40);\nRod : .bar A = [10,10] B = A + [20,0];\n@0 Rod.A = [30,20];\n@1\n")
    assert movimentum("check", path).returncode == 0
    assert movimentum("run", path).returncode == 0
    assert (tmp_path / "free.gif").exists()
    (tmp_path / "free.gif").unlink()
    for command in (["check"], ["run"], ["solve", "-o", tmp_path / "free.csv"]):
        done = movimentum(*command, path, "--strict")
        assert done.returncode == 1
        assert "error[constraint/free-motion]" in done.stdout + done.stderr
    assert os.listdir(tmp_path) == ["free.mov"]


# --- solve ---


def test_solve_puts_the_slider_where_the_closed_form_does(script: Path) -> None:
    done = movimentum("solve", script, "-o", "-")
    assert done.returncode == 0, done.stderr
    table = rows(done.stdout)
    assert list(table[0]) == [
        "frame",
        "time",
        "Crank.O.x",
        "Crank.O.y",
        "Crank.P.x",
        "Crank.P.y",
        "Rod.A.x",
        "Rod.A.y",
        "Rod.B.x",
        "Rod.B.y",
        "Crank.angle",
        "Rod.angle",
        "x",
    ]
    assert [row["frame"] for row in table] == [str(k) for k in range(11)]
    for k, row in enumerate(table):
        turn = math.radians(9 * k)
        expected = 30 + 20 * math.cos(turn) + math.sqrt(50**2 - (20 * math.sin(turn)) ** 2)
        assert float(row["time"]) == pytest.approx(k / 10, abs=1e-15)
        assert float(row["x"]) == pytest.approx(expected, abs=1e-9)
        assert float(row["Rod.B.x"]) == pytest.approx(expected, abs=1e-9)
        assert float(row["Crank.angle"]) == pytest.approx(9 * k, abs=1e-9)


def test_a_range_of_frames_has_the_numbers_of_the_whole(script: Path) -> None:
    whole = rows(movimentum("solve", script, "-o", "-").stdout)
    part = rows(movimentum("solve", script, "-o", "-", "--frames", "4:7").stdout)
    assert part == whole[4:7]


def test_tables_in_files(script: Path, tmp_path: Path) -> None:
    on_stdout = movimentum("solve", script, "-o", "-").stdout
    for suffix in (".csv", ".json", ".npz"):
        done = movimentum("solve", script, "-o", tmp_path / f"poses{suffix}")
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert (tmp_path / "poses.csv").read_text() == on_stdout
    table = rows(on_stdout)
    document = json.loads((tmp_path / "poses.json").read_text())
    assert document["columns"] == list(table[0])
    assert [row[-1] for row in document["rows"]] == [float(row["x"]) for row in table]
    with np.load(tmp_path / "poses.npz") as archive:
        assert archive["x"].tolist() == [float(row["x"]) for row in table]


# --- no solution ---


def test_stop_writes_nothing_and_says_when(tmp_path: Path) -> None:
    path = tmp_path / "binds.mov"
    path.write_text(BINDS)
    for command in (["run"], ["check"], ["solve", "-o", "poses.csv"], ["solve", "-o", "-"]):
        done = movimentum(*command, path, cwd=tmp_path)
        assert done.returncode == 3, (command, done.stderr)
        assert "solve/unreachable" in done.stdout + done.stderr
        assert "0.525" in done.stdout + done.stderr
    assert os.listdir(tmp_path) == ["binds.mov"]


@pytest.mark.parametrize(("choice", "expected"), [("hold", 11), ("skip", 6)])
def test_hold_and_skip_make_a_file_and_still_exit_with_3(tmp_path: Path, choice: str, expected: int) -> None:
    path = tmp_path / "binds.mov"
    path.write_text(BINDS)
    done = movimentum("solve", path, "-o", "-", "--on-failure", choice)
    assert done.returncode == 3, done.stderr
    table = rows(done.stdout)
    assert len(table) == expected
    assert all(math.isfinite(float(cell)) for row in table for cell in row.values())
    for k, row in enumerate(table[:6]):
        assert float(row["y"]) == pytest.approx(40 + math.sqrt(441 - (4.0 * k) ** 2), abs=1e-6)
    done = movimentum("run", path, "--on-failure", choice, "-o", tmp_path / "f%d.png")
    assert done.returncode == 3, done.stderr
    assert len(list(tmp_path.glob("f*.png"))) == expected


def test_one_step_is_one_frame(tmp_path: Path) -> None:
    path = tmp_path / "still.mov"
    path.write_text(STILL)
    done = movimentum("solve", path, "-o", "-")
    assert len(rows(done.stdout)) == 1
    assert movimentum("run", path).returncode == 0
    assert frames(tmp_path / "still.gif") == 1
