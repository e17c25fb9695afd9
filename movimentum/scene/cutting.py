"""``Cam : .cut Roller .in Shaft``: things whose outline is what another thing cuts in a third one over the film.

To find it, the film is first solved without the profile and without statements that mention it, so a statement about a
profile never affects how it is cut. Then the profile is a curve that moves with the thing that is cut.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from movimentum.diagnostics import Diagnostic, Fix, Severity, insertion, replacement
from movimentum.errors import ScriptError
from movimentum.expressions import symbol
from movimentum.records import dataclass, replace
from movimentum.scene.expansion.placement import HERE
from movimentum.scene.expansion.product import Expanded, Timed
from movimentum.scene.findings import Findings
from movimentum.scene.model import Anchor, AnchorCoordinate, AnchorRef, Constraint, Relation, Scene, Thing, ThingAngle
from movimentum.scene.resolve import ThingTable
from movimentum.source import Span
from movimentum.syntax.expression_tree import Expression, Index, Member, Name, Several, postorder
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import AnchorDefinition, Definition, Option, Reference, Text
from movimentum.things.kinds.curve import Curved
from movimentum.things.kinds.cut import CUT
from movimentum.things.registry import kind_of

if TYPE_CHECKING:  # it needs NumPy
    from movimentum.outlines.contour import Contour


@dataclass(frozen=True, slots=True)
class CutJob:
    """What is cut: the names of the profile, the tool and the thing; ``outer``: the outermost edge is left.
    ``needed``: statements that mention a profile mention the tool or the thing as well.
    """

    name: str
    tool: str
    frame: str
    outer: bool = False
    needed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class CutProfile:
    """A profile, measured from the first anchor of the thing that is cut; or the ``fault`` for which there is none, or
    the errors of a film that cannot be solved (``lost``).

    Where it crosses itself: ``time`` and ``place`` (in the frame of the thing); ``radius``: of a roller that would do;
    ``farther``: by how much farther away a tool that is not round would not cut so deep.
    """

    outline: Contour | None = None
    fault: str = ""
    lost: tuple[Diagnostic, ...] = ()
    time: float | None = None
    place: tuple[float, float] | None = None
    radius: float | None = None
    farther: float | None = None


Carve: TypeAlias = Callable[[Callable[[], Scene], Sequence[CutJob]], Sequence[CutProfile]]
"""From the scene without the profiles, and the cuts, to the profiles."""


def carved(
    expanded: Expanded,
    scene: Callable[[Expanded, Mapping[str, CutProfile], Findings], Scene],
    carve: Carve | None,
    findings: Findings,
) -> dict[str, CutProfile]:
    """The profile of each cut of a script. Cuts whose tools are cut themselves come after these."""
    jobs = {each.name: job for each in expanded.definitions if each.shape.word == CUT.word and (job := _job(each))}
    known: dict[str, CutProfile] = {}
    if findings.errors:
        return known
    waiting = dict(jobs)
    while waiting and carve is not None:
        ready = [job for job in waiting.values() if job.tool not in waiting and job.frame not in waiting]
        if not ready:
            break  # which is reported where they are made things
        rest, needed = without(expanded, set(waiting))
        ready = [replace(job, needed=bool(needed & {job.tool, job.frame})) for job in ready]
        own = Findings(findings.source)
        own.constants, own.things, own.broken = findings.constants, findings.things, set(findings.broken)
        try:
            found = carve(partial(scene, rest, dict(known), own), ready)
        except ScriptError as error:
            lost = tuple(item for item in error.diagnostics if item.severity is Severity.ERROR)
            known |= {name: CutProfile(lost=lost) for name in waiting}
            break
        known |= {job.name: profile for job, profile in zip(ready, found, strict=True)}
        waiting = {name: job for name, job in waiting.items() if name not in known}
    return known


def _job(definition: Definition) -> CutJob | None:
    named = _things_named(definition)
    outer = any(isinstance(part, Option) and part.name == "outer" for part in definition.parts)
    return CutJob(definition.name, named[0], named[1], outer) if len(named) == 2 and named[0] != named[1] else None


# --- the film without its profiles


def without(expanded: Expanded, cuts: set[str]) -> tuple[Expanded, set[str]]:
    """The script without ``cuts`` and what mentions them, and without what only shows something; and the things that
    statements mention together with a cut.
    """
    out = set(cuts)
    definitions = list(expanded.definitions)
    while True:
        kept = [each for each in definitions if each.name not in out and not _goes(each, out)]
        if len(kept) == len(definitions):
            break
        out |= {each.name for each in definitions} - {each.name for each in kept}
        definitions = kept
    statements: list[Timed] = []
    together: set[str] = set()
    for timed in expanded.statements:
        names = {name for side in (timed.statement.left, timed.statement.right) for name in _named(side)}
        if names & cuts:
            together |= names - cuts
        if not names & out:
            statements.append(timed)
    return replace(expanded, definitions=tuple(definitions), statements=tuple(statements), views=()), together


def _goes(definition: Definition, out: set[str]) -> bool:
    """Whether a thing is left out: it is no body that could cut or be cut, or it refers to one that is left out."""
    kind = kind_of(definition.shape.word)
    if kind.anchors is None or kind.word in ("label", "ground") or kind.valued:
        return True
    for part in definition.parts:
        nodes: tuple[Expression | Text, ...] = ()
        match part:
            case Reference():
                nodes = (part.thing,)
            case Option():
                nodes = part.arguments
            case AnchorDefinition():
                nodes = (part.base,)
        if any(name in out for node in nodes if not isinstance(node, Text) for name in _named(node)):
            return True
    return False


def _named(root: Expression) -> Iterator[str]:
    for node in postorder(root):
        if isinstance(node, Several):
            yield from node.names
        elif isinstance(node, Name | Member | Index):
            yield expression_text(node)


# --- with them


def cut_things(
    things: list[Thing], definitions: Sequence[Definition], profiles: Mapping[str, CutProfile], findings: Findings
) -> None:
    """Make each cut of ``things`` a curve with the first anchor of what it is cut in."""
    waiting = [k for k, thing in enumerate(things) if thing.kind is CUT]
    names = {things[k].name for k in waiting}
    while waiting:
        ready = [k for k in waiting if not names.intersection(_things_named(definitions[k]))]
        if not ready:
            for k in waiting:
                message = f"`{things[k].name}` is cut by itself, in the end"
                helps = ("cut with a `.disc`, a `.bar`, a `.polygon` or a `.curve`",)
                findings.error("cut/shape", message, definitions[k].name_span, helps=helps)
            break
        for k in ready:
            things[k] = _cut_thing(k, definitions, ThingTable(things), profiles.get(things[k].name), findings)
            names.discard(things[k].name)
        waiting = [k for k in waiting if k not in ready]


def _things_named(definition: Definition) -> list[str]:
    return [expression_text(part.thing) for part in definition.parts if isinstance(part, Reference)]


def _cut_thing(
    number: int,
    definitions: Sequence[Definition],
    table: ThingTable,
    profile: CutProfile | None,
    findings: Findings,
) -> Thing:
    from movimentum.scene.points import wholes

    definition, thing = definitions[number], table.things[number]
    if not _in_order(definition, table, findings):
        return thing
    errors = findings.errors
    about = wholes(number, definition, table, findings)
    if findings.errors > errors or len(about) < 2:
        return thing
    tool, frame = (table.things[each] for each in about)
    first = frame.anchors[0]
    anchor = Anchor(first.name, first.local, definition.name_span, first.stated)
    made = replace(thing, about=about, anchors=(anchor,), placement=HERE)
    from movimentum.scene.outlines import outline_of  # few scripts cut anything

    if outline_of(tool) is None:
        if not (findings.errors and isinstance(tool.own, Curved)):
            _report_tool(tool, definition, findings)
        return made
    if profile is None or profile.outline is None:
        _report_fault(definition, profile, findings)
        return made
    if profile.time is not None:
        findings.add(_undercut(made, tool, frame, profile, definition.name_span, definitions))
    return replace(made, own=Curved(profile.outline))


def profile_of(scene: Scene, job: CutJob) -> CutProfile:
    """The result of making a scene."""
    found = scene.profiles.get(job.name)
    return found if isinstance(found, CutProfile) else CutProfile(fault="it was not solved")


def carried(things: Sequence[Thing], number: int) -> Iterator[Constraint]:
    """What holds a profile in the thing that it is cut in; ``number``: of the first of these constraints."""
    for thing in things:
        if thing.kind is not CUT or not thing.anchors or len(thing.about) != 2:
            continue
        t, frame, span = thing.number, thing.about[1], thing.span
        left = symbol(AnchorCoordinate(t, 0, 0)), symbol(AnchorCoordinate(t, 0, 1))
        right = symbol(AnchorCoordinate(frame, 0, 0)), symbol(AnchorCoordinate(frame, 0, 1))
        key = f"{thing.name}.{thing.anchors[0].name}"
        ref = AnchorRef(t, 0)
        yield Constraint(number, 0, Relation.EQUAL, key, left, right, span, thing.name_span, anchor=ref)
        angles = (symbol(ThingAngle(t)),), (symbol(ThingAngle(frame)),)
        yield Constraint(number + 1, 0, Relation.EQUAL, f"{thing.name}.angle", *angles, span, thing.name_span)
        number += 2


# --- what is wrong


def _in_order(definition: Definition, table: ThingTable, findings: Findings) -> bool:
    """Whether it reads `.cut Tool .in Thing`."""
    parts = definition.parts
    places = [k for k, part in enumerate(parts) if isinstance(part, Reference)]
    said = [k for k, part in enumerate(parts) if isinstance(part, Option) and part.name == "in"]
    if len(places) == 2 and len(said) == 1 and places[0] < said[0] < places[1]:
        return True
    if not definition.parts and findings.errors:
        return False
    names = _things_named(definition)
    bodies = [each.name for each in table.things if each.is_body and each.kind is not CUT and each.name not in names]
    tool, frame = [*names[:2], *bodies, "Roller", "Shaft"][:2]
    fix: str | Fix = f"write `{definition.name} : .cut {tool} .in {frame};`"
    if len(places) == 2 and not said:
        fix = insertion(f"write `.cut {tool} .in {frame}`", parts[places[1]].span.start, ".in ")
    elif len(places) == 1 and len(parts) == 1:
        fix = insertion(f"name what it is cut in: `.in {frame}`", parts[0].span.end, f" .in {frame}")
    elif len(places) == 1 and len(parts) == 2 and len(said) == 1 and places[0] < said[0]:
        fix = insertion(f"name what it is cut in: `.in {frame}`", parts[1].span.end, f" {frame}")
    message = f"`{definition.name}` does not say what cuts, and in what"
    findings.error("cut/shape", message, definition.name_span, helps=(fix,))
    return False


def _report_tool(tool: Thing, definition: Definition, findings: Findings) -> None:
    what = "a picture" if tool.kind.word == "sprite" else tool.called
    helps = ("cut with a `.disc`, a `.bar`, a `.polygon` or a `.curve` that moves with it",)
    message = f"`{tool.name}` is {what}, which has no outline to cut with"
    span = next(part.span for part in definition.parts if isinstance(part, Reference))
    findings.error("contact/outline", message, span, helps=helps)


def _report_fault(definition: Definition, profile: CutProfile | None, findings: Findings) -> None:
    if profile is not None and profile.lost:
        if not findings.errors:
            for item in profile.lost:
                findings.add(item)
        return
    if profile is None and findings.errors:
        return
    fault = profile.fault if profile is not None else "the film is not solved here"
    helps = ("state how the tool and what it cuts move, without the profile itself",)
    findings.error("cut/nothing", f"`{definition.name}` has no profile: {fault}", definition.name_span, helps=helps)


def _undercut(
    thing: Thing, tool: Thing, frame: Thing, profile: CutProfile, span: Span, definitions: Sequence[Definition]
) -> Diagnostic:
    """The profile crosses itself."""
    from movimentum.scene.outlines import Circle, outline_of

    assert profile.time is not None
    where = "" if profile.place is None else f" at [{profile.place[0]:.4g}, {profile.place[1]:.4g}] as drawn"
    outline = outline_of(tool)
    size = f", of radius {outline.radius:g}," if isinstance(outline, Circle) else ""
    message = f"`{tool.name}`{size} undercuts `{thing.name}`, which crosses itself{where}: from t = "
    warning = Diagnostic("contact/undercut", Severity.WARNING, f"{message}{profile.time:.4g} on", span)
    note = "a part of the profile is cut away there, so a follower cannot move like the tool"
    warning = replace(warning, notes=(note,))
    if profile.radius is not None:
        number = f"{profile.radius:.4g}"
        title = f"a radius of {number} or less would do"
        made = next(each for each in definitions if each.name == tool.name).shape.arguments
        return warning.advised(replacement(title, made[0].span, number) if made else title)
    if profile.farther is not None:
        return warning.advised(f"move `{tool.name}` away from `{frame.name}` by {profile.farther:.4g} px")
    return warning.advised(f"a smaller tool would do, or one that stays farther away from `{frame.name}`")
