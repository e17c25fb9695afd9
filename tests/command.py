"""Running the command line as a user does: in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

STILL = """\
.config(12, 60, 40);
Rod : .bar A = [10,10] B = A + [30,0];
@0 Rod.A = [10,10]; Rod.angle = 0;
"""

CRANK = """\
.config(10, 120, 80);
Crank : .bar O = [30,40] P = O + [20,0];
Rod   : .bar A = [50,40] B = A + [50,0];
@0  Crank.O = [30,40];  Crank.angle = 90*.t;
    Rod.A = Crank.P;    Rod.B = [x,40];    x > Crank.O.x;
@1
"""
"""A slider-crank of 11 frames; x = 30 + 20 cos(90 t) + sqrt(50^2 - (20 sin(90 t))^2)."""

BINDS = """\
.config(10, 120, 80);
Rod : .bar A = [30,40] B = A + [21,0];
@0  Rod.A = [30,40];  Rod.B = [30 + 40*.t, y];  y >= 40;
@1
"""
"""No solution after t = 0.525: the far end would be more than 21 away. y = 40 + sqrt(441 - (40 t)^2)."""

LONG = """\
.config(100, 400, 300);
Rod : .bar A = [200,150] B = A + [100,0];
@0 Rod.A = [200,150]; Rod.angle = 7.3*.t;
@1000
"""
"""100,001 frames: minutes of rendering, to be interrupted."""


def command(*arguments: str | Path) -> list[str]:
    """The command line as a list."""
    return [sys.executable, "-m", "movimentum", *map(str, arguments)]


def environment(extra: Mapping[str, str] | None = None) -> dict[str, str]:
    """The environment, with the checkout importable from any folder, and without what would change the output."""
    kept = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR", "COLUMNS")}
    path = os.pathsep.join([str(ROOT), *filter(None, [kept.get("PYTHONPATH")])])
    return {**kept, "PYTHONPATH": path, **(extra or {})}


def movimentum(
    *arguments: str | Path,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
    timeout: float = 120,
    stdin: str | None = None,
) -> subprocess.CompletedProcess[str]:
    """Run the command line to its end; it must never show a traceback, unless asked."""
    done = subprocess.run(
        command(*arguments),
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=cwd,
        env=environment(env),
        timeout=timeout,
        input=stdin if stdin is not None else "",
        check=False,
    )
    if "--debug" not in arguments:
        assert "Traceback" not in done.stderr + done.stdout, done.stderr
    return done
