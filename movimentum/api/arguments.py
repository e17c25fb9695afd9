"""Checks arguments from Python: types, counterparts of command-line options, and errors that name keywords."""

from __future__ import annotations

import gc
import inspect
import math
import operator
import os
import types
from collections.abc import Callable, Collection, Generator, Iterable, Mapping
from contextlib import contextmanager
from enum import StrEnum
from fractions import Fraction
from functools import cache, wraps
from numbers import Rational, Real
from reprlib import repr as short
from threading import Lock
from typing import Any, Literal, ParamSpec, SupportsIndex, TypeGuard, TypeVar, Union, cast, get_args, get_origin

from movimentum.advice import Advised, Choose, Part, ScriptCommand, Setting, in_shell
from movimentum.diagnostics import Diagnostic
from movimentum.errors import MovimentumError, UsageError, usage_error
from movimentum.records import dataclass, replace
from movimentum.syntax.suggest import nearest
from movimentum.text import frame_range
from movimentum.workflow.choices import (
    LARGEST_NESTING,
    MAX_DIGITS,
    MAX_FRAMES,
    MAX_NESTING,
    MAX_OPERATIONS,
    MAX_PIXELS,
    FrameChoice,
    frames_in,
)

Number = int | float | Fraction | str
"""A number that is meant exactly: a float stands for its shortest spelling (0.1 is a tenth), "1/3" for a third."""

Measured = Mapping[str, str] | str | tuple[str, ...] | list[str]
"""Measures: expressions by name, or texts such as ``"stroke = .range(Rod.B.x)"``."""

QualityWord = Literal["draft", "standard", "high"]
TextWord = Literal["outlines", "live"]
ShowWord = Literal["names", "free", "anchors", "grid", "axes"]

PlaceWord = Literal["wikipedia", "slides", "latex", "web", "social"]

Frames = slice | range | int | str
"""Some frames: ``slice(12, 48)``, ``range(12, 48)``, ``7`` or ``"12:48"``, counted as Python counts."""

Choice = TypeVar("Choice", bound=StrEnum)


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits above which a script is refused, for `load` and `loads`.

    ``frames`` of a film, ``pixels`` of a picture, ``nesting`` of brackets and functions, ``operations`` in one
    expression, ``digits`` for ``accuracy="exact"``.

    >>> import movimentum as mv
    >>> script = mv.loads(".config(25); @0 x = 3*.t; @40", mv.Limits(frames=1000))
    >>> script.solve()
    Traceback (most recent call last):
        ...
    movimentum.errors.ScriptError: ...1,001 frames...
    """

    frames: int = MAX_FRAMES
    pixels: int = MAX_PIXELS
    nesting: int = MAX_NESTING
    operations: int = MAX_OPERATIONS
    digits: int = MAX_DIGITS

    def __post_init__(self) -> None:
        for name in self.__slots__:
            most = LARGEST_NESTING if name == "nesting" else None
            whole(getattr(self, name), f"`Limits`: `{name}`", 1, most)


P = ParamSpec("P")
R = TypeVar("R")

_KINDS = {
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    str: "a text",
    slice: "a slice",
    range: "a range",
    os.PathLike: "a path",
    Mapping: "a mapping",
}
"""How kinds are called in messages; a class that is not here adds nothing."""


def called(function: Callable[P, R]) -> Callable[P, R]:
    """Decorates what Python calls: an argument that is not of its annotated kind is a `UsageError`
    (``usage/argument``), and every error speaks as Python does.
    """

    @wraps(function)
    def calling(*args: P.args, **kwargs: P.kwargs) -> R:
        with errors_in_python(), _SPARING:
            positions, keywords, kinds = _parameters(function)
            given = dict(zip(positions, args, strict=False)) | {name: kwargs[name] for name in keywords & kwargs.keys()}
            for name, value in given.items():
                if name in kinds and not _is_of(value, kinds[name]):
                    raise _of_another_kind(function, name, kinds[name], value)
            return function(*args, **kwargs)

    return calling


class _RareCollections:
    """While a call runs in any thread, Python looks for garbage rarely: planning makes hundreds of thousands of small
    objects and hardly any cycles, and looking would take a quarter of the time of a large scene.
    """

    THRESHOLD = 200_000
    """New objects after which garbage is looked for."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._calls = 0
        self._before = gc.get_threshold()

    def __enter__(self) -> None:
        with self._lock:
            self._calls += 1
            if self._calls == 1:
                self._before = gc.get_threshold()
                if 0 < self._before[0] < self.THRESHOLD:  # 0: it is switched off
                    gc.set_threshold(self.THRESHOLD, max(self._before[1], 50), max(self._before[2], 100))

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._calls -= 1
            if not self._calls:
                gc.set_threshold(*self._before)


_SPARING = _RareCollections()


def _of_another_kind(function: Callable[..., Any], name: str, hint: Any, value: object) -> UsageError:
    owner = function.__qualname__.split(".")[0].lower()
    if function.__name__ == "__getitem__":
        message = f"`{owner}[…]` takes {_kind_text(hint)}, not {short(value)}"
        helps = (f'`{owner}["…"][{value}]`: first the name, then the row',) if isinstance(value, int) else ()
        return usage_error("usage/argument", message, *helps)
    return usage_error("usage/argument", f"`{function.__name__}`: `{name}` is {_kind_text(hint)}, not {short(value)}")


@cache
def _parameters(function: Callable[..., Any]) -> tuple[list[str], set[str], dict[str, Any]]:
    """The names of parameters by position, those that may be keywords, and the kinds of all that are annotated."""
    scope = getattr(function, "__globals__", {})
    named = [each for each in inspect.signature(function).parameters.values() if each.kind is not each.VAR_KEYWORD]
    positions = [each.name for each in named if each.kind is not each.KEYWORD_ONLY]
    keywords = {each.name for each in named if each.kind is not each.POSITIONAL_ONLY}
    kinds = {each.name: eval(each.annotation, scope) for each in named if isinstance(each.annotation, str)}
    return positions, keywords, kinds


def _is_of(value: object, hint: Any) -> bool:
    """Whether ``value`` is of the kind ``hint``. A choice of words takes any text: the words are reported elsewhere."""
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        return any(_is_of(value, each) for each in get_args(hint))
    if origin is Literal:
        return isinstance(value, str)
    if origin is not None:
        inner: tuple[Any, ...] = tuple(each for each in get_args(hint) if each is not Ellipsis)
        if not isinstance(value, origin) or not getattr(value, "ndim", 1):
            return False
        if isinstance(value, Mapping):
            table = cast("Mapping[object, object]", value)
            return len(inner) == 2 and all(_is_of(k, inner[0]) and _is_of(v, inner[1]) for k, v in table.items())
        items = cast("Collection[object]", value) if isinstance(value, Collection) else ()
        return origin is os.PathLike or all(_is_of(item, inner[0]) for item in items)
    if hint in (int, float):
        counts = "__index__" if hint is int else "__float__"
        fits = hasattr(type(value), counts) and getattr(value, "ndim", 0) == 0 and not isinstance(value, bool)
        return fits and (hint is float or getattr(getattr(value, "dtype", None), "kind", "i") in "iu")
    return hint in (object, Any) or (value is None if hint is None else isinstance(value, hint))


def _kind_text(hint: Any) -> str:
    """``a text, a whole number or None``."""
    return _either(_kinds(hint))


def _either(kinds: Iterable[str]) -> str:
    *most, last = dict.fromkeys(kinds)
    return f"{', '.join(most)} or {last}" if most else last


def _kinds(hint: Any) -> list[str]:
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        return [kind for each in get_args(hint) for kind in _kinds(each)]
    if origin is Literal:
        return [f'"{word}"' for word in get_args(hint)]
    if hint in (None, type(None)):
        return ["None"]
    if origin in _KINDS:
        return [_KINDS[origin]]
    if origin is not None:
        return [f"several ({_either(_kinds(get_args(hint)[0]))})"]
    return [_KINDS[hint]] if hint in _KINDS else [] if hasattr(hint, "__members__") else [f"a {hint.__name__}"]


# --- errors

_LIMITS = {
    Choose.MAX_FRAMES: "frames", Choose.MAX_PIXELS: "pixels", Choose.MAX_NESTING: "nesting",
    Choose.MAX_OPERATIONS: "operations", Choose.MAX_DIGITS: "digits",
}  # fmt: skip
_ELSEWHERE = frozenset({
    Choose.CERTIFY, Choose.DRIVE, Choose.FORMAT, Choose.HOLE, Choose.MAX_VARIANTS, Choose.OF, Choose.PLOT,
    Choose.RESUME, Choose.SECONDS, Choose.SHEET, Choose.SNAP, Choose.SNAP_ANGLE, Choose.THICKNESS,
})  # fmt: skip
"""Choices that only the command line has."""
_CALLED = {Choose.DASK: "client", Choose.SET: "with_constants", Choose.OUTPUT: "path"}
_NUMBERS = (Choose.AT, Choose.FPS, Choose.SCALE, Choose.WORKERS)


def _in_python(part: Part) -> str:
    """The Python keyword for an option, with its value if there is one."""
    match part:
        case ScriptCommand():
            return f"`script.{part.value}`"
        case Setting(option, value) if option not in _ELSEWHERE:
            return _keyword(option, value.strip("'")) if value else _named(option)
        case _:
            return in_shell(part)


def _named(option: Choose) -> str:
    if option in _LIMITS:
        return f"Limits({_LIMITS[option]}=…)"
    return _CALLED.get(option) or option.value.replace("-", "_")


def _keyword(option: Choose, value: str) -> str:
    name, sign, values = value.partition("=")
    match option:
        case _ if option in _LIMITS:
            return f"Limits({_LIMITS[option]}={value})"
        case Choose.SET:
            return f'with_constants({{"{name}": {values}}})'
        case Choose.VARY:
            parts = values.split(":")
            some = f"np.linspace({', '.join(parts)})" if len(parts) == 3 else f"({', '.join(parts)})"
            return f"{name}={'…' if not sign else some if len(parts) > 1 else f'[{values}]'}"
        case Choose.LIVE:
            return "live(" + ", ".join(f'"{each}"' for each in value.split(",")) + ")"
        case Choose.OUTPUT:
            return f'"{value}"'
        case _:
            return f"{option.value.replace('-', '_')}={value}" if option in _NUMBERS else f'{_named(option)}="{value}"'


def in_python(items: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Diagnostics that name keywords where the command line has options."""

    def in_words(text: str) -> str:
        return text.worded(_in_python) if isinstance(text, Advised) else text

    return tuple(
        replace(
            item,
            message=in_words(item.message),
            notes=tuple(map(in_words, item.notes)),
            helps=tuple(dict.fromkeys(map(in_words, item.helps))),
        )
        for item in items
    )


@contextmanager
def errors_in_python() -> Generator[None, None, None]:
    """Errors inside speak as Python does."""
    try:
        yield
    except MovimentumError as error:
        error.diagnostics = in_python(error.diagnostics)
        raise


# --- what stands for an option


def exact(value: Number | Real, what: str) -> Fraction:
    """A number as a fraction; `UsageError` (``usage/number``) for anything else, infinities too."""
    try:
        if isinstance(value, str):
            return Fraction(value.strip())
        if isinstance(value, Rational):
            return Fraction(int(value.numerator), int(value.denominator))
        return Fraction(repr(float(value)))  # NumPy's floats too
    except (ValueError, TypeError, OverflowError, ZeroDivisionError):
        raise usage_error("usage/number", f"{what} is a number such as 12, 2.5 or '1/3', not {value!r}") from None


def frame_rate(value: Number | None) -> Fraction | None:
    """Frames per time unit; None stays None (the script's own)."""
    if value is None:
        return None
    found = exact(value, "fps")
    if found <= 0:
        raise usage_error("usage/number", f"fps is greater than 0, not {value!r}")
    return found


def several(value: object) -> TypeGuard[Iterable[Any]]:
    """Whether ``value`` holds several; a text or an array without axes is one."""
    return isinstance(value, Iterable) and not isinstance(value, str) and getattr(value, "ndim", 1) > 0  # pyright: ignore[reportUnknownArgumentType]


def cluster_client(value: object) -> None:
    """`UsageError` (``usage/argument``) for what is no `distributed.Client`, and not None either."""
    if value is not None and not (hasattr(value, "submit") and hasattr(value, "scheduler")):
        example = 'distributed.Client("tcp://scheduler:8786")'
        raise usage_error("usage/argument", f"`client` is a `distributed.Client`, not {value!r:.60}", example)


def one_of(kind: type[Choice], value: str, what: str) -> Choice:
    """The member of ``kind`` that ``value`` names; `UsageError` (``usage/choice``) where it names none."""
    try:
        return kind(value)
    except ValueError:
        guess = nearest(str(value), [item.value for item in kind])
        known = ", ".join(f'"{item.value}"' for item in kind)
        helps = (f'did you mean "{guess}"?',) if guess else (f"one of {known}",)
        raise usage_error("usage/choice", f"there is no {what} {value!r}", *helps) from None


def words(value: str | Iterable[str], what: str) -> tuple[str, ...]:
    """``"names,free"`` or any collection of words; `UsageError` (``usage/argument``) for what is no word."""
    items: list[Any] = value.split(",") if isinstance(value, str) else list(value)
    for word in items:
        if not isinstance(word, str):
            raise usage_error("usage/argument", f"`{what}` is a text, or several, not {word!r}")
    return tuple(word.strip() for word in items if word.strip())


def frame_choice(value: Frames | None) -> FrameChoice | None:
    """The frames that `Frames` tells; `UsageError` (``usage/frames``) for a step, and for what is no frame."""
    if value is None:
        return None
    if isinstance(value, str):
        found = frame_range(value)
        if found is None:
            raise usage_error("usage/frames", f"{value!r} is not a range of frames such as '0:48', '48:' or '7'")
        value = found
    if not isinstance(value, slice | range):
        first = operator.index(value)
        value = slice(first, first + 1 or None)
    if value.step not in (None, 1):
        raise usage_error("usage/frames", "frames follow one another: a range of them has no step")
    if not all(part is None or isinstance(part, SupportsIndex) for part in (value.start, value.stop)):
        raise usage_error("usage/frames", f"frames are whole numbers: {value!r} has others")
    return frames_in(slice(value.start, value.stop))


def whole(value: object, what: str, least: int, most: int | None = None) -> int:
    """A whole number from ``least`` to ``most``; `UsageError` (``usage/number``) for any other."""
    found = operator.index(value) if isinstance(value, SupportsIndex) and not isinstance(value, bool) else None
    if found is None or found < least or (most is not None and found > most):
        bounds = f"of at least {least}" if most is None else f"from {least} to {most:,}"
        raise usage_error("usage/number", f"{what} is a whole number {bounds}, not {value!r}")
    return found


def positive(value: float, what: str) -> float:
    """A finite number greater than 0; `UsageError` (``usage/number``) for any other."""
    found = float(value)
    if not 0.0 < found < math.inf:
        raise usage_error("usage/number", f"{what} is a number greater than 0, not {value!r}")
    return found
