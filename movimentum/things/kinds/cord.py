"""A taut cord, drawn from one place to another and about wheels."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import CAP, DASH, LINED


@dataclass(frozen=True, slots=True)
class Course(Own):
    """``radii``: of what the cord runs about at each of its points, in pixels: positive for a wheel on its right,
    negative for one on its left, 0 for a point.
    """

    radii: tuple[float, ...] = ()


CORD = ThingKind("cord", place=33, anchors=None, points=(2, None), options=(*LINED, DASH, CAP), own=Course)
