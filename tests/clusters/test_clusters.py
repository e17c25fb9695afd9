"""Work on real worker processes: the same bytes, also where workers are killed; what can be wrong is told."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import movimentum as mv
from movimentum.cli.app import run_command_line
from movimentum.errors import UsageError
from movimentum.workflow import clusters, far_frames

distributed = pytest.importorskip("distributed")
SCRIPTS = Path(__file__).parents[2] / "scripts"
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]  # the engine's own warnings are not ours


@pytest.fixture
def two():
    """A cluster of two worker processes."""
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=60) as started,
        distributed.Client(started, set_as_default=False) as client,
    ):
        yield client


@pytest.fixture
def eager(monkeypatch):
    """The cluster is used however little there is to do."""
    monkeypatch.setattr(far_frames, "WORTH_S", 0.0)


def kill_one(client, after: float) -> threading.Thread:
    """Kill a worker process with SIGKILL in a moment."""

    def kill() -> None:
        time.sleep(after)
        pids = client.run(os.getpid)
        os.kill(next(iter(pids.values())), signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()
    return thread


def slowly(data: bytes, number: int) -> int:
    time.sleep(0.1)
    return number * clusters.unpacked(data)


def test_results_come_in_order_although_a_worker_is_killed(two):
    thread = kill_one(two, 0.5)
    found = list(clusters.done_by(two, slowly, 3, ((k,) for k in range(40))))
    thread.join()
    assert found == [3 * k for k in range(40)]


def test_a_sweep_loses_nothing_with_a_worker(two):
    script = mv.load(SCRIPTS / "klann.mov")
    values, measure = {"u": np.linspace(150, 190, 60)}, {"lift": ".range(Leg.F.y)"}
    here = script.sweep(values, measure=measure)
    thread = kill_one(two, 0.3)
    there = script.sweep(values, measure=measure, client=two)
    thread.join()
    np.testing.assert_allclose(there["lift"], here["lift"], rtol=1e-9)
    assert there.outcome.tolist() == here.outcome.tolist()


@pytest.mark.parametrize("suffix", ["gif", "apng"])
def test_a_film_has_the_same_bytes(eager, tmp_path, suffix):
    script = str(SCRIPTS / "jansen.mov")
    one, other = tmp_path / f"one.{suffix}", tmp_path / f"other.{suffix}"
    assert run_command_line(["run", script, "-o", str(one), "--workers", "1", "-q"]) == 0
    assert run_command_line(["run", script, "-o", str(other), "--dask", "local:2", "-q"]) == 0
    assert one.read_bytes() == other.read_bytes()


def test_a_film_with_a_sprite_and_a_trace_survives_a_worker(eager, tmp_path, monkeypatch, two):
    from contextlib import contextmanager

    @contextmanager
    def given(address, say):
        yield two

    monkeypatch.setattr(far_frames, "cluster", given)
    script = str(SCRIPTS / "slider-crank.mov")
    one, other = tmp_path / "one.apng", tmp_path / "other.apng"
    options = ["--trace", "Rod.B", "--fps", "60", "--scale", "1.5", "-q"]
    assert run_command_line(["run", script, "-o", str(one), *options]) == 0
    thread = kill_one(two, 0.3)
    assert run_command_line(["run", script, "-o", str(other), *options, "--dask", "local"]) == 0
    thread.join()
    assert one.read_bytes() == other.read_bytes()


def test_a_short_film_is_drawn_here(tmp_path, capsys):
    script = str(SCRIPTS / "trammel.mov")
    assert run_command_line(["run", script, "-o", str(tmp_path / "t.gif"), "--dask", "local:2"]) == 0
    assert "done here" in capsys.readouterr().err


def test_a_scheduler_that_does_not_answer(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(clusters, "TIMEOUT_S", 1)
    script = str(SCRIPTS / "klann.mov")
    arguments = ["sweep", script, "--vary", "u=150:190:5", "--dask", "tcp://127.0.0.1:9"]
    assert run_command_line(arguments) == 2
    assert "no scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err


def test_workers_with_another_version(two, monkeypatch):
    monkeypatch.setattr(clusters, "own_version", lambda: "0.0.0")
    with pytest.raises(UsageError, match="workers run another version of Movimentum"):
        clusters._checked(two)


def test_a_scheduler_without_workers(monkeypatch):
    monkeypatch.setattr(clusters, "TIMEOUT_S", 1)
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=60) as started,
        distributed.Client(started, set_as_default=False) as client,
        pytest.raises(UsageError, match="has no workers"),
    ):
        clusters._checked(client)


def dies(data: bytes, number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_work_that_kills_every_worker_is_given_up(two):
    with pytest.raises(UsageError, match="died on the same piece"):
        list(clusters.done_by(two, dies, None, ((k,) for k in range(2))))


def test_interrupted_nothing_is_left_running(tmp_path):
    """Ctrl-C in the middle: the exit code, what is kept, and no process."""
    path = SCRIPTS / "locomotive.mov"  # each variant takes some seconds
    target = tmp_path / "t.csv"
    arguments = ["sweep", str(path), "--vary", "rod=203:207:60", "--dask", "local:2", "-o", str(target)]
    environment = {**os.environ, "PYTHONPATH": str(SCRIPTS.parent)}
    with subprocess.Popen(
        [sys.executable, "-m", "movimentum", *arguments], stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        time.sleep(6.0)
        children = _children(process.pid)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30)
    assert process.returncode == 130, told
    assert not target.exists()
    deadline = time.monotonic() + 10
    while any(map(_runs, children)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(map(_runs, children))


def _children(pid: int) -> list[int]:
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False).stdout
    own = [int(word) for word in found.split()]
    return [*own, *(each for child in own for each in _children(child))]


def _runs(pid: int) -> bool:
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().split()[2] != "Z"
    except OSError:
        return False
