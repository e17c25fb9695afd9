"""Motions from Python: arrays by name at frames and at any times, exact velocities, pictures and tables."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from movimentum.api.arguments import (
    Frames,
    Number,
    PlaceWord,
    QualityWord,
    ShowWord,
    TextWord,
    called,
    frame_choice,
    frame_rate,
    in_python,
    one_of,
    several,
)
from movimentum.api.moments import Moments, instant, rates_of, values_of
from movimentum.api.understood import Names, UnderstoodScript, accepted
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.diagnostics import Diagnostic, Diagnostics
from movimentum.errors import errors_in, usage_error
from movimentum.records import dataclass, replace
from movimentum.settings import Accuracy, AccuracyWord, Advice, FailurePolicy, FailureWord
from movimentum.solver.poses import Poses
from movimentum.text import counted, time_text
from movimentum.timeline.model import Timeline
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import Solution, afterwards, arranged, examined

if TYPE_CHECKING:  # few ask for more than arrays
    from movimentum.analysis.contact_events import Contact
    from movimentum.analysis.gaps.overlaps import Overlap
    from movimentum.api.results import Written


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """A solved script: F frames with their times, positions, angles and values.

    Positions are world pixels, y up, origin at the canvas' lower-left corner; angles are degrees, counter-clockwise,
    continuous, 0 as drawn. `Script.solve` makes it; it never changes.

    >>> import movimentum as mv
    >>> motion = mv.load("scripts/slider-crank.mov").solve()
    >>> motion
    Motion(slider-crank.mov: 50 frames, 7 things, 0 to 2)
    >>> motion.times[:3].tolist(), motion.solved.all().item()
    ([0.0, 0.04, 0.08], True)
    >>> motion["Rod.B"].shape, motion["Rod.angle"].shape, motion["Rod.B.x"].shape
    ((50, 2), (50,), (50,))
    >>> motion["(Rod.B - Rod.A).l"].round(9)[:2].tolist()  # any expression of the language
    [165.0, 165.0]
    >>> motion["Rod.C"]
    Traceback (most recent call last):
        ...
    movimentum.errors.UnknownNameError: error[name/unknown]: there is no `Rod.C`
    ...
       = help: did you mean `Rod.A`?
    """

    script: UnderstoodScript
    solution: Solution
    choices: Choices

    # --- frames

    @property
    def timeline(self) -> Timeline:
        """The timeline that was solved."""
        return self.solution.motion.timeline

    @property
    def accuracy(self) -> Accuracy:
        """How exactly it was solved."""
        return Accuracy(self.choices.accuracy)

    @property
    def names(self) -> Names:
        """The names and expressions that it has values for."""
        return self.script.names

    @property
    def things(self) -> tuple[str, ...]:
        """The names of its things, in the order of definition."""
        return self.script.things

    @property
    def constants(self) -> dict[str, float | tuple[float, float]]:
        """The script's constants by name, with the values that it was solved with; a vector is a pair."""
        return self.script.constants

    def keys(self) -> list[str]:
        """The names of all anchors, angles and variables. `Motion` also has values for their parts ("Rod.B.x") and for
        expressions. A loop over a motion gives these names; ``in`` also accepts parts and expressions.

        >>> import movimentum as mv
        >>> arm = mv.loads("Arm : .bar O=[0,0] P=[9,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1").solve()
        >>> arm.keys(), "Arm.P.x" in arm, "Arm.Q" in arm
        (['Arm.O', 'Arm.P', 'Arm.angle'], True, False)
        >>> {name: arm[name].shape for name in arm}
        {'Arm.O': (26, 2), 'Arm.P': (26, 2), 'Arm.angle': (26,)}
        """
        return list(self.names.all())

    def __iter__(self) -> Iterator[str]:
        return self.names.all()

    def __contains__(self, name: object) -> bool:
        return self.names.has(name)

    @cached_property
    def _chunks(self) -> Iterable[Poses]:
        from movimentum.workflow.frames import PoseChunks

        skip = self.choices.on_failure == FailurePolicy.SKIP
        return PoseChunks(self.solution.motion, range(self.timeline.frame_count), skip).in_memory()

    @cached_property
    def _moments(self) -> tuple[IntArray, FloatArray, BoolArray]:
        parts = [(poses.frames, poses.times, poses.solved) for poses in self._chunks]
        frames, times, solved = (np.concatenate(part) for part in zip(*parts, strict=True))
        return frames, times, solved

    @property
    def frames(self) -> IntArray:
        """(F,) the frames' numbers, counted from 0; with ``on_failure="skip"`` some are left out."""
        return self._moments[0].copy()

    @property
    def times(self) -> FloatArray:
        """(F,) the frames' times, in the script's unit."""
        return self._moments[1].copy()

    @property
    def solved(self) -> BoolArray:
        """(F,) whether the scene has a solution there; if not, values are those of the last good pose."""
        return self._moments[2].copy()

    def __len__(self) -> int:
        return len(self._moments[0])

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Warnings and notes (errors too with ``on_failure`` "hold" or "skip"), and the accuracy of frames so far."""
        found, notes = afterwards(self.solution, Choices())
        return Diagnostics(in_python((*found, *(note for note in notes if note not in found))), self.script.source)

    # --- values

    @called
    def __getitem__(self, name: str) -> FloatArray:
        """(F,) or, for a vector, (F, 2): an anchor ("Rod.B"), a coordinate ("Rod.B.x"), an angle ("Rod.angle"), an
        opacity or a colour ("Rod.red"), a variable ("x"), or any expression that a claim could be about ("(A.P -
        B.Q).l"; clocks count from the first step).

        nan where a variable has no value, as no statement in force mentions it. Raises `UnknownNameError` (a KeyError)
        for an unknown name, `ScriptError` for an invalid expression.
        """
        return values_of(self.solution.motion, self.names.query(name), self._chunks)

    @called
    def velocity(self, name: str) -> FloatArray:
        """(F,) or (F, 2): the time derivative of ``motion[name]``, per time unit, in the world's frame.

        Exact: from the derivatives of the equations at the solved poses, not from differences. Free motion has the
        velocity that it follows. At a step's time it belongs to the step that begins, at the very end to the step that
        ends. Where several solutions meet (a dead centre that the motion passes through) it is the limit from both
        sides. It is nan where there is no limit (a drive runs into a dead centre), no solution, or no value.

        >>> import movimentum as mv
        >>> motion = mv.loads("Arm : .bar O=[0,0] P=[10,0]; @0 Arm.O=[0,0]; Arm.angle = 90*.t; @1").solve()
        >>> motion.velocity("Arm.P")[0].round(6).tolist()  # 10 pixels from the pivot, a quarter turn a time unit
        [0.0, 15.707963]
        >>> motion.velocity("Arm.angle")[0].item()
        90.0
        """
        return self._rates(name, 1)

    @called
    def acceleration(self, name: str) -> FloatArray:
        """(F,) or (F, 2): the second time derivative; see `velocity`.

        Free motion that no wish pulls has one too. Motion that a wish pulls has none and raises `UsageError`
        (``usage/no-acceleration``).

        >>> import movimentum as mv
        >>> motion = mv.loads("Arm : .bar O=[0,0] P=[10,0]; @0 Arm.O=[0,0]; Arm.angle = 90*.t; @1").solve()
        >>> motion.acceleration("Arm.P")[0].round(6).tolist()  # towards the pivot
        [-24.674011, 0.0]
        """
        return self._rates(name, 2)

    def _rates(self, name: str, order: int) -> FloatArray:
        frames, _, solved = self._moments
        exactly = [self.timeline.frame_time(int(frame)) for frame in frames]
        return rates_of(self.solution.motion, self.names.query(name), order, exactly, solved)

    @called
    def at(self, time: Number | Iterable[Number]) -> Moments:
        """The motion at one or several times, which may lie between frames.

        Raises `UsageError` (``usage/at``) for a time outside the film.

        >>> import movimentum as mv
        >>> motion = mv.load("scripts/slider-crank.mov").solve()
        >>> motion.at(0.25)["Rod.B"].shape, motion.at([0, "1/3", 1])["Rod.B"].shape
        ((2,), (3, 2))
        """
        if several(time):
            return Moments(self, tuple(instant(self.timeline, item) for item in time), single=False)
        return Moments(self, (instant(self.timeline, cast("Number", time)),), single=True)

    @called
    def overlaps(self, *, all_layers: bool = False) -> list[Overlap]:
        """Which things overlap, from when to when and how deep, as `movimentum check --gaps` lists them.

        >>> import movimentum as mv
        >>> two = "Arm : .bar O=[0,0] P=[9,0]; Dot : .disc(1) C=[0,9]; @0 Arm.O=[0,0]; Arm.angle=90*.t; Dot.C=[0,9]; @2"
        >>> [(each.things, round(each.begin, 6)) for each in mv.loads(two).solve().overlaps()]
        [(('Arm', 'Dot'), 0.929118)]
        """
        from movimentum.analysis.gaps.overlaps import overlaps

        return overlaps(self.solution.motion.path, all_layers=all_layers)

    @property
    def contacts(self) -> list[Contact]:
        """Contact events between things that push each other, in order of time: see `movimentum.Contact`."""
        from movimentum.analysis.contact_events import contacts

        return contacts(self.solution.motion.path)

    @called
    def poses(self, first: int = 0, stop: int | None = None) -> Poses:
        """The poses of frames ``first`` … ``stop - 1`` as `movimentum.stages.Poses`: arrays for all things at once.
        ``stop`` None: to the end. Raises `UsageError` (``usage/frames``) for frames that do not exist.

        >>> import movimentum as mv
        >>> mv.load("scripts/trammel.mov").solve().poses(0, 3).angle.shape  # things, frames
        (5, 3)
        """
        count = self.timeline.frame_count
        stop = count if stop is None else stop
        if not 0 <= first <= stop <= count:
            message = f"`poses`: there are no frames {first} to {stop}: there are {count}, and the first is frame 0"
            raise usage_error("usage/frames", message, f"motion.poses(0, {count})")
        return self.solution.motion.poses(first, stop)

    # --- tables

    def to_dataframe(self) -> Any:
        """A pandas DataFrame: one row for each frame (the index), and the columns of `movimentum solve`: ``time``,
        ``Thing.Anchor.x`` and ``.y``, ``Thing.angle``, and every variable that ever has a value (``v.x``, ``v.y``).

        nan where a variable has no value. Raises ImportError without pandas.

        >>> import movimentum as mv
        >>> try:
        ...     mv.load("scripts/trammel.mov").solve().to_dataframe()["Rod.A.x"].size
        ... except ImportError:  # pandas is no dependency
        ...     50
        50
        """
        from movimentum.api.results import data_frame

        return data_frame(self.solution.motion, self._chunks, self.frames)

    @called
    def save(self, path: str | os.PathLike[str], *, frames: Frames | None = None) -> Written:
        """Write the table of `movimentum solve` to ``path``: a ``.csv``, ``.json`` or ``.npz`` file, with one row for
        each frame.

        With ``accuracy="exact"`` numbers in CSV and JSON have all their digits. Raises `UsageError` for
        other suffixes, and if the file cannot be written.

        >>> import movimentum as mv, tempfile, os
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     mv.load("scripts/trammel.mov").solve().save(os.path.join(folder, "poses.csv")).frames
        50
        """
        from movimentum.api.results import Written, no_progress
        from movimentum.interop.tables import SUFFIXES
        from movimentum.workflow.tabulate import tabulate

        target = Path(os.fspath(path))
        if target.suffix.lower() not in SUFFIXES:
            raise usage_error("usage/format", f"{target}: a table ends in one of {', '.join(SUFFIXES)}")
        source = self.script.source
        with errors_in(source):
            outcome = tabulate(source, target, self.choices, frame_choice(frames), no_progress, self.solution)
        return Written(target, outcome.frames, in_python(outcome.diagnostics))

    # --- pictures

    @called
    def render(
        self,
        path: str | os.PathLike[str],
        *,
        fps: Number | None = None,
        frames: Frames | None = None,
        at: Number | None = None,
        for_: PlaceWord | None = None,
        scale: float | None = None,
        trace: str | Iterable[str] = (),
        show: ShowWord | str | Iterable[ShowWord] = (),
        background: str | None = None,
        accuracy: Accuracy | AccuracyWord | None = None,
        quality: QualityWord = "standard",
        loop: int = 0,
        transparent: bool = False,
        lossy: int = 0,
        text: TextWord | None = None,
        strict: bool | None = None,
        on_failure: FailurePolicy | FailureWord | None = None,
        workers: int | None = None,
        open: bool = False,  # noqa: A002 - named as the option
        max_pixels: int | None = None,
    ) -> Written:
        """Draw the motion into the file ``path``, whose suffix gives the format: a film (``.gif``, ``.apng``,
        ``.webp``, ``.svg``, ``.mp4``, ``.webm``), a page with a player (``.html``), a page for each frame (``.pdf``), a
        still (``.png``, ``.jpg``; ``.svg`` and ``.pdf`` with ``at``), or numbered pictures (``"frames/%04d.png"``).

        The keywords are the options of `movimentum run`: ``frames`` (``slice(12, 48)``, ``"12:48"``, ``7``) or one time
        ``at``; ``trace`` ("Rod.B", or several), ``show`` ("names", "free", "anchors", "grid", "axes", or several),
        ``background`` (a colour), ``quality`` ("draft", "standard", "high"), ``loop`` (times to play, 0: for ever),
        ``lossy`` (levels, of a GIF), ``text`` ("outlines", "live": of an SVG or a PDF), ``workers`` (processes).
        ``for_`` a place ("wikipedia", "slides", "latex", "web", "social") chooses the scale, the rate, and the format
        if ``path`` has no suffix. ``fps``, ``accuracy``, ``strict`` and ``on_failure`` default to those of the motion;
        if given, the motion is solved again for this picture.

        Raises `UsageError` for choices that do not fit together,
        and if the file cannot be written.

        >>> import movimentum as mv, tempfile, os
        >>> motion = mv.load("scripts/trammel.mov").solve()
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     motion.render(os.path.join(folder, "trammel.gif"), frames="0:5", scale=0.5, workers=1).frames
        5
        """
        from movimentum.api.pictures import DrawingRequest, picture_of

        motion = self._solved_with(fps, accuracy, strict, on_failure)
        picture = picture_of(
            self.script.limits, frames=frames, at=None if at is None else instant(motion.timeline, at), scale=scale,
            trace=trace, show=show, background=background, quality=quality, loop=loop, transparent=transparent,
            lossy=lossy, text=text, workers=workers, max_pixels=max_pixels,
        )  # fmt: skip
        asked = DrawingRequest(self.script.source, Path(os.fspath(path)), motion.choices, picture, motion.solution)
        return asked.written(for_, show_it=open)

    def _solved_with(
        self,
        fps: Number | None,
        accuracy: Accuracy | AccuracyWord | None,
        strict: bool | None,
        on_failure: FailurePolicy | FailureWord | None,
    ) -> Motion:
        """Itself, or a motion with other choices."""
        if fps is None and accuracy is None and strict is None and on_failure is None:
            return self
        choices = self.choices if strict is None else replace(self.choices, strict=strict)
        if fps is not None:
            choices = replace(choices, fps=frame_rate(fps))
        if accuracy is not None:
            choices = replace(choices, accuracy=one_of(Accuracy, accuracy, "accuracy"), digits=None)
        if on_failure is not None:
            choices = replace(choices, on_failure=one_of(FailurePolicy, on_failure, "failure policy"))
        return Motion(self.script, accepted(self.script, choices), choices)

    def __reduce__(self) -> tuple[object, ...]:
        return _again, (self.script, self.choices, self.solution.diagnostics)

    def _repr_html_(self) -> str:
        from movimentum.api.pictures import shown

        return shown(self.script.source, self.solution, self.choices, self.diagnostics)

    def __repr__(self) -> str:
        timeline = self.timeline
        things = counted(len(timeline.scene.things), "thing")
        times = " to ".join(time_text(float(time)) for time in (timeline.start, timeline.end))
        return f"Motion({self.script.name}: {counted(len(self), 'frame')}, {things}, {times})"


def _again(script: UnderstoodScript, choices: Choices, diagnostics: tuple[Diagnostic, ...]) -> Motion:
    """A motion in another process: solved again, to the same bits, as compiled code cannot be pickled."""
    solution = examined(arranged(script.scene, choices), choices, advice=Advice.PLAIN)
    return Motion(script, replace(solution, diagnostics=diagnostics), choices)
