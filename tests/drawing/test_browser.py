"""SVGs and pages show what Pillow draws; screenshots of Chromium."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from PIL import Image, ImageChops

import movimentum as mv
from tests.command import ROOT
from tests.drawing.films import changing, everything, figures, shot_of_page, shot_of_svg
from tests.drawing.likeness import ALIKE, LETTERED, LETTERS, SMALL, Tolerance, unlike

GALLERY = sorted((ROOT / "scripts").glob("*.mov"))
TRACED = {"four-bar": ("Coupler.P",), "jansen": ("ghi.W",), "trammel": ("Rod.P",)}
"""What is traced in the films here; in the others nothing is."""


def same(page: Any, motion: mv.Motion, folder: Path, like: Tolerance, frames: list[int], **options: Any) -> None:
    """Both files show frames as Pillow draws them."""
    svg, html = folder / "film.svg", folder / "film.html"
    motion.render(svg, **options)
    motion.render(html, **options)
    pictures = {}
    for frame in frames:
        motion.render(folder / f"{frame}.png", frames=frame, **options)
        pictures[frame] = Image.open(folder / f"{frame}.png").convert("RGB")
    found = {}
    page.goto(svg.as_uri())
    for frame, picture in pictures.items():
        shot = shot_of_svg(page, frame / motion.timeline.fps, picture.size)
        shot.save(folder / f"{frame}-svg.png")
        found["svg", frame] = unlike(shot, picture)
    page.goto(html.as_uri())
    for frame, picture in pictures.items():
        shot = shot_of_page(page, frame, picture.size)
        shot.save(folder / f"{frame}-html.png")
        found["html", frame] = unlike(shot, picture)
    assert {key: value for key, value in found.items() if value[0] > like.worst or value[1] > like.edges} == {}


@pytest.mark.slow
@pytest.mark.parametrize("script", GALLERY, ids=lambda path: path.stem)
def test_the_gallery_looks_the_same_in_a_browser(script: Path, page: Any, tmp_path: Path) -> None:
    motion = mv.load(script).solve()
    last = motion.timeline.frame_count - 1
    text = script.read_text(encoding="utf-8")
    like = LETTERS if any(word in text for word in LETTERED) else ALIKE
    same(page, motion, tmp_path, like, [0, last // 2, last - 1], trace=TRACED.get(script.stem, ()))


@pytest.mark.slow
def test_all_kinds_of_things_look_the_same_in_a_browser(page: Any, tmp_path: Path) -> None:
    motion = mv.load(everything(tmp_path)).solve()
    options = {"trace": ["Wheel.P", "Late.B"], "show": ["names", "anchors", "free"]}
    same(page, motion, tmp_path, SMALL, [0, 10], **options)


@pytest.mark.slow
def test_figures_look_the_same_in_a_browser(page: Any, tmp_path: Path) -> None:
    motion = mv.load(figures(tmp_path)).solve()
    same(page, motion, tmp_path, SMALL, [9])


@pytest.mark.slow
def test_what_changes_in_time_looks_the_same_in_a_browser(page: Any, tmp_path: Path) -> None:
    motion = mv.load(changing(tmp_path)).solve()
    same(page, motion, tmp_path, SMALL, [7, 18])


@pytest.mark.slow
@pytest.mark.parametrize("options", [{"scale": 2.0}, {"scale": 0.5, "quality": "high"}, {"background": "gold"}])
def test_choices_of_the_picture_hold_in_a_browser(page: Any, tmp_path: Path, options: dict[str, Any]) -> None:
    motion = mv.load(everything(tmp_path)).solve()
    same(page, motion, tmp_path, SMALL, [0, 14], **options)


def test_a_part_of_a_film_has_the_traces_of_what_came_before(page: Any, tmp_path: Path) -> None:
    motion = mv.load(everything(tmp_path)).solve()
    options: dict[str, Any] = {"trace": ["Wheel.P", "Late.B"]}
    motion.render(tmp_path / "film.svg", frames="8:16", **options)
    motion.render(tmp_path / "film.html", frames="8:16", **options)
    motion.render(tmp_path / "15.png", frames=15, **options)
    picture = Image.open(tmp_path / "15.png").convert("RGB")
    page.goto((tmp_path / "film.svg").as_uri())
    assert unlike(shot_of_svg(page, Fraction(7, 10), picture.size), picture)[0] <= LETTERS.worst
    page.goto((tmp_path / "film.html").as_uri())
    assert unlike(shot_of_page(page, 7, picture.size), picture)[0] <= LETTERS.worst


def test_a_still_is_as_exact_as_the_png(page: Any, tmp_path: Path) -> None:
    motion = mv.load(ROOT / "scripts" / "jansen.mov").solve()
    for name in ("still.svg", "still.png"):
        motion.render(tmp_path / name, at=Fraction(1, 3), trace="ghi.W")
    picture = Image.open(tmp_path / "still.png").convert("RGB")
    page.goto((tmp_path / "still.svg").as_uri())
    worst, edges = unlike(shot_of_svg(page, Fraction(0), picture.size), picture)
    assert worst <= ALIKE.worst
    assert edges <= ALIKE.edges


@pytest.mark.parametrize(("x", "y"), [(2, 0), (0, -2)])
def test_what_is_two_pixels_off_does_not_look_the_same(tmp_path: Path, x: int, y: int) -> None:
    motion = mv.load(ROOT / "scripts" / "four-bar.mov").solve()
    motion.render(tmp_path / "0.png", at=0)
    picture = Image.open(tmp_path / "0.png").convert("RGB")
    assert unlike(picture, picture) == (0, 0.0)
    assert unlike(ImageChops.offset(picture, x, y), picture)[0] > LETTERS.worst


@pytest.mark.slow
def test_a_quarter_of_a_pixel_is_told_from_the_edges(tmp_path: Path) -> None:
    motion = mv.load(ROOT / "scripts" / "locomotive.mov").solve()
    motion.render(tmp_path / "0.png", at=0)
    picture = Image.open(tmp_path / "0.png").convert("RGB")
    for x, y in ((0.25, 0.0), (0.0, 0.25), (0.2, -0.2)):
        moved = picture.transform(picture.size, Image.Transform.AFFINE, (1, 0, x, 0, 1, y), Image.Resampling.BILINEAR)
        worst, edges = unlike(picture, moved)
        assert worst <= ALIKE.worst
        assert edges > ALIKE.edges


def test_a_frame_does_not_look_like_the_next(tmp_path: Path) -> None:
    motion = mv.load(ROOT / "scripts" / "trammel.mov").solve()
    for frame in (10, 11):
        motion.render(tmp_path / f"{frame}.png", frames=frame)
    one, other = (Image.open(tmp_path / f"{frame}.png") for frame in (10, 11))
    assert unlike(one, other)[0] > ALIKE.worst
