"""The poses of a run of frames, as tables, pictures and analyses read them."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass, field

VISIBLE_FROM = 0.5
"""Of a `visible` property: from here on a thing is seen, as 1 says; below it is not, as 0 says."""


class HighPrecisionPoses(Protocol):
    """Poses that have more digits than a float: numbers of an arithmetic of their own, and their texts."""

    def coordinate(self, thing: int, local: tuple[float, float], axis: int) -> Any:
        """(F,) one world coordinate of a thing's point."""
        ...

    def turn(self, thing: int) -> Any:
        """(F,) a thing's turn in degrees."""
        ...

    def scalar(self, name: str, axis: int | None) -> Any:
        """(F,) a variable, or one component of it."""
        ...

    def clock(self) -> Any:
        """(F,) the times."""
        ...

    def texts(self, value: Any) -> list[str]:
        """(F,) such numbers with the digits asked for."""
        ...


@dataclass(frozen=True, eq=False)
class Poses:
    """Everything a picture or a table needs of F frames of a scene with N things.

    ``frames``     (F,) frame numbers, int64, counted from 0 at the film's start
    ``times``      (F,) absolute times
    ``origin``     (N, F, 2) world position of each thing's local origin (pixels, y up; see `scene.model`)
    ``direction``  (N, F, 2) cosine and sine of each thing's turn
    ``angle``      (N, F) that turn in degrees, continuous over time
    ``visible``    (N, F) whether the thing has appeared, and no statement makes it invisible
    ``properties`` (thing number, name of a `ThingProperty`) -> (F,), only those that constraints mention
    ``variables``  name -> (F,) for a scalar, (F, 2) for a vector
    ``missing``    name -> (F,) True where the variable has no value, as no statement in force mentions it
                   (``variables`` then holds the last value that it had, or else the first that it will have)
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
    missing: dict[str, BoolArray] = field(default_factory=lambda: {}, kw_only=True)  # noqa: PIE807 - typed

    @property
    def high_precision(self) -> HighPrecisionPoses | None:
        """The same with all digits, where numbers are written with more than a float has; else None."""
        return None

    @cached_property
    def of_things(self) -> dict[int, list[tuple[str, FloatArray]]]:
        """The properties of each thing that has any, by name."""
        found: dict[int, list[tuple[str, FloatArray]]] = {}
        for (thing, name), values in sorted(self.properties.items()):
            found.setdefault(thing, []).append((name, values))
        return found

    @cached_property
    def _one(self) -> dict[int, Poses]:
        return {}

    def one(self, i: int) -> Poses:
        """Frame ``i`` alone (a position in these arrays). All that is drawn in a frame asks for the same one: it is
        made once.
        """
        if i not in self._one:
            self._one.clear()
            self._one[i] = self.select(slice(i, i + 1))
        return self._one[i]

    def world(self, thing: int, local: tuple[float, float]) -> FloatArray:
        """(F, 2) world positions of the point ``local`` of thing number ``thing``."""
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
            missing={key: value[chosen] for key, value in self.missing.items()},
            solved=self.solved[chosen],
        )
