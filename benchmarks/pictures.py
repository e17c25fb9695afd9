"""What a GIF costs, in seconds of processors, beside another version of Movimentum.

::

    python benchmarks/pictures.py [BASE]    # BASE: a tree of another version (git archive COMMIT | tar -x -C BASE)

Cold processes, interleaved, medians: bars at 1080p (500 frames), the gallery's clockwork, and a script of ten lines
beside the imports that it needs. Bars also on two processes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from measure import ROOT, Run, interleaved, machine, verdict

IMPORTS = "import numpy, lark, PIL.Image"


def bars(frames: int = 500) -> str:
    """A slider-crank and a four-bar linkage at 1080p, bars only."""
    return f"""\
.config(25, 1920, 1080) .background('white');
Crank   : .bar O = [480,640]  P = O + [160,0]   .color('steelblue') .width(14);
Rod     : .bar A = [640,640]  B = A + [620,0]   .color('darkorange') .width(14);
Slider  : .bar L = [1200,640] R = L + [140,0]   .color('dimgray') .width(40);
Short   : .bar C = [700,250]  D = C + [120,0]   .color('firebrick') .width(14);
Long    : .bar E = [0,0]      F = E + [400,0]   .color('seagreen') .width(14);
Rocker  : .bar G = [0,0]      H = G + [0,260]   .color('purple') .width(14);
@0
    Crank.O = [480,640];   Crank.angle = 36*.t;
    Rod.A = Crank.P;       Rod.B = [x,640];   x > Crank.O.x;
    Slider.L = [x - 70, 640];   Slider.angle = 0;
    Short.C = [700,250];   Short.angle = 54*.t;
    Long.E = Short.D;      Rocker.H = Long.F;   Rocker.G = [1080,250];   Rocker.H.y > Rocker.G.y;
@{(frames - 1) / 25}
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", type=Path, nargs="?")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", help="names that begin so")
    options = parser.parse_args()
    trees = {"now": ROOT} | ({"base": options.base.resolve()} if options.base else {})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "bars.mov").write_text(bars())
        films = {
            "bars": folder / "bars.mov",
            "clockwork": ROOT / "scripts" / "clockwork.mov",
            "ten lines": ROOT / "benchmarks" / "scenes" / "ten-lines.mov",
        }
        commands = {
            f"{film}, {tree}, {workers}": [
                *(sys.executable, "-m", "movimentum", "run", str(script), "--workers", workers),
                *("-o", str(folder / f"{film}-{tree}-{workers}.gif")),
            ]
            for film, script in films.items()
            for tree in trees
            for workers in (("1", "2") if film == "bars" else ("1",))
        }
        commands["imports"] = [sys.executable, "-c", IMPORTS]
        commands = {name: each for name, each in commands.items() if name.startswith(options.only or "")}
        env = {
            name: {"PYTHONPATH": str(trees[name.split(", ")[1]]), "PYTHONSAFEPATH": "1"}
            for name in commands
            if ", " in name
        }
        print(machine())
        interleaved(commands, 1, env=env)
        runs = interleaved(commands, options.rounds, env=env)
        for name, run in runs.items():
            print(f"  {name:24}  {run.cpu:8.3f} s of processors  {run.seconds:8.3f} s  {run.megabytes:6.1f} MB")
        for file in sorted(folder.glob("*-1.gif")):
            print(f"  {file.name:28} {file.stat().st_size:10,} bytes")
    _compare(runs)


def _compare(runs: dict[str, Run]) -> None:
    def ratio(what: str, above: str, below: str, limit: float, value: str = "cpu") -> None:
        if above in runs and below in runs:
            print(verdict(what, getattr(runs[above], value) / getattr(runs[below], value), limit))

    ratio("bars / base", "bars, now, 1", "bars, base, 1", 0.5)
    ratio("clockwork / base", "clockwork, now, 1", "clockwork, base, 1", 0.67)
    ratio("bars on two processes / on one (time)", "bars, now, 2", "bars, now, 1", 1 / 1.6, "seconds")
    ratio("ten lines / imports", "ten lines, now, 1", "imports", 2.3)
    ratio("ten lines / base", "ten lines, now, 1", "ten lines, base, 1", 1.0)


if __name__ == "__main__":
    main()
