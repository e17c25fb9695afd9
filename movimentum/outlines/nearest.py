"""Where two outlines are nearest to each other, found afresh for each pose by searching the whole of both.

As functions of the pose these places have derivatives: those that keep the contact equations at zero. So expressions
built on them have exact rates. The places themselves are found in floats, which is enough for a distance, as its
derivative with respect to the places is zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import ZERO, Expr, add, call, const, div, mul, neg, sub, symbol
from movimentum.expressions.walk import substitute
from movimentum.outlines.contour import Contour, derivative_by, numeric, substitute_place
from movimentum.outlines.nearest_search import nearest_of_two, nearest_to_points
from movimentum.records import dataclass, replace

U, V = symbol("place"), symbol("other place")
LENGTH_EXCESS = 2
POSES_AT_A_TIME = 256
"""Poses of a point that are compared at once."""


@dataclass(frozen=True, slots=True)
class Nearest:
    """The place on ``first`` (``which`` 0) or on ``second`` (1) where both are nearest; ``second`` None: a point. With
    `LENGTH_EXCESS` it is how much longer the way between them is than across the first: more than 1 where they overlap
    and two places together stop the shortest way out.

    Arguments are (x, y) of the point in the frame of ``first``; or of the origin of ``second`` there, and cosine and
    sine of how far it is turned. ``counts_rounds``: the rounds of a closed outline count where the place is followed,
    and everywhere from ``drawn`` on, if that is not None: where it is as everything is drawn. ``share``: it is given by
    its share of the outline's length.
    """

    first: Contour
    second: Contour | None = None
    which: int = 0
    counts_rounds: bool = False
    drawn: float | None = None
    share: bool = False

    def other(self, which: int) -> Nearest:
        """The place on the other one."""
        return replace(self, which=which, counts_rounds=False, drawn=None, share=False)

    def counting_rounds(self, drawn: float | None = None) -> Nearest:
        """The same with rounds that count."""
        return replace(self, counts_rounds=True, drawn=drawn)

    def shared(self) -> Nearest:
        """The same with rounds that count, as a share of the length."""
        return replace(self, counts_rounds=True, share=True)

    @property
    def uncounted(self) -> Nearest:
        """The same place, whoever asks for it."""
        return replace(self, counts_rounds=False, drawn=None, share=False) if self.counts_rounds or self.share else self

    def place(self, *pose: Expr) -> Expr:
        """The place as an expression."""
        return Expr("nearest" if self.second is None else "nearest-turned", pose, self)

    def rate(self, node: Expr, d: Sequence[Expr]) -> Expr:
        """How fast the place moves, given how its arguments do: the rows of the contact stay zero."""
        if self.which == LENGTH_EXCESS:
            return ZERO
        if self.share:
            place = Expr(node.op, node.args, self.uncounted)
            pace = substitute_place(derivative_by(self.outline.arc_length), place)
            return mul(div(pace, const(self.outline.length)), self.uncounted.rate(place, d))
        return _rate(self, node, d)

    def value(self, m: Any, *pose: Any) -> Any:
        """The place in any arithmetic m; it is found in floats."""
        if hasattr(m, "rounded"):
            return m.floats(self.at(*(m.rounded(each) for each in pose)))
        if all(isinstance(each, int | float | np.ndarray | np.floating) for each in pose):
            return self.at(*pose)
        return type(pose[0])(self.at(*(float(each) for each in pose)))

    @property
    def outline(self) -> Contour:
        """The one that the place is on."""
        return self.both[self.which]

    @property
    def both(self) -> tuple[Contour, Contour]:
        """The two outlines; of one and a point, the one twice."""
        return self.first, self.second or self.first

    @property
    def count(self) -> int:
        """How many places there are."""
        return 1 if self.second is None else 2

    def at(self, *pose: Any) -> Any:
        """The place for floats of any shape that broadcast; nan where there is none."""
        arrays = np.broadcast_arrays(*(np.asarray(each, dtype=np.float64) for each in pose))
        shape = arrays[0].shape
        flat = np.stack([each.reshape(-1) for each in arrays])
        found = _places(self.first, self.second, flat.tobytes(), flat.shape[1])[self.which].reshape(shape)
        if self.share:
            (found,) = numeric([self.outline.arc_length])(found)
            found = found / self.outline.length
        return found if shape else float(found)


@lru_cache(maxsize=16)
def _places(first: Contour, second: Contour | None, pose: bytes, count: int) -> FloatArray:
    """(3, F): both places, and how much longer the way between them is than across, found together."""
    args = np.frombuffer(pose).reshape(-1, count)
    result = np.full((3, count), np.nan)
    good = np.logical_and.reduce(np.isfinite(args), axis=0)
    for begin in range(0, count, POSES_AT_A_TIME):
        some = np.nonzero(good[begin : begin + POSES_AT_A_TIME])[0] + begin
        if len(some):
            result[:, some] = (
                nearest_to_points(first, args[:, some])
                if second is None
                else nearest_of_two(first, second, args[:, some])
            )
    return result


# --- as expressions


def in_frame(second: Contour, pose: tuple[Expr, ...], place: Expr) -> tuple[tuple[Expr, Expr], tuple[Expr, Expr]]:
    """A place of ``second`` and its direction there, in the frame of the first."""
    x, y, c, s = pose
    px, py, tx, ty = (substitute_place(each, place) for each in (*second.position, *second.direction))
    return (
        (add(x, sub(mul(c, px), mul(s, py))), add(y, add(mul(s, px), mul(c, py)))),
        (sub(mul(c, tx), mul(s, ty)), add(mul(s, tx), mul(c, ty))),
    )


def contact_rows(touch: Nearest, pose: tuple[Expr, ...], places: tuple[Expr, ...]) -> list[Expr]:
    """What is zero where the places are those of a contact: the line between them is across the outlines."""
    first = touch.first
    ax, ay, tx, ty = (substitute_place(each, places[0]) for each in (*first.position, *first.direction))
    if touch.second is None:
        (x, y), found = (pose[0], pose[1]), []
    else:
        (x, y), (gx, gy) = in_frame(touch.second, pose, places[1])
        found = [sub(mul(tx, gy), mul(ty, gx))]
    return [*found, add(mul(sub(x, ax), tx), mul(sub(y, ay), ty))]


def signed_distance(touch: Nearest, pose: tuple[Expr, ...], places: tuple[Expr, ...]) -> Expr:
    """The distance between the places: negative where they overlap."""
    first = touch.first
    ax, ay, tx, ty = (substitute_place(each, places[0]) for each in (*first.position, *first.direction))
    x, y = (pose[0], pose[1]) if touch.second is None else in_frame(touch.second, pose, places[1])[0]
    across = sub(mul(tx, sub(y, ay)), mul(ty, sub(x, ax)))
    length = call("sqrt", add(mul(tx, tx), mul(ty, ty)))
    found = div(across, length)
    if touch.second is not None and not (first.facets.convex and touch.second.facets.convex):
        found = mul(found, touch.other(LENGTH_EXCESS).place(*pose))
    return found if first.side > 0.0 else neg(found)


def _rate(touch: Nearest, node: Expr, d: Sequence[Expr]) -> Expr:
    marks = tuple(symbol(("pose", k)) for k in range(len(node.args)))
    places = (U, V)[: touch.count]
    nodes = {place: Expr(node.op, node.args, touch.other(k)) for k, place in enumerate(places)}
    back = {**dict(zip(marks, node.args, strict=True)), **nodes}

    def put(root: Expr) -> Expr:
        return substitute(root, lambda leaf: back.get(leaf))

    found = contact_rows(touch, marks, places)
    changes: list[Expr] = []
    for row in found:
        total = ZERO
        for mark, rate in zip(marks, d, strict=True):
            total = add(total, mul(put(derivative_by(row, mark)), rate))
        changes.append(neg(total))
    matrix = [[put(derivative_by(row, place)) for place in places] for row in found]
    if touch.count == 1:
        return div(changes[0], matrix[0][0])
    (a, b), (c, e) = matrix
    determinant = sub(mul(a, e), mul(b, c))
    top = (
        sub(mul(changes[0], e), mul(b, changes[1])) if touch.which == 0 else sub(mul(a, changes[1]), mul(changes[0], c))
    )
    return div(top, determinant)
