"""A bar through two or more anchors: a link."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import ARCTO, AREA, CAP, JOINTS, THROUGH

BAR = ThingKind(
    "bar",
    place=1,
    anchors=2,
    options=(*AREA, CAP, *JOINTS, THROUGH, ARCTO),
    width=7.0,
    broad=1.0,
    link=True,
    supported=True,
    filled=True,
    followed=True,
)
