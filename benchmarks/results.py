"""What measuring solvers finds."""

from __future__ import annotations

import math
from dataclasses import dataclass

OFF = 0.05
"""Units that a point may be away from the truth before the frame counts as wrong."""


@dataclass(slots=True)
class Result:
    """Medians of one solver on one mechanism: microseconds a frame, and how right it is.

    ``frames`` were done in the budget; ``off`` of them are more than `OFF` from the truth, ``missing`` have no answer.
    ``first_ms`` is the first call for four frames, with all that is compiled on first use in a process.
    """

    solver: str
    us: float = math.nan
    setup_ms: float = math.nan
    first_ms: float = math.nan
    frames: int = 0
    residual: float = math.nan
    off: int = 0
    missing: int = 0
    note: str = ""
    error: str = ""


@dataclass(slots=True)
class Link:
    """A solver on a chain of ``k`` four-bars; ours has its stages in seconds and its memory in MB as well."""

    k: int
    result: Result
    seconds: dict[str, float] | None = None
    megabytes: float = math.nan
