"""The values in a file of formulas: inputs, number of frames, first pose; and lists of values as statements."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.interop.formulas import FPS, Formulas, evaluate, literal
from movimentum.records import replace
from movimentum.syntax.printer import float_text
from movimentum.tolerances import FASTEST_RATE, FRAME_VALUE, LEAST_DIVISOR, SIMPLE_RATE

USUAL_FPS = Fraction(24)
_STARTS = range(0, 360, 15)  # degrees of the trial values for the beginning of a free angle


def refuse_disorder(formulas: Formulas) -> None:
    """Raise `ScriptError` for a point that is used before its formula, and for a name that is a point and a number."""
    later = {formula.target for formula in formulas.formulas}
    points = later | {
        word for f in formulas.formulas for word, kind in zip(f.arguments, f.shape, strict=True) if kind == "P"
    }
    for formula in formulas.formulas:
        for word, kind in zip(formula.arguments, formula.shape, strict=True):
            if kind == "P" and word in later:
                code, message = "formula/unknown", f"{formula}: nothing before it gives the point `{word}`"
            elif kind != "P" and word in points:
                code, message = "formula/kind", f"{formula}: `{word}` is a point, not a number"
            else:
                continue
            raise ScriptError([Diagnostic(code, Severity.ERROR, message, formula.span)])
        later.discard(formula.target)


def kinds_of(formulas: Formulas) -> dict[str, str]:
    """Every name that is not the target of a formula, with its kind P, L or a: by its use, or else by its value."""
    targets = {formula.target for formula in formulas.formulas}
    found: dict[str, str] = {}
    for formula in formulas.formulas:
        for word, letter in zip(formula.arguments, formula.shape, strict=True):
            if word not in targets and (word in formulas.values or literal(word) is None or letter == "P"):
                found.setdefault(word, letter)
    for name, value in formulas.values.items():
        if name not in targets and value.ndim and value.shape[-1] == 2:
            found.setdefault(name, "P")
    return found


def inputs_of(formulas: Formulas) -> list[str]:
    """The angles that nothing gives; `ScriptError` with all other names that nothing gives."""
    kinds = kinds_of(formulas)
    missing = {name: kind for name, kind in kinds.items() if name not in formulas.values}
    if not formulas.formulas and "P" not in kinds.values():
        raise ScriptError([Diagnostic("formula/empty", Severity.ERROR, "there is no formula and no point")])
    found: list[Diagnostic] = []
    for name, kind in missing.items():
        if kind != "a":
            what, example = ("point", "[60, 20]") if kind == "P" else ("length", "60")
            first = next(formula for formula in formulas.formulas if name in formula.arguments)
            message = f"{first}: nothing gives the {what} `{name}`"
            found.append(
                Diagnostic("formula/unknown", Severity.ERROR, message, first.span, helps=(f"{name} = {example}",))
            )
    if found:
        raise ScriptError(found)
    return list(missing)


def frame_count(formulas: Formulas) -> int:
    """The number of values of names with a value for each frame; 1 if there are none."""
    counts: dict[str, int] = {}
    for name, kind in kinds_of(formulas).items():
        value = formulas.values.get(name)
        if value is not None and value.ndim > (1 if kind == "P" else 0):
            counts[name] = len(value)
    if len(set(counts.values())) > 1:
        (one, count), (other, another) = next((a, b) for a in counts.items() for b in counts.items() if a[1] != b[1])
        message = f"`{one}` has {count} values, and `{other}` has {another}"
        raise ScriptError([Diagnostic("formula/counts", Severity.ERROR, message, formulas.spans.get(other))])
    if 0 in counts.values():
        raise ScriptError([Diagnostic("formula/counts", Severity.ERROR, f"`{next(iter(counts))}` has no value")])
    return next(iter(counts.values()), 1)


def frame_rate(formulas: Formulas) -> Fraction:
    """Frames in a time unit: the number in the file as the simple fraction nearest to it."""
    value = formulas.values.get(FPS)
    if value is None or FPS in kinds_of(formulas) or value.ndim or not 1.0 / FASTEST_RATE < float(value) < FASTEST_RATE:
        return USUAL_FPS
    simple = Fraction(float(value)).limit_denominator(10_000)
    return simple if abs(float(simple) - float(value)) <= SIMPLE_RATE * float(value) else Fraction(float(value))


def first_pose(formulas: Formulas, inputs: Sequence[str]) -> tuple[int, dict[str, FloatArray]]:
    """Every point (2,) at the first frame, and the angles where the ``inputs`` begin."""
    values = dict(formulas.values)
    for name, kind in kinds_of(formulas).items():
        if name in values and values[name].ndim > (1 if kind == "P" else 0):
            values[name] = values[name][0]
    first = Formulas(formulas.formulas, values)
    problem: ScriptError | None = None
    for start in _STARTS if inputs else [0]:
        try:
            found = evaluate(first, dict.fromkeys(inputs, float(start)))
        except ScriptError as error:
            problem = problem or error
        else:
            given = {name: values[name] for name, kind in kinds_of(formulas).items() if kind == "P"}
            return start, given | found
    assert problem is not None
    raise problem


def shortfalls(formulas: Formulas) -> tuple[Diagnostic, ...]:
    """The first formula that has no point at one of the frames, as a warning."""
    try:
        evaluate(formulas)
    except ScriptError as error:
        return tuple(replace(item, severity=Severity.WARNING) for item in error.diagnostics)
    return ()


PIECES = 100
"""The largest number of pieces in one statement; further pieces follow in another step."""


def course(values: FloatArray, fps: Fraction) -> list[tuple[int, str]]:
    """Expressions of ``.t`` for ``values`` (F,) at frames, each with the frame of the step in which to state it.

    Between frames the values are interpolated linearly, because the list says nothing about them.
    """
    tolerance = FRAME_VALUE * (1.0 + float(np.max(np.abs(values))))
    corners = _corners(values, tolerance)
    found: list[tuple[int, str]] = []
    for begin in range(0, max(1, len(corners) - 1), PIECES):
        some = corners[begin : begin + PIECES + 1]
        pieces = [_line(values, first, last, some[0], fps, tolerance) for first, last in _pairs(some)]
        bounds = [time_text(Fraction(corner - some[0]) / fps) for corner in some[1:-1]]
        rest = "".join(f" > {bound} : {piece}" for bound, piece in zip(bounds, pieces[1:], strict=True))
        found.append((some[0], f"{{.t : {pieces[0]}{rest}}}" if rest else pieces[0]))
    return found


def time_text(time: Fraction) -> str:
    """A time exactly: ``2``, ``1/24``."""
    return str(time)


def _pairs(corners: list[int]) -> list[tuple[int, int]]:
    return [*pairwise(corners)] or [(corners[0], corners[0])]


def _corners(values: FloatArray, tolerance: float) -> list[int]:
    """The frames between which all values are on straight lines: each line goes as far as possible."""
    found = [0]
    while found[-1] < len(values) - 1:
        first = found[-1]
        low, high, last = -np.inf, np.inf, first + 1
        for k in range(first + 1, len(values)):
            slope = (values[k] - values[first]) / (k - first)
            if not low <= slope <= high:
                break
            last = k
            reach = tolerance / (k - first)
            low, high = max(low, slope - reach), min(high, slope + reach)
        found.append(last)
    return found


def _line(values: FloatArray, first: int, last: int, origin: int, fps: Fraction, tolerance: float) -> str:
    """The line from frame ``first`` to ``last``, of ``.t`` that counts from frame ``origin``; in round numbers."""
    start, end = float(values[first]), float(values[last])
    length = float(Fraction(last - first) / fps)
    rate = (end - start) / length if length else 0.0
    start, rate = _round(start, tolerance), _round(rate, tolerance / max(length, LEAST_DIVISOR) if length else 0.0)
    if rate == 0.0:
        return float_text(start)
    since = ".t" if first == origin else f"(.t - {time_text(Fraction(first - origin) / fps)})"
    if start == 0.0:
        return f"{float_text(rate)}*{since}"
    return f"{float_text(start)} {'-' if rate < 0.0 else '+'} {float_text(abs(rate))}*{since}"


def _round(value: float, tolerance: float) -> float:
    """A number of at most 12 digits within the tolerance, if there is one."""
    short = float(f"{value:.12g}")
    if abs(value) <= tolerance:
        return 0.0
    return short if abs(short - value) <= tolerance else value
