"""Workers of a Dask cluster: how to reach them, what they run, and what can be wrong with them.

The queue, the protocol and the dashboard are Dask's (`distributed`); this is the user-facing part.
"""

from __future__ import annotations

import hashlib
import logging
import pickle
import re
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from importlib import import_module
from typing import Any

from movimentum.advice import Advised, Choose
from movimentum.budget import keep_freed_memory
from movimentum.errors import MovimentumError, UsageError, usage_error
from movimentum.signals import interrupts_held_back
from movimentum.text import counted, listed

TIMEOUT_S = 10
"""So long is a scheduler waited for."""
LOST = 4
"""Workers that may be lost over one piece of work before it is given up."""
AHEAD = 3
"""Pieces for each thread that are sent out before the first of them is back: nobody waits, and little is kept."""
_DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
"""Ctrl-C in a terminal goes to the workers too: they are ended by the command, which tells what is left."""
_LOCAL = re.compile(r"local(?::(\d{1,4}))?")


def check_address(address: str) -> None:
    """Raise `UsageError` for what names no cluster, and where `distributed` is missing."""
    if not _LOCAL.fullmatch(address) and not re.fullmatch(r"(tcp|tls|ws|wss|ucx)://\S+", address):
        message = f"`{address}` is not the address of a cluster"
        raise usage_error(
            "usage/dask",
            message,
            Choose.DASK.to("local"),
            Choose.DASK.to("local:4"),
            Choose.DASK.to("tcp://scheduler:8786"),
        )
    _distributed()


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError as problem:
        message = Advised(Choose.DASK.to(), " needs distributed, which is not installed")
        raise usage_error("usage/extra", message, "pip install 'movimentum[cluster]'") from problem


@contextmanager
def cluster(address: str, say: Callable[[str], None]) -> Generator[Any, None, None]:
    """A client of the cluster at ``address``: ``local`` and ``local:N`` start processes on this machine, which end
    with the work, whatever happens. ``say`` is given the dashboard's address.

    Raises `UsageError` (``usage/dask``) if there is no scheduler, no worker, or workers with another Movimentum.
    """
    check_address(address)
    distributed = _distributed()
    local = _LOCAL.fullmatch(address)
    with _quiet():
        if local is not None:
            workers = int(local[1]) if local[1] else None
            if workers == 0:
                raise usage_error("usage/dask", "a cluster has at least one worker", Choose.DASK.to("local:2"))
            with ExitStack() as stack:
                stack.callback(_semaphores_freed)
                # as the tracker starts, it would let a Ctrl-C through that is held back
                import_module("multiprocessing.resource_tracker").ensure_running()
                with interrupts_held_back():
                    started = distributed.LocalCluster(
                        n_workers=workers,
                        threads_per_worker=1,
                        dashboard_address=None,
                        silence_logs=logging.CRITICAL + 1,
                        preload=[_DEAF],
                    )
                    stack.enter_context(started)
                    client = stack.enter_context(distributed.Client(started, set_as_default=False))
                yield _checked(client)
            return
        try:
            client = distributed.Client(address, timeout=TIMEOUT_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as problem:
            message = f"no scheduler answers at {address} (waited {TIMEOUT_S} s)"
            helps = ("`dask scheduler` starts one, and prints its address", Choose.DASK.to("local"))
            raise usage_error("usage/dask", message, *helps) from problem
        with client:
            if client.dashboard_link:
                say(f"dashboard: {client.dashboard_link}")
            yield _checked(client)


def _semaphores_freed() -> None:
    """An interrupted command ends without Python's own end, which would do this; else a keeper of them complains."""
    import_module("multiprocessing.util")._run_finalizers(0)


@contextmanager
def _quiet() -> Generator[None, None, None]:
    """The engine's own log lines are not for our users; lost workers are shown by what becomes of their work."""
    libraries = ("distributed", "tornado", "asyncio", "bokeh")
    known = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in libraries]
    loggers = [
        logging.getLogger(name) for name in {*libraries, *known}
    ]  # the engine's modules have levels of their own
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def own_version() -> str:
    """The version of Movimentum where this runs."""
    return str(import_module("movimentum").__version__)


def _version_there() -> str:
    return own_version()


def _checked(client: Any) -> Any:
    """``client``, if it has workers and all of them have this version of Movimentum."""
    try:
        client.wait_for_workers(1, timeout=TIMEOUT_S)
    except TimeoutError as problem:
        message = f"the scheduler has no workers (waited {TIMEOUT_S} s)"
        raise usage_error("usage/dask", message, f"`dask worker {client.scheduler.address}` starts one") from problem
    other: dict[str, list[str]] = {}
    own = own_version()
    found: dict[str, Any] = client.run(_version_there, on_error="return")
    for worker, version in found.items():
        if version != own:
            shown = version if isinstance(version, str) else "none"
            other.setdefault(shown, []).append(worker)
    if other:
        shown = "; ".join(f"{version} on {listed(names, 3)}" for version, names in other.items())
        message = f"workers run another version of Movimentum than {own}: {shown}"
        raise usage_error("usage/dask", message, f"pip install movimentum=={own} there")
    return client


def threads_of(client: Any) -> int:
    """How many pieces the cluster can work on at once."""
    return max(1, sum(client.nthreads().values()))


def shared_future(client: Any, value: object) -> Any:
    """``value`` as a future of the cluster, by the hash of its content: sent once, and again if its worker is lost."""
    data = pickle.dumps(value)
    key = f"movimentum-{hashlib.sha256(data).hexdigest()}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it is large: it is
        return client.submit(_itself, data, key=key)


def _itself(data: bytes) -> bytes:
    return data


@lru_cache(maxsize=2)
def unpacked(data: bytes) -> Any:
    """Unpickles a value from `shared_future`; runs on a worker."""
    keep_freed_memory()
    return pickle.loads(data)


def done_by(
    client: Any, function: Callable[..., Any], common: object, pieces: Iterable[tuple[Any, ...]]
) -> Generator[Any, None, None]:
    """The results of ``function(data, *piece)`` for each of the ``pieces``, in their order; ``data`` is ``common`` for
    `unpacked`.

    Only a few are out at a time, so ``pieces`` may be endless. A piece whose worker is lost is done by another one;
    `UsageError` where that happens again and again, or where the scheduler is lost. What a function raises is raised
    here. However this ends, what is still out is called back.
    """
    distributed = _distributed()
    waiting = iter(pieces)
    out: deque[Any] = deque()

    def send() -> None:
        piece = next(waiting, None)
        if piece is not None:
            out.append(client.submit(function, data, *piece, pure=False))

    try:
        data = shared_future(client, common)
        for _ in range(AHEAD * threads_of(client)):
            send()
        while out:
            result = _result_of(out[0], client, distributed)
            out.popleft()
            send()
            yield result
    except Exception as error:
        if isinstance(error, MovimentumError) or client.status == "running":
            raise
        raise _stopped() from error  # between two results: nothing can be sent any more
    finally:
        if out:
            with suppress(Exception):
                client.cancel(list(out), force=True)


def _stopped() -> UsageError:
    return usage_error("usage/dask", "the scheduler has stopped, and the work is lost")


def _result_of(future: Any, client: Any, distributed: Any) -> Any:
    """The result of a piece of work, when it is done."""
    while True:
        try:
            return future.result(timeout="1s")
        except TimeoutError:
            if not future.done() and client.status != "running":
                raise _stopped() from None
        except distributed.KilledWorker as error:
            message = f"{counted(LOST, 'worker')} died on the same piece of work"
            helps = ("the workers' logs say why; often they had too little memory",)
            raise usage_error("usage/dask", message, *helps) from error
        except distributed.CancelledError as error:
            raise _stopped() from error
