"""A script that was read and resolved, and the names and expressions that its motions can be asked for."""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.api.arguments import Limits, errors_in_python
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import NoSolutionError, ScriptError, UnknownNameError, errors_in
from movimentum.expressions import Expr, symbol
from movimentum.query import Query, make_query
from movimentum.records import dataclass, field, replace
from movimentum.scene.model import AnchorCoordinate, Scene, ThingAngle, ThingProperty, VariableComponent
from movimentum.settings import FailurePolicy
from movimentum.source import SourceText, Span
from movimentum.syntax.suggest import nearest
from movimentum.text import listed
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import ScriptFiles
from movimentum.workflow.stages import Solution, arranged, examined

if TYPE_CHECKING:
    from movimentum.timeline.model import Timeline

PROPERTIES = ("opacity", "red", "green", "blue", "visible", "layer", "scale")
_DOTTED = re.compile(r"[A-Za-z]\w*(?:\[\d+\]|\.[A-Za-z]\w*)*", re.ASCII)


def choices_of(limits: Limits, settings: tuple[tuple[str, str | Expr], ...] = ()) -> Choices:
    """The choices that stand for ``limits`` and for constants that are set."""
    return Choices(
        settings=settings,
        max_frames=limits.frames,
        max_nesting=limits.nesting,
        max_operations=limits.operations,
        max_digits=limits.digits,
    )


@dataclass(frozen=True, eq=False, repr=False)
class UnderstoodScript:
    """A motion's view of its script; see `movimentum.Script`."""

    source: SourceText
    scene: Scene
    limits: Limits
    _files: ScriptFiles = field(default_factory=ScriptFiles)

    @property
    def text(self) -> str:
        """The script's text."""
        return self.source.text

    @property
    def path(self) -> Path | None:
        """The file's path; None for a text without a name, and for standard input."""
        return None if self.source.path.startswith("<") else Path(self.source.path)

    @property
    def name(self) -> str:
        """Its short name: the file's name."""
        return self.source.path if self.path is None else self.path.name

    @cached_property
    def timeline(self) -> Timeline:
        """The scene in time: segments, and exact frame times. Raises `ScriptError` for more frames than the limit."""
        with errors_in_python(), errors_in(self.source):
            return arranged(self.scene, choices_of(self.limits))

    @property
    def things(self) -> tuple[str, ...]:
        """The names of its things, in the order of definition."""
        return tuple(thing.name for thing in self.scene.things)

    @property
    def constants(self) -> dict[str, float | tuple[float, float]]:
        """Its constants by name, with their values; a vector is a pair.

        >>> import movimentum as mv
        >>> mv.loads(".let R = 30; .let at = [10, R]; @0 x = R;", R=40).constants
        {'R': 40.0, 'at': (10.0, 40.0)}
        """
        found: dict[str, float | tuple[float, float]] = {}
        for constant in self.scene.constants:
            x, *rest = (float(part.value) for part in constant.value)
            found[constant.name] = (x, rest[0]) if rest else x
        return found

    @cached_property
    def names(self) -> Names:
        """The names and expressions that its motions have values for."""
        return Names(self.scene, choices_of(self.limits), self.name)

    @cached_property
    def _solutions(self) -> dict[Choices, Solution]:
        return {}


def solution_of(script: UnderstoodScript, choices: Choices) -> Solution:
    """The motion of a script and its diagnostics; solved once for each frame rate and accuracy."""
    known = script._solutions  # pyright: ignore[reportPrivateUsage]
    found = known.get(choices)
    if found is None:
        timeline = script.timeline if choices.fps is None else arranged(script.scene, choices)
        found = known[choices] = examined(timeline, choices)
    return found


def accepted(script: UnderstoodScript, choices: Choices) -> Solution:
    """The same; `ScriptError` where the script contradicts itself, `NoSolutionError` where ``choices.on_failure`` is to
    stop.
    """
    with errors_in(script.source):
        solution = solution_of(script, replace(choices, on_failure=FailurePolicy.STOP))
        if solution.fault == 1:
            raise ScriptError(solution.diagnostics)
        if solution.fault and choices.on_failure is FailurePolicy.STOP:
            raise NoSolutionError(solution.diagnostics)
    return solution


@dataclass(frozen=True, slots=True, eq=False)
class Names:
    """The names and expressions of a scene, whose title is ``title``; each is resolved once."""

    scene: Scene
    choices: Choices
    title: str
    known: dict[str, Query] = field(default_factory=dict[str, Query])

    def query(self, text: str) -> Query:
        """The query for a name or an expression. Raises `UnknownNameError` for an unknown name, `ScriptError` for an
        invalid expression.
        """
        found = self.known.get(text)
        if found is None:
            name = text.strip()
            expressions = self._named(name)
            if expressions is None:
                expressions = self._understood(text)
            found = self.known[text] = make_query(self.scene, name, expressions)
        return found

    def has(self, name: object) -> bool:
        """Whether ``name`` is a name or an expression that has values."""
        try:
            return isinstance(name, str) and bool(self.query(name).expressions)
        except ScriptError:
            return False

    def _named(self, name: str) -> tuple[Expr, ...] | None:
        """The expressions of a plain name; None for anything else."""
        if _DOTTED.fullmatch(name) is None:
            return None
        words = name.split(".")
        splits = [(".".join(words[:count]), words[count:]) for count in range(len(words), 0, -1)]
        first, rest = next((each for each in splits if each[0] in self.scene.variables), (words[0], words[1:]))
        payloads = self._of_variable(first, rest)
        known = {item.name: item for item in self.scene.things}
        thing, rest = next(((known[each], more) for each, more in splits if each in known), (None, rest))
        if thing is not None and rest:
            lengths = [item.name.count(".") + 1 for item in thing.anchors]  # a body's have dots: `Wheel.Slot[2].A`
            found = [i for i, item in enumerate(thing.anchors) if ".".join(rest[: lengths[i]]) == item.name]
            if found:
                anchor = found[0]
                axes = _axes(rest[lengths[anchor] :])
                payloads = None if axes is None else tuple(AnchorCoordinate(thing.number, anchor, a) for a in axes)
            elif rest == ["angle"] and thing.is_body:
                payloads = (ThingAngle(thing.number),)
            elif len(rest) == 1 and rest[0] in PROPERTIES:
                payloads = (ThingProperty(thing.number, rest[0]),)
        return None if payloads is None else tuple(map(symbol, payloads))

    def _of_variable(self, name: str, rest: list[str]) -> tuple[Hashable, ...] | None:
        variable = self.scene.variables.get(name)
        if variable is None:
            return None
        if not variable.is_vector:
            return None if rest else (VariableComponent(name, None),)
        axes = _axes(rest)
        return None if axes is None else tuple(VariableComponent(name, axis) for axis in axes)

    def _understood(self, text: str) -> tuple[Expr, ...]:
        """An expression, as in a claim of the first step: ``.t`` counts from there."""
        from movimentum.query import NOT_A_READING, parsed_statement, understood
        from movimentum.workflow.stages import rebuilding

        source = SourceText('motion["…"]', text)
        try:
            statement = parsed_statement(f"{text} = 0;", text)
            rebuild = rebuilding(self.scene.source, self.choices)
            found = () if statement is None else understood(statement.left, 0, rebuild)
        except ScriptError as error:
            item = error.diagnostics[0]
            if item.code.startswith("name/") or item.code == "claim/undetermined":
                raise self._unknown(text, item) from None
            if item.code == NOT_A_READING:
                message = "a derivative or an integral is not read off a motion but solved for"
                helps = ('`motion.velocity("…")` is a derivative', "or give it a name in the script: `v = …;`")
                item = replace(item, message=message, helps=helps)
            raise ScriptError([replace(item, labels=())], source) from None
        if not found:
            item = Diagnostic("name/expression", Severity.ERROR, f"`{text}` is not an expression", Span(0, len(text)))
            raise ScriptError([item], source)
        return found

    def _unknown(self, text: str, item: Diagnostic) -> UnknownNameError:
        """The error for an unknown name, with suggestions."""
        word = text.strip()
        if _DOTTED.fullmatch(word) is not None:
            guess = nearest(word, self.all())
            found = [f"`{name}`" for name in self.all()]
            owned = [name for name in found if name.startswith(f"`{word.split('.')[0]}.")]
            known = f"there are {listed(owned or found, 8)}" if found else "nothing has a name"
            helps = (f"did you mean `{guess}`?",) if guess else (known,)
            item = Diagnostic("name/unknown", Severity.ERROR, f"there is no `{word}`", item.span, helps=helps)
        return UnknownNameError([replace(item, labels=())], SourceText('motion["…"]', text))

    def all(self) -> Iterator[str]:
        """Every anchor, angle and variable by name, in the order of definition."""
        for thing in self.scene.things:
            if thing.is_body:
                yield from (f"{thing.name}.{anchor.name}" for anchor in thing.anchors)
                yield f"{thing.name}.angle"
        yield from self.scene.variables


def _axes(rest: list[str]) -> tuple[int, ...] | None:
    """Both axes of a vector, or the one that ``.x`` or ``.y`` names; None for anything else."""
    if not rest:
        return 0, 1
    return ("xy".index(rest[0]),) if rest in (["x"], ["y"]) else None
