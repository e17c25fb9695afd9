"""How the house is kept: no module or function so long that a stranger gets lost, no cycle, one name for one class."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from tests.command import ROOT

LONGEST_MODULE = 400
LONGEST_FUNCTION = 60
"""Lines, with comments and docstrings."""

LISTS = {"movimentum.tolerances"}
"""Modules that are looked things up in, and not read."""

LONG_FUNCTIONS = {
    "movimentum.solver.continuation.free_motion:integrate_free_motion": (
        "a step control whose branches all read and change one state"
    ),
}
"""Functions that may be longer, ``module:name``, and why they read better in one piece."""


@cache
def modules(folder: str) -> dict[str, tuple[Path, ast.Module]]:
    """Every module below ``folder`` by its dotted name."""
    found: dict[str, tuple[Path, ast.Module]] = {}
    for file in sorted((ROOT / folder).rglob("*.py")):
        parts = file.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = file, ast.parse(file.read_text(encoding="utf-8"))
    return found


def imported(tree: ast.Module, known: set[str]) -> Iterator[str]:
    """What a module imports, wherever the import stands, also for types only."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                inside = f"{node.module}.{alias.name}"
                if inside in known:
                    yield inside
                elif node.module in known:
                    yield node.module


def functions(tree: ast.AST, above: str = "") -> Iterator[tuple[str, int]]:
    """Name (``Class.method``) and number of lines of every function, decorators left out."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            name = above + node.name
            yield name, (node.end_lineno or node.lineno) - node.lineno + 1
            yield from functions(node, f"{name}.")
        elif isinstance(node, ast.ClassDef):
            yield from functions(node, f"{above}{node.name}.")
        else:
            yield from functions(node, above)


def cycle(graph: dict[str, set[str]]) -> list[str]:
    """The names of one cycle, the first again at its end; empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


@pytest.mark.parametrize("folder", ["movimentum", "benchmarks"])
def test_no_module_is_longer_than_one_can_hold_in_mind(folder: str) -> None:
    lengths = {name: len(file.read_text(encoding="utf-8").splitlines()) for name, (file, _) in modules(folder).items()}
    assert {name: length for name, length in lengths.items() if length > LONGEST_MODULE and name not in LISTS} == {}


def test_no_function_is_longer_than_a_page() -> None:
    trees = {name: tree for name, (_, tree) in modules("movimentum").items()}
    found = {f"{name}:{inside}": length for name, tree in trees.items() for inside, length in functions(tree)}
    long = {name for name, length in found.items() if length > LONGEST_FUNCTION}
    assert {name: found[name] for name in long - LONG_FUNCTIONS.keys()} == {}
    assert LONG_FUNCTIONS.keys() - long == set(), "no exceptions that are none"


def test_no_module_imports_itself_through_others_not_even_for_types() -> None:
    known = modules("movimentum")
    graph = {name: set(imported(tree, set(known))) - {name} for name, (_, tree) in known.items()}
    assert cycle(graph) == []


def test_no_benchmark_imports_itself_through_others() -> None:
    known = {name.removeprefix("benchmarks."): tree for name, (_, tree) in modules("benchmarks").items()}
    graph = {name: set(imported(tree, set(known))) - {name} for name, tree in known.items()}
    assert cycle(graph) == []


def test_a_cycle_is_found() -> None:
    source = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from b import c"
    graph = {"a": set(imported(ast.parse(source), {"a", "b"})), "b": set(imported(ast.parse("import a"), {"a", "b"}))}
    assert set(cycle(graph)) == {"a", "b"}


def test_one_name_stands_for_one_class() -> None:
    homes: defaultdict[str, list[str]] = defaultdict(list)
    for name, (_, tree) in modules("movimentum").items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(name)
    assert {name: places for name, places in homes.items() if len(places) > 1} == {}


def given_twice(tree: ast.Module) -> list[str]:
    """The names that a module gives a value twice, or to a function and a value: the first is lost."""
    found: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.append(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                found += [each.id for each in ast.walk(target) if isinstance(each, ast.Name)]
    return sorted({name for name in found if found.count(name) > 1})


def test_no_module_gives_one_name_twice() -> None:
    twice = {name: names for name, (_, tree) in modules("movimentum").items() if (names := given_twice(tree))}
    assert twice == {}


def test_a_name_that_is_given_twice_is_found() -> None:
    assert given_twice(ast.parse("FAR = 1\nNEAR, FAR = 2, 3\nA: int = 4")) == ["FAR"]


def small_numbers(tree: ast.Module) -> list[int]:
    """The lines with a number that can only be a tolerance: not zero, and at most a thousandth."""
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, float) and 0 < abs(node.value) <= 1e-3
    ]


def test_tolerances_stand_in_one_module() -> None:
    found = {
        f"{path}:{line}"
        for path, tree in modules("movimentum").values()
        for line in small_numbers(tree)
        if path.name != "tolerances.py"
    }
    assert not found


def test_one_name_stands_for_one_tolerance() -> None:
    tree = modules("movimentum")["movimentum.tolerances"][1]
    targets = [target for node in tree.body if isinstance(node, ast.Assign) for target in node.targets]
    names = [node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)]
    assert sorted(names) == sorted(set(names))


def test_a_small_number_is_found() -> None:
    assert small_numbers(ast.parse("MET = 1e-9\ndef f(x): return x < 0.001 or x == 0.0 or x > 0.1")) == [1, 2]


def undeclared(tree: ast.Module, declared: set[str]) -> list[str]:
    """Packages that a test module imports on its top level, that are not ``declared``, and that it does not ask for
    with `pytest.importorskip` first."""
    hard = {
        name.partition(".")[0]
        for node in tree.body
        if isinstance(node, ast.Import) or (isinstance(node, ast.ImportFrom) and not node.level)
        for name in ([each.name for each in node.names] if isinstance(node, ast.Import) else [node.module or ""])
    }
    asked_for = {
        str(node.args[0].value).partition(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "importorskip"
        if isinstance(node.args[0], ast.Constant)
    }
    return sorted(hard - asked_for - declared - sys.stdlib_module_names - {"movimentum", "tests", "benchmarks", "docs"})


def test_tests_import_what_is_declared_for_them() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = {
        re.split(r"[^\w.-]", each)[0].lower()
        for each in project["dependencies"] + project["optional-dependencies"]["test"]
    }
    owners = packages_distributions()
    declared = {name for name in owners if wanted & {each.lower().replace("_", "-") for each in owners[name]}}
    found = {name: undeclared(tree, declared) for name, (_, tree) in modules("tests").items()}
    assert {name: missing for name, missing in found.items() if missing} == {}


def test_an_undeclared_package_is_found() -> None:
    text = "import os\nimport numpy.linalg\nfrom shapely import affinity\nimport av\npytest.importorskip('av')"
    assert undeclared(ast.parse(text), {"numpy"}) == ["shapely"]


SPEAKS_OF_OPTIONS = {
    "movimentum.cli": "it is the command line",
    "movimentum.repl": "its commands have options of their own",
    "movimentum.console": "what the command line prints",
    "movimentum.golden": "commands, and the options of pytest",
    "movimentum.version": "an option of git",
    "movimentum.workflow.installation": "an option of git",
    "movimentum.equations.preludes": "C",
    "movimentum.markup": "CSS",
    "movimentum.advice": "the one place where options are spelled",
    "movimentum.interop.recognised": "a whole command that can be typed",
    "movimentum.editing.word_help": "help on a word, not on what was asked",
}


def test_the_library_names_no_option_of_the_command_line() -> None:
    """It says what can be chosen (`movimentum.advice`), and each front end has its own words for that."""
    flag = re.compile(r"(?<![\w-])(--[a-z]|-o )")
    found: list[str] = []
    for name, (_, tree) in modules("movimentum").items():
        if any(f"{name}.".startswith(f"{each}.") for each in SPEAKS_OF_OPTIONS):
            continue
        prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        found += [
            f"{name}:{node.lineno}: {node.value}"
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose
            if flag.search(re.sub(r"`movimentum [^`]*`", "", node.value))
        ]
    assert found == []


KIND_MODULES = ("movimentum.planning.blocks.base", "movimentum.planning.blocks.kinds")
KNOW_KINDS = ("movimentum.planning.blocks.", "movimentum.solver.kinds.")


def named(node: ast.AST) -> set[str]:
    """All names in an expression or a pattern, also those behind a dot."""
    names = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
    return names | {each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)}


def subclasses(trees: Iterator[ast.Module], base: str) -> set[str]:
    """The names of ``base``, of the classes that extend it, and of the unions of those."""
    found = {base}
    for node in (node for tree in trees for node in tree.body):
        if isinstance(node, ast.ClassDef) and any(named(each) & found for each in node.bases):
            found.add(node.name)
        elif isinstance(node, ast.Assign) and isinstance(node.value, ast.BinOp) and named(node.value) <= found:
            found |= named(node.targets[0])
    return found


def asks_for(tree: ast.Module, classes: set[str]) -> list[int]:
    """The lines that look whether something is one of ``classes``, under whatever name these are known there."""
    names = set(classes)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names |= {alias.asname for alias in node.names if alias.name in classes and alias.asname}
        elif isinstance(node, ast.Assign) and isinstance(node.value, ast.BinOp | ast.Tuple):
            names |= {each.id for each in node.targets if isinstance(each, ast.Name) and named(node.value) & names}
    lines: list[int] = []
    for node in ast.walk(tree):
        asked: list[ast.expr] = []
        if isinstance(node, ast.Call) and named(node.func) & {"isinstance", "issubclass"}:
            asked = node.args[1:]
        elif isinstance(node, ast.MatchClass):
            asked = [node.cls]
        elif isinstance(node, ast.Compare):
            asked = [node.left, *node.comparators]
            if not any(isinstance(each, ast.Call) and named(each.func) == {"type"} for each in asked):
                continue
        lines += [each.lineno for each in asked if named(each) & names]
    return sorted(lines)


def test_only_their_own_modules_know_the_kinds_of_blocks() -> None:
    """Others ask what a block is like, or call its kernel: else a new kind would have to be written into each."""
    known = {name: tree for name, (_, tree) in modules("movimentum").items()}
    kinds = subclasses((known[name] for name in KIND_MODULES), "BlockBase")
    assert {"Newton", "Free", "Velocity", "Block"} <= kinds
    outside = {name: tree for name, tree in known.items() if not name.startswith(KNOW_KINDS)}
    assert {name: lines for name, tree in outside.items() if (lines := asks_for(tree, kinds))} == {}


def test_a_question_for_a_kind_is_found() -> None:
    kinds = subclasses(iter([ast.parse("class A: ...\nclass B(A): ...\nclass C: ...\nAll = A | B")]), "A")
    assert kinds == {"A", "B", "All"}
    text = "isinstance(x, B | C)\nmatch x:\n  case m.B(): pass\n  case C(): pass\ntype(x) is B"
    assert asks_for(ast.parse(text), kinds) == [1, 3, 5]
    assert asks_for(ast.parse("Both = (B, C)\nissubclass(x, Both)\nisinstance(*some)"), kinds) == [2]
    assert asks_for(ast.parse("from kinds import B as D\nisinstance(x, D)\nisinstance(x, C)\nB(1) == D"), kinds) == [2]
