"""The gallery's imported linkages: what is known of them, measured on the solved poses."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.penrose import transformable
from movimentum.interop.linkages import linkage_script, read_linkage
from movimentum.source import SourceText
from tests.broad import broad
from tests.mechanisms.conftest import SCRIPTS
from tests.mechanisms.kinematics import Array, Columns, distance, point

Solve = Callable[..., Columns]
ROOT = Path(__file__).resolve().parents[2]


def drawn(name: str) -> dict[str, complex]:
    """Every anchor of a script's bars, as it is drawn."""
    text = (SCRIPTS / f"{name}.mov").read_text(encoding="utf-8")
    found: dict[str, complex] = {}
    for bar, anchors in re.findall(r"^(R\d+_\d+) : \.bar(.*);$", text, re.MULTILINE):
        for anchor, x, y in re.findall(r"(V\d+) = \[([^,]+), ([^\]]+)\]", anchors):
            found[f"{bar}.{anchor}"] = complex(float(x), float(y))
    return found


def at(table: Columns, anchor: str) -> Array:
    """(F,) complex places of an anchor."""
    return point(table, anchor) @ np.array([1.0, 1.0j])


def test_peaucellier_follows_its_wish_along_the_line_only(solve_script: Solve) -> None:
    table = solve_script("peaucellier-linkage")
    end = point(table, "R3_5.V5")
    o, m = point(table, "R0_3.V0"), point(table, "R1_2.V2")
    np.testing.assert_allclose(end[:, 0], 320.0, atol=1e-9)
    np.testing.assert_allclose(distance(o, m) * distance(o, end), (180**2 + 60**2) - (80**2 + 60**2), rtol=1e-11)
    wanted = 200 + 100 * np.sin(np.radians(90 * table["time"]))
    np.testing.assert_allclose(end[:, 1], wanted, atol=1e-6)


@broad(("name", "order"), [("penrose-five", 1), ("penrose-twenty", 2)], first=1)
def test_a_tiling_closes_as_the_formula_says(name: str, order: int, solve_script: Solve) -> None:
    """Vertices at C + cos(theta) (P - C), every star turned by +theta or -theta, neighbours against each other."""
    table = solve_script(name)
    places = drawn(name)
    vertices = min(int(anchor.split("_")[1].split(".")[0]) for anchor in places)  # middles of edges come behind
    middle = sum(places.values()) / len(places)
    angles = {bar: table[f"{bar}.angle"] for bar in {anchor.split(".")[0] for anchor in places}}
    centre = min((a for a in places if int(a.split(".V")[1]) < vertices), key=lambda a: abs(places[a] - middle))
    theta = angles[centre.split(".")[0]]
    wished = 35.0 * (1.0 - np.cos(np.radians(90.0 * table["time"])))
    np.testing.assert_allclose(theta, wished, atol=1e-5)
    assert theta.max() > 69.9
    origin = places[centre]
    turns: dict[int, set[float]] = {}
    for anchor, place in places.items():
        star = int(anchor.split("_")[0][1:])
        sign = np.sign(angles[anchor.split(".")[0]][len(theta) // 4])
        turns.setdefault(star, set()).add(float(sign))
        np.testing.assert_allclose(angles[anchor.split(".")[0]], sign * theta, atol=1e-8)
        if int(anchor.split(".V")[1]) < vertices:
            expected = origin + np.cos(np.radians(theta)) * (place - origin)
            np.testing.assert_allclose(at(table, anchor), expected, atol=1e-9)
    assert all(len(signs) == 1 for signs in turns.values())  # the half edges of a star turn together
    assert {s for signs in turns.values() for s in signs} == {1.0, -1.0}
    tiling = transformable(order)
    assert (len(tiling.rods), len(turns)) == (len(angles), vertices)


def test_the_scripts_are_what_the_import_makes() -> None:
    path = SCRIPTS / "linkages" / "peaucellier.txt"
    linkage, found = read_linkage(SourceText(path.name, path.read_text(encoding="utf-8")))
    assert found == ()
    text = (SCRIPTS / "peaucellier-linkage.mov").read_text(encoding="utf-8")
    made = linkage_script(linkage, path.name).splitlines()
    assert [line for line in made if line not in text.splitlines()] == [".config(24);"]


def test_the_generator_makes_the_scripts_again(tmp_path: Path) -> None:
    script = ROOT / "docs" / "make_linkages.py"
    subprocess.run([sys.executable, str(script), str(tmp_path)], check=True, cwd=tmp_path)
    made = sorted(path.name for path in tmp_path.glob("*.mov"))
    assert made == ["peaucellier-linkage.mov", "penrose-five.mov", "penrose-twenty.mov"]
    for name in made:
        assert (tmp_path / name).read_bytes() == (SCRIPTS / name).read_bytes()


@pytest.mark.parametrize(("order", "vertices", "edges"), [(1, 11, 15), (2, 31, 50), (3, 76, 135), (4, 201, 370)])
def test_tilings_have_as_many_vertices_and_edges_as_published(order: int, vertices: int, edges: int) -> None:
    linkage = transformable(order)
    assert len(linkage.vertices) == vertices + edges
    assert len(linkage.rods) == 2 * edges
    assert len(linkage.angles) == 2 * edges - vertices
    assert {round(linkage.length(rod), 9) for rod in range(len(linkage.rods))} == {30.0}
