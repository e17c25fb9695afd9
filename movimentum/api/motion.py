"""Motions from Python: arrays by name at frames and at any times, exact velocities, pictures and tables."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from movimentum.api.names import Reading
from movimentum.api.options import Number, exact, frame_choice, one_of, words
from movimentum.diagnostics import Diagnostic
from movimentum.errors import usage_error
from movimentum.settings import Accuracy, FailurePolicy
from movimentum.text import counted, time_text
from movimentum.timeline.model import Timeline
from movimentum.workflow.choices import Choices, Picture
from movimentum.workflow.frames import PoseChunks
from movimentum.workflow.stages import Solution, afterwards

if TYPE_CHECKING:
    from movimentum.api.script import Script
    from movimentum.solver.poses import Poses

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Written:
    """What `Motion.render` or `Motion.save` wrote: the file's ``path`` (numbered pictures: with its ``%d``), how many
    ``frames`` (or rows), and what there is to say.

    >>> import movimentum as mv, tempfile, os
    >>> motion = mv.load("scripts/trammel.mov").solve()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = motion.render(os.path.join(folder, "trammel.png"), at=0.5)
    >>> written.path.name, written.frames
    ('trammel.png', 1)
    """

    path: Path
    frames: int
    diagnostics: tuple[Diagnostic, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """A solved script: F frames, each with its time, and everything that can be asked of them.

    Positions are world pixels, y up, origin at the canvas' lower-left corner; angles are degrees, counter-clockwise,
    continuous, 0 as drawn. `Script.solve` makes it; it never changes.

    >>> import movimentum as mv
    >>> motion = mv.load("scripts/slider-crank.mov").solve()
    >>> motion
    Motion(slider-crank.mov: 51 frames, 6 things, 0 to 2)
    >>> motion.times[:3].tolist(), motion.solved.all().item()
    ([0.0, 0.04, 0.08], True)
    >>> motion["Rod.B"].shape, motion["Rod.angle"].shape, motion["Rod.B.x"].shape
    ((51, 2), (51,), (51,))
    >>> motion["(Rod.B - Rod.A).l"].round(9)[:2].tolist()  # any expression of the language
    [165.0, 165.0]
    >>> motion["Rod.C"]
    Traceback (most recent call last):
        ...
    movimentum.errors.UnknownNameError: error[name/unknown]: there is no `Rod.C`
    ...
       = help: did you mean `Rod.A`?
    """

    script: Script
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

    @cached_property
    def _chunks(self) -> Iterable[Poses]:
        skip = self.choices.on_failure == FailurePolicy.SKIP
        return PoseChunks(self.solution.motion, range(self.timeline.frame_count), skip).held()

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
        """(F,) whether the scene has a solution there; where not, values are those of the last good pose."""
        return self._moments[2].copy()

    def __len__(self) -> int:
        return len(self._moments[0])

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """What there is to say: warnings and notes (with ``on_failure`` "hold" or "skip", errors), and how exact frames
        have turned out to be so far.
        """
        found, notes = afterwards(self.solution, Choices())
        return (*found, *(note for note in notes if note not in found))

    # --- values

    def __getitem__(self, name: str) -> FloatArray:
        """(F,) or, for a vector, (F, 2): an anchor ("Rod.B"), a coordinate ("Rod.B.x"), an angle ("Rod.angle"), an
        opacity or a colour ("Rod.red"), a variable ("x"), or any expression that a claim could be about ("(A.P -
        B.Q).l"; clocks count from the first step).

        nan where a variable has no value, as no statement in force mentions it. `UnknownNameError` (a KeyError) for a
        name that there is not, `ScriptError` for what is no expression.
        """
        return _values(self.script.names.reading(name), self._chunks)

    def velocity(self, name: str) -> FloatArray:
        """(F,) or (F, 2): the time derivative of what `Motion` gives for ``name``, per time unit, in the world's frame.

        Exact: from the derivatives of the equations at the solved poses, not from differences. Free motion has the
        velocity that it follows. At a step's time it is that of the step that begins, at the very end that of the one
        that ends. Where several solutions meet (a dead centre that the motion passes through) it is the limit from both
        sides; nan where there is none (a dead centre that is driven against), no solution, or no value.

        >>> import movimentum as mv
        >>> motion = mv.loads("Arm : .bar O=[0,0] P=[10,0]; @0 Arm.O=[0,0]; Arm.angle = 90*.t; @1").solve()
        >>> motion.velocity("Arm.P")[0].round(6).tolist()  # 10 pixels from the pivot, a quarter turn a time unit
        [0.0, 15.707963]
        >>> motion.velocity("Arm.angle")[0].item()
        90.0
        """
        return self._rates(name, 1)

    def acceleration(self, name: str) -> FloatArray:
        """(F,) or (F, 2): the second time derivative, as `velocity` is the first.

        Least motion of what nothing drives has one too. What a wish draws has none: `UsageError`
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
        return _rates(self, self.script.names.reading(name), order, exactly, solved)

    def at(self, time: Number | Iterable[Number]) -> Moments:
        """The motion at a time, or at several, between frames too.

        Raises `UsageError` (``usage/at``) for a time outside the animation.

        >>> import movimentum as mv
        >>> motion = mv.load("scripts/slider-crank.mov").solve()
        >>> motion.at(0.25)["Rod.B"].shape, motion.at([0, "1/3", 1])["Rod.B"].shape
        ((2,), (3, 2))
        """
        if isinstance(time, str) or not isinstance(time, Iterable):
            return Moments(self, (self._exact(time),), single=True)
        return Moments(self, tuple(self._exact(item) for item in time), single=False)

    def _exact(self, time: Number) -> Fraction:
        """A time; a float that a step's time was rounded to means the step's."""
        timeline, found = self.timeline, exact(time, "a time")
        if not timeline.start <= found <= timeline.end:
            message = (
                f"time {time_text(float(found))} is outside the animation, from {timeline.start} to {timeline.end}"
            )
            raise usage_error("usage/at", message)
        steps = (*(segment.start for segment in timeline.segments), timeline.end)
        return next((step for step in steps if float(step) == float(found)), found)

    def poses(self, first: int = 0, stop: int | None = None) -> Poses:
        """The poses of frames ``first`` … ``stop - 1``, as the stages know them (`movimentum.stages.Poses`): arrays for
        all things at once. ``stop`` None: to the end.

        >>> import movimentum as mv
        >>> mv.load("scripts/trammel.mov").solve().poses(0, 3).angle.shape  # things, frames
        (4, 3)
        """
        return self.solution.motion.poses(first, self.timeline.frame_count if stop is None else stop)

    # --- tables

    def to_dataframe(self) -> Any:
        """A pandas DataFrame: a row a frame (the index), and the columns of `movimentum solve`: ``time``,
        ``Thing.Anchor.x`` and ``.y``, ``Thing.angle``, and every variable that ever has a value (``v.x``, ``v.y``).

        nan where a variable has no value. Raises ImportError where there is no pandas.

        >>> import movimentum as mv
        >>> try:
        ...     mv.load("scripts/trammel.mov").solve().to_dataframe()["Rod.A.x"].size
        ... except ImportError:  # pandas is no dependency
        ...     51
        51
        """
        from importlib import import_module

        try:
            pandas = import_module("pandas")
        except ImportError as problem:
            raise ImportError("to_dataframe() needs pandas: pip install pandas", name="pandas") from problem
        from movimentum.analysis.diagnose.valueless import never_valued
        from movimentum.interop.tables import columns

        found = columns(self.timeline.scene, never_valued(self.solution.motion.path))
        parts = [[column.values(poses) for column in found] for poses in self._chunks]
        table = {column.name: np.concatenate([part[i] for part in parts]) for i, column in enumerate(found)}
        for name, variable in self.timeline.scene.variables.items():
            missing = np.concatenate(
                [poses.missing.get(name, np.zeros(len(poses.times), bool)) for poses in self._chunks]
            )
            for title in (f"{name}.x", f"{name}.y") if variable.is_vector else (name,):
                if title in table:
                    table[title][missing] = np.nan
        return pandas.DataFrame(table, index=pandas.Index(self.frames, name="frame"))

    def save(self, path: str | os.PathLike[str], *, frames: slice | range | int | str | None = None) -> Written:
        """Write the table of `movimentum solve` to ``path``: a ``.csv``, ``.json`` or ``.npz`` file, a row a frame.

        With ``accuracy="exact"`` numbers in CSV and JSON have all their digits. Raises `UsageError` for another kind of
        file, or one that cannot be written.

        >>> import movimentum as mv, tempfile, os
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     mv.load("scripts/trammel.mov").solve().save(os.path.join(folder, "poses.csv")).frames
        51
        """
        from movimentum.api.script import told_in
        from movimentum.interop.tables import SUFFIXES
        from movimentum.workflow.tabulate import tabulate

        target = Path(os.fspath(path))
        if target.suffix.lower() not in SUFFIXES:
            raise usage_error("usage/format", f"{target}: a table ends in one of {', '.join(SUFFIXES)}")
        source = self.script.source
        with told_in(source):
            outcome = tabulate(source, target, self.choices, frame_choice(frames), _silent, self.solution)
        return Written(target, outcome.frames, outcome.diagnostics)

    # --- pictures

    def render(
        self,
        path: str | os.PathLike[str],
        *,
        fps: Number | None = None,
        frames: slice | range | int | str | None = None,
        at: Number | None = None,
        scale: float = 1.0,
        trace: str | Iterable[str] = (),
        show: str | Iterable[str] = (),
        background: str | None = None,
        accuracy: Accuracy | str | None = None,
        quality: str = "standard",
        loop: int = 0,
        transparent: bool = False,
        strict: bool | None = None,
        on_failure: FailurePolicy | str | None = None,
        workers: int | None = None,
        open: bool = False,  # noqa: A002 - named as the option
        max_pixels: int | None = None,
    ) -> Written:
        """Draw it into the file ``path``, whose suffix names the format: an animation (``.gif``, ``.apng``, ``.webp``,
        ``.mp4``, ``.webm``), a still (``.png``, ``.jpg``), or numbered pictures (``"frames/%04d.png"``).

        The keywords are the options of `movimentum run`: ``frames`` (``slice(12, 48)``, ``"12:48"``, ``7``) or one time
        ``at``; ``trace`` ("Rod.B", or several), ``show`` ("names", "free", "anchors", or several), ``background`` (a
        colour), ``quality`` ("draft", "standard", "high"), ``loop`` (times to play, 0: for ever), ``workers``
        (processes). ``fps``, ``accuracy``, ``strict`` and ``on_failure`` are as they were solved with, unless they are
        given: then the script is solved anew for this picture.

        Raises `UsageError` for choices that do not fit and files that cannot be written.

        >>> import movimentum as mv, tempfile, os
        >>> motion = mv.load("scripts/trammel.mov").solve()
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     motion.render(os.path.join(folder, "trammel.gif"), frames="0:5", scale=0.5, workers=1).frames
        5
        """
        from movimentum.api.script import told_in
        from movimentum.rendering.options import Quality, Show
        from movimentum.workflow.animate import animate

        if at is not None and frames is not None:
            raise usage_error("usage/at", "`at` is one picture and `frames` a range of them: give one of the two")
        motion = self._solved_with(fps, accuracy, strict, on_failure)
        picture = Picture(
            frames=frame_choice(frames),
            at=None if at is None else motion._exact(at),
            scale=_positive(scale, "scale"),
            traces=words(trace),
            show=frozenset(str(one_of(Show, word, "word for `show`")) for word in words(show)),
            background=background,
            quality=str(one_of(Quality, quality, "quality")),
            loop=loop,
            transparent=transparent,
            workers=workers,
            max_pixels=self.script.limits.pixels if max_pixels is None else max_pixels,
        )
        target, source = Path(os.fspath(path)), self.script.source
        with told_in(source):
            outcome = animate(source, target, motion.choices, picture, _silent, motion.solution)
        if open:
            import click

            click.launch(str(target))
        return Written(target, outcome.frames, outcome.diagnostics)

    def _solved_with(
        self,
        fps: Number | None,
        accuracy: Accuracy | str | None,
        strict: bool | None,
        on_failure: FailurePolicy | str | None,
    ) -> Motion:
        """Itself, or with other choices."""
        if fps is None and accuracy is None and strict is None and on_failure is None:
            return self
        return self.script.solve(
            self.choices.accuracy if accuracy is None else accuracy,
            digits=self.choices.digits if accuracy is None else None,
            fps=self.choices.fps if fps is None else fps,
            strict=self.choices.strict if strict is None else strict,
            on_failure=self.choices.on_failure if on_failure is None else on_failure,
        )

    def __repr__(self) -> str:
        timeline = self.timeline
        things = counted(len(timeline.scene.things), "thing")
        times = " to ".join(time_text(float(time)) for time in (timeline.start, timeline.end))
        return f"Motion({self.script.name}: {counted(len(self), 'frame')}, {things}, {times})"


@dataclass(frozen=True, eq=False, repr=False)
class Moments:
    """A motion at one time or at T times, in the order they were asked for (`Motion.at` makes it).

    >>> import movimentum as mv
    >>> motion = mv.loads("Arm : .bar O=[0,0] P=[10,0]; @0 Arm.O=[0,0]; Arm.angle = 90*.t; @1").solve()
    >>> motion.at(1)["Arm.P"].tolist(), motion.at([1, 0])["Arm.angle"].tolist()
    ([0.0, 10.0], [90.0, 0.0])
    >>> motion.at("1/3")
    Moments(<string>: 1 time)
    """

    motion: Motion
    exact: tuple[Fraction, ...]
    single: bool

    @cached_property
    def _order(self) -> list[int]:
        return sorted(range(len(self.exact)), key=self.exact.__getitem__)

    @cached_property
    def _poses(self) -> Poses:
        return self.motion.solution.motion.poses_at([self.exact[i] for i in self._order])

    @property
    def times(self) -> FloatArray:
        """(T,) the times (a single one: ())."""
        return self._given(self._poses.times)

    @property
    def solved(self) -> BoolArray:
        """(T,) whether the scene has a solution there (a single time: ())."""
        return self._given(self._poses.solved)

    def __getitem__(self, name: str) -> FloatArray:
        """(T,) or (T, 2); without T for a single time. Otherwise as `Motion`."""
        return self._given(_values(self.motion.script.names.reading(name), (self._poses,)))

    def velocity(self, name: str) -> FloatArray:
        """As `Motion.velocity`, at these times."""
        return self._rates(name, 1)

    def acceleration(self, name: str) -> FloatArray:
        """As `Motion.acceleration`, at these times."""
        return self._rates(name, 2)

    def _rates(self, name: str, order: int) -> FloatArray:
        reading, ascending = self.motion.script.names.reading(name), [self.exact[i] for i in self._order]
        return self._given(_rates(self.motion, reading, order, ascending, self._poses.solved))

    def _given(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values in the order of the times asked for."""
        result = np.empty_like(values)
        result[self._order] = values
        return result[0] if self.single else result

    def __len__(self) -> int:
        return len(self.exact)

    def __repr__(self) -> str:
        return f"Moments({self.motion.script.name}: {counted(len(self), 'time')})"


def _values(reading: Reading, chunks: Iterable[Poses]) -> FloatArray:
    """(F,) or (F, 2)."""
    parts = [np.stack(reading.values(poses), axis=-1) for poses in chunks]
    table = np.concatenate(parts) + 0.0
    return table if reading.is_vector else table[:, 0]


def _rates(
    motion: Motion, reading: Reading, order: int, ascending: Sequence[Fraction], solved: BoolArray
) -> FloatArray:
    """(F,) or (F, 2) derivatives; nan where there is no solution."""
    from movimentum.solver.rates.rates import UndefinedRate, rates_at

    try:
        table = rates_at(motion.solution.motion.path, reading.expressions, order, ascending)
    except UndefinedRate as error:
        scene = motion.timeline.scene
        what = "it" if error.thing is None else f"`{scene.things[error.thing].name}`"
        message = f"`{reading.text}` has no acceleration: {what} follows a wish, which has a velocity and no more"
        raise usage_error("usage/no-acceleration", message, "an equation in place of the wish has one") from error
    table[:, ~solved] = np.nan
    return table.T.copy() if reading.is_vector else table[0]


def _positive(value: float, what: str) -> float:
    found = float(value)
    if not 0.0 < found < np.inf:
        raise usage_error("usage/number", f"{what} is a number greater than 0, not {value!r}")
    return found


def _silent(done: int, total: int) -> None:
    """Nobody watches."""
