"""Commands that change the script: statements are tried out, undone and kept."""

from __future__ import annotations

import difflib
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from typing import NoReturn

from movimentum.diagnostics import Diagnostic, Fix, Label, Severity, render_text, to_json
from movimentum.errors import MovimentumError, ScriptError
from movimentum.records import replace
from movimentum.repl.session import Answer, AnswerWithData, CommandTable, Session, plain, refused, typed
from movimentum.scene.model import Constraint
from movimentum.scene.text_edits import stated, statement_of, typed_item, without, written_step
from movimentum.source import FarSpan, Span, edited
from movimentum.syntax.suggest import nearest
from movimentum.text import time_text

COMMANDS = CommandTable()


def reported(session: Session, diagnostics: Iterable[Diagnostic], *, brief: bool = False) -> Answer:
    """Diagnostics as text; their fixes are numbered for `apply`. ``brief``: in a terminal, what has been shown is not
    shown again.
    """
    suggestions: list[str | Fix] = []
    numbered = [_numbered(item, suggestions) for item in diagnostics]
    shown = briefly(session, numbered) if brief else numbered
    text = render_text(shown, session.work.source).rstrip("\n")
    already_shown = frozenset((item.code, item.message) for item in numbered)
    session = replace(
        session,
        suggestions=tuple(suggestions),
        already_shown=already_shown if brief else already_shown | session.already_shown,
    )
    return session, AnswerWithData(text, to_json(numbered, session.work.source))


def briefly(session: Session, diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """The diagnostics; in a terminal, those shown before in short: their code, and what can be applied."""
    shown: list[Diagnostic] = []
    for item in diagnostics:
        if session.ask is not None and (item.code, item.message) in session.already_shown:
            line = f", line {session.work.source.position(item.span.start).line}" if item.span is not None else ""
            fixes = tuple(text for text in item.helps if text.startswith("apply "))
            item = Diagnostic(item.code, item.severity, f"as before{line} (`check` tells it again)", helps=fixes)
        shown.append(item)
    return shown


def _numbered(item: Diagnostic, suggestions: list[str | Fix]) -> Diagnostic:
    """A diagnostic whose helps begin with what applies them; fixes that no help is about follow."""
    fixes = {fix.title: fix for fix in item.fixes if fix.tried}
    helps: list[str] = []
    for title in dict.fromkeys((*item.helps, *fixes)):
        if title in fixes:
            suggestions.append(fixes[title])
            title = f"apply {len(suggestions)}: {title}"
        helps.append(title)
    return replace(item, helps=tuple(helps))


@COMMANDS.add("check")
def check(session: Session, argument: str) -> Answer:
    """all messages, with numbered suggestions"""
    plain(argument, "check")
    diagnostics = session.advice
    if not diagnostics:
        return replace(session, suggestions=()), "there are no messages"
    return reported(session, diagnostics)


@COMMANDS.add("conflicts")
def conflicts(session: Session, argument: str) -> Answer:
    """what contradicts, has no solution, or is stated twice"""
    plain(argument, "conflicts")
    codes = (
        "constraint/conflict",
        "constraint/redundant",
        "cord/length",
        "solve/unreachable",
        "solve/not-converged",
        "claim/broken",
    )
    found = [d for d in session.advice if d.code in codes or d.severity is Severity.ERROR]
    return reported(session, found) if found else (session, "there are no contradictions, and nothing is stated twice")


def changed(after: Session) -> Answer:
    """The session with another text, and the effect of the change."""
    if after.tell is not None and (said := _at_first_sight(after)):
        after.tell(said)
    if after.tell is not None and (said := _without_solution(after)):
        after.tell(said)
    serious = [d for d in after.advice if d.severity is not Severity.NOTE]
    said = f"now {_summary(after)}"
    if not serious:
        return after, said
    after, listed = reported(after, serious, brief=True)
    return after, f"{listed}\n\n{said}"


def _at_first_sight(session: Session) -> str:
    """A first remark about the moment on show, before the path is known; empty if only the path can tell."""
    work = session.work
    if not work.moves:
        return ""
    timeline = work.timeline
    time = min(max(session.time, timeline.start), timeline.end)
    try:
        poses = work.preview(time)
    except MovimentumError:
        return ""
    return "" if poses is None else f"it can hold at t = {time_text(float(time))}; the whole film is being solved …"


def _without_solution(session: Session) -> str:
    """From when on there is no solution, before the reasons are known; nothing where there is one all the time."""
    work = session.work
    if not work.moves:
        return ""
    try:
        segment_motions = work.motion.segments
    except MovimentumError:
        return ""
    found = (float(each.segment.start) + trouble.begin for each in segment_motions for trouble in each.failures)
    begin = min(found, default=None)
    if begin is None:
        return ""
    return f"there is no solution at t = {time_text(begin)}; what is in the way, and what helps, is being looked for …"


def _summary(session: Session) -> str:
    diagnostics = session.advice
    errors = sum(d.severity is Severity.ERROR for d in diagnostics)
    warnings = sum(d.severity is Severity.WARNING for d in diagnostics)
    parts = [f"{n} {word}{'' if n == 1 else 's'}" for n, word in ((errors, "error"), (warnings, "warning")) if n]
    return " and ".join(parts) or "everything is determined and agrees"


def try_statement(session: Session, text: str, commands: Iterable[str] = ()) -> Answer:
    """A statement typed at the prompt: it takes effect at once, at this step, under the key convention.

    ``commands`` are the other things that can be typed, for "did you mean".
    """
    word, _, rest = text.partition(" ")
    near = near_commands(word, commands)
    helps = tuple(f"did you mean `{' '.join(filter(None, (name, rest.strip())))}`?" for name in near) or ("help",)
    try:
        statement = statement_of(text)
    except ScriptError as error:
        found = [replace(item, helps=(*item.helps, *helps)) if near else item for item in error.diagnostics[:1]]
        raise ScriptError(found, typed(text)) from error
    if statement is None:
        raise refused("unknown-command", f"`{word}` is not a command, and `{text}` is not a statement", *helps)
    return _stated(session, text)


def near_commands(word: str, commands: Iterable[str]) -> list[str]:
    """The commands that a word is probably meant to be: those that begin with it, otherwise the nearest by spelling."""
    names = list(commands)
    begun = [name for name in names if name.startswith(word.lower()) and name != word]
    if begun and len(word) > 0:
        return begun[:3]
    guess = nearest(word, names)
    if guess is not None:
        return difflib.get_close_matches(word.lower(), names, 1, 0.85) or [guess]
    return difflib.get_close_matches(word.lower(), names, 2, 0.6)


def _stated(session: Session, text: str) -> Answer:
    scene = session.work.scene
    step = session.step
    with _in_its_step(session):
        trial = stated(scene, step, text)
    after = session.edited(trial)
    if not after.work.moves:
        _refuse_typed(after, text, trial)
    new_scene = after.work.scene
    new = typed_item(scene, new_scene, step, text)
    own = tuple(item for item in scene.steps[step].statements if (item.key, item.relation) == (new.key, new.relation))
    with _in_its_step(session):
        final = stated(scene, step, text, own)
    return changed(after if final == trial else session.edited(final))


@contextmanager
def _in_its_step(session: Session) -> Generator[None, None, None]:
    """Where the step of the moment has no place of its own in the script, say what to do."""
    try:
        yield
    except ScriptError as error:
        item, scene = error.diagnostics[0], session.work.scene
        before = scene.steps[written_step(scene, session.step)].time
        there = (f"at {time_text(float(before))}",) if item.code == "edit/turn" else ()
        raise refused("elsewhere", item.message, *there, *item.helps) from error


def _refuse_typed(after: Session, text: str, trial: str) -> NoReturn:
    """The errors in the typed text, shown at their place in it."""
    offset = trial.find(text.strip().removesuffix(";").rstrip())
    shifted: list[Diagnostic] = []
    for item in after.work.diagnostics:
        if item.severity is Severity.ERROR and item.span is not None:
            span = replace(item.span, start=item.span.start - offset, end=item.span.end - offset)
            inside = span.start >= 0 and span.end <= len(text) + 1
            own, notes = list[Label](), list[str]()
            for label in item.labels:
                place = Span(label.span.start - offset, label.span.end - offset)
                if place.start >= 0 and place.end <= len(text) + 1:
                    own.append(replace(label, span=place))
                else:
                    notes.append(_elsewhere(after, trial, label))
            shown = replace(item, span=span if inside else None, label=item.label if inside else "", fixes=())
            shifted.append(replace(shown, labels=tuple(own), notes=(*notes, *item.notes)))
    raise ScriptError(shifted[:3] or after.work.diagnostics[:3], typed(text))


def _elsewhere(after: Session, trial: str, label: Label) -> str:
    """A message's label for a place outside the typed text."""
    if isinstance(label.span, FarSpan) or label.span.end > len(trial):
        return label.message
    line = after.work.source.position(label.span.start).line
    text = " ".join(trial[label.span.start : label.span.end].split())
    return f"line {line}, `{text}`{': ' if label.message else ''}{label.message}"


@COMMANDS.add("drop KEY")
def drop(session: Session, argument: str) -> Answer:
    """end what is stated under a key from this step on"""
    wanted = argument.strip().removesuffix(";").strip()
    if not wanted:
        raise refused("argument", "`drop` needs a key, the left-hand side of a statement", "constraints")
    work = session.work
    timeline = work.timeline
    active = timeline.segments[timeline.segment_at(session.time)].active
    found = [
        c
        for c in active
        if wanted in (c.key, f"{c.key} {c.relation}", _left(session, c), _left(session, c) + f" {c.relation}")
    ]
    if not found:
        near = difflib.get_close_matches(wanted, [c.key for c in active], 3)
        raise refused("key", f"nothing is in force under `{wanted}` now", *(f"drop {key}" for key in near))
    if len({c.relation for c in found}) > 1:
        raise refused(
            "key",
            f"several things are in force under `{wanted}`",
            *dict.fromkeys(f"drop {c.key} {c.relation}" for c in found),
        )
    own = [c for c in found if c.step == session.step]
    with _in_its_step(session):
        if not own or _stated_before(session, found[0]):  # otherwise an earlier step's would be in force again
            text = stated(work.scene, session.step, f"{found[0].key} {found[0].relation} _", own)
        else:
            text = without(work.scene, own)
    return changed(session.edited(text))


def _left(session: Session, item: Constraint) -> str:
    return " ".join(session.work.scene.source.slice(item.left_span).split())


def _stated_before(session: Session, item: Constraint) -> bool:
    key = (item.key, item.relation)
    return any((s.key, s.relation) == key for step in session.work.scene.steps[: session.step] for s in step.statements)


@COMMANDS.add("apply N")
def apply(session: Session, argument: str) -> Answer:
    """apply the fix or suggestion with that number"""
    count = len(session.suggestions)
    if not count:
        raise refused("nothing-suggested", "there are no suggestions; `check` and `solutions` make some", "check")
    text = argument.strip()
    if not text.isdecimal() or len(text) > 9 or not 1 <= int(text) <= count:
        raise refused("argument", f"suggestions go from 1 to {count}", "apply 1")
    chosen = session.suggestions[int(text) - 1]
    if isinstance(chosen, Fix):
        after, said = changed(session.edited(edited(session.text, chosen.edits)))
        return after, f"{chosen.title}\n{said}"
    answer = session, ""
    for part in filter(None, (piece.strip() for piece in chosen.split(";"))):
        answer = _stated(answer[0], part)
    after, said = answer
    return replace(after, past=(*session.past, session.text)), f"{chosen}\n{said}"


@COMMANDS.add("undo")
def undo(session: Session, argument: str) -> Answer:
    """take back the last change"""
    plain(argument, "undo")
    after = session.undone()
    return after, f"now {_summary(after)}"


@COMMANDS.add("redo")
def redo(session: Session, argument: str) -> Answer:
    """take back the last undo"""
    plain(argument, "redo")
    after = session.redone()
    return after, f"now {_summary(after)}"
