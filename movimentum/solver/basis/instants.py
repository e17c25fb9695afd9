"""Sets of times within one segment, and the readings of its clocks at them.

`numpy.unique` and functions based on it load `numpy.ma` on first use, which takes longer than following a four-bar.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Instants:
    """``tau`` (F,): time since the segment's start; ``clocks``: one array (F,) for each of `Plan.clocks`."""

    tau: FloatArray
    clocks: tuple[FloatArray, ...]

    def __len__(self) -> int:
        return len(self.tau)


def at_offsets(starts: Sequence[Fraction], segment_start: Fraction, tau: FloatArray) -> Instants:
    """Instants at any floating-point offsets ``tau`` from the segment's start."""
    tau = np.asarray(tau, dtype=np.float64)
    return Instants(tau, tuple(float(segment_start - start) + tau for start in starts))


def at_times(starts: Sequence[Fraction], segment_start: Fraction, times: Sequence[Fraction]) -> Instants:
    """Instants at exact times: each clock is the exact difference, rounded once."""
    ratios = [(time.numerator, time.denominator) for time in times]

    def since(start: Fraction) -> FloatArray:
        n, d = start.numerator, start.denominator
        return np.array([(p * d - n * q) / (q * d) for p, q in ratios], dtype=np.float64)  # whole numbers: rounded once

    return Instants(since(segment_start), tuple(since(start) for start in starts))


def at_frames(
    starts: Sequence[Fraction], segment_start: Fraction, origin: Fraction, step: Fraction, frames: NDArray[np.int64]
) -> Instants:
    """Instants at ``origin + k * step`` for the frame numbers k: exact rational arithmetic, rounded once, at array
    speed.
    """

    def since(start: Fraction) -> FloatArray:
        offset = origin - start
        denominator = offset.denominator * step.denominator
        first = offset.numerator * step.denominator
        stride = step.numerator * offset.denominator
        largest = abs(first) + abs(stride) * (int(frames.max(initial=0)) + 1)
        if largest < 2**53 and denominator < 2**53:  # both exact as floats, so the quotient is rounded once
            return (first + stride * frames).astype(np.float64) / float(denominator)
        return np.array([float(offset + int(k) * step) for k in frames], dtype=np.float64)

    return Instants(since(segment_start), tuple(since(start) for start in starts))


Number = TypeVar("Number", bound=np.generic)


def distinct(values: NDArray[Number]) -> NDArray[Number]:
    """All different ``values`` (any shape, none of them nan) in ascending order."""
    ordered: NDArray[Number] = np.sort(values, axis=None)
    kept = np.ones(len(ordered), dtype=np.bool_)
    kept[1:] = ordered[1:] != ordered[:-1]
    return ordered[kept]


def without(values: NDArray[Number], others: NDArray[Any]) -> NDArray[Number]:
    """The different ``values`` that are none of the ``others`` (ascending, at least one), in ascending order."""
    some = distinct(values)
    place = np.minimum(np.searchsorted(others, some), len(others) - 1)
    return some[others[place] != some]
