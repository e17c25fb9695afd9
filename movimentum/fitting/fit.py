"""`fit`: the constants of a script that best meet its goals while its requirements hold."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence

import numpy as np

from movimentum.advice import Choose
from movimentum.arrays import BoolArray, FloatArray
from movimentum.errors import ScriptError, usage_error
from movimentum.fitting.aims import LoweredAims, SideFormulas, lower_aims
from movimentum.fitting.evaluation import BatchEvaluator
from movimentum.fitting.merit import Merit
from movimentum.fitting.programming import Program, largest
from movimentum.fitting.search import (
    ONE_BY_ONE,
    SAMPLE,
    TOGETHER,
    Candidates,
    Search,
    SearchEffort,
    Task,
    sobol,
    tasks_of,
)
from movimentum.fitting.single import SingleEvaluator, SingleMotion
from movimentum.fitting.undecided_constants import Undecided, periods_of, undecided
from movimentum.records import dataclass, field, replace
from movimentum.scene.model import Claim
from movimentum.solver.basis.scene_size import scene_size
from movimentum.source import SourceText
from movimentum.timeline.model import Timeline
from movimentum.tolerances import (
    COSTS_ALIKE,
    GOAL_IN_REACH,
    GOAL_MET,
    LEAST_DIVISOR,
    LEAST_OFF_FACTOR,
    REQUIREMENT_NEARLY_MET,
    SOLVERS_AGREE,
)
from movimentum.variants.axes import check_interval
from movimentum.variants.measures import MeasureSet
from movimentum.variants.single import Variants, structure_key
from movimentum.variants.together.pattern import NotBatchable
from movimentum.variants.together.preparation import prepare
from movimentum.variants.tracing import generic
from movimentum.workflow.choices import Choices, Progress
from movimentum.workflow.read import ScriptFiles
from movimentum.workflow.stages import understand

AGREEING = 3
"""Parts of the search, for each unit of effort, that end at the same best when there is no need for more."""
LONGER = 3
"""Times as long the search goes on at most, where goals are nearly met."""
BEST = 6
"""Candidates that are refined in the end."""
SPARE = 24
"""Candidates that are tried where none of those is believed."""
NEAREST = 2
"""Candidates that are tried for the least that a requirement can be off."""
DIGITS = 12
"""To which constants are rounded, if that changes nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class FitJob:
    """The input of a fit: the constants ``names`` of a script within ``intervals`` (C, 2), ``own`` (C,) being the
    script's. It can be sent to other processes, which come to the same, with what ``files`` know of others than the
    script.
    """

    source: SourceText
    choices: Choices
    names: tuple[str, ...]
    intervals: FloatArray
    own: FloatArray
    seed: int = 0
    files: ScriptFiles = field(default_factory=ScriptFiles)


@dataclass(frozen=True, slots=True, eq=False)
class FitProblem:
    """A job made ready: what evaluates its variants, and the ``search``. ``reason``: why they are solved one by one."""

    job: FitJob
    single: SingleEvaluator
    search: Search
    lowered: LoweredAims
    reason: str | None


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """The result of a fit: the constants (C,) before and after, each with its motion; whether the requirements hold
    (``met``), and ``others``: constants (K, C) that are as good (all goals met) or nearly. ``left``: what the aims
    leave open; None where nothing moves.
    """

    problem: FitProblem
    before: FloatArray
    after: FloatArray
    first: SingleMotion
    last: SingleMotion
    met: bool
    tried: int
    others: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    left: Undecided | None = None

    @property
    def exit_code(self) -> int:
        """0 where all requirements are met, else 3."""
        return 0 if self.met else 3

    @property
    def constants(self) -> dict[str, float]:
        """The constants that were found."""
        return dict(zip(self.problem.job.names, self.after.tolist(), strict=True))


def make_job(
    source: SourceText, choices: Choices, intervals: Mapping[str, tuple[float, float]], seed: int = 0
) -> FitJob:
    """The job of fitting ``intervals`` (none: all constants that have a `.range` and are not set).

    Raises `ScriptError` and `UsageError` for what cannot be fitted.
    """
    files = ScriptFiles()
    scene = understand(source, choices, files=files)
    known = {constant.name: constant for constant in scene.constants}
    fixed = {name for name, _ in choices.settings}
    chosen = dict(intervals)
    if not chosen:
        for constant in scene.constants:
            if constant.least is not None and constant.most is not None and constant.name not in fixed:
                chosen[constant.name] = constant.least, constant.most
    if not chosen:
        message = "no constant has a `.range`, so there is nothing to fit"
        raise usage_error("fit/nothing", message, ".let L = 100 .range(60, 200);", Choose.VARY.to("L=60:200"))
    for name, (low, high) in chosen.items():
        check_interval(name, low, high, known)
    if not any(isinstance(aim, Claim) for step in scene.steps for aim in step.aims):
        message = "the script has no goal, so there is nothing to fit it to"
        raise usage_error("fit/no-goal", message, ".goal Rod.P = [100, 150];", ".require Rod.P.y > 20;")
    own = np.array([float(known[name].value[0].value or 0.0) for name in chosen])
    return FitJob(source, choices, tuple(chosen), np.array(list(chosen.values()), dtype=np.float64), own, seed, files)


def make_problem(job: FitJob) -> FitProblem:
    """A job made ready. Raises `UsageError` where the times of the film depend on a constant."""
    variants = Variants(job.source, job.choices, job.names, MeasureSet(), job.files)
    intervals = {name: (low, high) for name, (low, high) in zip(job.names, job.intervals.tolist(), strict=True)}
    values = {name: generic(*interval, k) for k, (name, interval) in enumerate(intervals.items())}
    traced = _traced(variants, job, values, intervals)
    lowered = lower_aims(traced)
    formulas = SideFormulas(lowered, job.names)
    single = SingleEvaluator(variants, formulas, job.intervals)
    size = max(scene_size(traced.scene), LEAST_DIVISOR)
    reason: str | None = None
    evaluate: BatchEvaluator | SingleEvaluator = single
    try:
        batch = prepare(variants, {}, intervals)
        evaluate = _worth_it(BatchEvaluator(batch, formulas, job.intervals, single.all_sides))
    except Exception as error:  # whatever it is, the single solver has the last word
        reason = str(error).split("\n")[0]
    exact = isinstance(evaluate, BatchEvaluator) and evaluate.exact
    effort: SearchEffort = TOGETHER if exact else ONE_BY_ONE
    low, high = job.intervals[:, 0], job.intervals[:, 1]
    own = np.clip((job.own - low) / (high - low), 0.0, 1.0)
    merit = Merit.of(lowered, formulas.layout, size)
    timing = evaluate if isinstance(evaluate, BatchEvaluator) and evaluate.free_times.times else None
    search = Search(evaluate, merit, low, high, size, own, job.seed, effort, timing)
    if reason is None:
        search.balance()
    search.periods = periods_of(search, float(traced.end - traced.start))
    return FitProblem(job, single, search, lowered, reason)


def _worth_it(found: BatchEvaluator) -> BatchEvaluator:
    """The evaluator ``found``; `NotBatchable` where many variants would have to be solved by themselves all the
    same.
    """
    low, high = found.intervals.T
    if found.followed:
        doubt = found.doubtful(low + sobol(len(low), 0).random(SAMPLE) * (high - low))
        if np.mean(doubt) > MOST_IN_DOUBT:
            raise NotBatchable("integrals, or free motions, that need a path of their own")
    return found


def _traced(
    variants: Variants, job: FitJob, values: Mapping[str, float], intervals: Mapping[str, tuple[float, float]]
) -> Timeline:
    """The timeline that knows what depends on the constants. Raises `UsageError` where some constant decides
    how many things there are, or when steps begin.
    """
    own = dict(zip(job.names, job.own.tolist(), strict=True))
    base = structure_key(variants.timeline(variants.choices_of(own)))
    for name in job.names:
        try:
            other = variants.timeline(variants.choices_of({**own, name: generic(*intervals[name], 3)}))
            key: Hashable = structure_key(other)
        except ScriptError:
            key = None
        if key != base:
            message = f"things, steps or times depend on `{name}`, so it cannot be fitted"
            raise usage_error("fit/constant", message, Choose.SET.to(f"{name}={own[name]:.10g}"))
    return variants.timeline(variants.traced_choices(values))


MOST_IN_DOUBT = 0.25
"""The share of variants that may have to be solved by themselves, for the others to be worth solving together."""

Work = Callable[[list[Task]], Iterator[Candidates]]
"""Does parts of the search, and gives back what came of them in their order."""


def done_here(problem: FitProblem) -> Work:
    """Does them here, one after the other."""

    def work(tasks: list[Task]) -> Iterator[Candidates]:
        return (task_done(problem, task) for task in tasks)

    return work


def task_done(problem: FitProblem, task: Task) -> Candidates:
    """The result of one part of the search."""
    found = problem.search.piece(task[1]) if task[0] == "piece" else problem.search.island(task[1])
    found = found.best(BEST * 4)
    return largest(problem.search, found.best(1)).and_others(found) if problem.search.merit.extremes else found


def fit(
    problem: FitProblem, progress: Progress, work: Work | None = None, *, every: bool = False, effort: int = 1
) -> Fitted:
    """Search, refine the best, and solve it by itself. ``every``: all solutions are wanted, so nothing ends early.
    ``effort``: so many times the usual number of starts.
    """
    search, job = problem.search, problem.job
    usual, extreme = len(tasks_of(search.effort, effort)), bool(search.merit.extremes)
    solvable = bool(search.effort.generations) and problem.lowered.equations <= len(job.names)
    tasks = tasks_of(search.effort, LONGER * effort if solvable else effort)
    found = Candidates(np.zeros((0, len(job.names))), np.zeros(0), np.zeros(0))
    bests: list[float] = []
    for number, candidates in enumerate((work or done_here(problem))(tasks)):
        found = found.and_others(candidates)
        progress(number + 1, usual if number < usual else len(tasks))
        bests.append(float(np.min(candidates.costs[_met(search, candidates)], initial=np.inf)))
        if not every and (_exact(search, found).any() or _agree(bests, AGREEING * effort)):
            break
        if number + 1 == usual and (every or min(bests) > (GOAL_IN_REACH * search.size) ** 2):
            break
    if len(found) and not _met(search, found).any():
        found = found.and_others(_as_required(search, found))
    first = problem.single.motion(job.own)
    best = found.best(4 * BEST if every else BEST)
    exact = _exact(search, best)
    if not every and exact.any():
        best = best.take([int(k) for k in np.nonzero(exact)[0]])
    enough = -1.0 if every or extreme else (GOAL_MET * search.size) ** 2
    refined = _refined(search, best, enough) if _met(search, best).any() else best
    spare = found.best(SPARE)
    if len(refined) and (refined.worst > 0.0).all():
        refined, tried = _nearest(search, refined)
        spare = tried.and_others(spare).best(SPARE)
    return _chosen(problem, refined, spare, first, len(tasks))


def _met(search: Search, found: Candidates) -> BoolArray:
    """(M,) whether requirements are met, or nearly, so that refining will do it."""
    return np.isfinite(found.costs) & (found.worst <= REQUIREMENT_NEARLY_MET * search.size)


def _exact(search: Search, found: Candidates) -> BoolArray:
    """(M,) whether goals are met, and requirements or nearly."""
    return _met(search, found) & (found.costs <= (GOAL_MET * search.size) ** 2) & (not search.merit.extremes)


def _agree(bests: Sequence[float], wanted: int) -> bool:
    """Whether so many parts have come to the best cost of all."""
    least = min(bests)
    return bool(np.isfinite(least)) and sum(cost <= least + COSTS_ALIKE * abs(least) for cost in bests) >= wanted


def _as_required(search: Search, found: Candidates) -> Candidates:
    """Where the requirements are met best, whatever becomes of the goals; and from there, where the goals are."""
    starts = found.take([int(k) for k in found.order()][: search.effort.starts])
    met = search.descended(starts.points, goals=False)
    return met.and_others(search.descended(met.best(search.effort.starts).points))


def _refined(search: Search, best: Candidates, enough: float = -1.0) -> Candidates:
    refined = largest(search, best) if search.merit.extremes else search.refined(best, enough)
    return refined.and_others(best).best(len(best))


def _nearest(search: Search, found: Candidates) -> tuple[Candidates, Candidates]:
    """Where no requirement is off more than it must be; among such points, where the goals are missed least. And all
    points that were tried: the nearest may be where the mechanism only just moves, and not move when solved by itself.
    """
    program = Program(search)
    points = np.array([program.least_off(point) for point in found.best(NEAREST).points])
    every = search.judged(points).and_others(found)
    nearest = every.best(1)
    least = float(nearest.worst[0])
    if not least > 0.0:
        return _refined(search, nearest), every
    relaxed = replace(search, merit=search.merit.relaxed(least * LEAST_OFF_FACTOR))
    (start,) = relaxed.judged(every.points).best(1).points
    return search.judged(Program(relaxed).nearest_goals(start)[None]), every


def _chosen(problem: FitProblem, refined: Candidates, spare: Candidates, first: SingleMotion, tried: int) -> Fitted:
    """The best candidate that the single solver finds as it was found; ``spare`` ones where there is none."""
    job, search = problem.job, problem.search
    width = search.high - search.low
    for found in (refined, spare):
        believed = _believed(problem, found)
        if believed is None:
            continue
        k, point, constants, motion = believed
        rest = [int(j) for j in found.order() if j != k and found.worst[j] == 0.0]
        enough = found.costs[k] + (COSTS_ALIKE if search.merit.extremes else 0.02) * abs(found.costs[k])
        close = [j for j in rest if found.costs[j] <= enough + (GOAL_MET * search.size) ** 2]
        left = undecided(search, np.clip((constants - search.low) / width, 0.0, 1.0))
        if left.idle.any():
            constants, motion = _as_before(problem, left, constants, motion)
        others = search.low + left.apart(found.points[close], point) * width
        return Fitted(problem, job.own, constants, first, motion, _holds(search, motion), tried, others, left)
    return Fitted(problem, job.own, job.own, first, first, False, tried)


def _believed(problem: FitProblem, found: Candidates) -> tuple[int, FloatArray, FloatArray, SingleMotion] | None:
    """The best of ``found`` that the single solver finds as it was found, first of those that it finds to meet all
    requirements: its number, its point in the box, its constants (C,) and their motion.
    """
    search = problem.search
    fallback: tuple[int, FloatArray, FloatArray, SingleMotion] | None = None
    for k in map(int, found.order()):
        point = found.points[k]
        if problem.reason is None and found.worst[k] == 0.0 and not search.merit.extremes:
            point = search.polished(point)
        constants, motion = _rounded(problem, search.low + point * (search.high - search.low))
        if motion is None:
            continue
        made = k, point, constants, motion
        if _holds(search, motion):
            return made
        fallback = fallback or made
    return fallback


def _holds(search: Search, motion: SingleMotion) -> bool:
    return bool(search.merit.worst(motion.sides[None])[0] == 0.0)


def _as_before(
    problem: FitProblem, left: Undecided, constants: FloatArray, motion: SingleMotion
) -> tuple[FloatArray, SingleMotion]:
    """With the constants that nothing depends on as the script has them, where that is in their intervals."""
    job, search = problem.job, problem.search
    inside = (job.own >= search.low) & (job.own <= search.high)
    tried, moved = _rounded(problem, np.where(left.idle & inside, job.own, constants))
    return (constants, motion) if moved is None else (tried, moved)


def _rounded(problem: FitProblem, constants: FloatArray) -> tuple[FloatArray, SingleMotion | None]:
    """Constants with few digits, if that changes nothing, and their motion by the single solver; None if it is another
    than was found.
    """
    search = problem.search
    together = search.evaluate(constants[None], slopes=False).sides[0]
    short = np.array([float(f"{value:.{DIGITS}g}") for value in constants])
    for tried in (short, constants):
        motion = problem.single.motion(tried)
        if not np.isfinite(motion.sides).all():
            continue
        met = search.merit.worst(motion.sides[None])[0] <= search.merit.worst(together[None])[0]
        same = np.max(np.abs(motion.sides - together), initial=0.0) <= SOLVERS_AGREE * search.size
        if same and (met or tried is constants):
            return tried, motion
    return constants, None
