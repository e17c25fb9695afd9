"""What the server says to a page; see `movimentum.studio.messages`."""

from __future__ import annotations

from typing import Any

from movimentum.records import dataclass

FORMATS = (".gif", ".png", ".apng", ".webp", ".mp4", ".webm", ".svg", ".html", ".jpg")
"""What a film or a still can be written as (``.mp4`` and ``.webm`` with the ``video`` extra)."""


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
    direction (cosine, sine), one after the other. ``ms``: what the server took for it. ``marks``: a film of one frame
    with what is drawn anew in every pose (springs, texts with numbers), if there is any.
    """

    grip: int
    move: int
    ms: float
    places: list[float]
    marks: dict[str, Any] | None = None


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
    """The values of an expression, evenly over the whole film: one row of components each; null where there is none."""

    rev: int
    expression: str
    rows: list[list[float | None]]
    words: str = ""


@dataclass(frozen=True, slots=True)
class ThumbnailMade:
    """A small film of a script of the start page (``source`` and ``number`` as in `FileOpened`), and the seconds that
    it takes.
    """

    source: str
    number: int
    film: dict[str, Any]
    seconds: float


@dataclass(frozen=True, slots=True)
class FilesListed:
    """The files of the script's folder that can be opened."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ClaimsJudged:
    """Each claim of text ``rev``: ``span`` (null: in another file), ``words``, ``things`` it is about, whether it
    ``holds``, and for one that does not ``time`` and ``frame`` from which on it fails, ``worst`` (how far it is off at
    most), ``at`` (the time of that), and ``failing`` (first and last frame of each run of frames in which it fails).
    """

    rev: int
    claims: list[dict[str, Any]]


@dataclass(frozen=True, slots=True)
class RatesTold:
    """Velocities in ``count`` frames from ``first`` on: base64 of little-endian 32-bit floats, frame after frame x and
    y (pixels per time unit, y up) of every anchor in the order of things; nan where there is none.
    """

    rev: int
    first: int
    count: int
    rates: str


@dataclass(frozen=True, slots=True)
class StillMade:
    """An SVG of the picture; ``words``: why there is none."""

    rev: int
    svg: str
    words: str = ""


@dataclass(frozen=True, slots=True)
class DiskChanged:
    """The script's file is another one now, or cannot be read (``trouble``). ``renamed``: what it is called now."""

    text: str
    version: str
    trouble: str = ""
    renamed: str = ""


@dataclass(frozen=True, slots=True)
class SaveDone:
    """The script was written (``state`` "saved"), or was not ("conflict": the file has ``text`` now; "failed");
    "renamed": its file has that name now, and ``text``.
    """

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
    "thumbnail": ThumbnailMade,
    "listed": FilesListed,
    "claims": ClaimsJudged,
    "speeds": RatesTold,
    "svg": StillMade,
    "disk": DiskChanged,
    "saved": SaveDone,
    "opened": TextOpened,
    "progress": RenderAdvanced,
    "told": Told,
}
"""What a page is sent."""
