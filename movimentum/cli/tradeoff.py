"""`movimentum trade`: the costs and gains of accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from movimentum.cli.common import (
    EXIT_CODES,
    FORMAT,
    FPS,
    LIMITS,
    SCRIPT,
    SPEECH,
    STRICT,
    carried_out,
    files,
    output_file,
    with_choices,
)
from movimentum.console import Console, answer, answer_json
from movimentum.workflow.choices import Choices, Outcome

if TYPE_CHECKING:
    from movimentum.source import SourceText


@click.command(
    epilog="""\b
Examples:
  movimentum trade crank.mov
  movimentum trade crank.mov -o crank.svg
  movimentum trade crank.mov --format json | jq .solver.tiers

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-o", "--output", metavar="PLOT", shell_complete=files, help="A plot of the results: a .png or .svg file."
)
@FORMAT
@FPS
@click.option(
    "--digits",
    type=click.IntRange(min=20, max=1000),
    metavar="N",
    help="Digits of the reference for all comparisons [default: 50].",
)
@STRICT
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def trade(
    console: Console,
    *,
    choices: Choices,
    script: str,
    output: str | None,
    form: str,
) -> int:
    """Measure what accuracy costs and gains on SCRIPT.

    For every tier of --accuracy and every --quality, it measures the time and the error, compared with a solution to 50
    digits or with a picture of many more pixels.
    """
    from movimentum.workflow.tradeoff import TradeReport
    from movimentum.workflow.tradeoff import trade as measured

    target: Path | None = None
    if output is not None:
        if Path(output).suffix.lower() not in (".png", ".svg"):
            raise click.UsageError(f"{output}: a plot ends in .png or .svg.")
        target = output_file(script, output, ".svg")
    reports: list[TradeReport] = []

    def work(source: SourceText) -> Outcome:
        with console.progress("measuring") as progress:
            report, outcome = measured(source, target, choices, progress)
        reports.append(report)
        return outcome

    outcome = carried_out(console, script, work)
    from movimentum.tradeoff.report import trade_json, trade_text

    (report,) = reports
    if form == "json":
        answer_json(trade_json(script, report.solver, report.pictures, report.rates))
    else:
        answer(trade_text(script, report.solver, report.pictures, report.rates))
    if target is not None:
        console.say(f"{target}: plotted")
    return outcome.exit_code
