"""Expands a script to first-edition items: copies, loops and constants written out, steps in order of time."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction

from movimentum.cancellation import look
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.errors import MovimentumError, UsageError
from movimentum.expressions import Expr
from movimentum.records import dataclass, field, replace
from movimentum.scene.constants import exact
from movimentum.scene.expansion.bodies import BODY, join_shapes
from movimentum.scene.expansion.constants import Constants
from movimentum.scene.expansion.declaring import Body, Declarer, Made, TooMany
from movimentum.scene.expansion.includes import Includer, ReadText
from movimentum.scene.expansion.placement import CopyFrame, local_in, stated, statement_in
from movimentum.scene.expansion.product import BodyShape, Expanded, NamedConstant, StepAt, Timed, TimedView
from movimentum.scene.expansion.scopes import ConstantEntry, Scope
from movimentum.scene.expansion.table_files import ReadTable, TableFiles
from movimentum.scene.expansion.writing import ItemWriter
from movimentum.scene.findings import Findings
from movimentum.source import SourceText, Span, Unfolding
from movimentum.syntax.parser import parse
from movimentum.syntax.suggest import nearest
from movimentum.syntax.tree import (
    ClaimStatement,
    ConfigStatement,
    Definition,
    FilmLoop,
    Let,
    ScriptTree,
    Statement,
    StepHeader,
    Text,
    ViewStatement,
)
from movimentum.text import fraction_text


@dataclass(slots=True)
class _StepStatement:
    """A statement and the step of its own text: its number there, None before the first step."""

    statement: Statement | ClaimStatement
    step: int | None


@dataclass(slots=True)
class _Strand:
    """The steps of one text: the script's or a copy's, with the statements in them."""

    scope: Scope
    steps: list[StepAt] = field(default_factory=list[StepAt])
    said: list[_StepStatement] = field(default_factory=list[_StepStatement])


def expand(
    script: ScriptTree,
    source: SourceText,
    findings: Findings,
    read_text: ReadText,
    settings: Mapping[str, str | Expr],
    added: Sequence[tuple[int, Statement | ClaimStatement]] = (),
    read_table: ReadTable | None = None,
) -> Expanded:
    """``script`` written out, with statements ``added`` to the ends of steps, by number.

    ``settings``: constants by name, as expressions (texts, or already lowered), that take the place of its own.

    Errors go to ``findings``, at places in the text of the result. Raises `UsageError` (``usage/constant``) for a
    setting of a constant that does not exist, or that is no expression.
    """
    unfolding = Unfolding(source)
    tables = TableFiles(findings, source, read_table)
    constants = Constants(findings, tables)
    declarer = Declarer(findings, constants, unfolding)
    scope = Scope(source)
    expansion = _Expansion(findings, constants, scope)
    own = tuple(item for item in script.items if isinstance(item, Let))
    try:
        Includer(declarer, unfolding, read_text).take(script.items, scope, scope, (source.path,))
        for item in own:
            declarer.let(item, scope)
        _set(settings, scope, unfolding)
        body = declarer.body(tuple(item for item in script.items if not isinstance(item, Let)), scope)
        joined = join_shapes(body, constants.rewriter, findings)
        expansion.body(body, expansion.strand(scope))
    except TooMany:
        return Expanded(unfolding.text(), (), (), (StepAt(Fraction(0), Span(0, 0)),), ())
    findings.constants, findings.things = tuple(scope.constants), frozenset(scope.entries)
    named = tuple(expansion.named(scope.constants.values()))
    steps, statements, early = expansion.in_order()
    if added:
        more = expansion.added(added, scope, steps)
        statements = tuple(sorted((*statements, *more), key=lambda each: each.step))
    constants.rewriter.finish()
    return Expanded(
        source=unfolding.text(),
        configs=tuple(expansion.configs),
        definitions=tuple(expansion.all_definitions(joined)),
        steps=steps,
        statements=statements,
        constants=named,
        placements=expansion.placements,
        early=early,
        film_loops=tuple(expansion.film_loops),
        views=tuple(expansion.views()),
        tables=tables.found,
    )


def _set(settings: Mapping[str, str | Expr], scope: Scope, unfolding: Unfolding) -> None:
    """Give constants other expressions."""
    for name, text in settings.items():
        entry = scope.constants.get(name)
        if entry is None:
            guess = nearest(name, scope.constants)
            known = ", ".join(f"`{each}`" for each in scope.constants)
            helps = f"did you mean `{guess}`?" if guess else f"its constants are {known}" if known else None
            helps = helps or "`.let R = 50;` in the script makes one"
            raise _usage(f"the script has no constant `{name}`", helps)
        if isinstance(text, Expr):
            scope.constants[name] = ConstantEntry(name, stated(text), scope, entry.span, options=entry.options)
            continue
        file = SourceText(f"<{name}>", f".let {name} = {text};")
        try:
            (item,) = parse(file).items
        except (MovimentumError, ValueError):
            item = None
        if not isinstance(item, Let) or item.name != name:
            raise _usage(f"`{text}` is not a constant expression", f"write a number, such as `{name}=60`")
        place = Scope(file, unfolding.enter(file, Span(0, len(file.text)), "", entry.span), outer=scope)
        scope.constants[name] = ConstantEntry(name, item.value, place, entry.span, options=entry.options)


def _usage(message: str, help_: str) -> UsageError:
    return UsageError([Diagnostic("usage/constant", Severity.ERROR, message, helps=(help_,))])


class _Expansion:
    def __init__(self, findings: Findings, constants: Constants, scope: Scope) -> None:
        self.findings = findings
        self.constants = constants
        self.writer = ItemWriter(findings, constants)
        self.script = scope
        self.configs: list[ConfigStatement] = []
        self.definitions: list[Definition] = []
        self.shapes: dict[str, BodyShape] = {}
        self.placements: dict[str, CopyFrame] = {}
        self.film_loops: list[tuple[FilmLoop, int]] = []
        self._views: list[tuple[ViewStatement, int]] = []
        self._strands: list[_Strand] = []

    def strand(self, scope: Scope) -> _Strand:
        """The steps of a text, which begins here."""
        self._strands.append(_Strand(scope))
        return self._strands[-1]

    def body(self, body: Body, strand: _Strand) -> None:
        """Write out the items of a body."""
        scope = body.scope
        for item in body.items:
            look()
            match item:
                case Body():
                    self.body(item, self.strand(item.scope) if item.copy else strand)
                case Made():
                    self._definition(item)
                case ConfigStatement():
                    made = self.writer.config(item, scope)
                    if made is not None:
                        self.configs.append(made)
                case StepHeader():
                    self._step(item, scope, strand)
                case Statement() | ClaimStatement():
                    said = self._placed(self.writer.statement(item, scope), scope)
                    if said is not None:
                        strand.said.append(_StepStatement(said, len(strand.steps) - 1 if strand.steps else None))
                case FilmLoop():
                    self.film_loops.append((replace(item, span=scope.place(item.span)), len(strand.steps) - 1))
                case ViewStatement():
                    shown = self.writer.view(item, scope)
                    if shown is not None:
                        self._views.append((shown, len(strand.steps) - 1))
                case _:
                    pass

    def views(self) -> Iterator[TimedView]:
        """The camera's views, with the times of the script's own steps; see `in_order`."""
        times = [step.time for step in self._strands[0].steps] if self._strands else []
        for view, step in self._views:
            later = next((time for time in times[step + 1 :] if step >= 0 and time > times[step]), None)
            yield TimedView(view, times[step] if step >= 0 else None, later)

    def _definition(self, item: Made) -> None:
        made = self.writer.definition(item)
        if made is None:
            self.findings.broken.add(item.name)
        else:
            placement = item.scope.owner.placement
            if (shape := self.constants.rewriter.shapes.get(item.name)) is not None:
                self.shapes[item.name] = BodyShape(made, placement, shape.minus, shape.prefix)
                return
            self.definitions.append(made)
            if not placement.is_here and made.shape.word != BODY:  # whose shapes are placed
                self.placements[item.name] = placement

    def all_definitions(self, joined: Mapping[str, list[str]]) -> Iterator[Definition]:
        """All things; those that are shapes of a body in it. A body that lacks one is left out."""
        for made in self.definitions:
            names = joined.get(made.name)
            if names is None:
                yield made
            elif not all(name in self.shapes for name in names) or not names:
                self.findings.broken.add(made.name)
            else:
                yield replace(made, shapes=tuple(self.shapes[name] for name in names))

    def _placed(self, said: Statement | ClaimStatement | None, scope: Scope) -> Statement | ClaimStatement | None:
        placement = scope.owner.placement
        if said is None or placement.is_here:
            return said
        is_anchor = self.constants.rewriter.is_anchor
        if isinstance(said, Statement):
            left, right = statement_in(placement, said, is_anchor)
        else:
            left, right = (local_in(placement, side, is_anchor) for side in (said.left, said.right))
        return replace(said, left=left, right=right)

    # --- steps

    def _step(self, header: StepHeader, scope: Scope, strand: _Strand) -> None:
        before = strand.steps[-1] if strand.steps else None
        span = scope.place(header.span)
        node = self.constants.rewriter.expression(header.time, scope)
        value = None if node is None else exact(node, "a step's time", self.findings)
        last = before.time if before is not None else Fraction(0)
        if value is None:
            strand.steps.append(StepAt(last, span))
            return
        time = last + value if header.relative else value
        if before is not None and time < before.time:
            self.findings.error(
                "timeline/order",
                f"this step is at {fraction_text(time)}, earlier than the previous step",
                span,
                labels=(Label(before.span, f"at {fraction_text(before.time)}"),),
                helps=("write the steps in the order of their times",),
            )
        strand.steps.append(StepAt(time, span))

    def in_order(self) -> tuple[tuple[StepAt, ...], tuple[Timed, ...], Statement | ClaimStatement | None]:
        """All steps and, by step, the statements: those of copies first; and what comes before the first step.

        Steps of a part count from the script's first one; what a part says before its first step holds from there.
        """
        script, *copies = self._strands or [_Strand(self.script)]
        early = next((each.statement for each in script.said if each.step is None), None)
        first = script.steps[0].time if script.steps else Fraction(0)
        times = {step.time for step in script.steps}
        steps = [(step, index) for index, step in enumerate(script.steps)]
        for strand in copies:
            strand.steps = [StepAt(first + step.time, step.span) for step in strand.steps]
            for step in strand.steps:
                if step.time not in times:
                    times.add(step.time)
                    steps.append((step, -1))
        steps.sort(key=lambda each: (each[0].time, each[1]))
        if not steps and any(strand.said for strand in copies):
            return (), (), None
        order = [step for step, _ in steps]
        own = [index for index, (_, number) in enumerate(steps) if number >= 0]
        self.film_loops = [(item, own[number] if number >= 0 else -1) for item, number in self.film_loops]
        end = order[-1].time if order else Fraction(0)
        found: list[Timed] = []
        for strand in copies:
            found.extend(_timed_copy(strand, order, end))
        for each in script.said:
            number = each.step or 0
            following = script.steps[number + 1].time if number + 1 < len(script.steps) else None
            if following is None and own and end > order[own[number]].time:
                following = end
            found.append(Timed(each.statement, own[number] if own else 0, following))
        found.sort(key=lambda each: each.step)
        return tuple(order), tuple(found), early

    def added(
        self, added: Sequence[tuple[int, Statement | ClaimStatement]], scope: Scope, steps: Sequence[StepAt]
    ) -> Iterator[Timed]:
        """Statements that do not stand in the script."""
        for step, item in added:
            made = self.writer.statement(item, scope)
            if made is not None:
                yield Timed(made, step, steps[step + 1].time if step + 1 < len(steps) else None)

    # --- constants

    def named(self, entries: Iterable[ConstantEntry]) -> Iterator[NamedConstant]:
        """The script's constants with their values, ranges and units."""
        for entry in list(entries):
            value = self.constants.value_of(entry)
            options = self.writer.let_options(entry)
            if value is None or isinstance(value, Text) or options is None:
                continue
            expression = entry.expression
            place = entry.span if expression is None else entry.scope.place(expression.span)
            least, most, unit = options
            yield NamedConstant(entry.name, value, entry.span, place, least, most, unit)


def _timed_copy(strand: _Strand, order: list[StepAt], end: Fraction) -> Iterator[Timed]:
    """A copy's statements, in the script's steps."""
    times = [step.time for step in order]
    for each in strand.said:
        if each.step is None:
            time = times[0] if times else Fraction(0)
            following = strand.steps[0].time if strand.steps and strand.steps[0].time > time else None
        else:
            time = strand.steps[each.step].time
            following = strand.steps[each.step + 1].time if each.step + 1 < len(strand.steps) else None
        if following is None and end > time:
            following = end
        yield Timed(each.statement, bisect_left(times, time), following)
