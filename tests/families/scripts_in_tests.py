"""Every script that the tests and the documentation contain, found by reading them: nothing is run."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from tests.command import ROOT

LONGEST = 4000
"""Characters: longer texts are there to be large."""
_SCRIPT = re.compile(r"@\s*\+?[\d(.]|^\s*[A-Za-z]\w*\s*:\s*[.'b]", re.MULTILINE)
_BLOCK = re.compile(r"```mov[^\n]*\n(.*?)```", re.DOTALL)


def scripts() -> list[str]:
    """Texts that look like scripts, each once, in a fixed order."""
    found: dict[str, None] = {}
    for path in sorted((ROOT / "tests").rglob("*.py")):
        found |= dict.fromkeys(_texts(ast.parse(path.read_text("utf-8"))))
    for folder in ("tests", "docs"):
        for path in sorted((ROOT / folder).rglob("*.md")):
            found |= dict.fromkeys(_BLOCK.findall(path.read_text("utf-8")))
    return [text for text in found if len(text) <= LONGEST and (";" in text or "@" in text) and _SCRIPT.search(text)]


def _texts(module: ast.Module) -> Iterator[str]:
    """The texts in a module, those made of constants and of others' names put together."""
    known: dict[str, str] = {}
    for node in ast.walk(module):
        if isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
            value = _text(node.value, known)
            if value is not None:
                known[node.targets[0].id] = value
    inside: set[int] = set()
    for node in ast.walk(module):
        if isinstance(node, ast.expr) and id(node) not in inside:
            value = _text(node, known)
            if value is not None:
                inside.update(id(child) for child in ast.walk(node))
                yield value


def _text(node: ast.expr, known: dict[str, str]) -> str | None:
    match node:
        case ast.Constant(value=str(value)):
            return value
        case ast.Name(id=name):
            return known.get(name)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            sides = _text(left, known), _text(right, known)
            return None if None in sides else "".join(filter(None, sides))
        case ast.Call(func=ast.Attribute(value=value, attr="replace"), args=[old, new]):
            parts = [_text(item, known) for item in (value, old, new)]
            return None if None in parts else str(parts[0]).replace(str(parts[1]), str(parts[2]))
        case ast.JoinedStr(values=values):
            pieces = [_text(v.value if isinstance(v, ast.FormattedValue) else v, known) for v in values]
            return None if None in pieces else "".join(filter(None, pieces))
        case _:
            return None
