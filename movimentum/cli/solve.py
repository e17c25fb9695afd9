"""`movimentum solve`: a table of poses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from movimentum.cli.common import (
    ACCURACY,
    EXIT_CODES,
    FPS,
    FRAMES,
    LIMITS,
    ON_FAILURE,
    SCRIPT,
    SPEECH,
    STRICT,
    carried_out,
    files,
    output_or_stdout,
    with_choices,
)
from movimentum.console import Console
from movimentum.settings import Accuracy
from movimentum.text import counted
from movimentum.workflow.choices import MAX_DIGITS, Choices, FrameChoice, Outcome

if TYPE_CHECKING:
    from movimentum.source import SourceText


@click.command(
    epilog="""\b
Examples:
  movimentum solve crank.mov -o poses.csv
  movimentum solve crank.mov -o - | head -3
  movimentum solve crank.mov -o poses.npz --fps 1000
  movimentum solve crank.mov -o poses.csv --accuracy exact --digits 80

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="OUT",
    shell_complete=files,
    help="A .csv, .json or .npz file; - is CSV on standard output.",
)
@FPS
@FRAMES
@ACCURACY
@click.option(
    "--digits",
    type=click.IntRange(min=1),
    metavar="N",
    help="Digits to compute and write with --accuracy exact [default: 50].",
)
@click.option(
    "--max-digits",
    type=click.IntRange(1, 100_000),
    default=MAX_DIGITS,
    show_default=True,
    metavar="N",
    help="Refuse more digits (three times as many take about nine times as long).",
)
@STRICT
@ON_FAILURE
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def solve(
    console: Console,
    *,
    choices: Choices,
    script: str,
    output: str,
    frames: FrameChoice | None,
) -> int:
    """Write the position of everything: a table with one row for each frame.

    The columns are frame, time, Thing.Anchor.x and .y of every anchor, Thing.angle of every thing (degrees, counting
    full turns), and every named variable. Coordinates are world coordinates in pixels, y up.
    """
    from movimentum.interop.tables import SUFFIXES
    from movimentum.workflow.tabulate import tabulate

    if choices.digits is not None and choices.accuracy is not Accuracy.EXACT:
        raise click.UsageError("--digits needs --accuracy exact: the other tiers have the digits of a float64.")
    if output != "-" and Path(output).suffix.lower() not in SUFFIXES:
        raise click.UsageError(f"{output}: a table ends in one of {', '.join(SUFFIXES)}, or is - for CSV on stdout.")
    target = output_or_stdout(script, output, ".csv")

    def work(source: SourceText) -> Outcome:
        with console.progress("solving") as progress:
            return tabulate(source, target, choices, frames, progress)

    outcome = carried_out(console, script, work)
    if target is not None:
        console.say(f"{target}: {counted(outcome.frames, 'row')}")
    return outcome.exit_code
