"""Answers with the data that they are the words for, and as JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from enum import Enum
from fractions import Fraction
from typing import Any, cast

import numpy as np

from movimentum.diagnostics import Fix

LEFT_OUT = frozenset({"pose", "edits", "tried_on"})
"""Fields of data that are for programs inside: whole poses, places in a text."""


class AnswerWithData(str):
    """An answer in words, and its ``data``: records, numbers, lists of them."""

    __slots__ = ("data",)
    data: Any

    def __new__(cls, text: str, data: Any) -> AnswerWithData:
        """``text`` with its ``data``."""
        made = super().__new__(cls, text)
        made.data = data
        return made


def plain_data(value: Any) -> Any:
    """Data as JSON has it: records are objects, exact times are numbers, what is no finite number is null."""
    match value:
        case AnswerWithData():
            return plain_data(value.data)
        case Enum():
            return value.value
        case None | bool() | int() | str():
            return value
        case Fraction():
            return float(value)
        case float():
            return value if math.isfinite(value) else None
        case np.ndarray() | np.generic():
            return plain_data(value.tolist())  # pyright: ignore[reportUnknownArgumentType]
        case Fix():
            return value.title
        case dict():
            items = cast("dict[Any, Any]", value)
            return {str(key): plain_data(item) for key, item in items.items()}
        case list() | tuple():
            return [plain_data(item) for item in cast("Sequence[Any]", value)]
        case _ if dataclasses.is_dataclass(value) or hasattr(value, "__dataclass_fields__"):
            names = [name for name in value.__dataclass_fields__ if name not in LEFT_OUT]
            return {name: plain_data(getattr(value, name)) for name in names}
        case _:
            return str(value)


Problem = list[dict[str, Any]]
"""Diagnostics as `check --format json` has them."""


def as_json(command: str, time: float | None, answer: str | None, problem: Problem | None) -> str:
    """The line about one command: ``answer`` has its text and data, ``diagnostics`` why it could not be done."""
    line: dict[str, Any] = {"command": command, "done": problem is None, "time": time}
    if answer is not None:
        line["text"] = str(answer)
        if isinstance(answer, AnswerWithData):
            line["answer"] = plain_data(answer)
    if problem is not None:
        line["diagnostics"] = problem
    return json.dumps(line, ensure_ascii=False)
