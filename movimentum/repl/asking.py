"""Commands that ask how the scene is solved, and what else could be."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from movimentum.analysis.words import counted, number, time_text
from movimentum.files import whole_file
from movimentum.repl.command import Answer, Command, plain, split_output, table
from movimentum.repl.reading import lowered
from movimentum.repl.session import Session, refused
from movimentum.repl.sheet import write_film, write_sheet
from movimentum.solve.stretches import Dead
from movimentum.solve.tracks import Piece


def why(session: Session, argument: str) -> Answer:
    """``why NAME``."""
    from movimentum.analysis.determination import determination

    text = _name(argument, "why Rod.B")
    scene, work = session.work.scene, session.work
    thing = next((t for t in scene.things if t.name == text), None)
    if thing is not None and not thing.anchors:
        raise refused("name", f"`{text}` has no anchors, so nothing can be said about where it is")
    asked = [thing.name + "." + a.name for a in thing.anchors] if thing is not None else [text]
    expressions = [e for name in asked for e in lowered(session, name)]
    found = determination(session.stretch.plan, expressions)
    numbers = {c.number: c for c in scene.constraints()}
    lines: list[str] = []
    for place, reason in enumerate(found.reasons, 1):
        if reason.constraint is None:
            assert reason.thing is not None
            body = scene.things[reason.thing]
            line, what = work.source.position(body.span.start).line, f"`{body.name}` is rigid"
        else:
            item = numbers[reason.constraint]
            line = work.source.position(item.span.start).line
            what = f"`{' '.join(work.source.text[item.span.start : item.span.end].split())}`"
        lines.append(f"{place:3}. line {line}: {what}")
    names = [unknown.name for unknown in session.stretch.plan.system.unknowns]
    for block in found.free:
        members = ", ".join(names[n] for n in session.stretch.plan.blocks[block].unknowns[:6])
        lines.append(f"     not determined by that alone: block {block} ({members}) leaves free motion, which is least")
    lines += [f"     `{scene.things[t].name}` stays as drawn: nothing in this step says otherwise" for t in found.drawn]
    return session, "\n".join(lines) or f"nothing in this step says anything about `{text}`"


def formula(session: Session, argument: str) -> Answer:
    """``formula NAME``."""
    from movimentum.analysis.formula import Obstacle
    from movimentum.analysis.formula import formula as closed_form

    text = _name(argument, "formula Rod.B")
    stretch = session.stretch
    tau = float(session.time - stretch.segment.start)
    expressions = lowered(session, text)
    lines: list[str] = []
    import sympy

    for label, expression in zip(
        (text,) if len(expressions) == 1 else (f"{text}.x", f"{text}.y"), expressions, strict=True
    ):
        found = closed_form(stretch, tau, expression)
        if isinstance(found, Obstacle):
            lines.append(f"{label} has no closed form: {found.words}")
        else:
            lines += [f"{label} = {sympy.sstr(found)}", f"  {sympy.latex(found)}"]
    since = time_text(float(stretch.segment.start))
    return session, "\n".join([*lines, f"(t counts from {since}, where this step begins; angles in radians inside)"])


def _name(argument: str, example: str) -> str:
    text = argument.strip()
    if not text:
        raise refused("argument", f"`{example.split()[0]}` needs a thing, an anchor or a variable", example)
    return text


def free(session: Session, argument: str) -> Answer:
    """``free``: each free motion in words, and what would stop it."""
    plain(argument, "free")
    from movimentum.analysis.freedom import block_ranks

    motions = [m for rank in block_ranks(session.stretch) for m in rank.motions]
    if not motions:
        return session, "nothing can move in a way that is not determined"
    lines = [f"{n}. {motion.words}\n   {motion.remedy}" for n, motion in enumerate(motions, 1)]
    suggestions = tuple(text for motion in motions for text in re.findall(r"`([^`]*;)`", motion.remedy))
    lines += [f"apply {n}: {text}" for n, text in enumerate(suggestions, 1)]
    return replace(session, suggestions=suggestions), "\n".join(lines)


def wiggle(session: Session, argument: str) -> Answer:
    """``wiggle FILE``: each free motion, one after the other, as an animation."""
    from movimentum.analysis.wiggle import wiggles

    name = argument.strip().removeprefix("-o").strip()
    if not name.lower().endswith((".gif", ".apng", ".webp")):
        raise refused("file", "`wiggle` writes an animation", "wiggle free.gif")
    piece, tau = _piece(session)
    found = list(wiggles(session.stretch, piece, tau))
    if not found:
        return session, "nothing can move in a way that is not determined"
    write_film(session, [moment for _, moments in found for moment in moments], Path(name))
    return session, "\n".join([*(f"{n}. {motion.words}" for n, (motion, _) in enumerate(found, 1)), f"wrote {name}"])


def solutions(session: Session, argument: str) -> Answer:
    """``solutions [-o FILE]``: every solution at this moment."""
    from movimentum.analysis.moment import alternatives

    rest, target = split_output(argument, (".png",))
    plain(rest, "solutions")
    piece, tau = _piece(session)
    found = [part for part in alternatives(session.stretch, piece, tau) if len(part.solutions) > 1]
    if not found:
        return session, "there is one solution only at this moment"
    scene = session.work.scene
    lines: list[str] = []
    suggestions: list[str] = []
    for part in found:
        names = ", ".join(f"`{scene.things[t].name}`" for t in part.things)
        more = "" if part.complete else ", found by looking: there may be more"
        lines.append(f"{counted(len(part.solutions), 'solution')} for {names or 'what is not drawn'}{more}")
        for n, solution in enumerate(part.solutions, 1):
            mark = "->" if solution.current else "  "
            lines.append(f"{mark} {n}. {solution.words}")
            if solution.selects is not None:
                suggestions.append(solution.selects)
                lines.append(f"      apply {len(suggestions)}: {solution.selects}")
    if target is not None:
        with whole_file(Path(target)) as part_file:
            write_sheet(session, [s.pose for part in found for s in part.solutions], part_file)
        lines.append(f"wrote {target}")
    return replace(session, suggestions=tuple(suggestions)), "\n".join(lines)


def _piece(session: Session) -> tuple[Piece, float]:
    stretch = session.stretch
    tau = float(session.time - stretch.segment.start)
    begins = np.array([piece.begin for piece in stretch.pieces[1:]])
    piece = stretch.pieces[int(np.searchsorted(begins, tau, side="right"))]
    if isinstance(piece, Dead):
        raise refused("no-solution", "there is no solution at this moment", "conflicts")
    return piece, tau


def branch(session: Session, argument: str) -> Answer:
    """``branch``: how sure the choice of every solution was, over the whole animation."""
    plain(argument, "branch")
    from movimentum.analysis.branches import branches

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


COMMANDS = (
    Command("why", "why NAME", "the constraints that determine a thing, an anchor or a variable, in their order", why),
    Command("formula", "formula NAME", "its closed form, plain and as LaTeX, or what stands in the way", formula),
    Command("free", "free", "what can still move, in words, and what would stop it", free),
    Command("wiggle", "wiggle FILE.gif", "each free motion there and back, one after the other", wiggle),
    Command("solutions", "solutions [-o FILE.png]", "every solution at this moment, and what selects it", solutions),
    Command("branch", "branch", "how close the solver's choices were over the whole animation", branch),
)
