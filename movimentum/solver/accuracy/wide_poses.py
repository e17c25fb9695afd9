"""Poses with more digits than float64 has, and the float64 poses that are rounded from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.planning.lowering.body_frames import stated_point
from movimentum.records import dataclass
from movimentum.scene.model import Thing
from movimentum.solver.arithmetic.evaluation import Evaluator, Number
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.poses import Poses


@dataclass(frozen=True, slots=True, eq=False)
class RefinedPoses(Poses):
    """`Poses` rounded from more digits, which ``pose`` (by thing), ``scalars`` (a variable's components by (name,
    axis)) and ``instants`` (the times) still have.
    """

    evaluator: Evaluator
    pose: tuple[BodyPose, ...]
    scalars: dict[tuple[str, int | None], Number]
    instants: Number
    size: float
    things: tuple[Thing, ...]

    @property
    def spelled(self) -> RefinedPoses | None:
        """Itself, where more digits are asked for than a float has."""
        return None if self.evaluator.arithmetic.shown is None else self

    def turn(self, thing: int) -> Number:
        """(F,) a thing's turn in degrees, with all digits."""
        return self.pose[thing].angle

    def scalar(self, name: str, axis: int | None) -> Number:
        """(F,) a variable, or one component of it, with all digits."""
        return self.scalars[name, axis]

    def clock(self) -> Number:
        """(F,) the times, exactly."""
        return self.instants

    def coordinate(self, thing: int, local: tuple[float, float], axis: int) -> Number:
        """(F,) one world coordinate of a thing's point, with all digits."""
        x, y = (self.evaluator.constant(value) for value in stated_point(self.things[thing], local))
        return self.pose[thing].world(x, y)[axis]

    def world(self, thing: int, local: tuple[float, float]) -> FloatArray:
        """(F, 2) world positions of the point ``local`` of thing number ``thing``, rounded once."""
        rounded = self.evaluator.arithmetic.rounded
        return np.stack([rounded(self.coordinate(thing, local, axis)) for axis in (0, 1)], axis=-1)

    def texts(self, value: Number) -> list[str]:
        """(F,) numbers with the digits asked for; in `high`, the shortest text of the nearest float."""
        arithmetic = self.evaluator.arithmetic
        if isinstance(arithmetic, DigitsArithmetic):
            return [arithmetic.text(item, self.size) for item in value]
        return [repr(item) for item in (arithmetic.rounded(value) + 0.0).tolist()]

    def select(self, chosen: NDArray[np.int64] | slice) -> RefinedPoses:
        """The frames ``chosen`` (positions in these arrays, not frame numbers)."""
        plain = Poses.select(self, chosen)
        return RefinedPoses(
            **{name: getattr(plain, name) for name in Poses.__dataclass_fields__},
            evaluator=self.evaluator,
            pose=tuple(pose.each(lambda part: part[chosen]) for pose in self.pose),
            scalars={key: value[chosen] for key, value in self.scalars.items()},
            instants=self.instants[chosen],
            size=self.size,
            things=self.things,
        )
