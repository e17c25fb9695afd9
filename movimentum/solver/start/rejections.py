"""What a search turned down, and why."""

from __future__ import annotations

from movimentum.records import dataclass


@dataclass(frozen=True, slots=True)
class Rejection:
    """Why a candidate was turned down: ``selector`` (number in `System.selectors`) or ``check`` (equation number) with
    the amount by which it failed, or the block that has no real solution (at a ``pole`` what it computes is at
    infinity; ``past_end``: on an open outline it is past one of the ends).
    """

    amount: float
    selector: int | None = None
    check: int | None = None
    block: int | None = None
    pole: bool = False
    past_end: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class TurnedDown:
    """What a search had found where it turned something down: ``values`` of all unknowns (None: not found yet)."""

    rejection: Rejection
    values: tuple[float | None, ...]
