"""The lines of a formatted text, before their columns are decided.

The author's line breaks stay, except that a step, and the contents of a block over several lines, begin a line of their
own.
"""

from __future__ import annotations

from bisect import bisect_right

from movimentum.formatting.elements import LINE_END, STATEMENTS, Glue, Leaf, elements_of
from movimentum.records import dataclass, field

TAB = 4
"""How wide a tab is taken to be."""


@dataclass(frozen=True, slots=True)
class Spaces:
    """The spaces in front of a cell: from ``least`` to ``most`` as the author has it, otherwise ``usual``."""

    least: int
    usual: int
    most: int


ITEM_GAP = Spaces(2, 3, 6)
COMMENT_GAP = Spaces(3, 4, 6)
POINT_GAP = Spaces(2, 2, 3)
OPTION_GAP = Spaces(2, 2, 4)
SPACE_GAP = Spaces(1, 1, 1)
REFERRED_GAP = Spaces(1, 1, 2)
"""For options behind points of other things."""

Role = tuple[int, int, int]
"""What a column is for: the number of the item in its line, the part of the item and its number. Cells with equal roles
stand below one another. Roles grow along a line."""

_COMMENT: Role = (10**9, 0, 0)
_BODY: Role = (0, 0, 1)
"""The first statement behind a step."""
POINTS = 3
_PARTS = {Glue.HEAD: 2, Glue.EQUALS: 2, Glue.POINT: POINTS, Glue.REFERENCE: 2, Glue.OPTION: 4}
_LATER = 5
"""What stands behind options and is none."""


@dataclass(slots=True)
class LineCell:
    """Text that begins a column. ``least``: how many spaces stand in front of it at least; ``column``: where it stood.
    ``stays``: it moves only to where it stood, in line with others. ``head``: it begins with the colon of a thing.
    ``fixed``: where it stands, unless there is no room. ``gap``: how many spaces stood in front of it.
    """

    role: Role
    text: str
    column: int
    least: int = 0
    stays: bool = False
    head: bool = False
    fixed: int | None = None
    gap: int = 0


@dataclass(slots=True)
class TextRow:
    """One line of the text. ``kind``: of its first item; rows of one kind may be in line with each other. ``column``:
    where it begins; None for the continuation of the item in the row ``of``. ``anchor``: with which of the cells the
    others move. ``blank``: an empty line comes before.
    """

    kind: str
    column: int | None
    cells: list[LineCell] = field(default_factory=list[LineCell])
    blank: bool = False
    of: TextRow | None = None
    anchor: int = 0


def rows_of(text: str) -> list[TextRow]:
    """The rows of a text without errors."""
    writer = _Typesetter(text)
    found = elements_of(text)
    for number, element in enumerate(found):
        writer.add(element, found[number + 1] if number + 1 < len(found) else None)
    return writer.rows


def _is_broken(element: Leaf, before: Leaf | None) -> bool:
    """Whether an element begins a line."""
    if before is None or element.begins or before.text.startswith("//"):
        return True
    if element.kind == "close":
        return before.comment and element.line_ends > 0
    joins = element.type in ("SEMICOLON", "COMMA", "LBRACE", "COLON")
    return element.line_ends > 0 and not joins


class _Typesetter:
    """Makes rows of elements."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.starts = [0, *(found.end() for found in LINE_END.finditer(text))]
        self.tabs = "\t" in text
        self.rows: list[TextRow] = []
        self.item = 0
        self.part = (1, 0)
        self.head: TextRow | None = None
        self.before: Leaf | None = None
        self.referred = False  # whether the last cell is a point of another thing

    def add(self, element: Leaf, following: Leaf | None) -> None:
        """The next element; ``following`` is the one after it."""
        if _is_broken(element, self.before):
            self._begin(element)
        elif element.comment:
            ends = following is None or _is_broken(following, element)
            self._behind(element, ends=ends)
        elif element.kind and element.kind != "close":
            self._next_item(element)
        else:
            self._next_token(element)
        self.before = element

    def _column(self, element: Leaf) -> int:
        """Where an element stood."""
        start = self.starts[bisect_right(self.starts, element.offset) - 1]
        before = element.offset - start
        return before if not self.tabs else len(self.text[start : element.offset].expandtabs(TAB))

    def _cell(self, element: Leaf, role: Role, gap: Spaces | None = None, *, stays: bool = False) -> LineCell:
        text = element.text.rstrip() if element.text.startswith("//") else element.text
        cell = LineCell(role, text, self._column(element), 0, stays)
        if gap is not None and self.before is not None:
            before = len(self.text[self.before.offset + len(self.before.text) : element.offset].expandtabs(TAB))
            cell.gap = before
            as_it_is = gap.least <= before <= gap.most
            cell.least = before if as_it_is else gap.usual
            cell.stays = stays or (as_it_is and gap is not SPACE_GAP)
        return cell

    def _begin(self, element: Leaf) -> None:
        """A new row."""
        at_item = element.column is not None
        opening = self.before is not None and self.before.type == "LBRACE"
        blank = (
            at_item and element.line_ends > 1 and self.before is not None and not opening and element.kind != "close"
        )
        if element.comment and at_item:
            row = TextRow("comment", element.column, blank=blank)
        elif at_item:
            row = self.head = TextRow(element.kind, element.column, blank=blank)
            self.item, self.part = 0, (1, 0)
            row.anchor = 1 if element.kind in ("thing", "step") else 0
        else:
            row = TextRow(self.head.kind if self.head else "", None, of=self.head)
        self.rows.append(row)
        role = (0, 0, 0) if at_item or element.comment else (self.item, *self._role(element.glue))
        row.cells.append(self._cell(element, role))

    def _behind(self, element: Leaf, *, ends: bool) -> None:
        """A comment behind something in its line."""
        row = self.rows[-1]
        if ends and row.kind == "step" and len(row.cells) == 1 and len(row.cells[0].text) < STATEMENTS:
            row.cells.append(self._body(element))
        elif ends:
            row.cells.append(self._cell(element, _COMMENT, COMMENT_GAP))
        else:
            row.cells[-1].text += " " + element.text

    def _next_item(self, element: Leaf) -> None:
        """An item behind another one in its line, or behind a step, or behind a comment."""
        row = self.rows[-1]
        self.part = (1, 0)
        if row.kind == "comment" and len(row.cells) == 1:
            row.kind, self.item, self.head = element.kind, 0, row
            row.cells[-1].text += " " + element.text
        elif self.before is not None and self.before.type == "LBRACE":
            self.item += 1
            row.cells[-1].text += " " + element.text
        elif row.kind == "step" and len(row.cells) == 1:
            self.item = 0
            row.cells.append(self._body(element))
        else:
            self.item += 1
            row.cells.append(self._cell(element, (self.item, 0, 0), ITEM_GAP))

    def _body(self, element: Leaf) -> LineCell:
        """The first element after a step, in its line."""
        cell = self._cell(element, _BODY, SPACE_GAP)
        cell.fixed = element.column
        return cell

    def _next_token(self, element: Leaf) -> None:
        last = self.rows[-1].cells[-1]
        glue = element.glue
        if self.before is not None and self.before.comment and glue is Glue.NOTHING and element.text not in ";,)]":
            glue = Glue.SPACE
        if glue is Glue.NOTHING:
            last.text += element.text
        elif glue in (Glue.SPACE, Glue.ITEM):
            last.text += " " + element.text
        else:
            part, number = self._role(glue)
            gap, stays = SPACE_GAP, True
            if glue is Glue.POINT:
                gap, stays = POINT_GAP, False
            elif glue is Glue.OPTION and number == 0:
                gap, stays = (REFERRED_GAP if self.referred else OPTION_GAP), False
            cell = self._cell(element, (self.item, part, number), gap, stays=stays)
            cell.head = glue is Glue.HEAD and self.item == 0
            self.referred = glue is Glue.REFERENCE
            self.rows[-1].cells.append(cell)

    def _role(self, glue: Glue) -> tuple[int, int]:
        """The next part of an item: 1 its beginning, 2 a colon or a sign, 3 points, 4 options, 5 points behind them."""
        part, number = self.part
        wanted = max(_PARTS.get(glue, part), part)
        if _PARTS.get(glue, part) < part:
            wanted = _LATER
        self.part = (wanted, number + 1 if wanted == part else 0)
        return self.part
