"""One rigid thing of several shapes, some of them cut out of the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import AREA, JOINTS

if TYPE_CHECKING:  # it needs NumPy
    from movimentum.outlines.contour import Contour


@dataclass(frozen=True, slots=True)
class Composite(Own):
    """``pieces``: of each connected piece its outline and its holes, measured from the first anchor."""

    pieces: tuple[tuple[Contour, ...], ...] = ()


BODY = ThingKind(
    "body",
    place=36,
    options=(*AREA, *JOINTS),
    own=Composite,
    width=1.6,
    inside=True,
    supported=True,
    filled=True,
    plain=False,
    cuts=True,
    followed=True,
)
