"""The wheel holds all that is needed: installed where the checkout is out of sight, it renders a script.

The libraries that it depends on are lent by this environment; `.ci/run` installs them as well.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
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
    assert {f"movimentum/rendering/fonts/DejaVuSans.{end}" for end in ("ttf", "LICENSE")} <= set(names)
    assert {"movimentum/vector/painter.js", "movimentum/vector/player.js", "movimentum/vector/page.css"} <= set(names)
    studio = {f"movimentum/studio/web/{name}" for name in ("index.html", "studio.css", "studio.js")}
    assert {*studio, "movimentum/studio/gallery/four-bar.mov"} <= set(names)
    assert not [name for name in names if "node_modules" in name]
    assert "movimentum = movimentum.__main__:main" in entry_points
    assert {name.partition("/")[0].partition("-")[0] for name in names} == {"movimentum"}
    sources = {path.relative_to(ROOT).as_posix() for path in (ROOT / "movimentum").rglob("*.py")}
    assert sources <= set(names)


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
    with Image.open(tmp_path / "crank.gif") as picture:
        assert (picture.format, picture.n_frames) == ("GIF", 11)
    run(python.parent / "movimentum", "run", "crank.mov", "-o", "crank.html", cwd=tmp_path)
    assert "class MovimentumPlayer" in (tmp_path / "crank.html").read_text(encoding="utf-8")
