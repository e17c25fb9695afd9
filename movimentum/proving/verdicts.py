"""The verdicts on claims."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from movimentum.records import dataclass, field
from movimentum.timeline.model import TimedClaim


class ProofVerdict(StrEnum):
    """The verdict on a claim."""

    PROVED = "proved"
    ON_BRANCH = "proved on this branch"
    FALSE = "false"
    IN_FILM = "true in this film"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Judgement:
    """A claim's verdict. ``conditions``: what it needs; ``counterexample``: a pose that breaks it, anchors by name."""

    timed_claim: TimedClaim
    verdict: ProofVerdict
    conditions: tuple[str, ...] = ()
    why: str = ""
    counterexample: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, "tuple[float, float]"])
