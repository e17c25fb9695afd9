"""Films in which something pushes, against closed forms: stops, chains, lost motion, clutches, Geneva drives, ratchets,
cams; the same at any frame rate, place, scale, and order of statements.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad
from tests.pushing.scripts import PLACES, Geneva, Place, Ratchet, play_operator, polygon, ratchet_points


def events(motion: mv.Motion, event: str) -> list[float]:
    return [each.time for each in motion.contacts if each.event == event]


# --- stops

CHAIN = """
    .config(25, 300, 100);
    A : .bar O=[0,50] P=[10,50];   B : .bar O=[40,50] P=[50,50];   C : .bar O=[100,50] P=[110,50];
    @0 A.O = [50*.t, 50];  A.angle = 0;  B.O.y = 50;  B.angle = 0;  C.O.y = 50;  C.angle = 0;
       B.O.x - A.O.x >= 20 .pushes;
       C.O.x - B.O.x >= 20 .pushes;
    @4
"""


def test_blocks_push_each_other() -> None:
    motion = mv.loads(CHAIN).solve()
    a = 50.0 * motion.times
    b = np.maximum(40.0, a + 20.0)
    c = np.maximum(100.0, b + 20.0)
    assert np.abs(motion["B.O"][:, 0] - b).max() < 1e-10
    assert np.abs(motion["C.O"][:, 0] - c).max() < 1e-10
    assert events(motion, "begins") == pytest.approx([0.4, 1.2], abs=1e-9)


def test_lost_motion_is_the_play_operator() -> None:
    text = """
        .config(25, 300, 100);
        A : .bar O=[100,50] P=[120,50];  B : .bar O=[100,80] P=[120,80];
        @0 A.O = [100 + 40*.sin(90*.t), 50];  A.angle = 0;  B.O.y = 80;  B.angle = 0;
           B.O.x - A.O.x >= -5 .pushes;  B.O.x - A.O.x <= 5 .pushes;
        @8
    """
    motion = mv.loads(text).solve()
    times = np.unique(np.concatenate([motion.times, np.arange(1.0, 8.0, 2.0)]))
    truth = play_operator(100.0 + 40.0 * np.sin(np.radians(90.0 * times)), 100.0, 5.0)
    assert np.abs(motion["B.O"][:, 0] - np.interp(motion.times, times, truth)).max() < 1e-10
    first = math.degrees(math.asin(5.0 / 40.0)) / 90.0
    assert events(motion, "begins")[0] == pytest.approx(first, abs=1e-9)
    assert events(motion, "ends")[:2] == pytest.approx([1.0, 3.0], abs=1e-9)


def test_a_stop_on_an_angle_counts_turns() -> None:
    text = """
        .config(10, 300, 300);  A : .bar O=[150,150] P=[200,150];  B : .bar O=[150,150] P=[150,220];
        @0 A.O = [150,150];  A.angle = 200*.t;  B.O = [150,150];  B.angle - A.angle >= -30 .pushes;
        @4 A.angle = 800 - 100*.t;
        @6
    """
    motion = mv.loads(text).solve()
    drive = np.where(motion.times < 4, 200 * motion.times, 800 - 100 * (motion.times - 4))
    truth = np.maximum.accumulate(np.maximum(0.0, drive - 30.0))
    assert np.abs(motion["B.angle"] - truth).max() < 1e-8


def test_a_clutch_takes_along_one_way() -> None:
    text = """
        .config(25, 300, 200);
        A : .bar O=[100,50] P=[120,50];  W : .bar O=[100,80] P=[120,80];
        @0 A.O = [100,50];  A.angle = 30*.sin(180*.t);  W.O = [100,80];
           .d(W.angle - A.angle) >= 0 .pushes;
           .d(W.angle) >= 0 .pushes;
        @6
    """
    motion = mv.loads(text).solve()
    t = motion.times
    rising = 30.0 * np.sin(np.pi * t)
    # a quarter first, then from each trough to the next crest
    crest = np.floor((t + 0.5) / 2.0)
    up = (t + 0.5) % 2.0 < 1.0
    truth = np.where(up, rising + 60.0 * crest, 30.0 + 60.0 * crest)
    assert np.abs(motion["W.angle"] - truth).max() < 1e-8


def test_what_pushes_against_a_wall_jams() -> None:
    text = """
        W : .bar P=[50,0] Q=[50,50];  A : .disc(5) C=[0,20];  B : .disc(5) C=[30,20];
        @0 A.C = [10*.t, 20];  B.C = [x, 20];  .gap(A, B) >= 0 .pushes;  .gap(B, W) >= 0 .pushes;
        @4
    """
    with pytest.raises(mv.NoSolutionError) as told:
        mv.loads(text).solve()
    (error,) = [each for each in told.value.diagnostics if each.severity == "error"]
    assert error.code == "solve/binds"
    assert "t = 3.5" in error.message
    assert all(name in error.message for name in ("`A`", "`B`", "`W`"))
    motion = mv.loads(text).solve(on_failure="skip")
    assert [(each.event, each.things) for each in motion.contacts] == [
        ("begins", ("A", "B")),
        ("begins", ("B", "W")),
        ("jams", ("A", "B")),
        ("jams", ("B", "W")),
    ]


def test_wishes_give_way_and_weak_ones_more() -> None:
    text = """
        .config(10, 300, 100);  A : .bar O=[0,50] P=[10,50];  B : .bar O=[40,50] P=[50,50];
        @0 A.O.y = 50;  A.angle = 0;  B.O.y = 50;  B.angle = 0;
           A.O.x ~ .most .weak(2) .speed(50);  B.O.x ~ .least .weak .speed(20);  B.O.x - A.O.x >= 20 .pushes;
        @2
    """
    motion = mv.loads(text).solve()
    # they meet at 0.2857…; then the stronger one goes on
    b = 40.0 - 20.0 * motion.times
    a = np.minimum(50.0 * motion.times, b - 20.0)
    assert np.abs(motion["B.O"][:, 0] - b).max() < 1e-8
    assert np.abs(motion["A.O"][:, 0] - a).max() < 1e-8


def test_what_holds_is_between_wishes_and_weak_ones() -> None:
    text = """
        .config(10, 300, 100);  A : .bar O=[0,50] P=[10,50];  B : .bar O=[30,50] P=[40,50];
        @0 A.O.y = 50;  A.angle = 0;  B.O.y = 50;  B.angle = 0;  B.O.x - A.O.x >= 20 .pushes;  B.O.x .holds;
           A.O.x ~ .most {weak} .speed(50);
        @1
    """
    held = mv.loads(text.replace("{weak}", ".weak")).solve()
    assert np.abs(held["B.O"][:, 0] - 30.0).max() < 1e-9
    assert held["A.O"][-1, 0] == pytest.approx(10.0, abs=1e-9)
    pushed = mv.loads(text.replace("{weak}", "")).solve()
    assert pushed["B.O"][-1, 0] == pytest.approx(70.0, abs=1e-7)


# --- Geneva drives


def judged(geneva: Geneva, motion: mv.Motion, place: Place, within: float) -> None:
    truth = geneva.wheel(motion.times)
    off = np.abs(place.sense * motion["Wheel.angle"] - truth)
    assert np.count_nonzero(np.isfinite(truth)) > 10
    assert np.nanmax(off) < within


def test_a_geneva_wheel_is_pushed_by_its_slots() -> None:
    geneva = Geneva(4, play=0.5)
    motion = mv.loads(geneva.text(Place(), 2)).solve()
    judged(geneva, motion, Place(), 1e-9)
    begins = [each.time for each in motion.contacts if each.event == "begins"]
    assert len(begins) >= 2


@pytest.mark.slow
@pytest.mark.parametrize("slots", range(3, 13))
@pytest.mark.parametrize("play", [0.0, 0.1, 0.4, 1.5])
def test_every_geneva_drive(slots: int, play: float) -> None:
    geneva = Geneva(slots, play)
    judged(geneva, mv.loads(geneva.text(Place(), 2)).solve(), Place(), 1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
def test_a_geneva_drive_anywhere(place: Place) -> None:
    geneva = Geneva(5, 0.3)
    judged(geneva, mv.loads(geneva.text(place)).solve(), place, 1e-8)


# --- ratchets


def pawl(teeth: int, phase: float, drive: str, end: float, place: Place = PLACES[0], fps: float = 25.0) -> str:
    wheel = polygon("Wheel", (150.0, 100.0), ratchet_points(teeth, 50.0, 42.0, phase), place)
    return f"""
        .config({fps}, 300, 220);
        {wheel}
        Pawl : .bar O = {place.said(90, 162)} T = {place.said(180, 147.5)};
        @0 Wheel.O = {place.said(150, 100)};  Wheel.angle = {drive};
           Pawl.O = {place.said(90, 162)};    Pawl.angle ~ .{"least" if place.sense > 0 else "most"} .weak;
           .gap(Pawl.T, Wheel) >= 0 .pushes;
        @{end}
    """


def above(point: np.ndarray, wheel: np.ndarray) -> float:
    """How far a point is from the polygon (N, 2), along its edges."""
    ends = np.roll(wheel, -1, axis=0)
    way = ends - wheel
    share = np.clip(((point - wheel) * way).sum(1) / (way * way).sum(1), 0.0, 1.0)
    return float(np.hypot(*(point - wheel - share[:, None] * way).T).min())


def test_a_pawl_rides_on_its_wheel_and_blocks_it() -> None:
    teeth = 12
    motion = mv.loads(pawl(teeth, 0.05, "30*.t", 3.0)).solve()
    drops = events(motion, "ends")
    assert np.diff(drops) == pytest.approx(1.0, abs=1e-8)  # one tooth each time unit
    points = np.array(ratchet_points(teeth, 50.0, 42.0, 0.05))
    for k in range(2, len(motion)):
        if min(abs(motion.times[k] - drop) for drop in drops) < 0.05:
            continue  # it falls
        turn = math.radians(30.0 * motion.times[k])
        c, s = math.cos(turn), math.sin(turn)
        wheel = (points - [150.0, 100.0]) @ np.array([[c, s], [-s, c]]) + [150.0, 100.0]
        assert above(motion["Pawl.T"][k], wheel) < 1e-9
    back = mv.loads(pawl(teeth, 0.05, "-30*.t", 3.0)).solve(on_failure="skip")
    assert [each.event for each in back.contacts][-1] == "jams"


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [5, 8, 17, 30, 32])
@pytest.mark.parametrize("phase", [0.0, 0.07])
def test_ratchets_of_many_teeth(teeth: int, phase: float) -> None:
    motion = mv.loads(pawl(teeth, phase, f"{720 / teeth}*.t", 2.0)).solve()
    drops = [time for time in events(motion, "ends") if time > 0.02]
    assert np.diff(drops) == pytest.approx(0.5, abs=1e-7)


def judged_ratchet(ratchet: Ratchet, motion: mv.Motion, place: Place, strokes: int) -> None:
    wheel = place.sense * motion["Wheel.angle"]
    assert wheel[[25 * 2 * (k + 1) for k in range(strokes)]] == pytest.approx(ratchet.advanced(strokes), abs=1e-9)
    assert np.diff(wheel).min() > -1e-11  # it never goes back


def test_a_pawl_pushes_a_ratchet_on() -> None:
    ratchet = Ratchet(12, 0.1373, 35.0)
    judged_ratchet(ratchet, mv.loads(ratchet.text(Place(), 1)).solve(), Place(), 1)


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [5, 7, 12, 17, 24, 36, 60])
@pytest.mark.parametrize("pawls", [1, 2, 3])
def test_every_ratchet(teeth: int, pawls: int) -> None:
    random = np.random.default_rng(100 * teeth + pawls)
    pitch = 360.0 / teeth
    place = PLACES[(teeth + pawls) % len(PLACES)]
    swing = random.uniform(40.0, 95.0) if teeth <= 8 else random.uniform(0.7, 2.4) * pitch
    offsets = tuple(-pitch / pawls * k for k in range(pawls))
    ratchet = Ratchet(teeth, random.uniform(0.0, math.radians(pitch)), swing, offsets)
    judged_ratchet(ratchet, mv.loads(ratchet.text(place, 3)).solve(), place, 3)


@pytest.mark.slow
def test_a_ratchet_does_not_depend_on_the_frame_rate() -> None:
    ratchet = Ratchet(17, 0.35, 30.0, (0.0, -10.0))
    times = np.linspace(0.1, 3.9, 39)
    seen = [mv.loads(ratchet.text(Place(), 2, fps)).solve().at(times) for fps in (7.0, 25.0, 60.0)]
    for name in ("Wheel.angle", "Pawl0.angle", "Pawl1.angle"):
        assert np.abs(seen[0][name] - seen[1][name]).max() < 1e-9
        assert np.abs(seen[2][name] - seen[1][name]).max() < 1e-9


# --- cams


@pytest.mark.slow
def test_a_flat_follower_is_lifted_by_a_cam() -> None:
    text = """
        .config(10, 300, 260);
        Cam  : .curve C = [150,100]  .polar(th, 40 + 9*.cos(th));
        Flat : .polygon A=[100,170] B=[200,170] C=[200,180] D=[100,180];
        @0 Cam.C = [150,100];  Cam.angle = 90*.t;
           Flat.A.x = 100;  Flat.angle = 0;  Flat.A.y ~ .least .weak;
           .gap(Flat, Cam) >= 0 .pushes;
        @2
    """
    motion = mv.loads(text).solve()
    theta = np.linspace(0.0, 2.0 * np.pi, 200_001)
    for time, y in zip(motion.times[3:], motion["Flat.A"][3:, 1], strict=True):
        top = np.max((40.0 + 9.0 * np.cos(theta)) * np.sin(theta + 0.5 * np.pi * time))
        assert y == pytest.approx(100.0 + top, abs=2e-8)  # the samples' own error


# --- the same film however it is asked for


@pytest.mark.parametrize("text", [CHAIN, Geneva(4, 0.5).text(Place())])
def test_the_film_does_not_depend_on_the_frame_rate(text: str) -> None:
    script = mv.loads(text)
    name = "C.O.x" if "C.O.x" in text else "Wheel.angle"
    times = [0.5, 1.0, 1.5, 2.0, 3.0]
    seen = [script.solve(fps=fps).at(times)[name] for fps in (7, 25, 60)]
    assert np.abs(seen[1] - seen[0]).max() < 1e-9
    assert np.abs(seen[1] - seen[2]).max() < 1e-9


def test_the_order_of_statements_does_not_matter() -> None:
    text = CHAIN.replace("B.O.x - A.O.x >= 20 .pushes;", "")
    text = text.replace("@0 A.O", "@0 B.O.x - A.O.x >= 20 .pushes;  A.O")
    one, other = mv.loads(CHAIN).solve(), mv.loads(text).solve()
    assert np.abs(one["C.O"] - other["C.O"]).max() < 1e-9


# --- beginnings


def test_a_start_in_overlap_is_told_with_its_depth() -> None:
    text = "A : .disc(5) C=[0,0]; B : .disc(5) C=[3,0]; @0 A.C=[0,0]; B.C=[x,0]; .gap(A, B) >= 0 .pushes; @4"
    with pytest.raises(mv.ScriptError) as told:
        mv.loads(text).solve()
    (error,) = [each for each in told.value.diagnostics if each.severity == "error"]
    assert error.code == "contact/start"
    assert "overlap by 7" in error.message


def test_two_stops_that_contradict_are_told() -> None:
    text = "A : .bar P=[0,0] Q=[5,0]; @0 A.P=[x,0]; A.angle = 0; x >= 3 .pushes; x <= 2 .pushes; @4"
    with pytest.raises(mv.ScriptError) as told:
        mv.loads(text).solve()
    (error,) = [each for each in told.value.diagnostics if each.severity == "error"]
    assert error.code == "constraint/conflict"


def test_the_first_pose_is_pushed_apart() -> None:
    text = "A : .bar P=[0,0] Q=[5,0]; @0 A.P=[x,0]; A.angle = 0; x >= 3 .pushes; @4"
    assert mv.loads(text).solve()["A.P"][0, 0] == pytest.approx(3.0, abs=1e-9)


def test_driven_things_bind() -> None:
    text = """
        A : .bar P=[0,0] Q=[5,0];  B : .bar P=[50,0] Q=[55,0];
        @0 A.P = [10*.t,0];  A.angle = 0;  B.P = [50,0];  B.angle = 0;  B.P.x - A.P.x >= 20 .pushes;
        @4
    """
    with pytest.raises(mv.NoSolutionError) as told:
        mv.loads(text).solve()
    (error,) = [each for each in told.value.diagnostics if each.severity == "error"]
    assert error.code == "solve/binds"
    assert "t = 3" in error.message


def test_velocities_are_those_of_what_pushes() -> None:
    motion = mv.loads(CHAIN).solve()
    moving = motion.times > 0.41
    assert np.abs(motion.velocity("B.O")[moving, 0] - 50.0).max() < 1e-9
    assert np.abs(motion.velocity("B.O")[motion.times < 0.39, 0]).max() < 1e-9


def test_one_of_several_things_pushes() -> None:
    text = """
        .config(10, 300, 100);
        A : .disc(5) C=[0,50];  S[k = 0..2] : .disc(5) C = [40 + 30*k, 50];
        @0 A.C = [20*.t, 50];  .for k = 0..2 { S[k].C = [_, 50]; }
           .gap(A, S[0..2]) >= 0 .pushes;  .gap(S[0], S[1]) >= 0 .pushes;  .gap(S[1], S[2]) >= 0 .pushes;
        @4
    """
    motion = mv.loads(text).solve()
    first = np.maximum(40.0, 20.0 * motion.times + 10.0)
    assert np.abs(motion["S[0].C"][:, 0] - first).max() < 1e-9
    assert np.abs(motion["S[1].C"][:, 0] - np.maximum(70.0, first + 10.0)).max() < 1e-9


@pytest.mark.parametrize("statement", ["A.P.x <= .most;", "A.P.x = .least;"])
def test_only_a_wish_is_for_the_most(statement: str) -> None:
    text = f"A : .bar P=[0,0] Q=[5,0]; @0 A.P.y = 0; A.angle = 0; {statement} @1"
    with pytest.raises(mv.ScriptError) as told:
        mv.loads(text).solve()
    (error,) = [each for each in told.value.diagnostics if each.severity == "error"]
    assert error.code == "kind/mismatch"
    assert "~ ." in error.helps[0]


# --- what is left for a part of a step only

HOOKS = """
    .config(25, 400, 430);
    Rack  : .polygon O = [180,24]  L[k = 0..23] = O + [-14*.mod(k, 2), 18*.floor(k/2) + 2 - 2*.mod(k, 2)]
            A = O + [0,300]  B = O + [40,300]
            R[k = 0..23] = O + [54 - 14*.mod(k, 2), 18*(11 - .floor(k/2)) + 2*.mod(k, 2)]  .through(L, A, B, R);
    Lever : .bar F = [200,270]  R = F + [62,0]  L = F - [62,0]  .through(L, R);
    PawlR : .bar P = [262,270]  M = [168,118]  .width(9);    PawlL : .bar P = [138,270]  M = [232,118]  .width(9);
    HookR : .polygon O = [262,270]  N = [178,132]  M = [160,131]  K = [163,111]  .through(N, M, K);
    HookL : .polygon O = [138,270]  N = [222,132]  M = [240,131]  K = [237,111]  .through(N, M, K);
    @0  Rack.O.x = 180;       Rack.angle = 0;  Rack.O.y ~ .least .weak(2) .speed(200);
        Lever.F = [200,270];  Lever.angle = 13*.sin(180*.t);
        PawlR.P = Lever.R;    HookR.O = Lever.R;  HookR.angle = PawlR.angle;  PawlR.angle ~ .most .weak .speed(400);
        PawlL.P = Lever.L;    HookL.O = Lever.L;  HookL.angle = PawlL.angle;  PawlL.angle ~ .least .weak .speed(400);
        .gap(HookR, Rack) >= 0 .pushes;   .gap(HookL, Rack) >= 0 .pushes;
    @1
"""
"""Two hooks lift a rack by turns. As the lever turns back, at a half, a hook is past a tooth's tip for a ninth of a
time unit: within a step of the solver. It falls to the next tooth then."""


def test_what_passes_a_tip_where_its_drive_turns_back_falls() -> None:
    motion = mv.loads(HOOKS).solve()
    assert ("HookL", "Rack") in [each.things for each in motion.contacts if each.event == "ends" and each.time < 0.45]
    fallen = motion["HookL.angle"][12]
    assert fallen < motion["HookL.angle"][11] - 3.0


@broad("swing", [12.8 + 0.2 * k for k in range(16)], every=8)
def test_two_hooks_lift_a_rack_by_two_teeth_a_period(swing: float) -> None:
    """Where one hook takes over the load, the contacts of both only just bear each other."""
    motion = mv.loads(HOOKS.replace("13*.sin", f"{swing:.9g}*.sin").replace("@1", "@4")).solve()
    height = motion["Rack.O"][:, 1]
    assert height[100] - height[50] == pytest.approx(36.0, abs=1e-6)
