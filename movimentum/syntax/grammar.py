"""The grammar file, and the LALR tables that Lark makes from it.

Importing Lark and making the tables takes about 70 ms, much of the total time for a small script. So the tables are
stored in ``tables.json`` beside this module, with the digest of their grammar. If the grammar has been edited since
then, they are made again in memory. This command saves them::

    python -m movimentum.syntax.grammar
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator
from functools import cache
from typing import Any

from movimentum.records import dataclass

GRAMMAR_NAME = "movimentum.lark"
TABLES_NAME = "tables.json"
END = "$END"
"""The terminal after the last one."""


@dataclass(frozen=True, slots=True)
class Terminal:
    """What the lexer looks for: a ``pattern`` (a regular expression) or, if ``literal``, that very text."""

    name: str
    pattern: str
    literal: bool
    priority: int


@dataclass(frozen=True, slots=True)
class Rule:
    """A grammar rule: the builder's method ``method`` makes ``symbol`` from the last ``size`` values.

    An empty ``method`` splices the values into those of the rule around; a ``transparent`` rule with one value is that
    value.
    """

    symbol: str
    size: int
    method: str
    transparent: bool


@dataclass(frozen=True, slots=True)
class Tables:
    """An LALR(1) automaton with a contextual lexer.

    ``states[s]`` maps terminals and symbols to what to do in state s: n >= 0, shift and go to state n; n < 0, reduce by
    ``rules[-1 - n]``. It begins in state 0 and accepts in state ``accept``. ``skipped`` are the patterns of the text
    between terminals.
    """

    terminals: tuple[Terminal, ...]
    skipped: tuple[str, ...]
    rules: tuple[Rule, ...]
    states: tuple[dict[str, int], ...]
    accept: int


def grammar_text() -> str:
    """The grammar's text: from the installed package, else from the checkout's ``grammar/``.

    Raises FileNotFoundError if neither has it (a broken installation).
    """
    try:
        return _packaged(GRAMMAR_NAME)
    except FileNotFoundError:
        here = os.path.dirname(os.path.abspath(__file__))
        with open(os.path.join(here, "..", "..", "grammar", GRAMMAR_NAME), encoding="utf-8") as file:
            return file.read()


def _packaged(name: str) -> str:
    """The text of a file beside this module, also where the package is not in a folder."""
    from movimentum import syntax

    loader: Any = syntax.__loader__  # importlib.resources would take longer to import than all else here to run
    data: bytes = loader.get_data(os.path.join(os.path.dirname(__file__), name))
    return data.decode("utf-8").replace("\r\n", "\n")


@cache
def load_tables() -> Tables:
    """The tables of the grammar: the saved ones if they were made from it, otherwise new ones."""
    text = grammar_text()
    try:
        kept = json.loads(_packaged(TABLES_NAME))
        if kept["grammar"] == digest(text):
            return from_json(kept)
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return make_tables(text)


def digest(text: str) -> str:
    """The digest that shows whether the grammar was edited."""
    return f"{len(text)}-{zlib.crc32(text.encode()):08x}"


def make_tables(text: str) -> Tables:
    """The tables of a grammar, by Lark; the same ones for the same grammar, whatever the order of Lark's sets."""
    from lark import Lark
    from lark.parsers.lalr_analysis import Shift

    options: dict[str, Any] = {"parser": "lalr", "lexer": "contextual", "keep_all_tokens": True}
    made: Any = Lark(text, maybe_placeholders=False, **options)
    table: Any = made.parser.parser._parse_table
    ignored = set(made.ignore_tokens)
    terminals = {item.name: item for item in made.terminals}
    rules: list[Any] = sorted(made.rules, key=lambda rule: (rule.origin.name, [item.name for item in rule.expansion]))
    numbers = {rule: number for number, rule in enumerate(rules)}

    # Number the states in the order in which they are reached.
    order: dict[Any, int] = {table.start_states["start"]: 0}
    waiting: list[Any] = list(order)
    while waiting:
        actions = table.states[waiting.pop(0)]
        for name in sorted(actions):
            action, target = actions[name]
            if action is Shift and target not in order:
                order[target] = len(order)
                waiting.append(target)

    def code(action: Any, target: Any) -> int:
        return order[target] if action is Shift else -1 - numbers[target]

    return Tables(
        terminals=tuple(
            Terminal(name, _pattern(item), item.pattern.type == "str", item.priority)
            for name, item in sorted(terminals.items())
            if name not in ignored
        ),
        skipped=tuple(sorted(_pattern(terminals[name]) for name in ignored)),
        rules=tuple(_rule(rule) for rule in rules),
        states=tuple(
            {name: code(*table.states[state][name]) for name in sorted(table.states[state])} for state in order
        ),
        accept=order[table.end_states["start"]],
    )


def _pattern(terminal: Any) -> str:
    return terminal.pattern.value if terminal.pattern.type == "str" else terminal.pattern.to_regexp()


def _rule(rule: Any) -> Rule:
    name, size = rule.origin.name, len(rule.expansion)
    transparent = bool(rule.options.expand1 and not rule.alias)
    nothing_to_call = name.startswith("_") or (transparent and size == 1)
    return Rule(name, size, rule.alias or ("" if nothing_to_call else name), transparent)


def to_json(tables: Tables, grammar: str) -> str:
    """The tables as the text of ``tables.json``, one state on each line."""

    def listed(rows: Iterator[Any]) -> str:
        return "[\n" + ",\n".join(json.dumps(row, separators=(",", ":")) for row in rows) + "\n]"

    return (
        "{"
        f'"grammar": "{digest(grammar)}",\n"accept": {tables.accept},\n"skipped": {json.dumps(tables.skipped)},\n'
        f'"terminals": {listed((t.name, t.pattern, t.literal, t.priority) for t in tables.terminals)},\n'
        f'"rules": {listed((r.symbol, r.size, r.method, r.transparent) for r in tables.rules)},\n'
        f'"states": {listed(iter(tables.states))}\n'
        "}\n"
    )


def from_json(kept: dict[str, Any]) -> Tables:
    """The tables in what was read from ``tables.json``."""
    return Tables(
        terminals=tuple(Terminal(*row) for row in kept["terminals"]),
        skipped=tuple(kept["skipped"]),
        rules=tuple(Rule(*row) for row in kept["rules"]),
        states=tuple(kept["states"]),
        accept=kept["accept"],
    )


def main() -> None:
    """Write ``tables.json``."""
    text = grammar_text()
    path = os.path.join(os.path.dirname(__file__), TABLES_NAME)
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write(to_json(make_tables(text), text))


if __name__ == "__main__":
    main()
