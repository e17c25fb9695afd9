"""What Python callers may write where the command line has an option: numbers, frames, words."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable, Mapping
from enum import StrEnum
from fractions import Fraction
from numbers import Rational, Real
from typing import Any, Literal, SupportsIndex, TypeGuard, TypeVar

from movimentum.errors import usage_error
from movimentum.records import dataclass
from movimentum.syntax.suggest import nearest
from movimentum.workflow.choices import FrameChoice
from movimentum.workflow.limits import (
    LARGEST_NESTING,
    MAX_DIGITS,
    MAX_FRAMES,
    MAX_NESTING,
    MAX_OPERATIONS,
    MAX_PIXELS,
)

Number = int | float | Fraction | str
"""A number that is meant exactly: a float stands for its shortest spelling (0.1 is a tenth), "1/3" for a third."""

Measured = Mapping[str, str] | str | tuple[str, ...] | list[str]
"""Measures: expressions by name, or texts such as ``"stroke = .range(Rod.B.x)"``."""

QualityWord = Literal["draft", "standard", "high"]
ShowWord = Literal["names", "free", "anchors"]

Frames = slice | range | int | str
"""Some frames: ``slice(12, 48)``, ``range(12, 48)``, ``7`` or ``"12:48"``, counted as Python counts."""

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

    def __post_init__(self) -> None:
        for name in self.__slots__:
            most = LARGEST_NESTING if name == "nesting" else None
            whole(getattr(self, name), f"`Limits`: `{name}`", 1, most)


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


def several(value: object) -> TypeGuard[Iterable[Any]]:
    """Whether ``value`` holds several; a text or an array without axes is one."""
    return isinstance(value, Iterable) and not isinstance(value, str) and getattr(value, "ndim", 1) > 0  # pyright: ignore[reportUnknownArgumentType]


def cluster_client(value: object) -> None:
    """`UsageError` (``usage/argument``) for what is no `distributed.Client`, and not None either."""
    if value is not None and not (hasattr(value, "submit") and hasattr(value, "scheduler")):
        example = 'distributed.Client("tcp://scheduler:8786")'
        raise usage_error("usage/argument", f"`client` is a `distributed.Client`, not {value!r:.60}", example)


def one_of(kind: type[Choice], value: str, what: str) -> Choice:
    """The member of ``kind`` that ``value`` names; `UsageError` (``usage/choice``) where it names none."""
    try:
        return kind(value)
    except ValueError:
        guess = nearest(str(value), [item.value for item in kind])
        known = ", ".join(f'"{item.value}"' for item in kind)
        helps = (f'did you mean "{guess}"?',) if guess else (f"one of {known}",)
        raise usage_error("usage/choice", f"there is no {what} {value!r}", *helps) from None


def words(value: str | Iterable[str], what: str) -> tuple[str, ...]:
    """``"names,free"`` or any collection of words; `UsageError` (``usage/argument``) for what is no word."""
    items: list[Any] = value.split(",") if isinstance(value, str) else list(value)
    for word in items:
        if not isinstance(word, str):
            raise usage_error("usage/argument", f"`{what}` is a text, or several, not {word!r}")
    return tuple(word.strip() for word in items if word.strip())


def frame_choice(value: Frames | None) -> FrameChoice | None:
    """The frames that `Frames` tells; `UsageError` (``usage/frames``) for a step, and for what is no frame."""
    if value is None:
        return None
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([+-]?\d{1,18})?\s*(:)?\s*([+-]?\d{1,18})?\s*", value)
        if match is None or (match[2] is None and (match[1] is None or match[3] is not None)):
            raise usage_error("usage/frames", f"{value!r} is not a range of frames such as '0:48', '48:' or '7'")
        if match[2] is None:
            return frame_choice(int(match[1]))
        value = slice(*(None if part is None else int(part) for part in (match[1], match[3])))
    if not isinstance(value, slice | range):
        first = operator.index(value)
        value = slice(first, first + 1 or None)
    if value.step not in (None, 1):
        raise usage_error("usage/frames", "frames follow one another: a range of them has no step")
    start, stop = value.start, value.stop
    if not all(part is None or isinstance(part, SupportsIndex) for part in (start, stop)):
        raise usage_error("usage/frames", f"frames are whole numbers: {value!r} has others")

    def chosen(count: int) -> tuple[int, int]:
        first, end, _ = slice(start, stop).indices(count)
        return first, max(first, end)

    return chosen


def whole(value: object, what: str, least: int, most: int | None = None) -> int:
    """A whole number from ``least`` to ``most``; `UsageError` (``usage/number``) for any other."""
    found = operator.index(value) if isinstance(value, SupportsIndex) and not isinstance(value, bool) else None
    if found is None or found < least or (most is not None and found > most):
        bounds = f"of at least {least}" if most is None else f"from {least} to {most:,}"
        raise usage_error("usage/number", f"{what} is a whole number {bounds}, not {value!r}")
    return found


def positive(value: float, what: str) -> float:
    """A finite number greater than 0; `UsageError` (``usage/number``) for any other."""
    found = float(value)
    if not 0.0 < found < math.inf:
        raise usage_error("usage/number", f"{what} is a number greater than 0, not {value!r}")
    return found
