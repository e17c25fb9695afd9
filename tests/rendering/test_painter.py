"""What is drawn, in which order, how large; what stands still; overlays."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from movimentum.drawing.picture_options import FreeMark, PictureOptions, Quality, Show, trace_anchors
from movimentum.errors import ScriptError, UsageError
from movimentum.geometry import View
from movimentum.rendering import painter as painter_module
from movimentum.rendering.painter import PaintSession, make_painter
from movimentum.rendering.stream import Spool, kept_frames, pieces, thinned
from movimentum.scene.model import AnchorRef
from tests.broad import broad
from tests.rendering.scenes import BLACK, disc_file, line, pixels, poses, scene, square_file, thing

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)


def bar(*points, **fields):
    return thing("bar", *points, **{"width": 10.0, "color": BLACK, **fields})


def frame(made, where, i=0, **options):
    return pixels(make_painter(made, where, PictureOptions(**options)).frame(where, i))


def test_a_bar_goes_through_its_anchors_and_meets_others():
    made = scene(bar((0, 0), (40, 0), color=RED), bar((0, 0), (0, 30), color=BLUE))
    where = poses([20, 20, 30], [20 + 40 * np.cos(np.pi / 6), 40, 0])
    image = frame(made, where)
    x, y = 20 + 40 * np.cos(np.pi / 6), 40
    assert tuple(image[80 - 20, 20]) == RED
    assert tuple(image[int(80 - y), int(x)]) == BLUE  # where the two are pinned


def test_opacity_lets_the_ground_through_evenly():
    points = [(0, 0), (50, 0), (10, 30), (40, -15)]
    made = scene(bar(*points, color=BLACK))
    where = poses([20, 30, 0], properties={(0, "opacity"): [0.5]})
    image = frame(made, where)[..., 0]
    solid = frame(made, poses([20, 30, 0]))[..., 0]
    assert abs(image - (255 + solid) / 2).max() <= 1.5  # no darker joints, no darker crossing
    assert (frame(made, poses([20, 30, 0], properties={(0, "opacity"): [0.0]})) == 255).all()
    assert (frame(made, poses([20, 30, 0], properties={(0, "opacity"): [1.7]}))[..., 0] == solid).all()


def test_opacity_of_a_sprite(tmp_path):
    made = scene(thing("sprite", image=square_file(tmp_path / "s.png", 30, (0, 100, 200))))
    image = frame(made, poses([10, 10, 0], properties={(0, "opacity"): [0.25]}))
    assert abs(image[50, 20] - np.array([191.25, 216.25, 241.25])).max() <= 1


def test_colours_from_constraints():
    made = scene(bar((0, 0), (40, 0), color=RED))
    image = frame(made, poses([20, 20, 0], properties={(0, "red"): [12.0], (0, "blue"): [999.0]}))
    assert tuple(image[60, 40]) == (12, 0, 255)


def test_order_of_drawing():
    def crossing(first, second):
        made = scene(bar((0, 0), (60, 0), color=RED, **first), bar((30, -30), (30, 30), color=BLUE, **second))
        return tuple(frame(made, poses([20, 40, 0], [20, 40, 0]))[40, 50])

    assert crossing({}, {}) == BLUE
    assert crossing({"layer": 5.0}, {}) == RED
    assert crossing({"layer": 1.0}, {"layer": 1.0}) == BLUE
    assert crossing({}, {"layer": -1.0}) == RED


def test_hidden_and_not_yet_visible():
    made = scene(bar((0, 0), (40, 0), hidden=True), bar((0, 0), (40, 0)))
    where = poses([20, 20, 0], [20, 60, 0], visible=[[True, True], [False, True]], frames=2)
    assert (frame(made, where, 0) == 255).all()
    second = frame(made, where, 1)
    assert tuple(second[20, 40]) == BLACK
    assert tuple(second[60, 40]) == (255, 255, 255)


def test_lines_follow_other_things_and_wait_for_them():
    made = scene(
        thing("disc", (0, 0), radius=3.0, hidden=True),
        thing("disc", (0, 0), radius=3.0, hidden=True),
        line((0, 0), (1, 0), width=6.0, color=GREEN),
    )
    where = poses(
        [10, 40, 0], [[60, 40, 0], [90, 40, 0], [90, 40, 0]], [0, 0, 0], visible=[[1, 1, 1], [1, 1, 0], [1, 1, 1]]
    )
    assert tuple(frame(made, where, 0)[40, 58]) == GREEN
    assert tuple(frame(made, where, 0)[40, 75]) == (255, 255, 255)
    assert tuple(frame(made, where, 1)[40, 75]) == GREEN
    assert (frame(made, where, 2) == 255).all()


def test_arrows_end_at_their_last_anchor():
    made = scene(thing("arrow", (0, 0), (60, 0), width=4.0, color=BLACK))
    image = 255 - frame(made, poses([20, 40, 0]))[..., 0]
    columns = np.flatnonzero(image.any(axis=0))
    assert columns[-1] in (78, 79)  # the tip is at x = 80
    heights = (image > 0).sum(axis=0)
    assert heights[30] in (4, 5)
    assert heights[60:80].max() > 11  # the head
    assert heights[78] < 4


def test_discs_rings_and_labels():
    made = scene(
        thing("disc", (0, 0), radius=12.0, color=RED),
        thing("disc", (0, 0), radius=12.0, width=4.0, color=BLUE),
        thing("label", (0, 0), text="Hello", color=GREEN),
    )
    image = frame(made, poses([20, 20, 0], [60, 20, 0], [10, 60, 0]))
    assert tuple(image[60, 20]) == RED
    assert tuple(image[60, 60]) == (255, 255, 255)
    assert tuple(image[60, 72]) == BLUE
    written = np.argwhere((image[:40, :, 0] < 128) & (image[:40, :, 1] > 128))
    assert len(written) > 30
    assert written[:, 0].max() <= 20  # on the baseline at y = 60
    assert 10 <= written[:, 1].min() <= 13  # from x = 10 on
    turned = frame(made, poses([20, 20, 0], [60, 20, 0], [50, 40, 90]))
    written = np.argwhere((turned[:, :, 0] < 128) & (turned[:, :, 1] > 128) & (turned[:, :, 2] < 128))
    assert np.ptp(written[:, 0]) > np.ptp(written[:, 1])  # text turns with its thing


# --- what stands still ------------------------------------------------------------------------------------------


def every_frame_anew(painter, where):
    return [pixels(painter.frame(where, i)) for i in range(len(where.frames))]


@pytest.mark.parametrize("quality", list(Quality))
@pytest.mark.parametrize("transparent", [False, True])
def test_the_still_part_changes_no_pixel(tmp_path, quality, transparent):
    rng = np.random.default_rng(4)
    path = disc_file(tmp_path / "d.png", 40)
    made = scene(
        thing("sprite", image=path),
        bar((0, 0), (40, 0), color=RED),
        bar((0, 0), (50, 10), color=BLUE),
        bar((0, 0), (30, 0), color=GREEN, layer=-3.0),
        thing("disc", (0, 0), radius=9.0, color=BLACK),
        line((1, 1), (4, 0)),
    )
    frames = 9
    wander = np.cumsum(rng.uniform(-3, 3, (frames, 3)), axis=0) + np.array([40, 40, 0])
    wander[4:6] = wander[3]  # a rest
    where = poses(
        [10, 10, 20],
        [30, 60, 0],
        wander,
        [60, 20, 0],
        [70, 30, 0],
        [0, 0, 0],
        properties={(3, "opacity"): [1, 1, 1, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5]},
    )
    options = PictureOptions(quality=quality, transparent=transparent, traces=(AnchorRef(2, 1),))
    painter = make_painter(made, where, options)
    expected = every_frame_anew(painter, where)
    for size in (1, 3, 4, 9):
        told = list(told_changes(PaintSession(painter), pieces([where], size)))
        assert all((a == b).all() for a, b in zip(told, expected, strict=True))


def told_changes(session, parts):
    """The pictures, each made from the one before by nothing but the rectangles that are told to have changed."""
    image = None
    for frame in (frame for part in parts for frame in session.changes(part)):
        if image is None:
            image = np.full_like(pixels(frame.image), -1)
        for left, top, right, bottom in frame.changed:
            now = pixels(frame.image)[top:bottom, left:right]
            assert (
                ((now != image[top:bottom, left:right]).any(axis=2)[[0, -1]]).any(axis=1).all()
            )  # no larger than needed
            image[top:bottom, left:right] = now
        yield image.copy()


def crowd(tmp_path, frames, seed):
    """Many things of all kinds, some at rest at some times, some faded, some outside."""
    rng = np.random.default_rng(seed)
    look = {"edge": BLACK, "fill": (250, 200, 100), "pins": 3.0}
    things = [
        thing("sprite", image=disc_file(tmp_path / "d.png", 40)),
        bar((0, 0), (60, 10), **look, width=14.0),
        thing("disc", (0, 0), radius=20.0, **look, width=0.1),
        thing("gear", (0, 0), teeth=9, module=4.0),
        thing("plate", (0, 0), (40, 0), (20, 30), edge=BLACK, dash=(5.0, 3.0)),
        thing("label", (0, 0), text="Text"),
        bar((-300, -2), (300, 3), width=0.2),
        thing("ground", (0, 0)),
    ]
    trace = thing("trace", through=(AnchorRef(1, 1),), width=5.0, color=BLUE)
    tail = thing("trace", through=(AnchorRef(4, 1),), width=3.0, color=RED, tail=0.3)
    dashed = thing("trace", through=(AnchorRef(3, 0),), width=1.0, color=RED, dash=(6.0, 3.0), cap="butt")
    paths = []
    for _ in things:
        path = np.cumsum(rng.uniform(-6, 6, (frames, 3)) * (rng.random((frames, 1)) < 0.6), axis=0)
        paths.append(path + rng.uniform((0, 0, 0), (150, 120, 360)))
    fading = {(n, "opacity"): np.clip(np.cumsum(rng.uniform(-0.2, 0.2, frames)) + 0.6, 0, 1) for n in (1, 3, 4)}
    made = scene(*things, trace, tail, dashed, line((1, 1), (4, 0)), size=(150, 120))
    return made, poses(*paths, [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], properties=fading)


@broad("quality", list(Quality), first=1)
@broad("transparent", [False, True], first=1)
def test_what_is_told_to_change_is_all_that_changes_whatever_moves(tmp_path, quality, transparent):
    made, where = crowd(tmp_path, 24, 8)
    painter = make_painter(made, where, PictureOptions(quality=quality, transparent=transparent))
    expected = every_frame_anew(painter, where)
    for size in (5, 24):
        told = list(told_changes(PaintSession(painter), pieces([where], size)))
        assert all((a == b).all() for a, b in zip(told, expected, strict=True))


def test_what_takes_too_much_room_is_drawn_when_it_is_needed(tmp_path, monkeypatch):
    made, where = crowd(tmp_path, 12, 9)
    painter = make_painter(made, where)
    expected = every_frame_anew(painter, where)
    monkeypatch.setattr(painter_module, "_KEPT", 0.2)
    told = list(told_changes(PaintSession(painter), [where]))
    assert all((a == b).all() for a, b in zip(told, expected, strict=True))


def test_a_disc_that_turns_about_its_centre_changes_nothing():
    look = {"edge": BLACK, "fill": (250, 200, 100), "pins": 4.0}
    for fields in ({"radius": 23.3, **look}, {"radius": 17.0}, {"radius": 30.1, "width": 0.4}):
        made = scene(thing("disc", (7.0, -3.0), **fields))
        turns = np.radians(np.linspace(0, 300, 40))
        x, y = 7.0 * np.cos(turns) + 3.0 * np.sin(turns), 7.0 * np.sin(turns) - 3.0 * np.cos(turns)
        where = poses(np.stack([50.5 - x, 40.0 - y, np.degrees(turns)], axis=1))
        frames = list(PaintSession(make_painter(made, where)).changes(where))
        assert [len(frame.changed) for frame in frames] == [1] + 39 * [0]


def test_a_scene_at_rest_is_drawn_once():
    made = scene(bar((0, 0), (40, 0)))
    where = poses([20, 20, 0], frames=50)
    frames = list(PaintSession(make_painter(made, where)).changes(where))
    assert [frame.changed for frame in frames] == [((0, 0, 100, 80),), *[()] * 49]


# --- the canvas ---------------------------------------------------------------------------------------------------


def test_the_canvas_fits_all_that_is_drawn_at_any_time(tmp_path):
    made = scene(
        bar((0, 0), (100, 0), width=10.0),
        bar((0, 0), (1, 0), hidden=True),
        thing("sprite", image=disc_file(tmp_path / "d.png", 40)),
        size=None,
    )
    where = poses([[-50, 30, 0], [200, 30, 90]], [9999, 0, 0], [[0, 0, 0], [10, -60, 0]])
    painter = make_painter(made, where)
    # bar: x -55 … 205, y 25 … 135; disc: from y -60 + 4 (its clear corner is not drawn)
    left, bottom, right, top = -55, -56, 205, 135
    margin = 0.05 * (right - left)
    view = painter.view
    assert view.left == pytest.approx(left - margin, abs=1)
    assert view.bottom == pytest.approx(bottom - margin, abs=2.5)
    assert view.left + view.width == pytest.approx(right + margin, abs=1)
    assert view.bottom + view.height == pytest.approx(top + margin, abs=1)
    for i in range(2):
        edge = pixels(painter.frame(where, i))
        assert (edge[[0, -1]] == 255).all()
        assert (edge[:, [0, -1]] == 255).all()
    # the same when poses come chunk by chunk
    assert make_painter(made, [where.select(slice(0, 1)), where.select(slice(1, 2))]).view == view


def test_an_empty_picture_has_a_pixel():
    made = scene(bar((0, 0), (1, 0), hidden=True), size=None)
    assert make_painter(made, poses([0, 0, 0])).size == (1, 1)


def test_scale_multiplies_pixels(tmp_path):
    made = scene(thing("sprite", image=square_file(tmp_path / "s.png", 20, BLACK)), bar((0, 0), (30, 0), width=8.0))
    where = poses([10, 10, 0], [50, 50, 0])
    for scale in (0.5, 2.0, 3.0):
        painter = make_painter(made, where, PictureOptions(scale=scale))
        assert painter.size == (100 * scale, 80 * scale)
        image = 255 - pixels(painter.frame(where, 0))[..., 0]
        dark = image.sum() / 255
        assert dark == pytest.approx((400 + 30 * 8 + np.pi * 16) * scale**2, rel=0.02)
    for wrong in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(UsageError):
            make_painter(made, where, PictureOptions(scale=wrong))


def test_too_large_a_canvas_is_refused_before_anything_is_read(tmp_path):
    made = scene(thing("sprite", image=str(tmp_path / "missing.png")), size=(10**7, 10**7))
    for options in (PictureOptions(), PictureOptions(scale=1e300)):
        with pytest.raises(ScriptError) as caught:
            make_painter(made, poses([0, 0, 0]), options)
        assert [item.code for item in caught.value.diagnostics] == ["limit/pixels"]
    far = scene(bar((0, 0), (1e9, 1e9)), size=None)
    with pytest.raises(ScriptError) as caught:
        make_painter(far, poses([0, 0, 0]))
    assert caught.value.diagnostics[0].code == "limit/pixels"
    small = scene(size=(100, 100))
    with pytest.raises(ScriptError):
        make_painter(small, poses([0, 0, 0]), PictureOptions(max_pixels=9999))


def test_backgrounds():
    where = poses([50, 40, 0])
    dot = thing("disc", (0, 0), radius=10.0, color=RED)
    assert tuple(frame(scene(dot, background=None), where)[0, 0]) == (255, 255, 255)
    assert tuple(frame(scene(dot, background=(1, 2, 3)), where)[0, 0]) == (1, 2, 3)
    assert tuple(frame(scene(dot, background=(1, 2, 3)), where, background=(7, 8, 9))[0, 0]) == (7, 8, 9)
    clear = frame(scene(dot), where, transparent=True)
    assert clear.shape[2] == 4
    assert clear[0, 0, 3] == 0
    assert tuple(clear[40, 50]) == (*RED, 255)


def test_a_transparent_picture_over_a_ground_is_the_opaque_picture(tmp_path):
    from PIL import Image

    made = scene(
        thing("sprite", image=disc_file(tmp_path / "d.png", 40)),
        bar((0, 0), (50, 20), color=BLUE),
        background=(9, 99, 200),
    )
    where = poses([20, 20, 33], [30, 30, 0], properties={(1, "opacity"): [0.6]})
    for quality in (Quality.STANDARD, Quality.HIGH):
        clear = make_painter(made, where, PictureOptions(transparent=True, quality=quality)).frame(where, 0)
        laid = Image.alpha_composite(Image.new("RGBA", clear.size, (9, 99, 200, 255)), clear).convert("RGB")
        assert abs(pixels(laid) - frame(made, where, quality=quality)).max() <= 3


# --- overlays -----------------------------------------------------------------------------------------------------


def traced(frames=12):
    made = scene(bar((0, 0), (30, 0), color=RED, hidden=True))
    angles = np.linspace(0, 300, frames)
    where = poses(np.stack([np.full(frames, 50.0), np.full(frames, 40.0), angles], axis=1))
    return made, where, PictureOptions(traces=(AnchorRef(0, 1),))


def test_a_trace_grows_along_the_path():
    made, where, options = traced(200)
    painter = make_painter(made, where, options)
    counts = [int((pixels(painter.frame(where, i))[..., 1] < 200).sum()) for i in (0, 50, 100, 199)]
    assert counts == sorted(counts)
    assert counts[0] < 9
    image = pixels(painter.frame(where, 199))
    rows, columns = np.nonzero(image[..., 1] < 128)
    radius = np.hypot(columns + 0.5 - 50, 80 - rows - 0.5 - 40)
    assert radius.min() > 28.5
    assert radius.max() < 31.5
    assert counts[-1] == pytest.approx(2 * np.pi * 30 * 300 / 360 * 1.6, rel=0.35)


def test_a_trace_is_the_same_however_the_frames_come():
    made, where, options = traced(20)
    painter = make_painter(made, where, options)
    whole = [pixels(image) for image in PaintSession(painter).frames(where)]
    assert all((pixels(painter.frame(where, i)) == whole[i]).all() for i in range(20))
    session = PaintSession(painter)  # a worker that draws only the frames 13 to 19
    assert all(
        (pixels(image) == expected).all()
        for image, expected in zip(session.frames(where.select(slice(13, 20))), whole[13:], strict=True)
    )


def test_a_trace_has_a_gap_where_its_thing_is_not_there():
    made = scene(bar((0, 0), (1, 0), color=BLACK, width=0.01))
    shown = [[1, 1, 0, 0, 1, 1]]
    where = poses([[x, 40, 0] for x in (5, 25, 35, 55, 65, 85)], visible=shown)
    image = frame(made, where, 5, traces=(AnchorRef(0, 0),))[40, :, 0]
    assert image[15] < 128
    assert image[45] == 255
    assert image[75] < 128


def test_names_anchors_and_free_motions_are_written():
    made = scene(bar((0, 0), (40, 0), name="Crank"))
    where = poses([20, 40, 0])
    bare = frame(made, where)
    for show, free in ((Show.NAMES, ()), (Show.ANCHORS, ()), (Show.FREE, (FreeMark(0, (0.0, 0.0), (1.0, 0.0)),))):
        assert (frame(made, where, show=frozenset({show}), free=free) != bare).any()
    slide = frame(made, where, show=frozenset({Show.FREE}), free=(FreeMark(0, (20.0, 0.0), (0.0, 1.0)),))
    changed = np.argwhere((slide != bare).any(axis=2))
    assert np.ptp(changed[:, 0]) > 30  # along the thing's own y
    assert np.ptp(changed[:, 1]) < 16


def test_names_of_anchors_to_trace():
    made = scene(bar((0, 0), (1, 0), name="Crank"))
    assert trace_anchors(made, ("Crank.B",)) == (AnchorRef(0, 1),)
    with pytest.raises(UsageError) as caught:
        trace_anchors(made, ("Crank.C", "x"))
    assert [item.code for item in caught.value.diagnostics] == ["name/unknown-anchor"] * 2
    assert caught.value.diagnostics[0].helps


# --- values -------------------------------------------------------------------------------------------------------


def test_a_painter_can_be_sent_to_another_process(tmp_path):
    made = scene(
        thing("sprite", image=disc_file(tmp_path / "d.png", 30)), thing("label", (0, 0), text="ab"), bar((0, 0), (9, 9))
    )
    where = poses([20, 20, 40], [60, 60, 10], [50, 50, 0])
    options = PictureOptions(traces=(AnchorRef(2, 1),), show=frozenset(Show), quality=Quality.HIGH)
    painter = make_painter(made, where, options)
    again = pickle.loads(pickle.dumps(painter))
    assert (pixels(again.frame(where, 0)) == pixels(painter.frame(where, 0))).all()
    assert replace(painter, view=View(0, 0, 10, 10)).size == (10, 10)


def test_streams_of_poses():
    where = poses([[k, 0, 0] for k in range(23)])
    parts = [where.select(slice(a, b)) for a, b in ((0, 4), (4, 5), (5, 20), (20, 23))]
    for size in (1, 5, 7, 30):
        regrouped = list(pieces(parts, size))
        assert [len(part.frames) for part in regrouped[:-1]] == [size] * (len(regrouped) - 1)
        assert np.concatenate([part.frames for part in regrouped]).tolist() == list(range(23))
    with Spool(iter(parts)) as spool:
        for _ in range(2):
            assert np.concatenate([part.origin for part in spool], axis=1).tolist() == where.origin.tolist()
    with pytest.raises(TypeError):
        make_painter(scene(bar((0, 0), (1, 0)), size=None), iter(parts))


def test_thinning_takes_the_frame_shown_at_each_instant():
    from fractions import Fraction

    where = poses([[k, 0, 0] for k in range(240)])
    for fps in (Fraction(60), Fraction(100), Fraction(60000, 1001), Fraction(51), Fraction(1000)):
        keep = kept_frames(240, fps, 50)
        for parts in ([where], [where.select(slice(a, a + 7)) for a in range(0, 240, 7)]):
            kept = np.concatenate([part.frames for part in thinned(parts, fps, 50, keep)])
            assert kept.tolist() == [int(j * fps / 50) for j in range(keep)]
