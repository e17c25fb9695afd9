"""The letters of texts with changing numbers, for every frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from movimentum.scene.shown import Piece, formatted, text_number
from movimentum.solver.poses import Poses

UNKNOWN = "–"
"""The text for a number without a value."""


def written(pieces: Sequence[Piece], thing: int, poses: Poses) -> list[str]:
    """The text of thing number ``thing`` in every frame."""
    count = len(poses.frames)
    columns: list[list[str]] = []
    number = 0
    for piece in pieces:
        if isinstance(piece, str):
            columns.append([piece] * count)
            continue
        values = poses.properties.get((thing, text_number(number)))
        columns.append([UNKNOWN] * count if values is None else [number_text(v, piece.spec) for v in values.tolist()])
        number += 1
    return ["".join(letters) for letters in zip(*columns, strict=True)] if columns else [""] * count


def number_text(value: Any, spec: str) -> str:
    """A number as Python's format ``spec`` writes it; a zero has no sign, and no value is a dash."""
    if not isinstance(value, float | int):  # a number of a living figure
        return value.written(number_text(value.value, spec), spec)
    if not math.isfinite(value):
        return UNKNOWN
    text = formatted(value, spec)
    digits = "123456789abcdefABCDEF" if spec[-1:] in ("x", "X") else "123456789"
    return formatted(0.0, spec) if value <= 0.0 and not any(digit in digits for digit in text) else text
