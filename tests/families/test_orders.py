"""The order in which things are said makes no difference: not that of definitions, nor that of a step's statements."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from benchmarks.penrose import transformable
from movimentum.interop.linkages import linkage_script
from movimentum.solver.solver import solve
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Definition, Statement
from tests.broad import broad
from tests.solver.scenes import motion_of
from tests.understand import timeline_of

SCRIPTS = Path(__file__).parents[2] / "scripts"
GALLERY = ["four-bar", "geneva-slots", "jansen", "peaucellier-linkage", "stephenson", "walschaerts", "watt"]
TILING = linkage_script(transformable(1), "tiling")
FIRST = next(line.split(" :")[0] for line in TILING.splitlines() if " : .bar" in line)


def reordered(text: str, seed: int, *kinds: type) -> str:
    """``text`` with the items of one kind that follow each other in another order."""
    generator = random.Random(seed)
    items = parse(SourceText("test.mov", text)).items
    runs: list[list[object]] = [[]]
    for item in items:
        if isinstance(item, kinds) and (not runs[-1] or type(item) is type(runs[-1][-1])):
            runs[-1].append(item)
        else:
            runs.append([item] if isinstance(item, kinds) else [])
    pieces: list[tuple[int, int, str]] = []
    for run in runs:
        spans = [(item.span.start, item.span.end) for item in run]
        texts = [text[start:end] for start, end in spans]
        generator.shuffle(texts)
        pieces += [(start, end, other) for (start, end), other in zip(spans, texts, strict=True)]
    for start, end, other in sorted(pieces, reverse=True):
        text = text[:start] + other + text[end:]
    return text


@broad("name", GALLERY, fast=("four-bar", "slider-crank", "geneva-slots", "watt", "whitworth"))
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 5))])
def test_of_statements(name, seed, monkeypatch):
    monkeypatch.chdir(SCRIPTS)
    text = (SCRIPTS / f"{name}.mov").read_text(encoding="utf-8")
    other = reordered(text, seed, Statement)
    assert other != text
    one, two = (motion_of(each) for each in (text, other))
    a, b = (motion.poses(0, motion.timeline.frame_count) for motion in (one, two))
    assert a.solved.all()
    assert b.solved.all()
    assert np.allclose(a.origin, b.origin, atol=1e-8)
    assert np.allclose(a.direction, b.direction, atol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(24))
def test_of_a_tiling_that_a_wish_pulls(seed):
    """Whatever comes first is eliminated first; the pose to begin with keeps to the sides of its angles."""
    lines = reordered(TILING, seed, Definition, Statement).rstrip()
    motion = solve(timeline_of(f"{lines}\n{FIRST}.V0.x ~ 400; @1\n"))
    assert not any(segment_motion.failures for segment_motion in motion.segments)
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
