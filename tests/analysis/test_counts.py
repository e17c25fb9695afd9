"""Only what a scene requires is modelled: counted in what `check --format json` says of each step."""

import json

import pytest

from tests.command import movimentum

THINGS = """Crank : .bar O=[0,0] P=[35,0];  Rocker : .bar O=[90,0] P=[90,60];
Coupler : .bar A=[35,0] B=[90,60]{more};"""
STATEMENTS = (
    """Crank.O=[0,0]; Crank.angle=90*.t; Rocker.O=[90,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P; Coupler.angle ~ 0;"""
)


def counts(tmp_path, script):
    path = tmp_path / "script.mov"
    path.write_text(script)
    done = movimentum("check", path, "--format", "json")
    assert done.returncode == 0, done.stdout + done.stderr
    step = json.loads(done.stdout)["steps"][0]
    return {key: value for key, value in step.items() if isinstance(value, int | list) and key != "duration"}


def script(more="", things="", statements=""):
    return f".config(24);\n{THINGS.format(more=more)}\n{things}\n@0 {STATEMENTS} {statements}\n@1\n"


@pytest.mark.parametrize(
    "added",
    [
        {"more": " C=[50,80] D=[60,20]"},  # anchors that nothing mentions
        {"more": " C=[50,80,0]"},  # a z that nothing mentions
        {"things": "House : .bar p=[0,0] q=[10,0] r=[10,10];"},  # a part that stands still
        {"things": "Note : .label('text') p=[3,4];  Follows : .line Crank.P Rocker.P;"},
        {"statements": "x = _;"},  # a variable that is not used
        {"things": " ".join(f"S{i} : .bar a=[{i},0] b=[{i},5];" for i in range(1000))},
    ],
    ids=["anchor", "z", "still part", "label and line", "unused variable", "a thousand still things"],
)
def test_what_is_not_needed_adds_nothing(tmp_path, added):
    plain, more = counts(tmp_path, script()), counts(tmp_path, script(**added))
    print(plain, more)
    assert more == plain
