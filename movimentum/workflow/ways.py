"""The two ways to write a film: from pixels that Pillow draws, or from the display list itself (SVG, HTML)."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from movimentum.workflow.choices import Picture, Progress

if TYPE_CHECKING:
    from movimentum.drawing.picture_options import PictureOptions
    from movimentum.encoding.runs import Elsewhere
    from movimentum.encoding.write import OutputFormat, WriteReport
    from movimentum.rendering.stream import PoseSource
    from movimentum.scene.model import Scene

Way: TypeAlias = "Callable[[PoseSource, Path, Fraction, Picture, Progress], WriteReport]"
"""Writes the frames of poses to a file, at so many frames a second, with the user's choices."""


def way_to(
    form: OutputFormat,
    scene: Scene,
    source: PoseSource,
    options: PictureOptions,
    elsewhere: Elsewhere | None = None,
) -> Way:
    """Everything ready to write a file of that ``form``; what is too large or cannot be read is refused here, see
    `rendering.prepare.prepare_drawing`. Pixels may be drawn ``elsewhere``.
    """
    if form.write is None:
        return _vectors(scene, source, options)
    return _pixels(scene, source, options, elsewhere)


def _pixels(scene: Scene, source: PoseSource, options: PictureOptions, elsewhere: Elsewhere | None) -> Way:
    from movimentum.encoding.write import write_animation
    from movimentum.rendering.painter import make_painter

    painter = make_painter(scene, source, options)

    def write(poses: PoseSource, path: Path, fps: Fraction, picture: Picture, progress: Progress) -> WriteReport:
        return write_animation(
            painter,
            poses,
            path,
            fps=fps,
            loop=picture.loop,
            lossy=picture.lossy,
            matte=options.background,
            workers=picture.workers,
            progress=progress,
            elsewhere=elsewhere,
        )

    return write


def _vectors(scene: Scene, source: PoseSource, options: PictureOptions) -> Way:
    from movimentum.rendering.prepare import prepare_drawing
    from movimentum.vector.write import TextForm, write_film

    prepared = prepare_drawing(scene, source, options)

    def write(poses: PoseSource, path: Path, fps: Fraction, picture: Picture, progress: Progress) -> WriteReport:
        text = None if picture.text is None else TextForm(picture.text)
        return write_film(scene, prepared, poses, path, fps=fps, loop=picture.loop, progress=progress, text=text)

    return write
