"""Where the camera is in every frame: how views go over into each other."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.query import reader
from movimentum.records import dataclass
from movimentum.scene.model import Scene
from movimentum.scene.shown import CAMERA, FILM, CameraView
from movimentum.solver.poses import Poses
from movimentum.tolerances import LARGEST_VIEW, SAME_ZOOM, SMALLEST_VIEW


@dataclass(frozen=True, slots=True)
class _Shot:
    """What F frames show: ``centre`` (F, 2) plus ``rest`` (F,) times the middle of the canvas; ``zoom`` (F,)."""

    centre: FloatArray
    rest: FloatArray
    zoom: FloatArray

    def towards(self, other: _Shot, share: FloatArray) -> _Shot:
        """A ``share`` of the way to another shot. Zooms grow in even ratios, and the corners of what is seen go on
        straight lines: a zoom alone leaves one point of the picture where it is.
        """
        zoom = self.zoom ** (1.0 - share) * other.zoom**share
        near = np.abs(np.log(other.zoom / self.zoom)) < SAME_ZOOM
        whole = np.where(near, 1.0, 1.0 / self.zoom - 1.0 / other.zoom)
        part = np.where(near, share, (1.0 / self.zoom - 1.0 / zoom) / whole)
        # exact at both ends
        part = np.where(share >= 1.0, 1.0, np.where(share <= 0.0, 0.0, part))
        zoom = np.where(share >= 1.0, other.zoom, np.where(share <= 0.0, self.zoom, zoom))
        centre = self.centre + part[:, None] * (other.centre - self.centre)
        return _Shot(centre, self.rest + part * (other.rest - self.rest), zoom)


def camera_rows(scene: Scene, poses: Poses) -> dict[tuple[int, str], FloatArray]:
    """What the camera shows in ``poses``, as properties of the film: see `_Shot`."""
    if not scene.views:
        return {}
    count = len(poses.times)
    shot = _Shot(np.zeros((count, 2)), np.ones(count), np.ones(count))
    values = reader(scene, [part for view in scene.views for part in (*view.centre, view.zoom)])(poses)
    for view in scene.views:
        *centre, zoom = (values.pop(0) for _ in range(len(view.centre) + 1))
        known: BoolArray = np.logical_and.reduce([np.isfinite(value) for value in (*centre, zoom)])
        begun = (poses.times >= float(view.begin)) & known
        middle = np.stack(centre, axis=1) if centre else np.zeros((count, 2))
        aim = _Shot(
            np.where(known[:, None], middle, 0.0),
            np.full(count, 0.0 if centre else 1.0),
            np.clip(np.where(known, zoom, 1.0), SMALLEST_VIEW, LARGEST_VIEW),
        )
        shot = shot.towards(aim, np.where(begun, _share(view, poses.times), 0.0))
    rows = (shot.centre[:, 0], shot.centre[:, 1], shot.rest, shot.zoom)
    return {(FILM, name): row for name, row in zip(CAMERA, rows, strict=True)}


def _share(view: CameraView, times: FloatArray) -> FloatArray:
    """How far the camera has gone to a view, eased as in the language."""
    if view.cut or view.until is None:
        return np.ones(len(times))
    u = np.clip((times - float(view.begin)) / float(view.until - view.begin), 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)
