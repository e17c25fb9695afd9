"""Spellings from the 2012 notes, other languages and mathematics, with how to write each of them here.

Also common first attempts: options without a dot, `if`, functions, other words for things.
"""

from __future__ import annotations

import re

from movimentum.diagnostics import Fix, insertion, replacement
from movimentum.source import Edit, Span
from movimentum.syntax.suggest import dotted
from movimentum.things.registry import KINDS, SHAPES, THING_FLAGS

SIGNS = {
    "\u00b0": ("angles are in degrees: leave out the `°`",),
    "\u00b2": ("write `^2`", "the square of the length of a vector is `(…).l^2`"),
    "\u00b3": ("write `^3`",),
    "\u221a": ("write `.sqrt(…)`",),
    "\u222b": ("write `.integral(…)`",),
    "\u03c0": ("write `.pi`",),
    "\u2032": ("write `.differential(…)` for the time derivative",),
    "|": ("the length of a vector is `(…).l`, the absolute value of a number is `.abs(…)`",),
    "\u2260": ("a statement uses `=`, `<`, `>` or `~`",),
    "\u2192": ("write `=`: a motion is an equation that says where something is at each time, with `.t`",),
    "\u00bd": ("write `1/2`",),
    "\u00bc": ("write `1/4`",),
    "\u00be": ("write `3/4`",),
    "\u221e": ("there is no infinity: leave out the bound",),
    "#": ("a comment begins with `//`",),
    "!": ("a statement uses `=`, `<`, `>` or `~`",),
    "&": ("two statements hold together: end each with `;`",),
    "%": ("the remainder is `.mod(a, b)`",),
}
"""The probable meaning of signs that have no meaning in a script."""

_LEFT_OUT = {"\u00b0"}
_COLOUR = re.compile(r"#([0-9a-fA-F]{6}|[0-9a-fA-F]{3})(?![\w])")
_WRITTEN = {
    "\u00b2": "^2", "\u00b3": "^3", "\u03c0": ".pi", "\u2192": "=", "\u00bd": "1/2", "\u00bc": "1/4", "\u00be": "3/4",
    "#": "//",
}  # fmt: skip
"""How to write a sign, where that needs to know nothing else."""
_ROOT = re.compile(r"\u221a\s*(\([^()]*\)|[A-Za-z0-9_.]+)")
_BARS = re.compile(r"\|([^|;@\r\n]+)\|")

_MEMBERS = {"length": "l", "l": "l", "LENGTH": "l", "Length": "l", "len": "l", "abs": "l", "norm": "l"}
_DISTANCES = ("dist", "distance", "Distance")
_SIMPLE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(\.[A-Za-z][A-Za-z0-9_]*)*")
_TIMED = re.compile(r"(@\s*\+?\s*[\d./]*\d)\s*((?:s|sec|secs|seconds|ms)\b)$")
_DEFINES = re.compile(r"\s*[.']")
_STEP = re.compile(r"@\s*\+?[^:;@=\r\n]*$")


def sign_fixes(text: str, place: int) -> tuple[Fix, ...]:
    """The fixes for a sign that has no meaning; each is a help of `SIGNS` or one way to do what it says."""
    character = text[place]
    here = Span(place, place + 1)
    factor = text[place - 1 : place].isalnum() or text[place - 1 : place] == ")"
    if character == "\u03c0" and factor:
        return (replacement(SIGNS[character][0], here, "*.pi"),)
    if character in "\u00bd\u00bc\u00be" and factor:  # one and a half, which may be part of a product
        return ()
    if character == "#" and (colour := _COLOUR.match(text, place)) and text[:place].rstrip().endswith("("):
        return (replacement(f"a colour is a text: `'{colour[0]}'`", Span(*colour.span()), f"'{colour[0]}'"),)
    if character in _WRITTEN:
        return (replacement(SIGNS[character][0], here, _WRITTEN[character]),)
    if character in _LEFT_OUT:
        return (replacement(SIGNS[character][0], here, ""),)
    if character == "\u221a" and (root := _ROOT.match(text, place)):
        new = f".sqrt({root[1].removeprefix('(').removesuffix(')')})"
        return (replacement(f"write `{new}`", Span(*root.span()), new),)
    if character == "|" and (bars := _BARS.match(text, place)):
        inner = bars[1].strip()
        both = (f"{_vector(inner)}.l", f".abs({inner})")
        return tuple(replacement(f"write `{new}`", Span(*bars.span()), new) for new in both)
    return ()


def called(text: str, start: int, place: int, word: str) -> Fix | None:
    """How to write a function that does not exist here (``.length(v)``, ``distance(P, Q)``, ``rotate(v, a)``);
    ``start`` is the offset of its name and ``place`` that of its ``(``.
    """
    found = _arguments(text, place)
    if found is None:
        return None
    arguments, end = found
    new, why = None, ""
    if word in _MEMBERS and len(arguments) == 1:
        new, why = f"{_vector(arguments[0])}.{_MEMBERS[word]}", ": it follows its vector"
    elif word in _DISTANCES and len(arguments) == 2:
        new = f"({arguments[0]} - {arguments[1]}).l"
    elif word in ("rotate", "r", "rot") and len(arguments) == 2:
        new, why = f"{_vector(arguments[0])}.rotate({arguments[1]})", ": it follows its vector"
    elif word in ("x", "y", "z") and len(arguments) == 1:
        new = f"{_vector(arguments[0])}.{word}"
    return None if new is None else replacement(f"write `{new}`{why}", Span(start, end), new)


def written(text: str, before: int, place: int, found: str) -> str | Fix | None:
    """Help for the text at ``place``, after the text that ends at ``before``, if it is a spelling from elsewhere."""
    behind, ahead = text[max(0, before - 80) : before], text[place : place + 80]
    here = Span(place, place + len(found))
    name = re.search(r"(?<![A-Za-z0-9_])\.?([A-Za-z]+)$", behind)
    if found == "(" and name is not None:
        begin = before - len(name[0])
        if name[0] == "config":
            return dotted("config(…)", begin)
        if name[0] == ".rot" and (angle := _arguments(text, place)) is not None and len(angle[0]) == 1:
            return replacement(f"write `.rotate({angle[0][0]})`", Span(begin, before), ".rotate")
        return called(text, begin, place, name[1])
    if found == ";" and (step := _STEP.search(behind)) and re.search(r"\d", step[0]):
        return replacement(f"a step's time has no `;` after it: write `{step[0].rstrip()}`", here, "")
    if found in ("deg", "degree", "degrees"):
        return replacement(f"angles are in degrees: leave out `{found}`", Span(before, here.end), "")
    if found in ("rad", "radians"):
        return "angles are in degrees"
    if found == "*" and behind.endswith("*"):
        return replacement("write `^` for a power", Span(before - 1, here.end), "^")
    if found == ":" and ahead.startswith(":="):
        return replacement("write `=`", Span(place, place + 2), "=")
    if found == "=" and behind.endswith(":"):
        return replacement("write `=`", Span(before - 1, here.end), "=")
    if found in ("<", ">") and behind.endswith("="):
        return replacement(f"write `{found}=`", Span(before - 1, here.end), f"{found}=")
    if (late := unit_of_time(text, before)) is not None:
        return late
    if (name := _misnamed(text, before, place, found)) is not None:
        return name
    if behind.endswith((".rotate", ".r")) and (number := re.match(r"-?[A-Za-z0-9_.]+", ahead)):
        return replacement(f"write `.rotate({number[0]})`", Span(before, place + number.end()), f"({number[0]})")
    if found == ",":
        return _comma(text, before, place, behind, ahead)
    if found == ";" and (pair := re.search(r"\[([^\[\]]*)$", behind)) and (rest := re.match(r";([^\[\]]*)\]", ahead)):
        return replacement(f"write a vector as `[{pair[1].strip()}, {rest[1].strip()}]`", here, ",")
    return None


def unit_of_time(text: str, before: int) -> Fix | None:
    """A step's time that ends at ``before`` with a unit."""
    late = _TIMED.search(text, max(0, before - 80), before)
    if late is None:
        return None
    return replacement(f"a time has no unit: `{late[1]}`", Span(late.end(1), before), "")


def _misnamed(text: str, before: int, place: int, found: str) -> Fix | None:
    """A definition of something whose name is none: `my-rod`, or `2nd`."""
    behind, ahead = text[max(0, before - 80) : before], text[place : place + 80]
    name, new = None, ""
    if found == ":" and _DEFINES.match(ahead[1:]) and (dashed := re.search(r"(?<![\w.])[A-Za-z]\w*(-\w+)+$", behind)):
        name, new = dashed[0], dashed[0].replace("-", "_")
    elif (digits := re.search(r"(?<![\w.])\d+$", behind)) and (
        word := re.match(r"([A-Za-z]\w*)\s*:\s*(?=[.'])", ahead)
    ):
        name, new = digits[0] + word[1], f"{word[1]}_{digits[0]}"
    if name is None or place - before > (0 if found != ":" else 20):
        return None
    uses = [match.span() for match in re.finditer(rf"(?<![\w.]){re.escape(name)}(?!\w)", text)]
    title = f"a name has letters, digits and `_`, a letter first: `{new}`"
    return Fix(title, tuple(Edit(Span(*use), new) for use in uses))


def _comma(text: str, before: int, place: int, behind: str, ahead: str) -> Fix | None:
    """Help for a comma in the wrong place."""
    here = Span(place, place + 1)
    digits, more = re.search(r"(?<![\w.])(\d+)$", behind), re.match(r",(\d+)", ahead)
    if digits and more and not _in_vector(text, before):
        return replacement(f"a decimal point is a dot: `{digits[1]}.{more[1]}`", here, ".")
    pair, rest = re.search(r"(?<![A-Za-z0-9_])\(([^()]*)$", behind), re.match(r",([^()]*)\)", ahead)
    if pair and rest:
        opens, closes = before - len(pair[0]), place + rest.end() - 1
        title = f"write a vector as `[{pair[1].strip()}, {rest[1].strip()}]`"
        return Fix(title, (Edit(Span(opens, opens + 1), "["), Edit(Span(closes, closes + 1), "]")))
    if re.match(r",\s*[A-Za-z][A-Za-z0-9_]*\s*=", ahead):
        return replacement("anchors are separated by spaces, without a comma", here, "")
    return None


def _in_vector(text: str, place: int) -> bool:
    """Whether a bracket is open before ``place`` in its statement."""
    statement = re.split(r"[;@]", text[max(0, place - 500) : place])[-1]
    return statement.count("[") > statement.count("]") or statement.count("(") > statement.count(")")


def _arguments(text: str, place: int) -> tuple[list[str], int] | None:
    """The arguments in the brackets that open at ``place``, and where the brackets end; None if they do not close in
    the statement.
    """
    depth, start, found = 0, place + 1, list[str]()
    for i, character in enumerate(text[place : place + 300], place):
        if character in "([{":
            depth += 1
        elif character in ")]}":
            depth -= 1
            if depth == 0:
                return [*found, text[start:i].strip()], i + 1
        elif character == "," and depth == 1:
            found.append(text[start:i].strip())
            start = i + 1
        elif character in ";@":
            return None
    return None


def _vector(text: str) -> str:
    return text if _SIMPLE.fullmatch(text) or (text.startswith("[") and text.endswith("]")) else f"({text})"


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
_CONDITION = "a value that depends on a condition is written in braces: `{ .t < 3 : 4; 5 }` is 4 while .t < 3, else 5"
_FUNCTION = (
    "you cannot define functions: state `f = …;` with its inputs written out, or `.let` for a constant;"
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
        return "put the text in quotes, and its anchor after it: `.label('A') Rod.P`"
    return None
