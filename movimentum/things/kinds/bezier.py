"""A curve with control points, which are its own anchors or anchors of other things."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import CAP, DASH, LINED

BEZIER = ThingKind(
    "bezier", place=32, anchors=3, points=(3, None), options=(*LINED, DASH, CAP), plain=False, followed=True
)
