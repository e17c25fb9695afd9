"""`check`: everything that can be reported about a script without rendering it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from movimentum.diagnostics import Diagnostic, Severity, limited
from movimentum.errors import MovimentumError, UsageError
from movimentum.records import dataclass
from movimentum.settings import Advice
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.fixes import with_fixes
from movimentum.workflow.read import read
from movimentum.workflow.stages import arranged, examined, judged, moved, understand

if TYPE_CHECKING:
    from movimentum.analysis.gaps.overlaps import Overlap
    from movimentum.analysis.report import StepReport
    from movimentum.certifying.certificate import Certificate
    from movimentum.solver.motion import PathMotion


@dataclass(frozen=True, slots=True)
class CheckReport:
    """Everything that can be said without rendering; ``frames`` and ``duration`` are None if not known.
    ``certificate`` and ``gaps`` (what overlaps): where they were asked for, and the rest of the check has passed.
    """

    diagnostics: tuple[Diagnostic, ...]
    steps: Sequence[StepReport]
    frames: int | None
    duration: float | None
    exit_code: int
    certificate: Certificate | None = None
    gaps: Sequence[Overlap] | None = None


UNDECIDED = 4
"""The exit code where nothing is wrong, but not all of what was asked for is proved."""


def check(
    path: str,
    choices: Choices,
    *,
    fps_invariance: bool = False,
    reverse: bool = False,
    certify: bool = False,
    gaps: bool = False,
    all_layers: bool = False,
) -> tuple[CheckReport, SourceText]:
    """All diagnostics, with the fixes that work, and the step reports; a script's errors are reported, not raised.

    ``fps_invariance`` and ``reverse`` test promises on this script (see `analysis.invariance`); ``certify`` proves that
    its frames belong to one motion (see `certifying`); ``gaps`` looks for things that overlap, with ``all_layers`` also
    on different layers.

    Raises `UsageError` if there is no script to read.
    """
    begun = time.thread_time()
    source = SourceText("<stdin>" if path == "-" else path, "")
    frames: int | None = None
    duration: float | None = None
    try:
        source = read(path)
        timeline = arranged(understand(source, choices), choices)
        from movimentum.solver.solver_cache import SolverCache

        known = SolverCache()
        frames, duration = timeline.frame_count, float(timeline.end - timeline.start)
        solution = examined(timeline, choices, advice=Advice.FULL, path=moved(timeline, known))
    except UsageError:
        raise
    except MovimentumError as error:
        found = with_fixes(error.diagnostics, source, choices, took=time.thread_time() - begun)
        return CheckReport(found, (), frames, duration, error.exit_code), source
    took, fault = time.thread_time() - begun, solution.fault
    found = with_fixes(limited(solution.diagnostics), source, choices, took=took, known=known)
    more: list[Diagnostic] = []
    if fps_invariance and fault in (0, 3):
        more += _at_other_rate(solution.motion.path, solution.diagnostics)
    if reverse and fault == 0:
        from movimentum.analysis.invariance import reverse_diagnostics

        more += reverse_diagnostics(solution.motion.path)
    if fault == 0 and any(item.severity is Severity.ERROR for item in more):
        fault = 1
    certified: Certificate | None = None
    if certify and fault == 0:
        certified, about = _certified(solution.motion.path)
        more += about
        fault = 1 if any(item.severity is Severity.ERROR for item in about) else UNDECIDED if about else 0
    overlapping: Sequence[Overlap] | None = None
    if gaps and fault in (0, UNDECIDED):
        overlapping, gap_notes, warned = _gaps(solution.motion.path, choices, all_layers=all_layers)
        more += gap_notes
        fault = 1 if warned else fault
    found = (*found, *more)
    return CheckReport(limited(found), solution.steps, frames, duration, fault, certified, overlapping), source


def _certified(motion: PathMotion) -> tuple[Certificate, Sequence[Diagnostic]]:
    """The certificate of a film, and what is said of it."""
    from movimentum.certifying.certificate import certificate
    from movimentum.certifying.wording import certificate_diagnostics

    found = certificate(motion)
    return found, list(certificate_diagnostics(found))


def _gaps(
    motion: PathMotion, choices: Choices, *, all_layers: bool
) -> tuple[Sequence[Overlap], Sequence[Diagnostic], bool]:
    """The overlaps, their diagnostics, and whether that is an error."""
    from movimentum.analysis.gaps.overlaps import overlaps
    from movimentum.analysis.gaps.wording import overlap_diagnostics

    found = overlaps(motion, all_layers=all_layers)
    return found, *judged(overlap_diagnostics(motion.timeline.scene, found), choices)


def _at_other_rate(motion: PathMotion, diagnostics: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """Differences at another frame rate."""
    from movimentum.analysis.examine import examine
    from movimentum.analysis.invariance import at_other_rate, frame_rate_diagnostics

    other = at_other_rate(motion)
    return frame_rate_diagnostics(motion, other, diagnostics, examine(other, advice=Advice.PLAIN).diagnostics)
