"""`movimentum studio`: script and motion in the browser."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import click

from movimentum.cli.common import EXIT_CODES, FPS, LIMITS, SPEECH, files, with_choices
from movimentum.console import Console
from movimentum.errors import usage_error
from movimentum.workflow.choices import Choices

NEEDED = ("starlette", "uvicorn", "websockets")


@click.command(
    epilog="""\b
Examples:
  movimentum studio crank.mov
  movimentum studio
  movimentum studio crank.mov --no-open --port 8123

"""
    + EXIT_CODES
)
@click.argument("script", metavar="[SCRIPT]", required=False, shell_complete=files)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    show_default=True,
    metavar="N",
    help="The port on 127.0.0.1; 0 is any free port.",
)
@click.option("--no-open", is_flag=True, help="Do not open the browser.")
@FPS
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def studio(console: Console, *, choices: Choices, script: str | None, port: int, no_open: bool) -> int:
    """Edit SCRIPT and watch it move, on a page in your browser, served from this machine only.

    What you type moves at once, and what you draw becomes text. Without SCRIPT, the page begins with a list
    of examples. The first line on standard output is the page's address with its token. Ctrl-C ends it.
    """
    _refuse_missing()
    if script == "-":
        raise click.UsageError("the studio saves to a file, so it cannot use a script from standard input.")
    if script is not None:
        from movimentum.workflow.read import read

        read(script)
    return _served(console, script, port, choices, browser=not no_open)


def _refuse_missing() -> None:
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        message = f"the studio needs {' and '.join(missing)}, which is not installed"
        raise usage_error("usage/studio", message, "pip install 'movimentum[studio]'")


def _served(console: Console, script: str | None, port: int, choices: Choices, *, browser: bool) -> int:
    from movimentum.studio.server import serve

    def ready(url: str) -> None:
        sys.stdout.write(f"{url}\n")
        sys.stdout.flush()
        console.say("Ctrl-C ends the studio")
        console.left = "the studio has ended"
        if browser:
            import webbrowser

            webbrowser.open(url)

    try:
        serve(script, port, choices, ready)
    except OSError as problem:
        reason = (problem.strerror or str(problem)).lower()
        raise usage_error("usage/port", f"cannot serve on port {port}: {reason}", "--port 0") from problem
    return 0
