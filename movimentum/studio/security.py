"""Decides who may talk to the server, and which files a message may name.

The server listens on the loopback interface only. A page of another site that the user visits could still reach it
there. So every request needs the token, which is in the URL that the command prints, the server's own ``Host`` (a
foreign name that resolves to 127.0.0.1 is refused), and no foreign ``Origin``.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import os
import re
import secrets
from collections.abc import Mapping
from pathlib import Path

from movimentum.records import dataclass, field

LOOPBACK = "127.0.0.1"
_NAMES = (LOOPBACK, "localhost")
_REFUSED = r"\x00-\x1f\x7f\\" + (r":*?\"<>|" if os.name == "nt" else "")
"""Characters that no file name may have. Windows forbids more; a backslash would leave the folder there."""
_NAME = re.compile(rf"[^{_REFUSED}]{{1,255}}")


@dataclass(frozen=True, slots=True)
class Gate:
    """The requirements on a request: the token, and the server's own ``port`` in Host and Origin."""

    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))

    @property
    def url(self) -> str:
        """The URL for the user."""
        return f"http://{LOOPBACK}:{self.port}/?token={self.token}"

    def refused(self, headers: Mapping[str, str], *, socket: bool = False) -> str:
        """Why a request with these headers is refused, whatever it asks for; empty if it is not. A ``socket`` must say
        from where it is.
        """
        hosts = [f"{name}:{self.port}" for name in _NAMES]
        if headers.get("host", "").lower() not in hosts:
            return "this server has another name"
        origin = headers.get("origin")
        if origin is None:
            return "a page says where it is from" if socket else ""
        return "" if origin.lower() in [f"http://{host}" for host in hosts] else "this is a page from elsewhere"

    def knows(self, token: str) -> bool:
        """Whether that is the token."""
        return secrets.compare_digest(token.encode("utf-8", "replace"), self.token.encode("utf-8"))


def policy(nonce: str, port: int) -> str:
    """The Content-Security-Policy of the page: its own scripts and styles and pictures in its data, nothing else.

    The editor makes a style element of its own, which it marks with ``nonce``. Style attributes are allowed because
    browsers write them themselves where somebody types over a selection. The socket on ``port`` is named because not
    every browser takes it for the page's own.
    """
    sockets = " ".join(f"ws://{name}:{port}" for name in _NAMES)
    return (
        f"default-src 'none'; script-src 'self'; style-src 'self' 'nonce-{nonce}'; style-src-attr 'unsafe-inline';"
        " img-src 'self' data: blob:;"
        f" connect-src 'self' {sockets}; font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""On every answer."""


def lasting_token(port: int, record: Path) -> str:
    """The token of this user's server on ``port``: the same after a restart, so that open pages find it again.

    It is made from a secret in the file ``record``, which only the user can read; where there can be none, it is a new
    one each time.
    """
    try:
        record.parent.mkdir(parents=True, exist_ok=True)
        if not record.exists():
            handle = os.open(record, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with open(handle, "w", encoding="ascii") as stream:
                stream.write(secrets.token_hex(32))
        secret = record.read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return secrets.token_urlsafe(24)
    if len(secret) < 64:
        return secrets.token_urlsafe(24)
    digest = hmac.new(secret.encode("ascii"), f"studio on port {port}".encode("ascii"), hashlib.sha256).digest()
    return base64.urlsafe_b64encode(digest[:24]).decode("ascii")


class OutsideFolder(ValueError):
    """A name that does not stand for a file below the script's folder."""


def inside(folder: Path, name: str) -> Path:
    """The file ``name`` below ``folder``; `OutsideFolder` for everything else, links that lead out included."""
    if not _NAME.fullmatch(name) or name.strip() != name or name.startswith("~"):
        raise OutsideFolder("this is not the name of a file")
    home = folder.resolve()
    try:
        found = (home / name).resolve()
    except (OSError, RuntimeError) as error:
        raise OutsideFolder("this is not the name of a file") from error
    if found == home or not found.is_relative_to(home):
        raise OutsideFolder("files are only below the script's folder")
    return found


def outside_files(folder: Path, mentioned: tuple[Path, ...]) -> tuple[Path, ...]:
    """Those of the files that a text mentions which are there, but not below ``folder``."""
    home = folder.resolve()
    found: list[Path] = []
    for path in mentioned:
        try:
            real = path.resolve()
            if not real.is_relative_to(home) and real.exists():
                found.append(path)
        except (OSError, RuntimeError, ValueError):
            continue
    return tuple(found)
