"""A spring between two anchors."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import LINED, SIZE, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class Coiled(Own):
    """``coils``: how many turns it shows."""

    coils: int = 8


SPRING = ThingKind(
    "spring",
    place=12,
    anchors=None,
    points=(2, 2),
    options=(*LINED, SIZE, OptionRule("coils", OptionForm.WHOLE, "the number of coils", lowest=1, highest=200)),
    own=Coiled,
    attached=True,
)
