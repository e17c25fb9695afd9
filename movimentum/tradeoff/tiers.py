"""What each accuracy tier costs and gains, measured on one timeline.

Drawing is measured too: time per frame against the error, compared with a heavily supersampled picture.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from statistics import median
from typing import Any

import numpy as np
from PIL import Image

from movimentum.drawing.picture_options import PictureOptions, Quality
from movimentum.encoding.palette import Mapper, Samples, choose_palette
from movimentum.expressions import Expr
from movimentum.planning.lowering.equations import Equation, Form
from movimentum.planning.lowering.unknowns import Rate, symbol_numbers
from movimentum.records import dataclass, replace
from movimentum.rendering.painter import Painter, PaintSession, make_painter
from movimentum.rendering.stream import PoseSource
from movimentum.scene.model import Scene
from movimentum.settings import Accuracy
from movimentum.solver.accuracy.draft import DraftMotion, interpolated_motion
from movimentum.solver.accuracy.refinement import RefinedMotion, refine
from movimentum.solver.arithmetic.double_double import WideArithmetic
from movimentum.solver.arithmetic.evaluation import Arithmetic, Evaluator, Number, ordered_nodes
from movimentum.solver.basis.effort import tighten_steps
from movimentum.solver.basis.instants import at_times
from movimentum.solver.continuation.tracks import NodeTrack, OdeTrack
from movimentum.solver.motion import MotionOfAnyAccuracy, PathMotion
from movimentum.solver.path.piece import Piece, evaluate_piece
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.solver.solver import solve
from movimentum.timeline.model import Timeline

SAMPLES = 48
"""The number of frames at which tiers are compared with `exact`, evenly spread if there are more."""
RUNS = 5
PATIENCE_S = 1.0
"""A measurement is repeated `RUNS` times, or less often if that would take longer than this."""
TIMED_FRAMES = 20_000
TIGHTER = 0.01
"""The error of a step of the motion by which the integration's error is measured, of that which is usual."""


@dataclass(frozen=True, slots=True)
class Tier:
    """``start``: seconds to compile and find the path, and to prepare frames; ``frame``: seconds per frame.

    ``residual``: the largest of the script's own equations and of rigidity, relative to the scene's size. ``error``:
    the largest distance of an anchor from its place in `exact` (pixels). ``claim``: the error that `draft`
    reports; None where it is the same as `standard`.
    """

    name: str
    start: float
    frame: float
    residual: float
    error: float
    claim: float | None = None


@dataclass(frozen=True, slots=True)
class SolverTrade:
    """The four tiers, on ``frames`` frames, compared at ``samples`` of them; ``size``: the scene's (pixels). ``rough``:
    what all tiers take from the path in float64, so that none of them is the truth. ``integration``: the error (pixels)
    of that, where it is free motion or a differential equation.
    """

    frames: int
    samples: int
    size: float
    digits: int
    tiers: tuple[Tier, ...]
    rough: tuple[str, ...] = ()
    integration: float | None = None


def timed(work: Callable[[], Any], runs: int = RUNS) -> float:
    """Median seconds of ``work`` over several runs."""
    seconds: list[float] = []
    while len(seconds) < runs and (not seconds or sum(seconds) < PATIENCE_S):
        begin = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begin)
    return median(seconds)


def measure_tiers(timeline: Timeline, digits: int, progress: Callable[[int, int], None]) -> SolverTrade:
    """Measure all tiers; the timeline must have a solution."""
    count = timeline.frame_count
    places = sorted({round(k) for k in np.linspace(0, count - 1, min(SAMPLES, count))})
    times = [timeline.frame_time(place) for place in places]
    many = min(count, TIMED_FRAMES)
    motion = solve(timeline)
    begin = timed(lambda: solve(timeline))
    progress(1, 6)
    exact = refine(motion, Accuracy.EXACT, digits)
    exact_start = _first(exact, times)
    began = time.perf_counter()
    truth = exact.poses_at(times)
    exact_frame = (time.perf_counter() - began) / len(times)
    progress(3, 6)

    every = motion.poses(0, many)
    chosen = np.array([place for place in places if place < many], dtype=np.int64)
    scene = timeline.scene
    standard = Tier(
        "standard",
        begin,
        timed(lambda: motion.poses(0, many)) / many,
        _residual(motion, times, WideArithmetic(), _as_floats(motion)),
        _farthest(scene, every.select(chosen), truth.select(slice(0, len(chosen)))),
    )
    tiers = [replace(standard, name="draft"), standard]
    draft = interpolated_motion(motion)
    if isinstance(draft, DraftMotion):
        tiers[0] = Tier(
            "draft",
            begin + timed(lambda: interpolated_motion(motion)),
            timed(lambda: draft.poses(0, many)) / many,
            _residual(draft.interpolated, times, WideArithmetic(), _as_floats(draft.interpolated)),
            max(_farthest(scene, every, draft.poses(0, many)), _farthest(scene, draft.poses_at(times), truth)),
            draft.error,
        )
    progress(4, 6)
    high = refine(motion, Accuracy.HIGH)
    high_start = _first(high, times)
    some = min(many, 2048)
    better = high.poses_at(times)
    tiers.append(
        Tier(
            "high",
            begin + high_start,
            timed(lambda: high.poses(0, some)) / some,
            _residual(motion, times, WideArithmetic(), _as_rounded(high)),
            _farthest(scene, better, truth),
        )
    )
    progress(5, 6)
    residual = _residual(motion, times[:: max(1, len(times) // 12)], exact.arithmetic, _as_digits(exact))
    tiers.append(Tier("exact", begin + exact_start, exact_frame, residual, 0.0))
    progress(6, 6)
    rough = tuple(exact.attained.inexact)
    integration = _integration_error(timeline, motion, times)
    return SolverTrade(count, len(times), motion.size, digits, tuple(tiers), rough, integration)


def _integration_error(timeline: Timeline, motion: PathMotion, times: Sequence[Fraction]) -> float | None:
    """The largest distance (pixels) at ``times`` to a motion with far more accurate steps; None without any."""
    tracks = [t for s in motion.segments for piece in s.pieces if isinstance(piece, Piece) for t in piece.tracks]
    if not any(isinstance(t, OdeTrack) or (isinstance(t, NodeTrack) and t.tolerance > 0.0) for t in tracks):
        return None
    with tighten_steps(TIGHTER):
        better = solve(timeline)
    return _farthest(timeline.scene, motion.poses_at(times), better.poses_at(times))


def _first(motion: RefinedMotion, times: Sequence[Fraction]) -> float:
    """Seconds that the first instant takes, with all that is prepared for it."""
    began = time.perf_counter()
    motion.poses_at(times[:1])
    return time.perf_counter() - began


def _farthest(scene: Scene, some: Poses, others: Poses) -> float:
    """The largest distance of any anchor between the two, over the frames that both have solved."""
    both = some.solved & others.solved
    worst = 0.0
    for thing in scene.things:
        for anchor in thing.anchors if thing.is_body else ():
            way = some.world(thing.number, anchor.local) - others.world(thing.number, anchor.local)
            worst = max(worst, float(np.max(np.hypot(way[both, 0], way[both, 1]), initial=0.0)))
    return worst


def measure_rate(motion: MotionOfAnyAccuracy, fps: Fraction) -> float:
    """How far the fastest anchor moves from one frame to the next at ``fps`` (pixels): what a lower rate loses."""
    timeline = motion.timeline
    count = min(int((timeline.end - timeline.start) * fps) + 1, TIMED_FRAMES)
    poses = motion.poses_at([timeline.start + k / fps for k in range(count)])
    worst = 0.0
    for thing in timeline.scene.things:
        for anchor in thing.anchors if thing.is_body else ():
            way = np.diff(poses.world(thing.number, anchor.local), axis=0)
            worst = max(worst, float(np.max(np.hypot(way[:, 0], way[:, 1]), initial=0.0)))
    return worst


# --- residuals


Known = Callable[[int, Piece, list[Fraction], Arithmetic], list[Number] | None]
"""All unknowns of a piece (of segment number …) at some times, as a tier has them; None where there is no solution."""


def _as_floats(motion: PathMotion) -> Known:
    def known(number: int, piece: Piece, times: list[Fraction], arithmetic: Arithmetic) -> list[Number] | None:
        instants = at_times(piece.plan.clocks, motion.segments[number].segment.start, times)
        with np.errstate(all="ignore"):
            floats, bad = evaluate_piece(piece, instants)
        if bad.any():
            return None
        return [None if value is None else arithmetic.floats(np.broadcast_to(value, len(times))) for value in floats]

    return known


def _as_digits(motion: RefinedMotion) -> Known:
    return lambda number, piece, times, _: motion.state(number, piece, times)[0]


def _as_rounded(motion: RefinedMotion) -> Known:
    """As it is reported: rounded to floats."""
    rounded = motion.arithmetic.rounded

    def known(number: int, piece: Piece, times: list[Fraction], arithmetic: Arithmetic) -> list[Number] | None:
        state = motion.state(number, piece, times)[0]
        return [None if value is None else arithmetic.floats(rounded(value)) for value in state]

    return known


def _residual(motion: PathMotion, times: Sequence[Fraction], arithmetic: Arithmetic, known: Known) -> float:
    """The largest residual at ``times``, evaluated in ``arithmetic``, of what is ``known``."""
    evaluator = Evaluator(arithmetic)
    worst = 0.0
    for number, piece, some in _by_piece(motion, times):
        state = known(number, piece, some, arithmetic)
        if state is not None:
            worst = max(worst, _of_state(motion, piece, evaluator, state, some))
    return worst


def _by_piece(motion: PathMotion, times: Sequence[Fraction]) -> Iterator[tuple[int, Piece, list[Fraction]]]:
    for number, segment_motion in enumerate(motion.segments):
        inside = [time for time in times if motion.timeline.segment_at(time) == number]
        for piece, end in _with_ends(segment_motion):
            if isinstance(piece, UnsolvedInterval):
                continue
            some = [t for t in inside if piece.begin <= float(t - segment_motion.segment.start) < end]
            if some:
                yield number, piece, some


def _with_ends(segment_motion: SegmentMotion) -> Iterator[tuple[Piece | UnsolvedInterval, float]]:
    begins = [piece.begin for piece in segment_motion.pieces[1:]]
    yield from zip(segment_motion.pieces, [*begins, float("inf")], strict=True)


def _of_state(
    motion: PathMotion, piece: Piece, evaluator: Evaluator, state: list[Number], times: list[Fraction]
) -> float:
    system = piece.plan.system
    known = {n for n, value in enumerate(state) if value is not None}
    rows = [
        e
        for e in system.equations
        if e.form is Form.PLAIN
        and symbol_numbers(e.original or e.residual) <= known
        and not any(isinstance(system.unknowns[n].payload, Rate) for n in e.unknowns)
    ]
    outputs = [e.original or e.residual for e in rows]

    def leaf(node: Expr) -> Number:
        if node.op == "clock":
            return evaluator.arithmetic.rationals([time - node.start for time in times])
        assert isinstance(node.payload, int)
        return state[node.payload]

    worst = 0.0
    with np.errstate(all="ignore"):
        values = evaluator.values(ordered_nodes(outputs), outputs, leaf)
        for row, value in zip(rows, values, strict=True):
            off = np.abs(evaluator.arithmetic.rounded(value))
            if _is_angle(row):  # angles agree modulo a turn
                off = np.minimum(off, np.abs(off - 360.0))
            size = 1.0 if row.constraint is None else motion.size
            worst = max(worst, float(np.max(off[np.isfinite(off)], initial=0.0)) / size)
    return worst


def _is_angle(row: Equation) -> bool:
    return row.original is not None and row.original.op in ("add", "atan2d")


FINEST = 8
LARGEST = 48_000_000
"""Pixels of the supersampled truth; if it would have more, it is supersampled less."""
DRAWINGS = 3


@dataclass(frozen=True, slots=True)
class PictureCost:
    """One way to draw. ``frame``: seconds per frame; ``error``: root mean square over pixels and channels, of 255."""

    name: str
    frame: float
    error: float


@dataclass(frozen=True, slots=True)
class PictureTrade:
    """``size`` in pixels at scale 1; ``frames`` compared with a truth drawn ``supersampling`` times as large."""

    size: tuple[int, int]
    frames: int
    supersampling: int
    costs: tuple[PictureCost, ...]


def measure_pictures(
    scene: Scene, source: PoseSource, some: Poses, progress: Callable[[int, int], None]
) -> PictureTrade:
    """Draw the frames ``some`` in every way; ``source`` is the whole film, to which the canvas fits."""
    plain = make_painter(scene, source, PictureOptions())
    width, height = plain.size
    finest = max(2, min(FINEST, int((LARGEST / (width * height)) ** 0.5)))
    fine = replace(make_painter(scene, source, PictureOptions(scale=finest)), traces=())
    # one at a time: the truth of a frame may have tens of millions of pixels
    truth = [_reduced([image.convert("RGB")], (width, height))[0] for image in PaintSession(fine).frames(some)]
    progress(1, 4)
    costs: list[PictureCost] = []
    standard: list[Image.Image] = []
    for quality in Quality:
        painter = make_painter(scene, source, PictureOptions(quality=quality))
        images, seconds = _drawn(painter, some)
        costs.append(PictureCost(f"quality {quality}", seconds, _rms(images, truth)))
        standard = images if quality is Quality.STANDARD else standard
    progress(2, 4)
    for scale in (0.5, 2.0):
        images, seconds = _drawn(make_painter(scene, source, PictureOptions(scale=scale)), some)
        costs.append(PictureCost(f"scale {scale:g}", seconds, _rms(_reduced(images, (width, height)), truth)))
    progress(3, 4)
    begin = time.perf_counter()
    palette = choose_palette(Samples.of(standard))
    mapper = Mapper(palette)
    mapped = [_mapped(mapper, palette.table(), image) for image in standard]
    seconds = (time.perf_counter() - begin) / len(standard)
    costs.append(PictureCost("palette (GIF)", seconds, _rms(mapped, standard)))
    progress(4, 4)
    return PictureTrade((width, height), len(some.frames), finest, tuple(costs))


def _drawn(painter: Painter, poses: Poses) -> tuple[list[Image.Image], float]:
    """The pictures, and the median seconds per frame of drawing them."""
    painter = replace(painter, traces=())
    seconds: list[float] = []
    images: list[Image.Image] = []
    while len(seconds) < DRAWINGS and sum(seconds) < 1.0:
        begin = time.perf_counter()
        images = [image.convert("RGB") for image in PaintSession(painter).frames(poses)]
        seconds.append(time.perf_counter() - begin)
    return images, median(seconds) / len(images)


def _reduced(images: Sequence[Image.Image], size: tuple[int, int]) -> list[Image.Image]:
    """Pictures brought to ``size``: averaged if they are larger, interpolated if they are smaller."""
    return [
        image.resize(size, Image.Resampling.BOX if image.width > size[0] else Image.Resampling.BICUBIC)
        for image in images
    ]


def _mapped(mapper: Mapper, table: bytes, image: Image.Image) -> Image.Image:
    indices = mapper.indices(image)
    colors = np.frombuffer(table, dtype=np.uint8).reshape(-1, 3)
    return Image.fromarray(colors[indices])


def _rms(images: Sequence[Image.Image], truth: Sequence[Image.Image]) -> float:
    total = 0.0
    for image, right in zip(images, truth, strict=True):
        off = np.asarray(image, dtype=np.float64) - np.asarray(right, dtype=np.float64)
        total += float(np.mean(off * off))
    return (total / len(images)) ** 0.5
