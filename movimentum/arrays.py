"""What arrays hold, in the words of annotations (shapes stand in docstrings), and the first number of one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def first_of(value: Any) -> float:
    """The first number of an array of any shape; a number itself."""
    return float(value) if isinstance(value, float) else float(np.asarray(value).item(0))
