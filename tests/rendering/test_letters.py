"""Labels with more than plain letters: drawn with a font that has them, or told."""

import numpy as np
import pytest

from movimentum.rendering import faces
from movimentum.rendering.text import text_sprite
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined
from tests.solver.scenes import scene_of


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


def test_different_letters_look_different():
    pictures = [drawn(c).tobytes() for c in "θωπΔ→"]
    assert len(set(pictures)) == 5


def test_plain_letters_keep_the_font_they_had():
    ((face, text),) = faces.runs("Crank 1: 90 deg")
    assert (face.name, text) == ("", "Crank 1: 90 deg")


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
