"""Reads and writes messages: JSON, checked field by field. ``python -m movimentum.studio.protocol`` writes their JSON
schema, ``messages.json``.
"""

from __future__ import annotations

import json
import math
import types
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

from movimentum.records import fields
from movimentum.studio.messages import FromPage, ToPage

MAX_MESSAGE_BYTES = 4 * 2**20
"""A larger message ends the connection: a script has 2 MiB at most."""


class BadMessage(ValueError):
    """A message that is none of ours."""


def sent(message: Any) -> str:
    """A message for a page, as JSON."""
    found = {"kind": message.kind, **{item.name: getattr(message, item.name) for item in fields(message)}}
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
    cls = FromPage.kinds.get(kind) if isinstance(kind, str) else None
    if cls is None:
        raise BadMessage("there is no such kind of message")
    hints = _hints(cls)
    if found.keys() != hints.keys():
        raise BadMessage("a message has all its fields and no others")
    return cls(**{name: _checked(hint, found[name]) for name, hint in hints.items()})


def _hints(cls: type) -> dict[str, Any]:
    """The types of a message's fields."""
    known = get_type_hints(cls)
    return {item.name: known[item.name] for item in fields(cls)}


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


# --- described

TARGET = Path(__file__).resolve().parent / "messages.json"


def schema() -> dict[str, Any]:
    """The JSON schema of all messages: ``$defs`` has one entry for each kind; ``page`` and ``server`` list them."""
    defs = {kind: _schema_of(kind, cls) for kind, cls in {**FromPage.kinds, **ToPage.kinds}.items()}
    refs = {
        side: {"oneOf": [{"$ref": f"#/$defs/{kind}"} for kind in kinds]}
        for side, kinds in (("page", FromPage.kinds), ("server", ToPage.kinds))
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$defs": {**defs, **refs}}


def _schema_of(kind: str, cls: type) -> dict[str, Any]:
    properties = {name: _type_schema(hint) for name, hint in _hints(cls).items()}
    return {
        "type": "object",
        "description": " ".join((cls.__doc__ or "").split()),
        "properties": {"kind": {"const": kind}, **properties},
        "required": ["kind", *properties],
        "additionalProperties": False,
    }


def _type_schema(hint: Any) -> dict[str, Any]:
    plain = {str: "string", int: "integer", float: "number", bool: "boolean", type(None): "null"}
    if hint in plain:
        return {"type": plain[hint]}
    origin, inside = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return {"anyOf": [_type_schema(item) for item in inside]}
    if origin is dict:
        return {"type": "object"}
    if origin is tuple and inside[-1] is not Ellipsis:
        return {"type": "array", "prefixItems": [_type_schema(item) for item in inside], "items": False}
    return {"type": "array", "items": _type_schema(inside[0])}


def schema_text() -> str:
    """The schema as the file has it."""
    return json.dumps(schema(), indent=1) + "\n"


if __name__ == "__main__":
    TARGET.write_text(schema_text(), encoding="utf-8", newline="\n")
