"""Runs the LALR tables over a text: a contextual lexer, a stack, and no recursion."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from movimentum.cancellation import look
from movimentum.records import dataclass, field
from movimentum.source import Span
from movimentum.syntax.grammar import END, Tables, load_tables


class Token(str):
    """A piece of text with the name of its terminal (``type``) and its place."""

    __slots__ = ("span", "type")

    span: Span
    type: str


class Unexpected(Exception):
    """At offset ``place``, the text continues in a way that the grammar does not allow.

    ``accepted`` are the terminals that are possible there; ``at_end``: the text ends instead.
    """

    def __init__(self, place: int, at_end: bool, accepted: frozenset[str]) -> None:
        self.place = place
        self.at_end = at_end
        self.accepted = accepted
        super().__init__(f"at offset {place}")


class TooDeep(Exception):
    """More is open at offset ``place`` than the caller allows."""

    def __init__(self, place: int) -> None:
        self.place = place
        super().__init__(f"at offset {place}")


Match = Callable[[str, int], "re.Match[str] | None"]


@dataclass(frozen=True, slots=True)
class _Lexer:
    """The possible terminals of one state: literal texts (the longest first) and patterns, with their names.

    ``beginning``: the literals that begin with a character, found when that character first comes up.
    """

    literals: tuple[tuple[str, str], ...]
    patterns: tuple[tuple[str, Match], ...]
    beginning: dict[str, tuple[tuple[str, str], ...]] = field(default_factory=dict[str, tuple[tuple[str, str], ...]])

    def token(self, text: str, place: int) -> Token | None:
        """The token at offset ``place``."""
        first = text[place]
        literals = self.beginning.get(first)
        if literals is None:
            literals = tuple(item for item in self.literals if item[1][0] == first)
            self.beginning[first] = literals
        for name, literal in literals:
            if text.startswith(literal, place):
                return _new_token(literal, name, place)
        for name, match in self.patterns:
            found = match(text, place)
            if found:
                return _new_token(found[0], name, place)
        return None


def run(text: str, start: int, builder: object, deepest: int = 10**9) -> Any:
    """The result of ``builder`` for ``text`` from offset ``start`` on.

    The builder has a method for each rule, which gets the list of its parts (tokens, and what other methods returned).
    Raises Unexpected, TooDeep if the stack would have more than ``deepest`` entries, and whatever the builder raises.
    Time is linear in the text.
    """
    tables, lexers, skip, rules = _prepared(type(builder))
    table, accept = tables.states, tables.accept
    states, values = [0], list[Any]()
    place, end = start, len(text)
    while True:
        look()
        found = skip(text, place)
        place = found.end() if found else place
        token = lexers[states[-1]].token(text, place) if place < end else None
        if token is None and place < end:
            raise Unexpected(place, False, _accepted(tables, states))
        name = END if token is None else token.type
        while (action := table[states[-1]].get(name)) is not None and action < 0:
            symbol, size, transparent, method = rules[-1 - action]
            if size == 1 and transparent and type(values[-1]) is not _Spliced:  # most are: the value has another name
                states[-1] = table[states[-2]][symbol]
            else:
                parts: list[Any] = []
                if size:
                    parts = values[-size:]
                    del values[-size:], states[-size:]
                states.append(table[states[-1]][symbol])
                values.append(_made(parts, transparent, method, builder))
            if token is None and states[-1] == accept:
                return values[-1]
        if action is None:
            raise Unexpected(place, token is None, _accepted(tables, states))
        assert token is not None
        if len(states) > deepest:
            raise TooDeep(place)
        states.append(action)
        values.append(token)
        place = token.span.end


class _Spliced(list[Any]):
    """Parts that belong to the rule around."""


def _made(parts: list[Any], transparent: bool, method: Method | None, builder: object) -> Any:
    if transparent and len(parts) == 1 and not isinstance(parts[0], _Spliced):
        return parts[0]
    if parts and isinstance(parts[0], _Spliced):  # the usual case of a repetition: go on with its list
        whole = parts[0]
        rest = parts[1:]
    else:
        whole, rest = _Spliced(), parts
    for part in rest:
        if isinstance(part, _Spliced):
            whole.extend(part)
        else:
            whole.append(part)
    return whole if method is None else method(builder, whole)


def _new_token(text: str, name: str, place: int) -> Token:
    token = Token(text)
    token.type = name
    token.span = Span(place, place + len(text))
    return token


def _accepted(tables: Tables, stack: Sequence[int]) -> frozenset[str]:
    """The terminals that would be shifted (or would end the text) after the reductions that they call for."""
    return frozenset(
        name
        for name in tables.states[stack[-1]]
        if (name.isupper() or name == END) and _would_go_on(tables, list(stack), name)
    )


def _would_go_on(tables: Tables, stack: list[int], name: str) -> bool:
    while (action := tables.states[stack[-1]].get(name)) is not None:
        if action >= 0:
            return True
        rule = tables.rules[-1 - action]
        if rule.size:
            del stack[-rule.size :]
        stack.append(tables.states[stack[-1]][rule.symbol])
        if name == END and stack[-1] == tables.accept:
            return True
    return False


Prepared = tuple[Tables, tuple[_Lexer, ...], Match, tuple[tuple[str, int, bool, "Method | None"], ...]]
"""Tables, a lexer for each state, the pattern of what is skipped; of each rule symbol, size, transparent, method."""
Method = Callable[[Any, list[Any]], Any]


@cache
def _prepared(builder: type) -> Prepared:
    """The tables with their patterns compiled and the builder's methods looked up."""
    tables = load_tables()
    literals = {item.name: item for item in tables.terminals if item.literal}
    patterns = {item.name: item for item in tables.terminals if not item.literal}
    compiled = {name: re.compile(item.pattern).match for name, item in patterns.items()}
    known: dict[frozenset[str], _Lexer] = {}

    def lexer(actions: dict[str, int]) -> _Lexer:
        names = frozenset(actions)
        if names not in known:
            short = sorted(
                (literals[name] for name in names & literals.keys()), key=lambda t: (-len(t.pattern), t.name)
            )
            long = sorted((patterns[name] for name in names & patterns.keys()), key=lambda t: (-t.priority, t.name))
            known[names] = _Lexer(
                tuple((item.name, item.pattern) for item in short),
                tuple((item.name, compiled[item.name]) for item in long),
            )
        return known[names]

    skip = re.compile("(?:" + "|".join(tables.skipped) + ")*").match
    rules = tuple(
        (rule.symbol, rule.size, rule.transparent, getattr(builder, rule.method) if rule.method else None)
        for rule in tables.rules
    )
    return tables, tuple(lexer(actions) for actions in tables.states), skip, rules
