"""Sorted values without repeats.

`numpy.unique` and what is made of it load `numpy.ma` when they are called first, which takes longer than following a
four-bar.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", bound=np.generic)


def distinct(values: NDArray[Number]) -> NDArray[Number]:
    """All different ``values`` (any shape, none of them nan) in ascending order."""
    ordered: NDArray[Number] = np.sort(values, axis=None)
    kept = np.ones(len(ordered), dtype=np.bool_)
    kept[1:] = ordered[1:] != ordered[:-1]
    return ordered[kept]


def without(values: NDArray[Number], others: NDArray[Any]) -> NDArray[Number]:
    """The different ``values`` that are none of the ``others`` (ascending, at least one), in ascending order."""
    some = distinct(values)
    place = np.minimum(np.searchsorted(others, some), len(others) - 1)
    return some[others[place] != some]
