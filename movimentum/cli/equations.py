"""`movimentum equations`: a motion as equations, and as code."""

from __future__ import annotations

from pathlib import Path

import click

from movimentum.cli.common import EXIT_CODES, LIMITS, SCRIPT, SPEECH, files, output_or_stdout, with_choices
from movimentum.console import Console, answer
from movimentum.errors import errors_in
from movimentum.workflow.choices import Choices

FORMS = {
    "text": "wording:text", "latex": "wording:latex", "mathml": "wording:mathml", "python": "code:python_code",
    "numpy": "code:numpy_code", "c": "code:c_code", "javascript": "code:javascript_code",
    "matlab": "code:matlab_code", "julia": "code:julia_code", "excel": "formulas:excel",
    "geogebra": "formulas:geogebra", "desmos": "formulas:desmos",
}  # fmt: skip
"""Each form's module in `movimentum.equations`, and its function there."""


@click.command(
    epilog="""\b
Examples:
  movimentum equations scripts/four-bar.mov --of Coupler.P
  movimentum equations crank.mov --as latex -o crank.tex
  movimentum equations crank.mov --as c -o crank.c && cc -DMAIN crank.c -lm
  movimentum equations crank.mov --as javascript --of Rod.B.x -o crank.js

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "--as",
    "form",
    type=click.Choice(list(FORMS)),
    default="text",
    show_default=True,
    help="Equations to read, or code: one file, which needs nothing else.",
)
@click.option(
    "--of", "of", multiple=True, metavar="EXPR", help="Only this expression, such as Rod.B.x; may be repeated."
)
@click.option("-o", "--output", metavar="OUT", default="-", shell_complete=files, help="A file [default: stdout].")
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def equations(console: Console, *, choices: Choices, script: str, form: str, of: tuple[str, ...], output: str) -> int:
    """Write the motion of SCRIPT as equations, or as code in another language.

    As equations: loop closures, the solution in named steps, velocities, and where dead centres are. As code: a
    function of the time and of the constants (`.let`), which gives what `solve` gives. Where no formula solves the
    equations, the code has Newton's method for them.
    """
    from importlib import import_module

    from movimentum.equations.program import NoProgram
    from movimentum.errors import script_error
    from movimentum.output.files import refuse_unwritable, whole_file
    from movimentum.workflow.equations import NO_FORM, program_of
    from movimentum.workflow.read import read

    source = read(script)
    target: Path | None = output_or_stdout(script, output, ".txt")
    if target is not None:
        refuse_unwritable(target)
    module, _, name = FORMS[form].partition(":")
    with errors_in(source), console.working("writing equations"):
        program = program_of(source, choices, of)
        try:
            made: str = getattr(import_module(f"movimentum.equations.{module}"), name)(program)
        except NoProgram as error:
            raise script_error(NO_FORM, str(error), "`--as python` has a place for it") from error
    if target is None:
        answer(made)
    else:
        with whole_file(target) as part:
            part.write_text(made, encoding="utf-8")
        console.say(f"{target}: {form}")
    return 0
