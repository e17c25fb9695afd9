"""Scripts that nobody should write get a clear error and the right exit code, at once."""

from __future__ import annotations

import json
import os
import random
from pathlib import Path

import pytest
from PIL import Image

from tests.command import movimentum

HEAD = ".config(10, 60, 40);\nRod : .bar A = [10,10] B = A + [20,0];\n"

CASES = {
    "nothing": "",
    "white space": " \n\t\n",
    "a comment": "// nothing else",
    "an open comment": HEAD + "@0 Rod.A = [1,1]; /* and then",
    "an open string": "Rod : 'rod.png",
    "zero bytes": "\0" * 1000,
    "nested parentheses": HEAD + "@0 Rod.A = [" + "(" * 5000 + "1" + ")" * 5000 + ", 1];\n@1\n",
    "nested brackets": HEAD + "@0 Rod.A = " + "[" * 5000 + "1" + "]" * 5000 + ";\n@1\n",
    "open parentheses": HEAD + "@0 Rod.A = [" + "(" * 5000,
    "a tower of minus signs": HEAD + "@0 Rod.A = [" + "-" * 5000 + "1, 1];\n@1\n",
    "division by zero": HEAD + "@0 Rod.A = [1/0, 1]; Rod.angle = 0;\n@1\n",
    "division by a zero in disguise": HEAD + "@0 Rod.A = [1/(2 - 1 - 1), 1]; Rod.angle = 0;\n@1\n",
    "zero to a negative power": HEAD + "@0 Rod.A = [0^-1, 1]; Rod.angle = 0;\n@1\n",
    "root of a negative number": HEAD + "@0 Rod.A = [.q(-1), 1]; Rod.angle = 0;\n@1\n",
    "logarithm of zero": HEAD + "@0 Rod.A = [.ln(0), 1]; Rod.angle = 0;\n@1\n",
    "overflow of a number": HEAD + "@0 Rod.A = [1e999, 1]; Rod.angle = 0;\n@1\n",
    "overflow of a product": HEAD + "@0 Rod.A = [1e200*1e200, 1]; Rod.angle = 0;\n@1\n",
    "overflow of an exponential": HEAD + "@0 Rod.A = [.exp(1000), 1]; Rod.angle = 0;\n@1\n",
    "overflow in a definition": HEAD.replace("[10,10]", "[1e308*10,10]") + "@0 Rod.angle = 0;\n@1\n",
    "no frames a second": ".config(0, 60, 40);\nRod : .bar A = [1,1] B = A + [20,0];\n@0 Rod.angle = 0;\n@1\n",
    "a negative rate": ".config(-5, 60, 40);\nRod : .bar A = [1,1] B = A + [20,0];\n@0 Rod.angle = 0;\n@1\n",
    "a canvas of no size": ".config(10, 0, 40);\nRod : .bar A = [1,1] B = A + [20,0];\n@0 Rod.angle = 0;\n@1\n",
    "time runs backwards": HEAD + "@5 Rod.angle = 0;\n@1\n",
    "a sprite that is not there": ".config(10, 60, 40);\nS : 'no.png' A = [1,1];\n@0 S.A = [1,1]; S.angle = 0;\n@1\n",
    "a sprite that is a folder": ".config(10, 60, 40);\nS : 'folder' A = [1,1];\n@0 S.A = [1,1]; S.angle = 0;\n@1\n",
    "a sprite that is text": ".config(10, 60, 40);\nS : 'text.png' A = [1,1];\n@0 S.A = [1,1]; S.angle = 0;\n@1\n",
    "a truncated sprite": ".config(10, 60, 40);\nS : 'half.png' A = [1,1];\n@0 S.A = [1,1]; S.angle = 0;\n@1\n",
    "an empty sprite": ".config(10, 60, 40);\nS : 'empty.png' A = [1,1];\n@0 S.A = [1,1]; S.angle = 0;\n@1\n",
    "a sprite with a zero in its name": ".config(10, 60, 40);\nS : 'a\0b.png' A = [1,1];\n@0 S.angle = 0;\n@1\n",
    "a sprite with a name too long": f".config(10, 60, 40);\nS : '{'x' * 5000}.png' A = [1,1];\n@0 S.angle = 0;\n@1\n",
}


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A folder with pictures to trip over."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "text.png").write_text("this is no picture")
    (tmp_path / "empty.png").write_bytes(b"")
    noise = Image.frombytes("RGB", (64, 64), random.Random(1).randbytes(64 * 64 * 3))
    noise.save(tmp_path / "whole.png")
    data = (tmp_path / "whole.png").read_bytes()
    (tmp_path / "half.png").write_bytes(data[: len(data) // 2])
    return tmp_path


def refused(room: Path, text: str | bytes, code: int = 1, *options: str) -> str:
    """Run the script in ``room``: refused with ``code``, with words, without a file; returns the words."""
    path = room / "bad.mov"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    before = sorted(os.listdir(room))
    done = movimentum("run", path, *options, timeout=60)
    assert done.returncode == code, done.stderr[-3000:]
    assert done.stdout == ""
    assert "error[" in done.stderr
    assert "nan" not in done.stderr.lower().split()
    assert len(done.stderr) < 20_000, "a long line is not a message"
    assert sorted(os.listdir(room)) == before
    return done.stderr


@pytest.mark.parametrize("name", CASES)
def test_a_script_at_fault_is_1_and_leaves_nothing(room: Path, name: str) -> None:
    refused(room, CASES[name])


@pytest.mark.parametrize("seed", range(4))
def test_binary_junk(room: Path, seed: int) -> None:
    refused(room, random.Random(seed).randbytes(20_000))


@pytest.mark.parametrize("seed", range(4))
def test_junk_of_the_languages_own_characters(room: Path, seed: int) -> None:
    dice = random.Random(seed)
    refused(room, "".join(dice.choices("@._=<>~[](){};:,+-*/^'0123456789 abAB\n", k=3000)))


def test_check_refuses_junk_as_json(room: Path) -> None:
    (room / "bad.mov").write_bytes(random.Random(9).randbytes(5000))
    done = movimentum("check", room / "bad.mov", "--format", "json")
    assert done.returncode == 1
    report = json.loads(done.stdout)
    assert report["diagnostics"]
    assert report["steps"] == []


def test_a_billion_frames_are_refused_with_the_option_that_raises_the_limit(room: Path) -> None:
    words = refused(room, HEAD + "@0 Rod.angle = 0;\n@1e8\n")
    assert "limit/frames" in words
    assert "--max-frames" in words
    refused(room, HEAD.replace("10,", "1e9,", 1) + "@0 Rod.angle = 0;\n@1\n")
    refused(room, HEAD + "@0 Rod.angle = 0;\n@1e300\n")
    refused(room, HEAD + "@0 Rod.angle = 0;\n@1\n", 1, "--fps", "1000000000")


def test_the_limit_of_frames_can_be_raised_and_lowered(room: Path) -> None:
    assert "limit/frames" in refused(room, HEAD + "@0 Rod.angle = 0;\n@1\n", 1, "--max-frames", "10")
    (room / "good.mov").write_text(HEAD + "@0 Rod.A = [1,1]; Rod.angle = 0;\n@1\n")
    assert movimentum("run", room / "good.mov", "--max-frames", "11").returncode == 0


def test_a_huge_canvas_is_refused_with_the_option_that_raises_the_limit(room: Path) -> None:
    huge = (
        ".config(10, 10000000, 10000000);\nRod : .bar A = [1,1] B = A + [20,0];\n@0 Rod.A = [1,1]; Rod.angle = 0;\n@1\n"
    )
    words = refused(room, huge)
    assert "limit/pixels" in words
    assert "--max-pixels" in words


def test_a_canvas_that_would_have_to_be_huge_is_refused(room: Path) -> None:
    far = ".config(10);\nRod : .bar A = [1,1] B = A + [20,0];\n@0 Rod.A = [1e7*.t, 1e7*.t]; Rod.angle = 0;\n@1\n"
    assert "limit/pixels" in refused(room, far)


def test_scaling_beyond_the_limit_is_refused(room: Path) -> None:
    assert "limit/pixels" in refused(room, HEAD + "@0 Rod.A = [1,1]; Rod.angle = 0;\n@1\n", 1, "--scale", "1e6")


@pytest.mark.slow
def test_a_decompression_bomb_is_refused(room: Path) -> None:
    Image.new("1", (40_000, 40_000)).save(room / "bomb.png")
    assert (room / "bomb.png").stat().st_size < 300_000
    words = refused(room, ".config(10, 60, 40);\nS : 'bomb.png' A = [1,1];\n@0 S.A = [1,1]; S.angle = 0;\n@1\n")
    assert "limit/pixels" in words
