"""Points of parts that are turned: what is grabbed or drawn at a world point is at that point of the part."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("starlette", reason="no studio: pip install 'movimentum[studio]'")

from movimentum.query import reader
from movimentum.source import SourceText
from movimentum.studio.dragging import grabbed_point
from movimentum.studio.messages import PartGrabbed
from movimentum.studio.placing import Sketch
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine

TEXT = "Arm : .bar O = [5,0] P = [35,10];\n@0 Arm.O = [100,50];  Arm.angle = 30 + 90*.t;\n@2\n"
AT = (93.0, 61.0)


def test_what_is_grabbed_off_the_anchors_of_a_turned_part_is_under_the_mouse() -> None:
    motion = Engine().revise(SourceText("arm.mov", TEXT)).motion
    poses = motion.poses_at([Fraction(1)])
    place = [*poses.origin[0, 0], *poses.direction[0, 0]]
    x, y = grabbed_point(motion, PartGrabbed(1, 1, 0, "", AT, 1.0), place)
    found = [value.item() for value in reader(motion.timeline.scene, (x, y))(poses)]
    assert found == pytest.approx(AT)


def test_places_of_a_turned_part_are_there_and_back() -> None:
    scene = Engine().revise(SourceText("arm.mov", TEXT)).scene
    sketch = Sketch(scene, Choices(), 0, np.array([[10.0, 20.0, 0.6, 0.8]]))
    thing, ref = sketch.anchor("Arm.P")
    assert sketch.where(ref) == pytest.approx((10.0 + 0.6 * 35 - 0.8 * 10, 20.0 + 0.8 * 35 + 0.6 * 10))
    assert sketch.local(thing, sketch.where(ref)) == pytest.approx((35.0, 10.0))
    assert sketch.turn(thing) == pytest.approx(np.degrees(np.arctan2(0.8, 0.6)))
