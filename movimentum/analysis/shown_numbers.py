"""Numbers shown in pictures, in the poses of every frame: those in texts, velocities, accelerations and poles.

They are stored with the poses as properties of the thing that shows them, and go with the poses to wherever pictures
are drawn. A pole is where a body has no velocity at a moment, or where two bodies have the same velocity.

With the velocity v of a point A of a body and its angular velocity w (radians per time unit), the velocity at P is
v + w J (P - A), J a quarter turn. Where two bodies' are equal, (w1 - w2) P = w1 A1 - w2 A2 - J (v2 - v1): a pole in
homogeneous coordinates, which is at infinity where the bodies turn alike. The inflection circle has its centre at
P + a / (2 w^2), where a is the acceleration of the body's point at its pole P, and goes through P (Bottema and Roth,
Theoretical Kinematics, 1979). All rates are exact (`solver.rates`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import Expr, symbol, walk
from movimentum.query import reader
from movimentum.records import dataclass, replace
from movimentum.scene.model import AnchorCoordinate, FixedPoint, Scene, Thing, ThingAngle
from movimentum.scene.shown import ARROW, CAMERA, CIRCLE, FILM, POLE, CameraView, Shown, text_number, value_name
from movimentum.solver.motion import MotionOfAnyAccuracy, PathMotion
from movimentum.solver.poses import Poses
from movimentum.things.kind import Valued
from movimentum.things.kinds.poles import CENTRE, INFLECTION, POLODE
from movimentum.things.kinds.vector import VectorScale
from movimentum.tolerances import AT_REST, LARGEST_VIEW, LEAST_DIVISOR, SAME_ZOOM, SMALLEST_VIEW


def pole_of(
    motion: PathMotion, bodies: Sequence[int], poses: Poses, times: Sequence[Fraction]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(F,) each, (x w, y w, w): the pole of a body, or that of the first body relative to the second, at ``times``,
    whose poses are ``poses``. ``w`` is 0 where it is at infinity; nan where there is no velocity. Where the bodies are
    at rest for a moment, it is where the pole comes from and goes to: the ratio of the derivatives (l'Hôpital).
    """
    found = _between(motion, bodies, poses, times, 1)
    speed = np.abs(found).max(axis=0)
    still = np.flatnonzero(speed <= AT_REST * motion.size**2)
    if len(still):
        some = [times[number] for number in still.tolist()]
        slopes = _between(motion, bodies, poses.select(still), some, 2)
        begins = np.abs(slopes).max(axis=0) * AT_REST > speed[still]
        found[:, still[begins]] = slopes[:, begins]
    x, y, w = found
    return x, y, w


def place_of(pole: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
    """(F, 2) the pole in the world; nan where it is at infinity."""
    x, y, w = pole
    with np.errstate(all="ignore"):
        found = np.stack([x, y], axis=-1) / w[:, None]
    return np.where(np.isfinite(found), found, np.nan)


def inflection_circle(
    motion: PathMotion, body: int, poses: Poses, times: Sequence[Fraction]
) -> tuple[FloatArray, FloatArray]:
    """(F, 2) centres and (F,) radii of the inflection circle; nan where there is none."""
    place, w = place_of(pole := pole_of(motion, (body,), poses, times)), pole[2]
    where = _anchor(motion, body, poses)
    ax, ay, alpha = _rates_of_body(motion, body, 2, times)
    away = place - where
    turned = np.stack([-away[:, 1], away[:, 0]], axis=-1)
    there = np.stack([ax, ay], axis=-1) + alpha[:, None] * turned - (w**2)[:, None] * away
    with np.errstate(all="ignore"):
        half = there / (2.0 * np.where(np.abs(w) > LEAST_DIVISOR, w, np.nan) ** 2)[:, None]
    return place + half, np.hypot(half[:, 0], half[:, 1])


def _between(
    motion: PathMotion, bodies: Sequence[int], poses: Poses, times: Sequence[Fraction], order: int
) -> FloatArray:
    """(3, F): the `_moment` of the first body, less that of the second."""
    first, *others = (_moment(motion, body, poses, times, order) for body in bodies)
    return first - others[0] if others else first


def _moment(motion: PathMotion, body: int, poses: Poses, times: Sequence[Fraction], order: int) -> FloatArray:
    """(3, F): w A - J^-1 v, and w, where J^-1 (a, b) = (b, -a) and v + w J (P - A) = 0; of ``order`` 2 its rate."""
    x, y = _anchor(motion, body, poses).T
    vx, vy, w = _rates_of_body(motion, body, 1, times)
    if order == 1:
        return np.stack([w * x - vy, w * y + vx, w])
    ax, ay, alpha = _rates_of_body(motion, body, 2, times)
    return np.stack([alpha * x + w * vx - ay, alpha * y + w * vy + ax, alpha])


def _anchor(motion: PathMotion, body: int, poses: Poses) -> FloatArray:
    return poses.world(body, motion.timeline.scene.things[body].anchors[0].local)


def _rates_of_body(motion: PathMotion, body: int, order: int, times: Sequence[Fraction]) -> FloatArray:
    """(3, F): of x and y of a body's first anchor, and of its angle in radians."""
    from movimentum.solver.rates.rates import UndefinedRate, rates_at

    asked: list[Expr] = [symbol(AnchorCoordinate(body, 0, axis)) for axis in (0, 1)]
    try:
        found = rates_at(motion, [*asked, symbol(ThingAngle(body))], order, times)
    except UndefinedRate:
        return np.full((3, len(times)), np.nan)
    found[2] *= math.pi / 180.0
    return found


def with_shown_numbers(motion: MotionOfAnyAccuracy, poses: Poses, instants: Sequence[Fraction] | None = None) -> Poses:
    """``poses`` with all numbers that pictures of them show; ``instants``: their exact times, if they are not frames.

    A number without a value is nan; an arrow without one is 0.
    """
    scene = motion.timeline.scene
    if not scene.shows_numbers or not len(poses.frames):
        return poses
    times = [motion.timeline.frame_time(frame) for frame in poses.frames.tolist()] if instants is None else instants
    found = {**texts_of(scene, motion.path)(poses), **_arrows(motion, poses, instants), **camera_rows(scene, poses)}
    for thing in scene.things:
        if thing.values and not thing.hidden:
            rows = shown_values(motion.path, thing, poses, times)
            found |= {(thing.number, value_name(*place)): row for place, row in rows.items()}
        if thing.kind in (CENTRE, POLODE) and not thing.hidden:
            from movimentum.analysis.shown_numbers import pole_of  # few films show a pole

            pole = pole_of(motion.path, thing.about, poses, times)
            found |= {(thing.number, name): row for name, row in zip(POLE, pole, strict=True)}
        elif thing.kind is INFLECTION and not thing.hidden:
            from movimentum.analysis.shown_numbers import inflection_circle

            middle, radius = inflection_circle(motion.path, thing.about[0], poses, times)
            rows = (middle[:, 0], middle[:, 1], radius)
            found |= {(thing.number, name): row for name, row in zip(CIRCLE, rows, strict=True)}
    return replace(poses, properties={**poses.properties, **found})


def shown_values(
    motion: PathMotion, thing: Thing, poses: Poses, times: Sequence[Fraction]
) -> dict[tuple[int, int], FloatArray]:
    """(number, axis) -> (F,): what a graph shows in ``poses``, which are those at ``times``; nan where there is no
    value. Exact, its derivatives too.
    """
    places = [(number, axis) for number, value in enumerate(thing.values) for axis in range(len(value))]
    expressions = [part for value in thing.values for part in value]
    order = 1 if thing.kind.valued is Valued.VELOCITIES else 0  # of points, their velocities
    if order == 0 and not any(node.op == "derivative" for part in expressions for node in walk(part)):
        return dict(zip(places, reader(motion.timeline.scene, expressions, motion)(poses), strict=True))
    return dict(zip(places, _at_each(motion, expressions, order, times), strict=True))


def _at_each(motion: PathMotion, expressions: Sequence[Expr], order: int, times: Sequence[Fraction]) -> FloatArray:
    """(n, F) rates; nan where a wish leaves none defined."""
    from movimentum.solver.rates.rates import UndefinedRate, rates_at

    try:
        return rates_at(motion, expressions, order, times)
    except UndefinedRate:
        if len(times) == 1:
            return np.full((len(expressions), 1), np.nan)
        half = len(times) // 2
        parts = [_at_each(motion, expressions, order, some) for some in (times[:half], times[half:])]
        return np.concatenate(parts, axis=1)


def texts_of(scene: Scene, motion: PathMotion | None = None) -> Callable[[Poses], dict[tuple[int, str], FloatArray]]:
    """Reads the numbers that the texts of a scene show, as properties of poses; ``motion``: see `reader`."""
    places = [
        (thing.number, text_number(number), shown)
        for thing in scene.things
        for number, shown in enumerate(piece for piece in thing.pieces if isinstance(piece, Shown))
    ]
    read = reader(scene, [shown.value for _, _, shown in places], motion)

    def texts(poses: Poses) -> dict[tuple[int, str], FloatArray]:
        return {(thing, name): found for (thing, name, _), found in zip(places, read(poses), strict=True)}

    return texts


def _arrows(
    motion: MotionOfAnyAccuracy, poses: Poses, instants: Sequence[Fraction] | None
) -> dict[tuple[int, str], FloatArray]:
    scene = motion.timeline.scene
    vectors = [thing for thing in scene.things if isinstance(thing.own, VectorScale) and not thing.hidden]
    if not vectors:
        return {}
    times = [motion.timeline.frame_time(frame) for frame in poses.frames.tolist()] if instants is None else instants
    found: dict[tuple[int, str], FloatArray] = {}
    for thing in vectors:
        for name, values in zip(ARROW, _rates(motion, thing, times), strict=True):
            found[thing.number, name] = values
    return found


def _rates(motion: MotionOfAnyAccuracy, thing: Thing, times: Sequence[Fraction]) -> FloatArray:
    """(2, F): a vector's arrow at ``times``."""
    from movimentum.solver.rates.rates import UndefinedRate, rates_at

    (ref,), own = thing.through, thing.own
    assert isinstance(own, VectorScale)
    if isinstance(ref, FixedPoint):
        return np.zeros((2, len(times)))
    coordinates = [symbol(AnchorCoordinate(ref.thing, ref.anchor, axis)) for axis in (0, 1)]
    order, scale = (1, own.velocity) if own.velocity is not None else (2, own.acceleration or 0.0)
    try:
        return np.nan_to_num(scale * rates_at(motion.path, coordinates, order, times), posinf=0.0, neginf=0.0)
    except UndefinedRate:
        if len(times) == 1:
            return np.zeros((2, 1))
        return np.concatenate([_rates(motion, thing, [time]) for time in times], axis=1)  # elsewhere there may be one


# --- where the camera is in every frame: how views go over into each other


@dataclass(frozen=True, slots=True)
class _CameraShot:
    """The view of F frames: ``centre`` (F, 2) plus ``rest`` (F,) times the middle of the canvas; ``zoom`` (F,)."""

    centre: FloatArray
    rest: FloatArray
    zoom: FloatArray

    def towards(self, other: _CameraShot, share: FloatArray) -> _CameraShot:
        """A ``share`` of the way to another shot. Zooms grow in even ratios, and the corners of what is seen go on
        straight lines: a zoom alone leaves one point of the picture where it is.
        """
        zoom = self.zoom ** (1.0 - share) * other.zoom**share
        near = np.abs(np.log(other.zoom / self.zoom)) < SAME_ZOOM
        whole = np.where(near, 1.0, 1.0 / self.zoom - 1.0 / other.zoom)
        part = np.where(near, share, (1.0 / self.zoom - 1.0 / zoom) / whole)
        # exact at both ends
        part = np.where(share >= 1.0, 1.0, np.where(share <= 0.0, 0.0, part))
        zoom = np.where(share >= 1.0, other.zoom, np.where(share <= 0.0, self.zoom, zoom))
        centre = self.centre + part[:, None] * (other.centre - self.centre)
        return _CameraShot(centre, self.rest + part * (other.rest - self.rest), zoom)


def camera_rows(scene: Scene, poses: Poses) -> dict[tuple[int, str], FloatArray]:
    """The camera's views in ``poses``, as properties of the film: see `_CameraShot`."""
    if not scene.views:
        return {}
    count = len(poses.times)
    shot = _CameraShot(np.zeros((count, 2)), np.ones(count), np.ones(count))
    values = reader(scene, [part for view in scene.views for part in (*view.centre, view.zoom)])(poses)
    for view in scene.views:
        *centre, zoom = (values.pop(0) for _ in range(len(view.centre) + 1))
        known: BoolArray = np.logical_and.reduce([np.isfinite(value) for value in (*centre, zoom)])
        begun = (poses.times >= float(view.begin)) & known
        middle = np.stack(centre, axis=1) if centre else np.zeros((count, 2))
        aim = _CameraShot(
            np.where(known[:, None], middle, 0.0),
            np.full(count, 0.0 if centre else 1.0),
            np.clip(np.where(known, zoom, 1.0), SMALLEST_VIEW, LARGEST_VIEW),
        )
        shot = shot.towards(aim, np.where(begun, _share(view, poses.times), 0.0))
    rows = (shot.centre[:, 0], shot.centre[:, 1], shot.rest, shot.zoom)
    return {(FILM, name): row for name, row in zip(CAMERA, rows, strict=True)}


def _share(view: CameraView, times: FloatArray) -> FloatArray:
    """How far the camera has gone to a view, eased as in the language."""
    if view.cut or view.until is None:
        return np.ones(len(times))
    u = np.clip((times - float(view.begin)) / float(view.until - view.begin), 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)
