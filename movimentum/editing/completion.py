"""Completion: what may be written at the cursor."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator

from movimentum.editing.lexemes import Lexeme, lexemes
from movimentum.editing.outline import OutlineItem, Symbol, TextOutline
from movimentum.editing.project import Project, builtin_members
from movimentum.editing.word_help import (
    CLOCK_HELP,
    ITEMS,
    KIND_HELP,
    MEMBER_HELP,
    OPTION_HELP,
    function_help,
    kind_help,
    option_help,
)
from movimentum.records import dataclass
from movimentum.source import Span
from movimentum.syntax.vocabulary import FUNCTIONS, SYNONYMS
from movimentum.things.colors import color_names
from movimentum.things.registry import KINDS, SHAPES

COPY_OPTIONS = ("at", "turned", "mirrored")
CONFIG_OPTIONS = ("background", "theme")
CONSTANT_OPTIONS = ("range", "unit")
ENDINGS = {"claim": ("within",), "require": ("within",), "goal": ("weight", "at", "largest", "smallest")}
PICTURES = (".png", ".gif", ".jpg", ".jpeg", ".webp", ".bmp", ".svg")


@dataclass(frozen=True, slots=True)
class Proposal:
    """Something that may be written: ``text`` for what ``span`` covers. ``kind``: as of a `Symbol`, or "kind",
    "option", "function", "clock", "member", "word", "value" or "file". ``detail``: in short what it is, ``help``: in a
    sentence.
    """

    label: str
    kind: str
    span: Span
    text: str
    detail: str = ""
    help: str = ""


@dataclass(frozen=True, slots=True)
class _Place:
    """Where somebody is typing: what is ``begun`` (from ``span``), and the pieces before it in its item."""

    span: Span
    begun: str
    before: list[Lexeme]
    item: OutlineItem | None


def proposals(
    project: Project, path: str, offset: int, folder: Callable[[str], list[str]] | None = None
) -> list[Proposal]:
    """Proposals at ``offset``. ``folder``: the names in a folder, for files that a script reads."""
    outline = project.outline(path)
    if outline is None or not 0 <= offset <= len(outline.text):
        return []
    project.uses(path)  # makes the variables
    around = next((p for p in outline.pieces if p.kind in ("comment", "string") and p.start < offset <= p.end), None)
    if around is not None and around.kind == "comment":
        ended = around.text.endswith("*/") and offset == around.end and len(around.text) > 3
        if not ended:
            return []
        around = None
    if around is not None and not (offset == around.end and len(around.text) > 1 and around.text.endswith("'")):
        return _in_string(project, outline, around, offset, folder or names_in)
    place = _place(outline, offset)
    return _fitting(_found(project, outline, place), place.begun)


def _fitting(found: Iterable[Proposal], begun: str) -> list[Proposal]:
    """Those that begin as is begun, each once."""
    unique: dict[str, Proposal] = {}
    for each in found:
        start = begun if each.label.startswith(".") else begun.removeprefix(".")
        if each.label.lower().startswith(start.lower()):
            unique.setdefault(each.label, each)
    return list(unique.values())


def _place(outline: TextOutline, offset: int) -> _Place:
    pieces = [piece for piece in outline.pieces if piece.kind != "comment" and piece.start < offset]
    begun = ""
    if pieces and pieces[-1].kind in ("name", "word") and pieces[-1].end >= offset:
        begun = pieces[-1].text[: offset - pieces[-1].start]
        pieces = pieces[:-1]
    elif pieces and pieces[-1].kind == "number" and pieces[-1].end >= offset and pieces[-1].text.endswith("."):
        pieces = pieces[:-1]  # `2.` may become `2..5` or `2.r(…)`: nothing to propose
        return _Place(Span(offset, offset), "\0", pieces, None)
    start = offset - len(begun)
    before: list[Lexeme] = []
    for piece in reversed(pieces):
        if piece.text in (";", "}") and not _in_braces(pieces, piece):
            break
        before.insert(0, piece)
        if piece.text == "@":
            break
    item = outline.item_at(before[0].start) if before else None
    return _Place(Span(start, offset), begun, _own(outline, before), item)


def _in_braces(pieces: list[Lexeme], piece: Lexeme) -> bool:
    """Whether a ``;`` belongs to a value such as ``{ a < 3 : 4; 5 }``: a colon stands before it in the same braces."""
    depth = colon = 0
    for each in reversed(pieces[: pieces.index(piece)]):
        depth += (each.text == "}") - (each.text == "{")
        colon |= each.text == ":" and depth == 0
        if depth < 0:
            return bool(colon)
        if each.text in ("@", ";") and depth == 0 and not colon:
            return False
    return False


def _own(outline: TextOutline, before: list[Lexeme]) -> list[Lexeme]:
    """The last item in what stands before: it may have begun without a ``;`` before it, or behind a brace."""
    for number in range(len(before) - 1, -1, -1):
        item = outline.item_at(before[number].start)
        if item is not None and item.start == before[number].start and number:
            return before[number:]
        if before[number].text == "{" and item is not None and item.kind in ("part", "loop", "step"):
            return before[number + 1 :]
    return before


def _found(project: Project, outline: TextOutline, place: _Place) -> Iterator[Proposal]:
    before, begun, span = place.before, place.begun, place.span
    last = before[-1] if before else None
    if begun.startswith("."):
        if last is not None and last.end == span.start and (last.kind in ("name", "word") or last.text in ("]", ")")):
            yield from _members(project, outline, before, Span(span.start + 1, span.end), begun)
            return
        yield from _dotted(before, span)
        return
    if begun == "\0" or (last is not None and last.kind in ("name", "number") and begun and last.end == span.start):
        return
    if last is not None and last.text == "." and last.end == span.start:
        return
    if last is not None and last.text == ":" and len(before) > 1 and not _in_value(before):
        yield from (_word(f".{word}", "kind", span, kind_help(word)) for word in SHAPES)
        parts = [each for each in _visible(project, outline, place).values() if each.kind == "part"]
        yield from (_symbol(each, span, f"{each.name}()") for each in parts)
        return
    if not before or (last is not None and last.kind == "sign" and last.text in ("@",)):
        yield from (_word(f".{word}", "word", span, help_texts) for word, help_texts in ITEMS.items())
    for symbol in _visible(project, outline, place).values():
        if symbol.kind != "part":
            yield _symbol(symbol, span)


def _in_value(before: list[Lexeme]) -> bool:
    """Whether the colon before belongs to a value in braces."""
    return any(piece.text == "{" for piece in before)


def _visible(project: Project, outline: TextOutline, place: _Place) -> dict[str, Symbol]:
    scope = outline.scope_at(place.span.start)
    found = project.visible(outline.path, scope)
    item = place.item
    if item is not None and item.kind == "thing" and item.symbol is not None:
        earlier = {n: s for n, s in item.symbol.members.items() if s.span.start < place.span.start}
        found = {**found, **earlier, **{s.name: s for s in item.defining.values() if s.kind == "index"}}
    return {name: each for name, each in found.items() if each.span.end != place.span.end or each.path != outline.path}


def _members(
    project: Project, outline: TextOutline, before: list[Lexeme], span: Span, begun: str
) -> Iterator[Proposal]:
    """Proposals after a dot: the anchors of a thing, the contents of a copy, and the language's own members."""
    chain: list[Lexeme] = []
    depth = 0
    for piece in reversed(before):
        if chain and not depth and chain[0].kind == "name":
            break
        if chain and piece.end != chain[0].start and not depth:
            break
        depth += (piece.text in ("]", ")")) - (piece.text in ("[", "("))
        if depth < 0 or piece.text in (";", "{", "}"):
            break
        chain.insert(0, piece)
    names = [p for n, p in enumerate(chain) if p.kind in ("name", "word") and _depth(chain[:n]) == 0]
    vector = Symbol("", "variable", outline.path, span, span)
    if not names or names[0].kind != "name" or (chain and chain[0].text in ("[", "(")):
        owner: Symbol | None = vector
    else:
        owner = project.lookup(outline.path, outline.scope_at(span.start), names[0].text)
        item = outline.item_at(names[0].start)
        if item is not None and item.kind == "thing" and item.symbol is not None:
            owner = item.symbol.members.get(names[0].text, owner)
        for word in names[1:]:
            inner = project.members(owner).get(word.text[1:])
            if inner is None and word.text[1:] in MEMBER_HELP and word.text[1:] not in ("r", "rotate"):
                return  # a number has no members
            owner = inner
        if owner is None:
            owner = vector if len(names) > 1 else None
    own = project.members(owner)
    for symbol in own.values():
        yield _symbol(symbol, span)
    for word in builtin_members(owner):
        if word not in own:
            written, help_texts = MEMBER_HELP[word]
            yield Proposal(word, "member", span, word, written, help_texts)
    if owner is None or owner.kind in ("anchor", "variable", "constant", "parameter"):
        written, help_texts = MEMBER_HELP["r"]
        yield Proposal("r", "function", span, "r(", written, help_texts)


def _depth(pieces: list[Lexeme]) -> int:
    return sum((p.text in ("[", "(")) - (p.text in ("]", ")")) for p in pieces)


def _dotted(before: list[Lexeme], span: Span) -> Iterator[Proposal]:
    """A dot with nothing before it: a word of the language, as the place allows."""
    texts = [piece.text for piece in before]
    first = texts[0] if texts else ""
    if not before or _only_a_time(before):
        yield from (_word(f".{word}", "word", span, help_texts) for word, help_texts in ITEMS.items())
        yield from _values(span)
        return
    if texts[-1] == ":" and "{" not in texts:
        yield from (_word(f".{word}", "kind", span, kind_help(word)) for word in SHAPES)
        return
    open_brackets = _depth(before)
    value_ended = before[-1].kind in ("name", "number", "word", "string", "blank") or texts[-1] in ("]", ")")
    if open_brackets == 0 and value_ended:
        names = _behind(first, texts)
        if names is not None:
            yield from (_word(f".{name}", "option", span, option_help(name)) for name in names)
            return
        if "~" in texts:
            words = ("least", "most") if texts[-1] == "~" else ("speed", "weak")
            yield from (_word(f".{word}", "option", span, OPTION_HELP[word]) for word in words)
        elif {"<", "<=", ">", ">="} & set(texts):
            yield _word(".pushes", "option", span, OPTION_HELP["pushes"])
        return
    yield from _values(span)


def _behind(first: str, texts: list[str]) -> tuple[str, ...] | None:
    """The options that may follow in an item; None for a statement."""
    simple = {".config": CONFIG_OPTIONS, ".let": CONSTANT_OPTIONS}
    if first in simple:
        return simple[first]
    if first[1:] in ENDINGS:
        return ENDINGS[first[1:]]
    if ":" not in texts or "{" in texts:
        return None
    shape = texts[texts.index(":") + 1] if texts.index(":") + 1 < len(texts) else ""
    if shape.startswith("."):
        kind = KINDS.get(shape[1:])
    else:
        kind = KINDS["sprite"] if shape.startswith("'") else None
        if kind is None:
            return COPY_OPTIONS
    return tuple(dict.fromkeys(rule.name for rule in kind.options)) if kind is not None else tuple(OPTION_HELP)


def _only_a_time(before: list[Lexeme]) -> bool:
    """Whether only ``@2`` stands before."""
    return before[0].text == "@" and len(before) > 1 and all(p.kind in ("number", "name", "sign") for p in before[1:])


def _values(span: Span) -> Iterator[Proposal]:
    for word in (*FUNCTIONS, *SYNONYMS):
        written, help_texts = function_help(word)
        yield Proposal(f".{word}", "function", span, f".{word}(", written, help_texts)
    yield from (_word(f".{word}", "clock", span, help_texts) for word, help_texts in CLOCK_HELP.items())


def _word(label: str, kind: str, span: Span, help_texts: tuple[str, str]) -> Proposal:
    return Proposal(label, kind, span, label, *help_texts)


def _symbol(symbol: Symbol, span: Span, text: str | None = None) -> Proposal:
    return Proposal(symbol.name, symbol.kind, span, text or symbol.name, described(symbol), symbol.note)


def described(symbol: Symbol) -> str:
    """A short description of a symbol."""
    if symbol.kind == "thing":
        return "a picture" if symbol.word == "sprite" else f".{symbol.word}" if symbol.word in KIND_HELP else "a thing"
    if symbol.kind == "copy":
        return f"a copy of {symbol.word}"
    if symbol.kind == "anchor":
        return f"an anchor of {symbol.word}"
    return f"{'an' if symbol.kind[0] in 'aeiou' else 'a'} {symbol.kind}"


# --- in texts


def _in_string(
    project: Project, outline: TextOutline, string: Lexeme, offset: int, folder: Callable[[str], list[str]]
) -> list[Proposal]:
    """In quotes: the name of a file, a colour or another word; in a label, names in braces."""
    begun = string.text[1 : offset - string.start]
    before = [piece for piece in outline.pieces if piece.kind != "comment" and piece.start < string.start]
    opening = begun.rfind("{")
    if opening >= 0 and "}" not in begun[opening:] and not begun[: opening + 1].endswith("{{"):
        return _in_field(project, outline, string.start + 1 + opening + 1, offset)
    word = before[-2].text if len(before) > 1 and before[-1].text == "(" else ""
    span = Span(string.start + 1, string.end - (len(string.text) > 1 and string.text.endswith("'")))
    words = _words_for(word[1:])
    if words:
        return [Proposal(each, "value", span, each) for each in words if each.startswith(begun)]
    last = before[-1].text if before else ""
    if last not in (".include", ":"):
        return []
    base, _, _ = begun.rpartition("/")
    wanted = (".mov",) if last == ".include" else PICTURES
    found: list[Proposal] = []
    for name in folder(os.path.join(os.path.dirname(outline.path), base)):
        shown = f"{base}/{name}" if base else name
        if shown.startswith(begun) and (name.endswith("/") or name.lower().endswith(wanted)):
            found.append(Proposal(shown, "file", span, shown))
    return found


def _in_field(project: Project, outline: TextOutline, start: int, offset: int) -> list[Proposal]:
    """A number in a text: as in any expression."""
    before = lexemes(outline.text[start:offset], start)
    begun = ""
    if before and before[-1].kind in ("name", "word"):
        begun = before[-1].text
        before = before[:-1]
    place = _Place(Span(offset - len(begun), offset), begun, before or [Lexeme("sign", "(", start - 1)], None)
    return _fitting(_found(project, outline, place), begun)


def _words_for(option: str) -> Iterable[str]:
    if option in ("color", "fill", "edge", "background"):
        return sorted(color_names())
    if option == "theme":
        from movimentum.scene.themes import THEMES

        return sorted(THEMES)
    for kind in KINDS.values():
        for rule in kind.options:
            if rule.name == option and rule.words:
                return rule.words
    return ()


def names_in(folder: str) -> list[str]:
    """The names in a folder; those of folders end with a slash."""
    try:
        with os.scandir(folder or ".") as entries:
            found = [each.name + "/" * each.is_dir() for each in entries if not each.name.startswith(".")]
    except OSError:
        return []
    return sorted(found)[:500]
