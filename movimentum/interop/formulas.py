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
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.errors import ScriptError
from movimentum.planning.codegen.numeric import sincosd
from movimentum.source import SourceText, Span

SHAPES = {
    "PLA": "PLa",
    "PLAP": "PLaP",
    "PLLP": "PLLP",
    "PLPP": "PLPP",
    "PALP": "PaLP",
    "PXY": "PLL",
    "PPP": "PPP",
}
"""What each function takes: points (P), lengths (L) and angles (a). PLAP is also written without its last point."""
FPS = "fps"
"""The name of the value for the number of frames in a time unit."""
TOUCHING = 1e-12
"""Relative gap up to which two circles count as touching."""


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
_LINE_END = re.compile(r"[\r\n]")


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
            raise _error("formula/syntax", "this is not a formula", span, "PLLP[P1, L1, L2, P2](P3)")
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


def without_comments(text: str) -> str:
    """The text with its comments blanked out; the rest keeps its place."""
    parts: list[str] = []
    place, closed = 0, True
    while (begin := text.find("#", place)) >= 0:
        end = text.find("#]", begin + 2) if closed and text.startswith("#[", begin) else begin
        if end < 0:  # then no later one ends either, so it is not searched again
            closed, end = False, begin
        line_end = _LINE_END.search(text, end)
        end = len(text) if line_end is None else line_end.start()
        parts += [text[place:begin], re.sub(r"[^\r\n]", " ", text[begin:end])]
        place = end
    return "".join([*parts, text[place:]])


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
        raise _error("formula/function", f"there is no function `{match[1]}`", span, f"one of {', '.join(SHAPES)}")
    arguments = [word.strip() for word in match[2].split(",")]
    counts = {len(SHAPES[function]), *([3] if function == "PLAP" else [])}
    inverse = False
    could_be_word = len(arguments) not in counts or arguments[-1] not in points
    if len(arguments) - 1 in counts and arguments[-1].lower() in ("t", "f", "true", "false") and could_be_word:
        inverse = arguments.pop().lower().startswith("t")
    if len(arguments) not in counts or not all(arguments):
        shape = ", ".join({"P": "point", "L": "length", "a": "angle"}[letter] for letter in SHAPES[function])
        more = "; the last one may be left out" if len(counts) > 1 else ""
        raise _error("formula/arguments", f"{function} takes {shape}{more}", span)
    return Formula(function, tuple(arguments), match[3], inverse, span)


def _value(text: str, span: Span) -> FloatArray:
    try:
        value = np.array(json.loads(text.replace("(", "[").replace(")", "]")), dtype=np.float64)
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise _error(
            "formula/value", "this is not a number, a point or a list of them", span, "P0 = [60, 20]"
        ) from None
    if value.ndim > 2 or not (np.abs(value) < 1e150).all():
        raise _error("formula/value", "this is not a number, a point or a list of them", span, "P0 = [60, 20]")
    return value


def formulas_text(formulas: Formulas, comments: Iterable[str] = ()) -> str:
    """The formulas, then the known values; numbers read back exactly."""
    lines = [f"# {comment}" for comment in comments]
    lines += [f"{formula};" for formula in formulas.formulas]
    lines += [f"{name} = {json.dumps(value.tolist())}" for name, value in formulas.values.items()]
    return "\n".join(lines) + "\n"


def _error(code: str, message: str, span: Span | None, *helps: str) -> ScriptError:
    return ScriptError([Diagnostic(code, Severity.ERROR, message, span, helps=helps)])


# --- evaluating -----------------------------------------------------------------------------------------


def evaluate(formulas: Formulas, inputs: Mapping[str, ArrayLike] | None = None) -> dict[str, FloatArray]:
    """Every point, (2,) or (F, 2), for the known values and ``inputs`` (which take precedence): one or F of each.

    Raises `ScriptError` for a name that nothing gives, for lists of different lengths, and for a formula that has no
    point at one of the inputs.
    """
    values = formulas.values | {name: np.asarray(value, dtype=np.float64) for name, value in (inputs or {}).items()}
    points: dict[str, FloatArray] = {}
    with np.errstate(all="ignore"):
        for formula in formulas.formulas:
            arguments = [
                _argument(word, letter, values, points, formula)
                for word, letter in zip(formula.arguments, formula.shape, strict=True)
            ]
            _refuse_other_counts(formula, arguments)
            function = _pla if formula.function == "PLAP" and len(arguments) == 3 else _FUNCTIONS[formula.function]
            point, faults = function(formula.inverse, *arguments)
            finite = np.atleast_1d(np.isfinite(point).all(axis=-1))
            faults = [*faults, _Fault(~finite, "its numbers are too large")]
            if any(fault.where.any() for fault in faults):
                raise _unreachable(formula, faults)
            points[formula.target] = np.asarray(point, dtype=np.float64)
    used = _points(formulas)
    return {name: value for name, value in values.items() if name not in points and name in used} | points


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
        raise _error(
            "formula/unknown", f"{formula}: nothing gives the {kind} `{word}`", formula.span, f"`{word} = …` gives it"
        )
    if letter == "P" and (found.ndim == 0 or found.shape[-1] != 2):
        raise _error("formula/kind", f"{formula}: `{word}` is not a point", formula.span, f"{word} = [60, 20]")
    if letter != "P" and (found.ndim > 1 or word in points):
        raise _error("formula/kind", f"{formula}: `{word}` is a point, not a number", formula.span, f"{word} = 60")
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
        told = ", ".join(f"`{word}` has {count}" for word, count in counts.items())
        raise _error("formula/counts", f"{formula}: different numbers of values: {told}", formula.span)


def _unreachable(formula: Formula, faults: Sequence[_Fault]) -> ScriptError:
    count = max(fault.where.size for fault in faults)
    everywhere = [(np.broadcast_to(fault.where, count), fault) for fault in faults]
    first = min(int(np.argmax(where)) for where, _ in everywhere if where.any())
    fault = next(fault for where, fault in everywhere if where[first])
    where = f" at input {first} of {count}" if count > 1 else ""
    short = math.nan if fault.short is None else float(np.broadcast_to(fault.short, count)[first])
    amount = f", by {short:.6g}" if math.isfinite(short) else ""
    story = fault.story.format(*formula.arguments)
    return _error("formula/unreachable", f"{formula} has no solution{where}: {story}{amount}", formula.span)


@dataclass(frozen=True, slots=True)
class _Fault:
    """``where`` (F,) a formula has no point, why (``{0}`` is its first argument), and the length it is ``short`` of."""

    where: NDArray[np.bool_]
    story: str
    short: FloatArray | None = None


_Result = tuple[FloatArray, tuple[_Fault, ...]]
"""The point (…, 2), and where it is none; of two faults at one place, the first is reported."""


def _polar(length: FloatArray, degrees: FloatArray) -> FloatArray:
    sine, cosine = sincosd(degrees)
    return np.stack(np.broadcast_arrays(length * cosine, length * sine), axis=-1)


def _together(d: FloatArray, *arms: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The length (F,) of ``d``, and where it is negligible compared with the lengths of ``arms`` and what is added to
    them.
    """
    far = np.hypot(d[..., 0], d[..., 1])
    return np.asarray(far), np.atleast_1d(far <= TOUCHING * sum(np.abs(arm) for arm in arms))


def _pla(inverse: bool, a: FloatArray, length: FloatArray, angle: FloatArray) -> _Result:
    return a + _polar(length, -angle if inverse else angle), ()


def _plap(inverse: bool, a: FloatArray, length: FloatArray, angle: FloatArray, b: FloatArray) -> _Result:
    d = b - a
    far, together = _together(d, length)
    unit = d / far[..., None]
    c, s = np.moveaxis(_polar(np.ones(()), -angle if inverse else angle), -1, 0)
    turned = np.stack([unit[..., 0] * c - unit[..., 1] * s, unit[..., 1] * c + unit[..., 0] * s], axis=-1)
    point = a + np.asarray(length)[..., None] * turned
    return point, (_Fault(together, "{0} and {3} coincide, and give no direction"),)


def _pllp(inverse: bool, a: FloatArray, first: FloatArray, second: FloatArray, b: FloatArray) -> _Result:
    d = b - a
    far, together = _together(d, first, second)
    along = ((first - second) * (first + second) / far + far) / 2.0
    # (first - along)(first + along), from the sides, so that nothing cancels if the circles touch
    across = (first + second + far) * (first + second - far) * (far + first - second) * (far - first + second)
    high = np.sqrt(np.maximum(across, 0.0)) / (2.0 * far) * (-1.0 if inverse else 1.0)
    ux, uy = d[..., 0] / far, d[..., 1] / far
    point = np.stack([a[..., 0] + along * ux - high * uy, a[..., 1] + along * uy + high * ux], axis=-1)
    slack = np.minimum(first + second - far, far - np.abs(first - second))
    slack = np.where(np.abs(slack) <= TOUCHING * (first + second), 0.0, slack)
    same = np.atleast_1d(np.abs(first - second) <= TOUCHING * (first + second))
    return point, (
        _Fault(together & same, "{0} and {3} coincide, and so do the circles about them: any point on them would do"),
        _Fault(together, "{0} and {3} coincide, and the circles about them do not meet", np.abs(first - second)),
        _Fault(np.atleast_1d(~(slack >= 0.0)), "its circles do not meet", -slack),
    )


def _plpp(inverse: bool, a: FloatArray, length: FloatArray, b: FloatArray, c: FloatArray) -> _Result:
    d = c - b
    far, together = _together(d, length)
    ux, uy = d[..., 0] / far, d[..., 1] / far
    ex, ey = a[..., 0] - b[..., 0], a[..., 1] - b[..., 1]
    along, off = ex * ux + ey * uy, np.abs(ey * ux - ex * uy)
    slack = length - off
    slack = np.where(np.abs(slack) <= TOUCHING * np.maximum(length, off), 0.0, slack)
    reach = along + np.sqrt(np.maximum((length - off) * (length + off), 0.0)) * (-1.0 if inverse else 1.0)
    point = np.stack([b[..., 0] + reach * ux, b[..., 1] + reach * uy], axis=-1)
    return point, (
        _Fault(together, "{2} and {3} coincide, and give no line"),
        _Fault(np.atleast_1d(~(slack >= 0.0)), "its circle does not reach the line", -slack),
    )


def _palp(inverse: bool, a: FloatArray, angle: FloatArray, length: FloatArray, b: FloatArray) -> _Result:
    _, together = _together(b - a, length)
    ahead, _ = _plap(False, a, np.ones(()), angle, b)
    backwards = (ahead[..., 0] >= a[..., 0]) ^ inverse
    point, (_, out_of_reach) = _plpp(
        False, b, length, np.where(backwards[..., None], ahead, a), np.where(backwards[..., None], a, ahead)
    )
    return point, (_Fault(together, "{0} and {3} coincide, and give no direction"), out_of_reach)


def _pxy(inverse: bool, a: FloatArray, x: FloatArray, y: FloatArray) -> _Result:
    del inverse
    return a + np.stack(np.broadcast_arrays(x, y), axis=-1), ()


def _ppp(inverse: bool, a: FloatArray, b: FloatArray, c: FloatArray) -> _Result:
    del inverse
    return c + (b - a), ()


_FUNCTIONS = {
    "PLA": _pla,
    "PLAP": _plap,
    "PLLP": _pllp,
    "PLPP": _plpp,
    "PALP": _palp,
    "PXY": _pxy,
    "PPP": _ppp,
}
