"""How pushed things move at an instant, against SciPy's quadratic programs; turning directions, series and signs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

import movimentum as mv
from movimentum.planning.structure.metric import Metric
from movimentum.solver.block.problem import Damping
from movimentum.solver.pushing.dense_steps import DEGREE, SHARES, series
from movimentum.solver.pushing.directions import TurningDirections
from movimentum.solver.pushing.force_signs import first_negative, root_on_equations
from movimentum.solver.pushing.push_law import (
    PushedInstant,
    WishLevel,
    not_opening,
    opening_rates,
    pushed_velocity,
    velocity_with_active,
    without_rounding,
)
from movimentum.solver.pushing.push_law_at_instants import (
    PushedInstants,
    contact_forces,
    opening_rates_at_instants,
    velocities_with_active,
)
from movimentum.solver.pushing.tracks import PushTrack

NONE = np.zeros(0, dtype=np.intp)


def metric_of(random, n, scale):
    root = random.normal(size=(n, n)) + 2.0 * np.eye(n)
    dense = root.T @ root * scale
    rows, columns = (each.ravel() for each in np.indices((n, n)))
    nothing = np.zeros(0, dtype=np.intp)
    return Metric(n, (rows, columns, dense.ravel()), (nothing, nothing, np.zeros(0)), ())


def instant(seed, *, scale=1.0, level=False, pulled=True):
    """Some equations, some inequalities that can be met, perhaps a wish that can be followed for itself."""
    random = np.random.default_rng(seed)
    n = int(random.integers(3, 7))
    m, k = int(random.integers(0, 2)), int(random.integers(1, 5))
    rows, pushes = random.normal(size=(m, n)), random.normal(size=(k, n))
    inside = scale * random.normal(size=n)
    levels = []
    if level:
        slopes = random.normal(size=(1, n))
        levels = [WishLevel(slopes, scale * random.normal(size=1), Damping())]
    return PushedInstant(
        metric_of(random, n, 1.0), rows, rows @ inside, scale * random.normal(size=n) if pulled else None, levels,
        pushes, pushes @ inside - scale * random.uniform(-0.2, 1.5, k) * (random.random(k) < 0.8),
    )  # fmt: skip


def best(now, equations, wanted, among=None):
    """The v with least v'Mv + 2 v'p of those that satisfy all, by SLSQP."""
    dense = now.metric.dense
    pull = np.zeros(len(dense)) if now.pull is None else now.pull
    constraints = [
        {"type": "eq", "fun": lambda v: equations @ v - wanted, "jac": lambda v: equations},
        {"type": "ineq", "fun": lambda v: now.pushes @ v - now.least, "jac": lambda v: now.pushes},
    ]
    used = [each for each, rows in zip(constraints, (equations, now.pushes), strict=True) if len(rows)]
    found = minimize(
        lambda v: float(v @ dense @ v + 2.0 * v @ pull), np.zeros(len(dense)), jac=lambda v: 2.0 * (dense @ v + pull),
        constraints=used, method="SLSQP", options={"maxiter": 800, "ftol": 1e-15},
    )  # fmt: skip
    return found.x if found.success or found.status == 8 else None


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("seed", range(10))
def test_what_is_pushed_moves_least(seed, scale):
    """With the pull of what is known: the least v'Mv + 2v'p."""
    now = instant(seed, scale=scale, pulled=bool(seed % 2))
    found = pushed_velocity(now)
    unit = PushedInstant(
        now.metric,
        now.rows,
        now.want / scale,
        None if now.pull is None else now.pull / scale,
        (),
        now.pushes,
        now.least / scale,
    )
    truth = best(unit, unit.rows, unit.want)
    assert found.v is not None
    assert truth is not None
    assert found.v / scale == pytest.approx(truth, abs=2e-5 * max(1.0, float(np.abs(truth).max())))
    assert found.is_certain
    # the inequalities that hold it are those that say nothing more: with these as equations it is the same
    assert velocity_with_active(now, found.active) == pytest.approx(found.v, rel=1e-9, abs=1e-9 * scale)
    assert opening_rates(now, found.v) == pytest.approx(found.opening_rates, rel=1e-9, abs=1e-9 * scale)
    assert (found.opening_rates >= -found.tolerance).all()
    assert np.abs(found.opening_rates[found.active]).max(initial=0.0) <= 1e-9 * scale
    white = now.metric.whitening[0]
    lengths = np.linalg.norm(now.pushes @ white, axis=1)
    assert found.opening_rates == pytest.approx(
        (now.pushes @ found.v - now.least) / lengths, rel=1e-9, abs=1e-12 * scale
    )
    # whatever is guessed to hold it
    for guess in (np.arange(len(now.least)), found.active, np.zeros(1, dtype=np.intp)):
        again = pushed_velocity(now, guess.astype(np.intp))
        assert again.v == pytest.approx(found.v, rel=1e-7, abs=1e-8 * scale)


@pytest.mark.parametrize("seed", range(10))
def test_a_wish_is_followed_as_far_as_the_inequalities_let_it_and_then_motion_is_least(seed):
    now = instant(100 + seed, level=True)
    found = pushed_velocity(now)
    assert found.v is not None
    (level,) = now.levels
    # how near the wish can be had at all
    dense = now.metric.dense
    constraints = [{"type": "ineq", "fun": lambda v: now.pushes @ v - now.least}]
    if len(now.rows):
        constraints.append({"type": "eq", "fun": lambda v: now.rows @ v - now.want})
    begin = np.linalg.pinv(now.pushes) @ (now.least + 1.0)
    nearest = minimize(
        lambda v: float(np.sum((level.slopes @ v - level.want) ** 2)), begin,
        constraints=constraints, method="SLSQP", options={"maxiter": 500, "ftol": 1e-14},
    )  # fmt: skip
    had = level.slopes @ nearest.x
    assert level.slopes @ found.v == pytest.approx(had, abs=2e-3)
    truth = best(now, np.concatenate([now.rows, level.slopes]), np.concatenate([now.want, level.slopes @ found.v]))
    if truth is not None and np.abs(level.slopes @ truth - level.slopes @ found.v).max() < 1e-6:
        assert found.v @ dense @ found.v + 2 * found.v @ (now.pull if now.pull is not None else 0 * found.v) <= (
            truth @ dense @ truth + 2 * truth @ (now.pull if now.pull is not None else 0 * truth) + 1e-4
        )


def test_what_contradicts_each_other_jams_and_what_is_left_out_does_not():
    metric = metric_of(np.random.default_rng(0), 2, 1.0)
    pushes = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    now = PushedInstant(metric, np.zeros((0, 2)), np.zeros(0), None, (), pushes, np.array([1.0, 0.5, -3.0]))
    jam = pushed_velocity(now)
    assert jam.v is None
    assert jam.active.tolist() == [0, 1]
    free = pushed_velocity(now.without([1]))
    assert free.v is not None
    assert free.active.tolist() == [0]
    assert free.v[0] == pytest.approx(1.0)
    dense = metric.dense  # the other unknown goes with it as the metric says
    assert free.v[1] == pytest.approx(-dense[0, 1] / dense[1, 1])
    # opposed and only just met: they are equations
    just = pushed_velocity(
        PushedInstant(metric, np.zeros((0, 2)), np.zeros(0), None, (), pushes[:2], np.array([1.0, -1.0]))
    )
    assert just.v is not None
    assert just.v[0] == pytest.approx(1.0)
    broken = PushedInstant(metric, np.array([[1.0, np.nan]]), np.zeros(1), None, (), pushes[:1], np.zeros(1))
    assert np.isnan(pushed_velocity(broken).v).all()
    assert np.isnan(velocity_with_active(broken, NONE)).all()
    # what an equation forbids
    fixed = PushedInstant(metric, np.array([[1.0, 0.0]]), np.array([0.0]), None, (), pushes[:1], np.array([1.0]))
    assert pushed_velocity(fixed).v is None
    assert pushed_velocity(fixed).active.tolist() == [0]


def test_small_helpers_of_the_law():
    assert without_rounding(np.array([1.0, 1e-18, -2.0]), np.array([1.0, 1.0, 1.0])).tolist() == [1.0, 0.0, -2.0]
    assert without_rounding(np.array([1e-9, 1e-27]), np.ones(2)).tolist() == [1e-9, 0.0]
    which = not_opening(np.array([2]), np.array([1.0, 1e-12, 3.0, 1e-10]), np.full(4, 1e-11))
    assert which.tolist() == [1, 2]


@pytest.mark.parametrize("level", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_many_instants_are_each_as_one_and_contacts_press_where_they_hold(seed, level):
    each = [instant(10 * seed, level=level) for _ in range(2)]
    random = np.random.default_rng(seed)
    first = each[0]
    each[1] = PushedInstant(
        first.metric, first.rows, first.want * 1.1, first.pull, first.levels, first.pushes, first.least + 0.1
    )
    levels = [(np.stack([now.levels[0].slopes for now in each]), np.stack([now.levels[0].want for now in each]),
               Damping())] if level else []  # fmt: skip
    many = PushedInstants(
        first.metric, *(np.stack([getattr(now, name) for now in each]) for name in ("rows", "want")),
        None if first.pull is None else np.stack([now.pull for now in each]), levels,
        *(np.stack([getattr(now, name) for now in each]) for name in ("pushes", "least")), 0.0,
        *(random.normal(size=(2, len(first.least))) for _ in range(3)),
    )  # fmt: skip
    which = pushed_velocity(each[0]).active
    found = velocities_with_active(many, which)
    assert found is not None
    v, projection = found
    white = first.metric.whitening[0]
    for k, now in enumerate(each):
        assert v[k] == pytest.approx(velocity_with_active(now, which), rel=1e-8, abs=1e-9)
        opens, slow = opening_rates_at_instants(many, v)
        assert opens[k] == pytest.approx(opening_rates(now, v[k]), rel=1e-9, abs=1e-12)
        assert (slow[k] > 0.0).all()
    rows = np.concatenate([first.rows, first.pushes[which]]) @ white
    assert rows @ projection == pytest.approx(np.zeros_like(rows), abs=1e-9)
    assert projection @ projection == pytest.approx(projection, abs=1e-9)
    assert np.trace(projection) == pytest.approx(len(white) - np.linalg.matrix_rank(rows), abs=1e-9)
    forces = contact_forces(many, which, v)
    assert forces.shape == (2, 1 + level, len(which))
    if not level and len(which):
        # Lagrange: M v + p = J'a + P'f, with the forces f along rows of unit length in the metric
        lengths = np.linalg.norm(first.pushes[which] @ white, axis=1)
        pull = np.zeros(len(v[0])) if first.pull is None else first.pull
        gradient = first.metric.dense @ v[0] + pull
        basis = np.concatenate([first.rows, first.pushes[which]]).T
        multipliers = np.linalg.lstsq(basis, gradient, rcond=None)[0]
        assert basis @ multipliers == pytest.approx(gradient, abs=1e-7)
        projected = _without(first.rows @ white, (first.pushes[which] @ white))
        lengths = np.linalg.norm(projected, axis=1)
        assert forces[0, 0] == pytest.approx(multipliers[len(first.rows) :] * lengths, rel=1e-6, abs=1e-7)
        assert (forces[0, 0] > 0.0).all()


def _without(rows, others):
    if not len(rows):
        return others
    return others - others @ np.linalg.pinv(rows) @ rows


# --- turning


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_a_steady_turn_is_steady_in_its_direction(scale):
    random = np.random.default_rng(4)
    turning = TurningDirections(np.array([1, 4]), np.array([2, 3]))
    size, turn = random.uniform(0.9, 1.1, (6, 2)), random.uniform(-3.0, 3.0, (6, 2))
    grows, spins = random.normal(size=(6, 2)), random.normal(size=(6, 2)) * scale
    x = random.normal(size=(6, 5))
    x[:, [1, 4]], x[:, [2, 3]] = size * np.cos(turn), size * np.sin(turn)
    rates = random.normal(size=(6, 5))
    rates[:, [1, 4]] = grows * np.cos(turn) - size * np.sin(turn) * spins
    rates[:, [2, 3]] = grows * np.sin(turn) + size * np.cos(turn) * spins
    paces = turning.paces(x, rates)
    assert paces[:, 0] == pytest.approx(rates[:, 0])
    assert paces[:, [1, 4]] == pytest.approx(grows / size, rel=1e-9, abs=1e-9 * scale)
    assert paces[:, [2, 3]] == pytest.approx(spins, rel=1e-9, abs=1e-9)
    change = np.zeros((6, 5))
    change[:, 0], change[:, [1, 4]], change[:, [2, 3]] = 0.5, 0.02, 0.7
    moved_ = turning.moved(x, change)
    assert moved_[:, 0] == pytest.approx(x[:, 0] + 0.5)
    assert moved_[:, [1, 4]] == pytest.approx(1.02 * size * np.cos(turn + 0.7))
    assert moved_[:, [2, 3]] == pytest.approx(1.02 * size * np.sin(turn + 0.7))


# --- tracks and signs


def test_a_track_is_its_series_from_step_to_step():
    """Two steps of polynomials of degree below 13."""
    begins_, lengths = np.array([2.0, 5.0]), np.array([3.0, 0.5])

    def truth(tau):
        return np.stack([np.where(tau < 5.0, np.sin(tau), tau**2), np.where(tau < 5.0, 3.0 * tau, np.cos(tau))])

    coefficients = np.stack(
        [series(truth(np.minimum(b + h * SHARES, b + h - 1e-12)).T) for b, h in zip(begins_, lengths, strict=True)]
    )
    assert coefficients.shape == (2, DEGREE + 1, 2)
    track = PushTrack(np.array([2.0, 5.0, 5.5]), np.zeros((3, 2)), np.zeros((3, 2)), 5.5, 1e-9, 0,
                      begins=begins_, lengths=lengths, coefficients=coefficients)  # fmt: skip
    tau = np.array([2.0, 2.7, 4.999, 5.0, 5.2, 5.5])
    assert track.step(np.array([1.0, 2.0, 4.9, 5.0, 9.0])).tolist() == [0, 0, 0, 1, 1]
    assert track.guess(tau) == pytest.approx(truth(tau), abs=1e-8)
    assert track.kinks.tolist() == []


class Step:
    t0, h = 10.0, 4.0

    @staticmethod
    def share(tau):
        return (tau - 10.0) / 4.0


@pytest.mark.parametrize("zero", [10.3, 11.7, 13.9])
def test_a_sign_that_turns_negative_is_found_and_how_fast(zero):
    times = 10.0 + 4.0 * SHARES
    found = first_negative(np.exp(-(times - zero)) - 1.0, Step, 10.0, 14.0)
    assert found is not None
    assert found == pytest.approx((zero, -1.0), rel=1e-4)
    assert found[0] == pytest.approx(zero, abs=1e-7)
    assert first_negative(np.exp(times - 10.0), Step, 10.0, 14.0) is None
    assert first_negative(np.sign(times - zero), Step, 10.0, 14.0) is None  # not smooth
    asked = []

    def value(tau):
        asked.append(tau)
        return math.cos(tau - zero + math.pi / 2.0)

    # by its slope from a good guess, by halves without one or with a bad one
    assert root_on_equations(value, (zero + 1e-3, -1.0), 10.0, zero + 1.0, 1e-9) == pytest.approx(zero, abs=1e-8)
    assert len(asked) < 6
    for guess in (None, (10.0, 5.0), (zero + 0.9, -1e-9)):
        assert root_on_equations(value, guess, zero - 1.0, zero + 1.0, 1e-9) == pytest.approx(zero, abs=2e-9)
    assert root_on_equations(value, None, zero - 2.0, zero - 1.0, 1e-9) is None
    assert root_on_equations(value, None, zero + 0.5, zero + 1.0, 1e-9) == zero + 0.5
    assert root_on_equations(lambda tau: math.nan, (zero, -1.0), 10.0, 14.0, 1e-9) is None


# --- films in closed form


def film(text, **more):
    return mv.loads(f".config(10, 400, 400);\n{text}").solve(**more)


@pytest.mark.parametrize("seed", range(4))
def test_a_disc_pushes_another_along_the_line_of_their_middles(seed):
    """Pursuit: about a pusher on a straight way the direction to the other is tan(a/2) = tan(a0/2) e^(u t/D)."""
    random = np.random.default_rng(seed)
    scale, lean = (1.0, 1e-2, 1e3, 5.0)[seed], float(random.uniform(0.0, 2.0 * np.pi))
    r, s, u = (scale * v for v in random.uniform([5, 5, 20], [15, 15, 60]).tolist())
    off = float(random.uniform(-0.5, 0.5)) * (r + s)
    way, side = np.array([math.cos(lean), math.sin(lean)]), np.array([-math.sin(lean), math.cos(lean)])
    start = 3.0 * (r + s) * way + off * side
    (x, y), (vx, vy) = start.tolist(), (u * way).tolist()
    motion = film(
        f"A : .disc({r!r}) C = [0,0]; B : .disc({s!r}) C = [{x!r},{y!r}];"
        f"@0 A.C = [{vx!r}*.t, {vy!r}*.t]; B.C = [_, _]; .gap(A, B) >= 0 .pushes; @{8.0 * (r + s) / u!r}"
    )
    far = r + s
    begin = (3.0 * far - math.sqrt(far**2 - off**2)) / u
    first = math.asin(off / far)
    (event,) = [each for each in motion.contacts if each.event == "begins"]
    assert event.time == pytest.approx(begin, rel=1e-9)
    end = begin - far / u * math.log(abs(math.tan(first / 2.0)))  # where it is square to the way
    time = np.clip(motion.times, begin, end)
    angle = 2.0 * np.arctan(math.tan(first / 2.0) * np.exp(u * (time - begin) / far))
    pushed = u * time[:, None] * way + far * (np.cos(angle)[:, None] * way + np.sin(angle)[:, None] * side)
    truth = np.where((motion.times <= begin)[:, None], start, pushed)
    assert motion["B.C"] == pytest.approx(truth, abs=1e-7 * far)


@pytest.mark.parametrize("spin", [40.0, -40.0])
def test_a_turning_bar_pushes_a_disc_out_and_round_its_tip(spin):
    """Square to the bar; so the foot goes along it by as much as the disc is large times the turn."""
    r, w, long = 10.0, math.radians(abs(spin)), 60.0
    sense = math.copysign(1.0, spin)
    motion = film(
        f"A : .bar O = [100,100] P = [160,100] .width(8); B : .disc(6) C = [150,{100 + sense * 20}];"
        f"@0 A.O = [100,100]; A.angle = {spin}*.t; B.C = [_, _]; .gap(A, B) >= 0 .pushes; @2"
    )
    # the bar's side meets the disc where its direction is r away from the middle
    far, up = math.hypot(50.0, 20.0), math.atan2(20.0, 50.0)
    lean = up - math.asin(r / far)
    begin, foot = lean / w, math.sqrt(far**2 - r**2)
    times = [each.time for each in motion.contacts if each.event == "begins"]
    assert times[0] == pytest.approx(begin, abs=1e-9)
    leaves = begin + (long - foot) / (r * w)
    some = (motion.times >= begin) & (motion.times <= leaves)
    turn = sense * w * motion.times[some]
    along = foot + r * w * (motion.times[some] - begin)
    x = 100 + along * np.cos(turn) - sense * r * np.sin(turn)
    y = 100 + along * np.sin(turn) + sense * r * np.cos(turn)
    assert some.sum() > 2
    assert motion["B.C"][some] == pytest.approx(np.stack([x, y], axis=1), abs=1e-7)
    changes = [each.time for each in motion.contacts if each.event == "changes"]
    assert changes[0] == pytest.approx(leaves, abs=1e-8)

    # beyond, the tip pushes along the line to the middle
    def rate(t, p):
        turned = sense * w * t
        tip = 100 + long * np.array([math.cos(turned), math.sin(turned)])
        speed = sense * w * long * np.array([-math.sin(turned), math.cos(turned)])
        n = (p - tip) / np.hypot(*(p - tip))
        return n * max(n @ speed, 0.0)

    turned = sense * w * leaves
    at = (
        100
        + long * np.array([math.cos(turned), math.sin(turned)])
        + r * sense * np.array([-math.sin(turned), math.cos(turned)])
    )
    after = motion.times[motion.times > leaves]
    truth = solve_ivp(rate, (leaves, 2.0), at, t_eval=after, rtol=1e-10, atol=1e-10).y.T
    assert motion["B.C"][motion.times > leaves] == pytest.approx(truth, abs=1e-6)


def test_a_row_of_discs_goes_as_one_stays_where_it_is_left():
    motion = film(
        "A : .disc(10) C = [50,100]; B : .disc(8) C = [80,100]; D : .disc(5) C = [120,100];"
        "@0 A.C = [50 + 60*.sin(90*.t), 100]; B.C = [_, _]; D.C = [_, _];"
        ".gap(A, B) >= 0 .pushes; .gap(B, D) >= 0 .pushes; @2"
    )
    a = 50.0 + 60.0 * np.sin(np.pi / 2.0 * motion.times)
    top = np.maximum.accumulate(a)
    b = np.maximum(80.0, top + 18.0)
    assert motion["B.C"][:, 0] == pytest.approx(b, abs=1e-7)
    assert motion["D.C"][:, 0] == pytest.approx(np.maximum(120.0, b + 13.0), abs=1e-7)
    events = [(each.event, each.time) for each in motion.contacts]
    first = math.asin(12.0 / 60.0) / (math.pi / 2.0)
    second = math.asin(39.0 / 60.0) / (math.pi / 2.0)
    assert [event for event, _ in events][:2] == ["begins", "begins"]
    assert [time for _, time in events[:2]] == pytest.approx([first, second], abs=1e-8)
    ends = [time for event, time in events if event == "ends"]
    assert ends
    assert ends == pytest.approx([1.0] * len(ends), abs=1e-6)


def test_a_row_that_meets_a_wall_says_when():
    script = mv.loads(
        ".config(10, 400, 400); A : .disc(10) C = [50,100]; B : .disc(8) C = [80,100]; W : .disc(10) C = [160,100];"
        "@0 A.C = [50 + 20*.t, 100]; W.C = [160,100]; B.C.y = 100; .gap(A, B) >= 0 .pushes; .gap(B, W) >= 0 .pushes; @5"
    )
    with pytest.raises(mv.NoSolutionError) as caught:
        script.solve()
    error = caught.value.diagnostics[0]
    # from 50 to 160 there is room for 10 + 16 + 10
    assert f"{(110.0 - 36.0) / 20.0:g}" in error.message


def test_stops_push_values_and_rates():
    motion = film(
        "A : .disc(5) C = [50,50]; @0 A.C.y = 50; A.C.x >= 30 + 40*.t .pushes; A.C.x <= 120 + 5*.t .pushes; @2"
    )
    assert motion["A.C"][:, 0] == pytest.approx(np.maximum(50.0, 30.0 + 40.0 * motion.times), abs=1e-8)


@pytest.mark.parametrize(
    ("rate", "truth"),
    [
        ("7", lambda t: 7.0 * t),
        ("7 + 2*.t", lambda t: 7.0 * t + t * t),
        ("20*.t", lambda t: 10.0 * t * t),  # which begins at rest
        ("20*.cos(90*.t)", lambda t: 40.0 / np.pi * np.sin(np.pi / 2.0 * np.minimum(t, 1.0))),  # until it would pull
        ("7 + 20*.sin(90*.t)", lambda t: 7.0 * t + 40.0 / np.pi * (1.0 - np.cos(np.pi / 2.0 * t))),
        ("7 + B.C.x", lambda t: 7.0 * t + t * t),
        ("A.C.x/50", lambda t: 50.0 * np.expm1(t / 50.0)),
    ],
)
def test_a_rate_that_pushes_is_integrated(rate, truth):
    """A rate says nothing of where something is, though nothing is free to be chosen."""
    motion = film(
        "A : .disc(5) C = [50,50]; B : .disc(5) C = [0,0]; @0 A.C.y = 50; B.C = [2*.t, 0];"
        f".d(A.C.x) >= {rate} .pushes; @2"
    )
    assert motion["A.C"][:, 0] == pytest.approx(50.0 + truth(motion.times), abs=1e-8)
