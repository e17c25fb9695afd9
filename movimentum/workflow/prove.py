"""`prove`: the verdict on each claim, beyond the film."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Hashable, Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from movimentum.diagnostics import Severity
from movimentum.errors import MovimentumError, NoSolutionError, ScriptError
from movimentum.expressions import Expr, symbol
from movimentum.records import dataclass, replace
from movimentum.scene.model import Claim
from movimentum.settings import Advice
from movimentum.tolerances import BESIDE_CONSTANT, CLAIM_MET
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, moved, plain_numbers, rebuilding, understand

if TYPE_CHECKING:
    from movimentum.proving.verdicts import Judgement
    from movimentum.scene.model import Scene
    from movimentum.solver.motion import PathMotion
    from movimentum.source import SourceText
    from movimentum.timeline.model import TimedClaim
    from movimentum.workflow.inspector import Inspector

LITTLE = 300_000
"""Products of terms that a proof may take in the background."""
LEAST_S = 0.05
"""The least time that a claim gets."""


@dataclass(frozen=True, slots=True)
class Open:
    """A constant that is left open, as a symbol of expressions."""

    name: str


def proofs(
    source: SourceText, choices: Choices, seconds: float, *, all_lengths: bool = False, accelerated: bool | None = None
) -> tuple[Iterator[Judgement], Sequence[str]]:
    """The claims' verdicts, one after the other within about so many ``seconds`` of computing in all (a busy machine
    gives the same ones, later), and the names of the constants that are left open (for ``all_lengths``).

    Raises `ScriptError` or `NoSolutionError` where there is no film to start from.
    """
    end = time.process_time() + seconds
    scene = understand(source, choices)
    given: dict[Hashable, Fraction] = {}
    motion = _motion(scene, choices)
    if all_lengths and motion.timeline.claims:
        settings = _open(scene, source, choices)
        beside = _beside(source, choices, settings)
        if beside is not None:
            motion = beside
            given = {Open(name): Fraction(repr(value.value)) for name, value in settings}
    names = [each.name for each in given if isinstance(each, Open)]
    return _judgements(motion, given, end, accelerated), names


def _motion(scene: Scene, choices: Choices) -> PathMotion:
    """The film; an error that is not about a claim is raised."""
    timeline = arranged(scene, choices)
    solution = examined(timeline, choices, advice=Advice.PLAIN, path=moved(timeline))
    faults = [item for item in solution.diagnostics if item.severity is Severity.ERROR and item.code != "claim/broken"]
    if faults:
        kind = NoSolutionError if any(item.code.startswith("solve/") for item in faults) else ScriptError
        raise kind([item for item in solution.diagnostics if item.code != "claim/broken"])
    return solution.motion.path


def proof(asked: Inspector, text: str, seconds: float) -> Judgement | None:
    """The verdict on a claim ``e = f`` that somebody types, from the step of the instant on; None where ``text`` is no
    single equation or inequality. Raises `ScriptError` for what makes no sense.
    """
    from movimentum.query import parsed_statement
    from movimentum.syntax.expression_tree import Comparison
    from movimentum.syntax.tree import ClaimStatement

    statement = parsed_statement(f"{text.strip().removesuffix(';')};", text)
    if statement is None or statement.comparison is Comparison.WISH:
        return None
    stated = ClaimStatement(statement.left, statement.comparison, statement.right, span=statement.span)
    timeline = rebuilding(asked.work.source, asked.work.engine.choices)((asked.step, stated))
    claims = [item for item in timeline.scene.steps[asked.step].claims if isinstance(item, Claim)]
    timed = [item for item in timeline.claims if claims and item.claim.number == claims[-1].number]
    end = time.process_time() + seconds
    return next(_judgements(asked.work.motion, {}, end, None, timed), None)


def verdicts(motion: PathMotion) -> dict[int, Judgement]:
    """The verdicts on the claims of a motion, by number, as far as little work tells (see `cancellation`)."""
    from movimentum.proving.prove import Prover

    broken = breaks(motion, None)
    prover = Prover(motion, most=LITTLE)
    return {one.timed_claim.claim.number: one for one in prover.judgements(broken, lambda work: work())}


def breaks(motion: PathMotion, claims: Sequence[TimedClaim] | None) -> dict[int, tuple[float, float]]:
    """The claims (all, or these) that a film breaks, by number: when they are off most, and by how much."""
    from movimentum.analysis.diagnose.claims import broken_claims

    broken: dict[int, tuple[float, float]] = {}
    for found in broken_claims(motion, claims):
        if found.worst > CLAIM_MET * max(map(abs, (*found.left, *found.right))):  # more than rounding of large numbers
            broken[found.claim.number] = found.worst_time, found.worst
    return broken


def _judgements(
    motion: PathMotion,
    given: dict[Hashable, Fraction],
    end: float,
    accelerated: bool | None,
    claims: Sequence[TimedClaim] | None = None,
) -> Iterator[Judgement]:
    from movimentum.analysis.interactive.deadline import within
    from movimentum.proving.prove import Prover

    def in_time(work: Callable[[], Judgement]) -> Judgement | None:
        return within(max(end - time.process_time(), LEAST_S), work, time.process_time)

    yield from Prover(motion, accelerated, given).judgements(breaks(motion, claims), in_time, claims)


def _open(scene: Scene, source: SourceText, choices: Choices) -> list[tuple[str, Expr]]:
    """The constants that are plain numbers and may have others, each a little beside its own."""
    found: list[tuple[str, Expr]] = []
    for constant, value in plain_numbers(scene, choices):
        number = value * (1.0 + BESIDE_CONSTANT * (math.sqrt(2.0 + len(found)) % 1.0 + 0.1))
        open_one = Expr("const", (), number, symbol(Open(constant.name)))
        try:
            understand(source, replace(choices, settings=(*choices.settings, (constant.name, open_one))))
        except MovimentumError:
            continue  # a number of copies, say
        found.append((constant.name, open_one))
    return found


def _beside(source: SourceText, choices: Choices, settings: list[tuple[str, Expr]]) -> PathMotion | None:
    """The film with these constants; those without which there is none are taken out of ``settings``."""
    while settings:
        try:
            return _motion(understand(source, replace(choices, settings=(*choices.settings, *settings))), choices)
        except MovimentumError:
            settings.pop()
    return None
