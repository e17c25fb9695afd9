"""Records golden frames: the results of a script once somebody has looked at them and found them right.

Beside ``NAME.mov``, or in another folder, ``NAME.golden/`` holds ``poses.csv`` (a table as `solve` writes it), some
frames as PNG, and ``golden.json``, which says what they were recorded with. This manifest is read with care, because it
may come from anywhere.
"""

from __future__ import annotations

import json
import os
import platform
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np

from movimentum.output.files import made_folder, read_limited, remove_own, whole_folder
from movimentum.records import dataclass, field
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read, reads
from movimentum.workflow.stages import Solution, arranged, solved, understand

FORMAT = 1


@dataclass(frozen=True, slots=True)
class Manifest:
    """The contents of ``golden.json``: how many ``frames`` the film had, of which there are ``pictures``, and who drew
    them.
    """

    frames: int
    pictures: tuple[int, ...]
    renderer: dict[str, str]
    fps: str | None = None
    """Frames per time unit, such as ``25``; None in older recordings."""


MANIFEST_BYTES = 1_000_000
"""A larger file is not a manifest: a folder may come from anywhere."""


def read_manifest(folder: Path) -> Manifest:
    """The manifest in a folder, with every value checked; `OSError` or `ValueError` if it is not valid."""
    data = read_limited(folder / "golden.json", MANIFEST_BYTES)
    try:
        about = json.loads(data.decode("utf-8"))
    except RecursionError as error:
        raise ValueError("golden.json is nested too deeply") from error
    if not isinstance(about, dict):
        raise ValueError("golden.json is not an object")
    found = cast("dict[str, object]", about)
    if found.get("format") != FORMAT:
        raise ValueError(f"its format is {found.get('format')!r}, not {FORMAT}"[:200])
    frames, pictures, drawn = found.get("frames"), found.get("pictures"), found.get("renderer")
    fps = found.get("fps")
    if not _whole(frames) or not isinstance(pictures, list) or not isinstance(drawn, dict):
        raise ValueError("golden.json does not say what was recorded")
    numbers = [number for number in cast("list[object]", pictures) if _whole(number)]
    return Manifest(
        cast("int", frames),
        tuple(cast("list[int]", numbers)),
        {str(key): str(value) for key, value in cast("dict[object, object]", drawn).items()},
        fps if isinstance(fps, str) and re.fullmatch(r"\d{1,9}(/\d{1,9})?", fps) else None,
    )


def _whole(value: object) -> bool:
    """Whether a value is a count of frames or the number of one."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 10**9


def picture_name(frame: int) -> str:
    """The name of a recorded frame's file."""
    return f"frame-{frame:05d}.png"


MOST_FRAMES = 2000
"""Rows of a table; for a longer film every second, third, … frame is kept."""
MOST_PICTURES = 12


@dataclass(frozen=True, slots=True)
class Golden:
    """Where a script's golden frames are, or are to be, and how it is read."""

    script: Path
    folder: Path
    choices: Choices = field(default_factory=Choices)

    @property
    def exists(self) -> bool:
        """Whether any are recorded."""
        return os.path.isfile(self.folder / "golden.json")


def golden_of(script: Path, to: Path | None = None, choices: Choices | None = None) -> Golden:
    """The place of a script's golden frames: beside it, or in the folder ``to``."""
    return Golden(script, (to or script.parent) / f"{script.stem}.golden", choices or Choices())


@dataclass(frozen=True, slots=True, eq=False)
class Rendition:
    """A script solved, with the frames that are worth recording: ``rows`` for the table, ``pictures`` to look at."""

    scene: Scene
    solution: Solution
    rows: tuple[int, ...]
    pictures: tuple[int, ...]

    def poses(self) -> Poses:
        """The poses of `contact_rows`."""
        import numpy as np

        poses = self.solution.motion.poses(0, self.rows[-1] + 1)
        return poses.select(np.array(self.rows, dtype=np.int64))

    def images(self) -> Iterator[tuple[int, Any]]:
        """The frames of `pictures` as Pillow images."""
        from movimentum.analysis.shown_numbers import with_shown_numbers
        from movimentum.drawing.picture_options import PictureOptions
        from movimentum.rendering.painter import make_painter

        motion = self.solution.motion
        count = motion.timeline.frame_count
        chunks = [
            with_shown_numbers(motion, motion.poses(first, min(first + 512, count))) for first in range(0, count, 512)
        ]
        painter = make_painter(self.scene, chunks, PictureOptions(motion=motion.path))
        for frame in self.pictures:
            yield frame, painter.frame(with_shown_numbers(motion, motion.poses(frame, frame + 1)), 0).convert("RGB")


def rendition(script: Path, choices: Choices) -> Rendition:
    """Solve a script; raises what `solved` does, broken claims included."""
    scene = understand(read(str(script)), choices)
    timeline = arranged(scene, choices)
    solution = solved(timeline, choices)
    count = timeline.frame_count
    stride = -(-count // MOST_FRAMES)
    first: list[int] = []
    middle: list[int] = []
    for segment in timeline.segments:
        begin = -int((timeline.start - segment.start) * timeline.fps // 1)
        half = int((segment.start + (segment.end - segment.start) / 2 - timeline.start) * timeline.fps // 1)
        first.append(min(begin, count - 1))
        middle.append(min(max(half, begin), count - 1))
    chosen = sorted({first[0], *middle})  # each step's middle; where a step begins, the one before it ends
    every = max(1, -(-len(chosen) // MOST_PICTURES))
    return Rendition(scene, solution, tuple(range(0, count, stride)), tuple(chosen[::every]))


def renderer() -> dict[str, str]:
    """The renderer here: if it is the same, pixels are the same.

    NumPy adds up in another order on processors with other vector instructions; that shows in the last digits of a
    pose, and so in a few pixels of a turned picture.
    """
    import PIL

    found: Any = np.__config__.show("dicts").get("SIMD Extensions", {})
    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "vectors": " ".join(found.get("found", [])),
        "pillow": PIL.__version__.split(".")[0],
    }


def record(golden: Golden) -> Rendition:
    """Write a script's golden frames, in place of older ones; whole or not at all."""
    from movimentum.interop.tables import write_csv

    made = rendition(golden.script, golden.choices)
    old = {picture_name(frame) for frame in _recorded_pictures(golden)}
    new = {picture_name(frame) for frame in made.pictures}
    inputs = reads(SourceText(str(golden.script), ""), made.scene)
    with made_folder(golden.folder), whole_folder(golden.folder / "golden", inputs) as folder:
        with (folder / "poses.csv").open("w", encoding="utf-8", newline="\n") as stream:
            write_csv(made.scene, (made.poses(),), stream)
        for frame, image in made.images():
            image.save(folder / picture_name(frame), "PNG", optimize=True)
        about = {
            "format": FORMAT,
            "script": golden.script.name,
            "frames": made.solution.motion.timeline.frame_count,
            "fps": str(made.solution.motion.timeline.fps),
            "pictures": list(made.pictures),
            "renderer": renderer(),
        }
        (folder / "golden.json").write_text(json.dumps(about, indent=1) + "\n", encoding="utf-8", newline="\n")
    for name in old - new:  # only what the manifest named: other files in this folder are not ours
        remove_own(golden.folder / name, inputs)
    return made


def _recorded_pictures(golden: Golden) -> tuple[int, ...]:
    """The frames of which an older recording here has pictures; none if it cannot be read."""
    try:
        return read_manifest(golden.folder).pictures
    except (OSError, ValueError):
        return ()
