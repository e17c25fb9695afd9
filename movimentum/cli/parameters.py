"""The text forms of options: rational numbers, ranges of frames, lists of words, pairs of joints, anchors."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from movimentum.records import dataclass
from movimentum.text import rational

if TYPE_CHECKING:
    _RationalBase = click.ParamType[Fraction]
    _RangeBase = click.ParamType["FrameRange"]
    _WordsBase = click.ParamType[frozenset[str]]
    _TextBase = click.ParamType[str]
    _PairBase = click.ParamType[tuple[int, int]]
else:  # older versions of click have no type arguments here
    _RationalBase = _RangeBase = _WordsBase = _TextBase = _PairBase = click.ParamType


_ANCHOR = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?:\[\d+\]|\.[A-Za-z][A-Za-z0-9_]*)*\.[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, slots=True)
class FrameRange:
    """``A:B``: frames A, A + 1, … B - 1, as Python slices count: half-open, either end may be left out or negative.

    A single number is that one frame.
    """

    start: int | None
    stop: int | None

    def of(self, count: int) -> tuple[int, int]:
        """First frame and end (not included) among ``count`` frames; equal if the range holds none."""
        start, stop, _ = slice(self.start, self.stop).indices(count)
        return start, max(start, stop)


def files(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """For ``shell_complete``: the shell completes the name of a file."""
    return [CompletionItem(incomplete, type="file")]


class RationalType(_RationalBase):
    """A number such as ``12``, ``2.5`` or ``24000/1001``, kept exactly."""

    name = "number"

    def __init__(self, *, positive: bool = False) -> None:
        self.positive = positive

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Fraction:
        """The `Fraction` that ``value`` spells."""
        if isinstance(value, Fraction):
            return value
        number = rational(str(value))
        if number is None:
            self.fail(f"{value!r} is not a number such as 12, 2.5 or 24000/1001.", param, ctx)
        if self.positive and number <= 0:
            self.fail(f"{value} is not greater than 0.", param, ctx)
        return number


class FrameRangeType(_RangeBase):
    """``A:B``, ``A:``, ``:B`` or ``A``."""

    name = "range"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> FrameRange:
        """The `FrameRange` that ``value`` spells."""
        if isinstance(value, FrameRange):
            return value
        match = re.fullmatch(r"\s*([+-]?\d{1,18})?\s*(:)?\s*([+-]?\d{1,18})?\s*", str(value))
        if match is None or (match[2] is None and (match[1] is None or match[3] is not None)):
            self.fail(f"{value!r} is not a range of frames such as 0:48, 48:, :-1 or 7.", param, ctx)
        start = None if match[1] is None else int(match[1])
        if match[2] is None:
            assert start is not None
            return FrameRange(start, None if start == -1 else start + 1)
        return FrameRange(start, None if match[3] is None else int(match[3]))


class WordsType(_WordsBase):
    """A list of words out of a few, separated by commas."""

    name = "words"

    def __init__(self, *words: str) -> None:
        self.words = words

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """How the option's value is shown in the help (older versions of click pass no context)."""
        return ",".join(self.words)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> frozenset[str]:
        """The set of words."""
        if isinstance(value, frozenset):
            return value  # pyright: ignore[reportUnknownVariableType]
        words = [word.strip() for word in str(value).split(",") if word.strip()]
        for word in words:
            if word not in self.words:
                self.fail(f"{word!r} is not one of {', '.join(self.words)}.", param, ctx)
        return frozenset(words)


class PairType(_PairBase):
    """Two joint numbers, ``0,1``."""

    name = "pair"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """The two numbers."""
        if isinstance(value, tuple):
            return value  # pyright: ignore[reportUnknownVariableType]
        match = re.fullmatch(r"\s*(\d{1,9})\s*,\s*(\d{1,9})\s*", str(value))
        if match is None:
            self.fail(f"{value!r} is not a pair of joint numbers such as 0,1.", param, ctx)
        return int(match[1]), int(match[2])


class TraceType(_TextBase):
    """``Thing.Anchor``; whether the scene has it is checked later."""

    name = "Thing.Anchor"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The name, without white space around it."""
        text = str(value).strip()
        match = _ANCHOR.fullmatch(text)
        if match is None:
            self.fail(f"{value!r} does not name an anchor, as in --trace Rod.B.", param, ctx)
        return text
