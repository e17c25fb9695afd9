"""An inset: a part of the film, magnified, beside it."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind, Valued
from movimentum.things.option_rules import COLOR, FILL, HIDDEN, LAYER, OPACITY, WIDTH, OptionForm, OptionRule, flag


@dataclass(frozen=True, slots=True)
class Detail(Own):
    """``sides``: how broad and how high the frame is, in world pixels, from the anchor, its lower-left corner.
    ``leader``: two lines lead to it from what it shows.
    """

    sides: tuple[float, float] = (120.0, 120.0)
    leader: bool = False

    @property
    def of_film(self) -> bool:
        """How near it comes in the whole film says how fine pictures are."""
        return True


INSET = ThingKind(
    "inset",
    place=29,
    options=(
        *(COLOR, WIDTH, LAYER, HIDDEN, OPACITY, FILL),
        OptionRule("size", OptionForm.SIDES, "the size of an inset", least=2, most=2, field="sides"),
        flag("leader"),
    ),
    own=Detail,
    width=1.2,
    valued=Valued.DETAIL,
    beside=True,
)
