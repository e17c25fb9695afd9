"""`movimentum explain`: what a message code means."""

from __future__ import annotations

import json
from dataclasses import asdict

import click
from click.shell_completion import CompletionItem

from movimentum import messages
from movimentum.cli.common import EXIT_CODES, FORMAT, SPEECH
from movimentum.console import Console, answer, answer_json
from movimentum.errors import UsageError


def _codes(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    return [CompletionItem(code) for code in messages.explanations() if code.startswith(incomplete)]


@click.command(
    epilog="""\b
Examples:
  movimentum explain solve/unreachable
  movimentum explain constraint
  movimentum explain | less

"""
    + EXIT_CODES
)
@click.argument("codes", metavar="[CODE]...", nargs=-1, shell_complete=_codes)
@FORMAT
@SPEECH
@click.pass_obj
def explain(console: Console, *, codes: tuple[str, ...], form: str) -> int:
    """Explain message codes: what each means, what to do, and an example.

    CODE is as in a message, such as solve/unreachable. A word before the slash stands for all its codes. Without CODE,
    all codes are listed with a line each.
    """
    del console
    found: list[messages.Explanation] = []
    for code in codes:
        explained = messages.find(code)
        if not explained:
            raise UsageError([messages.unknown(code, "movimentum explain")])
        found += [each for each in explained if each not in found]
    if form == "json":
        shown = found or list(messages.explanations().values())
        answer_json(json.dumps({"codes": [asdict(each) for each in shown]}, indent=2))
    else:
        answer(("\n\n\n".join(each.text for each in found) if found else messages.listing()).rstrip("\n") + "\n")
    return 0
