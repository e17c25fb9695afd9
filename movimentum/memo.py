"""Memoised results, keyed by everything that they depend on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from itertools import count
from threading import Lock
from typing import Any, TypeVar

T = TypeVar("T")

_NUMBERS = count(1)


class Memo:
    """Values of several kinds, each by a key with everything that was read to find it. What none of the last
    ``generations`` has asked for is forgotten.

    Threads may share it. ``made`` counts, for each kind, the values that had to be found.
    """

    def __init__(self, generations: int) -> None:
        self.made: Counter[str] = Counter()
        self._generations = generations
        self._generation = 0
        self._values: dict[tuple[str, Hashable], tuple[Any, int]] = {}
        self._lock = Lock()

    def __len__(self) -> int:
        """How many values there are."""
        return len(self._values)

    def begin(self) -> None:
        """Another generation begins."""
        with self._lock:
            self._generation += 1
            oldest = self._generation - self._generations
            for key in [key for key, (_, used) in self._values.items() if used < oldest]:
                del self._values[key]

    def get(self, kind: str, key: Hashable) -> Any | None:
        """The value of this kind under ``key``, or None."""
        whole = kind, key
        with self._lock:
            found = self._values.get(whole)
            if found is None:
                return None
            self._values[whole] = found[0], self._generation
            return found[0]

    def keep(self, kind: str, key: Hashable, value: T) -> T:
        """Keep ``value``, which had to be found, and return it."""
        with self._lock:
            self.made[kind] += 1
            self._values[kind, key] = value, self._generation
        return value

    def of(self, kind: str, key: Hashable, find: Callable[[], T]) -> T:
        """The value of this kind under ``key``, by ``find`` where there is none yet."""
        found: T | None = self.get(kind, key)
        return self.keep(kind, key, find()) if found is None else found

    def number(self, key: Hashable) -> int:
        """A number that stands for ``key``, and for no other: a key of keys is then as short as they are many."""
        return self.of("number", key, _NUMBERS.__next__)
