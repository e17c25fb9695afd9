"""`movimentum import` and `movimentum export`: scripts from other programs' files, and back."""

from __future__ import annotations

from fractions import Fraction

import click

from movimentum.cli.common import (
    EXIT_CODES,
    FPS,
    LIMITS,
    SCRIPT,
    SPEECH,
    STRICT,
    FiniteRange,
    carried_out,
    files,
    number,
    output_or_stdout,
    pair,
    with_choices,
)
from movimentum.console import Console
from movimentum.terminal import typed
from movimentum.workflow.choices import Choices


@click.command(
    "import",
    epilog="""\b
Examples:
  movimentum import peaucellier.txt -o peaucellier.mov
  movimentum import tiling.txt --snap -o tiling.mov
  movimentum import jansen.pyslvs --drive 0,1 -o jansen.mov
  movimentum import four-bar-formulas.txt -o four-bar.mov

"""
    + EXIT_CODES,
)
@click.argument("file", metavar="FILE", shell_complete=files)
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="SCRIPT",
    shell_complete=files,
    help="The script to write; - is standard output.",
)
@click.option(
    "--snap",
    is_flag=True,
    help="Make nearly equal lengths equal and fixed angles whole, and repair the coordinates (linkage files).",
)
@click.option(
    "--snap-angle",
    type=FiniteRange(min=0, min_open=True, max=360),
    metavar="A",
    help="With --snap, make angles multiples of A degrees [default: 36].",
)
@click.option(
    "--drive",
    "drives",
    type=pair,
    multiple=True,
    metavar="BASE,DRIVEN",
    help="Turn joint DRIVEN about joint BASE (mechanism expressions; repeatable).",
)
@STRICT
@SPEECH
@click.pass_obj
def import_(
    console: Console,
    *,
    file: str,
    output: str,
    snap: bool,
    snap_angle: float | None,
    drives: tuple[tuple[int, int], ...],
    strict: bool,
) -> int:
    """Turn FILE into a script: a linkage file of the program "linkages", a text file of PMKS, a .linkage2 of Linkage,
    a drawing in DXF, or a mechanism expression or triangular formulas from Pyslvs.

    The content of FILE decides which of these it is.
    """
    from movimentum.workflow.exchange import Import, imported, read_foreign

    if snap_angle is not None and not snap:
        raise click.UsageError("--snap-angle needs --snap.")
    target = output_or_stdout(file, output, ".mov")
    how = Import(snap, 36.0 if snap_angle is None else snap_angle, drives)
    outcome = carried_out(console, file, lambda source: imported(source, target, how, strict), read_foreign)
    if target is not None:
        console.say(f"{target}: written; look at it with `movimentum check {typed(target)}`")
    return outcome.exit_code


@click.command(
    epilog="""\b
Examples:
  movimentum export peaucellier.mov -o peaucellier.txt
  movimentum export four-bar.mov -o four-bar.pyslvs
  movimentum export four-bar.mov -o four-bar.dxf --at 1
  movimentum export four-bar.mov -o 'part-%s.stl' --thickness 3
  movimentum export four-bar.mov -o parts.csv

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="FILE",
    shell_complete=files,
    help="The file to write; - is standard output.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["linkages", "pyslvs", "dxf", "stl", "parts", "profiles"]),
    help="A linkage of rods at one moment, formulas that give every joint by triangles, a drawing of the parts, "
    "solids, a table of the parts, or one of the points of cuts and curves "
    "[default: what .txt, .pyslvs, .dxf, .stl or .csv says; linkages without one].",
)
@click.option("--at", type=number, metavar="T", help="The moment (linkages, dxf, stl) [default: the beginning].")
@click.option(
    "--thickness",
    type=FiniteRange(min=0, min_open=True),
    metavar="D",
    help="Thickness of the parts in pixels (stl); one pixel is a millimetre.",
)
@click.option(
    "--hole",
    type=FiniteRange(min=0),
    metavar="D",
    help="The diameter of all holes, 0 for none (dxf, stl) [default: that of the pins, or 0.3 of the width].",
)
@FPS
@STRICT
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def export(
    console: Console,
    *,
    choices: Choices,
    script: str,
    output: str,
    form: str | None,
    at: Fraction | None,
    thickness: float | None,
    hole: float | None,
) -> int:
    """Write the scene of SCRIPT in another program's format. With %s in the name of an STL, each part is a file."""
    from movimentum.workflow.exchange import Export, exported

    target = output_or_stdout(script, output, ".txt")
    how = Export(form or "", at, thickness, hole)
    outcome = carried_out(console, script, lambda source: exported(source, target, how, choices))
    if target is not None:
        console.say(f"{target}: written")
    return outcome.exit_code
