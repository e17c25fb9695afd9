"""Families in which something pushes, generated, against closed forms: lost motion, latches, counters, intermittent
drives, followers that land, touches that are hardly any; and each the same however it is asked for.
"""

from __future__ import annotations

import itertools
import math
import random
import re

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad
from tests.pushing.families import Counter, Dogs, Latch, Pins, Safety, block
from tests.pushing.scripts import PLACES, Geneva, Place, Ratchet


def errors(text: str) -> list[mv.Diagnostic]:
    with pytest.raises((mv.ScriptError, mv.NoSolutionError)) as told:
        mv.loads(text).solve()
    return [each for each in told.value.diagnostics if each.severity == "error"]


# --- lost motion


@broad(("wheels", "swing"), [(2, 400.0), (3, 700.0), (3, -700.0), (4, 1500.0)], first=1)
def test_wheels_with_dogs_take_each_other_along(wheels: int, swing: float) -> None:
    dogs = Dogs(wheels, swing)
    place = PLACES[wheels]
    motion = mv.loads(dogs.text(place)).solve()
    times = np.unique(np.concatenate([motion.times, [1.0, 3.0]]))
    for k, truth in enumerate(dogs.turned(times)):
        assert np.abs(place.sense * motion[f"W{k}.angle"] - np.interp(motion.times, times, truth)).max() < 1e-9


# --- latches


@broad(("slope", "depth", "place"), list(itertools.product((0.5, 1.0, 2.0), (5.0, 9.0), PLACES)), every=11)
def test_a_door_lifts_its_latch(slope: float, depth: float, place: Place) -> None:
    latch = Latch(slope, depth)
    motion = mv.loads(latch.text(place)).solve()
    up = np.array(place.at(0.0, 1.0)) - place.at(0.0, 0.0)
    lift = (motion["Catch.O"] - motion["Catch.O"][0]) @ up / place.scale**2
    truth = latch.lift(motion.times)
    assert np.nanmax(np.abs(lift - truth)) < 1e-9
    fallen = np.isnan(truth)
    assert fallen.any()
    assert (np.diff(lift[np.flatnonzero(fallen)[0] - 1 :]) < 0.0).all()  # it falls behind the door


@broad("place", PLACES, every=5)
def test_a_latched_door_does_not_come_back(place: Place) -> None:
    latch = Latch(1.0, 9.0)
    (error,) = errors(latch.text(place, back=True))
    assert error.code == "solve/binds"
    assert "`Door` and `Catch`" in error.message
    end = 1.2 * (9.0 + 25.0) / 40.0
    when = 2.0 * end - (104.0 + 9.0 - 80.0) / 40.0  # its back is where the nose is
    assert float(re.findall(r"t = ([0-9.]+)", error.message)[0]) == pytest.approx(when, abs=1e-8)


# --- counters and intermittent drives


@pytest.mark.parametrize(
    ("slots", "wheels", "turns"),
    [
        (10, 2, 3),
        pytest.param(6, 3, 10, marks=pytest.mark.slow),
        pytest.param(4, 3, 7, marks=pytest.mark.slow),
        pytest.param(5, 4, 30, marks=pytest.mark.slow),
        pytest.param(10, 3, 12, marks=pytest.mark.slow),
    ],
)
def test_counters_carry(slots: int, wheels: int, turns: int) -> None:
    counter = Counter(slots, wheels)
    place = PLACES[slots % len(PLACES)]
    motion = mv.loads(counter.text(place, turns)).solve()
    for wheel, truth in enumerate(counter.shown(turns), start=1):
        assert place.sense * motion[f"W{wheel}.angle"][-1] == pytest.approx(truth, abs=1e-8)


@broad(("slots", "pins"), [(3, 3), (4, 1), (4, 2), (5, 2), (6, 2), (8, 2)], every=3)
def test_several_pins_turn_a_wheel_by_so_many_steps(slots: int, pins: int) -> None:
    drive = Pins(slots, pins)
    place = PLACES[slots % len(PLACES)]
    motion = mv.loads(drive.text(place)).solve()
    assert place.sense * motion["Wheel.angle"][-1] == pytest.approx(drive.turned(), abs=1e-8)


# --- a follower that lifts off and lands


@pytest.mark.parametrize(("height", "rate", "fall"), [(20.0, 180.0, 30.0), (20.0, 360.0, 30.0), (35.0, 90.0, 10.0)])
def test_a_follower_lifts_off_and_lands(height: float, rate: float, fall: float) -> None:
    text = f"""
        .config(25, 300, 260);
        {block("Table", 100.0, 100.0, 60.0, 10.0, Place())}
        {block("Top", 110.0, 110.0, 40.0, 10.0, Place())}
        @0 Table.O = [100, 100 + {height}*.sin({rate}*.t)];  Table.angle = 0;
           Top.O.x = 110;  Top.angle = 0;  Top.O.y ~ .least .weak .speed({fall});
           .gap(Top, Table) >= 0 .pushes;
        @4
    """
    motion = mv.loads(text).solve()
    fine = np.linspace(0.0, 4.0, 400_001)
    surface = 110.0 + height * np.sin(np.radians(rate * fine))
    truth = np.maximum.accumulate(surface + fall * fine) - fall * fine
    assert np.abs(motion["Top.O"][:, 1] - np.interp(motion.times, fine, truth)).max() < 1e-6  # the samples' own error
    off = [each.time for each in motion.contacts if each.event == "ends"]
    leaves = math.degrees(math.acos(-fall / (height * math.radians(rate)))) / rate  # where it sinks as fast as that
    assert off[0] == pytest.approx(leaves, abs=1e-8)


# --- touches that are hardly any


@broad(
    ("depth", "fast", "side"),
    list(itertools.product((1.0, 1e-2, 1e-4, 1e-6), (10.0, 400.0), (1.0, -1.0))),
    every=5,
)
def test_a_disc_that_hardly_touches_pushes(depth: float, fast: float, side: float) -> None:
    text = f"""
        .config(10, 400, 100);  A : .disc(5) C = [0, 50];  B : .disc(5) C = [137.3, {50 + side * (10 - depth)}];
        @0 A.C = [{fast}*.t, 50];  B.C.x = 137.3;  .gap(A, B) >= 0 .pushes;
        @{400 / fast}
    """
    motion = mv.loads(text).solve()
    assert motion["B.C"][-1, 1] == pytest.approx(50.0 + side * 10.0, abs=1e-9)


@broad(("depth", "turn"), list(itertools.product((1e-1, 1e-3, 1e-6), (90.0, 700.0))), every=5)
def test_a_tip_that_hardly_dips_pushes(depth: float, turn: float) -> None:
    text = f"""
        .config(10, 400, 200);  Arm : .bar O = [100, 100] T = [180, 100];
        {block("Plate", 50.0, 0.0, 100.0, 20.0 + depth, Place())}
        @0 Arm.O = [100, 100];  Arm.angle = -{turn}*.t;  Plate.O.x = 50;  Plate.angle = 0;
           .gap(Arm.T, Plate) >= 0 .pushes;
        @{300 / turn}
    """
    motion = mv.loads(text).solve()
    assert motion["Plate.O"][-1, 1] == pytest.approx(-depth, abs=1e-9)


# --- the same however it is asked for

SAME = {
    "dogs": (Dogs(3, 700.0).text(Place()), "W2.angle"),
    "latch": (Latch(1.0, 8.0).text(Place()), "Catch.O.y"),
    "counter": (Counter(6, 3).text(Place(), 3), "W1.angle"),
    "pins": (Pins(5, 2).text(Place()), "Wheel.angle"),
    "geneva": (Geneva(6, 0.3).text(Place()), "Wheel.angle"),
    "ratchet": (Ratchet(17, 0.35, 30.0, (0.0, -10.0)).text(Place(), 1), "Pawl1.angle"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SAME)
def test_families_do_not_depend_on_the_frame_rate(name: str) -> None:
    text, value = SAME[name]
    times = np.linspace(0.05, 0.95, 19)
    script = mv.loads(text)
    seen = [script.solve(fps=fps).at(times)[value] for fps in (7, 25, 60)]
    assert np.abs(seen[0] - seen[1]).max() < 1e-9
    assert np.abs(seen[2] - seen[1]).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", SAME)
def test_families_do_not_depend_on_order(name: str) -> None:
    """Neither on that of things nor on that of statements within a step."""
    text, value = SAME[name]
    head, rest = text.split(";", 1)
    things, steps = rest.split("@0", 1)
    says, end = steps.rsplit("@", 1)
    shuffled = random.Random(3)
    parts = [each.strip() + ";" for each in things.split(";") if each.strip()]
    said = [each.strip() + ";" for each in says.split(";") if each.strip()]
    plain = mv.loads(text).solve()
    for _ in range(2):
        shuffled.shuffle(parts)
        shuffled.shuffle(said)
        other = mv.loads(head + ";" + "\n".join(parts) + "\n@0 " + "\n".join(said) + "\n@" + end).solve()
        assert np.abs(other[value] - plain[value]).max() < 1e-9


# --- a safety catch


@broad(("begin", "lift", "place"), list(itertools.product((1.0, 1.37), (20.0, 75.0), PLACES)), every=9)
def test_a_bolt_waits_for_its_catch(begin: float, lift: float, place: Place) -> None:
    safety = Safety(begin, lift)
    assert safety.free > safety.gap / safety.speed
    motion = mv.loads(safety.text(place, 3.0)).solve()
    assert np.abs(motion["way"] - safety.way(motion.times)).max() < 1e-8
    begins, ends = (next(each.time for each in motion.contacts if each.event == what) for what in ("begins", "ends"))
    assert begins == pytest.approx(safety.gap / safety.speed, abs=1e-9)
    assert ends >= safety.free - 1e-9


@broad("place", PLACES, every=5)
def test_a_bolt_that_is_driven_against_its_catch_binds(place: Place) -> None:
    safety = Safety(5.0, 20.0)
    (error,) = errors(safety.text(place, 3.0, driven=True))
    assert error.code == "solve/binds"
    assert float(re.findall(r"t = ([0-9.]+)", error.message)[0]) == pytest.approx(safety.gap / safety.speed, abs=1e-8)
    late = Safety(0.0, 40.0)  # it is out of the way in time
    motion = mv.loads(late.text(place, 3.0, driven=True)).solve()
    assert not motion.contacts
