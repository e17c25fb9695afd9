"""Free motion and variables that nothing determines, reported with a statement that would determine them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from movimentum.analysis.diagnose.places import span_of_blocks
from movimentum.analysis.diagnose.trials import Trials, first_that_works
from movimentum.analysis.freedom.degrees import BlockRank
from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.planning.blocks.kinds import Pushing
from movimentum.scene.model import Relation, Scene, VariableComponent
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.source import Span
from movimentum.text import time_text

if TYPE_CHECKING:
    from movimentum.analysis.freedom.motions import FreeMotion


def free_motions(trials: Trials, index: int, ranks: Sequence[BlockRank]) -> Iterator[Diagnostic]:
    """A warning for each free motion of segment number ``index`` that no wish draws, and that nothing pushes."""
    segment_motion = trials.motion.segments[index]
    freedom = sum(rank.freedom for rank in ranks)
    for rank in ranks:
        if isinstance(segment_motion.plan.blocks[rank.block], Pushing):
            continue
        for motion in rank.motions:
            if motion.drawn:
                continue
            meant = meant_names(segment_motion.plan.system.scene, motion)
            statement = None if meant else first_that_works(trials, index, motion.holds, freedom)
            yield Diagnostic(
                code="constraint/free-motion",
                severity=Severity.WARNING,
                message=f"{motion.words}; it moves as little as it can",
                span=_where(segment_motion, rank, motion),
                notes=(f"from t = {time_text(float(segment_motion.segment.start))} on",)
                if segment_motion.segment.number
                else (),
            ).advised(*(meant or (_given(segment_motion, motion, statement),)))


def _given(segment_motion: SegmentMotion, motion: FreeMotion, statement: str | None) -> str | Fix:
    from movimentum.analysis.freedom.motions import remedy
    from movimentum.scene.text_edits import added

    title = remedy(motion, statement)
    if statement is None:
        return title
    return Fix(title, (added(segment_motion.plan.system.scene, segment_motion.segment.step, statement),))


def meant_names(scene: Scene, motion: FreeMotion) -> tuple[Fix, ...]:
    """Help for variables whose names are probably another name, if nothing determines them."""
    from movimentum.scene.text_edits import name_meant, renamed

    return tuple(
        Fix(
            f"`{name}` is an ordinary variable, and nothing determines it: did you mean `{other}`?",
            renamed(scene, name, other),
        )
        for name in motion.variables
        if (other := name_meant(scene, name)) is not None
    )


def unstated_names(motion: PathMotion, found: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """A warning for each variable that nothing determines and whose name is like a clock's, or nearly that of a
    constant or of another variable, unless a diagnostic in ``found`` already asks about it. It is probably the cause of
    them.

    Where there is no solution, a variable counts that no statement is about (but for `s`, which is a usual name).
    """
    from movimentum.scene.text_edits import name_meant, renamed

    scene = motion.timeline.scene
    loose = _loose(motion)
    unsolved = any(segment_motion.troubles for segment_motion in motion.segments)
    asked = "\n".join(text for item in found for text in item.helps)
    stated = {item.key for item in scene.constraints() if item.relation is Relation.EQUAL}
    for name, variable in scene.variables.items():
        if name in stated or not (name in loose or (unsolved and name != "s")):
            continue
        other = name_meant(scene, name)
        if other is None or f"`{name}` is an ordinary variable" in asked:
            continue
        yield Diagnostic(
            code="name/clock" if other.startswith(".") else "name/near",
            severity=Severity.WARNING,
            message=f"`{name}` is an ordinary variable, and no statement says what it is",
            span=variable.span,
        ).advised(Fix(f"did you mean `{other}`?", renamed(scene, name, other)))


def _loose(motion: PathMotion) -> set[str]:
    """The variables that a free motion changes."""
    found: set[str] = set()
    for segment_motion in motion.segments:
        unknowns = segment_motion.plan.system.unknowns
        moved: set[int] = set()
        for block in segment_motion.plan.blocks:
            if block.free or moved & set(block.inputs):
                moved |= set(block.unknowns)
        found |= {payload.name for n in moved if isinstance(payload := unknowns[n].payload, VariableComponent)}
    return found


def _where(segment_motion: SegmentMotion, rank: BlockRank, motion: FreeMotion) -> Span | None:
    """Where a thing is defined, or else a variable last stated, or else first used."""
    scene = segment_motion.plan.system.scene
    if motion.things:
        return scene.things[motion.things[0]].name_span
    used = scene.variables.get(motion.variables[0].split(".")[0]) if motion.variables else None
    return span_of_blocks(segment_motion, (rank.block,)) or (used.span if used is not None else None)
