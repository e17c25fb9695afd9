"""Irreducible loops of many variants, followed side by side: a predictor from the instants before, Newton's method, and
the rules by which a step counts (`solver.continuation.trace`).

All variants take the same steps. One whose step does not count is left to be solved by itself.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.planning.blocks.kinds import Newton
from movimentum.solver.block.newton import newton_of_variants
from movimentum.solver.kinds.variants import LoopEnds, VariantRun, problem_at
from movimentum.tolerances import SMALL_LOOP_CORRECTION

LARGEST_STEP = 0.25
"""How far (in units of the unknowns' scale) a step may lead."""
LARGEST_CORRECTION = 0.1
"""How much of that Newton's method may correct, where it is more than `SMALL_LOOP_CORRECTION`."""
FEWEST_INSTANTS = 3
"""Instants of a path from which it may be followed on to its end."""
WEAKEST_DETERMINANT = 2e-3
"""Of its largest value on the way: a determinant below that is near to a singular point."""


def follow_loop(run: VariantRun, block: Newton, core: FloatArray) -> LoopEnds:
    """Set the state of a block that Newton's method solves, from its ``core`` (V, n) at the first instant."""
    state, instants = run.state, run.instants
    count, unknowns = core.shape
    many = len(instants)
    scale = run.scale(block)
    path = np.empty((many, count, unknowns))
    determinants = np.zeros((many, count))
    end = np.full(count, many)
    for k in range(many):
        guess = core if k == 0 else _predicted(path, instants.tau, k)
        x, converged, determinants[k] = newton_of_variants(problem_at(run, block, k, scale), guess)
        counts = converged
        if k:
            moved = np.max(np.abs(x - path[k - 1]) / scale, axis=1)
            correction = np.max(np.abs(x - guess) / scale, axis=1)
            counts &= (moved <= LARGEST_STEP) & (
                correction <= np.maximum(LARGEST_CORRECTION * moved, SMALL_LOOP_CORRECTION)
            )
        end = np.where(counts, end, np.minimum(end, k))
        path[k] = np.where(np.isfinite(x), x, path[k - 1] if k else core)
    for j, n in enumerate(block.core):
        state[n] = np.ascontiguousarray(path[:, :, j].T)
    return _ends(determinants, end)


def _ends(determinants: FloatArray, end: IntArray) -> LoopEnds:
    """What (T, V) determinants tell of paths that were followed as far as ``end`` (V,)."""
    many = len(determinants)
    inside = np.arange(many)[:, None] < end
    strength = np.where(inside, determinants * np.sign(determinants[0]), 0.0)
    weak = ~(strength > WEAKEST_DETERMINANT * np.max(strength, axis=0))
    sure = np.where(weak.any(axis=0), np.argmax(weak, axis=0), many) - 1
    lost = np.where(end == many, sure + 1 < many, (strength < 0.0).any(axis=0) | (sure < FEWEST_INSTANTS))
    return LoopEnds(end, sure, np.asarray(lost, dtype=np.bool_))


def _predicted(path: FloatArray, tau: FloatArray, k: int) -> FloatArray:
    """(V, n) the values at instant ``k`` by the polynomial through those before, as far as these lie apart."""
    chosen = [k - 1]
    for place in range(k - 2, -1, -1):
        if tau[chosen[-1]] - tau[place] > 0.2 * (tau[k] - tau[k - 1]):
            chosen.append(place)
        if len(chosen) == 4:
            break
    if tau[k] == tau[k - 1] or len(chosen) < 2:
        return path[k - 1]
    total = np.zeros_like(path[k - 1])
    for i in chosen:
        weight = 1.0
        for other in chosen:
            if other != i:
                weight *= (tau[k] - tau[other]) / (tau[i] - tau[other])
        total += weight * path[i]
    return total
