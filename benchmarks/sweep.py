"""Variants a second: `sweep` beside a loop of `solve`, and beside loops as they are written with other tools.

    python benchmarks/sweep.py [--variants N] [--rounds N]

Every round measures all ways one after the other; ratios are medians of the rounds' ratios. The loops solve fewer
variants. The work is the same for all: 50 frames (a turn), the width of a coupler point's path as the measure; what our
loop and our sweep measure is compared. `pylinkage` is used if it is installed; the PMKS-style loop finds positions dyad
by dyad, frame by frame, with circles that are cut, as such tools do in their inner loop, here in Python.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import movimentum as mv  # noqa: E402
from benchmarks.measure import machine  # noqa: E402
from movimentum.variants.axes import Axis, VariantGrid  # noqa: E402
from movimentum.variants.measures import read_measures  # noqa: E402
from movimentum.variants.sweep import SweepJob  # noqa: E402
from movimentum.workflow.choices import Choices  # noqa: E402

Floats = NDArray[np.float64]

FOUR_BAR = """.config(25); .let R = 50; .let L = 150;
Crank : .bar A = [130,110] B = A + [R,0];  Coupler : .plate B = [0,0] P = B + [70,90] C = B + [L,0];
Rocker : .bar C = [0,0] D = C - [0,130];
@0 Crank.A = [130,110]; Crank.angle = 180*.t; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [310,110];
   Rocker.C.y > Rocker.D.y;
@2 .loop;"""
TRIAD = """.config(25); .let L = 120; .let s = 1;
Base : .plate A=[0,0] B=[300,0] C=[150,260];   Plat : .plate A=[0,0] B=[60*s,0] C=[30*s,52*s];
R1 : .bar P=[0,0] Q=[L,0];   R2 : .bar P=[0,0] Q=[L,0];   R3 : .bar P=[0,0] Q=[L,0];
K1 : .bar P=[0,0] Q=[40,0];  K2 : .bar P=[0,0] Q=[40,0];  K3 : .bar P=[0,0] Q=[40,0];
@0 Base.A=[50,50]; Base.angle=0;
   K1.P=Base.A; K1.angle=30+40*.sin(90*.t); K2.P=Base.B; K2.angle=100+20*.sin(90*.t); K3.P=Base.C; K3.angle=250;
   R1.P=K1.Q; R2.P=K2.Q; R3.P=K3.Q; R1.Q=Plat.A; R2.Q=Plat.B; R3.Q=Plat.C;
@2"""


@dataclass(frozen=True)
class Family:
    name: str
    text: str
    names: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    measure: str
    point: str
    share: float  # of the variants that are asked for: of slow ones fewer
    loop: int


SWUNG = TRIAD.replace("30+40*.sin", "30+120*.sin").replace("100+20*.sin", "100+60*.sin")
FAILING = ((130, 150), (116, 146), (110, 140), (80, 105))
"""Lengths of the triad's legs, so that some, many or all variants fail."""
JANSEN = (ROOT / "scripts" / "jansen.mov").read_text()
PLANETARY = ".let w = 240; .let q = 25; " + (ROOT / "scripts" / "planetary.mov").read_text().replace(
    "240*.t", "w*.t"
).replace("[0, 25]", "[0, q]")
PENDULUM = """.config(25); .let L = 100; .let a0 = 40;   Rod : .bar O=[0,0] P=[0,-L];
@0 Rod.O = [200,200]; Rod.angle = a; w = .i(-981*180/.pi/L*.sin(a)); a = a0 + .i(w);
@2"""
THROWN = """.config(25); .let L = 110; .let g = 300;   Bar : .bar P=[0,0] M=P+[L/2,0] Q=P+[L,0];
@0 Bar.angle = 20*.t; Bar.M = [200,200] + .i([60,90] + .i([0,-g*.cos(30*.t)]));
@2"""
FAMILIES = (
    Family(
        "four-bar (a dyad)", FOUR_BAR, ("R", "L"), (20, 140), (60, 200), ".range(Coupler.P.x)", "Coupler.P.x", 1, 12
    ),
    Family("Jansen's leg (five dyads)", JANSEN, ("u",), (2.9,), (3.1,), ".range(ghi.W.x)", "ghi.W.x", 0.5, 8),
    Family("planetary gears", PLANETARY, ("w", "q"), (200, 20), (260, 30), ".range(Mark.O.x)", "Mark.O.x", 0.1, 4),
    Family("pendulum", PENDULUM, ("L", "a0"), (80, 20), (120, 60), ".range(Rod.P.x)", "Rod.P.x", 0.1, 4),
    Family("thrown bar (integrals)", THROWN, ("L", "g"), (80, 200), (120, 400), ".range(Bar.Q.y)", "Bar.Q.y", 0.1, 4),
    Family("3-RRR loop (a triad)", TRIAD, ("L", "s"), (118, 0.9), (140, 1.1), ".range(Plat.A.x)", "Plat.A.x", 0.1, 4),
)


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    began = time.perf_counter()
    result = work()
    return time.perf_counter() - began, result


def swept(family: Family, values: Floats) -> tuple[float, Floats, float]:
    """Seconds, the measure of each variant, and the share that was solved together."""
    source = mv.loads(family.text).source
    job = SweepJob(
        source, Choices(), VariantGrid((Axis(family.names, values),)), read_measures([("w", family.measure)])
    )

    def work() -> tuple[Any, Any]:
        solver = job.family()
        return solver.rows(np.arange(len(values))), solver

    seconds, (rows, solver) = timed(work)
    return seconds, rows.measures[:, 0], solver.together / (solver.together + solver.alone)


def looped(family: Family, values: Floats) -> tuple[float, Floats]:
    def work() -> list[float]:
        found: list[float] = []
        for row in values.tolist():
            motion = mv.loads(family.text, **dict(zip(family.names, row, strict=True))).solve()
            found.append(float(np.ptp(motion[family.point])))
        return found

    seconds, found = timed(work)
    return seconds, np.array(found)


def cut(ax: float, ay: float, ra: float, bx: float, by: float, rb: float) -> tuple[float, float]:
    """The left intersection of two circles, seen from A to B."""
    dx, dy = bx - ax, by - ay
    d2 = dx * dx + dy * dy
    along = (ra * ra - rb * rb + d2) / (2.0 * d2)
    across = math.sqrt(max(ra * ra / d2 - along * along, 0.0))
    return ax + along * dx - across * dy, ay + along * dy + across * dx


def pmks(values: Floats, frames: int = 50) -> tuple[float, Floats]:
    def work() -> list[float]:
        found: list[float] = []
        for r, length in values.tolist():
            low, high = math.inf, -math.inf
            for k in range(frames):
                turn = 2.0 * math.pi * k / frames
                bx, by = 130.0 + r * math.cos(turn), 110.0 + r * math.sin(turn)
                cx, cy = cut(bx, by, length, 310.0, 110.0, 130.0)
                x = bx + (70.0 * (cx - bx) - 90.0 * (cy - by)) / length
                low, high = min(low, x), max(high, x)
            found.append(high - low)
        return found

    seconds, found = timed(work)
    return seconds, np.array(found)


def pylinkage(values: Floats, frames: int = 50) -> tuple[float, Floats] | None:
    try:
        from pylinkage.actuators import Crank
        from pylinkage.components import Ground
        from pylinkage.dyads import RRRDyad
        from pylinkage.simulation import Linkage
    except ImportError:
        return None

    def work() -> list[float]:
        found: list[float] = []
        for r, length in values.tolist():
            a, d = Ground(130.0, 110.0), Ground(310.0, 110.0)
            crank = Crank(a, r, angular_velocity=2.0 * math.pi / frames, initial_angle=-2.0 * math.pi / frames)
            start = cut(130.0 + r, 110.0, length, 310.0, 110.0, 130.0)
            pin = RRRDyad(crank.output, d, length, 130.0, *start)
            linkage = Linkage([a, d, crank, pin])
            points = np.array([[crank.output.position, pin.position] for _ in linkage.step(frames)], dtype=np.float64)
            b, c = points[:, 0], points[:, 1]
            found.append(float(np.ptp(b[:, 0] + (70.0 * (c - b)[:, 0] - 90.0 * (c - b)[:, 1]) / length)))
        return found

    seconds, found = timed(work)
    return seconds, np.array(found)


def median(values: list[float]) -> float:
    return statistics.median(values)


def measure(family: Family, variants: int, rounds: int) -> None:
    count = max(200, round(variants * family.share))
    generator = np.random.default_rng(1)
    times: dict[str, list[float]] = {}
    off = together = 0.0
    for _ in range(rounds):
        values = generator.uniform(family.low, family.high, (count, len(family.names)))
        seconds, widths, together = swept(family, values)
        times.setdefault("sweep", []).append(seconds / count)
        few = values[: family.loop]
        seconds, expected = looped(family, few)
        times.setdefault("loop of solve", []).append(seconds / len(few))
        off = max(off, float(np.max(np.abs(widths[: len(few)] - expected) / expected)))
        if family.text is FOUR_BAR:
            for name, other in (("PMKS-style loop", pmks), ("pylinkage", pylinkage)):
                found = other(values[:50])
                if found is not None:
                    times.setdefault(name, []).append(found[0] / 50)
                    off = max(off, float(np.max(np.abs(found[1] - widths[:50]) / widths[:50])))
    print(f"\n{family.name}: {count:,} variants, {together:.1%} together; differences up to {off:.1e}\n")
    print("| | ms a variant | variants a second | of sweep's |")
    print("|---|---:|---:|---:|")
    for name, found in times.items():
        ratio = median([b / a for a, b in zip(times["sweep"], found, strict=True)])
        print(f"| {name} | {1e3 * median(found):.3g} | {1 / median(found):,.0f} | {ratio:.3g} |")


def measure_failing(rounds: int, count: int = 600) -> None:
    """A triad whose cranks swing far: ms a variant, where few variants fail and where many do."""
    found: dict[tuple[int, int], list[tuple[float, Any, float]]] = {}
    alone: dict[tuple[int, int], list[float]] = {}
    generator = np.random.default_rng(2)
    for _ in range(rounds):
        for low, high in FAILING:
            values = generator.uniform((low, 0.9), (high, 1.1), (count, 2))
            axis = Axis(("L", "s"), values)
            job = SweepJob(
                mv.loads(SWUNG).source, Choices(), VariantGrid((axis,)), read_measures([("w", ".range(Plat.A.x)")])
            )
            solver = job.family()
            seconds, rows = timed(lambda solver=solver: solver.rows(np.arange(count)))
            shares = np.bincount(rows.outcomes, minlength=4) / count
            found.setdefault((low, high), []).append((seconds / count, shares, solver.alone / count))
            single = job.family()
            seconds, _ = timed(
                lambda single=single, values=values: [
                    single.variants.row(dict(zip(("L", "s"), row, strict=True))) for row in values[:6].tolist()
                ]
            )
            alone.setdefault((low, high), []).append(seconds / 6)
    print(f"\n3-RRR loop that swings far: {count} variants, 51 frames\n")
    print("| L | bind | cannot be assembled | ms a variant | of the first row's | one by one | by themselves |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    first = [seconds for seconds, _, _ in found[FAILING[0]]]
    for (low, high), rounds_of in found.items():
        shares = np.mean([share for _, share, _ in rounds_of], axis=0)
        ratio = median([seconds / base for (seconds, _, _), base in zip(rounds_of, first, strict=True)])
        own = 1e3 * median([seconds for seconds, _, _ in rounds_of])
        by_itself = float(np.mean([each for _, _, each in rounds_of]))
        print(
            f"| {low} to {high} | {shares[1]:.0%} | {shares[2]:.0%} | {own:.1f} | {ratio:.2f} | "
            f"{1e3 * median(alone[low, high]):.0f} ms | {by_itself:.1%} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--variants", type=int, default=20_000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print(machine())
    for family in FAMILIES:
        measure(family, options.variants, options.rounds)
    measure_failing(options.rounds)


if __name__ == "__main__":
    main()
