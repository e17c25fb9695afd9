"""One mistake in a constant is one error: what is made from it, and what names that, is not reported as unknown."""

from __future__ import annotations

import itertools
import random

import pytest

import movimentum as mv

FAULTS = {
    "1/0": "kind/not-finite", ".sqrt(-1)": "kind/not-finite", "abc": "name/unknown-constant", ".t": "kind/not-constant",
    "other/(4-2^2)": "kind/not-finite",
}  # fmt: skip
MAKERS = [
    "A : .bar P=[0,0] Q=P+[R,0];",
    "A : .bar P=[0,0] Q=[R,0];",
    "A[k = 1..2] : .bar P=[0,0] Q=[k*R,0];",
    "A : .disc(R) P=[0,0] Q=[9,0];",
    ".part Part(k) { A : .bar P=[0,0] Q=[k,9]; @0 A.P = [1,1]; } C : Part(R);",
    ".part Part { A : .bar P=[0,0] Q=[R,9]; } C : Part();",
    ".part Part(k = R) { A : .bar P=[0,0] Q=[k,9]; } C[i = 1..2] : Part();",
    ".for j = 1..R { A[j] : .bar P=[0,0] Q=[9,9]; }",
    ".for j = 1..2 { A[j] : .bar P=[0,0] Q=[R,9]; @0 A[j].P = [j, 0]; }",
    "A[i = 1..R] : .bar P=[0,0] Q=[9,9];",
]
USES = [
    "{A}.P = [0,0];", "{A}.angle = 3;", "{A}.P = F.P;", "F.P = {A}.Q;", "{A}.P ~ [3,3] .speed(2);",
    ".claim {A}.Q.x = 3;", ".along(F.P, {A}.P, {A}.Q) = 0;", "x = {A}.P.x + {A}.Q.l;", ".goal {A}.P = [3,3];",
    "{A}.opacity = 0.5;", ".belt({A}, F) = 0;", "{A}.P.x > {A}.Q.x;",
]  # fmt: skip
DRAWN = ["", "Tr : .trace {A}.Q;", "Te : .label('a {{{A}.Q.x:.0f}}') at=[0,0];", "Di : .dimension {A}.P {A}.Q;"]


def scripts(count: int, seed: int) -> list[tuple[str, str]]:
    chance = random.Random(seed)
    made: list[tuple[str, str]] = []
    for (fault, code), maker in itertools.product(FAULTS.items(), MAKERS):
        for _ in range(count):
            name = "A"
            if "Part" in maker:
                name = "C[1].A" if "C[" in maker else "C.A"
            elif "A[" in maker:
                name = "A[1]"
            uses = " ".join(chance.sample(USES, chance.randint(1, 6))).replace("{A}", name)
            drawn = chance.choice(DRAWN).replace("{{", "{").replace("}}}", "}}").replace("{A}", name).replace("}}", "}")
            let = f".let R = {fault}; .let other = 1;"
            parts = [let, maker, "F : .disc(3) P=[0,0];", drawn]
            chance.shuffle(parts)
            made.append(("\n".join([*parts, f"@0 {uses}", "@1"]), code))
    return made


@pytest.mark.parametrize("seed", range(3))
def test_one_mistake_is_one_error(seed: int) -> None:
    wrong: list[tuple[str, list[str]]] = []
    for text, code in scripts(1, seed):
        with pytest.raises(mv.ScriptError) as caught:
            mv.loads(text)
        told = [item.code for item in caught.value.diagnostics if item.severity is mv.Severity.ERROR]
        if told != [code]:
            wrong.append((text, [item.message for item in caught.value.diagnostics]))
    assert wrong == []


@pytest.mark.parametrize("value", ["abc", "1/0", ".t"])
def test_a_wrong_setting_is_one_error(value: str) -> None:
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads(".let R=10; A:.bar P=[0,0] Q=P+[R,0]; @0 A.P=[0,0]; A.angle=3; @1", R=value)
    assert len(caught.value.diagnostics) == 1


def test_other_mistakes_are_told_beside_it() -> None:
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads(".let R=1/0; A:.bar P=[0,0] Q=P+[R,0]; B:.bar P=[0,0] Q=[9,0]; @0 B.P=Bb.P; B.S=[0,0]; @1")
    told = [item.code for item in caught.value.diagnostics]
    assert told == ["kind/not-finite", "name/unknown-thing", "name/unknown-anchor"]
