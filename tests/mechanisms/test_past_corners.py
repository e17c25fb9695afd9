"""Followers of every sort on outlines with corners, from which shapely measures the distance; pins past corners and
cusps."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum
from tests.broad import broad

shapely = pytest.importorskip("shapely")
from shapely import affinity  # noqa: E402

HEAD = ".config({fps}, 400, 400);\n"


def solved(text, fps=10):
    return movimentum.loads(HEAD.format(fps=fps) + text).solve()


def convex(random):
    """The corners of a random convex polygon about the origin, counter-clockwise."""
    while True:
        n = int(random.integers(3, 9))
        angles = np.sort(random.uniform(0.0, 2.0 * np.pi / n, n) + 2.0 * np.pi / n * np.arange(n))
        far = random.uniform(35.0, 70.0, n)
        hull = shapely.MultiPoint(np.stack([far * np.cos(angles), far * np.sin(angles)], axis=1)).convex_hull
        found = np.round(np.array(shapely.geometry.polygon.orient(hull).exterior.coords)[:-1], 3)
        polygon = shapely.Polygon(found)
        if polygon.contains(shapely.Point(0, 0)) and polygon.exterior.distance(shapely.Point(0, 0)) > 15.0:
            return found


def cam_of(random):
    """A cam about [200,150] as text, as a shape about the origin, and how exact that is."""
    kind = int(random.integers(4))
    if kind < 2:
        corners = convex(random)
        names = [f"K{k}" for k in range(len(corners))]
        anchors = " ".join(f"{name} = [{200 + x},{150 + y}]" for name, (x, y) in zip(names, corners, strict=True))
        shape = shapely.Polygon(corners)
        if kind == 0:
            return f"Cam : .polygon C = [200,150] {anchors} .through({', '.join(names)});", shape, 1e-9
        width = round(float(random.uniform(2.0, 12.0)), 2)
        text = f"Cam : .plate C = [200,150] {anchors} .width({width});"
        return text, shape.buffer(width / 2.0, quad_segs=500), 4e-5
    if kind == 2:  # a Reuleaux triangle
        width = float(random.uniform(60.0, 110.0))
        out = width / math.sqrt(3.0)
        turned = "(.mod(th, 120) - 60)"
        radius = f".sqrt({width}^2 - ({out}*.sin{turned})^2) - {out}*.cos{turned}"
        angles = np.radians(np.linspace(0.0, 360.0, 12001)[:-1])
        inner = np.mod(angles, 2.0 * np.pi / 3.0) - np.pi / 3.0
        far = np.sqrt(width**2 - (out * np.sin(inner)) ** 2) - out * np.cos(inner)
        points = np.stack([far * np.cos(angles), far * np.sin(angles)], axis=1)
        return f"Cam : .curve C = [200,150] .polar(th, {radius});", shapely.Polygon(points), 2e-5
    a, b = random.uniform(30.0, 60.0), random.uniform(25.0, 60.0)  # an ellipse that is cut off
    at = math.degrees(math.asin(15.0 / b))
    angles = np.radians(np.sort([*np.linspace(0.0, 360.0, 12001)[:-1], 180.0 + at, 360.0 - at]))
    points = np.stack([a * np.cos(angles), np.maximum(-15.0, b * np.sin(angles))], axis=1)
    text = f"Cam : .curve C = [200,150] .param(u, [{a}*.cos(u), .max(-15, {b}*.sin(u))]);"
    return text, shapely.Polygon(points), 2e-5


def follower_of(random):
    """A follower as text, its statements, its name, its radius, and what of it has that distance from the cam."""
    kind, radius = int(random.integers(4)), round(float(random.uniform(3.0, 15.0)), 2)
    if kind == 0:
        x = 200.0 + round(float(random.uniform(-8.0, 8.0)), 1)
        text = f"R : .disc({radius}) C = [{x},{round(float(random.uniform(200.0, 260.0)), 1)}];"
        said = [f"R.C.x = {x};", "R.C.y > 150;"]
    elif kind == 1:
        text = f"Arm : .bar O = [330,200] P = [200,240];   R : .disc({radius}) C = [200,240];"
        said = ["Arm.O = [330,200];", "R.C = Arm.P;", "R.C.y > 150;", "R.angle = 0;"]
    elif kind == 2:  # a flat face
        text = "F : .bar A = [50,260] B = [350,260];"
        said = ["F.A.x = 50;", "F.angle = 0;", "F.A.y > 150;"]
    else:  # along a slanted line
        x, y = math.cos(math.radians(120.0)), math.sin(math.radians(120.0))
        text = f"R : .disc({radius}) C = [{200 + 100 * x},{150 + 100 * y}];"
        said = [f"R.C = [200 + {x}*s, 150 + {y}*s];", "s > 0;"]
    if kind == 2:
        return text, said, "F", 0.0, lambda motion, k: shapely.LineString([motion["F.A"][k], motion["F.B"][k]])
    return text, said, "R", radius, lambda motion, k: shapely.Point(*motion["R.C"][k])


@broad("seed", range(80), first=2)
def test_followers_stay_on_cams_with_corners(seed):
    random = np.random.default_rng(seed)
    cam, shape, exact = cam_of(random)
    text, said, name, radius, seen = follower_of(random)
    speed, end = [60, -45, 90][seed % 3], round(float(random.uniform(4.0, 9.0)), 1)
    touch = [f".gap({name}, Cam) = 0;", f".gap(Cam, {name}) = 0;", f"0 = .gap({name}, Cam);"][seed % 3]
    statements = ["Cam.C = [200,150];", f"Cam.angle = {speed}*.t;", touch, *said]
    random.shuffle(statements)
    motion = solved(f"{cam}\n{text}\n@0 {' '.join(statements)}\n@{end}", fps=[7, 10][seed % 2])
    inside = shape.buffer(-1e-4)

    def placed_at(k, what):
        return affinity.translate(affinity.rotate(what, motion["Cam.angle"][k], origin=(0, 0)), 200, 150)

    for k in range(len(motion.times)):
        follower = seen(motion, k)
        assert placed_at(k, shape).distance(follower) == pytest.approx(radius, abs=exact)
        if not radius:  # a line lies on it, and not in it
            assert placed_at(k, inside).disjoint(follower)


@broad("seed", range(24), first=6)
def test_a_knife_edge_goes_over_the_corners_of_a_heart(seed):
    """r falls and rises evenly with the angle: a corner that points out, and one that points in, anywhere."""
    random = np.random.default_rng(seed)
    low, height = np.round(random.uniform((20.0, 10.0), (40.0, 60.0)), 2).tolist()
    phase = [0.0, 90.0, 180.0, round(float(random.uniform(0.0, 360.0)), 2)][seed % 4]
    speed = [90.0, -60.0, 45.0][seed % 3]
    start = round(float(random.uniform(140.0, 230.0)), 1)
    touch = [".on(P.P, Cam) = 0;", "0 = .on(P.P, Cam);", ".gap(P.P, Cam) = 0;"][int(random.integers(3))]
    statements = ["Cam.C = [150,130];", f"Cam.angle = {speed}*.t;", "P.P.x = 150;", "P.P.y > 131;", touch]
    random.shuffle(statements)
    motion = solved(
        f"""Cam : .curve C = [150,130] .polar(th, {low} + {height}*.abs(.mod(th + {phase}, 360) - 180)/180);
P : .disc(3) P = [150,{start}];
@0 {" ".join(statements)}
@10"""
    )
    turn = np.mod(90.0 - motion["Cam.angle"] + phase, 360.0)
    assert motion["P.P.y"] - 130.0 == pytest.approx(low + height * np.abs(turn - 180.0) / 180.0, abs=1e-9)


@broad("seed", range(24), first=6)
def test_a_pin_is_driven_through_a_cusp(seed):
    """Along y, on x³ ~ y²: its speed is infinite for a moment."""
    random = np.random.default_rng(seed)
    a, b = np.round(random.uniform(10.0, 40.0, 2), 3).tolist()
    start, speed = -round(float(random.uniform(1.0, 0.9 * b)), 3), round(float(random.uniform(5.0, 20.0)), 3)
    curve = [f".param(w, [{a}*w^2, {b}*w^3]) .range(-1, 1)", f".param(u, [{a}*(u/180 - 1)^2, {b}*(u/180 - 1)^3])",
             f".param(w, [{a}*(w - 0.3)^2, {b}*(w - 0.3)^3]) .range(-1, 1.3)"][seed % 3]  # fmt: skip
    way = 1 if seed % 2 else -1
    end = round((abs(start) + 0.9 * b) / speed, 2)
    touch = [".on(P.P, E) = 0;", "0 = .on(P.P, E);"][int(random.integers(2))]
    statements = ["E.C = [200,200];", "E.angle = 0;", touch, f"P.P.y = 200 + {way}*({start} + {speed}*.t);"]
    random.shuffle(statements)
    motion = solved(
        f"""E : .curve C = [200,200] {curve} .open;
P : .disc(4) P = [{200 + a * (abs(start) / b) ** (2 / 3)},{200 + way * start}];
@0 {" ".join(statements)}
@{end}""",
        fps=[7, 10, 25][seed % 3],
    )
    y = way * (start + speed * motion.times)
    assert motion["P.P"] - 200.0 == pytest.approx(np.stack([a * np.cbrt(np.abs(y) / b) ** 2, y], axis=1), abs=1e-8)
