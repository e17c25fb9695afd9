"""`import` and `export`: scripts from other programs' files, and back."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError, script_error, usage_error
from movimentum.output.files import refuse_overwriting, write_text
from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.terminal import typed, visible
from movimentum.workflow.choices import Choices, Outcome
from movimentum.workflow.read import decoded, read_bytes, reads
from movimentum.workflow.stages import Solution, arranged, judged, solved, understand

if TYPE_CHECKING:
    from movimentum.interop.shapes import Shape
    from movimentum.solver.poses import Poses
    from movimentum.timeline.model import Timeline


@dataclass(frozen=True, slots=True)
class Import:
    """How to read a foreign file: ``snap`` repairs rounded coordinates, with angles multiples of ``snap_angle``;
    ``drives`` are the inputs (base, driven) of a mechanism expression.
    """

    snap: bool = False
    snap_angle: float = 36.0
    drives: tuple[tuple[int, int], ...] = ()


def read_foreign(path: str) -> SourceText:
    """The file to import at ``path`` (``-`` is stdin): text in UTF-8, or a DXF in the code page that it names; errors
    as in `read`, and ``import/dxf`` for drawings that are no text.
    """
    data = read_bytes(path)
    try:
        return decoded(data, path)
    except ScriptError:
        from movimentum.interop.recognised import binary_drawing, code_page_of_dxf

        binary = binary_drawing(data)
        if binary:
            raise script_error("import/dxf", f"{path} is {binary}", "save it as DXF (text, R2000 or later)") from None
        page = code_page_of_dxf(data)
        if page is None:
            raise
        return SourceText(path, data.decode(page, "replace"))


def imported(source: SourceText, target: Path | None, how: Import, strict: bool) -> Outcome:
    """Write another program's file as a script to ``target`` (None: stdout); its content tells its format."""
    from movimentum.interop.recognised import FileKind, kind_of
    from movimentum.interop.scripts import script_of

    title = visible(Path(source.path).name)  # it is in a comment of one line
    kind = kind_of(source)
    if how.snap and kind is not FileKind.LINKAGE:
        raise usage_error(
            "usage/import",
            Advised(Choose.SNAP.to(), f" is for linkage files: {kind.description} has no angles to repair"),
        )
    if how.drives and kind is not FileKind.MECHANISM:
        instead = {
            FileKind.FORMULAS: "formulas name their own inputs",
            FileKind.LINKAGE: "pull a linkage with a wish",
        }.get(kind, "this file already says what is driven")
        raise usage_error(
            "usage/import", Advised(Choose.DRIVE.to(), f" is for Pyslvs' mechanism expressions: {instead}")
        )
    text, found = script_of(source, title, how.drives, how.snap_angle if how.snap else None)
    found, warned = judged(found, Choices(strict=strict))
    if warned:
        raise ScriptError(found)
    write_text(text, target, (source.path,))
    return Outcome(1, 0, found)


@dataclass(frozen=True, slots=True)
class Export:
    """How to write a script's scene for another program: the ``form`` (see `FORMS`), at which time, how thick solids
    are and how wide holes.
    """

    form: str = ""
    at: Fraction | None = None
    thickness: float | None = None
    hole: float | None = None


@dataclass(frozen=True, slots=True)
class _Scene:
    """The input for writing a format."""

    title: str
    timeline: Timeline
    solution: Solution
    moment: Fraction
    how: Export

    @property
    def poses(self) -> Poses:
        return self.solution.motion.poses_at([self.moment])


Written = tuple[str, tuple[Diagnostic, ...]]
"""A file's text, and what it could not hold."""


def _linkage(scene: _Scene) -> Written:
    from movimentum.interop.linkage_export import linkage_of
    from movimentum.interop.linkages import linkage_text

    timeline = scene.timeline
    active = timeline.segments[timeline.segment_at(scene.moment)].active
    linkage, _, found = linkage_of(timeline.scene, active, scene.poses)
    return linkage_text(linkage), found


def _formulas(scene: _Scene) -> Written:
    from movimentum.interop.formulas import formulas_text
    from movimentum.interop.triangles import triangles_of

    triangles = triangles_of(scene.solution.motion.path)
    comments = [
        f"{scene.title}: angles in degrees; a list has a value for each frame",
        *(f"{name}: {label}" for name, label in triangles.names),
    ]
    return formulas_text(triangles.formulas, comments), ()


def _shapes(scene: _Scene) -> list[Shape]:
    from movimentum.interop.shapes import shapes_of

    found = list(shapes_of(scene.timeline.scene, scene.how.hole))
    if not found:
        message = "there is nothing to cut: the script has no bars, plates, discs, polygons or gears"
        raise ScriptError([Diagnostic("export/empty", Severity.ERROR, message)])
    return found


def _dxf(scene: _Scene) -> Written:
    from movimentum.interop.dxf import dxf_text
    from movimentum.interop.shapes import not_as_drawn

    found = _shapes(scene)
    return dxf_text(found, scene.poses), not_as_drawn(found, scene.how.hole)


def _stl(scene: _Scene) -> Written:
    from movimentum.interop.shapes import not_as_drawn
    from movimentum.interop.solids import stl_text

    found = _shapes(scene)
    return stl_text(found, scene.how.thickness or 0.0, scene.poses), not_as_drawn(found, scene.how.hole)


def _parts(scene: _Scene) -> Written:
    from movimentum.interop.solids import bill_of_parts

    return bill_of_parts(scene.timeline.scene.things), ()


def _profiles(scene: _Scene) -> Written:
    from movimentum.interop.profiles import profiles_text

    text = profiles_text(scene.timeline.scene.things)
    if not text:
        message = "there is no profile: the script has no `.cut` and no `.curve`"
        raise ScriptError([Diagnostic("export/empty", Severity.ERROR, message)])
    return text, ()


FORMS: dict[str, Callable[[_Scene], Written]] = {
    "linkages": _linkage, "pyslvs": _formulas, "dxf": _dxf, "stl": _stl, "parts": _parts, "profiles": _profiles,
}  # fmt: skip
"""The writer of each export format."""
BY_SUFFIX = {
    ".txt": "linkages", ".linkages": "linkages", ".pyslvs": "pyslvs", ".dxf": "dxf", ".stl": "stl", ".csv": "parts",
    "": "linkages",
}  # fmt: skip
"""The forms that a file's suffix names; without one, and on standard output, a linkage."""


def exported(source: SourceText, target: Path | None, how: Export, choices: Choices) -> Outcome:
    """Write a script's scene in another program's format to ``target`` (None: stdout); with ``%s`` in the name of an
    STL, each part to a file of its own, called after it.
    """
    form = how.form or BY_SUFFIX.get("" if target is None else target.suffix.lower(), "")
    if not form and target is not None:
        refuse_overwriting(target, reads(source, understand(source, choices)))
        known = ", ".join(filter(None, BY_SUFFIX))
        message = f"cannot tell a format from `{target.name}`: known are {known}"
        helps = (Choose.OUTPUT.to(typed(target.with_suffix(".dxf"))), Choose.FORMAT.to("linkages"))
        raise usage_error("output/format", message, *helps)
    if how.at is not None and form in ("pyslvs", "parts", "profiles"):
        raise usage_error(
            "usage/at",
            Advised(Choose.AT.to(), f" is for what has one pose, and {form} has none"),
            Advised("leave out ", Choose.AT.to()),
        )
    if (how.thickness is None) == (form == "stl"):
        message = "an STL needs a thickness" if form == "stl" else Advised(Choose.THICKNESS.to(), " is for an STL")
        raise usage_error(
            "usage/thickness", message, Advised(Choose.OUTPUT.to(), " parts.stl ", Choose.THICKNESS.to(), " 3")
        )
    timeline = arranged(understand(source, choices), choices)
    solution = solved(timeline, choices)
    moment = timeline.start if how.at is None else how.at
    if not timeline.start <= moment <= timeline.end:
        raise usage_error("usage/at", f"time {moment} is outside the film, {timeline.start} to {timeline.end}")
    scene = _Scene(visible(Path(source.path).name), timeline, solution, moment, how)
    each = form == "stl" and target is not None and "%s" in target.name
    text, found = FORMS[form](scene)
    found, warned = judged((*solution.diagnostics, *found), choices)
    if warned:
        raise ScriptError(found)
    inputs = reads(source, timeline.scene)
    if each and target is not None:
        from movimentum.interop.dxf import layer_name
        from movimentum.interop.solids import stl_text

        for shape in _shapes(scene):
            name = target.name.replace("%s", layer_name(shape.thing.name))
            write_text(stl_text([shape], how.thickness or 0.0, None), target.with_name(name), inputs)
    else:
        write_text(text, target, inputs)
    return Outcome(1, solution.fault, found)
