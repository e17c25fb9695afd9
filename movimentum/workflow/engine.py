"""Answers about a script while it is being written.

An `Engine` is given one text after the other and reuses what still holds: it shifts the places of unchanged statements,
and reuses the motion of unchanged steps and the plan of an unchanged structure. The result never depends on earlier
texts: it is that of a fresh start, to the last bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from enum import StrEnum
from fractions import Fraction
from functools import cached_property
from threading import Lock
from typing import TYPE_CHECKING

from movimentum.cancellation import cancellable
from movimentum.diagnostics import Diagnostic, limited
from movimentum.errors import MovimentumError, ScriptError, script_error
from movimentum.records import dataclass
from movimentum.settings import Advice
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import ScriptFiles
from movimentum.workflow.same_statements import Items, items_of, shifted
from movimentum.workflow.stages import arranged, built, moved, off_canvas, parsed, rebuilding

if TYPE_CHECKING:
    from movimentum.analysis.examine import Examination
    from movimentum.expressions import Expr
    from movimentum.query import Query
    from movimentum.scene.model import Scene
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses
    from movimentum.solver.solver_cache import SolverCache
    from movimentum.syntax.expression_tree import Expression
    from movimentum.syntax.tree import ScriptTree
    from movimentum.timeline.model import Timeline


class Stage(StrEnum):
    """The stages of answers, in order."""

    SYNTAX = "syntax"
    SCENE = "scene"
    BEGINNING = "beginning"
    PATH = "path"
    EXAMINATION = "examination"


@dataclass(frozen=True, slots=True, eq=False)
class StageReport:
    """The results after ``stage``, for the text with number ``revision``.

    ``diagnostics``: all so far. ``poses``: after BEGINNING the pose at the instant looked at (F = 1), if one was found.
    ``final``: nothing comes after this, because all is known or because there is an error.
    """

    revision: int
    stage: Stage
    diagnostics: tuple[Diagnostic, ...]
    final: bool = False
    poses: Poses | None = None


class Engine:
    """Keeps what it has found from one text to the next. Threads may share it: the newest text wins. ``files``: makes
    what the files of a new text are read with.
    """

    def __init__(self, choices: Choices | None = None, files: Callable[[], ScriptFiles] = ScriptFiles) -> None:
        self.choices = choices or Choices()
        self.files = files
        self._lock = Lock()
        self._newest: Revision | None = None
        self._shown: PathMotion | None = None
        self._examined: tuple[Items, Examination] | None = None

    @cached_property
    def known(self) -> SolverCache:
        """Motions and plans of the last texts (the solver is imported when there is something to solve)."""
        from movimentum.solver.solver_cache import SolverCache

        return SolverCache()

    @property
    def newest(self) -> Revision | None:
        """The last text given."""
        return self._newest

    def revise(self, source: SourceText) -> Revision:
        """Take ``source`` for the text from here on; work on an older one that runs elsewhere is given up."""
        with self._lock:
            number = self._newest.number + 1 if self._newest is not None else 1
            self._newest = Revision(self, number, source)
            return self._newest

    # --- what revisions share

    def solved(self, timeline: Timeline) -> PathMotion:
        """The motion of a timeline; `ScriptError` if a derivative depends on itself."""
        self._shown = moved(timeline, self.known)
        return self._shown

    def examined(self, motion: PathMotion) -> Examination:
        """The diagnostics of a motion, without fixes (see `Revision.advice`). Of the same statements elsewhere in the
        text they are not found again.
        """
        from movimentum.analysis.examine import examine
        from movimentum.solver.basis.block_memo import use_memo

        items = items_of(motion.timeline.scene.source)
        last = self._examined
        if last is not None and last[0].same_as(items):
            return shifted(last[1], last[0], items)
        with use_memo(self.known.memory):
            found = shifted(examine(motion, drawn=off_canvas), items, items)
        self._examined = items, found
        return found

    def preview(self, timeline: Timeline, time: Fraction) -> Poses | None:
        """The poses (F = 1) at ``time`` nearest to the motion last solved; None where the path has to be awaited."""
        from movimentum.solver.basis.pose_state import as_drawn
        from movimentum.solver.preview import carried_to_scene, pose_at_rest, preview_pose

        shown = self._shown
        scene = timeline.scene
        carry = as_drawn(scene)
        if shown is not None:
            carry = carried_to_scene(pose_at_rest(shown, time), shown.timeline.scene, scene)
        return preview_pose(timeline, min(max(time, timeline.start), timeline.end), carry, self.known, shown)


class Revision:
    """One text, read and solved as far as possible; each part when it is first needed.

    ``number`` counts the texts of its engine from 1. Asking for a part that cannot be had raises `ScriptError` with the
    reasons.
    """

    def __init__(self, engine: Engine, number: int, source: SourceText) -> None:
        self.engine = engine
        self.number = number
        self.source = source
        self._advice: dict[float, tuple[Diagnostic, ...]] = {}
        self._queries: dict[tuple[str, int], Query] = {}

    @property
    def outdated(self) -> bool:
        """Whether a newer text was given."""
        return self.engine.newest is not self

    @cached_property
    def _tree(self) -> ScriptTree | MovimentumError:
        try:
            return parsed(self.source, self.engine.choices)
        except MovimentumError as error:
            return error

    @cached_property
    def _understood(self) -> tuple[Scene | None, Timeline | None, MovimentumError | None]:
        scene = None
        tree = self._tree
        if isinstance(tree, MovimentumError):
            return None, None, tree
        try:
            scene = built(tree, self.source, self.engine.choices, files=self.engine.files())
            timeline = arranged(scene, self.engine.choices)
        except MovimentumError as error:
            return scene, None, error
        return scene, timeline, None

    @property
    def scene(self) -> Scene:
        """The scene."""
        scene, _, error = self._understood
        if scene is None:
            assert error is not None
            raise error
        return scene

    @property
    def timeline(self) -> Timeline:
        """The scene in time."""
        _, timeline, error = self._understood
        if timeline is None:
            assert error is not None
            raise error
        return timeline

    @property
    def moves(self) -> bool:
        """Whether the script is understood."""
        return self._understood[1] is not None

    @cached_property
    def _solved(self) -> PathMotion | MovimentumError:
        try:
            return self.engine.solved(self.timeline)
        except MovimentumError as error:
            return error

    @property
    def motion(self) -> PathMotion:
        """The motion, as far as there is one."""
        solved = self._solved
        if isinstance(solved, MovimentumError):
            raise solved
        return solved

    @cached_property
    def examination(self) -> Examination:
        """The diagnostics of the motion."""
        return self.engine.examined(self.motion)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Everything that `check` would report."""
        scene, timeline, error = self._understood
        if error is not None or scene is None or timeline is None:
            return () if error is None else error.diagnostics
        solved = self._solved
        if isinstance(solved, MovimentumError):
            return solved.diagnostics
        return (*scene.diagnostics, *self.examination.diagnostics)

    def advice(self, seconds: float) -> tuple[Diagnostic, ...]:
        """The diagnostics with the fixes that work, which are tried for so many ``seconds`` at most."""
        if seconds not in self._advice:
            self._advice[seconds] = self._advised(seconds)
        return self._advice[seconds]

    def _advised(self, seconds: float) -> tuple[Diagnostic, ...]:
        from movimentum.analysis.examine import examine
        from movimentum.solver.basis.block_memo import use_memo
        from movimentum.workflow.fixes import with_fixes

        begun = time.thread_time()
        known = self.engine.known
        try:
            motion = self.motion
            with use_memo(known.memory):
                found = (*self.scene.diagnostics, *examine(motion, advice=Advice.FULL, drawn=off_canvas).diagnostics)
        except MovimentumError as error:
            found = error.diagnostics
        took = time.thread_time() - begun
        return with_fixes(limited(found), self.source, self.engine.choices, took=took, seconds=seconds, known=known)

    def preview(self, time: Fraction) -> Poses | None:
        """The poses (F = 1) at ``time`` before the path is known, all constraints satisfied; None where the path has to
        be awaited.
        """
        return self.engine.preview(self.timeline, time)

    def expressions(self, text: str, step: int) -> tuple[Expr, ...]:
        """The components of the expression ``text``, as it is understood in step number ``step``.

        `ScriptError` (``query/expression``) for what is no expression with a value, and with the code
        `query.NOT_A_READING` for one that has to be solved for.
        """
        from movimentum.query import understood

        return understood(_typed(text), step, rebuilding(self.source, self.engine.choices))

    def query(self, text: str, step: int) -> Query:
        """The value of the expression ``text``, as it is understood in step number ``step``, which is solved for if it
        has to be; `ScriptError` for what is no expression with a value.
        """
        from movimentum.query import NOT_A_READING, make_query, solved_query

        known = self._queries.get((text, step))
        if known is not None:
            return known
        try:
            found = make_query(self.scene, text, self.expressions(text, step))
            if found.goes_round:
                found = found.along(self.motion)
        except ScriptError as error:
            if error.diagnostics[0].code != NOT_A_READING:
                raise
            again = rebuilding(self.source, self.engine.choices)
            found = solved_query(text, self.scene, _typed(text), step, again, moved)
        self._queries[text, step] = found
        return found

    def reports(self, time: Fraction | None = None) -> Iterator[StageReport]:
        """The answers, stage by stage, the instant ``time`` first (default: the beginning).

        Raises `cancellation.Cancelled` as soon as a newer text is given.
        """
        for stage in Stage:
            with cancellable(lambda: self.outdated):
                report = self._after(stage, time)
            yield report
            if report.final:
                return

    def _after(self, stage: Stage, time: Fraction | None) -> StageReport:
        if stage is Stage.SYNTAX:
            wrong = self._tree if isinstance(self._tree, MovimentumError) else None
            return StageReport(self.number, stage, wrong.diagnostics if wrong else (), final=wrong is not None)
        scene, timeline, error = self._understood
        if error is not None or scene is None or timeline is None:
            return StageReport(self.number, stage, error.diagnostics if error else (), final=True)
        if stage is Stage.SCENE:
            return StageReport(self.number, stage, scene.diagnostics)
        if stage is Stage.BEGINNING:
            poses = self.preview(timeline.start if time is None else time)
            return StageReport(self.number, stage, scene.diagnostics, poses=poses)
        solved = self._solved
        if isinstance(solved, MovimentumError):
            return StageReport(self.number, stage, solved.diagnostics, final=True)
        if stage is Stage.PATH:
            return StageReport(self.number, stage, scene.diagnostics)
        return StageReport(self.number, stage, self.diagnostics, final=True)


def _typed(text: str) -> Expression:
    """The expression that somebody has typed."""
    from movimentum.query import parsed_statement
    from movimentum.syntax.expression_tree import Blank, postorder

    statement = parsed_statement(f"{text} = 0;", text)
    if statement is None:
        raise script_error("query/expression", f"`{text.strip()}` is not a single expression or condition")
    if any(isinstance(node, Blank) for node in postorder(statement.left)):
        raise script_error("query/expression", "`_` is any value, so there is none to show")
    return statement.left
