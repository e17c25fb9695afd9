"""Large free blocks: the sparse method against the dense one, against finite differences, and over a thousand steps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.penrose import transformable
from movimentum.interop.linkages import Linkage, linkage_script
from movimentum.planning.blocks import build
from movimentum.planning.blocks.kinds import Block
from movimentum.solver import solver_cache
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read
from movimentum.workflow.stages import arranged, moved, understand
from tests.command import ROOT


def motion_of(text: str) -> PathMotion:
    return moved(arranged(understand(SourceText("test.mov", text)), Choices()))


def free_block(motion: PathMotion) -> tuple[Piece, Block, NodeTrack]:
    for piece in motion.segments[0].pieces:
        assert isinstance(piece, Piece)
        for block, track in zip(piece.plan.blocks, piece.tracks, strict=True):
            if block.free and isinstance(track, NodeTrack):
                return piece, block, track
    raise AssertionError


def drawn_tiling(length: float) -> tuple[Linkage, str]:
    """The smallest tiling, a corner of which is drawn round a circle."""
    linkage = transformable(1)
    vertex = int(np.argmax(np.abs(np.array(linkage.vertices) @ [1, 1j] - (300 + 300j))))
    i, j = next(rod for rod in linkage.rods if vertex in rod)
    x, y = linkage.vertices[vertex]
    wish = f"R{i}_{j}.V{vertex} ~ [{x - 15!r}, {y!r}] + [15, 0].r(180*.t);"
    return linkage, linkage_script(linkage, "tiling").replace("config(24)", "config(2)") + f"{wish}\n@{length:g}\n"


@pytest.mark.slow
def test_both_methods_go_the_same_way(monkeypatch: pytest.MonkeyPatch) -> None:
    source = read(str(ROOT / "scripts" / "peaucellier-linkage.mov"))
    found = []
    for most in (4, 1000):
        monkeypatch.setattr(build, "LARGEST_DENSE_BLOCK", most)
        monkeypatch.setattr(solver_cache, "_PLANS", solver_cache._PlanCache())
        motion = moved(arranged(understand(source), Choices()))
        _, block, _ = free_block(motion)
        assert (block.sparse is not None) == (most == 4)
        found.append(motion.poses(0, motion.timeline.frame_count))
    assert found[0].solved.all()
    assert found[0].origin == pytest.approx(found[1].origin, abs=2e-5)
    assert found[0].direction == pytest.approx(found[1].direction, abs=1e-7)


@pytest.mark.slow
def test_rows_by_their_terms_are_the_rows() -> None:
    _, text = drawn_tiling(1)
    motion = motion_of(text)
    piece, block, track = free_block(motion)
    assert block.sparse is not None
    x = track.values[0] + 0.1 * np.random.default_rng(3).normal(size=len(block.core))
    instants = piece.instants(np.array([0.0]))
    state = piece.before(block.number, instants)
    problem = BlockProblem.of(block, state, instants.clocks, np.ones(len(x)))
    slopes = problem.jacobian(x[None])[0]
    for j in range(0, len(x), 7):
        step = np.zeros(len(x))
        step[j] = 1e-5
        ahead, behind = (problem.residual((x + s)[None])[0] for s in (step, -step))
        assert (ahead - behind) / 2e-5 == pytest.approx(slopes[:, j], abs=1e-6 * np.abs(slopes).max())


@pytest.mark.slow
def test_nothing_drifts_in_a_thousand_steps() -> None:
    linkage, text = drawn_tiling(15)
    motion = motion_of(text)
    _, block, track = free_block(motion)
    assert block.sparse is not None
    assert len(track.tau) > 1000
    poses = motion.poses(motion.timeline.frame_count - 1, motion.timeline.frame_count)
    for thing, rod in zip(motion.timeline.scene.things, range(len(linkage.rods)), strict=True):
        a, b = (poses.world(thing.number, anchor.local)[0] for anchor in thing.anchors)
        assert np.hypot(*(b - a)) == pytest.approx(linkage.length(rod), rel=1e-12)
    places: dict[str, list[np.ndarray]] = {}
    for thing in motion.timeline.scene.things:
        for anchor in thing.anchors:
            places.setdefault(anchor.name, []).append(poses.world(thing.number, anchor.local)[0])
    for some in places.values():  # joints hold
        assert np.ptp(np.array(some), axis=0) == pytest.approx([0, 0], abs=1e-11)
    for (i, j, k), degrees in zip(linkage.angles, linkage.degrees, strict=True):
        p, u, v = (places[f"V{n}"][0] @ [1, 1j] for n in (i, j, k))
        off = np.degrees(np.angle((v - p) / (u - p))) - degrees
        assert (off + 180) % 360 - 180 == pytest.approx(0, abs=1e-10)
