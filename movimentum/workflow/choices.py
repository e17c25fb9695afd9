"""The user's choices: how to solve and draw a script, what to report, and the limits."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.diagnostics import Diagnostic
from movimentum.records import dataclass
from movimentum.settings import Accuracy, FailurePolicy

if TYPE_CHECKING:
    from movimentum.expressions import Expr

# limits beyond which a script is refused; most can be raised
MAX_FRAMES = 1_000_000
MAX_PIXELS = 64_000_000
MAX_NESTING = 100
LARGEST_NESTING = 300
"""More than that, `MAX_NESTING` cannot be raised to."""
MAX_DIGITS = 1000
MAX_OPERATIONS = 20_000
MAX_SCRIPT_BYTES = 16 * 1024 * 1024

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
    ``lossy``: levels by which the colours of a GIF may be off, to make it smaller. ``text``: "outlines" or "live"
    (None: as the format has it). ``scale`` None: 1, or what the place
    asks for where the film is shown. ``canvas``: the size of the whole picture, with the film in its middle;
    ``repeats``: how often the frames are written, one time after the other.
    """

    frames: FrameChoice | None = None
    at: Fraction | None = None
    scale: float | None = None
    traces: tuple[str, ...] = ()
    show: frozenset[str] = frozenset()
    background: str | None = None
    quality: str = "standard"
    loop: int = 0
    transparent: bool = False
    lossy: int = 0
    text: str | None = None
    workers: int | None = None
    max_pixels: int = MAX_PIXELS
    canvas: tuple[int, int] | None = None
    repeats: int = 1


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome: the number of ``frames`` (or rows), the diagnostics, and the exit code (0 or 3).

    ``notes`` are always shown, although they are notes. ``size``: a picture's width and height. ``target``: the file,
    where it was chosen here.
    """

    frames: int
    exit_code: int
    diagnostics: tuple[Diagnostic, ...]
    notes: tuple[Diagnostic, ...] = ()
    size: tuple[int, int] = (0, 0)
    target: Path | None = None
