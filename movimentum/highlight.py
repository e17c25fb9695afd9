"""Syntax colours for scripts: a Pygments lexer, and a TextMate grammar for editors, both generated from the terminals
of the Lark grammar.

A word has the same colour everywhere, so a lexer without a parser is enough. Invalid text is still coloured as far as
possible. After editing the grammar, this command::

    python -m movimentum.highlight

writes ``grammar/movimentum.tmLanguage.json`` again, and its copy in ``editors/vscode``.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, ClassVar

from pygments.lexer import RegexLexer
from pygments.token import Comment, Keyword, Name, Number, Operator, Punctuation, String, Text
from pygments.token import _TokenType as TokenKind  # pyright: ignore[reportPrivateUsage]

from movimentum.syntax.grammar import Terminal, load_tables
from movimentum.syntax.vocabulary import THING_MEMBERS, VECTOR_MEMBERS
from movimentum.things.registry import SHAPES

KINDS: dict[str, tuple[TokenKind, str]] = {
    "CONFIG": (Keyword.Namespace, "keyword.other.config"),
    "CLAIM": (Keyword.Namespace, "keyword.other.claim"),
    "GOAL": (Keyword.Namespace, "keyword.other.goal"),
    "REQUIRE": (Keyword.Namespace, "keyword.other.require"),
    "LET": (Keyword.Namespace, "keyword.other.let"),
    "PART": (Keyword.Namespace, "keyword.other.part"),
    "BODY": (Keyword.Namespace, "keyword.other.body"),
    "INCLUDE": (Keyword.Namespace, "keyword.other.include"),
    "FOR": (Keyword.Namespace, "keyword.control.for"),
    "FILM_LOOP": (Keyword.Namespace, "keyword.control.loop"),
    "VIEW": (Keyword.Namespace, "keyword.control.view"),
    "RANGE": (Keyword.Namespace, "keyword.other.range"),
    "UNIT": (Keyword.Namespace, "keyword.other.unit"),
    "WITHIN": (Keyword.Namespace, "keyword.other.within"),
    "ALWAYS": (Keyword.Namespace, "keyword.other.always"),
    "WEIGHT": (Keyword.Namespace, "keyword.other.weight"),
    "EXTREME": (Keyword.Namespace, "keyword.other.extreme"),
    "SPEED": (Keyword.Namespace, "keyword.other.speed"),
    "PUSHES": (Keyword.Namespace, "keyword.other.pushes"),
    "WEAK": (Keyword.Namespace, "keyword.other.weak"),
    "HOLDS": (Keyword.Namespace, "keyword.other.holds"),
    "FARTHEST": (Keyword.Namespace, "keyword.other.farthest"),
    **{word.upper(): (Keyword.Type, "storage.type.shape") for word in SHAPES},
    "CLOCK": (Name.Builtin.Pseudo, "variable.language.clock"),
    "FUNCTION": (Name.Function, "support.function"),
    "MOMENT": (Name.Function, "support.function"),
    **dict.fromkeys(("TABLE", "SMOOTH", "HELD", "PERIODIC", "OVER"), (Name.Function, "support.function")),
    "ROTATE": (Name.Function, "support.function"),
    "WORD": (Name.Attribute, "entity.other.attribute-name"),
    "WHILE": (Name.Attribute, "entity.other.attribute-name"),
    "CLIP": (Name.Attribute, "entity.other.attribute-name"),
    "OPTION": (Name.Attribute, "entity.other.attribute-name"),
    "ELEMENT": (Name.Label, "entity.name.element"),
    "NUMBER": (Number, "constant.numeric"),
    "STRING": (String.Single, "string.quoted.single"),
    "BLANK": (Keyword.Constant, "constant.language.blank"),
    "NAME": (Name.Variable, "variable.other"),
}
"""Terminal -> its Pygments token and its TextMate scope, in the order in which they are tried; signs follow."""

_COMMENTS = ((r"//[^\r\n]*", Comment.Single, "comment.line"), (r"/\*[\s\S]*?\*/", Comment.Multiline, "comment.block"))
_STEP = r"@\+?"
_RELATIONS = {"EQUAL", "TILDE", "ATMOST", "BELOW", "ATLEAST", "ABOVE"}


def _terminals() -> dict[str, Terminal]:
    return {terminal.name: terminal for terminal in load_tables().terminals}


def _patterns() -> list[tuple[str, TokenKind, str]]:
    """(regular expression, token, scope), the first that matches wins."""
    known = _terminals()
    found = [*_COMMENTS, (_STEP, Keyword.Declaration, "keyword.control.step")]
    # after a value a dotted word is a member: `B.a` is an anchor or an angle, `.a(…)` a function
    members = "|".join(sorted({*THING_MEMBERS, *VECTOR_MEMBERS}, key=lambda word: (-len(word), word)))
    found.append(
        (rf"(?<=[A-Za-z0-9_)\]])\.(?:{members})(?![A-Za-z0-9_(])", Name.Attribute, "entity.other.attribute-name")
    )
    found += [(known[name].pattern, token, scope) for name, (token, scope) in KINDS.items() if name in known]
    signs = [t for t in known.values() if t.name not in KINDS and t.name not in ("AT",)]
    for terminal in sorted(signs, key=lambda t: -len(t.pattern)):
        token = Operator if terminal.name in _RELATIONS or terminal.pattern in "+-*/^" else Punctuation
        pattern = re.escape(terminal.pattern) if terminal.literal else terminal.pattern
        found.append((pattern, token, "keyword.operator" if token is Operator else "punctuation"))
    return found


class MovimentumLexer(RegexLexer):
    """Scripts of Movimentum, ``*.mov``."""

    name = "Movimentum"
    aliases = ("movimentum",)
    filenames = ("*.mov",)
    tokens: ClassVar[dict[str, Any]] = {
        "root": [(r"\s+", Text.Whitespace), *((pattern, token) for pattern, token, _ in _patterns())]
    }


def textmate() -> str:
    """The TextMate grammar, as JSON."""
    patterns = [
        {"name": f"{scope}.movimentum", "match": pattern}
        for pattern, _, scope in _patterns()
        if scope != "comment.block"
    ]
    block = {"name": "comment.block.movimentum", "begin": r"/\*", "end": r"\*/"}
    about = {
        "name": "Movimentum",
        "scopeName": "source.movimentum",
        "fileTypes": ["mov"],
        "patterns": [block, *patterns],
    }
    return json.dumps(about, indent=1) + "\n"


if __name__ == "__main__":
    for folder in ("grammar", "editors/vscode/syntaxes"):
        target = Path(__file__).resolve().parent.parent / folder / "movimentum.tmLanguage.json"
        target.write_text(textmate(), encoding="utf-8", newline="\n")
