"""The solver's figures as Markdown tables (which read well on a terminal too)."""

from __future__ import annotations

import importlib.metadata
import math
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from results import Link, Result
    from stages import Solved

PEERS = ("pylinkage", "numba", "slvs", "python-solvespace", "py-slvs", "mechanism", "pyslvs")
STAGES = ("parse", "scene", "plan", "code", "path", "first", "solve", "poses", "turns")


def number(value: float) -> str:
    """Three significant digits, or a dash."""
    if math.isnan(value):
        return "–"
    if value == 0.0 or abs(value) >= 1000:
        return f"{value:,.0f}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(abs(value))))}f}"


def _power(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.0e}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [list(head), *[list(row) for row in rows]]
    widths = [max(len(line[c]) for line in lines) for c in range(len(head))]

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)) + " |"

    return "\n".join([line(lines[0]), "|" + "|".join("-" * (w + 2) for w in widths) + "|", *map(line, lines[1:])])


def heading(machine: str, with_peers: bool) -> str:
    """When and on what."""
    text = f"{datetime.now(UTC):%Y-%m-%d}. {machine}. One thread."
    if not with_peers:
        return text
    versions: list[str] = []
    for name in PEERS:
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{name} not installed")
    return f"{text} Peers: {', '.join(versions)}."


def stages(found: Mapping[int, tuple[Mapping[str, Sequence[Result]], Mapping[str, Solved]]]) -> str:
    """Ours, stage by stage, in milliseconds."""
    rows: list[list[str]] = []
    for frames, (results, ours) in found.items():
        for name, one in ours.items():
            ms = [number(one.seconds[stage] * 1e3) for stage in STAGES]
            each = number(one.seconds["solve"] / frames * 1e6)
            kernels = ", ".join(f"{count} {kernel}" for kernel, count in one.kernels.items() if kernel != "assign")
            right = next(r for r in results[name] if r.solver == "Movimentum")
            wrong = f"{right.off + right.missing:,}"
            rows.append([name, f"{frames:,}", *ms, each, str(one.nodes), kernels, _power(right.residual), wrong])
    head = ["ms", "frames", *STAGES, "solve, µs/frame", "path nodes", "kernels", "residual", "wrong frames"]
    return "### Our stages\n\n" + _table(head, rows)


def _limit(results: Sequence[Result]) -> float:
    """The fastest limit that is right everywhere."""
    times = [r.us for r in results if r.solver.startswith("LIM") and not r.error and not r.off and not r.missing]
    return min(times, default=math.nan)


def side_by_side(frames: int, found: Mapping[str, Sequence[Result]]) -> str:
    """All solvers on all mechanisms: a row for each solver."""
    limits = {name: _limit(results) for name, results in found.items()}
    by_solver: dict[str, dict[str, Result]] = {}
    for name, results in found.items():
        for r in results:
            if not r.error:
                by_solver.setdefault(r.solver, {})[name] = r

    def rank(solver: str) -> tuple[int, float]:
        kind = 0 if solver.startswith("Movimentum") else 1 if solver.startswith("LIM") else 2
        ratios = [math.log(r.us / limits[name]) for name, r in by_solver[solver].items()]
        return kind, sum(ratios) / len(ratios)

    rows: list[list[str]] = []
    for solver in sorted(by_solver, key=rank):
        row = [solver]
        for name in found:
            r = by_solver[solver].get(name)
            row.append("" if r is None else f"{number(r.us)} ({number(r.us / limits[name])}×)")
        mine = by_solver[solver].values()
        wrong, done = sum(r.off + r.missing for r in mine), sum(r.frames for r in mine)
        row += [_power(max(r.residual for r in mine)), f"{wrong:,} of {done:,}"]
        row.append(number(max(r.setup_ms for r in mine)))
        rows.append(row)
    head = ["µs/frame (× the best limit)", *found, "largest residual", "wrong frames", "set-up, ms"]
    failed = sorted({r.solver for results in found.values() for r in results if _absent(r)})
    text = f"### {frames:,} frames\n\n" + _table(head, rows)
    return text + ("\n\nNot installed: " + ", ".join(failed) + "." if failed else "")


def _absent(r: Result) -> bool:
    return r.error.startswith(("ModuleNotFoundError", "ImportError"))


def details(frames: int, found: Mapping[str, Sequence[Result]]) -> str:
    """The same, a table for each mechanism, with all that is known of each run."""
    parts: list[str] = []
    for name, results in found.items():
        limit = _limit(results)
        rows = [
            [
                r.solver, number(r.us), number(r.us / limit), number(r.setup_ms), number(r.first_ms), f"{r.frames:,}",
                _power(r.residual), f"{r.off:,}", f"{r.missing:,}", r.note
            ]
            for r in results if not r.error
        ]  # fmt: skip
        head = [name, "µs/frame", "× limit", "set-up, ms", "first call, ms", "frames", "residual", "off", "missing", ""]
        text = _table(head, rows)
        failed = [f"{r.solver} ({r.error})" for r in results if r.error]
        if failed:
            text += "\n\nNot measured: " + "; ".join(failed).replace("|", "/") + "."
        parts.append(text)
    return f"### {frames:,} frames, in detail\n\n" + "\n\n".join(parts)


def chain(links: Sequence[Link]) -> str:
    """The chains: ours by stage, then all solvers."""
    rows: list[list[str]] = []
    before: Link | None = None
    for link in links:
        if link.result.solver != "Movimentum":
            continue
        if link.seconds is None:
            rows.append([str(link.k), link.result.error, *[""] * 12])
            continue
        s = link.seconds
        growth = "–"
        s["first"] = 0.0 if math.isnan(s["first"]) else s["first"]
        if before is not None and before.seconds is not None and link.k > before.k:
            one, two = (sum(x[t] for t in ("parse", "scene", "plan", "path", "first")) for x in (before.seconds, s))
            growth = f"{math.log(two / one) / math.log(link.k / before.k):.2f}"
        ms = [number(s[t] * 1e3) for t in ("parse", "scene", "plan", "code", "path", "first")]
        each = [number(s[t] / 360 * 1e6) for t in ("solve", "poses")]
        r = link.result
        rows.append(
            [
                f"{link.k:,}",
                *ms,
                growth,
                *each,
                _power(r.residual),
                str(r.off),
                str(r.missing),
                f"{link.megabytes:.0f}",
            ]
        )
        before = link
    head = [
        "k", "parse, ms", "scene, ms", "plan, ms", "of it code", "path, ms", "first, ms", "exponent", "solve, µs/frame",
        "poses, µs/frame", "residual", "off", "missing", "MB",
    ]  # fmt: skip
    text = "### Chains of k four-bars, 360 frames\n\n" + _table(head, rows)
    text += "\n\nExponent: of k, in the time from the text to the path, since the row above; 1 is linear."
    sizes = sorted({link.k for link in links})
    absent = {link.result.solver for link in links if _absent(link.result)}
    names = [name for name in dict.fromkeys(link.result.solver for link in links) if name not in absent]
    if len(names) > 1:
        cells: list[list[str]] = []
        for name in names:
            row = [name]
            for k in sizes:
                one = next((x.result for x in links if x.result.solver == name and x.k == k), None)
                if one is None:
                    row.append("")
                elif one.error:
                    row.append(one.error.replace("|", "/").partition("(")[0][:40])
                else:
                    wrong = one.off + one.missing
                    row.append(number(one.us) + (f" ({wrong} of {one.frames} wrong)" if wrong else ""))
            cells.append(row)
        text += "\n\n" + _table(["µs/frame", *(f"k = {k:,}" for k in sizes)], cells)
    return text


def cold(seconds: Mapping[str, float]) -> str:
    """The cold processes."""
    base = next(iter(seconds.values()))
    rows = [[name, f"{value:.3f}", f"{value / base:.2f}"] for name, value in seconds.items()]
    return "### From a cold process\n\n" + _table(["", "s", "× the imports"], rows)


def write(path: Path, text: str, what: str = "measured") -> None:
    """Put ``text`` between the marks for ``what`` in ``path``, or make a file of it where there are none."""
    begin, end = f"<!-- {what}: begin -->", f"<!-- {what}: end -->"
    before, after = "# Benchmarks of the solver\n\n", "\n"
    if path.exists():
        old = path.read_text(encoding="utf-8")
        if begin in old and end in old:
            before, after = old[: old.index(begin)], old[old.index(end) + len(end) :]
    path.write_text(f"{before}{begin}\n{text}\n{end}{after}", encoding="utf-8")
