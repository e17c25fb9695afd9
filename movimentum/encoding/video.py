"""MP4 (H.264) and WebM (VP9) through PyAV, which only the ``video`` extra installs.

Frames are drawn in this process while the encoder's own threads compress and use the other processors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

from PIL import Image

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import UsageError

_BT709, _LIMITED = 1, 1
"""What players take for granted from 720 lines on, and what all of them know; the pictures are converted to it."""


def write_video(
    images: Iterator[Image.Image],
    path: Path,
    kind: str,
    size: tuple[int, int],
    fps: Fraction,
    ground: tuple[int, int, int],
    step: Callable[[], None],
) -> None:
    """Write ``kind`` (``"mp4"`` or ``"webm"``) to ``path``; frame k is shown from exactly k / ``fps``.

    Odd sizes are padded by a row or column of ``ground``, which also lies under transparent pictures. ``step`` is
    called after each frame. `UsageError` (``output/video``) if PyAV or its encoder is missing.
    """
    av = _library()
    width, height = size[0] + size[0] % 2, size[1] + size[1] % 2
    tick = 1 / fps
    if kind == "mp4":
        codec, options = (
            "libx264",
            {"crf": "20", "preset": "slow", "tune": "animation", "x264-params": _x264(width * height)},
        )
    else:
        codec, options = "libvpx-vp9", {"crf": "24", "b:v": "0", "deadline": "good", "cpu-used": "5", "row-mt": "1"}
        options |= {"lag-in-frames": "0", "threads": "4"}  # frames that wait take room, and change nothing here
    # bitexact: no random identifiers, no dates, so that equal pictures give equal files
    muxing = {"fflags": "+bitexact"} | ({"movflags": "+faststart"} if kind == "mp4" else {})
    with av.open(str(path), "w", format=kind, options=muxing) as container:
        try:
            stream = container.add_stream(codec, rate=fps, options=options)
        except (ValueError, LookupError, av.error.FFmpegError) as error:
            raise UsageError(
                [
                    Diagnostic(
                        "output/video",
                        Severity.ERROR,
                        f"this PyAV has no encoder {codec}",
                        helps=(Choose.OUTPUT.to("out.gif"),),
                    )
                ]
            ) from error
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        context = stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = _BT709
        context.color_range = _LIMITED
        stream.time_base = stream.codec_context.time_base = tick
        for number, image in enumerate(images):
            frame = av.VideoFrame.from_image(_padded(image, width, height, ground)).reformat(
                format="yuv420p",
                src_color_range="JPEG",
                dst_color_range="MPEG",
                dst_colorspace="ITU709",
            )
            frame.pts, frame.time_base = number, tick
            for packet in stream.encode(frame):
                container.mux(packet)
            step()
        for packet in stream.encode(None):
            container.mux(packet)


def _x264(pixels: int) -> str:
    """Options of x264 for frames of so many ``pixels``; the same on every machine.

    Without cpu-independent, the lookahead gives other bits for the same pictures, once in some times; so would another
    number of threads. Frames that are looked at ahead, referred to and worked on at once are held whole, some 40 bytes
    a pixel, and 4K must fit into the memory that there is by default. Thin coloured lines need the finer chroma.
    """
    ahead = min(max(40_000_000 // pixels, 4), 40)
    fewer = ":threads=2:sync-lookahead=0:ref=4:bframes=3" if ahead < 10 else ":threads=4"
    return f"cpu-independent=1:chroma-qp-offset=-2:rc-lookahead={ahead}{fewer}"


def _padded(image: Image.Image, width: int, height: int, ground: tuple[int, int, int]) -> Image.Image:
    if image.mode == "RGB" and image.size == (width, height):
        return image
    whole = Image.new("RGB", (width, height), ground)
    whole.paste(image, (0, 0), image if image.mode == "RGBA" else None)
    return whole


def _library() -> Any:
    try:
        import av
    except ImportError as error:
        raise UsageError(
            [
                Diagnostic(
                    "output/video",
                    Severity.ERROR,
                    "video files need PyAV, which is not installed",
                    helps=("pip install 'movimentum[video]'",),
                )
            ]
        ) from error
    return av
