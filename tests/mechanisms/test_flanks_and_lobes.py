"""Involutes, epitrochoids and cams of constant width by their closed forms, at any scale and place."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum
from tests.broad import broad

SCALES = [1.0, 0.001, 30.0, 1000.0]


def solved(text, fps=37):
    """The motion, and the times of its frames; no frame lies on a simple part of a turn."""
    motion = movimentum.loads(f".config({fps}, 400, 400);\n{text}").solve()
    return motion, np.asarray(motion.times, dtype=float)


def told(motion):
    """What is told besides where things are on the canvas."""
    return {item.code for item in motion.diagnostics if not item.code.startswith("canvas/")}


def involute(radius, degrees):
    """Of a base circle, from a direction on, against the sense of its parameter."""
    x = f"{radius!r}*(.cos(u + {degrees!r}) + .pi/180*u*.sin(u + {degrees!r}))"
    y = f"{radius!r}*(.sin(u + {degrees!r}) - .pi/180*u*.cos(u + {degrees!r}))"
    return f".param(u, [{x}, {y}])"


@broad("seed", range(24), first=1)
def test_flanks_that_are_involutes_turn_each_other_evenly_along_one_line(seed):
    """The speeds are as the base circles. Contact is on the line of action, which touches both of these."""
    random = np.random.default_rng(seed)
    scale = SCALES[seed % 4]
    one, other, x, y = (random.uniform((30, 30, -100, -100), (80, 80, 100, 100)) * scale).tolist()
    pressure, line, share = (float(random.uniform(*ends)) for ends in ((0.2, 0.5), (0.0, 360.0), (0.3, 0.4)))
    apart = (one + other) / float(np.cos(pressure))
    action = apart * float(np.sin(pressure))
    # seen from each centre, the involute begins so much before where the line of action touches its circle
    begins = line + np.degrees([pressure - share * action / one, pressure + np.pi - (1.0 - share) * action / other])
    centre = complex(x, y) + apart * complex(np.exp(1j * np.radians(line)))
    drawn = float(random.uniform(0.0, 2.0)) if seed % 2 else 0.0  # apart from the other one
    speed = float(np.degrees(0.4 * action / one))
    motion, t = solved(f"""
One : .curve C = [{x!r},{y!r}] {involute(one, float(begins[0]))} .range(0, {float(np.degrees(action / one))!r}) .open;
Two : .curve C = [{centre.real!r},{centre.imag!r}] {involute(other, float(begins[1]) + drawn)}
      .range(0, {float(np.degrees(action / other))!r}) .open;
@0 One.C = [{x!r},{y!r}]; Two.C = [{centre.real!r},{centre.imag!r}]; One.angle = -{speed!r}*.t; .gap(One, Two) = 0;
@1""")
    assert motion["Two.angle"] == pytest.approx(speed * t * one / other - drawn, abs=1e-9)
    # the place of contact, which is the one at this distance along the line of action
    way = (share + 0.4 * t) * action
    touch = complex(x, y) + (one - 1j * way) * np.exp(1j * (np.radians(line) + pressure))
    for k in (0, len(t) // 2, len(t) - 1):
        for thing in ("One", "Two"):
            off = motion.at(t[k])[f".on([{touch[k].real:.17g},{touch[k].imag:.17g}], {thing})"]
            assert float(off) == pytest.approx(0.0, abs=1e-9 * scale)


def trochoid(lobes, eccentric, radius, turn):
    """The way of a rotor's corner by its turn, and its first two derivatives."""
    parts = [((lobes + 1) ** n * 1j**n * eccentric, 1j**n * radius) for n in range(3)]
    return [a * np.exp(1j * (lobes + 1) * turn) + b * np.exp(1j * turn) for a, b in parts]


@broad("seed", range(24), first=1)
def test_a_pin_on_a_planet_cuts_the_parallel_curve_of_an_epitrochoid(seed):
    random = np.random.default_rng(seed)
    scale, lobes, way = SCALES[seed % 4], int(random.integers(1, 6)), -1 if seed % 3 == 1 else 1
    e = float(random.uniform(5.0, 12.0)) * scale
    radius = float(random.uniform(1.15, 1.6)) * (lobes + 1) ** 2 * e  # no loops, and no hollow too narrow
    pin = float(random.uniform(0.3, 0.9)) * e
    x, y = (random.uniform(-100.0, 100.0, 2) * scale).tolist()
    motion, t = solved(f"""
House : .disc({e!r}) C = [{x!r},{y!r}];   Apex : .disc({pin!r}) C = [{x + e + radius!r},{y!r}];
Hull  : .cut Apex .in House .outer;
@0 House.C = [{x!r},{y!r}]; House.angle = 0; Apex.angle = 0; u = {way * 360}*.t;
   Apex.C = [{x!r},{y!r}] + [{e!r},0].r({lobes + 1}*u) + [{radius!r},0].r(u);
@1""")
    _, first, second = trochoid(lobes, e, radius, way * 2.0 * np.pi * t)
    assert np.abs(motion[".on(Apex.C, Hull)"]) == pytest.approx(pin, abs=1e-9 * scale)
    assert np.abs(motion[".gap(Apex, Hull)"]).max() < 1e-9 * scale
    of_centre = np.imag(np.conj(first) * second) / np.abs(first) ** 3
    bend = np.abs(1.0 / (1.0 / of_centre + pin))
    of_hull = np.abs(motion[".curvature(Hull, .where(Apex.C, Hull))"])
    assert np.abs(of_hull - bend).max() < 1e-8 * bend.max()


@broad("seed", range(24), first=1)
def test_all_corners_of_a_rotor_touch_its_housing(seed):
    """Two of them are held there, the others come along, and its centre goes round."""
    random = np.random.default_rng(100 + seed)
    scale, lobes = SCALES[seed % 4], int(random.integers(2, 6))
    e = float(random.uniform(5.0, 12.0)) * scale
    radius = float(random.uniform(1.15, 3.0)) * (lobes + 1) * e
    x, y, line = *(random.uniform(-100.0, 100.0, 2) * scale).tolist(), float(random.uniform(0.0, 360.0))
    corners = " ".join(f"P{k} = C + [{radius!r},0].r({360.0 * k / (lobes + 1)!r})" for k in range(lobes + 1))
    motion, t = solved(f"""
Hull  : .curve C = [{x!r},{y!r}] .param(w, [{e!r},0].r({lobes + 1}*w) + [{radius!r},0].r(w));
Rotor : .bar C = [{x!r},{y!r}] + [{e!r},0].r({line!r}) {corners};
@0 Hull.C = [{x!r},{y!r}]; Hull.angle = {line!r}; Rotor.angle = {line!r} + {360.0 / (lobes + 1)!r}*.t;
   .on(Rotor.P0, Hull) = 0; .on(Rotor.P1, Hull) = 0;
@1""")
    centre = (motion["Rotor.C"] - [x, y]) @ [1.0, 1.0j]
    assert np.abs(centre - e * np.exp(1j * (np.radians(line) + 2.0 * np.pi * t))).max() < 1e-9 * scale
    for k in range(lobes + 1):
        assert np.abs(motion[f".on(Rotor.P{k}, Hull)"]).max() < 1e-9 * scale


@broad("seed", range(24), first=1)
def test_a_cam_of_constant_width_fills_the_room_between_two_faces(seed):
    """How far its edge is from the axle, by the direction: half the width and odd waves."""
    random = np.random.default_rng(seed)
    scale = SCALES[seed % 4]
    width, waves = 60.0 * scale, np.array([3, 5, 7])
    heights = random.uniform(-1.0, 1.0, 3) * 8.0 * scale / (waves**2 - 1)
    phases, off = random.uniform(0.0, 360.0, 3), random.uniform(-5.0, 5.0, 2) * scale
    each = list(zip(heights.tolist(), waves.tolist(), phases.tolist(), strict=True))
    far = " + ".join([f"{width / 2.0!r}", *(f"({c!r})*.cos({k}*u + {p!r})" for c, k, p in each)])
    rise = " + ".join(f"({-c * k!r})*.sin({k}*u + {p!r})" for c, k, p in each)
    wide = 3.0 * width
    motion, t = solved(f"""
Cam : .curve C = [0,0] .param(u, [{off[0]:.17g},{off[1]:.17g}] + [{far}, {rise}].r(u));
Top : .bar A = [{-wide!r},{width!r}] B = [{wide!r},{width!r}];
Low : .bar A = [{-wide!r},{-width!r}] B = [{wide!r},{-width!r}];
@0 Cam.C = [0,0]; Cam.angle = 360*.t; Top.A.x = {-wide!r}; Top.angle = 0; Top.A.y > 0; .gap(Top, Cam) = 0;
   Low.A.x = {-wide!r}; Low.angle = 0; Low.A.y < 0; .gap(Low, Cam) = 0;
@1""")
    assert motion["Top.A.y"] - motion["Low.A.y"] == pytest.approx(width, abs=1e-9 * scale)
    up = np.pi / 2.0 - 2.0 * np.pi * t
    height = width / 2.0 + np.cos(waves * up[:, None] + np.radians(phases)) @ heights
    height += np.imag(complex(*off) * np.exp(2j * np.pi * t))
    assert motion["Top.A.y"] == pytest.approx(height, abs=1e-9 * scale)
    assert told(motion) <= {"loop/possible"}
