"""The command line as a whole: the commands, each in its own module, and the handling of their errors.

`workflow` does the work of a command, `console` prints its messages.
"""

from __future__ import annotations

import atexit
import gc
import os
import re
import sys
import warnings
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from importlib import import_module
from io import StringIO
from typing import Any, NoReturn, cast

import click

from movimentum import budget
from movimentum.cli.common import EXIT_CODES, SPEECH
from movimentum.console import INTERRUPTED, USAGE, Console, ReaderClosed, answer, guarded
from movimentum.signals import ignore_interrupts

MODULES = {
    "check": "check:check",
    "completion": "completion:completion",
    "curve": "curve:curve",
    "equations": "equations:equations",
    "examples": "new:examples",
    "explain": "explain:explain",
    "export": "exchange:export",
    "fit": "fit:fit",
    "fmt": "fmt:fmt",
    "golden": "golden:golden",
    "import": "exchange:import_",
    "lsp": "lsp:lsp",
    "new": "new:new",
    "prove": "prove:prove",
    "repl": "repl:repl",
    "run": "run:run",
    "solve": "solve:solve",
    "studio": "studio:studio",
    "sweep": "sweep:sweep",
    "trade": "tradeoff:trade",
}
"""Each command's module in this package, and its name there."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and end the process with its exit code.

    Planning makes hundreds of thousands of small objects and hardly any cycles. Garbage collection over them would take
    half the time of a large scene. Linear algebra has one thread, unless the environment says otherwise: matrices are
    small, and on busy processors threads wait for each other longer than they work.
    """
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    gc.freeze()
    gc.set_threshold(200_000, 50, 100)
    given = sys.argv[1:] if arguments is None else arguments
    if "--debug" not in given and not sys.warnoptions:
        warnings.simplefilter("ignore")  # warnings of libraries: ours are diagnostics
    code = run_command_line(given, watched=True)
    ignore_interrupts()
    if code == INTERRUPTED:  # after Ctrl-C inside an `exec`, Python would now end by the signal, and not with 130
        os._exit(code)
    if "--debug" in given:  # profilers and the like want an ordinary end
        sys.exit(code)
    _end(code)


def _end(code: int) -> NoReturn:
    """End the process without taking it apart: forgetting every object one by one takes a fifth of a small command."""
    atexit._run_exitfuncs()  # what libraries have asked for  # pyright: ignore[reportPrivateUsage]
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # pyright: ignore[reportUnnecessaryComparison]
            with suppress(OSError, ValueError):
                stream.flush()
    os._exit(code)


def run_command_line(arguments: Sequence[str], *, watched: bool = False) -> int:
    """Run one command; returns its exit code, and raises nothing.

    ``watched``: the process belongs to the command alone, so ``--max-memory`` applies to it.
    """
    console = Console(
        quiet="--quiet" in arguments or "-q" in arguments,
        verbose="--verbose" in arguments or "-v" in arguments,
        debug="--debug" in arguments,
    )

    def work() -> int:
        with budget.watched(console) if watched else nullcontext():
            return _dispatch(list(arguments), console)

    return guarded(work, console)


def _dispatch(arguments: list[str], console: Console) -> int:
    if os.environ.get("_MOVIMENTUM_COMPLETE", "").startswith("powershell"):
        import_module("movimentum.cli.completion")  # click does not know that shell
    try:
        code = commands.main(arguments, prog_name="movimentum", standalone_mode=False, obj=console)
    except click.Abort:
        raise KeyboardInterrupt from None
    except click.ClickException as error:
        shown = StringIO()
        error.show(file=shown)
        console.write(shown.getvalue() + _about_numbers(error.format_message()))
        return USAGE
    return code if isinstance(code, int) else 0


def _about_numbers(message: str) -> str:
    """What takes the place of a number behind the file's name, as the program "linkages" has it; otherwise nothing."""
    if not re.match(r"Got unexpected extra arguments? \([\d. ]+\)", message):
        return ""
    return (
        "No command takes a step size: poses are found exactly, at any step. `--fps 10` sets how many frames there are,"
        " and `.speed(60)` in the script how fast a wish pulls.\n"
    )


class _Modules(Mapping[str, click.Command]):
    """The commands by name; a command's module is imported when it is needed."""

    def __getitem__(self, name: str) -> click.Command:
        module, _, inside = MODULES[name].partition(":")
        return getattr(import_module(f"movimentum.cli.{module}"), inside)

    def __iter__(self) -> Iterator[str]:
        return iter(MODULES)

    def __len__(self) -> int:
        return len(MODULES)


class _Commands(click.Group):
    """click itself ends the process for some of our exceptions; under another name they come through."""

    def make_context(self, *given: Any, **named: Any) -> click.Context:
        with _by_another_name():  # `--help` and `--version` are answered here
            return super().make_context(*given, **named)

    def invoke(self, ctx: click.Context) -> Any:
        with _by_another_name():
            return super().invoke(ctx)


@contextmanager
def _by_another_name() -> Generator[None]:
    try:
        yield
    except BrokenPipeError as error:
        raise ReaderClosed from error
    except EOFError as error:
        raise RuntimeError("unexpected end of a file") from error


def _version(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted or context.resilient_parsing:
        return
    from movimentum.version import version

    shown = f"movimentum, version {version()}\n"
    if isinstance(context.obj, Console) and context.obj.verbose:
        from movimentum.workflow.installation import installation

        shown += installation()
    answer(shown)
    context.exit()


@click.group(
    cls=_Commands,
    commands=cast("dict[str, click.Command]", _Modules()),  # click only reads it
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  movimentum new four-bar
  movimentum run four-bar.mov
  movimentum check my-engine.mov
  movimentum solve my-engine.mov -o poses.csv

\b
Shell completion (bash; zsh, fish and PowerShell alike):
  eval "$(movimentum completion bash)"

"""
    + EXIT_CODES,
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_version,
    help="Show the version and exit; with -v, also what is installed, for reports of bugs.",
)
@SPEECH
def commands() -> None:
    """Animate mechanisms by stating what is connected to what.

    A script states which points of which parts coincide; Movimentum finds the motion and draws it.
    """
    budget.require_room()
