"""Messages as they are sent and received: JSON, checked field by field."""

from __future__ import annotations

import json
import math
import types
from dataclasses import asdict, fields
from typing import Any, Union, get_args, get_origin, get_type_hints

from movimentum.studio.answers import OUTGOING, FilmShown
from movimentum.studio.messages import INCOMING


class BadMessage(ValueError):
    """A message that is none of ours."""


_KINDS = {cls: kind for kind, cls in OUTGOING.items()}


def sent(message: Any) -> str:
    """A message for a page, as JSON."""
    if isinstance(message, FilmShown):  # large, and nothing in it to convert
        found = {"kind": "film", **{item.name: getattr(message, item.name) for item in fields(message)}}
    else:
        found = {"kind": _KINDS[type(message)], **asdict(message)}
    return json.dumps(found, separators=(",", ":"), allow_nan=False)


def received(data: str) -> Any:
    """The message that a page has sent; `BadMessage` if it is none."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise BadMessage("this is not JSON") from error
    if not isinstance(value, dict):
        raise BadMessage("a message is an object")
    found: dict[str, Any] = {str(key): item for key, item in value.items()}  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    kind = found.pop("kind", None)
    cls = INCOMING.get(kind) if isinstance(kind, str) else None
    if cls is None:
        raise BadMessage("there is no such kind of message")
    hints = get_type_hints(cls)
    if found.keys() != hints.keys():
        raise BadMessage("a message has all its fields and no others")
    return cls(**{name: _checked(hint, found[name]) for name, hint in hints.items()})


def _checked(hint: Any, value: Any) -> Any:
    if get_origin(hint) in (Union, types.UnionType):
        return None if value is None else _checked(get_args(hint)[0], value)
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    if hint is int and isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**53:
        return value
    if (hint is str and isinstance(value, str)) or (hint is bool and isinstance(value, bool)):
        return value
    if get_origin(hint) is tuple and isinstance(value, list) and len(value) <= 1000:  # pyright: ignore[reportUnknownArgumentType]
        inside = get_args(hint)
        if inside[-1] is Ellipsis:
            return tuple(_checked(inside[0], item) for item in value)  # pyright: ignore[reportUnknownVariableType]
        if len(value) == len(inside):  # pyright: ignore[reportUnknownArgumentType]
            return tuple(map(_checked, inside, value))  # pyright: ignore[reportUnknownArgumentType]
    raise BadMessage("a field has another type")
