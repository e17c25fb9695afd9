"""What was found before, kept as long as somebody needs it."""

from __future__ import annotations

from collections.abc import Hashable
from threading import Lock
from typing import Generic, TypeVar

T = TypeVar("T")


class Kept(Generic[T]):
    """Values by everything that they depend on. What none of the last ``generations`` has asked for is forgotten.

    Threads may share it. ``made`` counts the values that had to be found.
    """

    def __init__(self, generations: int) -> None:
        self.made = 0
        self._generations = generations
        self._generation = 0
        self._values: dict[Hashable, tuple[T, int]] = {}
        self._lock = Lock()

    def __len__(self) -> int:
        """How many values are kept."""
        return len(self._values)

    def begin(self) -> None:
        """Another generation begins."""
        with self._lock:
            self._generation += 1
            oldest = self._generation - self._generations
            for key in [key for key, (_, used) in self._values.items() if used < oldest]:
                del self._values[key]

    def get(self, key: Hashable) -> T | None:
        """The value under ``key``, if it is kept."""
        with self._lock:
            found = self._values.get(key)
            if found is None:
                return None
            self._values[key] = found[0], self._generation
            return found[0]

    def keep(self, key: Hashable, value: T) -> None:
        """Keep ``value``, which had to be found."""
        with self._lock:
            self.made += 1
            self._values[key] = value, self._generation
