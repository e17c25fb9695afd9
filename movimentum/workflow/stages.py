"""The stages in order, from a script to a motion and its diagnostics."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from movimentum.diagnostics import Diagnostic, Severity, real
from movimentum.errors import NoSolutionError, ScriptError
from movimentum.records import dataclass, replace
from movimentum.settings import Accuracy, Advice, FailurePolicy
from movimentum.text import is_plain, rational
from movimentum.workflow.choices import MAX_PIXELS, Choices

if TYPE_CHECKING:
    from movimentum.analysis.report import StepReport
    from movimentum.query import Rebuild
    from movimentum.scene.cutting import CutJob, CutProfile
    from movimentum.scene.expansion.product import NamedConstant
    from movimentum.scene.model import Scene
    from movimentum.solver.motion import MotionOfAnyAccuracy, PathMotion
    from movimentum.solver.solver_cache import SolverCache
    from movimentum.source import SourceText
    from movimentum.syntax.tree import ClaimStatement, ScriptTree, Statement
    from movimentum.timeline.model import Timeline
    from movimentum.workflow.read import ScriptFiles


def understand(
    source: SourceText,
    choices: Choices | None = None,
    max_pixels: int = MAX_PIXELS,
    files: ScriptFiles | None = None,
) -> Scene:
    """Parse and resolve a script (see `built`); raises `ScriptError` with all its errors."""
    choices = choices or Choices()
    return built(parsed(source, choices), source, choices, max_pixels, files=files)


def parsed(source: SourceText, choices: Choices) -> ScriptTree:
    """The syntax tree of a script; raises `ScriptError` with all syntax errors, or with one that names `import` for
    another program's file.
    """
    from movimentum.syntax.parser import parse

    try:
        return parse(source, max_nesting=choices.max_nesting, max_operations=choices.max_operations)
    except ScriptError as error:
        from movimentum.interop.recognised import not_a_script

        found = not_a_script(source)
        raise ScriptError([found] if found is not None else error.diagnostics) from error


def built(
    script: ScriptTree,
    source: SourceText,
    choices: Choices,
    max_pixels: int = MAX_PIXELS,
    added: Sequence[tuple[int, Statement | ClaimStatement]] = (),
    files: ScriptFiles | None = None,
) -> Scene:
    """Resolve a parsed script, with ``added`` statements (see `scene.build`) and what is known of its ``files``; raises
    `ScriptError` with all its errors, and `UsageError` for a constant that ``choices`` set and that there is not.
    """
    from movimentum.scene.build import build
    from movimentum.workflow.read import ScriptFiles

    files = files or ScriptFiles()
    return build(
        script,
        source,
        files.image_size,
        max_pixels=max_pixels,
        element=files.element_centre,
        read_text=files.text,
        settings=dict(choices.settings),
        added=added,
        read_table=files.table,
        carve=_carved,
    )


def _carved(scene: Callable[[], Scene], jobs: Sequence[CutJob]) -> Sequence[CutProfile]:
    """See `solver.carving`, which few scripts need."""
    from movimentum.solver.carving import carve

    return carve(scene, jobs)


def plain_numbers(scene: Scene, choices: Choices) -> Iterator[tuple[NamedConstant, float]]:
    """The constants that are plain numbers but 0 and are not set by ``choices``, with their values."""
    set_already = {name for name, _ in choices.settings}
    for constant in scene.constants:
        value = rational(scene.source.text[constant.expression.start : constant.expression.end].strip())
        if value and len(constant.value) == 1 and constant.name not in set_already:
            yield constant, float(value)


def rebuilding(source: SourceText, choices: Choices, files: ScriptFiles | None = None) -> Rebuild:
    """Reads the script again with one more statement, for a query that somebody types (`query.understood`)."""
    script = source.script

    def rebuild(added: tuple[int, Statement | ClaimStatement]) -> Timeline:
        return arranged(built(parsed(script, choices), script, choices, added=(added,), files=files), choices)

    return rebuild


@contextmanager
def errors_in_files(scene: Scene) -> Generator[None]:
    """Errors are at places in the script's files."""
    try:
        yield
    except ScriptError as error:
        raise ScriptError([real(item, scene.source) for item in error.diagnostics]) from error


def arranged(scene: Scene, choices: Choices) -> Timeline:
    """The scene in time; raises `ScriptError` if that makes more frames than ``choices`` allow."""
    from movimentum.timeline.arrange import arrange

    with errors_in_files(scene):
        return arrange(scene, fps=choices.fps, max_frames=choices.max_frames)


def moved(timeline: Timeline, known: SolverCache | None = None, *, resumes: bool = True) -> PathMotion:
    """The motion, as far as there is one; `ScriptError` for a derivative that nothing tells. What is ``known`` from
    other timelines is not solved again. Unless it ``resumes``, nothing is looked for behind the first failure.
    """
    from movimentum.planning.structure.rates import RateError
    from movimentum.solver.solver import solve

    try:
        return solve(timeline, known=known, resumes=resumes)
    except RateError as error:
        from movimentum.analysis.diagnose.undetermined import rate_diagnostic

        found = real(rate_diagnostic(timeline.scene, error), timeline.scene.source)
        raise ScriptError([*timeline.scene.diagnostics, found]) from error


@dataclass(frozen=True, slots=True)
class Solution:
    """A motion, all its diagnostics (the scene's warnings first), and a report for each step.

    ``fault`` is the exit code for it as it is: 0, 1 (it contradicts itself, or warnings with ``strict``) or 3 (no
    solution at some time).
    """

    motion: MotionOfAnyAccuracy
    diagnostics: tuple[Diagnostic, ...]
    steps: Sequence[StepReport]
    fault: int


def examined(
    timeline: Timeline, choices: Choices, *, advice: Advice = Advice.TRIED, path: PathMotion | None = None
) -> Solution:
    """The motion with its errors reported, not raised; `ScriptError` only if there is nothing to solve. ``path``: the
    motion, if it is known already (see `moved`).
    """
    from movimentum.analysis.examine import examine

    before = timeline.scene.diagnostics
    path = moved(timeline) if path is None else path
    motion: MotionOfAnyAccuracy = path
    examined_path, every_frame = path, True
    if choices.accuracy is Accuracy.DRAFT:
        from movimentum.solver.accuracy.draft import DraftMotion, interpolated_motion

        motion = interpolated_motion(path)
        if isinstance(motion, DraftMotion):  # it reports its own error
            examined_path, every_frame = motion.interpolated, False
    examination = examine(examined_path, every_frame=every_frame, advice=advice, drawn=off_canvas)
    found, warned = judged((*before, *_lettering(timeline.scene), *examination.diagnostics), choices)
    fault = examination.fault or (1 if warned else 0)
    if examination.doubted:
        motion = path = replace(path, uncertain=True)
    if choices.accuracy in (Accuracy.HIGH, Accuracy.EXACT):
        from movimentum.solver.accuracy.refinement import refine

        motion = refine(path, choices.accuracy, choices.digits)
    return Solution(motion, found, examination.steps, fault)


def off_canvas(motion: PathMotion) -> Iterator[Diagnostic]:
    """See `rendering.off_canvas`, which is needed only where the script gives the canvas a size."""
    if motion.timeline.scene.config.size is not None:
        from movimentum.rendering.off_canvas import leaving

        yield from leaving(motion)


def _lettering(scene: Scene) -> tuple[Diagnostic, ...]:
    """The diagnostics of labels with more than plain letters (others need no import)."""
    labels = [thing for thing in scene.things if thing.text is not None and not is_plain(thing.text)]
    if not labels:
        return ()
    from movimentum.rendering.text import lettering

    return tuple(real(item, scene.source) for item in lettering(labels))


def solved(timeline: Timeline, choices: Choices, known: SolverCache | None = None) -> Solution:
    """The motion, if ``on_failure`` accepts it; otherwise `ScriptError` or `NoSolutionError` with all diagnostics.
    ``known``: see `moved`.
    """
    solution = examined(timeline, choices, path=moved(timeline, known))
    if solution.fault == 1:
        raise ScriptError(solution.diagnostics)
    if solution.fault and choices.on_failure is FailurePolicy.STOP:
        raise NoSolutionError(solution.diagnostics)
    return solution


def afterwards(solution: Solution, choices: Choices) -> tuple[tuple[Diagnostic, ...], tuple[Diagnostic, ...]]:
    """The messages when the frames have been computed: (diagnostics, notes); `ScriptError` for warnings with
    ``strict``.
    """
    said = solution.motion.notes
    source = solution.motion.timeline.scene.source
    warnings = [real(item, source) for item in said if item.severity is not Severity.NOTE]
    diagnostics, warned = judged((*solution.diagnostics, *warnings), choices)
    if warned:
        raise ScriptError(diagnostics)
    return diagnostics, tuple(item for item in said if item.severity is Severity.NOTE)


def judged(diagnostics: Iterable[Diagnostic], choices: Choices) -> tuple[tuple[Diagnostic, ...], bool]:
    """With ``strict``, the diagnostics with warnings turned into errors, and whether there was one."""
    found = tuple(diagnostics)
    warned = choices.strict and any(item.severity is Severity.WARNING for item in found)
    if warned:
        found = tuple(
            replace(item, severity=Severity.ERROR) if item.severity is Severity.WARNING else item for item in found
        )
    return found, warned
