"""Gears and racks."""

from __future__ import annotations

import math

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import AREA, JOINTS, OptionForm, OptionRule, flag

MOST_TEETH = 2000
PRESSURE_ANGLE = 20.0
"""Degrees, of all teeth."""
ADDENDUM, DEDENDUM = 1.0, 1.25
RIM = 2.0
"""In modules: how high a tooth is above and below the pitch circle, and what a ring or a rack has behind its teeth."""


@dataclass(frozen=True, slots=True)
class Toothed(Own):
    """``teeth``: how many; ``module``: pitch diameter per tooth, in world pixels; an ``inner`` gear is a ring."""

    teeth: int
    module: float
    inner: bool = False

    @property
    def pitch_radius(self) -> float:
        """The radius of a gear's pitch circle, in world pixels."""
        return self.module * self.teeth / 2.0


def rack_corners(teeth: int, module: float) -> list[tuple[float, float]]:
    """The corners of a rack along x whose first tooth is at the origin, counter-clockwise: its flanks are straight."""
    pitch, slope = math.pi * module, math.tan(math.radians(PRESSURE_ANGLE))
    begin, end = -pitch / 2.0, (teeth - 0.5) * pitch
    root, back = -DEDENDUM * module, -(DEDENDUM + RIM) * module
    line = [(begin, back), (end, back), (end, root)]
    for number in reversed(range(teeth)):
        middle = number * pitch
        for side, height in ((1.0, -DEDENDUM), (1.0, ADDENDUM), (-1.0, ADDENDUM), (-1.0, -DEDENDUM)):
            line.append((middle + side * (pitch / 4.0 - height * module * slope), height * module))
    return [*line, (begin, root)]


def _arguments(least: int) -> tuple[OptionRule, ...]:
    teeth = OptionRule("teeth", OptionForm.WHOLE, "the number of teeth", lowest=least, highest=MOST_TEETH)
    return teeth, OptionRule("module", OptionForm.POSITIVE, "the module")


GEAR = ThingKind(
    "gear",
    place=7,
    arguments=_arguments(3),
    options=(*AREA, *JOINTS, flag("inner")),
    own=Toothed,
    width=1.2,
    inside=True,
    link=True,
    supported=True,
    filled=True,
    followed=True,
)
"""About its first anchor, with a tooth in the direction of the second."""

RACK = ThingKind(
    "rack",
    place=8,
    anchors=2,
    arguments=_arguments(1),
    options=(*AREA, *JOINTS),
    own=Toothed,
    width=1.2,
    inside=True,
    filled=True,
    followed=True,
)
"""From its first anchor, where a tooth is, in the direction of the second, with its teeth on the left."""
