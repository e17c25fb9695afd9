"""Differential equations: integrals that depend on what they drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Free, Ode
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import rounded, slopes_of
from movimentum.records import dataclass, replace
from movimentum.solver.basis.block_memo import code_of
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.block_at_instant import Probe
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.linearization import Tangent
from movimentum.solver.block.newton import freedom_of
from movimentum.solver.block.newton import newton as newton_steps
from movimentum.solver.block.problem import BlockProblem, Values, scale_of, track_scale
from movimentum.solver.block.rates import SeriesMoment
from movimentum.solver.continuation.free_motion import integrate_free_motion
from movimentum.solver.continuation.grid import Grid, end_of_upstream
from movimentum.solver.continuation.ode import Collocation, Equation, RateFunctions, integrate_equation
from movimentum.solver.continuation.tracks import Choice, Gap, OdeFailure, OdeTrack, Path, PolynomialTrack, Track
from movimentum.solver.free.velocity import FreeVelocity
from movimentum.solver.kinds import newton
from movimentum.solver.kinds.context import BlockSolutions, Kernel, StartContext
from movimentum.solver.kinds.variants import VariantLift, VariantRun
from movimentum.solver.solutions.newton_starts import FoundSolutions
from movimentum.tolerances import RANK_OF_ROWS


class _Problems:
    """The equations of a block along a path, given its states."""

    def __init__(self, path: Path, block: Ode) -> None:
        self.path, self.block = path, block
        self.scale = track_scale(path.plan, block)
        self._reads = (block.inputs | block.algebraic.inputs) - set(block.states)

    def outer(self, tau: FloatArray) -> BlockProblem:
        """At the times ``tau`` (F,), but for the states."""
        instants = self.path.instants(tau)
        before = self.path.before(self.block.number, instants)
        inputs = {n: value for n in self._reads if (value := before[n]) is not None}
        return BlockProblem(self.block.algebraic, inputs, instants.clocks, self.scale)

    def given(self, outer: BlockProblem, z: FloatArray) -> BlockProblem:
        """With the states ``z`` (F, p)."""
        return outer.given(dict(zip(self.block.states, z.T, strict=True)))

    def at(self, tau: float, z: FloatArray) -> BlockProblem:
        """At one time, with the states ``z`` (p,)."""
        return self.given(self.outer(np.array([tau])), z[None])

    def rates(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, p) the rates of the states, at core values ``x`` (F, n)."""
        found = self.block.integrands(problem.values(x), problem.clocks)
        rates = np.empty((len(x), len(found)))
        for j, value in enumerate(found):
            rates[:, j] = value
        return rates


def _equation(problems: _Problems) -> Equation:
    """The differential equation of a block along its path."""
    block = problems.block
    jacobian: list[_Jacobian] = []
    rounding = _Rounding(block, tuple(problems.path.plan.clocks))

    def at(tau: FloatArray) -> RateFunctions:
        outer = problems.outer(tau)

        def rates(z: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray]:
            problem, x = problems.given(outer, z), near
            if block.core:
                outcome = newton_steps(problem, near, iterations=12)
                x = np.where(outcome.converged[:, None], outcome.x, np.nan)
            return x, problems.rates(problem, x)

        def slopes(z: FloatArray, x: FloatArray) -> FloatArray:
            if not jacobian:
                jacobian.append(_Jacobian(problems.path, block))
            return jacobian[0](problems.given(outer, z), x)

        def noise(z: FloatArray, x: FloatArray) -> FloatArray:
            problem = problems.given(outer, z)
            found = rounding(problem.values(x), problem.clocks)
            return np.stack([np.broadcast_to(each, len(x)) for each in found], axis=-1)

        return RateFunctions(rates, slopes, noise)

    return at


@dataclass(slots=True, eq=False)
class _FreeOde:
    """A block with freedom left: its core moves as little as it can while the states run. Both are integrated."""

    problems: _Problems
    nodes: FloatArray

    def velocity(self, tau: float, x: FloatArray, tangent: Tangent | None = None, after: bool = False) -> FloatArray:
        """See `Integrable`; the states are last."""
        count = len(self.problems.block.core)
        core, z = x[:count], x[count:]
        rates = self.problems.rates(self.problems.at(tau, z), core[None])[0]

        def probe(times: FloatArray) -> BlockProblem:
            return self.problems.given(self.problems.outer(times), z + (times - tau)[:, None] * rates)

        return np.concatenate([self._free(probe).velocity(tau, core, tangent, after), rates])

    def restored(self, tau: float, x: FloatArray, tangent: Tangent | None = None) -> tuple[FloatArray, bool, Tangent]:
        """See `Integrable`."""
        count = len(self.problems.block.core)
        free = self._free(lambda times: self.problems.given(self.problems.outer(times), x[None, count:]))
        core, good, tangent = free.restored(tau, x[:count], tangent)
        return np.concatenate([core, x[count:]]), good, tangent

    def _free(self, probe: Probe) -> FreeVelocity:
        rows = self.problems.block.algebraic
        assert isinstance(rows, Free)
        return FreeVelocity(rows, self.problems.path.plan, probe, self.nodes)


def _free_tracks(path: Path, block: Ode, nodes: FloatArray, x: FloatArray, until: float) -> OdeTrack:
    """The tracks of a block with freedom left, from the core and the states ``x``."""
    count = len(block.core)
    scale = scale_of(path.plan, (*block.core, *block.states))
    found = integrate_free_motion(_FreeOde(_Problems(path, block), nodes), x, scale, nodes, until)
    core, states = (
        replace(found, values=found.values[:, part], rates=found.rates[:, part])
        for part in (slice(count), slice(count, None))
    )
    return OdeTrack(core, states)


class _Rounding:
    """What rounding makes of a block's rates, in units of that of one number. It is compiled when it is first asked."""

    def __init__(self, block: Ode, clocks: tuple[Fraction, ...]) -> None:
        self._derivatives, self._clocks = block.derivatives, clocks

    def __call__(self, values: State | Values, clocks: Sequence[FloatArray]) -> Sequence[Any]:
        """One for each state, of arrays that broadcast."""
        return code_of([rounded(each) for each in self._derivatives], self._clocks)(values, clocks)


class _Jacobian:
    """The derivatives of a block's integrands by its states, also by way of the core. They are compiled when they are
    first asked for.
    """

    def __init__(self, path: Path, block: Ode) -> None:
        self._states, self._core = len(block.states), len(block.core)
        roots = (*block.derivatives, *block.algebraic.residuals)
        self._entries, outputs = slopes_of(roots, (*block.states, *block.core))
        self._rows = self._states + len(block.algebraic.residuals)
        self._code = compiled(outputs, Clocks(path.plan.clocks))

    def __call__(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, p, p) at core values ``x`` (F, n)."""
        p = self._states
        whole = np.zeros((len(x), self._rows, p + self._core))
        for (i, j), value in zip(self._entries, self._code(problem.values(x), problem.clocks), strict=True):
            whole[:, i, j] = value
        if not self._core:
            return whole
        moved = -np.linalg.pinv(whole[:, p:, p:] * problem.scale, rcond=RANK_OF_ROWS) @ whole[:, p:, :p]
        return whole[:, :p, :p] + whole[:, :p, p:] @ (moved * problem.scale[:, None])


def _combined_variants(run: VariantRun, block: Ode) -> Callable[[FloatArray, Sequence[FloatArray]], RateFunctions]:
    """The equations of V variants without a core, as one: their states side by side, variant by variant."""
    count, states = len(run.size), len(block.states)
    partials, outputs = slopes_of(block.derivatives, block.states)
    slope = code_of(outputs, tuple(run.plan.clocks))
    rounding = _Rounding(block, tuple(run.plan.clocks))

    def equation(tau: FloatArray, clocks: Sequence[FloatArray]) -> RateFunctions:
        many = tau.shape[-1]

        def known(z: FloatArray) -> State:
            state = list(run.state)
            for j, n in enumerate(block.states):
                state[n] = z.reshape(many, count, states)[:, :, j].T
            return state

        def rates(z: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
            found = np.empty((many, count, states))
            for j, value in enumerate(block.integrands(known(z), clocks)):
                found[:, :, j] = np.broadcast_to(value, (count, many)).T
            return x, found.reshape(many, -1)

        def slopes(z: FloatArray, x: FloatArray) -> FloatArray:
            found = np.zeros((many, count, states, states))
            for (i, j), value in zip(partials, slope(known(z), clocks), strict=True):
                found[:, :, i, j] = np.broadcast_to(value, (count, many)).T
            return found if count > 1 else found[:, 0]

        def noise(z: FloatArray, x: FloatArray) -> FloatArray:
            found = rounding(known(z), clocks)
            return np.stack([np.broadcast_to(each, (count, many)).T for each in found], axis=-1).reshape(many, -1)

        return RateFunctions(rates, slopes, noise)

    return equation


class OdeKernel(Kernel[Ode]):
    """See `Kernel`."""

    def begin(self, start: StartContext, block: Ode) -> BlockSolutions:
        """The solutions for the core, with the states as they are so far."""
        scale = track_scale(start.plan, block)
        for n in block.states:
            start.state[n] = np.full(2, start.totals.get(n, 0.0))
        if block.free:
            starts = start.free_start(block, scale)
        else:
            starts = (
                newton.starts_near_carried(start, block, block.algebraic, scale)
                if block.core
                else FoundSolutions([np.zeros(0)], complete=True)
            )
        found = newton.block_solutions(start, block, starts)
        states = tuple(start.totals.get(n, 0.0) for n in block.states)
        found.choices = [Choice(values=(*choice.values, *states)) for choice in found.choices]
        return found

    def set_choice(self, start: StartContext, block: Ode, choice: Choice) -> None:
        """Set the core and the states, at both instants."""
        core = np.repeat(np.array(choice.values[: len(block.core)])[None], 2, axis=0)
        state = start.state
        for n in block.states:
            state[n] = start.totals.get(n, 0.0) * np.ones(2)
        newton.set_at_both_instants(start, block.algebraic, core)
        slopes = block.integrands(state, start.instants.clocks)
        for n, slope in zip(block.states, slopes, strict=True):
            state[n] = state[n] + np.array([0.0, start.ahead]) * np.broadcast_to(slope, 2)
        newton.set_at_both_instants(start, block.algebraic, core)

    def first_track(self, path: Path, block: Ode, choice: Choice) -> OdeTrack:
        """The track where a path is one instant long."""
        values, count = np.array(choice.values), len(block.core)
        return OdeTrack(
            PolynomialTrack.still(path.begin, values[:count]), PolynomialTrack.still(path.begin, values[count:])
        )

    def lifted(self, block: Ode, lift: VariantLift) -> dict[str, Any]:
        """The integrands, of what has no equations to be met besides, and is driven by nothing but time."""
        owner = lift.plan.owner
        if block.core or block.free or any(lift.plan.blocks[owner[n]].moving for n in block.inputs if n in owner):
            raise NotImplementedError("differential equations with other equations")
        derivatives = tuple(map(lift.formula, block.derivatives))
        return {"derivatives": derivatives, "integrands": lift.code(derivatives)}

    def compared(self, run: VariantRun, block: Ode, choice: Any) -> list[Any]:
        """The integrands, and what the states give."""
        fill_explicit(block, run.state, run.instants.clocks)
        return [*block.integrands(run.state, run.instants.clocks), *(run.state[n] for n in block.targets)]

    def solve_variants(self, run: VariantRun, block: Ode, choice: Any) -> None:
        """Integrate all variants in the same steps; a variant whose equation leads nowhere leaves all of them rough."""
        count, states = len(run.size), len(block.states)
        begun = np.zeros((count, states))
        for j, n in enumerate(block.states):
            begun[:, j] = run.before.get(n, 0.0)
        equation = _combined_variants(run, block)
        if not run.path:  # nearby instants
            clocks = run.instants.clocks
            _, rates = equation(run.instants.tau[..., :1], [clock[..., :1] for clock in clocks]).rates(
                begun.reshape(1, -1), np.zeros((1, 0))
            )
            away = run.instants.tau - run.instants.tau[..., :1]
            for j, n in enumerate(block.states):
                run.state[n] = begun[:, j : j + 1] + away * rates.reshape(count, states)[:, j : j + 1]
            return
        tau = run.instants.tau
        offsets = [float(clock[0] - tau[0]) for clock in run.instants.clocks]

        def at(times: FloatArray) -> RateFunctions:
            return equation(times, [times + offset for offset in offsets])

        flow = Collocation(at, tau, np.zeros(0), systems=count)
        track = flow.track(np.zeros(0), begun.reshape(-1), float(tau[-1]))
        run.rough |= bool(track.states.until < tau[-1] or track.failure is not OdeFailure.NONE)
        values = track.states.guess(tau).reshape(count, states, -1)
        for j, n in enumerate(block.states):
            run.state[n] = values[:, j]

    def rates(self, block: Ode, moment: SeriesMoment, depth: int) -> FloatArray | None:
        """None where freedom is left, which no velocity field says how to follow."""
        if not block.free:
            return super().rates(block, moment, depth)
        from movimentum.solver.free.rates import mark_undefined

        mark_undefined(block, moment, depth)
        return None

    def follow(self, path: Path, grid: Grid, block: Ode, choice: Choice, gaps: list[Gap]) -> OdeTrack:
        """The tracks of the core and of the states; where there is no solution is added to ``gaps``."""
        x, count = np.array(choice.values), len(block.core)
        until = end_of_upstream(path, block, gaps)
        scale = track_scale(path.plan, block)
        with np.errstate(all="ignore"):
            rows = block.algebraic
            if isinstance(rows, Free) and freedom_of(_Problems(path, block).at(path.begin, x[count:]), x[:count]) > 0:
                track = _free_tracks(path, block, grid.tau, x, until)
            else:
                track = integrate_equation(
                    _equation(_Problems(path, block)), grid.tau, scale, x[:count], x[count:], until
                )
        if track.core.until < path.end and track.core.until < until:
            gaps.append(Gap(track.core.until, path.end, block.number))
        return track

    def evaluate(self, path: Path, block: Ode, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the states and the core; returns where there is no solution."""
        assert isinstance(track, OdeTrack)
        for n, value in zip(block.states, track.states.guess(instants.tau), strict=True):
            state[n] = value
        return newton.solve_from(path, block.algebraic, track.core, state, instants, None)
