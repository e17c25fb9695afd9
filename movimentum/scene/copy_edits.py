"""Edits of a script that change one copy only: of an array of things, or of a part."""

from __future__ import annotations

import re
from collections.abc import Iterator

from movimentum.records import dataclass
from movimentum.scene.model import Scene, Thing
from movimentum.source import Edit, FarSpan, Span, UnfoldedText, edited
from movimentum.text import number

_ARRAY = re.compile(r"([A-Za-z]\w*)\s*\[\s*(?:([A-Za-z]\w*)\s*=\s*)?([^\[\];]+?)\s*\.\.\s*([^\[\];]+?)\s*\]\s*:")
_COPY = re.compile(r"(?:[A-Za-z]\w*(?:\s*\[[^\];]*\])?)\s*:\s*([A-Za-z]\w*)\s*\(([^()]*)\)")
_NUMBER = re.compile(r"\s*(-?(?:\d+\.?\d*|\.\d+))\s*")


@dataclass(frozen=True, slots=True)
class DefinedCopy:
    """A copy as it is defined in the script: what it is ``called``, and the ``place`` of its definition."""

    called: str
    place: Span


def array_of(scene: Scene, thing: Thing) -> DefinedCopy | None:
    """The definition of the array that a thing is one of; None where it is not in the script, or no array."""
    place = _real(scene, thing.span)
    if place is None or _ARRAY.match(scene.source.script.text, place.start, place.end) is None:
        return None
    return DefinedCopy(thing.name, place)


def copies_of(scene: Scene, thing: Thing) -> Iterator[DefinedCopy]:
    """The copies of parts that a thing belongs to, the innermost first."""
    source = scene.source
    if isinstance(source, UnfoldedText):
        for title, used in source.uses(thing.span):
            if title.startswith("the copy `") and not isinstance(used, FarSpan):
                end = source.script.text.find(";", used.start) + 1  # nothing in such a definition has another one
                yield DefinedCopy(
                    title.removeprefix("the copy `").removesuffix("`"), Span(used.start, max(end, used.end))
                )


def of_one(scene: Scene, copy: DefinedCopy, change: Edit) -> Edit | None:
    """``change``, in the definition of an array, for one of its copies, which gets a definition of its own; the change
    itself where the definition is of one thing. None where it cannot be said.
    """
    text = scene.source.script.text[copy.place.start : copy.place.end]
    head = _ARRAY.match(text)
    if head is None:
        return change
    own = re.fullmatch(r"(?:.*\.)?([A-Za-z]\w*)\[(-?\d+)\]", copy.called)
    start = change.span.start - copy.place.start
    if own is None or own[1] != head[1] or start < head.end():
        return None
    here, prefix = int(own[2]), copy.called[: own.start(1)]
    called = re.compile(rf"{re.escape(prefix + own[1])}\[(-?\d+)\]")
    known = {int(found[1]) for thing in scene.things if (found := called.match(thing.name))}
    body = text[head.end() :]
    shift = copy.place.start + head.end()
    moved = Edit(Span(change.span.start - shift, change.span.end - shift), change.text)
    changed = edited(body, [moved])
    ends = "" if text.rstrip().endswith(";") else ";"
    letter = f"{head[2]} = " if head[2] else ""
    used = head[2] is not None and re.search(rf"(?<![\w.]){head[2]}\b", body) is not None
    pieces = [f"{own[1]}[{f'{letter}{here}..{here}' if used else here}] :{changed}"]
    if here > min(known):
        pieces.insert(0, f"{own[1]}[{letter}{head[3]}..{here - 1}] :{body}")
    if here < max(known):
        pieces.append(f"{own[1]}[{letter}{here + 1}..{head[4]}] :{body}")
    line = scene.source.script.text.rfind("\n", 0, copy.place.start) + 1
    indent = re.match(r"[ \t]*", scene.source.script.text[line:])
    between = f"{ends}{scene.source.newline}{indent[0] if indent else ''}"
    return Edit(copy.place, between.join(pieces))


def arguments(scene: Scene, thing: Thing, factor: float) -> Iterator[tuple[str, Edit]]:
    """The numbers that a thing's copy is made with and its anchors depend on, each multiplied by ``factor`` for this
    copy only: (what that is, the edit).
    """
    script = scene.source.script.text
    said = scene.source.slice(thing.span)
    for copy in copies_of(scene, thing):
        stated = _COPY.match(script, copy.place.start, copy.place.end)
        if stated is None:
            return
        part = re.search(rf"\.part\s+{re.escape(stated[1])}\s*\(([^()]*)\)", script)
        names = [name.partition("=")[0].strip() for name in part[1].split(",")] if part is not None else []
        place = stated.start(2)
        for name, argument in zip(names, stated[2].split(","), strict=False):
            given = _NUMBER.fullmatch(argument)
            if given is not None and re.search(rf"(?<![\w.]){re.escape(name)}\b", said):
                wanted = number(factor * float(given[1]), 8)
                change = Edit(Span(place + given.start(1), place + given.end(1)), wanted)
                edit = of_one(scene, copy, change)
                if edit is not None:
                    yield f"`{name}` = {wanted} for `{copy.called}` (it is {given[1]})", edit
            place += len(argument) + 1
        return  # the arguments of outer copies are not those of this part


def _real(scene: Scene, span: Span) -> Span | None:
    source = scene.source
    place = source.real(span) if isinstance(source, UnfoldedText) else span
    return None if isinstance(place, FarSpan) else place


def in_script(scene: Scene, edit: Edit) -> Edit | None:
    """An edit with its place in the script; None for one in another file."""
    place = _real(scene, edit.span)
    return None if place is None else Edit(place, edit.text)


def written_once(scene: Scene, span: Span) -> bool:
    """Whether what stands there is for one copy and one turn of a loop only."""
    source = scene.source
    return not isinstance(source, UnfoldedText) or source.times(span) < 2
