"""The options that commands share, and how they are combined into one value.

A command lists its options in the order of its help. Those that belong to `Choices` reach it as one argument, see
`with_choices`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

import click
from click.core import ParameterSource

from movimentum import budget
from movimentum.cli.parameters import FrameRangeType, RationalType, files
from movimentum.console import Console
from movimentum.records import fields
from movimentum.settings import Accuracy, FailurePolicy
from movimentum.workflow.choices import Choices
from movimentum.workflow.limits import LARGEST_NESTING, MAX_FRAMES, MAX_NESTING, MAX_OPERATIONS

F = TypeVar("F", bound=Callable[..., Any])

EXIT_CODES = """\b
Exit codes:
  0   done (there may be warnings)
  1   the script is at fault
  2   wrong usage, or a file cannot be read or written
  3   the scene has no solution at some time
  70  a bug in Movimentum
  130 interrupted"""


def together(*decorators: Callable[[Any], Any]) -> Callable[[F], F]:
    """Several decorators as one, the first on top."""

    def decorate(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def with_choices(command: Callable[..., int]) -> Callable[..., int]:
    """Gather the options that `Choices` has fields for; ``command`` gets them as ``choices``."""
    names = {field.name for field in fields(Choices)}

    @wraps(command)
    def gathering(*arguments: Any, **options: Any) -> int:
        chosen = {name: options.pop(name) for name in names & options.keys()}
        return command(*arguments, choices=Choices(**chosen), **options)

    return gathering


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
FPS = click.option(
    "--fps", type=RationalType(positive=True), metavar="F", help="Frames per time unit, instead of the script's."
)
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
    type=FrameRangeType(),
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
    help="Have the work done by a Dask cluster: `local` or `local:N` (N processes on this machine), or a scheduler's "
    "address, such as tcp://scheduler:8786 (extra `cluster`).",
)


def _settings(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> Any:
    found: dict[str, str] = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not value or not (name.isascii() and name.isidentifier()):
            raise click.BadParameter(f"{text!r} is not NAME=VALUE, such as R=60.")
        found[name] = value
    return tuple(found.items())


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
