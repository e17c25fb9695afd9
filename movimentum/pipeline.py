"""From a script to its products: the only module that knows all stages.

Every stage is imported where it is called, so that a command pays for what it uses: checking imports no picture, and
a script that cannot be parsed imports no solver.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import MovimentumError, ScriptError, UsageError
from movimentum.source import SourceText

if TYPE_CHECKING:
    from movimentum.scene.model import Scene
    from movimentum.solve.motion import Poses
    from movimentum.solve.solver import Motion
    from movimentum.timeline.model import Timeline

MAX_FRAMES = 1_000_000
MAX_PIXELS = 100_000_000
MAX_SCRIPT_BYTES = 16 * 1024 * 1024
CHUNK = 2048
"""Frames solved at a time for a table: memory stays flat, NumPy's overhead is spread over enough of them."""

FrameChoice = Callable[[int], tuple[int, int]]
"""From the number of frames to the first one wanted and the end (not included)."""

Report = Callable[[int, int], None]
"""Called with how much is done, out of how much."""


@dataclass(frozen=True, slots=True)
class Choices:
    """How a script is to be understood and solved: what all commands have in common."""

    fps: Fraction | None = None
    accuracy: str = "standard"
    digits: int | None = None
    on_failure: str = "stop"
    strict: bool = False
    max_frames: int = MAX_FRAMES


@dataclass(frozen=True, slots=True)
class Picture:
    """What is drawn and how: everything that `run` asks beyond `Choices`.

    ``frames`` chooses frames, ``at`` one instant instead; ``traces`` are (thing, anchor) names; ``show`` is a subset of
    "names", "free", "anchors"; ``background`` as the user spelled it; ``workers`` None: as many as pay.
    """

    frames: FrameChoice | None = None
    at: Fraction | None = None
    scale: float = 1.0
    traces: tuple[tuple[str, str], ...] = ()
    show: frozenset[str] = frozenset()
    background: str | None = None
    quality: str = "standard"
    loop: int = 0
    transparent: bool = False
    workers: int | None = None
    max_pixels: int = MAX_PIXELS


# --- stages in a row ----------------------------------------------------------------------------------


def read(path: str) -> SourceText:
    """The script at ``path`` (``-`` is stdin); raises `UsageError` where there is none, `ScriptError` for no text."""
    shown = "<stdin>" if path == "-" else path
    try:
        if path == "-":
            data = sys.stdin.buffer.read(MAX_SCRIPT_BYTES + 1)
        else:
            with Path(path).open("rb") as stream:
                data = stream.read(MAX_SCRIPT_BYTES + 1)
    except (OSError, ValueError, AttributeError) as problem:
        reason = (getattr(problem, "strerror", None) or str(problem)).lower()
        raise _usage("usage/script", f"cannot read {shown}: {reason}") from problem
    if len(data) > MAX_SCRIPT_BYTES:
        raise _script("limit/script", f"{shown} is larger than {MAX_SCRIPT_BYTES // 2**20} MiB, which no script needs")
    try:
        return SourceText(shown, data.decode("utf-8-sig"))
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        raise _script(
            "syntax/encoding",
            f"{shown} is not text: byte {problem.start} (line {line}) is no UTF-8",
            "a script is a plain text file; save it as UTF-8",
        ) from problem


def understand(source: SourceText) -> Scene:
    """Parse and resolve a script; raises `ScriptError` with everything that is wrong with it."""
    from movimentum.scene.build import build
    from movimentum.syntax.parser import parse

    return build(parse(source), source, _image_size)


def arranged(scene: Scene, choices: Choices) -> Timeline:
    """The scene in time; raises `ScriptError` where that makes more frames than ``choices`` allow."""
    from movimentum.timeline.arrange import arrange

    return arrange(scene, fps=choices.fps, max_frames=choices.max_frames)


def solved(timeline: Timeline, choices: Choices) -> Motion:
    """The motion; raises `ScriptError` or `NoSolutionError` with everything known so far.

    With ``strict``, warnings (of all stages so far) become errors here.
    """
    from movimentum.solve.solver import SolveOptions, solve

    before = timeline.scene.diagnostics
    options = SolveOptions(on_failure=choices.on_failure, accuracy=choices.accuracy, strict=choices.strict)
    try:
        motion = solve(timeline, options)
    except MovimentumError as error:
        raise type(error)([*before, *error.diagnostics]) from error
    if choices.strict:
        refuse_warnings([*before, *motion.diagnostics])
    return motion


def refuse_warnings(diagnostics: Sequence[Diagnostic]) -> None:
    """Raise `ScriptError` if there is a warning: all of them, as errors."""
    if any(item.severity is Severity.WARNING for item in diagnostics):
        raise ScriptError(
            replace(item, severity=Severity.ERROR) if item.severity is Severity.WARNING else item
            for item in diagnostics
        )


def _image_size(path: str) -> tuple[int, int]:
    from movimentum.render.sprites import image_size

    return image_size(path)


# --- what the commands ask for ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class StepReport:
    """One line of `check`: what was left to solve between two steps, and how free it is."""

    time: float
    end: float
    unknowns: int
    equations: int
    rank: int
    freedom: int
    redundant: int
    blocks: tuple[tuple[tuple[str, ...], str], ...]


@dataclass(frozen=True, slots=True)
class CheckReport:
    """Everything that can be said without rendering; ``frames`` and ``duration`` None where it did not get so far."""

    diagnostics: tuple[Diagnostic, ...]
    steps: tuple[StepReport, ...]
    frames: int | None
    duration: float | None
    exit_code: int


def check(source: SourceText, choices: Choices) -> CheckReport:
    """All diagnostics and the step reports; errors are reported, not raised."""
    frames: int | None = None
    duration: float | None = None
    try:
        timeline = arranged(understand(source), choices)
        frames, duration = timeline.frame_count, float(timeline.end - timeline.start)
        motion = solved(timeline, choices)
    except MovimentumError as error:
        return CheckReport(error.diagnostics, (), frames, duration, error.exit_code)
    steps = tuple(
        StepReport(
            float(step.time),
            float(step.end),
            step.unknowns,
            step.equations,
            step.rank,
            step.freedom,
            step.redundant,
            tuple((tuple(unknowns), str(kernel)) for unknowns, kernel in step.blocks),
        )
        for step in motion.steps
    )
    diagnostics = (*timeline.scene.diagnostics, *motion.diagnostics)
    worst = any(item.severity is Severity.ERROR for item in diagnostics)
    return CheckReport(diagnostics, steps, frames, duration, 1 if worst else 0)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was made: how many ``frames`` (or rows), how many frames ``failed``, and what there is to say.

    ``inputs`` are the files that it was made from.
    """

    frames: int
    failed: int
    diagnostics: tuple[Diagnostic, ...]
    inputs: tuple[Path, ...] = ()


def tabulate(
    source: SourceText, target: Path | None, choices: Choices, frames: FrameChoice | None, progress: Report
) -> Outcome:
    """Write the poses to ``target`` (None: CSV on stdout)."""
    from movimentum.files import whole_file
    from movimentum.interop import tables

    timeline = arranged(understand(source), choices)
    start, stop = _chosen(timeline, frames)
    motion = solved(timeline, choices)
    failed = 0

    def chunks() -> Iterator[Poses]:
        nonlocal failed
        for first in range(start, stop, CHUNK):
            progress(first - start, stop - start)
            poses = motion.poses(first, min(first + CHUNK, stop))
            bad = int((~poses.solved).sum())
            failed += bad
            yield poses.select(poses.solved.nonzero()[0]) if bad and choices.on_failure == "skip" else poses

    if target is None:
        rows = tables.write_csv(timeline.scene, chunks(), _stdout())
    else:
        with whole_file(target) as part:
            rows = tables.write(timeline.scene, chunks(), part, target.suffix)
    return Outcome(rows, failed, (*timeline.scene.diagnostics, *motion.diagnostics))


def animate(source: SourceText, target: Path, choices: Choices, picture: Picture, progress: Report) -> Outcome:
    """Render the script to ``target``, whose suffix names the format."""
    raise NotImplementedError


def _stdout() -> TextIO:
    """Standard output; `UsageError` where it is closed."""
    if sys.stdout is None:  # pyright: ignore[reportUnnecessaryComparison]
        raise _usage("output/unwritable", "there is no standard output to write to")
    return sys.stdout


def _chosen(timeline: Timeline, frames: FrameChoice | None) -> tuple[int, int]:
    """First frame and end (not included); `UsageError` where that is no frame at all."""
    count = timeline.frame_count
    start, stop = (0, count) if frames is None else frames(count)
    if start >= stop:
        raise _usage(
            "usage/frames", f"--frames chooses none of the {count} frames (0 to {count - 1})", f"--frames 0:{count}"
        )
    return start, stop


def _usage(code: str, message: str, *helps: str) -> UsageError:
    return UsageError([Diagnostic(code, Severity.ERROR, message, helps=helps)])


def _script(code: str, message: str, *helps: str) -> ScriptError:
    return ScriptError([Diagnostic(code, Severity.ERROR, message, helps=helps)])
