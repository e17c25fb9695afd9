"""Colours: nothing of a script is lost, and every terminal of the grammar has one."""

import json
import re
from pathlib import Path

import pytest
from pygments.token import Comment, Error, Keyword, Name, Token

from movimentum.highlight import KINDS, MovimentumLexer, textmate
from movimentum.syntax.grammar import load_tables

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("script", sorted((ROOT / "scripts").glob("*.mov")), ids=lambda path: path.stem)
def test_every_script_is_read_whole(script):
    text = script.read_text()
    tokens = list(MovimentumLexer(stripnl=False, ensurenl=False).get_tokens(text))
    assert "".join(part for _, part in tokens) == text
    assert not [part for kind, part in tokens if kind is Error]


def coloured(text):
    return {part: kind for kind, part in MovimentumLexer(ensurenl=False).get_tokens(text)}


def test_words_are_told_apart():
    found = coloured("// why\n@2 .claim B.angle = .a([1,0], v) .within(1); A.l ~ .t; Rod : .bar A=[_,1.E-2]; v.r(3);")
    assert found["// why"] is Comment.Single
    assert found["@"] is Keyword.Declaration
    assert found[".claim"] is Keyword.Namespace
    assert found[".angle"] is Name.Attribute
    assert found[".a"] is Name.Function
    assert found[".l"] is Name.Attribute
    assert found[".t"] is Name.Builtin.Pseudo
    assert found[".bar"] is Keyword.Type
    assert found["_"] is Keyword.Constant
    assert found["1.E-2"] is Token.Literal.Number
    assert found[".r"] is Name.Function


def test_every_terminal_has_a_colour():
    for terminal in load_tables().terminals:
        assert terminal.name in KINDS or terminal.literal, terminal.name
    assert set(KINDS) == {t.name for t in load_tables().terminals if not t.literal}


def test_the_textmate_grammar_is_the_one_that_the_grammar_makes():
    kept = (ROOT / "grammar" / "movimentum.tmLanguage.json").read_text()
    assert kept == textmate()
    for pattern in json.loads(kept)["patterns"]:
        re.compile(pattern.get("match", ""))
