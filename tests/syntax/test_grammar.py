"""The grammar and the tables made of it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from lark import Lark, LarkError
from lark.exceptions import UnexpectedCharacters

from movimentum.syntax.automaton import Unexpected, run
from movimentum.syntax.grammar import (
    TABLES_NAME,
    digest,
    from_json,
    grammar_text,
    load_tables,
    make_tables,
    to_json,
)
from movimentum.syntax.vocabulary import CLOCKS, FUNCTIONS, SYNONYMS
from tests.broad import broad

ROOT = Path(__file__).parents[2]
TABLES = ROOT / "movimentum" / "syntax" / TABLES_NAME


def test_the_grammar_is_one_file() -> None:
    assert grammar_text() == (ROOT / "grammar" / "movimentum.lark").read_text(encoding="utf-8")


def test_the_tables_are_those_of_the_grammar() -> None:
    """If this fails, the grammar was edited: ``python -m movimentum.syntax.grammar``."""
    text = grammar_text()
    assert TABLES.read_text(encoding="utf-8") == to_json(make_tables(text), text)


@pytest.mark.slow
def test_the_tables_do_not_depend_on_the_order_of_sets() -> None:
    program = (
        "from movimentum.syntax.grammar import *\n"
        "text = grammar_text()\n"
        "print(digest(to_json(make_tables(text), text)))\n"
    )
    for seed in ("1", "2", "3"):
        done = subprocess.run(
            [sys.executable, "-c", program],
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        assert done.stdout.strip() == digest(TABLES.read_text(encoding="utf-8"))


def test_kept_tables_of_another_grammar_are_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    edited = grammar_text().replace('TILDE: "~"', 'TILDE: "?"')
    assert edited != grammar_text()
    monkeypatch.setattr("movimentum.syntax.grammar.grammar_text", lambda: edited)
    tables = load_tables.__wrapped__()
    assert [item.pattern for item in tables.terminals if item.name == "TILDE"] == ["?"]


@pytest.mark.slow
def test_reading_back() -> None:
    assert from_json(json.loads(TABLES.read_text(encoding="utf-8"))) == load_tables() == make_tables(grammar_text())


def test_starting_does_not_import_lark() -> None:
    program = (
        "import sys\n"
        "from movimentum.syntax.parser import parse\n"
        "from movimentum.source import SourceText\n"
        "parse(SourceText('x', '@0 x = 1;'))\n"
        "assert 'lark' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], env={"PYTHONPATH": str(ROOT)}, timeout=60, check=True)


# --- the automaton against Lark's own ---------------------------------------------------------------


class Plain:
    """A builder that keeps everything: (rule, parts)."""

    def __getattr__(self, name: str):
        raise AttributeError(name)


for _rule in load_tables().rules:
    if _rule.method:
        setattr(Plain, _rule.method, lambda self, parts, name=_rule.method: (name, list(parts)))


def lark_tree(tree):
    """A Lark tree as `Plain` would have it."""
    return (str(tree.data), [part if isinstance(part, str) else lark_tree(part) for part in tree.children])


@pytest.fixture(scope="module")
def lark_parser() -> Lark:
    return Lark(grammar_text(), parser="lalr", lexer="contextual", keep_all_tokens=True, maybe_placeholders=False)


SCRIPTS = [
    *[path.read_text(encoding="utf-8") for path in sorted((ROOT / "scripts").glob("*.mov"))],
    *[
        script
        for path in sorted((ROOT / "tests" / "cases").glob("*.md"))
        for script in re.findall(r"```mov[^\n]*\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)
    ],
]


@broad("number", range(len(SCRIPTS)), every=3)
def test_the_automaton_reads_as_lark_does(number: int, lark_parser: Lark) -> None:
    """The same tree; or an error at the same place, where the same terminals would have fitted."""
    text = SCRIPTS[number]
    found: Any
    try:
        expected = lark_tree(lark_parser.parse(text))
    except LarkError as error:
        expected = where(error)
    try:
        found = run(text, 0, Plain())
    except Unexpected as error:
        found = (None if error.at_end else error.place, error.accepted)
    assert found == expected


def where(error: Any) -> tuple[int | None, frozenset[str]]:
    """The offset of a Lark error (None at the end of the text), and what would have fitted."""
    accepted = frozenset(error.interactive_parser.accepts())
    if isinstance(error, UnexpectedCharacters):
        return error.pos_in_stream, accepted
    return None if error.token.type == "$END" else error.token.start_pos, accepted


def test_the_grammar_knows_the_same_words_as_the_tables_of_words() -> None:
    def words(terminal: str) -> set[str]:
        match = re.search(rf"^{terminal}: /\\\.\(\?:(.*?)\)", grammar_text(), re.MULTILINE)
        assert match
        found = match[1].split("|")
        return {word for item in found for word in ({item[:-2], item[:-1]} if item.endswith("?") else {item})}

    # `.range` is an option's word, too, and `.table` takes texts
    assert words("FUNCTION") | {"range", "table"} == {*FUNCTIONS, *SYNONYMS}
    assert words("CLOCK") == set(CLOCKS)
