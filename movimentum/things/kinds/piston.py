"""Dampers and cylinders: a barrel and a rod between two anchors."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import EDGE, FILL, LINED, SIZE

DAMPER = ThingKind("damper", place=13, anchors=None, points=(2, 2), options=(*LINED, SIZE), attached=True, of_film=True)

CYLINDER = ThingKind(
    "cylinder",
    place=14,
    anchors=None,
    points=(2, 2),
    options=(*LINED, FILL, EDGE, SIZE),
    width=1.6,
    attached=True,
    of_film=True,
)
