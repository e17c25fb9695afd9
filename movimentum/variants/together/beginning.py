"""Where many variants begin: the state at two instants, each block's solutions there, and what is known before.

All solutions of a Newton block come from coefficient-parameter homotopy, all paths of all variants at once. The
solutions for random complex coefficients are found once, by the homotopy of total degree. They lead to those for any
variant's coefficients (Sommese & Wampler, *The Numerical Solution of Systems of Polynomials Arising in Engineering and
Science*, ch. 7). `solver.solutions.homotopy` does the same for one variant at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum import tolerances
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.planning.blocks.kinds import Free, Newton
from movimentum.planning.lowering.unknowns import PoseCos, PosePart, PoseSin, symbol_numbers
from movimentum.records import dataclass
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import ThingAngle
from movimentum.solver.basis.body_pose import AS_DRAWN, BodyPose, pose_part
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.newton import newton, newton_of_variants
from movimentum.solver.kinds.kernels import solve_variants
from movimentum.solver.kinds.variant_free_paths import workspace_and_metric
from movimentum.solver.kinds.variant_free_start import VariantFreeStart, VariantTurn
from movimentum.solver.kinds.variants import column, problem_at
from movimentum.solver.solutions.homotopy import ComplexArray, TotalDegree, follow_paths
from movimentum.solver.solutions.newton_starts import immediate_wishes, random_starts, seed_count
from movimentum.solver.start.early_checks import EarlyChecks, satisfied
from movimentum.tolerances import LEAST_DIVISOR, NEARLY_REAL, REAL_ROOT
from movimentum.variants.together.pattern import (
    BlockFormulas,
    NotBatchable,
    PolynomialRows,
    SegmentPattern,
    filled,
    instants_of,
)
from movimentum.variants.together.poses import Places


class VariantPolynomials:
    """Polynomials in unknowns of size one: ``coefficients`` (paths or 1, terms)."""

    def __init__(self, rows: PolynomialRows, count: int) -> None:
        self.terms = rows.terms
        self.count = count

    def evaluated(self, x: ComplexArray, coefficients: Any) -> tuple[ComplexArray, ComplexArray]:
        """(paths, n) values and (paths, n, n) Jacobians."""
        paths = len(x)
        values = np.zeros((paths, self.count), dtype=np.complex128)
        jacobian = np.zeros((paths, self.count, self.count), dtype=np.complex128)
        for t, (row, factors) in enumerate(self.terms):
            c = coefficients[:, t]
            if not factors:
                values[:, row] += c
            elif len(factors) == 1:
                values[:, row] += c * x[:, factors[0]]
                jacobian[:, row, factors[0]] += c
            else:
                for k, j in enumerate(factors):
                    slope = c
                    for other, i in enumerate(factors):
                        if other != k:
                            slope = slope * x[:, i]
                    jacobian[:, row, j] += slope
                    if k == 0:
                        values[:, row] += slope * x[:, j]
        return values, jacobian


class _ToVariants:
    """From generic coefficients to those of each variant; V times as many paths as there are ``roots``."""

    def __init__(
        self, rows: VariantPolynomials, generic: ComplexArray, roots: ComplexArray, targets: FloatArray
    ) -> None:
        self.rows, self.roots = rows, roots
        self.generic = generic
        self.targets = targets
        self.way = targets - generic[None]

    def starts(self) -> ComplexArray:
        """The roots, for each variant."""
        return np.tile(self.roots, (len(self.targets), 1))

    def at(
        self, x: ComplexArray, t: FloatArray, paths: NDArray[np.intp]
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """See `PathProblem`."""
        way = self.way[paths // len(self.roots)]
        values, jacobian = self.rows.evaluated(x, self.generic[None] + t[:, None] * way)
        by_t, _ = self.rows.evaluated(x, way)
        return values, jacobian, by_t


@dataclass(frozen=True, slots=True, eq=False)
class VariantRoots:
    """``x`` (V, R, n): R core vectors at most, those that ``exist`` (V, R) first; ``unsure`` (V,)."""

    x: FloatArray
    exist: BoolArray
    unsure: BoolArray


def all_roots(item: BlockFormulas, state: State, clocks: Sequence[FloatArray], scale: FloatArray) -> VariantRoots:
    """All real solutions of a block at the first instant, for ``scale`` (V, n) of its core."""
    assert item.rows is not None
    count, size = scale.shape
    values = item.rows.coefficients([column(each, 0) for each in state], [column(clock, 0) for clock in clocks])
    table = np.stack([np.broadcast_to(value, (count, 1))[:, 0] for value in values], axis=1)
    unit = np.median(scale, axis=0)
    for t, (_, factors) in enumerate(item.rows.terms):
        table[:, t] *= np.prod(unit[list(factors)])
    typical = np.nanmedian(table, axis=0)
    for row in range(size):  # rows of size one, the same for all variants: numbers stay numbers
        mine = [t for t, (r, _) in enumerate(item.rows.terms) if r == row]
        weight = max(float(np.max(np.abs(typical[mine]))), LEAST_DIVISOR)
        table[:, mine] /= weight
        typical[mine] /= weight
    rows = VariantPolynomials(item.rows, size)
    generic, roots = _generic_roots(item.rows, rows, typical)
    bad = ~np.isfinite(table).all(axis=1)
    targets = np.where(np.asarray(bad)[:, None], typical[None], table)
    ends, finite, lost = follow_paths(_ToVariants(rows, generic, roots, targets), 0.1)
    many = len(roots)
    ends, finite, lost = ends.reshape(count, many, size), finite.reshape(count, many), lost.reshape(count, many)
    imaginary = np.max(np.abs(ends.imag), axis=2) / (1.0 + np.max(np.abs(ends.real), axis=2))
    real = finite & (imaginary <= REAL_ROOT)
    unsure = bad | lost.any(axis=1) | (finite & (imaginary > REAL_ROOT) & (imaginary < NEARLY_REAL)).any(axis=1)
    order = np.argsort(~real, axis=1, kind="stable")
    x = np.take_along_axis(ends.real, order[..., None], axis=1) * unit
    exist = np.take_along_axis(real, order, axis=1)
    most = max(1, int(exist.sum(axis=1).max(initial=0)))
    return VariantRoots(x[:, :most], exist[:, :most], unsure)


def _generic_roots(
    polynomials: PolynomialRows, rows: VariantPolynomials, typical: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Random complex coefficients near ``typical`` ones (numbers stay, what is equal stays equal), and all finite
    solutions for them.
    """
    generator = np.random.default_rng(77)
    turns = generator.normal(size=(2, max(polynomials.groups) + 2))
    factors = np.exp(0.7j * turns[0]) * (1.0 + 0.2 * turns[1])
    factors[-1] = 1.0
    generic = typical * factors[list(polynomials.groups)]
    system = TotalDegree(lambda x: rows.evaluated(x, generic[None]), polynomials.degrees, np.random.default_rng(2024))
    ends, finite, lost = follow_paths(system)
    if lost.any() or not finite.any():
        raise NotBatchable("a homotopy that does not finish")
    roots = ends[finite]
    return generic, roots


FAR_AHEAD = 0.05


@dataclass(slots=True, eq=False)
class Carried:
    """What V variants bring from the segment before: poses by thing, other unknowns by payload, all (V, 1)."""

    poses: dict[int, BodyPose]
    others: dict[Any, Any]


class VariantBeginning:
    """Chooses for V variants of one segment, at its beginning or at offsets ``tau`` (V,)."""

    def __init__(
        self,
        places: Places,
        pattern: SegmentPattern,
        carried: Carried | None,
        size: FloatArray,
        tau: FloatArray | None = None,
    ) -> None:
        self.places, self.pattern, self.carried, self.size = places, pattern, carried, size
        self.count = places.count
        two = np.array([0.0, pattern.ahead])
        self.instants = instants_of(pattern, two if tau is None else tau[:, None] + two)
        self.run = pattern.run(places.varied, self.instants, size, self.angles_before())
        self.state = self.run.state
        plan = pattern.plan
        self.owner = {n: block.number for block in plan.blocks for n in block.unknowns}
        self.judgements = EarlyChecks(plan, [None] * pattern.unknowns, (), self.owner)
        self.unsure = np.zeros(self.count, dtype=np.bool_)
        self.poses: dict[int, BodyPose] = {}

    def solve(self, number: int, choice: FloatArray | None) -> Any:
        """Set the state, at both instants; the margin of a quadratic block."""
        item = self.pattern.blocks[number]
        if item.iterated is not None:
            assert choice is not None
            self._ahead(item.iterated, choice)
            return None
        solve_variants(self.run, item.block, 1.0 if choice is None else choice)
        return self.run.margins.get(number)

    def _ahead(self, block: Newton, core: FloatArray) -> None:
        """The core (V, n), solved for again at the second instant."""
        scale = self.run.scale(block)
        found = newton(problem_at(self.run, block, 1, scale), core, limit=FAR_AHEAD)
        near = found.converged & (np.max(np.abs(found.x - core) / scale, axis=1) < FAR_AHEAD)
        x = np.where(near[:, None], found.x, core)
        for j, n in enumerate(block.core):
            self.state[n] = np.stack([core[:, j], x[:, j]], axis=1)
        fill_explicit(block, self.state, self.instants.clocks)

    def options(self, number: int) -> list[tuple[FloatArray, BoolArray]]:
        """The choices of a block, each with the variants (V,) that have it."""
        item = self.pattern.blocks[number]
        every = np.ones(self.count, dtype=np.bool_)
        block = item.iterated
        if block is None:
            signs = (1.0, -1.0) if item.block.two_valued else (1.0,)
            return [(np.full((self.count, 1), sign), every) for sign in signs]
        scale, system = self.run.scale(block), self.pattern.plan.system
        if block.free_rows is not None:
            return [self._free(block.free_rows, scale)]
        if self.carried is not None and any(system.unknowns[n].thing in self.carried.poses for n in block.core):
            before = [self.before(n) for n in block.core]
            core = np.concatenate([np.broadcast_to(0.0 if v is None else v, (self.count, 1)) for v in before], axis=1)
            x, converged, determinant = newton_of_variants(problem_at(self.run, block, 0, scale), core)
            stays = converged & (np.max(np.abs(x - core) / scale, axis=1) < tolerances.SAME_ROOT)
            self.unsure |= ~stays | (np.abs(determinant) < tolerances.SINGULAR_AT_FIRST)
            return [(x, every)]
        found = all_roots(item, self.state, self.instants.clocks, scale)
        self.unsure |= found.unsure
        problem = problem_at(self.run, block, 0, scale)
        result: list[tuple[FloatArray, BoolArray]] = []
        for k in range(found.exist.shape[1]):
            start = np.where(found.exist[:, k : k + 1], found.x[:, k], found.x[:, 0])
            x, converged, determinant = newton_of_variants(problem, start)
            exist = found.exist[:, k]
            self.unsure |= exist & (~converged | (np.abs(determinant) < tolerances.SINGULAR_AT_FIRST))
            result.append((x, exist))
        return result

    def _free(self, block: Free, scale: FloatArray) -> tuple[FloatArray, BoolArray]:
        """The pose that a free block begins with, see `solver.solutions.newton_starts.free_start`."""
        system, problem = self.pattern.plan.system, problem_at(self.run, block, 0, scale)

        def column_of(n: int) -> FloatArray:
            value = self.before(n)
            return np.ravel(np.broadcast_to(0.0 if value is None else value, (self.count, 1)))

        known: set[int] = set() if self.carried is None else set(self.carried.poses)
        place = {n: j for j, n in enumerate(block.core)}
        turns: list[VariantTurn] = []
        for n in block.unknowns:
            payload = system.unknowns[n].payload
            other = system.number_of.get(PoseSin(payload.thing)) if isinstance(payload, PoseCos) else None
            if not isinstance(payload, PoseCos) or payload.thing in known or n not in place or other not in place:
                continue
            c, s = (
                np.ravel(np.broadcast_to(self._part(part), (self.count, 1)))
                for part in (payload, PoseSin(payload.thing))
            )
            turns.append(VariantTurn(place[n], place[other], c, s))
        wished = immediate_wishes(self.pattern.plan, block, known)
        metric = workspace_and_metric(self.run, block)[1]
        start = VariantFreeStart(
            problem, metric, self.size, turns, wished, np.stack([column_of(n) for n in block.core], axis=1)
        )
        speeds = np.zeros((self.count, len(metric.coupled)))
        if metric.coupled:
            there = problem.completed(start.origin)
            for k, n in enumerate(metric.coupled):
                speeds[:, k] = there[n] - column_of(n)
        fresh = any(system.unknowns[n].thing not in known for n in block.unknowns)
        carried = not fresh and all(self.before(n) is not None for n in block.core)

        def scattered(origin: FloatArray, own: FloatArray) -> FloatArray:
            return random_starts(self.pattern.plan, block, origin, own, seed_count(origin))

        x, exist, unsure = start.start_poses(speeds, self._sides(block), scattered, stays=carried)
        self.unsure |= unsure
        return x, exist

    def _sides(self, block: Free) -> Callable[[FloatArray, IntArray], BoolArray]:
        """Whether core values (N, n) of some variants (N,) satisfy the inequalities about what a block finds."""
        plan = self.pattern.plan
        known = {n for n, value in enumerate(self.state[: self.pattern.unknowns]) if value is not None}
        known |= set(block.unknowns)
        own = [
            i
            for i, selector in enumerate(plan.system.selectors)
            if symbol_numbers(selector.value) <= known and not symbol_numbers(selector.value).isdisjoint(block.unknowns)
        ]

        def satisfied(x: FloatArray, who: IntArray) -> BoolArray:
            def there(value: Any) -> Any:
                here = column(value, 0)
                return here[who] if np.ndim(here) and len(here) == self.count else here

            fits = np.ones(len(x), dtype=np.bool_)
            if own:
                state = [None if value is None else there(value) for value in self.state]
                for j, n in enumerate(block.core):
                    state[n] = x[:, j : j + 1]
                clocks = [there(clock) for clock in self.instants.clocks]
                fill_explicit(block, state, clocks)
                values = self.pattern.selectors(filled(state), clocks)
                for i in own:
                    here = np.broadcast_to(values[i], (len(x), 1))[:, 0]
                    fits &= here >= -tolerances.INEQUALITY_MET * self.size[who]
            return fits

        return satisfied

    def before(self, n: int) -> Any:
        """(V, 1) the value of an unknown before, or None where it has none."""
        system = self.pattern.plan.system
        payload = system.unknowns[n].payload
        if not isinstance(payload, PosePart):
            if isinstance(payload, ThingAngle) and self.carried is not None and payload.thing in self.carried.poses:
                return self.carried.poses[payload.thing].angle
            return self.carried.others.get(payload) if self.carried is not None else None
        return self._part(payload)

    def _part(self, part: PosePart) -> Any:
        """(V, 1) a part of a thing's pose before, in its frame's terms."""
        pose, frame = self.poses.get(part.thing, AS_DRAWN), self.places.frame(self.pattern, part.thing)
        return pose_part(part, frame, pose, self.pattern.plan.system.shift)

    def angles_before(self) -> dict[int, Any]:
        """What goes on (angles, integrals) before, by unknown: what is carried over; a direction as it is drawn."""
        found: dict[int, Any] = {}
        for payload, n in self.pattern.plan.system.number_of.items():
            value: Any = payload.drawn if isinstance(payload, Bearing) else None
            if self.carried is not None and isinstance(payload, ThingAngle) and payload.thing in self.carried.poses:
                value = self.carried.poses[payload.thing].angle
            elif self.carried is not None and payload in self.carried.others:
                value = self.carried.others[payload]
            if value is not None:
                found[n] = np.ravel(np.broadcast_to(value, (self.count, 1)))
        return found

    def wished(self, number: int) -> FloatArray:
        """(V,) see `EarlyChecks.wish_cost`."""
        if not self.judgements.has_wishes(number):
            return np.zeros(self.count)
        values = self.pattern.wishes(filled(self.state), self.instants.clocks)
        first = [np.broadcast_to(value, (self.count, 2))[:, 0] for value in values]
        return np.asarray(self.judgements.missed(number, first.__getitem__, self.size), dtype=np.float64)

    def allowed(self, number: int) -> BoolArray:
        """(V,) whether the inequalities hold that can be judged after a block; redundant equations that do not leave
        their variants to be solved by themselves.
        """
        allowed = np.ones(self.count, dtype=np.bool_)
        judgements, pattern = self.judgements, self.pattern
        clocks = self.instants.clocks
        if number in judgements.checks_after and pattern.checks.count:
            values = pattern.checks(filled(self.state), clocks)
            for i in judgements.checks_after[number]:
                off = np.abs(np.broadcast_to(values[i], (self.count, 2))[:, 0])
                bad = ~(off <= 0.01 * tolerances.REDUNDANT_AT_START * np.minimum(self.size, 1.0))
                self.unsure |= bad
        if number in judgements.selectors_after:
            values = pattern.selectors(filled(self.state), clocks)
            tolerance = tolerances.INEQUALITY_MET * self.size
            for i in judgements.selectors_after[number]:
                here, later = np.broadcast_to(values[i], (self.count, 2)).T
                allowed &= satisfied(here, later, tolerance, strict=pattern.plan.system.selectors[i].strict)
        return allowed
