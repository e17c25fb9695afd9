"""An arrow through two or more anchors, with its head at the last one."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import CAP, DASH, JOINTS, LINED, THROUGH

ARROW = ThingKind(
    "arrow", place=2, anchors=2, options=(*LINED, DASH, CAP, *JOINTS, THROUGH), width=3.0, plain=False, followed=True
)
