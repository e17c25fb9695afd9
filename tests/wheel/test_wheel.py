"""The wheel holds all that is needed: installed where the checkout is out of sight, it renders a script.

The libraries that it depends on are lent by this environment; `.ci/run` installs them as well.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest
from PIL import Image

from tests.command import CRANK, ROOT

pytestmark = pytest.mark.slow


def run(*command: str | Path, cwd: Path) -> str:
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, cwd=cwd, env=clean, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT, cwd=folder)
    (made,) = folder.glob("*.whl")
    return made


def test_the_wheel_holds_the_grammar_and_nothing_foreign(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        grammar = archive.read("movimentum/syntax/movimentum.lark")
        entry_points = archive.read(next(name for name in names if name.endswith("entry_points.txt"))).decode()
    assert grammar == (ROOT / "grammar" / "movimentum.lark").read_bytes()
    assert "movimentum/py.typed" in names
    fonts = ("DejaVuSans.ttf", "DejaVuSans.LICENSE", "Inter-Regular.otf", "Inter-Regular.LICENSE")
    assert {f"movimentum/rendering/fonts/{name}" for name in fonts} <= set(names)
    assert {"movimentum/vector/painter.js", "movimentum/vector/player.js", "movimentum/vector/page.css"} <= set(names)
    studio = {f"movimentum/studio/web/{name}" for name in ("index.html", "studio.css", "studio.js")}
    assert {*studio, "movimentum/gallery/four-bar.mov"} <= set(names)
    assert not [name for name in names if "node_modules" in name or "make_sprites" in name]
    assert "movimentum = movimentum.__main__:main" in entry_points
    assert {name.partition("/")[0].partition("-")[0] for name in names} == {"movimentum"}
    sources = {path.relative_to(ROOT).as_posix() for path in (ROOT / "movimentum").rglob("*.py")}
    assert sources <= set(names)


def test_the_wheel_has_the_notices_of_all_that_others_wrote(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        about = archive.read(next(name for name in names if name.endswith("METADATA"))).decode()
    told = {line.partition(": ")[2] for line in about.splitlines() if line.startswith("License-File: ")}
    notices = {path.relative_to(ROOT).as_posix() for path in (ROOT / "movimentum").rglob("*.LICENSE")}
    assert told == {"LICENSE", *notices}
    assert len(notices) == 3  # two fonts, and the editor of the studio
    assert {name.partition("licenses/")[2] for name in names if "dist-info/licenses/" in name} == told


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sdist of a copy of the tree in which somebody has rendered films beside the scripts."""
    copy, folder = tmp_path_factory.mktemp("copy"), tmp_path_factory.mktemp("sdist")
    for name in tracked():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, copy / name)
    for name in LEFT:
        (copy / name).write_bytes(b"left")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, copy, cwd=folder)
    return folder


LEFT = ("scripts/four-bar.gif", "scripts/four-bar.png", "scripts/four-bar.mp4", "scripts/sprites/old.gif", "poses.csv")


def tracked() -> list[str]:
    """The files of the project: those that git knows, or those of the unpacked sdist that this is."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    found = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [name for name in found.split("\0") if name and (ROOT / name).exists()]


def test_the_sdist_holds_the_whole_project_and_no_films(sdist: Path) -> None:
    (made,) = sdist.glob("*.tar.gz")
    with tarfile.open(made) as archive:
        names = {member.name.partition("/")[2]: member.mode for member in archive.getmembers()}
    assert set(names) - set(tracked()) == {"PKG-INFO", "movimentum/VERSION"}
    assert set(tracked()) - set(names) == set()
    assert names[".ci/run"] & 0o100, "it can be run"
    (wheel,) = sdist.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        assert [name for name in archive.namelist() if Path(name).name in {Path(each).name for each in LEFT}] == []


def test_what_is_built_twice_is_the_same_and_so_is_what_is_built_from_the_sdist(sdist: Path, tmp_path: Path) -> None:
    (archive,) = sdist.glob("*.tar.gz")
    (wheel,) = sdist.glob("*.whl")
    with tarfile.open(archive) as opened:
        opened.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.iterdir()
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", tmp_path / "again", unpacked, cwd=tmp_path)
    again = {path.name: path.read_bytes() for path in (tmp_path / "again").iterdir()}
    assert again == {path.name: path.read_bytes() for path in (archive, wheel)}


def test_the_wheel_renders_a_script_without_the_checkout(wheel: Path, tmp_path: Path) -> None:
    room = tmp_path / "room"
    venv.create(room, with_pip=False)
    python = room / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", wheel, cwd=tmp_path)
    site = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=tmp_path).strip()
    lent = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (Path(site) / "lent.pth").write_text("\n".join(lent) + "\n")
    where = run(python, "-c", "import movimentum; print(movimentum.__file__)", cwd=tmp_path).strip()
    assert Path(where).is_relative_to(site)
    (tmp_path / "crank.mov").write_text(CRANK)
    run(python.parent / "movimentum", "run", "crank.mov", cwd=tmp_path)
    assert run(python.parent / "movimentum", "--version", cwd=tmp_path).split()[-1] == wheel.name.split("-")[1]
    run(python.parent / "movimentum", "new", "gears", cwd=tmp_path)
    run(python.parent / "movimentum", "run", "gears.mov", "--frames", "0:2", cwd=tmp_path)
    run(python.parent / "movimentum", "examples", cwd=tmp_path)
    run(python.parent / "movimentum", "check", "movimentum-examples/walschaerts.mov", "--strict", cwd=tmp_path)
    with Image.open(tmp_path / "crank.gif") as picture:
        assert (picture.format, picture.n_frames) == ("GIF", 11)
    run(python.parent / "movimentum", "run", "crank.mov", "-o", "crank.html", cwd=tmp_path)
    assert "class MovimentumPlayer" in (tmp_path / "crank.html").read_text(encoding="utf-8")
