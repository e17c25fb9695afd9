"""Bipartite matching and strongly connected components: the structure of a system of equations.

Small and dependency-free on purpose: importing a graph library costs more than a ten-line script takes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence, Set
from heapq import heapify, heappop, heappush

from movimentum.cancellation import look


def maximum_matching(rows: Sequence[Sequence[int]], columns: int) -> tuple[list[int], list[int]]:
    """A maximum matching of rows to columns; ``rows[i]`` lists the columns that row i may take.

    The set of matched rows is the lexicographically first one that can be: earlier rows win over later rows
    (transversal matroid). What has no choice is matched first (Karp & Sipser 1981), which leaves next to nothing for
    augmenting paths; then rows without a column take that of a later row where an alternating path leads there.
    Returns ``(of_row, of_column)``, -1: unmatched.
    """
    of_row, of_column = _forced_matching(rows, columns)
    closed: set[int] = set()  # rows from which no free column can be reached, now or later
    for start in range(len(rows)):
        if of_row[start] < 0:
            look()
            path, came, _ = _alternating(rows, of_column, start, closed)
            if not path:
                closed |= came.keys()
            for row, column in path:
                of_row[row], of_column[column] = column, row
    passed: set[int] = set()  # rows from which only rows before `start` can be reached, whatever is exchanged elsewhere
    for start in range(len(rows)):
        if of_row[start] < 0:
            _, came, last = _alternating(rows, of_column, start, passed)
            if last == start:
                passed |= came.keys()
            else:
                row = last
                of_row[last] = -1
                while row != start:
                    before, column = came[row]
                    of_row[before], of_column[column] = column, before
                    row = before
    return of_row, of_column


def _alternating(
    rows: Sequence[Sequence[int]], of_column: Sequence[int], start: int, closed: Set[int] = frozenset()
) -> tuple[list[tuple[int, int]], dict[int, tuple[int, int]], int]:
    """Search the alternating paths from an unmatched row: an augmenting path (empty if there is none), for each row
    reached the (row, column) it was reached by, and the last row reached. Rows in ``closed`` are left out.
    """
    came: dict[int, tuple[int, int]] = {start: (-1, -1)}
    stack = [start]
    last = start
    while stack:
        row = stack.pop()
        for column in rows[row]:
            owner = of_column[column]
            if owner < 0:
                path = [(row, column)]
                while row != start:
                    before, column = came[row]
                    path.append((before, column))
                    row = before
                return path[::-1], came, last
            if owner not in came and owner not in closed:
                came[owner] = (row, column)
                last = max(last, owner)
                stack.append(owner)
    return [], came, last


def _forced_matching(rows: Sequence[Sequence[int]], columns: int) -> tuple[list[int], list[int]]:
    """A matching found by taking what has one choice left, again and again; where everything has several, the first
    row takes the column that the fewest others want.
    """
    of_row, of_column = [-1] * len(rows), [-1] * columns
    users: list[list[int]] = [[] for _ in range(columns)]
    for i, row in enumerate(rows):
        for column in row:
            users[column].append(i)
    row_left = [len(row) for row in rows]
    column_left = [len(wanting) for wanting in users]
    queue = deque([(i, -1) for i, left in enumerate(row_left) if left == 1])
    queue.extend((-1, column) for column, left in enumerate(column_left) if left == 1)

    def match(row: int, column: int) -> None:
        of_row[row], of_column[column] = column, row
        for other in users[column]:
            row_left[other] -= 1
            if row_left[other] == 1 and of_row[other] < 0:
                queue.append((other, -1))
        for other in rows[row]:
            column_left[other] -= 1
            if column_left[other] == 1 and of_column[other] < 0:
                queue.append((-1, other))

    for start in range(len(rows) + 1):
        while queue:
            row, column = queue.popleft()
            if row < 0 and of_column[column] < 0:
                row = next((other for other in users[column] if of_row[other] < 0), -1)
            elif row >= 0 and of_row[row] < 0:
                column = next((other for other in rows[row] if of_column[other] < 0), -1)
            else:
                continue
            if row >= 0 and column >= 0:
                match(row, column)
        if start < len(rows) and of_row[start] < 0 and row_left[start] > 0:
            free = [column for column in rows[start] if of_column[column] < 0]
            if free:
                match(start, min(free, key=column_left.__getitem__))
    return of_row, of_column


def strong_components(successors: Sequence[Sequence[int]]) -> list[list[int]]:
    """Strongly connected components, each before every component that has an edge to it (Tarjan 1972, without
    recursion).

    With edges from a node to what it depends on, that is the order in which to solve.
    """
    count = len(successors)
    index = [-1] * count
    low = [0] * count
    on_stack = [False] * count
    stack: list[int] = []
    components: list[list[int]] = []
    counter = 0
    for root in range(count):
        if index[root] >= 0:
            continue
        work = [(root, 0)]
        while work:
            node, position = work.pop()
            if position == 0:
                index[node] = low[node] = counter
                counter += 1
                stack.append(node)
                on_stack[node] = True
            descend = False
            for place in range(position, len(successors[node])):
                other = successors[node][place]
                if index[other] < 0:
                    work.append((node, place + 1))
                    work.append((other, 0))
                    descend = True
                    break
                if on_stack[other]:
                    low[node] = min(low[node], index[other])
            if descend:
                continue
            if low[node] == index[node]:
                component: list[int] = []
                while True:
                    other = stack.pop()
                    on_stack[other] = False
                    component.append(other)
                    if other == node:
                        break
                components.append(sorted(component))
            if work:
                parent = work[-1][0]
                low[parent] = min(low[parent], low[node])
    return components


def reachable(start: Sequence[int], successors: Sequence[Sequence[int]]) -> set[int]:
    """All nodes that can be reached from ``start`` (included)."""
    seen = set(start)
    stack = list(start)
    while stack:
        for other in successors[stack.pop()]:
            if other not in seen:
                seen.add(other)
                stack.append(other)
    return seen


def groups(count: int, links: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Connected components of an undirected graph on ``range(count)``, each sorted, in order of their least member."""
    parent = list(range(count))

    def find(node: int) -> int:
        while parent[node] != node:
            parent[node] = parent[parent[node]]
            node = parent[node]
        return node

    for a, b in links:
        parent[find(a)] = find(b)
    members: dict[int, list[int]] = {}
    for node in range(count):
        members.setdefault(find(node), []).append(node)
    return sorted(members.values())


def in_order(components: Sequence[Sequence[int]], successors: Sequence[Sequence[int]]) -> list[list[int]]:
    """The same ``components`` of a graph, each after those that it has an edge to, and the smallest node first where
    there is a choice: the order depends on the graph alone, not on how it was searched.
    """
    of = {node: i for i, component in enumerate(components) for node in component}
    awaited: list[set[int]] = [
        {of[other] for node in component for other in successors[node]} for component in components
    ]
    waiting: list[list[int]] = [[] for _ in components]
    for i, others in enumerate(awaited):
        others.discard(i)
        for other in others:
            waiting[other].append(i)
    left = [len(others) for others in awaited]
    ready = [(min(component), i) for i, component in enumerate(components) if not left[i]]
    heapify(ready)
    result: list[list[int]] = []
    while ready:
        _, i = heappop(ready)
        result.append(list(components[i]))
        for other in waiting[i]:
            left[other] -= 1
            if not left[other]:
                heappush(ready, (min(components[other]), other))
    return result
