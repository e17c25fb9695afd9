"""Poses of many frames, in order: all in memory, or chunk by chunk.

A `PoseSource` is a `Poses` or anything that can be iterated *more than once* and yields `Poses` in order (a list, an
object with ``__iter__``, a `Spool`). Rendering reads it several times: to fit the canvas, to choose the palette, to
draw. A source that can be iterated only once (a generator) goes through a `Spool`, which keeps the chunks in a
temporary file. Memory then holds one chunk, however long the film is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from types import TracebackType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from movimentum.records import dataclass, replace
from movimentum.solver.poses import Poses

PoseSource: TypeAlias = Poses | Iterable[Poses]


class Spool:
    """Chunks of poses in a temporary file, which is removed by `close` (or at the end of a ``with``)."""

    def __init__(self, chunks: Iterable[Poses]) -> None:
        import pickle
        import tempfile

        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed by close()
        try:
            for chunk in chunks:
                pickle.dump(chunk, self._file, pickle.HIGHEST_PROTOCOL)
        except BaseException:
            self._file.close()
            raise
        self._end = self._file.tell()

    def __iter__(self) -> Iterator[Poses]:
        import pickle

        position = 0
        while position < self._end:
            self._file.seek(position)
            chunk: Poses = pickle.load(self._file)
            position = self._file.tell()
            yield chunk

    def close(self) -> None:
        """Free the disk space."""
        self._file.close()

    def __enter__(self) -> Spool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def chunks(source: PoseSource) -> Iterator[Poses]:
    """The poses of ``source`` from its beginning; `TypeError` for a source that can be iterated only once."""
    if isinstance(source, Poses):
        yield source
        return
    iterator = iter(source)
    if iterator is source:
        raise TypeError("poses are needed more than once: wrap the iterator in a Spool")
    for chunk in iterator:
        if len(chunk.frames):
            yield chunk


@dataclass(frozen=True, slots=True)
class StillPoses:
    """Poses of ``source`` with ``more`` things behind the others that stay where they are drawn."""

    source: PoseSource
    more: int

    def __iter__(self) -> Iterator[Poses]:
        for poses in chunks(self.source):
            size = (self.more, len(poses.frames))
            ahead = np.broadcast_to([1.0, 0.0], (*size, 2))
            yield replace(
                poses,
                origin=np.concatenate([poses.origin, np.zeros((*size, 2))]),
                direction=np.concatenate([poses.direction, ahead]),
                angle=np.concatenate([poses.angle, np.zeros(size)]),
                visible=np.concatenate([poses.visible, np.ones(size, dtype=np.bool_)]),
            )


def count(source: PoseSource) -> int:
    """How many frames there are."""
    return sum(len(chunk.frames) for chunk in chunks(source))


def concatenate(parts: list[Poses]) -> Poses:
    """One `Poses` of several, in order."""
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    return Poses(
        frames=np.concatenate([part.frames for part in parts]),
        times=np.concatenate([part.times for part in parts]),
        origin=np.concatenate([part.origin for part in parts], axis=1),
        direction=np.concatenate([part.direction for part in parts], axis=1),
        angle=np.concatenate([part.angle for part in parts], axis=1),
        visible=np.concatenate([part.visible for part in parts], axis=1),
        properties={key: np.concatenate([part.properties[key] for part in parts]) for key in first.properties},
        variables={key: np.concatenate([part.variables[key] for part in parts]) for key in first.variables},
        missing=_missing(parts),
        solved=np.concatenate([part.solved for part in parts]),
    )


def _missing(parts: list[Poses]) -> dict[str, NDArray[np.bool_]]:
    names = {name for part in parts for name in part.missing}
    never = [np.zeros(len(part.frames), dtype=np.bool_) for part in parts]
    return {
        name: np.concatenate([part.missing.get(name, no) for part, no in zip(parts, never, strict=True)])
        for name in sorted(names)
    }


def kept_frames(frames: int, fps: Fraction, limit: int) -> int:
    """How many frames of ``frames`` at ``fps`` are left at ``limit`` frames a second (at least 1)."""
    return max(1, int(Fraction(frames) / fps * limit))


def thinned(source: PoseSource, fps: Fraction, limit: int, keep: int) -> Iterator[Poses]:
    """``keep`` frames of ``source`` at ``limit`` a second, for ``fps`` > ``limit``: the one shown at each j/limit."""
    position = 0
    ratio = fps / limit
    for chunk in chunks(source):
        size = len(chunk.frames)
        # frame k stays if some j has floor(j * ratio) == k; ratio > 1, so j is unique
        first = -int(-position // ratio)
        wanted: list[int] = []
        j = first
        while j < keep and (k := int(j * ratio)) < position + size:
            wanted.append(k - position)
            j += 1
        position += size
        if wanted:
            yield chunk.select(np.array(wanted, dtype=np.int64))


def pieces(source: Iterable[Poses], size: int) -> Iterator[Poses]:
    """The same frames in pieces of ``size`` (the last may be shorter), however ``source`` is chunked."""
    waiting: list[Poses] = []
    have = 0
    for chunk in source:
        start = 0
        while start < len(chunk.frames):
            part = chunk.select(slice(start, start + size - have))
            start += len(part.frames)
            have += len(part.frames)
            waiting.append(part)
            if have == size:
                yield concatenate(waiting)
                waiting, have = [], 0
    if waiting:
        yield concatenate(waiting)
