"""The door from Python: arguments of the kinds that are annotated, and errors that name keywords, not options."""

from __future__ import annotations

import inspect
import os
import re
import types
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import contextmanager
from functools import cache, wraps
from reprlib import repr as short
from typing import TYPE_CHECKING, Any, Literal, ParamSpec, TypeVar, Union, cast, get_args, get_origin

from movimentum.diagnostics import Diagnostic
from movimentum.errors import MovimentumError, UsageError, usage_error
from movimentum.records import replace

if TYPE_CHECKING:
    from collections.abc import Generator

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
        with spoken():
            positions, keywords, kinds = _parameters(function)
            given = dict(zip(positions, args, strict=False)) | {name: kwargs[name] for name in keywords & kwargs.keys()}
            for name, value in given.items():
                if name in kinds and not _is_of(value, kinds[name]):
                    raise _of_another_kind(function, name, kinds[name], value)
            return function(*args, **kwargs)

    return calling


def _of_another_kind(function: Callable[..., Any], name: str, hint: Any, value: object) -> UsageError:
    owner = function.__qualname__.split(".")[0].lower()
    if function.__name__ == "__getitem__":
        message = f"`{owner}[…]` takes {_told_kind(hint)}, not {short(value)}"
        helps = (f'`{owner}["…"][{value}]`: first the name, then the row',) if isinstance(value, int) else ()
        return usage_error("usage/argument", message, *helps)
    return usage_error("usage/argument", f"`{function.__name__}`: `{name}` is {_told_kind(hint)}, not {short(value)}")


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
    """Whether ``value`` is of the kind ``hint``. A choice of words takes any text: the words are told elsewhere."""
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


def _told_kind(hint: Any) -> str:
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
    "max-frames": "frames", "max-pixels": "pixels", "max-nesting": "nesting", "max-operations": "operations",
    "max-digits": "digits",
}  # fmt: skip
_OPTIONS = (
    "accuracy", "at", "background", "dask", "digits", "effort", "fps", "frames", "loop", "lossy", "measure",
    "on-failure", "output", "quality", "sample", "scale", "set", "show", "strict", "trace", "transparent", "vary",
    "workers", *_LIMITS,
)  # fmt: skip
_WORDS = rf"(?:--({'|'.join(_OPTIONS)})|-(o))(?![\w-])"
_TYPED = re.compile(rf"(?:^|(?<=`)){_WORDS}[ =]('[^']*'|[^\s`]+)(?=`|$)")
"""An option with its value, as one would type it: a whole text, or in backticks."""
_NAMED = re.compile(rf"(?<![\w-]){_WORDS}")
_COMMANDS = re.compile(r"`movimentum (fit|sweep|check)`")


def _named(found: re.Match[str]) -> str:
    """What Python calls an option."""
    option = found[1] or "output"
    other = {"dask": "client", "set": "with_constants", "output": "path"}
    return other.get(option) or (f"Limits({_LIMITS[option]}=…)" if option in _LIMITS else option.replace("-", "_"))


def _keyword(found: re.Match[str]) -> str:
    """What Python writes for an option with its value."""
    option, value = found[1] or "output", found[3].strip("'")
    name, sign, values = value.partition("=")
    if option in _LIMITS:
        return f"Limits({_LIMITS[option]}={value})"
    if option == "set":
        return f'with_constants({{"{name}": {values}}})'
    if option == "vary":
        parts = values.split(":")
        some = f"np.linspace({', '.join(parts)})" if len(parts) == 3 else f"({', '.join(parts)})"
        return f"{name}={'…' if not sign else some if len(parts) > 1 else f'[{values}]'}"
    text = value if option in ("at", "digits", "effort", "fps", "loop", "scale", "workers") else f'"{value}"'
    return text if option == "output" else f"{option.replace('-', '_')}={text}"


def in_python(items: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Diagnostics that name keywords where the command line has options."""

    def told(text: str) -> str:
        return _COMMANDS.sub(r"`script.\1`", _NAMED.sub(_named, _TYPED.sub(_keyword, text)))

    return tuple(
        replace(
            item,
            message=told(item.message),
            notes=tuple(map(told, item.notes)),
            helps=tuple(dict.fromkeys(map(told, item.helps))),
        )
        for item in items
    )


@contextmanager
def spoken() -> Generator[None, None, None]:
    """Errors inside speak as Python does."""
    try:
        yield
    except MovimentumError as error:
        error.diagnostics = in_python(error.diagnostics)
        raise
