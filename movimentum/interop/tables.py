"""Poses as tables: one row per frame, as CSV, JSON or NPZ, written in chunks.

Columns, in this order: ``frame`` (from 0), ``time``, ``Thing.Anchor.x`` and ``.y`` of every anchor of every thing in
order of definition (a ``.line`` has none of its own), ``Thing.angle`` (degrees, continuous) of every thing that has a
pose, and every named variable (a vector ``v`` as ``v.x``, ``v.y``) that ever has a value; while it has none, its last
value, or before that its first one. World coordinates, pixels, y up. A number is written in the shortest form that
reads back exactly. A frame that is left out (``--on-failure skip``) has no row. With ``--accuracy exact`` numbers have
the digits asked for; in JSON they are strings then, because most readers would round them to a float. NPZ always holds
float64.

JSON is one object, ``{"columns": [name, …], "rows": [[value, …], …]}``, one row on each line; NPZ holds one array per
column under the column's name.
"""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Callable, Container, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from movimentum.arrays import FloatArray
from movimentum.records import dataclass
from movimentum.scene.model import Scene

if TYPE_CHECKING:
    from movimentum.solver.poses import HighPrecisionPoses, Poses

SUFFIXES = (".csv", ".json", ".npz")


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name, and how to read its (F,) values, or their texts with all digits, from the poses of F
    frames.
    """

    name: str
    values: Callable[[Poses], FloatArray]
    texts: Callable[[HighPrecisionPoses], list[str]]


def columns(scene: Scene, without: Container[str] = ()) -> tuple[Column, ...]:
    """The columns after ``frame``, ``without`` some variables."""

    def coordinate(name: str, thing: int, local: tuple[float, float], axis: int) -> Column:
        return Column(
            name,
            lambda poses: poses.world(thing, local)[:, axis],
            lambda poses: poses.texts(poses.coordinate(thing, local, axis)),
        )

    def angle(name: str, thing: int) -> Column:
        return Column(name, lambda poses: poses.angle[thing], lambda poses: poses.texts(poses.turn(thing)))

    def variable(name: str, axis: int | None) -> Column:
        def values(poses: Poses) -> FloatArray:
            return poses.variables[name] if axis is None else poses.variables[name][:, axis]

        title = name if axis is None else f"{name}.{'xy'[axis]}"
        return Column(title, values, lambda poses: poses.texts(poses.scalar(name, axis)))

    bodies = [thing for thing in scene.things if thing.is_body]
    found = [Column("time", lambda poses: poses.times, lambda poses: poses.texts(poses.clock()))]
    for thing in bodies:
        for anchor in thing.anchors:
            for axis, letter in enumerate("xy"):
                found.append(coordinate(f"{thing.name}.{anchor.name}.{letter}", thing.number, anchor.local, axis))
    found += [angle(f"{thing.name}.angle", thing.number) for thing in bodies]
    for name, item in scene.variables.items():
        if name in without:
            continue
        found += [variable(name, axis) for axis in ((0, 1) if item.is_vector else (None,))]
    return tuple(found)


def write_csv(scene: Scene, chunks: Iterable[Poses], stream: TextIO, without: Container[str] = ()) -> int:
    """Write a header line and one line per frame; returns the number of rows."""
    chosen = columns(scene, without)
    stream.write(",".join(["frame", *(column.name for column in chosen)]) + "\n")
    rows = 0
    for poses in chunks:
        texts = _texts(chosen, poses)
        frames, values = _block(chosen, poses)
        table = ([*map(repr, row)] for row in values.T.tolist()) if texts is None else texts
        stream.writelines(f"{frame},{','.join(row)}\n" for frame, row in zip(frames, table, strict=True))
        rows += len(frames)
    return rows


def write_json(scene: Scene, chunks: Iterable[Poses], stream: TextIO, without: Container[str] = ()) -> int:
    """Write one object, one row on each line; returns the number of rows."""
    chosen = columns(scene, without)
    stream.write(f'{{"columns": {json.dumps(["frame", *(column.name for column in chosen)])},\n "rows": [')
    rows = 0
    for poses in chunks:
        texts = _texts(chosen, poses)
        frames, values = _block(chosen, poses)
        for frame, row in zip(frames, values.T.tolist() if texts is None else texts, strict=True):
            stream.write(("\n  " if rows == 0 else ",\n  ") + json.dumps([frame, *row], allow_nan=False))
            rows += 1
    stream.write("]}\n")
    return rows


def write_npz(scene: Scene, chunks: Iterable[Poses], path: Path, without: Container[str] = ()) -> int:
    """Write ``numpy.savez``'s format, one array per column; returns the number of rows.

    Rows come frame by frame and an archive wants whole columns, so the numbers pass through an unnamed file beside
    ``path`` and memory does not grow with the length.
    """
    import numpy as np

    chosen = columns(scene, without)
    rows = 0
    with tempfile.TemporaryFile(dir=path.parent) as rough:
        for poses in chunks:
            frames, values = _block(chosen, poses)
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


def write(scene: Scene, chunks: Iterable[Poses], path: Path, suffix: str, without: Container[str] = ()) -> int:
    """Write the format that ``suffix`` (one of `SUFFIXES`) names to ``path``, without columns for the variables
    ``without``; returns the number of rows.
    """
    if suffix.lower() == ".npz":
        return write_npz(scene, chunks, path, without)
    writer = write_json if suffix.lower() == ".json" else write_csv
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        return writer(scene, chunks, stream, without)


def _block(chosen: tuple[Column, ...], poses: Poses) -> tuple[list[int], FloatArray]:
    """Frame numbers, and the (columns, F) values of a chunk; -0.0 is written as 0.0."""
    import numpy as np

    frames = poses.frames.tolist()
    if not frames:
        return [], np.zeros((len(chosen), 0))
    values = np.stack([column.values(poses) for column in chosen]) + 0.0
    if not np.isfinite(values).all():
        bad = next(column.name for column, row in zip(chosen, values, strict=True) if not np.isfinite(row).all())
        raise ArithmeticError(f"column {bad} holds a value that is not finite")
    return frames, values


def _texts(chosen: tuple[Column, ...], poses: Poses) -> Iterator[tuple[str, ...]] | None:
    """The rows of a chunk with the digits asked for; None where those are a float's."""
    spelled = poses.high_precision
    return None if spelled is None else zip(*(column.texts(spelled) for column in chosen), strict=True)
