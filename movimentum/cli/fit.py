"""`movimentum fit`: the constants that best meet a script's goals."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from movimentum.cli.common import (
    DASK,
    EXIT_CODES,
    FORMAT,
    FPS,
    LIMITS,
    SCRIPT,
    SPEECH,
    files,
    gathered,
    output_file,
)
from movimentum.console import Console, answer, answer_json
from movimentum.diagnostics import to_json
from movimentum.errors import errors_in
from movimentum.records import dataclass
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read

if TYPE_CHECKING:
    from movimentum.fitting.fit import Fitted
    from movimentum.scene.model import Purpose
    from movimentum.source import SourceText


@dataclass(frozen=True, slots=True)
class _FitOptions:
    """The values of the options."""

    vary: tuple[str, ...]
    seed: int
    effort: int
    every: bool
    sheet: str | None
    form: str
    dask: str | None


@click.command(
    epilog="""\b
Examples:
  movimentum fit four-bar.mov
  movimentum fit four-bar.mov -o fitted.mov --sheet before-after.png
  movimentum fit four-bar.mov --vary L=60:220 --vary R=20:80 --set Q=90
  movimentum fit arm.mov --all --format json

"""
    + EXIT_CODES
)
@SCRIPT
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    shell_complete=files,
    help="Write the script with the new constants; - is standard output.",
)
@click.option(
    "--vary",
    multiple=True,
    metavar="NAME[=A:B]",
    help="A constant (`.let`) to fit, and its interval (default: its `.range`). May be repeated. "
    "[default: all that have a `.range`, except those given by --set]",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Use other starting points.")
@click.option(
    "--effort",
    type=click.IntRange(1, 1000),
    default=1,
    show_default=True,
    metavar="N",
    help="Try N times as many starts.",
)
@click.option("--all", "every", is_flag=True, help="Look for all solutions, and list those that are equally good.")
@click.option(
    "--sheet", metavar="PNG", shell_complete=files, help="A picture of the script before and after, side by side."
)
@FORMAT
@DASK
@FPS
@LIMITS
@SPEECH
@click.pass_obj
@gathered(choices=Choices, asked=_FitOptions)
def fit(console: Console, *, choices: Choices, asked: _FitOptions, script: str, output: str | None) -> int:
    """Fit the constants of SCRIPT to its goals while its requirements hold.

    The script states goals and requirements: `.goal Rod.P = [100, 150];`, `.require Rod.P.y > 20;`. The constants are
    those that have a `.range`. The result can be assembled, moves all the way, and is verified.
    """
    target = None if output in (None, "-") else output_file(script, output, ".mov")
    source = read(script)
    with errors_in(source), console.working("fitting"):
        return _fitted(console, source, choices, asked, target, to_stdout=output == "-")


def _fitted(
    console: Console, source: SourceText, choices: Choices, asked: _FitOptions, target: Path | None, *, to_stdout: bool
) -> int:
    from movimentum.fitting.fit import done_here, make_job, make_problem
    from movimentum.fitting.fit import fit as fit_problem
    from movimentum.fitting.output import with_constants, write_before_and_after
    from movimentum.fitting.summary import fit_text, notes, unmet
    from movimentum.output.files import refuse_overwriting, refuse_unwritable
    from movimentum.variants.axes import read_intervals
    from movimentum.variants.plots import check_sheet
    from movimentum.workflow.read import reads
    from movimentum.workflow.stages import understand

    scene = understand(source, choices)
    job = make_job(source, choices, read_intervals(asked.vary, scene.constants), asked.seed)
    for path in (target, None if asked.sheet is None else Path(asked.sheet)):
        if path is not None:
            refuse_overwriting(path, reads(source, scene))
            refuse_unwritable(path)
    if asked.sheet is not None:
        check_sheet(Path(asked.sheet))
    if target is not None or to_stdout:
        with_constants(scene, dict.fromkeys(job.names, 0.0))  # now, and not after the work
    problem = make_problem(job)
    with ExitStack() as stack:
        work = done_here(problem)
        if asked.dask is not None:
            from movimentum.fitting.output import done_there
            from movimentum.workflow.clusters import cluster

            work = done_there(job, stack.enter_context(cluster(asked.dask, console.say)))
        progress = stack.enter_context(console.progress("fitting"))
        found = fit_problem(problem, progress, work, every=asked.every, effort=asked.effort)
    console.show(unmet(found), scene.source)
    console.note(notes(found), scene.source)
    if asked.form == "json":
        answer_json(_as_json(found))
    elif not to_stdout:
        answer(fit_text(found))
    if found.met:
        if target is not None:
            _write(target, with_constants(scene, found.constants, target.parent))
        elif to_stdout and asked.form != "json":
            answer(with_constants(scene, found.constants))
    if asked.sheet is not None:
        write_before_and_after(found, Path(asked.sheet))
    return found.exit_code


def _write(target: Path, text: str) -> None:
    from movimentum.output.files import whole_file

    with whole_file(target) as part, part.open("w", encoding="utf-8", newline="") as stream:
        stream.write(text)


# --- what it prints: the same result for people and for programs


def _as_json(found: Fitted) -> str:
    """One JSON object: ``constants``, ``goals``, ``requirements``, ``cost``, ``met``, ``others``."""
    from movimentum.fitting.summary import aim_outcomes, cost_of, notes, unmet
    from movimentum.scene.model import Purpose

    job = found.problem.job
    scene = found.problem.lowered.timeline.scene
    pairs = list(zip(aim_outcomes(found, found.first), aim_outcomes(found, found.last), strict=True))

    def outcomes(purpose: Purpose) -> list[dict[str, Any]]:
        return [
            {
                "text": now.text,
                "line": now.line,
                "rms": now.rms,
                "worst": now.worst,
                "time": now.time,
                "rms_before": was.rms,
                "worst_before": was.worst,
                "value": now.value,
                "value_before": was.value,
            }
            for was, now in pairs
            if now.claim.purpose is purpose
        ]

    rows = zip(job.names, found.before.tolist(), found.after.tolist(), job.intervals.tolist(), strict=True)
    data = {
        "met": found.met,
        "constants": [
            {"name": name, "before": before, "after": after, "least": low, "most": high}
            for name, before, after, (low, high) in rows
        ],
        "cost": cost_of(found, found.last),
        "cost_before": cost_of(found, found.first),
        "goals": outcomes(Purpose.GOAL),
        "requirements": outcomes(Purpose.REQUIREMENT),
        "others": [dict(zip(job.names, row, strict=True)) for row in found.others.tolist()],
        "seed": job.seed,
        "diagnostics": to_json([*unmet(found), *notes(found)], scene.source),
    }
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
