"""Matrices in a terminal: named rows and columns, split into as many tables as the width requires."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from movimentum import tolerances
from movimentum.analysis.interactive.matrix import Matrix, PartMatrix, RowName, sparse_basis
from movimentum.arrays import FloatArray
from movimentum.errors import ScriptError
from movimentum.interop.linkage_export import linkage_of, rigidity_rows
from movimentum.repl.session import Session, table
from movimentum.solver.block.problem import null_space
from movimentum.text import counted, listed, number
from movimentum.tolerances import RANK_TOLERANCE

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


def part_text(session: Session, part: PartMatrix) -> str:
    """The matrix of a connected part over its poses, with its rank, its singular values and its null space."""
    things = [session.work.scene.things[t].name for t in part.things]
    names = [_row_name(session, row) for row in part.rows]
    return _text(listed(things or list(part.columns)), names, part)


def vertices_text(session: Session) -> str:
    """The rigidity matrix of the whole scene over its vertices, unscaled, as the program "linkages" has it."""
    timeline = session.work.timeline
    active = timeline.segments[timeline.segment_at(session.time)].active
    try:
        linkage, anchors, left_out = linkage_of(timeline.scene, active, session.poses())
    except ScriptError:
        return "no equation says where an anchor is at this moment, so there is no matrix"
    names, matrix = rigidity_rows(linkage)
    length = np.linalg.norm(matrix, axis=1, keepdims=True)
    rank, null, _ = null_space(matrix / length, RANK_TOLERANCE)
    columns = tuple(f"{axis}{n}" for n in range(len(linkage.vertices)) for axis in "xy")
    singular = np.asarray(np.linalg.svd(matrix, compute_uv=False), dtype=np.float64)
    source = session.work.source
    lines = [*(f"vertex {n}: {anchor}" for n, anchor in enumerate(anchors))]
    for item in left_out:
        if item.span is not None:
            place = source.position(item.span.start).line
            lines.append(f"not in it: line {place}: {_shortened(source.statement(item.span), WIDTH)}")
    found = Matrix(columns, matrix, rank, singular, sparse_basis(null))
    return "\n".join([*lines, "", _text("nothing is scaled", names, found)])


def _text(title: str, names: Sequence[str], found: Matrix) -> str:
    """A matrix whose rows are called ``names``, under its ``title``."""
    m, n = found.jacobian.shape
    free = counted(n - found.rank, "free motion") if found.rank < n else "nothing free"
    repeated = f", {m - found.rank} redundant" if found.rank < m else ""
    head = f"{title}: {counted(m, 'equation')}, {counted(n, 'unknown')}"
    lines = [f"{head}, rank {found.rank}: {free}{repeated}"]
    if m == 0:
        lines.append("no equation says anything about it")
    elif m > MOST or n > MOST:
        lines.append(f"{m} x {n}: too large to show; the limit is {MOST} x {MOST}")
    else:
        entries = np.abs(found.jacobian)
        noise = entries <= tolerances.SHOWN_ZERO * np.max(entries, axis=1, keepdims=True)
        lines += _panels(names, found.columns, np.where(noise, 0.0, found.jacobian))
    if m:
        lines.append(f"singular values: {_singular(found.singular)}")
    if found.rank < n:
        lines += ["null space:", *_null_space(found.columns, found.null)]
    return "\n".join(lines)


def units_text(session: Session) -> str:
    """The units of all matrices of a scene."""
    size = number(session.segment_motion.plan.size)
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
    axis = f" .{row.part}" if row.part else ""
    line = f"line {source.position(span.start).line}: "
    return line + _shortened(source.statement(span), NAME - len(line) - len(axis)) + axis


def _shortened(text: str, room: int) -> str:
    return text if len(text) <= room else text[: room - 1] + "…"


def _singular(values: FloatArray) -> str:
    words = [number(value, 3) if value > tolerances.SHOWN_ZERO else "0" for value in values.tolist()]
    if len(words) > VALUES:
        words = [*words[:3], "…", *words[-(VALUES - 4) :]]
    return ", ".join(words)


def _null_space(columns: Sequence[str], null: FloatArray) -> Iterator[str]:
    """The motions as columns; for many or long ones only the largest entries."""
    if null.shape[1] <= 8 and len(columns) <= MOST:
        moving = np.any(null != 0.0, axis=1)
        names = [name for name, moves in zip(columns, moving, strict=True) if moves]
        yield from _panels(names, [str(k + 1) for k in range(null.shape[1])], null[moving])
        return
    for k in range(min(null.shape[1], 8)):
        order = np.argsort(-np.abs(null[:, k]), kind="stable")
        some = [f"{columns[j]} {number(null[j, k], 3)}" for j in order[:8] if null[j, k] != 0.0]
        more = int(np.count_nonzero(null[:, k])) - len(some)
        yield f"{k + 1}: {', '.join(some)}" + (f" and {more} more" if more else "")
    if null.shape[1] > 8:
        yield f"and {null.shape[1] - 8} more"
