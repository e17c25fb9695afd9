"""Commands about the script's file: show changes, save, reload."""

from __future__ import annotations

import difflib
import os
import re
from fractions import Fraction
from pathlib import Path

from movimentum.output.files import whole_file, write_script
from movimentum.output.merging import Clash, Merged, merged
from movimentum.records import replace
from movimentum.repl.inspect import moment_picture
from movimentum.repl.session import Answer, AnswerWithData, CommandTable, Session, plain, refused, split_output, table
from movimentum.source import SourceText
from movimentum.terminal import typed
from movimentum.text import counted, number, time_text
from movimentum.workflow.engine import Engine
from movimentum.workflow.read import read

COMMANDS = CommandTable()
MOST_CLASHES = 3
PALE = 0.3
"""How much of a picture of two films is the one of the file."""


@COMMANDS.add("diff [motion [-o FILE.png]]")
def diff(session: Session, argument: str) -> Answer:
    """the changes, against the file; `diff motion`: which anchors they move, by how much, and when first"""
    words, target = split_output(argument, (".png",))
    if words == "motion":
        return session, _moved_anchors(session, target)
    plain(argument, "diff")
    return session, _difference(session.original, session.text, session.file) or "nothing is changed"


def _moved_anchors(session: Session, target: str | None) -> str:
    """The anchors that are elsewhere than in the film of the file, the farthest first; with a picture of the moment
    when the first of them is farthest away: as it is now, and pale as it was.
    """
    from movimentum.workflow.motion_difference import motion_difference

    if session.text == session.original:
        return "nothing is changed"
    choices = session.work.engine.choices
    before = Engine(choices).revise(SourceText(session.work.source.path, session.original))
    found = motion_difference(before, session.work)
    rows = [["anchor", "by at most", "at t", "first at t"]]
    for item in found.moved:
        times = (time_text(float(time)) for time in (item.worst, item.first))
        rows.append([item.anchor, number(item.amount), *times])
    lines = [table(rows)] if found.moved else ["no anchor moves differently"]
    lines += [f"only in the film {where}: {', '.join(names)}" for where, names in found.only if names]
    if found.moved and (target is not None or session.draw is not None):
        worst = found.moved[0].worst
        picture = _both(session, worst)
        if target is None:
            assert session.draw is not None
            session.draw(picture)
        else:
            with whole_file(session.refuse_overwriting(target)) as part:
                part.write_bytes(picture)
            lines.append(f"wrote {target}: t = {time_text(float(worst))}, pale as it was in the file")
    elif target is not None:
        lines.append("there is nothing to draw")
    return AnswerWithData("\n".join(lines), found)


def _both(session: Session, time: Fraction) -> bytes:
    """A moment as it is now, with the same moment of the file's film behind it."""
    from movimentum.rendering.terminal_pictures import blended

    texts = session.text, session.original
    choices = session.work.engine.choices
    now, was = (moment_picture(choices, session.file, text, time) for text in texts)
    return blended(now, was, PALE)


def _difference(before: str, after: str, name: str) -> str:
    lines = difflib.unified_diff(
        before.splitlines(), after.splitlines(), name, f"{name} (as it is now)", "", "", 1, ""
    )  # fmt: skip
    return "\n".join(lines)


@COMMANDS.add("write [--merge | --force] [FILE]")
def write(session: Session, argument: str) -> Answer:
    """save the script; other changes to its file are never lost: they are merged, or you are asked"""
    given = re.fullmatch(r"\s*(?:--(merge|force)(?=\s|$))?\s*(.*?)\s*", argument, re.DOTALL)
    assert given is not None
    how, name = given[1] or "", given[2] or session.file
    if name.startswith("<"):
        raise refused("file", "the script came from standard input: it has no file to write to", "write changed.mov")
    if name.startswith("-"):
        raise refused("argument", f"`write` takes --merge, --force and a file, found `{name}`", "write --merge")
    path = session.refuse_overwriting(name, script=False)
    own = os.path.realpath(name) == os.path.realpath(session.file)
    there = read(name).text if path.is_file() else None
    if there is None or there == session.text or (own and there == session.original):
        return _saved(session, path, session.text, own=own)
    if not own:
        if how == "force" or _agreed(session, f"there is another file {name} already: overwrite it? [y/N] "):
            return _saved(session, path, session.text, own=own)
        free = _free(path)
        helps = (f"write --force {typed(path)}", f"write {typed(free)}")
        raise refused("file-exists", f"there is another file {name} already, and it was not overwritten", *helps)
    found = merged(session.original, session.text, there)
    if not how and session.ask is not None:
        how = _ask_to_save(session, found)
    if how == "force":
        return _saved(session, path, session.text, own=own)
    if how == "merge" and not found.clashes:
        after, said = _saved(session.edited(found.text), path, found.text, own=own)
        return after, f"{said}, with {counted(found.taken, 'change')} that the file had"
    free = _free(path)
    message = f"{name} has been changed since it was read, and was not overwritten"
    if found.clashes:
        message += f"; {counted(len(found.clashes), 'place')} in it clash{'es' if len(found.clashes) == 1 else ''}"
        message += f" with your changes ({'; '.join(map(_clash_text, found.clashes[:MOST_CLASHES]))})"
        raise refused("file-changed", message, f"write {typed(free)}", "write --force", "reload")
    raise refused("file-changed", message, "write --merge", "write --force", f"write {typed(free)}")


@COMMANDS.add("reload")
def reload(session: Session, argument: str) -> Answer:
    """reload the script from its file; `undo` brings yours back"""
    plain(argument, "reload")
    if session.file.startswith("<"):
        raise refused("file", "the script came from standard input: it cannot be read again")
    text = read(session.file).text
    if text == session.text:
        return replace(session, original=text), "the file is as it is here"
    after = replace(session.edited(text), original=text)
    return after, f"read {session.file}; `undo` brings back what was here"


def _saved(session: Session, path: Path, text: str, *, own: bool) -> Answer:
    write_script(path, text)
    return (replace(session, original=text) if own else session), f"wrote {path}"


def _agreed(session: Session, question: str) -> bool:
    reply = session.ask(question) if session.ask is not None else None
    return reply is not None and reply.strip().lower() in ("y", "yes")


def _ask_to_save(session: Session, found: Merged) -> str:
    """How to save over a file that has changed: "merge", "force", or nothing."""
    assert session.ask is not None
    if found.clashes:
        places = "; ".join(map(_clash_text, found.clashes[:MOST_CLASHES]))
        question = (
            f"the file has been changed meanwhile, and clashes with your changes ({places}): overwrite it? [y/N] "
        )
        return "force" if _agreed(session, question) else ""
    question = "the file has been changed meanwhile: [m]erge its changes and yours, [o]verwrite it, or leave it? "
    reply = (session.ask(question) or "").strip().lower()
    return {"m": "merge", "merge": "merge", "o": "force", "overwrite": "force"}.get(reply, "")


def _clash_text(clash: Clash) -> str:
    mine, theirs = (" ".join(" ".join(lines).split()) or "nothing" for lines in (clash.mine, clash.theirs))
    return f"line {clash.line}: yours `{_shortened(mine)}`, in the file `{_shortened(theirs)}`"


def _shortened(text: str) -> str:
    return text if len(text) <= 50 else text[:49] + "…"


def _free(path: Path) -> Path:
    """A name beside ``path`` that no file has."""
    names = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in range(2, 10**6))
    return next(name for name in names if not name.exists())
