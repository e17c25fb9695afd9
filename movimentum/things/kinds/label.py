"""A text whose baseline begins at its first anchor, or that is placed beside an anchor of another thing."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
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
    OptionForm,
    OptionRule,
    flag,
)


@dataclass(frozen=True, slots=True)
class Beside(Own):
    """Of a label at an anchor of another thing. ``offset``: of the text from there, in world pixels (None: where it
    crosses least); ``leader``: a line leads from the anchor to it; ``align``: what of it is there (None: what is
    nearest).
    """

    offset: tuple[float, float] | None = None
    leader: bool = False
    align: str | None = None

    @property
    def of_film(self) -> bool:
        """Whether it looks for a place where it crosses nothing in the whole film."""
        return self.offset is None


LABEL = ThingKind(
    "label",
    place=4,
    points=(1, 1),
    arguments=(OptionRule("text", OptionForm.TEXT),),
    options=(
        COLOR,
        LAYER,
        HIDDEN,
        OFFSTAGE,
        OPACITY,
        SIZE,
        OptionRule("align", OptionForm.CHOICE, "the alignment", words=("left", "center", "right")),
        ITALIC,
        OptionRule("offset", OptionForm.NUMBERS, "an offset", least=2, most=2),
        flag("leader"),
        OptionRule("follows", OptionForm.THING),
        CLIP,
        STILL,
    ),
    own=Beside,
    beside=True,
)
