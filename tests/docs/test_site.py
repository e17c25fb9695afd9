"""The site is built without a warning, has every page, and can be searched without a server."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.command import ROOT, movimentum
from tests.docs.pages import DOCS, PAGES, name_of

pytestmark = pytest.mark.slow
LEFT_OUT = shutil.ignore_patterns("*.py", "*.html")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("zensical", reason="no Zensical: pip install '.[docs]'")
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(DOCS, folder / "docs", ignore=LEFT_OUT)
    shutil.copy(ROOT / "zensical.toml", folder)
    movimentum("run", ROOT / "scripts" / "four-bar.mov", "-o", folder / "docs" / "gallery" / "four-bar.html")
    command = [sys.executable, "-m", "zensical", "build", "--clean", "--strict"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "site"


def test_every_page_is_there(site: Path) -> None:
    for path in PAGES:
        page = name_of(path).removesuffix(".md") + ".html"
        assert (site / page.replace("README.html", "index.html")).exists(), page


def test_code_is_highlighted_and_nothing_is_left_as_text(site: Path) -> None:
    start = (site / "start" / "first.html").read_text("utf-8")
    assert 'class="language-mov highlight"' in start or 'class="language-movimentum highlight"' in start
    assert re.search(r'<span class="k\w*">', start)
    for page in site.rglob("*.html"):
        assert "<p>```" not in page.read_text("utf-8"), page


def test_no_page_asks_for_anything_from_the_network(site: Path) -> None:
    for page in site.rglob("*.html"):
        asked = re.findall(
            r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?:https?:)?//[^"]*"', page.read_text("utf-8")
        )
        assert asked == [], page


def test_the_search_works_from_a_folder(site: Path, browser: Any) -> None:
    page = browser.new_page()
    failed: list[str] = []
    page.on("requestfailed", lambda request: failed.append(request.url))
    page.goto((site / "start" / "first.html").as_uri())
    page.keyboard.press("Control+k")
    page.keyboard.type("constraint/conflict")
    page.get_by_text(re.compile(r"^\d+ results?$")).wait_for(timeout=20_000)
    assert failed == []
    page.close()


def test_the_gallery_plays(site: Path, browser: Any) -> None:
    page = browser.new_page()
    page.goto((site / "gallery.html").as_uri())
    film = page.locator(".film").filter(has_text="scripts/four-bar.mov")
    film.locator(".film-player").click()
    player = film.locator("iframe").element_handle().content_frame()
    player.wait_for_function("window.movimentum && window.movimentum.state().frames == 50")
    page.close()


def test_the_gallery_shows_its_scripts() -> None:
    spec = importlib.util.spec_from_file_location("make_gallery", DOCS / "make_gallery.py")
    assert spec is not None
    assert spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    page = (DOCS / "gallery.md").read_text("utf-8")
    assert maker.with_scripts(page) == page, "python docs/make_gallery.py --scripts"
    for path in (ROOT / "scripts").glob("*.mov"):
        assert f"scripts/{path.name}</summary>" in page
