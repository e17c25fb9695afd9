"""The pages that are made from the package are what the package says today, and say all of it."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from types import ModuleType

import pytest

from tests.broad import broad
from tests.command import ROOT, environment

DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    return module_of("make_reference")


def module_of(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@broad("page", ["commands", "python", "messages"], fast=("commands", "python"))
def test_the_page_is_what_the_package_says(page: str, maker: ModuleType) -> None:
    made = getattr(maker, page)()
    shown = (DOCS / "reference" / f"{page}.md").read_text(encoding="utf-8")
    assert on_any_machine(shown) == on_any_machine(made), "python docs/make_reference.py"


MACHINE = re.compile(
    r"(?<=error of the differential equation grows to )\de-\d\d|(?<=it is more than 1e-9 from )t = .*"
    r"|(?m:^  R = [\d.]+, h = [\d.]+$)"
)
"""Numbers that rounding decides, which processors do otherwise: a chaotic motion's, and which of equally good solutions
a fit comes to.
"""


def on_any_machine(page: str) -> str:
    """A page without the numbers that are other on other machines."""
    return MACHINE.sub("…", page)


def test_a_few_messages_are_what_the_package_says(maker: ModuleType) -> None:
    """One of fifteen; the page of all of them is a slow test."""
    entries, shown = maker.catalogue(), maker.cases()
    page = (DOCS / "reference" / "messages.md").read_text(encoding="utf-8")
    for code in list(entries)[::15]:
        assert "\n".join(maker.example(code, entries[code], shown)) in page, "python docs/make_reference.py"


def test_the_manual_pages_are_what_the_commands_say() -> None:
    made = module_of("make_man").manual()
    shown = {path.name: path.read_text(encoding="ascii") for path in (DOCS / "man").glob("*.1")}
    assert shown == made, "python docs/make_reference.py"


@pytest.mark.skipif(shutil.which("man") is None or shutil.which("groff") is None, reason="no man")
def test_the_manual_pages_are_shown_without_a_warning() -> None:
    for path in (DOCS / "man").glob("*.1"):
        done = subprocess.run(
            ["man", "--warnings", "-l", "-Tutf8", path], capture_output=True, text=True, check=True, env=environment()
        )
        assert done.stderr == ""
        assert "SYNOPSIS" in re.sub(r".\x08|\x1b\[[\d;]*m", "", done.stdout)


def test_every_code_is_explained(maker: ModuleType) -> None:
    explained = set(maker.catalogue())
    assert maker.codes() - explained == set()
    package = "\n".join(path.read_text("utf-8") for path in (ROOT / "movimentum").rglob("*.py"))
    for code in explained:  # some codes are put together from a family and a word
        assert f'"{code}"' in package or f'"{code.partition("/")[2]}"' in package, code


def test_every_family_of_codes_is_known(maker: ModuleType) -> None:
    """So that a new family is not overlooked: every text of the package that looks like a code."""
    words: set[str] = set()
    for path in (ROOT / "movimentum").rglob("*.py"):
        words |= set(
            re.findall(r'(?:Diagnostic|error|warning|refused)\(\s*f?"([a-z0-9]+)/[a-z{]', path.read_text("utf-8"))
        )
    assert words <= set(maker.FAMILIES)
