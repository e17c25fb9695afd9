"""What a page and the server say to each other: JSON objects, each with its ``kind``.

A class for each kind; `movimentum.studio.wire` reads and writes them, `movimentum.studio.schema` describes them.
Offsets in texts count characters (code points) from 0, coordinates are the world's (pixels, y up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

MAX_MESSAGE_BYTES = 4 * 2**20
"""A larger message ends the connection: a script has 2 MiB at most."""
MAX_NAME = 255
FORMATS = (".gif", ".png", ".apng", ".webp", ".mp4", ".webm", ".svg", ".html", ".jpg")
"""What a film or a still can be written as (``.mp4`` and ``.webm`` with the ``video`` extra)."""

Point2 = tuple[float, float]
"""A world point as JSON has it."""


# --- from the page --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TextTyped:
    """The script is ``text`` now, and ``time`` is looked at. ``rev`` counts the texts of a page."""

    rev: int
    text: str
    time: float


@dataclass(frozen=True, slots=True)
class WorkStopped:
    """What is being done for text ``rev`` takes too long: nobody waits for it."""

    rev: int


@dataclass(frozen=True, slots=True)
class TimeLooked:
    """``time`` is looked at, and nothing moves: what is free there?"""

    rev: int
    time: float


@dataclass(frozen=True, slots=True)
class PartGrabbed:
    """A hand takes hold of thing number ``thing`` at the world point ``at`` (on ``anchor``, if it has a name)."""

    rev: int
    grip: int
    thing: int
    anchor: str
    at: Point2
    time: float


@dataclass(frozen=True, slots=True)
class HandMoved:
    """The hand with number ``grip`` is at ``to`` now."""

    grip: int
    move: int
    to: Point2


@dataclass(frozen=True, slots=True)
class PoseLeft:
    """What was dragged is to be as the script says again."""

    rev: int


@dataclass(frozen=True, slots=True)
class ToolUsed:
    """A drawing tool was used: what it has hit, and where (see `movimentum.studio.gestures`).

    ``names`` are things or anchors (``Rod.B``), an empty one where nothing was hit; ``points`` are world points.
    """

    rev: int
    tool: str
    names: tuple[str, ...]
    points: tuple[Point2, ...]
    time: float


@dataclass(frozen=True, slots=True)
class NameAsked:
    """A question about ``name``: ``why``, ``formula`` or ``solutions`` (where the name is empty)."""

    rev: int
    question: str
    name: str
    time: float


@dataclass(frozen=True, slots=True)
class PlotAsked:
    """The values of an expression over the whole film."""

    rev: int
    expression: str


@dataclass(frozen=True, slots=True)
class SaveWanted:
    """``text`` is to be written to ``name`` (empty: the script's file). ``base`` is the version that the page knows;
    with ``force`` it does not matter whether the file is another one by now.
    """

    text: str
    name: str
    base: str
    force: bool


@dataclass(frozen=True, slots=True)
class FileOpened:
    """A script of the start page (``source`` "gallery", "recent" or "blank", with its number), or a file of the folder
    (``source`` "folder", with its name): a script, or a linkage or mechanism file that becomes one.
    """

    source: str
    number: int
    name: str


@dataclass(frozen=True, slots=True)
class LinkageWanted:
    """The scene at ``time`` is to be written to ``name`` as a linkage file."""

    text: str
    name: str
    time: float


@dataclass(frozen=True, slots=True)
class RenderWanted:
    """``text`` is to be rendered to ``name``, whose suffix is the format; ``at``: a still of that time."""

    job: int
    text: str
    name: str
    scale: float
    at: float | None


@dataclass(frozen=True, slots=True)
class RenderCancelled:
    """Rendering number ``job`` is not wanted any more."""

    job: int


INCOMING = {
    "text": TextTyped,
    "stop": WorkStopped,
    "look": TimeLooked,
    "grab": PartGrabbed,
    "move": HandMoved,
    "leave": PoseLeft,
    "tool": ToolUsed,
    "ask": NameAsked,
    "plot": PlotAsked,
    "save": SaveWanted,
    "open": FileOpened,
    "linkage": LinkageWanted,
    "render": RenderWanted,
    "cancel": RenderCancelled,
}
"""What a page may send."""


# --- to the page ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Welcome:
    """What a page begins with: the script's file as it is on the disk (``name`` empty: none yet)."""

    name: str
    text: str
    version: str
    folder: str
    gallery: tuple[str, ...]
    recent: tuple[str, ...]
    formats: tuple[str, ...] = FORMATS
    trouble: str = ""


@dataclass(frozen=True, slots=True)
class StageDone:
    """What is known about text ``rev`` after ``stage`` (see `movimentum.workflow.engine`; "advice": with fixes)."""

    rev: int
    stage: str
    diagnostics: list[dict[str, Any]]
    final: bool
    understood: bool


@dataclass(frozen=True, slots=True)
class FilmShown:
    """The picture of text ``rev``. ``glimpse``: of the time looked at alone, before the path is known."""

    rev: int
    glimpse: bool
    time: float
    scene: dict[str, Any]
    film: dict[str, Any]


@dataclass(frozen=True, slots=True)
class PictureKept:
    """The picture of text ``rev`` is that of the text before; only places in the text are others (``scene``, which
    comes a moment later than the news).
    """

    rev: int
    scene: dict[str, Any] | None


@dataclass(frozen=True, slots=True)
class MotionsFree:
    """What is free at ``time``: each motion in words, with velocities ``[thing, x, y, vx, vy]`` of anchors."""

    rev: int
    time: float
    motions: list[dict[str, Any]]
    things: list[int]


@dataclass(frozen=True, slots=True)
class Grabbed:
    """Whether what was grabbed follows: ``free``, ``fixed`` or ``late`` (the motion is not known yet); and why not."""

    grip: int
    state: str
    words: str = ""


@dataclass(frozen=True, slots=True)
class PlacesMoved:
    """Where everything is after move ``move`` of a hand: of each thing the world place of its local origin and its
    direction (cosine, sine), one after the other. ``ms``: what the server took for it. ``symbols``: a film of one frame
    with the marks that are drawn anew in every pose (springs and the like), if there are any.
    """

    grip: int
    move: int
    ms: float
    places: list[float]
    symbols: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class TextEdited:
    """What a tool makes of the text: edits of text ``rev`` (``from``, ``to``, ``text``), which are one step to undo.
    ``select``: where to look in the new text. ``words``: why there is none.
    """

    rev: int
    edits: list[dict[str, Any]]
    select: list[int]
    words: str = ""


@dataclass(frozen=True, slots=True)
class Answered:
    """The answer to a question. ``choices``: statements that it suggests, each with the frame of ``film`` that shows
    what it selects.
    """

    rev: int
    question: str
    name: str
    words: str
    choices: list[dict[str, Any]]
    film: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Plotted:
    """The values of an expression: one row of components for each frame; null where there is none."""

    rev: int
    expression: str
    rows: list[list[float | None]]
    words: str = ""


@dataclass(frozen=True, slots=True)
class DiskChanged:
    """The script's file is another one now, or cannot be read (``trouble``)."""

    text: str
    version: str
    trouble: str = ""


@dataclass(frozen=True, slots=True)
class SaveDone:
    """The script was written (``state`` "saved"), or was not ("conflict": the file has ``text`` now; "failed")."""

    state: str
    name: str
    version: str
    text: str = ""
    words: str = ""


@dataclass(frozen=True, slots=True)
class TextOpened:
    """Another script is open."""

    name: str
    text: str
    version: str
    words: str = ""


@dataclass(frozen=True, slots=True)
class RenderAdvanced:
    """How far a rendering is; ``state`` is "running", "done", "cancelled" or "failed"."""

    job: int
    state: str
    done: int
    total: int
    name: str = ""
    words: str = ""


@dataclass(frozen=True, slots=True)
class Told:
    """Words for the user."""

    words: str
    severity: str = "note"


OUTGOING = {
    "welcome": Welcome,
    "stage": StageDone,
    "film": FilmShown,
    "same": PictureKept,
    "free": MotionsFree,
    "grabbed": Grabbed,
    "moved": PlacesMoved,
    "edits": TextEdited,
    "answer": Answered,
    "plotted": Plotted,
    "disk": DiskChanged,
    "saved": SaveDone,
    "opened": TextOpened,
    "progress": RenderAdvanced,
    "told": Told,
}
"""What a page is sent."""
