"""The notebooks run, and what they show moves wherever they are exported to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
PLAYERS = {"first-mechanism": 2, "sweep-and-fit": 2, "textbook-figure": 1}


def exported(path: Path, theme: str = "light") -> str:
    """A notebook, run from its beginning, as HTML."""
    nbformat = pytest.importorskip("nbformat")
    client = pytest.importorskip("nbclient")
    nbconvert = pytest.importorskip("nbconvert")
    pytest.importorskip("ipykernel")
    if "matplotlib" in path.read_text(encoding="utf-8"):
        pytest.importorskip("matplotlib")
    notebook = nbformat.read(path, as_version=4)
    client.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(ROOT)}}).execute()
    html, _ = nbconvert.HTMLExporter(theme=theme, mathjax_url="", require_js_url="").from_notebook_node(notebook)
    return html


def test_they_are_small_and_keep_no_outputs():
    assert {path.stem for path in NOTEBOOKS} == PLAYERS.keys()
    for path in NOTEBOOKS:
        assert path.stat().st_size < 8000
        assert '"outputs": []' in path.read_text(encoding="utf-8")
        assert '"output_type"' not in path.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_it_runs_and_its_films_play_after_an_export(path: Path, theme: str, browser: Any, tmp_path: Path):
    page_file = tmp_path / "page.html"
    page_file.write_text(exported(path, theme), encoding="utf-8")
    page = browser.new_page()
    said: list[str] = []
    requests: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("console", lambda message: said.append(message.text))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(page_file.as_uri())
    stages = page.get_by_test_id("stage")
    stages.first.wait_for()
    assert stages.count() == PLAYERS[path.stem]
    for number in range(stages.count()):
        stage = stages.nth(number)
        stage.scroll_into_view_if_needed()
        before = stage.screenshot()
        page.wait_for_timeout(300)
        assert stage.screenshot() != before
    assert [text for text in said if "net::" not in text] == []
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    page.close()
