"""In which order a search solves blocks."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from heapq import heapify, heappop, heappush

from movimentum.planning.blocks.kinds import Block


def solving_order(blocks: Sequence[Block], owner: Mapping[int, int], branching: Container[int]) -> list[int]:
    """The place of each block in an order of solving in which what has one solution comes as early as it can.

    So a choice is judged by all that follows from it before the next choice is made, and made next is what depends
    on the latest choices.
    """
    needs = [{owner[n] for n in b.inputs if n in owner} for b in blocks]
    users: list[list[int]] = [[] for _ in blocks]
    for number, some in enumerate(needs):
        for other in some:
            users[other].append(number)
    waiting = [len(some) for some in needs]
    ready = [(number in branching, 0, number) for number, count in enumerate(waiting) if count == 0]
    heapify(ready)
    rank = [0] * len(blocks)
    place = 0
    while ready:
        _, _, number = heappop(ready)
        rank[number] = place
        place += 1
        for other in users[number]:
            waiting[other] -= 1
            if waiting[other] == 0:  # what hangs on the latest choices next: then it fails soon, if it has to
                heappush(ready, (other in branching, -place, other))
    return rank
