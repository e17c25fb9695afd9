"""Script to file, from cold: parsed, solved, rendered, encoded.

    python benchmarks/end_to_end.py [--reference render_reference.py] [--peers PYTHON] [--rounds N] [--long N]

The wheels scene against a reference program that draws the same picture without a language or a solver (called as
`REFERENCE OUT.gif FRAMES PROCESSES`), on one and on two processes; memory for 240 and for 10,000 frames; and a
bars-only slider-crank of 240 frames against Manim and matplotlib's FuncAnimation, where PYTHON has them. A program
that is not there is left out, and said so.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from measure import Run, interleaved, machine, measured, movimentum, table, verdict
from scenes.make import script, wheels

HERE = Path(__file__).resolve().parent
FRAMES = 240


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reference", type=Path)
    parser.add_argument("--peers", default=sys.executable)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--long", type=int, default=10_000, help="frames of the memory test; 0 leaves it out")
    options = parser.parse_args()
    wheels(HERE / "scenes" / "sprites")
    print(machine())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _wheels(folder, options.reference, options.rounds, options.long)
        _bars(folder, options.peers, options.rounds)


def _scene(folder: Path, frames: int) -> str:
    path = folder / f"wheels{frames}.mov"
    path.write_text(script(frames, str(HERE / "scenes" / "sprites")))
    return str(path)


def _wheels(folder: Path, reference: Path | None, rounds: int, long: int) -> None:
    short = _scene(folder, FRAMES)
    commands: dict[str, list[str]] = {}
    for processes in ("1", "2"):
        commands[f"movimentum, {processes}"] = movimentum(
            "run", short, "-o", f"{folder}/m{processes}.gif", "--workers", processes
        )
        if reference is not None:
            commands[f"reference, {processes}"] = [
                sys.executable, str(reference), f"{folder}/r{processes}.gif", str(FRAMES), processes
            ]  # fmt: skip
    commands["movimentum, as many as pay"] = movimentum("run", short, "-o", f"{folder}/m.gif")
    interleaved(commands, 1)
    runs = interleaved(commands, rounds)
    print(f"\nfive sprites, five lines, {FRAMES} frames of 600x400, from cold")
    print(table(runs))
    if reference is None:
        print("  (no --reference: nothing to compare with)")
    else:
        for processes in ("1", "2"):
            ratio = runs[f"movimentum, {processes}"].seconds / runs[f"reference, {processes}"].seconds
            print(verdict(f"movimentum / reference on {processes}", ratio, 1.25))
    sizes = {file.name: file.stat().st_size / 1e6 for file in sorted(folder.glob("*.gif"))}
    print("  " + ", ".join(f"{file} {size:.2f} MB" for file, size in sizes.items()))
    print(verdict(f"memory, {FRAMES} frames", runs["movimentum, as many as pay"].megabytes, 90, " MB"))
    if long:
        run = measured(movimentum("run", _scene(folder, long), "-o", f"{folder}/long.gif"))
        print(verdict(f"memory, {long:,} frames ({run.seconds:.1f} s)", run.megabytes, 90, " MB"))


def _bars(folder: Path, python: str, rounds: int) -> None:
    scene = str(HERE / "scenes" / "slider-crank.mov")
    commands = {"movimentum": movimentum("run", scene, "-o", f"{folder}/bars.gif")}
    for peer, module in (("matplotlib", "matplotlib"), ("manim", "manim")):
        if subprocess.run([python, "-c", f"import {module}"], capture_output=True, check=False).returncode:
            print(f"  ({peer} is not installed for {python}: left out)")
            continue
        commands[peer] = [python, str(HERE / "peers" / f"{peer}_slider_crank.py"), f"{folder}/{peer}.gif"]
    interleaved(commands, 1)
    runs: dict[str, Run] = interleaved(commands, rounds)
    print(f"\nslider-crank of bars, {FRAMES} frames of 600x400, from cold")
    print(table(runs))
    for peer, factor in (("manim", 2.5), ("matplotlib", 4.0)):
        if peer in runs:
            ratio = runs[peer].seconds / runs["movimentum"].seconds
            print(f"  {'ok  ' if ratio >= factor else 'MISS'}  {ratio:.1f} times as fast as {peer} (target {factor})")


if __name__ == "__main__":
    main()
