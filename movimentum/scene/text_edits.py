"""Edits of a script: add or remove a statement, change a number or sign, edit one copy of an array or part only.

The layout of the rest stays as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache

from movimentum.errors import script_error
from movimentum.records import dataclass
from movimentum.scene.expansion.placement import CopyFrame
from movimentum.scene.findings import clock_meant
from movimentum.scene.model import Claim, Constraint, Ending, Relation, Scene, Thing
from movimentum.source import Edit, FarSpan, SourceText, Span, UnfoldedText, edited
from movimentum.syntax.expression_tree import Name, postorder
from movimentum.syntax.parser import parse
from movimentum.syntax.suggest import nearest
from movimentum.syntax.tree import ClaimStatement, Statement
from movimentum.text import number, time_text

_REST_OF_LINE = re.compile(r"[ \t]*(//[^\r\n]*|/\*(?:[^*\r\n]|\*(?!/))*\*/[ \t]*)?(?=\r|\n|\Z)")
_END = re.compile(r"(?:\s|//[^\r\n]*|/\*.*?\*/)*;", re.DOTALL)
_SIGN = re.compile(r"[\s)]*([<>]=?)")
_WITHIN = re.compile(r"\.within\s*\(.*\Z", re.DOTALL)
_CONFIG = re.compile(r"\.config\s*\([^(),]*(,[^(),]*,[^(),]*)\)")
_DIGITS = 11
"""Decimals of a coordinate that is written: enough for the solver to take it as exact."""
_BEGIN = 5
"""How far the statements of a step are indented, if nothing else shows it."""
SHORTEST_NEAR = 3
"""Letters: shorter names are nearly each other by chance."""


def added(scene: Scene, step: int, statements: str) -> Edit:
    """``statements``, without the last ``;``, behind the last statement of step number ``step``: on a line of their
    own if that statement ends its line.
    """
    text, own = scene.source.text, len(scene.source.script.text)
    if scene.steps[step].span.end > own:  # a step that only parts have: the script gets one too
        statements = f"@{_plain(float(scene.steps[step].time))}  {statements}"
        step = written_step(scene, step)
    place, indent = _end_of_step(scene, step)
    statements = statements.strip().removesuffix(";").rstrip() + ";"
    rest = _REST_OF_LINE.match(text, place)
    if rest is None:
        return Edit(Span(place, place), " " + statements)
    return Edit(Span(rest.end(), rest.end()), scene.source.newline + indent + statements)


def removed(text: str, span: Span) -> Edit:
    """The statement in ``span`` with its ``;`` and without its line if nothing else is there."""
    start, stop = span.start, statement_end(text, span)
    line_start = _line_start(text, start)
    rest = _REST_OF_LINE.match(text, stop)
    if text[line_start:start].strip() == "" and rest is not None and not rest[1]:
        stop = rest.end()
        if text.startswith("\r\n", stop):
            stop += 2
        elif stop < len(text):
            stop += 1
        return Edit(Span(line_start, stop), "")
    if rest is not None and not rest[1]:  # nothing follows it on its line
        return Edit(Span(len(text[:start].rstrip(" \t")), stop), "")
    while stop < len(text) and text[stop] in " \t" and text[start - 1 : start] in ("", " ", "\t", "\n"):
        stop += 1
    return Edit(Span(start, stop), "")


def renamed(scene: Scene, variable: str, text: str) -> tuple[Edit, ...]:
    """``text`` in the place of every use of a variable."""
    return tuple(Edit(span, text) for span in _uses(scene.source.script).get(variable, ()))


@lru_cache(maxsize=1)
def _uses(script: SourceText) -> dict[str, list[Span]]:
    """Where each name stands by itself in a statement or a claim: asked of one script for many names."""
    found: dict[str, list[Span]] = {}
    for item in parse(script).items:
        if isinstance(item, Statement | ClaimStatement):
            for side in (item.left, item.right):
                for node in postorder(side):
                    if isinstance(node, Name):
                        found.setdefault(node.name, []).append(node.span)
    return found


def name_meant(scene: Scene, name: str) -> str | None:
    """The probable meaning of a variable's name: a clock, or a constant or variable whose name is nearly the same."""
    clock = clock_meant(name)
    if clock is not None:
        return f".{clock}"
    if len(name) < SHORTEST_NEAR or _is_named_again(scene, name):  # what is misspelt, is so once
        return None
    constants = {constant.name for constant in scene.constants}
    others = (other for other in constants | set(scene.variables) if _letters(other) != _letters(name))  # x1 is not x2
    guess = nearest(name, others)
    return guess if guess is None or guess in constants or _is_named_again(scene, guess) else None


def _is_named_again(scene: Scene, variable: str) -> bool:
    return len(_uses(scene.source.script).get(variable, ())) > 1


def _letters(name: str) -> str:
    return re.sub(r"\d", "", name)


def turned_round(scene: Scene, item: Constraint) -> Edit | None:
    """An inequality with its sign the other way round."""
    sign = _SIGN.match(scene.source.text, item.left_span.end, item.span.end)
    other = {Relation.BELOW: ">", Relation.ABOVE: "<"}.get(item.relation)
    if sign is None or other is None:
        return None
    return Edit(Span(*sign.span(1)), other + sign[1][1:])


def tolerated(source: SourceText, claim: Claim, tolerance: str) -> Edit:
    """A claim with another tolerance."""
    text = source.slice(claim.span)
    end = claim.span.start + len(text.removesuffix(".always").rstrip()) if claim.always else claim.span.end
    given = _WITHIN.search(text) if claim.tolerance is not None else None
    if given is None:
        return Edit(Span(end, end), f" .within({tolerance})")
    return Edit(Span(claim.span.start + given.start(), end), f".within({tolerance})")


def lengthened(thing: Thing, factor: float) -> Edit | None:
    """The second of a thing's two anchors, ``factor`` times as far from the first; None where its definition does not
    say that plainly.
    """
    if len(thing.anchors) != 2 or thing.picture is not None or not math.isfinite(factor):
        return None
    first, second = thing.anchors
    dx, dy = (round(factor * (b - a), _DIGITS) + 0.0 for a, b in zip(first.local, second.local, strict=True))
    return Edit(second.span, f"{second.name} = {first.name} + [{_plain(dx)}, {_plain(dy)}]")


def resized(scene: Scene, size: tuple[int, int] | None) -> Edit | None:
    """``.config`` with another size of the canvas, or without one."""
    if scene.config.span is None:
        return None
    text = scene.source.slice(scene.config.span)
    given = _CONFIG.match(text)
    if given is None:
        return None
    start = scene.config.span.start
    return Edit(Span(start + given.start(1), start + given.end(1)), "" if size is None else f", {size[0]}, {size[1]}")


def _plain(value: float) -> str:
    return repr(int(value)) if value == int(value) else repr(value)


def statement_end(text: str, span: Span) -> int:
    """The offset behind the ``;`` of the statement in ``span``."""
    end = _END.match(text, span.end)
    return span.end if end is None else end.end()


def _line_start(text: str, place: int) -> int:
    return max(text.rfind("\n", 0, place), text.rfind("\r", 0, place)) + 1


def written_step(scene: Scene, step: int) -> int:
    """The number of the last step before number ``step`` that the script itself has."""
    own = len(scene.source.script.text)
    return max((each.number for each in scene.steps[:step] if each.span.end <= own), default=0)


def _end_of_step(scene: Scene, step: int) -> tuple[int, str]:
    """The offset behind the last statement of a step, and the indentation of its lines."""
    text, header = scene.source.text, scene.steps[step].span
    own = len(scene.source.script.text)
    last = max((span for span in _stated(scene, step) if span.end <= own), default=header)
    line = text[_line_start(text, last.start) : last.start]
    indented = last is not header and not line.lstrip().startswith("@")
    indent = line[: len(line) - len(line.lstrip())] if indented else " " * _BEGIN
    return (last.end if last is header else statement_end(text, last)), indent


def _stated(scene: Scene, step: int) -> Iterator[Span]:
    for item in (*scene.steps[step].statements, *scene.steps[step].claims, *scene.steps[step].aims):
        yield item.span


# --- statements that somebody types or draws ---------------------------------------------------------------


def statement_of(text: str) -> Statement | None:
    """``text`` as a statement, with its spans in ``text``; None if it is not one. A missing ``;`` is accepted.

    `ScriptError` for text that looks like one but is misspelled.
    """
    if not re.search(r"[=<>~]", text):
        return None
    script = parse(SourceText("<typed>", text if text.rstrip().endswith(";") else text + ";"))
    (item,) = script.items if len(script.items) == 1 else (None,)
    return item if isinstance(item, Statement) else None


def typed_item(before: Scene, after: Scene, step: int, statement: str) -> Constraint | Ending:
    """The counterpart in ``after`` of ``statement``, put at the end of step ``step`` of ``before``."""
    place = added(before, step, statement).span.start
    own = len(after.source.script.text)
    items = (item for each in after.steps for item in each.statements)
    return min((item for item in items if place <= item.span.start <= own), key=lambda item: item.span.start)


def stated(scene: Scene, step: int, statement: str, replaced: Sequence[Constraint | Ending] = ()) -> str:
    """The script of ``scene`` with ``statement`` at the end of step ``step``, or in the place of what the step states
    in ``replaced``. `ScriptError` (``edit/elsewhere``) where that is in a part or loop that makes
    several of it, and (``edit/turn``) in a turn of a loop.
    """
    text = scene.source.script.text
    if not replaced:
        _refuse_turn(scene, step)
        return edited(text, [added(scene, step, statement)])
    found = sorted(((_place_of(scene, item), item) for item in replaced), key=lambda each: each[0].start)
    (first, item), *others = found
    for span, _ in reversed(others):
        text = edited(text, [removed(text, span)])
    line = _unprefixed(scene, item, statement).strip().removesuffix(";").rstrip() + ";"
    return edited(text, [Edit(Span(first.start, statement_end(text, first)), line)])


def _refuse_turn(scene: Scene, step: int) -> None:
    """Refuse to state something in one turn of a loop: there is no place in the script for it."""
    source, own = scene.source, scene.steps[step]
    if not isinstance(source, UnfoldedText) or own.span.end <= source.own:
        return
    turns = [title for title, _ in source.uses(own.span)]
    if turns and not any(map(_is_copy, turns)):
        message = f"the step at t = {time_text(float(own.time))} is one turn of a loop ({', '.join(turns)})"
        note = "a statement in it would hold in all turns"
        raise script_error("edit/turn", f"{message}: {note}", "edit the script")


def without(scene: Scene, items: Sequence[Constraint | Ending]) -> str:
    """The script without some statements, and without their lines if nothing else is there. Raises as `stated` does."""
    text = scene.source.script.text
    for span in sorted((_place_of(scene, item) for item in items), key=lambda span: -span.start):
        text = edited(text, [removed(text, span)])
    return text


def _place_of(scene: Scene, item: Constraint | Ending) -> Span:
    """Where a statement is in the script."""
    source = scene.source
    if not isinstance(source, UnfoldedText) or item.span.end <= source.own:
        return item.span
    real, times = source.real(item.span), source.times(item.span)
    line = source.position(item.span.start).line
    if isinstance(real, FarSpan):
        message = f"`{item.key}` is stated in another file, {real.file.path}, line {line}"
        raise script_error("edit/elsewhere", message, "state it differently in a later step")
    copy = _copy_of(scene, item)
    if times > 1 or (copy is not None and not copy.is_here):
        counted = f", which is for {times} copies or turns" if times > 1 else ""
        message = f"`{item.key}` is stated in line {line}{counted}: a change there would mean something else"
        raise script_error("edit/elsewhere", message, "state it differently in a later step, or edit the script")
    return real


def _copy_of(scene: Scene, item: Constraint | Ending) -> CopyFrame | None:
    """How the copy is placed that a statement belongs to; None if there is none."""
    name = item.key.partition("[")[0].partition(".")[0]
    things = (thing for thing in scene.things if thing.name.partition("[")[0].partition(".")[0] == name)
    return next((thing.placement for thing in things), None)


def _is_copy(title: str) -> bool:
    """Whether the title of a use (`UnfoldedText.uses`) is that of a copy, and not of a turn of a loop."""
    return title.startswith("the copy `")


def _unprefixed(scene: Scene, item: Constraint | Ending, statement: str) -> str:
    """A statement about a copy as its part says it."""
    source = scene.source
    if not isinstance(source, UnfoldedText) or item.span.end <= source.own:
        return statement
    titles = [title for title, _ in source.uses(item.span) if _is_copy(title)]
    for title in titles[:1]:
        prefix = title.removeprefix("the copy `").removesuffix("`")
        statement = re.sub(rf"(?<![\w.]){re.escape(prefix)}\s*\.\s*(?=[A-Za-z])", "", statement)
    return statement


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
    """Whether the text there is for one copy and one turn of a loop only."""
    source = scene.source
    return not isinstance(source, UnfoldedText) or source.times(span) < 2
