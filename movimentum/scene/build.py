"""Tree to Scene: names and kinds resolved, vectors lowered, constraints with their keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import count

from movimentum.cancellation import look
from movimentum.diagnostics import Diagnostic, Fix, Label, insertion, real, replacement, the_first
from movimentum.errors import ScriptError, script_error
from movimentum.expressions import Expr
from movimentum.records import replace
from movimentum.scene.claims import build_claims, reading_outlines, report_undetermined
from movimentum.scene.configuration import MAX_PIXELS, build_config, build_loop
from movimentum.scene.cutting import Carve, CutProfile, carried, carved
from movimentum.scene.expansion.expand import expand
from movimentum.scene.expansion.includes import ReadText
from movimentum.scene.expansion.product import Expanded
from movimentum.scene.expansion.table_files import ReadTable
from movimentum.scene.findings import Findings
from movimentum.scene.joints import attached, fixed, joined, mentioned_in, variables_of
from movimentum.scene.keys import key_text
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.labels import build_texts, build_views
from movimentum.scene.looks import Stated, dressed, says_nothing, supports
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import (
    AnchorRef,
    Claim,
    Config,
    Constraint,
    Ending,
    Relation,
    Scene,
    Step,
)
from movimentum.scene.pairs import without_word
from movimentum.scene.pushing import manner_of, mannered, report_both_kinds
from movimentum.scene.reductions import at_one_time
from movimentum.scene.resolve import (
    UNPAINTED,
    PropertyUse,
    ResolvedStatement,
    ThingTable,
    resolve,
)
from movimentum.scene.themes import THEMES, Theme
from movimentum.scene.things import Assets, ElementPlace, ImageSize, build_things
from movimentum.scene.touching import follows_contact, gap_side, pin_of
from movimentum.scene.transitions import judge_transition
from movimentum.source import SourceText, folder
from movimentum.syntax.expression_tree import EXTREMES, Blank, Comparison, postorder
from movimentum.syntax.tree import ClaimStatement, Purpose, ScriptTree, Statement
from movimentum.things.kinds.skeleton import SKELETON


def build(
    script: ScriptTree,
    source: SourceText,
    image_size: ImageSize,
    *,
    max_pixels: int = MAX_PIXELS,
    read_text: ReadText | None = None,
    settings: Mapping[str, str | Expr] | None = None,
    added: Sequence[tuple[int, Statement | ClaimStatement]] = (),
    element: ElementPlace | None = None,
    read_table: ReadTable | None = None,
    carve: Carve | None = None,
) -> Scene:
    """The scene that ``script`` describes; its warnings are in ``Scene.diagnostics``.

    ``image_size`` gives the (width, height) of an image by its path: the path in the script, joined to the script's
    folder; ``read_text`` likewise the text of an included file, ``element`` the centre of an element of an SVG, and
    ``read_table`` a table. ``carve`` solves the film for what is cut in it. ``settings``: constant expressions by name,
    which take the place of the script's own constants. ``added``: more statements for steps, by number, at places of
    their own. Raises ScriptError with all errors of the script (and its warnings) at once, and UsageError for a wrong
    setting.
    """
    findings = Findings(source)
    expanded = expand(script, source, findings, read_text or _no_files, settings or {}, added, read_table)
    findings.source = expanded.source

    def finished(part: Expanded, profiles: Mapping[str, CutProfile], findings: Findings) -> Scene:
        config = build_config(list(part.configs), max_pixels, read_text or _no_files, findings)
        assets = Assets(
            folder(source), image_size, element, read_table=read_table, tables=part.tables, profiles=profiles
        )
        return _scene(script, part, config, assets, tuple((settings or {}).items()), findings)

    profiles = carved(expanded, finished, carve, findings)
    return finished(expanded, profiles, findings)


def _scene(
    script: ScriptTree,
    expanded: Expanded,
    config: Config,
    assets: Assets,
    settings: tuple[tuple[str, str | Expr], ...],
    findings: Findings,
) -> Scene:
    """The scene of a script that is written out."""
    table, options = build_things(expanded.definitions, expanded.placements, assets, findings)
    times = [step.time for step in expanded.steps]
    loop = build_loop(expanded, findings)
    inference, sound = _kinds(list(_all_resolved(expanded, table, findings)), findings)
    stated = [each for each in sound if isinstance(each.statement, Statement)]
    claimed = [each for each in sound if isinstance(each.statement, ClaimStatement)]
    report_undetermined(stated, claimed, findings)
    things, statements, claims, views = table.things, [], [], ()
    if inference:
        names, start = tuple(variables_of(stated, inference)), times[0] if times else Fraction(0)
        things = build_texts(table, expanded.definitions, inference, names, start, findings)
        statements = _statements(stated, times, inference, table, findings)
        statements += carried(things, len(statements))
        claims = build_claims(claimed, times, inference, table, findings, reading_outlines(stated))
        views = build_views(expanded, table, inference, names, findings)
    _report_no_step(script, expanded, findings)
    found = [real(item, expanded.source) for item in sorted(findings.items, key=_place)]
    if findings.errors or inference is None:
        raise ScriptError(the_first(found))
    scene = Scene(
        source=expanded.source,
        config=config,
        things=things,
        variables=variables_of(stated, inference),
        steps=_steps(expanded, statements, claims),
        diagnostics=tuple(found),
        mentioned=mentioned_in(stated, things),
        constants=expanded.constants,
        settings=settings,
        loop=loop,
        elements=assets.elements,
        tables=expanded.tables,
        views=views,
        changing=_properties(stated),
        profiles=dict(assets.profiles),
    )
    return _in_theme(scene, options, config.style or _automatic_theme(expanded, scene))


def _automatic_theme(expanded: Expanded, scene: Scene) -> Theme | None:
    painted = any(name not in UNPAINTED for _, name in scene.changing)
    return THEMES["textbook"] if says_nothing(expanded.definitions, scene.config, painted) else None


def _properties(stated: Sequence[ResolvedStatement]) -> frozenset[tuple[int, str]]:
    uses = (use for resolved in stated for use in resolved.meanings.values())
    return frozenset((use.thing, use.name) for use in uses if isinstance(use, PropertyUse))


def _place(item: Diagnostic) -> int:
    return item.span.start if item.span else -1


def _steps(
    expanded: Expanded, statements: Sequence[Constraint | Ending], claims: Sequence[Claim | Ending]
) -> tuple[Step, ...]:
    """The steps with what they state and claim, in the order written."""
    stated: list[list[Constraint | Ending]] = [[] for _ in expanded.steps]
    claimed: list[list[Claim | Ending]] = [[] for _ in expanded.steps]
    aimed: list[list[Claim | Ending]] = [[] for _ in expanded.steps]
    for item in statements:
        stated[item.step].append(item)
    for item in claims:
        (claimed if item.purpose is Purpose.CLAIM else aimed)[item.step].append(item)
    return tuple(
        Step(number, step.time, step.span, tuple(stated[number]), tuple(claimed[number]), tuple(aimed[number]))
        for number, step in enumerate(expanded.steps)
    )


def _in_theme(scene: Scene, options: Sequence[Stated], theme: Theme | None) -> Scene:
    """The scene with its joints, and in its theme, if it has one."""
    skeletons = tuple(thing.number for thing in scene.things if thing.kind is SKELETON)
    if theme is None and not skeletons and not any(t.look.pins is not None or t.look.fixed for t in scene.things):
        return scene
    joints: dict[int, set[int]] = {}
    for ref in joined(scene.steps) | attached(scene.things):
        joints.setdefault(ref.thing, set()).add(ref.anchor)
    joined_anchors = {thing: frozenset(anchors) for thing, anchors in joints.items()}
    scene = replace(scene, joints=joined_anchors, skeletons=skeletons)
    if theme is None:
        grounds = supports(scene.things, fixed(scene.steps, scene.mentioned)) if skeletons else ()
        return replace(scene, grounds=grounds)
    config = scene.config
    things = dressed(scene.things, options, theme, joints)
    return replace(
        scene,
        config=replace(config, background=config.background or theme.background, style=theme),
        things=things,
        grounds=supports(things, fixed(scene.steps, scene.mentioned)),
    )


def _no_files(path: str) -> SourceText:
    raise script_error("asset/missing", f"files cannot be included here: {path}")


# --- steps ----------------------------------------------------------------------------------------


def _all_resolved(expanded: Expanded, table: ThingTable, findings: Findings) -> Iterator[ResolvedStatement]:
    """The statements whose names are all known."""
    if expanded.early is not None and expanded.steps:
        first = expanded.early.span
        findings.error(
            "timeline/before-first-step",
            "this statement comes before the first step",
            first,
            labels=(Label(expanded.steps[0].span, "the first step begins here"),),
            helps=(insertion("write `@0` before it", first.start, "@0 "),),
        )
    for item in expanded.statements:
        resolved = _resolved(item.statement, item.step, table, findings)
        if resolved is not None:
            yield replace(resolved, step_end=item.until)


def _report_no_step(script: ScriptTree, expanded: Expanded, findings: Findings) -> None:
    if expanded.steps:
        return
    first = next((item.statement for item in expanded.statements if isinstance(item.statement, Statement)), None)
    findings.error(
        "timeline/no-step",
        "the script has no step, so there is no moment to show",
        first.span if first else None,
        helps=(
            insertion("write `@0` before the statements", first.span.start, "@0 ")
            if first
            else insertion("add a step: `@0` shows the things as drawn", *_at_the_end(script, findings.source)),
        ),
    )


def _at_the_end(script: ScriptTree, source: SourceText) -> tuple[int, str]:
    """Where the first step goes in a script of definitions, and its text."""
    end = max((item.span.end for item in script.items), default=0)
    return end, (source.newline if end else "") + "@0" + ("" if end else source.newline)


# --- statements -----------------------------------------------------------------------------------


def _resolved(
    statement: Statement | ClaimStatement, step: int, table: ThingTable, findings: Findings
) -> ResolvedStatement | None:
    look()
    first, second, worded = without_word(statement)
    statement = replace(statement, left=first, right=second)
    if isinstance(statement, ClaimStatement):
        statement = at_one_time(statement)
    left = tuple(postorder(statement.left))
    ends = isinstance(statement.right, Blank)
    right = None if ends else tuple(postorder(statement.right))
    sign = statement.comparison if isinstance(statement, Statement) else None
    meanings = resolve(left if right is None else (*left, *right), table, findings, worded=worded, sign=sign)
    return None if meanings is None else ResolvedStatement(step, statement, left, right, meanings)


def _kinds(items: list[ResolvedStatement], findings: Findings) -> tuple[Inference | None, list[ResolvedStatement]]:
    """The kinds of all expressions, and the statements without errors."""
    inference = Inference(findings)
    sound: list[ResolvedStatement] = []
    for resolved in items:
        look()
        errors = findings.errors
        statement = resolved.statement
        inference.expression(resolved.left, resolved.meanings)
        if resolved.right is not None:
            inference.expression(resolved.right, resolved.meanings)
            if findings.errors == errors:
                sign = statement.comparison
                message = f"the two sides of `{sign}` are a scalar and a vector"
                if sign in EXTREMES:
                    message = f"a goal is `{sign}` of a scalar, and this is a vector: its `.l`, `.x` or `.y`?"
                inference.equate(statement.left, statement.right, message)
        if findings.errors == errors and statement.comparison not in (Comparison.EQUAL, Comparison.WISH):
            message = f"`{statement.comparison}` compares scalars, not vectors"
            inference.require(statement.left, Kind.SCALAR, message)
        if findings.errors == errors:
            judge_transition(resolved, findings)
        if findings.errors == errors:
            sound.append(resolved)
    errors = findings.errors
    inference.finish()
    return (inference if findings.errors == errors else None), sound


def _statements(
    items: list[ResolvedStatement],
    times: Sequence[Fraction],
    inference: Inference,
    table: ThingTable,
    findings: Findings,
) -> list[Constraint | Ending]:
    made: list[Constraint | Ending] = []
    blanks, numbers = count(), count()
    stated: set[tuple[str, Relation]] = set()
    for resolved in items:
        look()
        statement = resolved.statement
        assert isinstance(statement, Statement)
        relation = resolved.relation
        key = key_text(statement.left, resolved.meanings, table)
        if resolved.right is None:
            if (key, relation) not in stated:
                _warn_nothing_to_end(statement, key, relation, stated, findings)
            made.append(Ending(resolved.step, relation, key, statement.span))
            continue
        manner = manner_of(statement, findings)
        lowered = _constraint(resolved, times or (Fraction(0),), key, next(numbers), inference, table, blanks, findings)
        made.extend(mannered(constraint, manner, findings) for constraint in lowered)
        stated.add((key, relation))
    report_both_kinds(made, findings)
    return made


def _constraint(
    resolved: ResolvedStatement,
    times: Sequence[Fraction],
    key: str,
    number: int,
    inference: Inference,
    table: ThingTable,
    blanks: Iterator[int],
    findings: Findings,
) -> Iterator[Constraint]:
    """The constraint, or nothing after an error."""
    statement = resolved.statement
    time = times[min(resolved.step, len(times) - 1)]
    context = Context(inference, findings, blanks, time, number, resolved.step_end, table.things, stored_from=times[0])
    left = lower(resolved.left, resolved.meanings, context)
    right = lower(resolved.right or (), resolved.meanings, context)
    if left is None or right is None:
        return
    anchor = resolved.meanings.get(id(statement.left))
    constraint = Constraint(
        number=number,
        step=resolved.step,
        relation=resolved.relation,
        key=key,
        left=left,
        right=right,
        span=statement.span,
        left_span=statement.left.span,
        touches=resolved.relation is Relation.EQUAL and follows_contact(resolved),
        anchor=anchor if isinstance(anchor, AnchorRef) else None,
        strict=resolved.strict,
        pin=pin_of(resolved, left[0], right[0]),
        gap_side=gap_side(resolved),
    )
    pushes = isinstance(statement, Statement) and statement.option("pushes") is not None
    if pushes:
        from movimentum.scene.solid import solidified  # few scripts need that module

        constraint = solidified(constraint, resolved, context)
    yield constraint


def _warn_nothing_to_end(
    statement: Statement, key: str, relation: Relation, stated: set[tuple[str, Relation]], findings: Findings
) -> None:
    others = [item.value for item in Relation if (key, item) in stated]
    helps: tuple[Fix, ...] = ()
    if others:
        ending = f"{key} {others[0]} _"
        helps = (replacement(f"`{ending};` ends what is stated", statement.span, ending),)
    else:
        guess = findings.nearest(key, (name for name, other in stated if other is relation))
        if guess:
            ending = f"{guess} {relation} _"
            helps = (replacement(f"did you mean `{ending};`?", statement.span, ending),)
    findings.warning(
        "timeline/nothing-to-end",
        f"nothing is stated under `{key} {relation}`, so nothing can end here",
        statement.span,
        helps=helps,
    )
