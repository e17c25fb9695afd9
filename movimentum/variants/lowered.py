"""Measures as expressions of a script's scene, lowered once for all variants of one structure."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.errors import MovimentumError, UsageError
from movimentum.expressions import Expr, symbols
from movimentum.query import parsed_statement, understood
from movimentum.records import dataclass
from movimentum.scene.model import Relation
from movimentum.source import SourceText
from movimentum.syntax.expression_tree import Constant, Expression, Name, children, rebuilt
from movimentum.text import counted, time_text
from movimentum.timeline.model import TimedClaim, Timeline
from movimentum.tolerances import CLAIM_WITHIN
from movimentum.variants.measures import (
    PLACE,
    MeasureSet,
    ReducedPart,
    Reduction,
    as_usage_error,
    example,
    reduced,
    wrong,
)
from movimentum.variants.tracing import OriginUnfolding, Reduced, Varied, generic, numbered, places_from, traced
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import ScriptFiles
from movimentum.workflow.stages import rebuilding

if TYPE_CHECKING:
    from movimentum.query import Reader


@dataclass(frozen=True, slots=True, eq=False)
class LoweredMeasures:
    """``inner``: for each reduction the expression that it reduces (None for a claim's margin), in symbols of the scene
    and of the varied constants. ``outer``: each measure, in symbols of reductions and varied constants. ``claims`` are
    the script's own, with both sides unfolded.
    """

    measures: MeasureSet
    inner: tuple[Expr | None, ...]
    outer: tuple[Expr, ...]
    claims: tuple[tuple[TimedClaim, tuple[Expr, ...], tuple[Expr, ...]], ...]
    timeline: Timeline

    @property
    def read(self) -> tuple[Expr, ...]:
        """All expressions that have to be read off a motion: those of reductions, then both sides of claims."""
        sides = (side for _, left, right in self._claims_read for side in (*left, *right))
        return (*(each for each in self.inner if each is not None), *sides)

    @property
    def _claims_read(self) -> Sequence[tuple[TimedClaim, tuple[Expr, ...], tuple[Expr, ...]]]:
        return self.claims if any(part.kind is Reduction.MARGIN for part in self.measures.parts) else ()

    def values(
        self,
        read: Sequence[FloatArray],
        at: Sequence[FloatArray],
        varied: Mapping[str, FloatArray],
        size: FloatArray,
    ) -> FloatArray:
        """(measures, V) the measures of V variants.

        ``read``: the expressions `read` in all frames, each (V, F); ``at`` the same (V, T) at `MeasureSet.times`;
        ``varied``: (V,) each; ``size`` (V,) the scene's.
        """
        from movimentum.planning.codegen.generate import Clocks, compiled

        margins = self._margins(read, size)
        numbers: list[FloatArray] = []
        place = 0
        with np.errstate(all="ignore"):
            for part in self.measures.parts:
                if part.kind is Reduction.MARGIN:
                    chosen = margins if part.claim is None else margins[part.claim : part.claim + 1]
                    numbers.append(np.min(chosen, axis=0))
                    continue
                if part.time is not None:
                    numbers.append(at[place][:, self.measures.times.index(part.time)])
                else:
                    numbers.append(reduced(part.kind, read[place]))
                place += 1
            count = len(size)
            inputs: dict[Hashable, int] = {Reduced(k): k for k in range(len(numbers))}
            inputs |= places_from(len(numbers), list(varied))
            found = compiled([numbered(each, inputs) for each in self.outer], Clocks())(
                [*numbers, *varied.values()], []
            )
        return np.array([np.broadcast_to(value, count) for value in found]).reshape(len(self.outer), count) + 0.0

    def _margins(self, read: Sequence[FloatArray], size: FloatArray) -> FloatArray:
        """(claims, V) how far each claim is from failing, over the frames in which it holds; below 0 where it fails."""
        from movimentum.analysis.diagnose.claims import claim_errors

        result: list[FloatArray] = []
        place = sum(each is not None for each in self.inner)
        for timed, left, right in self._claims_read:
            count = len(left) + len(right)
            values, place = read[place : place + count], place + count
            claim = timed.claim
            inside = self.timeline.frames_under(timed)
            given = claim.tolerance
            allowed = np.zeros_like(size) if claim.relation is not Relation.EQUAL else CLAIM_WITHIN * size
            allowed = allowed if given is None else np.full_like(size, float(given))
            with np.errstate(all="ignore"):
                room = allowed[:, None] - claim_errors(claim, values)
            room = np.broadcast_to(room, (len(size), self.timeline.frame_count))[:, inside]
            result.append(np.min(room, axis=1) if room.shape[1] else np.full(len(size), np.nan))
        return np.array(result)


def lower_measures(
    measures: MeasureSet, source: SourceText, choices: Choices, timeline: Timeline, files: ScriptFiles | None = None
) -> LoweredMeasures:
    """What ``measures`` mean in a script that was read with ``choices`` and what is known of its ``files``;
    `UsageError` where they mean nothing.
    """
    unfolding = OriginUnfolding()
    lowering = _Lowering(measures, source, choices, timeline, unfolding, files)
    inner = tuple(lowering.inner(part) for part in measures.parts)
    outer = tuple(lowering.outer(measure.outer, measure.text) for measure in measures.measures)
    claims = tuple(
        (timed, tuple(map(unfolding.unfolded, timed.claim.left)), tuple(map(unfolding.unfolded, timed.claim.right)))
        for timed in timeline.claims
    )
    return LoweredMeasures(measures, inner, outer, claims, timeline)


@dataclass(frozen=True, eq=False)
class _Lowering:
    measures: MeasureSet
    source: SourceText
    choices: Choices
    timeline: Timeline
    unfolding: OriginUnfolding
    files: ScriptFiles | None

    @cached_property
    def _known(self) -> dict[str, tuple[Expr, ...]]:
        return {}

    def inner(self, part: ReducedPart) -> Expr | None:
        if part.kind is Reduction.MARGIN:
            count = len(self.timeline.claims)
            if count <= (part.claim or 0):
                message = f"the script has {counted(count, 'claim')}" if count else "the script claims nothing"
                raise wrong(f".margin({part.claim + 1 if part.claim is not None else ''})", message)
            return None
        if part.time is not None and not self.timeline.start <= part.time <= self.timeline.end:
            begin, end = time_text(float(self.timeline.start)), time_text(float(self.timeline.end))
            message = f"t = {time_text(float(part.time))} is outside the film, from {begin} to {end}"
            raise wrong(f".at({part.text}, {time_text(float(part.time))})", message)
        found = self._understood(part.text, part.text)
        return self.unfolding.unfolded(found)

    def outer(self, text: str, shown: str) -> Expr:
        root = self.unfolding.unfolded(self._understood(text, shown))
        if root.op == "clock" or any(not isinstance(p, Varied | Reduced) for p in symbols(root)) or _has_clock(root):
            plain = text if PLACE not in text else "…"
            raise wrong(shown, "it is not one number, but changes with time", f"reduce it: `.max({plain})`")
        return root

    def _understood(self, text: str, shown: str) -> Expr:
        """A scalar expression, as in a claim of the first step."""
        try:
            statement = parsed_statement(f"{text} = 0;", text)
            found: tuple[Expr, ...] = ()
            if statement is not None:
                rebuild = rebuilding(self.source, self.choices, self.files)
                found = understood(_with_reductions(statement.left), 0, rebuild)
        except UsageError:
            raise
        except MovimentumError as error:
            raise as_usage_error(shown, error.diagnostics[0]) from None
        if not found:
            raise wrong(shown, "it is not an expression", example())
        if len(found) != 1:
            raise wrong(shown, f"`{text}` is a vector", f"its length `({text}).l`, or `({text}).x`")
        return found[0]


def _has_clock(root: Expr) -> bool:
    from movimentum.expressions import walk

    return any(node.op in ("clock", "progress", "lifetime") for node in walk(root))


def _with_reductions(node: Expression) -> Expression:
    """``node`` with a traced constant for each name that stands for a reduction."""
    if isinstance(node, Name) and node.name.startswith(PLACE) and node.name[len(PLACE) :].isdigit():
        number = int(node.name[len(PLACE) :])
        value = traced(Reduced(number), generic(0.2, 0.9, number))
        return Constant(value.value or 0.0, value, span=node.span)
    below = children(node)
    return rebuilt(node, [_with_reductions(each) for each in below], node.span) if below else node


def evaluated(reader: Reader, chunks: Iterable[object]) -> list[FloatArray]:
    """Each expression of ``reader`` in all frames of ``chunks`` of poses, (1, F) each."""
    parts = [reader(poses) for poses in chunks]  # type: ignore[arg-type]
    return [np.concatenate(column)[None, :] for column in zip(*parts, strict=True)]
