"""MeasureSet: one number for a variant, from expressions of the language that are reduced over time.

``.max(Foot.x) - .min(Foot.x)``: a *reduction* makes one number of an expression's values in all frames, and any
expression of the language may contain reductions. The grammar finds them; the rest is read as in a claim of the first
step. Goals use the same reductions.

Frames without a value (nan) are left out. A least or greatest value is that of the first frame that has it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum
from fractions import Fraction

import numpy as np

from movimentum.advice import Choose
from movimentum.arrays import FloatArray, IntArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError, UsageError, usage_error
from movimentum.records import dataclass, replace
from movimentum.source import Span
from movimentum.text import rational
from movimentum.tolerances import LEAST_DIVISOR
from movimentum.variants.axes import OWN_COLUMNS

_NAMED = re.compile(r"\s*([A-Za-z][A-Za-z0-9_ ]*?)\s*=(?!=)(.*)", re.ASCII | re.DOTALL)
PLACE = "reductionNumber"
"""Begins the names that stand for reductions in the text around them."""


class Reduction(StrEnum):
    """A reduction: makes one number from an expression's values in all frames."""

    MIN = "min"
    MAX = "max"
    MEAN = "mean"
    RMS = "rms"
    RANGE = "range"
    FIRST = "first"
    LAST = "last"
    AT = "at"
    MARGIN = "margin"


_COMPARED = re.compile(r"`=`, `<`, `>` or `~`(?:, `:`)?( or an operator)?")
"""What the parser expects behind a statement's left-hand side, for which measures have no use."""
_SIGN = re.compile(r"[<>]=?|=|~")
_MARGIN = re.compile(r"\.margin\s*\(([^()]*)\)", re.ASCII)


@dataclass(frozen=True, slots=True)
class ReducedPart:
    """``kind`` of the expression ``text``; ``time`` for AT; ``claim`` (from 0; None: the least of all) for MARGIN."""

    kind: Reduction
    text: str = ""
    time: Fraction | None = None
    claim: int | None = None


@dataclass(frozen=True, slots=True)
class Measure:
    """``outer`` is ``text`` with a name for each reduction; ``parts`` are their numbers in `MeasureSet.parts`."""

    name: str
    text: str
    outer: str


@dataclass(frozen=True, slots=True)
class MeasureSet:
    """MeasureSet, and all reductions in them, each once."""

    measures: tuple[Measure, ...] = ()
    parts: tuple[ReducedPart, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The measures' names."""
        return tuple(measure.name for measure in self.measures)

    @property
    def times(self) -> tuple[Fraction, ...]:
        """The instants that are asked for, ascending."""
        return tuple(sorted({part.time for part in self.parts if part.time is not None}))


def read_measures(texts: Sequence[str | tuple[str, str]], taken: Sequence[str] = ()) -> MeasureSet:
    """MeasureSet from texts such as ``stride = .max(Foot.x) - .min(Foot.x)``, or pairs of name and expression.

    ``taken``: names of other columns. Raises `UsageError` (``usage/measure``).
    """
    measures: list[Measure] = []
    parts: dict[ReducedPart, int] = {}
    names = {*taken, *OWN_COLUMNS}
    for given in texts:
        if isinstance(given, tuple):
            name, text = given
        else:
            named = _NAMED.fullmatch(given)
            name, text = (named[1], named[2].strip()) if named else (given.strip(), given.strip())
        if not text:
            raise wrong(name, "there is no expression", example(name))
        if name in names:
            what = (
                "another measure is"
                if any(measure.name == name for measure in measures)
                else "a constant that varies is"
            )
            what = f"the column that says {OWN_COLUMNS[name]} is" if name in OWN_COLUMNS else what
            raise wrong(text, f"{what} called `{name}` already", Choose.MEASURE.to(f"'my_{name} = {text}'"))
        names.add(name)
        measures.append(Measure(name, text, _split(text, parts)))
    return MeasureSet(tuple(measures), tuple(parts))


def wrong(text: str, message: str, *helps: str) -> UsageError:
    """The error for an invalid measure."""
    return usage_error("usage/measure", f"the measure `{text}`: {message}", *helps)


def example(name: str = "stroke") -> str:
    """A measure that can be typed."""
    word = name if re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) else "stroke"
    return Choose.MEASURE.to(f"'{word} = .max(Rod.B.x) - .min(Rod.B.x)'")


def as_usage_error(text: str, item: Diagnostic) -> UsageError:
    """A diagnostic about an expression in a measure."""
    message = f"the measure `{text}`: {item.message}"
    return UsageError([Diagnostic(item.code, Severity.ERROR, message, helps=item.helps)])


def _split(text: str, parts: dict[ReducedPart, int]) -> str:
    """``text`` with a name in place of each reduction; these are added to ``parts``."""
    from movimentum.query import parsed_statement
    from movimentum.scene.reductions import is_reduction
    from movimentum.syntax.expression_tree import Call, postorder

    def placed(part: ReducedPart) -> str:
        return f"{PLACE}{parts.setdefault(part, len(parts))}"

    plain = _MARGIN.sub(lambda found: placed(ReducedPart(Reduction.MARGIN, claim=_claim(text, found[1]))), text)
    try:
        statement = parsed_statement(f"{plain} = 0;", plain)
    except ScriptError as error:
        if (sign := _SIGN.search(re.sub(r"\{[^{}]*\}", lambda found: " " * len(found[0]), plain))) is not None:
            value = text[: sign.start()].strip() if plain == text else ""
            raise wrong(
                text,
                f"`{sign[0]}` compares, and a measure is a value",
                Choose.MEASURE.to(f"'{value}'") if value else example(),
            ) from None
        item = error.diagnostics[0]
        raise wrong(text, _COMPARED.sub("an operator", item.message), *(item.helps or (example(),))) from None
    if statement is None:
        raise wrong(text, "it is not an expression", example())
    calls = [node for node in postorder(statement.left) if isinstance(node, Call) and is_reduction(node)]
    made, place = list[str](), 0
    for call in sorted(calls, key=lambda node: node.span.start):
        inner = next((other for other in calls if other is not call and _holds(call.span, other.span)), None)
        if inner is not None:
            shown = plain[inner.span.start : inner.span.end]
            raise wrong(text, f"`{shown}` is already one value, so `.{call.function}(…)` does nothing", example())
        kind, operand = Reduction(call.function), call.arguments[0].span
        part = ReducedPart(kind, plain[operand.start : operand.end])
        if kind is Reduction.AT:
            if len(call.arguments) != 2:
                help_ = Choose.MEASURE.to(f"'there = .at({part.text}, 0.5)'")
                raise wrong(text, "`.at(…)` takes an expression and a time", help_)
            when = call.arguments[1].span
            part = replace(part, time=_time(text, part.text, plain[when.start : when.end]))
        made += [plain[place : call.span.start], placed(part)]
        place = call.span.end
    return "".join([*made, plain[place:]])


def _holds(outer: Span, inner: Span) -> bool:
    return outer.start <= inner.start and inner.end <= outer.end


def _time(text: str, operand: str, when: str) -> Fraction:
    time = rational(when, exponents=True)
    if time is None:
        raise wrong(
            text, f"`{when}` is not a time, such as 0.5 or 1/3", Choose.MEASURE.to(f"'there = .at({operand}, 0.5)'")
        )
    return time


def _claim(text: str, inside: str) -> int | None:
    inside = inside.strip()
    if not inside:
        return None
    if not inside.isdigit() or int(inside) < 1:
        raise wrong(
            text, "`.margin(…)` takes the number of a claim, in the order written", Choose.MEASURE.to("'.margin(1)'")
        )
    return int(inside) - 1


def reduced(kind: str, values: FloatArray) -> FloatArray:
    """(V,) what ``kind`` (a word of `syntax.vocabulary.REDUCTIONS`, but not "at") makes of (V, F) values; nan where
    there is none.
    """
    known = np.isfinite(values)
    count = known.sum(axis=1)
    held = np.where(known, values, 0.0)
    match kind:
        case "first":
            return values[:, 0]
        case "last":
            return values[:, -1]
        case "min":
            found = _least(values)
        case "max":
            found = -_least(-values)
        case "range":
            found = -_least(-values) - _least(values)
        case "mean":
            found = held.sum(axis=1) / count
        case "rms":
            found = np.sqrt(np.square(held).sum(axis=1) / count)
        case _:
            raise ValueError(kind)
    return np.asarray(np.where(count > 0, found, np.nan), dtype=np.float64)


def influence(kind: str, values: FloatArray) -> FloatArray:
    """(V, F) how what is `reduced` changes with each of the values."""
    known = np.isfinite(values)
    share: FloatArray = known / np.maximum(known.sum(axis=1), 1)[:, None]
    match kind:
        case "first":
            return _one(np.zeros(len(values), dtype=np.intp), values)
        case "last":
            return _one(np.full(len(values), values.shape[1] - 1), values)
        case "min":
            return _one(_place(values), values)
        case "max":
            return _one(_place(-values), values)
        case "range":
            return _one(_place(-values), values) - _one(_place(values), values)
        case "mean":
            return share
        case "rms":
            found = np.maximum(np.nan_to_num(reduced(kind, values)), LEAST_DIVISOR)
            return share * np.where(known, values, 0.0) / found[:, None]
        case _:
            raise ValueError(kind)


def _least(values: FloatArray) -> FloatArray:
    return np.min(np.where(np.isfinite(values), values, np.inf), axis=1)


def _place(values: FloatArray) -> IntArray:
    return np.argmin(np.where(np.isfinite(values), values, np.inf), axis=1)


def _one(place: IntArray, values: FloatArray) -> FloatArray:
    weights = np.zeros(values.shape)
    weights[np.arange(len(values)), place] = 1.0
    return weights
