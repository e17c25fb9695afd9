"""The tool that makes a rod turn by itself: all the way round where it can, else to and fro."""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.errors import MovimentumError
from movimentum.records import replace
from movimentum.scene.model import Relation
from movimentum.source import SourceText
from movimentum.studio.sheet import NothingToDo, Sheet, number_text
from movimentum.workflow.engine import Engine

TURN_S = 4
"""Time units that a turn takes, and the film that is made for it."""
WIDEST = 60.0
"""Degrees to each side that a rod swings which cannot turn."""
LEAST = 2.0
"""Degrees that a rod must be able to turn before it is driven."""
MOST_THINGS = 200
"""In larger scenes it is not tried whether a rod can turn: that would take long."""


def turn(sheet: Sheet, names: Sequence[str], _: Sequence[tuple[float, float]]) -> Sheet:
    """Drive a rod; where the film had no length, it has one turn's."""
    thing = sheet.thing(names[0])
    if not thing.is_body:
        raise NothingToDo(f"`{thing.name}` cannot turn")
    key = f"{thing.name}.angle"
    if sheet.stated_under(key, Relation.EQUAL):
        raise NothingToDo(f"the angle of `{thing.name}` is stated already")
    now = sheet.turn(thing)
    begin = "" if abs(now) < 1e-6 else f"{number_text(now)} + "
    whole = _driven(sheet, f"{key} = {begin}{360 // TURN_S}*.t;")
    if len(sheet.scene.steps) > 1 or len(sheet.scene.things) > MOST_THINGS or _solved(whole) >= 1.0:
        return whole
    forward, back = (180.0 * _solved(_driven(sheet, f"{key} = {begin}{sign}45*.t;")) for sign in ("", "-"))
    for wide in (0.9, 0.6, 0.3) if max(forward, back) > LEAST else ():
        swing = _driven(sheet, f"{key} = {begin}{_swing(wide * forward, wide * back)};")
        if _solved(swing) >= 1.0:
            return replace(swing, words=f"`{thing.name}` cannot turn all the way round: it swings.")
    raise NothingToDo(f"`{thing.name}` cannot turn: what it is joined to holds it where it is")


def _swing(forward: float, back: float) -> str:
    """An angle that begins at 0 and stays between ``-back`` and ``forward`` degrees."""
    rate = f"{360 // TURN_S}*.t"
    both = min(forward, back, WIDEST)
    if both >= 10.0:
        return f"{_degrees(both)}*.sin({rate})"
    wide = min(max(forward, back) / 2.0, WIDEST)
    return f"{'' if forward > back else '-'}{_degrees(wide)}*(1 - .cos({rate}))"


def _degrees(value: float) -> str:
    return number_text(value, 0 if value >= 2.0 else 2)


def _driven(sheet: Sheet, statement: str) -> Sheet:
    """The same with the statement, and with an end if there was none."""
    last = sheet.scene.steps[-1]
    sheet = sheet.state(statement)
    if len(sheet.scene.steps) > 1:
        return sheet
    newline = sheet.scene.source.newline
    ending = f"@{number_text(float(last.time) + TURN_S)}  .loop;"
    return sheet.to(sheet.text.rstrip() + 2 * newline + ending + newline)


def _solved(sheet: Sheet) -> float:
    """How much of a film has a solution, from its beginning on: 1 for all of it."""
    try:
        motion = Engine(sheet.choices).revise(SourceText(sheet.scene.source.path, sheet.text)).motion
    except MovimentumError:
        return 0.0
    count = motion.timeline.frame_count
    solved = motion.poses(0, count).solved
    return 1.0 if solved.all() else float((~solved).argmax()) / count
