"""Groups a system's equations into blocks that can be solved one after the other.

The Dulmage–Mendelsohn decomposition (Dulmage & Mendelsohn 1958; Pothen & Fan 1990, ACM TOMS 16): a maximum matching of
equations to unknowns splits off what has unknowns to spare (free motion); the rest falls into strongly connected
components. Equations that stay unmatched are *checks*: redundant if they hold, contradicting if not.
Structure is a plan, not a verdict: whether a block really has full rank is seen when it is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from movimentum.cancellation import look
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.unknowns import PoseCos, PosePart, PoseSin, Rate
from movimentum.planning.structure.graph import groups, in_order, maximum_matching, reachable, strong_components
from movimentum.records import dataclass
from movimentum.scene.model import ThingAngle


@dataclass(frozen=True, slots=True)
class Group:
    """Unknowns that are found together from ``equations``; ``free`` where there are more unknowns than equations, and
    ``pushed`` where inequalities push them, or wishes below others draw them.
    """

    unknowns: tuple[int, ...]
    equations: tuple[int, ...]
    free: bool = False
    pushed: bool = False


@dataclass(frozen=True, slots=True)
class Decomposition:
    """``groups`` in the order in which to solve them; ``checks`` are equations that determine nothing any more."""

    groups: tuple[Group, ...]
    checks: tuple[int, ...]


def decompose(
    system: System, merged: frozenset[int] = frozenset(), known: frozenset[int] = frozenset()
) -> Decomposition:
    """Group all equations of ``system``; unknowns that are ``known`` need none.

    Whatever is connected to an unknown in ``merged`` is kept together in one group with all its equations, redundant
    ones included: the fallback for what is singular by its geometry although its structure looks sound. Rates connect
    nothing: they are found by themselves.
    """
    look()
    equations = sorted(system.equations, key=lambda e: (e.priority, len(e.unknowns), e.number))
    held: list[Group] = []
    if merged:
        held, equations = _merged_groups(system, equations, merged)
    taken = known.union(*(group.unknowns for group in held))
    uses = [0] * len(system.unknowns)
    for equation in equations:
        for n in equation.targets:
            uses[n] += 1
    # an unknown that few equations could determine first: then hardly any choice has to be revised later
    rows = [sorted((n for n in e.targets if n not in taken), key=uses.__getitem__) for e in equations]
    of_row, of_column = maximum_matching(rows, len(system.unknowns))
    checks = [equations[i].number for i, column in enumerate(of_row) if column < 0]
    open_columns = [n for n, row in enumerate(of_column) if row < 0 and n not in taken]
    users: list[list[int]] = [[] for _ in system.unknowns]
    for i, equation in enumerate(equations):
        if of_row[i] >= 0:
            for n in _tied_unknowns(equation):
                users[n].append(of_row[i])
    free_columns = reachable(open_columns, users)
    _give_variables_their_rows(system, equations, (of_row, of_column), free_columns)
    hanging = _dependent_columns(system, equations, of_column, free_columns)
    free_columns -= hanging
    depends: list[list[int]] = [[] for _ in system.unknowns]
    for n, row in enumerate(of_column):
        if row >= 0:
            depends[n] = sorted(_tied_unknowns(equations[row]) - {n})
    # held groups stand for one node each: tie their unknowns into a cycle
    for group in held:
        members = group.unknowns
        outside = {m for e in group.equations for m in system.equations[e].unknowns}.difference(members)
        for place, n in enumerate(members):
            depends[n] = sorted({members[(place + 1) % len(members)], *outside} - {n})
    of_held = {n: group for group in held for n in group.unknowns}
    result: list[Group] = []
    after: list[Group] = []
    for component in in_order(strong_components(depends), depends):
        if component[0] in of_held:
            result.append(of_held[component[0]])
        elif component[0] in known:
            continue
        elif component[0] not in free_columns:
            numbers = tuple(equations[of_column[n]].number for n in component)
            group = Group(tuple(component), tuple(sorted(numbers)))
            (after if component[0] in hanging else result).append(group)
    result.extend(_free_groups(system, equations, of_row, free_columns))
    return Decomposition((*result, *after), tuple(sorted(checks)))


def _tied_unknowns(equation: Equation) -> frozenset[int]:
    """The unknowns that an equation may leave as free as others of them are: a velocity is given by a law, however free
    the motion is (what has to come first, `blocks.wishes.ordered_groups` sees to).
    """
    return frozenset(equation.targets) if equation.form is Form.VELOCITY else equation.unknowns


def _give_variables_their_rows(
    system: System, equations: list[Equation], matching: tuple[list[int], list[int]], columns: set[int]
) -> None:
    """Change the matching, within the free ``columns``, so that as many unknowns as can be that are no part of a pose
    have a row that gives them: ``h = Rod.P.y + Rod.Q.x`` gives h, and not where the rod is.
    """
    of_row, of_column = matching
    pose = {n for n in columns if isinstance(system.unknowns[n].payload, PosePart)}
    rows_of: dict[int, list[int]] = {}
    for i, column in enumerate(of_row):
        if column in columns:
            for n in equations[i].targets:
                if n in columns and n not in pose:
                    rows_of.setdefault(n, []).append(i)
    for start in sorted(columns - pose):
        if of_column[start] >= 0:
            continue
        came: dict[int, tuple[int, int]] = {start: (-1, -1)}  # an alternating path from there to a part of a pose
        stack, end = [start], -1
        while stack and end < 0:
            n = stack.pop()
            for i in rows_of.get(n, ()):
                owner = of_row[i]
                if owner not in came and _determines(equations[i], n):
                    came[owner] = n, i
                    if owner in pose:
                        end = owner
                        break
                    stack.append(owner)
        if end >= 0:
            of_column[end] = -1
            while end != start:
                end, row = came[end]
                of_column[end], of_row[row] = row, end


def _dependent_columns(system: System, equations: list[Equation], of_column: list[int], columns: set[int]) -> set[int]:
    """Those of the free ``columns`` that only hang from the others: no part of a pose, each given by its own equation.

    They move no anchor, so they have no say in how a free motion goes, and are found after it.
    """
    left = set(columns)
    users: dict[int, set[int]] = {n: set() for n in columns}
    for n in columns:
        if of_column[n] >= 0:
            for other in equations[of_column[n]].unknowns & columns:
                users[other].add(n)
    hanging: set[int] = set()
    progress = True
    while progress:
        progress = False
        for n in sorted(left):
            if of_column[n] >= 0 and not isinstance(system.unknowns[n].payload, PosePart):
                row = equations[of_column[n]]
                if row.targets == (n,) or ((users[n] & left) <= {n} and _determines(row, n)):
                    left.discard(n)
                    hanging.add(n)
                    progress = True
    # what a hanging unknown feeds must hang as well
    while True:
        bad = {n for n in hanging if users[n] & left}
        if not bad:
            return hanging
        hanging -= bad
        left |= bad


def _determines(equation: Equation, unknown: int) -> bool:
    if equation.polynomial is not None and max(m.count(unknown) for m in equation.polynomial) == 1:
        return True
    linear = equation.solved_for(unknown)
    return linear is not None and linear[0].value is not None


def _merged_groups(
    system: System, equations: list[Equation], merged: frozenset[int]
) -> tuple[list[Group], list[Equation]]:
    """Groups of what is connected to ``merged``, and the equations that are left."""
    links: list[tuple[int, int]] = []
    rates = {unknown.number for unknown in system.unknowns if isinstance(unknown.payload, Rate)}
    # what only measures is found afterwards
    plain = [e for e in _without_idle_equations(system, equations) if not e.targets or not rates.issuperset(e.targets)]
    for equation in plain:
        members = sorted(equation.unknowns - rates)
        links.extend((members[0], other) for other in members[1:])
    links.extend(_pose_links(system, range(len(system.unknowns))))
    held: list[Group] = []
    gone: set[int] = set()
    for component in groups(len(system.unknowns), links):
        members = set(component)
        if not members & merged:
            continue
        own = [e.number for e in plain if members & set(e.targets)]
        if not own:  # what only measures is still found from its own equation
            continue
        gone |= set(own)
        held.append(Group(tuple(component), tuple(sorted(own)), free=True))
    return held, [e for e in equations if e.number not in gone]


def _without_idle_equations(
    system: System, equations: list[Equation], *, keeping: type[ThingAngle] | None = None
) -> list[Equation]:
    """The equations without those that only give what no other equation reads and what is no part of a pose: an angle
    that nothing uses, a variable for a distance, and what is measured by these. What is ``keeping`` is no measure.
    """
    kept = (PosePart,) if keeping is None else (PosePart, keeping)
    left = {e.number: e for e in equations}
    users: list[set[int]] = [set() for _ in system.unknowns]
    for e in equations:
        for n in e.unknowns:
            users[n].add(e.number)
    waiting = [n for n, reading in enumerate(users) if len(reading) == 1]
    while waiting:
        n = waiting.pop()
        if len(users[n]) != 1 or isinstance(system.unknowns[n].payload, kept):
            continue
        (number,) = users[n]
        equation = left[number]
        if equation.targets != (n,) and not (n in equation.targets and _determines(equation, n)):
            continue
        del left[number]
        for other in equation.unknowns:
            users[other].discard(number)
            if len(users[other]) == 1:
                waiting.append(other)
    return [e for e in equations if e.number in left]


def _free_groups(system: System, equations: list[Equation], of_row: list[int], columns: set[int]) -> Iterable[Group]:
    rows = [i for i, column in enumerate(of_row) if column in columns]
    order = sorted(columns)
    place = {n: k for k, n in enumerate(order)}
    links: list[tuple[int, int]] = []
    for i in rows:
        inside = [place[n] for n in equations[i].unknowns if n in columns]
        links.extend((inside[0], other) for other in inside[1:])
    links.extend((place[a], place[b]) for a, b in _pose_links(system, order))
    for component in groups(len(order), links):
        members = {order[k] for k in component}
        own = tuple(sorted(equations[i].number for i in rows if members & equations[i].unknowns))
        yield Group(tuple(sorted(members)), own, free=True)


def _pose_links(system: System, unknowns: Iterable[int]) -> list[tuple[int, int]]:
    """Links between the pose unknowns of each thing: a body moves as one, also where no equation ties its unknowns."""
    first: dict[int, int] = {}
    links: list[tuple[int, int]] = []
    for n in unknowns:
        payload = system.unknowns[n].payload
        if isinstance(payload, PosePart):
            links.append((first.setdefault(payload.thing, n), n))
    return links


def driven_angles(system: System, with_rigidity: Callable[[System, frozenset[int]], System]) -> frozenset[int]:
    """The things whose direction follows from their angle (``Wheel.angle = 90*.t``, gears), rather than the other way
    round.

    An angle is driven where an equation gives it from what is known already. What is known grows in two ways until it
    no longer does: by such assignments, and by decomposing the equations that mention no undecided angle.
    ``with_rigidity`` is `planning.lowering.system.with_rigidity`.
    """
    angles = {payload.thing: number for payload, number in system.number_of.items() if isinstance(payload, ThingAngle)}
    driven: set[int] = set()
    measured: set[int] = set()
    if not angles:
        return frozenset()
    known: set[int] = set()

    rows_of: dict[int, list[int]] = {}
    full = with_rigidity(system, frozenset())
    for place, equation in enumerate(full.equations):
        for n in equation.unknowns:
            rows_of.setdefault(n, []).append(place)
    blocked = set(angles.values())
    # at first everything is looked at; later only what is connected with something that has become known since
    fresh = set(range(len(full.unknowns)))
    while True:
        places = [place for n in sorted(fresh, reverse=True) for place in reversed(rows_of.get(n, ()))]
        turned, given = _assigned_angles(full, len(system.equations), rows_of, places, known)
        driven |= turned
        fresh |= given
        blocked -= given
        if not blocked or not fresh:
            break
        open_rows = [
            [n for n in equation.targets if n not in known]
            for equation in _connected_equations(full, rows_of, known, blocked, fresh)
        ]
        found = _determined([row for row in open_rows if row])
        fresh = set(found)
        known |= found
        blocked -= found
        posed = {payload.thing for n in found if isinstance(payload := full.unknowns[n].payload, PoseCos | PoseSin)}
        for t in posed.intersection(angles) - driven:
            pose = (full.number_of[part] for part in (PoseCos(t), PoseSin(t)) if part in full.number_of)
            if angles[t] in blocked and known.issuperset(pose):
                measured.add(t)
                known.add(angles[t])
                fresh.add(angles[t])
                blocked.discard(angles[t])
    undecided = {t for t in angles if t not in driven and t not in measured}
    tied = {n for e in _without_idle_equations(system, list(system.equations), keeping=ThingAngle) for n in e.unknowns}
    return frozenset(driven | {t for t in undecided if angles[t] in tied})


def _assigned_angles(
    full: System, stated: int, rows_of: Mapping[int, Sequence[int]], places: Iterable[int], known: set[int]
) -> tuple[set[int], set[int]]:
    """The things whose angle is given by what is ``known``, and the unknowns that are: these are added to it, as one of
    the ``stated`` equations (the first ones) gives them, beginning with those at ``places``. ``rows_of``: the places of
    the equations of an unknown.
    """
    driven: set[int] = set()
    given: set[int] = set()
    waiting = list(places)
    while waiting:
        equation = full.equations[waiting.pop()]
        left = equation.unknowns - known
        if len(left) != 1 or equation.polynomial is None or equation.number >= stated:
            continue
        (target,) = left
        payload = full.unknowns[target].payload
        if isinstance(payload, PosePart) or max(m.count(target) for m in equation.polynomial) > 1:
            continue
        given.add(target)
        known.add(target)
        waiting += rows_of[target]
        if isinstance(payload, ThingAngle):
            driven.add(payload.thing)
            parts = (PoseCos(payload.thing), PoseSin(payload.thing))
            more = {n for part in parts if (n := full.number_of.get(part)) is not None and n not in known}
            given |= more
            known |= more
    return driven, given


def _connected_equations(
    system: System, rows_of: dict[int, list[int]], known: set[int], blocked: set[int], fresh: set[int]
) -> list[Equation]:
    """The equations connected with the unknowns ``fresh``, by unknowns that are not ``known``, without ``blocked``."""
    seen: set[int] = set()
    stack = sorted(fresh)
    visited = set(fresh)
    while stack:
        for place in rows_of.get(stack.pop(), ()):
            if place in seen or system.equations[place].unknowns & blocked:
                continue
            seen.add(place)
            for n in system.equations[place].unknowns:
                if n not in visited and n not in known:
                    visited.add(n)
                    stack.append(n)
    return [system.equations[place] for place in sorted(seen)]


def _determined(rows: list[list[int]]) -> set[int]:
    """The columns of ``rows`` that they determine: those that no freedom reaches (Dulmage & Mendelsohn)."""
    columns = sorted({n for row in rows for n in row})
    place = {n: k for k, n in enumerate(columns)}
    local = [[place[n] for n in row] for row in rows]
    of_row, of_column = maximum_matching(local, len(columns))
    users: list[list[int]] = [[] for _ in columns]
    for i, row in enumerate(local):
        if of_row[i] >= 0:
            for k in row:
                users[k].append(of_row[i])
    loose = reachable([k for k, row in enumerate(of_column) if row < 0], users)
    return {n for k, n in enumerate(columns) if k not in loose}
