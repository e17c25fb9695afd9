"""Checks claims in every frame, and on the solver's own grid between frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.expressions import walk
from movimentum.query import Reader, reader
from movimentum.records import dataclass
from movimentum.scene.model import Claim, Relation
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import UnsolvedInterval
from movimentum.source import SourceText
from movimentum.text import counted, number, time_text
from movimentum.timeline.model import TimedClaim
from movimentum.tolerances import CLAIM_MET, CLAIM_NEARLY_MET, NEXT_ROUND, NO_DIRECTION

CHUNK = 8192
HALVINGS = 60
INSTANTS_BETWEEN, MOST_PEAKS, ZOOMS = 4, 40, 16
"""Of claims about gaps: instants in each interval of the grid; narrow places that are looked at closely; how often."""
DIGITS = 60
"""Of claims of constants alone."""
MOST_INSTANTS = 50_000
"""Instants between the frames at which claims are looked at in one segment: each costs ten microseconds."""


@dataclass(frozen=True, slots=True)
class BrokenClaim:
    """A claim that does not hold: from ``time`` on its error is larger than ``tolerance``; it is worst at
    ``worst_time``.

    ``left`` and ``right`` are the two sides' components where it first fails (at the first checked instant that fails).
    ``amount`` and ``worst`` are the errors there and at the worst. ``failing``: the first and the last frame of each
    run of frames in which it fails.
    """

    claim: Claim
    time: float
    frame: int
    left: tuple[float, ...]
    right: tuple[float, ...]
    amount: float
    worst: float
    worst_time: float
    tolerance: float
    instants: int
    failing: tuple[tuple[int, int], ...] = ()


def broken_claims(motion: PathMotion, claims: Sequence[TimedClaim] | None = None) -> Iterator[BrokenClaim]:
    """The claims of the timeline (or these) that do not hold, in the order written. Times without a solution are not
    judged.
    """
    timeline = motion.timeline
    judges = [_ClaimCheck(motion, held) for held in (timeline.claims if claims is None else claims)]
    if not judges:
        return
    for first in range(0, timeline.frame_count, CHUNK):
        stop = min(first + CHUNK, timeline.frame_count)
        times = [timeline.frame_time(frame) for frame in range(first, stop)]
        poses = motion.poses(first, stop)
        for judge in judges:
            judge.check(poses, times, first)
    grid = _grid(motion)
    for first in range(0, len(grid), CHUNK):
        times = grid[first : first + CHUNK]
        poses = motion.poses_at(times)
        for judge in judges:
            judge.check(poses, times)
    for judge in judges:
        if judge.timed_claim.claim.of_gaps and judge.timed_claim.claim.relation is not Relation.EQUAL:
            judge.check_between(grid)
    yield from (found for judge in judges if (found := judge.verdict()) is not None)


def _grid(motion: PathMotion) -> list[Fraction]:
    """The instants at which the solver followed its paths, `MOST_INSTANTS` of each segment's."""
    times: set[Fraction] = set()
    for segment_motion in motion.segments:
        nodes = [piece.nodes for piece in segment_motion.pieces if not isinstance(piece, UnsolvedInterval)]
        if nodes:
            tau = np.unique(np.concatenate(nodes))
            if len(tau) > MOST_INSTANTS:
                tau = tau[np.linspace(0, len(tau) - 1, MOST_INSTANTS).round().astype(np.intp)]
            times.update(segment_motion.segment.start + Fraction(value) for value in tau.tolist())
    end = motion.timeline.end
    return sorted(time for time in times if time <= end)


def claim_errors(claim: Claim, values: Sequence[FloatArray]) -> FloatArray:
    """(F,) how far the two sides are from what is claimed; 0 or less where an inequality holds."""
    count = len(claim.left)
    left, right = values[:count], values[count:]
    match claim.relation:
        case Relation.BELOW:
            return left[0] - right[0]
        case Relation.ABOVE:
            return right[0] - left[0]
        case _:
            apart = [np.abs(a - b) for a, b in zip(left, right, strict=True)]
            if claim.left[0].op == "atan2d":  # an angle between vectors is one modulo a turn
                apart = [np.minimum(apart[0], np.abs(apart[0] - 360.0))]
            return np.asarray(np.hypot.reduce(apart), dtype=np.float64)


def _constant_off(claim: Claim) -> float | None:
    """By how much a claim of constants alone is off, where floats are too rough to tell; None for any other."""
    pairs = list(zip(claim.left, claim.right, strict=True))
    if not all(a.value is not None and b.value is not None for a, b in pairs):
        return None
    from movimentum.solver.arithmetic.evaluation import Evaluator
    from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic

    numbers = Evaluator(DigitsArithmetic(DIGITS))
    apart = [np.asarray(numbers.constant(a) - numbers.constant(b), dtype=np.float64) for a, b in pairs]
    return float(claim_errors(claim, [*apart, *(np.zeros(1) for _ in apart)])[0])


class _ClaimCheck:
    """Checks poses, and remembers where its claim fails."""

    def __init__(self, motion: PathMotion, held: TimedClaim) -> None:
        claim = held.claim
        self.motion, self.timed_claim = motion, held
        sides = *claim.left, *claim.right
        # the sine and the cosine of each angle, which is none where both are 0
        self.turns = [arg for node in walk(*sides) if node.op == "atan2d" for arg in node.args]
        self.longest = np.zeros(len(self.turns) // 2)
        self._read: Reader = reader(motion.timeline.scene, (*sides, *self.turns), motion)
        given = claim.tolerance
        self.tolerance = CLAIM_MET * motion.size if given is None else float(given)
        self.constant = _constant_off(claim)
        self.fails: tuple[Fraction, tuple[float, ...], float] | None = None
        self.worst, self.worst_time = 0.0, held.start
        self.good: list[Fraction] = []
        self.bad: list[NDArray[np.intp]] = []
        self.looked = 0

    def read(self, poses: Poses) -> tuple[list[FloatArray], NDArray[np.bool_]]:
        """The components of both sides, and (F,) whether there is anything to judge: a claim about the direction of a
        vector says nothing of instants at which the vector is zero.
        """
        values = self._read(poses)
        count = len(values) - len(self.turns)
        told = poses.solved.copy()
        for k, (y, x) in enumerate(zip(values[count::2], values[count + 1 :: 2], strict=True)):
            size = np.hypot(y, x)
            self.longest[k] = max(self.longest[k], float(np.max(size[np.isfinite(size)], initial=0.0)))
            told &= ~(size <= NO_DIRECTION * self.longest[k]) | (self.longest[k] == 0.0)
        return list(values[:count]), told

    def failing(self, off: FloatArray) -> NDArray[np.bool_]:
        strict = self.timed_claim.claim.strict and self.timed_claim.claim.tolerance is None
        return ~(off < 0.0) if strict else ~(off <= self.tolerance)

    def check(self, poses: Poses, times: Sequence[Fraction], frame: int | None = None) -> None:
        """Judge poses; ``frame``: the number of the first one, if they are frames."""
        inside = np.array([self.timed_claim.covers(time) for time in times], dtype=np.bool_)
        if not (inside & poses.solved).any():
            return
        values, told = self.read(poses)
        places = np.nonzero(inside & told)[0]
        if len(places) == 0:
            return
        off = (
            claim_errors(self.timed_claim.claim, values)
            if self.constant is None
            else np.full(len(times), self.constant)
        )
        fails = self.failing(off)
        self.looked += len(places)
        bad = places[fails[places]]
        good = places[~fails[places]]
        self.good += [times[int(good[0])], times[int(good[-1])]] if len(good) else []
        if len(bad) == 0:
            return
        if frame is not None:
            self.bad.append(frame + bad)
        before = good[good < bad[0]]
        self.good += [times[int(before[-1])]] if len(before) else []
        first = int(bad[0])
        if self.fails is None or times[first] < self.fails[0]:
            self.fails = times[first], tuple(float(v[first]) for v in values), float(off[first])
        top = int(bad[np.argmax(np.where(np.isfinite(off[bad]), off[bad], np.inf))])
        if not off[top] <= self.worst:
            self.worst, self.worst_time = float(off[top]), times[top]

    def check_between(self, grid: Sequence[Fraction]) -> None:
        """Look where the sides come nearest to each other between these instants: outlines pass each other quickly."""
        inside = np.array([float(time) for time in grid if self.timed_claim.covers(time)])
        if len(inside) < 2:
            return
        parts = np.arange(INSTANTS_BETWEEN) / INSTANTS_BETWEEN
        tau = np.append((inside[:-1, None] + np.diff(inside)[:, None] * parts).ravel(), inside[-1])
        off = self._off(tau)
        held = np.abs(off) <= self.tolerance  # they touch all along: only rounding is to be seen there
        peak = (off[1:-1] >= off[:-2]) & (off[1:-1] >= off[2:]) & ~(held[:-2] & held[1:-1] & held[2:])
        peaks = np.nonzero(peak)[0] + 1
        peaks = peaks[np.argsort(-off[peaks], kind="stable")[:MOST_PEAKS]]
        low, high, best = tau[peaks - 1], tau[peaks + 1], tau[peaks]
        for _ in range(ZOOMS if len(peaks) else 0):
            times = low[:, None] + (high - low)[:, None] * (np.arange(7) / 6.0)
            found = self._off(times.ravel()).reshape(times.shape)
            k, rows = np.argmax(found, axis=1), np.arange(len(times))
            best = times[rows, k]
            low, high = times[rows, np.maximum(k - 1, 0)], times[rows, np.minimum(k + 1, 6)]
        exactly = sorted({Fraction(time) for time in best.tolist()})
        self.check(self.motion.poses_at(exactly), exactly)

    def _off(self, tau: FloatArray) -> FloatArray:
        """(F,): by how much the claim is off at times; -inf where there is no solution."""
        times, back = np.unique(tau, return_inverse=True)
        poses = self.motion.poses_at([Fraction(time) for time in times.tolist()])
        values, told = self.read(poses)
        off = claim_errors(self.timed_claim.claim, values)
        return np.where(told & np.isfinite(off), off, -np.inf)[back]

    def verdict(self) -> BrokenClaim | None:
        if self.fails is None:
            return None
        time, values, amount = self.fails
        count = len(self.timed_claim.claim.left)
        before = max((t for t in self.good if t < time), default=None)
        return BrokenClaim(
            claim=self.timed_claim.claim,
            time=float(time if before is None else self._edge(before, time)),
            frame=-int((self.motion.timeline.start - time) * self.motion.timeline.fps // 1),
            left=values[:count],
            right=values[count:],
            amount=amount,
            worst=self.worst,
            worst_time=float(self.worst_time),
            tolerance=self.tolerance,
            instants=self.looked,
            failing=_runs(np.concatenate([np.zeros(0, dtype=np.intp), *self.bad])),
        )

    def _edge(self, good: Fraction, bad: Fraction) -> Fraction:
        """Where between two instants the claim begins to fail, by bisection on the solved path."""
        for _ in range(HALVINGS):
            middle = Fraction(float(good + bad) / 2.0)
            if not good < middle < bad:
                break
            poses = self.motion.poses_at([middle])
            values, told = self.read(poses)
            if told[0] and self.failing(claim_errors(self.timed_claim.claim, values))[0]:
                bad = middle
            else:
                good = middle
        return bad


def _runs(frames: NDArray[np.intp]) -> tuple[tuple[int, int], ...]:
    """First and last of each run of ascending numbers."""
    if not len(frames):
        return ()
    ends = np.nonzero(np.diff(frames) > 1)[0]
    firsts, lasts = np.concatenate([frames[:1], frames[ends + 1]]), np.concatenate([frames[ends], frames[-1:]])
    return tuple(zip(firsts.tolist(), lasts.tolist(), strict=True))


def claim_diagnostics(motion: PathMotion) -> Iterator[Diagnostic]:
    """An error for each claim that does not hold."""
    for broken in broken_claims(motion):
        yield _diagnostic(broken, motion.size, motion.timeline.scene.source)


def _diagnostic(broken: BrokenClaim, size: float, source: SourceText) -> Diagnostic:
    from movimentum.scene.text_edits import tolerated

    claim = broken.claim
    left, right = claim.side_texts
    word = {Relation.EQUAL: "", Relation.BELOW: "below ", Relation.ABOVE: "above "}[claim.relation]
    digits = _digits(broken)
    found, wanted = (_vector(side, digits) for side in (broken.left, broken.right))
    asked = wanted if right == wanted else f"`{right}`, which is {wanted}"
    finite = np.isfinite(broken.worst)
    helps: list[str | Fix] = ["either the claim or a constraint is wrong: the claim itself moves nothing"]
    if finite and broken.worst <= max(CLAIM_NEARLY_MET * size, 10.0 * broken.tolerance):
        enough = _rounded_up(broken.worst)
        helps.append(Fix(f"`.within({enough})` after it accepts this result", (tolerated(source, claim, enough),)))
    off = f"it is off by {number(broken.amount)} there" if finite else "it has no value there"
    if finite and broken.worst > 1.001 * broken.amount:
        off += f", and by at most {number(broken.worst)}, at t = {time_text(broken.worst_time)}"
    what = f"`{left}` is {found}, not {word}{asked}"
    for text, values in ((right, broken.right), (left, broken.left)):
        if not np.isfinite(values).all():
            what = f"`{text}` has no value"
    return Diagnostic(
        code="claim/broken",
        severity=Severity.ERROR,
        message=f"{what}: the claim fails from t = {time_text(broken.time)} (frame {broken.frame})",
        span=claim.span,
        notes=(
            f"{off}; the tolerance is {number(broken.tolerance)}"
            + (" (1e-9 of the scene's size)" if claim.tolerance is None else ""),
            f"checked at {counted(broken.instants, 'instant')}: every frame and the solver's own grid",
        ),
    ).advised(*helps)


def _digits(broken: BrokenClaim) -> int:
    """Enough digits to make the two sides look different."""
    size = max(map(abs, (*broken.left, *broken.right)), default=0.0)
    if not (np.isfinite(size) and broken.amount > 0.0 and np.isfinite(broken.amount)):
        return 6
    return int(np.clip(np.ceil(np.log10(max(size / broken.amount, 1.0))) + 2, 4, 17))


def _vector(values: tuple[float, ...], digits: int) -> str:
    shown: Callable[[float], str] = lambda value: number(value, digits)  # noqa: E731
    return shown(values[0]) if len(values) == 1 else f"[{', '.join(map(shown, values))}]"


def _rounded_up(value: float) -> str:
    """The next number of two digits."""
    if value <= 0.0:
        return "0"
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return number(float(np.ceil(value / unit * (1.0 + NEXT_ROUND)) * unit), 2)
