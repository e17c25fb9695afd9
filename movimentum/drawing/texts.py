"""Texts whose numbers change: the letters of every frame."""

from __future__ import annotations

import math
from collections.abc import Sequence

from movimentum.scene.appearance import Piece
from movimentum.solver.poses import Poses

UNKNOWN = "–"
"""What is written for a number that has no value."""


def live(number: int) -> str:
    """The name of a thing's number ``number`` among `Poses.properties`: those of its texts, in order."""
    return f"text {number}"


def written(pieces: Sequence[Piece], thing: int, poses: Poses) -> list[str]:
    """The text of thing number ``thing`` in every frame."""
    count = len(poses.frames)
    columns: list[list[str]] = []
    number = 0
    for piece in pieces:
        if isinstance(piece, str):
            columns.append([piece] * count)
            continue
        values = poses.properties.get((thing, live(number)))
        columns.append([UNKNOWN] * count if values is None else [formatted(v, piece.spec) for v in values.tolist()])
        number += 1
    return ["".join(letters) for letters in zip(*columns, strict=True)] if columns else [""] * count


def formatted(value: float, spec: str) -> str:
    """A number as Python's format ``spec`` writes it; a zero has no sign, and no value is a dash."""
    if not math.isfinite(value):
        return UNKNOWN
    if spec[-1:] in _WHOLE:
        return format(round(value), spec)
    text = format(value, spec)
    return format(0.0, spec) if value < 0.0 and not any(digit in "123456789" for digit in text) else text


_WHOLE = frozenset("bcdoxX")
"""Types of formats that Python has for whole numbers only."""
