"""Spellings from the 2012 notes, from other languages and from mathematics, and how to write each of them here."""

from __future__ import annotations

import re

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
}
"""The probable meaning of signs that have no meaning in a script."""

_MEMBERS = {"length": "l", "l": "l", "LENGTH": "l", "Length": "l", "len": "l", "abs": "l", "norm": "l"}
_DISTANCES = ("dist", "distance", "Distance")
_SIMPLE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(\.[A-Za-z][A-Za-z0-9_]*)*")
_STEP = re.compile(r"@\s*\+?[^:;@=\r\n]*$")


def called(text: str, place: int, word: str) -> str | None:
    """How to write a function that does not exist here (``.length(v)``, ``distance(P, Q)``, ``rotate(v, a)``);
    ``place`` is the offset of its ``(``.
    """
    arguments = _arguments(text, place)
    if arguments is None:
        return None
    if word in _MEMBERS and len(arguments) == 1:
        return f"write `{_vector(arguments[0])}.{_MEMBERS[word]}`: it follows its vector"
    if word in _DISTANCES and len(arguments) == 2:
        return f"write `({arguments[0]} - {arguments[1]}).l`"
    if word in ("rotate", "r", "rot") and len(arguments) == 2:
        return f"write `{_vector(arguments[0])}.rotate({arguments[1]})`: it follows its vector"
    if word in ("x", "y", "z") and len(arguments) == 1:
        return f"write `{_vector(arguments[0])}.{word}`"
    return None


def written(text: str, before: int, place: int, found: str) -> str | None:
    """Help for the text at ``place``, after the text that ends at ``before``, if it is a spelling from elsewhere."""
    behind, ahead = text[max(0, before - 80) : before], text[place : place + 80]
    name = re.search(r"(?<![A-Za-z0-9_])\.?([A-Za-z]+)$", behind)
    if found == "(" and name is not None:
        if name[0] == "config":
            return "write `.config(…)`: the language's own words begin with a dot"
        if name[0] == ".rot" and (angle := _arguments(text, place)) is not None and len(angle) == 1:
            return f"write `.rotate({angle[0]})`"
        return called(text, place, name[1])
    if found == ";" and (step := _STEP.search(behind)) and re.search(r"\d", step[0]):
        return f"a step's time has no `;` after it: write `{step[0].rstrip()}`"
    if found in ("deg", "degree", "degrees", "rad", "radians"):
        return f"angles are in degrees: leave out `{found}`" if found[0] == "d" else "angles are in degrees"
    if found == "*" and behind.endswith("*"):
        return "write `^` for a power"
    if found == "=" and behind.endswith(":"):
        return "write `=`"
    if behind.endswith((".rotate", ".r")) and (number := re.match(r"-?[A-Za-z0-9_.]+", ahead)):
        return f"write `.rotate({number[0]})`"
    if found == ",":
        return _comma(text, before, behind, ahead)
    if found == ";" and (pair := re.search(r"\[([^\[\]]*)$", behind)) and (rest := re.match(r";([^\[\]]*)\]", ahead)):
        return f"write a vector as `[{pair[1].strip()}, {rest[1].strip()}]`"
    return None


def _comma(text: str, before: int, behind: str, ahead: str) -> str | None:
    """Help for a comma in the wrong place."""
    digits, more = re.search(r"(?<![\w.])(\d+)$", behind), re.match(r",(\d+)", ahead)
    if digits and more and not _in_vector(text, before):
        return f"a decimal point is a dot: `{digits[1]}.{more[1]}`"
    pair, rest = re.search(r"(?<![A-Za-z0-9_])\(([^()]*)$", behind), re.match(r",([^()]*)\)", ahead)
    if pair and rest:
        return f"write a vector as `[{pair[1].strip()}, {rest[1].strip()}]`"
    if re.match(r",\s*[A-Za-z][A-Za-z0-9_]*\s*=", ahead):
        return "anchors are separated by spaces, without a comma"
    return None


def _in_vector(text: str, place: int) -> bool:
    """Whether a bracket is open before ``place`` in its statement."""
    statement = re.split(r"[;@]", text[max(0, place - 500) : place])[-1]
    return statement.count("[") > statement.count("]") or statement.count("(") > statement.count(")")


def _arguments(text: str, place: int) -> list[str] | None:
    """The arguments in the brackets that open at ``place``; None if they do not close in the statement."""
    depth, start, found = 0, place + 1, list[str]()
    for i, character in enumerate(text[place : place + 300], place):
        if character in "([{":
            depth += 1
        elif character in ")]}":
            depth -= 1
            if depth == 0:
                return [*found, text[start:i].strip()]
        elif character == "," and depth == 1:
            found.append(text[start:i].strip())
            start = i + 1
        elif character in ";@":
            return None
    return None


def _vector(text: str) -> str:
    return text if _SIMPLE.fullmatch(text) or (text.startswith("[") and text.endswith("]")) else f"({text})"
