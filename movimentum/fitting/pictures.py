"""Before and after a fit, side by side."""

from __future__ import annotations

import tempfile
from pathlib import Path

from movimentum.fitting.fit import Fitted
from movimentum.output.files import whole_file
from movimentum.rendering.small_multiples import SheetCell, write_small_multiples
from movimentum.variants.sheet import drawn


def write_before_and_after(fitted: Fitted, target: Path) -> None:
    """A picture of the script as it was and as it is now, in the last frame, with all of its traces; what does not move
    has a red frame.
    """
    timeline = fitted.problem.lowered.timeline
    end = timeline.frame_time(timeline.frame_count - 1)
    names, variants = fitted.problem.job.names, fitted.problem.single.variants
    rows = (("before", fitted.before, fitted.first), ("after", fitted.after, fitted.last))
    with tempfile.TemporaryDirectory() as folder, whole_file(target) as part:
        cells: list[SheetCell] = []
        for title, constants, motion in rows:
            values = dict(zip(names, constants.tolist(), strict=True))
            picture = Path(folder) / f"{title}.png"
            shown = picture if drawn(variants, values, picture, end) else None
            cells.append(SheetCell(shown, title, not motion.outcome.moves))
        write_small_multiples(cells, 2, part)
