"""`movimentum check`: everything that can be reported without rendering."""

from __future__ import annotations

import json
import os
import sys
from typing import TYPE_CHECKING, Any

import click

from movimentum.cli.common import EXIT_CODES, FPS, LIMITS, SPEECH, STRICT, files, with_choices
from movimentum.console import Console, answer, answer_json, wants_color
from movimentum.diagnostics import render_text, to_json
from movimentum.errors import MovimentumError
from movimentum.terminal import visible
from movimentum.text import counted, listed
from movimentum.workflow.choices import Choices

if TYPE_CHECKING:
    from movimentum.analysis.report import MotionReport, PartReport, StepReport
    from movimentum.diagnostics import Fix
    from movimentum.source import SourceText, Span
    from movimentum.workflow.check import CheckReport


@click.command(
    epilog="""\b
Examples:
  movimentum check crank.mov
  movimentum check *.mov --strict
  movimentum check crank.mov --format json | jq .diagnostics
  movimentum check crank.mov --freedom
  movimentum check crank.mov --fps-invariance --reverse
  movimentum check crank.mov --certify
  movimentum check crank.mov --gaps

"""
    + EXIT_CODES.replace("  70  a bug", "  4   nothing is wrong, but `--certify` has not proved all\n  70  a bug")
)
@click.argument("scripts", metavar="SCRIPT...", nargs=-1, required=True, shell_complete=files)
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", "sarif"]),
    default="text",
    show_default=True,
    help="Output for people, for programs, or for code review tools.",
)
@click.option("--freedom", is_flag=True, help="Show all connected parts and all free motions, with velocities.")
@click.option("--fps-invariance", is_flag=True, help="Also solve at another frame rate, and compare.")
@click.option(
    "--certify",
    is_flag=True,
    help="Also prove how far frames are from an exact solution, in one unbroken motion, and bounds between frames.",
)
@click.option("--gaps", is_flag=True, help="Also list the pairs that overlap: from when to when, and how deep.")
@click.option("--all-layers", is_flag=True, help="With --gaps: also pairs on different layers.")
@click.option("--reverse", is_flag=True, help="Also follow the motion from its end back to its beginning, and compare.")
@FPS
@STRICT
@LIMITS
@SPEECH
@click.pass_obj
@with_choices
def check(
    console: Console,
    *,
    choices: Choices,
    scripts: tuple[str, ...],
    form: str,
    freedom: bool,
    fps_invariance: bool,
    certify: bool,
    gaps: bool,
    all_layers: bool,
    reverse: bool,
) -> int:
    """Report everything about each SCRIPT that needs no rendering.

    It reports errors, warnings and notes, and for every step how much was left to solve and what is still free. With
    several scripts, the exit code is the highest one.
    """
    from movimentum.workflow.check import check as checked

    if all_layers and not gaps:
        raise click.UsageError("--all-layers belongs to --gaps.")
    if len(scripts) > 1 and form != "text":
        raise click.UsageError(f"--format {form} is for one script.")
    codes: list[int] = []
    for script in scripts:
        try:
            with console.working("checking"):
                report, source = checked(
                    script,
                    choices,
                    fps_invariance=fps_invariance,
                    reverse=reverse,
                    certify=certify,
                    gaps=gaps,
                    all_layers=all_layers,
                )
        except MovimentumError as error:
            if len(scripts) == 1:
                raise
            codes.append(console.fail(error))
            continue
        if form == "sarif":
            answer_json(check_sarif(report, source))
        elif form == "json":
            answer_json(check_json(report, source, freedom=freedom))
        elif report.exit_code or len(scripts) == 1 or not console.quiet:
            answer(check_text(report, source, color=wants_color(sys.stdout), freedom=freedom))
        codes.append(report.exit_code)
    return max(codes)


# --- what it prints: the same report for people and for programs

MOST_GROUPS = 3
"""Up to this many groups of things that move as one are shown in a line; JSON has all of them."""
SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def check_json(report: CheckReport, source: SourceText, *, freedom: bool = False) -> str:
    """One JSON object: ``diagnostics``, ``steps``, ``frames``, ``duration`` (null if it did not get that far); with
    ``freedom``, each step has its ``parts`` and ``motions`` too.
    """
    return json.dumps(
        {
            "diagnostics": to_json(report.diagnostics, source),
            "steps": [
                {
                    "time": step.time,
                    "end": step.end,
                    "unknowns": step.unknowns,
                    "equations": step.equations,
                    "rank": step.rank,
                    "freedom": step.freedom,
                    "redundant": step.redundant,
                    "blocks": [{"unknowns": list(unknowns), "kernel": kernel} for unknowns, kernel in step.blocks],
                    **(_freedom(step) if freedom else {}),
                }
                for step in report.steps
            ],
            "frames": report.frames,
            "duration": report.duration,
            **({"certificate": _certificate(report, source)} if report.certificate is not None else {}),
            **({"gaps": [each.as_data() for each in report.gaps]} if report.gaps is not None else {}),
        },
        indent=1,
        ensure_ascii=False,
        allow_nan=False,
    )


def _certificate(report: CheckReport, source: SourceText) -> dict[str, Any]:
    from movimentum.certifying.wording import as_data

    assert report.certificate is not None
    return as_data(report.certificate, source)


def _freedom(step: StepReport) -> dict[str, Any]:
    return {
        "parts": [
            {
                "things": list(part.things),
                "freedom": part.freedom,
                "redundant": part.redundant,
                "rigid": [list(some) for some in part.rigid],
                "fixed": list(part.fixed),
                "superfluous": list(part.superfluous),
            }
            for part in step.parts
        ],
        "motions": [
            {
                "words": motion.words,
                "things": list(motion.things),
                "variables": list(motion.variables),
                "velocities": {name: list(velocity) for name, velocity in motion.velocities},
                "drawn": motion.drawn,
            }
            for motion in step.motions
        ],
    }


def check_sarif(report: CheckReport, source: SourceText) -> str:
    """A SARIF 2.1.0 log of one run: a result for each diagnostic, its other places as related locations, and its fixes.

    Columns are counted in characters (``unicodeCodePoints``), as everywhere.
    """
    from urllib.parse import quote

    from movimentum import __version__

    codes = list(dict.fromkeys(item.code for item in report.diagnostics))
    place = {"uri": quote(os.fsencode(source.path.replace(os.sep, "/")))}  # bytes: a path need not be UTF-8

    def location(span: Span | None, message: str = "") -> dict[str, Any]:
        where: dict[str, Any] = {"artifactLocation": place}
        if span is not None:
            where["region"] = _region(span, source)
        return {"physicalLocation": where, **({"message": {"text": message}} if message else {})}

    results: list[dict[str, Any]] = []
    for item in report.diagnostics:
        lines = [item.message, *(f"note: {note}" for note in item.notes), *(f"help: {text}" for text in item.helps)]
        result: dict[str, Any] = {
            "ruleId": item.code,
            "ruleIndex": codes.index(item.code),
            "level": item.severity.value,
            "message": {"text": "\n".join(lines)},
            "locations": [location(item.span)],
        }
        if item.labels:
            related = enumerate(item.labels, 1)
            result["relatedLocations"] = [{"id": n, **location(label.span, label.message)} for n, label in related]
        if fixes := [_sarif_fix(fix, place, source) for fix in item.fixes if fix.tried]:
            result["fixes"] = fixes
        results.append(result)
    driver = {"name": "Movimentum", "version": __version__, "rules": [{"id": code} for code in codes]}
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    log = {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}
    return json.dumps(log, indent=1, ensure_ascii=False, allow_nan=False)


def _region(span: Span, source: SourceText) -> dict[str, int]:
    start, end = source.position(span.start), source.position(span.end)
    return {"startLine": start.line, "startColumn": start.column, "endLine": end.line, "endColumn": end.column}


def _sarif_fix(fix: Fix, place: dict[str, str], source: SourceText) -> dict[str, Any]:
    replacements = [
        {"deletedRegion": _region(edit.span, source), "insertedContent": {"text": edit.text}} for edit in fix.edits
    ]
    changes = [{"artifactLocation": place, "replacements": replacements}]
    return {"description": {"text": fix.title}, "artifactChanges": changes}


def check_text(report: CheckReport, source: SourceText, *, color: bool, freedom: bool = False) -> str:
    """The diagnostics with their lines, then one line per step, and the verdict; with ``freedom``, every part and every
    free motion.
    """
    parts: list[str] = []
    if report.diagnostics:
        parts.append(render_text(report.diagnostics, source, color=color).rstrip("\n") + "\n\n")
    parts.extend(_line(step, freedom) for step in report.steps)
    path = visible(source.path)
    if report.gaps is not None:
        from movimentum.analysis.gaps.wording import overlaps_text

        parts.append(overlaps_text(report.gaps))
    if report.certificate is not None:
        from movimentum.certifying.wording import certificate_text

        parts.append(certificate_text(report.certificate, source))
        if report.exit_code:
            parts.append(f"{path}: not certified\n")
    if report.exit_code:
        parts.append("" if report.certificate is not None else f"{path}: failed\n")
    elif report.frames is not None and report.duration is not None:
        units = f"{report.duration:g} time unit{'' if report.duration == 1 else 's'}"
        parts.append(f"{path}: passed; {counted(report.frames, 'frame')}, {units}\n")
    return "".join(parts)


def _line(step: StepReport, freedom: bool) -> str:
    return (
        f"step @{step.time:g}"
        + (f" to @{step.end:g}" if step.end > step.time else "")
        + f": {counted(step.unknowns, 'unknown')} left to solve, "
        + (f"{counted(step.freedom, 'free motion')}, " if step.freedom else "nothing free, ")
        + (f"{counted(step.redundant, 'redundant equation')}" if step.redundant else "nothing redundant")
        + "\n"
        + "".join(_part(part, freedom) for part in step.parts)
        + "".join(_motion(number, motion) for number, motion in enumerate(step.motions if freedom else (), 1))
    )


def _part(part: PartReport, whole: bool) -> str:
    """The line about a part; nothing if all is as it should be, unless ``whole``."""
    if not part.freedom and not part.redundant and not whole:
        return ""
    most, groups = (10**6, 10**6) if whole else (4, MOST_GROUPS)
    said = [f"{counted(part.freedom, 'degree')} of freedom" if part.freedom else "no freedom"]
    said += [f"{listed(some, most)} move as one" for some in part.rigid[:groups]]
    if len(part.rigid) > groups:
        said.append(f"so do {counted(len(part.rigid) - groups, 'other group')}")
    if part.fixed and (part.freedom or whole):
        said.append(f"{listed(part.fixed, most)} cannot move")
    if part.redundant:
        many = "one of these is" if part.redundant == 1 else f"{part.redundant} of these are"
        said.append(f"{many} superfluous: {listed(part.superfluous, max(most, 6))}")
    return f"  {listed(part.things, most)}: {'; '.join(said)}\n"


def _motion(number: int, motion: MotionReport) -> str:
    """A free motion: in words, and the velocities of the anchors that move."""
    drawn = " (a wish says where it goes)" if motion.drawn else ""
    rounded = [(name, round(x, 3) + 0.0, round(y, 3) + 0.0) for name, (x, y) in motion.velocities]
    moving = [f"{name} [{x:g}, {y:g}]" for name, x, y in rounded if x or y]
    return f"  motion {number}{drawn}: {motion.words}\n" + (f"    {', '.join(moving)}\n" if moving else "")
