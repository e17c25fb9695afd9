"""What Python callers may write where the command line has an option: numbers, frames, words."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from numbers import Rational, Real
from typing import TypeVar

from movimentum.errors import usage_error
from movimentum.syntax.suggest import nearest
from movimentum.workflow.choices import FrameChoice
from movimentum.workflow.limits import MAX_DIGITS, MAX_FRAMES, MAX_NESTING, MAX_OPERATIONS, MAX_PIXELS

Number = int | float | Fraction | str
"""A number that is meant exactly: a float stands for its shortest spelling (0.1 is a tenth), "1/3" for a third."""

Choice = TypeVar("Choice", bound=StrEnum)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a script may cost before it is refused, given to `load` and `loads`.

    ``frames`` of an animation, ``pixels`` of a picture, ``nesting`` of brackets and functions, ``operations`` in one
    expression, ``digits`` for ``accuracy="exact"``.

    >>> import movimentum as mv
    >>> script = mv.loads(".config(25); @0 x = 3*.t; @40", mv.Limits(frames=1000))
    >>> script.solve()
    Traceback (most recent call last):
        ...
    movimentum.errors.ScriptError: ...1,001 frames...
    """

    frames: int = MAX_FRAMES
    pixels: int = MAX_PIXELS
    nesting: int = MAX_NESTING
    operations: int = MAX_OPERATIONS
    digits: int = MAX_DIGITS


def exact(value: Number | Real, what: str) -> Fraction:
    """A number as a fraction; `UsageError` (``usage/number``) for anything else, infinities too."""
    try:
        if isinstance(value, str):
            return Fraction(value.strip())
        if isinstance(value, Rational):
            return Fraction(int(value.numerator), int(value.denominator))
        return Fraction(repr(float(value)))  # NumPy's floats too
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise usage_error("usage/number", f"{what} is a number such as 12, 2.5 or '1/3', not {value!r}") from None


def frame_rate(value: Number | None) -> Fraction | None:
    """Frames per time unit; None stays None (the script's own)."""
    if value is None:
        return None
    found = exact(value, "fps")
    if found <= 0:
        raise usage_error("usage/number", f"fps is greater than 0, not {value!r}")
    return found


def one_of(kind: type[Choice], value: str, what: str) -> Choice:
    """The member of ``kind`` that ``value`` names; `UsageError` (``usage/choice``) where it names none."""
    try:
        return kind(value)
    except ValueError:
        guess = nearest(str(value), [item.value for item in kind])
        known = ", ".join(f'"{item.value}"' for item in kind)
        helps = (f'did you mean "{guess}"?',) if guess else (f"one of {known}",)
        raise usage_error("usage/choice", f"there is no {what} {value!r}", *helps) from None


def words(value: str | Iterable[str]) -> tuple[str, ...]:
    """``"names,free"`` or any collection of words."""
    items = value.split(",") if isinstance(value, str) else value
    return tuple(word.strip() for word in items if word.strip())


def frame_choice(value: slice | range | int | str | None) -> FrameChoice | None:
    """Some frames: ``slice(12, 48)``, ``range(12, 48)``, ``7`` or ``"12:48"``, counted as Python counts."""
    if value is None:
        return None
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([+-]?\d{1,18})?\s*(:)?\s*([+-]?\d{1,18})?\s*", value)
        if match is None or (match[2] is None and (match[1] is None or match[3] is not None)):
            raise usage_error("usage/frames", f"{value!r} is not a range of frames such as '0:48', '48:' or '7'")
        if match[2] is None:
            return frame_choice(int(match[1]))
        value = slice(*(None if part is None else int(part) for part in (match[1], match[3])))
    if isinstance(value, int):
        value = slice(value, value + 1 or None)
    if isinstance(value, range):
        value = slice(value.start, value.stop, value.step)
    if value.step not in (None, 1):
        raise usage_error("usage/frames", "frames follow one another: a range of them has no step")
    start, stop = value.start, value.stop

    def chosen(count: int) -> tuple[int, int]:
        first, end, _ = slice(start, stop).indices(count)
        return first, max(first, end)

    return chosen


def positive(value: float, what: str) -> float:
    """A finite number greater than 0; `UsageError` (``usage/number``) for any other."""
    found = float(value)
    if not 0.0 < found < math.inf:
        raise usage_error("usage/number", f"{what} is a number greater than 0, not {value!r}")
    return found
