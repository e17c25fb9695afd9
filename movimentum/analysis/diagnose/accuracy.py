"""Messages about the accuracy that a user asked for."""

from __future__ import annotations

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.solver.accuracy.refinement import RefinedMotion
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.text import listed, number, time_text

FLOAT_DIGITS = 15.0
"""What `high` promises at every frame, relative to the scene's size."""


def draft_note(error: float) -> Diagnostic:
    """The error of a draft (world pixels), as measured on the path."""
    return Diagnostic(
        "solve/draft",
        Severity.NOTE,
        f"draft: frames are interpolated; the error is at most about {number(error)} pixels",
        helps=("--accuracy standard",),
    )


def refinement_diagnostics(motion: RefinedMotion) -> tuple[tuple[Diagnostic, ...], tuple[Diagnostic, ...]]:
    """(warnings, notes): frames too nearly singular for the digits asked for, and values that no equation gives."""
    attained, arithmetic = motion.attained, motion.arithmetic
    exact = isinstance(arithmetic, DigitsArithmetic)
    asked = float(arithmetic.shown) if exact else FLOAT_DIGITS
    warnings: tuple[Diagnostic, ...] = ()
    notes: tuple[Diagnostic, ...] = ()
    if attained.time is not None and attained.digits < asked:
        warnings = (
            Diagnostic(
                "solve/ill-conditioned",
                Severity.WARNING,
                f"only {max(0, int(attained.digits))} of {int(asked)} digits are certain at"
                f" t = {time_text(float(attained.time))}, where the mechanism is singular",
                notes=("several solutions meet there, and more digits cannot distinguish them",),
            ),
        )
    if attained.rough:
        notes = (
            Diagnostic(
                "solve/rough",
                Severity.NOTE,
                f"{listed(list(attained.rough))}: integrated along the path in float64 (about 12 digits, free motions"
                " 8); what depends on it is no more exact",
            ),
        )
    return warnings, notes
