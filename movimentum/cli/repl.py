"""`movimentum repl`: the debugger."""

from __future__ import annotations

import click

from movimentum.cli.common import EXIT_CODES, FPS, LIMITS, SCRIPT, SPEECH, with_choices
from movimentum.console import Console
from movimentum.workflow.choices import Choices


@click.command(
    epilog="""\b
Examples:
  movimentum repl crank.mov
  movimentum repl crank.mov -c 'at 1.5; show Rod; why Rod.B'
  echo 'solutions' | movimentum repl crank.mov

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-c",
    "commands_",
    metavar="COMMANDS",
    multiple=True,
    help="Run these commands, separated by `;` or line ends, and end (repeatable).",
)
@FPS
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def repl(_: Console, *, choices: Choices, script: str, commands_: tuple[str, ...]) -> int:
    """Debug SCRIPT: look at any moment, ask why things are where they are, try statements out.

    It also opens scripts with errors and scenes without a solution. `help` lists the commands.
    """
    from movimentum.repl.session import opened
    from movimentum.repl.shell import interact

    if script == "-" and not commands_:
        raise click.UsageError("the script comes from standard input, so give the commands with -c.")
    return interact(opened(script, choices), ";".join(commands_) if commands_ else None)
