"""Random edits of scripts, as people make them: numbers, comments, statements taken out, put in, moved and put back."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator

_NUMBER = re.compile(r"(?<![\w.@])\d+(?:\.\d+)?(?![\w.])")
_STATEMENT = re.compile(r"[^;@]+;")


def _number(chance: random.Random, text: str) -> str:
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    match = chance.choice(found)
    value = float(match[0])
    new = chance.choice([value * 1.01, value + 1.0, value * (1 + 1e-9), -value, 0.0, value])
    return f"{text[: match.start()]}{new:.10g}{text[match.end() :]}" if new >= 0 else text


def _comment(chance: random.Random, text: str) -> str:
    places = [match.end() for match in re.finditer(r";|^", text)]
    place = chance.choice(places)
    return text[:place] + chance.choice(["  /* é 🙂 */ ", "\n// a line\n", "\n\n", "   "]) + text[place:]


def _taken_out(chance: random.Random, text: str) -> str:
    found = list(_STATEMENT.finditer(text))
    match = chance.choice(found)
    return text[: match.start()] + text[match.end() :]


def _put_in(chance: random.Random, text: str) -> str:
    headers = [match.end() for match in re.finditer(r"@\d+(?:\.\d+)?", text)]
    thing = chance.choice(re.findall(r"^(\w+)\s*:", text, re.MULTILINE) or ["Rod"])
    statement = chance.choice(
        [
            "extra = 3*.t;",
            f"{thing}.angle > -4000;",
            f"{thing}.opacity = 0.5;",
            f"turn = {thing}.angle;",
            f"{thing}.angle < {4000 + chance.randrange(3)};",
            f"extra > {chance.randrange(3)} - 5;",
            f"{thing}.angle ~ {chance.randrange(3)};",
            f"! {thing}.angle = 0;",
            f"{thing}.angle = _;",
            "extra ~ 5;",
        ]
    )
    place = chance.choice(headers)
    return f"{text[:place]} {statement} {text[place:]}"


def _painted(chance: random.Random, text: str) -> str:
    places = [match.end() for match in re.finditer(r":\s*\.bar", text)]
    if not places:
        return text
    place = chance.choice(places)
    return f"{text[:place]} .color('{chance.choice(['red', 'navy', 'gold'])}') {text[place:]}"


def _defined(chance: random.Random, text: str) -> str:
    return re.sub(
        r"(\.config\([^;]*;)", rf"\1\nNew{chance.randrange(10**6)} : .bar A = [1,2] B = [40,2];", text, count=1
    )


def _slip(chance: random.Random, text: str) -> str:
    place = chance.randrange(len(text))
    return text[:place] + chance.choice(["(", ";", "", "q"]) + text[place + 1 :]


_EDITS = (_number, _number, _number, _comment, _comment, _taken_out, _put_in, _put_in, _painted, _defined, _slip)


def edited(chance: random.Random, text: str, count: int) -> Iterator[str]:
    """``count`` texts, each an edit of the one before; now and then an earlier one again, as `undo` makes it."""
    past = [text]
    for _ in range(count):
        if len(past) > 2 and chance.random() < 0.25:
            past.pop()
        else:
            past.append(chance.choice(_EDITS)(chance, past[-1]))
        yield past[-1]
