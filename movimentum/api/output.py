"""What motions are written to: pictures, tables, data frames."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.analysis.diagnose.valueless import never_valued
from movimentum.diagnostics import Diagnostic
from movimentum.interop.tables import columns
from movimentum.records import dataclass
from movimentum.solver.motion import AnyMotion
from movimentum.solver.poses import Poses


@dataclass(frozen=True, slots=True)
class Written:
    """What `Motion.render` or `Motion.save` wrote: the file's ``path`` (numbered pictures: with its ``%d``), how many
    ``frames`` (or rows), and what there is to say.

    >>> import movimentum as mv, tempfile, os
    >>> motion = mv.load("scripts/trammel.mov").solve()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = motion.render(os.path.join(folder, "trammel.png"), at=0.5)
    >>> written.path.name, written.frames
    ('trammel.png', 1)
    """

    path: Path
    frames: int
    diagnostics: tuple[Diagnostic, ...]


def data_frame(motion: AnyMotion, chunks: Iterable[Poses], frames: NDArray[np.int64]) -> Any:
    """See `Motion.to_dataframe`."""
    try:
        pandas = import_module("pandas")
    except ImportError as problem:
        raise ImportError("to_dataframe() needs pandas: pip install pandas", name="pandas") from problem
    scene, parts = motion.timeline.scene, list(chunks)
    found = columns(scene, never_valued(motion.path))
    table = {column.name: np.concatenate([column.values(poses) for poses in parts]) for column in found}
    for name, variable in scene.variables.items():
        missing = np.concatenate([poses.missing.get(name, np.zeros(len(poses.times), bool)) for poses in parts])
        for title in (f"{name}.x", f"{name}.y") if variable.is_vector else (name,):
            if title in table:
                table[title][missing] = np.nan
    return pandas.DataFrame(table, index=pandas.Index(frames, name="frame"))


def silent(done: int, total: int) -> None:
    """Nobody watches the progress."""
