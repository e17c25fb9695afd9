"""Tables of poses: columns in the agreed order, numbers that read back exactly, the same rows in every format."""

from __future__ import annotations

import csv
import io
import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from movimentum.interop import tables
from movimentum.scene.model import Anchor, AnchorRef, Config, Scene, Thing, Variable
from movimentum.solver.poses import Poses
from movimentum.source import SourceText, Span
from movimentum.things.kinds.bar import BAR
from movimentum.things.kinds.disc import DISC, Round
from movimentum.things.kinds.line import LINE

NOWHERE = Span(0, 0)


def scene() -> Scene:
    rod = Thing(0, "Rod", BAR, (Anchor("A", (0.0, 0.0), NOWHERE), Anchor("x", (3.0, 0.0), NOWHERE)), NOWHERE, NOWHERE)
    rope = Thing(1, "Rope", LINE, (), NOWHERE, NOWHERE, through=(AnchorRef(0, 0), AnchorRef(0, 1)))
    disc = Thing(2, "Disc", DISC, (Anchor("C", (1.0, 1.0), NOWHERE),), NOWHERE, NOWHERE, Round(5.0))
    return Scene(
        SourceText("t.mov", ""),
        Config(Fraction(10)),
        (rod, rope, disc),
        {"v": Variable("v", True, NOWHERE), "q": Variable("q", False, NOWHERE)},
        (),
    )


def poses(frames: int = 5) -> Poses:
    k = np.arange(frames, dtype=np.float64)
    angle = np.stack([100.0 * k, 0 * k, 0 * k])
    radians = np.radians(angle)
    return Poses(
        frames=np.arange(frames, dtype=np.int64),
        times=k / 10,
        origin=np.stack([np.stack([0.1 + k, 1 / 3 * k], axis=-1), np.zeros((frames, 2)), np.full((frames, 2), 7.0)]),
        direction=np.stack([np.cos(radians), np.sin(radians)], axis=-1),
        angle=angle,
        visible=np.ones((3, frames), dtype=bool),
        properties={},
        variables={"v": np.stack([k, -k], axis=-1), "q": k * 1e-300},
        solved=np.ones(frames, dtype=bool),
    )


NAMES = [
    "frame",
    "time",
    "Rod.A.x",
    "Rod.A.y",
    "Rod.x.x",
    "Rod.x.y",
    "Disc.C.x",
    "Disc.C.y",
    "Rod.angle",
    "Disc.angle",
    "v.x",
    "v.y",
    "q",
]


def written(chunks: list[Poses]) -> list[list[str]]:
    stream = io.StringIO()
    tables.write_csv(scene(), chunks, stream)
    return list(csv.reader(io.StringIO(stream.getvalue())))


def test_columns_are_anchors_then_angles_then_variables_in_order_of_definition() -> None:
    assert written([poses()])[0] == NAMES


def test_numbers_read_back_exactly_and_are_the_shortest_that_do() -> None:
    rows = written([poses()])[1:]
    source = poses()
    assert [row[0] for row in rows] == ["0", "1", "2", "3", "4"]
    for number, row in enumerate(rows):
        assert float(row[1]) == source.times[number]
        assert float(row[3]) == source.origin[0, number, 1]
        assert row[8] == repr(100.0 * number), "the angle counts on beyond a full turn"
        assert all(repr(float(cell)) == cell for cell in row[1:])


def test_anchors_are_where_turning_by_hand_puts_them() -> None:
    for number, row in enumerate(written([poses()])[1:]):
        turn = math.radians(100.0 * number)
        assert float(row[4]) == pytest.approx(0.1 + number + 3 * math.cos(turn), abs=1e-12)
        assert float(row[5]) == pytest.approx(number / 3 + 3 * math.sin(turn), abs=1e-12)


def test_there_is_no_negative_zero() -> None:
    assert not any(cell.startswith("-0.0") and float(cell) == 0 for row in written([poses()])[1:] for cell in row)


def test_how_the_frames_are_chunked_does_not_show(tmp_path: Path) -> None:
    whole = poses()
    parts = [whole.select(slice(0, 2)), whole.select(slice(2, 2)), whole.select(slice(2, 5))]
    assert written([whole]) == written(parts)
    for suffix in tables.SUFFIXES:
        one, other = tmp_path / f"one{suffix}", tmp_path / f"other{suffix}"
        assert tables.write(scene(), [whole], one, suffix) == 5
        assert tables.write(scene(), parts, other, suffix) == 5
        assert one.read_bytes() == other.read_bytes()


def test_all_formats_hold_the_same_numbers(tmp_path: Path) -> None:
    expected = [[float(cell) for cell in row] for row in written([poses()])[1:]]
    tables.write(scene(), [poses()], tmp_path / "t.json", ".JSON")
    document = json.loads((tmp_path / "t.json").read_text())
    assert document == {"columns": NAMES, "rows": expected}
    tables.write(scene(), [poses()], tmp_path / "t.npz", ".npz")
    with np.load(tmp_path / "t.npz") as archive:
        assert list(archive) == NAMES
        assert archive["frame"].dtype == np.int64
        assert np.stack([archive[name] for name in NAMES], axis=-1).tolist() == expected


def test_no_frames_make_a_table_of_no_rows(tmp_path: Path) -> None:
    assert written([]) == [NAMES]
    tables.write(scene(), [], tmp_path / "t.json", ".json")
    assert json.loads((tmp_path / "t.json").read_text()) == {"columns": NAMES, "rows": []}
    tables.write(scene(), [], tmp_path / "t.npz", ".npz")
    with np.load(tmp_path / "t.npz") as archive:
        assert all(archive[name].shape == (0,) for name in NAMES)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_never_gets_into_a_table(value: float) -> None:
    broken = poses()
    broken.variables["q"][3] = value
    with pytest.raises(ArithmeticError, match="column q"):
        tables.write_csv(scene(), [broken], io.StringIO())
