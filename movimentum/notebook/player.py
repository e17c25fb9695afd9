"""A film as notebook output: one piece of HTML that plays anywhere, without a network."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import tempfile
import zlib
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.drawing.picture_options import PictureOptions
from movimentum.rendering.prepare import prepare_drawing
from movimentum.rendering.stream import chunks, concatenate
from movimentum.settings import FailurePolicy
from movimentum.source import SourceText
from movimentum.vector.film import Film, make_film
from movimentum.vector.page import film_data, shipped
from movimentum.workflow.animate import animate
from movimentum.workflow.choices import Choices, Picture
from movimentum.workflow.frames import PoseChunks
from movimentum.workflow.stages import Solution

if TYPE_CHECKING:
    from movimentum.living.page import Figure

MOST_POSES = 30_000
"""Poses (things times frames) in one cell; of a longer film, every second, third … frame is shown."""
STILL_PIXELS = 480
"""The longer side of the picture that is seen where no script runs."""
STILL_BYTES = 30_000
"""A picture with more bytes is made again as a JPEG."""

_STYLE = ":host { display: block; color: inherit; font: 13px/1.4 system-ui, sans-serif; padding: 2px; }\n"


def player_html(source: SourceText, solution: Solution, choices: Choices) -> str:
    """The player of a solved script; `MovimentumError` where it cannot be drawn.

    Its keys are heard only inside of it, and it is drawn only while it is seen. The same film gives the same text.
    """
    film, step = _film(solution, choices)
    packed = zlib.compress(json.dumps(film_data(film), separators=(",", ":"), allow_nan=False).encode("utf-8"), 9)
    size = film.prepared.view
    still = _still(source, solution, choices, min(1.0, STILL_PIXELS / max(size.width, size.height)))
    label = html.escape(film.title)
    note = f'<div style="opacity: .7">of {step} frames, one is shown</div>' if step > 1 else ""
    return (
        # the attribute tells JupyterLab that keys pressed here are not its own
        f'<div data-movimentum-film="{base64.b64encode(packed).decode("ascii")}" data-lm-suppress-shortcuts="true">'
        f'<img src="{still}" alt="{label}" style="max-width: 100%"></div>'
        f"{note}<script>{_script(shipped('painter.js', 'player.js'), shipped('player.css'))}</script>"
    )


def figure_html(figure: Figure) -> str:
    """The same of a living figure. Its script begins no other cell: each figure has code of its own."""
    from movimentum.living.page import figure_parts, script, style

    code, data = figure_parts(figure)
    packed = zlib.compress(json.dumps(data, separators=(",", ":"), allow_nan=False).encode("utf-8"), 9)
    key = hashlib.sha256(packed + code.encode("utf-8")).hexdigest()[:16]
    return (
        f'<div data-movimentum-film="{base64.b64encode(packed).decode("ascii")}" data-movimentum-figure="{key}"'
        f' data-lm-suppress-shortcuts="true">{html.escape(figure.film.title)}</div>'
        f"<script>{_script(script(code), style(), f'[data-movimentum-figure={json.dumps(key)}]')}</script>"
    )


def _script(player: str, style: str, cells: str = "[data-movimentum-film]:not([data-movimentum-figure])") -> str:
    """The player's script in a scope of its own: cells do not share names."""
    cell = files("movimentum.notebook").joinpath("cell.js").read_text(encoding="utf-8")
    names = f"const STYLE = {json.dumps(_STYLE + style)}, CELLS = {json.dumps(cells)};\n"
    return f"(() => {{\n{player}{names}{cell}}})();"


def _film(solution: Solution, choices: Choices) -> tuple[Film, int]:
    """The film, and of how many frames it shows one."""
    motion = solution.motion
    timeline = motion.timeline
    scene, count = timeline.scene, timeline.frame_count
    step = -(-count * max(1, len(scene.things)) // MOST_POSES)
    some = range(count) if step == 1 else tuple(timeline.frame_time(frame) for frame in range(0, count, step))
    skip = choices.on_failure is FailurePolicy.SKIP
    poses = PoseChunks(motion, some, skip, drawn=True).in_memory()
    prepared = prepare_drawing(scene, poses, PictureOptions(motion=motion.path))
    title = "Movimentum" if scene.source.path.startswith("<") else Path(scene.source.path).stem
    return make_film(scene, prepared, concatenate(list(chunks(poses))), title, timeline.fps / step, 0), step


def _still(source: SourceText, solution: Solution, choices: Choices, scale: float) -> str:
    """The first frame, as a data URL."""

    def drawn(suffix: str) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            target = Path(folder) / f"still{suffix}"
            animate(source, target, choices, Picture(scale=scale), lambda done, total: None, solution)
            return target.read_bytes()

    kind, data = "png", drawn(".png")
    if len(data) > STILL_BYTES:
        kind, data = "jpeg", drawn(".jpg")
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
