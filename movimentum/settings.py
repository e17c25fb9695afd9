"""Settings with a few choices that several layers use, each with its name in options."""

from __future__ import annotations

from enum import StrEnum
from typing import Literal


class Accuracy(StrEnum):
    """How exactly equations are solved: interpolated, to a float's precision, to its last bits, to any number of
    digits.

    >>> import movimentum as mv
    >>> mv.Accuracy("high") is mv.Accuracy.HIGH
    True
    """

    DRAFT = "draft"
    STANDARD = "standard"
    HIGH = "high"
    EXACT = "exact"


AccuracyWord = Literal["draft", "standard", "high", "exact"]
"""`Accuracy` as a text."""


class FailurePolicy(StrEnum):
    """Where the scene has no solution: write nothing, hold the last good pose, or leave those frames out.

    >>> import movimentum as mv
    >>> list(map(str, mv.FailurePolicy))
    ['stop', 'hold', 'skip']
    """

    STOP = "stop"
    HOLD = "hold"
    SKIP = "skip"


FailureWord = Literal["stop", "hold", "skip"]
"""`FailurePolicy` as a text."""


class Advice(StrEnum):
    """How much work the helps of a motion's diagnostics are worth: ``PLAIN`` if nobody reads them, ``TRIED`` as usual,
    ``FULL`` with what takes long to find.
    """

    PLAIN = "plain"
    TRIED = "tried"
    FULL = "full"
