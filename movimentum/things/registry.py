"""All kinds of things: each module of `movimentum.things.kinds` has one, or several that are nearly the same."""

from __future__ import annotations

import copyreg
from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules

from movimentum.things import kinds
from movimentum.things.kind import ThingKind


def _found() -> dict[str, ThingKind]:
    modules = (import_module(f"{kinds.__name__}.{each.name}") for each in iter_modules(kinds.__path__))
    found = [value for module in modules for value in vars(module).values() if isinstance(value, ThingKind)]
    return {kind.word: kind for kind in sorted(found, key=lambda kind: kind.place)}


KINDS = _found()
"""Word -> kind."""

SHAPES = tuple(word for word in KINDS if word not in ("sprite", "body"))
"""The words of kinds behind a colon: the definition of a picture begins with the file's name, that of a body with its
word.
"""

THING_FLAGS = frozenset(rule.name for kind in KINDS.values() for rule in kind.options if rule.least == 0)
"""Options of things that may have no arguments."""


def kind_of(word: str) -> ThingKind:
    """The kind with a word; KeyError if there is none."""
    return KINDS[word]


def _by_word(kind: ThingKind) -> tuple[Callable[[str], ThingKind], tuple[str]]:
    return kind_of, (kind.word,)


copyreg.pickle(ThingKind, _by_word)  # there is one record of each kind, also in other processes
