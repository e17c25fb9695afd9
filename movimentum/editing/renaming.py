"""Another name for something, wherever it is named."""

from __future__ import annotations

import re
from collections.abc import Mapping

from movimentum.editing.completion import described
from movimentum.editing.project import Project, Use
from movimentum.errors import script_error
from movimentum.source import Edit, Span, edited

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def renamable(project: Project, path: str, offset: int) -> Use | None:
    """What could get another name at ``offset``."""
    use = project.use_at(path, offset)
    return use if use is not None and use.symbol is not None else None


def renamed(project: Project, path: str, offset: int, name: str) -> Mapping[str, list[Edit]]:
    """The edits of each file that give what stands at ``offset`` the name ``name``.

    `ScriptError` (``edit/name``) for what has no name, for a name that is none, and for one that would mean something
    else somewhere.
    """
    use = renamable(project, path, offset)
    if use is None or use.symbol is None:
        raise script_error("edit/name", "what stands here has no name of its own")
    if _NAME.fullmatch(name) is None:
        message = f"`{name}` is not a name: names have letters, digits and `_`, and begin with a letter"
        raise script_error("edit/name", message, "for example `Rod2`")
    old = use.symbol.name
    edits: dict[str, list[Edit]] = {}
    if name == old:
        return edits
    symbol = use.symbol
    home = project.outline(symbol.path)
    taken = {} if home is None else project.visible(symbol.path, home.scope_at(symbol.span.start))
    if symbol.kind != "anchor" and name in taken:
        raise script_error("edit/name", f"`{name}` is the name of {described(taken[name])} already", f"keep `{old}`")
    for each in project.all_uses(symbol):
        edits.setdefault(each.path, []).append(Edit(Span(each.piece.start, each.piece.end), name))
    edits = {file: sorted(set(those), key=lambda edit: edit.span) for file, those in edits.items()}
    _refuse_clash(project, edits, old, name)
    return edits


def _refuse_clash(project: Project, edits: dict[str, list[Edit]], old: str, name: str) -> None:
    """Every name must mean after the edits what it meant before."""
    texts = {file: edited(_text(project, file), those) for file, those in edits.items()}
    after = Project(lambda path: texts[path] if path in texts else project.read(path))
    for file in project.family(next(iter(edits))):
        before_uses, after_uses = project.uses(file), after.uses(file)
        order, new_order = _order(project, before_uses), _order(after, after_uses)
        if order != new_order:
            changed = next((n for n, pair in enumerate(zip(order, new_order, strict=False)) if pair[0] != pair[1]), 0)
            line = _text(project, file).count("\n", 0, before_uses[changed].piece.start) + 1 if before_uses else 1
            where = f"in line {line}" if len(edits) == 1 else f"in line {line} of {file}"
            raise script_error("edit/name", f"`{name}` means something else already, {where}", f"keep `{old}`")


def _text(project: Project, path: str) -> str:
    outline = project.outline(path)
    return "" if outline is None else outline.text


def _order(project: Project, uses: list[Use]) -> list[tuple[str, int] | None]:
    """What each name of a file means: the file, and the number of the piece, in which that is defined."""
    numbers: dict[str, dict[int, int]] = {}

    def number(path: str, start: int) -> tuple[str, int]:
        if path not in numbers:
            outline = project.outline(path)
            pieces = [] if outline is None else outline.pieces
            numbers[path] = {piece.start: n for n, piece in enumerate(pieces)}
            numbers[path].update({piece.start + 1: n for n, piece in enumerate(pieces) if piece.kind == "word"})
        return path, numbers[path].get(start, -1)

    return [None if use.symbol is None else number(use.symbol.path, use.symbol.span.start) for use in uses]
