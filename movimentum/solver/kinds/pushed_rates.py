"""How fast what is pushed moves, at any instants of its track."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Pushing
from movimentum.solver.block.rates import Moment
from movimentum.solver.block.sizes import track_scale
from movimentum.solver.continuation.tracks import NodeTrack, Path
from movimentum.solver.kinds.newton import probe_of
from movimentum.solver.pushing.course import PushCourse
from movimentum.solver.pushing.law import held, moved
from movimentum.solver.pushing.tracks import PushTrack


def extend_pushed(path: Path, nodes: FloatArray, block: Pushing, track: NodeTrack, moment: Moment) -> None:
    """Give the unknowns of ``block``, which know their values, their velocities; at events those after it. Where the
    path is one instant long, what touches there pushes.
    """
    tau = moment.instants.tau
    core = np.stack([np.broadcast_to((moment.values[n] or (np.nan,))[0], len(tau)) for n in block.core], axis=1)
    course = PushCourse(block, path.plan, probe_of(path, block), nodes, track_scale(path.plan, block))
    phases = track.phases if isinstance(track, PushTrack) else ()
    begins = [phase.begin for phase in phases]
    found = np.zeros_like(core)
    for k, time in enumerate(np.clip(tau, nodes[0], nodes[-1]).tolist()):
        if not phases:
            touching, _ = course.contacts.touching(course.at(time), core[k : k + 1], course.closed)
            v = moved(course.instant(time, core[k], touching)).v
            found[k] = np.nan if v is None else v
            continue
        phase = phases[max(bisect_right(begins, time) - 1, 0)]
        now = course.instant(time, core[k], phase.held, after=time in begins)
        found[k] = held(now, np.arange(len(phase.held), dtype=np.intp))
    for j, n in enumerate(block.core):
        moment.extend(n, found[:, j])
