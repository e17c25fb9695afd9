"""The one way in which these tests get poses: the command line, as a user would call it."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.command import movimentum
from tests.mechanisms.kinematics import Columns

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


@pytest.fixture(scope="session")
def solve_script() -> Callable[..., Columns]:
    """``solve_script(name, fps=None)``: the table of ``scripts/name.mov``, column name -> (F,) array.

    Warnings count as errors here, so every script of the gallery is also shown to run without any.
    """
    cache: dict[tuple[str, str | None], Columns] = {}

    def solve(name: str, fps: str | None = None) -> Columns:
        if (name, fps) not in cache:
            options = ["--fps", fps] if fps else []
            done = movimentum("solve", SCRIPTS / f"{name}.mov", "-o", "-", "--strict", *options, timeout=300)
            assert done.returncode == 0, done.stderr
            assert "warning" not in done.stderr, done.stderr
            header, *rows = list(csv.reader(io.StringIO(done.stdout)))
            values = np.array(rows, dtype=float)
            assert np.isfinite(values).all()
            cache[name, fps] = {column: values[:, k] for k, column in enumerate(header)}
        return cache[name, fps]

    return solve
