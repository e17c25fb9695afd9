"""Velocities (and accelerations) of free motions and pushed things, by the law that moves them."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Pushing, Velocity
from movimentum.planning.plan import Plan
from movimentum.solver.arithmetic.taylor import coefficient
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import track_scale
from movimentum.solver.block.rates import Moment
from movimentum.solver.continuation.tracks import Choice, NodeTrack, Path, Track
from movimentum.solver.free.rates import depths, extend
from movimentum.solver.kinds.context import Beginning, Kernel
from movimentum.solver.kinds.newton import probe_of
from movimentum.solver.pushing.course import PushCourse
from movimentum.solver.pushing.law import held, moved
from movimentum.solver.pushing.tracks import PushTrack


class VelocityKernel(Kernel[Velocity]):
    """See `Kernel`. The rates are evaluated at any instants, given the state of all blocks ``behind``."""

    def take(self, start: Beginning, block: Velocity, choice: Choice) -> None:
        """Set the rates."""
        _set_rates(start.plan, block, start.state, start.instants)

    def evaluate(self, path: Path, block: Velocity, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the rates."""
        law = path.tracks[block.law]
        if isinstance(law, NodeTrack) and math.isinf(law.tolerance):  # accuracy was given up on the way
            for n in block.unknowns:
                state[n] = np.full(len(instants), np.nan)
        else:
            _set_rates(path.plan, block, state, instants, path)
        return None


def _set_rates(plan: Plan, block: Velocity, state: State, instants: Instants, path: Path | None = None) -> None:
    """Without a ``path``, at its beginning, what pushes is not known yet: a block that is pushed has the velocity that
    it would have alone.
    """
    count, segment = len(instants), plan.system.segment
    ahead = segment.end > segment.start  # at the end of it all there is no other side of a kink
    moment = Moment(plan, instants, [None if value is None else (value,) for value in state], ahead)
    with np.errstate(all="ignore"):
        needed = depths(plan, block.behind, {block.law: block.order})
        for number in block.behind:
            law, track = plan.blocks[number], None if path is None else path.tracks[number]
            if path is not None and isinstance(law, Pushing) and isinstance(track, NodeTrack):
                aside = 0.5 if path.end == path.begin else 0.0  # of one instant: what drives it goes on
                nodes = np.linspace(path.begin - aside, path.end + aside, max(len(track.tau), 2))
                extend_pushed(path, nodes, law, track, moment)
            else:
                extend(law, moment, needed[number])
        extend(block, moment, 0)
    for n in block.unknowns:
        state[n] = np.array(np.broadcast_to(coefficient(moment.values[n] or (), 0), count), dtype=np.float64)


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
