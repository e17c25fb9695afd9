"""Gears and racks: what has teeth."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.options import AREA, JOINTS, OptionForm, OptionRule, flag

MOST_TEETH = 2000
PRESSURE_ANGLE = 20.0
"""Degrees, of all teeth."""


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
    supported=True,
    filled=True,
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
)
"""From its first anchor, where a tooth is, in the direction of the second, with its teeth on the left."""
