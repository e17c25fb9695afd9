"""A text whose baseline begins at its first anchor."""

from __future__ import annotations

from movimentum.things.kind import ThingKind
from movimentum.things.options import COLOR, HIDDEN, ITALIC, LAYER, OPACITY, SIZE, OptionForm, OptionRule

LABEL = ThingKind(
    "label",
    place=4,
    arguments=(OptionRule("text", OptionForm.TEXT),),
    options=(
        COLOR,
        LAYER,
        HIDDEN,
        OPACITY,
        SIZE,
        OptionRule("align", OptionForm.CHOICE, "the alignment", words=("left", "center", "right")),
        ITALIC,
    ),
)
