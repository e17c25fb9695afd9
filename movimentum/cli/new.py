"""`movimentum new` and `movimentum examples`: scripts that already move."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from movimentum.cli.common import EXIT_CODES, SPEECH, files
from movimentum.console import Console, answer
from movimentum.terminal import typed
from movimentum.text import counted

if TYPE_CHECKING:
    from movimentum.workflow.samples import Sample


def _kinds(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    from movimentum.workflow.samples import starters

    return [CompletionItem(each.name, help=each.title) for each in starters() if each.name.startswith(incomplete)]


def _examples(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    from movimentum.workflow.samples import examples

    return [CompletionItem(each.name, help=each.title) for each in examples() if each.name.startswith(incomplete)]


def _listed(samples: tuple[Sample, ...]) -> str:
    width = max((len(each.name) for each in samples), default=0)
    return "".join(f"{each.name:{width}}  {each.title}".rstrip() + "\n" for each in samples)


@click.command(
    epilog="""\b
Examples:
  movimentum new
  movimentum new four-bar
  movimentum new slider-crank -o engine.mov
  movimentum new gears -o - | movimentum check -

"""
    + EXIT_CODES,
)
@click.argument("kind", metavar="[KIND]", required=False, shell_complete=_kinds)
@click.option(
    "-o",
    "--output",
    metavar="SCRIPT",
    shell_complete=files,
    help="The script to write; - is standard output [default: KIND.mov].",
)
@SPEECH
@click.pass_obj
def new(console: Console, *, kind: str | None, output: str | None) -> int:
    """Write a first script that already moves. Without KIND, list the kinds.

    Every kind is a short script with comments. It needs no picture, and its lengths are constants at the top. Existing
    files are never overwritten.
    """
    from movimentum.workflow.samples import named, starters, write_starter

    if kind is None:
        if output is not None:
            known = ", ".join(each.name for each in starters())
            raise click.UsageError(f"-o needs a kind: {known}.")
        answer(_listed(starters()))
        console.say("\n`movimentum new KIND` writes one of these as KIND.mov")
        return 0
    sample = named(kind, starters(), "kind of script", "movimentum new")
    if output == "-":
        answer(sample.path.read_text(encoding="utf-8"))
        return 0
    target = Path(f"{sample.name}.mov" if output is None else output)
    write_starter(sample, target)
    console.say(f"{target}: written; `movimentum run {typed(target)}` makes the film")
    return 0


@click.command(
    epilog="""\b
Examples:
  movimentum examples
  movimentum examples --list
  movimentum examples here --only walschaerts --only planetary

"""
    + EXIT_CODES,
)
@click.argument("folder", metavar="[FOLDER]", required=False, default="movimentum-examples", shell_complete=files)
@click.option("--list", "listing", is_flag=True, help="Only list the scripts, and write nothing.")
@click.option(
    "--only",
    multiple=True,
    metavar="NAME",
    shell_complete=_examples,
    help="Copy this script and the files that it uses; may be repeated.",
)
@SPEECH
@click.pass_obj
def examples(console: Console, *, folder: str, listing: bool, only: tuple[str, ...]) -> int:
    """Copy the gallery, scripts with their pictures, into FOLDER (movimentum-examples).

    Existing files stay as they are.
    """
    from movimentum.workflow.samples import copy_examples, named
    from movimentum.workflow.samples import examples as known

    chosen = tuple(named(name, known(), "example", "movimentum examples --list") for name in only) or known()
    if listing:
        answer(_listed(chosen))
        return 0
    scripts, written = copy_examples(chosen, Path(folder))
    console.say(
        f"{folder}: {counted(len(scripts), 'script')}, {counted(written, 'file')} written; "
        f"`movimentum run {typed(scripts[0])}` makes a film"
    )
    return 0
