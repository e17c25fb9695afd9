"""Blocks that Newton's method solves, with or without freedom left."""

from __future__ import annotations

from collections.abc import Hashable
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Block, Free, Newton
from movimentum.planning.codegen.elimination import newton_steps, pivot_order
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.calculus import with_respect_to
from movimentum.planning.plan import Plan
from movimentum.records import replace
from movimentum.scene.leaves import ContactPlace
from movimentum.solver.basis.block_memo import memoized
from movimentum.solver.basis.instants import Instants, distinct
from movimentum.solver.block.block_at_instant import OutlinePlace, Probe
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.full_turns import keeps_cord_turns, without_full_turns
from movimentum.solver.block.newton import freedom_of, newton, newton_unrolled
from movimentum.solver.block.problem import BlockProblem, scale_of, track_scale
from movimentum.solver.continuation.free_motion import integrate_free_motion
from movimentum.solver.continuation.grid import Grid, end_of_upstream
from movimentum.solver.continuation.runaways import pole_ahead
from movimentum.solver.continuation.trace import trace_path
from movimentum.solver.continuation.tracks import Choice, Gap, NodeTrack, Path, PolynomialTrack, Track
from movimentum.solver.free.velocity import FreeVelocity, workspace_size
from movimentum.solver.kinds.context import BlockSolutions, Kernel, LoopRows, ResumeContext, StartContext
from movimentum.solver.kinds.variant_free_paths import lifted_free, solve_free_variants
from movimentum.solver.kinds.variant_loops import follow_loop
from movimentum.solver.kinds.variants import VariantLift, VariantRun
from movimentum.solver.solutions.newton_starts import FoundSolutions, carried_start, newton_starts
from movimentum.tolerances import FOLD_CLOSED, FREE_MOTION_STEP, LARGE_FREE_MOTION_STEP

if TYPE_CHECKING:
    from movimentum.solver.block.rates import SeriesMoment

FEW_INSTANTS = 16
"""Instants below which a batched dense solver is cheaper than generating code for the block."""
LARGEST_UNROLLED = 24
"""Unknowns; unrolled elimination of larger blocks makes too much code."""
MOST_MEMOIZED = 100_000
"""Values of a block at many instants; more take more room than they save time."""

_identities = count(1)


def starts_near_carried(start: StartContext, block: Block, rows: Newton, scale: FloatArray) -> FoundSolutions:
    """`newton_starts` for the equations ``rows`` of ``block``, with angles near to where they were."""
    problem = BlockProblem.of(rows, start.state, start.instants.clocks, scale)
    found = newton_starts(start.plan, problem, start.carry, start.all_of(block, scale))
    return FoundSolutions(
        without_full_turns(start.plan, problem, found.solutions, start.carry), found.complete, found.effort
    )


def block_solutions(start: StartContext, block: Block, starts: FoundSolutions) -> BlockSolutions:
    """What a search for core vectors comes to."""
    solutions = starts.solutions
    if isinstance(block, Newton) and solutions:
        one = BlockProblem.of(block, start.state, start.instants.clocks, track_scale(start.plan, block)).first()
        solutions = [x for x in solutions if keeps_cord_turns(start.plan, one, x, start.carry)]
    choices = [choice_from(start, block, x) for x in solutions]
    return BlockSolutions(choices, [] if choices else [-np.inf], starts.complete, starts.effort)


def choice_from(start: StartContext, block: Block, x: FloatArray) -> Choice:
    """The choice of core values ``x`` (n,)."""
    if not block.moving:  # what stands still keeps the values of all its unknowns, in their order
        x = np.array([x[block.core.index(n)] if n in block.core else 0.0 for n in block.unknowns])
    return Choice(values=tuple(float(v) for v in x))


def set_at_both_instants(start: StartContext, block: Newton, core: FloatArray) -> None:
    """Set the core, given for both instants (2, n), solved for again at the second."""
    problem = BlockProblem.of(block, start.state, start.instants.clocks, track_scale(start.plan, block))
    later = newton(problem, core, limit=0.05)
    x = np.array([core[0], later.x[1] if later.converged[1] else core[0]])
    for j, n in enumerate(block.core):
        start.state[n] = x[:, j]


def single_node(path: Path, values: FloatArray) -> NodeTrack:
    """A track of one node at the beginning of a path."""
    return NodeTrack(np.array([path.begin]), values[None, :], np.zeros((1, len(values))), path.begin)


def _path_key(
    path: Path, block: Newton, choice: Choice, nodes: FloatArray, until: float, sizes: FloatArray
) -> Hashable:
    """Everything that a block's path depends on: None where that cannot be determined."""
    above: list[Hashable] = []
    for number in path.upstream(block.number):
        other, track = path.plan.blocks[number], path.tracks[number]
        key = () if track is None else track.key
        if not other.identity or key is None:
            return None
        above.append((other.identity, key))
    if not block.identity:
        return None
    clocks = tuple(path.segment_start - start for start in path.plan.clocks)
    scales = sizes.tobytes(), track_scale(path.plan, block).tobytes()
    begin = path.begin, np.array([*choice.values, *(choice.rates or ())]).tobytes()
    # how fast wishes are followed
    fields = (path.plan.size, workspace_size(path.plan.system.scene)) if isinstance(block, Free) else ()
    return "path", block.identity, begin, nodes.tobytes(), until, clocks, scales, fields, tuple(above)


def solve_from(
    path: Path,
    block: Newton,
    track: NodeTrack | PolynomialTrack,
    state: State,
    instants: Instants,
    step: Compiled | None,
) -> BoolArray:
    """`evaluate`, by Newton steps that ``step`` computes, as far as they serve."""
    x = track.guess(instants.tau)
    problem = BlockProblem.of(block, state, instants.clocks, track_scale(path.plan, block))
    converged = newton_unrolled(problem, x, step) if step is not None else np.zeros(x.shape[1], np.bool_)
    if not converged.all():  # few frames, or a pivot that was good on the path's nodes and is not here
        left = np.nonzero(~converged)[0]
        outcome = newton(problem.at(left, len(instants)), x[:, left].T, limit=0.1)
        x[:, left] = outcome.x.T
        converged[left] = outcome.converged
    for j, n in enumerate(block.core):
        state[n] = x[j]
    return ~converged | (instants.tau > track.until)


def stepper(path: Path, block: Newton, track: NodeTrack) -> Compiled | None:
    """Newton's step of a square block as straight-line code, its pivots chosen for the path's nodes (made once)."""
    if block.number not in path.steppers:
        path.steppers[block.number] = _new_stepper(path, block, track)
    return path.steppers[block.number]


def _new_stepper(path: Path, block: Newton, track: NodeTrack) -> Compiled | None:
    size = len(block.core)
    if block.rows != size or block.free or size > LARGEST_UNROLLED or len(track.tau) < 2:
        return None
    chosen = distinct(np.linspace(0, len(track.tau) - 1, 9).astype(np.int64))
    instants = path.instants(track.tau[chosen])
    scale = track_scale(path.plan, block)
    problem = BlockProblem.of(block, path.before(block.number, instants), instants.clocks, scale)
    with np.errstate(all="ignore"):
        samples = problem.jacobian(track.values[chosen])
    samples = samples[np.isfinite(samples).all(axis=(1, 2))]
    if len(samples) == 0:
        return None
    order = pivot_order(samples * scale, block.entries)
    if len(order) < size:
        return None
    starts = path.plan.clocks

    def made() -> Compiled:
        entries = dict(zip(block.entries, block.slopes, strict=True))
        return compiled(newton_steps(size, entries, block.residuals, order), Clocks(starts))

    return memoized(lambda: ("step", block.identity, tuple(order), starts) if block.identity else None, made)


def probe_of(path: Path, block: Newton) -> Probe:
    """The problem of ``block`` along the path."""
    scale = track_scale(path.plan, block)

    def probe(tau: FloatArray) -> BlockProblem:
        instants = path.instants(tau)
        return BlockProblem.of(block, path.before(block.number, instants), instants.clocks, scale)

    return probe


def places_of(plan: Plan, block: Newton) -> tuple[OutlinePlace, ...]:
    """The places of contact in the core of ``block``."""
    found: list[OutlinePlace] = []
    for j, n in enumerate(block.core):
        payload = plan.system.unknowns[n].payload
        if not isinstance(payload, ContactPlace):
            continue
        outline = payload.touch.outline
        if payload.along:
            breaks = tuple(sorted({outline.length_at(each) for each in outline.breaks}))
            found.append(OutlinePlace(j, breaks, outline.length if outline.closed else 0.0, held=True))
        else:
            found.append(OutlinePlace(j, outline.breaks, outline.period if outline.closed else 0.0))
    return tuple(found)


class NewtonKernel(Kernel[Newton]):
    """See `Kernel`."""

    def begin(self, start: StartContext, block: Newton) -> BlockSolutions:
        """The solutions of a block without freedom; of a free one, the pose nearest to the one carried over."""
        scale = track_scale(start.plan, block)
        if isinstance(block, Free):
            return block_solutions(start, block, start.free_start(block, scale))
        return block_solutions(start, block, starts_near_carried(start, block, block, scale))

    def begun(self, start: StartContext, block: Newton) -> BlockSolutions | None:
        """Of a block without freedom: others are not looked for."""
        if isinstance(block, Free):
            return None
        problem = BlockProblem.of(block, start.state, start.instants.clocks, track_scale(start.plan, block))
        starts = carried_start(start.plan, problem, start.carry)
        if starts is None:
            return BlockSolutions([])
        choices = [choice_from(start, block, x) for x in starts.solutions]
        return BlockSolutions(choices, [] if choices else [-np.inf])

    def set_choice(self, start: StartContext, block: Newton, choice: Choice) -> None:
        """Set the core, at both instants."""
        core = choice.values if block.moving else [choice.values[block.unknowns.index(n)] for n in block.core]
        set_at_both_instants(start, block, np.repeat(np.array(core)[None], 2, axis=0))

    def first_track(self, path: Path, block: Newton, choice: Choice) -> NodeTrack:
        """The track where a path is one instant long."""
        return single_node(path, np.array(choice.values))

    def follow(self, path: Path, grid: Grid, block: Newton, choice: Choice, gaps: list[Gap]) -> NodeTrack:
        """The track of a block; where it has no solution is added to ``gaps``."""
        plan = path.plan
        scale = track_scale(plan, block)
        x = np.array(choice.values)
        probe = probe_of(path, block)
        until = end_of_upstream(path, block, gaps)
        sizes = scale_of(plan, block.unknowns)

        def followed() -> NodeTrack:
            if isinstance(block, Free) and freedom_of(probe(np.array([path.begin])), x) > 0:
                moving = FreeVelocity(block, plan, probe, grid.tau)
                tolerance = FREE_MOTION_STEP if block.sparse is None else LARGE_FREE_MOTION_STEP
                found = integrate_free_motion(moving, x, scale, grid.tau, until, tolerance, roughly=not path.resolved)
            else:
                rates = None if choice.rates is None else np.array(choice.rates)
                found = trace_path(block, probe, x, scale, grid.tau, until, rates, sizes, places_of(plan, block))
            return replace(found, identity=next(_identities))

        with np.errstate(all="ignore"):
            track = memoized(lambda: _path_key(path, block, choice, grid.tau, until, sizes), followed)
        if track.until < path.end and track.until < until:
            gap = pole_ahead(path, block, track, scale) or Gap(track.until, path.end, block.number)
            gaps.append(gap)
            track = replace(track, until=gap.begin)
        return track

    def loop(self, block: Newton) -> LoopRows | None:
        """The residuals of a block without freedom."""
        if not block.is_square:
            return None
        slopes = tuple(tuple(with_respect_to(root, n) for n in block.core) for root in block.residuals)
        return LoopRows(block.residuals, slopes)

    def compared(self, run: VariantRun, block: Newton, choice: Any) -> list[Any]:
        """The residuals and their slopes."""
        assert block.residual is not None
        assert block.jacobian is not None
        clocks = run.instants.clocks
        return [*block.residual(run.state, clocks), *block.jacobian(run.state, clocks)]

    def rates(self, block: Newton, moment: SeriesMoment, depth: int) -> FloatArray | None:
        """The derivatives of the equations; of a free block, those of the law that moves it."""
        if not isinstance(block, Free):
            return super().rates(block, moment, depth)
        from movimentum.solver.free.rates import FreeBlock

        free = FreeBlock(block, moment)
        free.first()
        if depth > 1:
            free.second()
        return None

    def lifted(self, block: Newton, lift: VariantLift) -> dict[str, Any]:
        """The equations and their slopes; of a free block, its wishes and its anchors' places too."""
        more: dict[str, Any] = {}
        if isinstance(block, Free):
            more = lifted_free(block, lift)
        elif not block.is_square:
            raise NotImplementedError("blocks with redundant equations")
        residuals, slopes = tuple(map(lift.formula, block.residuals)), tuple(map(lift.formula, block.slopes))
        return {
            "residuals": residuals,
            "slopes": slopes,
            "residual": lift.code(residuals),
            "jacobian": lift.code(slopes),
            **more,
        }

    def solve_variants(self, run: VariantRun, block: Newton, choice: Any) -> None:
        """Follow the loop or the free motion from the core ``choice`` (V, n), or along its track."""
        if isinstance(block, Free):
            solve_free_variants(run, block, choice)
        else:
            run.ends[block.number] = follow_loop(run, block, choice)

    def resume(self, on: ResumeContext, block: Newton, track: Track, state: State, instants: Instants) -> Choice | None:
        """Set the core, by Newton's method from the branch's own poses."""
        if not isinstance(track, NodeTrack):
            return super().resume(on, block, track, state, instants)
        problem = BlockProblem.of(block, state, instants.clocks, track_scale(on.piece.plan, block))
        for start in on.starts(block, track, float(instants.tau[0])):
            outcome = newton(problem, start[None], iterations=30, limit=0.1)
            if outcome.error[0] <= FOLD_CLOSED and on.regular(problem, outcome.x):
                for j, n in enumerate(block.core):
                    state[n] = outcome.x[:, j]
                return Choice(values=tuple(map(float, outcome.x[0])))
        return None

    def evaluate(self, path: Path, block: Newton, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the core; returns where there is no solution."""
        assert isinstance(track, NodeTrack)
        if len(instants) < FEW_INSTANTS:
            return solve_from(path, block, track, state, instants, None)

        def key() -> Hashable:
            if not track.identity or len(instants) * len(block.core) > MOST_MEMOIZED:
                return None
            return "at", track.identity, instants.tau.tobytes(), *(clock.tobytes() for clock in instants.clocks)

        def solved() -> tuple[tuple[FloatArray, ...], BoolArray]:
            failed = solve_from(path, block, track, state, instants, stepper(path, block, track))
            core = tuple(state[n] for n in block.core)
            for values in (*core, failed):
                values.flags.writeable = False
            return core, failed

        core, failed = memoized(key, solved)
        for n, values in zip(block.core, core, strict=True):
            state[n] = values
        return failed
