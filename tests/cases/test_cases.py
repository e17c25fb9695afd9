"""Scripts and what is said about them, side by side in this folder's Markdown files.

A case is a fenced ``mov`` block followed by a fenced ``text`` block. The info string of the first may set limits:
``mov max_frames=10``. Pictures are 200 × 100 pixels, except that ``missing.png`` does not exist.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from movimentum.diagnostics import Diagnostic, Severity, render_text, to_json
from movimentum.errors import ScriptError
from movimentum.scene.build import build
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.timeline.arrange import arrange

FOLDER = Path(__file__).parent
PACKAGE = FOLDER.parent.parent / "movimentum"
BLOCK = re.compile(r"```mov(?P<limits>[^\n]*)\n(?P<script>.*?)```\n\n```text\n(?P<said>.*?)```\n", re.DOTALL)


@dataclass(frozen=True)
class Case:
    file: str
    title: str
    limits: dict[str, int]
    script: str
    said: str


PARSER_LIMITS = ("max_nesting", "max_characters", "max_operations")


def cases(path: Path) -> list[Case]:
    text = path.read_text(encoding="utf-8")
    found = []
    for match in BLOCK.finditer(text):
        titles = re.findall(r"^#+ (.*)$", text[: match.start()], re.MULTILINE)
        limits = {name: int(value) for name, value in re.findall(r"(\w+)=(\d+)", match["limits"])}
        found.append(Case(path.name, titles[-1], limits, match["script"], match["said"]))
    return found


ALL = [case for path in sorted(FOLDER.glob("*.md")) for case in cases(path)]


def image_size(path: str) -> tuple[int, int] | Diagnostic:
    if path.endswith("missing.png"):
        return Diagnostic("asset/missing", Severity.ERROR, f"there is no file `{path}`")
    return 200, 100


def diagnostics_of(case: Case) -> tuple[Diagnostic, ...]:
    source = SourceText("case.mov", case.script)
    reading = {name: value for name, value in case.limits.items() if name in PARSER_LIMITS}
    building = {name: value for name, value in case.limits.items() if name == "max_pixels"}
    arranging = {name: value for name, value in case.limits.items() if name == "max_frames"}
    try:
        scene = build(parse(source, **reading), source, image_size, **building)
        arrange(scene, **arranging)
        return scene.diagnostics
    except ScriptError as error:
        return error.diagnostics


def said_about(case: Case) -> str:
    return render_text(diagnostics_of(case), SourceText("case.mov", case.script)) or "(nothing)\n"


def test_cases_are_up_to_date(request: pytest.FixtureRequest) -> None:
    """Every case's text is exactly what is said; with ``--refresh-cases`` it is made so."""
    refresh = request.config.getoption("--refresh-cases", default=False)
    wrong: list[str] = []
    for path in sorted(FOLDER.glob("*.md")):
        for case in cases(path):
            said = said_about(case)
            if said == case.said:
                continue
            if refresh:
                text = path.read_text(encoding="utf-8")
                old = f"{case.script}```\n\n```text\n{case.said}```\n"
                assert text.count(old) == 1, f"two cases are alike: {case.title}"
                path.write_text(text.replace(old, f"{case.script}```\n\n```text\n{said}```\n"), encoding="utf-8")
            else:
                wrong.append(f"{case.file}: {case.title}\n--- expected\n{case.said}--- said\n{said}")
    assert not wrong, "\n".join(wrong)


def test_every_code_of_the_front_end_has_a_case() -> None:
    code = re.compile(r'"((?:syntax|name|kind|asset|timeline|limit)/[a-z-]+)"')
    used = {
        found
        for stage in ("syntax", "scene", "timeline")
        for path in (PACKAGE / stage).glob("*.py")
        for found in code.findall(path.read_text(encoding="utf-8"))
    }
    shown = {found for case in ALL for found in re.findall(r"^\w+\[(\S+)\]:", case.said, re.MULTILINE)}
    assert used <= shown
    assert len(used) > 20


@pytest.mark.parametrize("case", ALL, ids=lambda case: f"{case.file}: {case.title}")
def test_json_and_text_tell_the_same(case: Case) -> None:
    """Every message, note and help of the text is in the JSON, at a place that exists in the script."""
    source = SourceText("case.mov", case.script)
    lines = case.script.split("\n")
    for item in to_json(diagnostics_of(case), source):
        assert f"{item['severity']}[{item['code']}]: {item['message']}\n" in case.said
        for text in [*item["notes"], *item["helps"]]:
            assert f": {text}\n" in case.said
        for place in [item, *item["labels"]]:
            if place["line"] is not None:
                assert 1 <= place["column"] <= len(lines[place["line"] - 1]) + 1
                assert (place["end_line"], place["end_column"]) >= (place["line"], place["column"])
