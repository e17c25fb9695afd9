"""Scripts from Python: read, check and solve them."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING

from movimentum.api.arguments import (
    Limits,
    Measured,
    Number,
    called,
    cluster_client,
    frame_rate,
    in_python,
    one_of,
    several,
    whole,
)
from movimentum.api.motion import Motion
from movimentum.api.understood import UnderstoodScript, accepted, choices_of, solution_of
from movimentum.diagnostics import Diagnostic, Diagnostics, diagnostics_html, limited
from movimentum.errors import MovimentumError, errors_in, usage_error
from movimentum.records import dataclass, replace
from movimentum.settings import Accuracy, AccuracyWord, FailurePolicy, FailureWord
from movimentum.source import SourceText
from movimentum.syntax.printer import float_text
from movimentum.text import counted
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import ScriptFiles, read
from movimentum.workflow.stages import understand

if TYPE_CHECKING:
    from movimentum.api.pictures import LivingFigure
    from movimentum.api.results import Fit, Sweep
    from movimentum.expressions import Expr
    from movimentum.scene.expansion.product import NamedConstant
    from movimentum.studio.widget import StudioWidget


@called
def load(path: str | os.PathLike[str], limits: Limits | None = None, /, **constants: object) -> Script:
    """The script in the file ``path`` (``"-"`` is standard input); its pictures are found from its folder.

    Keywords only set the script's constants, so a constant may even be called ``fps``: all other choices are arguments
    of `Script.solve` and `Motion.render`. A value is a
    number, a pair of numbers for a vector, or a text with a constant expression.

    Raises `UsageError` if the file cannot be read or a constant does not exist (``usage/constant``), and `ScriptError`
    with all errors in the script; printed, it looks as in a terminal.

    >>> import movimentum as mv
    >>> mv.load("scripts/four-bar.mov")
    Script(four-bar.mov: 5 things, 2 steps)
    """
    return _script(read(os.fspath(path)), limits, constants)


@called
def loads(text: str, limits: Limits | None = None, /, name: str = "<string>", **constants: object) -> Script:
    """The script ``text``; otherwise like `load`.

    Messages show ``name``; if it is a path, pictures are found from its folder.

    >>> import movimentum as mv
    >>> mv.loads("Crank : .bar O = [0,0] P = [50,0]; @0 Crank.O = [90,90]; Crank.angle = 90*.t; @4")
    Script(<string>: 1 thing, 2 steps)
    >>> mv.loads("Crank : .disc(9) O = [0,0]; @0 Crnk.O = [90,90];")
    Traceback (most recent call last):
        ...
    movimentum.errors.ScriptError: error[name/unknown-thing]: there is no thing called `Crnk`
      --> <string>:1:32
       |
     1 | Crank : .disc(9) O = [0,0]; @0 Crnk.O = [90,90];
       |                                ^^^^
       = help: did you mean `Crank.O`?
    """
    return _script(SourceText(name, text), limits, constants)


def _script(source: SourceText, limits: Limits | None, constants: Mapping[str, object]) -> Script:
    limits = limits or Limits()
    settings = tuple((name, _constant(name, value)) for name, value in constants.items())
    with errors_in(source):
        return _understood(source, settings, limits, ScriptFiles())


def _understood(
    source: SourceText, settings: tuple[tuple[str, str | Expr], ...], limits: Limits, files: ScriptFiles
) -> Script:
    return Script(source, understand(source, choices_of(limits, settings), limits.pixels, files), limits, files)


def _constant(name: str, value: object) -> str:
    """The value of a keyword as a constant expression: a number, a pair of numbers, or such an expression already."""
    if isinstance(value, str):
        return value
    given: list[object] = list(value) if several(value) else [value]  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
    texts = [_number(part) for part in given]
    good = [text for text in texts if text is not None]
    if not good or len(good) < len(texts) or len(texts) > 2:
        message = f"`{name}` is a constant: give it a number, or [x, y] for a vector"
        raise usage_error("usage/constant", message, f"{name}=60")
    return good[0] if len(good) == 1 else f"[{', '.join(good)}]"


def _number(value: object) -> str | None:
    if isinstance(value, int | Fraction):
        return f"({value.numerator}/{value.denominator})" if value.denominator != 1 else str(value.numerator)
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return None
    return float_text(number) if math.isfinite(number) else None


@dataclass(frozen=True, eq=False, repr=False)
class Script(UnderstoodScript):
    """A script that has been read and checked. `load` and `loads` make it; it never changes.

    >>> import movimentum as mv
    >>> script = mv.load("scripts/slider-crank.mov")
    >>> script.path.name, script.text[:2]
    ('slider-crank.mov', '//')
    >>> [thing.name for thing in script.scene.things][:2]
    ['Frame', 'Piston']
    >>> script.timeline.frame_count
    50
    """

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Everything that `movimentum check` reports: errors, warnings and notes, with places, notes and helps.

        Solves the script (once). Raises nothing: errors are in the list.

        >>> import movimentum as mv
        >>> script = mv.loads("Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A = [9,9]; @1")
        >>> [(item.code, str(item.severity)) for item in script.diagnostics]
        [('constraint/free-motion', 'warning')]
        """
        try:
            found = solution_of(self, choices_of(self.limits)).diagnostics
        except MovimentumError as error:
            found = error.diagnostics
        return Diagnostics(in_python(limited(found)), self.source)

    @called
    def solve(
        self,
        accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
        *,
        digits: int | None = None,
        fps: Number | None = None,
        on_failure: FailurePolicy | FailureWord = FailurePolicy.STOP,
        strict: bool = False,
    ) -> Motion:
        """The motion. Solved once for each accuracy and frame rate; another ``on_failure`` costs nothing.

        ``accuracy``: "draft", "standard", "high" or "exact" (then to ``digits`` digits, 50 if none are asked for).
        ``fps``: frames per time unit, instead of the script's. ``strict``: warnings are errors.
        ``on_failure``, where the scene has no solution at some time: "stop" raises `NoSolutionError`, whose diagnostics
        say when, what is too short or too long, and by how much; "hold" keeps the last good pose in such frames, "skip"
        leaves them out.

        Raises `ScriptError` if the script contradicts itself, `UsageError` for choices that do not fit together.

        >>> import movimentum as mv
        >>> script = mv.loads("Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A=[0,0]; Rod.B=[30 + 40*.t, y]; y > 0; @1")
        >>> script.solve()
        Traceback (most recent call last):
            ...
        movimentum.errors.NoSolutionError: error[solve/unreachable]: ...
        >>> script.solve(on_failure="hold").solved.mean().round(1).item(), len(script.solve(on_failure="skip"))
        (0.5, 13)
        """
        tier = one_of(Accuracy, accuracy, "accuracy")
        policy = one_of(FailurePolicy, on_failure, "failure policy")
        if digits is not None and tier is not Accuracy.EXACT:
            raise usage_error("usage/digits", 'digits need accuracy="exact": the other tiers have those of a float64')
        if digits is not None and not 1 <= digits <= self.limits.digits:
            message = f"{digits:,} digits are outside 1 to {self.limits.digits:,}"
            raise usage_error("limit/digits", message, "give `load` other `Limits`")
        choices = replace(choices_of(self.limits), fps=frame_rate(fps), accuracy=tier, digits=digits, strict=strict)
        choices = replace(choices, on_failure=policy)
        return Motion(self, accepted(self, choices), choices)

    @called
    def sweep(
        self,
        vary: Mapping[str, object] | None = None,
        /,
        *,
        measure: Measured = (),
        sample: str | None = None,
        client: object = None,
        **constants: object,
    ) -> Sweep:
        """Solve many variants: all combinations of the values of ``constants`` (arrays or array-likes), or a ``sample``
        such as "sobol:4096" of the intervals of all constants that have a `.range`.

        ``measure``: measures by name: expressions with reductions over all frames, such as
        ``".max(Rod.B.x) - .min(Rod.B.x)"`` (see docs/how-to/sweep.md). ``vary``: the same as ``constants``, for
        constants with the name of an argument. ``client``: a `distributed.Client` whose workers solve.

        A variant that does not move is a row, not an error. Raises `UsageError` for an unknown constant or an invalid
        measure.

        >>> import movimentum as mv
        >>> import numpy as np
        >>> script = mv.load("scripts/whitworth.mov")
        >>> table = script.sweep(r=np.linspace(60, 90, 4), measure={"stroke": ".range(Ram.H.x)"})
        >>> table["stroke"].round(3).tolist(), table.outcome[0].item(), table.time[0].round(6).item()
        ([nan, nan, 139.918, 139.918], 'binds', 1.489395)
        """
        from movimentum.api.results import Sweep
        from movimentum.variants.axes import VariantGrid, grid_of, read_grid
        from movimentum.variants.measures import read_measures
        from movimentum.variants.sweep import prepared, sweep_rows

        cluster_client(client)
        given = {**(vary or {}), **constants}
        choices = self._choices
        texts = (
            [measure]
            if isinstance(measure, str)
            else list(measure.items())
            if isinstance(measure, Mapping)
            else measure
        )
        with errors_in(self.source):
            grid = grid_of(given)
            if sample is not None:
                grid = VariantGrid((*grid.axes, *read_grid((), sample, self._without(given)).axes))
            if not grid.axes:
                raise usage_error("usage/vary", "nothing is varied", "script.sweep(R=np.linspace(20, 80, 61))")
            job, _ = prepared(self.source, choices, grid, read_measures(texts, grid.names))
            solver = None
            if client is not None:
                from movimentum.variants.sweep import OnCluster

                solver = OnCluster(job, client)
            rows = sweep_rows(job, solver)
        return Sweep(self.name, grid.names, job.measures.names, grid.shape, rows)

    @called
    def fit(
        self,
        vary: Mapping[str, object] | None = None,
        /,
        *,
        seed: int = 0,
        effort: int = 1,
        every: bool = False,
        client: object = None,
        **intervals: object,
    ) -> Fit:
        """Find the constants that best meet the script's goals while its requirements hold.

        docs/how-to/fit.md explains goals and requirements.

        ``intervals`` (or ``vary``, for constants with the name of an argument): the constants to fit, each with
        (least, most), or None for its `.range`; by default, all constants that have a `.range` and were not set.
        ``effort``: use this many times the usual number of starts; ``every``: look for all solutions, see `Fit.others`.
        ``client``: a `distributed.Client` whose workers search. The result does not depend on the machines.

        Requirements that cannot be met are not an error: see `Fit.met`. Raises `UsageError` for a script without goals
        or constants to fit.
        """
        from movimentum.api.results import fitted

        with errors_in(self.source):
            given = {**(vary or {}), **intervals}
            cluster_client(client)
            seed, effort = whole(seed, "`seed`", 0), whole(effort, "`effort`", 1)
            return fitted(
                self.name, self.scene, self._choices, given, seed=seed, effort=effort, every=every, client=client
            )

    @called
    def with_constants(self, constants: Mapping[str, object]) -> Script:
        """The same script with other values for some of its constants.

        >>> import movimentum as mv
        >>> script = mv.loads(".let R = 30; Arm : .bar O=[0,0] P=[R,0]; @0 Arm.O=[0,0]; Arm.angle=0; @1")
        >>> script.with_constants({"R": 50}).solve()["Arm.P"][0].tolist()
        [50.0, 0.0]
        """
        own = {name: _constant(name, value) for name, value in constants.items()}
        settings = tuple({**dict(self.scene.settings), **own}.items())
        with errors_in(self.source):
            return _understood(self.source, settings, self.limits, ScriptFiles())

    @called
    def with_text(self, text: str, /) -> Script:
        """A script with another text, in the same place and with the same constants set."""
        source = SourceText(self.source.path, text)
        with errors_in(source):
            return _understood(source, tuple(self.scene.settings), self.limits, ScriptFiles())

    @called
    def live(self, *constants: str) -> LivingFigure:
        """A figure in which these constants are sliders and the drive is a handle: in a notebook, or as a page.

        Every slider moves in the constant's `.range`, or else from half of its value to one and a half times as much.
        Raises `UsageError` for an unknown constant, and `ScriptError` (``live/cannot``) if part of the motion has no
        formula, or part of the picture cannot follow.

        >>> import movimentum as mv
        >>> text = ".let R = 30; Arm : .bar O=[0,0] P=[R,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1"
        >>> mv.loads(text).live("R").constants
        {'R': (15.0, 45.0)}
        """
        from movimentum.api.pictures import LivingFigure
        from movimentum.workflow.choices import Picture
        from movimentum.workflow.living import living_figure

        with errors_in(self.source):
            picture = Picture(max_pixels=self.limits.pixels)
            figure, found = living_figure(self.source, constants, self._choices, picture)
        return LivingFigure(self.name, self.source, figure, Diagnostics(in_python(found), self.source))

    @called
    def studio(self) -> StudioWidget:
        """The studio with this script as a live notebook widget: `StudioWidget.text` is its current text, and
        `StudioWidget.script` the script of that text. Its Save button writes to the script's file.

        `UsageError` (``usage/extra``) without the extra ``notebook``.
        """
        from movimentum.studio.widget import refuse_missing

        refuse_missing()
        from movimentum.studio.widget import StudioWidget

        return StudioWidget(self, self._choices)

    @property
    def _choices(self) -> Choices:
        """The choices that the script was read with."""
        return choices_of(self.limits, tuple(self.scene.settings))

    def _without(self, given: Mapping[str, object]) -> list[NamedConstant]:
        return [constant for constant in self.scene.constants if constant.name not in given]

    def __reduce__(self) -> tuple[object, ...]:
        return _understood, (self.source, tuple(self.scene.settings), self.limits, self._files)

    def _repr_html_(self) -> str:
        """The motion, as far as there is one, and the diagnostics."""
        from movimentum.api.pictures import shown

        choices, said = replace(choices_of(self.limits), on_failure=FailurePolicy.HOLD), self.diagnostics
        try:
            solution = accepted(self, choices)
        except MovimentumError:
            return diagnostics_html(said, self.source)
        return shown(self.source, solution, choices, said)

    def __repr__(self) -> str:
        parts = [counted(len(self.scene.things), "thing"), counted(len(self.scene.steps), "step")]
        return f"Script({self.name}: {', '.join(parts)})"
