"""Families with many members: some of them run with every change, the others are marked `slow`."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

import pytest


def broad(
    names: str | tuple[str, ...],
    values: Iterable[Any],
    *,
    first: int | None = None,
    every: int = 1,
    fast: Container[Any] | None = None,
    **options: Any,
) -> pytest.MarkDecorator:
    """`parametrize`, of which the ``first`` members, or one of ``every`` so many, or those whose (first) argument is in
    ``fast``, are quick tests. Members that are marked `slow` already stay so.
    """
    several = not isinstance(names, str) or "," in names

    def member(place: int, value: Any) -> Any:
        given = hasattr(value, "marks")
        arguments = value.values if given else tuple(value) if several else (value,)
        quick = place % every == 0 and (first is None or place < first) and (fast is None or arguments[0] in fast)
        marks = [*(value.marks if given else ()), *([] if quick else [pytest.mark.slow])]
        return pytest.param(*arguments, marks=marks, id=value.id if given else None)

    members = [member(k, value) for k, value in enumerate(values)]
    assert not all(any(mark.name == "slow" for mark in each.marks) for each in members), "no member is quick"
    return pytest.mark.parametrize(names, members, **options)
