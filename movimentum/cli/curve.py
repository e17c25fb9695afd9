"""`movimentum curve`: the equation of a path."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from movimentum.cli.common import EXIT_CODES, LIMITS, SCRIPT, SPEECH, anchor, files, with_choices
from movimentum.console import Console, answer
from movimentum.errors import errors_in, usage_error
from movimentum.workflow.choices import Choices

STILLS = (".svg", ".png", ".jpg")


@click.command(
    epilog="""\b
Examples:
  movimentum curve scripts/four-bar.mov Coupler.P
  movimentum curve scripts/peaucellier.mov AP.P
  movimentum curve scripts/four-bar.mov Coupler.P -o curve.svg
  movimentum curve scripts/klann.mov Leg.F --seconds 120 --as sympy

"""
    + EXIT_CODES
)
@SCRIPT
@click.argument("point", metavar="THING.ANCHOR", type=anchor)
@click.option(
    "--as",
    "form",
    type=click.Choice(["text", "latex", "sympy"]),
    default="text",
    show_default=True,
    help="How the equation is written.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0.0, min_open=True),
    default=60.0,
    show_default=True,
    metavar="N",
    help="Give up after N seconds.",
)
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    shell_complete=files,
    help="Also draw the curve, over the film's first picture and under the point's path: a still (.svg, .png, .jpg).",
)
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def curve(
    console: Console, *, choices: Choices, script: str, point: str, form: str, output: str | None, seconds: float
) -> int:
    """Write the equation of a point's path, for all positions of the mechanism, not only those in the film.

    The first line is its degree, then comes the polynomial in x and y (pixels, y up), which is zero on the path.
    Assemblies of the mechanism with another path are left out.
    """
    from movimentum.workflow.curve import curve as found_curve
    from movimentum.workflow.curve import draw_curve
    from movimentum.workflow.read import read

    source = read(script)
    target = None if output is None else Path(output)
    if target is not None and target.suffix not in STILLS:
        raise usage_error("output/format", f"`{output}` is no still", "-o curve.svg")
    with errors_in(source), console.working("looking for the equation"):
        found = found_curve(source, choices, point, seconds)
        if target is not None:
            draw_curve(source, choices, point, found, target)
    import sympy as library

    sympy: Any = library
    shown: str = {"latex": sympy.latex, "sympy": sympy.srepr, "text": sympy.sstr}[form](found.equation)
    answer(f"degree {found.degree}\n{shown}{'' if form == 'sympy' else ' = 0'}\n")
    if found.branches:
        console.say(f"other assemblies of the mechanism have {len(found.branches)} other curves")
    if target is not None:
        console.say(f"{target}: the curve")
    return 0
