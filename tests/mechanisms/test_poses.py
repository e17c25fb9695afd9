"""Every script of the gallery against its oracle, frame by frame, anchor by anchor."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.mechanisms import engine_oracles, linkage_oracles, motion_oracles
from tests.mechanisms.conftest import SCRIPTS
from tests.mechanisms.kinematics import Array, Columns

Solve = Callable[..., Columns]

ORACLES: dict[str, Callable[[Array], Columns]] = {
    "acceleration": motion_oracles.acceleration,
    "coupling-rods": engine_oracles.coupling_rods,
    "falling-bar": motion_oracles.falling_bar,
    "four-bar": linkage_oracles.four_bar,
    "hoecken": linkage_oracles.hoecken,
    "jansen": linkage_oracles.jansen,
    "maximum": motion_oracles.maximum,
    "oscillating-engine": engine_oracles.oscillating_engine,
    "pantograph": linkage_oracles.pantograph,
    "peaucellier": linkage_oracles.peaucellier,
    "scotch-yoke": engine_oracles.scotch_yoke,
    "slider-crank": engine_oracles.slider_crank,
    "stephenson": engine_oracles.stephenson,
    "trammel": linkage_oracles.trammel,
    "walschaerts": engine_oracles.walschaerts,
    "watt": linkage_oracles.watt,
}

IMPORTED = {"peaucellier-linkage", "penrose-five", "penrose-twenty"}
"""Linkages that wishes draw; see test_imported.py."""

FRAMES = {"falling-bar": 101, "acceleration": 101, "walschaerts": 121, "stephenson": 121}
"""How many frames each script has; 51 where it is not said."""

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
        assert np.abs(difference).max() <= 1e-9 * MEMBERS_LENGTH, (column, np.abs(difference).max())


@pytest.mark.parametrize("name", sorted(ORACLES))
def test_frames_are_evenly_spaced_and_complete(name: str, solve_script: Solve) -> None:
    table = solve_script(name)
    count = FRAMES.get(name, 51)
    assert len(table["time"]) == count
    np.testing.assert_array_equal(table["frame"], np.arange(count))
    fps = 20 if count == 121 else 25
    np.testing.assert_allclose(table["time"], np.arange(count) / fps, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", sorted(ORACLES))
def test_nothing_else_moves_and_nothing_hops(name: str, solve_script: Solve) -> None:
    table = solve_script(name)
    expected = ORACLES[name](table["time"])
    for column, values in table.items():
        if column.count(".") != 2 and not column.endswith(".angle"):
            continue  # frame, time, variables
        step = np.abs(np.diff(values)).max()
        allowed = np.abs(np.diff(expected[column])).max() if column in expected else 0.0
        assert step <= allowed + 1e-6, (column, step, allowed)


@pytest.mark.parametrize("name", sorted(ORACLES.keys() - {"falling-bar"}))
def test_the_loop_closes(name: str, solve_script: Solve) -> None:
    table = solve_script(name)
    for column, values in table.items():
        thing = column.split(".")[0]
        if column.count(".") == 2 and thing != "Track":  # the track goes by; its sleepers meet sleepers
            assert abs(values[-1] - values[0]) < 1e-6, column


def test_the_track_moves_by_whole_sleepers(solve_script: Solve) -> None:
    table = solve_script("coupling-rods")
    moved = table["Track.O.x"][0] - table["Track.O.x"][-1]
    assert moved == pytest.approx(10 * (2 * np.pi * 57.2 / 10), abs=1e-9)


def test_every_script_has_an_oracle() -> None:
    assert {path.stem for path in SCRIPTS.glob("*.mov")} - IMPORTED == ORACLES.keys()


@pytest.mark.parametrize(
    ("name", "fps", "stride"), [("walschaerts", "100", 5), ("stephenson", "100", 5), ("jansen", "100", 4)]
)
def test_more_frames_keep_the_shared_ones(name: str, fps: str, stride: int, solve_script: Solve) -> None:
    coarse, fine = solve_script(name), solve_script(name, fps)
    for column in coarse.keys() - {"frame"}:
        np.testing.assert_allclose(fine[column][::stride], coarse[column], rtol=0, atol=1e-9, err_msg=column)
