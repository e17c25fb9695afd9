"""The language server, by a client that speaks the protocol over a process."""

from __future__ import annotations

import os
import random
import statistics
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("pygls", reason="no pygls: pip install '.[lsp]'")

from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from tests.broad import broad
from tests.command import CRANK, ROOT, movimentum
from tests.lsp.client import Client

GALLERY = sorted((ROOT / "scripts").glob("*.mov"))
ODD = """\
// 図 😀 ünï
.config(10, 120, 80);
Rod : .bar A = [10,10] B = A + [30,0]; /* 😀 */ Disc : .disc(4) C = [1,1];
Says : .label('😀😀 {Rod.angle:.0f}°')  at = [9,9];
@0 Rod.A = [10,10]; Rod.angle = 0; /* 😀図 */ Disc.C = Rod.B;
"""


@pytest.fixture
def client() -> Iterator[Client]:
    running = Client()
    yield running
    running.kill()


def uri(path: Path) -> str:
    return path.as_uri()


def place(text: str, passage: str, more: int = 0) -> tuple[int, int]:
    """Line and UTF-16 column of a passage."""
    offset = text.index(passage) + more
    line = text.count("\n", 0, offset)
    start = text.rfind("\n", 0, offset) + 1
    return line, len(text[start:offset].encode("utf-16-le")) // 2


def applied(text: str, edits: list[dict]) -> str:
    lines = text.split("\n")
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line) + 1)

    def offset(position: dict) -> int:
        line = lines[position["line"]] if position["line"] < len(lines) else ""
        units = line.encode("utf-16-le")[: 2 * position["character"]]
        return min(starts[position["line"]] + len(units.decode("utf-16-le")), len(text))

    for edit in sorted(edits, key=lambda e: offset(e["range"]["start"]), reverse=True):
        text = text[: offset(edit["range"]["start"])] + edit["newText"] + text[offset(edit["range"]["end"]) :]
    return text


@pytest.mark.slow
def test_a_session_begins_and_ends(client: Client, tmp_path: Path) -> None:
    able = client.abilities["capabilities"]
    for name in ("completion", "hover", "definition", "references", "rename", "documentFormatting", "semanticTokens"):
        assert able[f"{name}Provider"], name
    for name in ("foldingRangeProvider", "documentSymbolProvider", "inlayHintProvider", "codeActionProvider"):
        assert able[name], name
    assert able["textDocumentSync"]["change"] == 2
    assert "movimentum.showPicture" in able["executeCommandProvider"]["commands"]
    script = tmp_path / "a.mov"
    client.open(uri(script), CRANK)
    assert client.diagnostics(uri(script)) == []
    assert client.end() == 0
    assert b"".join(client.errors) == b""


@pytest.mark.slow
def test_positions_are_in_utf_16(client: Client) -> None:
    where = "untitled:Untitled-1"
    client.open(where, ODD)
    assert client.diagnostics(where) == []
    line, column = place(ODD, "Disc.C = Rod.B", 5)
    found = client.at("definition", where, line, column)
    assert found["range"]["start"] == dict(zip(("line", "character"), place(ODD, "C = [1,1]"), strict=True))
    uses = client.at("references", where, *place(ODD, "Rod.A", 0), context={"includeDeclaration": True})
    assert len(uses) == 5  # the definition, three statements, and the text of the label
    inside = dict(zip(("line", "character"), place(ODD, "Rod.angle:"), strict=True))
    assert inside in [use["range"]["start"] for use in uses]
    edits = client.at("rename", where, *place(ODD, "Rod.A"), newName="Stange")["changes"][where]
    assert applied(ODD, edits) == ODD.replace("Rod", "Stange")
    line, column = place(ODD, "Disc.C = Rod")
    client.change(
        where,
        {
            "range": {"start": {"line": line, "character": column + 5}, "end": {"line": line, "character": column + 6}},
            "text": "Q😀",
        },
    )
    (fault,) = client.diagnostics(where, lambda found: found)[:1]
    assert fault["severity"] == 1


@broad("script", GALLERY, every=4, ids=lambda path: path.stem)
def test_the_gallery(script: Path, shared: Client) -> None:
    text, where = script.read_text(encoding="utf-8"), uri(script)
    shared.open(where, text)
    lines = text.split("\n")
    tokens = shared.of("semanticTokens/full", where)["data"]
    line = column = 0
    for step, start, length, _, _ in zip(*[iter(tokens)] * 5, strict=True):
        line, column = line + step, start + (0 if step else column)
        assert 0 < length <= len(lines[line].encode("utf-16-le")) // 2 - column
    symbols = shared.of("documentSymbol", where)
    assert [each["name"] for each in symbols if each["name"].startswith("@")]
    for fold in shared.of("foldingRange", where):
        assert 0 <= fold["startLine"] < fold["endLine"] < len(lines)
    thing = next(each for each in symbols if each["kind"] == 5)
    start = thing["selectionRange"]["start"]
    shown = shared.at("hover", where, start["line"], start["character"])
    assert thing["name"] in shown["contents"]["value"]
    uses = shared.at("references", where, start["line"], start["character"], context={"includeDeclaration": True})
    edits = shared.at("rename", where, start["line"], start["character"], newName="Renamed9")["changes"]
    assert len(edits[where]) == len(uses)
    assert parse(SourceText("a", applied(text, edits[where])))
    made = shared.of("formatting", where, options={"tabSize": 2, "insertSpaces": True})
    assert made == [] or script.stem in ("penrose-five", "penrose-twenty", "peaucellier-linkage")
    shared.close(where)


@pytest.fixture(scope="module")
def shared() -> Iterator[Client]:
    running = Client()
    yield running
    running.kill()


@pytest.mark.slow
def test_a_fault_has_its_fixes(client: Client) -> None:
    where = "untitled:a"
    text = CRANK.replace(".bar O", ".barr O")
    client.open(where, text)
    (fault, *_) = client.diagnostics(where, lambda found: found)
    for _ in range(100):
        actions = client.of("codeAction", where, range=fault["range"], context={"diagnostics": [fault]})
        if actions:
            break
        time.sleep(0.05)
    mended = applied(text, actions[0]["edit"]["changes"][where])
    assert ".barr" not in mended
    client.put(where, CRANK)
    assert client.diagnostics(where, lambda found: not found) == []


@pytest.mark.slow
def test_parts_and_includes_as_they_are_in_the_editor(client: Client, tmp_path: Path) -> None:
    part, main = tmp_path / "part.mov", tmp_path / "main.mov"
    part.write_text(".let len = 30;\n.part P() { b : .bar A = [0,0] B = A + [len,0]; @0 b.A = [0,0]; b.angle = 0; }\n")
    text = ".include 'part.mov';\nS : P();\nD : .disc(2) C = [0,0];\n@0 D.C = S.b.B;\n@1\n"
    client.open(uri(main), text)
    assert client.diagnostics(uri(main)) == []
    found = client.at("definition", uri(main), *place(text, "S.b.B", 4))
    assert found["uri"] == uri(part)
    edits = client.at("rename", uri(main), *place(text, "S.b.B", 4), newName="End")["changes"]
    assert {each: len(those) for each, those in edits.items()} == {uri(main): 1, uri(part): 1}
    assert len(client.at("rename", uri(main), *place(text, "P()", 0), newName="Arm")["changes"]) == 2
    # the open buffer wins over the disk
    client.open(uri(part), part.read_text().replace("B = A", "Q = A"))
    (fault, *_) = client.diagnostics(uri(main), lambda found: found)
    assert fault["code"].startswith("name/")
    client.close(uri(part))
    assert client.diagnostics(uri(main), lambda found: not found) == []
    part.unlink()
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": uri(part), "type": 3}]})
    assert client.diagnostics(uri(main), lambda found: found)


@pytest.mark.slow
def test_names_that_clash_or_are_none(client: Client) -> None:
    client.open("untitled:a", CRANK)
    line, column = place(CRANK, "Rod.A")
    for name in ("Crank", "1a", "a b", "", "ü", "_", "x"):
        asked = {
            "textDocument": {"uri": "untitled:a"},
            "position": {"line": line, "character": column},
            "newName": name,
        }
        answer = client.answer(client.request("textDocument/rename", asked))
        assert "name" in answer["error"]["message"], name


@pytest.mark.slow
def test_completion_and_hover(client: Client) -> None:
    text = CRANK.replace("Rod.A = Crank.P;", "Rod.A = Crank.;")
    client.open("untitled:a", text)
    found = client.at("completion", "untitled:a", *place(text, "Crank.;", 6))["items"]
    assert [each["label"] for each in found][:2] == ["O", "P"]
    assert not {"Rod", ".sin", ".bar"} & {each["label"] for each in found}
    client.put("untitled:a", CRANK)
    client.diagnostics("untitled:a")
    for _ in range(100):
        told = client.at("hover", "untitled:a", *place(CRANK, "Rod.A", 4))["contents"]["value"]
        if "beginning" in told:
            break
        time.sleep(0.05)
    assert "`Rod.A` = [50, 40]" in told
    assert "Rod.A = Crank.P" in told
    text = ".let a = 2*3;\n" + CRANK
    client.put("untitled:a", text)
    client.diagnostics("untitled:a")
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 9, "character": 0}}
    for _ in range(100):
        if hints := client.of("inlayHint", "untitled:a", range=whole):
            break
        time.sleep(0.05)
    assert [(hint["label"], hint["position"]["line"]) for hint in hints] == [(" = 6", 0)]


@pytest.mark.slow
def test_a_picture(client: Client, tmp_path: Path) -> None:
    client.open("untitled:a", CRANK)
    made = client.ask(
        "workspace/executeCommand", {"command": "movimentum.showPicture", "arguments": ["untitled:a", 0.5]}
    )
    assert Path(made["path"]).read_bytes().startswith(b"\x89PNG")
    made = client.ask("workspace/executeCommand", {"command": "movimentum.showPicture", "arguments": ["untitled:a"]})
    assert Path(made["path"]).read_bytes().startswith(b"GIF8")
    client.put("untitled:a", "x = ;")
    wrong = client.ask("workspace/executeCommand", {"command": "movimentum.showPicture", "arguments": ["untitled:a"]})
    assert "expected" in wrong["error"]
    assert client.ask("workspace/executeCommand", {"command": "movimentum.showPicture", "arguments": []})["error"]
    folder = Path(made["path"]).parent
    assert client.end() == 0
    assert not folder.exists()


QUESTIONS = ("completion", "hover", "definition", "prepareRename")


@pytest.mark.parametrize("name", ["four-bar", "watt"])
def test_a_text_broken_anywhere(name: str, shared: Client) -> None:
    text = (ROOT / "scripts" / f"{name}.mov").read_text(encoding="utf-8")
    r, where = random.Random(1), f"untitled:{name}"
    shared.open(where, "")
    for end in range(0, len(text), 11):
        broken = text[:end]
        shared.put(where, broken)
        offset = r.randrange(end + 1)
        for at in (end, offset):
            line, start = broken.count("\n", 0, at), broken.rfind("\n", 0, at) + 1
            shared.at(r.choice(QUESTIONS), where, line, at - start)
        for method in ("semanticTokens/full", "documentSymbol", "foldingRange"):
            shared.of(method, where)
        shared.of("formatting", where, options={"tabSize": 2, "insertSpaces": True})
    shared.put(where, text)
    assert shared.diagnostics(where, lambda found: not found) == []
    shared.close(where)


@pytest.mark.slow
def test_answers_while_it_solves_and_the_newest_text_wins(client: Client) -> None:
    """What it takes is printed with `-s`, and not asserted."""
    script = ROOT / "scripts" / "walschaerts.mov"
    text, where = script.read_text(encoding="utf-8"), uri(script)
    client.open(where, text)
    client.diagnostics(where)
    line, column = place(text, "x > 100", 4)
    first, asked = [], []
    for turn in range(8):
        begun = time.perf_counter()
        span = {"start": {"line": line, "character": column}, "end": {"line": line, "character": column + 3}}
        client.change(where, {"range": span, "text": f"10{turn}"})
        client.diagnostics(where)
        first.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        client.at("completion", where, line, column)
        asked.append(time.perf_counter() - begun)
    print(f"diagnostics {1e3 * statistics.median(first):.0f} ms, completion {1e3 * statistics.median(asked):.0f} ms")
    for turn in range(30):
        client.change(where, {"range": span, "text": f"1{turn:02}"})
    client.put(where, text.replace("x > 100", "x > y9z"))
    assert client.diagnostics(where) is not None
    client.put(where, text)
    assert client.diagnostics(where, lambda found: not found) == []


@pytest.mark.slow
def test_what_is_cancelled_is_answered_once_and_the_session_goes_on(client: Client) -> None:
    """The protocol: a cancelled request has an answer all the same, a result or the error RequestCancelled (-32800)."""
    script = ROOT / "scripts" / "walschaerts.mov"
    text, where = script.read_text(encoding="utf-8"), uri(script)
    client.open(where, text)
    document = {"textDocument": {"uri": where}}
    asked = [
        client.request("workspace/executeCommand", {"command": "movimentum.showPicture", "arguments": [where, 0.5]}),
        *(client.request("textDocument/documentSymbol", document) for _ in range(5)),
        client.request("textDocument/completion", {**document, "position": {"line": 9, "character": 3}}),
    ]
    for number in (*reversed(asked), *asked, 4711, "no such request"):
        client.tell("$/cancelRequest", {"id": number})
    for number in asked:
        answer = client.answer(number)
        assert "result" in answer or answer["error"]["code"] == -32800, answer
    assert client.of("documentSymbol", where)
    client.diagnostics(where)
    assert not [each for each in client.told if each.get("id") in asked and "method" not in each]


@pytest.mark.slow
def test_folders_of_the_workspace_come_move_and_go(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    folders = [{"uri": uri(tmp_path / "a"), "name": "a"}]
    client = Client(workspaceFolders=folders, capabilities={"workspace": {"workspaceFolders": True}})
    try:
        for name, thing in (("a", "Rod"), ("b", "Bar")):
            (tmp_path / name).mkdir(exist_ok=True)
            (tmp_path / name / "leg.mov").write_text(f".part Leg() {{ {thing} : .bar O = [0,0] P = [9,0]; }}")
        text = ".include 'leg.mov'; L : Leg(); @0 L.Rod.O = [0,0]; L.Rod.angle = 0;"
        where = uri(tmp_path / "a" / "film.mov")
        client.open(where, text)
        assert not [each for each in client.diagnostics(where) if each["severity"] == 1]
        (tmp_path / "a").rename(tmp_path / "moved")  # the editor closes, tells, and opens again
        (tmp_path / "b").rename(tmp_path / "a")
        event = {"added": [{"uri": uri(tmp_path / "moved"), "name": "a"}], "removed": folders}
        client.tell("workspace/didChangeWorkspaceFolders", {"event": event})
        assert client.diagnostics(where, lambda found: any(each["code"] == "name/unknown-thing" for each in found))
        client.close(where)
        moved = uri(tmp_path / "moved" / "film.mov")
        client.open(moved, text)
        assert not [each for each in client.diagnostics(moved) if each["severity"] == 1]
        (found,) = [client.at("definition", moved, *place(text, "L.Rod.O", 3))]
        assert found["uri"] == uri(tmp_path / "moved" / "leg.mov")
        removed = {"added": [], "removed": [*folders, {"uri": "file:///never/there", "name": "x"}]}
        client.tell("workspace/didChangeWorkspaceFolders", {"event": removed})
        assert client.of("documentSymbol", moved)
        assert client.end() == 0
    finally:
        client.kill()


def test_without_the_extra(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import importlib.util as u\nfind = u.find_spec\n"
        "u.find_spec = lambda name, *more: None if name == 'pygls' else find(name, *more)\n"
    )
    done = movimentum("lsp", env={"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])})
    assert (done.returncode, done.stdout) == (2, "")
    assert "pip install 'movimentum[lsp]'" in done.stderr
