"""Diagnostics gathered while a scene is built, so that all errors of a script are reported at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from movimentum.diagnostics import MAX_MESSAGES, Diagnostic, Fix, Label, Severity
from movimentum.source import SourceText, Span
from movimentum.syntax.suggest import nearest
from movimentum.syntax.vocabulary import CLOCKS


class Findings:
    """A list of diagnostics that grows; it lives as long as one call of `movimentum.scene.build.build`."""

    def __init__(self, source: SourceText) -> None:
        self.source = source
        self.items: list[Diagnostic] = []
        self.errors = 0
        """How many errors there are so far."""
        self.broken: set[str] = set()
        """Things that there are not because their definitions have errors, which have been reported."""
        self.constants: tuple[str, ...] = ()
        """The script's constants, for "did you mean"."""
        self.things: frozenset[str] = frozenset()
        """The names of the script's things, copies and arrays, which cannot be those of constants."""

    def add(self, item: Diagnostic) -> None:
        """Add a diagnostic."""
        self.items.append(item)
        self.errors += item.severity is Severity.ERROR

    def is_lost(self, thing: str) -> bool:
        """Whether a thing is one of `broken`. Then what names it has an error too, which needs no words."""
        self.errors += thing in self.broken
        return thing in self.broken

    def nearest(self, name: str, candidates: Iterable[str]) -> str | None:
        """The candidate that ``name`` probably means. None once there are more diagnostics than are shown, because each
        one costs a comparison with all candidates.
        """
        return nearest(name, candidates) if len(self.items) < MAX_MESSAGES else None

    def error(
        self,
        code: str,
        message: str,
        span: Span | None,
        label: str = "",
        *,
        labels: Sequence[Label] = (),
        notes: Sequence[str] = (),
        helps: Sequence[str | Fix] = (),
    ) -> None:
        """Add an error."""
        found = Diagnostic(code, Severity.ERROR, message, span, label, tuple(labels), tuple(notes))
        self.add(found.advised(*helps))

    def warning(self, code: str, message: str, span: Span | None, *, helps: Sequence[str | Fix] = ()) -> None:
        """Add a warning."""
        self.add(Diagnostic(code, Severity.WARNING, message, span).advised(*helps))


_MEANT = {clock: clock for clock in CLOCKS} | {"time": "t"}


def clock_meant(name: str) -> str | None:
    """The clock or constant that a name without a dot probably means (``t``, ``Pi``, ``time``); None for any other."""
    return _MEANT.get(name) or (_MEANT.get(name.lower()) if len(name) > 1 else None)
