"""`solve`: all positions as a table."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.errors import usage_error
from movimentum.settings import FailurePolicy
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices, FrameChoice, Outcome, Progress
from movimentum.workflow.frames import PoseChunks, chosen_frames
from movimentum.workflow.read import reads
from movimentum.workflow.stages import Solution, afterwards, arranged, solved, understand

if TYPE_CHECKING:
    from movimentum.solver.poses import Poses


def tabulate(
    source: SourceText,
    target: Path | None,
    choices: Choices,
    frames: FrameChoice | None,
    progress: Progress,
    solution: Solution | None = None,
) -> Outcome:
    """Write the poses to ``target`` (None: CSV on stdout). ``solution``: where it has been solved already.

    Raises `UsageError` for more digits than ``choices`` allow (``limit/digits``), before anything is read.
    """
    from movimentum.analysis.diagnose.undetermined import CODE, variables_never_valued
    from movimentum.interop import tables
    from movimentum.output.files import refuse_overwriting, refuse_unwritable, standard_output, whole_file

    if choices.digits is not None and choices.digits > choices.max_digits:
        message = f"{choices.digits:,} digits are more than the limit of {choices.max_digits:,}"
        raise usage_error(
            "limit/digits", message, Advised("`", Choose.MAX_DIGITS.to(choices.digits), "` raises the limit")
        )
    if target is not None:
        refuse_unwritable(target)
    timeline = arranged(understand(source, choices), choices) if solution is None else solution.motion.timeline
    if target is not None:
        refuse_overwriting(target, reads(source, timeline.scene))
    start, stop = chosen_frames(timeline, frames)
    solution = solution or solved(timeline, choices)
    motion = solution.motion
    without = variables_never_valued(motion.path)

    def chunks() -> Iterator[Poses]:
        for poses in PoseChunks(motion, range(start, stop), choices.on_failure is FailurePolicy.SKIP):
            yield poses
            if len(poses.frames):
                progress(int(poses.frames[-1]) + 1 - start, stop - start)

    if target is None:
        rows = tables.write_csv(timeline.scene, chunks(), standard_output(), without)
        diagnostics, notes = afterwards(solution, choices)
    else:
        with whole_file(target) as part:
            rows = tables.write(timeline.scene, chunks(), part, target.suffix, without)
            diagnostics, notes = afterwards(solution, choices)
    filled = tuple(item for item in diagnostics if item.code == CODE)  # the table shows something else: report it
    return Outcome(rows, solution.fault, diagnostics, (*notes, *filled))
