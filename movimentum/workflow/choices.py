"""The choices of a user: how to solve and draw a script, and what to report."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING

from movimentum.diagnostics import Diagnostic
from movimentum.records import dataclass
from movimentum.settings import Accuracy, FailurePolicy
from movimentum.workflow.limits import MAX_DIGITS, MAX_FRAMES, MAX_NESTING, MAX_OPERATIONS, MAX_PIXELS

if TYPE_CHECKING:
    from movimentum.expressions import Expr

FrameChoice = Callable[[int], tuple[int, int]]
"""From the number of frames to the first chosen one and the end (not included)."""


def frames_in(some: slice) -> FrameChoice:
    """The frames of a slice, counted as Python counts: half-open, either end may be left out or negative."""

    def chosen(count: int) -> tuple[int, int]:
        first, end, _ = some.indices(count)
        return first, max(first, end)

    return chosen


Progress = Callable[[int, int], None]
"""Called with (amount done, amount in all)."""


@dataclass(frozen=True, slots=True)
class Choices:
    """How to read and solve a script: the choices that all commands have in common."""

    fps: Fraction | None = None
    accuracy: Accuracy = Accuracy.STANDARD
    digits: int | None = None
    on_failure: FailurePolicy = FailurePolicy.STOP
    strict: bool = False
    max_frames: int = MAX_FRAMES
    max_nesting: int = MAX_NESTING
    max_digits: int = MAX_DIGITS
    max_operations: int = MAX_OPERATIONS
    settings: tuple[tuple[str, str | Expr], ...] = ()
    """Constants of the script that get other values: (name, constant expression, as a text or lowered)."""


@dataclass(frozen=True, slots=True)
class Picture:
    """What to draw and how: the choices of `run` beyond `Choices`.

    ``frames`` chooses frames, ``at`` one instant instead; ``traces`` are ``Thing.Anchor`` names; ``show`` is a subset
    of "names", "free", "anchors"; ``background`` as the user spelled it; ``workers`` None: chosen automatically;
    ``lossy``: levels by which the colours of a GIF may be off, to make it smaller.
    """

    frames: FrameChoice | None = None
    at: Fraction | None = None
    scale: float = 1.0
    traces: tuple[str, ...] = ()
    show: frozenset[str] = frozenset()
    background: str | None = None
    quality: str = "standard"
    loop: int = 0
    transparent: bool = False
    lossy: int = 0
    workers: int | None = None
    max_pixels: int = MAX_PIXELS


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome: the number of ``frames`` (or rows), the diagnostics, and the exit code (0 or 3).

    ``notes`` are always shown, although they are notes.
    """

    frames: int
    exit_code: int
    diagnostics: tuple[Diagnostic, ...]
    notes: tuple[Diagnostic, ...] = ()
