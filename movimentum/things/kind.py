"""The record for a kind of thing, and the final look of a thing."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any, TypeAlias

from movimentum.records import dataclass
from movimentum.things.colors import INK, PALE
from movimentum.things.option_rules import OptionRule

Color: TypeAlias = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""


class Valued(IntEnum):
    """The roles of a word's arguments if they are expressions, which have a value in every frame."""

    NOTHING = 0
    NUMBERS = 1
    VELOCITIES = 2
    """Points, of which the velocities are shown."""
    DETAIL = 3
    """A point and a number."""


@dataclass(frozen=True, slots=True)
class Own:
    """What only things of one kind have; a kind that has something derives its own class from this one. Its fields are
    named after the options and arguments that state them.
    """

    @property
    def of_film(self) -> bool:
        """Whether a picture of one frame depends on the whole film."""
        return False


@dataclass(frozen=True, slots=True, eq=False)
class ThingKind:
    """Everything that is particular to a kind of thing, except how it is drawn (`movimentum.drawing`).

    ``word``: as after the dot; ``place``: its place among the kinds, in messages. ``called``: how messages speak of it,
    if that is not its word. ``arguments`` of the word, ``options``, and the class ``own`` of what these make. Lengths
    are in world pixels.

    A *body* has ``anchors`` of its own, at least so many (None: no body). What follows other things is drawn at
    ``points`` (least, most; None: no end) anchors of theirs. A kind may be both: then a thing with an anchor is a body.

    ``width``, ``size``, ``ink``: where a definition does not state them; the ``width`` is that of lines, or of what is
    ``broad`` around an anchor. ``inside``: whether it has an inside and an edge whatever its options; then its ink is
    pale. ``broad``: the width that themes give it, in widths of links; 0 leaves it as it is. ``link``: it has pins at
    its joints in themes; ``supported``: and supports where it is fixed. ``filled``: themes colour its inside, in turn.
    ``accented``: it has a theme's accent colour. ``plain``: a script that says nothing about looks may have it.
    ``surface``: it is filled although it follows others. ``wholes`` (least, most): it is about so many things, not
    about their anchors; if it ``gathers``, about any things. ``cuts``: other things may be shown only inside it.
    ``followed``: letters may stand along it. ``valued``: its arguments are expressions. ``beside``: it is beside the
    film: the camera leaves it where it is unless a statement mentions it. ``loose``: a canvas without a size does not
    become larger for it. ``attached``: pins are drawn at its ends. ``under``: everything else is drawn over it.
    ``of_film``: its picture depends on the whole film.
    """

    word: str
    place: int
    options: tuple[OptionRule, ...]
    anchors: int | None = 1
    points: tuple[int, int | None] | None = None
    called: str | None = None
    arguments: tuple[OptionRule, ...] = ()
    own: Callable[..., Own] = Own
    width: float = 2.0
    size: float = 16.0
    ink: Color = INK
    inside: bool = False
    broad: float = 0.0
    link: bool = False
    supported: bool = False
    filled: bool = False
    surface: bool = False
    wholes: tuple[int, int] | None = None
    gathers: bool = False
    followed: bool = False
    cuts: bool = False
    valued: Valued = Valued.NOTHING
    beside: bool = False
    loose: bool = False
    accented: bool = False
    plain: bool = True
    attached: bool = False
    under: bool = False
    of_film: bool = False

    def __str__(self) -> str:
        return self.word

    @property
    def article(self) -> str:
        """``a`` or ``an``."""
        return "an" if self.word[0] in "aeio" else "a"

    @property
    def written(self) -> str:
        """As messages about its definition speak of it: ``a `.bar```."""
        return self.called or f"{self.article} `.{self.word}`"

    @property
    def main_ink(self) -> Color:
        """The main colour of a thing whose definition names none (of what has an inside: what is inside)."""
        return PALE if self.inside else self.ink

    def made(self, read: dict[str, Any]) -> Own:
        """The values of ``read`` (by the name of the option) that are its own; none without its arguments."""
        if any(rule.name not in read for rule in self.arguments):
            return Own()
        fields: tuple[str, ...] = getattr(self.own, "__slots__", ())
        return self.own(**{name: read[name] for name in fields if name in read})


@dataclass(frozen=True, slots=True)
class ArcEdge:
    """An edge that is an arc to anchor number ``end``: through anchor number ``through``, or ``bulge`` lengths of its
    chord high, to the right of it (as the definition is written).
    """

    end: int
    through: int | None
    bulge: float = 0.0


@dataclass(frozen=True, slots=True)
class Look:
    """How a thing looks, all decided: by its definition, else by the theme, else by its kind. Lengths in world pixels.

    ``paint``: the main colour, which statements about colours change: what is inside, if there is an inside, else the
    lines; of a picture its tint. ``color``, ``fill`` and ``outline`` (the width) are None where neither the definition
    nor the theme says anything; a bar with an ``edge`` is an outlined link. ``width``: of lines, or of what is as broad
    as that around an anchor. ``size``: the height of letters, or the breadth of a symbol. ``pins``: the radius of
    circles at joints, with ``pin_fill`` inside. ``ink``: the theme's, of lines. ``drawn``: the anchors (by number) that
    the thing is drawn through; ``arcs``: edges between them that are not straight. ``still``: the camera does not move
    it. ``layer`` None: by order of definition. ``curves``: colours of a graph's curves behind its first one, in turn
    (none: the usual ones). ``breadth``: the width that the definition states, which things touch with: no theme has a
    say in that.
    """

    paint: Color = INK
    color: Color | None = None
    fill: Color | None = None
    edge: Color | None = None
    edge_width: float = 1.6
    width: float = 2.0
    outline: float | None = None
    size: float = 16.0
    dash: tuple[float, ...] = ()
    cap: str = "round"
    opacity: float = 1.0
    pins: float | None = None
    pin_fill: Color = (255, 255, 255)
    ink: Color | None = None
    drawn: tuple[int, ...] | None = None
    arcs: tuple[ArcEdge, ...] = ()
    fixed: bool = False
    align: str = "left"
    italic: bool = False
    layer: float | None = None
    hidden: bool = False
    still: bool = False
    offstage: bool = False
    curves: tuple[Color, ...] = ()
    breadth: float | None = None
