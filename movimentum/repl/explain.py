"""Commands about how the scene is solved, and its alternatives."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from movimentum import messages, tolerances
from movimentum.diagnostics import Fix
from movimentum.errors import UsageError
from movimentum.output.files import whole_file
from movimentum.records import replace
from movimentum.repl.causes import why_not
from movimentum.repl.expressions import at_the_prompt, query
from movimentum.repl.session import Answer, AnswerWithData, CommandTable, Session, plain, refused, split_output, table
from movimentum.scene.text_edits import in_script, turned_round, written_once
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.text import counted, number, time_text

COMMANDS = CommandTable()

PROOF_S = 10.0
"""The time for a proof and for the equation of a curve."""
PATIENCE_S = 1.4
"""The time for finding a formula: the user waits two seconds in all."""
LONG = 40
"""Operations of a formula that is shown in short named steps."""
MOST_STEPS = 80


@COMMANDS.add("why NAME | why not CONDITION")
def why(session: Session, argument: str) -> Answer:
    """the constraints that determine a thing, an anchor or a variable, in their order; or what forbids a value now"""
    if argument.split(None, 1)[:1] == ["not"]:
        return why_not(session, argument.split(None, 1)[1] if len(argument.split()) > 1 else "")
    text = _name(argument, "why Rod.B")
    thing = session.thing(text)
    if thing is not None and not thing.anchors:
        raise refused("name", f"`{text}` has no anchors, so nothing can be said about where it is")
    with at_the_prompt(session, text):
        found = session.causes(text)
    lines = [
        f"{place:3}. line {cause.line}: `{cause.text}`{' is rigid' if cause.rigid else ''}"
        for place, cause in enumerate(found.chain, 1)
    ]
    for block, names in found.free:
        members = ", ".join(names[:6])
        lines.append(f"     not determined by that alone: block {block} ({members}) leaves free motion, which is least")
    lines += [f"     `{name}` stays as drawn: nothing in this step says otherwise" for name in found.drawn]
    return session, AnswerWithData("\n".join(lines) or f"nothing in this step says anything about `{text}`", found)


@COMMANDS.add("formula NAME")
def formula(session: Session, argument: str) -> Answer:
    """its closed form, plain and as LaTeX, or what prevents one"""
    from movimentum.analysis.interactive.formula import UNREASONABLE, Obstacle
    from movimentum.equations.stage_maker import shared_steps

    text = _name(argument, "formula Rod.B")
    with at_the_prompt(session, text):
        formulas = session.formulas(text, session.patience * PATIENCE_S)
    import sympy

    lines: list[str] = []
    for label, found in formulas:
        if isinstance(found, Obstacle) and found.words == UNREASONABLE:
            with at_the_prompt(session, text):
                steps = session.named_steps(label, session.patience * PATIENCE_S)
            lines += _steps(steps) if 0 < len(steps) <= MOST_STEPS else [f"{label} has {found.words}"]
        elif isinstance(found, Obstacle):
            lines.append(f"{label} has no closed form: {found.words}")
        else:
            steps = shared_steps(label, found) if _is_long(found) else [(label, found)]
            lines += [*_steps(steps), f"  {sympy.latex(found)}"]
    since = time_text(float(session.segment_motion.segment.start))
    lines.append(f"(.t counts from {since}, where this step begins)")
    return session, AnswerWithData("\n".join(lines), {label: str(found) for label, found in formulas})


@COMMANDS.add("prove CLAIM")
def prove(session: Session, argument: str) -> Answer:
    """whether a claim, `prove Rod.B.x = 120`, holds in every position of the mechanism, not only in the film"""
    from movimentum.workflow.prove import proof

    text = argument.strip()
    if not text:
        raise refused("argument", "`prove` needs a claim", "prove Rod.B.x = 120")
    with at_the_prompt(session, text):
        found = proof(session, text, PROOF_S)
    if found is None:
        raise refused("expression", f"`{text}` is not a single claim", "prove Rod.B.x = 120")
    lines = [found.verdict.value, *(f"  if {condition}" for condition in found.conditions)]
    lines += [f"  {found.why}"] if found.why else []
    spots = [f"{name} = [{number(x)}, {number(y)}]" for name, (x, y) in found.counterexample.items()]
    lines += [f"  for instance where {', '.join(spots)}"] if spots else []
    data = {
        "verdict": found.verdict.value,
        "conditions": list(found.conditions),
        "why": found.why,
        "counterexample": {name: list(spot) for name, spot in found.counterexample.items()},
    }
    return session, AnswerWithData("\n".join(lines), data)


@COMMANDS.add("curve THING.ANCHOR")
def curve(session: Session, argument: str) -> Answer:
    """the equation of the path of a point, for all positions of the mechanism"""
    from movimentum.workflow.curve import curve as found_curve

    text = _name(argument, "curve Rod.B")
    with at_the_prompt(session, text):
        found = found_curve(session.work.source, session.work.engine.choices, text, PROOF_S)
    equation = str(found.equation)
    words = f"degree {found.degree}\n{equation} = 0"
    return session, AnswerWithData(words, {"degree": found.degree, "equation": equation})


def _is_long(found: Any) -> bool:
    return int(found.count_ops()) > LONG


def _steps(steps: list[tuple[str, Any]]) -> list[str]:
    """Each step on a line of its own."""
    import sympy

    from movimentum.analysis.interactive.spelling import in_language

    return [
        f"{name} = {in_language(value) or f'{sympy.sstr(value, full_prec=False)} (in words of SymPy)'}"
        for name, value in steps
    ]


@COMMANDS.add("explain [CODE]")
def explain(session: Session, argument: str) -> Answer:
    """what a message code means and what to do, with an example; without CODE, the codes of the script's messages"""
    if argument.strip():
        found = messages.find(argument)
        if not found:
            raise UsageError([messages.unknown(argument.strip(), "explain")])
        return session, "\n\n\n".join(each.text for each in found)
    codes = dict.fromkeys(diagnostic.code for diagnostic in session.advice)
    found = [each for code in codes for each in messages.find(code)]
    if not found:
        return session, "the script has no messages; `explain CODE` explains any code, such as `explain wish/blocked`"
    return session, table([[each.code, each.summary] for each in found])


def _name(argument: str, example: str) -> str:
    text = argument.strip()
    if not text:
        raise refused("argument", f"`{example.split()[0]}` needs a thing, an anchor or a variable", example)
    return text


@COMMANDS.add("free [--matrix [NAME | --vertices]]")
def free(session: Session, argument: str) -> Answer:
    """what can still move, and what would stop it; or the matrix behind it"""
    word, _, name = argument.strip().partition(" ")
    if word == "--matrix":
        return session, _matrices(session, name.strip())
    if word:
        raise refused("argument", f"`free` takes `--matrix` or nothing, found `{argument.strip()}`", "free --matrix")
    from movimentum.analysis.freedom.motions import remedy

    _ = session.piece  # what has no pose cannot be asked how it moves
    found = session.freedom()
    if not found:
        return session, "nothing can move in a way that is not determined"
    lines = [
        f"{n}. {motion.words}{' (a wish says where it goes)' if motion.drawn else ''}\n   {remedy(motion, statement)}"
        for n, (motion, statement) in enumerate(found, 1)
    ]
    suggestions = tuple(statement for _, statement in found if statement is not None)
    lines += [f"apply {n}: {text}" for n, text in enumerate(suggestions, 1)]
    return replace(session, suggestions=suggestions), "\n".join(lines)


def _matrices(session: Session, name: str) -> str:
    """The matrix of every connected part, or of the part with the thing or variable ``name``; with ``--vertices``, of
    the linkage that the scene is.
    """
    from movimentum.analysis.interactive.matrix import part_matrices
    from movimentum.repl.matrix import part_text, units_text, vertices_text

    if name == "--vertices":
        return vertices_text(session)
    piece, tau = session.piece
    parts = part_matrices(session.segment_motion, piece, tau)
    if not parts:
        return "nothing is stated at this moment, so there is no matrix"
    if name:
        thing = next((t.number for t in session.work.scene.things if t.name == name), None)
        parts = [part for part in parts if thing in part.things or name in part.columns]
        if not parts:
            raise refused("name", f"no equation at this moment has anything to do with `{name}`", "free --matrix")
    return "\n\n".join([units_text(session), *(part_text(session, part) for part in parts)])


@COMMANDS.add("wiggle FILE.gif")
def wiggle(session: Session, argument: str) -> Answer:
    """a film of each free motion back and forth, in turn"""
    from movimentum.analysis.interactive.branches import free_swings

    name = argument.strip().removeprefix("-o").strip()
    if not name.lower().endswith((".gif", ".apng", ".webp")):
        raise refused("file", "`wiggle` writes a film", "wiggle free.gif")
    piece, tau = session.piece
    found = list(free_swings(session.segment_motion, piece, tau))
    if not found:
        return session, "nothing can move in a way that is not determined"
    _write_film(session, [moment for _, moments in found for moment in moments], session.refuse_overwriting(name))
    return session, "\n".join([*(f"{n}. {motion.words}" for n, (motion, _) in enumerate(found, 1)), f"wrote {name}"])


def _write_film(session: Session, moments: Sequence[Snapshot], path: Path) -> None:
    """The scene in each of ``moments``, one after the other, as a film in the format that the suffix names."""
    from movimentum.encoding.write import write_animation
    from movimentum.rendering.painter import make_painter

    poses = session.poses_of(moments)
    painter = make_painter(session.work.scene, (poses,))
    write_animation(painter, (poses,), path, fps=Fraction(20), workers=1)


@COMMANDS.add("drag A.P to [x,y] [-o FILE.gif]")
def drag(session: Session, argument: str) -> Answer:
    """pull it at this moment, and see what moves with it"""
    from movimentum.analysis.interactive.drag import DragResult
    from movimentum.analysis.interactive.drag import drag as pull

    rest, target = split_output(argument, (".gif", ".apng", ".webp"))
    match = re.fullmatch(r"\s*(.+?)\s+to\s+(.+?)\s*;?\s*", rest, re.DOTALL)
    if match is None:
        raise refused(
            "argument", "say what to drag where", "drag Rod.B to [300, 200]", "drag Rod.B to [300, 200] -o drag.gif"
        )
    left, goal = match[1], match[2]
    with at_the_prompt(session, left):
        expressions = session.expressions(left)
    values = query(session, goal).values(session.poses())[0]
    if len(values) != len(expressions):
        raise refused("kind", f"`{left}` and `{goal}` are a scalar and a vector", "drag Rod.B to [300, 200]")
    piece, tau = session.piece
    try:
        found = pull(session.segment_motion, piece, tau, expressions, [float(v) for v in values])
    except ValueError as error:
        raise refused("name", f"nothing says anything about `{error}` at this moment") from error
    off = number(found.off)
    if found.outcome is DragResult.FIXED:
        return (
            session,
            f"`{left}` is determined, and cannot be dragged; it is {off} from there (`why {left}` says more)",
        )
    words = {
        DragResult.REACHED: f"`{left}` gets there",
        DragResult.BLOCKED: f"`{left}` comes no nearer than {off}: the statements hold it back",
        DragResult.SINGULAR: f"`{left}` is stuck {off} from there: in this pose no velocity brings it nearer",
    }
    lines = [words[found.outcome], *_displaced(session, found.moments)]
    suggestion = f"{left} ~ {goal};"
    lines.append(f"apply 1: {suggestion}")
    if target is not None:
        _write_film(session, found.moments, session.refuse_overwriting(target))
        lines.append(f"wrote {target}")
    return replace(session, suggestions=(suggestion,)), "\n".join(lines)


def _displaced(session: Session, moments: Sequence[Snapshot]) -> list[str]:
    """How far and how much everything has moved, farthest first."""
    first, last = moments[0], moments[-1]
    rows: list[tuple[float, str]] = []
    for thing in session.work.scene.things:
        a, b = first.things[thing.number], last.things[thing.number]
        way = max((b.far_from(a, *anchor.local) for anchor in thing.anchors), default=0.0)
        if way > tolerances.DISPLACED * session.work.motion.size:
            turned = math.degrees(b.turned_from(a))
            rows.append((way, f"   `{thing.name}` moves {number(way)} and turns {number(turned)} degrees"))
    rows.sort(key=lambda row: -row[0])
    return [text for _, text in rows[:8]] + ([f"   and {len(rows) - 8} more"] if len(rows) > 8 else [])


@COMMANDS.add("solutions [-o FILE.png]")
def solutions(session: Session, argument: str) -> Answer:
    """every solution at this moment, and what selects it"""
    rest, target = split_output(argument, (".png",))
    plain(rest, "solutions")
    found = session.solutions()
    if not found:
        return session, AnswerWithData("there is one solution only at this moment", found)
    scene = session.work.scene
    lines: list[str] = [f"{session.no_pose}; without the inequalities that reject them:"] if session.no_pose else []
    suggestions: list[str | Fix] = []

    def suggest(what: str | Fix) -> None:
        suggestions.append(what)
        lines.append(f"      apply {len(suggestions)}: {what.title if isinstance(what, Fix) else what}")

    for part in found:
        names = ", ".join(f"`{scene.things[t].name}`" for t in part.things)
        more = "" if part.complete else ", found by a search: there may be more"
        many = counted(len(part.solutions) + len(part.rejected), "solution")
        down = f", {len(part.rejected)} of them rejected" if part.rejected else ""
        lines.append(f"{many} for {names or 'what is not drawn'}{down}{more}")
        for n, solution in enumerate(part.solutions, 1):
            lines.append(f"{'->' if solution.current else '  '} {n}. {solution.words}")
            if solution.selects is not None:
                suggest(solution.selects)
        for n, other in enumerate(part.rejected, len(part.solutions) + 1):
            lines.append(f"   {n}. {other.words}")
            for reason in other.by:
                line, text = session.statement(reason.constraint)
                lines.append(f"      rejected by line {line}: `{text}`, by {number(reason.by)}")
                if (fix := _other_side(session, reason.constraint)) is not None:
                    suggest(fix)
    if target is not None:
        from movimentum.rendering.sheet import write_thumbnails

        poses = session.poses_of([solution.pose for part in found for solution in (*part.solutions, *part.rejected)])
        with whole_file(session.refuse_overwriting(target)) as part_file:
            write_thumbnails(scene, poses, part_file)
        lines.append(f"wrote {target}")
    return replace(session, suggestions=tuple(suggestions)), AnswerWithData("\n".join(lines), found)


def _other_side(session: Session, constraint: int) -> Fix | None:
    """An inequality of the script with its sign the other way round."""
    scene = session.work.scene
    item = next(item for item in scene.constraints() if item.number == constraint)
    edit = turned_round(scene, item)
    if edit is None or not written_once(scene, item.span) or (edit := in_script(scene, edit)) is None:
        return None
    _, text = session.statement(constraint)
    other = {"<": ">", ">": "<"}[item.relation]
    return Fix(f"`{text.replace(item.relation, other, 1)}` instead", (edit,))


@COMMANDS.add("branch")
def branch(session: Session, argument: str) -> Answer:
    """how close the solver's choices were over the whole film"""
    plain(argument, "branch")
    from movimentum.analysis.interactive.branches import branches

    rows = [["", "finds", "least singular value", "at t", "nearest rival, px", "at t"]]
    for found in branches(session.work.motion):
        rival = "not followed" if found.rival is None else number(found.rival)
        rows.append(
            [
                "close" if found.close else "",
                ", ".join(found.unknowns[:4]) + (", …" if len(found.unknowns) > 4 else ""),
                number(found.singular),
                time_text(round(found.singular_time, 9)),
                rival,
                time_text(round(found.rival_time, 9)),
            ]
        )
    if len(rows) == 1:
        return session, "nothing that moves has more than one solution"
    return session, table(rows)
