"""Things that leave the canvas that the script gives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.scene.model import Scene, Thing
from movimentum.scene.text_edits import resized
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.text import listed, number, time_text
from movimentum.things.kinds.arrow import ARROW
from movimentum.things.kinds.bar import BAR
from movimentum.things.kinds.disc import Round
from movimentum.things.kinds.graph import GRAPH, Axes
from movimentum.things.kinds.label import LABEL
from movimentum.things.kinds.sprite import SpriteImage
from movimentum.things.kinds.toothed import GEAR, RACK, Toothed

OUTSIDE, CUT_OFF = "canvas/outside", "canvas/cut-off"
CHUNK = 2048
MOST = 200_000
"""Poses of things that are examined; for a longer film, evenly spread frames."""
SLACK = 1.0
"""World pixels that may stick out: round ends, and things drawn up to the edge."""
LETTERS = (0.3, 1.2)
"""Of a font's size: the width of narrow and of the widest letters."""
Points = list[tuple[float, float]]


Visible = Callable[[Thing], Points | None]
"""The local corners of what is to be seen of a text or a picture; None for other things."""


def leaving(motion: PathMotion, visible: Visible | None = None) -> Iterator[Diagnostic]:
    """A note for things of which nothing is left to see at some time, and one for moving things that are cut off.

    A thing may be meant to leave, so this is not a warning. It is checked only if the script gives the canvas a size.
    Lines follow other things, hidden and faded-out things are not seen anyway, and a backdrop may be larger than the
    picture. A text is never cut on purpose. What may leave is measured by ``visible`` (None: estimated).
    """
    scene = motion.timeline.scene
    if scene.config.size is None:
        return
    things = [t for t in scene.things if t.is_body and not t.hidden and (t.anchors or t.picture)]
    if not things:
        return
    outlines = [_outlines(thing) for thing in things]
    measured: set[int] = set()
    size = np.array(scene.config.size, dtype=np.float64)
    gone: dict[int, float] = {}
    cut: dict[int, float] = {}
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for poses in _looked_at(motion, len(things)):
        for place, thing in enumerate(things):
            box = _box(thing, poses, outlines[place][1])
            if visible is not None and place not in measured and not _inside(box, size):
                measured.add(place)
                corners = visible(thing)
                if corners is not None:
                    outlines[place] = corners, corners
                    box = _box(thing, poses, corners)
            seen = _box(thing, poses, outlines[place][0])
            shown = poses.visible[thing.number] & poses.solved & _opaque(thing, poses)
            if not shown.any():
                continue
            low = np.minimum(low, box[shown, :2].min(axis=0))
            high = np.maximum(high, box[shown, 2:].max(axis=0))
            over = np.maximum(-seen[:, :2], seen[:, 2:] - size) >= SLACK
            if thing.kind not in (LABEL, GRAPH):
                over &= seen[:, 2:] - seen[:, :2] <= size  # a thing larger than the picture is not meant to fit
            away = np.maximum(box[:, :2] - size, -box[:, 2:]) >= _half_width(thing)
            for found, bad in ((cut, over.any(axis=1) & shown), (gone, away.any(axis=1) & shown)):
                if bad.any() and thing.number not in found:
                    found[thing.number] = float(poses.times[int(np.argmax(bad))])
    told = {*scene.mentioned, *(thing.number for thing in things if thing.kind in (LABEL, GRAPH))}
    cut = {t: time for t, time in cut.items() if t in told and t not in gone}
    if gone:
        yield _told(motion, gone, OUTSIDE, "outside the canvas", low, high)
    if cut:
        yield _told(motion, cut, CUT_OFF, "cut off by the edge of the canvas", low, high)


def _inside(box: FloatArray, size: FloatArray) -> bool:
    return bool(((box[:, :2] >= 0.0) & (box[:, 2:] <= size)).all())


def _looked_at(motion: PathMotion, things: int) -> Iterator[Poses]:
    count = motion.timeline.frame_count
    every = -(-count * things // MOST)
    if every <= 1:
        for first in range(0, count, CHUNK):
            yield motion.poses(first, min(first + CHUNK, count), angles=False)
        return
    times: list[Fraction] = [motion.timeline.frame_time(frame) for frame in range(0, count, every)]
    for first in range(0, len(times), CHUNK):
        yield motion.poses_at(times[first : first + CHUNK])


def _box(thing: Thing, poses: Poses, outline: Points) -> FloatArray:
    """(F, 4) left, bottom, right, top of a thing's local points and what lies around them."""
    reach = _radius(thing)
    places = np.stack([poses.world(thing.number, point) for point in outline], axis=1)
    return np.concatenate([places.min(axis=1) - reach, places.max(axis=1) + reach], axis=1)


def _outlines(thing: Thing) -> tuple[Points, Points]:
    """Local points that are certainly drawn, and points around everything that may be drawn (lines without their
    width).

    A picture is assumed to fill at least the ellipse in its frame: wheels have clear corners.
    """
    anchors = [anchor.local for anchor in thing.anchors] or [(0.0, 0.0)]
    match thing.own:
        case SpriteImage(image_size=(_, _) as size, scale=scale):
            width, height = (side * scale for side in size)
            turns = np.arange(24) * (np.pi / 12.0)
            x, y = 0.5 * width * (1.0 + np.cos(turns)), 0.5 * height * (1.0 + np.sin(turns))
            inside = [thing.placement.affine.apply(*point) for point in zip(x.tolist(), y.tolist(), strict=True)]
            corners = ((0.0, 0.0), (width, 0.0), (0.0, height), (width, height))
            return inside, [thing.placement.affine.apply(*corner) for corner in corners]
        case _ if thing.kind is LABEL:
            size = thing.look.size
            x, y = anchors[0]
            least, most = (letter * size * len(thing.text or "") for letter in LETTERS)
            part = {"left": 0.0, "center": 0.5, "right": 1.0}[thing.look.align]
            near, far = x - part * least, x - part * most
            return [(near, y), (near + least, y + 0.5 * size)], [(far, y - 0.3 * size), (far + most, y + size)]
        case Axes(sides=(wide, high)):
            (x, y), *_ = anchors
            field = [(x, y), (x + wide, y), (x, y + high), (x + wide, y + high)]
            return field, field
        case Toothed() if thing.kind is RACK:
            return _rack(thing)
        case Round() | Toothed():
            return anchors[:1], anchors[:1]
        case _ if thing.look.drawn is not None:
            drawn = [anchors[number] for number in thing.look.drawn]
            return drawn, drawn
        case _:
            return anchors, anchors


def _radius(thing: Thing) -> float:
    """How far a round thing reaches from its centre."""
    match thing.own:
        case Round(radius):
            return radius
        case Toothed(module=module, inner=inner) as gear if thing.kind is GEAR:
            return gear.pitch_radius + module * (3.25 if inner else 1.0)
        case _:
            return 0.0


def _rack(thing: Thing) -> tuple[Points, Points]:
    """A rack's pitch line, and a box around it."""
    module, teeth = thing.toothed.module, thing.toothed.teeth
    turn = np.radians(thing.tooth_direction)
    x, y = thing.anchors[0].local
    c, s = float(np.cos(turn)), float(np.sin(turn))
    begin, end = -0.5 * np.pi * module, (teeth - 0.5) * np.pi * module

    def placed(*places: tuple[float, float]) -> Points:
        return [(x + c * u - s * v, y + s * u + c * v) for u, v in places]

    high, low = module, -3.25 * module
    return placed((begin, 0.0), (end, 0.0)), placed((begin, low), (end, low), (begin, high), (end, high))


def _half_width(thing: Thing) -> float:
    """How far the line of a thing reaches around its points."""
    if thing.kind is ARROW:
        return 2.0 * thing.look.width
    return 0.5 * thing.look.width if thing.kind.broad else 0.5 * (thing.look.outline or 0.0)


def _opaque(thing: Thing, poses: Poses) -> NDArray[np.bool_]:
    opacity = poses.properties.get((thing.number, "opacity"))
    return np.full(len(poses.frames), thing.look.opacity > 0.0) if opacity is None else opacity > 0.0


def _told(
    motion: PathMotion, when: dict[int, float], code: str, where: str, low: FloatArray, high: FloatArray
) -> Diagnostic:
    scene = motion.timeline.scene
    assert scene.config.size is not None
    first = min(when, key=lambda t: (when[t], t))
    others = [f"`{scene.things[t].name}` from t = {time_text(when[t])} on" for t in sorted(when) if t != first]
    width, height = scene.config.size
    margin = max((t.look.width for t in scene.things if t.kind in (BAR, ARROW)), default=0.0)
    left, bottom = (float(np.floor(value - margin)) for value in low)
    right, top = (float(np.ceil(value + margin)) for value in high)
    notes = [
        f"the drawing reaches from [{number(left, 6)}, {number(bottom, 6)}] to [{number(right, 6)}, {number(top, 6)}]"
    ]
    if others:
        notes.insert(0, f"so is {listed(others, 4)}")
    return Diagnostic(
        code=code,
        severity=Severity.NOTE,
        message=f"`{scene.things[first].name}` is {where} ({width} x {height}) at t = {time_text(when[first])}",
        span=scene.things[first].name_span,
        notes=tuple(notes),
    ).advised(*_remedy(scene, (left, bottom), (right, top)))


def _remedy(scene: Scene, low: tuple[float, float], high: tuple[float, float]) -> tuple[Fix, ...]:
    assert scene.config.size is not None
    fps = str(scene.config.fps)
    if min(low) >= 0.0:
        width, height = (max(side, round(value)) for side, value in zip(scene.config.size, high, strict=True))
        title, edit = f"`.config({fps}, {width}, {height})` holds everything", resized(scene, (width, height))
        return (Fix(title, () if edit is None else (edit,)),)
    edit = resized(scene, None)
    title = (
        f"`.config({fps})` without a size fits the canvas to everything; a size of"
        f" {round(high[0] - min(low[0], 0.0))} x {round(high[1] - min(low[1], 0.0))} does, if everything is moved by"
        f" [{number(max(0.0, -low[0]), 6)}, {number(max(0.0, -low[1]), 6)}]"
    )
    return (Fix(title, () if edit is None else (edit,)),)
