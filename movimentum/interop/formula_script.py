"""Converts triangular formulas to a script: points become anchors of bars and discs, inputs become drives."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic
from movimentum.interop.formula_values import (
    course,
    first_pose,
    frame_count,
    frame_rate,
    inputs_of,
    kinds_of,
    refuse_disorder,
    shortfalls,
    time_text,
)
from movimentum.interop.formulas import Formula, Formulas, literal
from movimentum.interop.mechanisms import script_name
from movimentum.records import dataclass, field
from movimentum.syntax.printer import float_text
from movimentum.syntax.vocabulary import THING_MEMBERS, VECTOR_MEMBERS

TURN = 60
"""Degrees by which a free angle grows in a time unit."""


def formula_script(formulas: Formulas, title: str) -> tuple[str, tuple[Diagnostic, ...]]:
    """A script whose things are where the formulas say. A constant length is a bar, which keeps it. A point on no bar
    is a disc. A name with a value for each frame is driven with these values. An angle that nothing gives is an input,
    and turns once round. There is a warning if a formula has no point at a later frame.

    Raises `ScriptError` for other names that nothing gives, for lists of different lengths, and if a formula has no
    point at the first frame.
    """
    refuse_disorder(formulas)
    inputs = inputs_of(formulas)
    count = frame_count(formulas)
    start, drawn = first_pose(formulas, inputs)
    fps = frame_rate(formulas)
    writer = _Writer(formulas, drawn, fps)
    for name in inputs:
        writer.drive(name, [(0, f"{start} + {TURN}*.t" if start else f"{TURN}*.t")], float(start))
    for name, kind in kinds_of(formulas).items():
        if name in formulas.values:
            writer.give(name, kind, formulas.values[name])
    for formula in formulas.formulas:
        writer.state(formula)
    end = Fraction(count - 1) / fps if count > 1 else Fraction(360, TURN) if inputs else Fraction(0)
    return writer.text(title, inputs, end), () if inputs or count == 1 else shortfalls(formulas)


# --- what is written ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Number:
    """A length or an angle: its text in the script, and its value at the first frame."""

    text: str
    first: float
    varies: bool


@dataclass(slots=True)
class _Body:
    """A bar through points (names of the formulas), or a disc at one."""

    name: str
    points: list[str]


@dataclass(slots=True)
class _Writer:
    """Takes the formulas in their order; ``drawn`` (2,) is where each point is at the first frame."""

    formulas: Formulas
    drawn: dict[str, FloatArray]
    fps: Fraction
    bodies: list[_Body] = field(default_factory=list[_Body])
    homes: dict[str, list[_Body]] = field(default_factory=dict[str, list[_Body]])
    anchors: dict[str, str] = field(default_factory=dict[str, str])
    variables: dict[str, _Number] = field(default_factory=dict[str, _Number])
    taken: set[str] = field(default_factory=set[str])
    still: set[str] = field(default_factory=set[str])
    steps: dict[int, list[str]] = field(default_factory=dict[int, list[str]])
    statements: list[str] = field(default_factory=list[str])
    lines: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])

    def __post_init__(self) -> None:
        """Anchors have the names of their points, unless the language uses that name for something else."""
        used = {*THING_MEMBERS, *VECTOR_MEMBERS}
        for point in self.drawn:
            self.anchors[point] = script_name(point, "P", used.__contains__)
            used.add(self.anchors[point])

    def text(self, title: str, inputs: Sequence[str], end: Fraction) -> str:
        """The script."""
        for point in self.drawn:
            if point in self.still and point not in self.homes:
                self.disc(point, self._literal(point))
        counts = f"{_counted(len(self.formulas.formulas), 'formula')}, {_counted(len(self.drawn), 'point')}"
        lines = [
            f"// {title}: {counts}, {_counted(len(inputs), 'input')}.",
            "// Point P1 is the anchor P1 of every bar that it is on.",
            "",
            f".config({time_text(self.fps)});",
            "",
            *(self._definition(body) for body in self.bodies),
            *self._drawn_lines(),
            "",
            "@0",
            *self.steps.pop(0, []),
            *self.statements,
        ]
        for frame, drives in sorted(self.steps.items()):
            lines += [f"@{time_text(Fraction(frame) / self.fps)}", *drives]
        if end:
            lines.append(f"@{time_text(end)}")
        return "\n".join(lines) + "\n"

    def _definition(self, body: _Body) -> str:
        anchors = "  ".join(f"{self.anchors[point]} = {self._literal(point)}" for point in body.points)
        return f"{body.name} : {'.bar' if len(body.points) > 1 else '.disc(3)'}  {anchors};"

    def _drawn_lines(self) -> list[str]:
        """Lines between two points that belong together without a bar."""
        return [f"{self._name(f'{a}_{b}', 'L')} : .line  {self._at(a)}  {self._at(b)};" for a, b in self.lines]

    # --- what is given ----------------------------------------------------------------------------------

    def drive(self, name: str, pieces: Sequence[tuple[int, str]], first: float) -> str:
        """The variable that has the course of ``name``."""
        variable = self._name(name, "v")
        self.variables[name] = _Number(variable, first, True)
        for frame, expression in pieces:
            self.steps.setdefault(frame, []).append(f"{variable} = {expression};")
        return variable

    def give(self, name: str, kind: str, value: FloatArray) -> None:
        """A known value; a value for each frame becomes a drive."""
        if kind == "P" and value.ndim == 1:
            self.still.add(name)
        elif kind == "P":
            axes = [self.drive(f"{name}_{'xy'[k]}", course(value[:, k], self.fps), float(value[0, k])) for k in (0, 1)]
            self.disc(name, f"[{axes[0]}, {axes[1]}]")
        elif value.ndim:
            self.drive(name, course(value, self.fps), float(value[0]))
        else:
            self.variables[name] = _Number(float_text(float(value)), float(value), False)

    def _number(self, word: str) -> _Number:
        value = literal(word)
        if word in self.variables or value is None:
            return self.variables[word]
        return _Number(float_text(float(value)), float(value), False)

    # --- things and points ------------------------------------------------------------------------------

    def _name(self, word: str, prefix: str) -> str:
        name = script_name(word, prefix, self.taken.__contains__)
        self.taken.add(name)
        return name

    def disc(self, point: str, place: str) -> None:
        """A disc at a point, which is at ``place``."""
        body = self._body(point, "P")
        self._put(body, point)
        self.statements.append(f"{body.name}.{self.anchors[point]} = {place};")

    def bar(self, start: str, target: str) -> str:
        """The name of a new bar that keeps the distance of two points, one of which may be new."""
        body = self._body(f"{start}_{target}", "L")
        for point in (start, target):
            known = self._known(point)
            if known is not None:
                self.statements.append(f"{body.name}.{self.anchors[point]} = {known};")
            self._put(body, point)
        return body.name

    def _body(self, word: str, prefix: str) -> _Body:
        self.bodies.append(_Body(self._name(word, prefix), []))
        return self.bodies[-1]

    def _put(self, body: _Body, point: str) -> None:
        body.points.append(point)
        self.homes.setdefault(point, []).append(body)

    def _join(self, body: _Body, point: str) -> None:
        """A new point of a body, which the formula just stated puts there."""
        self._put(body, point)
        self.statements[-1] += f" is on {body.name}"

    def _known(self, point: str) -> str | None:
        """A point in the script's terms; None if no body has it yet."""
        if point in self.homes:
            return f"{self.homes[point][0].name}.{self.anchors[point]}"
        return self._literal(point) if point in self.still else None

    def _at(self, point: str) -> str:
        known = self._known(point)
        assert known is not None
        return known

    def _literal(self, point: str) -> str:
        x, y = self.drawn[point].tolist()
        return f"[{float_text(x)}, {float_text(y)}]"

    def _shared(self, a: str, b: str) -> _Body | None:
        """The body that has both points."""
        return next((body for body in self.homes.get(a, ()) if b in body.points), None)

    # --- formulas ---------------------------------------------------------------------------------------

    def state(self, formula: Formula) -> None:
        """The statements of a formula."""
        self.statements.append(f"// {formula}")
        words = formula.arguments
        match formula.function:
            case "PLA" | "PLAP" if len(words) == 3:
                self._pla(formula, words[0], self._number(words[1]), self._number(words[2]))
            case "PLAP":
                self._plap(formula, words[0], self._number(words[1]), self._number(words[2]), words[3])
            case "PLLP":
                self._pllp(formula, words[0], self._number(words[1]), self._number(words[2]), words[3])
            case "PLPP":
                self._plpp(formula, words[0], self._number(words[1]), words[2], words[3])
            case "PALP":
                self._palp(formula, words[0], self._number(words[1]), self._number(words[2]), words[3])
            case "PXY":
                x, y = self._number(words[1]), self._number(words[2])
                self.disc(formula.target, f"{self._at(words[0])} + [{x.text}, {y.text}]")
            case _:
                a, b, c = (self._at(word) for word in words)
                self.disc(formula.target, f"{c} + ({b} - {a})")

    def _pla(self, formula: Formula, a: str, length: _Number, angle: _Number) -> None:
        if length.varies or length.first == 0.0:
            turned = f"[{length.text}, 0].r({_signed(angle, formula.inverse)})"
            self.disc(formula.target, f"{self._at(a)} + {turned}")
            self.lines.append((a, formula.target))
        else:
            self._turn(self.bar(a, formula.target), angle, formula.inverse)

    def _turn(self, body: str, angle: _Number, inverse: bool, base: _Body | None = None) -> None:
        """A bar turns with an angle from where it is drawn, against a ``base`` that turns itself."""
        first = -angle.first if inverse else angle.first
        terms = [] if base is None else [f"{base.name}.angle"]
        if angle.varies:
            terms += [_signed(angle, inverse), *([f"({float_text(-first)})"] if first != 0.0 else [])]
        self.statements.append(f"{body}.angle = {' + '.join(terms) or '0'};")

    def _plap(self, formula: Formula, a: str, length: _Number, angle: _Number, b: str) -> None:
        target, body = formula.target, self._shared(a, b)
        rigid = not length.varies and length.first > 0.0
        if rigid and body is not None and not angle.varies:
            self._join(body, target)
        elif rigid and (body is not None or {a, b} <= self.still):
            self._turn(self.bar(a, target), angle, formula.inverse, body)
        else:  # the direction it is counted from is not a thing with an angle
            base = f"({self._at(b)} - {self._at(a)})"
            turned = f"{base}.r({_signed(angle, formula.inverse)})*({length.text}/{base}.l)"
            self.disc(target, f"{self._at(a)} + {turned}")
            self.lines.append((a, target))

    def _arm(self, start: str, target: str, length: _Number) -> None:
        """A point at a distance from another: by a bar, if that is constant."""
        if not length.varies and length.first > 0.0:
            self.bar(start, target)
        else:
            if self._known(target) is None:
                self.disc(target, "[_, _]")
            self.lines.append((start, target))
            self.statements.append(f"({self._at(target)} - {self._at(start)}).l = {length.text};")

    def _pllp(self, formula: Formula, a: str, first: _Number, second: _Number, b: str) -> None:
        target, body = formula.target, self._shared(a, b)
        if body is not None and not first.varies and not second.varies:
            self._join(body, target)
            return
        self._arm(a, target, first)
        self._arm(b, target, second)
        (ax, ay), (bx, by), (tx, ty) = (_axes(self._at(point)) for point in (a, b, target))
        side = f"({bx} - {ax})*({ty} - {ay}) - ({by} - {ay})*({tx} - {ax})"
        self.statements.append(f"{side} {'<=' if formula.inverse else '>='} 0;")

    def _plpp(self, formula: Formula, a: str, length: _Number, b: str, c: str) -> None:
        self._arm(a, formula.target, length)
        (ax, ay), (bx, by), (cx, cy), (tx, ty) = (_axes(self._at(point)) for point in (a, b, c, formula.target))
        along = f"{self._at(b)} + ({self._at(c)} - {self._at(b)})*_"
        self.statements += [
            f"{self._at(formula.target)} = {along};",
            f"({tx} - {ax})*({cx} - {bx}) + ({ty} - {ay})*({cy} - {by}) {'<=' if formula.inverse else '>='} 0;",
        ]

    def _palp(self, formula: Formula, a: str, angle: _Number, length: _Number, b: str) -> None:
        self._arm(b, formula.target, length)
        line = self._name(f"line_{formula.target}", "v")
        (bx, by), (tx, ty) = (_axes(self._at(point)) for point in (b, formula.target))
        self.statements += [
            f"{line} = ({self._at(b)} - {self._at(a)}).r({angle.text});",
            f"{self._at(formula.target)} = {self._at(a)} + {line}*_;",
            # the point of the two with the smaller x (with the larger x, for the inverse)
            f"(({tx} - {bx})*{line}.x + ({ty} - {by})*{line}.y)*{line}.x {'>=' if formula.inverse else '<='} 0;",
        ]


def _signed(angle: _Number, inverse: bool) -> str:
    if not inverse:
        return angle.text
    return float_text(-angle.first) if not angle.varies else f"-{angle.text}"


def _axes(point: str) -> tuple[str, str]:
    """The coordinates of a point: of an anchor, or of one that is written in numbers."""
    if point.startswith("["):
        x, y = point[1:-1].split(", ")
        return x if not x.startswith("-") else f"({x})", y if not y.startswith("-") else f"({y})"
    return f"{point}.x", f"{point}.y"


def _counted(count: int, one: str) -> str:
    return f"{count or 'no'} {one if count == 1 else one + 's'}"
