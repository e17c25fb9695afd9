"""Whatever a person or a program may hand over: scripts, slips, command lines, debugger lines, recordings, pictures.

An input is made of its kind and a number, so that each can be had again: ``made("slip", 17, folder)`` fills a folder
and says which command lines are to be run there. Options, commands of the debugger and spellings are asked of the
program itself, so that a new one is tried the day it is added.
"""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import click

from movimentum.cli.app import commands, run_command_line
from movimentum.repl.shell import COMMANDS
from tests.command import CRANK, ROOT
from tests.families import valid_scripts
from tests.families.grammar_scripts import NUMBERS, Speller, mutated, script
from tests.families.hostile_inputs import CONTROLS, saved
from tests.interop.test_anything import torn

GALLERY = sorted(path for path in (ROOT / "scripts").glob("*.mov") if path.stat().st_size < 3000)
ENDLESS = ("watch", "open_it")
"""Options that wait for a person."""
SUFFIXES = [".gif", ".png", ".jpg", "-%d.png", ".apng", ".webp", ".csv", ".json", ".npz", ".svg", ".txt", ".mov", ""]
TEXTS = [
    *("0", "1", "-1", "2", "3", "0.5", "1/3", "24000/1001", "0:5", ":2", "-2:", "5:1", "7", "names", "names,free"),
    *(
        "anchors",
        "A.P",
        "B.Q.x",
        "x",
        "nothing",
        "0,1",
        "1,1",
        "red",
        "#ffcc00",
        "",
        " ",
        "é→😀",
        "1e300",
        "nan",
        "inf",
    ),
    *("-", "--", "1e-300", "99999999999999999999", "0x10", "1_0", "٣", "a'b", "$(x)", "\x1b[2J", "\u202e", "\udcff"),
]
SMALL = ["--max-frames", "300"]


# --- scripts with slips -----------------------------------------------------------------------------------------------

_TOKEN = re.compile(r"'[^'\n]*'|//[^\n]*|[0-9]*\.?[0-9]+(?:e-?[0-9]+)?|\.?[A-Za-z_][A-Za-z0-9_]*|\s+|.", re.DOTALL)
_STRANGE = ["é", "漢", "😀", "\u202e", "\u00a0", "\ufeff", "²", "−", "٣", "\0", "\r", "\u2028", "’", "…", "\x1b"]


def slipped(text: str, chance: random.Random) -> str:
    """A script with a few words dropped, doubled, swapped, taken from elsewhere or made strange."""
    tokens = _TOKEN.findall(text)
    for _ in range(chance.randint(1, 4)):
        solid = [k for k, token in enumerate(tokens) if token.strip() and not token.startswith("//")]
        if len(solid) < 2:
            break
        a, b = chance.choice(solid), chance.choice(solid)
        match chance.randrange(7):
            case 0:
                tokens[a] = ""
            case 1:
                tokens[a] += " " + tokens[a]
            case 2:
                tokens[a], tokens[b] = tokens[b], tokens[a]
            case 3:
                tokens[a] = tokens[b]
            case 4:
                numbers = [k for k in solid if tokens[k][:1].isdigit()]
                if numbers:
                    tokens[chance.choice(numbers)] = chance.choice(NUMBERS)
            case 5:
                tokens[a] = chance.choice(_STRANGE) if chance.random() < 0.5 else tokens[a] + chance.choice(_STRANGE)
            case _:
                tokens[a] = f"{tokens[a]} ; {Speller(chance).spell('statement', 6)} ;"
    return "".join(tokens)


def any_script(chance: random.Random) -> str:
    """A script out of the grammar, or one of the gallery with slips, or as it is."""
    match chance.randrange(5):
        case 0:
            return mutated(chance.choice(GALLERY).read_text(), chance)
        case 1:
            return slipped(chance.choice(GALLERY).read_text(), chance)
        case 2:
            return CRANK
        case _:
            return script(chance)


# --- command lines ----------------------------------------------------------------------------------------------------


def leaves(
    group: click.Command = commands, above: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    """Every command with the words that name it."""
    if isinstance(group, click.Group):
        for name, inside in group.commands.items():
            yield from leaves(inside, (*above, name))
    else:
        yield above, group


def value_of(parameter: click.Parameter, chance: random.Random) -> str:
    """Text for a parameter, most of the time of its type."""
    kind = parameter.type
    if chance.random() < 0.1:
        return chance.choice(TEXTS)
    match kind:
        case click.Choice():
            return str(chance.choice(list(kind.choices)))
        case click.IntRange():
            low, high = int(kind.min or 0), int(kind.max if kind.max is not None else 10**6)
            return str(chance.choice([low, low + 1, min(high, low + 3), min(high, 40)]))
        case click.FloatRange():
            return chance.choice(["0.5", "2", "1e-3", "1", "3.7", "1e300"])
        case click.Path():
            return chance.choice(["golden", ".", "no/folder"])
    fitting = {
        "output": lambda: (
            "out" + chance.choice(SUFFIXES) if chance.random() < 0.9 else chance.choice(("-", "", "/", "."))
        ),
        "commands_": lambda: "; ".join(debugger_line(chance) for _ in range(chance.randint(1, 4))),
        "fps": lambda: chance.choice(["1", "2.5", "24000/1001", "7", "50"]),
        "at": lambda: chance.choice(["0", "0.3", "1/3", "1", "2"]),
        "frames": lambda: chance.choice(["0:5", ":2", "-2:", "3"]),
        "traces": lambda: chance.choice(["A.P", "Rod.B", "Crank.P"]),
        "show": lambda: chance.choice(["names", "free", "names,free,anchors"]),
        "background": lambda: chance.choice(["red", "#ffcc00", "white"]),
        "drives": lambda: f"{chance.randrange(4)},{chance.randrange(4)}",
        "script": lambda: "any.mov",
        "scripts": lambda: "any.mov",
        "file": lambda: chance.choice(["any.txt", "any.mov"]),
    }.get(str(parameter.name))
    return fitting() if fitting is not None else chance.choice(TEXTS)


def command_line(chance: random.Random) -> list[str]:
    """A command with options by chance; outputs and inputs are in the current folder."""
    words, command = chance.choice(list(leaves()))
    line = list(words)
    for parameter in command.params:
        if isinstance(parameter, click.Argument):
            line.append(value_of(parameter, chance) if chance.random() < 0.97 else chance.choice(TEXTS))
        elif isinstance(parameter, click.Option) and parameter.name not in ENDLESS:
            wanted = 0.9 if parameter.required else 0.12
            if chance.random() < wanted:
                line.append(chance.choice([*parameter.opts, *parameter.secondary_opts]))
                if not parameter.is_flag:
                    line.append(value_of(parameter, chance))
    limits = {option for parameter in command.params for option in parameter.opts}
    return [*line, *(SMALL if "--max-frames" in limits else ())]


# --- the debugger -----------------------------------------------------------------------------------------------------


def debugger_line(chance: random.Random) -> str:
    """A command of the debugger with arguments by chance, or a statement to try."""
    if chance.random() < 0.25:
        return chance.choice(("A.P", "Rod.B", "x", "Crank.angle")) + chance.choice(
            ("= 3", "~ [1,2]", "> 0", "=", " += 1")
        )
    if chance.random() < 0.1:
        return Speller(chance).spell("statement", 6)
    name = chance.choice([*COMMANDS, "help", "quit", "?"])
    usage = COMMANDS[name].usage if name in COMMANDS else ""
    options = re.findall(r"--?[a-z]+|(?<=[ |\[(])[a-z]{3,}", usage)
    names = ["A", "A.P", "B.Q", "Crank", "Rod.B", "Rod.B.x", "x", "Rod", "Crank.angle", "y", "1", "2", "0.5", "1/3"]
    words = [chance.choice([*names, *names, *options, *options, *TEXTS]) for _ in range(chance.randrange(4))]
    if chance.random() < 0.15:
        words += ["-o", "out" + chance.choice(SUFFIXES)]
    return f"{name} {' '.join(words)}"


# --- files ------------------------------------------------------------------------------------------------------------


def spoiled(data: bytes, chance: random.Random) -> bytes:
    """Bytes with a few changed, cut out, doubled or added; numbers in a text made extreme."""
    for _ in range(chance.randint(1, 4)):
        a, b = sorted(chance.randrange(len(data) + 1) for _ in range(2))
        b = min(b, a + chance.choice((1, 4, 100)))
        match chance.randrange(6):
            case 0:
                data = data[:a] + data[b:]
            case 1:
                data = data[:b] + data[a:b] * chance.choice((1, 50)) + data[b:]
            case 2:
                data = data[:a] + chance.randbytes(b - a) + data[b:]
            case 3:
                data = data[:a]
            case 4:
                odd = [*NUMBERS, "nan", "1e999", "-1e308", "null", "true", "[[[[", '"', *CONTROLS]
                data = data[:a] + chance.choice(odd).encode("utf-8", "surrogatepass") + data[b:]
            case _:
                found = list(re.finditer(rb"\d+(\.\d+)?", data[:100_000]))
                if found:
                    start, end = chance.choice(found).span()
                    data = data[:start] + chance.choice([*NUMBERS, "nan", "-1"]).encode() + data[end:]
    return data


@cache
def _recording(folder: Path) -> Path:
    """A recording to be copied, made once."""
    place = folder.parent / "recording"
    if not (place / "any.golden" / "golden.json").exists():
        place.mkdir(exist_ok=True)
        (place / "any.mov").write_text(CRANK)
        assert run_command_line(["-q", "golden", "record", str(place / "any.mov")]) == 0
    return place / "any.golden"


def _of_the_grammar(chance: random.Random, folder: Path) -> list[list[str]]:
    (folder / "any.mov").write_text(script(chance), encoding="utf-8")
    return [_checked(), _drawn(chance)]


def _valid(chance: random.Random, folder: Path) -> list[list[str]]:
    text = valid_scripts.script(chance)
    (folder / "any.mov").write_text(text, encoding="utf-8")
    return valid_scripts.lines(chance, text)


def _with_characters_changed(chance: random.Random, folder: Path) -> list[list[str]]:
    (folder / "any.mov").write_text(mutated(chance.choice(GALLERY).read_text(), chance), encoding="utf-8")
    return [_checked(), _drawn(chance)]


def _with_words_changed(chance: random.Random, folder: Path) -> list[list[str]]:
    (folder / "any.mov").write_text(slipped(chance.choice(GALLERY).read_text(), chance), encoding="utf-8")
    return [_checked(), _drawn(chance)]


def _checked() -> list[str]:
    return ["check", "any.mov", "--format", "json", "--freedom", *SMALL]


def _drawn(chance: random.Random) -> list[str]:
    return ["run", "any.mov", "--at", chance.choice(("0", "0.25", "1")), "-q", *SMALL, "--max-pixels", "1000000"]


def _lines(chance: random.Random, folder: Path) -> list[list[str]]:
    (folder / "any.mov").write_text(any_script(chance), encoding="utf-8")
    (folder / "any.txt").write_text(torn(chance), encoding="utf-8")
    return [command_line(chance) for _ in range(3)]


def _debugged(chance: random.Random, folder: Path) -> list[list[str]]:
    (folder / "any.mov").write_text(any_script(chance), encoding="utf-8")
    lines = "\n".join(debugger_line(chance) for _ in range(chance.randint(1, 8)))
    return [["repl", "any.mov", "-c", lines, *SMALL]]


def _recorded(chance: random.Random, folder: Path) -> list[list[str]]:
    shutil.copytree(_recording(folder), folder / "any.golden")
    (folder / "any.mov").write_text(CRANK)
    for path in chance.sample(sorted((folder / "any.golden").iterdir()), chance.randint(1, 2)):
        path.write_bytes(spoiled(path.read_bytes(), chance))
    return [["golden", "check", "any.mov"], ["golden", chance.choice(("record", "check")), "any.mov"]]


def _imported(chance: random.Random, folder: Path) -> list[list[str]]:
    (folder / "any.txt").write_bytes(torn(chance).encode("utf-8", "surrogatepass"))
    options = [["--snap"], ["--snap", "--snap-angle", "7"], ["--drive", "0,1"], ["--strict"], [], [], []]
    return [["import", "any.txt", "-o", "any.mov", *chance.choice(options)], _checked()]


def _pictured(chance: random.Random, folder: Path) -> list[list[str]]:
    kind = chance.choice(("PNG", "GIF", "JPEG", "WEBP", "BMP", "TIFF"))
    (folder / "any.png").write_bytes(spoiled(saved(kind, (chance.randint(1, 40), chance.randint(1, 40))), chance))
    options = chance.choice(("", ".scale(2)", ".red(0.5)", ".opacity(0.5)"))
    text = (
        f".config(4, 60, 40);\nWheel : 'any.png' {options} P = [4,4];\n@0 Wheel.P = [30,20]; Wheel.angle = 90*.t;\n@1"
    )
    (folder / "any.mov").write_text(text)
    return [_drawn(chance)]


KINDS: dict[str, Callable[[random.Random, Path], list[list[str]]]] = {
    "valid": _valid,
    "grammar": _of_the_grammar,
    "character": _with_characters_changed,
    "word": _with_words_changed,
    "line": _lines,
    "debugger": _debugged,
    "recording": _recorded,
    "import": _imported,
    "picture": _pictured,
}
SHARES = {
    "valid": 8,
    "grammar": 8,
    "word": 4,
    "character": 3,
    "line": 5,
    "debugger": 4,
    "recording": 2,
    "import": 2,
    "picture": 1,
}
"""How many of 37 inputs are of each kind."""


def kind_of(seed: int) -> str:
    """The kind of the input with that number, where all kinds are wanted."""
    return random.Random(f"kind {seed}").choices(list(SHARES), list(SHARES.values()))[0]


def made(kind: str, seed: int, folder: Path) -> list[list[str]]:
    """Fill an empty ``folder`` with an input; the command lines to be run in it."""
    return KINDS[kind](random.Random(f"{kind} {seed}"), folder)
