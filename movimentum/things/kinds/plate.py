"""A plate: everything within half its width of the convex hull of its anchors."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import AREA, JOINTS, THROUGH

PLATE = ThingKind(
    "plate",
    place=5,
    anchors=2,
    options=(*AREA, *JOINTS, THROUGH),
    width=20.0,
    inside=True,
    broad=1.7,
    link=True,
    supported=True,
    filled=True,
    cuts=True,
    followed=True,
)
