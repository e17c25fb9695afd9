"""Free motion: time per step and drift, beside the greedy method without correction; and how long an import takes.

    python benchmarks/free.py [--files FOLDER] [--steps N] [--greedy N]

Every linkage (the files ``*.txt`` of FOLDER, and transformable Penrose tilings of orders 1 to 4) is drawn by its vertex
farthest from the middle, which is wished round a small circle for about N steps. Drift is the largest deviation of a
rod's length at the end, relative to it, where the coordinates were consistent to begin with (``--snap``).

The greedy method takes the null space of the Jacobian by a singular value decomposition of the whole matrix and applies
its basis vectors one after the other, each as far as it brings the vertex nearer, and corrects nothing.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks.penrose import transformable  # noqa: E402
from movimentum.interop import snapping  # noqa: E402
from movimentum.interop.linkages import Linkage, linkage_script, linkage_text, read_linkage  # noqa: E402
from movimentum.solver.path import follow as following  # noqa: E402
from movimentum.source import SourceText  # noqa: E402
from movimentum.workflow.choices import Choices  # noqa: E402
from movimentum.workflow.stages import arranged, moved, understand  # noqa: E402

FloatArray = NDArray[np.float64]
RADIUS, TURN = 0.1, 180.0
"""Of the circle, in sizes of the linkage; degrees a time unit."""


def linkages(folder: Path | None) -> Iterator[tuple[str, Linkage]]:
    """Names and linkages, coordinates repaired."""
    for path in sorted(folder.glob("*.txt")) if folder else []:
        yield path.stem, snapping.snapped(read_linkage(SourceText(path.name, path.read_text()))[0]).linkage
    for order in range(1, 5):
        yield f"tiling {order}", transformable(order)


def drawn_vertex(linkage: Linkage) -> tuple[int, float]:
    """The vertex farthest from the middle that is not fixed, and the linkage's size."""
    points = np.array(linkage.vertices)
    away = np.hypot(*(points - points.mean(axis=0)).T)
    away[list(linkage.fixed)] = -1.0
    return int(np.argmax(away)), float(np.max(np.ptp(points, axis=0)))


def script_of(linkage: Linkage, length: float) -> str:
    """The imported script with a wish that goes round for ``length`` time units."""
    vertex, size = drawn_vertex(linkage)
    i, j = next(rod for rod in linkage.rods if vertex in rod)
    x, y = linkage.vertices[vertex]
    r = RADIUS * size
    wish = f"R{i}_{j}.V{vertex} ~ [{x - r!r}, {y!r}] + [{r!r}, 0].r({TURN:g}*.t);"
    return linkage_script(linkage, "linkage").replace(".config(24)", ".config(1)") + f"{wish}\n@{length:g}\n"


def ours(linkage: Linkage, steps: int) -> tuple[int, float, float]:
    """Steps taken, seconds for each, and the drift at the end."""
    length = 1.0
    for _ in range(4):  # the steps are the solver's own choice: as long a motion as takes about so many
        source = SourceText("linkage.mov", script_of(linkage, length))
        timeline = arranged(understand(source), Choices())
        spent: list[tuple[float, int]] = []
        drift = following.drift

        def timed(*arguments: Any, drift: Any = drift, spent: list[tuple[float, int]] = spent) -> Any:
            begin = time.perf_counter()
            track = drift(*arguments)
            spent.append((time.perf_counter() - begin, len(track.tau) - 1))
            return track

        following.drift = timed  # pyright: ignore[reportAttributeAccessIssue]
        try:
            motion = moved(timeline)
        finally:
            following.drift = drift  # pyright: ignore[reportAttributeAccessIssue]
        seconds, count = max(spent, key=lambda item: item[1])
        if count >= 0.8 * steps or count == 0:
            break
        length = min(length * 1.1 * steps / count, 200.0)
    poses = motion.poses(timeline.frame_count - 1, timeline.frame_count)
    bars = {thing.name: thing for thing in timeline.scene.things}
    end: dict[int, FloatArray] = {}
    for i, j in linkage.rods:
        thing = bars[f"R{i}_{j}"]
        for anchor, vertex in zip(thing.anchors, (i, j), strict=True):
            end.setdefault(vertex, poses.world(thing.number, anchor.local)[0])
    return count, seconds / max(count, 1), drifted(linkage, np.array([end[v] for v in sorted(end)]))


def drifted(linkage: Linkage, points: FloatArray) -> float:
    """The largest relative deviation of a rod's length (vertices without rods left out)."""
    numbers = {v: k for k, v in enumerate(sorted({n for rod in linkage.rods for n in rod}))}
    rods = np.array([[numbers[i], numbers[j]] for i, j in linkage.rods])
    now = np.hypot(*(points[rods[:, 1]] - points[rods[:, 0]]).T)
    stated = np.array([linkage.length(rod) for rod in range(len(rods))])
    return float(np.max(np.abs(now / stated - 1.0)))


def greedy(linkage: Linkage, steps: int, shown: int) -> tuple[float, float]:
    """Seconds a step, and the drift after ``shown`` steps of such a size that ``steps`` go as far as ours."""
    vertex, size = drawn_vertex(linkage)
    p = np.array(linkage.vertices)
    rods, corners = np.array(linkage.rods), np.array(linkage.angles, dtype=np.intp).reshape(-1, 3)
    lengths = np.array([linkage.length(rod) for rod in range(len(rods))])
    free = np.setdiff1d(np.arange(len(p)), linkage.fixed)
    columns = (2 * free[:, None] + np.arange(2)).reshape(-1)
    place = np.searchsorted(columns, [2 * vertex, 2 * vertex + 1])
    centre = p[vertex] - [RADIUS * size, 0.0]
    begin = time.perf_counter()
    for k in range(1, shown + 1):
        jacobian = snapping.rows_of(p, rods, corners, lengths, np.radians(linkage.degrees))[1][:, columns]
        singular, right = np.linalg.svd(jacobian)[1:]
        basis = right[int(np.sum(singular > 1e-5 * singular[0])) :]
        angle = np.radians(360.0) * k / steps
        target = centre + RADIUS * size * np.array([np.cos(angle), np.sin(angle)])
        for v in basis:
            p.reshape(-1)[columns] += v * (v[place] @ (target - p[vertex]))
    used = sorted({n for rod in linkage.rods for n in rod})
    return (time.perf_counter() - begin) / shown, drifted(linkage, p[used])


def imports(name: str, linkage: Linkage) -> float:
    """Seconds that ``movimentum import`` takes from a cold process, the file repaired too."""
    from benchmarks.measure import measured, movimentum

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name.replace(' ', '-')}.txt"
        path.write_text(linkage_text(linkage))
        command = movimentum("import", str(path), "--snap", "-o", str(path.with_suffix(".mov")), "-q")
        return sorted(measured(command).seconds for _ in range(3))[1]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--files", type=Path)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--greedy", type=int, default=100, help="steps of the greedy method on large linkages")
    options = parser.parse_args()
    print(f"{'':14}{'vertices':>9}{'rods':>6}{'angles':>7}{'import':>8}   {'steps':>6}{'ms a step':>10}{'drift':>9}"
          f"   {'greedy: steps':>13}{'ms a step':>10}{'drift':>9}")  # fmt: skip
    for name, linkage in linkages(options.files):
        taken, seconds, off = ours(linkage, options.steps)
        shown = options.steps if len(linkage.vertices) < 100 else options.greedy
        slow, far = greedy(linkage, options.steps, shown)
        counts = f"{name:14}{len(linkage.vertices):9}{len(linkage.rods):6}{len(linkage.angles):7}"
        print(
            f"{counts}{imports(name, linkage):7.2f}s   {taken:6}{1e3 * seconds:10.2f}{off:9.0e}"
            f"   {shown:13}{1e3 * slow:10.2f}{far:9.0e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
