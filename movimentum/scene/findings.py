"""Diagnostics gathered while a scene is built, so that a script's faults are told all at once."""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.source import Span


class Findings:
    """A list of diagnostics that grows; it lives as long as one call of `movimentum.scene.build.build`."""

    def __init__(self) -> None:
        self.items: list[Diagnostic] = []
        self.errors = 0
        """How many errors there are so far."""

    def add(self, item: Diagnostic) -> None:
        """Add a diagnostic."""
        self.items.append(item)
        self.errors += item.severity is Severity.ERROR

    def error(
        self,
        code: str,
        message: str,
        span: Span | None,
        label: str = "",
        *,
        labels: Sequence[Label] = (),
        notes: Sequence[str] = (),
        helps: Sequence[str] = (),
    ) -> None:
        """Add an error."""
        self.add(Diagnostic(code, Severity.ERROR, message, span, label, tuple(labels), tuple(notes), tuple(helps)))

    def warning(self, code: str, message: str, span: Span | None, *, helps: Sequence[str] = ()) -> None:
        """Add a warning."""
        self.add(Diagnostic(code, Severity.WARNING, message, span, helps=tuple(helps)))
