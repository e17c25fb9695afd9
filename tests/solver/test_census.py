"""A census of random mechanisms that rotate fully, at few frames a turn, against references stepped 1440 times a turn.

The references share nothing with the solver: circles intersected with their side kept, and Newton's method on the rods'
lengths, from 0.25 degrees to the next.
"""

import itertools

import numpy as np
import pytest

from movimentum.analysis.diagnose.verify import first_unsolved_frame
from tests.solver.scenes import anchor, motion_of

RATES = (72, 36, 18, 8)
STEPS = 1440


def point(p):
    return f"[{float(p[0])!r},{float(p[1])!r}]"


def third_corner(p, q, from_p, from_q, side):
    """Where circles about ``p`` and ``q`` (F, 2) meet, on one side of the line from p to q."""
    d = q - p
    square = np.sum(d * d, axis=-1)
    along = (from_p**2 - from_q**2 + square) / (2 * square)
    height = side * np.sqrt(from_p**2 / square - along**2)
    return p + along[..., None] * d + height[..., None] * np.stack([-d[..., 1], d[..., 0]], axis=-1)


def compared(text, name, reference):
    """The largest distance of an anchor from ``reference(degrees of turn)`` over a turn, over all frame rates."""
    worst = 0.0
    for rate in RATES:
        motion = motion_of(text, rate)
        poses = motion.poses(0, rate + 1)
        assert poses.solved.all(), text
        assert first_unsolved_frame(motion) is None
        worst = max(worst, float(np.max(np.abs(anchor(motion, poses, name) - reference(360 * poses.times)))))
    return worst


def four_bars(count, seed):
    """Random crank-rockers and double cranks: (crank, coupler, rocker, ground, first angle, side)."""
    random = np.random.default_rng(seed)
    while count:
        lengths = random.uniform(20, 120, 4)
        short, *middle, long = np.sort(lengths)
        crank, coupler, rocker, ground = lengths
        if short + long < sum(middle) and short in (crank, ground):
            count -= 1
            yield crank, coupler, rocker, ground, random.uniform(0, 360), random.choice([-1, 1])


def four_bar_error(crank, coupler, rocker, ground, start, side):
    pivot = np.array([ground, 0.0])

    def joint(turn):
        angle = np.radians(start + np.atleast_1d(turn))
        p = crank * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return p, third_corner(p, np.broadcast_to(pivot, p.shape), coupler, rocker, side)

    p, b = (v[0] for v in joint(0.0))
    text = f""".config(8);
    C : .bar O=[0,0] P=[{crank!r},0];  R : .bar O={point(pivot)} P={point(b)};  L : .bar A={point(p)} B={point(b)};
    @0 C.O=[0,0]; C.angle={start!r} + 360*.t; R.O={point(pivot)}; L.A=C.P; L.B=R.P;
    @1"""
    return compared(text, "L.B", lambda turn: joint(turn)[1])


COUNTS = [25, pytest.param(400, marks=pytest.mark.slow)]


@pytest.mark.slow
@pytest.mark.parametrize("count", COUNTS)
def test_four_bars(count):
    errors = [four_bar_error(*map(float, case)) for case in four_bars(count, count)]
    print(f"{count} four-bars at {RATES} frames a turn: largest error {max(errors):.1e}")
    assert max(errors) < 1e-9


def slider_crank_error(crank, rod, offset, start, side):
    def slider(turn):
        angle = np.radians(start + np.atleast_1d(turn))
        x, y = crank * np.cos(angle), crank * np.sin(angle)
        return np.stack([x + side * np.sqrt(rod**2 - (y - offset) ** 2), np.full_like(x, offset)], axis=-1)

    first = np.radians(start)
    p = crank * np.array([np.cos(first), np.sin(first)])
    text = f""".config(8);
    C : .bar O=[0,0] P=[{crank!r},0];  L : .bar A={point(p)} B={point(slider(0.0)[0])};
    @0 C.O=[0,0]; C.angle={start!r} + 360*.t; L.A=C.P; L.B=[_,{offset!r}];
    @1"""
    return compared(text, "L.B", slider)


@pytest.mark.slow
@pytest.mark.parametrize("count", COUNTS)
def test_slider_cranks(count):
    random = np.random.default_rng(count)
    errors = []
    while len(errors) < count:
        crank, rod, offset = random.uniform(10, 60), random.uniform(20, 120), random.uniform(-40, 40)
        if crank + abs(offset) < rod:
            case = crank, rod, offset, random.uniform(0, 360), float(random.choice([-1, 1]))
            errors.append(slider_crank_error(*map(float, case)))
    print(f"{count} slider-cranks at {RATES} frames a turn: largest error {max(errors):.1e}")
    assert max(errors) < 1e-9


# --- triads: a platform on three legs, two pivots fixed, the third on a crank


class Triad:
    """Legs from three pivots to a platform's corners; the first pivot is a crank's pin. Followed by Newton's method."""

    def __init__(self, crank, pivots, corners):
        self.crank, self.pivots, self.corners = crank, np.array(pivots), np.array(corners)
        pins = np.concatenate([[[crank, 0.0]], self.pivots])
        self.legs = np.linalg.norm(self.corners - pins, axis=1)
        self.pairs = list(itertools.combinations(range(3), 2))
        self.sides = np.array([np.linalg.norm(self.corners[i] - self.corners[j]) for i, j in self.pairs])

    def system(self, x, angle):
        corners = x.reshape(3, 2)
        pin = self.crank * np.array([np.cos(angle), np.sin(angle)])
        ends = [*zip(corners, [pin, *self.pivots], self.legs, strict=True)]
        rows, jacobian = np.zeros(6), np.zeros((6, 6))
        for i, (corner, pivot, length) in enumerate(ends):
            d = corner - pivot
            rows[i] = d @ d - length**2
            jacobian[i, 2 * i : 2 * i + 2] = 2 * d
        for k, ((i, j), length) in enumerate(zip(self.pairs, self.sides, strict=True)):
            d = corners[i] - corners[j]
            rows[3 + k] = d @ d - length**2
            jacobian[3 + k, 2 * i : 2 * i + 2] = 2 * d
            jacobian[3 + k, 2 * j : 2 * j + 2] = -2 * d
        return rows, jacobian

    def turn(self, finer=1, nearest=2e-3):
        """(STEPS + 1, 2) positions of the first corner, and how near to singular it comes; None where it cannot turn
        fully, or comes nearer than ``nearest``.
        """
        x = self.corners.reshape(-1).copy()
        path, worst = [x[:2].copy()], np.inf
        for angle in np.linspace(0, 2 * np.pi, finer * STEPS + 1)[1:]:
            before = x.copy()
            for _ in range(12):
                rows, jacobian = self.system(x, angle)
                step = np.linalg.solve(jacobian, rows)
                x = x - step
                if np.max(np.abs(step)) < 1e-12:
                    break
            else:
                return None
            singular = np.linalg.svd(jacobian / np.linalg.norm(jacobian, axis=1)[:, None], compute_uv=False)
            worst = min(worst, singular[-1] / singular[0])
            if np.max(np.abs(x - before)) > 4 / np.sqrt(finer) or worst < nearest:
                return None
            path.append(x[:2].copy())
        return np.array(path[::finer]), worst

    def script(self):
        (a, b), (x, y, z) = self.pivots, self.corners
        return f""".config(8);
        C : .bar O=[0,0] P=[{self.crank!r},0]; L0 : .bar a=[{self.crank!r},0] b={point(x)};
        L1 : .bar a={point(a)} b={point(y)}; L2 : .bar a={point(b)} b={point(z)};
        B : .bar x={point(x)} y={point(y)} z={point(z)};
        @0 C.O=[0,0]; C.angle=360*.t; L0.a=C.P; L1.a={point(a)}; L2.a={point(b)}; L0.b=B.x; L1.b=B.y; L2.b=B.z;
        @1"""


def triads(count, seed):
    random = np.random.default_rng(seed)
    while count:
        pivots = [
            (random.uniform(40, 110), random.uniform(-40, 40)),
            (random.uniform(-60, 110), random.uniform(-80, 80)),
        ]
        corners = [(random.uniform(-10, 90), random.uniform(10, 100)) for _ in range(3)]
        triad = Triad(float(random.uniform(12, 22)), pivots, corners)
        if min(triad.sides) < 25 or min(triad.legs) < 30:
            continue
        try:
            turned = triad.turn()
        except np.linalg.LinAlgError:
            continue
        if turned is not None:
            count -= 1
            yield triad, *turned


@pytest.mark.slow
@pytest.mark.long
def test_triads_near_change_points():
    """Platforms that come near to a change point: the legs turned until the smallest singular value almost vanishes."""
    random = np.random.default_rng(5)
    errors, conditions = [], []
    while len(errors) < 8:
        triad = next(iter(triads(1, int(random.integers(1 << 30)))))[0]
        # a longer and longer crank brings the mechanism to where it can just turn: the last that does is kept
        low, high, best = triad.crank, 3 * triad.crank, None
        for _ in range(14):
            middle = 0.5 * (low + high)
            longer = Triad(middle, triad.pivots, triad.corners)
            try:
                turned = longer.turn(finer=1, nearest=1e-6)
            except np.linalg.LinAlgError:
                turned = None
            if turned is None:
                high = middle
            else:
                low, best = middle, longer
        turned = None if best is None else best.turn(finer=16, nearest=1e-6)
        if turned is None or turned[1] > 5e-3:
            continue
        path, worst = turned
        error = compared(best.script(), "B.x", lambda turn, path=path: path[np.rint(turn * STEPS / 360).astype(int)])
        print(f"condition {1 / worst:.0f}: error {error:.1e}")
        errors.append(error)
        conditions.append(1 / worst)
        assert error < 1e-7, best.script()
    print(
        f"{len(errors)} triads near change points, condition up to {max(conditions):.0f}:"
        f" largest error {max(errors):.1e}"
    )


def census_of_triads(count, seed):
    errors, conditions = [], []
    for triad, path, worst in triads(count, seed):
        errors.append(
            compared(triad.script(), "B.x", lambda turn, path=path: path[np.rint(turn * STEPS / 360).astype(int)])
        )
        conditions.append(1 / worst)
        assert errors[-1] < 1e-8, triad.script()
    print(
        f"{count} triads at {RATES} frames a turn: largest error {max(errors):.1e}; the most singular comes to a"
        f" condition of {max(conditions):.0f}"
    )


@pytest.mark.slow
def test_triads():
    census_of_triads(6, 3)


@pytest.mark.slow
@pytest.mark.long
def test_two_hundred_triads():
    census_of_triads(200, 4)
