"""Contradictions among copies: what is offered changes one copy, or a pin, and every offer that is shown closes."""

import pytest

from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine
from movimentum.workflow.fixes import diagnosed, fixed
from tests.broad import broad

CHAIN = """.config(20, 500, 300);
{definition}
@0 {name}[{first}]{bar}.P = [50,100];
   .for k = {first}+1..{last} {{ {name}[k]{bar}.P = {name}[k-1]{bar}.{end}; {extra} }}
   {name}[{last}]{bar}.Q = [{x},100];
@2
"""


def offers(text):
    source = SourceText("scene.mov", text)
    found = [item for item in Engine(Choices()).revise(source).advice(300.0) if item.severity.value == "error"]
    assert [item.code for item in found] == ["constraint/conflict"]
    for fix in found[0].fixes:
        after = diagnosed(fixed(source, fix), Choices())
        assert after is not None
        assert not [item for item in after if item.severity.value == "error"], fix.title
    return source, found[0].fixes


@broad(
    ("definition", "bar"),
    [
        ("Link[k = {first}..{last}] : .bar P = [0,0] Q = P + [40,0];", ""),
        ("Link[{first} .. {last}]: .bar P=[0,0]\n  Q=P+[40,0] .color('red') ;", ""),
        (".part L(h, a) {{ Bar : .bar P=[0,h] Q=P+[a,0]; @0 Bar.angle=0;}}\nLink[{first}..{last}] : L(7,40);", ".Bar"),
        (".part L(a = 3) {{ Bar : .bar P=[0,0] Q=P+[a,0]; }}\nLink[i = {first}..{last}] : L(40) .at([3*i,0]);", ".Bar"),
    ],
    every=2,
)  # fmt: skip
@broad(("first", "last"), [(1, 4), (0, 2)], first=1)
def test_one_copy_is_made_longer_and_no_loop_is_emptied(definition, bar, first, last):
    count = last - first + 1
    values = {"first": first, "last": last}
    made = CHAIN.format(
        definition=definition.format(**values),
        name="Link",
        bar=bar,
        end="Q",
        extra="",
        x=50 + 40 * count + 60,
        **values,
    )
    source, found = offers(made)
    own = [fix for fix in found if f"`Link[{last}]" in fix.title and "100" in fix.title]
    assert own
    assert not any("Link[k]" in fix.title for fix in found)
    after = fixed(source, own[0]).text
    assert f"Link[{last}] :" in after or f"Link[i = {last}..{last}] :" in after


@pytest.mark.slow
def test_a_pin_at_the_anchor_that_closes():
    text = CHAIN.format(
        definition="Link[k = 1..4] : .bar P = [0,0] M = P + [20,0] Q = P + [40,0];",
        name="Link", bar="", first=1, last=4, end="M", extra="Link[k].angle = 0;", x=210,
    ).replace("[50,100];", "[50,100]; Link[1].angle = 0;")  # fmt: skip
    _, found = offers(text)
    assert "`Link[k].P = Link[k-1].Q` instead of `Link[k].P = Link[k-1].M`" in [fix.title for fix in found]


@pytest.mark.slow
def test_a_coupler_held_at_the_wrong_anchor():
    """A four-bar whose rocker is pinned to the coupler's point P and would reach its end C."""
    text = """.config(20, 300, 200);
Crank : .bar O=[100,60] A=O+[20,0];  Coupler : .bar A=[120,60] P=A+[20,0] C=A+[80,0];
Rocker : .bar B=[200,60] C=B+[0,60];
@0 Crank.O = [100,60]; Crank.angle = 90*.t; Coupler.A = Crank.A; Rocker.B = [200,60]; Rocker.C = Coupler.P;
@4
"""  # fmt: skip
    source = SourceText("scene.mov", text)
    found = [item for item in Engine(Choices()).revise(source).advice(300.0) if item.severity.value == "error"]
    titles = [fix.title for item in found for fix in item.fixes]
    assert "`Rocker.C = Coupler.C` instead of `Rocker.C = Coupler.P`" in titles
