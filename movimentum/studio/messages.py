"""What a page says to the server: JSON objects, each with its ``kind``; `movimentum.studio.answers` has the others.

A class for each kind; `movimentum.studio.wire` reads and writes them, `movimentum.studio.schema` describes them.
Offsets in texts count characters (code points) from 0, coordinates are the world's (pixels, y up).
"""

from __future__ import annotations

from movimentum.records import dataclass

MAX_MESSAGE_BYTES = 4 * 2**20
"""A larger message ends the connection: a script has 2 MiB at most."""
MAX_NAME = 255

Point2 = tuple[float, float]
"""A world point as JSON has it."""


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
class RatesAsked:
    """The velocities of all anchors, from frame ``first`` on."""

    rev: int
    first: int


@dataclass(frozen=True, slots=True)
class StillAsked:
    """The picture on show at ``time`` as an SVG, parts that a hand has moved included."""

    rev: int
    time: float


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
class FilesAsked:
    """Which files of the folder can be opened?"""


@dataclass(frozen=True, slots=True)
class RecordingBegun:
    """What is shown from now on is recorded; what was recorded before is forgotten."""

    rev: int


@dataclass(frozen=True, slots=True)
class ShotTaken:
    """From ``at`` milliseconds after the beginning on, text ``rev`` is shown at ``time``; if it is ``held``, with what
    a hand has moved.
    """

    rev: int
    at: float
    time: float
    held: bool


@dataclass(frozen=True, slots=True)
class RecordingWanted:
    """What was recorded is to be rendered to ``name``, as `RenderWanted`. ``at``: milliseconds to its end."""

    job: int
    name: str
    scale: float
    at: float


@dataclass(frozen=True, slots=True)
class RenameFollowed:
    """The script's file is the one called ``name`` from now on."""

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
    "rates": RatesAsked,
    "still": StillAsked,
    "save": SaveWanted,
    "open": FileOpened,
    "files": FilesAsked,
    "follow": RenameFollowed,
    "record": RecordingBegun,
    "shot": ShotTaken,
    "recorded": RecordingWanted,
    "linkage": LinkageWanted,
    "render": RenderWanted,
    "cancel": RenderCancelled,
}
"""What a page may send."""
