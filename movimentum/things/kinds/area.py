"""A filled area through anchors of other things."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.colors import PALE
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import AREA as OPTIONS
from movimentum.things.option_rules import OptionForm, OptionRule, flag


@dataclass(frozen=True, slots=True)
class Bounded(Own):
    """``smooth``: its edge is one smooth curve. ``bulge``: how high the arcs are that are its edges, in lengths of the
    edges, outwards: one for all, or one for each in turn.
    """

    smooth: bool = False
    bulge: tuple[float, ...] = ()


AREA = ThingKind(
    "area",
    place=19,
    anchors=None,
    points=(3, None),
    options=(*OPTIONS, flag("smooth"), OptionRule("bulge", OptionForm.NUMBERS, "a bulge", most=64)),
    own=Bounded,
    width=1.6,
    ink=PALE,
    surface=True,
    cuts=True,
    followed=True,
)
