"""When overlapping things are deepest in each other, and how deep."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from movimentum.analysis.gaps.pair_distances import GapIntervals, GapPairs
from movimentum.arrays import FloatArray, IntArray
from movimentum.cancellation import look
from movimentum.tolerances import GAP_FLAT, ROUGH_FLAT

ZOOMS = 20
ZOOM_INSTANTS = 5
DIFFERENCE_OFFSETS = np.array([-0.01, 0.0, 0.01])


def deepest_overlaps(
    pairs: GapPairs, intervals: list[tuple[int, float, float]], known: GapIntervals
) -> tuple[FloatArray, FloatArray]:
    """When the things of each stretch (pair, from, to) overlap most, and by how much."""
    best, found = np.zeros(len(intervals)), np.zeros(len(intervals))
    low, high = (np.array([each[k] for each in intervals]) for k in (1, 2))
    number = np.array([each[0] for each in intervals], dtype=np.int64)
    alive = np.nonzero(pairs.exact[number])[0]
    rough = ~pairs.exact[number]
    best[rough], found[rough] = _deepest_by_search(pairs, number[rough], low[rough], high[rough])
    if not len(alive):
        return best, found
    best[alive], low[alive], high[alive] = _seeds(known, number[alive], low[alive], high[alive])
    parts = np.linspace(0.0, 1.0, ZOOM_INSTANTS + 2)
    vertex = best.copy()
    for step in range(ZOOMS):
        wide = high[alive] - low[alive]
        if step % 2:  # beside where a parabola has its vertex
            times = vertex[alive, None] + wide[:, None] * DIFFERENCE_OFFSETS
        else:
            times = low[alive, None] + wide[:, None] * parts
        times = np.concatenate([times, best[alive, None], low[alive, None], high[alive, None]], axis=1)
        times = np.sort(np.clip(times, low[alive, None], high[alive, None]), axis=1)
        value = pairs.depths(np.repeat(number[alive], times.shape[1]), times.ravel()).reshape(times.shape)
        k, rows, last = np.argmax(value, axis=1), np.arange(len(times)), times.shape[1] - 1
        best[alive], found[alive] = times[rows, k], value[rows, k]
        before = np.maximum((times < best[alive, None]).sum(axis=1) - 1, 0)
        after = np.minimum(last + 1 - (times > best[alive, None]).sum(axis=1), last)
        low[alive], high[alive] = times[rows, before], times[rows, after]
        vertex[alive] = _vertex(*(each[rows, n] for n in (before, k, after) for each in (times, value)))
        fall = value[rows, k] - np.minimum(value[rows, before], value[rows, after])
        alive = alive[fall > GAP_FLAT * pairs.scale]
        if not len(alive):
            break
    return best, found


def _vertex(a: Any, fa: Any, b: Any, fb: Any, c: Any, fc: Any) -> Any:
    """Where a parabola through three points (each a time and a value) has its vertex; b where there is none."""
    left, right = b - a, c - b
    rise, fall = fb - fa, fb - fc
    with np.errstate(all="ignore"):
        moved = 0.5 * (fall * left * left - rise * right * right) / -(rise * right + fall * left)
    return b + np.where(np.isfinite(moved), moved, 0.0)


def _deepest_by_search(
    pairs: GapPairs, number: IntArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The same of pairs whose shortest way out takes long to find, and may have several tops."""
    searches = [_search(*each) for each in zip(low.tolist(), high.tolist(), strict=True)]
    wanted = {k: next(search) for k, search in enumerate(searches)}
    best = 0.5 * (low + high)
    while wanted:
        look()
        for ways in (False, True):
            some = {k: times for k, (of_ways, times) in wanted.items() if of_ways == ways}
            if not some:
                continue
            pair = np.concatenate([np.repeat(number[k], len(times) - ways) for k, times in some.items()])
            if ways:
                ends = [np.concatenate([times[n : len(times) - 1 + n] for times in some.values()]) for n in (0, 1)]
                results = pairs.travel(pair, *(pairs.placed(pair, each) for each in ends))
            else:
                results = pairs.depths(pair, np.concatenate(list(some.values())))
            place = 0
            for k, times in some.items():
                count = len(times) - ways
                try:
                    wanted[k] = searches[k].send(results[place : place + count])
                except StopIteration as end:
                    best[k] = end.value
                    del wanted[k]
                place += count
    return best, pairs.depths(number, best, whole=True)


def _search(low: float, high: float) -> Generator[tuple[bool, FloatArray], FloatArray, float]:
    """When a depth is greatest between two times. It asks for the depths at some times (False), or by how much depths
    may change from each time to the next (True): no depth changes by more than the things move.
    """
    times = np.linspace(low, high, SCANNED)
    deep = yield False, times
    for step in range(SCANS + VERTICES):
        if step < SCANS:
            bound = 0.5 * (deep[:-1] + deep[1:] + (yield True, times))
            some = np.argsort(-bound)[:SPLIT]
            some = some[bound[some] > (1.0 + WORTH_SPLITTING) * deep.max()]
            new = 0.5 * (times[some] + times[some + 1])
        else:
            k = min(max(int(np.argmax(deep)), 2), len(times) - 3)
            (a, b, c, d, e), (fa, fb, fc, fd, fe) = times[k - 2 : k + 3], deep[k - 2 : k + 3]
            if fc - min(fb, fd) <= ROUGH_FLAT * fc:
                break
            with np.errstate(all="ignore"):  # as of a roof, of a parabola, or neither
                up, down = (fb - fa) / (b - a), (fe - fd) / (e - d)
                ridge = (fd - fb + up * b - down * d) / (up - down)
            new = np.array([ridge, _vertex(b, fb, c, fc, d, fd), 0.5 * (b + c), 0.5 * (c + d)])
            new = new[(new > b) & (new < d)]
        if len(new):
            times, deep = np.append(times, new), np.append(deep, (yield False, new))
            order = np.argsort(times, kind="stable")
            times, deep = times[order], deep[order]
    return float(times[np.argmax(deep)])


SCANNED, SCANS, SPLIT, VERTICES = 5, 4, 3, 3
"""Instants at which a depth is looked at first; how often intervals are halved, and how many of them at once; and how
often a parabola is put through the deepest one.
"""
WORTH_SPLITTING = 0.002
"""Of the depth: what another top may be higher without being looked for."""


def _seeds(
    known: GapIntervals, number: IntArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where pairs are nearest at instants that have been looked at, and the times before and after."""
    first, stop = (np.searchsorted(known.pair, number, side=side) for side in ("left", "right"))
    best = 0.5 * (low + high)
    for k in range(len(number)):
        own = slice(first[k], stop[k])
        tau = np.concatenate([known.begin[own], known.end[own]])
        value = np.concatenate([known.first[own], known.last[own]])
        inside = (tau >= low[k]) & (tau <= high[k])
        if inside.any():
            tau, value = tau[inside], value[inside]
            best[k] = tau[np.argmin(value)]
            low[k] = max(low[k], tau[tau < best[k]].max(initial=low[k]))
            high[k] = min(high[k], tau[tau > best[k]].min(initial=high[k]))
    return best, low, high
