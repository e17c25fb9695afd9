"""`import` and `export`: scripts from other programs' files, and the reverse."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from movimentum.diagnostics import Diagnostic
from movimentum.errors import ScriptError, usage_error
from movimentum.output.text import write_text
from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.terminal import visible
from movimentum.workflow.choices import Choices, Outcome
from movimentum.workflow.read import reads
from movimentum.workflow.stages import arranged, judged, solved, understand


@dataclass(frozen=True, slots=True)
class Import:
    """How to read a foreign file: ``snap`` repairs rounded coordinates, with angles multiples of ``snap_angle``;
    ``drives`` are the inputs (base, driven) of a mechanism expression.
    """

    snap: bool = False
    snap_angle: float = 36.0
    drives: tuple[tuple[int, int], ...] = ()


def imported(source: SourceText, target: Path | None, how: Import, strict: bool) -> Outcome:
    """Write another program's file as a script to ``target`` (None: stdout); its content tells its format."""
    from movimentum.interop.recognised import FileKind, kind_of
    from movimentum.interop.scripts import script_of

    title = visible(Path(source.path).name)  # it is in a comment of one line
    kind = kind_of(source)
    if how.snap and kind is not FileKind.LINKAGE:
        raise usage_error("usage/import", f"--snap is for linkage files: {kind.told} has no angles to repair")
    if how.drives and kind is not FileKind.MECHANISM:
        instead = {
            FileKind.FORMULAS: "formulas name their own inputs",
            FileKind.LINKAGE: "pull a linkage with a wish",
        }.get(kind, "this file already says what is driven")
        raise usage_error("usage/import", f"--drive is for Pyslvs' mechanism expressions: {instead}")
    text, found = script_of(source, title, how.drives, how.snap_angle if how.snap else None)
    found, warned = judged(found, Choices(strict=strict))
    if warned:
        raise ScriptError(found)
    write_text(text, target, (source.path,))
    return Outcome(1, 0, found)


def exported(source: SourceText, target: Path | None, form: str, at: Fraction | None, choices: Choices) -> Outcome:
    """Write a script's scene as a linkage file, as it is at time ``at``, or its plan as Pyslvs' formulas."""
    from movimentum.interop.linkage_export import linkage_of
    from movimentum.interop.linkages import linkage_text

    timeline = arranged(understand(source, choices), choices)
    solution = solved(timeline, choices)
    found: tuple[Diagnostic, ...] = ()
    if form == "linkages":
        moment = timeline.start if at is None else at
        if not timeline.start <= moment <= timeline.end:
            raise usage_error("usage/at", f"time {moment} is outside the film, {timeline.start} to {timeline.end}")
        active = timeline.segments[timeline.segment_at(moment)].active
        linkage, _, found = linkage_of(timeline.scene, active, solution.motion.poses_at([moment]))
        text = linkage_text(linkage)
    else:
        from movimentum.interop.formulas import formulas_text
        from movimentum.interop.triangles import triangles_of

        triangles = triangles_of(solution.motion.path)
        comments = [
            f"{visible(Path(source.path).name)}: angles in degrees; a list has a value for each frame",
            *(f"{name}: {told}" for name, told in triangles.names),
        ]
        text = formulas_text(triangles.formulas, comments)
    found, warned = judged((*solution.diagnostics, *found), choices)
    if warned:
        raise ScriptError(found)
    write_text(text, target, reads(source, timeline.scene))
    return Outcome(1, solution.fault, found)
