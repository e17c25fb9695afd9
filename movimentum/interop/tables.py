"""Poses as tables: one row a frame, as CSV, JSON or NPZ, written in chunks.

Columns, in this order: ``frame`` (from 0), ``time``, ``Thing.Anchor.x`` and ``.y`` of every anchor of every thing in
order of definition (a ``.line`` has none of its own), ``Thing.angle`` (degrees, continuous) of every thing that has a
pose, and every named variable (a vector ``v`` as ``v.x``, ``v.y``). World coordinates, pixels, y up. A number is
written in the shortest form that reads back exactly. A frame that is left out (``--on-failure skip``) has no row.

JSON is one object, ``{"columns": [name, …], "rows": [[value, …], …]}``, a row a line; NPZ holds one array per column
under the column's name.
"""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from movimentum.scene.model import Scene

if TYPE_CHECKING:
    from movimentum.solve.motion import FloatArray, Poses

SUFFIXES = (".csv", ".json", ".npz")


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name, and how to read its (F,) values from the poses of F frames."""

    name: str
    values: Callable[[Poses], FloatArray]


def columns(scene: Scene) -> tuple[Column, ...]:
    """The columns after ``frame``."""

    def coordinate(thing: int, local: tuple[float, float], axis: int) -> Callable[[Poses], FloatArray]:
        return lambda poses: poses.world(thing, local)[:, axis]

    def angle(thing: int) -> Callable[[Poses], FloatArray]:
        return lambda poses: poses.angle[thing]

    def scalar(name: str) -> Callable[[Poses], FloatArray]:
        return lambda poses: poses.variables[name]

    def component(name: str, axis: int) -> Callable[[Poses], FloatArray]:
        return lambda poses: poses.variables[name][:, axis]

    bodies = [thing for thing in scene.things if thing.is_body]
    found = [Column("time", lambda poses: poses.times)]
    for thing in bodies:
        for anchor in thing.anchors:
            for axis, letter in enumerate("xy"):
                found.append(
                    Column(f"{thing.name}.{anchor.name}.{letter}", coordinate(thing.number, anchor.local, axis))
                )
    found += [Column(f"{thing.name}.angle", angle(thing.number)) for thing in bodies]
    for name, variable in scene.variables.items():
        if variable.is_vector:
            found += [Column(f"{name}.{letter}", component(name, axis)) for axis, letter in enumerate("xy")]
        else:
            found.append(Column(name, scalar(name)))
    return tuple(found)


def write_csv(scene: Scene, chunks: Iterable[Poses], stream: TextIO) -> int:
    """Write a header line and one line a frame; returns the number of rows."""
    chosen = columns(scene)
    stream.write(",".join(["frame", *(column.name for column in chosen)]) + "\n")
    rows = 0
    for frames, values in _blocks(chosen, chunks):
        stream.writelines(
            f"{frame},{','.join(map(repr, row))}\n" for frame, row in zip(frames, values.T.tolist(), strict=True)
        )
        rows += len(frames)
    return rows


def write_json(scene: Scene, chunks: Iterable[Poses], stream: TextIO) -> int:
    """Write one object, a row a line; returns the number of rows."""
    chosen = columns(scene)
    stream.write(f'{{"columns": {json.dumps(["frame", *(column.name for column in chosen)])},\n "rows": [')
    rows = 0
    for frames, values in _blocks(chosen, chunks):
        for frame, row in zip(frames, values.T.tolist(), strict=True):
            stream.write(("\n  " if rows == 0 else ",\n  ") + json.dumps([frame, *row], allow_nan=False))
            rows += 1
    stream.write("]}\n")
    return rows


def write_npz(scene: Scene, chunks: Iterable[Poses], path: Path) -> int:
    """Write ``numpy.savez``'s format, one array per column; returns the number of rows.

    Rows come frame by frame and an archive wants whole columns, so the numbers pass through an unnamed file beside
    ``path`` and memory does not grow with the length.
    """
    import numpy as np

    chosen = columns(scene)
    rows = 0
    with tempfile.TemporaryFile(dir=path.parent) as rough:
        for frames, values in _blocks(chosen, chunks):
            table = np.empty((len(frames), len(chosen) + 1))
            table[:, 0] = frames
            table[:, 1:] = values.T
            rough.write(table.tobytes())
            rows += len(frames)
        rough.flush()
        shape = (rows, len(chosen) + 1)
        table = np.memmap(rough, dtype=np.float64, mode="r", shape=shape) if rows else np.empty(shape)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
            for number, name in enumerate(["frame", *(column.name for column in chosen)]):
                column = np.ascontiguousarray(table[:, number], dtype=np.int64 if number == 0 else np.float64)
                # A fixed date: the same scene gives the same bytes.
                entry = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
                with archive.open(entry, "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, column, allow_pickle=False)
        del table
    return rows


def write(scene: Scene, chunks: Iterable[Poses], path: Path, suffix: str) -> int:
    """Write the format that ``suffix`` (one of `SUFFIXES`) names to ``path``; returns the number of rows."""
    if suffix.lower() == ".npz":
        return write_npz(scene, chunks, path)
    writer = write_json if suffix.lower() == ".json" else write_csv
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        return writer(scene, chunks, stream)


def _blocks(chosen: tuple[Column, ...], chunks: Iterable[Poses]) -> Iterator[tuple[list[int], FloatArray]]:
    """Frame numbers, and the (columns, F) values of each chunk; -0.0 is written as 0.0."""
    import numpy as np

    for poses in chunks:
        frames = poses.frames.tolist()
        if not frames:
            continue
        values = np.stack([column.values(poses) for column in chosen]) + 0.0
        if not np.isfinite(values).all():
            bad = next(column.name for column, row in zip(chosen, values, strict=True) if not np.isfinite(row).all())
            raise ArithmeticError(f"column {bad} holds a value that is not finite")
        yield frames, values
