"""Velocities (and accelerations) of free motions and pushed things, by the law that moves them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Block, Pushing, Velocity
from movimentum.planning.plan import Plan
from movimentum.solver.arithmetic.taylor import coefficient, shifted
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.rates import SeriesMoment
from movimentum.solver.continuation.tracks import Choice, NodeTrack, Path, Track
from movimentum.solver.free.rates import derivative_depths
from movimentum.solver.kinds.context import Kernel, StartContext
from movimentum.solver.kinds.pushing import extend_pushed

Rates = Callable[[Block, SeriesMoment, int], FloatArray | None]


class VelocityKernel(Kernel[Velocity]):
    """See `Kernel`. The rates are evaluated at any instants, given the state of all blocks ``behind``; ``rates_of``
    gives those of any block (see `kernels.rates`).
    """

    def __init__(self, rates_of: Rates) -> None:
        self._rates_of = rates_of

    def set_choice(self, start: StartContext, block: Velocity, choice: Choice) -> None:
        """Set the rates."""
        self._set_rates(start.plan, block, start.state, start.instants)

    def evaluate(self, path: Path, block: Velocity, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the rates."""
        law = path.tracks[block.law]
        if isinstance(law, NodeTrack) and math.isinf(law.tolerance):  # accuracy was given up on the way
            for n in block.unknowns:
                state[n] = np.full(len(instants), np.nan)
        else:
            self._set_rates(path.plan, block, state, instants, path)
        return None

    def rates(self, block: Velocity, moment: SeriesMoment, depth: int) -> FloatArray | None:
        """Those of what it is the velocity of, one order higher."""
        for n in block.unknowns:
            series = moment.values[moment.plan.system.differentiated(n)[0]] or ()
            for _ in range(block.order):
                series = shifted(series)
            moment.values[n] = series[: depth + 1]
        return None

    def _set_rates(
        self, plan: Plan, block: Velocity, state: State, instants: Instants, path: Path | None = None
    ) -> None:
        """Without a ``path``, at its beginning, what pushes is not known yet: a block that is pushed has the velocity
        that it would have alone.
        """
        count, segment = len(instants), plan.system.segment
        ahead = segment.end > segment.start  # at the end of it all there is no other side of a kink
        moment = SeriesMoment(plan, instants, [None if value is None else (value,) for value in state], ahead)
        with np.errstate(all="ignore"):
            needed = derivative_depths(plan, block.upstream, {block.law: block.order})
            for number in block.upstream:
                law, track = plan.blocks[number], None if path is None else path.tracks[number]
                if path is not None and isinstance(law, Pushing) and isinstance(track, NodeTrack):
                    aside = 0.5 if path.end == path.begin else 0.0  # of one instant: what drives it goes on
                    nodes = np.linspace(path.begin - aside, path.end + aside, max(len(track.tau), 2))
                    extend_pushed(path, nodes, law, track, moment)
                else:
                    self._rates_of(law, moment, needed[number])
            self._rates_of(block, moment, 0)
        for n in block.unknowns:
            state[n] = np.array(np.broadcast_to(coefficient(moment.values[n] or (), 0), count), dtype=np.float64)
