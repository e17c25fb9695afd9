"""`movimentum fmt`: formats scripts in the layout of the gallery."""

from __future__ import annotations

import difflib
import re
import sys
from collections.abc import Iterator

import click

from movimentum.cli.common import EXIT_CODES, SPEECH, files
from movimentum.console import Console
from movimentum.errors import MovimentumError
from movimentum.output.files import standard_output
from movimentum.text import counted
from movimentum.workflow.reformat import Reformatted, reformat, write_back

_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")


@click.command(
    epilog="""\b
Examples:
  movimentum fmt crank.mov
  movimentum fmt --check scripts/*.mov
  movimentum fmt --diff crank.mov
  movimentum fmt - < crank.mov > formatted.mov

"""
    + EXIT_CODES
)
@click.argument("scripts", metavar="SCRIPT...", nargs=-1, required=True, shell_complete=files)
@click.option("--check", is_flag=True, help="Write nothing; the exit code is 1 if a script is not formatted.")
@click.option("--diff", is_flag=True, help="Write nothing; show what would change.")
@SPEECH
@click.pass_obj
def fmt(console: Console, *, scripts: tuple[str, ...], check: bool, diff: bool) -> int:
    """Format each SCRIPT in place; - is standard input to standard output.

    Only white space changes, between lines and in them. Comments and the meaning of the script stay as they are.
    Included files are formatted only if they are named too.
    """
    if "-" in scripts and len(scripts) > 1:
        raise click.UsageError("- is standard input, and stands alone.")
    code = changed = same = 0
    for path in scripts:
        try:
            made = reformat(path)
            if made.changes and path != "-" and not (check or diff):
                write_back(made)
        except MovimentumError as error:
            console.show(error.diagnostics, error.source)
            code = max(code, error.exit_code)
            continue
        changed, same = changed + made.changes, same + (not made.changes)
        if diff:
            standard_output().write("".join(_difference(made)))
        elif path == "-" and not check:
            standard_output().write(made.output.decode("utf-8"))
        elif made.changes:
            console.say(f"{made.source.path}: {'would be formatted' if check else 'formatted'}")
    if len(scripts) > 1 and not diff:
        console.say(f"{counted(changed, 'script')} {'to format' if check else 'formatted'}, {same} as it should be")
    sys.stdout.flush()
    return max(code, 1 if check and changed else 0)


def _difference(made: Reformatted) -> Iterator[str]:
    before, after = (_LINE.findall(text) for text in (made.source.text, made.text))
    for line in difflib.unified_diff(before, after, made.source.path, f"{made.source.path} (formatted)"):
        yield line if line.endswith(("\n", "\r")) else line + "\n\\ No newline at end of file\n"
