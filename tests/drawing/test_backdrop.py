"""Grids and axes under pictures: where they are, and that nothing else changes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from tests.broad import broad

BAR = "R : .bar A = [-50,-30] B = A + [100,0]; @0 R.A = [-50,-30]; R.angle = 90*.t; @1"
SIZED = (
    ".config(5, 200, 120) .background('white'); R : .bar A = [50,20] B = A + [90,0] .width(9) .color('red');"
    " @0 R.A = [50,20]; @1"
)


def picture(folder: Path, text: str, *show: str, scale: float = 1.0) -> np.ndarray:
    motion = mv.loads(text).solve()
    motion.render(folder / "a.png", at=0, show=show, scale=scale)
    with Image.open(folder / "a.png") as found:
        return np.asarray(found.convert("RGB")).astype(int)


@pytest.mark.parametrize("text", [BAR, SIZED])
def test_the_canvas_and_the_things_stay(tmp_path: Path, text: str) -> None:
    plain, whole = picture(tmp_path, text), picture(tmp_path, text, "grid", "axes")
    assert plain.shape == whole.shape
    drawn = (plain[:, :, 0] > 250) & (plain[:, :, 1] < 5)  # red
    assert (plain[drawn] == whole[drawn]).all()
    assert (plain != whole).any()


def test_the_lines_of_a_grid_are_at_round_numbers(tmp_path: Path) -> None:
    found = picture(tmp_path, SIZED, "grid", scale=2)
    dark = (found < 250).any(axis=2)
    columns = np.flatnonzero(dark[4:20].all(axis=0))
    assert {round((x + 0.5) / 40) for x in columns.tolist()} == set(range(11))
    assert all(abs((x + 0.5) % 40 - 40 * round((x + 0.5) % 40 / 40)) <= 2 for x in columns.tolist())


@broad("suffix", ["svg", "html", "pdf", "gif"], first=3)
def test_every_format_has_them(tmp_path: Path, suffix: str) -> None:
    sizes: list[int] = []
    for show in ((), ("grid", "axes")):
        mv.loads(BAR).solve().render(tmp_path / f"a.{suffix}", show=show)
        sizes.append((tmp_path / f"a.{suffix}").stat().st_size)
    assert sizes[0] < sizes[1]
