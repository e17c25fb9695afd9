"""`run --dask`: frames drawn and encoded by the workers of a cluster, written here, in order.

Poses are sent out, not the text: solving takes a small part of the time for drawing, and a worker that solved would
have to plan first. Pictures are sent as they were read here, by the hash of their content, so no file can be missing
there.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import ExitStack
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from movimentum.text import counted, number
from movimentum.workflow.clusters import check_address, cluster, done_by, threads_of, unpacked

if TYPE_CHECKING:
    from movimentum.encoding.pieces import Coder
    from movimentum.encoding.runs import FrameRun, Pieces
    from movimentum.rendering.painter import Painter, PaintSession
    from movimentum.rendering.stream import PoseSource

WORTH_S = 5.0
"""Less work than that is done here: a cluster takes some seconds to begin."""


class FarFrames:
    """Draws on the cluster at ``address``, which is asked for when there is enough to do; a context."""

    def __init__(self, address: str, say: Callable[[str], None]) -> None:
        check_address(address)
        self.address, self.say = address, say
        self._stack = ExitStack()

    def __enter__(self) -> FarFrames:
        return self

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    def takes(self, seconds: float) -> bool:
        """See `encoding.runs.Elsewhere`."""
        if seconds < WORTH_S:
            self.say(f"{number(seconds, 2)} s of drawing: done here, without the cluster")
            return False
        return True

    def coded(self, painter: Painter, coder: Coder, source: PoseSource) -> Generator[Pieces, None, None]:
        """See `encoding.runs.Elsewhere`."""
        from movimentum.encoding.runs import runs

        client = self._stack.enter_context(cluster(self.address, self.say))
        self.say(f"drawn by {counted(threads_of(client), 'thread')} of {self.address}")
        yield from done_by(client, draw_run, (painter, coder), ((run,) for run in runs(source)))


def draw_run(data: bytes, run: FrameRun) -> Pieces:
    """One run of frames; runs on a worker."""
    from movimentum.encoding.runs import coded_alone

    return coded_alone(*_session(data), run)


@lru_cache(maxsize=1)
def _session(data: bytes) -> tuple[PaintSession, Coder]:
    """The worker's painter and coder: static layers are prepared once."""
    from movimentum.rendering.painter import PaintSession

    painter, coder = unpacked(data)
    return PaintSession(painter), coder
