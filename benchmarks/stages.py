"""Our own solver, one script from text to points, with the time of each stage."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # the checkout, where it is not installed

from mechanisms import Array, Mechanism, anchors, program

from movimentum.planning.blocks.kinds import method_of
from movimentum.scene.build import build
from movimentum.solver.motion import FRAMES_AT_A_TIME, PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.solver import solve
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.timeline.arrange import arrange

INSIDE = {
    "plan": "movimentum.planning.planner:compile_structure",
    "code": "movimentum.planning.codegen.generate:compiled",
}
"""What is timed inside of solving: planning, and of that, generating code."""


@dataclass(slots=True)
class Solved:
    """One run: seconds by stage, the points (F, points, 2), and what is known about the way there.

    Stages: ``parse`` and ``scene`` (text to timeline), ``plan`` (equations to blocks, ``code`` included), ``code``,
    ``path`` (branches chosen and followed), ``first`` (what the first frame costs once: code made on first use),
    ``solve`` (where everything is and which way it points, in all frames), ``poses`` (the same in arrays by thing and
    frame), ``turns`` (the same with each thing's angle, full turns counted).
    """

    seconds: dict[str, float]
    points: Array
    unsolved: int
    kernels: dict[str, int] = field(default_factory=dict)
    nodes: int = 0


@contextmanager
def _watched(totals: dict[str, float]) -> Iterator[None]:
    """While open, the time inside of the functions in `INSIDE` is added to ``totals``, whoever calls them."""
    undo: list[tuple[Any, str, Any]] = []
    for stage, place in INSIDE.items():
        home, _, name = place.partition(":")
        original = getattr(import_module(home), name)
        totals[stage] = 0.0

        def timed(*args: Any, _stage: str = stage, _original: Callable[..., Any] = original, **kwargs: Any) -> Any:
            begin = time.perf_counter()
            try:
                return _original(*args, **kwargs)
            finally:
                totals[_stage] += time.perf_counter() - begin

        for module in [m for n, m in sys.modules.items() if n.startswith("movimentum")]:
            if vars(module).get(name) is original:
                undo.append((module, name, original))
                setattr(module, name, timed)
    try:
        yield
    finally:
        for module, name, original in undo:
            setattr(module, name, original)


def _solved(motion: PathMotion, segment_motion: SegmentMotion, piece: Piece, frames: int) -> None:
    """Solve all frames, in the batches in which poses are made."""
    for begin in range(0, frames, FRAMES_AT_A_TIME):
        piece.solve(motion.instants(segment_motion, begin, min(begin + FRAMES_AT_A_TIME, frames)), windings=False)


def run(m: Mechanism, frames: int, repeats: int = 1) -> Solved:
    """Solve ``m`` once from its text; what is done for frames ``repeats`` times (the best is kept)."""
    seconds: dict[str, float] = {}

    def stage(name: str, work: Callable[[], Any]) -> Any:
        begin = time.perf_counter()
        result = work()
        took = time.perf_counter() - begin
        seconds[name] = min(seconds.get(name, took), took)
        return result

    source = SourceText("mechanism.mov", program(m, frames))
    tree = stage("parse", lambda: parse(source))
    timeline = stage(
        "scene", lambda: arrange(build(tree, source, lambda _path: (100, 100)), max_frames=max(10**6, 2 * frames))
    )
    inside: dict[str, float] = {}
    with _watched(inside):
        motion: PathMotion = stage("path", lambda: solve(timeline))
    seconds.update(inside)
    seconds["path"] -= inside["plan"]
    segment_motion = motion.segments[0]
    piece = segment_motion.pieces[0]
    if not isinstance(piece, Piece):  # nothing satisfies the constraints from the start
        seconds |= {"first": np.nan, "solve": np.nan}
        repeats = 1
    else:
        stage("first", lambda: _solved(motion, segment_motion, piece, 1))
        for _ in range(repeats):
            stage("solve", lambda: _solved(motion, segment_motion, piece, frames))
    poses: Any = None
    motion.poses(0, 1)
    for _ in range(repeats):
        stage("turns", lambda: motion.poses(0, frames))
        poses = stage("poses", lambda: motion.poses(0, frames, angles=False))
    points = np.empty((frames, len(m.pts), 2))
    points[:] = m.pts
    things = {thing.name: thing for thing in timeline.scene.things}
    for i, (thing, anchor) in anchors(m).items():
        local = next(a.local for a in things[thing].anchors if a.name == anchor)
        points[:, i] = poses.world(things[thing].number, local)
    points[~poses.solved] = np.nan
    kernels = Counter(method_of(block) for block in segment_motion.plan.blocks)
    nodes = len(piece.nodes) if isinstance(piece, Piece) else 0
    return Solved(seconds, points, int((~poses.solved).sum()), dict(kernels), nodes)
