"""What is at a place in a text, information about it, and renaming it everywhere."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from movimentum.editing.completion import described
from movimentum.editing.lexemes import holding
from movimentum.editing.outline import Symbol
from movimentum.editing.project import Project, Use
from movimentum.editing.word_help import MEMBER_HELP, word_help
from movimentum.errors import script_error
from movimentum.records import dataclass
from movimentum.source import Edit, Span, edited

MOST_TEXT = 400
"""Longer definitions are cut."""


@dataclass(frozen=True, slots=True)
class Facts:
    """The facts about a name at the film's beginning: its ``value``, and the statements (with their lines) that
    ``determined`` it.
    """

    value: str = ""
    determined: tuple[str, ...] = ()


NO_FACTS = Facts()


@dataclass(frozen=True, slots=True)
class About:
    """Information about the text in ``span``: how it is ``written``, and ``paragraphs`` about it."""

    span: Span
    written: str
    paragraphs: tuple[str, ...]

    @property
    def markdown(self) -> str:
        """As editors show it."""
        return "\n\n".join([f"```movimentum\n{self.written}\n```", *self.paragraphs])


def about(project: Project, path: str, offset: int, facts: Callable[[str], Facts]) -> About | None:
    """Information about the text at ``offset``. ``facts``: of a name such as ``Rod.A``."""
    outline = project.outline(path)
    if outline is None:
        return None
    use = project.use_at(path, offset)
    if use is not None:
        return _about_use(project, path, use, facts)
    piece = holding(outline.pieces, offset)
    if piece is None or piece.kind != "word":
        return None
    helps = word_help(piece.text[1:], member=False)
    if not helps:
        return None
    return About(Span(piece.start, piece.end), helps[0][0], tuple(words for _, words in helps if words))


def _about_use(project: Project, path: str, use: Use, facts: Callable[[str], Facts]) -> About | None:
    span = Span(use.piece.start, use.piece.end)
    symbol = use.symbol
    name = full_name(project, path, use)
    known = facts(name) if name else NO_FACTS
    if symbol is None:
        if use.owner is None or use.piece.text not in MEMBER_HELP:
            return None
        written, words = MEMBER_HELP[use.piece.text]
        return About(span, written, tuple(filter(None, [words, *_fact_lines(name, known)])))
    file = project.outline(symbol.path)
    text = "" if file is None else " ".join(file.text[symbol.whole.start : symbol.whole.end].split())
    if symbol.kind in ("variable", "index", "parameter") or not text:
        text = symbol.name
    written = text if len(text) <= MOST_TEXT else text[:MOST_TEXT] + " …"
    what = f"**{symbol.name}**: {described(symbol)}"
    if symbol.path != path:
        what += f" (of {symbol.path.replace(chr(92), '/').rpartition('/')[2]})"
    return About(span, written, tuple(filter(None, [what, symbol.note, *_fact_lines(name, known)])))


def _fact_lines(name: str, known: Facts) -> list[str]:
    found: list[str] = []
    if known.value:
        found.append(f"At the beginning: `{name}` = {known.value}")
    if known.determined:
        found.append("Determined by:\n" + "\n".join(f"- `{each}`" for each in known.determined))
    return found


def full_name(project: Project, path: str, use: Use) -> str:
    """The whole path up to and with what is used, as it is written: ``S[2].A.P``; of an anchor in its own definition
    with the name of the thing. Empty for what is no value: parts, parameters, files.
    """
    symbol = use.symbol
    if symbol is not None and symbol.kind in ("part", "parameter", "index"):
        return ""
    outline = project.outline(path)
    if outline is None:
        return ""
    item = outline.item_at(use.piece.start)
    if symbol is not None and symbol.kind == "anchor" and use.owner is None and item is not None and item.symbol:
        return "" if item.symbol.many else f"{item.symbol.name}.{symbol.name}"
    start = use.piece.start
    pieces = [each for each in outline.pieces if each.end <= use.piece.end or each.start < use.piece.start]
    depth = 0
    while use.owner is not None and pieces:
        piece = pieces.pop()
        depth += (piece.text == "]") - (piece.text == "[")
        start = piece.start
        if piece.kind == "name" and depth == 0 and piece.start < use.piece.start:
            break
    return "".join(outline.text[start : use.piece.end].split())


def definition_of(project: Project, path: str, offset: int) -> Symbol | None:
    """The symbol named at ``offset`` and defined elsewhere."""
    use = project.use_at(path, offset)
    return None if use is None else use.symbol


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def renamable(project: Project, path: str, offset: int) -> Use | None:
    """The symbol that can be renamed at ``offset``."""
    use = project.use_at(path, offset)
    return use if use is not None and use.symbol is not None else None


def renamed(project: Project, path: str, offset: int, name: str) -> Mapping[str, list[Edit]]:
    """The edits of each file that give what stands at ``offset`` the name ``name``.

    `ScriptError` (``edit/name``) for what has no name, for a name that is none, and for one that would mean something
    else somewhere.
    """
    use = renamable(project, path, offset)
    if use is None or use.symbol is None:
        raise script_error("edit/name", "there is no name here")
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
    """The meaning of each name of a file: the file, and the number of the piece, in which that is defined."""
    numbers: dict[str, dict[int, int]] = {}

    def number(path: str, start: int) -> tuple[str, int]:
        if path not in numbers:
            outline = project.outline(path)
            pieces = [] if outline is None else outline.pieces
            numbers[path] = {piece.start: n for n, piece in enumerate(pieces)}
            numbers[path].update({piece.start + 1: n for n, piece in enumerate(pieces) if piece.kind == "word"})
        return path, numbers[path].get(start, -1)

    return [None if use.symbol is None else number(use.symbol.path, use.symbol.span.start) for use in uses]
