"""The version. Every commit has its own: ``0.1.1.dev202611232155+g3f2a91c04`` is a state on the way to 0.1.1.

In a checkout, git identifies the commit. In a build, the file ``VERSION`` beside this module has the answer. The build
runs this file on its own, so it imports nothing of ours.
"""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import Any

RELEASE = "0.1.0"
"""The last release. The commit with the tag ``v0.1.0`` has just this version."""
_HERE = Path(__file__).resolve().parent
_LOG = re.compile(r"(?P<time>\d+) (?P<commit>[0-9a-f]{9})[0-9a-f]* ?(?P<names>.*)")


def version() -> str:
    """The version of the code that this file belongs to.

    The number behind ``.dev`` is the commit's time in UTC, to the minute, so a later commit is a later version. A
    shallow clone has the same answer as a whole one (but it may lack the tag of a release).
    """
    return (git_version() if is_checkout() else None) or _recorded() or f"{_next()}.dev0"


def is_checkout() -> bool:
    """Whether this is a working copy of the project's repository."""
    root = _HERE.parent
    return (root / ".git").exists() and (root / "grammar").is_dir()


def git_version() -> str | None:
    """The version from git; None without git."""
    said = git("log", "-1", "--format=%ct %H %D")
    found = None if said is None else _LOG.fullmatch(said)
    if found is None:
        return None
    if f"tag: v{RELEASE}" in found["names"].split(", "):
        return RELEASE
    return f"{_next()}.dev{time.strftime('%Y%m%d%H%M', time.gmtime(int(found['time'])))}+g{found['commit']}"


def git(*words: str) -> str | None:
    """The output of git about the checkout; None without git, or if it refuses."""
    import subprocess  # 10 ms that an installed program does not need

    # only this repository, whatever a hook of another one has set
    clean = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        done = subprocess.run(
            ["git", *words], cwd=_HERE.parent, capture_output=True, text=True, timeout=10, check=False, env=clean
        )
    except (OSError, ValueError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def _recorded() -> str | None:
    """The version left by the build, also if the package is not in a folder."""
    loader: Any = globals()["__loader__"]
    try:
        return loader.get_data(os.path.join(os.path.dirname(__file__), "VERSION")).decode("ascii").strip() or None
    except (OSError, ValueError, AttributeError):
        return None


def _next() -> str:
    """The version after the last release."""
    before, _, last = RELEASE.rpartition(".")
    return f"{before}.{int(last) + 1}"
