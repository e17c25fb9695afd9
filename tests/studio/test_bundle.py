"""The page's script is what its sources make, byte for byte."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.command import ROOT

WEB = ROOT / "movimentum" / "studio" / "web"


@pytest.mark.slow
def test_the_bundle_is_built_from_the_sources(tmp_path: Path) -> None:
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("no Node: the page's script is not built again")
    for name in ("package.json", "package-lock.json"):
        shutil.copy(WEB / name, tmp_path)
    shutil.copytree(WEB / "src", tmp_path / "src")
    install = [npm, "ci", "--no-audit", "--no-fund", "--ignore-scripts"]
    done = subprocess.run(install, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    if done.returncode != 0:
        pytest.skip(f"no packages from npm: the page's script is not built again ({done.stderr.strip()[-200:]})")
    subprocess.run([npm, "run", "build"], cwd=tmp_path, capture_output=True, check=True, timeout=120)
    built = (tmp_path / "studio.js").read_bytes()
    assert built == (WEB / "studio.js").read_bytes(), "npm ci && npm run build in movimentum/studio/web"


def test_the_notices_of_everything_in_the_bundle_are_beside_it() -> None:
    packages = json.loads((WEB / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    bundled = {
        name.removeprefix("node_modules/"): each for name, each in packages.items() if name and not each.get("dev")
    }
    text = (WEB / "studio.js.LICENSE").read_text(encoding="utf-8")
    named = {line.partition(": Copyright (C) ")[0] for line in text.splitlines() if ": Copyright (C) " in line}
    assert named == set(bundled)
    assert {each["license"] for each in bundled.values()} == {"MIT"}
    assert "Permission is hereby granted, free of charge" in text


def test_the_page_asks_for_nothing_elsewhere() -> None:
    for name in ("index.html", "studio.css"):
        assert "http" not in (WEB / name).read_text(encoding="utf-8")
    for file in (WEB / "src").glob("*.js"):
        text = file.read_text(encoding="utf-8")
        for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "http://", "https://"):
            assert word not in text, (file.name, word)
