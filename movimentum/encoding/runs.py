"""Draws and encodes runs of frames, in this process or in others.

A run is 30 frames, preceded by the frame with which the first is compared. Runs are the same whichever process draws
them, so the file is the same for any number of workers. Workers get runs one by one and send back encoded pieces. No
run is given out far ahead of the file, so memory depends neither on the film's length nor on slow workers.

Processes are forked on Linux, which costs about 10 ms. Elsewhere they are spawned, which costs about 0.35 s (measured),
because a fork may interfere there with threads of the system's libraries. A forked worker runs only the loop in this
file and ends with ``os._exit``, so it never needs locks that another thread held at the fork.
"""

from __future__ import annotations

import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import TYPE_CHECKING, Protocol, TypeAlias, cast

from movimentum.advice import Choose
from movimentum.budget import DEFAULT_MEGABYTES
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.encoding.pieces import Coder, FramePiece
from movimentum.errors import MovimentumError
from movimentum.records import dataclass
from movimentum.rendering.painter import Painter, PaintSession
from movimentum.rendering.stamps import Box, Frame
from movimentum.rendering.stream import PoseSource, chunks, concatenate, pieces
from movimentum.signals import interrupts_held_back
from movimentum.solver.poses import Poses

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnContext
    from multiprocessing.process import BaseProcess

    from PIL import Image

RUN = 30
_FORKS = sys.platform == "linux"
_ROOM = 800_000 * DEFAULT_MEGABYTES
_SHARED, _LEAST = 40_000_000, 10_000_000  # of a worker's memory: what it shares with us, and what it has at least
_START = 0.03 if _FORKS else 0.4  # seconds until a worker works

Pieces: TypeAlias = "list[FramePiece | None]"


@dataclass(frozen=True, slots=True)
class FrameRun:
    """``poses``: the run's frames, with ``lead`` the frame before them first."""

    number: int
    lead: bool
    poses: Poses


def runs(source: PoseSource) -> Iterator[FrameRun]:
    """All runs of a source, in order."""
    before: Poses | None = None
    for number, piece in enumerate(pieces(chunks(source), RUN)):
        yield FrameRun(number, before is not None, piece if before is None else concatenate([before, piece]))
        before = piece.select(slice(-1, None))


def coded_runs(painter: Painter, coder: Coder, source: PoseSource, workers: int) -> Generator[Pieces, None, None]:
    """For each run in order, one entry per frame: what it changes, None for nothing.

    If the system allows fewer processes than ``workers``, those draw. If it allows none, this process draws. Close the
    generator (or let an exception through it) to end the workers.
    """
    if workers <= 1:
        return _coded_here(painter, coder, source)
    return _coded_elsewhere(painter, coder, source, workers)


class Elsewhere(Protocol):
    """Somebody else who draws and encodes runs: the workers of a cluster."""

    def takes(self, seconds: float) -> bool:
        """Whether that many seconds of work are worth being done there."""
        ...

    def coded(self, painter: Painter, coder: Coder, source: PoseSource) -> Generator[Pieces, None, None]:
        """As `coded_runs`, with the same result."""
        ...


def coded_alone(session: PaintSession, coder: Coder, run: FrameRun) -> Pieces:
    """One of `runs`, drawn and encoded by itself. ``session`` may have drawn others before, if there are no
    traces: it remembers nothing else.
    """
    return _code_run(PaintSession(session.painter) if session.painter.traces else session, coder, run)


def workers_that_pay(seconds_a_frame: float, frames: int, held: int = 0) -> int:
    """How many processes finish ``frames`` frames soonest, at most as many as there are available processors.

    ``held``: the bytes that this process holds. A worker will hold about as much, except for what it shares. All
    together stay within the default memory limit of a command.
    """
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    work = seconds_a_frame * frames
    room = (_ROOM - held) // max(held - _SHARED, _LEAST)
    most = max(1, min(available, frames // RUN, room))
    best = min(range(1, most + 1), key=lambda n: work / n + (n > 1) * n * _START)
    return best if work - work / best - best * _START > 0.1 else 1


# --- in this process ----------------------------------------------------------------------------------------


def _coded_here(painter: Painter, coder: Coder, source: PoseSource) -> Generator[Pieces, None, None]:
    session = PaintSession(painter)
    coder.forget()  # it may have been timed
    shown: Image.Image | None = None
    for run in runs(source):
        if shown is not None:
            coder.see(Frame(shown, ()))
        pieces: Pieces = []
        for frame in session.changes(run.poses.select(slice(1, None)) if run.lead else run.poses):
            shown = frame.image
            pieces.append(coder.code(frame))
        yield pieces


# --- in others ------------------------------------------------------------------------------------------------


def _code_run(session: PaintSession, coder: Coder, run: FrameRun) -> Pieces:
    coded: Pieces = []
    for number, frame in enumerate(session.changes(run.poses)):
        if number == 0 and run.lead:
            coder.see(frame)
            continue
        if number == 0:  # the first of the film: all of it is new, whatever this session drew before
            coder.forget()
            frame = frame._replace(changed=(Box(0, 0, *frame.image.size),))
        coded.append(coder.code(frame))
    return coded


def _work(pipe: Connection, others: Sequence[Connection], painter: Painter, coder: Coder) -> None:
    """A worker's life: a run comes in, its pieces go out; the end of the pipe is the end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    for other in others:  # if held open here, they would hide the parent's end from its other workers
        other.close()
    try:
        session = PaintSession(painter)
        while True:
            run: FrameRun = pipe.recv()
            try:
                answer: Pieces | Exception = _code_run(session, coder, run)
            except Exception as error:
                answer = error
            pipe.send((run.number, answer))
    except (EOFError, OSError):
        pass
    finally:
        os._exit(0)


class _Crew:
    """The worker processes, as a context: they are gone when it ends."""

    def __init__(self, painter: Painter, coder: Coder, workers: int) -> None:
        self._start = (painter, coder, workers)
        self.pipes: list[Connection] = []
        self._processes: list[BaseProcess] = []

    def __enter__(self) -> _Crew:
        import multiprocessing

        painter, coder, workers = self._start
        # typed as one of the two; they are used alike
        context = cast("SpawnContext", multiprocessing.get_context("fork" if _FORKS else "spawn"))
        try:
            for _ in range(workers):
                if not self._started(context, painter, coder):
                    break
        except BaseException:
            self.__exit__()
            raise
        return self

    def _started(self, context: SpawnContext, painter: Painter, coder: Coder) -> bool:
        """Start one more worker; False if there is no process, no file handle or no memory for it."""
        try:
            ours, theirs = context.Pipe()
        except OSError:
            return False
        self.pipes.append(ours)
        others = tuple(self.pipes) if _FORKS else ()
        process = context.Process(target=_work, args=(theirs, others, painter, coder), daemon=True)
        try:
            # Python 3.12 warns of forks beside threads; see above
            with interrupts_held_back(), warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)
                process.start()
                self._processes.append(process)
        except (OSError, MemoryError):
            self.pipes.pop().close()
            return False
        finally:
            theirs.close()
        return True

    def __exit__(self, *_: object) -> None:
        for pipe in self.pipes:
            pipe.close()
        for process in self._processes:
            process.terminate()
        for process in self._processes:
            process.join()


def _coded_elsewhere(painter: Painter, coder: Coder, source: PoseSource, workers: int) -> Generator[Pieces, None, None]:
    from multiprocessing.connection import wait  # 5 ms that a short film does not need

    waiting = runs(source)
    done: dict[int, Pieces] = {}
    given = taken = 0
    with _Crew(painter, coder, workers) as crew:
        workers = len(crew.pipes)
        if not workers:
            yield from _coded_here(painter, coder, source)
            return
        idle = list(range(workers))
        while True:
            # only to a worker that waits for it: if both ends were sending, neither would ever finish
            while idle and given - taken < 4 * workers and (run := next(waiting, None)) is not None:
                worker = idle.pop(0)
                _send(crew.pipes[worker], run)
                given += 1
            if given == taken:
                return
            if taken in done:
                yield done.pop(taken)
                taken += 1
                continue
            for pipe in wait([pipe for worker, pipe in enumerate(crew.pipes) if worker not in idle]):
                worker = crew.pipes.index(cast("Connection", pipe))
                number, answer = _receive(crew.pipes[worker])
                if isinstance(answer, Exception):
                    raise answer
                idle.append(worker)
                done[number] = answer


def _send(pipe: Connection, run: FrameRun) -> None:
    try:
        pipe.send(run)
    except OSError as error:
        raise _died() from error


def _receive(pipe: Connection) -> tuple[int, Pieces | Exception]:
    try:
        return pipe.recv()
    except (EOFError, OSError) as error:
        raise _died() from error


def _died() -> MovimentumError:
    message = "a worker process ended unexpectedly (out of memory?)"
    return MovimentumError([Diagnostic("render/worker", Severity.ERROR, message, helps=(Choose.WORKERS.to(1),))])


def timed_frames(
    painter: Painter, source: PoseSource, positions: Sequence[int], see: Callable[[Frame], None] = lambda _: None
) -> tuple[list[Image.Image], float]:
    """Have some positions (ascending) drawn and ``see``n; the last two pictures of them (or the only one), and the
    seconds that one took (the fastest: the first warms up).
    """
    session = PaintSession(painter)
    images: list[Image.Image] = []
    fastest = float("inf")
    start = 0
    ahead = list(positions)
    for chunk in chunks(source):
        size = len(chunk.frames)
        while ahead and ahead[0] < start + size:
            position = ahead.pop(0) - start
            began = time.perf_counter()
            frames = [*session.changes(chunk.select(slice(position, position + 1)))]
            fastest = min(fastest, time.perf_counter() - began)
            images += [frame.image.copy() for frame in frames if len(ahead) < 2]
            for frame in frames:
                see(frame)
        if not ahead:
            break
        start += size
    return images, fastest
