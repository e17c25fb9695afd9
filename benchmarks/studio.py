"""How long somebody waits in the studio: medians, through a real browser.

    python benchmarks/studio.py [--keys N] [--moves N]

From a key to its picture (milliseconds, the browser's clock): a number of a four-bar, a comment of Walschaerts' gear, a
number in the last step of Stephenson's gear. Then a hand that drags (the server's clock): a freed four-bar,
Peaucellier's cell and the tiling of 571 vertices.
"""

from __future__ import annotations

import argparse
import math
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # the checkout, where it is not installed

from live import SCRIPTS, last_number
from penrose import transformable

from movimentum.interop.linkages import linkage_script


@contextmanager
def opened(browser: Any, text: str) -> Iterator[Any]:
    """A page with a script beside a copy of the gallery's pictures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(SCRIPTS / "sprites", folder / "sprites")
        script = folder / "script.mov"
        script.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "movimentum", "studio", str(script), "--no-open"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
            assert server.stdout is not None
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(server.stdout.readline().strip())
            settle(page)
            yield page
            page.close()
            server.terminate()


def settle(page: Any) -> None:
    """Wait until everything is known about the text."""
    while not page.evaluate("(s => s.settled && s.shownRev === s.rev && !s.glimpse)(movimentum.state())"):
        time.sleep(0.02)


def keys(page: Any, place: int, count: int) -> list[float]:
    """What each key waits for its picture: digits, each taken back by the next key."""
    page.evaluate("place => movimentum.select(place)", place)
    for number in range(count):
        page.keyboard.press("Backspace" if number % 2 else str(1 + number // 2 % 9))
        time.sleep(0.2)  # asking the page meanwhile would be measured too
        settle(page)
    return page.evaluate("movimentum.state().keyMs")


def drag(page: Any, name: str, moves: int) -> list[float]:
    """What the server takes for the moves of a hand that holds an anchor."""
    x, y = page.evaluate("name => movimentum.state().anchors[name]", name)
    for move in range(moves):
        target = [x + 25 * math.sin(move / 15) + 3, y + 25 * math.sin(move / 11)]
        page.mouse.move(*page.evaluate("p => movimentum.toScreen(p)", target if move else [x, y]))
        if not move:
            page.mouse.down()
    time.sleep(2.0)  # taking hold of a large scene takes a while, and its last moves arrive
    page.mouse.up()
    return page.evaluate("movimentum.state().dragMs")


def row(name: str, found: list[float]) -> None:
    """Print one line of the table."""
    if found:
        print(f"{name:40}{statistics.median(found):10.1f}{sorted(found)[int(0.95 * len(found))]:10.1f}", flush=True)
    else:
        print(f"{name:40}{'none':>10}", flush=True)


def main() -> None:
    """Print the table."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser()
    parser.add_argument("--keys", type=int, default=20)
    parser.add_argument("--moves", type=int, default=60)
    chosen = parser.parse_args()
    four, gear, stephenson, cell = (
        (SCRIPTS / f"{name}.mov").read_text(encoding="utf-8")
        for name in ("four-bar", "walschaerts", "stephenson", "peaucellier-linkage")
    )
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        print(f"{'milliseconds':40}{'median':>10}{'95 %':>10}")
        with opened(browser, four) as page:
            row("key: a number of a four-bar", keys(page, four.index("[70,90]") + 3, chosen.keys))
        with opened(browser, gear) as page:
            row("key: a comment of Walschaerts' gear", keys(page, gear.index("//") + 2, chosen.keys))
        place = last_number(SCRIPTS / "stephenson.mov", stephenson)
        assert place is not None
        begin, end = place
        with_point = f"{stephenson[:begin]}{float(stephenson[begin:end])}{stephenson[end:]}"
        with opened(browser, with_point) as page:
            at = begin + len(str(float(stephenson[begin:end])))
            row("key: the last step of Stephenson's gear", keys(page, at, chosen.keys))
        with opened(browser, four.replace("Crank.angle = 180*.t;", "")) as page:
            row("move: a freed four-bar", drag(page, "Crank.B", chosen.moves))
        with opened(browser, re.sub(r"^[^/\n]*~[^;]*;", "", cell, flags=re.M)) as page:
            row("move: Peaucellier's cell", drag(page, "R3_5.V5", chosen.moves))
        tiling = linkage_script(transformable(4), "tiling of order 4")
        with opened(browser, tiling) as page:
            names = page.evaluate("Object.keys(movimentum.state().anchors)")
            row("move: the tiling of 571 vertices", drag(page, names[-1], chosen.moves))
        browser.close()


if __name__ == "__main__":
    main()
