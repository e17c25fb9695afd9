"""Prepares a mark of the display list for drawing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.model import OverMark, Paint, TextMark, ThingMark
from movimentum.drawing.motion import bounds, state
from movimentum.records import dataclass
from movimentum.rendering.sprites import Sprite
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PreparedMark:
    """A mark with its picture, if it is an image or a text; ``halo`` goes under the text of a note. ``clip``: it is
    drawn only inside that mark's outline (see `drawing.clips`). ``group``: it is faded as one with the marks beside it
    that have the same. ``still``: the camera does not move it.
    """

    mark: ThingMark | OverMark
    sprite: Sprite | None = None
    halo: Sprite | None = None
    clip: ThingMark | None = None
    group: Paint | None = None
    still: bool = False

    def bounds(self, poses: Poses) -> Floats:
        """(F, 4): left, bottom, right, top in the world; rows of NaN where nothing is drawn."""
        found = self._unclipped(poses)
        if self.clip is None:
            return found
        around = bounds(self.clip, poses, ())
        low, high = np.maximum(found[:, :2], around[:, :2]), np.minimum(found[:, 2:], around[:, 2:])
        some = np.logical_and(low[:, 0] <= high[:, 0], low[:, 1] <= high[:, 1])
        return np.where(some[:, None], np.concatenate([low, high], axis=1), np.nan)

    def state(self, poses: Poses) -> Floats:
        """(F, K): all numbers that its picture depends on; equal rows are equal pictures."""
        own = state(self.mark, poses)
        return own if self.clip is None else np.concatenate([own, state(self.clip, poses)], axis=1)

    def _unclipped(self, poses: Poses) -> Floats:
        if isinstance(self.mark, TextMark) and self.mark.pieces:
            from movimentum.rendering.text import longest

            return bounds(self.mark, poses, longest(self.mark, poses))
        return bounds(self.mark, poses, () if self.sprite is None else self.sprite.local_corners())
