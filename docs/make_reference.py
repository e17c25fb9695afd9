"""Writes the pages of the reference that are made from the package itself: ``python docs/make_reference.py``.

- ``reference/commands.md``: every command with its options, as click knows them;
- ``reference/python.md``: the public names, from their docstrings;
- ``reference/messages.md``: every code, from ``docs/messages.toml`` and from what the examples say today;
- ``man/*.1``: a manual page for each command.

``tests/docs/test_reference.py`` compares the pages with what this makes.
"""

from __future__ import annotations

import contextlib
import inspect
import io
import os
import re
import shlex
import tempfile
import textwrap
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
PACKAGE = ROOT / "movimentum"
CASES = ROOT / "tests" / "cases"
MADE = "<!-- Made by `python docs/make_reference.py`: change the sources, not this page. -->"

# --- commands -----------------------------------------------------------------------------------------------------

COMMANDS = f"""\
{MADE}

# Commands

The general form is `movimentum COMMAND SCRIPT [options]`. `--help` works on every command and shows the same text as
this page. [What commands write](files.md) describes files, tables, JSON and exit codes.

## Options of every command

{{shared}}

`--set NAME=VALUE` may be repeated. `SCRIPT` may be `-` for standard input; then pictures are found from the current
folder, and `-o` is required.

{{commands}}
"""


def commands() -> str:
    """``reference/commands.md``."""
    from movimentum.cli.app import MODULES
    from movimentum.cli.app import commands as group

    top = click.Context(group, info_name="movimentum")
    found: dict[str, click.Command] = {}
    for name in MODULES:
        command = group.get_command(top, name)
        assert command is not None, name
        if isinstance(command, click.Group):
            inner = click.Context(command, info_name=name, parent=top)
            for part in command.list_commands(inner):
                below = command.get_command(inner, part)
                assert below is not None
                found[f"{name} {part}"] = below
        else:
            found[name] = command
    told = {name: dict(_options(command)) for name, command in found.items()}
    shared = {key: text for key, text in told["run"].items() if all(key in options for options in told.values())}
    sections = [_command(name, command, told[name], shared) for name, command in found.items()]
    return COMMANDS.format(shared=_table(shared), commands="\n".join(sections).rstrip())


def _command(name: str, command: click.Command, options: dict[str, str], shared: dict[str, str]) -> str:
    arguments = [p.make_metavar(click.Context(command)) for p in command.params if isinstance(p, click.Argument)]
    title = " ".join(["movimentum", name, *arguments])
    own = {key: text for key, text in options.items() if key not in shared}
    examples = _examples(command.epilog or "")
    parts = [f"## `{title}`", "", _prose(command.help or ""), "", _table(own), ""]
    parts += ["```bash", examples, "```", ""] if examples else []
    return "\n".join(parts)


def _options(command: click.Command) -> Iterator[tuple[str, str]]:
    """What stands in the help: the spelling of each option, and what it does."""
    context = click.Context(command)
    for option in command.params:
        record = option.get_help_record(context)
        if record is not None and isinstance(option, click.Option):
            yield record


def _table(options: dict[str, str]) -> str:
    rows = [f"| {_spelled(key)} | {_cell(text)} |" for key, text in options.items()]
    return "\n".join(["| option | |", "|---|---|", *rows])


def _spelled(key: str) -> str:
    """``-o, --output OUT`` as code, with its bars escaped."""
    parts = (f"<code>{part}</code>" if "|" in part else f"`{part}`" for part in key.split(", "))
    return ", ".join(parts).replace("|", "&#124;")


def _cell(text: str) -> str:
    said, bracket, rest = text, "", ""
    if noted := re.fullmatch(r"(.*)  \[(.*)\]", text, re.DOTALL):
        said, bracket, rest = noted[1], "[", noted[2]
    said = said.replace("|", "&#124;").replace("*", "\\*").replace("<", "&lt;")
    return re.sub(r"(?<![`\w])(--[a-z-]+|\.[a-z]\w*)(?![`\w])", r"`\1`", said) + (_default(rest) if bracket else "")


def _default(note: str) -> str:
    """``default: 0; 0<=x<=64``, as words."""
    words = [part for part in note.split("; ") if part]
    told = [part.replace("default: ", "default ") for part in words if part.startswith("default")]
    told += ["required" for part in words if part == "required"]
    for part in words:
        if low := re.fullmatch(r"x(>=|>)(\S+)", part):
            told.append(f"{'at least' if low[1] == '>=' else 'above'} {low[2]}")
        elif both := re.fullmatch(r"(\S+)<=x<=(\S+)", part):
            told.append(f"{both[1]} to {both[2]}")
    return f" ({', '.join(told)})" if told else ""


def _prose(text: str) -> str:
    """A help text as paragraphs: what stands behind ``\\b`` keeps its lines."""
    found: list[str] = []
    for paragraph in re.split(r"\n\s*\n", inspect.cleandoc(text).split("\f")[0]):
        if paragraph.startswith("\b"):
            found.append("```\n" + textwrap.dedent(paragraph.removeprefix("\b\n")).rstrip() + "\n```")
        else:
            found.append(textwrap.fill(" ".join(paragraph.split()), 120, break_on_hyphens=False))
    return "\n\n".join(found)


def _examples(epilog: str) -> str:
    """The examples of an epilog as a session, without their indentation."""
    blocks = re.split(r"\n\s*\n|\b(?=Exit codes:)", epilog.replace("\b", ""))
    for block in blocks:
        if block.strip().startswith("Examples:"):
            lines = textwrap.dedent(block.strip("\n").partition("Examples:")[2].strip("\n")).splitlines()
            return "\n".join(re.sub(r"  +(?=\S)", "  # ", line, count=1) for line in lines if line.strip())
    return ""


# --- Python -------------------------------------------------------------------------------------------------------

PYTHON = f"""\
{MADE}

# Python

All public names, from their docstrings. [From Python](../how-to/python.md) introduces them with examples.
`import movimentum as mv` imports nothing else until a name is first used. The tests run every example.

{{names}}
"""
ORDER = {
    "Read": ("load", "loads", "Script", "Limits"),
    "Motions": ("Motion", "Moments", "Accuracy", "FailurePolicy", "Overlap", "Contact", "Written"),
    "In a notebook": ("studio",),
    "Many variants, and fits": ("Sweep", "Fit"),
    "Messages and errors": (
        "Diagnostic", "Severity", "MovimentumError", "ScriptError", "NoSolutionError", "UnknownNameError", "UsageError",
    ),
    "The stages one by one": ("stages",),
}  # fmt: skip
PAGES = {"sweep": "../how-to/sweep.md", "fit": "../how-to/fit.md"}


def python() -> str:
    """``reference/python.md``."""
    import movimentum as mv

    assert sorted(name for names in ORDER.values() for name in names) == sorted({*mv.__all__} - {"__version__"})
    found: list[str] = []
    for title, names in ORDER.items():
        found.append(f"## {title}\n")
        for name in names:
            found += _public(name, getattr(mv, name))
    return PYTHON.format(names="\n".join(found).rstrip())


def _public(name: str, value: Any) -> Iterator[str]:
    if inspect.ismodule(value):
        yield f"### `mv.{name}`\n\n{_docstring(value)}\n"
        return
    if inspect.isfunction(value):
        yield f"### `mv.{name}`\n\n```python\n{_signature(name, value)}\n```\n\n{_docstring(value)}\n"
        return
    yield f"### `mv.{name}`\n\n{_docstring(value)}\n"
    attributes: list[str] = []
    for member, what in _members(value):
        inner = inspect.unwrap(getattr(what, "fget", None) or getattr(what, "func", None) or what)
        if not inspect.isfunction(inner) or not inspect.getdoc(inner):
            continue
        said = _docstring(inner)
        if inspect.isfunction(what):
            yield f"#### `{name}.{member}`\n\n```python\n{_signature(member, inner)}\n```\n\n{said}\n"
        elif "```" in said:
            yield f"#### `{name}.{member}`\n\n{said}\n"
        else:
            attributes.append(f"| `{name}.{member}` | {_escaped(' '.join(said.split()))} |")
    if attributes:
        yield "\n".join(["| attribute | |", "|---|---|", *attributes]) + "\n"


def _members(kind: type) -> Iterator[tuple[str, Any]]:
    """What a class has, with what it takes from classes of ours; the words of an enumeration are no members."""
    found: dict[str, Any] = {}
    for base in reversed(kind.__mro__):
        if base.__module__.startswith("movimentum"):
            found |= {name: what for name, what in vars(base).items() if not name.startswith("_")}
    yield from ((name, what) for name, what in found.items() if not isinstance(what, kind))


def _escaped(text: str) -> str:
    return text.replace("|", "&#124;")


def _signature(name: str, function: Any) -> str:
    """The signature, one argument on each line where it is long."""
    signature = inspect.signature(function)
    kept = [each.replace(annotation=each.annotation) for key, each in signature.parameters.items() if key != "self"]
    whole = f"{name}{signature.replace(parameters=kept)}"
    whole = re.sub(r"<(\w+)\.(\w+): [^>]*>", r"\1.\2", whole.replace("'", '"'))
    whole = re.sub(r'(: |-> )"([^"]*)"', r"\1\2", whole)
    if len(whole) <= 100:
        return whole
    begin, inside, end = re.fullmatch(r"(\w+\()(.*)(\) -> .*)", whole).groups()  # type: ignore[union-attr]
    return f"{begin}\n" + "".join(f"    {part},\n" for part in _split(inside)) + end


def _split(text: str) -> Iterator[str]:
    """The arguments: commas inside brackets are not between them."""
    depth, begin = 0, 0
    for place, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0:
            yield text[begin:place].strip()
            begin = place + 1
    yield text[begin:].strip()


def _docstring(value: Any) -> str:
    """A docstring as Markdown: examples are sessions, names are code, pages are links."""
    text = inspect.getdoc(value) or ""
    found: list[str] = []
    for paragraph in re.split(r"\n\s*\n", text):
        plain = textwrap.dedent(paragraph)
        if plain.startswith(">>>"):
            plain = re.sub(r"[ \t]*# doctest:.*", "", plain)
            if found and found[-1].startswith("```pycon"):
                found[-1] = found[-1].removesuffix("\n```") + f"\n{plain}\n```"
            else:
                found.append(f"```pycon\n{plain}\n```")
            continue
        plain = re.sub(r"``(.*?)``", lambda match: f"`{match[1]}`", plain, flags=re.DOTALL)
        plain = re.sub(r"docs/(\w+)\.md", lambda match: f"[{match[1]}]({PAGES[match[1]]})", plain)
        plain = re.sub(r"docs/[\w/-]+/(\w+)\.md", lambda match: f"[{match[1]}]({PAGES[match[1]]})", plain)
        found.append(plain)
    return "\n\n".join(found)


# --- messages -----------------------------------------------------------------------------------------------------

MESSAGES = f"""\
{MADE}

# Messages

Every message of Movimentum has a code, such as `constraint/conflict`. An error stops the work. A warning does not,
except with `--strict`. A note is only shown by `check` and with `-v`. This page lists all codes: what each means, what
to do, and an example where a few lines show it. Below a script stands what `movimentum check` says about it today;
below a command, what that command says.

{{families}}
"""
FAMILIES = {
    "syntax": "Spelling",
    "name": "Names",
    "kind": "Kinds and values",
    "asset": "Pictures and included files",
    "theme": "Themes in files",
    "table": "Tables",
    "timeline": "Steps and times",
    "loop": "Films without end",
    "constraint": "What holds, and what is free",
    "solve": "Finding the motion",
    "claim": "Claims",
    "certify": "Certificates",
    "curve": "Curves",
    "cut": "Profiles that things cut",
    "equations": "Equations and code",
    "wish": "Wishes",
    "fit": "Goals and requirements",
    "mesh": "Gears",
    "vector": "Arrows",
    "graph": "Graphs",
    "option": "Looks",
    "body": "Bodies",
    "canvas": "The canvas",
    "contact": "Contact",
    "look": "Looks that change",
    "render": "Drawing",
    "output": "Files that are written",
    "limit": "Limits",
    "usage": "Options and calls",
    "import": "Linkage files",
    "export": "Exports",
    "mechanism": "Mechanism expressions",
    "pmks": "Files of PMKS",
    "linkage2": "Files of Linkage",
    "formula": "Triangular formulas",
    "golden": "Golden frames",
    "check": "Comparisons",
    "repl": "The debugger",
    "query": "What is asked",
    "edit": "Changes by gestures and in the debugger",
    "internal": "Bugs",
}
SCRIPTS = {
    "STILL": ".config(10, 60, 40);\nRod : .bar A = [10,10] B = A + [30,0];\n@0 Rod.A = [10,10]; Rod.angle = 0;\n",
    "ARM": "Arm : .bar O = [60,60] P = O + [40,0];\n@0  Arm.O = [60,60];   Arm.angle = 90*.t;\n@1\n",
}
"""Scripts for messages that are not about the script; they are not shown."""
_CASE = re.compile(r"```mov(?P<limits>[^\n]*)\n(?P<script>.*?)```\n\n```text\n(?P<said>.*?)```\n", re.DOTALL)


def codes() -> set[str]:
    """All codes that the package can say, found in its texts."""
    plain = re.compile(rf'"((?:{"|".join(FAMILIES)})/[a-z][a-z-]+)"')
    found: set[str] = set()
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text("utf-8")
        found |= set(plain.findall(text))
        if path.parent.name == "repl":
            found |= {f"repl/{code}" for code in re.findall(r'\brefused\(\s*"([a-z-]+)"', text)}
    return found


def catalogue() -> dict[str, dict[str, Any]]:
    """``messages.toml``."""
    with (DOCS / "messages.toml").open("rb") as file:
        return tomllib.load(file)


def messages() -> str:
    """``reference/messages.md``."""
    entries, shown = catalogue(), cases()
    parts: list[str] = []
    for family, title in FAMILIES.items():
        parts.append(f"## {title}\n")
        for code, entry in entries.items():
            if code.startswith(f"{family}/"):
                parts.append(f"### `{code}`\n\n{entry['is']} {entry['do']}\n")
                parts += example(code, entry, shown)
    return MESSAGES.format(families="\n".join(parts).rstrip())


def cases() -> dict[str, tuple[int, str, str]]:
    """For each code the shortest case of ``tests/cases``: how long it is, the script, and what is said."""
    found: dict[str, tuple[int, str, str]] = {}
    for path in sorted(CASES.glob("*.md")):
        for match in _CASE.finditer(path.read_text("utf-8")):
            blocks = [text for text in re.split(r"\n\n", match["said"]) if re.match(r"\w+\[\S+\]:", text)]
            for block in blocks:
                code = re.match(r"\w+\[(\S+)\]", block)
                assert code is not None
                size = len(match["script"]) + len(block) + 1000 * (len(blocks) > 1 or bool(match["limits"].strip()))
                if code[1] not in found or size < found[code[1]][0]:
                    found[code[1]] = size, match["script"], block
    return found


def example(code: str, entry: dict[str, Any], shown: dict[str, tuple[int, str, str]]) -> Iterator[str]:
    """A script, or a command, and the part of its answer that has the code."""
    if "python" in entry:
        yield f"```pycon\n>>> {entry['python']}\n{_raised(entry['python'], code)}\n```\n"
    elif "script" in entry or "run" in entry or "binary" in entry:
        script = entry.get("script", "").lstrip("\n")
        told = script not in SCRIPTS
        script = SCRIPTS.get(script, script)
        run = entry.get("run", "check example.mov")
        files = {"example.mov": script, **entry.get("files", {})}
        said = answer([*entry.get("first", ()), run], files, entry.get("later", {}), entry.get("binary"))
        blocks = [text for text in re.split(r"\n(?=\w+\[\S+\]:)|\n\n", said) if re.match(rf"\w+\[{code}\]:", text)]
        assert blocks, f"{code}: {run} says\n{said}"
        if script and told:
            yield f"```mov\n{script.rstrip()}\n```\n"
        if "show" in entry:
            yield f"```text\n{files[entry['show']].rstrip()}\n```\n"
        yield (
            f"```console\n$ movimentum {run}\n{blocks[0].rstrip()}\n```\n"
            if "run" in entry
            else (f"```text\n{blocks[0].rstrip()}\n```\n")
        )
    elif code in shown:
        _, script, said = shown[code]
        yield f"```mov\n{script.rstrip()}\n```\n"
        yield f"```text\n{said.rstrip()}\n```\n"


def _raised(expression: str, code: str) -> str:
    import movimentum as mv

    try:
        eval(expression, {"mv": mv})
    except mv.MovimentumError as error:
        if f"[{code}]" not in str(error):
            raise AssertionError(f"{code}: {expression} raises\n{error}") from error
        name = f"{type(error).__module__}.{type(error).__qualname__}"
        return f"Traceback (most recent call last):\n    ...\n{name}: {error}".rstrip()
    raise AssertionError(f"{code}: {expression} raises nothing")


def answer(runs: Sequence[str], files: Mapping[str, str], later: Mapping[str, str], binary: str | None = None) -> str:
    """What the last command says on both streams, in a folder with ``files``; before it, ``later`` are written."""
    from movimentum.cli.app import run_command_line

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for name, text in files.items():
            Path(name).write_text(text, encoding="utf-8")
        if binary is not None:
            Path("example.mov").write_bytes(bytes.fromhex(binary))
        for place, run in enumerate(runs, 1):
            if place == len(runs):
                for name, text in later.items():
                    Path(name).write_text(text, encoding="utf-8")
            said = io.StringIO()
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                run_command_line(shlex.split(run))
    return said.getvalue().replace(folder + os.sep, "")


def main() -> None:
    """Write all pages."""
    for name, made in (("commands", commands), ("python", python), ("messages", messages)):
        (DOCS / "reference" / f"{name}.md").write_text(made() + "", encoding="utf-8")
        print(f"reference/{name}.md")
    import make_man  # beside this file, which is on the path when it is run

    make_man.write()
    print("man/*.1")


if __name__ == "__main__":
    main()
