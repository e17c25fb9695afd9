"""All solutions at a path's beginning: counts that are known, and that the listed inequalities select each."""

import re

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from movimentum.diagnostics import Severity
from tests.solver.scenes import motion_of, residuals

# a triad with six assembly modes: base, platform, legs
SIX = ([(-0.5, -0.3), (2.1, -0.3), (1.6, 2.3)], [(0.3, -0.2), (2.3, 0.1), (0.5, 2.3)], [1.9, 1.6, 1.5])


def script(base, platform, legs):
    body = " ".join(f"{n}=[{x!r},{y!r}]" for n, (x, y) in zip("xyz", platform, strict=True))
    bars = "".join(f"L{i} : .bar a=[0,0] b=[{leg!r},0];" for i, leg in enumerate(legs))
    feet = " ".join(f"L{i}.a=[{x!r},{y!r}];" for i, (x, y) in enumerate(base))
    joints = " ".join(f"L{i}.b=Body.{n};" for i, n in enumerate("xyz"))
    return f".config(10); Body : .bar {body}; {bars} @0 {feet} {joints}"


def modes_by_angle(base, platform, legs):
    """Independent: scan the platform's angle. With it fixed, two legs leave two positions; the third leg's error is a
    function of the angle whose zeros are the modes.
    """
    (b0, b1, b2), (p0, p1, p2) = (np.array(base), np.array(platform))
    angle = np.linspace(-np.pi, np.pi, 200_001)
    c, s = np.cos(angle), np.sin(angle)

    def turned(p):
        return np.stack([c * p[0] - s * p[1], s * p[0] + c * p[1]], axis=-1)

    # the platform's origin lies on circles about b0 - R p0 and b1 - R p1
    m0, m1 = b0 - turned(p0), b1 - turned(p1)
    d = m1 - m0
    d2 = np.sum(d * d, axis=1)
    along = (legs[0] ** 2 - legs[1] ** 2 + d2) / (2 * d2)
    height = legs[0] ** 2 / d2 - along**2
    count = 0
    for side in (1, -1):
        h = side * np.sqrt(np.where(height >= 0, height, np.nan))
        origin = m0 + along[:, None] * d + h[:, None] * np.stack([-d[:, 1], d[:, 0]], axis=-1)
        off = np.hypot(*(origin + turned(p2) - b2).T) - legs[2]
        count += int(np.sum((off[:-1] * off[1:] < 0) & np.isfinite(off[:-1] * off[1:])))
    return count


def parts(text):
    motion = motion_of(text)
    return motion, motion.segments[0].beginnings[0].selection.parts


def test_the_triad_has_six_assembly_modes():
    assert modes_by_angle(*SIX) == 6
    motion, (part,) = parts(script(*SIX))
    assert len(part.candidates) == 6
    assert part.complete
    assert max(residuals(motion, motion.poses(0, 1)).values()) < 1e-12


@pytest.mark.slow
def test_each_of_the_six_can_be_selected_by_its_inequality():
    examination = examine(motion_of(script(*SIX)))
    (warning,) = [d for d in examination.diagnostics if d.code == "constraint/ambiguous"]
    assert "6 solutions" in warning.message
    inequalities = [re.match(r"`(.+?)`", text).group(1) for text in warning.helps]
    assert len(inequalities) == 6
    seen = []
    for inequality in inequalities:
        motion = motion_of(f"{script(*SIX)} {inequality}")
        again = examine(motion)
        assert again.fault == 0
        assert not [d for d in again.diagnostics if d.severity is Severity.WARNING], inequality
        seen.append(motion.poses(0, 1).direction[0, 0])
    assert len({tuple(np.round(direction, 6)) for direction in seen}) == 6


@pytest.mark.parametrize("seed", range(6))
def test_counts_agree_with_a_scan_of_the_angle(seed):
    generator = np.random.default_rng(seed)
    base = [tuple(map(float, p)) for p in generator.uniform(-2, 2, (3, 2))]
    platform = [tuple(map(float, p)) for p in generator.uniform(-1, 1, (3, 2))]
    legs = [float(v) for v in generator.uniform(1, 3, 3)]
    _, found = parts(script(base, platform, legs))
    assert len(found[0].candidates) == modes_by_angle(base, platform, legs)
