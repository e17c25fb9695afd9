"""Linkages of rods as scripts, and what is true of them by their rigidity matrix."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.analysis.examine import Examination, examine
from movimentum.analysis.report import StepReport
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, understand

Points = Sequence[tuple[float, float]]
Rods = Sequence[tuple[int, int]]


def rod_script(
    points: Points, rods: Rods, fixed: Iterable[int] = (), more: str = "", *, backwards: bool = False
) -> str:
    """Rod ``R0_3`` is from vertex 0 to vertex 3, which are its anchors ``V0`` and ``V3``."""
    ends: dict[int, str] = {}
    things: list[str] = []
    stated: list[str] = []
    for i, j in rods:
        name = f"R{i}_{j}"
        places = " ".join(f"V{n} = [{points[n][0]!r}, {points[n][1]!r}]" for n in (i, j))
        things.append(f"{name} : .bar {places};")
        stated += [f"{name}.V{n} = {ends[n]};" for n in (i, j) if n in ends]
        for n in (i, j):
            ends.setdefault(n, f"{name}.V{n}")
    stated += [f"{ends[n]} = [{points[n][0]!r}, {points[n][1]!r}];" for n in fixed]
    if backwards:
        stated.reverse()
    return "\n".join([".config(10, 300, 300);", *things, "@0", *stated, more, ""])


def rigidity_freedom(points: Points, rods: Rods, fixed: Iterable[int] = ()) -> int:
    """Degrees of freedom of the vertices that rods end in, by the rank of the rigidity matrix."""
    used = sorted({n for rod in rods for n in rod})
    place = {n: 2 * k for k, n in enumerate(used)}
    matrix: list[NDArray[np.float64]] = []
    for i, j in rods:
        row = np.zeros(2 * len(used))
        d = np.subtract(points[i], points[j])
        row[place[i] : place[i] + 2], row[place[j] : place[j] + 2] = d, -d
        matrix.append(row / np.linalg.norm(d))
    for n in fixed:
        for axis in (0, 1):
            row = np.zeros(2 * len(used))
            row[place[n] + axis] = 1.0
            matrix.append(row)
    return 2 * len(used) - int(np.linalg.matrix_rank(np.array(matrix), tol=1e-7))


def examined_script(text: str) -> tuple[PathMotion, Examination]:
    """A script's motion and all that is said of it."""
    motion = moved(arranged(understand(SourceText("test.mov", text)), Choices()))
    return motion, examine(motion)


def step_of(text: str) -> StepReport:
    """The report of a script's first step."""
    return examined_script(text)[1].steps[0]
