"""Draws the pictures of the pages: ``python docs/make_pictures.py [PICTURE …]``.

Without names it draws those that are out of date. A picture belongs to the script just above it: a block of ``mov``,
and below it ``![…](…/pictures/NAME.svg)``. It is what ``movimentum run`` makes of that script; of a page with dozens of
scripts (``brown-….svg``) it is a still. ``pictures/made.json`` says of which script each picture was made.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures"
MADE = PICTURES / "made.json"
PAIR = re.compile(r"^```mov[^\n]*\n([^`]*)^```\n\n!\[[^\]]*\]\([./]*pictures/([\w-]+\.svg)\)", re.MULTILINE)


def pairs() -> dict[str, str]:
    """Every picture that a page shows below a script, with that script."""
    found: dict[str, str] = {}
    for page in sorted(DOCS.rglob("*.md")):
        for script, picture in PAIR.findall(page.read_text(encoding="utf-8")):
            if found.setdefault(picture, script) != script:
                raise SystemExit(f"{picture} is shown below two scripts")
    return found


def fingerprint(script: str) -> str:
    """Of which script a picture was made."""
    return hashlib.sha256(script.encode()).hexdigest()[:16]


def draw(script: str, picture: Path) -> None:
    """Run one script."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / picture.with_suffix(".mov").name
        path.write_text(script, encoding="utf-8")
        command = [sys.executable, "-m", "movimentum", "run", str(path), "-o", str(picture), "-q"]
        if picture.name.startswith("brown-"):
            end = float(re.findall(r"@(\d+(?:\.\d+)?)", script)[-1])
            command += ["--at", f"{0.17 * end:.2f}"]
        subprocess.run(command, check=True, cwd=DOCS.parent)


def main(names: list[str]) -> None:
    """Draw what is named, or what is out of date; delete what no page shows."""
    made = json.loads(MADE.read_text()) if MADE.exists() else {}
    wanted = pairs()
    for name, script in wanted.items():
        if name in names or (not names and (made.get(name) != fingerprint(script) or not (PICTURES / name).exists())):
            draw(script, PICTURES / name)
            print(f"{name}: {(PICTURES / name).stat().st_size / 1000:.0f} kB", flush=True)
            made[name] = fingerprint(script)
    for name in made.keys() - wanted.keys():
        (PICTURES / name).unlink(missing_ok=True)
    kept = {name: made[name] for name in sorted(wanted) if name in made}
    MADE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
