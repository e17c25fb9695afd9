"""Pyslvs' triangular formulas: read, written, and evaluated over arrays of inputs.

``PLAP[P0, L0, a0, P2](P1); PLLP[P1, L1, L2, P2](P3)``: a function of points, lengths and angles, and the point it
gives, which later formulas may use. Angles are in degrees, counter-clockwise.

=================================  =====================================================================
``PLA[A, L, a](T)``                T at distance L from A, in direction a
``PLAP[A, L, a, B](T)``            the same, the direction counted from that of A to B
``PLLP[A, L, M, B](T)``            at L from A and at M from B, to the left of A to B
``PLPP[A, L, B, C](T)``            at L from A on the line through B and C, the farther one in its direction
``PALP[A, a, L, B](T)``            in direction a (counted from A to B) from A, at L from B: that with the smaller x
``PXY[A, x, y](T)``                at (x, y) from A
``PPP[A, B, C](T)``                A, B, T, C are the corners of a parallelogram
=================================  =====================================================================

A last argument ``T`` (true) takes the inverse: the negative angle, the right side, the other point of the line.
The functions are those of Pyslvs (Chang, https://github.com/KmolYuan/pyslvs, tinycadlib). Lines ``name = value`` give
what is known, ``#`` begins a comment.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.plan.numeric import sincosd
from movimentum.source import SourceText, Span

FloatArray = NDArray[np.float64]

SHAPES = {
    "PLA": "PLa",
    "PLAP": "PLaP",
    "PLLP": "PLLP",
    "PLPP": "PLPP",
    "PALP": "PaLP",
    "PXY": "PLL",
    "PPP": "PPP",
}
"""What each function takes: points (P), lengths (L) and angles (a)."""
TOUCHING = 1e-12
"""Relative amount by which two circles may fail to meet and are taken to touch."""


@dataclass(frozen=True, slots=True)
class Formula:
    """``function[arguments](target)``; ``inverse`` takes the other solution."""

    function: str
    arguments: tuple[str, ...]
    target: str
    inverse: bool = False
    span: Span | None = field(default=None, compare=False)

    def __str__(self) -> str:
        """The formula as Pyslvs writes it."""
        return f"{self.function}[{', '.join((*self.arguments, *('T' * self.inverse)))}]({self.target})"


@dataclass(frozen=True, slots=True)
class Formulas:
    """Formulas in the order in which to evaluate them; ``values``: numbers or arrays (F,), points (2,) or (F, 2)."""

    formulas: tuple[Formula, ...]
    values: dict[str, FloatArray] = field(default_factory=dict[str, FloatArray])


# --- reading and writing --------------------------------------------------------------------------------

_COMMENT = re.compile(r"#\[.*?#\][^\n]*|#[^\n]*", re.DOTALL)
_FORMULA = re.compile(r"\s*([A-Za-z]+)\s*\[([^\[\]()]*)\]\s*\(\s*([A-Za-z_]\w*)\s*\)\s*\Z")
_KNOWN = re.compile(r"\s*([A-Za-z_]\w*)\s*=\s*(\S.*?)\s*\Z", re.DOTALL)


def read_formulas(source: SourceText) -> Formulas:
    """Formulas parted by ``;`` or lines; raises `ScriptError` for what is neither a formula nor a known value."""
    text = _COMMENT.sub(lambda match: " " * len(match[0]), source.text)
    formulas: list[Formula] = []
    values: dict[str, FloatArray] = {}
    for piece in re.finditer(r"[^;\n]+", text):
        if not piece[0].strip():
            continue
        begin = piece.start() + len(piece[0]) - len(piece[0].lstrip())
        span = Span(begin, piece.start() + len(piece[0].rstrip()))
        known = _KNOWN.match(piece[0])
        if known:
            values[known[1]] = _value(known[2], span)
        else:
            formulas.append(_formula(piece[0], span))
    return Formulas(tuple(formulas), values)


def _formula(text: str, span: Span) -> Formula:
    match = _FORMULA.match(text)
    if match is None:
        raise _error("formula/syntax", "this is no formula", span, "PLLP[P1, L1, L2, P2](P3)")
    function = match[1].upper()
    if function not in SHAPES:
        raise _error("formula/function", f"there is no function `{match[1]}`", span, f"one of {', '.join(SHAPES)}")
    arguments = [word.strip() for word in match[2].split(",")]
    inverse = False
    if len(arguments) == len(SHAPES[function]) + 1 and arguments[-1].lower() in ("t", "f", "true", "false"):
        inverse = arguments.pop().lower().startswith("t")
    if len(arguments) != len(SHAPES[function]) or not all(arguments):
        shape = ", ".join({"P": "point", "L": "length", "a": "angle"}[letter] for letter in SHAPES[function])
        raise _error("formula/arguments", f"{function} takes {shape}", span)
    return Formula(function, tuple(arguments), match[3], inverse, span)


def _value(text: str, span: Span) -> FloatArray:
    try:
        value = np.array(json.loads(text.replace("(", "[").replace(")", "]")), dtype=np.float64)
    except (ValueError, RecursionError):
        raise _error("formula/value", "this is no number, point or list of them", span, "P0 = [60, 20]") from None
    if value.ndim > 2 or not np.isfinite(value).all():
        raise _error("formula/value", "this is no number, point or list of them", span, "P0 = [60, 20]")
    return value


def formulas_text(formulas: Formulas, comments: Iterable[str] = ()) -> str:
    """The formulas, then what is known; numbers read back exactly."""
    lines = [f"# {comment}" for comment in comments]
    lines += [f"{formula};" for formula in formulas.formulas]
    lines += [f"{name} = {json.dumps(value.tolist())}" for name, value in formulas.values.items()]
    return "\n".join(lines) + "\n"


def _error(code: str, message: str, span: Span | None, *helps: str) -> ScriptError:
    return ScriptError([Diagnostic(code, Severity.ERROR, message, span, helps=helps)])


# --- evaluating -----------------------------------------------------------------------------------------


def evaluate(formulas: Formulas, inputs: Mapping[str, ArrayLike] | None = None) -> dict[str, FloatArray]:
    """Every point, (2,) or (F, 2), for the known values and ``inputs`` (which go before): one or F of each.

    Raises `ScriptError` for a name that nothing gives, and for a formula that has no point at one of the inputs.
    """
    values = formulas.values | {name: np.asarray(value, dtype=np.float64) for name, value in (inputs or {}).items()}
    points: dict[str, FloatArray] = {}
    with np.errstate(all="ignore"):
        for formula in formulas.formulas:
            arguments = [
                _argument(word, letter, values, points, formula)
                for word, letter in zip(formula.arguments, SHAPES[formula.function], strict=True)
            ]
            point, slack, story = _FUNCTIONS[formula.function](formula.inverse, *arguments)
            wrong = ~(np.asarray(slack) >= 0.0) | ~np.isfinite(point).all(axis=-1)
            if np.any(wrong):
                raise _unreachable(formula, np.atleast_1d(wrong), np.atleast_1d(slack), story)
            points[formula.target] = np.asarray(point, dtype=np.float64)
    known = {name: value for name, value in values.items() if name not in points and name in _points(formulas)}
    return known | points


def _points(formulas: Formulas) -> set[str]:
    return {
        word
        for formula in formulas.formulas
        for word, letter in zip(formula.arguments, SHAPES[formula.function], strict=True)
        if letter == "P"
    }


def _argument(
    word: str, letter: str, values: Mapping[str, FloatArray], points: Mapping[str, FloatArray], formula: Formula
) -> FloatArray:
    found = points.get(word, values.get(word))
    if found is None and letter != "P":
        with suppress(ValueError):
            found = np.array(float(word))
    if found is None:
        kind = {"P": "point", "L": "length", "a": "angle"}[letter]
        raise _error(
            "formula/unknown", f"{formula}: nothing gives the {kind} `{word}`", formula.span, f"`{word} = …` gives it"
        )
    if letter == "P" and (found.ndim == 0 or found.shape[-1] != 2):
        raise _error("formula/kind", f"{formula}: `{word}` is no point", formula.span, f"{word} = [60, 20]")
    if letter != "P" and (found.ndim > 1 or word in points):
        raise _error("formula/kind", f"{formula}: `{word}` is a point, and no number", formula.span, f"{word} = 60")
    return found


def _unreachable(formula: Formula, wrong: NDArray[np.bool_], slack: FloatArray, story: str) -> ScriptError:
    first = int(np.argmax(wrong))
    short = -float(np.broadcast_to(slack, wrong.shape)[first])
    where = f" at input {first} of {len(wrong)}" if len(wrong) > 1 else ""
    amount = f", by {short:.6g}" if np.isfinite(short) and short > 0.0 else ""
    return _error("formula/unreachable", f"{formula} has no solution{where}: {story}{amount}", formula.span)


_Result = tuple[FloatArray, FloatArray, str]
"""The point (…, 2), by how much it exists (negative: not), and what is wrong where it does not."""


def _polar(length: FloatArray, degrees: FloatArray) -> FloatArray:
    sine, cosine = sincosd(degrees)
    return np.stack(np.broadcast_arrays(length * cosine, length * sine), axis=-1)


def _pla(inverse: bool, a: FloatArray, length: FloatArray, angle: FloatArray) -> _Result:
    return a + _polar(length, -angle if inverse else angle), np.zeros(1), ""


def _plap(inverse: bool, a: FloatArray, length: FloatArray, angle: FloatArray, b: FloatArray) -> _Result:
    d = b - a
    far = np.hypot(d[..., 0], d[..., 1])
    unit = d / far[..., None]
    c, s = np.moveaxis(_polar(np.ones(()), -angle if inverse else angle), -1, 0)
    turned = np.stack([unit[..., 0] * c - unit[..., 1] * s, unit[..., 1] * c + unit[..., 0] * s], axis=-1)
    return a + np.asarray(length)[..., None] * turned, np.where(far > 0.0, 0.0, -1.0), "its two points coincide"


def _pllp(inverse: bool, a: FloatArray, first: FloatArray, second: FloatArray, b: FloatArray) -> _Result:
    d = b - a
    far = np.hypot(d[..., 0], d[..., 1])
    along = ((first - second) * (first + second) / far + far) / 2.0
    # (first - along)(first + along), from the sides, so that nothing cancels where the circles touch
    across = (first + second + far) * (first + second - far) * (far + first - second) * (far - first + second)
    high = np.sqrt(np.maximum(across, 0.0)) / (2.0 * far) * (-1.0 if inverse else 1.0)
    ux, uy = d[..., 0] / far, d[..., 1] / far
    point = np.stack([a[..., 0] + along * ux - high * uy, a[..., 1] + along * uy + high * ux], axis=-1)
    slack = np.minimum(first + second - far, far - np.abs(first - second))
    slack = np.where(np.abs(slack) <= TOUCHING * (first + second), 0.0, slack)
    slack = np.where(far > 0.0, slack, -1.0)
    return point, slack, "its circles do not meet"


def _plpp(inverse: bool, a: FloatArray, length: FloatArray, b: FloatArray, c: FloatArray) -> _Result:
    d = c - b
    far = np.hypot(d[..., 0], d[..., 1])
    ux, uy = d[..., 0] / far, d[..., 1] / far
    ex, ey = a[..., 0] - b[..., 0], a[..., 1] - b[..., 1]
    along, off = ex * ux + ey * uy, np.abs(ey * ux - ex * uy)
    slack = length - off
    slack = np.where(np.abs(slack) <= TOUCHING * np.maximum(length, off), 0.0, slack)
    reach = along + np.sqrt(np.maximum((length - off) * (length + off), 0.0)) * (-1.0 if inverse else 1.0)
    point = np.stack([b[..., 0] + reach * ux, b[..., 1] + reach * uy], axis=-1)
    return point, np.where(far > 0.0, slack, -1.0), "its circle does not reach the line"


def _palp(inverse: bool, a: FloatArray, angle: FloatArray, length: FloatArray, b: FloatArray) -> _Result:
    ahead, _, _ = _plap(False, a, np.ones(()), angle, b)
    backwards = (ahead[..., 0] >= a[..., 0]) ^ inverse
    point, slack, story = _plpp(
        False, b, length, np.where(backwards[..., None], ahead, a), np.where(backwards[..., None], a, ahead)
    )
    return point, slack, story


def _pxy(inverse: bool, a: FloatArray, x: FloatArray, y: FloatArray) -> _Result:
    del inverse
    return a + np.stack(np.broadcast_arrays(x, y), axis=-1), np.zeros(1), ""


def _ppp(inverse: bool, a: FloatArray, b: FloatArray, c: FloatArray) -> _Result:
    del inverse
    return c + (b - a), np.zeros(1), ""


_FUNCTIONS = {
    "PLA": _pla,
    "PLAP": _plap,
    "PLLP": _pllp,
    "PLPP": _plpp,
    "PALP": _palp,
    "PXY": _pxy,
    "PPP": _ppp,
}
