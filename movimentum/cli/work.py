"""The common parts of commands that work on a script: name the output, run the work, report the outcome."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from movimentum.console import Console
from movimentum.errors import MovimentumError
from movimentum.output.files import refuse_overwriting
from movimentum.workflow.choices import Outcome

if TYPE_CHECKING:
    from movimentum.source import SourceText
    from movimentum.workflow.far_frames import FarFrames


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

        read(script)  # what is no script is told as that
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


def carried_out(console: Console, script: str, work: Callable[[SourceText], Outcome]) -> tuple[int, Outcome | None]:
    """The exit code and outcome of ``work`` on the script; its diagnostics are shown with the script's lines."""
    from movimentum.workflow.read import read

    source: SourceText | None = None
    try:
        source = read(script)
        with console.working("working"):
            outcome = work(source)
    except MovimentumError as error:
        console.trace(error)
        console.show(error.diagnostics, source)
        return error.exit_code, None
    console.show(outcome.diagnostics, source)
    console.note([item for item in outcome.notes if not console.verbose or item not in outcome.diagnostics], source)
    return outcome.exit_code, outcome
