"""What page and server say to each other, and what the server refuses."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from movimentum.studio import messages
from movimentum.studio.messages import FromPage, TextTyped, ToolUsed, ToPage
from movimentum.studio.protocol import TARGET, BadMessage, received, schema, schema_text, sent
from movimentum.studio.security import Gate, OutsideFolder, inside, lasting_token, outside_files, policy
from movimentum.studio.tokens import TARGET as TOKENS
from movimentum.studio.tokens import tokens_script

TYPES = {"string": str, "integer": int, "number": (int, float), "boolean": bool, "null": type(None), "object": dict}


def agrees(value: Any, rule: dict[str, Any]) -> bool:
    """Whether a value is as a schema of ours says (the few words of JSON schema that it uses)."""
    if "anyOf" in rule:
        return any(agrees(value, each) for each in rule["anyOf"])
    if "const" in rule:
        return value == rule["const"]
    if rule["type"] == "array":
        rules = rule.get("prefixItems")
        if rules is not None:
            return isinstance(value, list) and len(value) == len(rules) and all(map(agrees, value, rules))
        return isinstance(value, list) and all(agrees(each, rule["items"]) for each in value)
    if not isinstance(value, TYPES[rule["type"]]) or (isinstance(value, bool) and rule["type"] != "boolean"):
        return False
    if "properties" not in rule:
        return True
    return value.keys() == set(rule["required"]) and all(agrees(value[k], v) for k, v in rule["properties"].items())


def test_the_schema_is_that_of_the_classes() -> None:
    assert TARGET.read_text(encoding="utf-8") == schema_text(), "python -m movimentum.studio.protocol"
    assert schema()["$defs"].keys() == {*FromPage.kinds, *ToPage.kinds, "page", "server"}


def test_the_words_of_the_editor_are_those_of_the_grammar() -> None:
    pytest.importorskip("pygments")
    assert TOKENS.read_text(encoding="utf-8") == tokens_script(), "python -m movimentum.studio.tokens"


@pytest.mark.parametrize("kind", sorted(FromPage.kinds))
def test_what_a_page_sends_is_read_as_the_schema_says(kind: str) -> None:
    cls = FromPage.kinds[kind]
    rule = schema()["$defs"][kind]
    values = {"string": "x", "integer": 3, "number": 2.5, "boolean": True}
    message: dict[str, Any] = {"kind": kind}
    for name, each in rule["properties"].items():
        if name == "kind":
            continue
        if each.get("type") == "array":
            inner = each.get("items") or {}
            message[name] = [1.0, 2] if "prefixItems" in each else [] if "prefixItems" in inner else ["A"]
        else:
            message[name] = None if "anyOf" in each else values[each["type"]]
    assert agrees(message, rule)
    found = received(json.dumps(message))
    assert type(found) is cls
    for name in message.keys() - {"kind"}:
        with pytest.raises(BadMessage):
            received(json.dumps({key: value for key, value in message.items() if key != name}))
        with pytest.raises(BadMessage):
            received(json.dumps({**message, name: {"other": "type"}}))
    with pytest.raises(BadMessage):
        received(json.dumps({**message, "more": 1}))


@pytest.mark.parametrize(
    "data",
    ["", "[]", "3", "{}", '{"kind": "welcome"}', '{"kind": ["text"]}', '{"kind": null}', "[" * 100_000,
     '{"kind": "text", "rev": true, "text": "", "time": 0}', '{"kind": "text", "rev": 1.5, "text": "", "time": 0}',
     '{"kind": "text", "rev": 1, "text": "", "time": NaN}', '{"kind": "text", "rev": 1, "text": "", "time": 1e999}'],
)  # fmt: skip
def test_anything_else_is_refused(data: str) -> None:
    with pytest.raises(BadMessage):
        received(data)


def test_points_and_names_become_tuples() -> None:
    data = {"kind": "tool", "rev": 1, "tool": "rod", "names": ["A.P", ""], "points": [[1, 2.5], [3, 4]], "time": 0}
    assert received(json.dumps(data)) == ToolUsed(1, "rod", ("A.P", ""), ((1.0, 2.5), (3.0, 4.0)), 0.0)
    assert received('{"kind": "text", "rev": 1, "text": "\\ud83d", "time": 0}') == TextTyped(1, "\ud83d", 0.0)


def test_what_is_sent_is_as_the_schema_says() -> None:
    found = [
        messages.Welcome("x.mov", "", "", "/", (), ("a",), (".gif",)),
        messages.StageDone(1, "read", [{"code": "x"}], final=False, understood=True),
        messages.FilmShown(1, True, 0.0, {}, {"marks": []}),
        messages.PictureSame(1, None),
        messages.PlacesMoved(1, 2, 0.5, [1.0]),
        messages.Plotted(1, "x", [[None, 1.0]]),
    ]
    for message in found:
        data = json.loads(sent(message))
        assert agrees(data, schema()["$defs"][data["kind"]]), data
        assert {item.name for item in fields(message)} == data.keys() - {"kind"}


# --- who may speak ------------------------------------------------------------------------------------------


def test_host_and_origin_are_checked() -> None:
    gate = Gate(8000)
    right = {"host": "127.0.0.1:8000"}
    assert gate.refused(right) == ""
    assert gate.refused({"host": "localhost:8000", "origin": "http://localhost:8000"}) == ""
    assert gate.refused({"host": "127.0.0.1:8000", "origin": "http://127.0.0.1:8000"}, socket=True) == ""
    for host in ("127.0.0.1", "127.0.0.1:80", "evil.example:8000", "127.0.0.1:8000.evil.example", ""):
        assert gate.refused({"host": host})
    for origin in ("http://evil.example", "https://127.0.0.1:8000", "http://127.0.0.1:8001", "null", ""):
        assert gate.refused({**right, "origin": origin})
    assert gate.refused(right, socket=True), "a socket without an origin is no page's"
    assert gate.knows(gate.token)
    assert not gate.knows(gate.token[:-1])
    assert not gate.knows("")
    assert not gate.knows("ä")
    assert Gate(8000).token != gate.token


def test_a_token_lasts_for_its_user_and_its_port(tmp_path: Path) -> None:
    record = tmp_path / "state" / "secret"
    token = lasting_token(8000, record)
    assert lasting_token(8000, record) == token
    assert lasting_token(8001, record) != token
    assert lasting_token(8000, tmp_path / "other") != token
    assert len(token) == 32
    assert record.stat().st_mode & 0o077 == 0
    record.write_text("short")
    assert lasting_token(8000, record) != lasting_token(8000, record), "a secret that is none is not used"


def test_the_policy_lets_nothing_out() -> None:
    text = policy("abc", 8000)
    assert "default-src 'none'" in text
    assert "http" not in text
    assert "script-src 'self';" in text
    assert "connect-src 'self' ws://127.0.0.1:8000 ws://localhost:8000;" in text
    assert "*" not in text


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../x.mov", "a/../../x.mov", "/etc/passwd", "~/x.mov", "C:\\x.mov", "a\\b.mov", "x\0.mov",
     "x\n.mov",
     " x.mov", "x.mov ", "x" * 300, "link/x.mov", "//server/share"],
)  # fmt: skip
def test_names_of_files_stay_below_the_folder(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "scripts"
    folder.mkdir()
    (tmp_path / "elsewhere").mkdir()
    (folder / "link").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutsideFolder):
        inside(folder, name)


def test_other_names_are_files_of_the_folder(tmp_path: Path) -> None:
    assert inside(tmp_path, "x.mov") == tmp_path.resolve() / "x.mov"
    assert inside(tmp_path, "out/é x-%d.png") == tmp_path.resolve() / "out" / "é x-%d.png"


def test_files_that_a_text_mentions_are_found_where_they_are(tmp_path: Path) -> None:
    folder = tmp_path / "scripts"
    folder.mkdir()
    (tmp_path / "secret.png").write_bytes(b"")
    (folder / "wheel.png").write_bytes(b"")
    mentioned = (folder / "wheel.png", folder / ".." / "secret.png", folder / "missing.png", Path("/etc/hostname"))
    away = outside_files(folder, mentioned)
    assert folder / ".." / "secret.png" in away
    assert not {folder / "wheel.png", folder / "missing.png"} & set(away)
