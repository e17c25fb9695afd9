"""The server: serves the page's files, and a socket for each open page."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import secrets
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from movimentum import tolerances
from movimentum.studio.files import state_file
from movimentum.studio.page import Page
from movimentum.studio.protocol import MAX_MESSAGE_BYTES, BadMessage, received, sent
from movimentum.studio.security import HEADERS, LOOPBACK, Gate, lasting_token, policy
from movimentum.workflow.choices import Choices

FILES = {
    "studio.js": ("movimentum.studio", "web/studio.js", "text/javascript"),
    "studio.css": ("movimentum.studio", "web/studio.css", "text/css"),
    "painter.js": ("movimentum.vector", "painter.js", "text/javascript"),
}
"""The page's files: URL, place in the package, and media type."""
LASTING = {"Cache-Control": "private, max-age=31536000, immutable"}
"""For a file whose URL contains its hash."""
CLOSED_BAD, CLOSED_REFUSED = 1003, 1008


def studio_app(gate: Gate, script: str | None, folder: Path, choices: Choices) -> Starlette:
    """The web application."""

    def index(request: Request) -> Response:
        if reason := gate.refused(request.headers):
            return _refusal(reason)
        if not gate.knows(request.query_params.get("token", "")):
            return _refusal("the token is missing or wrong: open the address that `movimentum studio` has printed")
        nonce = secrets.token_urlsafe(16)
        text = files("movimentum.studio").joinpath("web/index.html").read_text(encoding="utf-8")
        for name in FILES:
            text = text.replace(f'="{name}"', f'="{name}?{_asset(name)[1]}"')
        page = text.replace("{nonce}", nonce).encode("utf-8")
        headers = {**HEADERS, "Content-Security-Policy": policy(nonce, gate.port)}
        return _answer(request, page, gzip.compress(page), "text/html", headers)

    def asset(request: Request) -> Response:
        if reason := gate.refused(request.headers):
            return _refusal(reason)
        found = FILES.get(request.path_params["name"])
        if found is None:
            return PlainTextResponse("there is no such file\n", 404, headers=HEADERS)
        data, version, packed = _asset(request.path_params["name"])
        same = request.url.query == version  # under this address there is never anything else
        return _answer(request, data, packed, found[2], {**HEADERS, **(LASTING if same else {})})

    async def connect(websocket: WebSocket) -> None:
        if gate.refused(websocket.headers, socket=True) or not gate.knows(websocket.query_params.get("token", "")):
            await websocket.close(CLOSED_REFUSED)
            return
        await websocket.accept()
        await _serve_page(websocket, lambda send: Page(script, folder, choices, send))

    routes = [Route("/", index), WebSocketRoute("/socket", connect), Route("/{name}", asset)]
    return Starlette(routes=routes)


@cache
def _asset(name: str) -> tuple[bytes, str, bytes]:
    """A file of the page, a short name for what is in it, and the file compressed."""
    package, place, _ = FILES[name]
    data = files(package).joinpath(place).read_bytes()
    return data, hashlib.sha256(data).hexdigest()[:16], gzip.compress(data)


def _answer(request: Request, data: bytes, packed: bytes, kind: str, headers: dict[str, str]) -> Response:
    """A file, compressed if the browser takes it so."""
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(packed, media_type=kind, headers={**headers, "Content-Encoding": "gzip"})
    return Response(data, media_type=kind, headers=headers)


def _refusal(reason: str) -> Response:
    return PlainTextResponse(f"refused: {reason}\n", 403, headers=HEADERS)


async def _serve_page(websocket: WebSocket, begun: Callable[[Callable[[Any], None]], Page]) -> None:
    """Pass messages on until the page is gone."""
    loop = asyncio.get_running_loop()
    waiting: asyncio.Queue[str] = asyncio.Queue()

    def send(message: Any) -> None:  # from any thread
        data = sent(message)
        with suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(waiting.put_nowait, data)

    async def pump() -> None:
        while True:
            await websocket.send_text(await waiting.get())

    page = begun(send)
    pumping, watching = asyncio.create_task(pump()), asyncio.create_task(page.watch())
    try:
        while True:
            page.take(received(await websocket.receive_text()))
    except BadMessage as problem:
        with suppress(RuntimeError):
            await websocket.close(CLOSED_BAD, str(problem))
    except (WebSocketDisconnect, KeyError, RuntimeError):
        pass
    finally:
        page.close()
        for task in (pumping, watching):
            task.cancel()
            with suppress(asyncio.CancelledError, Exception):
                await task


def serve(script: str | None, port: int, choices: Choices, ready: Callable[[str], None]) -> None:
    """Serve until interrupted; ``ready`` is given the address as soon as it answers. `OSError`: the port is taken."""
    folder = Path(script).resolve().parent if script is not None else Path.cwd()
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if sys.platform != "win32":
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listening.bind((LOOPBACK, port))
    listening.listen(64)
    port = listening.getsockname()[1]
    gate = Gate(port, lasting_token(port, state_file("studio-secret")))
    sys.setswitchinterval(tolerances.THREAD_SWITCH_S)
    config = uvicorn.Config(
        studio_app(gate, script, folder, choices),
        log_level="error",
        access_log=False,
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=MAX_MESSAGE_BYTES,
        ws_per_message_deflate=False,  # nothing leaves the machine
        timeout_graceful_shutdown=1,
        lifespan="off",
    )
    ready(gate.url)
    uvicorn.Server(config).run(sockets=[listening])
