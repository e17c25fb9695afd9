"""Compares a script with its golden frames: first the numbers, then the pixels.

On the machine and with the Pillow that recorded them, pixels are the same except for rounding. Elsewhere a picture must
be as near to the recording as another renderer's correct result, judged after a Gaussian blur. Several measures were
tried on pictures of other renderers and on faulty pictures (shifts, turns, a missing bar). Only the largest difference
after the blur distinguishes them; RMS and structural similarity do not.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.golden.record import Golden, Manifest, Rendition, picture_name, read_manifest, renderer, rendition
from movimentum.interop.tables import columns
from movimentum.output.files import read_limited
from movimentum.records import dataclass
from movimentum.rendering.images import picture_file
from movimentum.source import SourceText
from movimentum.terminal import typed
from movimentum.text import counted, listed, number, time_text
from movimentum.tolerances import DIFFERING_PIXELS, GOLDEN_PLACE, LEAST_AGREEMENT
from movimentum.workflow.read import reads

SIGMA = 1.5
"""Of the blur, in pixels."""
BLURRED = 16.0
"""Largest difference after the blur (of 255) that may come from another renderer: those measured differed by 11, a bar
shifted by half a pixel by 25.
"""
ROUNDING = 1


@dataclass(frozen=True, slots=True)
class Difference:
    """Two pictures of one size: ``differing`` is the share of pixels that differ by more than rounding, ``largest`` the
    largest difference of a channel (0 to 255), ``blurred`` the same after the blur.
    """

    differing: float
    largest: int
    blurred: float

    def acceptable(self, *, same_renderer: bool) -> bool:
        """Whether nothing is wrong."""
        return self.differing <= DIFFERING_PIXELS if same_renderer else self.blurred <= BLURRED


def difference(expected: Image.Image, actual: Image.Image) -> Difference:
    """Compare two pictures of the same size."""
    apart = np.abs(_pixels(expected) - _pixels(actual)).max(axis=2)
    blur = ImageFilter.GaussianBlur(SIGMA)
    soft = np.abs(_pixels(expected.convert("RGB").filter(blur)) - _pixels(actual.convert("RGB").filter(blur)))
    return Difference(float((apart > ROUNDING).sum()) / apart.size, int(apart.max()), float(soft.max()))


def shown(expected: Image.Image, actual: Image.Image) -> Image.Image:
    """The difference as a picture: white where they agree, darker and redder the more they differ."""
    apart = np.abs(_pixels(expected) - _pixels(actual)).max(axis=2)
    strength = np.where(apart > ROUNDING, 80 + apart * 175 // 255, 0)
    red: NDArray[np.int64] = np.full((*apart.shape, 3), 255, dtype=np.int64)
    red[:, :, 1] -= strength
    red[:, :, 2] -= strength
    return Image.fromarray(red.clip(0, 255).astype(np.uint8), "RGB")


def _pixels(image: Image.Image) -> NDArray[np.int64]:
    """(height, width, 3), over white."""
    flat = image.convert("RGBA")
    ground = Image.new("RGBA", flat.size, "white")
    ground.alpha_composite(flat)
    return np.asarray(ground.convert("RGB"), dtype=np.int64)


MOST = 6


@dataclass(frozen=True, slots=True, eq=False)
class GoldenResult:
    """``diagnostics``: one error for what is no longer as recorded, none if everything is. ``pictures`` are those that
    differ: (frame, expected, actual); expected is None if there was no such frame. ``inputs``: the files read.
    """

    golden: Golden
    diagnostics: tuple[Diagnostic, ...]
    inputs: tuple[str, ...] = ()
    pictures: tuple[tuple[int, Image.Image | None, Image.Image], ...] = ()

    @property
    def good(self) -> bool:
        """Whether everything is as recorded."""
        return not self.diagnostics


def check(golden: Golden) -> GoldenResult:
    """Solve and draw a script again; raises what solving raises, and `ScriptError` if nothing was recorded."""
    recorded = _recorded(golden)
    made = rendition(golden.script, golden.choices)
    found = list(_numbers(golden, made, recorded))
    differing: list[tuple[int, Image.Image | None, Image.Image]] = []
    same = recorded.manifest.renderer == renderer()
    worst: tuple[float, str] | None = None
    for frame, actual in made.images():
        expected = _picture(golden.folder / picture_name(frame), actual)
        if expected is None or isinstance(expected, tuple):
            differing.append((frame, None, actual))
            what = "was not recorded"
            if expected is not None:
                what = f"is {actual.width} x {actual.height} pixels, it was {expected[0]} x {expected[1]}"
            worst = worst or (0.0, f"frame {frame} {what}")
            continue
        apart = difference(expected, actual)
        if not apart.acceptable(same_renderer=same):
            differing.append((frame, expected, actual))
            share = f"{number(100 * apart.differing, 2)} % of frame {frame}'s pixels differ, by up to {apart.largest}"
            if worst is None or apart.blurred > worst[0]:
                worst = apart.blurred, f"{share} of 255 ({number(apart.blurred, 3)} when blurred)"
    if worst is not None and not found:
        found.append(
            _error(
                "golden/looks-different",
                f"{golden.script.name} looks different, though everything is where it was: {worst[1]}",
                *(() if same else ("recorded with another renderer, so pictures are compared when blurred",)),
            )
        )
    inputs = reads(SourceText(str(golden.script), ""), made.scene)
    return GoldenResult(golden, tuple(found), inputs, tuple(differing))


def _error(code: str, message: str, *notes: str) -> Diagnostic:
    helps = ("look at the pictures; if the new ones are right, `movimentum golden check --update` keeps them",)
    return Diagnostic(code, Severity.ERROR, message, notes=tuple(notes), helps=helps)


_TWO_LINES = 16_000_000
"""Bytes of a table's names and first row: enough for a hundred thousand columns."""
_CELL_BYTES = 32
"""A number in a table takes 24 at most, with its comma."""


@dataclass(frozen=True, slots=True, eq=False)
class _Recorded:
    """A recording's manifest, and the names of its table's columns."""

    manifest: Manifest
    header: list[str]


def _recorded(golden: Golden) -> _Recorded:
    """The recording without the rows of its table; raises `ScriptError` if there is none, or if it cannot be read.

    A folder may come from anywhere, so no more of the table is read later than our own would take.
    """
    if not golden.exists:
        message = f"{golden.script.name} has no golden frames in {golden.folder}"
        helps = (_record(golden),)
        raise ScriptError([Diagnostic("golden/missing", Severity.ERROR, message, helps=helps)])
    try:
        manifest = read_manifest(golden.folder)
        lines = read_limited(golden.folder / "poses.csv", _TWO_LINES, lines=2).decode("utf-8").splitlines()
        header, *first = csv.reader(lines)
        for row in first:
            np.array(row, dtype=np.float64).reshape(len(header))
        return _Recorded(manifest, header)
    except (OSError, ValueError, csv.Error) as problem:
        raise _unreadable(golden, problem) from problem


def _record(golden: Golden) -> str:
    """The command that records it."""
    to = "" if golden.folder.parent == golden.script.parent else f" --to {typed(golden.folder.parent)}"
    return f"movimentum golden record {typed(golden.script)}{to}"


def _unreadable(golden: Golden, problem: Exception) -> ScriptError:
    reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else str(problem)
    message = f"{golden.script.name}'s golden frames in {golden.folder} cannot be read: {reason}"
    helps = (_record(golden),)
    return ScriptError([Diagnostic("golden/unreadable", Severity.ERROR, message, helps=helps)])


def _table(golden: Golden, header: list[str], rows: int) -> FloatArray:
    """The recorded numbers, (rows, columns); no more is read than ``rows`` and one more can take."""
    limit = sum(len(name.encode()) + 4 for name in header) + (rows + 1) * len(header) * _CELL_BYTES
    try:
        text = read_limited(golden.folder / "poses.csv", limit).decode("utf-8")
        _, *cells = csv.reader(text.splitlines())
        table = np.array(cells, dtype=np.float64).reshape(len(cells), len(header))
        if not np.isfinite(table).all():
            raise ValueError("there is a number in it that is not finite")
    except (OSError, ValueError, csv.Error) as problem:
        raise _unreadable(golden, problem) from problem
    return table


def _picture(path: Path, actual: Image.Image) -> Image.Image | tuple[int, int] | None:
    """A recorded picture of the same size as ``actual``; if the size is different, that size, and the picture is not
    decoded; None if there is none.
    """
    try:
        with picture_file(str(path), ("PNG",)) as image:
            return image.convert("RGB") if image.size == actual.size else image.size
    except ScriptError:
        return None


def _numbers(golden: Golden, made: Rendition, recorded: _Recorded) -> Iterator[Diagnostic]:
    """Anchors, angles and variables that differ from the recording."""
    header, frames = recorded.header, recorded.manifest.frames
    motion = made.solution.motion
    count = motion.timeline.frame_count
    chosen = columns(made.scene)
    names = ["frame", *(column.name for column in chosen)]
    gone = [name for name in header if name not in names]
    new = [name for name in names if name not in header]
    if gone or new:
        parts = [f"no {listed([f'`{n}`' for n in gone])} any more"] * bool(gone)
        parts += [f"{listed([f'`{n}`' for n in new])} that were not recorded"] * bool(new)
        yield _error("golden/changed", f"the scene has changed: there is {' and there is '.join(parts)}")
        return
    fps, before = str(motion.timeline.fps), recorded.manifest.fps
    if before is not None and fps != before:
        message = f"the frame rate is {fps}, it was {before}: poses are compared at the same times only"
        yield _error("golden/changed", message)
        return
    if count != frames:
        now, before = counted(count, "frame"), counted(frames, "frame")
        yield _error("golden/changed", f"the film has {now}, it had {before}")
        return
    poses = made.poses()
    table = _table(golden, header, len(poses.frames))
    if len(poses.frames) != len(table) or (table[:, 0] != poses.frames).any():
        yield _error("golden/changed", "the recorded frames are not those that would be recorded now")
        return
    place = {name: k for k, name in enumerate(header)}
    old = {name: table[:, place[name]] for name in names}
    now = {column.name: np.asarray(column.values(poses), dtype=np.float64) for column in chosen}
    limit = GOLDEN_PLACE * motion.size
    apart = dict(_distances(made, old, now))
    off = {name: far for name, far in apart.items() if not (far <= limit).all()}
    if not off:
        return
    first = {name: int(np.argmax(~(far <= limit))) for name, far in off.items()}
    name = min(off, key=lambda n: (first[n], -float(off[n][first[n]])))
    here = first[name]
    anchors = [n for n in apart if n not in off and f"{n}.x" in now]
    agreed = max([LEAST_AGREEMENT, *(float(apart[n].max()) for n in anchors)])
    agree = f"; {counted(len(anchors), 'other anchor')} agree to {number(agreed, 1)}" if anchors else ""
    unit = "px" if f"{name}.x" in now else "degrees" if name.endswith(".angle") else "off"
    far = number(float(off[name][here]), 3)
    worst = int(np.argmax(off[name]))
    what = f"`{name}` is {far} {unit} from where it was" if unit != "off" else f"`{name}` is {far} from what it was"
    notes = [f"`{name}` is farthest off at t = {_time(now, worst)}: by {number(float(off[name][worst]), 3)}"]
    others = sorted((n for n in off if n != name), key=lambda n: (first[n], -float(off[n].max())))
    for other in others[:MOST]:
        by = number(float(off[other].max()), 3)
        notes.append(f"so is `{other}`, from t = {_time(now, first[other])} on, by up to {by}")
    if len(others) > MOST:
        notes.append(f"and {len(others) - MOST} more")
    frame = int(poses.frames[here])
    yield _error(
        "golden/moved",
        f"{what}, at t = {_time(now, here)} (frame {frame}), first seen there{agree}",
        *notes,
    )


def _time(now: dict[str, FloatArray], row: int) -> str:
    return time_text(float(now["time"][row]))


def _distances(
    made: Rendition, old: dict[str, FloatArray], now: dict[str, FloatArray]
) -> Iterator[tuple[str, FloatArray]]:
    """How far everything is from where it was, in each row: anchors in pixels, angles in degrees, variables."""
    for thing in made.scene.things:
        if not thing.is_body:
            continue
        for anchor in thing.anchors:
            name = f"{thing.name}.{anchor.name}"
            dx, dy = (now[f"{name}.{axis}"] - old[f"{name}.{axis}"] for axis in "xy")
            yield name, np.asarray(np.hypot(dx, dy), dtype=np.float64)
        yield f"{thing.name}.angle", np.abs(now[f"{thing.name}.angle"] - old[f"{thing.name}.angle"])
    for name, variable in made.scene.variables.items():
        for title in (f"{name}.x", f"{name}.y") if variable.is_vector else (name,):
            yield title, np.abs(now[title] - old[title])
