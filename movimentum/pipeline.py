"""From a script to its products: the only module that knows all stages.

Every stage is imported where it is called, so that a command pays for what it uses: checking imports no picture, and
a script that cannot be parsed imports no solver.
"""

from __future__ import annotations

import io
import itertools
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, cast

from movimentum.diagnostics import Diagnostic, Severity, limited
from movimentum.errors import MovimentumError, NoSolutionError, ScriptError, UsageError
from movimentum.source import SourceText
from movimentum.terminal import visible

if TYPE_CHECKING:
    from movimentum.analysis.report import StepReport
    from movimentum.rendering.options import FreeMark
    from movimentum.rendering.stream import PoseSource
    from movimentum.scene.model import Scene
    from movimentum.solver.accuracy.refinement import RefinedMotion
    from movimentum.solver.motion import Motion
    from movimentum.solver.poses import Poses
    from movimentum.syntax.tree import Script
    from movimentum.timeline.model import Timeline
    from movimentum.tradeoff.pictures import PictureTrade
    from movimentum.tradeoff.tiers import SolverTrade

MAX_FRAMES = 1_000_000
MAX_PIXELS = 64_000_000
MAX_NESTING = 100
MAX_DIGITS = 1000
MAX_OPERATIONS = 20_000
MAX_SCRIPT_BYTES = 16 * 1024 * 1024
CHUNK = 2048
"""Frames solved at a time (fewer in scenes of very many things): NumPy's overhead is spread, memory stays flat."""

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
    max_nesting: int = MAX_NESTING
    max_digits: int = MAX_DIGITS
    max_operations: int = MAX_OPERATIONS


@dataclass(frozen=True, slots=True)
class Picture:
    """What is drawn and how: everything that `run` asks beyond `Choices`.

    ``frames`` chooses frames, ``at`` one instant instead; ``traces`` are ``Thing.Anchor`` names; ``show`` is a subset
    of "names", "free", "anchors"; ``background`` as the user spelled it; ``workers`` None: as many as pay.
    """

    frames: FrameChoice | None = None
    at: Fraction | None = None
    scale: float = 1.0
    traces: tuple[str, ...] = ()
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


def understand(source: SourceText, choices: Choices | None = None, max_pixels: int = MAX_PIXELS) -> Scene:
    """Parse and resolve a script; raises `ScriptError` with everything that is wrong with it."""
    from movimentum.syntax.parser import parse

    limits = choices or Choices()
    script = parse(source, max_nesting=limits.max_nesting, max_operations=limits.max_operations)
    return built(script, source, max_pixels)


def built(script: Script, source: SourceText, max_pixels: int = MAX_PIXELS) -> Scene:
    """Resolve a parsed script; raises `ScriptError` with everything that is wrong with it."""
    from movimentum.scene.build import build

    return build(script, source, _image_size, max_pixels=max_pixels)


def arranged(scene: Scene, choices: Choices) -> Timeline:
    """The scene in time; raises `ScriptError` where that makes more frames than ``choices`` allow."""
    from movimentum.timeline.arrange import arrange

    return arrange(scene, fps=choices.fps, max_frames=choices.max_frames)


@dataclass(frozen=True, slots=True)
class Solution:
    """A motion, everything that is to be said about it (the scene's warnings first), and a report for each step.

    ``fault`` is the exit code that it deserves as it is: 0, 1 (it contradicts itself, or warnings with ``strict``) or 3
    (no solution at some time).
    ``notes`` are about the accuracy asked for, and are shown where notes are not.
    """

    motion: Motion | RefinedMotion
    diagnostics: tuple[Diagnostic, ...]
    steps: Sequence[StepReport]
    fault: int
    notes: tuple[Diagnostic, ...] = ()


def moved(timeline: Timeline) -> Motion:
    """The motion, as far as there is one; `ScriptError` where a derivative depends on itself."""
    from movimentum.planning.planner import CyclicRateError
    from movimentum.solver.solver import solve

    try:
        return solve(timeline)
    except CyclicRateError as error:
        from movimentum.analysis.diagnose.failure import cyclic_rate

        raise ScriptError([*timeline.scene.diagnostics, cyclic_rate(timeline.scene, error.constraint)]) from error


def examined(timeline: Timeline, choices: Choices) -> Solution:
    """The motion with its faults told, not raised; `ScriptError` only where there is nothing to solve."""
    from movimentum.analysis.examine import examine

    before = timeline.scene.diagnostics
    motion = moved(timeline)
    notes: tuple[Diagnostic, ...] = ()
    if choices.accuracy == "draft":
        from movimentum.analysis.diagnose.accuracy import draft_note
        from movimentum.solver.accuracy.draft import drafted

        motion, error = drafted(motion)
        notes = (draft_note(error),)
    examination = examine(motion)
    found, warned = judged((*before, *_lettering(timeline.scene), *examination.diagnostics), choices)
    fault = examination.fault or (1 if warned else 0)
    if examination.doubted:
        motion = replace(motion, doubted=True)
    if choices.accuracy in ("high", "exact"):
        from movimentum.solver.accuracy.refinement import refined

        motion = refined(motion, choices.accuracy, choices.digits)
    return Solution(motion, found, examination.steps, fault, notes)


def _lettering(scene: Scene) -> tuple[Diagnostic, ...]:
    """What there is to say about labels with more than plain letters (others cost no import)."""
    labels = [thing for thing in scene.things if thing.text is not None and not thing.text.isascii()]
    if not labels:
        return ()
    from movimentum.rendering.text import lettering

    return tuple(lettering(labels))


def afterwards(solution: Solution, choices: Choices) -> tuple[tuple[Diagnostic, ...], tuple[Diagnostic, ...]]:
    """What is to be said when the frames have been computed: (diagnostics, notes); `ScriptError` for warnings with
    ``strict``.
    """
    from movimentum.solver.motion import Motion

    if isinstance(solution.motion, Motion):
        return solution.diagnostics, solution.notes
    from movimentum.analysis.diagnose.accuracy import refinement_diagnostics

    warnings, notes = refinement_diagnostics(solution.motion)
    diagnostics, warned = judged((*solution.diagnostics, *warnings), choices)
    if warned:
        raise ScriptError(diagnostics)
    return diagnostics, (*solution.notes, *notes)


def solved(timeline: Timeline, choices: Choices) -> Solution:
    """The motion, as far as ``on_failure`` lets it pass; else `ScriptError` or `NoSolutionError` with all there is."""
    solution = examined(timeline, choices)
    if solution.fault == 1:
        raise ScriptError(solution.diagnostics)
    if solution.fault and choices.on_failure == "stop":
        raise NoSolutionError(solution.diagnostics)
    return solution


def judged(diagnostics: Iterable[Diagnostic], choices: Choices) -> tuple[tuple[Diagnostic, ...], bool]:
    """With ``strict``, the diagnostics with warnings made errors, and whether there was one."""
    found = tuple(diagnostics)
    warned = choices.strict and any(item.severity is Severity.WARNING for item in found)
    if warned:
        found = tuple(
            replace(item, severity=Severity.ERROR) if item.severity is Severity.WARNING else item for item in found
        )
    return found, warned


def _image_size(path: str) -> tuple[int, int] | Diagnostic:
    from movimentum.rendering.images import image_size

    return image_size(path)


# --- what the commands ask for ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class CheckReport:
    """Everything that can be said without rendering; ``frames`` and ``duration`` None where it did not get so far."""

    diagnostics: tuple[Diagnostic, ...]
    steps: Sequence[StepReport]
    frames: int | None
    duration: float | None
    exit_code: int


def check(
    path: str, choices: Choices, *, fps_invariance: bool = False, reverse: bool = False
) -> tuple[CheckReport, SourceText]:
    """All diagnostics and the step reports; a script's errors are reported, not raised.

    ``fps_invariance`` and ``reverse`` put promises to the test on this script (see `analysis.invariance`).

    Raises `UsageError` where there is no script to read.
    """
    source = SourceText("<stdin>" if path == "-" else path, "")
    frames: int | None = None
    duration: float | None = None
    try:
        source = read(path)
        timeline = arranged(understand(source, choices), choices)
        frames, duration = timeline.frame_count, float(timeline.end - timeline.start)
        solution = examined(timeline, choices)
    except UsageError:
        raise
    except MovimentumError as error:
        return CheckReport(error.diagnostics, (), frames, duration, error.exit_code), source
    found, fault = solution.diagnostics, solution.fault
    if fault == 0:
        from movimentum.analysis.invariance import frame_rate_diagnostics, reverse_diagnostics
        from movimentum.solver.motion import Motion

        assert isinstance(solution.motion, Motion)
        more = [*frame_rate_diagnostics(solution.motion)] if fps_invariance else []
        more += reverse_diagnostics(solution.motion) if reverse else []
        fault = 1 if any(item.severity is Severity.ERROR for item in more) else 0
        found = (*found, *more)
    return CheckReport(limited(found), solution.steps, frames, duration, fault), source


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was made: how many ``frames`` (or rows), what there is to say, and the exit code (0 or 3).

    ``notes`` are to be shown although they are notes.
    """

    frames: int
    exit_code: int
    diagnostics: tuple[Diagnostic, ...]
    notes: tuple[Diagnostic, ...] = ()


def tabulate(
    source: SourceText, target: Path | None, choices: Choices, frames: FrameChoice | None, progress: Report
) -> Outcome:
    """Write the poses to ``target`` (None: CSV on stdout).

    Raises `UsageError` for more digits than ``choices`` allow (``limit/digits``), before anything is read.
    """
    from movimentum.analysis.diagnose.valueless import CODE, never_valued
    from movimentum.interop import tables
    from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file
    from movimentum.solver.motion import Motion

    if choices.digits is not None and choices.digits > choices.max_digits:
        message = f"{choices.digits:,} digits are more than the limit of {choices.max_digits:,}"
        raise _usage("limit/digits", message, f"`--max-digits {choices.digits}` raises the limit")
    if target is not None:
        refuse_unwritable(target)
    timeline = arranged(understand(source, choices), choices)
    if target is not None:
        refuse_overwriting(target, reads(source, timeline.scene))
    start, stop = _chosen(timeline, frames)
    solution = solved(timeline, choices)
    motion = solution.motion
    without = never_valued(motion if isinstance(motion, Motion) else motion.base)

    def chunks() -> Iterator[Poses]:
        for poses in _Take(motion, range(start, stop), choices.on_failure == "skip"):
            yield poses
            if len(poses.frames):
                progress(int(poses.frames[-1]) + 1 - start, stop - start)

    if target is None:
        rows = tables.write_csv(timeline.scene, chunks(), _stdout(), without)
        diagnostics, notes = afterwards(solution, choices)
    else:
        with whole_file(target) as part:
            rows = tables.write(timeline.scene, chunks(), part, target.suffix, without)
            diagnostics, notes = afterwards(solution, choices)
    filled = tuple(item for item in diagnostics if item.code == CODE)  # the table says otherwise: tell
    return Outcome(rows, solution.fault, diagnostics, (*notes, *filled))


@dataclass(frozen=True, slots=True)
class Import:
    """How a foreign file is to be read: ``snap`` repairs rounded coordinates, with angles multiples of ``snap_angle``;
    ``drives`` are the inputs (base, driven) of a mechanism expression.
    """

    snap: bool = False
    snap_angle: float = 36.0
    drives: tuple[tuple[int, int], ...] = ()


def imported(source: SourceText, target: Path | None, how: Import, strict: bool) -> Outcome:
    """Write what another program's file says as a script to ``target`` (None: stdout); its content tells its format."""
    from movimentum.interop.recognised import Kind, kind_of

    title = visible(Path(source.path).name)  # it stands in a comment of one line
    kind = kind_of(source)
    if how.snap and kind in (Kind.MECHANISM, Kind.FORMULAS):
        raise _usage("usage/import", f"--snap is for linkage files: {kind.told} has no angles to repair")
    if how.drives and kind is Kind.FORMULAS:
        raise _usage("usage/import", "--drive is for Pyslvs' mechanism expressions: formulas say what their inputs are")
    if how.drives and kind is Kind.LINKAGE:
        raise _usage("usage/import", "--drive is for Pyslvs' mechanism expressions; draw a linkage with a wish")
    found: tuple[Diagnostic, ...] = ()
    match kind:
        case Kind.MECHANISM:
            from movimentum.interop.mechanisms import mechanism_script, read_mechanism

            text = mechanism_script(read_mechanism(source), how.drives, title)
        case Kind.FORMULAS:
            from movimentum.interop.formula_script import formula_script
            from movimentum.interop.formulas import read_formulas

            text, found = formula_script(read_formulas(source), title)
        case Kind.LINKAGE:
            from movimentum.interop.linkages import linkage_script, read_linkage

            linkage, found = read_linkage(source)
            if how.snap:
                from movimentum.interop.snapping import snapped

                result = snapped(linkage, how.snap_angle)
                linkage, found = result.linkage, (*found, *result.diagnostics)
            text = linkage_script(linkage, title)
    found, warned = judged(found, Choices(strict=strict))
    if warned:
        raise ScriptError(found)
    _written(text, target, (source.path,))
    return Outcome(1, 0, found)


def exported(source: SourceText, target: Path | None, form: str, at: Fraction | None, choices: Choices) -> Outcome:
    """Write a script's scene as a linkage file, as it is at the time ``at``, or its plan as Pyslvs' formulas."""
    from movimentum.interop.linkage_export import linkage_of
    from movimentum.interop.linkages import linkage_text
    from movimentum.solver.motion import Motion

    timeline = arranged(understand(source, choices), choices)
    solution = solved(timeline, choices)
    assert isinstance(solution.motion, Motion)
    found: tuple[Diagnostic, ...] = ()
    if form == "linkages":
        moment = timeline.start if at is None else at
        if not timeline.start <= moment <= timeline.end:
            raise _usage("usage/at", f"time {moment} is outside the animation, {timeline.start} to {timeline.end}")
        active = timeline.segments[timeline.segment_at(moment)].active
        linkage, _, found = linkage_of(timeline.scene, active, solution.motion.poses_at([moment]))
        text = linkage_text(linkage)
    else:
        from movimentum.interop.formulas import formulas_text
        from movimentum.interop.triangles import triangles_of

        triangles = triangles_of(solution.motion)
        comments = [
            f"{visible(Path(source.path).name)}: angles in degrees; where there is a list, a value for each frame",
            *(f"{name}: {told}" for name, told in triangles.names),
        ]
        text = formulas_text(triangles.formulas, comments)
    found, warned = judged((*solution.diagnostics, *found), choices)
    if warned:
        raise ScriptError(found)
    _written(text, target, reads(source, timeline.scene))
    return Outcome(1, solution.fault, found)


def _written(text: str, target: Path | None, inputs: Iterable[str]) -> None:
    """Write a whole text file, which is none of ``inputs``, or to stdout."""
    from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file

    if target is None:
        _stdout().write(text)
        return
    refuse_unwritable(target)
    refuse_overwriting(target, inputs)
    with whole_file(target) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def animate(source: SourceText, target: Path, choices: Choices, picture: Picture, progress: Report) -> Outcome:
    """Render the script to ``target``, whose suffix names the format; a picture without ``%d`` is the first frame."""
    from movimentum.analysis.diagnose.off_canvas import OUTSIDE
    from movimentum.encoding.write import STILL_KINDS, check_output, write_animation
    from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file
    from movimentum.rendering.options import PictureOptions, Quality, Show, trace_anchors
    from movimentum.rendering.painter import make_painter
    from movimentum.solver.motion import Motion

    kind = check_output(target, transparent=picture.transparent)
    background = None if picture.background is None else _color(picture.background)
    refuse_unwritable(target)
    timeline = arranged(understand(source, choices, picture.max_pixels), choices)
    scene = timeline.scene
    numbers = range(timeline.frame_count + 1 if kind == "sequence" else 0)
    refuse_overwriting(target, reads(source, scene), numbers)
    options = PictureOptions(
        quality=Quality(picture.quality),
        scale=picture.scale,
        background=background,
        transparent=picture.transparent,
        traces=trace_anchors(scene, picture.traces),
        show=frozenset(Show(word) for word in picture.show),
        max_pixels=picture.max_pixels,
    )
    start, stop = _chosen(timeline, picture.frames)
    if picture.at is not None and not timeline.start <= picture.at <= timeline.end:
        raise _usage(
            "usage/at", f"time {picture.at} is outside the animation, from {timeline.start} to {timeline.end}", "--at 0"
        )
    ready = None
    if scene.config.size is not None and not options.traces and Show.FREE not in options.show:
        ready = make_painter(scene, (), options)  # what is too large or cannot be read is refused before the work
    solution = solved(timeline, choices)
    motion, skip = solution.motion, choices.on_failure == "skip"
    if picture.at is not None:
        start = math.ceil((picture.at - timeline.start) * timeline.fps)
        poses: PoseSource = _Take(motion, (picture.at,), skip).held()
    else:
        poses = _Take(motion, range(start, start + 1 if kind in STILL_KINDS else stop), skip).held()
    if Show.FREE in options.show:
        times = [picture.at] if picture.at is not None else [timeline.frame_time(frame) for frame in range(start, stop)]
        options = replace(options, free=_free_marks(motion if isinstance(motion, Motion) else motion.base, times))
    if not any(len(chunk.frames) for chunk in poses):
        message = "none of the frames asked for has a solution"
        raise NoSolutionError([*solution.diagnostics, Diagnostic("solve/unreachable", Severity.ERROR, message)])
    painter = ready or make_painter(
        scene,
        _Take(motion, range(timeline.frame_count), skip),
        options,
        before=_Take(motion, range(start), skip),
    )
    with ExitStack() as stack:
        # A warning that only the writing brings to light must not leave a file with --strict: a place beside it, then.
        place = stack.enter_context(whole_file(target)) if choices.strict and kind != "sequence" else target
        written = write_animation(
            painter,
            poses,
            place,
            fps=timeline.fps,
            loop=picture.loop,
            workers=picture.workers,
            progress=progress,
        )
        said, notes = afterwards(solution, choices)
        diagnostics, warned = judged((*said, *written.diagnostics), choices)
        if warned:
            raise ScriptError(diagnostics)
    unseen = tuple(item for item in diagnostics if item.code == OUTSIDE)  # it is missing in the picture: tell
    return Outcome(written.frames, solution.fault, diagnostics, (*notes, *unseen))


FREE_MOMENTS = 24
"""Moments of an animation at which its free motions are found anew; arrows turn with their things in between."""


def _free_marks(motion: Motion, times: Sequence[Fraction]) -> tuple[FreeMark, ...]:
    """Arrows for all free motions at ``times`` (ascending): one for each moving anchor, numbered by motion."""
    from movimentum.analysis.freedom.motions import free_motions_at
    from movimentum.rendering.options import FreeMark

    if len(times) > FREE_MOMENTS:
        times = [times[round(k * (len(times) - 1) / (FREE_MOMENTS - 1))] for k in range(FREE_MOMENTS)]
    edges = [-math.inf, *(float((a + b) / 2) for a, b in itertools.pairwise(times)), math.inf]
    things = motion.timeline.scene.things
    marks: list[FreeMark] = []
    for time, (begin, end) in zip(times, itertools.pairwise(edges), strict=True):
        poses = motion.poses_at([time])
        for number, found in enumerate(free_motions_at(motion, time)):
            for ref, (vx, vy) in found.velocities:
                c, s = poses.direction[ref.thing, 0].tolist()
                local = things[ref.thing].anchors[ref.anchor].local
                marks.append(FreeMark(ref.thing, local, (c * vx + s * vy, c * vy - s * vx), number, begin, end))
    return tuple(marks)


@dataclass(frozen=True, slots=True)
class TradeReport:
    """What accuracy costs and what it buys on one script: of the solver, of drawing, and of more frames a time unit.

    ``rates``: (frames per time unit, the farthest that an anchor moves from one frame to the next, in pixels).
    """

    solver: SolverTrade
    pictures: PictureTrade
    rates: tuple[tuple[Fraction, float], ...]


TRADE_PICTURES = 4
"""Frames that are drawn in every way."""


def trade(
    source: SourceText, target: Path | None, choices: Choices, progress: Report, max_pixels: int = MAX_PIXELS
) -> tuple[TradeReport, Outcome]:
    """Measure the trade between time and accuracy on a script, and plot it to ``target`` (`.png` or `.svg`).

    Raises as `solved` does: only what has a solution can be measured.
    """
    from movimentum.output.files import refuse_overwriting, refuse_unwritable, whole_file
    from movimentum.solver.accuracy.refinement import DEFAULT_DIGITS
    from movimentum.tradeoff.pictures import measure_pictures
    from movimentum.tradeoff.tiers import measure_rate, measure_tiers

    if target is not None:
        refuse_unwritable(target)
    timeline = arranged(understand(source, choices, max_pixels), choices)
    if target is not None:
        refuse_overwriting(target, reads(source, timeline.scene))
    solution = solved(timeline, choices)
    count = timeline.frame_count
    tiers = measure_tiers(timeline, choices.digits or DEFAULT_DIGITS, progress)
    every = _Take(solution.motion, range(count), False)
    places = sorted({round(k * (count - 1) / max(1, TRADE_PICTURES - 1)) for k in range(TRADE_PICTURES)})
    some = solution.motion.poses_at([timeline.frame_time(place) for place in places])
    pictures = measure_pictures(timeline.scene, every, some, progress)
    rates = tuple((timeline.fps * k / 2, measure_rate(solution.motion, timeline.fps * k / 2)) for k in (1, 2, 4))
    report = TradeReport(tiers, pictures, rates)
    if target is not None:
        from movimentum.encoding.plot import write_plot
        from movimentum.tradeoff.report import panels

        with whole_file(target) as part:
            write_plot(panels(visible(source.path), report.solver, report.pictures), part, target.suffix)
    return report, Outcome(count, solution.fault, solution.diagnostics)


@dataclass(frozen=True, slots=True)
class _Take:
    """The poses of some frames (or at some times), in chunks; computed again whenever they are looked at.

    A pose costs less to compute again than to keep: microseconds, and memory does not grow with the length.
    ``skip`` leaves out frames without a solution.
    """

    motion: Motion | RefinedMotion
    frames: range | tuple[Fraction, ...]
    skip: bool

    def __iter__(self) -> Iterator[Poses]:
        size = max(60, min(CHUNK, 200_000 // max(1, len(self.motion.timeline.scene.things))))
        for first in range(0, len(self.frames), size):
            some = self.frames[first : first + size]
            poses = self.motion.poses(some.start, some.stop) if isinstance(some, range) else self.motion.poses_at(some)
            if self.skip and not poses.solved.all():
                poses = poses.select(poses.solved.nonzero()[0])
            yield poses

    def held(self) -> Iterable[Poses]:
        """The same; if that is little, computed now and kept."""
        return tuple(self) if len(self.frames) * len(self.motion.timeline.scene.things) <= 50_000 else self


def _color(text: str) -> tuple[int, int, int]:
    from movimentum.scene.colors import color, color_names

    found = color(text)
    if found is None:
        from difflib import get_close_matches

        near = get_close_matches(text.lower(), color_names(), 3) or ["white", "'#ffcc00'"]
        raise _usage("usage/color", f"there is no colour `{text}`", *(f"--background {name}" for name in near))
    return found


def reads(source: SourceText, scene: Scene | None) -> tuple[str, ...]:
    """Every file that a command reads for a script: the script and its pictures (without a scene, what it may mean)."""
    if scene is None:
        return (source.path, *map(str, mentioned_files(source)))
    return (source.path, *dict.fromkeys(thing.image for thing in scene.things if thing.image is not None))


def mentioned_files(source: SourceText) -> tuple[Path, ...]:
    """Every file that the script may refer to, whether or not it exists or the script can be parsed.

    For watching: each quoted text is taken for a file's name. A label's text is none, and nobody notices.
    """
    import re

    folder = Path() if source.path.startswith("<") else Path(source.path).parent
    return tuple(folder / name for name in re.findall(r"""['"]([^'"\n\0]{1,255})['"]""", source.text))


def _stdout() -> TextIO:
    """Standard output for the text of a file, which is UTF-8 wherever it goes but to a terminal; `UsageError` where it
    is closed.
    """
    stream = sys.stdout
    if stream is None:  # pyright: ignore[reportUnnecessaryComparison]
        raise _usage("output/unwritable", "there is no standard output to write to")
    if not isinstance(stream, io.TextIOWrapper):
        pass
    elif stream.isatty():
        cast("io.TextIOWrapper", stream).reconfigure(errors="backslashreplace")
    else:
        cast("io.TextIOWrapper", stream).reconfigure(encoding="utf-8", newline="\n")
    return cast("TextIO", stream)


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
