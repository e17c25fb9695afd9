"""What is asked: how a script is to be solved and drawn, and what is to be told on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from movimentum.diagnostics import Diagnostic
from movimentum.settings import Accuracy, FailurePolicy
from movimentum.workflow.limits import MAX_DIGITS, MAX_FRAMES, MAX_NESTING, MAX_OPERATIONS, MAX_PIXELS

FrameChoice = Callable[[int], tuple[int, int]]
"""From the number of frames to the first one wanted and the end (not included)."""


Progress = Callable[[int, int], None]
"""Called with how much is done, out of how much."""


@dataclass(frozen=True, slots=True)
class Choices:
    """How a script is to be understood and solved: what all commands have in common."""

    fps: Fraction | None = None
    accuracy: Accuracy = Accuracy.STANDARD
    digits: int | None = None
    on_failure: FailurePolicy = FailurePolicy.STOP
    strict: bool = False
    max_frames: int = MAX_FRAMES
    max_nesting: int = MAX_NESTING
    max_digits: int = MAX_DIGITS
    max_operations: int = MAX_OPERATIONS


@dataclass(frozen=True, slots=True)
class Picture:
    """What is drawn and how: everything that `run` asks beyond `Choices`.

    ``frames`` chooses frames, ``at`` one instant instead; ``traces`` are ``Thing.Anchor`` names; ``show`` is a subset
    of "names", "free", "anchors"; ``background`` as the user spelled it; ``workers`` None: as many as pay.
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
    workers: int | None = None
    max_pixels: int = MAX_PIXELS


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was made: how many ``frames`` (or rows), what there is to say, and the exit code (0 or 3).

    ``notes`` are to be shown although they are notes.
    """

    frames: int
    exit_code: int
    diagnostics: tuple[Diagnostic, ...]
    notes: tuple[Diagnostic, ...] = ()
