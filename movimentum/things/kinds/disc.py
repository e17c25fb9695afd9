"""A disc about its first anchor; with ``.width``, only its circle."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import AREA, JOINTS, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class Round(Own):
    """``radius``: in world pixels."""

    radius: float = 5.0


DISC = ThingKind(
    "disc",
    place=3,
    arguments=(OptionRule("radius", OptionForm.POSITIVE, "a disc's radius"),),
    options=(*AREA, *JOINTS),
    own=Round,
    filled=True,
    plain=False,
    cuts=True,
    followed=True,
)
