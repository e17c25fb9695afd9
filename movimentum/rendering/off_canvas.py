"""Things that leave the stated canvas, judged by what is drawn of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Fix, Severity, insertion
from movimentum.drawing.texts import written
from movimentum.records import replace
from movimentum.scene.model import Scene, Thing
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.text import is_plain, listed, number, time_text
from movimentum.things.kinds.arc import ARC
from movimentum.things.kinds.body import Composite
from movimentum.things.kinds.curve import Curved
from movimentum.things.kinds.dimension import DIMENSION, Distance
from movimentum.things.kinds.disc import Round
from movimentum.things.kinds.graph import GRAPH, Axes
from movimentum.things.kinds.ground import GROUND
from movimentum.things.kinds.inset import Detail
from movimentum.things.kinds.label import LABEL, Beside
from movimentum.things.kinds.sector import Annular, Wedge
from movimentum.things.kinds.sprite import SpriteImage
from movimentum.things.kinds.toothed import Toothed
from movimentum.things.kinds.vector import VECTOR
from movimentum.things.kinds.velocities import VELOCITIES

if TYPE_CHECKING:  # Pillow, and what draws, are loaded only where something is near the edge
    from movimentum.rendering.marks import PreparedMark

OUTSIDE, CUT_OFF = "canvas/outside", "canvas/cut-off"
CHUNK = 2048
MOST = 200_000
"""Poses of things that are examined; for a longer film, evenly spread frames."""
LARGEST = 16_000_000
"""Pixels of a picture that is looked at; decoding a larger one twice would take more memory than drawing it."""
SUPPORT = GROUND.size + 4.0
"""World pixels: a support reaches 0.98 of its size to the sides and down."""
SLACK = 1.0
"""World pixels that may stick out: what is drawn up to the edge, and the soft rim of letters."""
WRITTEN = (LABEL, GRAPH, VELOCITIES, DIMENSION, ARC, VECTOR)
"""Kinds with letters, which are never cut off on purpose."""
WIDEST, MORE = 1.3, 24
"""Of a font's size: the width of the widest letters; letters that a text with numbers may have besides its own."""
UP, ASIDE = 1.2, 0.4
"""Of a font's size: how far plain letters reach above their baseline, and below it or beside their widths."""


def leaving(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for things of which nothing is left to see at some time, and one for moving things that are cut off.

    A thing may be meant to leave, so this is not a warning. It is checked only if the script gives the canvas a size.
    Lines, springs and the like follow other things, hidden and faded-out things are not seen anyway, ``.offstage`` says
    that a thing is meant to leave, and a backdrop may be larger than the picture. A text is never cut on purpose.
    """
    scene = motion.timeline.scene
    if scene.config.size is None:
        return
    size = np.array(scene.config.size, dtype=np.float64)
    things = [t for t in scene.things if (t.is_body or t.kind in WRITTEN) and not (t.hidden or t.look.offstage)]
    things = [t for t in things if t.picture is None or _pixels(t.picture) <= LARGEST]
    if scene.views:  # a camera leaves out what it likes
        from movimentum.drawing.camera import is_still

        things = [t for t in things if is_still(scene, t.number)]
    close = [thing.number for thing in _near_the_edge(motion, things, size)] if things else []
    if not close:
        return
    from movimentum.analysis.shown_numbers import with_shown_numbers

    poses = [with_shown_numbers(motion, *part) for part in _looked_at(motion, len(scene.things), angles=True)]
    free = any(scene.things[each].kind is LABEL and scene.things[each].own.of_film for each in close)
    # labels look for their places among all things: once
    every = _boxes(motion, poses, [thing.number for thing in things] if free else close)
    boxes = {thing: every[thing] for thing in close if thing in every}
    relevant = {*scene.mentioned, *(thing.number for thing in things if thing.kind in WRITTEN)}
    times = np.concatenate([part.times for part in poses])
    gone: dict[int, float] = {}
    cut: dict[int, float] = {}
    for thing, box in boxes.items():
        low, high = box[:, :2], box[:, 2:]
        away = (np.maximum(low - size, -high) >= 0.0).any(axis=1)
        over = np.maximum(-low, high - size) >= SLACK
        if scene.things[thing].kind not in WRITTEN:
            over &= high - low <= size  # a thing larger than the picture is not meant to fit
        if away.any() and scene.things[thing].is_body:
            gone[thing] = float(times[int(np.argmax(away))])
        elif over.any() and thing in relevant:
            cut[thing] = float(times[int(np.argmax(over.any(axis=1)))])
    if not (gone or cut):
        return
    every |= _boxes(motion, poses, [thing.number for thing in things if thing.number not in every])
    sides = np.concatenate(list(every.values()))
    low, high = np.fmin.reduce(sides[:, :2], axis=0), np.fmax.reduce(sides[:, 2:], axis=0)
    if gone:
        yield _diagnostic(motion, gone, OUTSIDE, "outside the canvas", low, high)
    if cut:
        yield _diagnostic(motion, cut, CUT_OFF, "cut off by the edge of the canvas", low, high)


def _pixels(picture: SpriteImage) -> int:
    return math.prod(picture.image_size or (0, 0))


def _looked_at(motion: PathMotion, things: int, *, angles: bool) -> Iterator[tuple[Poses, Sequence[Fraction] | None]]:
    """The poses that are examined, and their times if they are not all frames."""
    count = motion.timeline.frame_count
    every = -(-count * things // MOST)
    for first in range(0, count, CHUNK * every):
        last = min(first + CHUNK * every, count)
        if every == 1:
            poses, times = motion.poses(first, last, angles=angles), None
        else:
            times = [motion.timeline.frame_time(frame) for frame in range(first, last, every)]
            poses = motion.poses_at(times)
        yield poses, times


def _near_the_edge(motion: PathMotion, things: Sequence[Thing], size: FloatArray) -> list[Thing]:
    """The things that may be drawn over the edge at some time: those whose points come so near to it."""
    scene = motion.timeline.scene
    supports = {(ref.thing, ref.anchor) for ref in scene.grounds}
    texts = _texts(scene) if any(thing.kind is LABEL and thing.pieces for thing in things) else None
    reach = {thing.number: math.inf if (thing.number, "scale") in scene.changing else _reach(thing) for thing in things}
    found = [thing for thing in things if math.isinf(reach[thing.number])]
    left = [thing for thing in things if not math.isinf(reach[thing.number])]
    for poses, _ in _looked_at(motion, len(scene.things), angles=texts is not None):
        inside: list[Thing] = []
        shown = poses if texts is None else texts(poses)
        for thing in left:
            places = np.stack([poses.world(*point) for point in _points(scene, thing, shown)], axis=1)
            margin = np.full((places.shape[1], 1), reach[thing.number])
            for each in range(len(thing.anchors)):
                if (thing.number, each) in supports and thing.picture is None:
                    margin[each] = max(margin[each, 0], SUPPORT)
            safe = ((places >= margin) & (places <= size - margin)).all(axis=(1, 2))
            (inside if (safe | ~poses.visible[thing.number]).all() else found).append(thing)
        left = inside
    return found


def _texts(scene: Scene) -> Callable[[Poses], Poses]:
    """Puts the numbers that texts show into poses."""
    from movimentum.analysis.shown_numbers import texts_of  # few texts have any

    numbers = texts_of(scene)
    return lambda poses: replace(poses, properties={**poses.properties, **numbers(poses)})


def _points(scene: Scene, thing: Thing, poses: Poses) -> list[tuple[int, tuple[float, float]]]:
    """Points that everything of a thing is near to."""
    if not thing.is_body:
        return [(ref.thing, scene.local(ref)) for ref in thing.through]
    match thing.own:
        case SpriteImage(image_size=(width, height), scale=scale):
            corners = ((x * scale, y * scale) for x in (0.0, width) for y in (0.0, height))
            places = [thing.placement.affine.apply(*corner) for corner in corners]
        case _ if thing.kind is LABEL:
            texts = written(thing.pieces, thing.number, poses) if thing.pieces else [thing.text or ""]
            places = [anchor.local for anchor in thing.anchors] + _letters(thing, texts)
        case _:
            places = [anchor.local for anchor in thing.anchors]
    return [(thing.number, place) for place in (places or [(0.0, 0.0)])]


def _letters(thing: Thing, texts: list[str]) -> list[tuple[float, float]]:
    """The corners of a box about a label's letters, whichever of ``texts`` it shows."""
    (x, y), size = thing.anchors[0].local if thing.anchors else (0.0, 0.0), thing.look.size
    if not all(map(is_plain, texts)):
        return [(-math.inf, 0.0), (math.inf, 0.0)]  # it has to be looked at
    wide = WIDEST * size * max(map(len, texts), default=0)
    left = x - {"left": 0.0, "center": 0.5, "right": 1.0}[thing.look.align] * wide
    aside = ASIDE * size
    return [(a, b) for a in (left - aside, left + wide + aside) for b in (y - aside, y + UP * size)]


def _reach(thing: Thing) -> float:
    """World pixels: what is drawn of a thing is certainly no farther from its points; infinite where that depends on
    the motion.
    """
    look, own = thing.look, thing.own
    letters = WIDEST * look.size * (len(thing.text or "") + (MORE if thing.pieces or thing.kind is not LABEL else 0))
    room = 4.0 + max(look.width, look.outline or 0.0, look.pins or 0.0)
    room = max(room, SUPPORT if look.fixed or thing.picture is not None else 0.0)
    match own:
        case _ if thing.kind in (VECTOR, VELOCITIES, ARC) or look.arcs or (thing.kind is LABEL and thing.about):
            return math.inf
        case Annular(outer=radius) | Wedge(radius=radius):
            return room + radius
        case Beside(offset=offset) if not thing.is_body:
            return room + letters + (6.0 * look.size if offset is None else math.hypot(*offset))
        case Axes(sides=sides) | Detail(sides=sides):
            return room + sum(sides) + letters
        case Distance(offset=offset):
            return room + abs(offset) + letters
        case Round(radius):
            return room + radius
        case Composite(pieces=pieces):
            return room + max((math.hypot(*point) for outline, *_ in pieces for point in outline.polyline), default=0.0)
        case Curved(outline=outline) if outline is not None:
            return room + max(math.hypot(*point) for point in outline.polyline)
        case Toothed():
            return room + own.module * (math.pi * own.teeth + 4.0)
        case _:
            return room + (1.5 * look.size if thing.kind is GROUND else 0.0)


def _boxes(motion: PathMotion, poses: Sequence[Poses], wanted: Sequence[int]) -> dict[int, FloatArray]:
    """(F, 4) left, bottom, right, top of all that is drawn of each thing that can be; rows of NaN where it is not
    seen.
    """
    scene = motion.timeline.scene
    boxes: dict[int, FloatArray] = {}
    from movimentum.rendering.prepare import marks_of

    for thing, some in marks_of(scene, poses, motion, wanted).items():
        parts: list[FloatArray] = []
        for part in poses:
            stacked = np.stack([_bounds(mark, part) for mark in some])
            low, high = np.fmin.reduce(stacked[:, :, :2], axis=0), np.fmax.reduce(stacked[:, :, 2:], axis=0)
            shown = part.visible[thing] & part.solved & _opaque(scene.things[thing], part)
            parts.append(np.where(shown[:, None], np.concatenate([low, high], axis=1), np.nan))
        boxes[thing] = np.concatenate(parts)
    return boxes


def _bounds(item: PreparedMark, poses: Poses) -> FloatArray:
    """Its `bounds`; letters are as broad as they are drawn."""
    from movimentum.drawing.model import SymbolMark
    from movimentum.drawing.motion import symbol_bounds

    mark = item.mark
    if isinstance(mark, SymbolMark) and item.clip is None and not mark.kind.loose:
        from movimentum.rendering.layout import width_of

        return symbol_bounds(mark, poses, lambda text, size: size * width_of(text))
    return item.bounds(poses)


def _opaque(thing: Thing, poses: Poses) -> NDArray[np.bool_]:
    opacity = poses.properties.get((thing.number, "opacity"))
    return np.full(len(poses.frames), thing.look.opacity > 0.0) if opacity is None else opacity > 0.0


def _diagnostic(
    motion: PathMotion, when: dict[int, float], code: str, where: str, low: FloatArray, high: FloatArray
) -> Diagnostic:
    scene = motion.timeline.scene
    assert scene.config.size is not None
    first = min(when, key=lambda t: (when[t], t))
    others = [f"`{scene.things[t].name}` from t = {time_text(when[t])} on" for t in sorted(when) if t != first]
    width, height = scene.config.size
    left, bottom = (float(np.floor(value)) for value in low)
    right, top = (float(np.ceil(value)) for value in high)
    notes = [
        f"the drawing reaches from [{number(left, 6)}, {number(bottom, 6)}] to [{number(right, 6)}, {number(top, 6)}]"
    ]
    if others:
        notes.insert(0, f"so is {listed(others, 4)}")
    name, end = scene.things[first].name, scene.things[first].span.end - 1
    meant = insertion(f"if `{name}` is meant to leave, write `.offstage` into its definition", end, " .offstage")
    return Diagnostic(
        code=code,
        severity=Severity.NOTE,
        message=f"`{name}` is {where} ({width} x {height}) at t = {time_text(when[first])}",
        span=scene.things[first].name_span,
        notes=tuple(notes),
    ).advised(*_remedy(scene, (left, bottom), (right, top)), meant)


def _remedy(scene: Scene, low: tuple[float, float], high: tuple[float, float]) -> tuple[Fix, ...]:
    from movimentum.scene.text_edits import resized

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
