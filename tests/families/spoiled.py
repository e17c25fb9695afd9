"""Good scripts with one fault each, in several layouts: what a person mistypes, and how a file may look."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

_COMMENT = re.compile(r"('(?:[^'\r\n]|'')*')|//[^\r\n]*|/\*.*?\*/", re.DOTALL)


@dataclass(frozen=True)
class Spoiled:
    """``text`` is ``good`` with one fault of a ``kind``."""

    kind: str
    text: str
    good: str


def without_comments(text: str) -> str:
    return _COMMENT.sub(lambda match: match[1] or "", text)


LAYOUTS: dict[str, Callable[[str], str]] = {
    "as it is": lambda text: text,
    "CRLF": lambda text: text.replace("\n", "\r\n"),
    "CR": lambda text: text.replace("\n", "\r"),
    "tabs": lambda text: re.sub(r"(?m)^ +|(?<=;) +", "\t", text),
    "one line": lambda text: " ".join(without_comments(text).split()),
    "emoji": lambda text: "/* 😀🦿 長 */ " + re.sub(r"(?m)$", " // 🤖", without_comments(text)),
    "a statement a line": lambda text: re.sub(r";[ \t]*(?=\S)", ";\n\n   ", without_comments(text)),
}


def _swapped(word: str) -> str:
    """A word with two letters swapped, or one doubled if they are all the same or few."""
    for k in range(len(word) - 2, 0, -1):
        if word[k] != word[k + 1]:
            return word[:k] + word[k + 1] + word[k] + word[k + 2 :]
    return word + word[-1]


def _replaced(text: str, pattern: str, new: str | Callable[[re.Match[str]], str], which: int) -> str | None:
    """``text`` with one match replaced (outside comments); None if there is none."""
    comments = [match.span() for match in _COMMENT.finditer(text)]
    found = [m for m in re.finditer(pattern, text) if not any(a <= m.start() < b for a, b in comments)]
    if not found:
        return None
    match = found[which % len(found)]
    return text[: match.start()] + (new if isinstance(new, str) else new(match)) + text[match.end() :]


THING = r"(?<![.\w'])([A-Z][A-Za-z]{2,})(?=\.[A-Za-z])"
FAULTS: dict[str, tuple[str, str | Callable[[re.Match[str]], str]]] = {
    "no semicolon": (r"(?<=[\w\])]);", ""),
    "a misspelt thing": (THING, lambda m: _swapped(m[1])),
    "a misspelt member": (r"(?<=\w)\.angle(?=\s*=)", ".agnle"),
    "a misspelt function": (r"\.(sin|cos|max|abs|ease|floor|integral)\(", lambda m: f".{_swapped(m[1])}("),
    "a misspelt shape": (r":\s*\.bar\b", ": .bra"),
    "a misspelt option": (r"\.color\(", ".colour("),
    "a misspelt colour": (r"\.color\('(\w{4,})'\)", lambda m: f".color('{_swapped(m[1])}')"),
    "a colour without quotes": (r"\.color\('(\w+)'\)", lambda m: f".color({m[1]})"),
    "double quotes": (r"\.color\('(\w+)'\)", lambda m: f'.color("{m[1]}")'),
    "typographic quotes": (r"\.color\('(\w+)'\)", lambda m: f".color(\u2018{m[1]}\u2019)"),
    "a text without end": (r"\.color\('(\w+)'\)", lambda m: f".color('{m[1]})"),
    "no dot before a shape": (r":\s*\.bar\b", ": bar"),
    "no dot before a function": (r"(?<![\w.])\.(sin|cos|max|abs|ease|floor)\(", lambda m: f"{m[1]}("),
    "two equals signs": (r"(?<=[\w\]]) = (?=[\w\[.])", " == "),
    "a wrong bracket": (r"(\[[^\[\]()]*)\]", lambda m: f"{m[1]})"),
    "no bracket": (r"(=\s*\[[^\[\]()]*)\](?=;)", lambda m: m[1]),
    "a bracket too many": (r"(=\s*\[[^\[\]()]*\])(?=;)", lambda m: f"{m[1]}]"),
    "round brackets": (r"(=\s*)\[([^\[\]()]*)\]", lambda m: f"{m[1]}({m[2]})"),
    "a comma between anchors": (r"(\])(\s+)(?=[A-Z]\w*\s*=\s*)", lambda m: f"{m[1]},{m[2]}"),
    "a colon behind a step": (r"@\d+(?=\s)", lambda m: f"{m[0]}:"),
    "a semicolon behind a step": (r"@\d+(?=\s)", lambda m: f"{m[0]};"),
    "a real minus sign": (r"(?<=[\w\]]) - (?=\w)", " \u2212 "),
    "no multiplication sign": (r"(?<![\w.])(\d+)\*(?=\.?[a-zA-Z])", lambda m: m[1]),
    "a power of elsewhere": (r"\^(?=\d)", "**"),
    "degrees": (r"(?<=\.angle = )(\d+)(?=[*;])", lambda m: f"{m[1]}°"),
    "no first step": (r"@0(?=\s)", ""),
    "an underscore": (THING, lambda m: f"_{m[1]}"),
}


def spoiled(text: str, which: int) -> Iterator[Spoiled]:
    """``text`` with each fault in turn at its ``which``-th place, where there is one."""
    for kind, (pattern, new) in FAULTS.items():
        bad = _replaced(text, pattern, new, which)
        if bad is not None and bad != text:
            yield Spoiled(kind, bad, text)
