"""A polygon with its anchors as corners."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import ARCTO, AREA, JOINTS, THROUGH

POLYGON = ThingKind(
    "polygon",
    place=6,
    anchors=3,
    options=(*AREA, *JOINTS, THROUGH, ARCTO),
    width=1.6,
    inside=True,
    link=True,
    supported=True,
    filled=True,
    cuts=True,
    followed=True,
)
