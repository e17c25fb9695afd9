"""Renders the gallery: ``python docs/make_gallery.py [NAME …]`` writes ``docs/gallery/NAME.gif`` for every script.

``--sizes`` prints the table of sizes in ``docs/gallery.md``, ``--scripts`` writes the scripts beside their films
there, and ``--players`` makes ``docs/gallery/NAME.html`` for the site, which git does not keep. It calls the command
line, as a reader of the gallery would.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).resolve().parent
SCRIPTS = DOCS.parent / "scripts"

LIGHTER: dict[str, tuple[str, ...]] = {
    "antiparallelogram": ("--fps", "12.5", "--scale", "0.75"),
    "axle-path": ("--fps", "12.5", "--scale", "0.75"),
    "bicycle-suspension": ("--scale", "0.8"),
    "clockwork": ("--scale", "0.6"),
    "combination-lock": ("--fps", "12.5", "--scale", "0.8"),
    "coupling-rods": ("--fps", "20", "--frames", ":-1"),
    "crane": ("--fps", "12.5", "--scale", "0.8"),
    "drafting-pantograph": ("--fps", "12.5", "--scale", "0.8"),
    "escapement": ("--fps", "20", "--scale", "0.7"),
    "excavator": ("--scale", "0.9"),
    "geneva": ("--fps", "20", "--scale", "0.8"),
    "geneva-play": ("--fps", "20", "--scale", "0.8"),
    "governor": ("--fps", "12.5", "--scale", "0.8"),
    "jansen-walker": ("--fps", "20", "--scale", "0.85"),
    "planetary": ("--scale", "0.75"),
    "ratchet": ("--scale", "0.8"),
    "scissor-lift": ("--fps", "20"),
    "simson-line": ("--fps", "12.5", "--scale", "0.75"),
    "stephenson": ("--fps", "10"),
    "tackle": ("--fps", "12.5", "--scale", "0.75"),
    "two-stroke": ("--fps", "25", "--scale", "0.8"),
    "writing": ("--fps", "12.5", "--scale", "0.8"),
    "umbrella": ("--fps", "12.5", "--scale", "0.75"),
    "velocity-polygon": ("--fps", "12.5", "--scale", "0.8"),
    "vending-latch": ("--fps", "12.5", "--scale", "0.8"),
    "walking-toy": ("--fps", "12.5", "--scale", "0.8"),
    "walschaerts": ("--fps", "10", "--scale", "0.7"),
    "zeuner": ("--fps", "12.5", "--scale", "0.8"),
}
"""Fewer frames or pixels, for pages that load quickly; the scripts themselves run at full rate and size."""


def command(name: str) -> list[str]:
    """The arguments of ``movimentum`` that render script ``name``, without its output."""
    return ["run", str(SCRIPTS / f"{name}.mov"), *LIGHTER.get(name, ())]


def sizes() -> None:
    """Prints a table: how many kB the films of the gallery have in each format."""
    print("| | frames | GIF | SVG | HTML |\n|---|--:|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as folder:
        for name in sorted(path.stem for path in SCRIPTS.glob("*.mov")):
            made = [Path(folder) / f"{name}.{kind}" for kind in ("gif", "svg", "html")]
            for out in made:
                done = [sys.executable, "-m", "movimentum", *command(name), "-o", str(out)]
                said = subprocess.run(done, check=True, capture_output=True, text=True).stderr
            frames = said.rpartition(": ")[2].split()[0]
            print(f"| {name} | {frames} |", " | ".join(f"{out.stat().st_size / 1000:.0f}" for out in made), "|")


LONGEST = 90
"""Lines of a script that the page shows."""
FILM = re.compile(
    r"(?:<div class=\"film\" markdown=\"1\">\n\n)?(!\[[^\]]*\]\(gallery/([a-z-]+)\.gif\))\n"
    r"(?:\n<details.*?</details>\n\n</div>\n)?",
    re.DOTALL,
)


def with_scripts(page: str) -> str:
    """The page of the gallery with every film's script beside it."""

    def beside(match: re.Match[str]) -> str:
        picture, name = match.groups()
        lines = (SCRIPTS / f"{name}.mov").read_text(encoding="utf-8").rstrip().splitlines()
        if len(lines) > LONGEST:
            lines = [*lines[: LONGEST // 2], f"// … and {len(lines) - LONGEST // 2} more lines"]
        script = "\n".join(lines)
        return (
            f'<div class="film" markdown="1">\n\n{picture}\n\n<details markdown="1">\n'
            f"<summary>The script, scripts/{name}.mov</summary>\n\n```movimentum\n{script}\n```\n\n"
            "</details>\n\n</div>\n"
        )

    return FILM.sub(beside, page)


def players() -> None:
    """Pages with players, for the site."""
    for name in sorted(path.stem for path in SCRIPTS.glob("*.mov")):
        out = DOCS / "gallery" / f"{name}.html"
        if not out.exists() or out.stat().st_mtime < (SCRIPTS / f"{name}.mov").stat().st_mtime:
            done = [sys.executable, "-m", "movimentum", *command(name), "-q", "-o", str(out)]
            subprocess.run(done, check=True)


def main(names: list[str]) -> None:
    """Renders the named scripts, or all."""
    if names == ["--sizes"]:
        sizes()
        return
    if names == ["--players"]:
        players()
        return
    if names == ["--scripts"]:
        page = DOCS / "gallery.md"
        page.write_text(with_scripts(page.read_text(encoding="utf-8")), encoding="utf-8")
        return
    (DOCS / "gallery").mkdir(exist_ok=True)
    for name in names or sorted(path.stem for path in SCRIPTS.glob("*.mov")):
        out = DOCS / "gallery" / f"{name}.gif"
        subprocess.run([sys.executable, "-m", "movimentum", *command(name), "-o", str(out)], check=True)
        print(f"{out.name}: {out.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
