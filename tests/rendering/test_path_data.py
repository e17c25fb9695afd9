"""SVG's path data and transformations: against closed forms of curves and arcs, and products of matrices."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from movimentum.rendering.affines import transform_of
from movimentum.rendering.path_data import PathFault, numbers_of, path_pieces
from movimentum.rendering.svg_paths import path_of


def sampled(text, most_turn=math.pi / 16.0):
    """Points along a path, and where its subpaths begin."""
    points, here, start, begins = [], 0j, 0j, []
    for piece in path_pieces(text, most_turn):
        if piece.command == "M":
            here = start = piece.points[0]
            begins.append(here)
            points.append(here)
        elif piece.command == "C":
            a, b, c = piece.points
            t = np.linspace(0.0, 1.0, 9)[1:]
            points += list((1 - t) ** 3 * here + 3 * t * (1 - t) ** 2 * a + 3 * t**2 * (1 - t) * b + t**3 * c)
            here = c
        else:
            here = start if piece.command == "Z" else piece.points[0]
            points.append(here)
    return np.array(points), begins


def test_lines_absolute_and_relative_are_the_same_path():
    one = [(p.command, p.points) for p in path_pieces("M1,2L4 6H10V-3L0,0Z m5 5 l1 1")]
    assert one == [
        ("M", (1 + 2j,)), ("L", (4 + 6j,)), ("L", (10 + 6j,)), ("L", (10 - 3j,)), ("L", (0j,)), ("Z", ()),
        ("M", (6 + 7j,)), ("L", (7 + 8j,)),
    ]  # fmt: skip
    for other in ("m1 2 3 4h6v-9l-10 3z m5 5l1 1", "M 1 2 4 6 H 10 V -3 L 0 0 Z m 5,5 1,1"):
        assert [(p.command, p.points) for p in path_pieces(other)] == one
    # after a path is closed, the next line begins where that did
    assert [p.points for p in path_pieces("M1 1L5 1Z L2 2")][-2:] == [(1 + 1j,), (2 + 2j,)]


def test_curves_are_beziers_and_smooth_ones_mirror_the_handle():
    (_, first, second) = path_pieces("M0 0C1 2 3 4 5 6S8 9 10 10")
    assert first.points == (1 + 2j, 3 + 4j, 5 + 6j)
    assert second.points == (7 + 8j, 8 + 9j, 10 + 10j)
    (_, alone) = path_pieces("M1 1s2 2 3 3")
    assert alone.points == (1 + 1j, 3 + 3j, 4 + 4j)
    # a quadratic curve is the cubic one with the same points
    t = np.linspace(0.0, 1.0, 9)
    truth = (1 - t) ** 2 * 0 + 2 * t * (1 - t) * (2 + 4j) + t**2 * (6 + 0j)
    points, _ = sampled("M0 0Q2 4 6 0T14 2")
    assert points[:9] == pytest.approx(truth, abs=1e-12)
    truth = (1 - t) ** 2 * 6 + 2 * t * (1 - t) * (10 - 4j) + t**2 * (14 + 2j)
    assert points[8:] == pytest.approx(truth, abs=1e-12)
    (_, _, third) = path_pieces("M0 0L6 0T14 2")  # what is no quadratic curve has no handle
    assert third.points[0] == pytest.approx(6 + 0j)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("seed", range(6))
def test_arcs_are_on_their_ellipse_and_turn_as_their_flags_say(seed, scale):
    random = np.random.default_rng(seed)
    rx, ry, turn = scale * random.uniform(5.0, 20.0), scale * random.uniform(5.0, 20.0), random.uniform(-180, 180)
    a, b = random.uniform(0.0, 2.0 * np.pi, 2)
    middle = scale * complex(*random.normal(size=2) * 10.0)
    way = np.exp(1j * math.radians(turn))

    def at(u):
        return middle + way * (rx * np.cos(u) + 1j * ry * np.sin(u))

    for sweep in (0, 1):
        by = (b - a) % (2.0 * np.pi) if sweep else -((a - b) % (2.0 * np.pi))
        large = int(abs(by) > np.pi)
        p, q = at(a), at(b)
        rest = f"{rx:.17g} {ry:.17g} {turn:.17g} {large}{sweep}{q.real:.17g},{q.imag:.17g}"
        text = f"M{p.real:.17g} {p.imag:.17g}A{rest}"
        points, _ = sampled(text)
        local = (points - middle) / way
        assert (local.real / rx) ** 2 + (local.imag / ry) ** 2 == pytest.approx(np.ones(len(points)), abs=1e-7)
        angle = np.unwrap(np.arctan2(local.imag / ry, local.real / rx))
        assert angle[-1] - angle[0] == pytest.approx(by, abs=1e-5)
        assert points[-1] == pytest.approx(q, abs=1e-9 * scale)
        step = np.diff(angle)
        assert (step * np.sign(by) > 0.0).all()
        # pieces turn no farther than is asked for, and there are no more than needed
        count = sum(piece.command == "C" for piece in path_pieces(text, math.pi / 2.0))
        assert count == math.ceil(abs(by) / (math.pi / 2.0) - 1e-9)


def test_arcs_without_radius_without_way_or_too_short():
    assert [p.command for p in path_pieces("M0 0A0 5 0 0 1 3 4A5 5 0 0 1 3 4")] == ["M", "L"]
    points, _ = sampled("M-10 0A4 2 0 0 1 10 0")  # it grows until it just reaches: half an ellipse about the middle
    assert (points.real / 10.0) ** 2 + (points.imag / 5.0) ** 2 == pytest.approx(np.ones(len(points)), abs=1e-7)
    assert points.imag.min() == pytest.approx(-5.0, abs=1e-6)
    points, _ = sampled("M-10 0A-4-2 0 0 0 10 0")  # radii have no sign
    assert points.imag.max() == pytest.approx(5.0, abs=1e-6)


WRONG = "L1 2;M1;M1 2 3;M1 2L3 x;M0 0A1 1 0 2 1 3 4;M0 0Z1 2;M0 0C1 1 2 2;M1e999 0;5 5"


@pytest.mark.parametrize("text", WRONG.split(";"))
def test_what_is_no_path_is_a_fault(text):
    with pytest.raises(PathFault):
        list(path_pieces(text))


def test_numbers_in_all_spellings():
    assert numbers_of(" 1,2 -3-4.5.5e1, +.25 ") == [1.0, 2.0, -3.0, -4.5, 5.0, 0.25]
    for text in ("1 two", "1,,2", "1e999"):
        with pytest.raises(PathFault):
            numbers_of(text)


# --- transformations


def matrix(affine):
    return np.array([[affine.a, affine.b, affine.c], [affine.d, affine.e, affine.f], [0.0, 0.0, 1.0]])


def test_transformations_are_products_of_matrices():
    a = math.radians(30.0)
    c, s = math.cos(a), math.sin(a)
    turn, move = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([[1, 0, 7], [0, 1, -2], [0, 0, 1]])
    back = np.array([[1, 0, -7], [0, 1, 2], [0, 0, 1]])
    skew = np.array([[1, math.tan(math.radians(20)), 0], [0, 1, 0], [0, 0, 1]])
    cases = {
        "": np.eye(3),
        "translate(7 -2)": move,
        "translate(7)": np.array([[1, 0, 7], [0, 1, 0], [0, 0, 1]]),
        "scale(2)": np.diag([2, 2, 1]),
        "scale(2,-3)": np.diag([2, -3, 1]),
        "rotate(30)": turn,
        "rotate(30, 7, -2)": move @ turn @ back,
        "skewX(20)": skew,
        "skewY(20)": skew.T,
        "matrix(1 2 3 4 5 6)": np.array([[1, 3, 5], [2, 4, 6], [0, 0, 1]]),
        "translate(7,-2) rotate(30), scale(2 -3)skewX(20)": move @ turn @ np.diag([2, -3, 1]) @ skew,
    }
    for text, truth in cases.items():
        found = transform_of(text)
        assert found is not None
        assert matrix(found) == pytest.approx(truth, abs=1e-12), text
    for text in ("turn(3)", "rotate(1,2)", "scale(a)", "translate(1,2) x", "x translate(1,2)", "matrix(1,2,3)"):
        assert transform_of(text) is None, text


# --- elements


DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" width="200" height="100" viewBox="0 0 100 50">
<g transform="translate(10,5)"><circle id="c" cx="20" cy="15" r="10"/><ellipse id="e" cx="5" cy="6" rx="4" ry="2"/>
<rect id="r" x="1" y="2" width="10" height="5"/><line id="l" x1="0" y1="0" x2="3" y2="4"/>
<polyline id="o" points="0,0 5 0,5,5"/><polygon id="p" points="0,0 5 0,5,5"/>
<path id="d" d="M0 0L10 0A5 5 0 0 1 10 10Z M50 50L60 60"/><path id="q" d="M0 0L10 0L10 10 M9 9"/>
<path id="b" d="M0 0L10 0L0 0"/><path id="w" d="L1 1"/><text id="t">no</text></g></svg>"""


def test_elements_are_paths_in_pixels_of_the_drawing(tmp_path):
    file = tmp_path / "drawing.svg"
    file.write_text(DRAWING)

    def of(name):
        found = path_of(str(file), name)
        assert isinstance(found, tuple), found
        pieces, closed, height = found
        assert height == 100.0
        for piece, following in pairwise(pieces):
            assert piece[3] == pytest.approx(following[0])
        t = np.linspace(0.0, 1.0, 9)[:, None]
        weights = np.array([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
        curve = [np.sum(weights * np.array(piece)[:, None], axis=0) for piece in pieces]
        return np.concatenate(curve), closed, pieces

    # twice as many pixels as units, moved by 10 and 5 units
    points, closed, _ = of("c")
    assert closed
    assert np.hypot(*(points - (60.0, 40.0)).T) == pytest.approx(np.full(len(points), 20.0), abs=1e-7)
    points, closed, _ = of("e")
    assert ((points - (30.0, 22.0)) / (8.0, 4.0)) ** 2 @ np.ones(2) == pytest.approx(np.ones(len(points)), abs=1e-7)
    for name, corners, closes in (
        ("r", [(1, 2), (11, 2), (11, 7), (1, 7), (1, 2)], True),
        ("l", [(0, 0), (3, 4)], False),
        ("o", [(0, 0), (5, 0), (5, 5)], False),
        ("p", [(0, 0), (5, 0), (5, 5), (0, 0)], True),
    ):
        _, closed, pieces = of(name)
        truth = 2.0 * (np.array(corners) + np.array([10, 5]))
        assert closed == closes
        assert np.array([pieces[0][0], *(piece[3] for piece in pieces)]) == pytest.approx(truth)
        for piece in pieces:  # straight, at a steady pace
            step = (np.array(piece[3]) - piece[0]) / 3.0
            assert np.diff(np.array(piece), axis=0) == pytest.approx(np.tile(step, (3, 1)))
    points, closed, pieces = of("d")
    assert closed
    assert pieces[-1][3] == pytest.approx((20.0, 10.0))
    assert points[:, 0].max() == pytest.approx(2.0 * (10 + 10 + 5), abs=1e-6)  # half a circle bulges by its radius
    _, closed, pieces = of("q")  # its first subpath
    assert not closed
    assert [piece[3] for piece in pieces] == [(40.0, 10.0), (40.0, 30.0)]
    assert of("b")[1]  # it comes back to where it began
    assert not isinstance(path_of(str(file), "w"), tuple)
    assert not isinstance(path_of(str(file), "t"), tuple)
    assert not isinstance(path_of(str(file), "none"), tuple)
