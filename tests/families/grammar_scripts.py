"""Scripts out of the grammar itself: whatever it can spell, new syntax from the day it is added.

`Speller` walks the rules and terminals of ``grammar/movimentum.lark``; nothing here knows a construct by name, but a
few terminals are spelled with what has been declared, so that much of it means something. `script` strews such
statements over a scene of a few things, and keeps most of those that the scene understands.
"""

from __future__ import annotations

import random
import re._parser as regex  # type: ignore[import-not-found]
from functools import cache
from typing import Any

from hypothesis import strategies as st
from lark import Lark

from movimentum.errors import MovimentumError
from movimentum.source import SourceText
from movimentum.syntax.grammar import grammar_text
from movimentum.syntax.vocabulary import THING_MEMBERS, VECTOR_MEMBERS
from movimentum.workflow.stages import understand

USUAL = "0 1 2 3 4 0.5 0.1 10 20 30 45 60 90 120 180 360 50 100 200 1.5 .25 7.3 0.001"
ODD = "1e300 1e308 1.7e308 1e154 1e-300 5e-324 1e16 1e-16 1e9 400 4000 999999999999 1e-9 0.30000000000000004"
NUMBERS = [*USUAL.split() * 4, *ODD.split()]
THINGS, ANCHORS, VARIABLES = "AB", "PQR", "xyz"


@cache
def grammar() -> Any:
    """The grammar: rules by origin, terminals by name."""
    made = Lark(grammar_text(), parser="lalr", keep_all_tokens=True, maybe_placeholders=False)
    rules: dict[str, list[list[Any]]] = {}
    for rule in made.rules:
        rules.setdefault(rule.origin.name, []).append(list(rule.expansion))
    return rules, {terminal.name: terminal.pattern for terminal in made.terminals}, _depths(rules)


def _depths(rules: dict[str, list[list[Any]]]) -> dict[str, int]:
    """How many rules at least stand inside one another below each symbol."""
    depths: dict[str, int] = {}
    while len(depths) < len(rules):
        for name, expansions in rules.items():
            found = [_depth(expansion, depths) for expansion in expansions]
            known = [depth for depth in found if depth is not None]
            if known:
                depths[name] = min(known)
    return depths


def _depth(expansion: list[Any], depths: dict[str, int]) -> int | None:
    inside = [0 if symbol.is_term else depths.get(symbol.name) for symbol in expansion]
    return None if None in inside else 1 + max(inside, default=0)


class Speller:
    """Spells symbols of the grammar by chance; expressions often out of ``pool``, which are known to mean something."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.pool: list[str] = []

    def fill_pool(self, lines: list[str], things: str, chance: random.Random, tries: int = 400) -> None:
        """Expressions that the scene of ``lines`` understands, each spelled with those before it; most are about a
        thing, for that is what there is to solve.
        """
        mine, self.chance = self.chance, chance
        plain = 0
        for k in range(tries):
            text = self.spell("postfix", 4) if k < tries / 2 else self.spell("sum", 9)
            about = any(f"{name} ." in text for name in things)
            if len(text) > 120 or text in self.pool or (not about and plain >= 8):
                continue
            if understood([*lines, f"@0 u = {text};"]):
                plain += not about
                self.pool += [text] * (3 if about else 1)
        self.chance = mine

    def spell(self, symbol: str, deepest: int = 14) -> str:
        """Text of a rule; ``deepest``: after so many rules inside one another the shortest way is taken."""
        if symbol == "sum" and self.pool and self.chance.random() < 0.7:
            return self.chance.choice(self.pool)
        rules, _, depths = grammar()
        options = rules[symbol]
        far = [1 + max((depths[s.name] for s in option if not s.is_term), default=0) for option in options]
        near = [option for option, depth in zip(options, far, strict=True) if depth <= deepest]
        options = near or [options[far.index(min(far))]]
        # the plain spelling is taken oftener, or sums would hang onto sums without end
        weights = [1.0 / (1 + len(option)) ** 2.5 for option in options]
        option = self.chance.choices(options, weights)[0]
        return " ".join(self.terminal(s.name) if s.is_term else self.spell(s.name, deepest - 1) for s in option)

    def terminal(self, name: str) -> str:
        """Text of a terminal."""
        pattern = grammar()[1][name]
        if pattern.type == "str":
            return pattern.value
        if self.chance.random() < 0.97:
            if name == "NUMBER":
                return self.chance.choice(NUMBERS)
            if name == "NAME":
                return self.chance.choice(THINGS + THINGS + VARIABLES)
            if name == "WORD":
                return "." + self.chance.choice([*ANCHORS, *ANCHORS, *VECTOR_MEMBERS, *THING_MEMBERS])
        return self.matching(regex.parse(pattern.value))

    def matching(self, tree: Any) -> str:
        """Text that a regular expression matches, its look-ahead aside."""
        return "".join(self._piece(str(op), value) for op, value in tree)

    def _piece(self, op: str, value: Any) -> str:
        match op:
            case "LITERAL":
                return chr(value)
            case "NOT_LITERAL":
                return "n" if value != ord("n") else "m"
            case "ANY":
                return "."
            case "IN":
                return self._member(value)
            case "BRANCH":
                return self.matching(self.chance.choice(value[1]))
            case "SUBPATTERN":
                return self.matching(value[-1])
            case "MAX_REPEAT" | "MIN_REPEAT":
                low, high, inside = value
                count = self.chance.randint(low, min(int(high), low + 3))
                return "".join(self.matching(inside) for _ in range(count))
            case _:  # what looks ahead spells nothing
                return ""

    def _member(self, options: Any) -> str:
        if str(options[0][0]) == "NEGATE":
            return self.chance.choice("abcé 1")
        op, value = self.chance.choice(options)
        if str(op) == "RANGE":
            return chr(self.chance.randint(*value))
        return chr(value) if str(op) == "LITERAL" else {"CATEGORY_SPACE": " "}.get(str(value), "a")


@st.composite
def scripts(draw: st.DrawFn) -> str:
    """`script` as a strategy: what is spelled can be shrunk, what it is spelled with comes from a number."""
    return script(draw(st.randoms(use_true_random=False)), random.Random(draw(st.integers(0, 10**6))), 4)


def script(chance: random.Random, pool: random.Random | None = None, tries: int = 30) -> str:
    """A script with one or two things and statements out of the grammar, in one to three steps.

    ``pool`` chooses what expressions are made of; a statement that means nothing is spelled anew, ``tries`` times.
    """
    speller = Speller(chance)
    if chance.random() < 0.03:
        return speller.spell("start", 24)
    lines = [f".config({chance.choice(('4', '10', '3'))}{chance.choice(('', ', 60, 40'))});"]
    things = THINGS[: chance.randint(1, 2)]
    for name in things:
        anchors = " ".join(f"{a} = [{chance.randint(-40, 40)},{chance.randint(-40, 40)}]" for a in ANCHORS)
        lines.append(f"{name} : {chance.choice(('.bar', '.bar', '.arrow', '.disc(4)'))} {anchors};")
    if chance.random() < 0.1:
        lines.append(speller.spell("definition"))
    speller.fill_pool(lines, things, pool or chance)
    for step in range(chance.randint(1, 3)):
        lines.append(f"@{step}" if chance.random() < 0.95 else speller.spell("step"))
        for _ in range(chance.randint(1, 5)):
            for _ in range(tries):
                statement = speller.spell("statement" if chance.random() < 0.95 else "claim")
                if chance.random() < 0.01:
                    lines.append(statement)
                elif not (any(f"{name} ." in statement for name in things) or chance.random() < 0.1):
                    continue
                elif understood([*lines, statement]):
                    lines.append(statement)
                    break
    return "\n".join([*lines, "@+1" if chance.random() < 0.8 else ""])


def understood(lines: list[str]) -> bool:
    """Whether a script is one."""
    try:
        understand(SourceText("<family>", "\n".join(lines)))
    except MovimentumError:
        return False
    return True


def mutated(text: str, chance: random.Random) -> str:
    """A script with a few places changed: cut out, doubled, swapped, overwritten."""
    for _ in range(chance.randint(1, 3)):
        a, b = sorted(chance.randrange(len(text) + 1) for _ in range(2))
        b = min(b, a + chance.choice((1, 2, 8, 40)))
        match chance.randrange(5):
            case 0:
                text = text[:a] + text[b:]
            case 1:
                text = text[:b] + text[a:b] + text[b:]
            case 2:
                text = text[:a] + chance.choice((";", "@1", "=", "(", ")", ".", "'", "1e308", "_", "[", "~")) + text[b:]
            case 3:
                c = chance.randrange(len(text) + 1)
                text = text[:c] + text[a:b] + text[c:]
            case _:
                numbers = [*re_numbers(text)]
                if numbers:
                    start, end = chance.choice(numbers)
                    text = text[:start] + chance.choice(NUMBERS) + text[end:]
    return text


def re_numbers(text: str) -> list[tuple[int, int]]:
    """Where numbers stand."""
    import re

    return [match.span() for match in re.finditer(r"\d+(\.\d+)?", text)]
