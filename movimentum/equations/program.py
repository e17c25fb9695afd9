"""A motion as a small program: assignments in order, in SymPy's terms, from which every language is printed.

A step of the script is a `StageProgram`. A block with a closed form becomes assignments; its branch is a sign that is
looked up by time. Any other block has a Newton loop, which starts from a nearby pose of the path. A continuous angle is
the direction plus whole turns from such a table.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from movimentum.records import dataclass

WORDS = """
t tau pi e i j root place lookup between turned eliminate pose poses constants defaults names count main
math np atan2 sin cos tan asin acos atan sqrt abs exp log floor min max mod sign
and as assert async await begin bool break case catch char class const continue debugger def default del delete do
double elif else elseif end enum except export extends extern false finally float for from function global goto if
implements import in int interface is lambda let local long macro module new none not null or otherwise package
parfor pass private protected public quote raise register return short signed sizeof spmd static struct super switch
this throw true try typedef typeof undefined union unsigned using var void volatile while with yield inline restrict
"""
RESERVED = frozenset(WORDS.split())
"""Names that some language keeps for itself, or that programs use: names of a script are written differently."""


@dataclass(frozen=True, slots=True)
class ConstantSymbol:
    """The payload of a symbol for a constant that keeps its name."""

    name: str


class NoProgram(Exception):
    """Why a motion has no program, in a sentence. ``constraints``: the statements (by number) that are the reason."""

    def __init__(self, words: str, constraints: Sequence[int] = ()) -> None:
        super().__init__(words)
        self.constraints = tuple(constraints)


@dataclass(frozen=True, slots=True)
class NamedValue:
    """``name`` is ``value``."""

    name: str
    value: Any


@dataclass(frozen=True, slots=True)
class BranchSign:
    """``name`` is the last of ``values`` whose time (``times``, since the step) has come."""

    name: str
    times: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ContinuousTurn:
    """``name`` is the direction (x, y) in degrees, the turn nearest to what ``times`` and ``values`` interpolate."""

    name: str
    y: Any
    x: Any
    times: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class NewtonLoop:
    """Newton's method for ``names``: ``residuals`` are zero; ``slopes`` row by row. ``values``: starts at ``times``."""

    names: tuple[str, ...]
    residuals: tuple[Any, ...]
    slopes: tuple[tuple[Any, ...], ...]
    times: tuple[float, ...]
    values: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Fork:
    """Two solutions for ``names``, where ``rows`` are zero. ``margin`` is zero where they meet, negative nowhere."""

    names: tuple[str, ...]
    rows: tuple[Any, ...]
    margin: Any


Statement = NamedValue | BranchSign | ContinuousTurn | NewtonLoop


@dataclass(frozen=True, slots=True)
class StageProgram:
    """A step from time ``start`` to ``end``; ``outputs`` in the order asked for. Statements read ``t``, the absolute
    time, and ``tau``, the time since the step. ``loops``: the equations of each block, ``forks``: where there are two
    solutions. ``choices``: what inequalities keep from being negative;
    ``checks``: what is zero although no block solves it.
    """

    start: float
    end: float
    statements: tuple[Statement, ...]
    outputs: tuple[Any, ...]
    loops: tuple[Any, ...] = ()
    forks: tuple[Fork, ...] = ()
    choices: tuple[Any, ...] = ()
    checks: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class MotionProgram:
    """``constants``: names with values; ``names``: of the outputs, as the script calls them; ``stages`` in order."""

    constants: tuple[tuple[str, float], ...]
    names: tuple[str, ...]
    stages: tuple[StageProgram, ...]


def needed(stage: StageProgram) -> list[Statement]:
    """The statements that the outputs depend on, in order."""
    wanted = {str(one) for each in stage.outputs for one in each.free_symbols}
    found: list[Statement] = []
    for one in reversed(stage.statements):
        names = one.names if isinstance(one, NewtonLoop) else (one.name,)
        if wanted.isdisjoint(names):
            continue
        found.append(one)
        match one:
            case NamedValue():
                parts = (one.value,)
            case BranchSign():
                parts = ()
            case ContinuousTurn():
                parts = (one.y, one.x)
            case NewtonLoop():
                parts = (*one.residuals, *(each for row in one.slopes for each in row))
        wanted |= {str(symbol) for part in parts for symbol in getattr(part, "free_symbols", ())}
    return found[::-1]


def identifier(text: str) -> str:
    """A name that every language takes."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_") or "v"
    name = name if name[0].isalpha() else f"v{name}"
    return f"{name}_" if name.lower() in RESERVED else name
