"""Pyslvs' triangular formulas: read, written, and evaluated over arrays of inputs.

``PLAP[P0, L0, a0, P2](P1); PLLP[P1, L1, L2, P2](P3)``: a function of points, lengths and angles, and the point it
gives, which later formulas may use. Angles are in degrees, counter-clockwise.

=================================  =====================================================================
``PLA[A, L, a](T)``                T at distance L from A, in direction a
``PLAP[A, L, a, B](T)``            the same, the direction counted from that of A to B; without B as ``PLA``
``PLLP[A, L, M, B](T)``            at L from A and at M from B, to the left of A to B
``PLPP[A, L, B, C](T)``            at L from A on the line through B and C, the farther one in its direction
``PALP[A, a, L, B](T)``            in direction a (counted from A to B) from A, at L from B: that with the smaller x
``PXY[A, x, y](T)``                at (x, y) from A
``PPP[A, B, C](T)``                A, B, T, C are the corners of a parallelogram
=================================  =====================================================================

A last argument ``T`` (true) selects the inverse: the negative angle, the right side, the other point of the line. The
functions are those of Pyslvs (Chang, https://github.com/KmolYuan/pyslvs, tinycadlib). Lines ``name = value`` give known
values, ``#`` begins a comment.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Container, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.errors import ScriptError, error_at
from movimentum.interop.recognised import SHAPES, without_comments
from movimentum.interop.triangle_functions import FUNCTIONS, Fault
from movimentum.records import dataclass, field
from movimentum.settings import FailurePolicy
from movimentum.source import SourceText, Span

FPS = "fps"
"""The name of the value for the number of frames in a time unit."""


@dataclass(frozen=True, slots=True)
class Formula:
    """``function[arguments](target)``; ``inverse`` selects the other solution."""

    function: str
    arguments: tuple[str, ...]
    target: str
    inverse: bool = False
    span: Span | None = field(default=None, compare=False)

    @property
    def shape(self) -> str:
        """The kinds of its arguments, see `SHAPES`."""
        return SHAPES[self.function][: len(self.arguments)]

    def __str__(self) -> str:
        """The formula as Pyslvs writes it."""
        return f"{self.function}[{', '.join((*self.arguments, *('T' * self.inverse)))}]({self.target})"


@dataclass(frozen=True, slots=True)
class Formulas:
    """Formulas in the order in which to evaluate them; ``values``: numbers or arrays (F,), points (2,) or (F, 2).

    ``spans``: the places of the values in a file.
    """

    formulas: tuple[Formula, ...]
    values: dict[str, FloatArray] = field(default_factory=dict[str, FloatArray])
    spans: dict[str, Span] = field(default_factory=dict[str, Span], compare=False)


# --- reading and writing --------------------------------------------------------------------------------

_FORMULA = re.compile(r"\s*([A-Za-z]+)\s*\[([^\[\]()]*)\]\s*\(\s*([^\W\d]\w*)\s*\)\s*\Z")
_KNOWN = re.compile(r"([^\W\d]\w*)\s*=\s*(\S.*)\Z", re.DOTALL)


def read_formulas(source: SourceText) -> Formulas:
    """Formulas separated by ``;`` or line ends; raises `ScriptError` for text that is neither a formula nor a known
    value, and for a name that is given twice.
    """
    text = without_comments(source.text)
    pieces: list[tuple[str, Span]] = []
    for piece in re.finditer(r"[^;\r\n]+", text):
        begin = piece.start() + len(piece[0]) - len(piece[0].lstrip())
        if piece[0].strip():
            pieces.append((piece[0].strip(), Span(begin, piece.start() + len(piece[0].rstrip()))))
    values: dict[str, FloatArray] = {}
    spans: dict[str, Span] = {}
    found: list[re.Match[str]] = []
    places: list[Span] = []
    targets: dict[str, Span] = {}
    for words, span in pieces:
        known, formula = _KNOWN.match(words), _FORMULA.match(words)
        if known is None and formula is None:
            raise error_at("formula/syntax", "this is not a formula", span, "PLLP[P1, L1, L2, P2](P3)")
        if formula is not None:
            _once(formula[3], targets, span)
            found.append(formula)
            places.append(span)
        elif known is not None:
            _once(known[1], spans, span)
            values[known[1]] = _value(known[2], span)
    points = {*targets, *values}
    formulas = [_formula(match, span, points) for match, span in zip(found, places, strict=True)]
    return Formulas(tuple(formulas), values, spans)


def _once(name: str, spans: dict[str, Span], span: Span) -> None:
    if name in spans:
        first = (Label(spans[name], "here"),)
        message = f"`{name}` is given twice"
        raise ScriptError([Diagnostic("formula/twice", Severity.ERROR, message, span, labels=first)])
    spans[name] = span


def _formula(match: re.Match[str], span: Span, points: Container[str]) -> Formula:
    """``points``: all names that the file gives; if `T` is among them, it is a point and not the word for true."""
    function = match[1].upper()
    if function not in SHAPES:
        raise error_at("formula/function", f"there is no function `{match[1]}`", span, f"one of {', '.join(SHAPES)}")
    arguments = [word.strip() for word in match[2].split(",")]
    counts = {len(SHAPES[function]), *([3] if function == "PLAP" else [])}
    inverse = False
    could_be_word = len(arguments) not in counts or arguments[-1] not in points
    if len(arguments) - 1 in counts and arguments[-1].lower() in ("t", "f", "true", "false") and could_be_word:
        inverse = arguments.pop().lower().startswith("t")
    if len(arguments) not in counts or not all(arguments):
        shape = ", ".join({"P": "point", "L": "length", "a": "angle"}[letter] for letter in SHAPES[function])
        more = "; the last one may be left out" if len(counts) > 1 else ""
        raise error_at("formula/arguments", f"{function} takes {shape}{more}", span)
    return Formula(function, tuple(arguments), match[3], inverse, span)


def _value(text: str, span: Span) -> FloatArray:
    try:
        value = np.array(json.loads(text.replace("(", "[").replace(")", "]")), dtype=np.float64)
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise error_at(
            "formula/value", "this is not a number, a point or a list of them", span, "P0 = [60, 20]"
        ) from None
    if value.ndim > 2 or not (np.abs(value) < 1e150).all():
        raise error_at("formula/value", "this is not a number, a point or a list of them", span, "P0 = [60, 20]")
    return value


def formulas_text(formulas: Formulas, comments: Iterable[str] = ()) -> str:
    """The formulas, then the known values; numbers read back exactly."""
    lines = [f"# {comment}" for comment in comments]
    lines += [f"{formula};" for formula in formulas.formulas]
    lines += [f"{name} = {json.dumps(value.tolist())}" for name, value in formulas.values.items()]
    return "\n".join(lines) + "\n"


# --- evaluating -----------------------------------------------------------------------------------------


def evaluate(formulas: Formulas, inputs: Mapping[str, ArrayLike] | None = None) -> dict[str, FloatArray]:
    """Every point, (2,) or (F, 2), for the known values and ``inputs`` (which take precedence): one or F of each.

    Raises `ScriptError` for a name that nothing gives, for lists of different lengths, and for a formula that has no
    point at one of the inputs.
    """
    return evaluate_each(formulas, inputs, FailurePolicy.STOP).points


@dataclass(frozen=True, slots=True)
class Unreachable:
    """A formula that has no point at ``rows`` (indices of the inputs), all for the same reason: the ``diagnostic``."""

    rows: NDArray[np.intp]
    diagnostic: Diagnostic


@dataclass(frozen=True, slots=True)
class FormulaPoints:
    """``points``: every point, (2,) or (F, 2); ``unreachable``: at which inputs there are none, and why. Each such
    input is in one of them.
    """

    points: dict[str, FloatArray]
    unreachable: tuple[Unreachable, ...] = ()


def evaluate_each(
    formulas: Formulas,
    inputs: Mapping[str, ArrayLike] | None = None,
    on_failure: FailurePolicy | str = FailurePolicy.SKIP,
) -> FormulaPoints:
    """The points as in `evaluate`. At an input where a formula has no point, ``skip`` makes all computed points nan,
    ``hold`` repeats those of the last input before it that has points (nan, if there is none), and ``stop`` raises
    `ScriptError`.
    """
    policy = FailurePolicy(on_failure)
    values = formulas.values | {name: np.asarray(value, dtype=np.float64) for name, value in (inputs or {}).items()}
    points: dict[str, FloatArray] = {}
    failed: NDArray[np.bool_] = np.zeros(1, dtype=np.bool_)
    unreachable: list[Unreachable] = []
    with np.errstate(all="ignore"):
        for formula in formulas.formulas:
            arguments = [
                _argument(word, letter, values, points, formula)
                for word, letter in zip(formula.arguments, formula.shape, strict=True)
            ]
            _refuse_other_counts(formula, arguments)
            function = FUNCTIONS["PLA" if len(arguments) == 3 and formula.function == "PLAP" else formula.function]
            point, faults = function(formula.inverse, *arguments)
            finite = np.atleast_1d(np.isfinite(point).all(axis=-1))
            for fault in (*faults, Fault(~finite, "its numbers are too large")):
                new = fault.where & ~failed
                if new.any():
                    unreachable.append(Unreachable(np.flatnonzero(new), _unreachable(formula, fault, new)))
                    failed = failed | new
            if unreachable and policy is FailurePolicy.STOP:
                raise ScriptError([min(unreachable, key=lambda each: int(each.rows[0])).diagnostic])
            points[formula.target] = np.asarray(point, dtype=np.float64)
    if unreachable:
        points = {name: _without(point, failed, policy) for name, point in points.items()}
    used = _points(formulas)
    given = {name: value for name, value in values.items() if name not in points and name in used}
    return FormulaPoints(given | points, tuple(unreachable))


def _without(point: FloatArray, failed: NDArray[np.bool_], policy: FailurePolicy) -> FloatArray:
    """A computed point with nothing, or what is held, at the rows that ``failed``."""
    everywhere = np.array(np.broadcast_to(point, (len(failed), 2)) if len(failed) > 1 else point)
    rows = everywhere.reshape(-1, 2)
    rows[failed] = np.nan
    if policy is FailurePolicy.HOLD:
        last = np.maximum.accumulate(np.where(failed, -1, np.arange(len(failed))))
        rows[last >= 0] = rows[last[last >= 0]]
    return everywhere


def _points(formulas: Formulas) -> set[str]:
    return {
        word
        for formula in formulas.formulas
        for word, letter in zip(formula.arguments, formula.shape, strict=True)
        if letter == "P"
    }


def _argument(
    word: str, letter: str, values: Mapping[str, FloatArray], points: Mapping[str, FloatArray], formula: Formula
) -> FloatArray:
    found = points.get(word, values.get(word))
    if found is None and letter != "P":
        found = literal(word)
    if found is None:
        kind = {"P": "point", "L": "length", "a": "angle"}[letter]
        raise error_at(
            "formula/unknown", f"{formula}: nothing gives the {kind} `{word}`", formula.span, f"`{word} = …` gives it"
        )
    if letter == "P" and (found.ndim == 0 or found.shape[-1] != 2):
        raise error_at("formula/kind", f"{formula}: `{word}` is not a point", formula.span, f"{word} = [60, 20]")
    if letter != "P" and (found.ndim > 1 or word in points):
        raise error_at("formula/kind", f"{formula}: `{word}` is a point, not a number", formula.span, f"{word} = 60")
    return found


def literal(word: str) -> FloatArray | None:
    """The number of a length or an angle, if it is written as one."""
    try:
        value = float(word) if word.isascii() and "_" not in word else math.nan
    except ValueError:
        return None
    return np.array(value) if abs(value) < 1e150 else None


def _refuse_other_counts(formula: Formula, arguments: Sequence[FloatArray]) -> None:
    """Check that all lists have the same number of values."""
    counts = {
        word: len(value)
        for word, letter, value in zip(formula.arguments, formula.shape, arguments, strict=True)
        if value.ndim > (1 if letter == "P" else 0)
    }
    if len(set(counts.values())) > 1:
        counts_text = ", ".join(f"`{word}` has {count}" for word, count in counts.items())
        raise error_at("formula/counts", f"{formula}: different numbers of values: {counts_text}", formula.span)


def _unreachable(formula: Formula, fault: Fault, rows: NDArray[np.bool_]) -> Diagnostic:
    """The text of ``fault`` for the first of ``rows`` (F,)."""
    count, first, many = len(rows), int(np.argmax(rows)), int(np.count_nonzero(rows))
    where = f" at input {first} of {count}" if count > 1 else ""
    if many > 1:
        where = f" at {many} of {count} inputs, the first is input {first}"
    short = math.nan if fault.short is None else float(np.broadcast_to(fault.short, count)[first])
    amount = f", by {short:.6g}" if math.isfinite(short) else ""
    message = f"{formula} has no solution{where}: {fault.story.format(*formula.arguments)}{amount}"
    return Diagnostic("formula/unreachable", Severity.ERROR, message, formula.span)
