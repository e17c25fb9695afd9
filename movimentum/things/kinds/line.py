"""A line through anchors of other things."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import CAP, DASH, LINED

LINE = ThingKind(
    "line", place=10, anchors=None, points=(2, None), options=(*LINED, DASH, CAP), plain=False, followed=True
)
