"""`movimentum check`: everything that can be said without rendering."""

from __future__ import annotations

import sys

import click

from movimentum.cli.options import EXIT_CODES, FPS, LIMITS, SCRIPT, SPEECH, STRICT, with_choices
from movimentum.console import Console, answer, answer_json, wants_color
from movimentum.workflow.choices import Choices


@click.command(
    epilog="""\b
Examples:
  movimentum check crank.mov
  movimentum check crank.mov --format json | jq .diagnostics
  movimentum check crank.mov --freedom
  movimentum check crank.mov --fps-invariance --reverse

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", "sarif"]),
    default="text",
    show_default=True,
    help="Output for people, for programs, or for code review tools.",
)
@click.option("--freedom", is_flag=True, help="Show all connected parts and all free motions, with velocities.")
@click.option("--fps-invariance", is_flag=True, help="Also solve at another frame rate, and compare.")
@click.option("--reverse", is_flag=True, help="Also follow the motion from its end back to its beginning, and compare.")
@FPS
@STRICT
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def check(
    console: Console,
    *,
    choices: Choices,
    script: str,
    form: str,
    freedom: bool,
    fps_invariance: bool,
    reverse: bool,
) -> int:
    """Report everything that can be said about SCRIPT without rendering it.

    It reports errors, warnings and notes, and for every step what was left to solve and what is still free.
    """
    from movimentum.workflow.check import check as checked

    with console.working("checking"):
        report, source = checked(script, choices, fps_invariance=fps_invariance, reverse=reverse)
    if form == "sarif":
        from movimentum.cli.check_report import check_sarif

        answer_json(check_sarif(report, source))
    elif form == "json":
        from movimentum.cli.check_report import check_json

        answer_json(check_json(report, source, freedom=freedom))
    else:
        from movimentum.cli.check_report import check_text

        answer(check_text(report, source, color=wants_color(sys.stdout), freedom=freedom))
    return report.exit_code
