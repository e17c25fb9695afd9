"""Groups of equations that determine their unknowns by their structure, but not by their geometry.

A third parallel crank, the rhombuses of a tiling: as many equations as unknowns, none of them idle, and yet the linkage
moves. Such a group must be solved with everything connected to it, redundant equations included. It is recognised from
its numbers, if the starting pose satisfies it, before anything is compiled or searched for.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.lowering.equations import Form, System
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.planner import Structure
from movimentum.planning.structure.decompose import Group
from movimentum.solver.basis.block_memo import memoized
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.start.placement import pins_in_pose, rigid_motion
from movimentum.tolerances import LOOP_CLOSED

LARGEST_GROUP = 700
"""Unknowns of a group that is looked at (its Jacobian is dense)."""


def mobile_groups(structure: Structure, carry: PoseState, size: float) -> frozenset[int]:
    """An unknown of each group that the pose carried over (or drawn) satisfies, and that can move there although its
    structure says that it cannot.
    """
    system = structure.system
    values = _Values(system, carry)
    found: set[int] = set()
    with np.errstate(all="ignore"):
        pins, _ = pins_in_pose(system, carry, range(len(system.scene.things)), size)
        moved = rigid_motion(pins, size) is not None
    apart: set[int] = set()  # unknowns of what the drawing does not satisfy, and of all that depends on it
    for group in structure.decomposition.groups:
        inputs = {n for e in group.equations for n in system.equations[e].unknowns}
        with np.errstate(all="ignore"):
            if inputs & apart or not all(_equation_holds(system, e, values, moved) for e in group.equations):
                apart |= set(group.unknowns)
            elif _may_be_mobile(system, group):
                rows = _PolynomialRows.of(system, group, values, size)
                if rows is not None and memoized(rows.key, rows.is_mobile):
                    found.add(group.unknowns[0])
    return frozenset(found)


class _Values(dict[int, float | None]):
    """The values of a system's unknowns in the pose carried over, each found when it is first asked for."""

    def __init__(self, system: System, carry: PoseState) -> None:
        super().__init__()
        self.system, self.carry = system, carry

    def __missing__(self, unknown: int) -> float | None:
        self[unknown] = value = self.carry.now.value(self.system, unknown)
        return value


def _may_be_mobile(system: System, group: Group) -> bool:
    square = (
        not group.free and 2 <= len(group.unknowns) <= LARGEST_GROUP and len(group.unknowns) == len(group.equations)
    )
    return square and any(_bodies(system, e) > 1 for e in group.equations)


def _equation_holds(system: System, equation: int, values: _Values, moved: bool) -> bool:
    """Whether an equation holds in the pose to begin from, as far as that is known; what is about one body holds
    where all is moved as one.
    """
    form = system.equations[equation].polynomial
    if form is None or (moved and _bodies(system, equation) == 1):
        return True
    total = weight = 0.0
    for monomial, coefficient in form.items():
        term = coefficient.value
        for n in monomial:
            value = values[n]
            term = None if term is None or value is None else term * value
        if term is None:
            return True
        total += term
        weight += abs(term)
    return abs(total) <= LOOP_CLOSED * weight


def _bodies(system: System, equation: int) -> int:
    """How many things an equation is about."""
    return len({t for n in system.equations[equation].unknowns if (t := system.unknowns[n].thing) is not None})


class _PolynomialRows:
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
    def of(cls, system: System, group: Group, values: _Values, size: float) -> _PolynomialRows | None:
        """The rows beside a pose; None where they are no such polynomials."""
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
        start = np.array([values[n] or 0.0 for n in group.unknowns])
        scale = [1.0 if isinstance(system.unknowns[n].payload, PoseCos | PoseSin) else size for n in group.unknowns]
        return cls(start, np.array(scale), row, constants, terms)

    def key(self) -> Hashable:
        """Everything that its mobility depends on."""
        arrays = (self.start, self.scale, self.row, self.constants, self.factors)
        return "mobile", self.factors.shape, *(array.tobytes() for array in arrays)

    def values(self, x: FloatArray) -> FloatArray:
        """The residuals (m,)."""
        extended = np.append(x, 1.0)
        terms = self.constants * np.prod(extended[self.factors], axis=1)
        return np.asarray(np.bincount(self.row, terms, self.count), dtype=np.float64)

    def slopes(self, x: FloatArray) -> FloatArray:
        """The Jacobian (m, n), unknowns in units of their scale."""
        extended = np.append(x, 1.0)
        matrix = np.zeros((self.count, self.count + 1))
        for d in range(self.factors.shape[1]):
            others: Iterable[int] = (k for k in range(self.factors.shape[1]) if k != d)
            slope = self.constants * np.prod(extended[self.factors[:, list(others)]], axis=1)
            np.add.at(matrix, (self.row, self.factors[:, d]), slope)
        return matrix[:, :-1] * self.scale

    def is_mobile(self) -> bool:
        """Whether the group can move from its start; what is pinned elsewhere is taken as pinned here."""
        from movimentum.solver.block.linearization import is_mobile

        constant = self.values(self.start)

        def rows(x: FloatArray) -> tuple[FloatArray, FloatArray]:
            return self.values(x * self.scale) - constant, self.slopes(x * self.scale)

        return is_mobile(rows, self.start / self.scale)
