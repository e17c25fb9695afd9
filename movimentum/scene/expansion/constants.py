"""The values of constants: of ``.let``, of a part's arguments, of ``--set``."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import repeat

from movimentum.diagnostics import Label, replacement
from movimentum.scene.constants import exact_value
from movimentum.scene.cords import CORD
from movimentum.scene.expansion.placement import stated
from movimentum.scene.expansion.rewriting import Rewriter
from movimentum.scene.expansion.scopes import ConstantEntry, Value
from movimentum.scene.expansion.table_files import TableFiles
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference
from movimentum.scene.lower import Context, lower
from movimentum.scene.pairs import PAIRED
from movimentum.scene.resolve import CONTACT, ComponentUse, Meanings
from movimentum.syntax.expression_tree import (
    Blank,
    Call,
    Clock,
    Constant,
    Element,
    Expression,
    Member,
    Name,
    Transition,
    Vector,
    postorder,
)
from movimentum.syntax.tree import Text
from movimentum.syntax.vocabulary import VECTOR_MEMBERS


class Constants:
    """Finds the values of constants, each once, in the order in which they depend on each other."""

    def __init__(self, findings: Findings, tables: TableFiles) -> None:
        self.findings = findings
        self.rewriter = Rewriter(findings, self.value_of, self.whole_number, tables)
        self._failed: set[int] = set()

    def value_of(self, entry: ConstantEntry) -> Value | None:
        """The value of a constant; None after an error (reported once), a cycle among them (``name/cycle``)."""
        waiting = [entry]
        path: dict[int, ConstantEntry] = {}
        while waiting:
            current = waiting[-1]
            if current.value is not None or id(current) in self._failed:
                waiting.pop()
                path.pop(id(current), None)
                continue
            first = id(current) not in path
            path[id(current)] = current
            needed = [each for each in _needed(current) if each.value is None and id(each) not in self._failed]
            if needed and first:
                around = [each for each in needed if id(each) in path]
                if around:
                    self._report_cycle(around[0], list(path.values()))
                    self._failed.update(path)
                    return None
                waiting.extend(needed)
                continue
            self._evaluate(current)
        return entry.value

    def _report_cycle(self, first: ConstantEntry, path: list[ConstantEntry]) -> None:
        cycle = path[path.index(first) :]
        names = " → ".join(f"`{each.name}`" for each in (*cycle, first))
        if len(cycle) > 6:
            names = f"`{first.name}` → … → `{first.name}` ({len(cycle)} constants)"
        self.findings.error(
            "name/cycle",
            f"the constant `{first.name}` depends on itself: {names}",
            first.span,
            labels=tuple(Label(each.span, "needed here") for each in cycle[1:6]),
        )

    def _evaluate(self, entry: ConstantEntry) -> None:
        if isinstance(entry.expression, Text):
            entry.value = entry.expression
            return
        assert entry.expression is not None
        name = entry.expression.name if isinstance(entry.expression, Name) else None
        given = entry.scope.constant(name) if name is not None else None
        if given is not None and isinstance(given.value, Text):
            entry.value = given.value
            return
        node = self.rewriter.expression(entry.expression, entry.scope)
        entry.value = None if node is None else self.evaluated(node, f"the constant `{entry.name}`", entry)
        if entry.value is None:
            self._failed.add(id(entry))

    def evaluated(self, node: Expression, what: str, entry: ConstantEntry | None = None) -> Value | None:
        """The value of a rewritten constant expression; None after an error."""
        value = exact_value(node)
        if value is not None:
            return (Constant(value),)
        if isinstance(node, Vector):
            parts = [exact_value(part) for part in node.components[:2]]
            if len(node.components) == 2 and parts[0] is not None and parts[1] is not None:
                return Constant(parts[0]), Constant(parts[1])
        nodes = list(postorder(node))
        meanings: Meanings = {}
        for each in nodes:
            if isinstance(each, Member) and each.name in VECTOR_MEMBERS:
                meanings[id(each)] = ComponentUse(VECTOR_MEMBERS[each.name])
            elif varies(each):
                self._report_varying(each, what, entry)
                return None
        errors = self.findings.errors
        inference = Inference(self.findings)
        inference.expression(nodes, meanings)
        inference.finish()
        if self.findings.errors != errors:
            return None
        made = lower(nodes, meanings, Context(inference, self.findings, repeat(0)))
        if made is None or any(part.value is None for part in made):
            return None
        return tuple(map(stated, made))

    def _report_varying(self, node: Expression, what: str, entry: ConstantEntry | None) -> None:
        if isinstance(node, Name):
            known = [] if entry is None else [name for name in entry.scope.names() if name != entry.name]
            guess = self.findings.nearest(node.name, known)
            self.findings.error(
                "name/unknown-constant",
                f"there is no constant `{node.name}`",
                node.span,
                helps=(replacement(f"did you mean `{guess}`?", node.span, guess),)
                if guess
                else (f"{what} may use only numbers and constants; `.let {node.name} = …;` makes one",),
            )
            return
        self.findings.error("kind/not-constant", f"{what} must not change with time", node.span)

    def whole_number(self, node: Expression, what: str) -> int | None:
        """The whole number that a rewritten expression is; None after an error."""
        value = self.evaluated(node, what)
        if value is None or isinstance(value, Text):
            return None
        number = value[0].value
        if len(value) == 1 and number == int(number):
            return int(number)
        shown = "a vector" if len(value) > 1 else f"{float(number):g}"
        self.findings.error("kind/mismatch", f"{what} must be a whole number", node.span, f"this is {shown}")
        return None


def _needed(entry: ConstantEntry) -> Iterator[ConstantEntry]:
    """The constants that a constant's expression names."""
    if entry.expression is None or isinstance(entry.expression, Text):
        return
    for node in postorder(entry.expression):
        if isinstance(node, Name):
            found = entry.scope.constant(node.name)
            if found is not None:
                yield found


def varies(node: Expression) -> bool:
    """Whether an expression with this node is no constant, so that it has no value before the scene is solved."""
    match node:
        case Name() | Blank() | Member() | Transition() | Element():
            return True
        case Clock():
            return node.name != "pi"
        case Call():
            return node.function in {"i", "d", CORD, *PAIRED, *CONTACT}
        case _:
            return False
