"""Groups of equations that determine their unknowns by their structure, but not by their geometry.

A third parallel crank, the rhombuses of a tiling: as many equations as unknowns, none of them idle, and yet the linkage
moves. Such a group must be solved with everything connected to it, redundant equations included. It is seen from its
numbers, where the pose to begin from satisfies it, before anything is compiled or searched for.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.compile import Structure
from movimentum.plan.decompose import Group
from movimentum.plan.equations import Form, System
from movimentum.plan.unknowns import PoseCos, PoseSin
from movimentum.scene.model import AnchorCoordinate, Relation
from movimentum.solve.carry import Carry
from movimentum.solve.linear import RANK_TOLERANCE

FloatArray = NDArray[np.float64]

CLOSED = 1e-6
"""Relative to the sizes of a row's terms: what a pose that satisfies the row may be off by."""
LOST = 1e-6
"""Smallest singular value, of the largest, of a group that has lost its rank."""
ASIDE = 0.03
"""Of the unknowns' scale: how far beside a pose another solution is looked for."""
LARGEST = 700
"""Unknowns of a group that is looked at (its Jacobian is dense)."""


def deceptive(structure: Structure, carry: Carry, size: float) -> frozenset[int]:
    """An unknown of each group that the pose carried over (or drawn) satisfies, and that can move there although its
    structure says that it cannot.
    """
    system = structure.system
    found: set[int] = set()
    with np.errstate(all="ignore"):
        moved = _moved_as_one(system, carry, size)
    apart: set[int] = set()  # unknowns of what the drawing does not satisfy, and of all that depends on it
    for group in structure.decomposition.groups:
        inputs = {n for e in group.equations for n in system.equations[e].unknowns}
        with np.errstate(all="ignore"):
            if inputs & apart or not all(_holds(system, e, carry, moved) for e in group.equations):
                apart |= set(group.unknowns)
            elif _may_deceive(system, group):
                rows = _Rows.of(system, group, carry, size)
                if rows is not None and rows.is_mobile():
                    found.add(group.unknowns[0])
    return frozenset(found)


def _may_deceive(system: System, group: Group) -> bool:
    square = not group.free and 2 <= len(group.unknowns) <= LARGEST and len(group.unknowns) == len(group.equations)
    return square and any(_bodies(system, e) > 1 for e in group.equations)


def _moved_as_one(system: System, carry: Carry, size: float) -> bool:
    """Whether what is pinned at stated places is pinned as it is drawn, moved and turned as a whole."""
    drawn: list[complex] = []
    stated: list[complex] = []
    for constraint in system.segment.active:
        if constraint.relation is Relation.EQUAL and constraint.anchor is not None and len(constraint.right) == 2:
            x, y = (side.value for side in constraint.right)
            payload = constraint.left[0].payload
            if x is not None and y is not None and isinstance(payload, AnchorCoordinate):
                pose = carry.now.things[payload.thing]
                local = complex(*system.scene.things[payload.thing].anchors[payload.anchor].local)
                drawn.append(complex(pose.x, pose.y) + complex(pose.c, pose.s) * local)
                stated.append(complex(x, y))
    if len(drawn) < 2:
        return True
    here, there = np.array(drawn) - np.mean(drawn), np.array(stated) - np.mean(stated)
    turn = np.vdot(here, there)
    turn = turn / abs(turn) if abs(turn) > 0.0 else 1.0
    return bool(np.max(np.abs(there - turn * here)) <= CLOSED * size)


def _holds(system: System, equation: int, carry: Carry, moved: bool) -> bool:
    """Whether an equation holds in the pose to begin from, as far as that can be told; what is about one body holds
    where all is moved as one.
    """
    form = system.equations[equation].polynomial
    if form is None or (moved and _bodies(system, equation) == 1):
        return True
    total = weight = 0.0
    for monomial, coefficient in form.items():
        term = coefficient.value
        for n in monomial:
            value = carry.now.value(system, n)
            term = None if term is None or value is None else term * value
        if term is None:
            return True
        total += term
        weight += abs(term)
    return abs(total) <= CLOSED * weight


def _bodies(system: System, equation: int) -> int:
    """How many things an equation is about."""
    return len({t for n in system.equations[equation].unknowns if (t := system.unknowns[n].thing) is not None})


class _Rows:
    """The polynomial equations of one group with numbers for coefficients; x (n,) are its unknowns.

    Term t adds ``constants[t]`` times the product of the unknowns ``factors[t]`` (places in x; n stands for 1) to row
    ``row[t]``.
    """

    def __init__(
        self, start: FloatArray, scale: FloatArray, row: list[int], constants: list[float], terms: list[list[int]]
    ) -> None:
        degree = max((len(term) for term in terms), default=0)
        self.start, self.scale = start, scale
        self.count = len(start)
        self.row = np.array(row, dtype=np.intp)
        self.constants = np.array(constants)
        self.factors = np.array([[*term, *[self.count] * (degree - len(term))] for term in terms], dtype=np.intp)

    @classmethod
    def of(cls, system: System, group: Group, carry: Carry, size: float) -> _Rows | None:
        """The rows beside a pose; None where they are no such polynomials."""
        values = {n: carry.now.value(system, n) for e in group.equations for n in system.equations[e].unknowns}
        place = {n: i for i, n in enumerate(group.unknowns)}
        row: list[int] = []
        constants: list[float] = []
        terms: list[list[int]] = []
        for i, e in enumerate(group.equations):
            form = system.equations[e].polynomial
            if form is None or system.equations[e].form is not Form.PLAIN:
                return None
            for monomial, coefficient in form.items():
                factor = coefficient.value
                if factor is None:
                    return None
                for n in monomial:
                    value = values[n]
                    if value is None:
                        return None
                    factor *= 1.0 if n in place else value
                row.append(i)
                constants.append(factor)
                terms.append([place[n] for n in monomial if n in place])
        start = np.array([values.get(n) or 0.0 for n in group.unknowns])
        scale = [1.0 if isinstance(system.unknowns[n].payload, PoseCos | PoseSin) else size for n in group.unknowns]
        return cls(start, np.array(scale), row, constants, terms)

    def values(self, x: FloatArray) -> FloatArray:
        """The residuals (m,)."""
        extended = np.append(x, 1.0)
        terms = self.constants * np.prod(extended[self.factors], axis=1)
        return np.asarray(np.bincount(self.row, terms, self.count), dtype=np.float64)

    def slopes(self, x: FloatArray) -> FloatArray:
        """The Jacobian (m, n), its rows of unit length, unknowns in units of their scale; and those lengths."""
        extended = np.append(x, 1.0)
        matrix = np.zeros((self.count, self.count + 1))
        for d in range(self.factors.shape[1]):
            others: Iterable[int] = (k for k in range(self.factors.shape[1]) if k != d)
            slope = self.constants * np.prod(extended[self.factors[:, list(others)]], axis=1)
            np.add.at(matrix, (self.row, self.factors[:, d]), slope)
        return matrix[:, :-1] * self.scale

    def _lost(self, x: FloatArray) -> FloatArray | None:
        """The direction (n,), in units of the scale, in which nothing holds the group; None where something does."""
        matrix = _unit_rows(self.slopes(x))[0]
        if not np.isfinite(matrix).all():
            return None
        _, singular, turned = np.linalg.svd(matrix)
        return turned[-1] if singular[-1] <= LOST * singular[0] else None

    def is_mobile(self) -> bool:
        """Whether the group has lost its rank at its start, and again beside it, where it also has a solution (at a
        dead centre there is none).
        """
        constant = self.values(self.start)  # what is pinned elsewhere is taken as pinned here
        direction = self._lost(self.start)
        if direction is None:
            return False
        x = self.start + ASIDE * self.scale * direction / float(np.max(np.abs(direction)))
        error = np.inf
        for _ in range(20):
            matrix, lengths = _unit_rows(self.slopes(x))
            right = (self.values(x) - constant) / lengths
            if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
                return False
            error = float(np.max(np.abs(right)))
            if error < 1e-12:
                break
            x = x - np.linalg.lstsq(matrix, right, rcond=RANK_TOLERANCE)[0] * self.scale
        away = float(np.max(np.abs(x - self.start) / self.scale))
        return error <= 1e-9 and away > 0.5 * ASIDE and self._lost(x) is not None


def _unit_rows(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    largest = np.max(np.abs(matrix), axis=1, initial=0.0)
    largest = np.where(largest > 0.0, largest, 1.0)
    lengths = largest * np.sqrt(np.sum((matrix / largest[:, None]) ** 2, axis=1))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    return matrix / lengths[:, None], lengths
