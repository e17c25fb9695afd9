"""The velocity polygon: the velocities of several points as arrows from one point."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.colors import NOTED
from movimentum.things.kind import Own, ThingKind, Valued
from movimentum.things.option_rules import (
    CLIP,
    COLOR,
    HIDDEN,
    ITALIC,
    LAYER,
    OFFSTAGE,
    OPACITY,
    SIZE,
    STILL,
    WIDTH,
    OptionForm,
    OptionRule,
)


@dataclass(frozen=True, slots=True)
class Polygon(Own):
    """``magnified``: pixels of an arrow for a pixel a time unit."""

    magnified: float = 0.2


VELOCITIES = ThingKind(
    "velocities",
    place=24,
    options=(
        *(COLOR, WIDTH, LAYER, HIDDEN, OFFSTAGE, OPACITY, SIZE, ITALIC, CLIP, STILL),
        OptionRule("scale", OptionForm.POSITIVE, "the scale of velocities", field="magnified"),
    ),
    own=Polygon,
    width=2.0,
    size=14.0,
    ink=NOTED,
    accented=True,
    valued=Valued.VELOCITIES,
    beside=True,
)
