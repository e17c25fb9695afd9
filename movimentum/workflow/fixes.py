"""Tries the fixes of diagnostics on the script before anybody sees them.

A fix is tried by reading, solving and examining the script with its edits. It works if its diagnostic goes away and
there is no new error. Only such fixes are ``tried``, and only these are shown as edits.

Every trial costs as much as `check` on the edited script. So fixes are tried only where somebody looks at them
(`check`, the debugger), never by `run` or `solve`. All trials together have a limit of seconds and of solver steps. A
fix beyond it stays plain text.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from enum import Enum
from typing import TYPE_CHECKING

from movimentum.cancellation import Cancelled, cancellable, look
from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.errors import MovimentumError, UsageError
from movimentum.records import dataclass, replace
from movimentum.settings import Advice
from movimentum.solver.basis.effort import EffortExceeded, limit_effort
from movimentum.source import Edit, SourceText, Span, edited, edited_place
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, moved, understand

if TYPE_CHECKING:
    from movimentum.solver.solver_cache import SolverCache

SECONDS = 5.0
"""The limit for all trials of one script, in the thread's processor time: what else the machine does has no influence.
Where solving the script took longer than that, nothing is tried.
"""
SHARE, OVERTIME = 0.3, 0.5
"""Of the time that is left: what one trial may take at first. And of the whole: how long after its end a trial that was
begun in time is given up.
"""
EFFORT = 40_000
"""The limit of linearizations for them (see `movimentum.solver.basis.effort`): the same on every machine."""
BEFORE_SOLVING = ("syntax/", "name/", "kind/", "asset/", "timeline/", "limit/", "claim/")
"""Codes of errors that keep a script from being solved: with them, nothing is known of what solving would say."""
NO_SOLUTION = ("constraint/conflict", "cord/length", "solve/unreachable", "solve/not-converged")
"""Codes of errors about times without a solution."""
_STATEMENT = re.compile(r"[;@]")


class Verdict(Enum):
    """The result of a trial. A contradicted fix does not help because other statements conflict with it."""

    WORKS = "works"
    FAILS = "fails"
    CONTRADICTED = "contradicted"
    UNKNOWN = "not tried"


def with_fixes(
    found: Sequence[Diagnostic],
    source: SourceText,
    choices: Choices,
    *,
    took: float = 0.0,
    seconds: float = SECONDS,
    known: SolverCache | None = None,
) -> tuple[Diagnostic, ...]:
    """The diagnostics of a script with those of their fixes that work, and without the helps that are contradicted.

    ``found`` are all diagnostics that `check` makes of ``source`` with these ``choices``, for which it ``took`` so many
    seconds of the thread's processor time. What is ``known`` of it from there is not solved again.
    """
    if not any(item.fixes for item in found):
        return tuple(found)
    trials = _Trials(tuple(found), source, choices, seconds, time.thread_time() + seconds, known, expected=took)
    verdicts: dict[tuple[int, int], Verdict] = {}
    tried = [(rank, place) for place, item in enumerate(found) for rank in range(len(item.fixes))]
    late: list[tuple[int, int]] = []
    for rank, place in sorted(tried):  # the likeliest of each diagnostic first, in case time runs out
        item = found[place]
        fix = item.fixes[rank]
        done = (verdicts[place, k] for k in range(rank) if item.fixes[k].title == fix.title)
        verdicts[place, rank] = Verdict.UNKNOWN if Verdict.WORKS in done else trials.verdict(item, fix)
        if trials.cut_short:
            late.append((rank, place))
    for rank, place in late:  # what would have left no time for the others
        verdicts[place, rank] = trials.verdict(found[place], found[place].fixes[rank], in_a_share=False)
    return tuple(
        _judged(item, [verdicts[place, rank] for rank in range(len(item.fixes))]) for place, item in enumerate(found)
    )


def fixed(source: SourceText, fix: Fix) -> SourceText:
    """The script with a fix made."""
    return SourceText(source.path, edited(source.text, fix.edits))


@dataclass(slots=True)
class _Trials:
    """``seconds``: for all of them, until ``deadline``; ``left``: linearizations that may still be done; ``expected``:
    how long one of a fix that works may take. ``cut_short``: the last one took more than its share of the time.
    """

    found: tuple[Diagnostic, ...]
    source: SourceText
    choices: Choices
    seconds: float
    deadline: float
    known: SolverCache | None
    left: int = EFFORT
    expected: float = 0.0
    cut_short: bool = False

    def verdict(self, item: Diagnostic, fix: Fix, *, in_a_share: bool = True) -> Verdict:
        begun = time.thread_time()
        self.cut_short = False
        if not fix.edits or begun + self.expected > self.deadline or self.left <= 0:
            return Verdict.UNKNOWN
        after = fixed(self.source, fix)
        left = [0]
        last = self.deadline + OVERTIME * self.seconds
        if in_a_share:
            last = begun + max(SHARE * (self.deadline - begun), self.expected)
        try:
            with limit_effort(self.left) as left, cancellable(lambda: time.thread_time() > last):
                found = diagnosed(after, self.choices, self.known, in_full=self._has_another_trouble(item))
        except (EffortExceeded, ArithmeticError, ValueError):
            return Verdict.UNKNOWN
        except Cancelled:
            look()  # does anybody wait at all?
            self.cut_short = in_a_share
            return Verdict.UNKNOWN
        finally:
            self.left = left[0]
        if found is None:
            return Verdict.FAILS if _before_solving(item) else Verdict.CONTRADICTED
        verdict = self._compared(item, fix, found, after)
        if verdict is Verdict.WORKS:
            self.expected = max(self.expected, time.thread_time() - begun)
        return verdict

    def _has_another_trouble(self, item: Diagnostic) -> bool:
        """Whether there may be times without a solution that have nothing to do with ``item`` (of all of them, only the
        first is reported).
        """
        return item.code not in NO_SOLUTION and any(
            other.code in NO_SOLUTION and other.severity is Severity.ERROR for other in self.found
        )

    def _compared(self, item: Diagnostic, fix: Fix, after: Sequence[Diagnostic], source: SourceText) -> Verdict:
        if _stays(item, fix, self.found, after):
            return Verdict.CONTRADICTED
        added = list(_added(self.found, after))
        if not added:
            return Verdict.WORKS
        if not _before_solving(item):  # everything was known before
            return Verdict.CONTRADICTED
        touched = [_statement_around(source.text, edit, fix.edits) for edit in fix.edits]
        near = (error.span for error in added if error.span is not None)
        own = any(place.start <= span.end and span.start <= place.end for span in near for place in touched)
        return Verdict.CONTRADICTED if own else Verdict.FAILS


def _before_solving(item: Diagnostic) -> bool:
    return item.severity is Severity.ERROR and item.code.startswith(BEFORE_SOLVING) and item.code != "claim/broken"


def _judged(item: Diagnostic, verdicts: Sequence[Verdict]) -> Diagnostic:
    """A diagnostic with the fixes that work, without the helps that the script contradicts.

    Help about spelling is right even where the edit that was guessed from it is not all that has to be done: it is left
    out only if another help works.
    """
    works = dict.fromkeys(fix.title for fix, found in zip(item.fixes, verdicts, strict=True) if found is Verdict.WORKS)
    spelling = item.code.startswith("syntax/")
    wrong: dict[str, bool] = {}
    for fix, found in zip(item.fixes, verdicts, strict=True):
        fails = found is Verdict.CONTRADICTED or (spelling and found is Verdict.FAILS)
        wrong[fix.title] = wrong.get(fix.title, True) and fails and (bool(works) or not spelling)
    kept = [replace(fix, tried=True) for fix, found in zip(item.fixes, verdicts, strict=True) if found is Verdict.WORKS]
    return replace(item, helps=tuple(text for text in item.helps if not wrong.get(text)), fixes=tuple(kept))


def diagnosed(
    source: SourceText, choices: Choices, known: SolverCache | None = None, *, in_full: bool = True
) -> tuple[Diagnostic, ...] | None:
    """Everything that `check` says about a script, nothing of it tried out; unless ``in_full``, None if there is no
    solution at some time, for finding out why takes longest.
    """
    try:
        timeline = arranged(understand(source, choices), choices)
        path = moved(timeline, known)
        if not in_full and any(segment_motion.failures for segment_motion in path.segments):
            return None
        return examined(timeline, choices, advice=Advice.PLAIN, path=path).diagnostics
    except UsageError:
        raise
    except MovimentumError as error:
        return error.diagnostics


def _stays(item: Diagnostic, fix: Fix, before: Sequence[Diagnostic], after: Sequence[Diagnostic]) -> bool:
    """Whether a diagnostic is still there: as many with its message as before, or of its code at its place."""
    if _alike(item, after) >= _alike(item, before):
        return True
    if item.span is None:
        return False
    start = Span(item.span.start, item.span.start)
    last = edited_place(start.start, fix.edits)
    first = last - sum(len(edit.text) for edit in fix.edits if edit.span == start)
    there = _starting(item.code, before, start.start, start.start)
    return _starting(item.code, after, first, last) >= there


def _alike(item: Diagnostic, found: Sequence[Diagnostic]) -> int:
    return sum((other.code, other.message) == (item.code, item.message) for other in found)


def _starting(code: str, found: Sequence[Diagnostic], first: int, last: int) -> int:
    """How many diagnostics of a code begin between two offsets."""
    places = (other.span.start for other in found if other.code == code and other.span is not None)
    return sum(first <= place <= last for place in places)


def _added(before: Sequence[Diagnostic], after: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """The errors that were not there before (their places may have moved)."""
    known = Counter((item.code, item.message) for item in before if item.severity is Severity.ERROR)
    for item in after:
        if item.severity is Severity.ERROR:
            known[item.code, item.message] -= 1
            if known[item.code, item.message] < 0:
                yield item


def _statement_around(text: str, edit: Edit, edits: Sequence[Edit]) -> Span:
    """The statement (or definition) that an edit belongs to, in the ``text`` after all ``edits``."""
    start = edited_place(edit.span.start, [other for other in edits if other.span < edit.span])
    end = start + len(edit.text)
    before = max(text.rfind(";", 0, start), text.rfind("@", 0, start)) + 1
    following = _STATEMENT.search(text, end)
    return Span(before, len(text) if following is None else following.start())
