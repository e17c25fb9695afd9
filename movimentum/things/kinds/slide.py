"""Two guides beside the line through anchors of other things."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import LINED, SIZE

SLIDE = ThingKind(
    "slide", place=11, anchors=None, points=(2, None), options=(*LINED, SIZE), size=24.0, under=True, of_film=True
)
