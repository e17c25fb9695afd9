"""What there is to say about what stands at a place of a text."""

from __future__ import annotations

from collections.abc import Callable

from movimentum.editing.completion import described
from movimentum.editing.lexemes import holding
from movimentum.editing.outline import Symbol
from movimentum.editing.project import Project, Use
from movimentum.editing.words import MEMBER_HELP, word_help
from movimentum.records import dataclass
from movimentum.source import Span

MOST_TEXT = 400
"""Longer definitions are cut."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of a name at the film's beginning: its ``value``, and the statements (with their lines) that
    ``determined`` it.
    """

    value: str = ""
    determined: tuple[str, ...] = ()


NO_FACTS = Facts()


@dataclass(frozen=True, slots=True)
class About:
    """What there is to say about the text in ``span``: how it is ``written``, and ``paragraphs`` about it."""

    span: Span
    written: str
    paragraphs: tuple[str, ...]

    @property
    def markdown(self) -> str:
        """As editors show it."""
        return "\n\n".join([f"```movimentum\n{self.written}\n```", *self.paragraphs])


def about(project: Project, path: str, offset: int, facts: Callable[[str], Facts]) -> About | None:
    """What there is to say about what stands at ``offset``. ``facts``: of a name such as ``Rod.A``."""
    outline = project.outline(path)
    if outline is None:
        return None
    use = project.use_at(path, offset)
    if use is not None:
        return _about_use(project, path, use, facts)
    piece = holding(outline.pieces, offset)
    if piece is None or piece.kind != "word":
        return None
    told = word_help(piece.text[1:], member=False)
    if not told:
        return None
    return About(Span(piece.start, piece.end), told[0][0], tuple(words for _, words in told if words))


def _about_use(project: Project, path: str, use: Use, facts: Callable[[str], Facts]) -> About | None:
    span = Span(use.piece.start, use.piece.end)
    symbol = use.symbol
    name = full_name(project, path, use)
    known = facts(name) if name else NO_FACTS
    if symbol is None:
        if use.owner is None or use.piece.text not in MEMBER_HELP:
            return None
        written, words = MEMBER_HELP[use.piece.text]
        return About(span, written, tuple(filter(None, [words, *_told(name, known)])))
    file = project.outline(symbol.path)
    text = "" if file is None else " ".join(file.text[symbol.whole.start : symbol.whole.end].split())
    if symbol.kind in ("variable", "index", "parameter") or not text:
        text = symbol.name
    written = text if len(text) <= MOST_TEXT else text[:MOST_TEXT] + " …"
    what = f"**{symbol.name}**: {described(symbol)}"
    if symbol.path != path:
        what += f" (of {symbol.path.replace(chr(92), '/').rpartition('/')[2]})"
    return About(span, written, tuple(filter(None, [what, symbol.note, *_told(name, known)])))


def _told(name: str, known: Facts) -> list[str]:
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
    """What is defined elsewhere and named at ``offset``."""
    use = project.use_at(path, offset)
    return None if use is None else use.symbol
