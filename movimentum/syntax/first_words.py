"""What people write first, before they have read how it is written: options without a dot, `if`, functions, other words
for things.
"""

from __future__ import annotations

import re

from movimentum.diagnostics import Fix, insertion, replacement
from movimentum.source import Span
from movimentum.syntax.suggest import dotted
from movimentum.things.registry import KINDS, SHAPES, THING_FLAGS

_SHAPES = {
    "rope": "cord", "cable": "cord", "string": "cord", "wire": "line", "chain": "line",
    "thread": "cord", "polyline": "line", "path": "trace", "curve": "trace", "track": "trace", "locus": "trace",
    "rod": "bar", "link": "bar", "beam": "bar", "stick": "bar", "crank": "bar", "segment": "bar", "circle": "disc",
    "wheel": "disc", "ball": "disc", "dot": "disc", "point": "disc", "disk": "disc", "rect": "polygon",
    "rectangle": "polygon", "box": "polygon", "square": "polygon", "triangle": "polygon", "poly": "polygon",
    "shape": "polygon", "text": "label", "name": "label", "title": "label", "plot": "graph", "chart": "graph",
    "diagram": "graph", "support": "ground", "base": "ground", "fixed": "ground", "hatch": "ground",
    "piston": "cylinder", "shock": "damper", "absorber": "damper", "coil": "spring", "fill": "area",
    "region": "area", "gas": "area", "cloth": "area", "liquid": "area", "water": "area", "cog": "gear",
    "cogwheel": "gear", "pinion": "gear", "angle": "arc", "length": "dimension", "distance": "dimension",
    "dim": "dimension", "measure": "dimension", "guide": "slide", "rail": "slide", "force": "vector",
    "velocity": "vector",
}  # fmt: skip
"""Other words for things -> kinds."""
_SPELLED = {
    "line": ".line A.P B.Q", "trace": ".trace A.P", "bar": ".bar A = [0,0] B = [100,0]", "disc": ".disc(20) C = [0,0]",
    "polygon": ".polygon A = [0,0] B = [90,0] C = [90,60]", "label": ".label('text') A.P",
    "graph": ".graph(A.P.x) at = [300,40]", "ground": ".ground A.P", "cylinder": ".cylinder A.P B.Q",
    "damper": ".damper A.P B.Q", "spring": ".spring A.P B.Q", "area": ".area A.P A.Q B.R",
    "cord": ".cord A.P Wheel B.Q",
    "gear": ".gear(20, 5) C = [0,0]", "arc": ".arc A.P B.O C.Q", "dimension": ".dimension A.P B.Q",
    "slide": ".slide A.P B.Q", "vector": ".vector A.P .velocity(0.2)",
}  # fmt: skip
_CONDITION = "what depends on a condition is a value in braces: `{ .t < 3 : 4; 5 }` is 4 while .t < 3, else 5"
_FUNCTION = (
    "there are no functions of one's own: state `f = …;` with what it depends on in it, or `.let` for a constant;"
    " a mechanism that is used again is a `.part`"
)
_OPTIONS = {rule.name for kind in KINDS.values() for rule in kind.options}


def other_shape(word: str) -> str | None:
    """Help for another language's word for a thing."""
    kind = _SHAPES.get(word.lower())
    return None if kind is None else f"write `.{kind}`, such as `Name : {_SPELLED[kind]};`"


def unnamed(word: str, place: int) -> Fix | None:
    """Help for a kind of thing at the beginning of a statement, where its name should be."""
    return insertion(f"a thing has a name: `A : .{word}…`", place, "A : ") if word in SHAPES else None


def first_word(text: str, before: int, place: int, found: str, accepted: frozenset[str]) -> str | Fix | None:
    """Help for what is found at ``place``; the text before it ends at ``before``. None for other things."""
    line = text[max(0, before - 500) : before]
    statement = re.split(r"[;@{}]", line)[-1]
    name = re.search(r"(?<![.\w])([A-Za-z]\w*)\Z", statement)
    begin = 0 if name is None else before - len(name[1])
    defines = re.search(r":\s*(?:\.[a-z]+|')", statement) is not None
    if name is not None and defines and name[1] in _OPTIONS:
        if found == "(":
            return dotted(f"{name[1]}(…)", begin)
        if name[1] in THING_FLAGS and accepted <= {"EQUAL", "LSQB", "WORD"}:
            return dotted(name[1], begin)
    if found in "<>" and re.compile(r"[^;@{}]*\?").match(text, place):
        return _CONDITION
    if found in "<>" and re.search(r"(?<![.\w])if(?!\w)", statement):
        return _CONDITION
    if found == "?" or (name is not None and name[1] == "if") or found == "if":
        return _CONDITION
    if found == "(" and name is not None and not defines and "SEMICOLON" not in accepted | {"STAR"}:
        call = re.compile(r"\(\s*[A-Za-z]\w*(?:\s*,\s*[A-Za-z]\w*)*\s*\)\s*=").match(text, place)
        if (
            call is not None
            and name.start() == len(statement) - len(name[1])
            and re.fullmatch(r"\s*(?:\+?\s*[\d./*]+)?\s*", statement[: name.start()])
        ):
            return _FUNCTION
    if "LPAR" in accepted and len(accepted) == 1 and (word := re.search(r"\.(graph|velocities)\Z", statement)):
        rest = re.compile(r"[A-Za-z][\w.]*").match(text, place)
        if rest is not None:
            return replacement(f"write `.{word[1]}({rest[0]})`", Span(place, rest.end()), f"({rest[0]})")
    if "STRING" in accepted and re.search(r"\.label\s*\(\s*\Z", statement):
        return "the text is in quotes, and what it stands at behind it: `.label('A') Rod.P`"
    return None
