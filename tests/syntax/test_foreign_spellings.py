"""What people write first, from other languages: the first message's fix makes of it what they meant."""

import pytest

import movimentum as mv
from movimentum.source import edited

FRAME = """// a crank
.let r = 40;
Crank : .disc(9) C = [0,0] P = C + [r,0];
@0 Crank.C = [50,60]; Crank.angle = 90*.t;
@4
"""
SPELLINGS = {
    "a comment of Python": ("// a crank", "# a crank", None),
    "a colour of CSS": ("[r,0];", "[r,0] .color(#f80);", "[r,0] .color('#f80');"),
    "a short colour in another place": ("[r,0];", "[r,0] .edge( #ff8800 );", "[r,0] .edge( '#ff8800' );"),
    "an assignment": ("Crank.C = ", "Crank.C := ", None),
    "an assignment of a number": ("Crank.angle = 90", "Crank.angle := 90", None),
    "a vector without a comma": ("[50,60]", "[50 60]", "[50, 60]"),
    "a vector of names without a comma": ("[50,60]", "[r 2*r]", "[r, 2*r]"),
    "an arrow for at least": ("90*.t;", "90*.t; Crank.P.x => -99;", "90*.t; Crank.P.x >= -99;"),
    "an arrow for at most": ("90*.t;", "90*.t; Crank.P.x =< 999;", "90*.t; Crank.P.x <= 999;"),
    "seconds": ("@4\n", "@4s\n", None),
    "seconds before a statement": ("@4\n", "@4 sec Crank.angle = 9;\n", "@4 Crank.angle = 9;\n"),
    "milliseconds of a later step": ("@4\n", "@+4ms\n", "@+4\n"),
    "a name with a hyphen": ("Crank", "Crank-pin", "Crank_pin"),
    "a name that begins with a digit": ("Crank", "1st", "st_1"),
}


def changed(old, new):
    assert old in FRAME
    return FRAME.replace(old, new)


@pytest.mark.parametrize("name", SPELLINGS)
def test_the_first_fix_writes_what_was_meant(name):
    right, wrong, written = SPELLINGS[name]
    with pytest.raises(mv.ScriptError) as raised:
        mv.loads(changed(right, wrong))
    first = raised.value.diagnostics[0]
    assert first.helps, name
    fixed = edited(changed(right, wrong), first.fixes[0].edits)
    assert "".join(fixed.split()) == "".join(changed(right, written or right).split())
    assert not [item for item in mv.loads(fixed).diagnostics if str(item.severity) == "error"]


@pytest.mark.parametrize(
    "value", ["if .t < 1 then 3 else 4", "[if .t > 2 : 3, 4].x", "(if (.t < 1) 3 else 4)", "2*if .t>1"]
)
def test_a_condition_is_told_as_a_value_in_braces(value):
    with pytest.raises(mv.ScriptError) as raised:
        mv.loads(changed("90*.t", value))
    assert any("{ .t < 3 : 4; 5 }" in text for text in raised.value.diagnostics[0].helps)


@pytest.mark.parametrize("place", ["Crank : .disc(w)", "Crank : .disc(9) .width(2*w)", "Crank : .disc(9) D = [3, w]"])
def test_a_name_where_a_number_is_needed_is_no_constant_yet(place):
    with pytest.raises(mv.ScriptError) as raised:
        mv.loads(changed("Crank : .disc(9)", place))
    first = raised.value.diagnostics[0]
    assert first.code == "kind/not-constant"
    assert first.helps == ("`.let w = …;` makes a constant",)
