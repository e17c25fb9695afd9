"""A graph beside the film: the values of an expression over the whole film, and a dot at the current value."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind, Valued
from movimentum.things.option_rules import (
    CLIP,
    COLOR,
    HIDDEN,
    LAYER,
    OFFSTAGE,
    OPACITY,
    STILL,
    WIDTH,
    OptionForm,
    OptionRule,
    flag,
)


@dataclass(frozen=True, slots=True)
class Axes(Own):
    """``sides``: how broad and how high the field of the curves is, in world pixels, from the anchor, its lower-left
    corner. ``title`` is above it, ``xlabel`` and ``ylabel`` are beside its axes. ``polar``: the first axis is an angle
    in degrees, the second the distance from the middle.
    """

    sides: tuple[float, float] = (200.0, 120.0)
    title: str = ""
    xlabel: str = ""
    ylabel: str = ""
    polar: bool = False

    @property
    def of_film(self) -> bool:
        """It shows the whole curve."""
        return True


GRAPH = ThingKind(
    "graph",
    place=23,
    options=(
        *(COLOR, WIDTH, LAYER, HIDDEN, OFFSTAGE, OPACITY, CLIP, STILL),
        OptionRule("over", OptionForm.EXPRESSIONS),
        OptionRule("size", OptionForm.SIDES, "the size of a graph", least=2, most=2, field="sides"),
        OptionRule("title", OptionForm.TEXT),
        OptionRule("xlabel", OptionForm.TEXT),
        OptionRule("ylabel", OptionForm.TEXT),
        flag("polar"),
    ),
    own=Axes,
    width=1.8,
    size=11.0,
    valued=Valued.NUMBERS,
    beside=True,
)
