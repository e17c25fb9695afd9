"""Random chains drawn by random wishes: whatever is wished for, rods stay rods, joints joints, and it ends well."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from tests.solver.scenes import anchor, motion_of

FAULTS = {"solve/not-converged", "solve/unreachable", "solve/too-fast", "solve/jump", "constraint/conflict"}


def scene(seed: int) -> tuple[str, list[tuple[str, str]]]:
    """A script, and the joints in it: chains of up to five bars, most of them pinned, and one to three steps of wishes:
    for places near and far, single coordinates, angles, distances, other anchors, and sums.
    """
    r = random.Random(seed)
    count = r.randint(1, 5)
    lines, stated, joints = [".config(20,500,500);"], [], []
    place = [r.uniform(50, 400), r.uniform(50, 400)]
    for i in range(count):
        anew = i > 0 and r.random() < 0.2
        if anew:
            place = [r.uniform(50, 400), r.uniform(50, 400)]
        end = [place[0] + r.uniform(-90, 90), place[1] + r.uniform(-90, 90)]
        lines.append(f"B{i} : .bar P=[{place[0]:.2f},{place[1]:.2f}] Q=[{end[0]:.2f},{end[1]:.2f}];")
        if i and not anew:
            stated.append(f"B{i}.P = B{i - 1}.Q;")
            joints.append((f"B{i}.P", f"B{i - 1}.Q"))
        elif r.random() < 0.8:
            stated.append(f"B{i}.P = [{place[0]:.2f},{place[1]:.2f}];")
        place = end
    lines.append("@0 " + " ".join(stated))
    time = 1
    for k in range(r.randint(1, 3)):
        wishes = []
        for j in range(r.randint(1, 2)):
            bar, far = r.randrange(count), r.choice([500, 500, 500, 3000, 1e5])
            one, other = f"B{bar}.{r.choice('PQ')}", f"B{r.randrange(count)}.{r.choice('PQ')}"
            choices = [
                f"{one} ~ [{r.uniform(-far, far):.1f},{r.uniform(-far, far):.1f}]",
                f"{one}.x ~ {r.uniform(0, 500):.1f}",
                f"{one} ~ [250,250] + [{r.uniform(5, 150):.1f},0].r({r.uniform(-200, 200):.1f}*.t)",
                f"B{bar}.angle ~ {r.uniform(-200, 200):.1f}*.t",
                f"h{k}_{j} = {one}.y + {other}.x; h{k}_{j} ~ {r.uniform(0, 500):.1f}",
            ]
            if one != other:
                choices += [f"({one}-{other}).l ~ {r.uniform(10, 200):.1f}", f"{one} ~ {other}"]
            wishes.append(r.choice(choices) + r.choice(["", "", " .speed(40)", " .speed(300)"]) + ";")
        lines.append(f"@{time} " + " ".join(wishes))
        time += r.choice([1, 2])
    return "\n".join([*lines, f"@{time}"]) + "\n", joints


def check(seed: int) -> None:
    text, joints = scene(seed)
    motion = motion_of(text)
    found = {item.code for item in examine(motion).diagnostics}
    assert not found & FAULTS, (seed, found, text)
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    reach = 1.0 + np.max(np.abs(poses.origin))
    for one, other in joints:
        assert anchor(motion, poses, one) == pytest.approx(anchor(motion, poses, other), abs=1e-9 * reach), (seed, text)
    for thing in motion.timeline.scene.things:
        ends = [anchor(motion, poses, f"{thing.name}.{item.name}") for item in thing.anchors]
        lengths = np.hypot(*(ends[1] - ends[0]).T)
        drawn = np.hypot(*np.subtract(thing.anchors[1].local, thing.anchors[0].local))
        assert lengths == pytest.approx(np.full(len(lengths), drawn), abs=1e-11 * reach), (seed, text)
    # every second frame of twice the rate is a frame
    times = [motion.timeline.start + Fraction(k, 10) for k in range(10 * int(motion.timeline.end) + 1)]
    assert (motion.poses_at(times).origin == poses.origin[:, ::2]).all(), (seed, text)


@pytest.mark.slow
def test_random_wishes() -> None:
    for seed in range(6):
        check(seed)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("block", range(2))
def test_many_random_wishes(block: int) -> None:
    for seed in range(1000 * block + 1000, 1000 * block + 1050):
        check(seed)
