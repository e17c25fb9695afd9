"""Angles as multiples of others."""

from __future__ import annotations

import math
from collections.abc import Hashable
from fractions import Fraction

HIGHEST = 24
"""The largest multiple of an angle that is written in that of its unit: 30 and 30.001 have none in common."""
CLOCK, DEGREE = "clock", "degree"

Form = dict[Hashable, Fraction]
"""An angle: multiples of sources, and degrees under None. `CLOCK` is the time, `DEGREE` a number of degrees whose
sine is taken as free."""


def sum_of(a: Form, b: Form, factor: Fraction) -> Form:
    """a + factor b."""
    found = dict(a)
    for source, share in b.items():
        found[source] = found.get(source, Fraction(0)) + factor * share
    return {source: share for source, share in found.items() if share}


def common_bases(requests: dict[Hashable, set[Fraction]]) -> dict[Hashable, Fraction]:
    """For each source with several shares the one that all are multiples of, unless these are too high."""
    found: dict[Hashable, Fraction] = {}
    for source, shares in requests.items():
        if len(shares) > 1:
            denominator = math.lcm(*(share.denominator for share in shares))
            base = Fraction(math.gcd(*(int(share * denominator) for share in shares)), denominator)
            split = source == DEGREE and 30 % base == 0 and 15 / base <= HIGHEST  # see `Lowering._exact`
            if split or max(shares) / base <= HIGHEST:
                found[source] = base
    return found
