"""What the server answers to somebody who writes: completion, what a name is, other names, layout."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from movimentum.editing.about import Facts
from movimentum.editing.completion import proposals
from movimentum.editing.project import Project
from movimentum.formatting.columns import formatted
from movimentum.messages import explanations
from movimentum.source import Edit, SourceText, Span, edited
from movimentum.studio import messages as m
from movimentum.studio.questions import Assistant
from movimentum.studio.worker import Worker
from tests.studio.scripts import FOUR_BAR


class Desk:
    """An assistant of a script; nothing is solved."""

    def __init__(self, path: Path) -> None:
        self.said: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.worker = Worker(str(path), path.parent, self.said.put)
        self.assistant = Assistant(self.worker, self.said.put)
        self.rev = 0

    def type(self, text: str) -> None:
        self.rev += 1
        self.assistant.typed(m.TextTyped(self.rev, text, 0.0))

    def ask(self, message: Any) -> Any:
        assert self.assistant.take(message)
        return self.said.get(timeout=20.0)


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Callable[..., Desk]]:
    made: list[Desk] = []

    def begin(text: str, name: str = "drawn.mov") -> Desk:
        made.append(Desk(tmp_path / name))
        made[-1].type(text)
        return made[-1]

    yield begin
    for each in made:
        each.assistant.close()
        each.worker.close()


def changed(text: str, told: m.TextEdited) -> str:
    return edited(text, [Edit(Span(each["from"], each["to"]), each["text"]) for each in told.edits])


def test_proposals_are_those_of_the_language_server(desk: Callable[..., Desk]) -> None:
    found = desk(FOUR_BAR)
    project = Project(lambda _path: FOUR_BAR)
    for place in range(0, len(FOUR_BAR) + 1, 7):
        told = found.ask(m.ProposalsRequest(1, place))
        wanted = proposals(project, "drawn.mov", place)
        assert [(each["label"], each["text"]) for each in told.proposals] == [(e.label, e.text) for e in wanted], place
        assert all(told.span == (each.span.start, each.span.end) for each in wanted)


def test_no_prefix_of_a_script_breaks_an_answer(desk: Callable[..., Desk]) -> None:
    found = desk("")
    text = FOUR_BAR + "L : .label('{Crank.angle:.1f} \U0001f642') O = [0, 0] .color('r'); P : 'x"
    for end in [*range(0, len(text), 11), len(text)]:
        found.type(text[:end])
        for message, kind in (
            (m.ProposalsRequest(found.rev, end), m.ProposalsReply),
            (m.AboutRequest(found.rev, end // 2), m.AboutReply),
            (m.NamingRequest(found.rev, end), m.NamingReply),
            (m.RenameRequest(found.rev, end, "Other"), m.TextEdited),
            (m.FormatRequest(found.rev), m.TextEdited),
        ):
            assert isinstance(found.ask(message), kind), end


@pytest.mark.parametrize("place", [-5, 10**9])
def test_places_that_are_none(desk: Callable[..., Desk], place: int) -> None:
    found = desk(FOUR_BAR)
    assert found.ask(m.ProposalsRequest(1, place)).proposals == []
    assert found.ask(m.AboutRequest(1, place)).written == ""
    assert found.ask(m.NamingRequest(1, place)).words
    assert found.ask(m.RenameRequest(1, place, "X")).words


def test_a_question_about_an_older_text_is_not_answered(desk: Callable[..., Desk]) -> None:
    found = desk(FOUR_BAR)
    found.type(FOUR_BAR + "\n")
    for stale in (m.ProposalsRequest(1, 0), m.AboutRequest(1, 0), m.NamingRequest(1, 0), m.FormatRequest(1)):
        assert found.assistant.take(stale)
    assert found.ask(m.ProposalsRequest(2, 0)).rev == 2
    assert found.said.empty()


def test_what_a_name_is_and_what_is_known_of_it(desk: Callable[..., Desk]) -> None:
    found = desk(FOUR_BAR)
    place = FOUR_BAR.index("Crank.B") + 1
    told = found.ask(m.AboutRequest(1, place))
    assert FOUR_BAR[slice(*told.span)] == "Crank"
    assert told.written.startswith("Crank : .bar")
    found.worker.facts = lambda name: Facts("90°", (f"8: {name}.angle = 180*.t",))
    assert "At the beginning: `Crank` = 90°" in found.ask(m.AboutRequest(1, place)).paragraphs


def test_every_code_of_a_message_is_explained(desk: Callable[..., Desk]) -> None:
    here = desk(FOUR_BAR)
    for code, each in explanations().items():
        told = here.ask(m.MeaningRequest(here.rev, code))
        assert (told.code, told.text) == (code, each.text)
    assert here.ask(m.MeaningRequest(here.rev, "no/such-code")).text == "Nothing is written about this code."


def test_another_name_everywhere(desk: Callable[..., Desk]) -> None:
    found = desk(FOUR_BAR)
    place = FOUR_BAR.index("Coupler.B") + 2
    named = found.ask(m.NamingRequest(1, place))
    assert named.name == "Coupler"
    assert {FOUR_BAR[slice(*span)] for span in named.spans} == {"Coupler"}
    assert len(named.spans) == FOUR_BAR.count("Coupler")
    told = found.ask(m.RenameRequest(1, place, "Link"))
    assert changed(FOUR_BAR, told) == FOUR_BAR.replace("Coupler", "Link")
    for name, words in (("Crank", "already"), ("2x", "not a name"), ("", "not a name"), ("a b", "not a name")):
        told = found.ask(m.RenameRequest(1, place, name))
        assert words in told.words, name
        assert not told.edits


def test_a_name_that_another_file_has_stays(desk: Callable[..., Desk], tmp_path: Path) -> None:
    (tmp_path / "leg.mov").write_text(".let long = 40;\n", encoding="utf-8")
    text = ".include 'leg.mov';\nA : .bar P = [0, 0]  Q = P + [long, 0];\n"
    found = desk(text)
    told = found.ask(m.RenameRequest(1, text.index("long"), "wide"))
    assert "leg.mov" in told.words
    assert not told.edits
    assert (tmp_path / "leg.mov").read_text(encoding="utf-8") == ".let long = 40;\n"


def test_files_elsewhere_are_neither_read_nor_listed(desk: Callable[..., Desk], tmp_path: Path) -> None:
    (tmp_path / "secret.mov").write_text(".let hidden = 40;\n", encoding="utf-8")
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "own.mov").write_text("", encoding="utf-8")
    text = ".include '../secret.mov';\n.let x = hidd"
    found = desk(text, "inner/drawn.mov")
    assert found.ask(m.ProposalsRequest(1, len(text))).proposals == []
    for begun, wanted in (("../", []), ("/", []), ("", ["own.mov"])):
        found.type(f".include '{begun}")
        told = found.ask(m.ProposalsRequest(found.rev, len(f".include '{begun}")))
        assert [each["label"] for each in told.proposals] == wanted


def test_the_layout_is_that_of_fmt(desk: Callable[..., Desk]) -> None:
    text = FOUR_BAR.replace(" = ", "=").replace(";  ", ";\t")
    found = desk(text)
    told = found.ask(m.FormatRequest(1))
    assert changed(text, told) == formatted(SourceText("x.mov", text)) != text
    found.type(changed(text, told))
    told = found.ask(m.FormatRequest(2))
    assert (told.edits, bool(told.words)) == ([], True)
    found.type("A : .bar\n@0 A.P = ;")
    told = found.ask(m.FormatRequest(3))
    assert not told.edits
    assert "line 2" in told.words
