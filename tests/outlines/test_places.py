"""Places on curves: zeros in brackets, polygons that stand for curves, kinks and cusps, where an outline goes along."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from movimentum.expressions import Expr, add, call, const, div, mul, neg, sub
from movimentum.expressions.tables import Table
from movimentum.geometry import counter_clockwise
from movimentum.outlines import cubics
from movimentum.outlines.bracketed_roots import bracketed_roots
from movimentum.outlines.contour import PLACE, numeric, smooth_contour
from movimentum.outlines.flattening import flattened
from movimentum.outlines.kinks import TooManyPieces, at_piece, cusps_of, kinks_of
from movimentum.outlines.lines import polygon
from movimentum.outlines.primitive_pieces import primitive_values, primitives_of, primitives_of_edges
from movimentum.outlines.shapes import circle_outline
from movimentum.outlines.tangential_motion import inward_speed, outward_speed, tangential_places

SCALES = (1e-3, 1.0, 1e6)


def cross(p, q):
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


def ellipse(a: float, b: float):
    return smooth_contour(
        (mul(const(a), call("cosd", PLACE)), mul(const(b), call("sind", PLACE))), 0.0, 360.0, closed=True
    )


# --- zeros


@pytest.mark.parametrize("scale", SCALES)
def test_zeros_are_those_that_brent_finds(scale):
    """Steep and flat ones, falling and rising, from which Newton's method runs away, and zeros at ends."""
    random = np.random.default_rng(3)
    shapes = [
        (lambda z: np.arctan(9.0 * z), lambda z: 9.0 / (1.0 + 81.0 * z * z)),
        (lambda z: np.expm1(3.0 * z), lambda z: 3.0 * np.exp(3.0 * z)),
        (lambda z: z + 5.0 * z**3, lambda z: 1.0 + 15.0 * z * z),
        (lambda z: -np.sinh(4.0 * z), lambda z: -4.0 * np.cosh(4.0 * z)),
    ]
    for k, (shape, slope) in enumerate(shapes):
        zero = random.uniform(-1.0, 1.0, 40)
        low, high = zero - random.uniform(0.0, 5.0, 40), zero + random.uniform(0.0, 5.0, 40)
        calls = []

        def at(place, zero=zero, shape=shape, slope=slope, falling=k == 3, calls=calls):
            value = shape(place / scale - zero)
            calls.append(place)
            return value, slope(place / scale - zero) / scale, (value > 0.0) if falling else (value < 0.0)

        found = bracketed_roots(at, low * scale, high * scale, 1e-14 * scale)
        truth = [brentq(lambda x, z=z, f=shape: f(x - z), a - 1e-9, b + 1e-9, xtol=1e-15) for z, a, b in
                 zip(zero, low, high, strict=True)]  # fmt: skip
        assert found == pytest.approx(np.array(truth) * scale, abs=3e-14 * scale)
        assert len(calls) < 16  # Newton's method, which doubles the digits
        for ends in ((zero * scale, high * scale), (low * scale, zero * scale)):
            assert bracketed_roots(at, *ends, 1e-14 * scale) == pytest.approx(
                np.array(truth) * scale, abs=3e-14 * scale
            )


# --- cubics that stand for arcs


@pytest.mark.parametrize("scale", SCALES)
def test_arcs_and_cubics_are_nearly_those_of_circles(scale):
    random = np.random.default_rng(5)
    turn = random.uniform(-0.3, 0.3, 60)
    radius, first = scale * random.uniform(0.5, 2.0, 60), random.uniform(0.0, 7.0, 60)
    centre, share, off = random.normal(size=(60, 2)) * scale, random.uniform(0, 1, 60), random.uniform(-0.1, 0.1, 60)

    def on(angle, far):
        return centre + far[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def way(angle):
        return np.sign(turn)[:, None] * np.stack([-np.sin(angle), np.cos(angle)], axis=1)

    p, q, d, e = on(first, radius), on(first + turn, radius), way(first), way(first + turn)
    assert cubics.arc_length(p, d, q, e) == pytest.approx(radius * np.abs(turn), rel=2e-5)
    middle = first + share * turn
    along = way(middle)
    for far in (0.0 * off, off):
        for sign in (1.0, -1.0):  # directions may be those of the other way round
            found = cubics.cubic_offsets(p, sign * d, q, sign * e, on(middle, radius * (1.0 + far)), along)
            error = np.abs(found - radius * np.abs(far)) / radius
            # Hermite's interpolation of what goes at a steady pace: h⁴ / 384 times the fourth derivative
            assert float(np.max(error / (turn**4 + 1e-10))) < 1.002 / 384.0


# --- curves as polygons


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("flat", [1.0, 0.2])
def test_a_polygon_stays_within_its_bound_and_has_few_corners(scale, flat):
    def points(turn):
        return scale * np.stack([np.cos(turn), flat * np.sin(turn)], axis=1)

    breaks = [0.0, 1.0, 2.5, 2.0 * np.pi]
    for off in (1e-2, 1e-4):
        found = flattened(points, breaks, off * scale)
        assert np.isin(breaks[:-1], found).all()
        ends = np.append(found, breaks[-1])
        assert (np.diff(ends) > 0.0).all()
        inner = ends[:-1, None] + np.diff(ends)[:, None] * np.linspace(0.0, 1.0, 21)
        p, q, r = points(ends[:-1]), points(ends[1:]), points(inner.ravel()).reshape(len(found), -1, 2)
        chord = q - p
        far = np.abs(cross(chord[:, None], r - p[:, None])) / np.hypot(*chord.T)[:, None]
        assert far.max() <= 1.02 * off * scale
        # on a circle of radius 1 an arc of angle a bulges by a² / 8
        assert flat < 1.0 or len(found) <= max(24, 4.0 * np.pi / np.sqrt(8.0 * off))
    # where a piece begins and ends at one point its points are compared with that
    assert len(flattened(lambda turn: points(16.0 * turn), [0.0, 2.0 * np.pi], 1e-3 * scale)) > 16 * 40 * flat


# --- lines, arcs and corners as numbers


@pytest.mark.parametrize("scale", SCALES)
def test_lines_arcs_and_corners_are_recognised_and_computed_exactly(scale):
    random = np.random.default_rng(11)
    for _ in range(20):
        (x, y, vx, vy), angle, rate = random.normal(size=4) * scale, random.uniform(-3, 3), random.uniform(-0.4, 0.4)
        radius, begin = scale * random.uniform(0.3, 3.0), random.uniform(-2.0, 2.0)

        def line(u):
            one = np.ones_like(u)
            return [x + vx * u, y + vy * u, vx * one, vy * one, vx * one, vy * one, 0 * u, 0 * u]  # noqa: B023

        def arc(u):
            c, s = np.cos(angle + rate * u), np.sin(angle + rate * u)  # noqa: B023
            w, r = rate, radius  # noqa: B023
            return [x + r * c, y + r * s, -r * w * s, r * w * c, -r * w * s, r * w * c, -r * w * w * c, -r * w * w * s]  # noqa: B023

        def corner(u):
            c, s, o = np.cos(angle + rate * u), np.sin(angle + rate * u), np.ones_like(u)  # noqa: B023
            return [x * o, y * o, c, s, 0 * u, 0 * u, -rate * s, rate * c]  # noqa: B023

        def bulge(u, r=radius):  # an ellipse, which is none of these
            c, s = np.cos(u), 0.9 * np.sin(u)
            return [r * c, r * s, -r * s / 0.9, 0.9 * r * c, -r * s / 0.9, 0.9 * r * c, -r * c, -r * s]

        pieces = [line, arc, corner, bulge]
        breaks = begin + np.cumsum([0.0, 1.0, 2.0, 0.5, 1.5])
        forms, known = primitives_of(pieces, breaks.tolist())
        assert known.tolist() == [True, True, True, False]
        for k, piece in enumerate(pieces[:3]):
            places = np.linspace(breaks[k], breaks[k + 1], 9)
            found = primitive_values(np.repeat(forms[:, k : k + 1], 9, axis=1), places - breaks[k])
            truth = np.array(piece(places))
            assert found[:2] == pytest.approx(truth[:2], abs=1e-12 * scale)
            # a direction may have another length, if it changes as it turns
            size = np.hypot(*truth[2:4])
            assert found[2:] == pytest.approx(truth[2:], abs=1e-11 * max(float(size.max()), scale))


@pytest.mark.parametrize("scale", SCALES)
def test_a_polygon_stands_still_at_corners_while_its_direction_turns(scale):
    random = np.random.default_rng(2)
    for count in (3, 4, 7):
        turns = np.sort(random.uniform(0.0, 2.0 * np.pi, count))
        corners = counter_clockwise(tuple(zip(*(scale * np.array([np.cos(turns), np.sin(turns)])), strict=True)))
        found = polygon(corners)
        assert primitives_of_edges(found.position, found.direction, np.array(found.breaks)) is not None
        assert primitives_of_edges(found.position, found.position, np.array(found.breaks)) is None
        p = np.array([*corners, corners[0]])
        lengths = np.hypot(*np.diff(p, axis=0).T)
        for k in range(count):
            begin, end, after = found.breaks[2 * k : 2 * k + 3]
            assert end - begin == pytest.approx(lengths[k], rel=1e-12)
            unit = (p[k + 1] - p[k]) / lengths[k]
            values = found.values(begin + (end - begin) * np.array([0.25, 0.75]))
            truth = p[k] + np.outer([0.25, 0.75], p[k + 1] - p[k])
            assert pytest.approx(truth, abs=1e-12 * scale) == values[:2].T
            assert pytest.approx(np.tile(np.append(unit, unit), (2, 1)), abs=1e-12) == values[2:6].T
            assert values[6:] == pytest.approx(np.zeros((2, 2)), abs=1e-12)
            following = (p[(k + 1) % count + 1] - p[k + 1 - count * (k + 1 == count)]) / lengths[(k + 1) % count]
            turn = np.arctan2(cross(unit, following), unit @ following)
            for share in (0.0, 0.3, 0.6):
                x, y, tx, ty, dx, dy, rx, ry = found.values(np.array([end + share * (after - end)]))[:, 0]
                angle = np.arctan2(unit[1], unit[0]) + share * turn
                assert (x, y) == pytest.approx(tuple(p[k + 1]), abs=1e-12 * scale)
                assert (tx, ty) == pytest.approx((np.cos(angle), np.sin(angle)), abs=1e-12)
                rate = turn / (after - end)
                assert (dx, dy) == pytest.approx((0.0, 0.0), abs=1e-12)
                assert (rx, ry) == pytest.approx((-rate * np.sin(angle), rate * np.cos(angle)), rel=1e-9)


# --- kinks and cusps


def of(name: str, *args: Expr) -> Expr:
    return call(name, *args)


def test_kinks_are_where_closed_forms_have_them():
    rate = 1.3
    u = mul(const(rate), PLACE)
    sine = of("sind", u)
    cases = {
        "abs": (of("abs", sine), np.arange(0.0, 400.0 * rate, 180.0) / rate),
        "min": (of("min", sine, const(0.5)), [(a + 360.0 * k) / rate for k in range(9) for a in (30.0, 150.0)]),
        "max": (of("max", of("cosd", u), sine), [(45.0 + 180.0 * k) / rate for k in range(20)]),
        "floor": (of("floor", div(u, const(50.0))), np.arange(0.0, 400.0 * rate, 50.0) / rate),
        "mod": (of("mod", u, const(70.0)), np.arange(0.0, 400.0 * rate, 70.0) / rate),
        "ease": (of("ease", div(sub(u, const(20.0)), const(60.0))), np.array([20.0, 80.0]) / rate),
        "tand": (of("tand", u), np.arange(90.0, 400.0 * rate, 180.0) / rate),
    }
    for name, (root, places) in cases.items():
        truth = [place for place in sorted(places) if 1e-9 < place < 360.0 - 1e-9]
        assert kinks_of([root], 0.0, 360.0) == pytest.approx(truth, abs=1e-11), name
    both = sorted([*np.arange(50.0, 360.0 * rate, 50.0) / rate, *np.arange(70.0, 360.0 * rate, 70.0) / rate])
    once = [a for a, b in pairwise([*both, np.inf]) if b - a > 1e-6]
    assert kinks_of([cases["floor"][0], cases["mod"][0]], 0.0, 360.0) == pytest.approx(once, abs=1e-9)
    assert kinks_of([sine], 0.0, 360.0) == []


def test_a_table_has_kinks_at_its_rows_and_a_round_kink_is_where_the_script_says():
    random = np.random.default_rng(4)
    x = np.sort(random.uniform(-5.0, 5.0, 12))
    table = call("table", PLACE, payload=Table(x, random.normal(size=12)))
    found = kinks_of([table], -6.0, 6.0)
    assert found == pytest.approx(x, abs=1e-8)  # it has a value a little beyond its ends too
    assert found[1:-1] == pytest.approx(x[1:-1], abs=1e-13)
    assert kinks_of([call("table", PLACE, payload=Table(x, x**2, smooth=True))], -6.0, 6.0) == []
    assert kinks_of([of("abs", sub(PLACE, const(0.625)))], 0.0, 3.0) == [0.625]
    with pytest.raises(TooManyPieces):
        kinks_of([of("floor", mul(const(1000.0), PLACE))], 0.0, 10.0)


def test_between_two_kinks_a_function_is_its_own_smooth_piece_and_goes_on_as_that():
    u = PLACE
    table = Table(np.array([0.0, 1.0, 2.0, 4.0]), np.array([1.0, 3.0, 0.0, 8.0]))
    cases = [  # function, a place, how it goes on from there
        (of("abs", sub(u, const(1.0))), 0.2, lambda x: 1.0 - x),
        (of("abs", sub(u, const(1.0))), 1.7, lambda x: x - 1.0),
        (of("min", u, mul(u, u)), 0.5, lambda x: x * x),
        (of("min", u, mul(u, u)), 1.5, lambda x: x),
        (of("max", u, mul(u, u)), 0.5, lambda x: x),
        (of("max", u, mul(u, u)), 1.5, lambda x: x * x),
        (of("floor", mul(const(3.0), u)), 0.5, lambda x: 1.0 + 0.0 * x),
        (of("mod", u, const(0.7)), 1.5, lambda x: x - 1.4),
        (of("le", u, const(1.0), neg(u), mul(u, u)), 0.5, lambda x: -x),
        (of("le", u, const(1.0), neg(u), mul(u, u)), 1.5, lambda x: x * x),
        (of("ease", u), 0.4, lambda x: x * x * (3.0 - 2.0 * x)),
        (of("ease", sub(u, const(2.0))), 0.4, lambda x: 0.0 * x),
        (of("ease", u), 1.4, lambda x: 1.0 + 0.0 * x),
        (call("table", u, payload=table), 1.5, lambda x: 3.0 - 3.0 * (x - 1.0)),
        (call("table", u, payload=table), 3.0, lambda x: 4.0 * (x - 2.0)),
    ]
    places = np.linspace(-3.0, 5.0, 33)
    for root, place, truth in cases:
        piece = at_piece(add(root, const(2.0)), place)
        assert numeric([piece])(places)[0] == pytest.approx(truth(places) + 2.0, abs=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1e6])
def test_cusps_are_those_of_cycloids_and_hypocycloids(scale):
    size = const(scale)
    turn = mul(const(np.pi / 180.0), PLACE)
    cycloid = mul(size, sub(turn, of("sind", PLACE))), mul(size, sub(const(1.0), of("cosd", PLACE)))
    assert cusps_of(cycloid, -100.0, 1000.0) == pytest.approx([0.0, 360.0, 720.0], abs=1e-6)
    # one that only slows down, on a slope
    x, y = sub(turn, mul(const(0.95), of("sind", PLACE))), mul(const(0.95), of("cosd", PLACE))
    assert cusps_of((mul(size, add(x, y)), mul(size, sub(x, y))), -100.0, 1000.0) == []
    for n in (3, 5):
        m = float(n - 1)
        x = mul(size, add(mul(const(m), of("cosd", PLACE)), of("cosd", mul(const(m), PLACE))))
        y = mul(size, sub(mul(const(m), of("sind", PLACE)), of("sind", mul(const(m), PLACE))))
        found = cusps_of((x, y), -5.0, 355.0)
        assert found == pytest.approx([360.0 * k / n for k in range(n)], abs=1e-6)
        assert cusps_of((x, y), 0.0, 350.0) == pytest.approx([360.0 * k / n for k in range(1, n)], abs=1e-6)


# --- where a moving outline goes along itself


@pytest.mark.parametrize("scale", SCALES)
def test_an_ellipse_goes_along_itself_where_a_polynomial_says(scale):
    """n·v = 0 on (a cos u, b sin u): of e^(iu) a polynomial of degree 4."""
    random = np.random.default_rng(8)
    a, b = 2.0 * scale, 0.7 * scale
    tool = ellipse(a, b)
    count = 30
    inward = random.normal(size=(3, count)) * np.array([[scale], [scale], [1.0]])
    inward[2, :5] = 0.0
    moves = np.ones(count, dtype=bool)
    moves[7] = False
    number, place, rising = tangential_places(tool, inward, moves)
    for k in range(count):
        vx, vy, w = inward[:, k]
        # tx (vy + w x) - ty (vx - w y): -a vy sin u - b vx cos u + w (b² - a²) sin u cos u
        p = np.array(
            [
                w * (b * b - a * a) / 4j,
                -a * vy / 2j - b * vx / 2.0,
                0.0,
                a * vy / 2j - b * vx / 2.0,
                -w * (b * b - a * a) / 4j,
            ]
        )
        z = np.roots(p / scale**2)
        truth = np.sort(np.degrees(np.angle(z[np.abs(np.abs(z) - 1.0) < 1e-6])) % 360.0) if moves[k] else []
        assert place[number == k] % 360.0 == pytest.approx(truth, abs=1e-7)
        here = place[number == k]
        beyond = inward_speed(tool, here + 1e-3, np.repeat(inward[:, k : k + 1], len(here), axis=1))[0]
        assert rising[number == k].tolist() == (beyond > 0.0).tolist()
    places = random.uniform(0.0, 360.0, count)
    value, change = inward_speed(tool, places, inward)
    u = np.radians(places)
    x, y, tx, ty = a * np.cos(u), b * np.sin(u), -a * np.sin(u), b * np.cos(u)
    rad = np.pi / 180.0  # the parameter is in degrees
    assert value == pytest.approx(
        rad * (tx * (inward[1] + inward[2] * x) - ty * (inward[0] - inward[2] * y)), rel=1e-9, abs=1e-12 * scale**2
    )
    step = 1e-4
    slopes = (inward_speed(tool, places + step, inward)[0] - inward_speed(tool, places - step, inward)[0]) / (
        2.0 * step
    )
    assert change == pytest.approx(slopes, rel=1e-5, abs=1e-7 * scale**2)


def test_a_circle_goes_along_itself_on_both_sides_of_its_way_and_places_go_outwards_ahead():
    tool = circle_outline(3.0)
    way = np.radians(np.array([0.0, 33.0, 100.0, 200.0, 350.0]))
    inward = np.stack([5.0 * np.cos(way), 5.0 * np.sin(way), 0.0 * way])
    moves = np.array([True, True, False, True, True])
    number, place, rising = tangential_places(tool, inward, moves)
    assert number.tolist() == [0, 0, 1, 1, 3, 3, 4, 4]
    for k in (0, 1, 3, 4):
        own = number == k
        truth = sorted((np.degrees(way[k]) + np.array([90.0, -90.0])) % 360.0)
        assert place[own] == pytest.approx(truth, abs=1e-9)
        # before the place on its left it goes outwards, and inwards behind it
        left = (np.degrees(way[k]) + 90.0) % 360.0
        assert rising[own].tolist() == [bool(abs(each - left) < 1e-6) for each in place[own]]
    turned = np.radians(25.0)
    pose = np.array([7.0, -2.0, np.cos(turned), np.sin(turned), 1.5, 0.5, 0.8])
    places = np.linspace(0.0, 350.0, 15)
    for shape, normal in (
        (tool, np.radians(places)),
        (ellipse(4.0, 2.0), np.arctan2(4.0 * np.sin(np.radians(places)), 2.0 * np.cos(np.radians(places)))),
    ):
        px, py = shape.points(places).T
        qx, qy = np.cos(turned) * px - np.sin(turned) * py, np.sin(turned) * px + np.cos(turned) * py
        nx, ny = np.cos(normal + turned), np.sin(normal + turned)
        assert outward_speed(shape, places, pose) == pytest.approx(
            (1.5 - 0.8 * qy) * nx + (0.5 + 0.8 * qx) * ny, abs=1e-12
        )
