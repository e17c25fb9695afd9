"""The results that Python gets from motions, sweeps and fits: files, tables, constants."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from movimentum.api.arguments import called, errors_in_python, in_python
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.diagnostics import Diagnostic, Diagnostics, Severity, diagnostics_html
from movimentum.errors import UnknownNameError, usage_error
from movimentum.records import dataclass, fields
from movimentum.syntax.suggest import nearest
from movimentum.text import number

if TYPE_CHECKING:
    from movimentum.fitting.fit import FitJob, Fitted
    from movimentum.fitting.summary import AimOutcome
    from movimentum.scene.model import Purpose, Scene
    from movimentum.solver.motion import MotionOfAnyAccuracy
    from movimentum.solver.poses import Poses
    from movimentum.variants.outcomes import VariantRows
    from movimentum.workflow.choices import Choices


@dataclass(frozen=True, slots=True)
class Written:
    """The result of `Motion.render` or `Motion.save`: the file's ``path`` (numbered pictures: with its ``%d``), the
    number of ``frames`` (or rows), and diagnostics.

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


def data_frame(motion: MotionOfAnyAccuracy, chunks: Iterable[Poses], frames: IntArray) -> Any:
    """See `Motion.to_dataframe`."""
    from movimentum.analysis.diagnose.undetermined import variables_never_valued
    from movimentum.interop.tables import columns

    pandas = _pandas()
    scene, parts = motion.timeline.scene, list(chunks)
    found = columns(scene, variables_never_valued(motion.path))
    table = {column.name: np.concatenate([column.values(poses) for poses in parts]) for column in found}
    for name, variable in scene.variables.items():
        missing = np.concatenate([poses.missing.get(name, np.zeros(len(poses.times), bool)) for poses in parts])
        for title in (f"{name}.x", f"{name}.y") if variable.is_vector else (name,):
            if title in table:
                table[title][missing] = np.nan
    return pandas.DataFrame(table, index=pandas.Index(frames, name="frame"))


def _pandas() -> Any:
    try:
        return import_module("pandas")
    except ImportError as problem:
        raise ImportError("to_dataframe() needs pandas: pip install pandas", name="pandas") from problem


def no_progress(done: int, total: int) -> None:
    """Nobody watches the progress."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """The variants of a script, one row each: the values of the varying constants, and the measures.

    All combinations of the values are solved, the last constant fastest. `Script.sweep` makes it; it never changes.

    >>> import movimentum as mv
    >>> script = mv.loads(".let R = 30;  Arm : .bar O=[0,0] P=[R,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1")
    >>> table = script.sweep(R=[10, 20, 30], measure={"height": ".max(Arm.P.y)"})
    >>> table
    Sweep(<string>: 3 variants, 3 ok)
    >>> table["R"].tolist(), table["height"].round(9).tolist(), table.outcome.tolist()
    ([10.0, 20.0, 30.0], [10.0, 20.0, 30.0], ['ok', 'ok', 'ok'])
    >>> table["heigt"]
    Traceback (most recent call last):
        ...
    movimentum.errors.UnknownNameError: error[name/unknown]: the sweep has no column `heigt`
       = help: did you mean `height`?
    """

    title: str
    constants: tuple[str, ...]
    measures: tuple[str, ...]
    shape: tuple[int, ...]
    rows: VariantRows

    def __len__(self) -> int:
        return len(self.rows)

    @called
    def __getitem__(self, name: str) -> FloatArray:
        """(V,) a constant's values, or a measure's (nan where the variant does not move); `UnknownNameError` for any
        other name.
        """
        if name in self.constants:
            return self.rows.constants[:, self.constants.index(name)].copy()
        if name in self.measures:
            return self.rows.measures[:, self.measures.index(name)].copy()
        guess = nearest(name, self.keys())
        helps = (f"did you mean `{guess}`?",) if guess else (f"its columns are {', '.join(self)}",)
        message = f"the sweep has no column `{name}`"
        raise UnknownNameError([Diagnostic("name/unknown", Severity.ERROR, message, helps=helps)])

    def keys(self) -> list[str]:
        """The names of the constants and of the measures; a loop over a sweep gives the same."""
        return [*self.constants, *self.measures]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self.keys()

    @property
    def outcome(self) -> NDArray[np.str_]:
        """(V,) "ok", "binds", "cannot be assembled" or "jumps"."""
        from movimentum.variants.outcomes import OUTCOMES

        return np.array([outcome.value for outcome in OUTCOMES])[self.rows.outcomes]

    @property
    def time(self) -> FloatArray:
        """(V,) when a variant binds or jumps, in the script's unit; nan where it is ok."""
        return self.rows.times.copy()

    @property
    def ok(self) -> BoolArray:
        """(V,) whether the outcome is "ok"."""
        from movimentum.variants.outcomes import VariantOutcome

        return self.rows.outcomes == VariantOutcome.OK.code

    @called
    def grid(self, name: str) -> FloatArray:
        """A column in the shape of the given values: one axis for each constant, in their order.

        >>> import movimentum as mv
        >>> script = mv.loads(".let a = 1; .let b = 1; A : .bar O=[0,0] P=[a,b]; @0 A.O=[0,0]; A.angle=0; @1")
        >>> script.sweep(a=[1, 2, 3], b=[1, 2], measure={"x": ".max(A.P.x)"}).grid("x").tolist()
        [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]
        """
        return self[name].reshape(self.shape)

    def columns(self) -> Iterator[tuple[str, NDArray[Any]]]:
        """The columns of the table: constants, measures, ``outcome``, ``time``."""
        for name in self:
            yield name, self[name]
        yield "outcome", self.outcome
        yield "time", self.time

    def to_dataframe(self) -> Any:
        """A pandas DataFrame with one row for each variant. Raises ImportError without pandas."""
        return _pandas().DataFrame(dict(self.columns()))

    @called
    def save(self, path: str | os.PathLike[str]) -> Written:
        """Write the table as a ``.csv``, ``.npz`` or ``.parquet`` file; raises `UsageError` for other suffixes, and
        if it cannot be written.
        """
        from movimentum.output.files import whole_file
        from movimentum.variants.outcomes import check_table, write_table

        target = Path(os.fspath(path))
        check_table(target)
        with whole_file(target) as part:
            write_table(self.keys(), lambda: (self.rows,), len(self), part, target.suffix)
        return Written(target, len(self), ())

    def _repr_html_(self) -> str:
        """The first and the last rows of the table."""
        from movimentum.markup import table_html

        count = len(self)
        shown = range(count) if count <= MOST_ROWS else (*range(MOST_ROWS // 2), *range(count - MOST_ROWS // 2, count))
        names, columns = zip(*self.columns(), strict=True)
        cells = [[_cell(column[row]) for column in columns] for row in shown]
        bad = [not self.ok[row] for row in shown]
        return table_html(names, cells, bad, (MOST_ROWS // 2, count - len(shown)), repr(self))

    def __repr__(self) -> str:
        return f"Sweep({self.title}: {len(self):,} variants, {int(self.ok.sum()):,} ok)"


MOST_ROWS = 20
"""Rows of a sweep that a notebook shows."""


def _cell(value: Any) -> str:
    """A cell of the table in a notebook; nothing where there is no value."""
    return str(value) if isinstance(value, str) else "" if np.isnan(value) else number(float(value), 6)


Interval = tuple[float, float]
"""From the least to the most that a constant may be."""


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """The result of a fit. `Script.fit` makes it; it never changes.

    ``constants`` are the fitted ones, by name. Lengths are in the script's pixels, angles in degrees.

    >>> import movimentum as mv
    >>> script = mv.loads('''.let R = 30 .range(10, 80);
    ... Arm : .bar O = [0,0] P = [R,0];
    ... @0 Arm.O = [0,0]; Arm.angle = 90*.t;  .goal .max(Arm.P.y) = 50;  .require Arm.P.x > -1;
    ... @1''')
    >>> found = script.fit()
    >>> found
    Fit(<string>: R = 50; the requirements hold)
    >>> round(found.constants["R"], 9), found.met, round(found.cost, 9)
    (50.0, True, 0.0)
    >>> found.text.splitlines()[0]
    '.let R = 50 .range(10, 80);'
    >>> script.with_constants(found.constants).solve()["Arm.P"].max().round(9).item()
    50.0
    """

    title: str
    _scene: Scene
    _found: Fitted

    @property
    def constants(self) -> dict[str, float]:
        """The fitted constants."""
        return self._found.constants

    @property
    def before(self) -> dict[str, float]:
        """Their values in the script."""
        return dict(zip(self._found.problem.job.names, self._found.before.tolist(), strict=True))

    @property
    def others(self) -> list[dict[str, float]]:
        """Other equally good constants; all that were found, with ``every``."""
        names = self._found.problem.job.names
        return [dict(zip(names, row, strict=True)) for row in self._found.others.tolist()]

    @property
    def met(self) -> bool:
        """Whether all requirements hold. If not, this is the nearest result, and `diagnostics` say so."""
        return self._found.met

    @property
    def cost(self) -> float | None:
        """The sum over all goals of their mean square errors, less values to be largest, times their weights; None if
        nothing moves.
        """
        from movimentum.fitting.summary import cost_of

        return cost_of(self._found, self._found.last)

    @cached_property
    def goals(self) -> Sequence[AimOutcome]:
        """How far each goal is missed, in the order written: ``text``, ``line``, ``rms``, ``worst``, ``time``; and the
        ``value`` of a goal to be largest or smallest.
        """
        return self._outcomes("goal")

    @cached_property
    def requirements(self) -> Sequence[AimOutcome]:
        """How far each requirement is off (``worst``, below 0 if an inequality holds), in the order written."""
        return self._outcomes("require")

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Diagnostics: requirements that no variant meets, constants at the end of their ranges, and so on."""
        from movimentum.fitting.summary import notes, unmet

        return Diagnostics(in_python((*unmet(self._found), *notes(self._found))), self._scene.source)

    @cached_property
    def text(self) -> str:
        """The script's text with the new constants; layout and comments are kept. Raises `UsageError` for constants of
        an included file.
        """
        from movimentum.fitting.output import with_constants

        with errors_in_python():
            return with_constants(self._scene, self.constants)

    @called
    def save(self, path: str | os.PathLike[str]) -> Written:
        """Write `text` to a file, with picture paths relative to it; never over a file that the script reads
        (`UsageError`).
        """
        from movimentum.fitting.output import with_constants
        from movimentum.output.files import refuse_overwriting, whole_file
        from movimentum.workflow.read import reads

        target = Path(os.fspath(path))
        refuse_overwriting(target, reads(self._scene.source.script, self._scene))
        text = with_constants(self._scene, self.constants, target.parent)
        with whole_file(target) as part, part.open("w", encoding="utf-8", newline="") as stream:
            stream.write(text)
        return Written(target, 1, ())

    def _outcomes(self, purpose: Purpose | str) -> Sequence[AimOutcome]:
        from movimentum.fitting.summary import aim_outcomes

        return tuple(each for each in aim_outcomes(self._found, self._found.last) if each.claim.purpose == purpose)

    def __reduce__(self) -> tuple[object, ...]:
        found = self._found
        made_again = ("problem", "first", "last")
        rest = {each.name: getattr(found, each.name) for each in fields(found) if each.name not in made_again}
        return _again, (self.title, found.problem.job, rest)

    def _repr_html_(self) -> str:
        """What `movimentum fit` prints."""
        from movimentum.fitting.summary import fit_text
        from movimentum.markup import text_html

        return text_html(fit_text(self._found)) + diagnostics_html(self.diagnostics, self._scene.source)

    def __repr__(self) -> str:
        from movimentum.fitting.summary import constants_text

        holds = "the requirements hold" if self.met else "no variant meets the requirements"
        return f"Fit({self.title}: {constants_text(self._found)}; {holds})"


def fitted(
    title: str,
    scene: Scene,
    choices: Choices,
    given: Mapping[str, object],
    *,
    seed: int,
    effort: int,
    every: bool,
    client: object,
) -> Fit:
    """The fit of the script of ``scene``, which was read with ``choices``; see `Script.fit`."""
    from movimentum.fitting.fit import done_here, fit, make_job, make_problem

    job = make_job(scene.source.script, choices, {n: _interval(n, v, scene) for n, v in given.items()}, seed)
    problem = make_problem(job)
    work = done_here(problem)
    if client is not None:
        from movimentum.fitting.output import done_there

        work = done_there(job, client)
    return Fit(title, scene, fit(problem, lambda _done, _total: None, work, every=every, effort=effort))


def _again(title: str, job: FitJob, rest: Mapping[str, Any]) -> Fit:
    """A fit in another process: what was found, and all else made again, for compiled code does not travel."""
    from movimentum.fitting.fit import Fitted, make_problem
    from movimentum.workflow.stages import understand

    problem = make_problem(job)
    first, last = (problem.single.motion(rest[name]) for name in ("before", "after"))
    scene = understand(job.source, job.choices, files=job.files)
    return Fit(title, scene, Fitted(problem=problem, first=first, last=last, **rest))


def _interval(name: str, value: Any, scene: Scene) -> Interval:
    if value is None:
        known = {constant.name: constant for constant in scene.constants}
        own = known.get(name)
        if own is None or own.least is None or own.most is None:
            raise usage_error("usage/vary", f"`{name}` has no `.range`", f"{name}=(10, 20)")
        return own.least, own.most
    try:
        low, high = (float(each) for each in value)
    except (TypeError, ValueError):
        raise usage_error("usage/vary", f"`{name}` needs an interval", f"{name}=(10, 20)") from None
    return low, high
