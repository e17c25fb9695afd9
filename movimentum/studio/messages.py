"""Messages between a page and the server: JSON objects, each with its ``kind``, and a class for each kind.

Messages about the script, and about files beside it, are in `movimentum.studio.script_messages`.
`movimentum.studio.protocol` reads and writes them, and describes them in ``messages.json``. Offsets in texts count
characters (code points) from 0; coordinates are the world's (pixels, y up).
"""

from __future__ import annotations

from typing import Any

from movimentum.studio.script_messages import AboutReply as AboutReply
from movimentum.studio.script_messages import AboutRequest as AboutRequest
from movimentum.studio.script_messages import FilesListed as FilesListed
from movimentum.studio.script_messages import FilesRequest as FilesRequest
from movimentum.studio.script_messages import FormatRequest as FormatRequest
from movimentum.studio.script_messages import MeaningReply as MeaningReply
from movimentum.studio.script_messages import MeaningRequest as MeaningRequest
from movimentum.studio.script_messages import NamingReply as NamingReply
from movimentum.studio.script_messages import NamingRequest as NamingRequest
from movimentum.studio.script_messages import PictureDropped as PictureDropped
from movimentum.studio.script_messages import PictureStored as PictureStored
from movimentum.studio.script_messages import ProposalsReply as ProposalsReply
from movimentum.studio.script_messages import ProposalsRequest as ProposalsRequest
from movimentum.studio.script_messages import RenameRequest as RenameRequest
from movimentum.studio.script_messages import StartRequest as StartRequest
from movimentum.studio.sides import FromPage, Point2, ToPage


class TextTyped(FromPage, kind="text"):
    """The script is ``text`` now, and the page shows ``time``. ``rev`` counts the texts of a page."""

    rev: int
    text: str
    time: float


class WorkStopped(FromPage, kind="stop"):
    """Stop the work on text ``rev``."""

    rev: int


class OverlapsRequest(FromPage, kind="overlaps"):
    """Whether the page shows what overlaps, from now on; `OverlapsFound` answers for each text."""

    wanted: bool


class TimeLooked(FromPage, kind="look"):
    """The page rests at ``time``: what is free there?"""

    rev: int
    time: float


class PartGrabbed(FromPage, kind="grab"):
    """The mouse takes hold of thing number ``thing`` at the world point ``at`` (on ``anchor``, if it has a name)."""

    rev: int
    grip: int
    thing: int
    anchor: str
    at: Point2
    time: float


class HandMoved(FromPage, kind="move"):
    """The mouse that holds ``grip`` is at ``to`` now."""

    grip: int
    move: int
    to: Point2


class PoseReset(FromPage, kind="leave"):
    """Everything goes back to where the script has it."""

    rev: int


class ToolUsed(FromPage, kind="tool"):
    """A drawing tool was used: what it has hit, and where (see `movimentum.studio.tools`).

    ``names`` are things or anchors (``Rod.B``), an empty one where nothing was hit; ``points`` are world points.
    """

    rev: int
    tool: str
    names: tuple[str, ...]
    points: tuple[Point2, ...]
    time: float


class NameRequest(FromPage, kind="ask"):
    """A question about ``name``: ``why`` or ``formula``; or ``solutions``, with an empty name."""

    rev: int
    question: str
    name: str
    time: float


class PlotRequest(FromPage, kind="plot"):
    """The values of an expression over the whole film."""

    rev: int
    expression: str


class RatesRequest(FromPage, kind="rates"):
    """The velocities of all anchors, from frame ``first`` on."""

    rev: int
    first: int


class StillRequest(FromPage, kind="still"):
    """The picture at ``time`` as an SVG, with what was dragged."""

    rev: int
    time: float


class SaveRequest(FromPage, kind="save"):
    """Write ``text`` to ``name`` (empty: the script's file). A file that is not version ``base`` is left alone unless
    ``force``.
    """

    text: str
    name: str
    base: str
    force: bool


class FileOpened(FromPage, kind="open"):
    """A script of the start page (``source`` "gallery", "recent" or "blank", with its number), or a file of the folder
    (``source`` "folder", with its name): a script, or a linkage or mechanism file that becomes one.
    """

    source: str
    number: int
    name: str


class RecordingBegun(FromPage, kind="record"):
    """Record what is shown from now on; forget what was recorded before."""

    rev: int


class ShotTaken(FromPage, kind="shot"):
    """From ``at`` milliseconds on, text ``rev`` is shown at ``time``; ``held``: with what was dragged."""

    rev: int
    at: float
    time: float
    held: bool


class RecordingRequest(FromPage, kind="recorded"):
    """Render what was recorded to ``name``, as `RenderRequest`. ``at``: milliseconds to its end."""

    job: int
    name: str
    scale: float
    at: float


class RenameFollowed(FromPage, kind="follow"):
    """The script's file is called ``name`` from now on."""

    name: str


class LinkageRequest(FromPage, kind="linkage"):
    """Write the scene at ``time`` to ``name`` as a linkage file."""

    text: str
    name: str
    time: float


class RenderRequest(FromPage, kind="render"):
    """Render ``text`` to ``name``, whose suffix is the format; ``at``: a still of that time."""

    job: int
    text: str
    name: str
    scale: float
    at: float | None


class RenderCancelled(FromPage, kind="cancel"):
    """Cancel rendering number ``job``."""

    job: int


class Welcome(ToPage, kind="welcome"):
    """The start of a page: the script's file (``name`` empty: none yet)."""

    name: str
    text: str
    version: str
    folder: str
    gallery: tuple[str, ...]
    recent: tuple[str, ...]
    formats: tuple[str, ...]
    trouble: str = ""


class StageDone(ToPage, kind="stage"):
    """The results for text ``rev`` after ``stage`` (see `movimentum.studio.worker`)."""

    rev: int
    stage: str
    diagnostics: list[dict[str, Any]]
    final: bool
    understood: bool


class FilmShown(ToPage, kind="film"):
    """The picture of text ``rev``. ``glimpse``: of the time looked at alone, before the path is known."""

    rev: int
    glimpse: bool
    time: float
    scene: dict[str, Any]
    film: dict[str, Any]


class PictureSame(ToPage, kind="same"):
    """The picture of text ``rev`` is that of the text before, but for places in the text: ``scene``, a moment later."""

    rev: int
    scene: dict[str, Any] | None


class MotionsFree(ToPage, kind="free"):
    """The free motions at ``time``: each motion in words, with velocities ``[thing, x, y, vx, vy]`` of anchors."""

    rev: int
    time: float
    motions: list[dict[str, Any]]
    things: list[int]


class Grabbed(ToPage, kind="grabbed"):
    """Whether what was grabbed follows: ``free``, ``loose`` (no statement holds it: its coordinates are edited),
    ``fixed`` or ``late`` (the motion is not known yet); and why not.
    """

    grip: int
    state: str
    words: str = ""


class PlacesMoved(ToPage, kind="moved"):
    """Where everything is after move ``move`` of a hand: of each thing the world place of its local origin and its
    direction (cosine, sine), one after the other. ``ms``: what the server took for it. ``marks``: a film of one frame
    with what is drawn anew in every pose (springs, texts with numbers), if there is any.
    """

    grip: int
    move: int
    ms: float
    places: list[float]
    marks: dict[str, Any] | None = None


class TextEdited(ToPage, kind="edits"):
    """The edits of the text by a tool, a new name or the layout: edits of text ``rev`` (``from``, ``to``, ``text``),
    which are one step to undo. ``select``: where to look in the new text. ``words``: why there is none.
    """

    rev: int
    edits: list[dict[str, Any]]
    select: list[int]
    words: str = ""


class Answered(ToPage, kind="answer"):
    """The answer. ``choices``: statements that it suggests, each with the frame of ``film`` that shows its pose."""

    rev: int
    question: str
    name: str
    words: str
    choices: list[dict[str, Any]]
    film: dict[str, Any] | None = None


class Plotted(ToPage, kind="plotted"):
    """The values of an expression, evenly over the whole film: one row of components each; null where there is none."""

    rev: int
    expression: str
    rows: list[list[float | None]]
    words: str = ""


class ThumbnailMade(ToPage, kind="thumbnail"):
    """A small film of a script of the start page (see `FileOpened`), and how many seconds it takes."""

    source: str
    number: int
    film: dict[str, Any]
    seconds: float


class ClaimsChecked(ToPage, kind="claims"):
    """Each claim of text ``rev``: ``span`` (null: in another file), ``words``, ``things`` it is about, whether it
    ``holds``, its ``proof`` (the verdict of `movimentum prove`; empty until it is known), and for one that does not
    hold ``time`` and ``frame`` from which on it fails, ``worst`` (how far it is off at most), ``at`` (the time of
    that), and ``failing`` (first and last frame of each run of frames in which it fails).
    """

    rev: int
    claims: list[dict[str, Any]]


class OverlapsFound(ToPage, kind="overlapped"):
    """The overlaps that `movimentum check --gaps` lists for text ``rev``: each with the two ``things``, ``from`` and
    ``to`` (times), ``depth`` (pixels) and the time at which they are ``deepest``, and ``words``.
    """

    rev: int
    overlaps: list[dict[str, Any]]


class RatesSent(ToPage, kind="speeds"):
    """Velocities in ``count`` frames from ``first`` on: base64 of little-endian 32-bit floats, frame after frame x and
    y (pixels per time unit, y up) of every anchor in the order of things; nan where there is none.
    """

    rev: int
    first: int
    count: int
    rates: str


class StillMade(ToPage, kind="svg"):
    """An SVG of the picture; ``words``: why there is none."""

    rev: int
    svg: str
    words: str = ""


class DiskChanged(ToPage, kind="disk"):
    """The script's file has changed or cannot be read (``trouble``). ``renamed``: its new name."""

    text: str
    version: str
    trouble: str = ""
    renamed: str = ""


class SaveDone(ToPage, kind="saved"):
    """The script was written (``state`` "saved"), or was not ("conflict": the file has ``text`` now; "failed");
    "renamed": its file has that name now, and ``text``.
    """

    state: str
    name: str
    version: str
    text: str = ""
    words: str = ""


class TextOpened(ToPage, kind="opened"):
    """Another script is open."""

    name: str
    text: str
    version: str
    words: str = ""


class RenderAdvanced(ToPage, kind="progress"):
    """How far a rendering is; ``state`` is "running", "done", "cancelled" or "failed"."""

    job: int
    state: str
    done: int
    total: int
    name: str = ""
    words: str = ""


class Notice(ToPage, kind="told"):
    """A message for the user."""

    words: str
    severity: str = "note"
