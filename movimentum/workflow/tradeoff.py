"""`trade`: the costs and gains of accuracy for a script."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.terminal import visible
from movimentum.workflow.choices import MAX_PIXELS, Choices, Outcome, Progress
from movimentum.workflow.frames import PoseChunks
from movimentum.workflow.read import reads
from movimentum.workflow.stages import arranged, solved, understand

if TYPE_CHECKING:
    from movimentum.tradeoff.tiers import PictureTrade, SolverTrade


@dataclass(frozen=True, slots=True)
class TradeReport:
    """The costs and gains of accuracy on one script: for the solver, for drawing, and for more frames per time unit.

    ``rates``: (frames per time unit, the largest distance that an anchor moves from one frame to the next, in pixels).
    """

    solver: SolverTrade
    pictures: PictureTrade
    rates: tuple[tuple[Fraction, float], ...]


TRADE_PICTURES = 4
"""Frames that are drawn in every way."""


def trade(
    source: SourceText, target: Path | None, choices: Choices, progress: Progress, max_pixels: int = MAX_PIXELS
) -> tuple[TradeReport, Outcome]:
    """Measure the trade between time and accuracy on a script, and plot it to ``target`` (`.png` or `.svg`).

    Raises as `solved` does: only a script with a solution can be measured.
    """
    from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file
    from movimentum.solver.accuracy.refinement import DEFAULT_DIGITS
    from movimentum.tradeoff.tiers import measure_pictures, measure_rate, measure_tiers

    if target is not None:
        refuse_unwritable(target)
    timeline = arranged(understand(source, choices, max_pixels), choices)
    if target is not None:
        refuse_overwriting(target, reads(source, timeline.scene))
    solution = solved(timeline, choices)
    count = timeline.frame_count
    tiers = measure_tiers(timeline, choices.digits or DEFAULT_DIGITS, progress)
    every = PoseChunks(solution.motion, range(count), False, drawn=True)
    places = sorted({round(k * (count - 1) / max(1, TRADE_PICTURES - 1)) for k in range(TRADE_PICTURES)})
    some = solution.motion.poses_at([timeline.frame_time(place) for place in places])
    pictures = measure_pictures(timeline.scene, every, some, progress)
    rates = tuple((timeline.fps * k / 2, measure_rate(solution.motion, timeline.fps * k / 2)) for k in (1, 2, 4))
    report = TradeReport(tiers, pictures, rates)
    if target is not None:
        from movimentum.encoding.plot import write_plot
        from movimentum.tradeoff.report import panels

        with whole_file(target) as part:
            write_plot(panels(visible(source.path), report.solver, report.pictures), part, target.suffix)
    return report, Outcome(count, solution.fault, solution.diagnostics)
