"""Tree to Scene: names and kinds resolved, vectors lowered, constraints with their keys."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import count

from movimentum.diagnostics import Fix, Label, insertion, replacement, the_first
from movimentum.errors import ScriptError
from movimentum.scene.claims import build_claims, report_undetermined
from movimentum.scene.configuration import MAX_PIXELS, build_config
from movimentum.scene.constants import exact
from movimentum.scene.drafts import Draft
from movimentum.scene.findings import Findings
from movimentum.scene.keys import key_text
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.labels import build_texts
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import (
    AnchorRef,
    Constraint,
    Ending,
    Relation,
    Scene,
    Step,
    Variable,
)
from movimentum.scene.resolve import (
    AngleUse,
    PropertyUse,
    ThingTable,
    VariableUse,
    resolve,
)
from movimentum.scene.silence import is_silent
from movimentum.scene.things import Assets, ElementPlace, ImageSize, build_things
from movimentum.source import SourceText, Span
from movimentum.syntax.tree import (
    Blank,
    ClaimStatement,
    Comparison,
    ConfigStatement,
    Definition,
    Name,
    ScriptTree,
    Statement,
    StepHeader,
    postorder,
)


def build(
    script: ScriptTree,
    source: SourceText,
    image_size: ImageSize,
    *,
    max_pixels: int = MAX_PIXELS,
    element: ElementPlace | None = None,
) -> Scene:
    """The scene that ``script`` describes; its warnings are in ``Scene.diagnostics``.

    ``image_size`` gives the (width, height) of an image by its path: the path in the script, joined to the script's
    folder. ``element`` gives the centre of an element of an SVG in the same way.

    Raises ScriptError with all errors of the script (and its warnings) at once.
    """
    findings = Findings(source)
    config = build_config([item for item in script.items if isinstance(item, ConfigStatement)], max_pixels, findings)
    definitions = [item for item in script.items if isinstance(item, Definition)]
    assets = Assets(_folder(source), image_size, element)
    things, table = build_things(definitions, assets, findings)
    times, spans, drafts = _steps(script, table, findings)
    inference, sound = _kinds(drafts, findings)
    stated = [draft for draft in sound if isinstance(draft.statement, Statement)]
    claimed = [draft for draft in sound if isinstance(draft.statement, ClaimStatement)]
    report_undetermined(stated, claimed, findings)
    if inference:
        start = times[0] if times else Fraction(0)
        names = tuple(_variables(stated, inference))
        things = build_texts(things, definitions, inference, names, table, start, findings)
    statements = _statements(stated, times, inference, table, findings) if inference else []
    claims = build_claims(claimed, times, inference, table, findings) if inference else []
    if not spans:
        _report_no_step(script, findings)
    findings.items.sort(key=lambda item: item.span.start if item.span else -1)
    if findings.errors:
        raise ScriptError(the_first(findings.items))
    assert inference is not None
    by_step: list[list[Constraint | Ending]] = [[] for _ in times]
    for item in statements:
        by_step[item.step].append(item)
    steps = tuple(
        Step(number, time, span, tuple(by_step[number]), tuple(claim for claim in claims if claim.step == number))
        for number, (time, span) in enumerate(zip(times, spans, strict=True))
    )
    mentioned = _mentioned(stated)
    pinned = any(thing.look.pins is not None or thing.look.fixed for thing in things)
    scene = Scene(
        source=source,
        config=config,
        things=things,
        variables=_variables(stated, inference),
        steps=steps,
        diagnostics=tuple(findings.items),
        mentioned=mentioned,
        elements=assets.elements,
    )
    painted = any(isinstance(use, PropertyUse) for draft in stated for use in draft.meanings.values())
    theme = config.theme or ("textbook" if is_silent(definitions, config, painted) else None)
    return _dressed(scene, theme) if pinned or theme else scene


def _dressed(scene: Scene, name: str | None) -> Scene:
    """The scene with its joints, and in a theme if it has one."""
    from movimentum.scene.joints import attached, fixed, joined  # most scripts of the first edition need none of it
    from movimentum.scene.themes import THEMES, dressed, supports

    scene = replace(scene, joints=joined(scene.steps) | attached(scene.things))
    if name is None:
        return scene
    theme, config = THEMES[name], scene.config
    things = dressed(scene.things, theme, scene.joints)
    return replace(
        scene,
        config=replace(config, background=config.background or theme.background, theme=name),
        things=things,
        grounds=supports(things, fixed(scene.steps, scene.mentioned)),
    )


def _folder(source: SourceText) -> str:
    return "" if source.path.startswith("<") else os.path.dirname(source.path)


# --- steps ----------------------------------------------------------------------------------------


def _steps(script: ScriptTree, table: ThingTable, findings: Findings) -> tuple[list[Fraction], list[Span], list[Draft]]:
    """Step times and spans, and the statements whose names are all known."""
    times: list[Fraction] = []
    spans: list[Span] = []
    drafts: list[Draft] = []
    early: Statement | ClaimStatement | None = None
    for item in script.items:
        if isinstance(item, StepHeader):
            times.append(_time(item, times, spans, findings))
            spans.append(item.span)
        elif isinstance(item, Statement | ClaimStatement):
            if not spans and early is None:
                early = item
            draft = _draft(item, max(len(spans) - 1, 0), table, findings)
            if draft is not None:
                drafts.append(draft)
    if early is not None and spans:
        findings.error(
            "timeline/before-first-step",
            "this statement comes before the first step",
            early.span,
            labels=(Label(spans[0], "the first step begins here"),),
            helps=(insertion("write `@0` before it", early.span.start, "@0 "),),
        )
    return times, spans, drafts


def _time(header: StepHeader, times: list[Fraction], spans: list[Span], findings: Findings) -> Fraction:
    before = times[-1] if times else None
    value = exact(header.time, "a step's time", findings)
    if value is None:
        return before or Fraction(0)
    time = (before or Fraction(0)) + value if header.relative else value
    if before is not None and time < before:
        findings.error(
            "timeline/order",
            f"this step is at {_shown(time)}, earlier than the previous step",
            header.span,
            labels=(Label(spans[-1], f"at {_shown(before)}"),),
            helps=("write the steps in the order of their times",),
        )
    return time


def _shown(time: Fraction) -> str:
    return str(time) if time.denominator == 1 and abs(time) < 10**9 else f"{float(time):.6g}"


def _report_no_step(script: ScriptTree, findings: Findings) -> None:
    first = next((item for item in script.items if isinstance(item, Statement)), None)
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


def _draft(statement: Statement | ClaimStatement, step: int, table: ThingTable, findings: Findings) -> Draft | None:
    left = tuple(postorder(statement.left))
    ends = isinstance(statement.right, Blank)
    right = None if ends else tuple(postorder(statement.right))
    meanings = resolve(left if right is None else (*left, *right), table, findings)
    return None if meanings is None else Draft(step, statement, left, right, meanings)


def _kinds(drafts: list[Draft], findings: Findings) -> tuple[Inference | None, list[Draft]]:
    """The kinds of all expressions, and the statements without errors."""
    inference = Inference(findings)
    sound: list[Draft] = []
    for draft in drafts:
        errors = findings.errors
        statement = draft.statement
        inference.expression(draft.left, draft.meanings)
        if draft.right is not None:
            inference.expression(draft.right, draft.meanings)
            if findings.errors == errors:
                sign = statement.comparison
                inference.equate(
                    statement.left, statement.right, f"the two sides of `{sign}` are a scalar and a vector"
                )
        if findings.errors == errors and statement.comparison not in (Comparison.EQUAL, Comparison.WISH):
            message = f"`{statement.comparison}` compares scalars, not vectors"
            inference.require(statement.left, Kind.SCALAR, message)
        if findings.errors == errors:
            sound.append(draft)
    errors = findings.errors
    inference.finish()
    return (inference if findings.errors == errors else None), sound


def _statements(
    drafts: list[Draft], times: Sequence[Fraction], inference: Inference, table: ThingTable, findings: Findings
) -> list[Constraint | Ending]:
    made: list[Constraint | Ending] = []
    blanks, numbers = count(), count()
    stated: set[tuple[str, Relation]] = set()
    for draft in drafts:
        statement = draft.statement
        assert isinstance(statement, Statement)
        relation = draft.relation
        key = key_text(statement.left, draft.meanings, table)
        if draft.right is None:
            if (key, relation) not in stated:
                _warn_nothing_to_end(statement, key, relation, stated, findings)
            made.append(Ending(draft.step, relation, key, statement.span))
            continue
        speed = _speed(statement, findings)
        time = times[draft.step] if times else Fraction(0)
        lowered = _constraint(draft, time, key, next(numbers), inference, blanks, findings)
        made.extend(replace(constraint, speed=speed) for constraint in lowered)
        stated.add((key, relation))
    return made


def _speed(statement: Statement, findings: Findings) -> float | None:
    """How fast a wish may be followed; None if nothing limits it."""
    if statement.speed is None:
        return None
    if statement.comparison is not Comparison.WISH:
        message = "only a wish can have a speed"
        findings.error("kind/mismatch", message, statement.speed.span, helps=("a wish is stated with `~`",))
        return None
    value = exact(statement.speed, "a wish's speed", findings)
    if value is not None and value <= 0:
        findings.error("kind/mismatch", "a wish's speed must be more than 0", statement.speed.span)
        return None
    return None if value is None else float(value)


def _constraint(
    draft: Draft,
    time: Fraction,
    key: str,
    number: int,
    inference: Inference,
    blanks: Iterator[int],
    findings: Findings,
) -> Iterator[Constraint]:
    """The constraint, or nothing after an error."""
    statement = draft.statement
    context = Context(inference, findings, blanks, time, number)
    left = lower(draft.left, draft.meanings, context)
    right = lower(draft.right or (), draft.meanings, context)
    if left is None or right is None:
        return
    anchor = draft.meanings.get(id(statement.left))
    yield Constraint(
        number=number,
        step=draft.step,
        relation=draft.relation,
        key=key,
        left=left,
        right=right,
        span=statement.span,
        left_span=statement.left.span,
        anchor=anchor if isinstance(anchor, AnchorRef) else None,
        strict=draft.strict,
    )


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


# --- what the scene needs to know of it all -------------------------------------------------------


def _variables(drafts: list[Draft], inference: Inference) -> dict[str, Variable]:
    """The variables of all constraints, in the order of their first uses."""
    found: dict[str, Variable] = {}
    for draft in drafts:
        if draft.right is None:
            continue
        for node in sorted((*draft.left, *draft.right), key=lambda item: item.span.start):
            meaning = draft.meanings.get(id(node))
            if isinstance(node, Name) and isinstance(meaning, VariableUse) and meaning.name not in found:
                vector = inference.variable_kind(meaning.name) is Kind.VECTOR
                found[meaning.name] = Variable(meaning.name, vector, node.span)
    return found


def _mentioned(drafts: list[Draft]) -> dict[int, int]:
    """Thing number -> first step with a constraint that mentions it, on either side."""
    found: dict[int, int] = {}
    for draft in drafts:
        if draft.right is not None:
            for meaning in draft.meanings.values():
                if isinstance(meaning, AnchorRef | AngleUse | PropertyUse):
                    found.setdefault(meaning.thing, draft.step)
    return found
