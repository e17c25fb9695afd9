"""The options of things: their names, and the arguments that they take.

An option of several kinds is a constant here; one of a single kind is in the module of that kind.
`movimentum.scene.option_reading` reads each form.
"""

from __future__ import annotations

from enum import Enum, auto

from movimentum.records import dataclass


class OptionForm(Enum):
    """The form of an option's value."""

    FLAG = auto()
    COLOR = auto()
    NUMBER = auto()
    POSITIVE = auto()
    WHOLE = auto()
    """A whole number from ``lowest`` to ``highest``."""
    CHOICE = auto()
    """One of ``words``."""
    TEXT = auto()
    NAMES = auto()
    """Names of anchors of the thing."""
    DASH = auto()
    OPACITY = auto()
    PINS = auto()
    THING = auto()
    """The name of a thing."""
    NUMBERS = auto()
    """Several numbers."""
    SIDES = auto()
    """A breadth and a height."""
    ARC = auto()
    """The name of an anchor, and a number or another name."""
    EXPRESSIONS = auto()
    """Expressions, which have a value in every frame."""
    FUNCTION = auto()
    """The name of a parameter, and an expression of it."""
    PLACES = auto()
    """Constant vectors."""
    OUTLINE = auto()
    """Constant vectors, or a text."""


@dataclass(frozen=True, slots=True)
class OptionRule:
    """An option (or an argument) ``name``, which messages call ``what``, with ``least`` to ``most`` arguments.

    ``field``: what its value is called, if not by the name of the option (which means something else for other kinds).
    ``again``: it may be written several times, and its value is a list of these.
    """

    name: str
    form: OptionForm
    what: str = ""
    least: int = 1
    most: int = 1
    lowest: int = 0
    highest: int = 0
    words: tuple[str, ...] = ()
    field: str = ""
    again: bool = False

    @property
    def key(self) -> str:
        """The name of its value."""
        return self.field or self.name


def flag(name: str) -> OptionRule:
    """An option without arguments."""
    return OptionRule(name, OptionForm.FLAG, least=0, most=0)


COLOR = OptionRule("color", OptionForm.COLOR)
WIDTH = OptionRule("width", OptionForm.POSITIVE, "the width")
LAYER = OptionRule("layer", OptionForm.NUMBER, "a layer")
HIDDEN = flag("hidden")
OFFSTAGE = flag("offstage")
"""The thing may leave the canvas."""
OPACITY = OptionRule("opacity", OptionForm.OPACITY, "the opacity")
FILL = OptionRule("fill", OptionForm.COLOR)
EDGE = OptionRule("edge", OptionForm.COLOR)
DASH = OptionRule("dash", OptionForm.DASH, "the length of a dash or a gap", most=8)
CAP = OptionRule("cap", OptionForm.CHOICE, "a cap", words=("butt", "round", "square"))
PINS = OptionRule("pins", OptionForm.PINS, "a pin's radius", least=0)
SUPPORTS = OptionRule("supports", OptionForm.FLAG, least=0, most=0, field="fixed")
FIXED = flag("fixed")
"""The old word for it, which is read as something that keeps a body where it is."""
THROUGH = OptionRule("through", OptionForm.NAMES, most=100_000)
ARCTO = OptionRule("arcto", OptionForm.ARC, least=2, most=2, again=True)
SIZE = OptionRule("size", OptionForm.POSITIVE, "the size")
ITALIC = flag("italic")
TEXT = OptionRule("text", OptionForm.TEXT)
PLACES = OptionRule("places", OptionForm.WHOLE, "the number of decimals", highest=15)
WHOLE = flag("whole")
CLIP = OptionRule("clip", OptionForm.THING)

STILL = flag("still")

LINED = (COLOR, WIDTH, LAYER, HIDDEN, OFFSTAGE, OPACITY, CLIP, STILL)
"""Of whatever has lines."""
AREA = (*LINED, FILL, EDGE, DASH)
"""Of what has an inside."""
JOINTS = (PINS, SUPPORTS, FIXED)
"""Of bodies that can be links."""
WRITTEN = (SIZE, ITALIC, TEXT)
"""Of what has a text beside it."""
