"""The product of the expansion: first-edition items with names and constants resolved, steps in order of time."""

from __future__ import annotations

from fractions import Fraction

from movimentum.records import dataclass, field
from movimentum.scene.expansion.placement import CopyFrame
from movimentum.scene.expansion.table_files import Tables
from movimentum.source import SourceText, Span
from movimentum.syntax.expression_tree import Constant
from movimentum.syntax.tree import ClaimStatement, ConfigStatement, Definition, FilmLoop, Statement, ViewStatement


@dataclass(frozen=True, slots=True)
class NamedConstant:
    """A constant of the script: ``value`` has one component or two.

    ``least`` and ``most`` are its ``.range``, ``unit`` its ``.unit``; ``expression`` is where it is given a value.
    """

    name: str
    value: tuple[Constant, ...]
    span: Span
    expression: Span
    least: float | None = None
    most: float | None = None
    unit: str = ""


@dataclass(frozen=True, slots=True)
class StepAt:
    """A step; ``span`` is its header's."""

    time: Fraction
    span: Span


@dataclass(frozen=True, slots=True)
class Timed:
    """A statement or claim of step number ``step``, which its own text's next step follows at ``until`` (None: it has
    no length, as the last step of all).
    """

    statement: Statement | ClaimStatement
    step: int
    until: Fraction | None


@dataclass(frozen=True, slots=True)
class TimedView:
    """What the camera shows from ``begin`` on (None: from the first frame); the step ends at ``until``, as above."""

    statement: ViewStatement
    begin: Fraction | None
    until: Fraction | None


@dataclass(frozen=True, slots=True)
class BodyShape:
    """A shape of a ``.body``: its definition, under the name that it has in the whole script, and the ``placement`` of
    its copy. ``minus``: it is cut out. ``prefix``: what its anchors are called after in the body.
    """

    definition: Definition
    placement: CopyFrame
    minus: bool
    prefix: str


@dataclass(frozen=True, slots=True)
class Expanded:
    """A script without constants, parts, copies and loops.

    ``early``: the first statement before the first step, if any. ``placements`` are those of things of placed copies,
    by name. ``film_loops``: where the film begins again, with the number of the step (-1: before the first).
    ``views``: what the camera shows, in the order written. ``tables`` are those that it reads.
    """

    source: SourceText
    configs: tuple[ConfigStatement, ...]
    definitions: tuple[Definition, ...]
    steps: tuple[StepAt, ...]
    statements: tuple[Timed, ...]
    constants: tuple[NamedConstant, ...] = ()
    placements: dict[str, CopyFrame] = field(default_factory=dict[str, CopyFrame])
    early: Statement | ClaimStatement | None = None
    film_loops: tuple[tuple[FilmLoop, int], ...] = ()
    views: tuple[TimedView, ...] = ()
    tables: Tables = field(default_factory=Tables)
