"""Scripts that say nothing about how things look."""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.scene.model import Config, Shape
from movimentum.syntax.tree import Definition, Option

LOOKS = frozenset({"color", "width", "fill", "edge", "dash", "cap", "opacity", "pins", "fixed"})
"""Options that say something about looks."""
_QUIET = frozenset(Shape) - {Shape.SPRITE, Shape.ARROW, Shape.DISC, Shape.LINE}
"""Kinds that a figure of links consists of."""
_LINKS = frozenset({Shape.BAR, Shape.PLATE})


def is_silent(definitions: Sequence[Definition], config: Config, painted: bool) -> bool:
    """Whether a script says nothing about looks and draws nothing but links, and what figures of links have.

    ``painted``: whether a statement is about a colour or an opacity.
    """
    shapes = {
        Shape(definition.shape.word)
        for definition in definitions
        if not any(isinstance(part, Option) and part.name == "hidden" for part in definition.parts)
    }
    options = {part.name for item in definitions for part in item.parts if isinstance(part, Option)}
    silent = config.background is None and not painted and not options & LOOKS
    return silent and shapes <= _QUIET and bool(shapes & _LINKS)
