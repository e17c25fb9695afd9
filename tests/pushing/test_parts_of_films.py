"""A part of a film in which something pushes is the same as in the whole film: what came before counts, wherever one
looks first; against closed forms.
"""

from __future__ import annotations

import csv
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import movimentum as mv
from movimentum.cli.app import run_command_line
from tests.broad import broad
from tests.pushing.families import Dogs, Safety
from tests.pushing.scripts import PLACES, Geneva, Place, Ratchet, play_operator

Truth = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Film:
    """A script at a place and a frame rate, the column that tells, and what it is at times (nan: not known)."""

    text: Callable[[Place, float], str]
    column: str
    truth: Callable[[Place], Truth]


def _follower(place: Place, fps: float) -> str:
    """A thing that is carried along between two stops: where it is depends on all that was before."""
    return f"""
        .config({fps}, 300, 100);
        A : .bar O=[0,50] P=[20,50];  B : .bar O=[0,80] P=[20,80];
        @0 A.O = [{place.sense}*(20*.t*.sin(90*.t)), 50];  A.angle = 0;  B.O.y = 80;  B.angle = 0;
           B.O.x - A.O.x >= -5 .pushes;  B.O.x - A.O.x <= 5 .pushes;
        @6
    """


def _followed(place: Place) -> Truth:
    fine = np.linspace(0.0, 6.0, 600_001)
    found = place.sense * play_operator(20.0 * fine * np.sin(0.5 * np.pi * fine), 0.0, 5.0)
    return lambda times: np.interp(times, fine, found)


DOGS, GENEVA, RATCHET, SAFETY = Dogs(2, 400.0), Geneva(5, 0.4), Ratchet(12, 0.1373, 35.0), Safety(0.5, 20.0)


def _dogs(place: Place) -> Truth:
    fine = np.linspace(0.0, 4.0, 400_001)
    found = place.sense * DOGS.turned(fine)[-1]
    return lambda times: np.interp(times, fine, found)


def _ratchet(place: Place) -> Truth:
    ends = RATCHET.advanced(2)

    def turned(times: np.ndarray) -> np.ndarray:
        strokes = np.round(times / 2.0).astype(int)
        known = (np.abs(times - 2.0 * strokes) < 1e-12) & (strokes > 0)
        return np.where(known, place.sense * np.array([np.nan, *ends])[np.clip(strokes, 0, 2)], np.nan)

    return turned


FILMS = {
    "follower": Film(_follower, "B.O.x", _followed),
    "dogs": Film(lambda place, fps: DOGS.text(place, fps), "W1.angle", _dogs),
    "geneva": Film(
        lambda place, fps: GENEVA.text(place, 2, fps),
        "Wheel.angle",
        lambda place: lambda times: place.sense * GENEVA.wheel(times),
    ),
    "ratchet": Film(lambda place, fps: RATCHET.text(place, 2, fps), "Wheel.angle", _ratchet),
    "safety": Film(
        lambda place, fps: SAFETY.text(place, 2.5).replace(".config(25,", f".config({fps},"),
        "way",
        lambda _: SAFETY.way,
    ),
}
MEMBERS = [(name, place) for name in FILMS for place in (PLACES[0], PLACES[5])]


def rows(folder: Path, text: str, *options: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The table that the command writes: the frames' numbers, and the columns."""
    (folder / "m.mov").write_text(text)
    assert run_command_line(["solve", str(folder / "m.mov"), "-o", str(folder / "m.csv"), "-q", *options]) == 0
    with (folder / "m.csv").open(newline="") as file:
        found = list(csv.DictReader(file))
    columns = {name: np.array([float(row[name]) for row in found]) for name in found[0]}
    return columns["frame"].astype(int), columns


def agree(one: dict[str, np.ndarray], other: dict[str, np.ndarray], within: float) -> None:
    for name, values in one.items():
        assert np.abs(values - other[name]).max() <= within * max(1.0, np.abs(other[name]).max()), name


@broad(("name", "place"), MEMBERS, every=5)
def test_a_range_of_frames_is_as_in_the_whole_film(name: str, place: Place, tmp_path: Path) -> None:
    film = FILMS[name]
    text = film.text(place, 20.0)
    _, whole = rows(tmp_path, text)
    truth = film.truth(place)(whole["time"])
    known = np.isfinite(truth)
    assert known.any()
    assert np.abs(whole[film.column] - truth)[known].max() < 2e-8
    chosen = random.Random(name)
    count = len(whole["time"])
    for _ in range(3):
        first = chosen.randrange(1, count - 2)
        last = chosen.randrange(first + 1, count)
        numbers, some = rows(tmp_path, text, "--frames", f"{first}:{last}")
        assert numbers.tolist() == list(range(first, last))
        agree(some, {key: values[first:last] for key, values in whole.items()}, 1e-12)
    numbers, some = rows(tmp_path, text, "--frames", "-1:")
    agree(some, {key: values[-1:] for key, values in whole.items()}, 1e-12)


@broad(("name", "place"), MEMBERS, every=5)
def test_moments_are_as_in_the_film(name: str, place: Place) -> None:
    film = FILMS[name]
    motion = mv.loads(film.text(place, 25.0)).solve()
    other = mv.loads(film.text(place, 7.0)).solve()
    times = np.array(sorted(random.Random(name).uniform(0.0, float(motion.times[-1])) for _ in range(12)))
    together = other.at(times)[film.column]
    alone = np.array([float(motion.at(float(time))[film.column]) for time in times[::-1]])[::-1]
    assert np.abs(together - alone).max() < 1e-9 * max(1.0, np.abs(alone).max())
    agree({"": motion.at(motion.times)[film.column]}, {"": motion[film.column]}, 1e-12)
    truth = film.truth(place)(times)
    known = np.isfinite(truth)
    assert np.abs(alone - truth)[known].max(initial=0.0) < 2e-8


@pytest.mark.parametrize(("name", "frame"), [("follower", 37), ("follower", 60), ("safety", 24), ("safety", 25)])
def test_a_still_is_that_frame_of_the_film(name: str, frame: int, tmp_path: Path) -> None:
    (tmp_path / "m.mov").write_text(FILMS[name].text(PLACES[0], 10.0))
    script = str(tmp_path / "m.mov")
    pictures = []
    for words in (("--at", f"{frame / 10:g}"), ("--frames", str(frame))):
        out = tmp_path / f"{words[0][2:]}.svg"
        assert run_command_line(["run", script, "-o", str(out), "-q", *words]) == 0
        pictures.append(out.read_text())
    assert pictures[0] == pictures[1]


# --- what opens for a moment only


@broad(
    ("half", "middle", "fps"),
    [(half, middle, fps) for half in (0.002, 0.005, 0.02, 0.1) for middle in (0.7, 1.0, 1.2345) for fps in (7, 25)],
    every=5,
)
def test_a_claw_that_lets_go_for_a_moment(half: float, middle: float, fps: int) -> None:
    """Two feet that slide forwards only are driven apart, and together from ``middle - half`` to ``middle + half``:
    then the hind one goes on, by what the fore one would have to go back.
    """
    steep = 1000.0
    motion = mv.loads(f"""
        .config({fps}, 300, 100);
        F : .bar A=[100,50] B=[110,50];  H : .bar A=[50,50] B=[60,50];
        @0 F.A.y = 50;  H.A.y = 50;  F.angle = 0;  H.angle = 0;
           F.A.x - H.A.x = 50 + {steep}*(((.t - {middle})^3 + {middle**3!r})/3 - {half**2!r}*.t);
           .d(F.A.x) >= 0 .pushes;  .d(H.A.x) >= 0 .pushes;
        @2
    """).solve()

    def apart(times: np.ndarray) -> np.ndarray:
        return steep * (((times - middle) ** 3 + middle**3) / 3.0 - half**2 * times)

    low, high = middle - half, middle + half
    inside = np.clip(motion.times, low, high)
    hind = 50.0 + apart(np.array(low)) - apart(inside)
    assert np.abs(motion["H.A"][:, 0] - hind).max() < 1e-9
    assert np.abs(motion["F.A"][:, 0] - hind - 50.0 - apart(motion.times)).max() < 1e-9
    near = np.array([low - 0.1 * half, low + 0.1 * half, middle, high - 0.1 * half, high + 0.1 * half])
    hind = 50.0 + apart(np.array(low)) - apart(np.clip(near, low, high))
    assert np.abs(motion.at(near)["H.A"][:, 0] - hind).max() < 1e-9


def test_times_of_contacts_are_plain_numbers() -> None:
    for name in ("follower", "safety", "geneva"):
        contacts = mv.loads(FILMS[name].text(PLACES[0], 10.0)).solve().contacts
        assert contacts
        assert {type(each.time) for each in contacts} == {float}
