"""The manifest of a recording, ``golden.json``, read with care, because it may come from anywhere."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import cast

from movimentum.output.files import read_limited
from movimentum.records import dataclass

FORMAT = 1


@dataclass(frozen=True, slots=True)
class Manifest:
    """What ``golden.json`` says: how many ``frames`` the film had, of which there are ``pictures``, and who drew
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
