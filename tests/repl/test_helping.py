"""Help by what is wrong."""

import pytest

from movimentum.repl.helping import TROUBLES, help_text
from movimentum.repl.shell import COMMANDS


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ("jumps", "it jumps"),
        ("it does not move", "it does not move"),
        ("doesn't move", "it does not move"),
        ("move", "it does not move"),
        ("it is not where I want it", "it is not where I want it"),
        ("wrong place", "it is not where I want it"),
        ("it contradicts itself", "it contradicts itself"),
        ("contradiction", "it contradicts itself"),
        ("stops", "it stops halfway"),
        ("worked before", "it worked before"),
    ],
)
def test_help_by_trouble(asked, told):
    assert help_text(COMMANDS, asked).splitlines()[0] == told


def test_help_alone_begins_with_the_troubles_and_names_every_command():
    text = help_text(COMMANDS, "")
    lines = text.splitlines()
    assert [line.strip().startswith(t.it) for line, t in zip(lines[1:], TROUBLES, strict=False)] == [True] * len(
        TROUBLES
    )
    for command in COMMANDS.values():
        assert f"\n  {command.usage} " in text


def test_what_is_neither_is_none_and_commands_come_first():
    assert help_text(COMMANDS, "banana") is None
    assert help_text(COMMANDS, "free").startswith("free ")
