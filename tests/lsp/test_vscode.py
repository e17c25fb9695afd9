"""The extension for VS Code: its files say the same as the server; what is packed is what is needed."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

from tests.command import ROOT

HERE = ROOT / "editors" / "vscode"


def test_its_files_exist_and_its_grammar_is_the_made_one() -> None:
    about = json.loads((HERE / "package.json").read_text())
    (language,) = about["contributes"]["languages"]
    (grammar,) = about["contributes"]["grammars"]
    for name in (about["main"], language["configuration"], grammar["path"]):
        assert (HERE / name).is_file(), name
    made = (ROOT / "grammar" / "movimentum.tmLanguage.json").read_text()
    assert (HERE / grammar["path"]).read_text() == made, "python -m movimentum.highlight"
    assert json.loads(made)["scopeName"] == grammar["scopeName"]
    rules = json.loads((HERE / language["configuration"]).read_text())
    assert re.fullmatch(rules["wordPattern"], "Rod_2")
    assert re.match(rules["indentationRules"]["increaseIndentPattern"], ".for k = 1..3 {  // three")
    script = (HERE / about["main"]).read_text()
    assert all(f'"{each["command"]}"' in script for each in about["contributes"]["commands"])
    assert '"movimentum.showPicture"' in script


@pytest.mark.slow
def test_it_packs(tmp_path: Path) -> None:
    if shutil.which("npm") is None:
        pytest.skip("no Node")
    folder = tmp_path / "vscode"
    shutil.copytree(HERE, folder, ignore=shutil.ignore_patterns("node_modules"))
    try:
        install = ["npm", "install", "--no-audit", "--no-fund", "--no-package-lock"]
        if subprocess.run(install, cwd=folder, capture_output=True, timeout=240).returncode:
            pytest.skip("its packages cannot be had")
    except subprocess.TimeoutExpired:
        pytest.skip("its packages cannot be had")
    pack = ["npx", "--no-install", "vsce", "package", "--allow-missing-repository", "--no-rewrite-relative-links"]
    subprocess.run([*pack, "-o", "a.vsix"], cwd=folder, check=True, capture_output=True, timeout=240)
    with zipfile.ZipFile(folder / "a.vsix") as packed:
        names = set(packed.namelist())
    for name in ("extension.js", "package.json", "language-configuration.json", "syntaxes/movimentum.tmLanguage.json"):
        assert f"extension/{name}" in names
    assert "extension/node_modules/vscode-languageclient/node.js" in names
    assert not any(name.endswith(".vsix") for name in names)  # an older package
