"""Numbers, times and lists as diagnostics show them."""

from __future__ import annotations

from collections.abc import Sequence


def number(value: float, digits: int = 4) -> str:
    """A value for people: up to ``digits`` significant digits, no trailing zeros, never ``-0``."""
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
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
    """``1 constraint``, ``2 constraints``."""
    return f"{count} {noun if count == 1 else plural or noun + 's'}"
