"""Whether what the solver writes keeps to the script: every frame, by an evaluation of its own."""

import dataclasses

import numpy as np

from movimentum.analysis.examine import examine
from movimentum.diagnostics import Severity
from movimentum.scene.model import Relation
from tests.solver.scenes import motion_of, residuals, rigidity, value


def solved_as_written(text, rate):
    """The examination, the motion and the poses that would be written (those that are not solved are held)."""
    motion = motion_of(text, rate)
    examination = examine(motion)
    motion = dataclasses.replace(motion, uncertain=examination.doubted)
    return examination, motion, motion.poses(0, motion.timeline.frame_count)


def errors_of(examination):
    return [item for item in examination.diagnostics if item.severity is Severity.ERROR]


def broken_promises(motion, poses, most=1e-9):
    """What frames that count as solved violate by more than ``most`` (pixels), and whether held ones are rigid."""
    found = []
    off = residuals(motion, poses)
    if off and max(off.values()) > most:
        found.append(f"an equation is off by {max(off.values()):.1e}")
    if rigidity(motion, poses) > 1e-9:
        found.append(f"a thing is stretched by {rigidity(motion, poses):.1e}")
    timeline = motion.timeline
    for frame in np.nonzero(poses.solved)[0]:
        time = timeline.frame_time(int(frame))
        for constraint in timeline.segments[timeline.segment_at(time)].active:
            if constraint.relation not in (Relation.BELOW, Relation.ABOVE):
                continue
            for left, right in zip(constraint.left, constraint.right, strict=True):
                slack = float(
                    value(left, timeline.scene, poses, frame, time) - value(right, timeline.scene, poses, frame, time)
                )
                slack = -slack if constraint.relation is Relation.BELOW else slack
                if slack < -1e-6 * motion.size:
                    found.append(f"an inequality is violated by {-slack:.1e} in frame {frame}")
    return found
