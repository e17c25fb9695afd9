"""The public names, that they are all there is, and that each has an example that runs."""

from __future__ import annotations

import doctest
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import movimentum

ROOT = Path(__file__).parents[1]
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
CONSTANTS = {"__version__"}
WITHOUT = {"stages"}
"""A module: its own docstring has the example, and its names are those of the stages."""


def test_all_is_exact():
    assert sorted(movimentum.__all__) == [
        "Accuracy", "Contact", "Diagnostic", "FailurePolicy", "Fit", "Limits", "Moments", "Motion",
        "MovimentumError", "NoSolutionError", "Overlap", "Script", "ScriptError", "Severity", "Sweep",
        "UnknownNameError", "UsageError", "Written", "__version__",
        "load", "loads", "stages", "studio",
    ]  # fmt: skip
    for name in movimentum.__all__:
        assert getattr(movimentum, name) is not None
    assert dir(movimentum) == sorted(movimentum.__all__)
    with pytest.raises(AttributeError):
        movimentum.solve_timeline  # noqa: B018
    from movimentum import stages

    for name in stages.__all__:
        assert getattr(stages, name) is not None


def public_objects() -> list[tuple[str, object]]:
    """Every public name, and every public method and property of the classes among them that are ours to explain."""
    found: list[tuple[str, object]] = [("movimentum", movimentum)]
    for name in movimentum.__all__:
        if name in CONSTANTS:
            continue
        value = getattr(movimentum, name)
        found.append((name, value))
    return found


def examples() -> list[doctest.DocTest]:
    finder = doctest.DocTestFinder(recurse=True, exclude_empty=True)
    found: list[doctest.DocTest] = []
    for name, value in public_objects():
        if inspect.ismodule(value):
            parser = doctest.DocTestParser()
            found.append(parser.get_doctest(value.__doc__ or "", {}, name, None, 0))
        else:
            found += [test for test in finder.find(value, name, globs={}) if test.examples]
    for page in ("README.md", "docs/how-to/python.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        session = "\n".join(re.findall(r"```pycon\n(.*?)```", text, re.DOTALL))
        found.append(doctest.DocTestParser().get_doctest(session, {}, page, page, 0))
    return found


@pytest.mark.parametrize("example", examples(), ids=lambda test: test.name)
def test_every_example_runs(example: doctest.DocTest, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(ROOT)
    told: list[str] = []
    runner = doctest.DocTestRunner(optionflags=OPTIONS)
    runner.run(example, out=told.append, clear_globs=False)
    assert runner.failures == 0, "".join(told)


@pytest.mark.parametrize("name", [name for name, _ in public_objects()])
def test_every_public_name_has_an_example(name: str):
    assert any(test.name == name and test.examples for test in examples())


@pytest.mark.parametrize("kind", [movimentum.Script, movimentum.Motion, movimentum.Moments])
def test_every_public_method_is_explained(kind: type):
    for name, value in vars(kind).items():
        if not name.startswith("_") and (callable(value) or isinstance(value, property)):
            assert inspect.getdoc(value), f"{kind.__name__}.{name}"


def test_importing_the_package_imports_nothing_heavy():
    heavy = ("numpy", "lark", "PIL", "click", "typing", "movimentum.api")
    code = f"""if True:
        import sys
        before = set(sys.modules)
        import movimentum
        print([name for name in {heavy} if name in sys.modules and name not in before])
    """
    done = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"
