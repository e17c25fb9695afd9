"""Writes the manual pages, ``man/*.1``, from the commands as click knows them. `make_reference.py` calls it."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

import click

PAGES = Path(__file__).resolve().parent / "man"


def manual() -> dict[str, str]:
    """Every page under its file's name."""
    from movimentum.cli.app import MODULES
    from movimentum.cli.app import commands as group

    top = click.Context(group, info_name="movimentum", max_content_width=100)
    found = {"movimentum.1": _page("movimentum", group, top, sorted(MODULES))}
    for name in MODULES:
        command = group.get_command(top, name)
        assert command is not None, name
        context = click.Context(command, info_name=name, parent=top, max_content_width=100)
        inner = sorted(command.commands) if isinstance(command, click.Group) else []
        found[f"movimentum-{name}.1"] = _page(f"movimentum-{name}", command, context, inner)
    return found


def _page(name: str, command: click.Command, context: click.Context, inner: list[str]) -> str:
    help_ = inspect.cleandoc(command.help or "")
    first = " ".join(help_.split("\n\n")[0].split()).rstrip(".").replace("`", "")
    usage = " ".join(command.collect_usage_pieces(context))
    lines = [
        f'.TH "{name.upper()}" 1 "{_date()}" "Movimentum" "User Commands"',
        ".SH NAME",
        f"{_text(name)} \\- {_text(first[:1].lower() + first[1:])}",
        ".SH SYNOPSIS",
        f".B {_text(context.command_path)}",
        _text(usage),
        ".SH DESCRIPTION",
        *_prose(help_),
    ]
    if isinstance(command, click.Group):
        lines.append(".SH COMMANDS")
        for each in inner:
            below = command.get_command(context, each)
            assert below is not None
            lines += [".TP", f".B {_text(each)}", _text(below.get_short_help_str(200))]
            if name != "movimentum":
                lines += [line for options in _options(below, click.Context(below)) for line in options]
    lines += [".SH OPTIONS", *(line for options in _options(command, context) for line in options)]
    for block in _blocks(command.epilog or ""):
        title, _, rest = block.partition("\n")
        lines += [f".SH {_text(title.rstrip(':').upper())}", *_as_it_is(rest)]
    lines += [".SH SEE ALSO"]
    others = [f"movimentum-{each}" for each in inner] if name == "movimentum" else ["movimentum"]
    lines += [f".BR {_text(each)} (1){',' if each != others[-1] else ''}" for each in others]
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _options(command: click.Command, context: click.Context) -> Iterator[list[str]]:
    for option in command.params:
        record = option.get_help_record(context)
        if record is not None and isinstance(option, click.Option):
            yield [".TP", f".B {_text(record[0])}", _text(" ".join(record[1].split()))]


def _blocks(epilog: str) -> list[str]:
    blocks = re.split(r"\n\s*\n|\b(?=Exit codes:)", epilog.replace("\b", ""))
    return [block.strip("\n") for block in blocks if block.strip()]


def _prose(text: str) -> Iterator[str]:
    for number, paragraph in enumerate(re.split(r"\n\s*\n", text.split("\f")[0])):
        if number:
            yield ".PP"
        if paragraph.startswith("\b"):
            yield from _as_it_is(paragraph.removeprefix("\b\n"))
        else:
            yield _text(" ".join(paragraph.split()))


def _as_it_is(text: str) -> list[str]:
    return [".nf", *map(_text, textwrap.dedent(text).splitlines()), ".fi"]


def _text(text: str) -> str:
    """Text in which nothing is a request or an escape."""
    plain = text.replace("\\", "\\e").replace("-", "\\-").replace("`", "\\(ga").replace("'", "\\(aq")
    plain = plain.replace("^", "\\(ha").replace("~", "\\(ti").replace('"', "\\(dq")
    plain = re.sub(r"[^\x00-\x7f]", lambda found: f"\\[u{ord(found[0]):04X}]", plain)
    return f"\\&{plain}" if plain.startswith(".") else plain


def _date() -> str:
    """That of the last release."""
    text = (PAGES.parent.parent / "CHANGELOG.md").read_text(encoding="utf-8")
    return re.findall(r"^## \[\d[^\]]*\] - (\S+)", text, re.MULTILINE)[0]


def write() -> None:
    """Write all pages; those of commands that are gone go."""
    made = manual()
    PAGES.mkdir(exist_ok=True)
    for old in PAGES.glob("*.1"):
        if old.name not in made:
            old.unlink()
    for name, text in made.items():
        (PAGES / name).write_text(text, encoding="ascii")


if __name__ == "__main__":
    write()
