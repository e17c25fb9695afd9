"""The version tells commits apart: in a checkout, in a shallow clone, at a release, and without git."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from packaging.version import Version

import movimentum
from movimentum.cli.app import run_command_line
from movimentum.version import RELEASE
from tests.command import ROOT

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="no git")
DEVELOPED = re.compile(r"\d+\.\d+\.\d+\.dev\d{12}\+g[0-9a-f]{9}")


def git(folder: Path, *words: str) -> str:
    clean = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    clean |= {f"GIT_{who}_{what}": "a@b.example" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    clean |= {"GIT_COMMITTER_DATE": "2026-05-04T03:02:01+0200"}
    return subprocess.run(
        ["git", "-c", "protocol.file.allow=always", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
        env=clean,
    ).stdout.strip()


def version_in(folder: Path) -> str:
    """What the module says where it stands, run as the build runs it."""
    spec = importlib.util.spec_from_file_location("version_there", folder / "movimentum" / "version.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.version()


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "tree" / "movimentum").mkdir(parents=True)
    (tmp_path / "tree" / "grammar").mkdir()
    (tmp_path / "tree" / "grammar" / "movimentum.lark").write_text("")
    shutil.copy(ROOT / "movimentum" / "version.py", tmp_path / "tree" / "movimentum")
    return tmp_path / "tree"


@needs_git
def test_each_commit_has_a_version_of_its_own_between_the_releases(tree: Path) -> None:
    git(tree, "init", "-q")
    git(tree, "add", ".")
    git(tree, "commit", "-q", "-m", "one")
    first = version_in(tree)
    assert DEVELOPED.fullmatch(first)
    assert first.endswith(f".dev202605040102+g{git(tree, 'rev-parse', 'HEAD')[:9]}"), "its time in UTC, its name"
    git(tree, "commit", "-q", "--allow-empty", "-m", "two")
    assert version_in(tree) != first
    before, _, last = RELEASE.rpartition(".")
    assert Version(RELEASE) < Version(first) < Version(f"{before}.{int(last) + 1}")
    git(tree, "tag", f"v{RELEASE}")
    assert version_in(tree) == RELEASE


@needs_git
def test_a_shallow_clone_and_a_worktree_say_the_same(tree: Path) -> None:
    git(tree, "init", "-q")
    git(tree, "add", ".")
    for name in ("one", "two"):
        git(tree, "commit", "-q", "--allow-empty", "-m", name)
    git(tree.parent, "clone", "-q", "--depth", "1", tree.as_uri(), "shallow")
    git(tree, "worktree", "add", "-q", "../beside")
    assert DEVELOPED.fullmatch(version_in(tree))
    assert version_in(tree.parent / "shallow") == version_in(tree) == version_in(tree.parent / "beside")


def test_without_git_what_the_build_recorded_counts(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+\.dev0", version_in(tree))
    (tree / "movimentum" / "VERSION").write_text("7.8.9\n")
    assert version_in(tree) == "7.8.9"
    (tree / ".git").write_text("gitdir: /no/such/folder\n")
    assert version_in(tree) == "7.8.9", "a broken repository"
    monkeypatch.setenv("PATH", "")
    assert version_in(tree) == "7.8.9", "no git"


@needs_git
def test_another_projects_repository_is_not_asked(tree: Path) -> None:
    (tree / "movimentum" / "VERSION").write_text("7.8.9\n")
    shutil.rmtree(tree / "grammar")
    git(tree, "init", "-q")
    git(tree, "add", ".")
    git(tree, "commit", "-q", "-m", "vendored")
    assert version_in(tree) == "7.8.9"


@pytest.mark.parametrize("words", [["--version", "--verbose"], ["-v", "--version"], ["--version", "-v"]])
def test_a_report_of_a_bug_has_what_is_installed(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(words) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == f"movimentum, version {movimentum.__version__}"
    told = dict(line.split(": ", 1) for line in said[1:])
    assert str(Path(movimentum.__file__).parent) in told["installed in"]
    assert {"Python", "platform", "libraries", "fonts", "encodings", "extra video", "extra svg"} <= set(told)
    for name in ("numpy", "sympy", "lark", "pillow"):
        assert re.search(rf"\b{name} \d", told["libraries"])


# --- what an index shows ---


def described(home: str) -> tuple[str, dict[str, str]]:
    pytest.importorskip("hatchling")
    spec = importlib.util.spec_from_file_location("metadata_hook", ROOT / ".ci" / "metadata.py")
    assert spec is not None
    assert spec.loader is not None
    hook: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    config = {"pages": "{home}/blob/{ref}/{path}", "pictures": "{home}/raw/{ref}/{path}", "issues": "{home}/issues"}
    text = (ROOT / "README.md").read_text("utf-8")
    return hook.described(text, home, "v1.2.3", config), hook.urls(home, "v1.2.3", config)


def test_links_of_the_description_are_absolute_and_lead_to_files_of_the_commit() -> None:
    text, urls = described("https://code.example/m")
    links = re.findall(r"\]\(([^)]+)\)", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL))
    assert len(links) > 8
    assert all(link.startswith("https://code.example/m/") for link in links)
    assert "https://code.example/m/raw/v1.2.3/docs/gallery/four-bar.gif" in links
    for link in (*links, urls["Documentation"], urls["Changelog"]):
        path = re.sub(r"https://code.example/m/(blob|raw)/v1.2.3/|#.*", "", link)
        assert (ROOT / path).exists(), link
    assert "[2*" not in text
    assert text.count("```") == (ROOT / "README.md").read_text("utf-8").count("```")


def test_without_an_address_no_link_leads_nowhere() -> None:
    text, urls = described("")
    assert urls == {}
    assert not re.findall(r"\]\((?!https?:)", text)
    assert "<!--" not in text
