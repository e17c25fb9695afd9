"""Bipartite matching and strongly connected components: the structure of a system of equations.

Small and dependency-free on purpose: importing a graph library costs more than a ten-line script takes.
"""

from __future__ import annotations

from collections.abc import Sequence


def maximum_matching(rows: Sequence[Sequence[int]], columns: int) -> tuple[list[int], list[int]]:
    """A maximum matching of rows to columns; ``rows[i]`` lists the columns that row i may take.

    Rows are tried in order, each by an augmenting path (Kuhn's algorithm, without recursion), so the set of matched
    rows is the lexicographically first one: earlier rows win over later rows (transversal matroid). Returns ``(of_row,
    of_column)``, -1: unmatched.
    """
    of_row = [-1] * len(rows)
    of_column = [-1] * columns
    for start in range(len(rows)):
        visited: set[int] = set()
        for column in rows[start]:  # most rows find a free column at once
            if of_column[column] < 0:
                of_row[start], of_column[column] = column, start
                break
        else:
            path: list[tuple[int, int]] = []  # (row, position of the next column to try)
            stack = [(start, 0)]
            while stack:
                row, position = stack[-1]
                if position == len(rows[row]):
                    stack.pop()
                    if path:
                        path.pop()
                    continue
                stack[-1] = (row, position + 1)
                column = rows[row][position]
                if column in visited:
                    continue
                visited.add(column)
                path.append((row, column))
                owner = of_column[column]
                if owner < 0:
                    for matched_row, matched_column in path:
                        of_row[matched_row], of_column[matched_column] = matched_column, matched_row
                    break
                stack.append((owner, 0))
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
