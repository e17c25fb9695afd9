"""What holds when: the key convention, clocks, lifetimes, frames."""

from __future__ import annotations

from fractions import Fraction

import pytest

from movimentum.errors import ScriptError
from movimentum.timeline.arrange import arrange
from tests.understand import BAR, scene_of, timeline_of


def active(text: str) -> list[list[str]]:
    """What holds in each segment, as the script spells it."""
    timeline = timeline_of(text)
    source = timeline.scene.source
    return [[source.slice(item.span) for item in segment.active] for segment in timeline.segments]


def test_a_step_replaces_what_earlier_steps_stated_under_a_key() -> None:
    assert active("@0 x = 1; y = 2; @1 x = 3; @2 z = 4;") == [
        ["x = 1", "y = 2"],
        ["y = 2", "x = 3"],
        ["y = 2", "x = 3", "z = 4"],
    ]


def test_all_that_one_step_states_under_one_key_holds_together() -> None:
    assert active("@0 x = a; x = b; @1 x = c; x = d; x = e; @2") == [
        ["x = a", "x = b"],
        ["x = c", "x = d", "x = e"],
    ] * 1 + [["x = c", "x = d", "x = e"]]


def test_the_direction_belongs_to_the_key() -> None:
    text = "@0 x = 1; x ~ 2; x < 3; x > 4; @1 x <= 5; @2 x = _; @3 x ~ _; @4 x < _; @5 x > _;"
    assert active(text) == [
        ["x = 1", "x ~ 2", "x < 3", "x > 4"],
        ["x = 1", "x ~ 2", "x > 4", "x <= 5"],
        ["x ~ 2", "x > 4", "x <= 5"],
        ["x > 4", "x <= 5"],
        ["x > 4"],
        [],
    ]


def test_ending_and_stating_in_one_step_is_restating() -> None:
    assert active("@0 x = 1; @1 x = 2; x = _; @2") == [["x = 1"], ["x = 2"], ["x = 2"]]


def test_keys_by_meaning() -> None:
    assert active(BAR + "@0 (Bar.P - Bar.Q).l = 3; Bar.a = 1; @1 ((Bar.P-Bar.Q)).length = 4; Bar.angle = _;") == [
        ["(Bar.P - Bar.Q).l = 3", "Bar.a = 1"],
        ["((Bar.P-Bar.Q)).length = 4"],
    ]


def test_an_anchor_and_its_coordinate_are_two_keys() -> None:
    assert active(BAR + "@0 Bar.P = [0,0]; @1 Bar.P.x = 0;") == [["Bar.P = [0,0]"], ["Bar.P = [0,0]", "Bar.P.x = 0"]]


def lifetime_values(text: str) -> dict[str, list[float]]:
    """For constraints of the form ``name = .iv``: the numbers that .iv became, by segment."""
    found: dict[str, list[float]] = {}
    for segment in timeline_of(text).segments:
        for item in segment.active:
            value = item.right[0].value
            assert value is not None
            found.setdefault(item.key, []).append(value)
    return found


def test_iv_is_how_long_a_constraint_stays_stated() -> None:
    """Until its key is restated or ended, else the end; a step about something else changes nothing."""
    assert lifetime_values("@1 a = .iv; b = .iv; @2 c = .iv; @4 a = 1; b = _; @7.5") == {
        "a": [3.0, 3.0, 1.0, 1.0],
        "b": [3.0, 3.0],
        "c": [5.5, 5.5, 5.5],
    }


def test_a_lifetime_of_zero_counts_as_one() -> None:
    """Of a still picture, of the last step, and of what a step at the same time replaces: .t/.iv is then 0, not 0/0."""
    assert lifetime_values("@3 x = .iv;") == {"x": [1.0]}
    timeline = timeline_of("@0 x = .iv; @0 x = .iv; @2 y = .iv;")
    assert timeline.lifetimes == {0: 0, 1: 2, 2: 0}
    assert [segment.step for segment in timeline.segments] == [1, 2]
    assert timeline.segments[0].active[0].right[0].value == 2.0


def test_division_by_iv_is_found_out_in_no_step() -> None:
    for text in ("@0 x = .t/.iv;", "@0 x = 1; @1 x = .t/.iv;"):
        for segment in timeline_of(text).segments:
            assert not any(item.right[0].op == "lifetime" for item in segment.active)


def test_steps_at_one_time_are_one_segment() -> None:
    timeline = timeline_of(BAR + "@0 x = 1; @+0 x = 2; Bar.P = [0,0]; @1 @1 x = 3;")
    assert [(segment.number, segment.step, segment.start, segment.end) for segment in timeline.segments] == [
        (0, 1, 0, 1),
        (1, 3, 1, 1),
    ]
    assert timeline.segments[0].visible == {0}


def test_times_are_exact() -> None:
    timeline = timeline_of(".config(24000/1001); @0.1 x = 1; @+0.2 @0.3 @+1/3")
    assert [segment.start for segment in timeline.segments] == [Fraction(1, 10), Fraction(3, 10), Fraction(19, 30)]
    assert timeline.fps == Fraction(24000, 1001)
    assert timeline.frame_time(2) == Fraction(1, 10) + 2 * Fraction(1001, 24000)


def test_relative_times() -> None:
    times = [step.time for step in scene_of("@+2 @+1.5 @10 @+1/3 @+(1+1)*2").steps]
    assert times == [2, Fraction(7, 2), 10, Fraction(31, 3), Fraction(43, 3)]
    assert [step.time for step in scene_of("@-3 @-(1) @+0").steps] == [-3, -1, -1]


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("@0", 1),
        ("@5 x = 1;", 1),
        (".config(10); @0 @1", 11),
        (".config(10); @0 @0.95", 10),
        (".config(10); @0.05 @1.05", 11),
        (".config(1/3); @0 @7", 3),
        (".config(24000/1001); @0 @1.001", 25),
        (".config(24000/1001); @0 @1.0009", 24),
        (".config(0.1); @0 @9.99", 1),
    ],
)
def test_frames(text: str, frames: int) -> None:
    timeline = timeline_of(text)
    assert timeline.frame_count == frames
    assert timeline.frame_time(0) == timeline.start
    assert timeline.frame_time(frames - 1) <= timeline.end < timeline.frame_time(frames)


def test_steps_between_frames_count_from_the_next_frame_on() -> None:
    timeline = timeline_of(".config(10); @0 x = 1; @0.25 x = 2; @0.3 x = 3; @1")
    belongs = [timeline.segment_at(timeline.frame_time(frame)) for frame in range(5)]
    assert belongs == [0, 0, 0, 2, 2]
    assert timeline.segment_at(Fraction(1, 4)) == 1
    assert timeline.segment_at(Fraction(1)) == 3


def test_another_rate() -> None:
    scene = scene_of(".config(10); @0 @1")
    assert arrange(scene, fps=Fraction(1, 2)).frame_count == 1
    assert arrange(scene, fps=1000).frame_count == 1001


def test_the_limit_of_frames() -> None:
    scene = scene_of(".config(10); @0 x = 1; @1")
    assert arrange(scene, max_frames=11).frame_count == 11
    for limit, fps in ((10, None), (10, 1000)):
        with pytest.raises(ScriptError) as raised:
            arrange(scene, fps=fps, max_frames=limit)
        assert raised.value.diagnostics[0].code == "limit/frames"
        assert "--max-frames" in raised.value.diagnostics[0].helps[0]


def test_things_appear_with_the_first_step_that_mentions_them() -> None:
    timeline = timeline_of(
        "Sky : 'sky.png';\nA : .bar P = [0,0] Q = [1,0];\nB : .bar P = [0,0] Q = [1,0];\n"
        "@0 A.P = [0,0]; @1 x = B.angle; @2 A.P = _; B.P = [0,0];"
    )
    assert [segment.visible for segment in timeline.segments] == [{0, 1}, {0, 1, 2}, {0, 1, 2}]


def test_a_clock_runs_on_through_steps_about_something_else() -> None:
    timeline = timeline_of("@1 x = .t; @2 y = 1; @3 x = .t; @4")
    clocks = [[item.right[0].payload for item in segment.active if item.key == "x"] for segment in timeline.segments]
    assert clocks == [[1], [1], [3], [3]]


def test_statement_order_makes_no_difference_to_what_holds() -> None:
    one = timeline_of("@0 x = 1; y = 2; @1 x = _; z = 3; @2 y = 5;")
    other = timeline_of("@0 y = 2; x = 1; @1 z = 3; x = _; @2 y = 5;")
    for a, b in zip(one.segments, other.segments, strict=True):
        assert {(item.key, item.right) for item in a.active} == {(item.key, item.right) for item in b.active}
