"""Pictures from Python: what `Motion.render` draws, what a notebook shows, and the living figures of `Script.live`."""

from __future__ import annotations

import os
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.api.arguments import (
    Frames,
    Limits,
    QualityWord,
    ShowWord,
    TextWord,
    called,
    frame_choice,
    in_python,
    one_of,
    positive,
    whole,
    words,
)
from movimentum.api.results import Written, no_progress
from movimentum.diagnostics import Diagnostic, Diagnostics, Severity, diagnostics_html
from movimentum.errors import MovimentumError, errors_in, usage_error
from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices, Picture
from movimentum.workflow.stages import Solution

if TYPE_CHECKING:
    from movimentum.living.page import Figure


def picture_of(
    limits: Limits,
    *,
    frames: Frames | None,
    at: Fraction | None,
    scale: float | None,
    trace: str | Iterable[str],
    show: ShowWord | str | Iterable[ShowWord],
    background: str | None,
    quality: QualityWord,
    loop: int,
    transparent: bool,
    lossy: int,
    text: TextWord | None,
    workers: int | None,
    max_pixels: int | None,
) -> Picture:
    """The keywords of `Motion.render`, checked."""
    from movimentum.drawing.picture_options import Quality, Show
    from movimentum.vector.write import TextForm

    if at is not None and frames is not None:
        raise usage_error("usage/at", "`at` is one picture and `frames` a range of them: give one of the two")
    return Picture(
        frames=frame_choice(frames),
        at=at,
        scale=None if scale is None else positive(scale, "scale"),
        traces=words(trace, "trace"),
        show=frozenset(str(one_of(Show, word, "word for `show`")) for word in words(show, "show")),
        background=background,
        quality=str(one_of(Quality, quality, "quality")),
        loop=whole(loop, "`loop`", 0, 65535),
        transparent=transparent,
        lossy=whole(lossy, "`lossy`", 0, 64),
        text=None if text is None else str(one_of(TextForm, text, "text")),
        workers=None if workers is None else whole(workers, "`workers`", 1, 256),
        max_pixels=limits.pixels if max_pixels is None else whole(max_pixels, "`max_pixels`", 1),
    )


@dataclass(frozen=True, slots=True)
class DrawingRequest:
    """A solved script that is to be drawn into a file."""

    source: SourceText
    target: Path
    choices: Choices
    picture: Picture
    solution: Solution

    def written(self, place: str | None, *, show_it: bool) -> Written:
        """See `Motion.render`."""
        from movimentum.workflow.animate import animate

        arguments = (self.source, self.target, self.choices, self.picture, no_progress, self.solution)
        with errors_in(self.source):
            if place is None:
                outcome = animate(*arguments)
            else:
                from movimentum.workflow.places import PLACES
                from movimentum.workflow.publish import publish

                if place not in PLACES:
                    known = tuple(f'for_="{word}"' for word in PLACES)
                    raise usage_error("usage/place", f"there is no place {place!r}", *known)
                outcome = publish(place, *arguments, by_place=not self.target.suffix)
        target = outcome.target or self.target
        if show_it:
            import click

            click.launch(str(target))
        return Written(target, outcome.frames, Diagnostics(in_python(outcome.diagnostics), self.source))


def shown(source: SourceText, solution: Solution, choices: Choices, said: Iterable[Diagnostic]) -> str:
    """The player, and below it what is worse than a note; only that, if it cannot be drawn."""
    from movimentum.notebook.player import player_html

    worse = tuple(item for item in said if item.severity is not Severity.NOTE)
    try:
        film = player_html(source, solution, choices)
    except MovimentumError as error:
        film, worse = "", (*worse, *in_python(error.diagnostics))
    return film + diagnostics_html(worse, source)


@dataclass(frozen=True, eq=False, repr=False)
class LivingFigure:
    """A figure whose constants are sliders and whose drive is a handle. It shows itself at the end of a cell, and then
    needs neither Python nor a network. ``diagnostics``: its warnings and notes.
    """

    name: str
    source: SourceText
    figure: Figure
    diagnostics: Diagnostics

    @property
    def constants(self) -> dict[str, tuple[float, float]]:
        """The constants that have a slider, each with the least and the most that it may be."""
        return {slider.name: (slider.least, slider.most) for slider in self.figure.sliders}

    @called
    def save(self, path: str | os.PathLike[str], /) -> Path:
        """Write one page of HTML, which needs nothing else; raises `UsageError` if it cannot be written."""
        from movimentum.workflow.living import written_page

        return written_page(self.figure, Path(path), self.source)

    def _repr_html_(self) -> str:
        from movimentum.notebook.player import figure_html

        worse = [item for item in self.diagnostics if item.severity is not Severity.NOTE]
        return figure_html(self.figure) + diagnostics_html(worse, self.source)

    def __repr__(self) -> str:
        return f"LivingFigure({self.name}: {', '.join(self.constants)})"
