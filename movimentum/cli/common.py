"""Parts that commands share: options, their text forms, the output file, and the report of the result.

A command lists its options in the order of its help. Options that belong to `Choices` reach it as one argument, see
`with_choices`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Generator
from contextlib import contextmanager
from fractions import Fraction
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from movimentum import budget
from movimentum.console import Console
from movimentum.errors import MovimentumError, errors_in
from movimentum.output.files import refuse_overwriting
from movimentum.records import fields
from movimentum.settings import Accuracy, FailurePolicy
from movimentum.text import frame_range, rational
from movimentum.workflow.choices import (
    LARGEST_NESTING,
    MAX_FRAMES,
    MAX_NESTING,
    MAX_OPERATIONS,
    Choices,
    FrameChoice,
    Outcome,
    frames_in,
)

if TYPE_CHECKING:
    from movimentum.source import SourceText
    from movimentum.workflow.far_frames import FarFrames

F = TypeVar("F", bound=Callable[..., Any])

EXIT_CODES = """\b
Exit codes:
  0   done (there may be warnings)
  1   the script is at fault
  2   wrong usage, or a file cannot be read or written
  3   the scene has no solution at some time
  70  a bug in Movimentum
  130 interrupted"""


class FiniteRange(click.FloatRange):
    """A number in a range; infinity and `nan` are none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number; a usage error for anything else."""
        found = super().convert(value, param, ctx)
        if not math.isfinite(found):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return found


def together(*decorators: Callable[[Any], Any]) -> Callable[[F], F]:
    """Several decorators as one, the first on top."""

    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def gathered(**kinds: Callable[..., Any]) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """A decorator of commands: ``command`` gets those options as ``name=kind(…)`` that ``kind`` has fields for."""

    def decorate(command: Callable[..., int]) -> Callable[..., int]:
        @wraps(command)
        def gathering(*arguments: Any, **options: Any) -> int:
            for name, kind in kinds.items():
                own = {field.name for field in fields(kind)} & options.keys()  # pyright: ignore[reportArgumentType]
                options[name] = kind(**{each: options.pop(each) for each in own})
            return command(*arguments, **options)

        return gathering

    return decorate


with_choices = gathered(choices=Choices)


# --- the text forms of options ----------------------------------------------------------------------------

_ANCHOR = re.compile(r"[A-Za-z][A-Za-z0-9_]*(?:\[\d+\]|\.[A-Za-z][A-Za-z0-9_]*)*\.[A-Za-z][A-Za-z0-9_]*(?:\[\d+\])?")


def files(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """For ``shell_complete``: the shell completes the name of a file."""
    return [CompletionItem(incomplete, type="file")]


def number(text: str) -> Fraction:
    """A number such as ``12``, ``2.5`` or ``24000/1001``, exactly."""
    found = rational(text)
    if found is None:
        raise click.BadParameter(f"{text!r} is not a number such as 12, 2.5 or 24000/1001.")
    return found


def positive(text: str) -> Fraction:
    """Such a number greater than 0."""
    found = number(text)
    if found <= 0:
        raise click.BadParameter(f"{text} is not greater than 0.")
    return found


def frames(text: str) -> FrameChoice:
    """``A:B``, ``A:``, ``:B`` or ``A``."""
    found = frame_range(text)
    if found is None:
        raise click.BadParameter(f"{text!r} is not a range of frames such as 0:48, 48:, :-1 or 7.")
    return frames_in(found)


def words_of(*known: str) -> Callable[[str], frozenset[str]]:
    """Reads a list of words out of a few, separated by commas."""

    def words(text: str) -> frozenset[str]:
        found = [word.strip() for word in text.split(",") if word.strip()]
        for word in found:
            if word not in known:
                raise click.BadParameter(f"{word!r} is not one of {', '.join(known)}.")
        return frozenset(found)

    return words


def names_of_constants(text: str) -> tuple[str, ...]:
    """Names of constants, separated by commas (also in brackets); whether the script has them is checked later."""
    found = tuple(word.strip() for word in text.strip().removeprefix("[").removesuffix("]").split(",") if word.strip())
    for word in found:
        if not word.replace(".", "_").isidentifier():
            raise click.BadParameter(f"{word!r} does not name a constant, as in --live R,L.")
    if not found:
        raise click.BadParameter("no constant is named, as in --live R,L.")
    return found


def pair(text: str) -> tuple[int, int]:
    """Two joint numbers, ``0,1``."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*,\s*(\d{1,9})\s*", text)
    if match is None:
        raise click.BadParameter(f"{text!r} is not a pair of joint numbers such as 0,1.")
    return int(match[1]), int(match[2])


def anchor(text: str) -> str:
    """``Thing.Anchor``; whether the scene has it is checked later."""
    if _ANCHOR.fullmatch(text.strip()) is None:
        raise click.BadParameter(f"{text!r} does not name an anchor, as in --trace Rod.B.")
    return text.strip()


def _settings(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> Any:
    found: dict[str, str] = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not value or not (name.isascii() and name.isidentifier()):
            raise click.BadParameter(f"{text!r} is not NAME=VALUE, such as R=60.")
        found[name] = value
    return tuple(found.items())


# --- options ----------------------------------------------------------------------------------------------


def _accuracy(_context: click.Context, _parameter: click.Parameter, word: str) -> Accuracy:
    return Accuracy(word)


def _failure_policy(_context: click.Context, _parameter: click.Parameter, word: str) -> FailurePolicy:
    return FailurePolicy(word)


def _keep_memory(context: click.Context, _: click.Parameter, megabytes: int) -> int:
    if isinstance(context.obj, Console) and context.get_parameter_source("max_memory") is not ParameterSource.DEFAULT:
        context.obj.megabytes = megabytes
    return megabytes


SPEECH = together(
    click.option("-q", "--quiet", is_flag=True, expose_value=False, help="Show only warnings and errors."),
    click.option("-v", "--verbose", is_flag=True, expose_value=False, help="Show notes too (as `check` always does)."),
    click.option("--debug", is_flag=True, expose_value=False, help="Show a traceback with every error."),
    click.option(
        "--max-memory",
        type=click.IntRange(min=100),
        default=budget.DEFAULT_MEGABYTES,
        show_default=True,
        metavar="MB",
        expose_value=False,
        callback=_keep_memory,
        help="End with an error if more memory is used.",
    ),
)
SCRIPT = click.argument("script", metavar="SCRIPT", shell_complete=files)
FPS = click.option("--fps", type=positive, metavar="F", help="Frames per time unit, instead of the script's.")
FORMAT = click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="Output for people, or for programs.",
)
FRAMES = click.option(
    "--frames",
    type=frames,
    metavar="A:B",
    help="Only frames A to B-1, counted from 0 like Python slices (A:, :B and -12: work); A alone is one frame.",
)
STRICT = click.option("--strict", is_flag=True, help="Treat warnings as errors (exit code 1).")
ACCURACY = click.option(
    "--accuracy",
    type=click.Choice([tier.value for tier in Accuracy]),
    default=Accuracy.STANDARD.value,
    callback=_accuracy,
    show_default=True,
    help="How exactly the equations are solved: interpolated (with a reported error), to the precision of a float, to "
    "its last bits, or to any number of digits.",
)
ON_FAILURE = click.option(
    "--on-failure",
    type=click.Choice([policy.value for policy in FailurePolicy]),
    default=FailurePolicy.STOP.value,
    callback=_failure_policy,
    show_default=True,
    help="If the scene has no solution at some time: write nothing, hold the last good pose, or leave those frames out "
    "(the exit code is 3 in each case).",
)


DASK = click.option(
    "--dask",
    metavar="ADDRESS",
    help="Do the work on a Dask cluster: `local` or `local:N` (N processes on this machine), or a scheduler's "
    "address, such as tcp://scheduler:8786 (extra `cluster`).",
)


SET = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    callback=_settings,
    help="Give a constant of the script (`.let`) another value, a constant expression; may be repeated.",
)
LIMITS = together(
    SET,
    click.option(
        "--max-frames",
        type=click.IntRange(min=1),
        default=MAX_FRAMES,
        show_default=True,
        metavar="N",
        help="Refuse scripts that make more frames.",
    ),
    click.option(
        "--max-nesting",
        type=click.IntRange(1, LARGEST_NESTING),
        default=MAX_NESTING,
        show_default=True,
        metavar="N",
        help="Refuse expressions with more nested brackets, signs, powers and functions.",
    ),
    click.option(
        "--max-operations",
        type=click.IntRange(min=1),
        default=MAX_OPERATIONS,
        show_default=True,
        metavar="N",
        help="Refuse longer expressions.",
    ),
)


# --- outputs and outcomes ---------------------------------------------------------------------------------


def output_file(script: str, output: str | None, suffix: str) -> Path:
    """The file to write: never the script itself (nor its pictures, which are checked later)."""
    if output is None:
        if script == "-":
            raise click.UsageError("a script from stdin has no name: give an output with -o.")
        output = str(Path(script).with_suffix(suffix)) if Path(script).name else script
    target = Path(output)
    try:
        refuse_overwriting(target, () if script == "-" else (script,))
    except MovimentumError:
        from movimentum.workflow.read import read

        read(script)  # what is no script is reported as that
        raise
    return target


def output_or_stdout(script: str, output: str, suffix: str) -> Path | None:
    """The same; None for ``-``, which is standard output."""
    return None if output == "-" else output_file(script, output, suffix)


@contextmanager
def far_frames(dask: str | None, console: Console) -> Generator[FarFrames | None, None, None]:
    """The cluster at the address ``dask``, which may draw; None without one."""
    if dask is None:
        yield None
        return
    from movimentum.workflow.far_frames import FarFrames

    with FarFrames(dask, console.say) as elsewhere:
        yield elsewhere


def carried_out(
    console: Console,
    script: str,
    work: Callable[[SourceText], Outcome],
    reading: Callable[[str], SourceText] | None = None,
) -> Outcome:
    """The outcome of ``work`` on the script; its diagnostics are shown with the script's lines, and so are errors.
    ``reading``: how the file is read, if it is no script.
    """
    from movimentum.workflow.read import read

    source = (reading or read)(script)
    with errors_in(source), console.working("working"):
        outcome = work(source)
    console.show(outcome.diagnostics, source)
    console.note([item for item in outcome.notes if not console.verbose or item not in outcome.diagnostics], source)
    return outcome
