"""The colours of a sprite multiply those of its picture; its alpha stays."""

import numpy as np
import pytest
from PIL import Image

from movimentum.drawing.picture_options import PictureOptions, Quality
from movimentum.rendering.painter import make_painter
from movimentum.scene.model import AnchorRef
from movimentum.things.colors import INK
from tests.command import movimentum
from tests.rendering.scenes import disc_file, pixels, poses, scene, thing

CHANNELS = ("red", "green", "blue")
TINTS = [(255, 128, 0), (0, 0, 0), (7, 255, 200), (254, 254, 254), (12.4, 99.6, 300.0), (-5.0, 80.0, 255.0)]


def noise_file(path, seed, size=(30, 20)):
    """A picture of which every pixel has its own colour and alpha."""
    data = np.random.default_rng(seed).integers(0, 256, (size[1], size[0], 4), dtype=np.uint8)
    Image.fromarray(data).save(path)
    return str(path), data.astype(int)


def tinted(tint):
    return {(0, name): [value] for name, value in zip(CHANNELS, tint, strict=True)}


def painted(image, tint=None, pose=(11, 7, 0), **options):
    where = poses(list(pose), properties=tinted(tint) if tint is not None else None)
    background = options.pop("background", (255, 255, 255))
    made = scene(thing("sprite", image=image), size=(60, 50), background=background)
    return pixels(make_painter(made, where, PictureOptions(**options)).frame(where, 0))


@pytest.mark.parametrize("tint", TINTS)
@pytest.mark.parametrize("quality", [Quality.DRAFT, Quality.STANDARD])
def test_colours_are_multiplied_and_alpha_is_kept(tmp_path, tint, quality):
    image, data = noise_file(tmp_path / "n.png", 3)
    plain = painted(image, transparent=True, quality=quality)[23:43, 11:41]
    found = painted(image, tint, transparent=True, quality=quality)[23:43, 11:41]
    assert (found[..., 3] == data[..., 3]).all()
    factor = np.round(np.clip(tint, 0, 255)) / 255
    assert np.abs(found[..., :3] - plain[..., :3] * factor).max() <= 0.5


def test_over_a_ground_the_tinted_picture_is_composed(tmp_path):
    image, data = noise_file(tmp_path / "n.png", 4)
    ground = np.array([200, 30, 90])
    found = painted(image, (255, 100, 10), background=tuple(ground.tolist()))[23:43, 11:41]
    alpha = data[..., 3:] / 255
    truth = data[..., :3] * (np.array([255, 100, 10]) / 255) * alpha + ground * (1 - alpha)
    assert np.abs(found - truth).max() <= 2.0  # premultiplied in 8 bits, and back


def test_opacity_and_tint_together(tmp_path):
    image = disc_file(tmp_path / "d.png", 20, color=(200, 100, 50))
    where = poses([20, 10, 0], properties=tinted((255, 51, 0)) | {(0, "opacity"): [0.5]})
    made = scene(thing("sprite", image=image), size=(60, 50))
    inside = pixels(make_painter(made, where).frame(where, 0))[50 - 20, 30]
    assert np.abs(inside - [227.5, 137.5, 127.5]).max() <= 1.0


def test_255_is_the_picture_as_it_is(tmp_path):
    image, _ = noise_file(tmp_path / "n.png", 5)
    for pose in ((11, 7, 0), (20.3, 11.7, 31.0)):
        assert (painted(image, (255, 255, 255), pose) == painted(image, pose=pose)).all()


def test_one_colour_alone_leaves_the_others(tmp_path):
    image, _ = noise_file(tmp_path / "n.png", 6)
    where = poses([11, 7, 0], properties={(0, "green"): [0.0]})
    made = scene(thing("sprite", image=image), size=(60, 50), background=(0, 0, 0))
    found, plain = pixels(make_painter(made, where).frame(where, 0)), painted(image, background=(0, 0, 0))
    assert (found[..., 1] == 0).all()
    assert (found[..., [0, 2]] == plain[..., [0, 2]]).all()


def test_a_tint_that_changes_is_drawn_anew_though_nothing_moves(tmp_path):
    image = disc_file(tmp_path / "d.png", 20, color=(200, 200, 200))
    where = poses([20, 10, 0], frames=3, properties={(0, "red"): [255.0, 255.0, 51.0]})
    painter = make_painter(scene(thing("sprite", image=image), size=(60, 50)), where)
    red = [int(pixels(painter.frame(where, i))[30, 30, 0]) for i in range(3)]
    assert red == [200, 200, 40]


def test_a_colour_that_is_stated_later_is_that_of_the_definition_before(tmp_path):
    path = tmp_path / "late.mov"
    path.write_text(
        ".config(1, 60, 40);\nA : .bar P = [10,20] Q = [50,20];\n@0 A.P = [10,20];\n@1 A.red = 255;\n@2 A.red = _;\n"
    )
    assert movimentum("run", path, "-o", tmp_path / "f%d.png").returncode == 0
    colors = []
    for k in range(3):
        with Image.open(tmp_path / f"f{k}.png") as image:
            colors.append(image.convert("RGB").getpixel((30, 20)))
    assert colors == [INK, (255, *INK[1:]), INK]


def test_the_trace_of_a_sprite_is_drawn_in_ink(tmp_path):
    image = disc_file(tmp_path / "d.png", 10)
    where = poses([[5, 40, 0], [50, 40, 0]])
    made = scene(thing("sprite", (0, 0), image=image), size=(60, 50))
    painter = make_painter(made, where, PictureOptions(traces=(AnchorRef(0, 0),)))
    assert painter.traces[0].mark.color == INK
