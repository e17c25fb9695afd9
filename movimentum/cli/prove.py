"""`movimentum prove`: which claims are theorems."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from movimentum.cli.common import FORMAT, LIMITS, SCRIPT, SPEECH, with_choices
from movimentum.console import Console, answer, answer_json
from movimentum.errors import errors_in
from movimentum.text import number
from movimentum.workflow.choices import Choices

if TYPE_CHECKING:
    from movimentum.proving.verdicts import Judgement
    from movimentum.source import SourceText

UNDECIDED = 4


@click.command(
    epilog="""\b
Examples:
  movimentum prove scripts/peaucellier.mov
  movimentum prove scripts/hart.mov --all-lengths
  movimentum prove crank.mov --seconds 60 --format json | jq .claims

\b
Verdicts:
  proved                 for every position
  proved on this branch  for every position that the mechanism reaches without being put together differently
  false                  not even in the film
  true in this film      in the film, but not in general
  unknown                none of these is known

\b
Exit codes:
  0   all claims are proved
  1   one is false, or one with `.always` is true in this film only; or the script is at fault
  2   wrong usage, or a file cannot be read
  3   the scene has no solution at some time
  4   none is false, but one is not proved
  70  a bug in Movimentum
  130 interrupted"""
)
@SCRIPT
@click.option(
    "--seconds",
    type=click.FloatRange(min=0.0, min_open=True),
    default=10.0,
    show_default=True,
    metavar="N",
    help="Give up after N seconds of computing; undecided claims are then unknown.",
)
@click.option(
    "--all-lengths",
    is_flag=True,
    help="Prove for all values of the constants (`.let`) that are plain numbers, not only for the script's.",
)
@FORMAT
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def prove(console: Console, *, choices: Choices, script: str, seconds: float, all_lengths: bool, form: str) -> int:
    """Prove the claims of SCRIPT: that they hold in every position, not only in the film.

    One line for each claim: its verdict, its place, and the claim. The conditions of a proof, the reason why there is
    none, or a pose that breaks the claim go to stderr and into the JSON.
    """
    from movimentum.workflow.prove import proofs
    from movimentum.workflow.read import read

    source = read(script)
    found: list[Judgement] = []
    with errors_in(source), console.working("proving"):
        judgements, names = proofs(source, choices, seconds, all_lengths=all_lengths)
        found = list(judgements)
    if all_lengths:
        console.say(
            f"for all values of {', '.join(names)}" if names else "no constant is left open: none is a plain number"
        )
    if form == "json":
        answer_json(json.dumps({"claims": [_data(one, source) for one in found]}, indent=2))
    else:
        width = max((len(one.verdict.value) for one in found), default=0)
        for one in found:
            data = _data(one, source)
            answer(f"{one.verdict.value:<{width}}  {data['line']}:{data['column']}  {data['text']}\n")
            for line in _reasons(data):
                console.say(f"    {line}")
        if not found:
            console.say("the script claims nothing: state what should hold with `.claim Rod.B.x = 120;`")
    verdicts = {one.verdict.value for one in found}
    if "false" in verdicts or any(
        one.timed_claim.claim.always and one.verdict.value == "true in this film" for one in found
    ):
        return 1
    return UNDECIDED if verdicts & {"unknown", "true in this film"} else 0


def _data(one: Judgement, source: SourceText) -> dict[str, Any]:
    claim = one.timed_claim.claim
    return {
        **source.claim_data(claim.span),
        "verdict": one.verdict.value,
        "always": claim.always,
        "conditions": list(one.conditions),
        "why": one.why,
        "counterexample": {name: list(spot) for name, spot in one.counterexample.items()},
    }


def _reasons(data: dict[str, Any]) -> list[str]:
    from movimentum.proving.prove import NO_TIME

    lines = [f"if {condition}" for condition in data["conditions"]]
    more = "; `--seconds` gives more" if data["why"] == NO_TIME else ""
    lines += [f"{data['why']}{more}"] if data["why"] else []
    spots = [f"{name} = [{number(x)}, {number(y)}]" for name, (x, y) in data["counterexample"].items()]
    return lines + (["for instance where " + ", ".join(spots)] if spots else [])
