"""Tubes: enclosures of a piece of a path from its beginning to its end, interval by interval.

In each interval there is one solution, which moves continuously. Neighbouring intervals hold the same one: at the
instant where they meet, a small ball with exactly one solution lies inside both. The same is done at each frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.certifying.blocks import Encloser, Tubes, joined
from movimentum.certifying.forms import up
from movimentum.records import dataclass
from movimentum.tolerances import NARROWEST_TUBE, UNIT_ROUNDOFF

FIRST_TUBES = 32
"""Intervals that a piece is cut into to begin with, or one for each of the path's own steps."""
MOST_FAILED = 4096
"""Intervals of a piece that may turn out to be too long."""


class Stop(StrEnum):
    """Why a tube ends: the equations do not tell one solution from another (SINGULAR), a statement JUMPS, or there
    would have to be too MANY intervals.
    """

    SINGULAR = "singular"
    JUMPS = "jumps"
    MANY = "many"


@dataclass(frozen=True, slots=True)
class TubeEnd:
    """Where a tube cannot go on: within [``begin``, ``end``] (offsets), because of block number ``block``."""

    begin: float
    end: float
    block: int
    stop: Stop


@dataclass(frozen=True, slots=True, eq=False)
class Tunnel:
    """A piece of path in tubes: the intervals that are enclosed in the order of time, the instants ``at`` which they
    were entered and left and those of frames, and where it ends. ``linked``: which of the instants are in the same
    tube as all intervals that touch them.
    """

    encloser: Encloser
    tubes: Tubes | None
    at: Tubes
    linked: BoolArray
    endings: tuple[TubeEnd, ...]


def tunnel(encloser: Encloser, instants: FloatArray) -> Tunnel:
    """A piece enclosed, with its solution at ``instants`` (offsets of frames) also by itself."""
    piece = encloser.piece
    tubes, endings = _grown(encloser)
    edges = np.zeros(0) if tubes is None else np.concatenate([tubes.begin, tubes.end])
    times = np.unique(np.concatenate([[piece.begin, piece.end], edges, instants]))
    at = encloser.enclosed(times, times)
    linked = at.good if tubes is None else at.good & _linked(encloser, tubes, at)
    endings += [
        TubeEnd(float(at.begin[k]), float(at.begin[k]), int(at.failed[k]), Stop.SINGULAR)
        for k in np.nonzero(~linked)[0]
        if not any(one.begin <= at.begin[k] <= one.end for one in endings)
    ]
    return Tunnel(encloser, tubes, at, linked, tuple(sorted(endings, key=lambda one: one.begin)))


def _grown(encloser: Encloser) -> tuple[Tubes | None, list[TubeEnd]]:
    """Intervals, halved until each is enclosed, and where they get too short."""
    piece = encloser.piece
    length = piece.end - piece.begin
    if length <= 0.0:
        return None, []
    edges = np.linspace(piece.begin, piece.end, max(FIRST_TUBES + 1, len(piece.nodes)))
    begin, end = edges[:-1], edges[1:]
    parts: list[Tubes] = []
    stopped: list[TubeEnd] = []
    failed = 0
    while len(begin):
        found = encloser.enclosed(begin, end)
        good, narrow = found.good, end - begin <= NARROWEST_TUBE * length
        failed += int(np.sum(~good))
        parts.append(found.chosen(good))
        short = ~good & (narrow | (failed > MOST_FAILED))
        for k in np.nonzero(short)[0]:
            stop = Stop.JUMPS if found.jumps[k] else Stop.SINGULAR if narrow[k] else Stop.MANY
            stopped.append(TubeEnd(float(begin[k]), float(end[k]), int(found.failed[k]), stop))
        begin, end = halves(begin[~good & ~short], end[~good & ~short])
    whole = joined([part for part in parts if len(part.begin)] or parts[:1])
    return (whole if len(whole.begin) else None), _merged(stopped)


def halves(begin: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Intervals cut into two each."""
    middle = 0.5 * (begin + end)
    return np.concatenate([begin, middle]), np.concatenate([middle, end])


def _merged(stopped: Sequence[TubeEnd]) -> list[TubeEnd]:
    """Endings that touch, as one."""
    found: list[TubeEnd] = []
    for one in sorted(stopped, key=lambda one: one.begin):
        if found and one.begin <= found[-1].end and one.stop is found[-1].stop:
            last = found.pop()
            one = TubeEnd(last.begin, max(last.end, one.end), last.block, last.stop)
        found.append(one)
    return found


def _linked(encloser: Encloser, tubes: Tubes, at: Tubes) -> BoolArray:
    """Which instants have the solution of each interval that they lie in."""
    linked = np.ones(len(at.begin), dtype=np.bool_)
    last = np.searchsorted(tubes.begin, at.begin, side="right") - 1
    for place in (last, last - 1):  # the interval that begins there or before, and the one before it, if it ends there
        place = np.maximum(place, 0)
        inside = (tubes.begin[place] <= at.begin) & (at.begin <= tubes.end[place])
        linked &= ~inside | within(encloser, tubes, at, place)
    return linked


def within(encloser: Encloser, tubes: Tubes, found: Tubes, place: IntArray) -> BoolArray:
    """Which of what is ``found`` (M), over intervals or at instants, is proved to be the solution of the interval at
    its ``place`` (M,) among the ``tubes``: it lies where that has no other one.
    """
    begin, end = tubes.begin[place], tubes.end[place]
    good = np.ones(len(place), dtype=np.bool_)
    for side, times in ((-1.0, found.begin), (1.0, found.end)):  # both are straight
        u = (2.0 * times - begin - end) / (end - begin)
        for n in found.forms.keys() & encloser.moving:
            inner, tube = found.forms[n], tubes.forms[n]
            c, s, region = (
                np.broadcast_to(part, len(tubes.begin))[place] for part in (tube.c, tube.s, tubes.region[n])
            )
            off = 16.0 * UNIT_ROUNDOFF * (np.abs(c) + np.abs(s) + np.abs(inner.c) + np.abs(inner.s))
            good &= up(np.abs(inner.c + side * inner.s - (c + s * u)) + inner.r + off) <= region
    return good
