"""Pictures turn about the right point, move without hopping, and have neither rims nor halos nor stairs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from movimentum.drawing.picture_options import PictureOptions, Quality
from movimentum.rendering.painter import make_painter
from tests.rendering.scenes import BLACK, disc_file, pixels, poses, scene, square_file, thing


def painted(things, where, size=(100, 80), background=(255, 255, 255), **options):
    made = scene(*things, size=size, background=background)
    return pixels(make_painter(made, where, PictureOptions(**options)).frame(where, 0))


def weight(image, background=255):
    """How far each pixel is from the background, in its red channel."""
    return abs(image[..., 0] - background).astype(float)


def centroid(image):
    w = weight(image)
    rows, columns = np.indices(w.shape)
    return ((columns + 0.5) * w).sum() / w.sum(), ((rows + 0.5) * w).sum() / w.sum()


def test_an_unturned_sprite_at_whole_pixels_is_its_file(tmp_path):
    rng = np.random.default_rng(1)
    data = rng.integers(0, 256, (30, 40, 3), dtype=np.uint8)
    Image.fromarray(data).save(tmp_path / "noise.png")
    image = painted([thing("sprite", image=str(tmp_path / "noise.png"))], poses([7, 11, 0]))
    # lower-left corner at world (7, 11): rows 80 - 11 - 30 to 80 - 11
    assert (image[39:69, 7:47] == data).all()
    image[39:69, 7:47] = 255
    assert (image == 255).all()


@pytest.mark.parametrize("degrees", [0, 17.5, 90, 135, 200, 271])
def test_a_sprite_turns_about_its_local_origin(tmp_path, degrees):
    path = square_file(tmp_path / "s.png", 20)
    a = math.radians(degrees)
    image = painted([thing("sprite", image=path)], poses([50, 40, degrees]))
    x = 50 + math.cos(a) * 10 - math.sin(a) * 10
    y = 40 + math.sin(a) * 10 + math.cos(a) * 10
    assert centroid(image) == pytest.approx((x, 80 - y), abs=0.06)


def test_moving_and_turning_slowly_does_not_hop(tmp_path):
    path = disc_file(tmp_path / "d.png", 40)
    for k in range(40):
        x, degrees = 30 + 0.05 * k, 0.9 * k
        a = math.radians(degrees)
        image = painted([thing("sprite", image=path)], poses([x, 25 + 0.03 * k, degrees]))
        centre = (
            x + 20 * math.cos(a) - 20 * math.sin(a),
            80 - (25 + 0.03 * k + 20 * math.sin(a) + 20 * math.cos(a)),
        )
        assert centroid(image) == pytest.approx(centre, abs=0.02)  # whole pixels would be off by up to 0.5


def test_no_halo_of_hidden_colours(tmp_path):
    # clear pixels hold bright green, as editors may leave them: none of it may show
    path = disc_file(tmp_path / "d.png", 50, color=(200, 30, 30), hidden_color=(0, 255, 0))
    for degrees in (0, 30, 77):
        image = painted([thing("sprite", image=path)], poses([45, 15, degrees]), background=(250, 40, 40))
        assert image[..., 1].max() <= 41
        assert image[..., 0].min() >= 199


def test_no_dark_or_bright_rims(tmp_path):
    # a mid-grey disc on mid-grey ground is invisible at any angle, size and quality
    path = disc_file(tmp_path / "d.png", 64, color=(128, 128, 128), hidden_color=(0, 0, 0))
    for quality in Quality:
        for degrees, scale in ((0, 1.0), (31, 1.0), (200.4, 0.4), (12, 1.7)):
            image = painted(
                [thing("sprite", image=path, scale=scale)],
                poses([30.3, 20.7, degrees]),
                background=(128, 128, 128),
                quality=quality,
            )
            assert abs(image - 128).max() <= 2


def test_an_opaque_sprite_has_smooth_edges(tmp_path):
    path = square_file(tmp_path / "s.png", 40, BLACK)
    image = painted([thing("sprite", image=path)], poses([40, 15, 10]))[..., 0]
    # the lower edge rises by tan(10°) a column: its height, read off the grey values, is a straight line
    column = slice(46, 74)
    height = (255 - image[40:, column]).sum(axis=0) / 255.0
    steps = np.diff(height)
    assert steps == pytest.approx(np.full(len(steps), -math.tan(math.radians(10))), abs=0.09)
    assert len(np.unique(image)) > 20


def test_a_sprite_made_smaller_is_averaged(tmp_path):
    # fine stripes: sampled they would alias, averaged they are grey
    stripes = np.zeros((200, 200, 3), dtype=np.uint8)
    stripes[:, ::2] = 255
    Image.fromarray(stripes).save(tmp_path / "fine.png")
    for scale in (0.35, 0.25, 0.13, 0.04):
        image = painted(
            [thing("sprite", image=str(tmp_path / "fine.png"), scale=scale)],
            poses([10, 5, 0]),
        )
        side = int(200 * scale)
        inner = image[80 - 5 - side + 2 : 80 - 5 - 2, 12 : 10 + side - 2]
        assert inner.size
        assert abs(inner - 127.5).max() < 8
        assert abs(inner.mean() - 127.5) < 4


def test_size_and_place_of_a_scaled_sprite_are_exact(tmp_path):
    path = square_file(tmp_path / "s.png", 101, BLACK)
    for scale in (0.1, 0.237, 0.5, 0.71):
        w = weight(painted([thing("sprite", image=path, scale=scale)], poses([5.3, 4.6, 0])))
        side = 101 * scale
        assert w.sum() / 255.0 == pytest.approx(side * side, rel=0.01)
        rows, columns = np.indices(w.shape)
        assert ((columns + 0.5) * w).sum() / w.sum() == pytest.approx(5.3 + side / 2, abs=0.02)
        assert ((rows + 0.5) * w).sum() / w.sum() == pytest.approx(80 - 4.6 - side / 2, abs=0.02)


def test_a_mirrored_picture_would_be_seen(tmp_path):
    # an L shape: which corner is filled tells handedness and the direction of turning
    data = np.zeros((20, 20, 4), dtype=np.uint8)
    data[10:, :10] = (0, 0, 0, 255)  # lower-left quarter of the file
    Image.fromarray(data).save(tmp_path / "l.png")
    image = painted([thing("sprite", image=str(tmp_path / "l.png"))], poses([50, 40, 90]))
    # turned a quarter counter-clockwise about (50, 40), the filled square is at x 40…50, y 40…50
    assert (image[31:39, 41:49] == 0).all()
    assert weight(image).sum() == pytest.approx(255 * 100, rel=0.001)


def test_high_quality_is_nearer_to_the_truth(tmp_path):
    path = disc_file(tmp_path / "d.png", 60, BLACK)
    made, where = scene(thing("sprite", image=path)), poses([42.3, 9.8, 27])
    exact = pixels(replace(make_painter(made, where), supersample=8).frame(where, 0))
    errors = {}
    for quality in Quality:
        painter = make_painter(made, where, PictureOptions(quality=quality))
        errors[quality] = float(np.sqrt(((pixels(painter.frame(where, 0)) - exact) ** 2).mean()))
    assert errors[Quality.HIGH] < 0.5 * errors[Quality.STANDARD] < 0.2 * errors[Quality.DRAFT]


def test_a_sprite_that_is_wholly_clear_draws_nothing(tmp_path):
    Image.new("RGBA", (30, 30), (255, 0, 0, 0)).save(tmp_path / "c.png")
    assert (painted([thing("sprite", image=str(tmp_path / "c.png"))], poses([20, 20, 5])) == 255).all()
