"""When an expression reaches a value, and where it is largest, on the continuous motion.

An expression is known at any time with its exact rate. Each piece of the path is divided until the cubic through the
values and rates at both ends of an interval predicts its middle; then no root or extremum can hide in it. Roots of the
expression and of its rate are found by bisection to the last digits of the time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from fractions import Fraction
from itertools import pairwise

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, within_half
from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import CUBIC_FITS, JUMP_ACROSS, VALUE_TOUCHED

Read = Callable[[Sequence[Fraction]], FloatArray]
"""Times (ascending) -> (F,)."""
AT_FIRST = 4
"""Intervals into which that between two nodes of the path is divided to begin with."""
FINEST, MOST = 14, 60_000
"""Halvings of an interval, and values in all."""
BISECTIONS = 64


class Way(StrEnum):
    """How a value is passed: going up or down, touched from below or above, jumped over, kept for a while; or, of a
    vector, met.
    """

    RISING = "rising"
    FALLING = "falling"
    TOUCHES_BELOW = "touches it from below"
    TOUCHES_ABOVE = "touches it from above"
    JUMPS = "jumps over it"
    STAYS = "stays there"
    MEETS = "meets it"


@dataclass(frozen=True, slots=True)
class Crossing:
    """A ``time`` at which an expression has the value; what stays does so ``until`` (else the same)."""

    time: Fraction
    way: Way
    until: Fraction


@dataclass(frozen=True, slots=True)
class ExtremeValue:
    """The largest (or smallest) value, and the first time that has it."""

    value: float
    time: Fraction


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """An expression of the motion: its ``values`` and exact ``rates`` (per time unit) at times. ``turns``: it is an
    angle that is only known but for full turns.
    """

    motion: PathMotion
    values: Read
    rates: Read
    turns: bool = False

    def samples(self) -> Iterator[_Samples]:
        """One for each piece of the path, in order."""
        for place, segment_motion in enumerate(self.motion.segments):
            start, length = segment_motion.segment.start, segment_motion.segment.end - segment_motion.segment.start
            last = place + 1 == len(self.motion.segments)
            for piece, following in pairwise([*segment_motion.pieces, None]):
                if not isinstance(piece, Piece):
                    continue
                closed = last and following is None
                end = piece.end if closed else float(np.nextafter(min(piece.end, float(length)), 0.0))
                if end >= piece.begin:
                    yield _Samples(self, start, piece.begin, max(end, piece.begin), piece.nodes)


class _Samples:
    """A curve over one piece, from ``begin`` to ``end`` (offsets from ``start``), at times so close that cubics fit."""

    def __init__(self, curve: Curve, start: Fraction, begin: float, end: float, nodes: FloatArray) -> None:
        self.curve, self.start = curve, start
        inside = np.unique(np.clip(np.concatenate([[begin, end], nodes[(nodes > begin) & (nodes < end)]]), begin, end))
        parts = np.linspace(0.0, 1.0, AT_FIRST + 1)[:-1]
        fine = inside[:-1, None] + np.diff(inside)[:, None] * parts
        self.tau = np.append(fine.reshape(-1), inside[-1])
        self.value, self.rate = self.at(self.tau), self.rates(self.tau)
        self.size = max(curve.motion.size, float(np.nanmax(np.abs(self.value), initial=0.0)))
        self._divide()

    def times(self, tau: FloatArray) -> list[Fraction]:
        return [self.start + Fraction(float(offset)) for offset in tau]

    def at(self, tau: FloatArray) -> FloatArray:
        """(F,) the values at offsets, of an angle between -180 and 180."""
        values = self.curve.values(self.times(tau))
        return within_half(values) if self.curve.turns else values

    def rates(self, tau: FloatArray) -> FloatArray:
        return self.curve.rates(self.times(tau))

    def _divide(self) -> None:
        """Divide intervals until the cubic through the values and rates at both ends tells the middle."""
        left: IntArray = np.arange(len(self.tau) - 1, dtype=np.int64)
        for _ in range(FINEST):
            width = self.tau[left + 1] - self.tau[left]
            middle = self.tau[left] + 0.5 * width
            inside = (middle > self.tau[left]) & (middle < self.tau[left + 1])
            left, middle, width = left[inside], middle[inside], width[inside]
            if not len(left) or len(self.tau) > MOST:
                return
            value, rate = self.at(middle), self.rates(middle)
            a, b = self.value[left], self.value[left + 1]
            cubic = 0.5 * (a + b) + 0.125 * width * (self.rate[left] - self.rate[left + 1])
            off = ~(np.abs(value - cubic) <= CUBIC_FITS * self.size)
            off &= np.isfinite(value) | np.isfinite(a) | np.isfinite(b)
            self.tau = np.insert(self.tau, left + 1, middle)
            self.value = np.insert(self.value, left + 1, value)
            self.rate = np.insert(self.rate, left + 1, rate)
            places = left + np.arange(len(left))
            left = np.sort(np.concatenate([places[off], places[off] + 1]))

    def bisected(self, function: Callable[[FloatArray], FloatArray], places: BoolArray) -> FloatArray:
        """The roots (B,) of a ``function`` of offsets in those intervals where it has both signs."""
        low, high = self.tau[:-1][places].copy(), self.tau[1:][places].copy()
        if not len(low):
            return low
        sign = np.sign(function(low))
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if not ((middle > low) & (middle < high)).any():
                break
            found = function(middle)
            same = np.sign(found) == sign
            low, high = np.where(same, middle, low), np.where(same, high, middle)
            exact = found == 0.0
            low, high = np.where(exact, middle, low), np.where(exact, middle, high)
        return 0.5 * (low + high)

    def turns(self) -> FloatArray:
        """Where the curve turns: the roots (B,) of its rate."""
        a, b = self.rate[:-1], self.rate[1:]
        return self.bisected(self.rates, np.asarray((a * b < 0.0) & np.isfinite(a + b), dtype=np.bool_))


def crossings(curve: Curve) -> list[Crossing]:
    """Every time at which a curve is zero, in order."""
    found: list[Crossing] = []
    before: float | None = None
    for samples in curve.samples():
        first, last = float(samples.value[0]), float(samples.value[-1])
        near = VALUE_TOUCHED * samples.size
        begin = samples.start + Fraction(float(samples.tau[0]))
        if before is not None and before * first < 0.0 and min(abs(before), abs(first)) > near:
            found.append(Crossing(begin, Way.JUMPS, begin))
        found += _in_piece(samples, near)
        before = last if np.isfinite(last) else None
    return _joined(found)


def _in_piece(samples: _Samples, near: float) -> list[Crossing]:
    turns = samples.turns()
    tau = np.unique(np.concatenate([samples.tau, turns]))
    value = np.empty(len(tau))
    value[np.searchsorted(tau, samples.tau)] = samples.value
    if len(turns):
        value[np.searchsorted(tau, turns)] = samples.at(turns)
    samples.tau, samples.value = tau, value
    samples.rate = np.zeros(0)  # of other times
    flat = np.abs(value) <= near
    start = samples.start

    def time(offset: float) -> Fraction:
        return start + Fraction(float(offset))

    result: list[Crossing] = []
    signs = np.where(flat, 0, np.sign(np.nan_to_num(value)))
    crossed = np.asarray((signs[:-1] * signs[1:] < 0) & np.isfinite(value[:-1] + value[1:]), dtype=np.bool_)
    roots = samples.bisected(samples.at, crossed)
    if len(roots):
        off = np.abs(samples.at(roots))
        for root, place, left in zip(roots, np.nonzero(crossed)[0], off, strict=True):
            jumps = not left <= max(near, JUMP_ACROSS * abs(value[place + 1] - value[place]))
            if jumps and samples.curve.turns:
                continue  # an angle goes on at -180
            way = Way.JUMPS if jumps else Way.RISING if value[place] < 0.0 else Way.FALLING
            result.append(Crossing(time(root), way, time(root)))
    change = np.diff(flat.astype(np.int8), prepend=0, append=0)
    for first, stop in zip(np.nonzero(change == 1)[0], np.nonzero(change == -1)[0] - 1, strict=True):
        before = signs[first - 1] if first > 0 else 0
        after = signs[stop + 1] if stop + 1 < len(tau) else 0
        if stop > first and _stays(samples, tau[first], tau[stop], near):
            result.append(Crossing(time(tau[first]), Way.STAYS, time(tau[stop])))
            continue
        place = tau[first + int(np.argmin(np.abs(value[first : stop + 1])))]
        if before * after < 0:
            place = _root_between(samples, tau[first - 1], tau[stop + 1])
            way = Way.RISING if before < 0 else Way.FALLING
        elif before * after > 0:
            way = Way.TOUCHES_BELOW if before < 0 else Way.TOUCHES_ABOVE
        else:  # where the piece begins or ends
            rising = after > 0 or before < 0
            way = Way.RISING if rising else Way.FALLING
        result.append(Crossing(time(place), way, time(place)))
    return sorted(result, key=lambda item: item.time)


def _stays(samples: _Samples, first: float, last: float, near: float) -> bool:
    return bool(last > first) and bool((np.abs(samples.at(np.linspace(first, last, 9))) <= near).all())


def _root_between(samples: _Samples, low: float, high: float) -> float:
    samples.tau = np.array([low, high])
    return float(samples.bisected(samples.at, np.array([True]))[0])


def _joined(found: Sequence[Crossing]) -> list[Crossing]:
    """Without what is reported twice: where one piece ends and the next begins."""
    result: list[Crossing] = []
    for item in found:
        last = result[-1] if result else None
        together = last is not None and item.time - last.until <= Fraction(1, 10**12) * max(1, abs(item.time))
        if last is not None and together and Way.STAYS in (last.way, item.way):
            result[-1] = Crossing(last.time, Way.STAYS, max(item.until, last.until))
        elif last is not None and together and item.way is last.way:
            continue
        elif last is not None and together and {last.way, item.way} == {Way.RISING, Way.FALLING}:
            way = Way.TOUCHES_BELOW if last.way is Way.RISING else Way.TOUCHES_ABOVE
            result[-1] = Crossing(last.time, way, last.time)
        else:
            result.append(item)
    return result


def extreme(curve: Curve, *, largest: bool) -> ExtremeValue | None:
    """The largest or the smallest value of a curve over the whole motion; None where it never has one."""
    best: ExtremeValue | None = None
    sign = 1.0 if largest else -1.0
    for samples in curve.samples():
        tau = np.unique(np.concatenate([samples.turns(), samples.tau]))
        value = sign * samples.at(tau)
        if not np.isfinite(value).any():
            continue
        top = float(np.nanmax(value))
        place = int(np.nanargmax(value >= top - VALUE_TOUCHED * samples.size))  # the first that is as large
        near = value[place : place + 3]
        place += int(np.nanargmax(near))
        found = ExtremeValue(sign * float(value[place]), samples.start + Fraction(float(tau[place])))
        if best is None or sign * (found.value - best.value) > VALUE_TOUCHED * samples.size:
            best = found
    return best
