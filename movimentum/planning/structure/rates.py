"""The equations of rates (``.d``): determined quantities are differentiated, free motions follow their law."""

from __future__ import annotations

from collections.abc import Set
from enum import StrEnum

from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.system import with_rates, with_velocities
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, Rate, symbol_numbers
from movimentum.planning.structure.decompose import Decomposition, Group, decompose

HIGHEST_RATE = 4


class RateProblem(StrEnum):
    """Why a derivative cannot be determined.

    CYCLE: the equations of what it is a derivative of only say it with the derivative itself; FED_BACK: it is one of a
    free motion that depends on it; HIGHER: it is a derivative of a velocity that has none (toward a wish, or the third
    one of any free motion); FLOWING: of a free motion that a differential equation drives; PUSHED: of one
    that something pushes; DEMANDED: an equation says what it should be, of a free motion that goes its own way.
    """

    CYCLE = "cycle"
    FED_BACK = "fed back"
    HIGHER = "higher"
    FLOWING = "flowing"
    PUSHED = "pushed"
    DEMANDED = "demanded"


class RateError(Exception):
    """A derivative that nothing tells, the number of a constraint that asks for it, and the thing that moves freely."""

    def __init__(self, trouble: RateProblem, constraint: int | None, thing: int | None = None) -> None:
        self.problem, self.constraint, self.thing = trouble, constraint, thing
        super().__init__(f"an unknown derivative: {trouble}")


def with_needed_rates(base: System, merged: frozenset[int]) -> tuple[System, Decomposition]:
    """The equations with those of all rates that are asked for, in groups.

    The equations of what is determined are differentiated, until no new rate is asked for. What has freedom left moves
    by a law of its own, which its equations do not tell: its rates are taken from there.
    """
    rates = frozenset(n for n, unknown in enumerate(base.unknowns) if isinstance(unknown.payload, Rate))
    stated = decompose(base, merged, known=rates)
    if not rates:
        return base, stated
    group_of = {n: group for group in stated.groups for n in group.unknowns}
    system, place = base, 0
    levels = {group: [group.equations] for group in stated.groups}
    laws: dict[tuple[Group, int], list[int]] = {}
    while place < len(system.unknowns):
        of, order = system.differentiated(place)
        place += 1
        group = group_of.get(of)
        if not order or group is None:
            continue
        if order > HIGHEST_RATE:
            raise RateError(RateProblem.CYCLE, reader_of(base, rates))
        if group.free:
            laws.setdefault((group, order), []).append(place - 1)
            continue
        while len(levels[group]) <= order:
            before = len(system.equations)
            system = with_rates(system, levels[group][-1], group.unknowns)
            levels[group].append(tuple(range(before, len(system.equations))))
    for (group, _), some in laws.items():
        system = with_velocities(system, some, _read_by_law(system, group))
    return system, decompose(system, merged)


def _read_by_law(system: System, group: Group) -> set[int]:
    """The unknowns that the free motion of ``group`` depends on: those of its equations, and where its things are."""
    read = set(group.unknowns).union(*(system.equations[e].unknowns for e in group.equations))
    for thing in {t for n in group.unknowns if (t := system.unknowns[n].thing) is not None}:
        parts = (system.number_of.get(kind(thing)) for kind in (PoseX, PoseY, PoseCos, PoseSin))
        read |= {n for n in parts if n is not None}
    return read


def reader_of(system: System, rates: Set[int]) -> int | None:
    """The number of a constraint that reads one of ``rates`` (unknowns of ``system``)."""
    stated = [(symbol_numbers(e.residual), e.constraint) for e in system.equations]
    stated += [(symbol_numbers(*wish.errors), wish.constraint) for wish in system.wishes]
    stated += [(symbol_numbers(selector.value), selector.constraint) for selector in system.selectors]
    return next((number for read, number in stated if number is not None and read & rates), None)
