"""The kinematic diagram: bodies reduced to their joints and the lines between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from movimentum.drawing.figure_outlines import FigurePart, PartForm, pin
from movimentum.drawing.figures import PIN_EDGE
from movimentum.drawing.model import FigureMark, Paint
from movimentum.geometry import hull
from movimentum.scene.model import AnchorRef, Scene, Thing
from movimentum.things.colors import INK
from movimentum.things.kind import Color
from movimentum.things.kinds.label import LABEL
from movimentum.things.kinds.sprite import SPRITE

_RADIUS = 3.6
_TINT = 0.86


def joints_of(scene: Scene, thing: Thing) -> frozenset[int]:
    """The numbers of a thing's anchors that joints use."""
    return scene.joints.get(thing.number, frozenset())


DrawnAt = Mapping[int, Sequence[Thing]]
"""The number of a thing -> the things that are drawn at anchors of it."""


def drawn_at(scene: Scene) -> DrawnAt:
    """The marks at the anchors of each thing of a scene, found in one pass over it."""
    found: dict[int, list[Thing]] = {}
    for each in scene.things:
        for number in dict.fromkeys(ref.thing for ref in each.through if isinstance(ref, AnchorRef)):
            found.setdefault(number, []).append(each)
    return found


def skeleton_of(scene: Scene, thing: Thing) -> Thing | None:
    """The skeleton that shows a thing, if one does: the first that names it, or that names none."""
    if not thing.is_body or thing.kind in (LABEL, SPRITE) or thing.kind.valued or len(thing.anchors) < 1:
        return None
    found = (each for each in map(scene.things.__getitem__, scene.skeletons) if not each.hidden)
    return next((each for each in found if thing.number in each.about or not each.about), None)


def skeleton_marks(scene: Scene, thing: Thing, skeleton: Thing, at: DrawnAt) -> Iterator[FigureMark]:
    """Lines between the joints of a body, a tinted polygon where there are more than two, and circles at them."""
    joints = joints_of(scene, thing)
    places = [anchor.local for number, anchor in enumerate(thing.anchors) if not joints or number in joints]
    shown = {ref.anchor for each in at.get(thing.number, ()) for ref in each.through
             if isinstance(ref, AnchorRef) and ref.thing == thing.number and not each.hidden}  # fmt: skip
    points = list(dict.fromkeys([*places, *(thing.anchors[number].local for number in sorted(shown))]))
    if len(points) == 1:  # a crank or a slider may have its other end free
        points = list(dict.fromkeys([*points, *(anchor.local for anchor in thing.anchors[:2])]))
    look = skeleton.look
    ink, paper = look.paint, look.pin_fill
    parts: list[FigurePart] = []
    corners = hull(points)
    if len(corners) > 2:
        parts.append(FigurePart(PartForm.FILL, tuple(corners), color=_tint(ink, paper)))
        parts.append(FigurePart(PartForm.STROKE, tuple(corners), look.width, None, True))
    elif len(corners) == 2:
        parts.append(FigurePart(PartForm.STROKE, tuple(corners), look.width))
    radius = look.pins or _RADIUS
    for place in dict.fromkeys(places):
        parts += pin(place, radius, PIN_EDGE, ink or INK, paper)
    yield FigureMark(Paint(thing.number, ink, thing.look.opacity), tuple(parts))


def _tint(ink: Color, paper: Color) -> Color:
    red, green, blue = (round(_TINT * b + (1.0 - _TINT) * a) for a, b in zip(ink, paper, strict=True))
    return red, green, blue
