"""What the server refuses, asked as a stranger would ask: by a socket of one's own, and by hostile scripts."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from movimentum.studio.messages import FromPage
from movimentum.studio.protocol import MAX_MESSAGE_BYTES
from tests.studio.conftest import Studio, Tab
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow
Opened = Callable[..., Tab]

OUTSIDE = ("../secret.mov", "/etc/passwd", "a/../../secret.mov", "away/secret.mov", "away.mov", "~/secret.mov",
           "C:\\secret.mov", "..\\secret.mov", "x\x00.mov", "", " ", "x" * 300 + ".mov")  # fmt: skip
"""Names that stand for no file of the folder (``away`` and ``away.mov`` are links that lead out of it)."""
HOSTILE = """\
.config(20, 300, 200);
Note : .label('<img src=x onerror="window.hacked=1"><script>window.hacked=1</script></svg>')  at = [10, 10];
Arm  : .bar A = [100, 80]  B = A + [60, 0];   // <script>window.hacked = 1</script> <b id="hacked">
@0   Arm.A = [100, 80];   .claim Arm.A.x = 1;   Arm.angle = '<b id="hacked">';
@1
"""


@contextmanager
def socket(studio: Studio, token: str | None = None, origin: str | None = "", host: str | None = None) -> Iterator[Any]:
    """A socket to a studio, its own page's unless something else is said."""
    from websockets.sync.client import connect

    base = f"http://127.0.0.1:{studio.port}"
    right = studio.url.split("token=")[1]
    headers = {} if host is None else {"Host": host}
    url = f"ws://127.0.0.1:{studio.port}/socket?token={right if token is None else token}"
    with connect(
        url, origin=base if origin == "" else origin, additional_headers=headers, max_size=None, proxy=None
    ) as made:  # pyright: ignore[reportArgumentType]
        yield made


def answer(connection: Any, message: dict[str, Any], kinds: tuple[str, ...]) -> dict[str, Any]:
    """The first answer of one of the kinds."""
    connection.send(json.dumps(message))
    while True:
        found = json.loads(connection.recv(timeout=20))
        if found["kind"] in kinds and found.get("state") != "running":
            return found


def test_a_socket_needs_the_token_the_host_and_the_origin(studio: Callable[..., Studio]) -> None:
    from websockets.exceptions import InvalidStatus

    running = studio(FOUR_BAR)
    with socket(running) as connection:
        assert json.loads(connection.recv(timeout=20))["kind"] == "welcome"
    port = running.port
    for wrong in (
        {"token": ""}, {"token": "x"}, {"origin": None}, {"origin": "http://evil.example"}, {"origin": "null"},
        {"origin": f"http://evil.example:{port}"}, {"origin": f"https://127.0.0.1:{port}"},
    ):  # fmt: skip
        with pytest.raises(InvalidStatus) as refused, socket(running, **wrong):
            pass
        assert refused.value.response.status_code == 403


def test_a_name_that_leads_here_is_no_name_of_ours(studio: Callable[..., Studio]) -> None:
    """DNS rebinding: a page of evil.example, whose name now stands for 127.0.0.1, has its own Host and Origin."""
    import http.client

    running = studio(FOUR_BAR)
    for host in ("evil.example", f"evil.example:{running.port}", "127.0.0.1", "127.0.0.1:1", f"[::1]:{running.port}"):
        connection = http.client.HTTPConnection("127.0.0.1", running.port, timeout=10)
        upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                   "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}  # fmt: skip
        for path, more in (("/", {}), ("/studio.js", {}), ("/socket", {**upgrade, "Origin": f"http://{host}"})):
            token = running.url.split("?")[1]
            connection.request("GET", f"{path}?{token}", headers={"Host": host, **more})
            found = connection.getresponse()
            found.read()
            assert found.status == 403, (host, path)
        connection.close()


def test_no_message_reaches_a_file_outside_the_folder(studio: Callable[..., Studio], tmp_path: Path) -> None:
    """Each kind of message that has the name of a file, with each kind of name that leads out."""
    away = tmp_path.parent / f"{tmp_path.name}-away"
    away.mkdir()
    (away / "secret.mov").write_text("A : .disc(1) P=[1,2];", encoding="utf-8")
    (tmp_path.parent / "secret.mov").write_text("B : .disc(1) P=[1,2];", encoding="utf-8")
    running = studio(FOUR_BAR)
    (tmp_path / "away").symlink_to(away)
    (tmp_path / "away.mov").symlink_to(away / "secret.mov")
    (tmp_path / "away.gif").symlink_to(away / "new.gif")
    (tmp_path / "away.txt").symlink_to(away / "new.txt")
    before = {path: path.read_bytes() for path in (away / "secret.mov", tmp_path.parent / "secret.mov")}
    messages: dict[str, tuple[dict[str, Any], str]] = {
        "save": ({"text": "mine", "base": "", "force": True}, ".mov"),
        "open": ({"source": "folder", "number": 0}, ".mov"),
        "follow": ({}, ".mov"),
        "linkage": ({"text": FOUR_BAR, "time": 0.0}, ".txt"),
        "render": ({"job": 1, "text": FOUR_BAR, "scale": 1.0, "at": None}, ".gif"),
        "recorded": ({"job": 2, "scale": 1.0, "at": 0.0}, ".gif"),
    }
    named = {kind for kind, cls in FromPage.kinds.items() if "name" in cls.__dataclass_fields__}
    assert messages.keys() == named - {"ask", "rename"}  # those names are no files
    with socket(running) as connection:
        for kind, (fields, suffix) in messages.items():
            for name in OUTSIDE:
                if kind in ("save", "follow") and name == "":
                    continue  # its own file
                sent = {"kind": kind, "name": name.replace(".mov", suffix), **fields}
                found = answer(connection, sent, ("saved", "opened", "told", "progress"))
                assert found.get("state", "failed") == "failed", (kind, name, found)
                assert found["words"], (kind, name)
                assert found.get("text", "") == "", (kind, name)
        script = FOUR_BAR + "Picture : '../secret.png' A = [0, 0];\n"
        (tmp_path.parent / "secret.png").write_bytes(b"\x89PNG")
        found = answer(connection, {"kind": "text", "rev": 1, "text": script, "time": 0.0}, ("stage",))
        assert [item["code"] for item in found["diagnostics"]] == ["asset/outside"]
    assert {path: path.read_bytes() for path in before} == before
    assert sorted(path.name for path in away.iterdir()) == ["secret.mov"]
    os.unlink(tmp_path.parent / "secret.png")


def test_a_message_that_is_too_large_or_none_ends_its_connection_only(studio: Callable[..., Studio]) -> None:
    from websockets.exceptions import ConnectionClosed

    running = studio(FOUR_BAR)
    long = {"kind": "text", "rev": 1, "text": "/" * MAX_MESSAGE_BYTES, "time": 0.0}
    bad = ["not JSON", "[]", '{"kind": "nothing"}', '{"kind": "text", "rev": 1}']
    for data, code in ((json.dumps(long), 1009), *((text, 1003) for text in bad)):
        with socket(running) as connection:
            connection.recv(timeout=20)
            with pytest.raises(ConnectionClosed) as closed:
                connection.send(data)
                while True:
                    connection.recv(timeout=20)
            # what is said while the large message is still on its way may be lost with the connection
            assert closed.value.rcvd is not None or len(data) > MAX_MESSAGE_BYTES
            assert closed.value.rcvd is None or closed.value.rcvd.code == code, data[:40]
    with socket(running) as connection:
        assert json.loads(connection.recv(timeout=20))["kind"] == "welcome"


def test_nothing_in_a_script_becomes_markup(opened: Opened) -> None:
    tab = opened(HOSTILE.replace("Arm.angle = '<b id=\"hacked\">';", "Arm.angle = 90*.t;"))
    tab.until("s.claims.length === 1")
    tab.testid("info").click()
    tab.testid("names").click()
    tab.write(HOSTILE)  # now with an error that quotes it
    tab.until("s.diagnostics.some(d => d.severity === 'error')")
    tab.page.wait_for_timeout(100)
    found = "[window.hacked === undefined, document.querySelectorAll('img, #hacked, iframe').length]"
    assert tab.page.evaluate(found) == [True, 0]
    # the policy would stop it, too
    tab.page.evaluate("() => { const made = document.createElement('script'); made.textContent = 'window.hacked = 1';"
                      " document.body.append(made); }")  # fmt: skip
    assert tab.page.evaluate("window.hacked === undefined")
    tab.said.clear()  # the browser has told about it
