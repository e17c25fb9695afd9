"""Anchor and deadbeat escapements, generated: where the wheel rests, against the meeting of a circle with a face; it
goes by exactly one tooth in each period, and the deadbeat never goes back.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad
from tests.pushing.escapements import Escapement
from tests.pushing.scripts import PLACES, Place

MEMBERS = [
    Escapement(teeth, span, swing, dead)
    for teeth, spans in ((15, (2, 3, 4)), (20, (3, 4, 5)), (30, (5, 7)))
    for span in spans
    for swing in (3.5, 5.0, 6.0)
    for dead in (True, False)
]


def judged(escapement: Escapement, motion: mv.Motion, place: Place) -> None:
    """The wheel rests where it should in all frames in which it does, and goes on by whole teeth."""
    turned = -place.sense * motion["Wheel.angle"]
    truth = escapement.resting(motion.times)
    rests = np.isfinite(truth)
    assert rests.sum() >= 5
    assert np.abs(turned - truth)[rests].max() < 1e-9
    if escapement.dead:
        assert np.diff(turned).min() > -1e-9


def contacts_of(motion: mv.Motion) -> list[tuple[str, tuple[str, ...], float]]:
    return [(each.event, each.things, each.time) for each in motion.contacts]


@broad(("member",), [(each,) for each in MEMBERS], every=12, ids=str)
def test_the_wheel_rests_on_the_pallets(member: Escapement) -> None:
    motion = mv.loads(member.text(Place(), 2)).solve()
    judged(member, motion, Place())
    assert motion.overlaps() == []


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES[1:])
@pytest.mark.parametrize("dead", [True, False])
def test_anywhere(place: Place, dead: bool) -> None:
    member = Escapement(15, 3, 5.0, dead)
    judged(member, mv.loads(member.text(place, 2)).solve(), place)


@pytest.mark.slow
@pytest.mark.parametrize("dead", [True, False])
@pytest.mark.parametrize("teeth", [15, 30])
def test_frames_do_not_matter(teeth: int, dead: bool) -> None:
    member = Escapement(teeth, teeth // 4, 5.0, dead)
    films = [mv.loads(member.text(Place(), 2, fps)).solve() for fps in (7, 25, 60)]
    for film in films:
        judged(member, film, Place())
    events = [contacts_of(film) for film in films]
    times = np.array([[time for _, _, time in each] for each in events])
    assert [[each[:2] for each in film] for film in events] == 3 * [[each[:2] for each in events[0]]]
    assert np.abs(times - times[0]).max() < 1e-9
    shared = [film["Wheel.angle"][np.isclose(film.times % 1.0, 0.0)] for film in films]
    assert np.abs(np.array(shared) - shared[0]).max() < 1e-9


def test_recoil_is_as_deep_as_its_closed_form() -> None:
    """Between a tooth's arrival and the turning point the anchor drives the wheel back, by what the face says."""
    member = Escapement(15, 3, 5.0, dead=False)
    motion = mv.loads(member.text(Place(), 1, 100)).solve()
    turned = -motion["Wheel.angle"]
    late = (motion.times >= 0.35) & (motion.times <= 0.5)  # the anchor swings on, a tooth on the exit pallet
    truth = np.array([-member.seen(float(theta), 1) for theta in member.anchor(motion.times[late])])
    assert np.abs(np.diff(turned[late]) + np.diff(truth)).max() < 1e-9
    assert turned[late][-1] < turned[late][0] - 0.5


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("member", [Escapement(15, 3, 5.0), Escapement(30, 7, 5.0, dead=False)], ids=str)
def test_a_thousand_periods(member: Escapement) -> None:
    periods = 1000
    motion = mv.loads(member.text(Place(), periods, fps=4)).solve()
    judged(member, motion, Place())
    turned = -motion["Wheel.angle"][4::4]  # at each whole period but the first, a tooth rests
    gone = turned - turned[0]
    assert np.abs(gone - member.pitch * np.arange(len(gone))).max() < 1e-9


def test_a_weak_train_stops_at_a_pallet_that_stands_still() -> None:
    """Without a swing, one tooth comes to rest, and the wheel stays."""
    member = dataclasses.replace(Escapement(15, 3, 5.0), speed=60.0)
    text = member.text(Place(), 1).replace("*(.cos(360*.t))", "")
    turned = -mv.loads(text).solve()["Wheel.angle"]
    assert np.abs(turned[5:] - 0.05 * member.pitch).max() < 1e-9
