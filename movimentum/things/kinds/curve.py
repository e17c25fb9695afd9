"""A curve: polar, by coordinates, through points, or from a drawing. It is measured from its first anchor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import AREA, CAP, JOINTS, OptionForm, OptionRule, flag

if TYPE_CHECKING:  # it needs NumPy
    from movimentum.outlines.contour import Contour


@dataclass(frozen=True, slots=True)
class Curved(Own):
    """``outline``: where the curve runs, from its first anchor on, as it is drawn; None after an error."""

    outline: Contour | None = None


RANGE = OptionRule("range", OptionForm.NUMBERS, "the range of a curve's parameter", least=2, most=2)
"""The parameter of `.polar` and `.param`: from where to where."""

CURVE = ThingKind(
    "curve",
    place=25,
    options=(
        *AREA,
        CAP,
        *JOINTS,
        OptionRule("polar", OptionForm.FUNCTION, "a radius", least=2, most=2),
        OptionRule("param", OptionForm.FUNCTION, "a place", least=2, most=2),
        OptionRule("through", OptionForm.PLACES, "a point of a curve", least=2, most=100_000, field="places"),
        OptionRule("points", OptionForm.TEXT, field="table"),
        RANGE,
        flag("open"),
    ),
    own=Curved,
    width=1.6,
    inside=True,
    filled=True,
    plain=False,
    cuts=True,
    followed=True,
)

SHAPES = ("polar", "param", "through", "points")
"""The options that say how it runs: one of them."""
