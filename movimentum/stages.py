"""The stages one by one, for programs that need an intermediate product: the syntax tree, the scene, the timeline.

    >>> from movimentum import stages
    >>> source = stages.SourceText("arm.mov", "Arm : .bar O=[0,0] P=[9,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1")
    >>> scene = stages.build(stages.parse(source), source, stages.image_size)
    >>> motion = stages.solve(stages.arrange(scene))
    >>> stages.examine(motion).diagnostics  # nothing to complain about
    ()
    >>> motion.poses(0, motion.timeline.frame_count).angle[0, -1].item()
    90.0

Each stage is a function from the product of the one before it. `movimentum.load` and the commands run these stages, in
this order.
"""

from __future__ import annotations

from functools import partial

from movimentum.analysis.examine import Examination, examine
from movimentum.rendering.images import image_size
from movimentum.scene.build import build
from movimentum.scene.model import Scene
from movimentum.solver.carving import carve
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.solver.solver import solve
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.timeline.arrange import arrange
from movimentum.timeline.model import Timeline

build = partial(build, carve=carve)
"""See `scene.build.build`; what is cut is known."""

__all__ = [
    "Examination",
    "PathMotion",
    "Poses",
    "Scene",
    "SourceText",
    "Timeline",
    "arrange",
    "build",
    "examine",
    "image_size",
    "parse",
    "solve",
]
