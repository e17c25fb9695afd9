"""The result of a fit, in the script's units: constants, goals, requirements."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from movimentum.advice import Advised, Choose, ScriptCommand
from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Fix, Severity, replacement
from movimentum.fitting.fit import Fitted
from movimentum.fitting.programming import Program
from movimentum.fitting.single import SingleMotion
from movimentum.records import dataclass, field, replace
from movimentum.scene.model import Claim, Purpose, Relation
from movimentum.text import counted, number, time_text
from movimentum.tolerances import AT_AN_END, GAIN_WORTH_A_NOTE, LEAST_DIVISOR, ROUNDED_UP
from movimentum.variants.outcomes import VariantOutcome
from movimentum.variants.tracing import varied_names

_ANGLE = re.compile(r"\.a(ngle)?\s*\(.*\)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class AimOutcome:
    """How far a goal or a requirement (``text`` in the script, in ``line``) is off: the root of the mean square
    over its frames (``rms``), and the most (``worst``) at ``time`` (None: it is about the whole film). Of an inequality
    ``worst`` is what is too much: below 0 it holds, with that to spare. None where the variant does not move. What is
    to be as large or as small as can be has a ``value`` instead.
    """

    claim: Claim = field(repr=False)
    text: str
    line: int
    rms: float | None
    worst: float | None
    time: float | None
    value: float | None = None


def aim_outcomes(fitted: Fitted, motion: SingleMotion) -> list[AimOutcome]:
    """One for each aim, in the order written."""
    problem = fitted.problem
    merit, layout = problem.search.merit, problem.single.formulas.layout
    all_missed: FloatArray = merit.missed(motion.sides[None])[0]
    timeline, source = problem.lowered.timeline, problem.lowered.timeline.scene.source
    found: list[AimOutcome] = []
    for n, aim in enumerate(problem.lowered.aims):
        claim = aim.timed_claim.claim
        line = source.position(claim.span.start).line
        text = " ".join(source.slice(claim.span).split()).removeprefix(f".{claim.purpose} ")
        own = layout.aim == n
        sides = motion.sides[own].reshape(len(aim.sides), -1)
        if aim.extreme:
            sign = -1.0 if claim.relation is Relation.LARGEST else 1.0
            value = sign * float(np.max(sides))
            if found and found[-1].claim is claim:  # one more term
                value += found.pop().value or 0.0
            found.append(AimOutcome(claim, text, line, None, None, None, value if np.isfinite(value) else None))
            continue
        if not np.isfinite(sides).all():
            found.append(AimOutcome(claim, text, line, None, None, None))
            continue
        missed: FloatArray = all_missed[own].reshape(sides.shape)
        off: FloatArray = np.sqrt(np.sum(np.square(missed), axis=0))
        amount = off if aim.sign == 0.0 else sides[0]
        place = int(np.argmax(amount))
        frame = int(layout.frame[own][place])
        time = float(timeline.frame_time(frame)) if frame >= 0 else None
        rms = float(np.sqrt(np.mean(np.square(missed)) * len(aim.sides)))
        found.append(AimOutcome(claim, text, line, rms, float(amount[place]), time))
    return found


def unmet(fitted: Fitted) -> Iterator[Diagnostic]:
    """An error for each requirement that does not hold, with the nearest that does; or that nothing moves."""
    problem = fitted.problem
    last = fitted.last
    if not np.isfinite(last.sides).all():
        yield _nothing_moves(fitted)
        return
    source = problem.lowered.timeline.scene.source
    merit, layout = problem.search.merit, problem.single.formulas.layout
    excess = merit.excess(last.sides[None])[0]
    for n, outcome in enumerate(aim_outcomes(fitted, last)):
        own = layout.aim == n
        if outcome.worst is None or not (excess[own] > 0.0).any():
            continue
        claim = outcome.claim
        when = "" if outcome.time is None else f", at t = {time_text(outcome.time)}"
        yield Diagnostic(
            "fit/requirement",
            Severity.ERROR,
            f"no variant meets `{outcome.text}`: the nearest is off by {number(outcome.worst)}{when}",
            claim.span,
            notes=(f"the nearest: {constants_text(fitted)}",),
        ).advised(
            *_other_sense(claim, fitted.last.sides[own]),
            _nearest(claim, outcome.worst, source.slice(claim.span)),
            "or give constants wider ranges",
        )


def _other_sense(claim: Claim, sides: FloatArray) -> Iterator[str]:
    """Advice where an angle that is to be large is below 0 all the time: it is counted in the other sense."""
    angle, limit = claim.side_texts[0], claim.right[0].value
    below = limit is not None and bool((sides > max(limit, 0.0)).all())
    if below and claim.relation is Relation.ABOVE and _ANGLE.fullmatch(angle):
        yield f"an angle has a sign, and this one is negative: `.abs({angle}) > {claim.side_texts[1]}`"


def _nearest(claim: Claim, worst: float, text: str) -> Fix:
    """The requirement that can be met instead."""
    allowed = float(claim.tolerance or 0)
    enough = _rounded_up(worst + (allowed if claim.relation is Relation.EQUAL else 0.0))
    plain = text if claim.tolerance is None else text[: text.rindex(".within")].rstrip()
    now = f"{plain} .within({enough})"
    return replacement(f"this can be met: `{now};`", claim.span, now)


def _rounded_up(value: float) -> str:
    unit = 10.0 ** (np.floor(np.log10(max(value, LEAST_DIVISOR))) - 2)
    return number(float(np.ceil(value / unit * (1.0 + ROUNDED_UP)) * unit), 3)


def _nothing_moves(fitted: Fitted) -> Diagnostic:
    first, job = fitted.first, fitted.problem.job
    box = ", ".join(
        f"{name} from {number(low)} to {number(high)}"
        for name, (low, high) in zip(job.names, job.intervals.tolist(), strict=True)
    )
    own = {
        VariantOutcome.BINDS: f"the script's own values: it binds at t = {time_text(first.time)}",
        VariantOutcome.JUMPS: f"the script's own values: it jumps at t = {time_text(first.time)}",
    }.get(first.outcome, "the script's own values: it cannot be assembled")
    return Diagnostic(
        "fit/nothing-moves",
        Severity.ERROR,
        "no variant moves all the way, so no goal can be judged",
        notes=(f"tried: {box}", own),
        helps=(
            Advised("start from constants for which the script moves: ", ScriptCommand.CHECK, " says why it does not"),
        ),
    )


def notes(fitted: Fitted) -> Iterator[Diagnostic]:
    """Notes on constants: those that stand at an end of their intervals, and those that are not decided."""
    if fitted.left is None:
        return
    job = fitted.problem.job
    idle = fitted.left.idle
    each = zip(job.names, fitted.after.tolist(), job.intervals.tolist(), idle.tolist(), strict=True)
    for column, (name, value, (low, high), unused) in enumerate(each):
        near = AT_AN_END * (high - low)
        if unused:
            message = f"no goal or requirement depends on {name}, so it keeps its value"
            yield Diagnostic("fit/idle", Severity.NOTE, message, helps=(Choose.SET.to(f"{name}={number(value)}"),))
        elif min(value - low, high - value) <= near and np.isinf(fitted.problem.search.periods[column]):
            yield from _at_an_end(fitted, name, value, low, high)
    if fitted.left.free and fitted.met:
        free, every = fitted.left.free, counted(int(np.sum(~idle)), "constant")
        message = f"the goals leave {free} of {every} free: many other solutions are equally good"
        advice = Advised(
            f"state {counted(free, 'more goal')}, or give a constant its value with `", Choose.SET.to(), "`"
        )
        yield Diagnostic("fit/undecided", Severity.NOTE, message, helps=(advice,))


def _at_an_end(fitted: Fitted, name: str, value: float, low: float, high: float) -> Iterator[Diagnostic]:
    """The note that a constant is at an end of its range. A wider range is proposed if it helps, or may help."""
    job, lowered = fitted.problem.job, fitted.problem.lowered
    least, most = -np.inf, np.inf
    if any(part.time is not None and name in varied_names(part.time) for part in lowered.reductions):
        least, most = float(lowered.timeline.start), float(lowered.timeline.end)
    width = high - low
    wider = (max(_lower(low, high), least), high) if 2.0 * value < low + high else (low, min(high + 0.5 * width, most))
    message = f"{name} is at the end of its range, {number(value)}"
    column = job.names.index(name)
    if wider == (low, high) or not _better_within(fitted, column, wider):
        yield Diagnostic("fit/at-an-end", Severity.NOTE, message)
        return
    ends = [wider if n == name else (a, b) for n, (a, b) in zip(job.names, job.intervals.tolist(), strict=True)]
    varied = (Choose.VARY.to(f"{n}={number(a)}:{number(b)}") for n, (a, b) in zip(job.names, ends, strict=True))
    advice = Advised(*[part for one in varied for part in (" ", one)][1:])
    yield Diagnostic("fit/at-an-end", Severity.NOTE, f"{message}: a wider one may do better", helps=(advice,))


def _better_within(fitted: Fitted, column: int, wider: tuple[float, float]) -> bool:
    """Whether the descent goes on beyond the end of an interval. Not tried where each variant is solved by itself."""
    if fitted.problem.reason is not None:
        return True
    search = fitted.problem.search
    low, high = search.low.copy(), search.high.copy()
    low[column], high[column] = wider
    beyond = replace(search, low=low, high=high, timing=None)
    point = np.clip((fitted.after - low) / (high - low), 0.0, 1.0)[None]
    before, after = beyond.judged(point), beyond.descended(point)
    if search.merit.extremes:
        after = beyond.judged(Program(beyond).nearest_goals(point[0])[None])
    if after.worst[0] > 0.0 or before.worst[0] > 0.0:
        return bool(after.worst[0] < before.worst[0] or not fitted.met)
    return bool(after.costs[0] < before.costs[0] - GAIN_WORTH_A_NOTE * abs(before.costs[0]))


def _lower(low: float, high: float) -> float:
    """A lower end of an interval; a length stays above 0."""
    lower = low - 0.5 * (high - low)
    return 0.5 * low if low > 0.0 >= lower else lower


def constants_text(fitted: Fitted) -> str:
    """``L = 100, R = 20``."""
    return ", ".join(f"{name} = {number(value)}" for name, value in fitted.constants.items())


def cost_of(fitted: Fitted, motion: SingleMotion) -> float | None:
    """The weighted sum of squares of what goals miss by, and of what is to be small; None where nothing moves."""
    sides: FloatArray = motion.sides[None]
    return float(fitted.problem.search.merit.cost(sides)[0]) if np.isfinite(sides).all() else None


def fit_text(found: Fitted) -> str:
    """The printed result: constants before and after, the error of each goal, each requirement."""
    job = found.problem.job
    lines: list[str] = []
    if found.problem.reason is not None:
        lines.append(f"(variants were solved one by one: {found.problem.reason})")
    width = max(map(len, job.names))
    for name, before, after in zip(job.names, found.before.tolist(), found.after.tolist(), strict=True):
        lines.append(f"{name:<{width}} = {number(after, 10)}   (was {number(before, 10)})")
    before, after = (aim_outcomes(found, motion) for motion in (found.first, found.last))
    for purpose, title in ((Purpose.GOAL, "goals"), (Purpose.REQUIREMENT, "requirements")):
        own = [(a, b) for a, b in zip(before, after, strict=True) if a.claim.purpose is purpose]
        if own:
            lines.append(f"{title}:")
        for was, now in own:
            off = _off(now, purpose is Purpose.GOAL)
            moved = was.rms is not None or was.value is not None
            earlier = f"   (before: {_off(was, purpose is Purpose.GOAL)})" if moved else ""
            lines.append(f"  line {now.line}: {now.text}: {off}{earlier}")
    if len(found.others):
        lines.append(f"{counted(len(found.others), 'other solution')}, equally good:")
        rows = ([f"{n} = {number(v, 8)}" for n, v in zip(job.names, r, strict=True)] for r in found.others.tolist())
        lines += ["  " + ", ".join(row) for row in rows]
    return "\n".join(lines) + "\n"


def _off(outcome: AimOutcome, goal: bool) -> str:
    if outcome.value is not None:
        return number(outcome.value)
    if outcome.worst is None or outcome.rms is None:
        return "it does not move"
    when = "" if outcome.time is None else f" at t = {time_text(outcome.time)}"
    if goal:
        if outcome.time is None:
            return f"off by {number(max(outcome.rms, 0.0))}"
        return (
            f"off by {number(outcome.rms)} (root of the mean square), {number(max(outcome.worst, 0.0))} at most{when}"
        )
    if outcome.worst <= 0.0:
        return f"holds, with {number(-outcome.worst)} to spare{when}"
    return f"off by {number(outcome.worst)}{when}"
