"""What solving yields for a run of frames: poses of all things, and the other scalars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Everything a picture or a table needs of F frames of a scene with N things.

    ``frames``     (F,) frame numbers, int64, counted from 0 at the animation's start
    ``times``      (F,) absolute times
    ``origin``     (N, F, 2) world position of each thing's local origin (pixels, y up; see `scene.model`)
    ``direction``  (N, F, 2) cosine and sine of each thing's turn
    ``angle``      (N, F) that turn in degrees, continuous over time
    ``visible``    (N, F) whether the thing has appeared
    ``properties`` (thing number, "opacity"|"red"|"green"|"blue") -> (F,), only those that constraints mention
    ``variables``  name -> (F,) for a scalar, (F, 2) for a vector
    ``solved``     (F,) False where the scene has no solution (the arrays then hold the last good pose)

    A world point of local (x, y) is ``origin + (c x - s y, s x + c y)`` with (c, s) = direction. All values are finite.
    """

    frames: NDArray[np.int64]
    times: FloatArray
    origin: FloatArray
    direction: FloatArray
    angle: FloatArray
    visible: BoolArray
    properties: dict[tuple[int, str], FloatArray]
    variables: dict[str, FloatArray]
    solved: BoolArray

    def world(self, thing: int, local: tuple[float, float]) -> FloatArray:
        """(F, 2) world positions of the point ``local`` of thing number ``thing``."""
        import numpy as np

        c, s = self.direction[thing, :, 0], self.direction[thing, :, 1]
        x, y = local
        return np.stack(
            [self.origin[thing, :, 0] + (c * x - s * y), self.origin[thing, :, 1] + (s * x + c * y)], axis=-1
        )

    def select(self, chosen: NDArray[np.int64] | slice) -> Poses:
        """The frames ``chosen`` (positions in these arrays, not frame numbers)."""
        return Poses(
            frames=self.frames[chosen],
            times=self.times[chosen],
            origin=self.origin[:, chosen],
            direction=self.direction[:, chosen],
            angle=self.angle[:, chosen],
            visible=self.visible[:, chosen],
            properties={key: value[chosen] for key, value in self.properties.items()},
            variables={key: value[chosen] for key, value in self.variables.items()},
            solved=self.solved[chosen],
        )
