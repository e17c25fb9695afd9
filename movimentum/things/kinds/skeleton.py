"""The kinematic diagram: lines between joints in place of bodies."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import COLOR, HIDDEN, LAYER, OPACITY, PINS, WIDTH

SKELETON = ThingKind(
    "skeleton",
    28,
    (COLOR, WIDTH, LAYER, HIDDEN, OPACITY, PINS),
    anchors=None,
    wholes=(0, 500),
    width=2.2,
)
