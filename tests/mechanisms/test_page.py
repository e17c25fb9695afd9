"""The gallery's page shows every script, with a picture that is one."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
GEARS = {"clockwork", "planetary"}
"""Teeth have long edges, which cost much in a GIF."""
NAMES = sorted(path.stem for path in (ROOT / "scripts").glob("*.mov"))


def test_every_script_is_on_the_page_once() -> None:
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"`scripts/([a-z-]+)\.mov`", page)) == NAMES
    assert sorted(re.findall(r"\]\(gallery/([a-z-]+)\.gif\)", page)) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_its_picture_moves(name: str) -> None:
    path = ROOT / "docs" / "gallery" / f"{name}.gif"
    assert path.stat().st_size < (1_800_000 if name in GEARS else 1_300_000)
    config = re.search(r"^\.config\(\d+, (\d+), (\d+)\)", (ROOT / "scripts" / f"{name}.mov").read_text(), re.MULTILINE)
    assert config is not None
    with Image.open(path) as picture:
        assert picture.format == "GIF"
        assert getattr(picture, "n_frames", 1) >= 40
        assert picture.info.get("loop") == 0
        assert picture.width / picture.height == pytest.approx(int(config[1]) / int(config[2]), rel=0.01)


def test_every_sprite_is_used() -> None:
    texts = [(ROOT / "scripts" / f"{name}.mov").read_text(encoding="utf-8") for name in NAMES]
    used = {sprite for text in texts for sprite in re.findall(r"'sprites/([a-z-]+)\.png'", text)}
    assert {path.stem for path in (ROOT / "scripts" / "sprites").glob("*.png")} == used
