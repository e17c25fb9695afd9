"""The known and the open values of a file of formulas: inputs, the number of frames, the first pose."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.interop.formulas import FPS, Formulas, evaluate, literal
from movimentum.records import replace
from movimentum.tolerances import FASTEST_RATE, SIMPLE_RATE

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
