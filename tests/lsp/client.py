"""A client of the language server: the protocol, byte by byte, over a process."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
import time
from typing import Any

from tests.command import environment


class Client:
    """A session. Every answer is waited for; whatever else comes is kept in ``told``."""

    def __init__(self, **initialization: Any) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "movimentum", "lsp"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment(),
        )  # fmt: skip
        self.told: list[dict[str, Any]] = []
        self._came: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self._number = 0
        self.versions: dict[str, int] = {}
        self.errors: list[bytes] = []
        self.threads = [
            threading.Thread(target=self._read, daemon=True),
            threading.Thread(target=lambda: self.errors.extend(self.process.stderr), daemon=True),
        ]
        for thread in self.threads:
            thread.start()
        self.abilities = self.ask(
            "initialize", {"processId": None, "rootUri": None, "capabilities": {}, **initialization}
        )
        self.tell("initialized", {})

    def _read(self) -> None:
        stream = self.process.stdout
        while True:
            length = 0
            while (line := stream.readline()) not in (b"\r\n", b""):
                name, _, value = line.partition(b":")
                assert name.lower() in (b"content-length", b"content-type"), line  # nothing else is on stdout
                if name.lower() == b"content-length":
                    length = int(value)
            if not length:
                self._came.put(None)
                return
            self._came.put(json.loads(stream.read(length)))

    def _send(self, message: dict[str, Any]) -> None:
        data = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
        self.process.stdin.flush()

    def tell(self, method: str, params: Any) -> None:
        self._send({"method": method, "params": params})

    def request(self, method: str, params: Any) -> int:
        self._number += 1
        self._send({"id": self._number, "method": method, "params": params})
        return self._number

    def ask(self, method: str, params: Any, timeout: float = 60) -> Any:
        """The result; an `AssertionError` with the error."""
        answer = self.answer(self.request(method, params), timeout)
        assert "error" not in answer, answer
        return answer["result"]

    def answer(self, number: int, timeout: float = 60) -> dict[str, Any]:
        end = time.monotonic() + timeout
        while True:
            for message in self.told:
                if message.get("id") == number and "method" not in message:
                    self.told.remove(message)
                    return message
            self._take(end)

    def _take(self, end: float) -> None:
        message = self._came.get(timeout=max(0.01, end - time.monotonic()))
        assert message is not None, b"".join(self.errors).decode()
        self.told.append(message)

    # --- documents

    def open(self, uri: str, text: str) -> None:
        self.versions[uri] = 1
        document = {"uri": uri, "languageId": "movimentum", "version": 1, "text": text}
        self.tell("textDocument/didOpen", {"textDocument": document})

    def change(self, uri: str, *changes: dict[str, Any]) -> None:
        self.versions[uri] += 1
        document = {"uri": uri, "version": self.versions[uri]}
        self.tell("textDocument/didChange", {"textDocument": document, "contentChanges": list(changes)})

    def put(self, uri: str, text: str) -> None:
        self.change(uri, {"text": text})

    def close(self, uri: str) -> None:
        self.tell("textDocument/didClose", {"textDocument": {"uri": uri}})

    def at(self, method: str, uri: str, line: int, character: int, **more: Any) -> Any:
        place = {"textDocument": {"uri": uri}, "position": {"line": line, "character": character}}
        return self.ask(f"textDocument/{method}", {**place, **more})

    def of(self, method: str, uri: str, **more: Any) -> Any:
        return self.ask(f"textDocument/{method}", {"textDocument": {"uri": uri}, **more})

    def diagnostics(self, uri: str, wanted: Any = None, timeout: float = 60) -> list[dict[str, Any]]:
        """The diagnostics of the newest version; with ``wanted``, the first of which that is true."""
        end = time.monotonic() + timeout
        while True:
            for message in list(self.told):
                if message.get("method") == "textDocument/publishDiagnostics" and message["params"]["uri"] == uri:
                    self.told.remove(message)
                    found = message["params"]
                    if found.get("version") == self.versions.get(uri) and (
                        wanted is None or wanted(found["diagnostics"])
                    ):
                        return found["diagnostics"]
            self._take(end)

    def end(self) -> int:
        self.ask("shutdown", None)
        self.tell("exit", None)
        return self.process.wait(20)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        for thread in self.threads:
            thread.join(20)
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            stream.close()
