"""`movimentum repl`: the debugger."""

from __future__ import annotations

from pathlib import Path

import click

from movimentum.cli.common import EXIT_CODES, FPS, LIMITS, SCRIPT, SPEECH, with_choices
from movimentum.console import Console
from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read


@click.command(
    epilog="""\b
Examples:
  movimentum repl crank.mov
  movimentum repl crank.mov -c 'at 1.5; show Rod; why Rod.B'
  echo 'solutions' | movimentum repl crank.mov
  movimentum repl crank.mov --format json -c 'when x = 200' | jq .answer

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
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="json: a line for each command, with its answer as data.",
)
@click.option("--record", metavar="FILE", help="Write the questions and answers to FILE at the end, for --replay.")
@click.option("--replay", metavar="FILE", help="Ask the questions in FILE again; exit code 1 if an answer has changed.")
@FPS
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def repl(
    _: Console,
    *,
    choices: Choices,
    script: str,
    commands_: tuple[str, ...],
    form: str,
    record: str | None,
    replay: str | None,
) -> int:
    """Debug SCRIPT: look at any moment, ask why things are where they are, try statements out.

    It also opens scripts with errors and scenes without a solution. `help` lists the commands.
    """
    from movimentum.repl.session import UNHURRIED, opened
    from movimentum.repl.shell import Teller, interact
    from movimentum.repl.shell import replay as replayed

    if script == "-" and not (commands_ or replay):
        raise click.UsageError("the script comes from standard input, so give the commands with -c.")
    if replay is not None and commands_:
        raise click.UsageError("--replay asks the questions of its file, so -c cannot be given too.")
    teller = Teller(json=form == "json", asked=bool(commands_))
    if record is not None:
        refuse_unwritable(Path(record))
        refuse_overwriting(Path(record), [script, *filter(None, [replay])])
    session = opened(script, choices, 1.0 if record is None and replay is None else UNHURRIED)
    if replay is not None:
        code = replayed(session, read(replay).text, replay, teller)
    else:
        code = interact(session, ";".join(commands_) if commands_ else None, teller)
    if record is not None:
        with whole_file(Path(record)) as part:
            part.write_text("\n".join(teller.record), encoding="utf-8")
    return code
