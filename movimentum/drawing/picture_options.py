"""The command line's choices about the look of a picture."""

from __future__ import annotations

import math
from enum import StrEnum
from fractions import Fraction

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import UsageError
from movimentum.records import dataclass
from movimentum.scene.model import AnchorRef, Scene
from movimentum.solver.motion import PathMotion

MAX_CANVAS_PIXELS = 64_000_000
MAX_SPRITE_PIXELS = 64_000_000
MAX_SPRITE_BYTES = 256_000_000
MAX_PREPARED_PIXELS = 128_000_000
"""Of all pictures of a scene together, each as large as it is drawn: half a gigabyte."""


class Quality(StrEnum):
    """``draft``: jagged and fast; ``standard``: anti-aliased; ``high``: drawn twice as large, then averaged."""

    DRAFT = "draft"
    STANDARD = "standard"
    HIGH = "high"


class Show(StrEnum):
    """Extras over a picture, and a grid and axes under it."""

    NAMES = "names"
    ANCHORS = "anchors"
    FREE = "free"
    GRID = "grid"
    AXES = "axes"


@dataclass(frozen=True, slots=True)
class FreeMark:
    """How the ``local`` point of thing number ``thing`` moves in free motion number ``motion``, from when to when.

    ``velocity`` in the thing's local frame; the fastest point of a motion moves by 1.
    """

    thing: int
    local: tuple[float, float]
    velocity: tuple[float, float]
    motion: int = 0
    begin: float = -math.inf
    end: float = math.inf


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """``scale``: output pixels per world pixel. ``background`` None: the script's, otherwise white.

    ``traces``: anchors whose path up to now is drawn. ``motion``: what paths follow between frames (None: straight
    lines), up to the time ``until`` where no more of it is shown. ``free`` is drawn where ``show`` has ``free``.
    ``max_pixels``: a larger canvas is refused (``limit/pixels``). ``canvas``: a smaller picture becomes so large, with
    what the script shows in its middle. ``room``: the rectangle of the world that is shown (left, bottom, right, top),
    if it is known.
    """

    quality: Quality = Quality.STANDARD
    scale: float = 1.0
    background: tuple[int, int, int] | None = None
    transparent: bool = False
    traces: tuple[AnchorRef, ...] = ()
    motion: PathMotion | None = None
    until: Fraction | None = None
    show: frozenset[Show] = frozenset()
    free: tuple[FreeMark, ...] = ()
    max_pixels: int = MAX_CANVAS_PIXELS
    canvas: tuple[int, int] | None = None
    room: tuple[float, float, float, float] | None = None


def trace_anchors(scene: Scene, names: tuple[str, ...]) -> tuple[AnchorRef, ...]:
    """The anchors that ``--trace Thing.Anchor`` names; `UsageError` for those that do not exist."""
    known = {
        f"{thing.name}.{anchor.name}": AnchorRef(thing.number, number)
        for thing in scene.things
        for number, anchor in enumerate(thing.anchors)
    }
    problems: list[Diagnostic] = []
    for name in names:
        if name not in known:
            from difflib import get_close_matches

            near = get_close_matches(name, known, 3)
            problems.append(
                Diagnostic(
                    "name/unknown-anchor",
                    Severity.ERROR,
                    f"there is no anchor `{name}` to trace",
                    helps=tuple(Choose.TRACE.to(item) for item in near or sorted(known)[:3]),
                )
            )
    if problems:
        raise UsageError(problems)
    return tuple(known[name] for name in names)
