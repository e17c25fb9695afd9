"""Message texts that name a choice outside the script: a limit, the frames, the accuracy.

Each front end has its own word for such a choice: the command line an option, Python a keyword, the studio a control.
So the library states a `Choose` and a value, and `Advised` keeps them apart from the rest of the text.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import SupportsIndex

from movimentum.records import dataclass


class Choose(Enum):
    """Choices, by their words on the command line."""

    ACCURACY = "accuracy"
    AT = "at"
    BACKGROUND = "background"
    CERTIFY = "certify"
    DASK = "dask"
    DRIVE = "drive"
    FORMAT = "format"
    FPS = "fps"
    FRAMES = "frames"
    HOLE = "hole"
    LIVE = "live"
    LOSSY = "lossy"
    MAX_DIGITS = "max-digits"
    MAX_FRAMES = "max-frames"
    MAX_NESTING = "max-nesting"
    MAX_OPERATIONS = "max-operations"
    MAX_PIXELS = "max-pixels"
    MAX_VARIANTS = "max-variants"
    MEASURE = "measure"
    OF = "of"
    ON_FAILURE = "on-failure"
    OUTPUT = "output"
    PLOT = "plot"
    QUALITY = "quality"
    RESUME = "resume"
    SAMPLE = "sample"
    SCALE = "scale"
    SECONDS = "seconds"
    SET = "set"
    SHEET = "sheet"
    SHOW = "show"
    SNAP = "snap"
    SNAP_ANGLE = "snap-angle"
    THICKNESS = "thickness"
    TRACE = "trace"
    VARY = "vary"
    WORKERS = "workers"

    def to(self, value: object = "") -> Advised:
        """The advice to choose ``value`` (as one would type it in a shell); without one, the option's name."""
        return Advised(Setting(self, str(value)))


class ScriptCommand(Enum):
    """Commands for a script, by their words on the command line."""

    CHECK = "check"
    FIT = "fit"
    SWEEP = "sweep"


@dataclass(frozen=True, slots=True)
class Setting:
    """An option and the value that is advised, as one would type it in a shell; empty where only its name is meant."""

    option: Choose
    value: str = ""


Part = str | Setting | ScriptCommand


def in_shell(part: Part) -> str:
    """How the command line words a part of an advice."""
    match part:
        case Setting(option, value):
            flag = "-o" if option is Choose.OUTPUT else f"--{option.value}"
            return f"{flag} {value}" if value else flag
        case ScriptCommand():
            return f"`movimentum {part.value}`"
        case _:
            return part


class Advised(str):
    """A text that names options. As a text it is worded for the command line; ``parts`` are for other front ends."""

    parts: tuple[Part, ...]

    def __new__(cls, *parts: Part) -> Advised:  # noqa: D102
        flat = tuple(inner for part in parts for inner in (part.parts if isinstance(part, Advised) else (part,)))
        made = super().__new__(cls, "".join(map(in_shell, flat)))
        made.parts = flat
        return made

    @classmethod
    def of(cls, text: str, *parts: Part) -> Advised:
        """``text`` with the ``parts`` in place of its ``{}``."""
        first, *others = text.split("{}")
        return cls(first, *(piece for pair in zip(parts, others, strict=True) for piece in pair))

    @property
    def has_settings(self) -> bool:
        """Whether an option is named."""
        return any(isinstance(part, Setting) for part in self.parts)

    def worded(self, word: Callable[[Part], str]) -> str:
        """The text in the words of another front end."""
        return "".join(map(word, self.parts))

    def replace(self, old: str, new: str, count: SupportsIndex = -1, /) -> Advised:
        """As of any text, within its parts."""

        def replaced(part: Part) -> Part:
            if isinstance(part, Setting):
                return Setting(part.option, part.value.replace(old, new, count))
            return part if isinstance(part, ScriptCommand) else part.replace(old, new, count)

        return Advised(*map(replaced, self.parts))
