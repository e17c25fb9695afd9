"""Syntax errors in words: what was found, what was expected, and what was probably meant."""

from __future__ import annotations

import re

from movimentum.diagnostics import Diagnostic, Fix, Label, Severity, insertion, replacement
from movimentum.records import replace
from movimentum.source import Edit, Span
from movimentum.syntax.automaton import Unexpected
from movimentum.syntax.building_blocks import WORDS, claim_meant, copied, meant, other_word
from movimentum.syntax.older import SIGNS, called, first_word, other_shape, sign_fixes, unit_of_time, unnamed, written
from movimentum.syntax.suggest import dotted, nearest
from movimentum.syntax.vocabulary import CLOCKS, FUNCTIONS, SYNONYMS
from movimentum.things.registry import SHAPES

_VALUE = {"NUMBER", "NAME", "BLANK", "CLOCK", "FUNCTION", "LSQB", "LPAR", "LBRACE", "MINUS"}
_PLACE = _VALUE - {"BLANK", "LBRACE"} | {"ELEMENT"}
_TIME = _VALUE - {"BLANK", "LBRACE", "LSQB"}
_OPERATORS = {"PLUS", "MINUS", "STAR", "SLASH", "CIRCUMFLEX"}
_RELATIONS = {"EQUAL", "TILDE", "ATMOST", "BELOW", "ATLEAST", "ABOVE"}
_SHAPES = {word.upper() for word in SHAPES}
_SHAPES_HELP = "a thing is a picture `'file.png'`, `.bar`, `.plate`, `.disc(r)`, `.label('text')`, `.line`, …"
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
    "OPTION": "an option",
    "CLIP": "an option",
    "DOTS": "`..`",
    "TO": "`->`",
    "ELEMENT": "`#id`",
    "CONFIG": "`.config`",
    "WITHIN": "`.within(…)`",
    "WEIGHT": "`.weight(…)`",
    "ALWAYS": "`.always`",
    "EXTREME": "`.largest`",
    "SPEED": "`.speed(…)`",
    "PUSHES": "`.pushes`",
    "WEAK": "`.weak`",
    "HOLDS": "`.holds`",
    "FARTHEST": "`.least`",
}
_ORDER = ("SEMICOLON", "RPAR", "RSQB", "RBRACE", "COMMA", "COLON", "LPAR", "LSQB", "ABOVE", "EQUAL")
_LOOKALIKES = {
    "\u2212": "-", "\u2013": "-", "\u00d7": "*", "\u00b7": "*", "\u2217": "*", "\u00f7": "/", "\u2264": "<=",
    "\u2265": ">=", "\u201c": "'", "\u201d": "'", "\u2018": "'", "\u2019": "'", '"': "'", "\u2248": "~",
}  # fmt: skip
_END = "end the statement with `;`"
_CLOSING = {"RPAR": ")", "RSQB": "]", "RBRACE": "}"}
_QUOTED = re.compile(r"([\"\u201c\u201d\u2018\u2019])[^\"'\u201c\u201d\u2018\u2019;\r\n]*[\"'\u201c\u201d\u2018\u2019]")
_PIECE = re.compile(r"\s+|//[^\r\n]*|/\*.*?\*/|'(?:[^'\r\n]|'')*'|[A-Za-z0-9_.]+|.", re.DOTALL)
_DOTTED = re.compile(r"\.[A-Za-z][A-Za-z0-9_]*")
_ANOTHER = re.compile(r"[A-Za-z][A-Za-z0-9_.]*\s*(?:[=<>~:]|\.r|[-+*/(\[])[^;@]*;")
"""The apparent start of the next statement or definition, on the same line."""
_LET = re.compile(r"\.let\s+[A-Za-z][A-Za-z0-9_]*\s*\Z")
_SHAPELESS = re.compile(r":\s*([A-Za-z][A-Za-z0-9_]*)\Z")
_FOUND = re.compile(r"\.?[A-Za-z0-9_]+|'(?:[^'\r\n]|'')*'|<=|>=|->|.", re.DOTALL)


def explain(unexpected: Unexpected, text: str, start: int) -> tuple[Diagnostic, int, bool]:
    """The error, its offset, and whether reading can continue right there (because a ``;`` was forgotten before it).

    ``text`` is the script's; the part that was read began at ``start``.
    """
    place, accepted = unexpected.place, unexpected.accepted
    before = _end_before(text, start, place)
    is_let = _LET.search(text[max(start, before - 200) : before]) is not None
    if (
        text.startswith(":", place)
        and not is_let
        and (ahead := _definition_after(text, start, before, accepted)) is not None
    ):
        return ahead
    if accepted == frozenset({"LPAR"}) and (word := _SHAPELESS.search(text, start, before)) is not None:
        # what was read as a part's name
        place, accepted = word.start(1), frozenset({*_SHAPES, "STRING"})
        before = _end_before(text, start, place)
    elif unexpected.at_end:
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
    another = new_line or found == "@" or (place > before and _ANOTHER.match(text, place) is not None)
    if "SEMICOLON" in accepted and another and not helps:
        helps = (insertion(_END, before, ";"),)
        labels = (Label(Span(max(before - 1, start), before), "`;` missing after this?"),)
        resume = found == "@" or found[0].isalpha() or found == ".config"
    error = Diagnostic(
        "syntax/unexpected",
        Severity.ERROR,
        f"expected {expected_words(accepted)}, found `{found}`",
        Span(place, place + len(found)),
        labels=labels,
    ).advised(*helps)
    return error, place, resume


def _definition_after(
    text: str, start: int, before: int, accepted: frozenset[str]
) -> tuple[Diagnostic, int, bool] | None:
    """The error, if what was read as an anchor's name (up to ``before``, and a colon behind it) begins a definition."""
    name = re.search(r"[A-Za-z][A-Za-z0-9_]*$", text[max(start, before - 200) : before])
    if not accepted <= {"EQUAL", "LSQB", "WORD"} or name is None:  # an anchor's name, or that of a point's thing
        return None
    place = before - len(name[0])
    end = _end_before(text, start, place)
    error = Diagnostic(
        "syntax/unexpected",
        Severity.ERROR,
        f"expected `;`, a name or an option, found the definition of `{name[0]}`",
        Span(place, before),
        labels=(Label(Span(max(end - 1, start), end), "`;` missing after this?"),),
    )
    return error.advised(insertion(_END, end, ";")), place, True


def expected_words(accepted: frozenset[str]) -> str:
    """The expected tokens in words, the likeliest first."""
    names = set(accepted) - {"$END"} - ({"TABLE"} if "FUNCTION" in accepted else set[str]())
    words: list[str] = []
    if "CONFIG" in names or ("AT" in names and "NAME" in names):
        return "a thing, a step or a statement"
    if "NUMBER" in names and names <= _TIME | {"PLUS"}:
        return "a time (numbers and constants joined by `+ - * /`)"
    if "NUMBER" in names and names <= _PLACE:
        return "a place such as `[0, 0]` or `P + [10, 0]`"
    if names >= _VALUE:
        words.append("a value")
        names -= _VALUE | {"RANGE", "FARTHEST"}
    if names >= _RELATIONS:
        words.append("`=`, `<`, `>` or `~`")
        names -= _RELATIONS
    elif names >= {"ATMOST", "BELOW", "ATLEAST"}:
        words.append("a comparison")
        names -= _RELATIONS - {"ABOVE"} if "COLON" not in names and "RBRACE" in names else _RELATIONS
    elif names >= _RELATIONS - {"TILDE"}:
        words.append("`=`, `<` or `>`")
        names -= _RELATIONS
    if names >= _SHAPES:
        words.append("a shape")
        names -= _SHAPES | {"STRING"}
    if len(names) > 1:
        names -= {"SPEED", "PUSHES", "WEAK", "HOLDS", "FARTHEST", "TO", "CLIP"}  # nobody expects them here
    if "WORD" in names:
        names -= {"WITHIN", "WEIGHT", "ALWAYS", "EXTREME"} if len(names) > 1 else set()
    if "CIRCUMFLEX" in names or "STAR" in names:
        names -= {"LSQB"}  # an index, which hardly anybody expects
    words.extend(_WORDS[name] for name in _ORDER if name in names)
    names -= set(_ORDER)
    if "CIRCUMFLEX" in names or "STAR" in names:
        words.append("an operator")
        names -= {*_OPERATORS, "WORD", "OPTION", "ROTATE", "MOMENT", "LSQB", "TO"}
    words.extend(sorted({_WORDS.get(name, name.lower()) for name in names - {"ROTATE", "MOMENT"}}))
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
    helps: tuple[str | Fix, ...] = (insertion(_END, before, ";"),)
    if (late := unit_of_time(text, before)) is not None:
        helps = (late,)
    elif "SEMICOLON" not in accepted:
        helps = _unclosed(before, accepted)
    return Diagnostic(
        "syntax/unexpected-end",
        Severity.ERROR,
        f"the script ends where {expected_words(accepted)} should follow",
        Span(max(before - 1, 0), before),
    ).advised(*helps)


def _unreadable(text: str, place: int) -> Diagnostic | None:
    """Texts without an end, characters without a meaning."""
    character = text[place]
    if character == "'" and not re.match(r"'(?:[^'\r\n]|'')*'", text[place:]):
        return _endless_text(text, place)
    if character in _LOOKALIKES:
        return _character(character, place).advised(_lookalike(text, place))
    if character == "_" and re.match(r"_[A-Za-z0-9_]", text[place:]):
        name = re.compile(r"_+([A-Za-z0-9_]*)").match(text, place)
        assert name is not None
        return Diagnostic(
            "syntax/name",
            Severity.ERROR,
            f"`{name[0]}` is not a name: a name begins with a letter",
            Span(place, place + len(name[0])),
        ).advised(*((replacement(f"write `{name[1]}`", Span(*name.span()), name[1]),) if name[1][:1].isalpha() else ()))
    if character.isspace() or (character.isascii() and (character.isalnum() or character in ".,;:=<>~+-*/^()[]{}@'_")):
        return None
    unit = re.search(r"\.config\s*\(([^();]*)(,\s*)$", text[max(0, place - 80) : place])
    if character == "\u00b0" and unit:
        title = f"angles are always in degrees: `.config({unit[1].strip()})`"
        return _character(character, place).advised(replacement(title, Span(place - len(unit[2]), place + 1), ""))
    helps = SIGNS.get(character, ())
    if not helps and character.isalpha():
        helps = ("a name consists of the letters A to Z, a to z, digits and `_`",)
    fixes = sign_fixes(text, place)
    if character == "#":  # a colour, or a comment
        return _character(character, place).advised(*fixes)
    return replace(_character(character, place), helps=helps, fixes=fixes)


def _endless_text(text: str, place: int) -> Diagnostic:
    found = re.compile(r"[^\r\n]*").match(text, place)
    end = place if found is None else found.end()
    title = "close it with `'` on the same line"
    word = re.compile(r"'[^\s;)']*").match(text, place)  # a file's name or a colour: other things may follow it
    rest = re.compile(r"'[^\r\n]*?(?=[\s;)]*$)", re.MULTILINE).match(text, place)
    places = [match.end() for match in (word, rest) if match is not None]
    diagnostic = Diagnostic("syntax/text", Severity.ERROR, "this text never ends", Span(place, end))
    return diagnostic.advised(*(insertion(title, offset, "'") for offset in dict.fromkeys([*places, end])))


def _lookalike(text: str, place: int) -> str | Fix:
    """What to write instead of a sign that looks like one of the language's; of quotes, both are replaced."""
    wanted = _LOOKALIKES[text[place]]
    if wanted != "'":
        return replacement(f"write `{wanted}`", Span(place, place + 1), wanted)
    title = "write texts as `'…'`"
    quotes = _QUOTED.match(text, place)
    if quotes is None:
        return title
    ends = (place, quotes.end() - 1)
    return Fix(title, tuple(Edit(Span(offset, offset + 1), "'") for offset in ends))


def _character(character: str, place: int) -> Diagnostic:
    name = f"`{character}`" if character.isprintable() else "this"
    return Diagnostic(
        "syntax/character",
        Severity.ERROR,
        f"{name} (U+{ord(character):04X}) has no meaning in a script",
        Span(place, place + 1),
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
        known += WORDS
    if not known or word in known:
        return None
    guess = nearest(word, known) or (other_word(word) if "CONFIG" in accepted else None)
    other = called(text, place, match.end(), word) if text.startswith("(", match.end()) else None
    kind = "shape" if "BAR" in accepted else "word"
    here = Span(*match.span())
    helps: tuple[str | Fix, ...] = (replacement(f"did you mean `.{guess}`?", here, f".{guess}"),) if guess else ()
    if other is not None:
        helps = (other,)
    if kind == "shape" and (meant_by := other_shape(word)) is not None:
        helps = (meant_by,)
    elif kind == "shape" and not guess:
        helps = (_SHAPES_HELP,)
    elif "CONFIG" in accepted and (whole := unnamed(word, place)) is not None:
        helps = (whole,)
    return Diagnostic(
        "syntax/unknown-word",
        Severity.ERROR,
        f"there is no {kind} `.{word}`" + (" that fits here" if kind == "word" else ""),
        here,
    ).advised(*helps)


def _transition_helps(text: str, place: int) -> tuple[str | Fix, ...]:
    """Where `->` can stand, which is not here."""
    claim = re.search(r"\.(claim|goal|require)\s+(?=[^;]*\Z)", text[:place])
    if claim is not None:
        what = {"claim": "a claim", "goal": "a goal", "require": "a requirement"}[claim[1]]
        title = f"{what} is about a result; without `.{claim[1]}` this statement causes it"
        return (replacement(title, Span(*claim.span()), ""),)
    what = "the two values that are the whole right side of a statement, or one of its components"
    return (f"`->` joins {what}: `x = 0 -> 90;`, `P = [10, 0 -> 90];`",)


def _helps(text: str, before: int, place: int, found: str, accepted: frozenset[str]) -> tuple[str | Fix, ...]:
    """The probable intention."""
    previous_match = re.search(r"\.?[A-Za-z0-9_.]+$|<=|>=|.$", text[max(0, before - 60) : before])
    previous = previous_match[0] if previous_match else ""
    begin, here = before - len(previous), Span(place, place + len(found))
    other = (
        first_word(text, before, place, found, accepted)
        or meant(text, before, place, found, accepted)
        or claim_meant(text, before, place, found)
        or written(text, before, place, found)
    )
    if other is not None:
        return (other,)
    if "BAR" in accepted and (copy := copied(text, place, here.end)) is not None:
        return (copy,)
    if found == "->":
        return _transition_helps(text, place)
    number = re.fullmatch(r"(\d+)\.([a-z]+)", previous)
    if found == "(" and number and number[2] in {*FUNCTIONS, *SYNONYMS}:
        title = f"to multiply, write `{number[1]}*.{number[2]}(…)`"
        return (insertion(title, begin + len(number[1]), "*"),)
    if "RSQB" in accepted and (half := re.search(r"\[([^\[\](),;]*)$", text[max(0, before - 80) : before])):
        rest = re.compile(r"([^\[\],;]*)\]").match(text, place)
        if rest is not None:
            return (insertion(f"write a vector as `[{half[1].strip()}, {rest[1].strip()}]`", before, ","),)
    pair = re.compile(r"\(([^()\[\];]*)\)").match(text, place)
    if found == "(" and pair and "LSQB" in accepted and not accepted & {"LPAR", "STAR"}:
        edits = (Edit(here, "["), Edit(Span(pair.end() - 1, pair.end()), "]"))
        return (Fix(f"write a vector as `[{pair[1].strip()}]`", edits),)
    step = re.search(r"@[^:;@\r\n]*$", text[:before])
    if found == ":" and step:
        return (replacement(f"a step has no colon: write `{step[0].rstrip()}`", here, ""),)
    if found == "(" and "." in previous[:-1] and "CIRCUMFLEX" in accepted:
        word = previous[previous.rfind(".") + 1 :]
        if guess := nearest(word, ["r", "rotate"]):
            return (replacement(f"did you mean `.{guess}`?", Span(before - len(word), before), guess),)
    if found == "(" and previous in {*FUNCTIONS, *SYNONYMS}:
        return (dotted(f"{previous}(…)", begin),)
    if "BAR" in accepted and found in SHAPES:
        return (dotted(found, place),)
    if "BAR" in accepted:
        return (_SHAPES_HELP,)
    if found == "=" and previous in ("=", "!"):
        return (replacement("write one `=`", Span(begin, here.end), "="),)
    if found in ("=", "<", ">", "<=", ">=", "~") and "SEMICOLON" in accepted:
        title = "state one relation at a time: `a < b;  b < c;`"
        middle = re.search(r"[=<>~]\s*([^=<>~;@]+)$", text[max(0, before - 500) : before])
        return (title if middle is None else insertion(title, before, f";  {middle[1].strip()}"),)
    if "STAR" in accepted and place == before and (found[0].isalpha() or found == "("):
        return (insertion(f"to multiply, write `{previous}*{found}{'…' if found == '(' else ''}`", place, "*"),)
    if found == "'" or found.startswith('"'):
        return ("write texts as `'…'`",)
    return _brackets(before, here, found, accepted)


def _brackets(before: int, here: Span, found: str, accepted: frozenset[str]) -> tuple[Fix, ...]:
    """A bracket of the wrong kind, one too many, or one that is missing."""
    wanted = next((sign for name, sign in _CLOSING.items() if name in accepted), None)
    if found in _CLOSING.values():
        if wanted is not None:
            return (replacement(f"write `{wanted}`", here, wanted), replacement(f"leave out `{found}`", here, ""))
        open_ = "SEMICOLON" not in accepted
        return () if open_ else (replacement(f"nothing is open here: leave out `{found}`", here, ""),)
    return _unclosed(before, accepted) if wanted is not None and found in (";", "@") else ()


def _unclosed(before: int, accepted: frozenset[str]) -> tuple[Fix, ...]:
    wanted = next((sign for name, sign in _CLOSING.items() if name in accepted), None)
    if wanted is None:
        return ()
    title = f"close the bracket with `{wanted}`"
    return (insertion(title, before, wanted), insertion(title, before, f"{wanted};"))
