"""Commands that find causes: what forbids a value, what it depends on, what repairs the film, how it was solved."""

from __future__ import annotations

from movimentum.diagnostics import Fix
from movimentum.records import replace
from movimentum.repl.expressions import at_the_prompt
from movimentum.repl.session import Answer, AnswerWithData, CommandTable, Session, plain, refused, table
from movimentum.text import counted, number, time_text

COMMANDS = CommandTable()

PATIENCE_S = 1.6
"""The limit for trials: the user waits two seconds in all."""
MOST_FIXES = 8


def why_not(session: Session, text: str) -> Answer:
    """Which statements forbid a condition at the moment."""
    from movimentum.workflow import causes

    if not text.strip():
        raise refused("argument", "`why not` needs a condition", "why not Rod.B.x = 300")
    with at_the_prompt(session, text):
        found = causes.why_not(session, text, session.patience * PATIENCE_S)
    asked, when = text.strip().removesuffix(";"), time_text(float(session.time))
    if found.possible:
        return session, AnswerWithData(
            f"nothing forbids `{asked}` at t = {when}: with it as a statement there is a pose", found
        )
    if not found.statements:
        words = f"`{asked}` is impossible by itself at t = {when}: no other statement is needed to forbid it"
        return session, AnswerWithData(words, found)
    how = (
        "without any one of them it can hold"
        if found.minimal
        else "time was up before all were tried: some of them may not be needed"
    )
    rows = [f"   line {line}: `{statement}`" for line, statement in found.statements]
    words = "\n".join([f"`{asked}` is forbidden at t = {when} by these together ({how}):", *rows])
    return session, AnswerWithData(words, found)


@COMMANDS.add("certify")
def certify(session: Session, argument: str) -> Answer:
    """what is proved about the film: how exact it is, that it is one unbroken motion, bounds between frames"""
    plain(argument, "certify")
    from movimentum.certifying.certificate import certificate
    from movimentum.certifying.wording import as_data, certificate_diagnostics, certificate_text
    from movimentum.diagnostics import render_text

    motion, source = session.work.motion.path, session.work.source
    if any(segment.failures for segment in motion.segments):
        raise refused("no-solution", "there is no pose at some time, so there is nothing to certify", "conflicts")
    found = certificate(motion)
    words = render_text(list(certificate_diagnostics(found)), source) + certificate_text(found, source)
    return session, AnswerWithData(words.rstrip("\n"), as_data(found, source))


@COMMANDS.add("bisect")
def bisect(session: Session, argument: str) -> Answer:
    """the smallest change of statements with which the film has no error and every claim holds"""
    plain(argument, "bisect")
    from movimentum.workflow import causes

    _ = session.work.motion  # errors of spelling are reported by `check`
    found = causes.bisect(session, session.patience * PATIENCE_S)
    if found.size == 0:
        return session, AnswerWithData("the film has no error: there is nothing to repair", found)
    short = f"time was up after {counted(found.tried, 'change')} of {found.all}" if found.tried < found.all else ""
    if not found.fixes:
        whole = f"{counted(found.tried, 'change')} of one or two statements were tried, and none repairs the film"
        return session, AnswerWithData(short + ", and none of them repairs the film" if short else whole, found)
    many = "one change of a statement" if found.size == 1 else "changes of two statements"
    rest = short or f"all {found.tried} of that size and smaller were tried"
    suggestions: tuple[str | Fix, ...] = found.fixes[:MOST_FIXES]
    rows = [f"apply {n}: {fix.title}" for n, fix in enumerate(found.fixes[:MOST_FIXES], 1)]
    more = len(found.fixes) - MOST_FIXES
    rows += [f"and {more} more"] if more > 0 else []
    words = "\n".join([f"{many} repairs the film ({rest}):", *rows])
    return replace(session, suggestions=suggestions), AnswerWithData(words, found)


@COMMANDS.add("blame EXPR")
def blame(session: Session, argument: str) -> Answer:
    """the statements and lengths that its value depends on now, and how much: px for each px, or for each degree"""
    from movimentum.workflow import causes

    text = argument.strip()
    if not text:
        raise refused("argument", "`blame` needs an anchor, a thing or an expression", "blame Rod.B")
    with at_the_prompt(session, text):
        found = causes.blame(session, text)
    if not found:
        return session, AnswerWithData(f"no statement and no length changes `{text}` at this moment", found)
    head = ["changes by", "for one", "line", "of"]
    rows = [
        [
            "nothing alone" if item.rates is None else _vector(item.rates),
            item.unit,
            str(item.line),
            item.text + (f"  .{item.part}" if item.part else ""),
        ]
        for item in found
    ]
    note = ["(nothing alone: other statements say the same, so it cannot be changed by itself)"]
    words = "\n".join([table([head, *rows]), *note * any(item.rates is None for item in found)])
    return session, AnswerWithData(words, found)


def _vector(rates: tuple[float, ...]) -> str:
    parts = [number(rate, 6) for rate in rates]
    return parts[0] if len(parts) == 1 else f"[{', '.join(parts)}]"


@COMMANDS.add("trace")
def trace(session: Session, argument: str) -> Answer:
    """how this moment was solved: in which order, from which lines, and where there was a choice"""
    plain(argument, "trace")
    from movimentum.workflow import causes

    lines: list[str] = []
    found = causes.trace(session)
    for place, item in enumerate(found, 1):
        whose = ", ".join(f"`{name}`" for name in item.finds[:6]) + (", …" if len(item.finds) > 6 else "")
        lines.append(f"{place:3}. {whose}: {'; '.join(item.methods)}")
        lines += [f"       line {line}: `{text}`" for line, text in item.statements]
        lines += [f"       {item.choice}"] if item.choice else []
        shown = [f"{name} = {_vector(value)}" for name, value in item.values[:6]]
        lines += [f"       -> {', '.join(shown)}"] if shown else []
    return session, AnswerWithData("\n".join(lines) or "nothing is solved for at this moment", found)
