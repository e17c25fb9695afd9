"""The two sides of the studio's protocol, and the base of all messages."""

from __future__ import annotations

from typing import ClassVar, dataclass_transform

from movimentum.records import dataclass

Point2 = tuple[float, float]
"""A world point as JSON has it."""


@dataclass_transform(frozen_default=True)
class Message:
    """A message of one kind; ``kinds`` has the classes of a side by their kinds."""

    kind: ClassVar[str]
    kinds: ClassVar[dict[str, type]]

    def __init_subclass__(cls, kind: str = "") -> None:
        if not kind:  # a side
            cls.kinds = {}
            return
        cls.kind = kind
        cls.kinds[kind] = dataclass(frozen=True)(cls)


class FromPage(Message):
    """A message from a page to the server."""


class ToPage(Message):
    """A message from the server to a page."""
