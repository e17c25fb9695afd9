"""What the figures of the gallery say is true, to 1e-9: graphs, poles, polygons, ports, ropes."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import movimentum as mv
from movimentum.analysis.shown_numbers import place_of, pole_of, with_shown_numbers
from movimentum.drawing.compose import compose
from movimentum.drawing.graph_curves import curves_of
from movimentum.drawing.model import GraphMark, SymbolMark
from movimentum.drawing.picture_options import PictureOptions
from movimentum.drawing.symbols import moving_parts
from movimentum.solver.poses import Poses
from tests.command import ROOT
from tests.mechanisms import figure_oracles
from tests.mechanisms.kinematics import Array, point

NEAR = pytest.approx


class Film:
    """A script of the gallery, solved, with the poses of all frames."""

    def __init__(self, name: str) -> None:
        self.motion = mv.load(ROOT / "scripts" / f"{name}.mov").solve().solution.motion.path
        self.scene = self.motion.timeline.scene
        count = self.motion.timeline.frame_count
        self.times: list[Fraction] = [self.motion.timeline.frame_time(frame) for frame in range(count)]
        self.poses: Poses = with_shown_numbers(self.motion, self.motion.poses(0, count))
        self.thing = {thing.name: thing for thing in self.scene.things}

    def at(self, name: str) -> Array:
        thing, _, anchor = name.partition(".")
        found = self.thing[thing]
        return self.poses.world(found.number, next(a.local for a in found.anchors if a.name == anchor))

    def curves(self) -> list[Array]:
        (mark,) = (m for m in compose(self.scene, PictureOptions()).things if isinstance(m, GraphMark))
        return curves_of(mark, self.scene, (self.poses,), self.motion)

    def tips(self) -> Array:
        """(N, F, 2) of the arrows of the polygon of velocities."""
        marks: list[Any] = [m for m in compose(self.scene, PictureOptions()).things
                            if isinstance(m, SymbolMark) and m.kind.word == "velocities"]  # fmt: skip
        return np.stack([moving_parts(mark, self.poses)[-1].points[:, 0] for mark in marks])


def test_the_ports_of_the_two_stroke_open_when_it_says() -> None:
    film = Film("two-stroke")
    edges = [float(film.at(name)[0, 1]) for name in ("Outlet.D", "Duct.D", "Inlet.A")]
    for edge, degrees, way, on in zip(edges, (105, 122, 60), ("L", "L", "SR"), (-1, -1, 1), strict=True):
        for after in (degrees, 360 - degrees):
            times = np.array([after / 180, (after + 1e-3) / 180])
            y = point(figure_oracles.two_stroke(times), f"Piston.{way}")[:, 1]
            assert y[0] == NEAR(edge, abs=1e-9)
            opening = on * (y[1] - y[0]) > 0
            assert opening == ((after < 180) == (on < 0))
    exhaust, transfer, inlet = film.curves()
    for curve, high in ((exhaust, edges[0] - 236), (transfer, edges[1] - 236), (inlet, 18.0)):
        assert curve[:, 1].min() == 0.0
        assert curve[:, 1].max() == NEAR(high, abs=1e-9)
    assert np.ptp(inlet[(inlet[:, 0] > 70) & (inlet[:, 0] < 290), 1]) == 0.0


def test_zeuners_diagram_is_circles_and_its_events_are_where_ports_close() -> None:
    film = Film("zeuner")
    valve, outside, inside = film.curves()
    angle, value = valve[valve[:, 2] > 0, :2].T
    places = value[:, None] * np.stack([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))], axis=1)
    middle = 17 * np.array([math.cos(math.radians(55)), math.sin(math.radians(55))])
    away = np.minimum(np.linalg.norm(places - middle, axis=1), np.linalg.norm(places + middle, axis=1))
    assert away == NEAR(np.full(len(away), 17.0), abs=1e-9)  # two circles through the middle, of diameter e
    assert set(outside[:, 1]) == {17.0}
    assert set(inside[:, 1]) == {5.0}
    # from the left dead centre on: admission and cut-off at the lap outside, release and compression at that inside
    for name, edge in (("LineA", 17), ("LineB", 17), ("LineC", -5), ("LineD", -5)):
        (x, y) = film.scene.local(film.thing[name].through[1])
        crank = math.degrees(math.atan2(y - 176, x - 574))
        assert 34 * math.sin(math.radians(crank - 180 + 35)) == NEAR(edge, abs=1e-9)
    port, face = film.at("LeftIn.D")[0, 0], film.at("Valve.A")[:, 0]
    opened = film.at("LeftIn.E")[0, 0] - face < 0
    assert port > film.at("LeftIn.E")[0, 0]
    assert (opened == (film.at("Valve.M")[:, 0] - 116 > 17)).all()


def test_the_velocity_polygon_is_the_coupler_turned_by_a_quarter() -> None:
    film = Film("velocity-polygon")
    tips = film.tips() - np.array([480.0, 165.0])
    b, c, p = (film.at(name) for name in ("Crank.B", "Coupler.C", "Coupler.P"))
    turn = math.pi / 2
    a, d = np.array([110.0, 90.0]), np.array([290.0, 90.0])
    v = turn * np.stack([-(b - a)[:, 1], (b - a)[:, 0]], axis=1)
    assert tips[0] == NEAR(v, abs=1e-9)
    # the coupler's angular velocity, of the rule that C goes at right angles to DC
    u = c - b
    spin = -((v * (c - d)).sum(axis=1)) / (u[:, 0] * (c - d)[:, 1] - u[:, 1] * (c - d)[:, 0])
    for tip, place in ((tips[1], c), (tips[2], p)):
        arm = place - b
        assert tip - tips[0] == NEAR(spin[:, None] * np.stack([-arm[:, 1], arm[:, 0]], axis=1), abs=1e-8)


def test_the_pole_of_the_rear_wheel_is_on_both_lines_also_where_it_rests() -> None:
    film = Film("bicycle-suspension")
    pole = place_of(pole_of(film.motion, (film.thing["Carrier"].number,), film.poses, film.times))
    assert pole == NEAR(film.at("Pole.M"), abs=1e-7)
    truth = figure_oracles.bicycle_suspension(film.poses.times)
    assert pole == NEAR(point(truth, "Pole.M"), abs=1e-7)


def test_the_rope_of_the_crane_keeps_its_length_while_the_jib_moves() -> None:
    film = Film("crane")
    turned = {name: film.poses.angle[film.thing[name].number] for name in ("Stay", "Nose", "Spoke")}
    fall = np.hypot(*(film.at("Wheel.R") - film.at("Hook.T")).T)
    straight = sum(np.hypot(*(film.at(a) - film.at(b)).T) for a, b in (("Stay.W", "Stay.V"), ("Nose.V", "Nose.W")))
    wraps = [turned["Stay"] - turned["Nose"], turned["Nose"] + 90, -turned["Stay"] + turned["Spoke"]]
    length = fall + straight + 7 * np.deg2rad(sum(wraps))
    assert length == NEAR(np.full(len(length), length[0]), abs=1e-9)
    moving = (film.poses.times >= 1.6) & (film.poses.times <= 3.8)
    assert np.ptp(fall[moving]) < 1e-9
    assert np.ptp(film.at("Nose.P")[moving, 0]) > 100
    assert np.ptp(film.at("Nose.P")[moving, 1]) < 3
