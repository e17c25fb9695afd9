"""Numbers, times and lists as diagnostics show them, and numbers in the form in which they are typed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction

from movimentum import tolerances

# Short exponents: Fraction("1e999999999") would fill the memory before anybody could say that it is too large.
_RATIONAL = re.compile(r"([+-]?)(\d{1,30}(?:\.\d{0,30})?|\.\d{1,30})([eE][+-]?\d{1,2})?(?:/(\d{1,30}))?", re.ASCII)


LEVELS = {"_": "\ufff9", "^": "\ufffa"}
"""What begins lower letters (an index) and raised ones in a text that is drawn."""
RAISED = re.compile(r"[_^]\{([^{}:.()\[\]]+)\}")
"""Letters, no expression (which has a point, a bracket or a format)."""
LEVEL = "\ufffb"
"""What ends them."""
_PLAIN = frozenset("ΆΌ–—…−→←" + "".join(LEVELS.values()) + LEVEL).union(
    *(map(chr, range(ord(first), ord(last) + 1)) for first, last in (" ~", "¡¬", "®ſ", "ΈΊ", "ΎΡ", "Σώ", "Ѐџ"))
)


def is_plain(text: str) -> bool:
    """Whether all letters of a text are in the fonts that belong to the project."""
    return _PLAIN.issuperset(text)


def raised(text: str) -> str:
    """A text as it is drawn: with the marks of lower and raised letters (`F_{12}`, `x^{2}`)."""
    return RAISED.sub(lambda match: LEVELS[match[0][0]] + match[1] + LEVEL, text) if "{" in text else text


def unraised(text: str) -> str:
    """A text without the marks of lower and raised letters."""
    return text.translate(_NO_LEVELS) if max(text, default="") >= "\ufff9" else text


_NO_LEVELS = dict.fromkeys(map(ord, (*LEVELS.values(), LEVEL)))


def number(value: float, digits: int = 4) -> str:
    """A value for people: up to ``digits`` significant digits, no trailing zeros, never ``-0``."""
    text = f"{value:.{digits}g}"
    if "e" in text and tolerances.SHORTEST_DECIMAL <= abs(value) < 1e7:
        text = f"{value:.0f}"
    return "0" if text in ("-0", "0") else text


def time_text(value: float) -> str:
    """A time: enough digits to find it again."""
    return number(value, 10)


def listed(items: Sequence[str], most: int = 6) -> str:
    """``a``, ``a and b``, ``a, b and c``; a long list ends in "and 3 more"."""
    if len(items) > most:
        return ", ".join(items[: most - 1]) + f" and {len(items) - most + 1} more"
    if len(items) < 2:
        return "".join(items)
    return ", ".join(items[:-1]) + " and " + items[-1]


def counted(count: int, noun: str, plural: str | None = None) -> str:
    """``1 constraint``, ``2,000 constraints``."""
    return f"{count:,} {noun if count == 1 else plural or noun + 's'}"


def rational(text: str, *, exponents: bool = False) -> Fraction | None:
    """The number that ``text`` spells (``12``, ``2.5``, ``24000/1001``, with ``exponents`` ``1e-3`` too), exactly.

    None if it is not a number, or has more than 30 digits or an exponent of more than two.
    """
    match = _RATIONAL.fullmatch(text.strip())
    if match is None or (match[3] and not exponents) or (match[4] is not None and int(match[4]) == 0):
        return None
    return Fraction(match[1] + match[2] + (match[3] or "")) / int(match[4] or 1)


def fraction_text(value: Fraction) -> str:
    """A whole number as it is, any other (or a huge one) with six digits."""
    return str(value) if value.denominator == 1 and abs(value) < 10**9 else f"{float(value):.6g}"


def frame_range(text: str) -> slice | None:
    """``A:B``, ``A:``, ``:B``, or ``A`` for that one frame, counted as Python counts; None for anything else."""
    match = re.fullmatch(r"\s*([+-]?\d{1,18})?\s*(:)?\s*([+-]?\d{1,18})?\s*", text)
    if match is None or (match[2] is None and (match[1] is None or match[3] is not None)):
        return None
    first, end = (None if part is None else int(part) for part in (match[1], match[3]))
    return slice(first, end) if match[2] is not None or first is None else slice(first, first + 1 or None)
