"""Matrices for a terminal: named rows and columns, in as many tables as the width requires."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from movimentum.analysis.interactive.matrix import PartMatrix, RowName
from movimentum.arrays import FloatArray
from movimentum.repl.command import table
from movimentum.repl.session import Session
from movimentum.text import counted, listed, number

MOST = 24
"""Rows and columns of the largest matrix that is shown; for a larger one, the number of entries of a motion that are
shown.
"""
WIDTH = 100
"""Characters of a line."""
NAME = 44
"""Characters of a row's name."""
VALUES = 12
"""Up to this many singular values are all shown; of more, only the largest and the smallest."""


def matrix_text(session: Session, part: PartMatrix) -> str:
    """A part's matrix with its rank, its singular values and its null space."""
    m, n = part.jacobian.shape
    things = [session.work.scene.things[t].name for t in part.things]
    free = counted(n - part.rank, "free motion") if part.rank < n else "nothing free"
    repeated = f", {m - part.rank} redundant" if part.rank < m else ""
    head = f"{listed(things or list(part.columns))}: {counted(m, 'equation')}, {counted(n, 'unknown')}"
    lines = [f"{head}, rank {part.rank}: {free}{repeated}"]
    if m == 0:
        lines.append("no equation says anything about it")
    elif m > MOST or n > MOST:
        lines.append(f"{m} x {n}: too large to show; the limit is {MOST} x {MOST}")
    else:
        names = [_row_name(session, row) for row in part.rows]
        lines += _panels(names, part.columns, part.jacobian)
    if m:
        lines.append(f"singular values: {_singular(part.singular)}")
    if part.rank < n:
        lines += ["null space:", *_null_space(part)]
    return "\n".join(lines)


def units_text(session: Session) -> str:
    """The units of all matrices of a scene."""
    size = number(session.stretch.plan.size)
    return f"rows have length 1; lengths in units of the scene's size ({size} px), angles in units of 57 degrees"


def _panels(names: Sequence[str], columns: Sequence[str], values: FloatArray) -> Iterator[str]:
    """The table, cut after as many columns as a line holds."""
    cells = [[number(value, 3) for value in row] for row in values.tolist()]
    widths = [max(len(name), *(len(row[j]) for row in cells)) for j, name in enumerate(columns)]
    left = max(map(len, names))
    begin = 0
    while begin < len(columns):
        end, used = begin, left
        while end < len(columns) and (end == begin or used + 2 + widths[end] <= WIDTH):
            used += 2 + widths[end]
            end += 1
        rows = [["", *columns[begin:end]]]
        rows += [[name, *row[begin:end]] for name, row in zip(names, cells, strict=True)]
        yield table(rows, right=frozenset(range(1, end - begin + 1)))
        begin = end


def _row_name(session: Session, row: RowName) -> str:
    scene = session.work.scene
    source = scene.source
    if row.constraint is None:
        if row.thing is None:
            return "the language"
        name = scene.things[row.thing].name
        return (
            f"{name}: {row.part} from its {'direction' if row.part == 'angle' else 'angle'}"
            if row.part
            else (f"{name} is rigid")
        )
    span = next(item.span for item in scene.constraints() if item.number == row.constraint)
    text = source.statement(span)
    axis = f" .{row.part}" if row.part else ""
    line = f"line {source.position(span.start).line}: "
    room = NAME - len(line) - len(axis)
    return line + (text if len(text) <= room else text[: room - 1] + "…") + axis


def _singular(values: FloatArray) -> str:
    words = [number(value, 3) if value > 1e-12 else "0" for value in values.tolist()]
    if len(words) > VALUES:
        words = [*words[:3], "…", *words[-(VALUES - 4) :]]
    return ", ".join(words)


def _null_space(part: PartMatrix) -> Iterator[str]:
    """The motions as columns; for many or long ones only the largest entries."""
    null = part.null
    if null.shape[1] <= 8 and len(part.columns) <= MOST:
        moving = np.any(null != 0.0, axis=1)
        names = [name for name, moves in zip(part.columns, moving, strict=True) if moves]
        yield from _panels(names, [str(k + 1) for k in range(null.shape[1])], null[moving])
        return
    for k in range(min(null.shape[1], 8)):
        order = np.argsort(-np.abs(null[:, k]), kind="stable")
        some = [f"{part.columns[j]} {number(null[j, k], 3)}" for j in order[:8] if null[j, k] != 0.0]
        more = int(np.count_nonzero(null[:, k])) - len(some)
        yield f"{k + 1}: {', '.join(some)}" + (f" and {more} more" if more else "")
    if null.shape[1] > 8:
        yield f"and {null.shape[1] - 8} more"
