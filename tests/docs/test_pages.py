"""The documentation is true: its scripts run, its sessions are what the commands print, its links lead somewhere."""

from __future__ import annotations

import ast
import doctest
import hashlib
import importlib.util
import json
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import movimentum as mv
from movimentum.interop.formulas import evaluate, read_formulas
from movimentum.source import SourceText
from tests.command import ROOT
from tests.docs.pages import DOCS, MADE, PAGES, Block, alike, anchors, answer, blocks, links, name_of, prose
from tests.understand import scene_of, script_of

WRITTEN = [path for path in PAGES if name_of(path) not in MADE and "decisions" not in path.parts]
WITH_SCRIPTS = [path for path in WRITTEN if any(block.language == "mov" for block in blocks(path))]
WITH_SESSIONS = [path for path in WRITTEN if any(block.language == "console" for block in blocks(path))]
WITH_PYTHON = [path for path in WRITTEN if any(block.language in ("python", "pycon") for block in blocks(path))]
PICTURED = re.compile(r"^```mov[^\n]*\n([^`]*)^```\n\n!\[[^\]]*\]\([./]*pictures/([\w-]+\.svg)\)", re.MULTILINE)
HEAVY = {"how-to/fit.md", "how-to/python.md", "start/many.md", "start/wrong.md"}
"""Pages whose sessions search for something: seconds."""
MANY = {"how-to/answers.md"}
"""Pages with dozens of scripts: seconds. (`tests.docs.test_brown` tries those of Brown's page.)"""
ABSENT = re.compile(r"^(?:import|from) dask_", re.MULTILINE)
"""Libraries that no test environment has."""


def scripts(path: Path) -> list[Block]:
    return [block for block in blocks(path) if block.language == "mov"]


def spoiled(path: Path) -> set[str]:
    """Scripts that a session of the page shows with messages: they may be wrong, and the session is compared."""
    sessions = "".join(block.text for block in blocks(path) if block.language == "console")
    return set(re.findall(r"[\w-]+\.mov", sessions))


def furnish(path: Path, folder: Path) -> None:
    """The files that a page's scripts and sessions need: its titled blocks, and any pictures."""
    for block in blocks(path):
        for picture in re.findall(r"'([\w-]+\.png)'", block.text):
            Image.new("RGBA", (200, 100), "gray").save(folder / picture)
        if "." in block.title:
            (folder / block.title).write_text(block.text, encoding="utf-8")


@pytest.mark.parametrize("path", WITH_SCRIPTS, ids=name_of)
def test_every_script_is_understood(path: Path) -> None:
    for block in scripts(path):
        if block.title in spoiled(path):
            continue
        assert script_of(block.text).items
        if block.title == "lines":  # of a script that stands elsewhere
            continue
        scene = scene_of(block.text + ("@0" if block.is_part and "@" not in block.text else ""))
        assert scene.diagnostics == (), f"line {block.line}: {scene.diagnostics}"


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(p, marks=[pytest.mark.slow] * (name_of(p) in MANY))
        for p in WITH_SCRIPTS
        if name_of(p).startswith(("start", "how-to", "cams"))
    ],
    ids=name_of,
)
def test_every_script_runs_without_a_warning(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The pages that people copy from."""
    monkeypatch.chdir(tmp_path)
    furnish(path, tmp_path)
    for block in scripts(path):
        if block.title in {"part", "lines", *spoiled(path)}:
            continue
        said = [item for item in mv.loads(block.text, name="page.mov").diagnostics if item.severity != "note"]
        assert said == [], f"line {block.line}: {said[0].code}: {said[0].message}"


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.slow] * (name_of(p) in HEAVY)) for p in WITH_SESSIONS],
    ids=name_of,
)
def test_every_session_is_what_the_commands_print(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("crank.gif",):
        assert not (tmp_path / name).exists()
    pending = blocks(path)
    furnish(path, tmp_path)
    for block in pending:
        if "." in block.title:  # a later block of the same name replaces an earlier one
            (tmp_path / block.title).write_text(block.text, encoding="utf-8")
        if block.language != "console":
            continue
        for exchange in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
            line, _, shown = exchange.partition("\n")
            said = answer(line)
            assert alike(shown, said), f"line {block.line}: $ {line}\n{said}"


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.slow] * (name_of(p) in HEAVY)) for p in WITH_PYTHON],
    ids=name_of,
)
def test_every_example_in_python(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks run one after another, beside the page's scripts and the gallery's; those for a cluster are only read."""
    for script in [*(ROOT / "scripts").glob("*.mov"), *(ROOT / "scripts" / "fits").glob("*.mov")]:
        shutil.copy(script, tmp_path)
    if "parquet" in path.read_text("utf-8"):
        pytest.importorskip("pyarrow")
    if importlib.util.find_spec("pandas") is None:
        monkeypatch.setattr("movimentum.api.results._pandas", lambda: SimpleNamespace(DataFrame=dict))
    monkeypatch.chdir(tmp_path)
    furnish(path, tmp_path)
    names: dict[str, object] = {"mv": mv}
    for block in blocks(path):
        if block.language == "python":
            tree = compile(block.text, name_of(path), "exec", ast.PyCF_ONLY_AST)
            if not ABSENT.search(block.text):
                exec(compile(tree, name_of(path), "exec"), names)
    monkeypatch.chdir(ROOT)
    session = "\n".join(block.text for block in blocks(path) if block.language == "pycon")
    told: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    runner.run(doctest.DocTestParser().get_doctest(session, {}, path.name, path.name, 0), out=told.append)
    assert runner.failures == 0, "".join(told)


@pytest.mark.parametrize("path", [*PAGES, ROOT / "README.md", ROOT / "CHANGELOG.md"], ids=lambda path: path.name)
def test_every_block_is_seen(path: Path) -> None:
    """An indented block of code would not be tried."""
    assert not re.search(r"^[ \t]+```", path.read_text("utf-8"), re.MULTILINE)


@pytest.mark.parametrize("path", [*PAGES, ROOT / "README.md", ROOT / "CHANGELOG.md"], ids=lambda path: path.name)
def test_every_link_leads_somewhere(path: Path) -> None:
    for link in links(path):
        if re.match(r"https?:|mailto:", link):
            continue
        target, _, anchor = link.partition("#")
        found = path.parent / target if target else path
        assert found.exists(), link
        if anchor:
            assert anchor in anchors(found), link
        if path.is_relative_to(DOCS):
            assert found.resolve().is_relative_to(DOCS), f"{link}: the site has only what is in docs/"


def test_every_page_is_in_the_navigation() -> None:
    listed = re.findall(r'= "([\w/-]+\.md)"', (ROOT / "zensical.toml").read_text("utf-8"))
    shown = {name_of(path) for path in PAGES if path.parent.name != "decisions" or path.name == "README.md"}
    assert sorted(listed) == sorted(shown)


def test_pages_of_the_documentation_that_the_package_names_exist() -> None:
    for path in (ROOT / "movimentum").rglob("*.py"):
        for page in re.findall(r"\bdocs/[\w/-]+\.md", path.read_text("utf-8")):
            assert (ROOT / page).exists(), f"{path}: {page}"


@pytest.mark.parametrize(
    "path",
    [*WRITTEN, *(DOCS / name for name in sorted(MADE)), ROOT / "README.md", ROOT / "CHANGELOG.md"],
    ids=lambda path: path.name,
)
def test_one_word_for_one_thing(path: Path) -> None:
    """A film is what is drawn, a motion is what is solved."""
    assert not re.findall(r"(?i)\banimations?\b", prose(path))


def test_the_pictures_are_those_of_the_scripts_beside_them() -> None:
    made = json.loads((DOCS / "pictures" / "made.json").read_text("utf-8"))
    found = {}
    for path in WRITTEN:
        text = path.read_text("utf-8")
        for script, picture in re.findall(
            r"^```mov[^\n]*\n([^`]*)^```\n\n!\[[^\]]*\]\([./]*pictures/([\w-]+\.svg)\)", text, re.M
        ):
            found[picture] = hashlib.sha256(script.encode()).hexdigest()[:16]
    assert found == made, "python docs/make_pictures.py"
    assert {path.name for path in (DOCS / "pictures").glob("*.svg")} == {*made, "trade.svg"}
    assert sum(path.stat().st_size for path in (DOCS / "pictures").glob("*.svg")) < 2_500_000


def test_the_summary_of_the_benchmarks_is_that_of_the_tables() -> None:
    page = (DOCS / "understanding" / "accuracy-and-speed.md").read_text("utf-8")
    table = page.partition("### 36,000 frames")[2]
    measured = re.search(r"^\| Movimentum +\|(.*)$", table, re.MULTILINE)
    summary = re.search(r"^\| Movimentum, from plain equations \|(.*)$", page, re.MULTILINE)
    assert measured is not None
    assert summary is not None
    exact = re.findall(r"([\d.]+) \(([\d.]+)×\)", measured[1])
    told = re.findall(r"([\d.]+) \(([\d.]+) ×\)", summary[1])
    assert len(told) == 5
    for (time, ratio), (said, about) in zip(exact, told, strict=True):
        assert float(said) == pytest.approx(float(time), abs=0.0006)
        assert float(about) == pytest.approx(float(ratio), abs=0.05)


def test_the_report_for_programs_has_the_keys_that_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = DOCS / "reference" / "files.md"
    shown, added = (json.loads(block.text) for block in blocks(page) if block.language == "json")
    Path("wrong.mov").write_text("Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A=[0,0]; Rod.B=[90,0]; @1", encoding="utf-8")
    said = json.loads(answer("movimentum check wrong.mov --format json").rpartition("\n}")[0] + "\n}")
    assert shape(said, shown) == shape(shown, shown)
    furnish(page, tmp_path)
    said = json.loads(answer("movimentum check free.mov --format json --freedom"))
    step = said["steps"][0]
    assert {key: step[key] for key in added if key == "parts"} == {"parts": added["parts"]}
    (tail,) = (motion for motion in step["motions"] if motion["things"] == ["Tail"])
    tail["velocities"] = {name: [round(each, 3) for each in pair] for name, pair in tail["velocities"].items()}
    assert tail == added["motions"][0]


def shape(value: object, like: object) -> object:
    """The keys of an object, as far down as ``like`` has any."""
    if isinstance(like, dict):
        assert isinstance(value, dict)
        return {key: shape(value[key], part) for key, part in like.items()} | dict.fromkeys(value.keys() - like.keys())
    if isinstance(like, list):
        assert isinstance(value, list)
        return [shape(item, like[0]) for item in value[:1]] if like else []
    return None


def test_what_formulas_without_a_point_say() -> None:
    page = (DOCS / "reference" / "formats.md").read_text("utf-8")
    text = "PLLP[P1, L1, L2, P2](P3)\nPLA[P0, L0, a0](P1)\nP0 = [0, 0]; P2 = [90, 0]; L0 = 35; L1 = 70; L2 = 70"
    text = "\n".join([*text.splitlines()[1::-1], text.splitlines()[2]])
    formulas = read_formulas(SourceText("four-bar.pyslvs", text))
    for changed in ({"L1": 30, "a0": [0, 180]}, {"L0": 90, "a0": [0, 180]}):
        with pytest.raises(mv.ScriptError) as caught:
            evaluate(formulas, {name: np.array(value, float) for name, value in changed.items()})
        (item,) = caught.value.diagnostics
        assert f"{item.code} {item.message}\n" in page
