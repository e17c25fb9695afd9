"""The size of a scene, for scaling and tolerances."""

from __future__ import annotations

from movimentum.scene.model import Scene


def scene_size(scene: Scene) -> float:
    """The scene's size in world pixels: the largest distance between two anchors of a thing, along an axis (else
    between any two anchors as drawn, else a disc's radius, else the canvas' size, else 100).

    Only used for scaling and tolerances; taken from the things themselves, so that a scaled scene is solved alike.
    """
    everything: list[tuple[float, float]] = []
    size = 0.0
    for thing in scene.things:
        points = [anchor.local for anchor in thing.anchors]
        everything += points
        size = max(size, _extent(points))
    size = size or _extent(everything) or max((thing.radius or 0.0 for thing in scene.things), default=0.0)
    if size > 0.0:
        return size
    return float(max(scene.config.size)) if scene.config.size else 100.0


def _extent(points: list[tuple[float, float]]) -> float:
    """The largest difference of a coordinate."""
    if len(points) < 2:
        return 0.0
    return max(max(p[axis] for p in points) - min(p[axis] for p in points) for axis in (0, 1))
