"""`help`: by problem, and the list of commands."""

from __future__ import annotations

import re
from collections.abc import Mapping

from movimentum.records import dataclass
from movimentum.repl.session import Command, table


@dataclass(frozen=True, slots=True)
class Symptom:
    """A symptom: ``it`` is the sentence, ``words`` describe it, ``commands`` find the cause."""

    it: str
    words: tuple[str, ...]
    commands: tuple[str, ...]


TROUBLES = (
    Symptom(
        "it does not move",
        ("move", "moves", "still", "stands", "stuck", "rests"),
        ("check", "constraints", "why NAME", "blame EXPR", "max EXPR", "min EXPR"),
    ),
    Symptom(
        "it moves by itself",
        ("itself", "free", "loose", "falls", "floppy", "undetermined"),
        ("free", "wiggle FILE.gif", "drag A.P to [x,y]", "why NAME"),
    ),
    Symptom(
        "it jumps",
        ("jump", "jumps", "flips", "flip", "snaps", "mirrored", "branch"),
        ("check", "solutions", "branch", "when CONDITION", "constraints", "steps"),
    ),
    Symptom(
        "it is not where I want it",
        ("where", "wrong", "place", "direction", "length", "value", "want", "elsewhere"),
        ("show NAME", "why not CONDITION", "solutions", "blame EXPR", "trace", "set NAME VALUE"),
    ),
    Symptom(
        "it contradicts itself",
        ("contradicts", "contradiction", "conflict", "conflicts", "solution", "binds", "error", "errors"),
        ("check", "conflicts", "bisect", "residuals", "apply N"),
    ),
    Symptom(
        "it stops halfway",
        ("stops", "stop", "ends", "halfway", "blocked", "reach"),
        ("check", "at T", "conflicts", "bisect", "when CONDITION", "steps"),
    ),
    Symptom(
        "it worked before",
        ("before", "worked", "changed", "undo"),
        ("diff", "diff motion", "undo", "reload"),
    ),
    Symptom(
        "I do not understand a message",
        ("message", "messages", "code", "understand"),
        ("explain", "explain CODE", "check"),
    ),
)
_SMALL = frozenset(["it", "is", "not", "does", "do", "i", "a", "the", "to", "in", "my", "of", "and"])


def help_text(commands: Mapping[str, Command], name: str) -> str | None:
    """Help for a command or a trouble; for no ``name``, both lists. None where it is neither."""
    if not name:
        return _whole(commands)
    command = commands.get(name)
    if command is not None:
        return f"{command.usage}\n  {command.help}"
    found = _meant(name)
    if not found:
        return None
    return "\n\n".join(f"{trouble.it}\n{_of(trouble, commands)}" for trouble in found)


def _meant(text: str) -> list[Symptom]:
    """The troubles that most of the words are about."""
    words = re.findall(r"[a-z]+", text.lower().replace("n't", " not"))
    whole = " ".join(words)
    for trouble in TROUBLES:
        if whole == trouble.it.lower():
            return [trouble]
    telling = {word for word in words if word not in _SMALL}
    scores = [len(telling & {*trouble.words, *trouble.it.lower().split()}) for trouble in TROUBLES]
    best = max(scores)
    return [trouble for trouble, score in zip(TROUBLES, scores, strict=True) if score == best > 0]


def _of(trouble: Symptom, commands: Mapping[str, Command]) -> str:
    rows = [[f"  {usage}", commands[usage.split()[0]].help] for usage in trouble.commands]
    return table(rows)


def _whole(commands: Mapping[str, Command]) -> str:
    troubles = [[f"  {trouble.it}", ", ".join(f"`{usage}`" for usage in trouble.commands)] for trouble in TROUBLES]
    rows = [[f"  {command.usage}", command.help] for command in commands.values()]
    rows.append(["  STATEMENT;", "try it: it takes effect at once, at this step, under the key convention"])
    rows.append(["  help [COMMAND | TROUBLE], COMMAND?", "this list, or help for one command, or `help jumps`"])
    rows.append(["  quit", "end (so does the end of the input); in a terminal, it asks if changes are not saved"])
    head = "what is wrong, and the commands that find out why (`help jumps` says more):"
    return "\n".join([head, table(troubles), "", "all commands:", table(rows)])
