"""Outlines as parts that may touch: corners and round parts, straight edges, hollows, and other curves.

A *knob* is a point with a radius: a corner (radius 0), a convex arc, a disc. It touches with the directions of its
*fan*, those of its outward normals. An *edge* is straight. A *bowl* is a concave arc, which is touched from inside. A
*bend* is a piece of any other curve that turns one way and not far, so that it has one place for each direction.
Everything within the outline's *reach* belongs to it: knobs and edges are so much larger, bowls smaller.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.outlines.contour import Contour
from movimentum.records import dataclass
from movimentum.tolerances import LEAST_DIVISOR, OUTLINE_CLOSES, PIECE_ROUND, PIECE_STRAIGHT, PIECE_TURNS

SAMPLES = 17
"""By which a piece of an outline counts as straight, an arc, or neither."""
MOST_BEND_TURN = math.radians(40.0)
"""That a bend makes at most."""
END_CAP = math.radians(90.0)
"""How far round its ends an open curve is touched."""


@dataclass(frozen=True, slots=True, eq=False)
class Bends:
    """Pieces (N,) of one contour, from ``first`` to ``last`` of its parameter; ``side``: of its outward normal.
    ``reach``: as that of a skin. ``quick``: what gives the contour's values quickly, if there is such a thing.
    """

    contour: Contour
    first: FloatArray
    last: FloatArray
    side: float
    reach: float
    quick: Callable[[FloatArray], FloatArray] | None = None

    def values(self, place: FloatArray) -> FloatArray:
        """`Contour.values`."""
        return self.contour.values(place) if self.quick is None else self.quick(self.contour.inside(place))


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """What of an outline may touch. ``knobs`` (P, 5): x, y, radius, direction of the middle of the fan and half its
    extent (radians; π: all round). ``edges`` (E, 5): from (x, y) to (x, y) with what is outside on the right, and its
    reach. ``bowls`` (B, 5): as knobs, with the directions from the centre to the arc. ``bends``: other curves.

    The reach is in all of them.
    """

    knobs: FloatArray
    edges: FloatArray
    bowls: FloatArray
    bends: tuple[Bends, ...]

    def placed(self, x: float, y: float, c: float, s: float) -> Skin:
        """The same after a turn (cosine, sine) and a shift."""
        turn = math.atan2(s, c)

        def moved(px: FloatArray, py: FloatArray) -> tuple[FloatArray, FloatArray]:
            return x + c * px - s * py, y + s * px + c * py

        def rounds(part: FloatArray) -> FloatArray:
            there = part.copy()
            there[:, 0], there[:, 1] = moved(part[:, 0], part[:, 1])
            there[:, 3] = part[:, 3] + turn
            return there

        edges = np.column_stack([*moved(*self.edges[:, :2].T), *moved(*self.edges[:, 2:4].T), self.edges[:, 4]])
        bends = tuple(
            Bends(bend.contour.placed((c, -s, s, c), (x, y)), bend.first, bend.last, bend.side, bend.reach)
            for bend in self.bends
        )
        return Skin(rounds(self.knobs), edges, rounds(self.bowls), bends)


def disc_skin(radius: float, at: tuple[float, float] = (0.0, 0.0)) -> Skin:
    """That of a disc, or of a point."""
    return _skin([(*at, radius, 0.0, math.pi)], [], [], ())


def _skin(
    knobs: Sequence[Sequence[float]],
    edges: Sequence[Sequence[float]],
    bowls: Sequence[Sequence[float]],
    bends: Sequence[Bends],
) -> Skin:
    def table(rows: Sequence[Sequence[float]], columns: int) -> FloatArray:
        return np.array(rows, dtype=np.float64).reshape(-1, columns)

    return Skin(table(knobs, 5), table(edges, 5), table(bowls, 5), tuple(bends))


def gathered_skins(skins: Sequence[Skin]) -> Skin:
    """All parts of all of them in one table each, in order, each in its own skin's frame."""
    if len(skins) == 1:
        return skins[0]
    knobs, edges, bowls = (
        np.concatenate([getattr(skin, name) for skin in skins]) for name in ("knobs", "edges", "bowls")
    )
    bends = tuple(bend for skin in skins for bend in skin.bends)
    return Skin(knobs, edges, bowls, bends)


@lru_cache(maxsize=256)
def skin_of(contour: Contour) -> Skin:
    """That of a contour."""
    knobs: list[tuple[float, ...]] = []
    edges: list[tuple[float, ...]] = []
    bowls: list[tuple[float, ...]] = []
    firsts: list[float] = []
    lasts: list[float] = []
    size = max(contour.size, LEAST_DIVISOR)
    side, reach = contour.side, contour.reach
    for begin, end in zip(contour.breaks, contour.breaks[1:], strict=False):
        places = np.linspace(begin, end, SAMPLES)
        inner = places.copy()
        inner[-1] = end if not contour.closed else np.nextafter(end, begin)
        x, y, tx, ty = contour.values(inner)[:4]
        extent = max(float(np.ptp(x)), float(np.ptp(y)))
        before = math.atan2(ty[0], tx[0])
        if extent <= OUTLINE_CLOSES * size:
            turn = _turned(tx, ty)
            if turn * side < -PIECE_TURNS:  # it turns away from what is outside
                middle = before + turn / 2.0 + side * math.pi / 2.0
                knobs.append((x[0], y[0], reach, middle, abs(turn) / 2.0))
            continue
        if _is_straight(x, y, extent):
            ends = (x[0], y[0], x[-1], y[-1])
            edges.append((*ends, reach) if side < 0.0 else (*ends[2:], *ends[:2], reach))
            continue
        arc = _arc(x, y, extent)
        if arc is not None:
            cx, cy, radius = arc
            turn = _turned(tx, ty)
            out = side * turn < 0.0
            middle = before + turn / 2.0 + side * math.pi / 2.0
            half = math.pi if contour.closed and len(contour.breaks) == 2 else abs(turn) / 2.0
            if out:
                knobs.append((cx, cy, radius + reach, middle, half))
            else:
                bowls.append((cx, cy, radius - reach, middle + math.pi, half))
            continue
        for first, last in _one_way_pieces(contour, begin, end):
            firsts.append(first)
            lasts.append(last)
    bends = (Bends(contour, np.array(firsts), np.array(lasts), side, reach),) if firsts else ()
    if not contour.closed:
        for place, way in ((contour.first, -1.0), (contour.last, 1.0)):
            x0, y0, tx0, ty0 = (float(v) for v in contour.values(np.array([place]))[:4, 0])
            normal = math.atan2(ty0, tx0) + side * math.pi / 2.0
            ahead = math.atan2(way * ty0, way * tx0)
            towards = math.remainder(ahead - normal, 2.0 * math.pi)
            knobs.append((x0, y0, reach, normal + math.copysign(END_CAP / 2.0, towards), END_CAP / 2.0))
    return _skin(knobs, edges, bowls, bends)


def _turned(tx: FloatArray, ty: FloatArray) -> float:
    """How far a direction turns along its samples."""
    return float(np.sum(np.arctan2(tx[:-1] * ty[1:] - ty[:-1] * tx[1:], tx[:-1] * tx[1:] + ty[:-1] * ty[1:])))


def _is_straight(x: FloatArray, y: FloatArray, extent: float) -> bool:
    dx, dy = x[-1] - x[0], y[-1] - y[0]
    length = math.hypot(dx, dy)
    if length <= 0.5 * extent:
        return False
    return float(np.max(np.abs(dx * (y - y[0]) - dy * (x - x[0])))) <= PIECE_STRAIGHT * length * extent


def _arc(x: FloatArray, y: FloatArray, extent: float) -> tuple[float, float, float] | None:
    """The centre and the radius of the circle that the points are on."""
    third = (len(x) - 1) // 3
    (ax, ay), (bx, by), (cx, cy) = ((float(x[k]), float(y[k])) for k in (0, third, 2 * third))
    ux, uy, vx, vy = bx - ax, by - ay, cx - ax, cy - ay
    cross = 2.0 * (ux * vy - uy * vx)
    if abs(cross) <= PIECE_STRAIGHT * extent * extent:
        return None
    u, v = ux * ux + uy * uy, vx * vx + vy * vy
    px, py = ax + (vy * u - uy * v) / cross, ay + (ux * v - vx * u) / cross
    away = np.hypot(x - px, y - py)
    radius = float(np.mean(away))
    return (px, py, radius) if float(np.ptp(away)) <= PIECE_ROUND * extent else None


def _one_way_pieces(contour: Contour, begin: float, end: float) -> list[tuple[float, float]]:
    """A piece cut where it begins to turn the other way, and where it has turned far."""
    places = np.linspace(begin, end, 2049)
    inner = places.copy()
    inner[-1] = end if not contour.closed else np.nextafter(end, begin)
    _, _, tx, ty, _, _, rx, ry = contour.values(inner)
    bending = tx * ry - ty * rx
    sign = np.sign(np.where(np.abs(bending) > PIECE_TURNS * np.max(np.abs(bending)), bending, 0.0))
    cuts = [begin]
    k = 0
    total = 0.0
    current = sign[np.nonzero(sign)[0][0]] if sign.any() else 0.0
    step = np.arctan2(tx[:-1] * ty[1:] - ty[:-1] * tx[1:], tx[:-1] * tx[1:] + ty[:-1] * ty[1:])
    for k in range(len(step)):
        if sign[k + 1] != 0.0 and sign[k + 1] != current:
            low, high = places[k], places[k + 1]
            for _ in range(60):
                middle = 0.5 * (low + high)
                _, _, a, b, _, _, ra, rb = contour.values(np.array([middle]))[:, 0]
                low, high = (middle, high) if (a * rb - b * ra) * current > 0.0 else (low, middle)
            cuts.append(0.5 * (low + high))
            current, total = sign[k + 1], 0.0
            continue
        total += abs(float(step[k]))
        if total >= MOST_BEND_TURN and k + 1 < len(step):
            cuts.append(float(places[k + 1]))
            total = 0.0
    cuts.append(end)
    return [(a, b) for a, b in pairwise(cuts) if b > a]
