"""Things that fade, appear and lie on a layer together."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import LAYER, OPACITY

GROUP = ThingKind("group", 29, (LAYER, OPACITY), anchors=None, wholes=(1, 500), gathers=True)
