"""Random laws of lift, made of dwells, rises and falls, at any scale, place, sense of turn and rate of frames: law,
cut, touch, law again; the profile's position, pressure angle and curvature against closed forms.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import movimentum as mv
from tests.broad import broad

Floats = np.ndarray
Shape = tuple[str, Callable[[Floats], tuple[Floats, Floats, Floats]]]


def cycloidal(v: Floats) -> tuple[Floats, Floats, Floats]:
    p = 2.0 * np.pi
    return v - np.sin(p * v) / p, 1.0 - np.cos(p * v), p * np.sin(p * v)


def polynomial(v: Floats) -> tuple[Floats, Floats, Floats]:
    return 10 * v**3 - 15 * v**4 + 6 * v**5, 30 * v**2 - 60 * v**3 + 30 * v**4, 60 * v - 180 * v**2 + 120 * v**3


def modified_sine(v: Floats) -> tuple[Floats, Floats, Floats]:
    p, c = np.pi, 1.0 / (4.0 + np.pi)
    middle = (v >= 0.125) & (v < 0.875)
    a, b = 4.0 * p * v, np.pi / 3.0 + 4.0 * p * v / 3.0
    end = np.where(v >= 0.875, 4.0, 0.0)
    return (
        np.where(middle, c * (2.0 + p * v - 9.0 / 4.0 * np.sin(b)), c * (end + p * v - np.sin(a) / 4.0)),
        np.where(middle, c * (p - 3.0 * p * np.cos(b)), c * (p - p * np.cos(a))),
        np.where(middle, c * 4.0 * p * p * np.sin(b), c * 4.0 * p * p * np.sin(a)),
    )


def harmonic(v: Floats) -> tuple[Floats, Floats, Floats]:
    """It jumps in its acceleration where a dwell begins."""
    p = np.pi
    return (1.0 - np.cos(p * v)) / 2.0, p * np.sin(p * v) / 2.0, p * p * np.cos(p * v) / 2.0


SHAPES: dict[str, Shape] = {
    "harmonic": ("(1 - .cos(180*(V)))/2", harmonic),
    "cycloidal": ("V - .sin(360*(V))/(2*.pi)", cycloidal),
    "3-4-5": ("10*(V)^3 - 15*(V)^4 + 6*(V)^5", polynomial),
    "modified sine": (
        (
            "{ V < 1/8 : (.pi*(V) - .sin(720*(V))/4)/(4 + .pi);"
            " V < 7/8 : (2 + .pi*(V) - 9/4*.sin(60 + 240*(V)))/(4 + .pi); (4 + .pi*(V) - .sin(720*(V))/4)/(4 + .pi) }"
        ),
        modified_sine,
    ),
}


class Law:
    """A lift over a whole turn: (ends, heights) and the shapes of what is not a dwell; ``text`` in terms of `u`."""

    def __init__(self, seed: int, scale: float) -> None:
        random = np.random.default_rng(seed)
        count = int(random.integers(1, 3))
        ends, self.heights, self.shapes = [0.0], [0.0], list[str]()
        for _ in range(count):  # up, a dwell, down, a dwell
            lift = float(random.uniform(0.2, 0.5)) * scale
            for height, shape in ((lift, True), (lift, False), (0.0, True), (0.0, False)):
                ends.append(ends[-1] + float(random.uniform(0.7, 1.3)))
                self.heights.append(height)
                self.shapes.append(str(random.choice(list(SHAPES))) if shape else "dwell")
        self.ends = [round(end / ends[-1], 6) for end in ends]
        pieces: list[str] = []
        spans = itertools.pairwise(self.ends)
        for (a, b), (low, high), shape in zip(spans, itertools.pairwise(self.heights), self.shapes, strict=True):
            value = f"{high!r}"
            if shape != "dwell":
                part = SHAPES[shape][0].replace("V", f"(u - {a!r})/({b - a!r})")
                value = (
                    f"{low!r} + ({high - low!r})*({part})" if "{" not in part else f"{low!r} + ({high - low!r})*{part}"
                )
            pieces.append(f"u < {b!r} : {value};" if b < 1.0 else value)
        self.text = "{ " + " ".join(pieces) + " }"

    def __call__(self, u: Floats) -> tuple[Floats, Floats, Floats]:
        """The lift and its first two derivatives by the turn in radians."""
        lift, rise, bend = np.zeros_like(u), np.zeros_like(u), np.zeros_like(u)
        spans = itertools.pairwise(self.ends)
        for (a, b), (low, high), shape in zip(spans, itertools.pairwise(self.heights), self.shapes, strict=True):
            some = (u >= a) & (u < b) if b < 1.0 else u >= a
            if shape == "dwell":
                lift[some] = high
                continue
            wide = 2.0 * np.pi * (b - a)
            s, ds, dds = SHAPES[shape][1]((u[some] - a) / (b - a))
            lift[some] = low + (high - low) * s
            rise[some], bend[some] = (high - low) * ds / wide, (high - low) * dds / wide**2
        return lift, rise, bend


def scene(seed: int, *, fps: int = 90) -> tuple[str, Law, dict[str, float]]:
    """A roller on a random law, and another one of the same radius that is only held to what it has cut."""
    random = np.random.default_rng(1000 + seed)
    scale = float([1.0, 0.01, 30.0, 1000.0][seed % 4]) * 40.0
    x, y = (round(float(v), 3) for v in random.uniform(-3.0, 3.0, 2) * scale)
    way = -1 if seed % 3 == 2 else 1
    base, radius, offset = 1.9 * scale, 0.3 * scale, round(float(random.uniform(-0.2, 0.2)), 3) * scale
    law = Law(seed, scale)
    text = f"""
.config({fps}, 300, 300);
Shaft  : .disc({0.2 * scale!r}) C = [{x!r},{y!r}];
Roller : .disc({radius!r}) C = [{x + offset!r},{y + base!r}];
Other  : .disc({radius!r}) C = [{x + offset!r},{y + 1.7 * base!r}];
Cam    : .cut Roller .in Shaft;
@0  Shaft.C = [{x!r},{y!r}];   u = .mod(.t/4, 1);   Shaft.angle = {way * 90}*.t;
    Roller.C = [{x + offset!r}, {y + base!r} + {law.text}];   Roller.angle = 0;
    Other.C.x = {x + offset!r};   Other.angle = 0;   Other.C.y > {y!r};   .gap(Other, Cam) = 0;
@4
"""
    return text, law, {"scale": scale, "base": base, "radius": radius, "offset": offset, "way": way}


@broad("seed", range(24), first=2)
def test_a_law_comes_back_through_its_profile(seed: int) -> None:
    text, law, size = scene(seed)
    motion = mv.loads(text).solve()
    u = np.mod(np.asarray(motion.times, dtype=float) / 4.0, 1.0)
    assert len(u) == 361
    lift, rise, bend = law(u)
    off = motion["Other.C"] - motion["Roller.C"]
    assert np.abs(off).max() < 1e-8 * size["scale"]
    assert motion["Roller.C"][:, 1] - motion["Shaft.C"][:, 1] == pytest.approx(
        size["base"] + lift, abs=1e-9 * size["scale"]
    )
    # the centre's path seen from the shaft, turned on with it
    way = size["way"]
    z = size["offset"] + 1j * (size["base"] + lift)
    first = way * 1j * rise - 1j * z
    second = 1j * bend + way * rise - 1j * first if way > 0 else 1j * bend - rise - 1j * first
    curvature = np.imag(np.conj(first) * second) / np.abs(first) ** 3
    of_cam = 1.0 / (1.0 / -curvature - size["radius"])
    told = motion[".curvature(Cam, .where(Roller.C, Cam))"]
    inner = np.min(np.abs(u[:, None] - np.array(law.ends)[None]), axis=1) > 2e-3  # bends may jump in their slope there
    assert np.abs(np.abs(told) - np.abs(of_cam))[inner].max() < 1e-7 * np.abs(of_cam).max()
    pressure = motion[".a(.tangent(Cam, .where(Roller.C, Cam)), [1,0])"]
    turned = np.exp(1j * np.radians(pressure)) * -first / np.abs(first)
    assert np.abs(np.angle(turned**2)).max() / 2.0 < 1e-8


@broad("seed", range(24), first=2)
@broad("follower", ["roller", "face"], first=2)
def test_a_measured_law_comes_back(follower: str, seed: int, tmp_path: Path) -> None:
    """A smooth table of its heights; SciPy says what is between the rows. Frames lie between the places of the cut."""
    random = np.random.default_rng(2000 + seed)
    scale, way, rows = 40.0 * float([1.0, 0.01, 30.0, 1000.0][seed % 4]), -1 if seed % 3 == 2 else 1, seed % 8 + 6
    angles = np.arange(rows + 1) * 360.0 / rows
    angles[1:-1] = np.round(angles[1:-1] + random.uniform(-72.0, 72.0, rows - 1) / rows, 4)
    waves = np.cos(np.radians(angles[:, None] * [1.0, 2.0] + random.uniform(0.0, 360.0, 2)))
    heights = np.round(scale * waves @ random.uniform(0.05, 0.15, 2), 6)
    heights[-1] = heights[0]
    table = "".join(f"{a!r},{h!r}\n" for a, h in zip(angles.tolist(), heights.tolist(), strict=True))
    (tmp_path / "lift.csv").write_text("angle,lift\n" + table)
    base, wide = 1.9 * scale, 3.0 * scale
    x = 0.0 if follower == "roller" else -wide
    kind, end = (f".disc({0.25 * scale!r})", "") if follower == "roller" else (".bar", f" D = C + [{2.0 * wide!r},0]")
    (tmp_path / "cam.mov").write_text(f"""
.config(77, 300, 300);
Shaft : .disc({0.2 * scale!r}) C = [0,0];
Tool  : {kind} C = [{x!r},{base!r}]{end};   Other : {kind} C = [{x!r},{1.7 * base!r}]{end};
Cam   : .cut Tool .in Shaft;
@0  Shaft.C = [0,0];   Shaft.angle = {way * 90}*.t;   Tool.angle = 0;
    Tool.C = [{x!r}, {base!r} + .table('lift.csv', 'lift', 90*.t).smooth.periodic];
    Other.C.x = {x!r};   Other.angle = 0;   Other.C.y > 0;   .gap(Other, Cam) = 0;
@4
""")
    motion = mv.load(tmp_path / "cam.mov").solve()
    turned = np.mod(90.0 * np.asarray(motion.times, dtype=float), 360.0)
    lift = CubicSpline(angles, heights, bc_type="periodic")(turned)
    assert np.abs(motion["Other.C"][:, 1] - base - lift).max() < 1e-9 * scale


@broad("fps", [7, 25, 60], first=1)
def test_frames_have_no_part_in_it(fps: int) -> None:
    text, law, size = scene(4, fps=fps)
    motion = mv.loads(text).solve()
    lift, _, _ = law(np.mod(np.asarray(motion.times, dtype=float) / 4.0, 1.0))
    off = motion["Other.C"][:, 1] - motion["Shaft.C"][:, 1] - size["base"] - lift
    assert np.abs(off).max() < 1e-8 * size["scale"]


def test_the_closed_forms_are_derivatives() -> None:
    """What the truth rests on."""
    v = np.linspace(0.01, 0.99, 300)
    step = 1e-6
    for _, shape in SHAPES.values():
        s, ds, dds = shape(v)
        before, after = shape(v - step), shape(v + step)
        assert (after[0] - before[0]) / (2 * step) == pytest.approx(ds, abs=1e-8)
        assert (after[1] - before[1]) / (2 * step) == pytest.approx(dds, abs=1e-3)
        assert math.isclose(float(shape(np.array([1.0]))[0][0]), 1.0, abs_tol=1e-12)
        assert s.min() >= 0.0
