"""Script text to syntax tree: limits first, then the grammar. All syntax errors of a script are reported at once."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import cast

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Fix, Severity, insertion
from movimentum.errors import ScriptError
from movimentum.source import SourceText, Span
from movimentum.syntax.automaton import TooDeep, Unexpected, run
from movimentum.syntax.building import Builder, Refusal
from movimentum.syntax.expression_tree import children, postorder
from movimentum.syntax.tree import ScriptTree, all_items, expressions_of

MAX_NESTING = 100
"""How deep brackets and operators may be nested, unless the caller says otherwise."""

MAX_CHARACTERS = 4_000_000
"""How long a script may be, unless the caller says otherwise."""

MAX_ERRORS = 20
"""After this many syntax errors, the rest of a script is not read."""

_BRACKETS = re.compile(r"'(?:[^'\r\n]|'')*'|//[^\r\n]*|/\*.*?\*/|/\*|[\[({]|[\])}]", re.DOTALL)
_ITEM_END = re.compile(r"'(?:[^'\r\n]|'')*'|//[^\r\n]*|/\*.*?\*/|[;@]", re.DOTALL)
_LINE = re.compile(r"[^\r\n]*")
_OPERATIONS = re.compile(
    r"'(?:[^'\r\n]|'')*'|//[^\r\n]*|/\*.*?\*/|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|(?P<part>[;@:=<>~])|(?P<op>[-+*/^,]|\.[A-Za-z])",
    re.DOTALL | re.ASCII,
)
_CONTROL = re.compile("[\x00-\x08\x0e-\x1f\x7f\ufffe\uffff\ud800-\udfff]")


def parse(
    source: SourceText,
    *,
    max_nesting: int = MAX_NESTING,
    max_characters: int = MAX_CHARACTERS,
    max_operations: int | None = None,
) -> ScriptTree:
    """The syntax tree of a script. ``max_operations``: how many one expression may have (None: any number).

    Raises ScriptError with all syntax errors that were found (``syntax/…``), or with the limit that the text exceeds
    (``limit/…``). Time and memory grow linearly with the text; nothing recurses.
    """
    text = source.text
    _check_characters(text, max_characters)
    _check_brackets(text, max_nesting)
    if max_operations is not None and len(text) > max_operations:  # an operation takes a character at least
        _check_operations(text, max_operations)
    errors: list[Diagnostic] = []
    start = 0
    while True:
        found = _parse_from(text, start, max_nesting)
        if isinstance(found, ScriptTree):
            break
        error, start = found
        if not (errors and _is_left_over(text, error)):
            errors.append(error)
        if start >= len(text) or len(errors) >= MAX_ERRORS:
            raise ScriptError(errors)
    if errors:
        raise ScriptError(errors)
    _check_depth(found, max_nesting)
    return found


def _is_left_over(text: str, error: Diagnostic) -> bool:
    """Whether an error is only the end of a part or loop in which there was another error."""
    return (
        error.span is not None
        and text.startswith("}", error.span.start)
        and error.message.startswith("expected a thing, a step or a statement")
    )


PER_LEVEL = 16
"""More entries of the parser's stack than one level of nesting can need, whatever the rules of the grammar."""


def _parse_from(text: str, start: int, max_nesting: int) -> ScriptTree | tuple[Diagnostic, int]:
    """The tree of ``text`` from ``start`` on, or the first error there and where to continue after it.

    Text that is nested far too deeply is refused during reading: a million minus signs are not collected first.
    """
    try:
        return cast("ScriptTree", run(text, start, Builder(), PER_LEVEL * (max_nesting + 8)))
    except TooDeep as deep:
        raise ScriptError([_too_deep(Span(deep.place, deep.place + 1), max_nesting)]) from deep
    except Refusal as refusal:
        span = refusal.diagnostic.span or Span(start, start)
        return refusal.diagnostic, _next_item(text, max(span.end, start + 1))
    except Unexpected as unexpected:
        return _explained(unexpected, text, start)


def _explained(unexpected: Unexpected, text: str, start: int) -> tuple[Diagnostic, int]:
    from movimentum.syntax.messages import explain  # only a script with an error needs its words

    error, place, resume_here = explain(unexpected, text, start)
    if resume_here and place > start:
        return error, place
    return error, _next_item(text, max(place, start + 1 if place <= start else start))


def _next_item(text: str, offset: int) -> int:
    """Where the item after the one at ``offset`` begins: after the next ``;`` or at the next ``@``."""
    for match in _ITEM_END.finditer(text, offset):
        if match[0] == ";":
            return match.end()
        if match[0] == "@":
            return match.start()
    return len(text)


# --- limits ---------------------------------------------------------------------------------------


def _check_characters(text: str, max_characters: int) -> None:
    if len(text) > max_characters:
        raise ScriptError(
            [
                Diagnostic(
                    "limit/text",
                    Severity.ERROR,
                    f"the script has {len(text):,} characters, more than the limit of {max_characters:,}",
                )
            ]
        )
    control = _CONTROL.search(text)
    if control:
        raise ScriptError(
            [
                Diagnostic(
                    "syntax/binary",
                    Severity.ERROR,
                    f"this is not a script: it has the control character U+{ord(control[0]):04X}",
                    Span(control.start(), control.end()),
                    helps=("a script is plain text in UTF-8",),
                )
            ]
        )


def _check_brackets(text: str, max_nesting: int) -> None:
    """Refuse deep brackets, and a comment without end, which would be read as a division."""
    depth = 0
    for match in _BRACKETS.finditer(text):
        first = match[0]
        if first in "[({":
            depth += 1
            if depth > max_nesting:
                raise ScriptError([_too_deep(Span(match.start(), match.end()), max_nesting)])
        elif first in "])}":
            depth = max(depth - 1, 0)
        elif first == "/*":
            place = Span(match.start(), match.end())
            error = Diagnostic("syntax/comment", Severity.ERROR, "this comment never ends", place)
            raise ScriptError([error.advised(*_closed_comment(text, match.end()))])


def _closed_comment(text: str, start: int) -> Iterator[Fix]:
    """Where a comment probably ends: with its line, before the next statement, or with the text."""
    line = _LINE.match(text, start)
    item = _ITEM_END.search(text, start)
    places = [*(found.end() for found in (line, item) if found is not None), len(text.rstrip())]
    for place in dict.fromkeys(places):
        yield insertion("close it with `*/`", max(place, start), " */")


def _check_operations(text: str, max_operations: int) -> None:
    """Refuse text that would take too long, before a tree is made from it."""
    count = begin = 0
    for match in _OPERATIONS.finditer(text):
        if match.lastgroup == "op":
            count += 1
        elif match.lastgroup == "part":
            if count > max_operations:
                break
            count, begin = 0, match.end()
    if count > max_operations:
        begin += len(text[begin:]) - len(text[begin:].lstrip())
        raise ScriptError(
            [
                Diagnostic(
                    "limit/operations",
                    Severity.ERROR,
                    f"this expression has {count:,} operations, more than the limit of {max_operations:,}",
                    Span(begin, begin + 1),
                    notes=("operators, commas, members and functions count",),
                    helps=(
                        "give names to parts of it: `x = …;`",
                        Advised("`", Choose.MAX_OPERATIONS.to(count), "` allows more"),
                    ),
                )
            ]
        )


def _check_depth(script: ScriptTree, max_nesting: int) -> None:
    errors: list[Diagnostic] = []
    for item, level in all_items(script.items):
        if level > max_nesting:
            raise ScriptError([_too_deep(item.span, max_nesting)])
        for root in expressions_of(item):
            depth: dict[int, int] = {}
            nodes = list(postorder(root))
            for node in nodes if len(nodes) > max_nesting else ():  # else it cannot be
                deep = 1 + max((depth[id(child)] for child in children(node)), default=0)
                depth[id(node)] = deep
                if deep > max_nesting:
                    errors.append(_too_deep(node.span, max_nesting))
                    break
    if errors:
        raise ScriptError(errors)


def _too_deep(span: Span, max_nesting: int) -> Diagnostic:
    return Diagnostic(
        "limit/nesting",
        Severity.ERROR,
        f"this is nested deeper than the limit of {max_nesting} levels",
        span,
        notes=("brackets, minus signs, powers and functions inside one another count as levels; a long sum does not",),
        helps=(
            "give a name to a part of it: `x = …;`",
            Advised("`", Choose.MAX_NESTING.to(min(3 * max_nesting, 300)), "` allows more"),
        ),
    )
