"""Messages about the requested accuracy."""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.records import dataclass, field
from movimentum.text import listed, number, time_text

FLOAT_DIGITS = 15
"""What `high` promises at every frame, relative to the scene's size."""


def draft_note(error: float) -> Diagnostic:
    """The error of a draft (world pixels), as measured on the path."""
    return Diagnostic(
        "solve/draft",
        Severity.NOTE,
        f"draft: frames are interpolated; the error is at most about {number(error)} pixels",
        helps=(Choose.ACCURACY.to("standard"),),
    )


def singular_warning(digits: float, asked: int, time: Fraction) -> Diagnostic:
    """A frame too nearly singular for the digits ``asked`` for: so many as are certain at ``time``."""
    return Diagnostic(
        "solve/ill-conditioned",
        Severity.WARNING,
        f"only {max(0, int(digits))} of {asked} digits are certain at t = {time_text(float(time))}, where the mechanism"
        " is singular",
        notes=("several solutions meet there, and more digits cannot distinguish them",),
    )


def inexact_note(what: Iterable[str]) -> Diagnostic:
    """Values that no equation gives, which stay those of `standard`."""
    return Diagnostic(
        "solve/rough",
        Severity.NOTE,
        f"{listed(list(what))}: integrated along the path in float64 (about 12 digits, free motions 8); what depends"
        " on it is no more exact",
    )


@dataclass(slots=True)
class AttainedAccuracy:
    """What could not be made as exact as asked: ``digits``, the fewest at any frame seen so far, at ``time``;
    ``inexact`` says what no equation gives (integrals along the path, free motions), which stay those of
    `standard`.
    """

    digits: float = math.inf
    time: Fraction | None = None
    inexact: dict[str, None] = field(default_factory=dict[str, None])

    def notes(self, shown: int | None) -> tuple[Diagnostic, ...]:
        """What that falls short of, where so many digits are ``shown`` (None: those of a float)."""
        found: list[Diagnostic] = []
        asked = FLOAT_DIGITS if shown is None else shown
        if self.time is not None and self.digits < asked:
            found.append(singular_warning(self.digits, asked, self.time))
        if self.inexact:
            found.append(inexact_note(self.inexact))
        return tuple(found)
