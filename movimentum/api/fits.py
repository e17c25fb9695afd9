"""Fits from Python: the constants that bring a script's goals nearest."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from movimentum.api.calls import called, in_python, spoken
from movimentum.api.output import Written
from movimentum.diagnostics import Diagnostic
from movimentum.errors import usage_error
from movimentum.records import dataclass, fields

if TYPE_CHECKING:
    from movimentum.fitting.fit import FitJob, Fitted
    from movimentum.fitting.summary import AimOutcome
    from movimentum.scene.model import Purpose, Scene
    from movimentum.workflow.choices import Choices

Interval = tuple[float, float]
"""From the least to the most that a constant may be."""


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """What a fit has found. `Script.fit` makes it; it never changes.

    ``constants`` are those that were fitted, by name. Lengths are in the script's pixels, angles in degrees.

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
        """The constants that were found."""
        return self._found.constants

    @property
    def before(self) -> dict[str, float]:
        """What they were in the script."""
        return dict(zip(self._found.problem.job.names, self._found.before.tolist(), strict=True))

    @property
    def others(self) -> list[dict[str, float]]:
        """Other constants that are as good; all that were found, if ``every`` was asked for."""
        names = self._found.problem.job.names
        return [dict(zip(names, row, strict=True)) for row in self._found.others.tolist()]

    @property
    def met(self) -> bool:
        """Whether all requirements hold. If not, this is the nearest that was found, and `diagnostics` say so."""
        return self._found.met

    @property
    def cost(self) -> float | None:
        """The sum over all goals of the mean square of what they miss by, less what is to be largest, times their
        weights; None where nothing moves.
        """
        from movimentum.fitting.summary import cost_of

        return cost_of(self._found, self._found.last)

    @cached_property
    def goals(self) -> Sequence[AimOutcome]:
        """What each goal misses by, in the order written: ``told``, ``line``, ``rms``, ``worst``, ``time``; and the
        ``value`` of one to be largest or smallest.
        """
        return self._outcomes("goal")

    @cached_property
    def requirements(self) -> Sequence[AimOutcome]:
        """By how much each requirement is off (``worst``, below 0 where an inequality holds), in the order written."""
        return self._outcomes("require")

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """What there is to say: requirements that no variant meets, constants at the end of their ranges."""
        from movimentum.fitting.summary import notes, unmet

        return in_python((*unmet(self._found), *notes(self._found)))

    @cached_property
    def text(self) -> str:
        """The script's text with the new constants; layout and comments are kept. `UsageError` for constants of an
        included file.
        """
        from movimentum.fitting.written import with_constants

        with spoken():
            return with_constants(self._scene, self.constants)

    @called
    def save(self, path: str | os.PathLike[str]) -> Written:
        """Write `text` to a file, with its pictures named from there; never over what the script reads
        (`UsageError`).
        """
        from movimentum.fitting.written import with_constants
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
        from movimentum.fitting.distributed import done_there

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
