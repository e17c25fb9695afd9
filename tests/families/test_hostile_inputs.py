"""Nothing that is read can start a program, hang, fill the memory, or write to the terminal what it obeys; and nothing
that is read is written over.
"""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from movimentum.cli.app import run_command_line
from movimentum.rendering.images import image_size, load_premultiplied
from movimentum.terminal import typed, visible, visible_json, visible_lines
from tests.broad import broad
from tests.command import CRANK, command, environment, movimentum
from tests.families.hostile_inputs import CONTROLS, SPRITE, bomb, png, postscript, saved, tampered

OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")

# --- pictures ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["EPS", "PPM", "TGA", "ICO", "PCX", "SGI", "PDF", "DDS", "JPEG2000"])
def test_only_a_few_formats_are_opened_whatever_the_name_says(tmp_path: Path, kind: str) -> None:
    try:
        data = postscript(tmp_path / "mark") if kind == "EPS" else saved(kind)
    except (OSError, KeyError, ValueError):
        pytest.skip(f"this Pillow does not write {kind}")
    (tmp_path / "wheel.png").write_bytes(data)
    found = image_size(str(tmp_path / "wheel.png"))
    assert not isinstance(found, tuple)
    assert found.code == "asset/unreadable"
    assert any("PNG" in text for text in found.helps)
    assert not (tmp_path / "mark").exists()


@pytest.mark.parametrize("kind", ["PNG", "GIF", "JPEG", "WEBP", "BMP", "TIFF"])
def test_these_are(tmp_path: Path, kind: str) -> None:
    (tmp_path / "wheel.any").write_bytes(saved(kind, (9, 7)))
    assert image_size(str(tmp_path / "wheel.any")) == (9, 7)
    assert load_premultiplied(str(tmp_path / "wheel.any")).size == (9, 7)


@pytest.mark.slow
@broad(("width", "height"), [(1, 4_000_000), (4_000_000, 1), (7000, 9000)], first=1)
@pytest.mark.parametrize("scale", [1, pytest.param(0.01, marks=pytest.mark.slow)])
def test_odd_pictures_cost_what_is_drawn(tmp_path: Path, width: int, height: int, scale: float) -> None:
    (tmp_path / "wheel.png").write_bytes(bomb(width, height))
    (tmp_path / "wheel.mov").write_text(SPRITE.format("wheel.png").replace("' P", f"' .scale({scale}) P"))
    done = movimentum("run", tmp_path / "wheel.mov", "--at", "0", "-o", tmp_path / "o.png", timeout=60)
    assert done.returncode == 0  # 70 s for the first of them, once


def test_many_large_pictures_are_refused_before_any_is_decoded(tmp_path: Path) -> None:
    script = ".config(4, 60, 40);\n"
    for k in range(3):
        (tmp_path / f"{k}.png").write_bytes(bomb(8000, 7900))
        script += f"S{k} : '{k}.png' P = [0,0];\n"
    (tmp_path / "a.mov").write_text(script + "@0 " + " ".join(f"S{k}.P = [0,0]; S{k}.angle = 0;" for k in range(3)))
    done = movimentum("run", tmp_path / "a.mov", "--at", "0")
    assert done.returncode == 1
    assert "limit/pixels" in done.stderr


# --- what is read is not written over ------------------------------------------------------------------------------


def _scene(folder: Path, sprite: str, script: str) -> Path:
    if sprite.endswith(".svg"):
        circle = '<circle cx="5" cy="5" r="4" fill="red"/>'
        (folder / sprite).write_text(f'<svg xmlns="http://www.w3.org/2000/svg" width="10" height="10">{circle}</svg>')
    else:
        png(folder / sprite)
    (folder / script).write_text(SPRITE.format(sprite))
    return folder / script


def _link(kind: str, folder: Path, real: str) -> str:
    """Another name for ``real`` in ``folder``, of the same suffix."""
    name = f"another{Path(real).suffix}"
    if kind == "same":
        return real
    if kind == "spelling":
        return f"../{folder.name}/./{real}"
    (os.symlink if kind == "link" else os.link)(folder / real, folder / name)
    return name


COMMANDS = {
    "run": (["run", "{script}", "-o", "{out}"], [".gif", ".png", ".apng", ".webp"]),
    "run at": (["run", "{script}", "--at", "0", "-o", "{out}"], [".png"]),
    "trade": (["trade", "{script}", "-o", "{out}"], [".png", ".svg"]),
    "solve": (["solve", "{script}", "-o", "{out}"], [".csv", ".json", ".npz"]),
    "export": (["export", "{script}", "-o", "{out}"], [".txt", ".png"]),
    "plot": (["repl", "{script}", "-c", "plot Wheel.P.x -o {out}"], [".png", ".svg"]),
    "picture": (["repl", "{script}", "-c", "picture {out}"], [".png"]),
    "write": (["repl", "{script}", "-c", "write {out}"], [".png", ".mov"]),
}


@pytest.mark.parametrize("kind", ["same", "spelling", "link", "hard link"])
@pytest.mark.parametrize("command", COMMANDS)
def test_no_output_replaces_a_picture_that_the_script_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str, kind: str
) -> None:
    arguments, suffixes = COMMANDS[command]
    for suffix in suffixes:
        folder = tmp_path / suffix[1:]
        folder.mkdir()
        script = _scene(folder, f"wheel{suffix}", "wheel.mov" if suffix != ".mov" else "other.mov")
        before = (folder / f"wheel{suffix}").read_bytes()
        out = _link(kind, folder, f"wheel{suffix}")
        monkeypatch.chdir(folder)
        code = run_command_line([text.format(script=script, out=out) for text in arguments])
        said = capsys.readouterr()
        assert code == (1 if arguments[0] == "repl" else 2), (suffix, said)
        assert "usage/overwrites-input" in said.err + said.out
        assert (folder / f"wheel{suffix}").read_bytes() == before
        assert not [name for name in os.listdir(folder) if name.endswith(".part")]


@pytest.mark.parametrize(("script", "sprite"), [("wheel.mov", "wheel.png"), ("crank.mov", "crank.gif")])
def test_default_outputs_too_and_the_help_can_be_typed(tmp_path: Path, script: str, sprite: str) -> None:
    path = _scene(tmp_path, sprite, script)
    before = (tmp_path / sprite).read_bytes()
    arguments = ["run", script, *(["--at", "0"] if sprite.endswith("png") else [])]
    done = movimentum(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert (tmp_path / sprite).read_bytes() == before
    help_ = re.search(r"help: -o (\S+)", done.stderr)
    assert help_ is not None
    assert movimentum(*arguments, "-o", help_[1], cwd=tmp_path).returncode == 0
    assert (tmp_path / sprite).read_bytes() == before
    assert path.exists()


def test_numbered_pictures_spare_sprites_and_the_script(tmp_path: Path) -> None:
    for victim in ("f-0003.png", "f-0000.png"):
        folder = tmp_path / victim[:6]
        folder.mkdir()
        script = _scene(folder, victim, "a.mov")
        before = (folder / victim).read_bytes()
        assert run_command_line(["run", str(script), "-o", str(folder / "f-%04d.png")]) == 2
        assert (folder / victim).read_bytes() == before
        assert run_command_line(["run", str(script), "-o", str(folder / "g-%04d.png")]) == 0
    named = tmp_path / "f-0001.png"
    named.write_text(CRANK)
    assert run_command_line(["run", str(named), "-o", str(tmp_path / "f-%04d.png")]) == 2
    assert named.read_text() == CRANK
    far = _scene(tmp_path, "f-0999.png", "far.mov")  # a number that is not reached
    named.rename(tmp_path / "crank.mov")
    assert run_command_line(["run", str(far), "-o", str(tmp_path / "f-%04d.png")]) == 0


def test_an_import_does_not_replace_its_file(tmp_path: Path) -> None:
    text = "v\n0 0\n10 0\nf\n0\ne\n0 1\na\n"
    (tmp_path / "a.txt").write_text(text)
    os.link(tmp_path / "a.txt", tmp_path / "b.mov")
    for out in ("a.txt", "b.mov"):
        assert run_command_line(["import", str(tmp_path / "a.txt"), "-o", str(tmp_path / out)]) == 2
        assert (tmp_path / "a.txt").read_text() == text


def test_the_debugger_still_saves_the_script(tmp_path: Path) -> None:
    script = _scene(tmp_path, "wheel.png", "wheel.mov")
    assert run_command_line(["repl", str(script), "-c", "@0; Wheel.angle = 45*.t; write"]) in (0, 1)
    assert "Wheel" in script.read_text()


# --- recordings ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recording")
    (folder / "crank.mov").write_text(CRANK)
    assert run_command_line(["-q", "golden", "record", str(folder / "crank.mov")]) == 0
    return folder


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
def test_every_tampered_recording_is_told_and_none_hurts(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number, name in enumerate(tampered(recording / "crank.golden")):
        folder = tmp_path / str(number)
        shutil.copytree(recording, folder)
        tampered(folder / "crank.golden")[name]()
        code = run_command_line(["golden", "check", str(folder / "crank.mov")])
        said = capsys.readouterr()
        assert code == 1, (name, said)
        assert "golden/" in said.err, name
        assert not OBEYED.search(said.err + said.out), name


def test_only_our_own_pictures_are_deleted(recording: Path, tmp_path: Path) -> None:
    folder = tmp_path / "r"
    shutil.copytree(recording, folder)
    golden, failed = folder / "crank.golden", folder / "crank.golden-failed"
    failed.mkdir()
    kept = [png(place / name) for place in (golden, failed) for name in ("mine.png", "frame-99999.png", "page.png")]
    outside = png(folder / "outside.png")
    about = json.loads((golden / "golden.json").read_text())
    about["pictures"] += [77, -1, "../outside", 1e9, None]
    (golden / "golden.json").write_text(json.dumps(about))
    stale = png(golden / "frame-00077.png")
    (folder / "crank.mov").write_text(CRANK.replace("90*.t", "91*.t"))
    assert run_command_line(["-q", "golden", "check", str(folder / "crank.mov")]) == 1
    (failed / "pictures.json").write_text(json.dumps(["../outside.png", "mine.png", "frame-00002-actual.png", 3]))
    own = png(failed / "frame-00002-actual.png")
    assert run_command_line(["-q", "golden", "check", str(folder / "crank.mov")]) == 1
    assert not own.exists() or own.stat().st_size != outside.stat().st_size
    assert run_command_line(["-q", "golden", "record", str(folder / "crank.mov")]) == 0
    assert all(path.exists() for path in [*kept, outside])
    assert not stale.exists()


# --- text on a terminal --------------------------------------------------------------------------------------------


@broad("control", CONTROLS, every=4, ids=ascii)
def test_names_do_not_reach_the_terminal_as_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], control: str
) -> None:
    monkeypatch.chdir(tmp_path)
    script = tmp_path / f"a{control}b.mov"
    script.write_text(CRANK)
    bad = tmp_path / f"bad{control}.mov"
    bad.write_text(f"A : 'no{'' if control in CONTROLS[-2:] else control}.png' P = [0,0]; @0 A.P = [0,0];")
    for arguments in (
        ["check", script],
        ["check", bad],
        ["check", script, "--format", "json"],
        ["check", bad, "--format", "sarif"],
        ["run", script, "--at", "0"],
        ["run", script, "--at", f"1{control}"],
        ["run", f"{script}x"],
        ["run", script, "extra" + control],
        ["solve", script, "-o", tmp_path / f"{control}.csv"],
        ["golden", "check", script],
        ["export", script, "-o", "-"],
        ["repl", script, "-c", f"show Rod{control}; {control}; write {control}.mov; diff"],
    ):
        code = run_command_line([str(argument) for argument in arguments])
        said = capsys.readouterr()
        assert not OBEYED.search(said.out + said.err), (arguments, said)
        assert code != 70, (arguments, said)
        if "--format" in arguments:
            assert json.loads(said.out)


def test_a_real_terminal_gets_our_colours_and_nothing_else(tmp_path: Path) -> None:
    import pty

    name = "a\x1b[31mb\u202e.mov"
    (tmp_path / name).write_text("A : .bar P = [0,0]; @0 B.P = [0,0];")
    ours, theirs = pty.openpty()
    done = subprocess.run(command("check", name), cwd=tmp_path, env=environment(), stdout=theirs, check=False)
    os.close(theirs)
    text = os.read(ours, 100_000).decode()
    assert done.returncode == 1
    assert "\x1b[1;31merror" in text
    assert "\x1b[31m" not in text
    assert "\u202e" not in text
    assert r"a\x1b[31mb\u202e.mov" in text


def test_a_line_break_in_a_name_adds_no_statement(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for control in ("\n", "\r", "\r\n", "\u2028", "\x85"):
        name = tmp_path / f"x{control}Evil : .bar A = [0,0];{control}.txt"
        name.write_text("v\n0 0\n10 0\nf\n0\ne\n0 1\na\n")
        for form in (["-o", "-"], ["-o", str(tmp_path / "out.mov")]):
            assert run_command_line(["import", str(name), *form]) == 0
            text = capsys.readouterr().out or (tmp_path / "out.mov").read_text()
            assert sum("Evil" in line for line in re.split("[\n\r\x85\u2028]", text)) == 1
            assert next(line for line in text.splitlines() if "Evil" in line).startswith("//")
        script = tmp_path / f"y{control}evil = 1{control}.mov"
        script.write_text(CRANK)
        assert run_command_line(["export", str(script), "--format", "pyslvs", "-o", "-"]) == 0
        lines = re.split("[\n\r\x85\u2028]", capsys.readouterr().out)
        assert all(line.startswith("#") for line in lines if "evil" in line)


def test_any_text_is_made_harmless() -> None:
    chance = random.Random(12)
    letters = [chr(k) for k in range(0x180)] + list(
        "\u200e\u200f\u061c\u2028\u2029\u202a\u202e\u2066\u2069é→漢😀\udcff"
    )
    for _ in range(2000):
        text = "".join(chance.choices(letters, k=chance.randrange(12)))
        assert not OBEYED.search(visible(text))
        assert "\n" not in visible(text)
        assert visible_lines(text).count("\n") == text.count("\n")
        quoted = visible_json(json.dumps({"a": text}, ensure_ascii=False))
        assert json.loads(quoted) == {"a": text}
        assert json.loads(visible_json(json.dumps(text, ensure_ascii=False), "cp1252").encode("ascii")) == text


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_what_is_to_be_typed_means_the_file(tmp_path: Path) -> None:
    chance = random.Random(3)
    letters = list("ab -'\"$`\\;&|*?[]{}()<>~#!\n\t\x1b\u202eé\udcff%=")
    names = ["".join(chance.choices(letters, k=chance.randrange(1, 9))) for _ in range(300)]
    command = "printf '%s\\0' " + " ".join(map(typed, names))
    assert not OBEYED.search(command)
    told = subprocess.run(["bash", "-c", command.encode("utf-8")], capture_output=True, check=True).stdout
    expected = [f"./{name}" if name.startswith("-") and name != "-" else name for name in names]
    assert told.split(b"\0")[:-1] == [os.fsencode(name) for name in expected]


@pytest.mark.parametrize(
    "statements",
    ["A.green ~ 0.5; @1 A.green > 0.2; 0.1 ~ A.green; @2", "-A.red^2 = 2*.T - .t; @1", "A.opacity ~ x; @1"],
)
def test_a_thing_of_which_only_a_property_is_free_is_no_bug(tmp_path: Path, statements: str) -> None:
    (tmp_path / "a.mov").write_text(f".config(3, 60, 40);\nA : .bar P = [-27,1] Q = [-26,-32];\n@0 {statements}")
    assert run_command_line(["check", str(tmp_path / "a.mov")]) in (0, 1, 3)
