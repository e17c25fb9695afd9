"""How far anchors move: the quadratic form that least motion minimises."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.equations import System
from movimentum.plan.unknowns import PoseCos, PoseSin, PoseX, PoseY


def anchor_metric(
    system: System, core: Sequence[int]
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[int, ...]]:
    """The sum of squared speeds of all anchors of the things in ``core``, as v' M v + 2 v' C w + (what v does not
    change).

    v are the speeds of the unknowns ``core``, w those of the same things' other pose unknowns, which are known. Returns
    M (n, n), C (n, p) and the p numbers of the latter. Unknowns that move no anchor get a tiny weight of their own, so
    that they too stay where nothing drives them.
    """
    place = {system.unknowns[n].payload: k for k, n in enumerate(core)}
    coupled: list[int] = []
    for thing in system.scene.things:
        payloads = [kind(thing.number) for kind in (PoseX, PoseY, PoseCos, PoseSin)]
        if any(payload in place for payload in payloads):
            coupled += [system.number_of[p] for p in payloads if p in system.number_of and p not in place]
    n = len(core)
    place |= {system.unknowns[number].payload: n + k for k, number in enumerate(coupled)}
    whole = np.zeros((n + len(coupled), n + len(coupled)))
    for thing in system.scene.things:
        columns = [place.get(kind(thing.number)) for kind in (PoseX, PoseY, PoseCos, PoseSin)]
        if all(k is None or k >= n for k in columns):
            continue
        frame = system.frame(thing.number)
        for anchor in thing.anchors:
            dx, dy = frame.local(anchor.local)
            for form in ((1.0, 0.0, dx, -dy), (0.0, 1.0, dy, dx)):
                for i, ki in enumerate(columns):
                    for j, kj in enumerate(columns):
                        if ki is not None and kj is not None:
                            whole[ki, kj] += form[i] * form[j]
    scale = float(np.max(np.diag(whole)[:n], initial=0.0)) or 1.0
    return whole[:n, :n] + 1e-9 * scale * np.eye(n), whole[:n, n:], tuple(coupled)
