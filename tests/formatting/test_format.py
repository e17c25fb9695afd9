"""`fmt`: another layout, the same script; and what is formatted stays as it is."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.errors import ScriptError
from movimentum.formatting.columns import formatted
from movimentum.formatting.elements import elements_of
from movimentum.source import SourceText
from movimentum.syntax.automaton import Token
from movimentum.syntax.concrete import concrete, tokens
from movimentum.syntax.parser import parse
from tests.broad import broad
from tests.command import ROOT
from tests.properties.scenes import Anything

GALLERY = sorted((ROOT / "scripts").rglob("*.mov"))
SMALL = [path for path in GALLERY if "penrose" not in path.stem]
BLANKS = ["", " ", "   ", "\t", "\n", "\n\n\n", "\r\n", "\r", " \n \n  ", "\u00a0", "\u3000"]
COMMENTS = [
    " // a\n",
    "//\n",
    "/* b */",
    "\n// ünï 図 \n",
    "\n\n/* c\n   d */ ",
    "/**/",
    "// x ; @ ' { \r\n",
    " /* ' */\n",
]


def text_of(path) -> str:
    return path.read_text(encoding="utf-8")


def fmt(text: str) -> str:
    return formatted(SourceText("a.mov", text))


def comments(text: str) -> list[str]:
    return [re.sub(r"\r\n|\r", "\n", each.text).rstrip() for each in elements_of(text) if each.comment]


def same(text: str) -> str:
    """The formatted text, after all that must be true of it."""
    made = fmt(text)
    assert parse(SourceText("a.mov", made)) == parse(SourceText("a.mov", text))
    assert [str(token) for token in tokens(concrete(made))] == [str(token) for token in tokens(concrete(text))]
    assert comments(made) == comments(text)
    assert fmt(made) == made
    lines = re.split(r"\r\n|\r|\n", made)
    inside = any("\n" in each.text or "\r" in each.text for each in elements_of(made) if each.comment)
    assert inside or all(line == line.rstrip() and "\t" not in line for line in lines if "//" not in line)
    assert not re.search(r"\n\s*\n\s*\n", re.sub(r"/\*.*?\*/", "x", made.replace("\r\n", "\n"), flags=re.DOTALL))
    return made


def pieces(text: str) -> Iterator[tuple[Token, str]]:
    """Every token with the white space and the comments that stand behind it."""
    found = list(tokens(concrete(text)))
    for token, following in zip(found, [*found[1:], None], strict=True):
        yield token, text[token.span.end : following.span.start if following else len(text)]


def disturbed(text: str, seed: int, share: float = 0.3) -> str:
    """The same script in any white space, with comments anywhere."""
    r = random.Random(seed)
    made = [r.choice(["", *COMMENTS, *BLANKS])]
    found = list(pieces(text))
    for (token, gap), (following, _) in zip(found, [*found[1:], (None, "")], strict=True):
        made.append(token)
        word_before_bracket = following == "(" and token.startswith(".")
        if r.random() < share and not word_before_bracket:
            between = r.choice(COMMENTS if r.random() < 0.3 else BLANKS)
            made.append(between or (" " if gap else ""))
        else:
            made.append(gap)
    return "".join(made)


IMPORTED = ("penrose-five", "penrose-twenty", "peaucellier-linkage")
"""What `import` writes, letter for letter (`tests/mechanisms/test_imported.py`)."""


@broad("path", GALLERY, every=4, ids=lambda path: path.stem)
def test_the_gallery_stays_as_it_is(path) -> None:
    made = same(text_of(path))
    assert made == text_of(path) or path.stem in IMPORTED


MESSY = """\
.config( 25,400 , 300 ) ;  .let a=3;   .let b  = [1 ,2]; // lengths
Crank:.bar A=[130,110] B=A+[50,0] .width(3); // crank
Coupler  :.plate B=[0,0] P=B+[70,90] .color( 'red' );
Path: .trace Coupler.P .whole;



@0 Crank.A=b; Crank.angle=180*.t;/* even */
Coupler.B=Crank.B; .for k=1 .. 3 { x ~ a [ k - 1 ] ; }
    // own line
  .claim x=3.within( 4 ) ;@ + 2 .loop;
.part P( a , c=3 ){
A:.bar P=[0,0] Q=[a , c] - [1,-1] ;
@0 A.P=[0,0];
}
// end"""
NEAT = """\
.config(25, 400, 300);  .let a = 3;   .let b = [1,2];    // lengths
Crank   : .bar    A = [130,110]  B = A + [50,0]   .width(3);    // crank
Coupler : .plate  B = [0,0]      P = B + [70,90]  .color('red');
Path    : .trace Coupler.P .whole;

@0   Crank.A = b;           Crank.angle = 180*.t;    /* even */
     Coupler.B = Crank.B;   .for k = 1..3 { x ~ a[k-1]; }
     // own line
     .claim x = 3 .within(4);
@+2  .loop;
.part P(a, c = 3) {
  A : .bar  P = [0,0]  Q = [a, c] - [1,-1];
  @0  A.P = [0,0];
}
// end
"""


def test_a_script_that_nobody_has_aligned() -> None:
    assert fmt(MESSY) == NEAT


@pytest.mark.parametrize("newline", ["\r\n", "\r", "\n"])
def test_lines_end_as_they_did(newline: str) -> None:
    assert fmt(MESSY.replace("\n", newline)) == NEAT.replace("\n", newline)
    assert [fmt(text) for text in ("", " \n\n", "// a")] == ["", "", "// a\n"]


def test_what_holds_is_a_statement() -> None:
    text = "A : .bar  P = [0,0]   Q = [9,0];\n@0   A.P = [0,0];\n     A.angle .holds;\n@1\n"
    assert fmt(text.replace("     A.angle", "         A.angle")) == fmt(text) == text


def test_what_would_be_read_differently_without_a_space() -> None:
    same("Rod : .bar A = [1. , 2 .x]; @0 A.x = 1. .r(2); x = 5 .e5; .for k = 1. ..5 { y = k; }")
    same("E : 'a.svg' A = #wheel * 2 B = #x .r(3); @0x = 3; @1 (-.t) = 2;")
    same("@0 x = - - 3 - -.t; y = .t* -2; .goal x .largest .weight( 3 ); z = { a<3:4;a > 5 : 6 ; 7 };")


@pytest.mark.slow
def test_long_scripts_take_time_in_proportion() -> None:
    one_line = "".join(f"Rod{n} : .bar A = [{n},0] B = [0,{n}];" for n in range(150))
    same(one_line)
    same(one_line.replace(";", ";\n"))


@pytest.mark.slow
@settings(max_examples=10)
@given(st.sampled_from(SMALL), st.integers(0, 10**9), st.floats(0, 1))
def test_white_space_and_comments_anywhere(path, seed: int, share: float) -> None:
    same_if_valid(disturbed(text_of(path), seed, share))


@settings(max_examples=10)
@given(st.integers(0, 10**9), st.integers(0, 10**9))
def test_any_script(seed: int, other: int) -> None:
    text = Anything(seed).script()
    if same_if_valid(text):
        same_if_valid(disturbed(text, other, 0.2))


def same_if_valid(text: str) -> bool:
    """Random scripts may have an error, and a comment between a word and its bracket is one."""
    try:
        parse(SourceText("a.mov", text))
    except ScriptError:
        return False
    same(text)
    return True


def test_what_is_about_whole_things_is_an_item_like_others() -> None:
    text = (
        "R : .bar A = [0,0] B = [9,0];\nPole : .centre R S[1] .text('P');\nP : .polode R .fixed;\nK : .skeleton;\n@0\n"
    )
    assert [line.index(":") for line in same(text).splitlines()[:4]] == [5, 5, 5, 5]
