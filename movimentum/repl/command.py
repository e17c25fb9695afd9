"""What can be typed: commands, and the statements that are tried out."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from movimentum.records import dataclass
from movimentum.repl.answers import AnswerWithData
from movimentum.repl.session import Session, refused

Answer = tuple[Session, str]
"""The session afterwards, and the answer."""


@dataclass(frozen=True, slots=True)
class Command:
    """``usage`` shows its arguments, ``help`` is a line about it; ``run`` gets the text after the name."""

    usage: str
    help: str
    run: Callable[[Session, str], Answer]


class CommandTable(dict[str, Command]):
    """Commands by name, in the order of the list that `help` shows. The docstring of a command is its help."""

    def add(self, usage: str) -> Callable[[Callable[[Session, str], Answer]], Callable[[Session, str], Answer]]:
        """Decorates the command that ``usage`` begins with."""

        def added(run: Callable[[Session, str], Answer]) -> Callable[[Session, str], Answer]:
            self[usage.split()[0]] = Command(usage, " ".join((run.__doc__ or "").split()), run)
            return run

        return added


def table(columns: Sequence[Sequence[str]], *, right: frozenset[int] = frozenset()) -> str:
    """Rows of texts, aligned."""
    widths = [max(map(len, column)) for column in zip(*columns, strict=True)] if columns else []
    lines: list[str] = []
    for row in columns:
        cells = [
            cell.rjust(w) if i in right else cell.ljust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return AnswerWithData("\n".join(lines), columns)


def split_output(argument: str, suffixes: Sequence[str]) -> tuple[str, str | None]:
    """The text before ``-o FILE``, and FILE."""
    found = re.fullmatch(r"(.*?)(?:^|\s)-o\s+(\S+)\s*", argument, re.DOTALL)
    if found is None:
        return argument.strip(), None
    if not found[2].lower().endswith(tuple(suffixes)):
        raise refused("file", f"`{found[2]}` is not a {' or '.join(suffixes)} file", f"-o plot{suffixes[0]}")
    return found[1].strip(), found[2]


def plain(argument: str, command: str) -> None:
    """Refuse an argument for a command that takes none."""
    if argument.strip():
        raise refused("argument", f"`{command}` takes no argument, found `{argument.strip()}`")
