"""Builds the documentation as a site: ``python docs/make_site.py [--quick]`` (``pip install -e '.[docs]'``).

It renders the players of the gallery (half a minute, once; ``--quick`` leaves them out), and runs ``zensical build
--strict``. The site is in ``site/``. It needs no server: open ``site/index.html``.
"""

from __future__ import annotations

import subprocess
import sys

from make_gallery import DOCS, players


def main() -> int:
    """Build it; returns the exit code of the builder."""
    if "--quick" not in sys.argv[1:]:
        players()
    return subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--clean", "--strict"], cwd=DOCS.parent
    ).returncode


if __name__ == "__main__":
    sys.exit(main())
