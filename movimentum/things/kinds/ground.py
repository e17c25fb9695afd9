"""The hatched support under a fixed pin, at an anchor of its own or of another thing."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import LINED, SIZE

GROUND = ThingKind("ground", place=9, points=(1, 1), options=(*LINED, SIZE), width=1.6, size=22.0, under=True)
