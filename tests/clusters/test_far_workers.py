"""A scheduler and workers as separate processes, which share no folder with the command: `--dask tcp://…`."""

from __future__ import annotations

import csv
import os
import shutil
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from movimentum.cli.app import run_command_line
from movimentum.workflow import far_frames

distributed = pytest.importorskip("distributed")
ROOT = Path(__file__).parents[2]
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]  # the engine's own warnings are not ours

PART = """.let base = 130;
.part Rocking(len) { Bar : .bar C = [0,0] D = C - [0,len]; }
"""
SCRIPT = """.include 'parts/rocker.mov';
.config(25, 400, 300);  .let R = 50;
Backdrop : 'pictures/plain.png' O = [0,0];
Wheel : 'pictures/plain.svg#hub' C = #hub;
Crank : .bar A = [130,110] B = A + [R,0];  Coupler : .plate B = [0,0] P = B + [70,90] C = B + [150,0];
Rocker : Rocking(base);
@0 Crank.A = [130,110]; Crank.angle = 180*.t; Coupler.B = Crank.B; Rocker.Bar.C = Coupler.C; Rocker.Bar.D = [310,110];
   Rocker.Bar.C.y > Rocker.Bar.D.y;  Wheel.C = Crank.A;  Wheel.angle = Crank.angle;
@1 Crank.angle = 180;
@2
"""
DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" width="60" height="60">
<g id="hub"><circle cx="30" cy="30" r="25" fill="teal"/><rect x="28" y="5" width="4" height="20"/></g></svg>"""


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """The address of a scheduler with two workers, each a process in an empty folder of its own."""
    with ExitStack() as stack:

        def started(*arguments: str, told: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "dask", *arguments]
            environment = {**os.environ, "PYTHONPATH": str(ROOT)}
            process = subprocess.Popen(
                command, cwd=tmp_path_factory.mktemp("empty"), env=environment, stderr=told, text=True
            )
            stack.callback(process.wait, 20)
            stack.callback(process.terminate)
            return process

        scheduler = started("scheduler", "--port", "0", "--host", "127.0.0.1", "--no-dashboard", told=subprocess.PIPE)
        assert scheduler.stderr is not None
        address = next(line.split()[-1] for line in scheduler.stderr if "Scheduler at:" in line)
        for _ in range(2):
            started("worker", address, "--nthreads", "1", "--no-dashboard")
        with distributed.Client(address) as client:
            client.wait_for_workers(2, timeout=120)  # a busy machine takes longer to start them than a user waits
        yield address


@pytest.fixture
def script(tmp_path, monkeypatch):
    """A script with an included file and pictures; it is named as users do, from its folder's parent."""
    from PIL import Image

    folder = tmp_path / "engine"
    (folder / "parts").mkdir(parents=True)
    (folder / "pictures").mkdir()
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    (folder / "parts" / "rocker.mov").write_text(PART)
    (folder / "pictures" / "plain.svg").write_text(DRAWING)
    Image.linear_gradient("L").convert("RGB").save(folder / "pictures" / "plain.png")
    (folder / "engine.mov").write_text(SCRIPT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(far_frames, "WORTH_S", 0.0)
    return "engine/engine.mov"


def gone_when_sent(monkeypatch) -> None:
    """The script's folder is no more when workers begin: what they open there is missing."""
    from movimentum.workflow import clusters

    kept = clusters.shared_future

    def sent(client, value):
        shutil.move("engine", "gone")
        return kept(client, value)

    monkeypatch.setattr(clusters, "shared_future", sent)


@pytest.mark.parametrize("suffix", ["gif", "apng", "webp", "mp4", "webm", "png"])
def test_a_film_has_the_same_bytes_on_machines_without_its_files(scheduler, script, monkeypatch, suffix):
    pytest.importorskip("resvg_py")
    if suffix in ("mp4", "webm"):
        pytest.importorskip("av")
    name = f"%02d.{suffix}" if suffix == "png" else f"film.{suffix}"
    assert run_command_line(["run", script, "-o", f"here/{name}", "--workers", "1", "-q"]) == 0
    gone_when_sent(monkeypatch)
    assert run_command_line(["run", script, "-o", f"there/{name}", "--dask", scheduler, "-q"]) == 0
    here, there = ({path.name: path.read_bytes() for path in Path(folder).iterdir()} for folder in ("here", "there"))
    assert here == there
    assert len(here) == (51 if suffix == "png" else 1)


def test_a_sweep_on_machines_without_its_files(scheduler, script, monkeypatch):
    pytest.importorskip("resvg_py")
    asked = ["sweep", script, "--vary", "R=30:60:40", "--vary", "base=120,130", "--measure", "w = .range(Coupler.P.x)"]
    assert run_command_line([*asked, "-o", "here.csv", "-q"]) == 0
    gone_when_sent(monkeypatch)
    assert run_command_line([*asked, "-o", "there.csv", "-q", "--dask", scheduler]) == 0
    here, there = (list(csv.DictReader(Path(name).read_text().splitlines())) for name in ("here.csv", "there.csv"))
    assert len(here) == 80
    assert {row["outcome"] for row in here} == {"ok"}
    for a, b in zip(here, there, strict=True):
        assert (a["R"], a["base"], a["outcome"]) == (b["R"], b["base"], b["outcome"])
        assert float(a["w"]) == pytest.approx(float(b["w"]), rel=1e-9)


def test_a_variant_with_a_picture_that_the_script_itself_does_not_use(scheduler, script, capsys):
    path = Path(script)
    more = ".let n = 0;  .for k = 1..n { Extra[k] : 'pictures/plain.png' O = [9*k,0]; }\n@0 Crank.A"
    path.write_text(path.read_text().replace("@0 Crank.A", more, 1))
    asked = ["sweep", script, "--vary", "n=0:15:16", "--measure", "w = .range(Coupler.P.x)"]
    path.write_text(path.read_text().replace("Backdrop : 'pictures/plain.png' O = [0,0];", ""))
    assert run_command_line([*asked, "-o", "here.csv"]) == 0
    capsys.readouterr()
    assert run_command_line([*asked, "-o", "there.csv", "--dask", scheduler]) == 2
    told = capsys.readouterr().err
    assert "error[usage/dask]" in told
    assert "engine/pictures/plain.png" in told
    assert not Path("there.csv").exists()
    assert run_command_line([*asked, "-o", "there.csv", "--dask", scheduler, "--set", "n=1"]) == 0  # as told
