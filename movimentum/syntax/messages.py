"""Syntax errors in words: what was found, what was expected, and what was probably meant."""

from __future__ import annotations

import re

from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.source import Span
from movimentum.syntax.automaton import Unexpected
from movimentum.syntax.older import SIGNS, called, written
from movimentum.syntax.suggest import nearest
from movimentum.syntax.words import CLOCKS, FUNCTIONS, SHAPES, SYNONYMS

_VALUE = {"NUMBER", "NAME", "BLANK", "CLOCK", "FUNCTION", "LSQB", "LPAR", "LBRACE", "MINUS"}
_OPERATORS = {"PLUS", "MINUS", "STAR", "SLASH", "CIRCUMFLEX"}
_RELATIONS = {"EQUAL", "TILDE", "ATMOST", "BELOW", "ATLEAST", "ABOVE"}
_SHAPES = {"BAR", "ARROW", "DISC", "LABEL", "LINE"}
_SHAPES_HELP = "a thing is a picture `'file.png'`, `.bar`, `.arrow`, `.disc(r)`, `.label('text')` or `.line`"
_WORDS = {
    "SEMICOLON": "`;`",
    "COLON": "`:`",
    "COMMA": "`,`",
    "RPAR": "`)`",
    "RSQB": "`]`",
    "RBRACE": "`}`",
    "LPAR": "`(`",
    "LSQB": "`[`",
    "LBRACE": "`{`",
    "STRING": "a text in quotes",
    "NAME": "a name",
    "NUMBER": "a number",
    "ABOVE": "`>`",
    "EQUAL": "`=`",
    "AT": "`@`",
    "PLUS": "`+`",
    "MINUS": "`-`",
    "WORD": "an option",
    "CONFIG": "`.config`",
    "WITHIN": "`.within(…)`",
    "SPEED": "`.speed(…)`",
}
_ORDER = ("SEMICOLON", "RPAR", "RSQB", "RBRACE", "COMMA", "COLON", "LPAR", "LSQB", "ABOVE", "EQUAL")
_LOOKALIKES = {
    "\u2212": "-", "\u2013": "-", "\u00d7": "*", "\u00b7": "*", "\u2217": "*", "\u00f7": "/", "\u2264": "<=",
    "\u2265": ">=", "\u201c": "'", "\u201d": "'", "\u2018": "'", "\u2019": "'", '"': "'", "\u2248": "~",
}  # fmt: skip
_PIECE = re.compile(r"\s+|//[^\r\n]*|/\*.*?\*/|'(?:[^'\r\n]|'')*'|[A-Za-z0-9_.]+|.", re.DOTALL)
_DOTTED = re.compile(r"\.[A-Za-z][A-Za-z0-9_]*")
_FOUND = re.compile(r"\.?[A-Za-z0-9_]+|'(?:[^'\r\n]|'')*'|<=|>=|.", re.DOTALL)


def explain(unexpected: Unexpected, text: str, start: int) -> tuple[Diagnostic, int, bool]:
    """The error, its offset, and whether reading can continue right there (because a ``;`` was forgotten before it).

    ``text`` is the script's; the part that was read began at ``start``.
    """
    place, accepted = unexpected.place, unexpected.accepted
    before = _end_before(text, start, place)
    if unexpected.at_end:
        return _unexpected_end(text, before, accepted), len(text), False
    special = _unreadable(text, place)
    if special is not None:
        return special, max(special.span.end if special.span else place, place + 1), False
    word = _unknown_word(text, place, accepted)
    if word is not None:
        return word, place, False
    found_match = _FOUND.match(text, place)
    found = found_match[0] if found_match else text[place]
    labels: tuple[Label, ...] = ()
    helps = _helps(text, before, place, found, accepted)
    new_line = "\n" in text[before:place] or "\r" in text[before:place]
    resume = False
    if "SEMICOLON" in accepted and (new_line or found == "@") and not helps:
        helps = ("end the statement with `;`",)
        labels = (Label(Span(max(before - 1, start), before), "`;` missing after this?"),)
        resume = found == "@" or found[0].isalpha() or found == ".config"
    error = Diagnostic(
        "syntax/unexpected",
        Severity.ERROR,
        f"expected {expected_words(accepted)}, found `{found}`",
        Span(place, place + len(found)),
        labels=labels,
        helps=helps,
    )
    return error, place, resume


def expected_words(accepted: frozenset[str]) -> str:
    """What was expected there, in words, the likeliest first."""
    names = set(accepted) - {"$END"}
    words: list[str] = []
    if "CONFIG" in names or ("AT" in names and "NAME" in names):
        return "a thing, a step or a statement"
    if names <= {"LPAR", "PLUS", "MINUS", "NUMBER"}:
        return "a time (numbers joined by `+ - * /`)"
    if names >= _VALUE:
        words.append("a value")
        names -= _VALUE
    if names >= _RELATIONS:
        words.append("`=`, `<`, `>` or `~`")
        names -= _RELATIONS
    elif names >= _RELATIONS - {"TILDE"}:
        words.append("`=`, `<` or `>`")
        names -= _RELATIONS
    if names >= _SHAPES:
        words.append("a shape")
        names -= _SHAPES | {"STRING"}
    if len(names) > 1:
        names -= {"SPEED"}  # it belongs only after wishes, and nobody expects it here
    if names > {"WITHIN"} and "WORD" in names:
        names -= {"WITHIN"}
    words.extend(_WORDS[name] for name in _ORDER if name in names)
    names -= set(_ORDER)
    if "CIRCUMFLEX" in names or "STAR" in names:
        words.append("an operator")
        names -= {*_OPERATORS, "WORD", "ROTATE"}
    words.extend(sorted(_WORDS.get(name, name.lower()) for name in names - {"ROTATE"}))
    if not words:
        return "something else"
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " or " + words[-1]


# --- where, and what would have fitted ------------------------------------------------------------


def _end_before(text: str, start: int, place: int) -> int:
    """The end of the last text before ``place`` that is neither space nor comment."""
    end = start
    for match in _PIECE.finditer(text, start, place):
        piece = match[0]
        if not piece.isspace() and not piece.startswith(("//", "/*")):
            end = match.end()
    return end


# --- the special cases ----------------------------------------------------------------------------


def _unexpected_end(text: str, before: int, accepted: frozenset[str]) -> Diagnostic:
    helps = ("end the statement with `;`",) if "SEMICOLON" in accepted else ()
    return Diagnostic(
        "syntax/unexpected-end",
        Severity.ERROR,
        f"the script ends where {expected_words(accepted)} should follow",
        Span(max(before - 1, 0), before),
        helps=helps,
    )


def _unreadable(text: str, place: int) -> Diagnostic | None:
    """Texts without an end, characters without a meaning."""
    character = text[place]
    if character == "'" and not re.match(r"'(?:[^'\r\n]|'')*'", text[place:]):
        line_end = re.compile(r"[\r\n]|$").search(text, place)
        return Diagnostic(
            "syntax/text",
            Severity.ERROR,
            "this text never ends",
            Span(place, line_end.start() if line_end else len(text)),
            helps=("close it with `'` on the same line",),
        )
    if character in _LOOKALIKES:
        wanted = _LOOKALIKES[character]
        help_text = "write texts as `'…'`" if wanted == "'" else f"write `{wanted}`"
        return _character(character, place, (help_text,))
    if character == "_" and re.match(r"_[A-Za-z0-9_]", text[place:]):
        name = re.match(r"_+([A-Za-z0-9_]*)", text[place:])
        assert name is not None
        return Diagnostic(
            "syntax/name",
            Severity.ERROR,
            f"`{name[0]}` is not a name: a name begins with a letter",
            Span(place, place + len(name[0])),
            helps=(f"write `{name[1]}`",) if name[1][:1].isalpha() else (),
        )
    if character.isspace() or (character.isascii() and (character.isalnum() or character in ".,;:=<>~+-*/^()[]{}@'_")):
        return None
    helps = SIGNS.get(character, ())
    unit = re.search(r"\.config\s*\(([^();]*),\s*$", text[max(0, place - 80) : place])
    if character == "\u00b0" and unit:
        helps = (f"angles are always in degrees: `.config({unit[1].strip()})`",)
    if not helps and character.isalpha():
        helps = ("a name consists of the letters A to Z, a to z, digits and `_`",)
    return _character(character, place, helps)


def _character(character: str, place: int, helps: tuple[str, ...]) -> Diagnostic:
    name = f"`{character}`" if character.isprintable() else "this"
    return Diagnostic(
        "syntax/character",
        Severity.ERROR,
        f"{name} (U+{ord(character):04X}) has no meaning in a script",
        Span(place, place + 1),
        helps=helps,
    )


def _unknown_word(text: str, place: int, accepted: frozenset[str]) -> Diagnostic | None:
    """A word with a dot that the language does not have, in a place where one of its words would fit."""
    match = _DOTTED.match(text, place)
    if not match:
        return None
    word = match[0][1:]
    known: list[str] = []
    if "FUNCTION" in accepted:
        known += [*FUNCTIONS, *SYNONYMS, *CLOCKS]
    if "BAR" in accepted:
        known += SHAPES
    if "CONFIG" in accepted:
        known.append("config")
    if not known or word in known:
        return None
    guess = nearest(word, known)
    other = called(text, match.end(), word) if text.startswith("(", match.end()) else None
    kind = "shape" if "BAR" in accepted else "word"
    helps = (f"did you mean `.{guess}`?",) if guess else ()
    if other is not None:
        helps = (other,)
    if kind == "shape" and not guess:
        helps = (_SHAPES_HELP,)
    return Diagnostic(
        "syntax/unknown-word",
        Severity.ERROR,
        f"there is no {kind} `.{word}`" + (" that fits here" if kind == "word" else ""),
        Span(match.start(), match.end()),
        helps=helps,
    )


def _helps(text: str, before: int, place: int, found: str, accepted: frozenset[str]) -> tuple[str, ...]:
    """What was probably meant."""
    previous_match = re.search(r"\.?[A-Za-z0-9_.]+$|<=|>=|.$", text[max(0, before - 60) : before])
    previous = previous_match[0] if previous_match else ""
    functions = {*FUNCTIONS, *SYNONYMS}
    other = written(text, before, place, found)
    if other is not None:
        return (other,)
    step = re.search(r"@[^:;@\r\n]*$", text[:before])
    if found == ":" and step:
        return (f"a step has no colon: write `{step[0].rstrip()}`",)
    if found == "(" and "." in previous[:-1] and "CIRCUMFLEX" in accepted:
        guess = nearest(previous[previous.rfind(".") + 1 :], ["r", "rotate"])
        if guess:
            return (f"did you mean `.{guess}`?",)
    if found == "(" and previous in functions:
        return (f"write `.{previous}(…)`: the language's own words begin with a dot",)
    if "BAR" in accepted:
        return (f"write `.{found}`: the language's own words begin with a dot" if found in SHAPES else _SHAPES_HELP,)
    if found == "=" and previous in ("=", "!"):
        return ("write one `=`",)
    if found in ("=", "<", ">", "<=", ">=", "~") and "SEMICOLON" in accepted:
        return ("state one relation at a time: `a < b;  b < c;`",)
    if "STAR" in accepted and place == before and (found[0].isalpha() or found == "("):
        return (f"to multiply, write `{previous}*{found}{'…' if found == '(' else ''}`",)
    if found == "'" or found.startswith('"'):
        return ("write texts as `'…'`",)
    return ()
