"""Every script of the gallery against its oracle, frame by frame, anchor by anchor."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.mechanisms import (
    contact_oracles,
    engine_oracles,
    figure_oracles,
    gear_oracles,
    leg_oracles,
    linkage_oracles,
    machine_oracles,
    motion_oracles,
)
from tests.mechanisms.conftest import SCRIPTS
from tests.mechanisms.kinematics import Array, Columns

Solve = Callable[..., Columns]

ORACLES: dict[str, Callable[[Array], Columns]] = {
    "acceleration": motion_oracles.acceleration,
    "antiparallelogram": figure_oracles.antiparallelogram,
    "axle-path": figure_oracles.axle_path,
    "belt-idler": contact_oracles.belt_idler,
    "bicycle-suspension": figure_oracles.bicycle_suspension,
    "cam-follower": contact_oracles.cam_follower,
    "clockwork": gear_oracles.clockwork,
    "coupling-rods": engine_oracles.coupling_rods,
    "crane": figure_oracles.crane,
    "drafting-pantograph": figure_oracles.drafting_pantograph,
    "elliptic-gears": gear_oracles.elliptic_gears,
    "excavator": machine_oracles.excavator,
    "falling-bar": motion_oracles.falling_bar,
    "four-bar": linkage_oracles.four_bar,
    "geneva-slots": gear_oracles.geneva_slots,
    "governor": figure_oracles.governor,
    "hart": machine_oracles.hart,
    "hoecken": linkage_oracles.hoecken,
    "jansen": linkage_oracles.jansen,
    "jansen-walker": leg_oracles.jansen_walker,
    "klann": leg_oracles.klann,
    "locomotive": machine_oracles.locomotive,
    "maximum": motion_oracles.maximum,
    "oscillating-engine": engine_oracles.oscillating_engine,
    "pantograph": linkage_oracles.pantograph,
    "peaucellier": linkage_oracles.peaucellier,
    "planetary": gear_oracles.planetary,
    "pressure-volume": figure_oracles.pressure_volume,
    "scissor-lift": machine_oracles.scissor_lift,
    "scissor-rollers": contact_oracles.scissor_rollers,
    "scotch-yoke": engine_oracles.scotch_yoke,
    "simson-line": figure_oracles.simson_line,
    "slider-crank": engine_oracles.slider_crank,
    "stephenson": engine_oracles.stephenson,
    "tackle": machine_oracles.tackle,
    "tracer": contact_oracles.tracer,
    "trammel": linkage_oracles.trammel,
    "two-stroke": figure_oracles.two_stroke,
    "umbrella": figure_oracles.umbrella,
    "velocity-polygon": figure_oracles.velocity_polygon,
    "walschaerts": engine_oracles.walschaerts,
    "wankel": engine_oracles.wankel,
    "watt": linkage_oracles.watt,
    "whitworth": machine_oracles.whitworth,
    "writing": figure_oracles.writing,
    "zeuner": figure_oracles.zeuner,
}

IMPORTED = {"peaucellier-linkage", "penrose-five", "penrose-twenty"}
"""Linkages that wishes draw; see test_imported.py."""

PUSHED = {"combination-lock", "escapement", "geneva", "geneva-play", "ratchet", "vending-latch", "walking-toy"}
"""What is pushed; see test_legs_and_gears.py."""

FRAMES = {
    "acceleration": 100, "antiparallelogram": 125, "simson-line": 200, "tackle": 125, "umbrella": 125,
    "axle-path": 100, "bicycle-suspension": 60, "crane": 250, "velocity-polygon": 100, "zeuner": 100,
    "clockwork": 240, "coupling-rods": 51, "excavator": 100, "falling-bar": 101,
    "drafting-pantograph": 100, "governor": 150, "writing": 163,
    "planetary": 150, "scissor-lift": 125, "stephenson": 120, "walschaerts": 120,
    "belt-idler": 51, "geneva-slots": 51, "tracer": 75,
}  # fmt: skip
"""How many frames each script has; 50 where it is not said."""

ENDING = {"belt-idler", "coupling-rods", "falling-bar", "geneva-slots", "writing"}
"""Scripts that do not begin again at their end: the rods' track goes by (its sleepers meet sleepers), the bar falls,
a title is written, the belt's small wheel has not turned by whole turns, and the Geneva wheel has turned by a quarter.
"""

SLOWER = {"excavator", "stephenson", "walschaerts"}
"""Scripts with 20 frames a second instead of 25."""

CLOSED_FORMS = {
    "clockwork", "excavator", "geneva-slots", "hart", "jansen-walker", "klann", "locomotive", "planetary",
    "scissor-lift", "scissor-rollers", "simson-line", "wankel", "whitworth",
}  # fmt: skip
"""Scripts whose oracles are exact to the last digits, so that they are compared to 1e-9 pixels."""

MEMBERS_LENGTH = 600.0
"""Size of the scenes in pixels, to which errors are relative."""


@pytest.mark.parametrize("name", sorted(ORACLES))
def test_all_anchors_are_where_the_oracle_says(name: str, solve_script: Solve) -> None:
    table = solve_script(name)
    expected = ORACLES[name](table["time"])
    assert expected.keys() <= table.keys()
    for column, values in expected.items():
        difference: Array = table[column] - values
        if column.endswith(".angle"):  # where the oracle has only a direction, whole turns are not its business
            difference = difference - 360 * np.round(difference[0] / 360)
        limit = 1e-9 * (1.0 if name in CLOSED_FORMS else MEMBERS_LENGTH)
        assert np.abs(difference).max() <= limit, (column, np.abs(difference).max())


@pytest.mark.parametrize("name", sorted(ORACLES))
def test_frames_are_evenly_spaced_and_complete(name: str, solve_script: Solve) -> None:
    table = solve_script(name)
    count = FRAMES.get(name, 50)
    assert len(table["time"]) == count
    np.testing.assert_array_equal(table["frame"], np.arange(count))
    fps = 20 if name in SLOWER else 25
    np.testing.assert_allclose(table["time"], np.arange(count) / fps, rtol=0, atol=1e-14)


def _thing(column: str) -> str:
    """Of ``S[1].A.P.x`` or ``S[1].A.angle``."""
    return column.removesuffix(".x").removesuffix(".y").rpartition(".")[0]


@pytest.mark.parametrize("name", sorted(ORACLES))
def test_nothing_else_moves_and_nothing_hops(name: str, solve_script: Solve) -> None:
    table = solve_script(name)
    expected = ORACLES[name](table["time"])
    for column, values in table.items():
        if not column.endswith((".x", ".y", ".angle")):
            continue  # frame, time, variables
        if column not in expected and any(other.startswith(_thing(column) + ".") for other in expected):
            continue  # another anchor of a rigid thing
        step = np.abs(np.diff(values)).max()
        allowed = np.abs(np.diff(expected[column])).max() if column in expected else 0.0
        assert step <= allowed + 1e-6, (column, step, allowed)


@pytest.mark.parametrize("name", sorted(ORACLES.keys() - ENDING))
def test_the_loop_closes(name: str, solve_script: Solve) -> None:
    """The instant after the last frame is the first one, by the oracle: no frame is drawn twice."""
    time = solve_script(name)["time"]
    begin, end = (ORACLES[name](np.array([instant])) for instant in (time[0], 2 * time[-1] - time[-2]))
    for column, values in end.items():
        if column.endswith((".x", ".y")):
            assert abs(values[0] - begin[column][0]) < 1e-6, column


def test_the_track_moves_by_whole_sleepers(solve_script: Solve) -> None:
    table = solve_script("coupling-rods")
    moved = table["Track.O.x"][0] - table["Track.O.x"][-1]
    assert moved == pytest.approx(10 * (2 * np.pi * 57.2 / 10), abs=1e-9)


def test_every_script_has_an_oracle() -> None:
    assert {path.stem for path in SCRIPTS.glob("*.mov")} - IMPORTED - PUSHED == ORACLES.keys()


@pytest.mark.parametrize(
    ("name", "fps", "stride"), [("walschaerts", "100", 5), ("stephenson", "100", 5), ("jansen", "100", 4)]
)
def test_more_frames_keep_the_shared_ones(name: str, fps: str, stride: int, solve_script: Solve) -> None:
    coarse, fine = solve_script(name), solve_script(name, fps)
    for column in coarse.keys() - {"frame"}:
        np.testing.assert_allclose(fine[column][::stride], coarse[column], rtol=0, atol=1e-9, err_msg=column)
