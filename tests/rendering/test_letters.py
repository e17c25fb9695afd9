"""Labels with more than plain letters: drawn with a font that has them, or told."""

import numpy as np
import pytest

from movimentum.drawing.style import SLANT
from movimentum.rendering import faces
from movimentum.rendering.layout import laid_out, width_of
from movimentum.rendering.off_canvas import ASIDE, UP, WIDEST
from movimentum.rendering.outlines import text_outline
from movimentum.rendering.painter import PaintSession, make_painter
from movimentum.rendering.text import text_sprite
from movimentum.text import is_plain
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined
from tests.drawing.test_outlines import rings
from tests.solver.scenes import scene_of


def corners_of(path):
    return [corner for ring in rings(path) for corner in ring]


def picture_of(text):
    solution = examined(arranged(scene_of(text), Choices()), Choices())
    poses = solution.motion.poses(0, 1)
    return make_painter(solution.motion.timeline.scene, (poses,)).frame(poses, 0)


def drawn(text):
    sprite = text_sprite(text, 16.0, 4.0)
    return None if sprite is None else np.asarray(sprite.image)


@pytest.mark.parametrize("character", "θωΩπαβΔΣ→←↔²³°éüñßøŁčжЯ∫√≈≤≥±×·½")
def test_the_font_that_ships_has_what_engineers_write(character):
    face = faces.face_of(character)
    assert face is not None
    assert faces.missing(character) == ""
    glyph = drawn(character)
    assert glyph is not None
    assert glyph.max() > 128


def test_plain_letters_are_in_shipped_fonts_and_in_the_box_that_is_assumed_of_them():
    letters = [chr(code) for code in range(0x2200) if is_plain(chr(code))]
    assert len(letters) > 400
    for letter in letters:
        assert faces.face_of(letter).name in faces.SHIPPED
        for part in laid_out(letter):
            left, top, right, bottom = part.face.at(1000.0).getbbox(part.text, anchor="ls")
            # a raised, and a slanted one is drawn so much higher, and to the side
            assert 340 - 0.7 * top <= 1000 * UP
            assert 160 + 0.7 * bottom <= 1000 * ASIDE
            assert part.width <= WIDEST
            assert -left + SLANT * bottom <= 1000 * ASIDE
            assert right - 1000 * part.width - SLANT * top <= 1000 * ASIDE


def test_different_letters_look_different():
    pictures = [drawn(c).tobytes() for c in "θωπΔ→"]
    assert len(set(pictures)) == 5


LABELS = (
    "θ = 47°", "crank", "Rod B", "φ₁₂ = 35.2°", "ω = 3 rad/s", "x₁ ≤ 260", "r = 50 mm", "A₀  B′  C″", "Δs = −0.25",
    "2πr·n", "v_max → 12.5", "P(t)", "Σ F = 0", "α + β + γ", "½ m v²", "√2 ≈ 1.414", "Ωₙ ∞ ±5 %", "Gas 20 °C",
    "Il1 O0 rn m", "Größe: Łódź, жук",
)  # fmt: skip


@pytest.mark.parametrize("label", LABELS)
def test_all_labels_of_a_film_have_one_typeface(label):
    assert [(face.name, text) for face, text in faces.runs(label)] == [("Inter-Regular.otf", label)]


def test_only_what_the_typeface_lacks_is_drawn_in_another():
    pieces = [(face.name, text) for face, text in faces.runs("F = ∮ a⃗ ds")]
    assert pieces == [
        ("Inter-Regular.otf", "F = "),
        ("DejaVuSans.ttf", "∮ a⃗ "),
        ("Inter-Regular.otf", "ds"),
    ]


@pytest.mark.parametrize("label", LABELS)
def test_a_text_is_equally_wide_at_every_scale_and_in_every_output(label):
    wide = width_of(label)
    last = laid_out(label)[-1]
    assert last.x + last.width == wide
    for magnification in (0.7, 1.0, 1.3, 2.0, 5.0):
        sprite = text_sprite(label, 16.0, magnification)
        corners = [x for x, _ in sprite.local_corners()]
        ink = [x for path in [text_outline(label)] for x, _ in corners_of(path)]
        pixel = 1.0 / magnification
        assert min(corners) - min(ink) * 16 / 1000 == pytest.approx(0.0, abs=2.6 * pixel)
        assert max(corners) - max(ink) * 16 / 1000 == pytest.approx(0.0, abs=2.6 * pixel)


@pytest.mark.parametrize("place", [(20.0, 30.0), (20.4, 30.3), (20.5, 29.8)])
def test_a_label_stands_at_whole_pixels(place):
    text = f".config(10, 120, 60); L : .label('Illumination') at = [{place[0]}, {place[1]}]; @0 @1"
    pixels = np.asarray(picture_of(text).convert("L"))
    whole = np.asarray(picture_of(text.replace(f"{place[0]}, {place[1]}", "20, 30")).convert("L"))
    rows, columns = (int(np.flatnonzero((whole < 255).any(axis=axis))[0]) for axis in (1, 0))
    moved = [int(np.flatnonzero((pixels < 255).any(axis=axis))[0]) for axis in (1, 0)]
    assert np.array_equal(np.roll(whole, (moved[0] - rows, moved[1] - columns), (0, 1)), pixels)


def test_an_accent_of_its_own_is_put_together():
    assert np.array_equal(drawn("e\u0301"), drawn("é"))


def test_one_text_is_drawn_in_one_font_where_one_has_all():
    assert [piece for _, piece in faces.runs("θ = 90°")] == ["θ = 90°"]


def test_what_no_font_has_is_told_by_name():
    text = ".config(10, 100, 100); L : .label('a\u0378b') P=[9,9]; @0 L.P = [9,9];"
    solution = examined(arranged(scene_of(text), Choices()), Choices())
    (warning,) = [d for d in solution.diagnostics if d.code == "asset/glyph"]
    assert "U+0378" in warning.message
    assert "`L`" in warning.message
    plain = text.replace("\u0378", "é")
    assert not [d for d in examined(arranged(scene_of(plain), Choices()), Choices()).diagnostics if "glyph" in d.code]


def test_many_labels_share_the_poses_of_a_frame(monkeypatch):
    """The work of a label does not grow with their number: a frame is selected once, whoever asks."""
    text = ".config(5, 400, 300);\n.for k = 0..59 { L[k] : .label('{.t:.1f}') at = [6*k, 4*k]; }\n@0\n@1\n"
    solution = examined(arranged(scene_of(text), Choices()), Choices())
    poses = solution.motion.poses(0, 3)
    selected = []
    select = type(poses).select
    monkeypatch.setattr(type(poses), "select", lambda self, some: selected.append(some) or select(self, some))
    painter = make_painter(solution.motion.timeline.scene, (poses,))
    pictures = list(PaintSession(painter).frames(poses))
    assert len(pictures) == 3
    assert len(selected) <= 6
