"""`run --for PLACE`: a film drawn within a place's limits, and what was chosen and why."""

from __future__ import annotations

import math
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.output.files import unwritable
from movimentum.records import dataclass, replace
from movimentum.solver.solver_cache import SolverCache
from movimentum.source import SourceText
from movimentum.terminal import typed
from movimentum.workflow.animate import TooHeavy, animate, natural_size
from movimentum.workflow.choices import Choices, FrameChoice, Outcome, Picture, Progress
from movimentum.workflow.fitted_film import FilmFit, FilmShape, fitted, summary
from movimentum.workflow.frames import chosen_frames
from movimentum.workflow.places import PLACES, NumberedFrames, Place, Taken
from movimentum.workflow.stages import Solution, arranged, judged, solved, understand

if TYPE_CHECKING:
    from movimentum.encoding.runs import Elsewhere

CHOSEN, LIMIT, FORMAT = "place/chosen", "place/limit", "place/format"
_MODULES = {"video": "av"}
"""The module that each extra installs."""
_LIGHTER, _TRIES = 0.9, 5
_ANYTHING = Taken("{}", "", box=(sys.maxsize, sys.maxsize))


def publish(
    word: str,
    source: SourceText,
    target: Path,
    choices: Choices,
    picture: Picture,
    progress: Progress,
    solution: Solution | None = None,
    known: SolverCache | None = None,
    elsewhere: Elsewhere | None = None,
    *,
    by_place: bool = False,
) -> Outcome:
    """Draw the script for the place ``word`` into ``target``; ``by_place``: that has no suffix yet, and gets the one of
    the format that the place takes best. What ``picture`` and ``choices`` ask for is done, and told where the place
    does not take it.
    """
    known = known or SolverCache()
    if solution is None:
        # what is too large as it is may be small enough for the place
        timeline = arranged(understand(source, choices, sys.maxsize), replace(choices, fps=None))
        solution = solved(timeline, choices, known)
    work = _Publishing(PLACES[word], source, target, by_place, choices, picture, progress, solution, known, elsewhere)
    return work.outcome()


@dataclass(frozen=True, slots=True)
class _Publishing:
    """A film on its way to a place; ``solution`` is that of the script's own rate, or of the user's."""

    place: Place
    source: SourceText
    target: Path
    by_place: bool
    choices: Choices
    picture: Picture
    progress: Progress
    solution: Solution
    known: SolverCache
    elsewhere: Elsewhere | None

    def outcome(self) -> Outcome:
        shape, said, passed = self._shape(), list[Diagnostic](), list[str]()
        some = self._candidates(shape, said)
        for number, taken in enumerate(some):
            last = number == len(some) - 1
            if taken.extra and self.by_place and find_spec(_MODULES[taken.extra]) is None:
                said.append(self._missing(taken))
                continue
            made = fitted(taken, shape)
            if made.refused and not last:
                passed.append(f"as {_format(taken)} {made.refused}")
                continue
            written = self._light_enough(taken, shape, made, [*said, *self._broken(made)], last=last)
            if written is not None:
                return self._report(taken, shape, *written, said, passed)
            passed.append(f"as {_format(taken)} it would have more than {(taken.weight or 0) / 1e6:g} MB")
        raise AssertionError("the last format is accepted in any case")

    def _shape(self) -> FilmShape:
        timeline, picture = self.solution.motion.timeline, self.picture
        start, stop = chosen_frames(timeline, picture.frames)
        width, height = natural_size(self.solution, picture)
        one = (
            not self.by_place
            and self.target.suffix.lower() in (".png", ".jpg", ".jpeg")
            and "%" not in self.target.name
        )
        return FilmShape(
            width=width,
            height=height,
            start=start,
            stop=stop,
            count=timeline.frame_count,
            own_fps=timeline.fps,
            scale=picture.scale,
            fps=self.choices.fps,
            chosen=picture.frames is not None,
            still=picture.at is not None or one,
        )

    def _candidates(self, shape: FilmShape, said: list[Diagnostic]) -> list[Taken]:
        """The formats that may be written, the best first; one that the place does not take is reported."""
        place, suffix = self.place, self.target.suffix.lower()
        every = (place.still,) if shape.still else place.takes
        if self.by_place:
            some = [taken for taken in every if taken.clear or not self.picture.transparent] or list(every)
            if some[0] is not every[0]:
                message = f"{_format(every[0])} cannot be transparent: {place.called} gets {_format(some[0])}"
                said.append(Diagnostic(FORMAT, Severity.NOTE, message))
            return some
        own = [each for each in every if each.suffix == suffix and each.numbered == ("%" in self.target.name)]
        reason = dict(place.refuses).get(suffix)
        if not own and reason is not None and not shape.still:
            message = f"`{self.target.name}` is not for {place.called}: {reason}"
            better = self.target.with_suffix(every[0].suffix) if not every[0].numbered else self.target.with_suffix("")
            said.append(Diagnostic(FORMAT, Severity.WARNING, message, helps=(Choose.OUTPUT.to(typed(better)),)))
        return own or [_ANYTHING]

    def _missing(self, taken: Taken) -> Diagnostic:
        message = f"{_format(taken)} is what {self.place.called} would get, but it needs what is not installed"
        notes = (taken.why,)
        return Diagnostic(
            FORMAT, Severity.WARNING, message, notes=notes, helps=(f"pip install 'movimentum[{taken.extra}]'",)
        )

    def _broken(self, made: FilmFit) -> list[Diagnostic]:
        return [
            Diagnostic(LIMIT, Severity.WARNING, f"{self.place.called}: {message}", helps=(advice,))
            for message, advice in made.broken
        ]

    def _light_enough(
        self, taken: Taken, shape: FilmShape, made: FilmFit, before: list[Diagnostic], *, last: bool
    ) -> tuple[FilmFit, Outcome] | None:
        """The written film, drawn smaller if it is too large; None if another format should be tried."""
        judged_now, warned = judged(before, self.choices)
        if warned:
            raise ScriptError(judged_now)
        smaller, fixed = 1.0, shape.scale is not None or taken.numbered
        for number in range(_TRIES):
            most = None if taken.numbered or (last and (fixed or number == _TRIES - 1)) else taken.weight
            try:
                return made, self._written(taken, shape, made, most)
            except TooHeavy as heavy:
                if not last and (fixed or taken.suffix == ".svg"):  # it weighs the same at every size
                    return None
                smaller *= _LIGHTER * math.sqrt((taken.weight or heavy.size) / heavy.size)
                made = fitted(taken, shape, smaller)
                made.reasons.append(f"smaller, for at most {(taken.weight or 0) / 1e6:g} MB")
        return None

    def _written(self, taken: Taken, shape: FilmShape, made: FilmFit, most: int | None) -> Outcome:
        own = self.solution.motion.timeline
        solution, choices = self.solution, self.choices
        if made.fps != own.fps and not shape.still:
            choices = replace(choices, fps=made.fps)
            solution = solved(arranged(own.scene, choices), choices, self.known)
        frames = None if shape.still and self.picture.at is not None else _frames(shape, made)
        picture = replace(self.picture, scale=made.scale, canvas=made.canvas, repeats=made.repeats, frames=frames)
        target = self._file(taken)
        with _folder(target.parent if taken.numbered and self.by_place else None):
            done = animate(
                self.source, target, choices, picture, self.progress, solution, self.known, self.elsewhere, most
            )
        return replace(done, target=target)

    def _file(self, taken: Taken) -> Path:
        if not self.by_place:
            return self.target
        stem = self.target.name.replace("%", "_") if taken.numbered else self.target.name
        return self.target.parent / taken.name.replace("{}", stem)

    def _report(
        self, taken: Taken, shape: FilmShape, made: FilmFit, done: Outcome, said: list[Diagnostic], passed: list[str]
    ) -> Outcome:
        assert done.target is not None
        helps = (taken.typed(self._show(done.target, shape, made, done)),) if taken.typed and not shape.still else ()
        what = summary(shape, made, done.size, done.frames)
        note = Diagnostic(
            CHOSEN,
            Severity.NOTE,
            f"for {self.place.called}: {_format(taken, done.target)}, {what}",
            notes=(*([taken.why] if taken.why else []), *passed, *made.reasons),
            helps=helps,
        )
        more = [*said, *self._broken(made)]
        if taken.weight is not None and done.target.is_file() and (size := done.target.stat().st_size) > taken.weight:
            message = f"{self.place.called}: the file has {size / 1e6:.1f} MB, and the limit is {taken.weight / 1e6:g}"
            more.append(Diagnostic(LIMIT, Severity.WARNING, message, helps=(Choose.FRAMES.to("0:50"),)))
        own = ("render/gif-area", "render/weight")  # the place has said what it takes
        rest = tuple(item for item in done.diagnostics if item.code not in own)
        notes = tuple(item for item in done.notes if item.code not in own)
        noted = [item for item in more if item.severity is Severity.NOTE]
        return replace(done, diagnostics=(*rest, *more, note), notes=(*notes, *noted, note))

    def _show(self, target: Path, shape: FilmShape, made: FilmFit, done: Outcome) -> NumberedFrames:
        first, _ = _frames(shape, made)(sys.maxsize)
        return NumberedFrames(target.as_posix(), first, first + done.frames - 1, made.fps)


def _frames(shape: FilmShape, made: FilmFit) -> FrameChoice:
    """The frames asked for, at another rate."""
    ratio = made.fps / shape.own_fps
    first = math.ceil(shape.start * ratio)

    def chosen(count: int) -> tuple[int, int]:
        end = count if shape.stop == shape.count else min(count, math.ceil(shape.stop * ratio))
        begin = min(first, max(0, count - 1))
        if made.seconds < shape.seconds:
            end = min(end, begin + int(made.seconds * made.fps))
        return begin, max(end, begin + 1)

    return chosen


def _format(taken: Taken, target: Path | None = None) -> str:
    """``a GIF``, ``numbered PNGs``."""
    from movimentum.encoding.write import FORMATS

    suffix = taken.suffix if target is None else target.suffix.lower()
    found = FORMATS.get(suffix)
    name = suffix[1:].upper() if found is None else found.name
    if taken.numbered:
        return f"numbered {name}s"
    return f"{'an' if name[0] in 'AFHLMNRSX' and name != 'WebM' else 'a'} {name}"


@contextmanager
def _folder(wanted: Path | None) -> Generator[None]:
    """A folder that is there; one that was made is taken away if nothing was written into it."""
    made = False
    if wanted is not None and not wanted.is_dir():
        try:
            wanted.mkdir()
        except OSError as problem:
            raise unwritable(wanted, (problem.strerror or str(problem)).lower()) from problem
        made = True
    try:
        yield
    except BaseException:
        if made and wanted is not None:
            with suppress(OSError):
                wanted.rmdir()
        raise
