"""The messages of page and server as a JSON schema; ``python -m movimentum.studio.schema`` writes ``messages.json``."""

from __future__ import annotations

import json
import types
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

from movimentum.studio.answers import OUTGOING
from movimentum.studio.messages import INCOMING

TARGET = Path(__file__).resolve().parent / "messages.json"


def schema() -> dict[str, Any]:
    """The JSON schema of all messages: ``$defs`` has one entry for each kind; ``page`` and ``server`` list them."""
    defs = {kind: _schema_of(kind, cls) for kind, cls in {**INCOMING, **OUTGOING}.items()}
    refs = {
        side: {"oneOf": [{"$ref": f"#/$defs/{kind}"} for kind in kinds]}
        for side, kinds in (("page", INCOMING), ("server", OUTGOING))
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$defs": {**defs, **refs}}


def _schema_of(kind: str, cls: type) -> dict[str, Any]:
    properties = {name: _type_schema(hint) for name, hint in get_type_hints(cls).items()}
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
