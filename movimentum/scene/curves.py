"""The outline of a ``.curve``: by its radius, by its coordinates, or through points; measured from its first anchor."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from itertools import repeat
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, insertion, replacement
from movimentum.expressions import Expr, add, call, const, mul, substitute
from movimentum.expressions.tables import Ends, Table
from movimentum.outlines.contour import PLACE, Contour, smooth_contour
from movimentum.outlines.expression_outlines import UndefinedPlace, curve_of_expressions, curve_of_pieces
from movimentum.outlines.kinks import MOST_PIECES, TooManyPieces
from movimentum.outlines.lines import polygon
from movimentum.records import replace
from movimentum.scene.expansion.constants import varies
from movimentum.scene.expansion.table_files import POINTS, ReadTable, TableColumn, Tables
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import VariableComponent
from movimentum.scene.resolve import ComponentUse, Meanings, VariableUse
from movimentum.source import drawing_file
from movimentum.syntax.expression_tree import Expression, Member, Name, postorder
from movimentum.syntax.tree import Definition, Option, Text
from movimentum.syntax.vocabulary import VECTOR_MEMBERS
from movimentum.things.kinds.curve import SHAPES
from movimentum.tolerances import OUTLINE_CLOSES

FARTHEST = 1e9
"""Pixels from the first anchor to a point of a curve."""


class CurveReader:
    """Makes the outlines of curves; ``folder`` is where their files are."""

    def __init__(self, folder: str, read_table: ReadTable | None, tables: Tables, findings: Findings) -> None:
        self._folder, self._read_table, self._tables, self._findings = folder, read_table, tables, findings

    def border(self, definition: Definition, image: str, height: float | None, *, down: bool) -> Contour | None:
        """The outline of a picture, in its pixels from its lower-left corner: of `.outline`, or of the element which
        it is of a drawing; None if it has none, and after an error. ``down``: places are from the upper-left one.
        """
        option = next((part for part in definition.parts if isinstance(part, Option) and part.name == "outline"), None)
        if option is None:
            file = drawing_file(image)
            return None if file == image else self._element(file, image[len(file) + 1 :], image, None)
        first, *rest = option.arguments
        if isinstance(first, Text):
            file = drawing_file(first.text) if "#" in first.text.lstrip("#") else drawing_file(image)
            if not file.lower().endswith(".svg") or rest or "#" not in first.text or self._read_table is None:
                message = f"`{first.text}` names no element of an SVG drawing"
                helps = ("write `.outline('#rim')`, `.outline('drawing.svg#rim')`, or corners: `.outline([0,0], …)`",)
                self._findings.error("curve/shape", message, first.span, helps=helps)
                return None
            if not first.text.startswith("#"):
                file = os.path.join(self._folder, file)
            return self._element(file, first.text.rpartition("#")[2], first.text, first)
        places = self._places(option)
        if places is None:
            return None
        if len(places) < 3:
            message = f"an outline has at least 3 corners, this has {len(places)}"
            self._findings.error("curve/points", message, option.span, helps=("write them in their order",))
            return None
        if down and height is not None:
            places[:, 1] = height - places[:, 1]
        return polygon([(float(x), float(y)) for x, y in places])

    def _element(self, file: str, element: str, shown: str, report_at: Text | None) -> Contour | None:
        """The path of an element of a drawing, as an outline; ``report_at``: where to report its errors."""
        if self._read_table is None:
            return None
        column = TableColumn(file, shown, POINTS, element)
        made = self._read_table(column)
        if isinstance(made, Diagnostic):
            if report_at is not None:
                self._findings.add(replace(made, span=report_at.span, label=""))
            return None
        self._tables[column] = made
        points = np.stack([made.x, made.y], axis=-1).reshape(-1, 4, 2)
        return curve_of_pieces([(_bezier(piece), 0.0, 1.0) for piece in points], closed=True)

    def outline(self, definition: Definition, read: Mapping[str, Any]) -> Contour | None:
        """The outline that the options of a definition state; None after an error, which is reported."""
        options = {part.name: part for part in definition.parts if isinstance(part, Option)}
        if definition.shape.arguments:
            return self._drawing(definition, [options[name] for name in (*SHAPES, "range") if name in options], read)
        said = [options[name] for name in SHAPES if name in options]
        if len(said) != 1:
            self._report_shape(definition, said)
            return None
        option = said[0]
        key = {"through": "places", "points": "table"}.get(option.name, option.name)
        if key not in read:
            return None  # which has been reported
        if option.name in ("polar", "param"):
            return self._traced(option, read)
        if "range" in read:
            message = f"`.range` is that of the parameter of `.polar` or `.param`; `.{option.name}` has none"
            self._findings.error("syntax/misplaced-option", message, options["range"].span)
            return None
        points = self._places(option) if option.name == "through" else self._file(option)
        return None if points is None else self._through(option, points, closed="open" not in read)

    # --- by expressions

    def _traced(self, option: Option, read: Mapping[str, Any]) -> Contour | None:
        first, last = read.get("range", (0.0, 360.0))
        if not first < last:
            span = next(part.span for part in (option,))
            message = f"the range of a curve goes from the less to the greater number, not from {first:g} to {last:g}"
            self._findings.error("kind/out-of-range", message, span, helps=(f"write `.range({last:g}, {first:g})`",))
            return None
        parameter, expression = option.arguments
        assert isinstance(parameter, Name)
        assert not isinstance(expression, Text)
        made = self._lowered(parameter, expression, Kind.SCALAR if option.name == "polar" else Kind.VECTOR)
        if made is None:
            return None
        if option.name == "polar":
            (r,) = made
            made = mul(r, call("cosd", PLACE)), mul(r, call("sind", PLACE))
        try:
            outline = curve_of_expressions(made[0], made[1], first, last, closed="open" not in read)
        except UndefinedPlace as problem:
            message = f"this has no value at {parameter.name} = {problem.place:g}"
            helps = ("state with `.range(…)` where it has one",)
            self._findings.error("kind/not-finite", message, expression.span, helps=helps)
            return None
        except TooManyPieces as problem:
            message = f"this curve has {problem.count} jumps and corners, or more; the limit is {MOST_PIECES}"
            helps = ("write it as a body of shapes, or read its points with `.points('file.csv')`",)
            self._findings.error("curve/points", message, expression.span, helps=helps)
            return None
        return self._checked(outline, expression)

    def _lowered(self, parameter: Name, expression: Expression, kind: Kind) -> tuple[Expr, ...] | None:
        """The components of an expression of the parameter, in `PLACE`."""
        nodes = list(postorder(expression))
        meanings: Meanings = {}
        for node in nodes:
            if isinstance(node, Name) and node.name == parameter.name:
                meanings[id(node)] = VariableUse(node.name)
            elif isinstance(node, Member) and node.name in VECTOR_MEMBERS:
                meanings[id(node)] = ComponentUse(VECTOR_MEMBERS[node.name])
            elif varies(node):
                self._report_varying(node, parameter)
                return None
        errors = self._findings.errors
        inference = Inference(self._findings)
        inference.expression(nodes, meanings)
        what = "a radius is a number" if kind is Kind.SCALAR else "a place is a vector: write `[x, y]`"
        if self._findings.errors == errors:
            inference.require(expression, kind, what)
        if self._findings.errors == errors and any(isinstance(node, Name) for node in nodes):
            name = next(node for node in nodes if isinstance(node, Name))
            inference.require(name, Kind.SCALAR, "the parameter of a curve is a number")
        inference.finish()
        if self._findings.errors != errors:
            return None
        found = lower(nodes, meanings, Context(inference, self._findings, repeat(0)))
        if found is None:
            return None
        place = VariableComponent(parameter.name, None)
        return tuple(substitute(each, lambda node: PLACE if node.payload == place else None) for each in found)

    def _report_varying(self, node: Expression, parameter: Name) -> None:
        if isinstance(node, Name):
            guess = self._findings.nearest(node.name, (parameter.name, *self._findings.constants))
            helps = (replacement(f"did you mean `{guess}`?", node.span, guess),) if guess else ()
            message = f"`{node.name}` is neither the parameter `{parameter.name}` nor a constant"
            helps = helps or (f"`.let {node.name} = …;` makes a constant",)
            self._findings.error("name/unknown-constant", message, node.span, helps=helps)
            return
        self._findings.error("kind/not-constant", "a curve must not change with time", node.span)

    # --- through points

    def _places(self, option: Option) -> FloatArray | None:
        places: list[tuple[float, float]] = []
        for argument in option.arguments:
            value = None if isinstance(argument, Text) else self._vector(argument)
            if value is None:
                return None
            places.append(value)
        return np.array(places)

    def _vector(self, argument: Expression) -> tuple[float, float] | None:
        nodes = list(postorder(argument))
        meanings: Meanings = {}
        for node in nodes:
            if isinstance(node, Member) and node.name in VECTOR_MEMBERS:
                meanings[id(node)] = ComponentUse(VECTOR_MEMBERS[node.name])
            elif varies(node):
                message = "a point of a curve is a constant vector, such as `[40, 10]`"
                self._findings.error("kind/not-constant", message, node.span)
                return None
        errors = self._findings.errors
        inference = Inference(self._findings)
        inference.expression(nodes, meanings)
        if self._findings.errors == errors:
            inference.require(argument, Kind.VECTOR, "a point of a curve is a vector, such as `[40, 10]`")
        inference.finish()
        if self._findings.errors != errors:
            return None
        found = lower(nodes, meanings, Context(inference, self._findings, repeat(0)))
        return None if found is None else (found[0].value or 0.0, found[1].value or 0.0)

    def _file(self, option: Option) -> FloatArray | None:
        (text,) = option.arguments
        assert isinstance(text, Text)
        if not text.text or "\0" in text.text or self._read_table is None:
            self._findings.error("asset/missing", "`.points` needs a file", text.span)
            return None
        column = TableColumn(os.path.join(self._folder, text.text), text.text, POINTS)
        made = self._read_table(column)
        if isinstance(made, Diagnostic):
            self._findings.add(replace(made, span=text.span, label=""))
            return None
        self._tables[column] = made
        return np.stack([made.x, made.y], axis=-1)

    def _through(self, option: Option, points: FloatArray, *, closed: bool) -> Contour | None:
        size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
        if closed and len(points) > 1 and np.hypot(*(points[0] - points[-1])) <= OUTLINE_CLOSES * size:
            points = points[:-1]  # it says itself that it is closed
        least = 3 if closed else 2
        if len(points) < least:
            message = (
                f"{'a closed' if closed else 'an open'} curve needs at least {least} points, this has {len(points)}"
            )
            at = option.span.end
            helps = (insertion("leave it open: `.open`", at, " .open"),) if closed and len(points) == 2 else ()
            self._findings.error("curve/points", message, option.span, helps=helps)
            return None
        round_ = np.concatenate([points, points[:1]]) if closed else points
        steps = np.hypot(*np.diff(round_, axis=0).T)
        if not (steps > OUTLINE_CLOSES * size).all():
            k = int(np.argmin(steps > OUTLINE_CLOSES * size))
            x, y = round_[k]
            message = f"points {k + 1} and {(k + 1) % len(points) + 1} of this curve are one: [{x:g}, {y:g}]"
            helps = ("leave out one of them",)
            self._findings.error("curve/points", message, option.span, helps=helps)
            return None
        along = np.concatenate([[0.0], np.cumsum(steps)])
        ends = Ends.PERIODIC if closed else Ends.STRAIGHT
        x, y = (call("table", PLACE, payload=Table(along, np.ascontiguousarray(round_[:, k]), smooth=True, ends=ends))
                for k in (0, 1))  # fmt: skip
        return self._checked(smooth_contour((x, y), 0.0, float(along[-1]), closed=closed), option)

    # --- of a drawing

    def _drawing(self, definition: Definition, others: Sequence[Option], read: Mapping[str, Any]) -> Contour | None:
        """The path of an element, from the drawing's lower-left corner, y up."""
        (text,) = definition.shape.arguments
        assert isinstance(text, Text)
        if others:
            message = f"`{definition.name}` comes from a drawing, and is also defined by `.{others[0].name}`"
            helps = (replacement("leave this out", others[0].span, ""),)
            self._findings.error("curve/shape", message, others[0].span, helps=helps)
            return None
        file = drawing_file(text.text)
        if file == text.text or not file.lower().endswith(".svg") or "\0" in file or self._read_table is None:
            message = f"`{text.text}` names no element of an SVG drawing"
            helps = ("write the drawing and the id of its path: `.curve 'plate.svg#groove'`",)
            self._findings.error("curve/shape", message, text.span, helps=helps)
            return None
        element = text.text[len(file) + 1 :]
        column = TableColumn(os.path.join(self._folder, file), text.text, POINTS, element)
        made = self._read_table(column)
        if isinstance(made, Diagnostic):
            self._findings.add(replace(made, span=text.span, label=""))
            return None
        self._tables[column] = made
        points = np.stack([made.x, made.y], axis=-1).reshape(-1, 4, 2)
        own = [(_bezier(piece), 0.0, 1.0) for piece in points]
        closed = bool(made.spelled[2]) and "open" not in read
        return self._checked(curve_of_pieces(own, closed=closed), text)

    # --- what is wrong

    def _checked(self, outline: Contour, node: Expression | Option | Text) -> Contour | None:
        drawn = np.array(outline.polyline)
        if not np.abs(drawn).max() <= FARTHEST:
            message = f"this curve goes {np.abs(drawn).max():g} px from its anchor"
            notes = (f"points of curves are at most {FARTHEST:g} px from it",)
            self._findings.error("kind/not-finite", message, node.span, notes=notes)
            return None
        if outline.size <= 0.0 or len(drawn) < 2:
            message = "this curve is only a point"
            helps = ("a point of a thing is an anchor; something round is a `.disc(radius)`",)
            self._findings.error("curve/points", message, node.span, helps=helps)
            return None
        away = drawn - drawn[0]
        x, y = away[np.argmax(np.hypot(*away.T))]
        if outline.closed and np.abs(away @ [-y, x]).max() <= OUTLINE_CLOSES * outline.size * math.hypot(x, y):
            message = "this closed curve is straight, there and back: it encloses nothing"
            helps = ("leave it open: `.open`, along one of the two ways",)
            self._findings.error("curve/points", message, node.span, helps=helps)
            return None
        return outline

    def _report_shape(self, definition: Definition, said: Sequence[Option]) -> None:
        if said:
            message = f"`{definition.name}` is defined twice: by `.{said[0].name}` and by `.{said[1].name}`"
            helps = (replacement("leave this out", said[1].span, ""),)
            self._findings.error("curve/shape", message, said[1].span, helps=helps)
            return
        at = definition.span.end - 1
        helps = (
            insertion("add a radius: `.polar(th, 40 + 9*.cos(2*th))`", at, " .polar(th, 40 + 9*.cos(2*th))"),
            "or `.param(u, [80*.cos(u), 50*.sin(u)])`, `.through([0,0], [40,10], [90,0]) .open`, `.points('file.csv')`",
        )
        message = f"`{definition.name}` does not say which curve it is"
        self._findings.error("curve/shape", message, definition.name_span, helps=helps)


def _bezier(points: FloatArray) -> tuple[Expr, Expr]:
    """A cubic Bézier curve by its parameter from 0 to 1, by Horner's rule."""
    a, b, c, d = points
    parts = (a, 3.0 * (b - a), 3.0 * (a - 2.0 * b + c), d - a + 3.0 * (b - c))
    x, y = (_horner([float(part[k]) for part in parts]) for k in (0, 1))
    return x, y


def _horner(coefficients: Sequence[float]) -> Expr:
    total = const(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        total = add(const(coefficient), mul(PLACE, total))
    return total
