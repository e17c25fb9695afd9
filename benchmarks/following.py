"""What the conditions on a step of a path buy: random triads followed with and without each, beside a fine reference.

    python benchmarks/following.py [--count N] [--fps F]

A triad is a platform on three rods, each driven by a crank of its own: an irreducible block with up to six assembly
modes. Half of the triads here come close to a singular pose without reaching it, or have their end there. The reference
shares no code with the solver: Newton's method on the three lengths, from an extrapolation, in steps that are halved
until the correction is below a hundredth of the displacement, five thousand a film at least. A jump is a frame before
the reference's end whose pose is another; an end that is missed is one that is off by more than a frame.
"""

from __future__ import annotations

import argparse
import functools
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from movimentum.solver.block.block_at_instant import BlockAtInstant  # noqa: E402
from movimentum.solver.continuation import steps, trace  # noqa: E402
from movimentum.solver.kinds import newton  # noqa: E402
from movimentum.source import SourceText  # noqa: E402
from movimentum.workflow.choices import Choices  # noqa: E402
from movimentum.workflow.stages import arranged, moved, understand  # noqa: E402

FloatArray = NDArray[np.float64]
TURN = 10.0
"""Time units of a turn of the slowest crank."""
FINE = 5_000
OFF = 1e-4
"""Of the platform's size: how far a pose of the same path may be from the reference's."""


@dataclass(frozen=True, slots=True, eq=False)
class Triad:
    """``pivots`` (3, 2), ``cranks`` (3,) radii, ``phases`` (3,) and ``speeds`` (3,) in degrees, ``platform`` (3, 2) in
    its own frame, ``pose`` (x, y, turn) at the beginning.
    """

    pivots: FloatArray
    cranks: FloatArray
    phases: FloatArray
    speeds: FloatArray
    platform: FloatArray
    pose: FloatArray

    def pins(self, t: float) -> FloatArray:
        """(3, 2) the cranks' ends."""
        angle = np.radians(self.phases + self.speeds * t)
        return self.pivots + self.cranks[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def corners(self, pose: FloatArray) -> FloatArray:
        """(3, 2) the platform's corners."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        return pose[:2] + self.platform @ np.array([[c, s], [-s, c]])

    @property
    def lengths(self) -> FloatArray:
        """(3,) of the rods."""
        return np.asarray(np.hypot(*(self.corners(self.pose) - self.pins(0.0)).T), dtype=np.float64)

    def script(self, fps: int) -> str:
        """The drawing, and what is connected to what."""
        pins, corners = self.pins(0.0).tolist(), self.corners(self.pose).tolist()
        parts = [
            f".config({fps}, 600, 600);",
            "T : .bar " + " ".join(f"{n} = {p}" for n, p in zip("ABD", corners, strict=True)) + ";",
        ]
        step = []
        for i, name in enumerate("ABD"):
            parts.append(f"C{i} : .bar O = {self.pivots[i].tolist()} P = {pins[i]};")
            parts.append(f"L{i} : .bar P = {pins[i]} Q = {corners[i]};")
            step.append(f"C{i}.O = {self.pivots[i].tolist()}; C{i}.angle = {self.speeds[i]}*.t;")
            step.append(f"L{i}.P = C{i}.P; L{i}.Q = T.{name};")
        return "\n".join([*parts, "@0", *step, f"@{TURN}", ""])


def triads(count: int, seed: int = 7) -> Iterator[Triad]:
    """Random ones; every other one begins near a singular pose, its three rods nearly through one point."""
    random = np.random.default_rng(seed)
    for number in range(count):
        pivots = np.array([[150.0, 150.0], [450.0, 160.0], [300.0, 430.0]]) + random.uniform(-60.0, 60.0, (3, 2))
        platform = np.array([[-40.0, -25.0], [40.0, -25.0], [0.0, 45.0]]) * random.uniform(0.6, 1.5, (3, 1))
        triad = Triad(
            pivots,
            random.uniform(4.0, 30.0, 3),
            random.uniform(-180.0, 180.0, 3),
            random.choice([-2.0, -1.0, 1.0, 2.0, 3.0], 3) * 360.0 / TURN,
            platform,
            np.array([*random.uniform(250.0, 350.0, 2), random.uniform(-np.pi, np.pi)]),
        )
        yield near_singular(triad, random.uniform(0.02, 0.3)) if number % 2 else triad


def near_singular(triad: Triad, share: float) -> Triad:
    """With its platform turned nearly to where the three rods go through one point."""
    turns = np.linspace(-np.pi, np.pi, 721)
    values = [determinant(triad, np.array([*triad.pose[:2], turn])) for turn in turns]
    changes = np.nonzero(np.diff(np.sign(values)))[0]
    if not len(changes):
        return triad
    return replace(triad, pose=np.array([*triad.pose[:2], turns[changes[0]] + share]))


def slopes(triad: Triad, pose: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
    """How much longer than they should be the squared rods are (3,), and the derivatives by the pose (3, 3)."""
    corners = triad.corners(pose)
    rods = corners - triad.pins(t)
    arms = corners - pose[:2]
    turning = rods[:, 1] * arms[:, 0] - rods[:, 0] * arms[:, 1]
    return np.sum(rods**2, axis=1) - triad.lengths**2, 2.0 * np.column_stack([rods, turning])


def determinant(triad: Triad, pose: FloatArray) -> float:
    """Of the derivatives, relative to their rows' lengths."""
    matrix = slopes(triad, pose, 0.0)[1]
    return float(np.linalg.det(matrix / np.linalg.norm(matrix, axis=1)[:, None]))


def reference(triad: Triad, times: FloatArray) -> tuple[FloatArray, float]:
    """Poses (F, 3) at ``times`` (nan beyond the end), and when the path ends (inf where it does not)."""
    found = np.full((len(times), 3), np.nan)
    found[0] = triad.pose
    t, pose, step = 0.0, triad.pose, TURN / FINE
    rate = speed(triad, pose, t)
    side = np.sign(np.linalg.det(slopes(triad, pose, t)[1]))
    place = 1
    while place < len(times):
        h = min(step, times[place] - t)
        landed = onto(triad, pose + h * rate, t + h)
        moved = h * np.abs(rate * [1.0, 1.0, 50.0]).max()
        good = (
            landed is not None and np.abs((landed - pose - h * rate) * [1.0, 1.0, 50.0]).max() <= 0.01 * moved + 1e-12
        )
        if good and side * np.linalg.det(slopes(triad, landed, t + h)[1]) > 0.0:
            t, pose = t + h, landed
            rate = speed(triad, pose, t)
            step = min(2.0 * step, TURN / FINE)
            if t >= times[place]:
                found[place] = pose
                place += 1
            continue
        step = 0.5 * h
        if step < 1e-11:
            return found, t
    return found, np.inf


def speed(triad: Triad, pose: FloatArray, t: float) -> FloatArray:
    """(3,) the velocity of the pose."""
    later, earlier = (slopes(triad, pose, t + h)[0] for h in (1e-6, -1e-6))
    return np.linalg.solve(slopes(triad, pose, t)[1], (earlier - later) / 2e-6)


def onto(triad: Triad, pose: FloatArray, t: float) -> FloatArray | None:
    """Newton's method; None where it does not arrive."""
    for _ in range(8):
        off, matrix = slopes(triad, pose, t)
        if np.abs(off).max() < 1e-7:
            return pose
        try:
            pose = pose - np.linalg.solve(matrix, off)
        except np.linalg.LinAlgError:
            return None
    return None


@contextmanager
def loosened(limits: steps.StepLimits, *, oriented: bool, long: bool) -> Iterator[None]:
    """Inside, steps count by ``limits``; ``oriented``: if the determinant keeps its sign; ``long``: nodes may be passed
    together.
    """
    before = steps.CERTAIN_STEP, trace.try_step, steps.FEWEST_NODES, BlockAtInstant.orientation
    steps.CERTAIN_STEP = limits
    trace.try_step = functools.partial(before[1], limits=limits)
    steps.FEWEST_NODES = before[2] if long else 10**9
    if not oriented:
        BlockAtInstant.orientation = lambda *_: 0.0
    try:
        yield
    finally:
        steps.CERTAIN_STEP, trace.try_step, steps.FEWEST_NODES, BlockAtInstant.orientation = before


NOTHING = 1e9
WAYS: dict[str, Callable[[], Any]] = {
    "all conditions": nullcontext,
    "single steps, all conditions": lambda: loosened(steps.CERTAIN_STEP, oriented=True, long=False),
    "no sign of the determinant": lambda: loosened(steps.CERTAIN_STEP, oriented=False, long=False),
    "any correction": lambda: loosened(steps.StepLimits(0.3, NOTHING, 0.05), oriented=True, long=False),
    "any mismatch of velocities": lambda: loosened(steps.StepLimits(0.3, 0.2, NOTHING), oriented=True, long=False),
    "any distance": lambda: loosened(steps.StepLimits(NOTHING, 0.2, 0.05), oriented=True, long=False),
    "the sign alone": lambda: loosened(steps.StepLimits(NOTHING, NOTHING, NOTHING), oriented=True, long=False),
    "none": lambda: loosened(steps.StepLimits(NOTHING, NOTHING, NOTHING), oriented=False, long=False),
}


def followed(triad: Triad, fps: int) -> tuple[FloatArray, FloatArray, int, int, float]:
    """Frames' times and corner A and turn (F, 3; nan where there is no solution); steps tried, nodes, and seconds that
    following took.
    """
    timeline = arranged(understand(SourceText("triad.mov", triad.script(fps))), Choices())
    calls, seconds = [0], [0.0]
    inner, followed_before = (trace.try_step, steps.try_step), newton.trace_path

    def timed(*arguments: Any) -> Any:
        begin = time.process_time()
        try:
            return followed_before(*arguments)
        finally:
            seconds[0] += time.process_time() - begin

    def counting(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            calls[0] += 1
            return function(*arguments, **named)

        return call

    trace.try_step, steps.try_step = map(counting, inner)
    newton.trace_path = timed
    try:
        motion = moved(timeline)
    finally:
        trace.try_step, steps.try_step = inner
        newton.trace_path = followed_before
    poses = motion.poses(0, timeline.frame_count)
    platform = next(thing for thing in timeline.scene.things if thing.name == "T")
    corner = poses.world(platform.number, platform.anchors[0].local)
    turn = np.unwrap(np.arctan2(*poses.direction[platform.number].T[::-1]))
    found = np.column_stack([corner, turn])
    found[~poses.solved] = np.nan
    nodes = sum(
        len(piece.nodes)
        for segment_motion in motion.segments
        for piece in segment_motion.pieces
        if hasattr(piece, "nodes")
    )
    return poses.times, found, calls[0], nodes, seconds[0]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--fps", type=int, default=7)
    options = parser.parse_args()
    members = list(triads(options.count))
    rows: dict[str, list[tuple[int, bool, int, int, float]]] = {way: [] for way in WAYS}
    ends = 0
    for triad in members:
        times = np.arange(int(TURN * options.fps)) / options.fps
        truth, end = reference(triad, times)
        ends += np.isfinite(end)
        corners = np.array([triad.corners(pose)[0] for pose in truth])
        size = float(np.ptp(triad.platform))
        for way, context in WAYS.items():
            with context():
                _, found, attempts, nodes, seconds = followed(triad, options.fps)
            off = np.hypot(*(found[: len(times), :2] - corners).T) > OFF * size
            before = times < end - 1e-6
            first = (
                times[np.argmax(np.isnan(found[: len(times), 0]))] if np.isnan(found[: len(times)]).any() else np.inf
            )
            missed = abs(min(first, TURN) - min(end, TURN)) > 1.0 / options.fps + 1e-9
            rows[way].append((int((off & before).sum()), bool(missed), attempts, nodes, seconds))
    print(f"{len(members)} triads, {ends} of them with an end; {options.fps} frames a time unit, a film of {TURN:g}")
    print("milliseconds: of following alone, medians")
    print(
        f"{'conditions':32} {'with a jump':>12} {'ends missed':>12} {'steps tried':>12} {'nodes':>8} {'median ms':>10}"
    )
    for way, found in rows.items():
        jumps, missed, attempts, nodes, seconds = zip(*found, strict=True)
        print(
            f"{way:32} {sum(map(bool, jumps)):12} {sum(missed):12} {sum(attempts):12} {sum(nodes):8} "
            f"{1e3 * statistics.median(seconds):10.0f}"
        )


if __name__ == "__main__":
    main()
