"""Pyslvs' triangular functions over arrays (see `movimentum.interop.formulas`): the resulting point, or why there is
none.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.expressions.arrays import sincosd
from movimentum.records import dataclass
from movimentum.tolerances import CIRCLES_TOUCHING


@dataclass(frozen=True, slots=True)
class Fault:
    """``where`` (F,) a formula has no point, why (``{0}`` is its first argument), and the length it is ``short`` of."""

    where: NDArray[np.bool_]
    story: str
    short: FloatArray | None = None


Result = tuple[FloatArray, tuple[Fault, ...]]
"""The point (…, 2), and where it is none; of two faults at one place, the first is reported."""


def _polar(length: FloatArray, degrees: FloatArray) -> FloatArray:
    sine, cosine = sincosd(degrees)
    return np.stack(np.broadcast_arrays(length * cosine, length * sine), axis=-1)


def _together(d: FloatArray, *arms: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The length (F,) of ``d``, and where it is negligible compared with the lengths of ``arms`` and what is added to
    them.
    """
    far = np.hypot(d[..., 0], d[..., 1])
    return np.asarray(far), np.atleast_1d(far <= CIRCLES_TOUCHING * sum(np.abs(arm) for arm in arms))


def _pla(inverse: bool, a: FloatArray, length: FloatArray, angle: FloatArray) -> Result:
    return a + _polar(length, -angle if inverse else angle), ()


def _plap(inverse: bool, a: FloatArray, length: FloatArray, angle: FloatArray, b: FloatArray) -> Result:
    d = b - a
    far, together = _together(d, length)
    unit = d / far[..., None]
    c, s = np.moveaxis(_polar(np.ones(()), -angle if inverse else angle), -1, 0)
    turned = np.stack([unit[..., 0] * c - unit[..., 1] * s, unit[..., 1] * c + unit[..., 0] * s], axis=-1)
    point = a + np.asarray(length)[..., None] * turned
    return point, (Fault(together, "{0} and {3} coincide, and give no direction"),)


def _pllp(inverse: bool, a: FloatArray, first: FloatArray, second: FloatArray, b: FloatArray) -> Result:
    d = b - a
    far, together = _together(d, first, second)
    along = ((first - second) * (first + second) / far + far) / 2.0
    # (first - along)(first + along), from the sides, so that nothing cancels if the circles touch
    across = (first + second + far) * (first + second - far) * (far + first - second) * (far - first + second)
    high = np.sqrt(np.maximum(across, 0.0)) / (2.0 * far) * (-1.0 if inverse else 1.0)
    ux, uy = d[..., 0] / far, d[..., 1] / far
    point = np.stack([a[..., 0] + along * ux - high * uy, a[..., 1] + along * uy + high * ux], axis=-1)
    slack = np.minimum(first + second - far, far - np.abs(first - second))
    slack = np.where(np.abs(slack) <= CIRCLES_TOUCHING * (first + second), 0.0, slack)
    same = np.atleast_1d(np.abs(first - second) <= CIRCLES_TOUCHING * (first + second))
    return point, (
        Fault(together & same, "{0} and {3} coincide, and so do the circles about them: any point on them would do"),
        Fault(together, "{0} and {3} coincide, and the circles about them do not meet", np.abs(first - second)),
        Fault(np.atleast_1d(~(slack >= 0.0)), "its circles do not meet", -slack),
    )


def _plpp(inverse: bool, a: FloatArray, length: FloatArray, b: FloatArray, c: FloatArray) -> Result:
    d = c - b
    far, together = _together(d, length)
    ux, uy = d[..., 0] / far, d[..., 1] / far
    ex, ey = a[..., 0] - b[..., 0], a[..., 1] - b[..., 1]
    along, off = ex * ux + ey * uy, np.abs(ey * ux - ex * uy)
    slack = length - off
    slack = np.where(np.abs(slack) <= CIRCLES_TOUCHING * np.maximum(length, off), 0.0, slack)
    reach = along + np.sqrt(np.maximum((length - off) * (length + off), 0.0)) * (-1.0 if inverse else 1.0)
    point = np.stack([b[..., 0] + reach * ux, b[..., 1] + reach * uy], axis=-1)
    return point, (
        Fault(together, "{2} and {3} coincide, and give no line"),
        Fault(np.atleast_1d(~(slack >= 0.0)), "its circle does not reach the line", -slack),
    )


def _palp(inverse: bool, a: FloatArray, angle: FloatArray, length: FloatArray, b: FloatArray) -> Result:
    _, together = _together(b - a, length)
    ahead, _ = _plap(False, a, np.ones(()), angle, b)
    backwards = (ahead[..., 0] >= a[..., 0]) ^ inverse
    point, (_, out_of_reach) = _plpp(
        False, b, length, np.where(backwards[..., None], ahead, a), np.where(backwards[..., None], a, ahead)
    )
    return point, (Fault(together, "{0} and {3} coincide, and give no direction"), out_of_reach)


def _pxy(inverse: bool, a: FloatArray, x: FloatArray, y: FloatArray) -> Result:
    del inverse
    return a + np.stack(np.broadcast_arrays(x, y), axis=-1), ()


def _ppp(inverse: bool, a: FloatArray, b: FloatArray, c: FloatArray) -> Result:
    del inverse
    return c + (b - a), ()


FUNCTIONS: dict[str, Callable[..., Result]] = {
    "PLA": _pla,
    "PLAP": _plap,
    "PLLP": _pllp,
    "PLPP": _plpp,
    "PALP": _palp,
    "PXY": _pxy,
    "PPP": _ppp,
}
"""Each takes whether it is inverse, and its arguments: points (2,) or (F, 2), numbers () or (F,)."""
