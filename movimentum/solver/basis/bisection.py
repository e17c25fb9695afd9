"""When something ends that holds at first, by halving the interval, to the last digit."""

from __future__ import annotations

from collections.abc import Callable

HALVINGS = 60
"""More than a float has digits, for an interval that is not much shorter than its ends."""


def bisected(holds: Callable[[float], bool], good: float, bad: float) -> tuple[float, float]:
    """Two neighbouring numbers between ``good``, where something ``holds``, and ``bad`` above it, where it does not:
    again one where it does, and one where it does not.
    """
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        if not good < middle < bad:
            break
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good, bad
