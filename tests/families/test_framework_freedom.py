"""Imported linkage files are as free as their rigidity matrix says, whatever is in them."""

from __future__ import annotations

import json
import random
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from movimentum.interop.linkages import linkage_script, read_linkage
from movimentum.source import SourceText
from tests.analysis.rods import step_of
from tests.broad import broad
from tests.command import movimentum
from tests.families.frameworks import Framework, framework

SQUARE = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
RING = [(0, 1), (1, 2), (2, 3), (3, 0)]
FIGURES = {
    "nothing but a vertex": (Framework(SQUARE[:1]), 2),
    "two vertices": (Framework(SQUARE[:2]), 4),
    "a rod": (Framework([(0.0, 0.0), (80.0, 60.0)], [(0, 1)]), 3),
    "a rod and a vertex": (Framework(SQUARE[:3], [(0, 1)]), 5),
    "a vertex that is fixed": (Framework(SQUARE[:1], fixed=[0]), 0),
    "a rod with one end fixed": (Framework(SQUARE[:2], [(0, 1)], [1]), 1),
    "a rod with both ends fixed": (Framework(SQUARE[:2], [(0, 1)], [1, 0]), 0),
    "two rods with a joint": (Framework(SQUARE[:3], [(0, 1), (1, 2)]), 4),
    "two rods apart": (Framework(SQUARE, [(0, 1), (2, 3)]), 6),
    "a triangle": (Framework(SQUARE[:3], [(0, 1), (1, 2), (2, 0)]), 3),
    "three vertices and an angle": (Framework(SQUARE[:3], angles=[(1, 0, 2)]), 5),
    "a corner whose angle is fixed": (Framework(SQUARE[:3], [(0, 1), (1, 2)], angles=[(1, 0, 2)]), 3),
    "a square": (Framework(SQUARE, RING), 4),
    "a braced square": (Framework(SQUARE, [*RING, (0, 2)]), 3),
    "a square braced twice": (Framework(SQUARE, [*RING, (0, 2), (1, 3)]), 3),
    "a square whose angle is fixed": (Framework(SQUARE, RING, angles=[(0, 1, 3)]), 3),
    "a square on the ground": (Framework(SQUARE, RING, [0, 1]), 1),
}


def freedom_of(made: Framework, seed: int) -> int:
    linkage, found = read_linkage(SourceText("drawn.txt", made.text(random.Random(seed))))
    assert not found
    return step_of(linkage_script(linkage, "drawn.txt")).freedom


@broad("name", FIGURES, every=3)
def test_figures_of_the_page_on_rigidity(name: str) -> None:
    made, freedom = FIGURES[name]
    assert made.freedom() == freedom
    assert freedom_of(made, 1) == freedom


@broad("seed", range(16), every=2)
def test_frameworks_in_general_position(seed: int) -> None:
    made = framework(seed)
    assert freedom_of(made, seed) == made.freedom()


@pytest.mark.slow
def test_many_frameworks_in_general_position() -> None:
    sizes = {**dict.fromkeys(range(100, 350), 9), **dict.fromkeys(range(500, 550), 24)}
    wrong = [seed for seed, largest in sizes.items() if _differs(framework(seed, largest), seed)]
    assert wrong == []


def _differs(made: Framework, seed: int) -> bool:
    return freedom_of(made, seed) != made.freedom()


@pytest.mark.parametrize(("name", "colors"), [("nothing but a vertex", 2), ("a rod", 3), ("a vertex that is fixed", 0)])
def test_the_command_counts_and_draws_them(name: str, colors: int, tmp_path: Path) -> None:
    made, freedom = FIGURES[name]
    (tmp_path / "drawn.txt").write_text(made.text(random.Random(2)))
    assert movimentum("import", "drawn.txt", "-o", "drawn.mov", cwd=tmp_path).returncode == 0
    done = movimentum("check", "drawn.mov", "--format", "json", cwd=tmp_path)
    assert (done.returncode, json.loads(done.stdout)["steps"][0]["freedom"]) == (0, freedom)
    assert movimentum("run", "drawn.mov", "--at", "0", "--show", "free", "-o", "o.png", cwd=tmp_path).returncode == 0
    with Image.open(tmp_path / "o.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int)
    # the arrows are what has a colour: thing and ground are greys
    solid, counts = np.unique(pixels[np.ptp(pixels, axis=1) > 60], axis=0, return_counts=True)
    assert int(np.sum(counts > 20)) == colors, solid
