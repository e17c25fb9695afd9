"""What we tell a user: diagnostics as data, rendered elsewhere in this module as text or JSON."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from movimentum.source import Span


class Severity(StrEnum):
    """How bad it is: an error stops the work, a warning may (``--strict``), a note never does."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Label:
    """A second place that belongs to the story, with what to say about it."""

    span: Span
    message: str = ""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One message: a stable ``code`` (``"constraint/conflict"``), a headline that stands alone,
    the narrowest span (``None`` where the whole script is meant) with an optional ``label``,
    further ``labels``, ``notes`` (numbers in script units) and ``helps`` that can be typed.
    """

    code: str
    severity: Severity
    message: str
    span: Span | None = None
    label: str = ""
    labels: tuple[Label, ...] = ()
    notes: tuple[str, ...] = ()
    helps: tuple[str, ...] = ()
