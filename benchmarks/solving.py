"""The solver, stage by stage, beside other solvers and beside the limits of what is possible.

    python benchmarks/solving.py [--adapters FOLDER] [--rounds N] [--budget S] [--chain 1,10,100,1000]
                                 [--parts stages,solvers,chain,cold] [--markdown FILE]

Mechanisms (see `mechanisms.py`) as programs in the language, 360 and 36,000 frames, one thread; all solvers in turns in
one process, medians. Chains of four-bars, each size in a process of its own. A ten-line script from cold.

FOLDER has other solvers: a module `bench_adapters` with two tables, `PEERS` and `LIMITS` (limits: the fastest known way
for that mechanism alone, written by hand), name -> f(mechanism, angles) -> {"loop": seconds, "setup": seconds,
"done": frames, "C": (done, points, 2)}, where nan marks a frame without a solution, and its variable `BUD` bounds the
seconds of a run. What is not installed is left out, and said so. Without FOLDER only our own figures are measured.
"""

# ruff: noqa: E402 (the number of threads is set before NumPy is imported)

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import argparse
import contextlib
import json
import math
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import tables
from measure import interleaved, machine, movimentum
from mechanisms import MECHANISMS, Array, Mechanism, chain
from results import OFF, Link, Result
from stages import Solved, run

HERE = Path(__file__).resolve().parent
FEW, MANY = 360, 36_000
Solver = Callable[[Mechanism, Array], dict[str, Any]]


def solvers(folder: Path | None) -> tuple[dict[str, Solver], dict[str, Solver], Any]:
    """Peers, limits, and the module they come from."""
    if folder is None:
        return {}, {}, None
    sys.path.insert(0, str(folder.resolve()))
    adapters = import_module("bench_adapters")
    limits = dict(adapters.LIMITS)
    with contextlib.suppress(ImportError):
        limits["LIM_numpy_soa_newton"] = import_module("bench_soa").soa
    return dict(adapters.PEERS), limits, adapters


def judged(name: str, m: Mechanism, points: Array, theta: Array, truth: Array | None = None) -> Result:
    """A result without times."""
    truth = m.truth(theta[: len(points)]) if truth is None else truth[: len(points)]
    far = np.abs(points[:, m.unk] - truth[:, m.unk]).max((1, 2))
    missing = np.isnan(far)
    return Result(
        name,
        frames=len(points),
        residual=m.residual(points),
        off=int((far > OFF).sum()),
        missing=int(missing.sum()),
    )


def _each(solve: Solver, m: Mechanism, theta: Array, frames: int) -> float:
    """Seconds for a frame, roughly."""
    found = solve(m, theta[:frames])
    return max(found["loop"] / max(found["done"], 1), 1e-9)


def side_by_side(
    folder: Path | None, rounds: int, budget: float, frames: int, say: Callable[[str], None]
) -> tuple[dict[str, list[Result]], dict[str, Solved]]:
    """Every solver on every mechanism in turns; ours as `Solved` of medians as well."""
    peers, limits, adapters = solvers(folder)
    if adapters is not None:
        adapters.BUD = budget
    results: dict[str, list[Result]] = {}
    ours: dict[str, Solved] = {}
    for make in MECHANISMS:
        m = make()
        theta = m.thetas(frames)
        truth = m.truth(theta)
        run(m, frames)
        alive: dict[str, Result] = {}
        table: list[Result] = []
        share: dict[str, int] = {}
        for name, solve in {**limits, **peers}.items():
            try:
                begin = time.perf_counter()
                solve(m, theta[:4])
                first_ms = (time.perf_counter() - begin) * 1e3
                each = _each(solve, m, theta, 4)
                if each * FEW < 4 * budget:  # four frames tell little of what warms up
                    each = _each(solve, m, theta, FEW)
            except Exception as failure:  # whatever a peer may raise
                table.append(Result(name, error=f"{type(failure).__name__}: {failure}"[:90]))
                continue
            share[name] = frames if name in limits else int(np.clip(budget / each, 4, frames))
            alive[name] = Result(name, first_ms=first_ms)
        times: dict[str, list[float]] = {name: [] for name in alive}
        setups: dict[str, list[float]] = {name: [] for name in alive}
        mine: list[Solved] = []
        for turn in range(rounds):
            mine.append(run(m, frames))
            for name in list(alive):
                if name in peers and turn >= max(2, rounds // 2):
                    continue  # they are many, and slow
                try:
                    found = {**limits, **peers}[name](m, theta[: share[name]])
                except Exception as failure:
                    table.append(Result(name, error=f"{type(failure).__name__}: {failure}"[:90]))
                    del alive[name]
                    continue
                times[name].append(found["loop"] / max(found["done"], 1))
                setups[name].append(found["setup"])
                if turn == 0:
                    first_ms = alive[name].first_ms
                    alive[name] = judged(name, m, found["C"], theta, truth)
                    alive[name].first_ms = first_ms
                    alive[name].note = str(found.get("note", ""))
        for name, result in alive.items():
            result.us = statistics.median(times[name]) * 1e6
            result.setup_ms = statistics.median(setups[name]) * 1e3
            table.append(result)
        medians = {
            stage: statistics.median(one.seconds[stage] for one in mine if stage in one.seconds)
            for stage in mine[0].seconds
        }
        ours[m.name] = Solved(medians, mine[0].points, mine[0].unsolved, mine[0].kernels, mine[0].nodes)
        for label, stage in (
            ("Movimentum", "solve"),
            ("Movimentum, poses", "poses"),
            ("Movimentum, poses and turns", "turns"),
        ):
            result = judged(label, m, mine[0].points, theta, truth)
            result.us = medians[stage] / frames * 1e6
            result.setup_ms = (medians["plan"] + medians["path"] + medians["first"]) * 1e3
            table.append(result)
        results[m.name] = sorted(table, key=lambda r: (math.isnan(r.us), r.us))
        say(f"{m.name}, {frames:,} frames: done")
    return results, ours


# --- chains: each in a process of its own, so that memory and crashes are its own


def chain_child(name: str, k: int, folder: Path | None, budget: float) -> None:
    """Measure one solver on one chain, and print it as JSON."""
    m = chain(k)
    theta = m.thetas(FEW)
    if name == "Movimentum":
        run(chain(1), 36)
        runs = [run(m, FEW, repeats=5) for _ in range(3 if k <= 100 else 1)]
        seconds = {stage: statistics.median(one.seconds[stage] for one in runs) for stage in runs[0].seconds}
        result = judged(name, m, runs[0].points, theta)
        result.us = seconds["solve"] / FEW * 1e6
        print(json.dumps(asdict(Link(k, result, seconds, _megabytes()))))
        return
    peers, limits, adapters = solvers(folder)
    adapters.BUD = budget
    solve = {**limits, **peers}[name]
    solve(chain(1), theta[:4])
    count = FEW if name in limits else 24
    runs = [solve(m, theta[:count]) for _ in range(3 if name in limits else 1)]
    best = min(runs, key=lambda found: found["loop"])
    result = judged(name, m, best["C"], theta)
    result.us, result.setup_ms = best["loop"] / max(best["done"], 1) * 1e6, best["setup"] * 1e3
    print(json.dumps(asdict(Link(k, result))))


def _megabytes() -> float:
    """The most memory that this process has had; on Linux its own figure, as rusage has the parent's in it."""
    try:
        status = Path("/proc/self/status").read_text()
        return next(float(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) / 2**10
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def chains(folder: Path | None, sizes: Sequence[int], patience: float, say: Callable[[str], None]) -> list[Link]:
    """Every solver on every chain; one that takes more than ``patience`` seconds is not asked for longer ones."""
    peers, limits, _ = solvers(folder)
    links: list[Link] = []
    for name in ("Movimentum", *limits, *peers):
        for k in sizes:
            command = [sys.executable, str(HERE / "solving.py"), "--child", name, "--child-size", str(k)]
            command += ["--adapters", str(folder)] if folder else []
            limit = 20 * patience if name == "Movimentum" else patience
            try:
                done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
            except subprocess.TimeoutExpired:
                links.append(Link(k, Result(name, error=f"more than {limit:g} s")))
                break
            lines = done.stdout.strip().splitlines()
            if done.returncode or not lines:
                links.append(Link(k, Result(name, error=_complaint(done.stderr) or f"crashed ({done.returncode})")))
                break
            read = json.loads(lines[-1])
            links.append(Link(read["k"], Result(**read["result"]), read["seconds"], read["megabytes"]))
        say(f"chains, {name}: done")
    return links


def _complaint(text: str) -> str:
    """The last line that names an error."""
    lines = [line.strip() for line in text.splitlines() if "Error" in line]
    return lines[-1][:90] if lines else ""


def cold(rounds: int) -> dict[str, float]:
    """Seconds from a cold process: what is imported anyway, and a ten-line script to its first picture."""
    script = str(HERE / "scenes" / "ten-lines.mov")
    picture = HERE / ".first.png"
    commands = {
        "import numpy, lark, PIL.Image": [sys.executable, "-c", "import numpy, lark, PIL.Image"],
        "ten lines, compiled and solved (check)": movimentum("check", script),
        "ten lines, first picture": movimentum("run", script, "-o", str(picture)),
    }
    try:
        interleaved(commands, 1)
        return {name: one.seconds for name, one in interleaved(commands, rounds).items()}
    finally:
        picture.unlink(missing_ok=True)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--adapters", type=Path, metavar="FOLDER")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--budget", type=float, default=1.0, help="seconds for one run of a peer")
    parser.add_argument("--patience", type=float, default=20.0, help="seconds for a peer's process on one chain")
    parser.add_argument("--chain", default="1,10,100,1000")
    parser.add_argument("--parts", default="stages,solvers,chain,cold")
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    parser.add_argument("--child-size", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        chain_child(options.child, options.child_size, options.adapters, options.budget)
        return
    parts = set(options.parts.split(","))

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    text = [tables.heading(machine(), options.adapters is not None)]
    details: list[str] = []
    if parts & {"stages", "solvers"}:
        folder = options.adapters if "solvers" in parts else None
        found = {n: side_by_side(folder, options.rounds, options.budget, n, say) for n in (FEW, MANY)}
        text.append(tables.stages(found))
        if folder is not None:
            text += [tables.side_by_side(n, results) for n, (results, _) in found.items()]
            details = [tables.details(n, results) for n, (results, _) in found.items()]
    if "chain" in parts:
        sizes = [int(k) for k in options.chain.split(",")]
        text.append(tables.chain(chains(options.adapters, sizes, options.patience, say)))
    if "cold" in parts:
        text.append(tables.cold(cold(2 * options.rounds)))
    whole = "\n\n".join(text)
    print("\n\n".join([*text, *details]))
    if options.markdown:
        tables.write(options.markdown, whole)


if __name__ == "__main__":
    main()
