"""MeasureSet: one number for a variant, from expressions of the language that are reduced over time.

``.max(Foot.x) - .min(Foot.x)``: a *reduction* makes one number of an expression's values in all frames, and around
reductions any expression of the language may stand. The text is split here; what it means is left to the language: an
expression is read as it would be in a claim of the first step.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import UsageError, usage_error
from movimentum.text import rational

_NAMED = re.compile(r"\s*([A-Za-z][A-Za-z0-9_ ]*?)\s*=(?!=)(.*)", re.ASCII | re.DOTALL)
PLACE = "reductionNumber"
"""Begins the names that stand for reductions in the text around them."""


class Reduction(StrEnum):
    """What makes one number of an expression's values in all frames."""

    MIN = "min"
    MAX = "max"
    MEAN = "mean"
    RMS = "rms"
    RANGE = "range"
    FIRST = "first"
    LAST = "last"
    AT = "at"
    MARGIN = "margin"


_WORD = re.compile(rf"\.({'|'.join(Reduction)})\s*\(", re.ASCII)


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
    names = {*taken, "outcome", "time"}
    for given in texts:
        if isinstance(given, tuple):
            name, text = given
        else:
            named = _NAMED.fullmatch(given)
            name, text = (named[1], named[2].strip()) if named else (given.strip(), given.strip())
        if not text:
            raise wrong(name, "there is no expression", example(name))
        if name in names:
            what = "a constant that varies" if name in taken else "a column of its own"
            what = "another measure" if any(measure.name == name for measure in measures) else what
            raise wrong(text, f"there is {what} called `{name}` already", f"--measure 'my_{name} = {text}'")
        names.add(name)
        measures.append(Measure(name, text, _split(text, parts)))
    return MeasureSet(tuple(measures), tuple(parts))


def wrong(text: str, message: str, *helps: str) -> UsageError:
    """That a measure makes no sense."""
    return usage_error("usage/measure", f"the measure `{text}`: {message}", *helps)


def example(name: str = "stroke") -> str:
    """A measure that can be typed."""
    word = name if re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) else "stroke"
    return f"--measure '{word} = .max(Rod.B.x) - .min(Rod.B.x)'"


def retold(text: str, item: Diagnostic) -> UsageError:
    """A diagnostic about an expression in a measure."""
    message = f"the measure `{text}`: {item.message}"
    return UsageError([Diagnostic(item.code, Severity.ERROR, message, helps=item.helps)])


def _split(text: str, parts: dict[ReducedPart, int]) -> str:
    """``text`` with a name in place of each reduction; these are added to ``parts``."""
    made: list[str] = []
    place = 0
    while True:
        found = _WORD.search(text, place)
        if found is None:
            made.append(text[place:])
            return "".join(made)
        end = _closing(text, found.end() - 1)
        inside = [part.strip() for part in _arguments(text[found.end() : end])]
        kind = Reduction(found[1])
        if kind in (Reduction.MIN, Reduction.MAX) and len(inside) > 1:  # the smaller or larger of several
            made.append(text[place : found.end()])
            place = found.end()
            continue
        before = text[place : found.start()]
        if kind is Reduction.AT and len(inside) == 1:
            begin = _operand(before)
            part = _at(text, before[begin:], inside[0])
            before = before[:begin]
        elif kind is Reduction.AT and len(inside) == 2:
            part = _at(text, *inside)
        elif kind is Reduction.MARGIN:
            part = ReducedPart(kind, claim=_claim(text, inside))
        elif len(inside) != 1 or not inside[0]:
            raise wrong(text, f"`.{kind}(…)` takes one expression", example())
        else:
            part = ReducedPart(kind, inside[0])
        nested = _WORD.search(part.text)
        if nested is not None and len(_arguments(part.text[nested.end() : _closing(part.text, nested.end() - 1)])) < 2:
            raise wrong(text, f"`{part.text}` is reduced already, so `.{kind}(…)` has nothing to do", example())
        number = parts.setdefault(part, len(parts))
        made += [before, f"{PLACE}{number}"]
        place = end + 1


def _closing(text: str, opening: int) -> int:
    """The place of the bracket that closes the one at ``opening``."""
    depth = 0
    for place in range(opening, len(text)):
        if text[place] in "([{":
            depth += 1
        elif text[place] in ")]}":
            depth -= 1
            if depth == 0:
                return place
    raise wrong(text, "a bracket is not closed", example())


def _arguments(text: str) -> list[str]:
    """The parts of a list of arguments."""
    parts, depth, begin = list[str](), 0, 0
    for place, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0:
            parts.append(text[begin:place])
            begin = place + 1
    return [*parts, text[begin:]]


def _operand(text: str) -> int:
    """Where the value begins at the end of ``text``: a name with its members, or what stands in brackets."""
    place = len(text.rstrip())
    while place > 0:
        letter = text[place - 1]
        if letter in ")]":
            depth = 0
            while place > 0:
                place -= 1
                depth += (text[place] in ")]") - (text[place] in "([")
                if depth == 0:
                    break
        elif letter.isalnum() or letter in "_.":
            place -= 1
        else:
            break
    return place


def _at(text: str, operand: str, when: str) -> ReducedPart:
    time = rational(when, exponents=True)
    if not operand.strip():
        raise wrong(text, "`.at(…)` does not say what is read", f"--measure 'there = .at(Rod.B.x, {when or 0.5})'")
    if time is None:
        raise wrong(text, f"`{when}` is no time, such as 0.5 or 1/3", f"--measure 'there = .at({operand}, 0.5)'")
    return ReducedPart(Reduction.AT, operand.strip(), time=time)


def _claim(text: str, inside: Sequence[str]) -> int | None:
    if list(inside) == [""]:
        return None
    if len(inside) != 1 or not inside[0].isdigit() or int(inside[0]) < 1:
        raise wrong(text, "`.margin(…)` takes the number of a claim, in the order written", "--measure '.margin(1)'")
    return int(inside[0]) - 1
