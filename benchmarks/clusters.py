"""A film drawn by Dask workers on this machine, beside this process alone and beside processes without Dask.

    python benchmarks/clusters.py [--frames N] [--scale S] [--rounds N]

Every round runs the whole command in each way, one after the other, each in a new process; a cluster's start and end
are in its time. Ratios are medians of the rounds' ratios. The files are compared: they must have the same bytes.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks.measure import machine  # noqa: E402

WAYS = {
    "in this process": ("--workers", "1"),
    "two processes": ("--workers", "2"),
    "one Dask worker": ("--dask", "local:1"),
    "two Dask workers": ("--dask", "local:2"),
}


def drawn(options: tuple[str, ...], frames: int, scale: float, target: Path) -> float:
    """Seconds of the whole command."""
    script = ROOT / "scripts" / "jansen.mov"  # two seconds long
    asked = ["run", str(script), "-o", str(target), "--fps", f"{frames}/2", "--scale", str(scale), "-q", *options]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    began = time.perf_counter()
    subprocess.run([sys.executable, "-m", "movimentum", *asked], check=True, env=environment)
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=720)
    parser.add_argument("--scale", type=float, default=2.0)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print(machine())
    times: dict[str, list[float]] = {name: [] for name in WAYS}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.rounds):
            files: set[bytes] = set()
            for name, way in WAYS.items():
                target = Path(folder) / "film.apng"
                times[name].append(drawn(way, options.frames, options.scale, target))
                files.add(target.read_bytes())
            if len(files) > 1:
                raise SystemExit("the films differ")
    size = f"{480 * options.scale:.0f} × {440 * options.scale:.0f}"
    print(f"\n{options.frames} frames of {size} pixels, APNG, {options.rounds} rounds, the same bytes\n")
    print("| | s | of one Dask worker's | of this process's |")
    print("|---|---:|---:|---:|")
    for name, found in times.items():
        ratios = [
            statistics.median([a / b for a, b in zip(found, times[other], strict=True)])
            for other in ("one Dask worker", "in this process")
        ]
        print(f"| {name} | {statistics.median(found):.1f} | {ratios[0]:.2f} | {ratios[1]:.2f} |")


if __name__ == "__main__":
    main()
