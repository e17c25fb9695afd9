"""From what stands in ``motion["…"]`` to what is read off a motion: names, and expressions of the language."""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterator

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError, UnknownNameError
from movimentum.expressions import Expr, symbol
from movimentum.query import Query, make_query
from movimentum.records import dataclass, field, replace
from movimentum.scene.model import AnchorCoordinate, Scene, ThingAngle, ThingProperty, VariableComponent
from movimentum.source import SourceText, Span
from movimentum.syntax.suggest import nearest
from movimentum.text import listed
from movimentum.workflow.choices import Choices

PROPERTIES = ("opacity", "red", "green", "blue")
_DOTTED = re.compile(r"[A-Za-z]\w*(?:\[\d+\]|\.[A-Za-z]\w*)*", re.ASCII)


@dataclass(frozen=True, slots=True, eq=False)
class Names:
    """Everything that can be asked of a scene, which is called ``title``; each is understood once."""

    scene: Scene
    choices: Choices
    title: str
    known: dict[str, Query] = field(default_factory=dict[str, Query])

    def query(self, text: str) -> Query:
        """What a name or an expression stands for; `UnknownNameError` for a name that the scene does not have,
        `ScriptError` for what is no expression.
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
            anchor = next((i for i, item in enumerate(thing.anchors) if item.name == rest[0]), None)
            if anchor is not None:
                axes = _axes(rest[1:])
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
        """That a name means nothing, with what may be meant."""
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
