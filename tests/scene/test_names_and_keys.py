"""What names stand for, keys, kinds, and the way back to the script's words."""

from __future__ import annotations

from fractions import Fraction

import pytest

from movimentum.expressions import Expr, clock, symbol, walk
from movimentum.scene.model import (
    AnchorCoordinate,
    AnchorRef,
    Anonymous,
    Ending,
    Relation,
    ThingAngle,
    ThingProperty,
    VariableComponent,
)
from movimentum.scene.names import symbol_name
from tests.understand import BAR, codes_of, constraint_of, scene_of


def coordinates(thing: int, anchor: int) -> tuple[Expr, Expr]:
    return symbol(AnchorCoordinate(thing, anchor, 0)), symbol(AnchorCoordinate(thing, anchor, 1))


@pytest.mark.parametrize(
    "name",
    ["x", "y", "z", "l", "link", "length", "line", "t", "T", "iv", "a", "r", "color", "sink", "opacity", "i", "sin"],
)
def test_an_anchor_of_any_name_is_the_anchor(name: str) -> None:
    scene = scene_of(
        f"B : .bar {name} = [1,2] Q = {name} + [3,4];\n@0 B.{name} = [0,0]; B.{name}.x = 0; B.{name}.l = 0;"
    )
    constraint = constraint_of(scene, f"B.{name}")
    assert constraint.left == coordinates(0, 0)
    assert constraint.anchor == AnchorRef(0, 0)
    assert constraint_of(scene, f"B.{name}.x").left == (symbol(AnchorCoordinate(0, 0, 0)),)
    assert scene.things[0].anchors[1].local == (4.0, 6.0)
    assert constraint_of(scene, f"B.{name}.l").anchor is None


def test_the_angle_of_a_thing_and_an_anchor_called_angle() -> None:
    plain = scene_of(BAR + "@0 Bar.angle = 1; Bar.a = 2;")
    assert [item.key for item in plain.constraints()] == ["Bar.angle"] * 2
    taken = scene_of("Bar : .bar angle = [0,0] Q = [1,0];\n@0 Bar.angle = [1,1]; Bar.a = 2;")
    assert constraint_of(taken, "Bar.angle").left == coordinates(0, 0)
    assert constraint_of(taken, "Bar.a").left == (symbol(ThingAngle(0)),)
    swapped = scene_of("Bar : .bar a = [0,0] Q = [1,0];\n@0 Bar.a = [1,1]; Bar.angle = 2;")
    assert constraint_of(swapped, "Bar.a").left == coordinates(0, 0)
    assert constraint_of(swapped, "Bar.angle").left == (symbol(ThingAngle(0)),)


def test_properties() -> None:
    scene = scene_of(BAR + "@0 Bar.opacity = 0.5; Bar.red = 1; Bar.green = 2; Bar.blue = 3;")
    found = [item.left[0].payload for item in scene.constraints()]
    assert found == [ThingProperty(0, name) for name in ("opacity", "red", "green", "blue")]
    assert [scene.things[0].undriven(name) for name in ("opacity", "red")] == [1.0, 40.0]


def test_a_sprite_has_a_tint_which_changes_nothing_by_itself() -> None:
    scene = scene_of("Wheel : 'wheel.png' C = [0,0];\n@0 Wheel.red = 255*.t; Wheel.green = 1; Wheel.blue = Wheel.red;")
    assert [item.left[0].payload for item in scene.constraints()] == [
        ThingProperty(0, name) for name in ("red", "green", "blue")
    ]
    assert scene.things[0].undriven("opacity") == 1.0
    assert [scene.things[0].undriven(name) for name in ("red", "green", "blue")] == [255.0, 255.0, 255.0]


SAME_KEYS = [
    ("Bar.Q", "(Bar.Q)", "((Bar.Q))", "/* the */ Bar.Q // end\n"),
    ("(Bar.P - Bar.Q).l", "(Bar.P-Bar.Q).length", "((Bar.P) - (Bar.Q)).l"),
    (".a(u, v)", ".angle(u,v)"),
    ("Bar.a", "Bar.angle"),
    ("2*x", "2.0 * x", "(2) * x", "2e0*x"),
    ("x + y - z", "(x + y) - z", "x + (y - z)", "x+y-z"),
    ("x - y + z", "x - (y - z)"),
    ("x*y*z", "x*(y*z)", "(x*y)*z"),
    ("x*y/z", "x*(y/z)"),
    ("u.r(30)", "u.rotate(30)"),
    (".q(x)", ".sqrt(x)"),
    ("{x : 1 > 2 : 3}", "{ x:1>2:3 }"),
]


@pytest.mark.parametrize("spellings", SAME_KEYS, ids=lambda spellings: spellings[0])
def test_keys_compare_by_meaning(spellings: tuple[str, ...]) -> None:
    scene = scene_of(BAR + "@0 u = Bar.P; v = Bar.P; @1 " + " ".join(f"{spelling} = _;" for spelling in spellings))
    keys = {item.key for item in scene.steps[1].statements}
    assert len(keys) == 1, keys


DIFFERENT_KEYS = [
    "Bar.Q",
    "Bar.P",
    "Bar.Q.x",
    "Bar.Q.y",
    "x",
    "y",
    "X",
    "x - y",
    "y - x",
    "x/y*z",
    "x/(y*z)",
    "(x^2)^2",
    "x^2^2",
    "2*x",
    "-x",
]


def test_different_keys_stay_different() -> None:
    scene = scene_of(BAR + "@0 " + " ".join(f"{key} = _;" for key in DIFFERENT_KEYS))
    assert len({item.key for item in scene.steps[0].statements}) == len(DIFFERENT_KEYS)


def test_relations() -> None:
    scene = scene_of("@0 x = 1; x ~ 2; x < 3; x <= 4; x > 5; x >= 6;")
    found = [(item.relation, item.strict) for item in scene.constraints()]
    equal, wish, below, above = Relation.EQUAL, Relation.WISH, Relation.BELOW, Relation.ABOVE
    assert found == [(equal, False), (wish, False), (below, True), (below, False), (above, True), (above, False)]
    ends = scene_of("@0 x = 1; @1 x = _; x ~ _; x < _; x <= _; x > _; x >= (_);").steps[1].statements
    assert [item.relation for item in ends if isinstance(item, Ending)] == [equal, wish, below, below, above, above]


def test_a_blank_elsewhere_ends_nothing() -> None:
    scene = scene_of(BAR + "@0 x = -_; y = _ + _; Bar.P = [_, _]; _ = 3;")
    assert len(scene.constraints()) == 4
    numbers = [
        node.payload.number
        for item in scene.constraints()
        for node in walk(*item.left, *item.right)
        if node.op == "symbol" and isinstance(node.payload, Anonymous)
    ]
    assert sorted(numbers) == list(range(6))


def test_clocks() -> None:
    scene = scene_of("@1/2 x = .t; @+3 y = .T + .iv; z = .i(.t) + .d(x);")
    assert constraint_of(scene, "x").right == (clock(Fraction(1, 2)),)
    y = constraint_of(scene, "y")
    assert {(node.op, node.payload) for node in walk(*y.right) if not node.args} == {
        ("clock", Fraction(0)),
        ("lifetime", y.number),
    }
    z = constraint_of(scene, "z").right[0]
    assert {(node.op, node.payload) for node in walk(z) if node.op in ("integral", "derivative", "clock")} == {
        ("integral", Fraction(7, 2)),
        ("clock", Fraction(7, 2)),
        ("derivative", None),
    }


def test_an_integral_of_a_constant_is_no_constant() -> None:
    scene = scene_of("@2 v = [1,2] + .i(w + .i([0,-300])); w = .i([1,1]) - .d([1,1]); x = .i(0);")
    x, y = constraint_of(scene, "v").right
    assert {node.payload for node in walk(x, y) if node.op == "integral"} == {Fraction(2)}
    assert constraint_of(scene, "x").right[0].value == 0.0
    assert constraint_of(scene, "w").right[0].op == "integral"


def test_variables_and_their_kinds() -> None:
    scene = scene_of(
        BAR + "@0 b = a + c; w = 2*v; v = _ + Bar.P; n = m; k*v = u; s = {e : f > 1 : 2}; p.x = 1; q = .i(p); b = 1;"
    )
    kinds = {name: item.is_vector for name, item in scene.variables.items()}
    assert list(kinds) == ["b", "a", "c", "w", "v", "n", "m", "k", "u", "s", "e", "f", "p", "q"]
    assert {name for name, vector in kinds.items() if vector} == {"w", "v", "u", "p", "q"}
    assert constraint_of(scene, "w").left == (symbol(VariableComponent("w", 0)), symbol(VariableComponent("w", 1)))
    assert constraint_of(scene, "n").left == (symbol(VariableComponent("n", None)),)


def test_the_kind_of_a_factor_may_come_from_anywhere() -> None:
    later = scene_of(BAR + "@0 Bar.P = a*b*c; b = Bar.Q;")
    assert [item.is_vector for item in later.variables.values()] == [False, True, False]
    result = scene_of("@0 x = a*b; x = 3; y = c*c;")
    assert not any(item.is_vector for item in result.variables.values())
    division = scene_of(BAR + "@0 Bar.P = a/b;")
    assert [item.is_vector for item in division.variables.values()] == [True, False]
    blank = scene_of(BAR + "@0 Bar.P = _*u; u = Bar.Q;")
    assert blank.variables["u"].is_vector


def test_mentioned_on_either_side_but_not_by_endings() -> None:
    things = "".join(f"B{i} : .bar P = [0,0] Q = [1,0];\n" for i in range(6)) + "L : .line B0.P B1.P;\n"
    scene = scene_of(
        things + "@0 B1.P = [0,0]; @1 x = B2.angle; B3.P = _; @2 B0.opacity > 0; B1.Q ~ B4.P - B4.P; L.opacity = 1;"
    )
    assert scene.mentioned == {1: 0, 2: 1, 0: 2, 4: 2, 6: 2}


def test_every_problem_is_told_at_once() -> None:
    codes = codes_of(
        "A : .bar P = [0,0];\nB : .disc(-1) C = [0,0] .foo;\n@0 A.Q = [0,0]; C.P = 1; A.P = 3; x = 1/0;\n@-1"
    )
    assert set(codes) == {
        "kind/anchors", "kind/out-of-range", "syntax/unknown-option", "name/unknown-anchor", "name/unknown-thing",
        "kind/mismatch", "kind/not-finite", "timeline/order",
    }  # fmt: skip
    assert len(codes) == 8


def test_words_of_some_things() -> None:
    scene = scene_of(BAR + "@0 v = Bar.Q;")
    assert symbol_name(scene, constraint_of(scene, "v").right[1].payload) == "Bar.Q.y"
    assert symbol_name(scene, AnchorCoordinate(0, 1, 1)) == "Bar.Q.y"
    assert symbol_name(scene, ThingAngle(0)) == "Bar.angle"
    assert symbol_name(scene, "anything") == "anything"
