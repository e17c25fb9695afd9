"""Several poses of a scene at once: side by side on a sheet, or one after the other as a film."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from movimentum.analysis.live import with_numbers
from movimentum.repl.session import Session
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.poses import Poses


def poses_of(session: Session, moments: Sequence[Snapshot]) -> Poses:
    """Snapshots as the poses of so many frames."""
    now = session.poses()
    count = len(moments)
    repeated = np.zeros(count, dtype=np.int64)
    poses = now.select(repeated)
    origin, direction, angle = poses.origin.copy(), poses.direction.copy(), poses.angle.copy()
    for f, moment in enumerate(moments):
        for t, pose in enumerate(moment.things):
            origin[t, f], direction[t, f], angle[t, f] = (pose.x, pose.y), (pose.c, pose.s), pose.angle
    made = Poses(
        frames=np.arange(count, dtype=np.int64),
        times=poses.times,
        origin=origin,
        direction=direction,
        angle=angle,
        visible=poses.visible,
        properties=poses.properties,
        variables=poses.variables,
        missing=poses.missing,
        solved=np.ones(count, dtype=np.bool_),
    )
    return with_numbers(session.work.motion, made, [session.time] * count)


def write_sheet(session: Session, moments: Sequence[Snapshot], path: Path) -> None:
    """A PNG of the scene in each of ``moments``, with rows that make the sheet about square."""
    from movimentum.rendering.sheet import write_thumbnails

    write_thumbnails(session.work.scene, poses_of(session, moments), path)


def write_film(session: Session, moments: Sequence[Snapshot], path: Path) -> None:
    """The scene in each of ``moments``, one after the other, as an animation in the format that the suffix names."""
    from movimentum.encoding.write import write_animation
    from movimentum.rendering.painter import make_painter

    poses = poses_of(session, moments)
    painter = make_painter(session.work.scene, (poses,))
    write_animation(painter, (poses,), path, fps=Fraction(20), workers=1)
