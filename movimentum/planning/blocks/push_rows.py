"""The rows of a pushed block, besides its equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from movimentum.arrays import FloatArray
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.records import dataclass
from movimentum.scene.model import GapSide, Thing, Toward

if TYPE_CHECKING:
    from movimentum.outlines.skin import Skin


@dataclass(frozen=True, slots=True, eq=False)
class GapRow:
    """Two outlines that must not overlap: ``push`` is the place of their inequality among those of the block."""

    push: int
    first: SkinBody
    second: SkinBody


@dataclass(frozen=True, slots=True, eq=False)
class SkinBody:
    """A ``side`` of a gap with its ``skin``, in the ``frame`` of its thing (one of ``things``, by number): the numbers
    of the unknowns of its pose (x, y, cosine, sine), or the values ``still`` where it has none.
    """

    side: GapSide
    things: tuple[Thing, ...]
    frame: BodyFrame
    skin: Skin
    numbers: tuple[int | None, int | None, int | None, int | None]
    still: tuple[float, float, float, float]

    @property
    def thing(self) -> int:
        """The number of the thing."""
        return self.side.thing


@dataclass(frozen=True, slots=True, eq=False)
class PushRows:
    """The inequalities that push a block, ``count`` of them: their values ``fixed`` (K,), or, of the ``varying`` ones,
    compiled ``values``, and their derivatives ``slopes`` at ``entries`` (inequality, core unknown). ``numbers``: of
    their constraints.

    Those in ``gaps`` are about outlines: what is added to each distance. Those in ``rates`` say how fast the value must
    grow at least; ``least_rates``: compiled; that rate, 0 for others. Of the rates, ``clutches`` are always 0.
    """

    count: int
    fixed: FloatArray
    varying: tuple[int, ...]
    values: Compiled
    slopes: Compiled
    entries: tuple[tuple[int, int], ...]
    numbers: tuple[int, ...]
    gaps: tuple[GapRow, ...]
    rates: frozenset[int]
    least_rates: Compiled
    clutches: frozenset[int]


@dataclass(frozen=True, slots=True, eq=False)
class PullRows:
    """The wishes below others that draw a block, level by level: compiled ``values`` (``count`` of them), their
    derivatives ``slopes`` at ``entries`` (value, core unknown).

    ``wishes``: for each its level, its values from a first to an end (not included), where it draws, whether it is an
    angle, its speed (inf: none), and the number of its constraint.
    """

    count: int
    values: Compiled
    slopes: Compiled
    entries: tuple[tuple[int, int], ...]
    wishes: tuple[tuple[int, int, int, Toward, bool, float, int], ...]
