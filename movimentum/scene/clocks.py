"""Names without a dot that look like clocks and constants."""

from __future__ import annotations

from movimentum.syntax.words import CLOCKS

_MEANT = {clock: clock for clock in CLOCKS} | {"time": "t"}


def clock_meant(name: str) -> str | None:
    """The clock or constant that a name without a dot probably means (``t``, ``Pi``, ``time``); None for any other."""
    return _MEANT.get(name) or (_MEANT.get(name.lower()) if len(name) > 1 else None)
