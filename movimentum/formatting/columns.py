"""Aligns a script in the layout of the gallery: the same script and comments, with different white space.

Text that is already aligned with another row stays where it is, if there is room. Other text is aligned with the rows
around it. Where nothing is aligned yet, all rows are, except one that would push the others far away.
"""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterator, Sequence

from movimentum.formatting.elements import INDENT, LINE_END
from movimentum.formatting.rows import POINTS, LineCell, Role, TextRow, rows_of
from movimentum.source import Edit, SourceText, Span
from movimentum.syntax.parser import MAX_NESTING, parse

SHORT_NAME = 9
"""Names up to this length have their colons below one another; longer ones only with their neighbours."""
WIDER = 3
"""Colons that are in line stay there if they are at most so far from the longest name."""
FARTHEST = 16
"""So far at most, text moves to the right to be in line with that of other rows;"""
FARTHEST_POINT = 8
"""anchors only so far."""
CONTINUED = 4
"""How far the continuation of an item is indented, unless the author has indented it."""


def lines_of(rows: Sequence[TextRow]) -> Iterator[str]:
    """The text of each row, in its columns, after an empty line where there is one."""
    placed: dict[int, list[int]] = {}
    for region in _regions(rows):
        _place(region, placed)
    for row in rows:
        if row.blank:
            yield ""
        line = ""
        for cell, column in zip(row.cells, placed[id(row)], strict=True):
            line += " " * (column - len(_last_line(line))) + cell.text  # a comment may have several lines
        yield line


def _regions(rows: Sequence[TextRow]) -> Iterator[list[TextRow]]:
    """Rows that may be in line: those of one kind, up to the next of another kind. Comments do not interrupt them."""
    region: list[TextRow] = []
    kind: tuple[str, bool] | None = None
    for row in rows:
        if row.kind == "comment":
            yield [row]
            continue
        group = "step" if row.kind == "statement" else row.kind, row.kind != "close"
        if group != kind and region:
            yield region
            region = []
        kind = group
        region.append(row)
    if region:
        yield region


def _place(region: list[TextRow], placed: dict[int, list[int]]) -> None:
    """The columns of all cells of a region."""
    heads = _head_columns(region)
    shifts: dict[int, int] = {}
    for row in region:
        placed[id(row)] = [_start(row, placed)]
        shifts[id(row)] = placed[id(row)][0] - row.cells[0].column
    before = _wishes(region, shifts)
    for row in region:
        for number, cell in enumerate(row.cells[1:2], 1):
            least, wish = _needed(row, number, placed), cell.column + shifts[id(row)]
            if cell.head:
                placed[id(row)].append(max(heads[id(row)], least))
            elif cell.fixed is not None:
                in_line = wish > cell.fixed and wish >= least and wish in before
                placed[id(row)].append(wish if in_line else max(cell.fixed, least))
        if row.anchor < len(placed[id(row)]):
            shifts[id(row)] = placed[id(row)][row.anchor] - row.cells[row.anchor].column
    roles: dict[Role, list[tuple[TextRow, int]]] = {}
    for row in region:
        for number in range(len(placed[id(row)]), len(row.cells)):
            roles.setdefault(row.cells[number].role, []).append((row, number))
    wishes = _wishes(region, shifts)
    for role in sorted(roles):
        for (row, _), column in zip(roles[role], _columns(roles[role], shifts, placed, wishes), strict=True):
            placed[id(row)].append(column)


def _wishes(region: list[TextRow], shifts: dict[int, int]) -> set[int]:
    """The columns in which cells stand in line on purpose, if their rows are moved by ``shifts``."""
    cells = [(cell.column + shifts[id(row)], cell.gap) for row in region for cell in row.cells[1:]]
    count, on_purpose = Counter(column for column, _ in cells), {column for column, gap in cells if gap > 1}
    return {column for column in on_purpose if count[column] > 1}


def _start(row: TextRow, placed: dict[int, list[int]]) -> int:
    """Where a row begins."""
    if row.column is not None:
        return row.column
    head = row.of
    if head is None:
        return row.cells[0].column
    begin = placed[id(head)][0]
    offset = row.cells[0].column - head.cells[0].column
    return begin + (offset if offset >= INDENT else CONTINUED)


def _needed(row: TextRow, number: int, placed: dict[int, list[int]]) -> int:
    """The first column that a cell may have."""
    before = row.cells[number - 1].text
    begin = 0 if "\n" in before else placed[id(row)][number - 1]
    return begin + len(_last_line(before)) + row.cells[number].least


def _last_line(text: str) -> str:
    return text.rpartition("\n")[2]


def _columns(
    entries: list[tuple[TextRow, int]], shifts: dict[int, int], placed: dict[int, list[int]], wishes: set[int]
) -> list[int]:
    """The columns of cells of one role."""
    cells: list[LineCell] = [row.cells[number] for row, number in entries]
    needed = [_needed(row, number, placed) for row, number in entries]
    wanted = [cell.column + shifts[id(row)] for (row, _), cell in zip(entries, cells, strict=True)]
    here = Counter(wish for wish, least in zip(wanted, needed, strict=True) if wish >= least)
    known = {wish for wish, count in here.items() if count > 1}
    farthest = FARTHEST_POINT if entries[0][0].cells[entries[0][1]].role[1] == POINTS else FARTHEST
    together = _together(needed, farthest)
    found: list[int] = []
    for cell, least, wish in zip(cells, needed, wanted, strict=True):
        if wish in wishes and wish > least - cell.least:
            found.append(wish)
        elif cell.stays:
            found.append(least)
        elif known:
            fitting = [column for column in known if least <= column <= least + farthest]
            found.append(max(fitting, key=lambda column: (here[column], -column), default=least))
        else:
            found.append(together[least])
    return found


def _together(needed: Sequence[int], farthest: int) -> dict[int, int]:
    """For each of the columns that cells need at least, the one that they get: that of the farthest, for all that are
    near it; then the same for the others.
    """
    found: dict[int, int] = {}
    target = max(needed)
    for least in sorted(needed, reverse=True):
        if least < target - farthest:
            target = least
        found[least] = target
    return found


def _head_columns(region: list[TextRow]) -> dict[int, int]:
    """Where the colons of definitions stand."""
    found: dict[int, int] = {}
    long: list[TextRow] = []
    named = [row for row in region if len(row.cells) > 1 and row.cells[1].head]
    short = [row for row in named if _width(row) <= SHORT_NAME]
    widest = _in_line(short)
    far = _in_line([row for row in named if _width(row) > SHORT_NAME])

    def settle() -> None:
        longest = max((_width(each) for each in long), default=0)
        longest = far if longest < far <= longest + WIDER else longest
        found.update({id(each): (each.column or 0) + longest + 1 for each in long})
        long.clear()

    for row in named:
        if _width(row) > SHORT_NAME:
            long.append(row)
        else:
            settle()
            found[id(row)] = (row.column or 0) + widest + 1
    settle()
    return found


def _in_line(rows: Sequence[TextRow]) -> int:
    """How far the colons of ``rows`` are from where the names begin, less one: as they are if they are in line."""
    widest = max(map(_width, rows), default=0)
    distances = {row.cells[1].column - row.cells[0].column for row in rows}
    if len(distances) == 1 and len(rows) > 1 and 0 < (distance := min(distances)) - widest <= WIDER:
        return distance - 1
    return widest


def _width(row: TextRow) -> int:
    return len(row.cells[0].text)


MOST_PASSES = 12
"""Columns depend on where text stood, so a second pass may still move some; it takes three at most in practice."""


def formatted(source: SourceText, *, max_nesting: int = MAX_NESTING) -> str:
    """The script's text, formatted: its tree and its comments are the same, and formatting it again changes nothing.

    Lines end as they do in the script. Raises ScriptError as `movimentum.syntax.parser.parse` does.
    """
    parse(source, max_nesting=max_nesting)
    text = LINE_END.sub("\n", source.text)
    for _ in range(MOST_PASSES):
        before, text = text, "".join(line + "\n" for line in lines_of(rows_of(text)))
        if text == before:
            break
    return text.replace("\n", source.newline)


# --- from one layout of a text to another


LINES = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")


def line_edits(before: str, after: str) -> list[Edit]:
    """The edits of whole lines that make ``after`` of ``before``."""
    old, new = LINES.findall(before), LINES.findall(after)
    starts = [0]
    for line in old:
        starts.append(starts[-1] + len(line))
    matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
    return [
        Edit(Span(starts[i], starts[j]), "".join(new[k:m]))
        for tag, i, j, k, m in matcher.get_opcodes()
        if tag != "equal"
    ]
