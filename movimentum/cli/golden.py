"""`movimentum golden`: records the results of scripts, and compares with them later."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from movimentum.cli.common import EXIT_CODES, LIMITS, SPEECH, carried_out, files, with_choices
from movimentum.console import DONE, Console
from movimentum.errors import MovimentumError
from movimentum.workflow.choices import Choices, Outcome

if TYPE_CHECKING:
    from movimentum.source import SourceText


@click.group()
def golden() -> None:
    """Golden frames: record the results of scripts, and compare with them later."""


_SCRIPTS = click.argument("scripts", nargs=-1, required=True, metavar="SCRIPT…", shell_complete=files)
_TO = click.option(
    "--to",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Keep the golden frames in DIR [default: beside each script].",
)


@golden.command(epilog=EXIT_CODES)
@_SCRIPTS
@_TO
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def record(console: Console, *, choices: Choices, scripts: tuple[str, ...], to: Path | None) -> int:
    """Record the results of each SCRIPT: its poses, and a few frames that cover every step.

    Look at the frames before you keep them: from now on they count as correct.
    """
    from movimentum.golden.record import golden_of
    from movimentum.golden.record import record as write_golden

    _named(scripts)
    worst = DONE
    for script in scripts:

        def work(_source: SourceText, script: str = script) -> Outcome:
            place = golden_of(Path(script), to, choices)
            made = write_golden(place)
            console.say(f"{place.folder}: {len(made.rows)} rows, {len(made.pictures)} frames")
            return Outcome(len(made.pictures), made.solution.fault, made.solution.diagnostics)

        worst = max(worst, _code(console, script, work))
    return worst


@golden.command(
    "check",
    epilog="""\b
Examples:
  movimentum golden check scripts/*.mov --to tests/golden
  movimentum golden check crank.mov --update

"""
    + EXIT_CODES,
)
@_SCRIPTS
@_TO
@click.option("--update", is_flag=True, help="Replace the recordings of scripts that differ.")
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def golden_check(console: Console, *, choices: Choices, scripts: tuple[str, ...], to: Path | None, update: bool) -> int:
    """Compare the results of each SCRIPT with the recording: first positions, then pictures.

    If they differ, NAME.golden-failed/index.html shows expected, actual and difference side by side.
    """
    from movimentum.golden.check import check as compare
    from movimentum.golden.page import remove_report, write_report
    from movimentum.golden.record import golden_of
    from movimentum.golden.record import record as write_golden

    _named(scripts)
    worst = DONE
    for script in scripts:

        def work(source: SourceText, script: str = script) -> Outcome:
            outcome = compare(golden_of(Path(script), to, choices))
            if outcome.good or update:
                remove_report(outcome)
            if outcome.good:
                console.say(f"{script}: as recorded")
                return Outcome(0, DONE, ())
            if update:
                write_golden(outcome.golden)
                console.show(outcome.diagnostics, source)
                console.say(f"{script}: recorded again")
                return Outcome(0, DONE, ())
            page = write_report(outcome)
            console.show(outcome.diagnostics, source)
            console.say(f"{script}: differs; see {page}")
            return Outcome(0, 1, ())

        worst = max(worst, _code(console, script, work))
    return worst


def _code(console: Console, script: str, work: Callable[[SourceText], Outcome]) -> int:
    """The exit code of ``work`` on a script; an error does not end the work on the others."""
    try:
        return carried_out(console, script, work).exit_code
    except MovimentumError as error:
        return console.fail(error)


def _named(scripts: Iterable[str]) -> None:
    """Golden frames are stored under the name of their script."""
    if "-" in scripts:
        raise click.UsageError("a script from standard input has no name to keep golden frames under: give a file.")
