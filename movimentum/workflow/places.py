"""The places where films are shown, and their limits. Each place is one record; `publish` applies it."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from movimentum.records import dataclass

LARGEST_RATE = Fraction(60)


@dataclass(frozen=True, slots=True)
class Taken:
    """A format that a place takes, and what a film in it may be.

    ``name`` is the target's, with ``{}`` for the script's name; its suffix names the format. ``why`` the place takes
    it. ``extra``: what has to be installed for it; ``clear``: whether it can be transparent.

    ``box``: the picture's sides at most; ``enlarged``: a smaller one is drawn up to so many times larger to fill it.
    ``shapes``: the picture has exactly one of these sizes, with the film in its middle. ``area``: pixels of all frames
    together; rather than make the longer side shorter than ``readable`` or the rate lower than ``smooth`` for it, the
    next format is taken. ``rate``: frames a second, ``seconds``: the length, ``frames``: their number, ``weight``:
    bytes of the file. ``typed``: a line to type where it is used.
    """

    name: str
    why: str
    box: tuple[int, int] = (1920, 1920)
    enlarged: float = 1.0
    shapes: tuple[tuple[int, int], ...] = ()
    area: int | None = None
    readable: int = 400
    smooth: Fraction = Fraction(10)
    rate: tuple[Fraction, Fraction] = (Fraction(0), LARGEST_RATE)
    seconds: tuple[Fraction, Fraction | None] = (Fraction(0), None)
    frames: int | None = None
    weight: int | None = None
    extra: str = ""
    clear: bool = True
    typed: Callable[[NumberedFrames], str] | None = None

    @property
    def suffix(self) -> str:
        """The suffix of its files."""
        return self.name[self.name.rindex(".") :] if "." in self.name else ""

    @property
    def numbered(self) -> bool:
        """Whether it is a file for each frame."""
        return "%" in self.name


@dataclass(frozen=True, slots=True)
class NumberedFrames:
    """The film to show: the files' name as it was written, the frames' first and last numbers, and the rate."""

    name: str
    first: int
    last: int
    fps: Fraction


@dataclass(frozen=True, slots=True)
class Place:
    """A place: what it ``takes``, the best first, its format of a ``still``, and what it is ``called``.

    ``refuses``: suffixes of formats that do not move there, or that it does not take, and why.
    """

    called: str
    takes: tuple[Taken, ...]
    still: Taken
    refuses: tuple[tuple[str, str], ...] = ()


def _animated(show: NumberedFrames) -> str:
    """The line of LaTeX that plays numbered pictures, or the pages of a PDF."""
    rate = f"{float(show.fps):g}"
    stem = show.name.rpartition(".")[0]
    head, percent, tail = stem.partition("%")
    if not percent:
        return f"\\animategraphics[loop,controls,width=\\linewidth]{{{rate}}}{{{stem}}}{{}}{{}}"
    first, last = (f"%{tail}" % number for number in (show.first, show.last))
    return f"\\animategraphics[loop,controls,width=\\linewidth]{{{rate}}}{{{head}}}{{{first}}}{{{last}}}"


_HD = (1920, 1080)
_VIDEO = "video"

PLACES: dict[str, Place] = {
    "wikipedia": Place(
        "Wikipedia",
        (
            Taken(
                "{}.gif",
                "a GIF moves in articles up to 100 megapixels, counted over all frames",
                box=(1280, 1280),
                area=100_000_000,
                rate=(Fraction(0), Fraction(25)),
            ),
            Taken(
                "{}.webm",
                "as a GIF it would stand still in articles: it has too many frames",
                rate=(Fraction(0), Fraction(30)),
                extra=_VIDEO,
                clear=False,
            ),
            Taken(
                "{}.gif",
                "a GIF moves in articles up to 100 megapixels, counted over all frames",
                box=(1280, 1280),
                area=100_000_000,
                readable=1,
                smooth=Fraction(1, 100),
                rate=(Fraction(0), Fraction(25)),
            ),
        ),
        Taken("{}.svg", "a still is sharp as an SVG"),
        refuses=(
            (".svg", "an SVG is a still in articles"),
            (".apng", "its thumbnails are stills"),
            (".webp", "its thumbnails are stills"),
            (".mp4", "it takes no MP4: WebM is free of patents"),
            (".html", "it takes no pages"),
            (".pdf", "it shows a PDF page by page"),
        ),
    ),
    "slides": Place(
        "slides",
        (
            Taken(
                "{}.mp4",
                "PowerPoint, Keynote, Impress and Google Slides play MP4 (H.264)",
                box=_HD,
                enlarged=4.0,
                extra=_VIDEO,
                clear=False,
            ),
            Taken("{}.gif", "they play a GIF too", box=(960, 540), enlarged=2.0, rate=(Fraction(0), Fraction(25))),
        ),
        Taken("{}.png", "a still", box=_HD, enlarged=4.0),
        refuses=(
            (".webm", "PowerPoint and Keynote do not play WebM"),
            (".webp", "it stands still there"),
            (".apng", "it stands still there"),
            (".svg", "it stands still there"),
            (".html", "they show no pages"),
            (".pdf", "it stands still there"),
        ),
    ),
    "latex": Place(
        "LaTeX",
        (
            Taken(
                "{}-frames/{}-%d.png",
                "the package `animate` plays numbered pictures",
                box=(1200, 1200),
                enlarged=3.0,
                rate=(Fraction(0), Fraction(25)),
                frames=250,
                typed=_animated,
            ),
            Taken(
                "{}.pdf",
                "the package `animate` plays the pages of a PDF",
                rate=(Fraction(0), Fraction(25)),
                frames=250,
                typed=_animated,
            ),
        ),
        Taken("{}.pdf", "a still is sharp as a PDF", clear=True),
        refuses=tuple(
            (suffix, "LaTeX cannot read it") for suffix in (".gif", ".apng", ".webp", ".svg", ".html", ".mp4", ".webm")
        ),
    ),
    "web": Place(
        "the web",
        (
            Taken("{}.svg", "an SVG moves in an <img>, is sharp, and loads fastest", weight=500_000),
            Taken(
                "{}.webp",
                "as an SVG it would be heavier than 500 kB",
                box=(800, 800),
                rate=(Fraction(0), Fraction(25)),
                weight=2_000_000,
            ),
        ),
        Taken("{}.svg", "an SVG is sharp, and loads fastest"),
        refuses=((".pdf", "a page shows no film of it"),),
    ),
    "social": Place(
        "social media",
        (
            Taken(
                "{}.mp4",
                "all of them play MP4 (H.264), square or 4:5, of 3 to 60 seconds, at 24 to 60 frames a second",
                box=(1080, 1350),
                enlarged=8.0,
                shapes=((1080, 1080), (1080, 1350)),
                rate=(Fraction(24), LARGEST_RATE),
                seconds=(Fraction(3), Fraction(60)),
                weight=30_000_000,
                extra=_VIDEO,
                clear=False,
            ),
            Taken(
                "{}.gif",
                "most of them play a GIF too",
                box=(540, 675),
                enlarged=8.0,
                shapes=((540, 540), (540, 675)),
                rate=(Fraction(0), Fraction(25)),
                seconds=(Fraction(3), Fraction(60)),
                weight=8_000_000,
                clear=False,
            ),
        ),
        Taken("{}.png", "a still", box=(1080, 1350), enlarged=8.0, shapes=((1080, 1080), (1080, 1350)), clear=False),
        refuses=tuple(
            (suffix, "they do not show it as a film") for suffix in (".svg", ".html", ".apng", ".webp", ".webm", ".pdf")
        ),
    ),
}
"""Every place, by the word of `run --for`."""
