"""Integrating a block with states (integrals that drive themselves, a differential equation) by collocation.

Over each step the states are polynomials whose slopes are right at the points of Radau (IIA; Hairer & Wanner, *Solving
Ordinary Differential Equations II*, IV.5 and IV.8). So all points of a step are evaluated by one call, steps are long,
stiff equations need no other method, and the polynomial itself is what frames are taken from.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.records import dataclass, replace
from movimentum.solver.basis.effort import charge_effort, step_tightening
from movimentum.solver.continuation.tracks import OdeFailure, OdeTrack, PolynomialTrack, legendre
from movimentum.tolerances import (
    COLLOCATION_LAST_CHANGE,
    COLLOCATION_MET,
    COLLOCATION_NEARLY_MET,
    COLLOCATION_SETTLED,
    CORE_BEND,
    LEAST_DIVISOR,
    LEAST_STATE_ERROR,
    QUADRATIC_CONVERGENCE,
    ROUNDING_OF_RATES,
    RUNAWAY_TIME,
    SHORTEST_STATE_STEP,
    SMALL_STATE,
    SMALL_STATE_ERROR,
    STATE_STEP,
    STATES_AT_END,
    SWITCHES_AT_ONCE,
)

STAGES = 16
"""Points in a step. The states are polynomials of this degree, and their order at a step's end is twice that."""
LEAST_TIGHTENING = 0.1
"""Of `STATE_STEP`: what that is tightened to, at most."""
SHORT_STEPS_OF_SWITCHING = 12
"""So many of the shortest steps within `SWITCHES_AT_ONCE`: something switches to and fro."""
MOST_STEPS, MANY_STATES = 20_000, 32
"""Steps that are tried, and from how many states on they are fewer (by the square)."""
FIRST, LONGEST, LONGEST_NODES = 0.01, 0.125, 32
"""Of the interval: the first step, and the longest; and how many of the path's nodes it may pass."""
NEWTON_STEPS, SIMPLIFIED_STEPS, PLAIN_STEPS = 12, 50, 30
LARGEST_DENSE_STEP = 64
"""Unknowns of a step up to which all are solved for at once, with a Jacobian of each point. Larger systems are solved
with one Jacobian a step."""
RUNAWAY_GROWTH = 100.0
"""Times what it was before: a state that grows so much within `RUNAWAY_TIME` runs away."""
AT_INFINITY = 1e100
"""What is larger is as good as at infinity."""
ERROR_STEP_RATIO = 0.7
"""Steps of the second solution, which estimates the error, for each of the first."""


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """Of a step [0, 1], s points ``at``, the last of which is 1, and s + 1 points ``between``: ``slopes`` makes
    Legendre coefficients of values at the points, ``integrals`` integrates those up to the points, ``values`` and
    ``totals`` evaluate and integrate them between the points. ``core`` makes coefficients of values at 0 and at the
    points.
    """

    at: FloatArray
    between: FloatArray
    slopes: FloatArray
    matrix: FloatArray
    values: FloatArray
    totals: FloatArray
    core: FloatArray
    core_values: FloatArray
    eigenvalues: NDArray[np.complex128]
    modes: NDArray[np.complex128]
    amplitudes: NDArray[np.complex128]


@cache
def radau_points() -> _Points:
    """The points of Radau, as eigenvalues (Golub 1973, *Some modified matrix eigenvalue problems*)."""
    s = STAGES
    k = np.arange(1.0, s)
    off = k / np.sqrt(4.0 * k * k - 1.0)
    jacobi = np.diag(off, 1) + np.diag(off, -1)
    last = np.zeros(s - 1)
    last[-1] = off[-1] ** 2
    jacobi[-1, -1] = 1.0 + np.linalg.solve(jacobi[:-1, :-1] - np.eye(s - 1), last)[-1]
    u = np.asarray(np.linalg.eigvalsh(jacobi), dtype=np.float64)
    u[-1] = 1.0
    edges = np.concatenate([[-1.0], u])
    test = 0.5 * (edges[:-1] + edges[1:])
    slopes = np.asarray(np.linalg.inv(legendre(u, s)), dtype=np.float64)
    core = np.asarray(np.linalg.inv(legendre(edges, s + 1)), dtype=np.float64)
    matrix = 0.5 * _integrals(u) @ slopes
    found, modes = np.linalg.eig(matrix.astype(np.complex128))
    eigenvalues = np.asarray(found, dtype=np.complex128)
    pairs = eigenvalues.imag > 0.0
    inverse = np.asarray(np.linalg.inv(modes), dtype=np.complex128)
    return _Points(
        0.5 * (u + 1.0), 0.5 * (test + 1.0), slopes, matrix, legendre(test, s), 0.5 * _integrals(test), core,
        legendre(test, s + 1), eigenvalues[pairs], np.asarray(modes, dtype=np.complex128)[:, pairs], inverse[pairs],
    )  # fmt: skip


def _integrals(u: FloatArray) -> FloatArray:
    """(F, s) integrals of the Legendre polynomials from -1 to ``u``."""
    p = legendre(u, STAGES + 1)
    k = np.arange(1, STAGES)
    return np.column_stack([u + 1.0, (p[:, 2:] - p[:, :-2]) / (2.0 * k + 1.0)])


@dataclass(frozen=True, slots=True, eq=False)
class RateFunctions:
    """The equation at F instants: ``rates`` gives, from states (F, p) and core values near by (F, n), the core (F, n)
    and the states' rates (F, p), nan where there is no solution. ``slopes`` gives the derivatives (F, p, p) of the
    rates by the states; of V systems side by side in p, which have nothing to do with each other, (F, V, p/V, p/V).
    ``noise`` gives what rounding makes of the rates (F, p).
    """

    rates: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
    slopes: Callable[[FloatArray, FloatArray], FloatArray]
    noise: Callable[[FloatArray, FloatArray], FloatArray]


Equation = Callable[[FloatArray], RateFunctions]
"""The equation at the given times (F,)."""


@dataclass(slots=True, eq=False)
class _Step:
    """A step that was solved: the states' and the core's coefficients, and both at its end with the rates there.
    ``error``: in units of what is allowed.
    """

    states: FloatArray
    core: FloatArray
    z: FloatArray
    x: FloatArray
    rate: FloatArray
    error: float


class Collocation:
    """The solution of an equation from ``low`` to ``high``, step by step. ``nodes`` are the path's, ``scale`` (n,) the
    core's natural sizes.
    """

    def __init__(
        self, equation: Equation, nodes: FloatArray, scale: FloatArray, factor: float = 1.0, systems: int = 1
    ) -> None:
        self._equation = equation
        self._nodes = nodes
        self._scale = scale
        self._factor, self._systems = factor, systems
        self._low, self._high = float(nodes[0]), float(nodes[-1])
        self._total = self._high - self._low
        self._points = radau_points()
        self._stiff = np.inf  # from such steps on, large systems need a Jacobian; shorter ones are solved by iteration

    def track(self, x: FloatArray, z: FloatArray, until: float) -> OdeTrack:
        """From core values ``x`` (n,) and states ``z`` (p,) at the first node to ``until``, the last node, or where
        there is no solution any more.
        """
        total, tau = self._total, self._low
        times = [tau]
        found: list[_Step] = []
        switches = [-np.inf] * SHORT_STEPS_OF_SWITCHING
        failure = OdeFailure.NONE
        x, rate = self._at(tau, x, z)
        z0, largest = z, np.abs(z)
        length = FIRST * total
        left = MOST_STEPS / (1.0 + (len(z) / self._systems / MANY_STATES) ** 2)
        noise: FloatArray | None = None  # is asked where a step fails: rates of a system in balance are nothing else
        while tau < self._high and tau < until and np.isfinite(rate).all():
            charge_effort()
            left -= 1
            if left < 0:
                failure = OdeFailure.WORK
                break
            place = min(int(np.searchsorted(self._nodes, tau, side="right")) + LONGEST_NODES, len(self._nodes) - 1)
            longest = min(LONGEST * total, float(self._nodes[place]) - tau, self._high - tau)
            step = min(self._factor * length, longest)
            one = self._step(tau, step, x, z, rate, largest if noise is None else np.maximum(largest, step * noise))
            if one is None or one.error > 1.0:
                if noise is None:
                    noise = self._noise(tau, x, z)
                    if np.any(step * noise > np.maximum(largest, step * np.abs(rate))):
                        continue
                if step > SHORTEST_STATE_STEP * total:
                    far = 1.0 if one is None else one.error ** (-1.0 / STAGES)
                    length = max(min(0.9 * far, 0.5) if far < 1.0 else 0.25, 0.1) * step / self._factor
                    continue
                switches = [*switches[1:], tau]
                fast = np.any(np.abs(rate) * SWITCHES_AT_ONCE * total > largest)
                if tau - switches[0] < SWITCHES_AT_ONCE * total and not fast:
                    failure = OdeFailure.SWITCHES
                    break
                one = self._straight(tau, step, x, z, rate)
            if not np.isfinite(one.states).all():  # it leads nowhere
                break
            tau = self._high if self._high - tau - step < STATES_AT_END * total else tau + step
            x, z, rate, noise = one.x, one.z, one.rate, None
            times.append(tau)
            found.append(one)
            largest = np.maximum(largest, np.abs(z))
            length = step / self._factor * min(4.0, 0.9 * max(one.error, LEAST_STATE_ERROR) ** (-1.0 / STAGES))
        early = tau < self._high and tau < until and failure is not OdeFailure.WORK
        if early and found and _runs_away(np.array(times), np.array([z0, *(one.z for one in found)]), total):
            failure = OdeFailure.AWAY
        if not found:
            return OdeTrack(PolynomialTrack.still(tau, x), PolynomialTrack.still(tau, z), failure=failure)
        nodes, end = np.array(times), tau if tau < self._high and tau < until else max(until, self._high)
        cores, states = np.array([one.core for one in found]), np.array([one.states for one in found])
        return OdeTrack(PolynomialTrack(nodes, cores, end), PolynomialTrack(nodes, states, end), failure=failure)

    def _at(self, tau: float, x: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The core (n,) and the states' rates (p,) at one instant."""
        core, rates = self._equation(np.array([tau])).rates(z[None], x[None])
        return core[0], rates[0]

    def _noise(self, tau: float, x: FloatArray, z: FloatArray) -> FloatArray:
        """(p,) how large a state must become in one time unit, for its rate to be known as exactly as is asked."""
        noise = self._equation(np.array([tau])).noise(z[None], x[None])[0]
        return np.nan_to_num(noise, posinf=0.0) * (ROUNDING_OF_RATES / STATE_STEP)

    def _straight(self, tau: float, step: float, x: FloatArray, z: FloatArray, rate: FloatArray) -> _Step:
        """A step along the slope at its beginning."""
        later = z + step * rate
        core, slope = self._at(tau + step, x, later)
        states, cores = np.zeros((STAGES + 1, len(z))), np.zeros((STAGES + 1, len(x)))
        states[:2] = 0.5 * (z + later), 0.5 * (later - z)
        cores[:2] = 0.5 * (x + core), 0.5 * (core - x)
        return _Step(states, cores, later, core, slope, 0.0)

    def _step(
        self, tau: float, step: float, x: FloatArray, z: FloatArray, rate: FloatArray, largest: FloatArray
    ) -> _Step | None:
        """A step from core values ``x`` and states ``z`` with their ``rate``; None where it was not solved."""
        p = self._points
        equation = self._equation(tau + step * p.at)
        guess = z + step * p.at[:, None] * rate
        size = np.maximum(np.maximum(largest, step * np.abs(rate)), LEAST_DIVISOR)
        size = np.maximum(size, SMALL_STATE * np.max(size))
        solved = self._collocated(equation, step, np.repeat(x[None], STAGES, axis=0), guess, z, size)
        if solved is None:
            return None
        core, rates, states = solved
        slopes = p.slopes @ rates
        size = np.maximum(size, np.max(np.abs(states), axis=0))
        cores = p.core @ np.concatenate([x[None], core])
        expected = p.core_values @ cores
        test, slope = self._equation(tau + step * p.between).rates(z + step * (p.totals @ slopes), expected)
        tolerance = STATE_STEP * max(step_tightening(), LEAST_TIGHTENING)
        off = float(np.max(np.abs(slope - p.values @ slopes) * step / (tolerance * size)))
        early = (
            rate - legendre(-np.ones(1), STAGES)[0] @ slopes
        )  # a switch just after the beginning is nowhere else seen
        off = max(off, float(np.max(np.abs(early) * step / (tolerance * size))))
        bend = float(np.max(np.abs(test - expected) / self._scale, initial=0.0)) / CORE_BEND
        error = max(off, bend)
        if not np.isfinite(error):
            return None
        coefficients = np.zeros((STAGES + 1, len(z)))
        coefficients[0] = z + 0.5 * step * (slopes[0] - slopes[1] / 3.0)
        k = np.arange(1, STAGES + 1)[:, None]
        after = np.concatenate([slopes[2:], np.zeros((2, len(z)))])
        coefficients[1:] = 0.5 * step * (slopes / (2.0 * k - 1.0) - after / (2.0 * k + 3.0))
        return _Step(coefficients, cores, states[-1], core[-1], rates[-1], error)

    def _collocated(
        self, equation: RateFunctions, step: float, x: FloatArray, states: FloatArray, z: FloatArray, size: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """The core (s, n), the states' rates (s, p) and the states at the points; None where they are not found."""
        matrix = step * self._points.matrix
        dense, far = self._systems == 1 and STAGES * len(z) <= LARGEST_DENSE_STEP, np.inf
        if not dense and step < self._stiff:
            if (found := self._iterated(equation, matrix, x, states, z, size)) is not None:
                return found
            self._stiff = step
        inverses = None
        for sweep in range(NEWTON_STEPS if dense else SIMPLIFIED_STEPS):
            x, rates = equation.rates(states, x)
            change = z + matrix @ rates - states
            if not np.isfinite(change).all():
                break
            if dense:
                change = self._newton(matrix, equation.slopes(states, x), change)
            else:
                if inverses is None:
                    inverses = self._inverses(step, equation.slopes(states, x))
                change = self._simplified(inverses, change)
            states = states + change
            far, before = float(np.max(np.abs(change) / size)), far
            # whether the next change would be its square
            squared = dense and far < COLLOCATION_LAST_CHANGE and far < QUADRATIC_CONVERGENCE * before
            if far <= COLLOCATION_MET or squared or before < COLLOCATION_NEARLY_MET:
                return *equation.rates(states, x), states
            if not far < 1e6 or (sweep > 8 and far > 0.5 * before):
                break
        return None

    def _iterated(
        self,
        equation: RateFunctions,
        matrix: FloatArray,
        x: FloatArray,
        states: FloatArray,
        z: FloatArray,
        size: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """The same without a Jacobian: for short steps the changes fall as those of a power series do."""
        changes: list[float] = []
        for sweep in range(PLAIN_STEPS):
            x, rates = equation.rates(states, x)
            change = z + matrix @ rates - states
            states = states + change
            changes.append(float(np.max(np.abs(change) / size)))
            if changes[-1] <= COLLOCATION_SETTLED:
                return *equation.rates(states, x), states
            if not changes[-1] < 1e6 or (sweep > 9 and changes[-1] > 0.1 * changes[-4]):
                return None
        return None

    def _inverses(self, step: float, slopes: FloatArray) -> NDArray[np.complex128]:
        """(s/2, …, p, p) inverses, one for each system into which a step with the mean Jacobian falls apart."""
        mean = np.mean(slopes, axis=0)
        scaled = step * self._points.eigenvalues.reshape(-1, *[1] * mean.ndim) * mean
        try:
            return np.asarray(np.linalg.inv(np.eye(slopes.shape[-1]) - scaled), dtype=np.complex128)
        except np.linalg.LinAlgError:
            return np.full_like(scaled, np.nan)

    def _simplified(self, inverses: NDArray[np.complex128], change: FloatArray) -> FloatArray:
        """The Newton step (s, p) with one Jacobian."""
        p = self._points
        found = inverses @ (p.amplitudes @ change).reshape(*inverses.shape[:-1], 1)
        return 2.0 * (p.modes @ found.reshape(len(found), -1)).real

    @staticmethod
    def _newton(matrix: FloatArray, slopes: FloatArray, change: FloatArray) -> FloatArray:
        """The Newton step (s, p) for what the states are off by."""
        stages, count = change.shape
        whole = np.eye(stages * count) - np.einsum("ij,jab->iajb", matrix, slopes).reshape(stages * count, -1)
        try:
            return np.asarray(np.linalg.solve(whole, change.reshape(-1)), dtype=np.float64).reshape(stages, count)
        except np.linalg.LinAlgError:
            return np.full_like(change, np.nan)


def _runs_away(times: FloatArray, states: FloatArray, total: float) -> bool:
    """Whether a state (K, p) grows without end before the last of ``times`` (K,)."""
    largest = np.max(np.abs(states), axis=1)
    long_before = largest[times <= times[-1] - RUNAWAY_TIME * total]
    return bool(len(long_before) and largest[-1] > min(RUNAWAY_GROWTH * np.max(long_before), AT_INFINITY))


def integrate_equation(
    equation: Equation, nodes: FloatArray, scale: FloatArray, x: FloatArray, z: FloatArray, until: float
) -> OdeTrack:
    """Integrate ``equation`` from core values ``x`` (n,) and states ``z`` (p,) at ``nodes[0]``.

    It is solved a second time with other steps: by what the two differ the error is told.
    """
    track = Collocation(equation, nodes, scale).track(x, z, until)
    if track.failure is OdeFailure.WORK:
        return track
    times = track.states.tau
    twin = Collocation(equation, nodes, scale, ERROR_STEP_RATIO).track(x, z, min(until, track.states.until))
    one, other = track.states.guess(times), twin.states.guess(times)
    sizes = np.maximum(np.max(np.abs(one), axis=1, keepdims=True), LEAST_DIVISOR)
    sizes = np.maximum(sizes, SMALL_STATE_ERROR * np.max(sizes))
    errors = np.max(np.abs(one - other) / sizes, axis=0)
    if track.failure is OdeFailure.AWAY:  # beside a pole, any difference of its time is as large as all
        errors[times > times[-1] - RUNAWAY_TIME * (nodes[-1] - nodes[0])] = 0.0
    return replace(track, times=times, errors=errors)
