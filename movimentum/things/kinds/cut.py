"""The profile that a moving outline cuts in another thing: a curve that moves with that thing."""

from __future__ import annotations

from movimentum.records import replace
from movimentum.things.kinds.curve import CURVE
from movimentum.things.option_rules import AREA, CAP, flag

CUT = replace(
    CURVE, word="cut", place=34, options=(*AREA, CAP, flag("in"), flag("outer")), anchors=0, wholes=(2, 2)
)  # fmt: skip
"""It has one anchor, that of the thing which is cut (`scene.cutting`)."""
