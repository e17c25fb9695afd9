"""Forms hold what they say, for every operation of the table, by mpmath with many digits."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from movimentum.certifying.forms import OF_OUTLINES, Forms, TimeForm, rational
from movimentum.expressions.operations import OPERATIONS
from tests.broad import broad

COUNT = 40
TRUTH: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "neg": lambda a: -a,
    "sqrt": mp.sqrt,
    "sind": lambda a: mp.sin(a * mp.pi / 180),
    "cosd": lambda a: mp.cos(a * mp.pi / 180),
    "tand": lambda a: mp.tan(a * mp.pi / 180),
    "asind": lambda a: mp.asin(a) * 180 / mp.pi,
    "acosd": lambda a: mp.acos(a) * 180 / mp.pi,
    "atand": lambda a: mp.atan(a) * 180 / mp.pi,
    "atan2d": lambda a, b: mp.atan2(a, b) * 180 / mp.pi,
    "abs": abs,
    "min": min,
    "max": max,
    "floor": mp.floor,
    "mod": lambda a, b: a - b * mp.floor(a / b),
    "exp": mp.exp,
    "ln": mp.log,
    "ease": lambda a: (lambda u: u * u * (3 - 2 * u))(min(max(a, mpf(0)), mpf(1))),
    "le": lambda a, b, v, w: v if a <= b else w,
}
NOT_HERE = OF_OUTLINES | {"pow", "table"}  # see test_tables, test_nearest
SMALL = {"asind", "acosd", "ease", "exp"}


def values(form: TimeForm, k: int, u: Any, within: float) -> Any:
    return mpf(float(form.c[k])) + mpf(float(form.s[k])) * u + mpf(float(form.r[k])) * mpf(within)


def some(rng: random.Random, name: str) -> TimeForm:
    size = 0.7 if name in SMALL else 10.0 ** rng.uniform(-2, 2.5)
    width = 10.0 ** rng.uniform(-12, 0)
    c = np.array([rng.uniform(-size, size) for _ in range(COUNT)])
    if rng.random() < 0.3:
        c = np.round(c)
    s = size * width * np.array([rng.uniform(-1, 1) for _ in range(COUNT)])
    r = size * width**2 * np.array([rng.uniform(0, 1) for _ in range(COUNT)])
    return TimeForm(c, s, np.zeros(COUNT) if rng.random() < 0.3 else r)


def holds(found: TimeForm, k: int, u: Any, true: Any) -> bool:
    c, s, r = (mpf(float(np.broadcast_to(part, COUNT)[k])) for part in (found.c, found.s, found.r))
    return bool(not mp.isfinite(r) or abs(true - (c + s * u)) <= r)


@broad("name", sorted(set(TRUTH)), every=3)
def test_what_an_operation_makes_holds_every_true_value(name: str) -> None:
    rng = random.Random(name)
    arity = next(row.arity for row in OPERATIONS if row.name == name)
    told = 0
    with mp.workdps(50), np.errstate(all="ignore"):
        for _ in range(6):
            arguments = [some(rng, name) for _ in range(arity)]
            found = Forms().call(name, None, arguments)
            for k in range(COUNT):
                for u in (mpf(-1), mpf(1), mpf(rng.uniform(-1, 1))):
                    given = [values(one, k, u, rng.choice([-1.0, 1.0, rng.uniform(-1, 1)])) for one in arguments]
                    try:
                        true = TRUTH[name](*given)
                    except (ZeroDivisionError, ValueError):
                        continue
                    if mp.im(true) != 0 or not mp.isfinite(true):
                        assert not np.isfinite(np.broadcast_to(found.r, COUNT)[k])
                        continue
                    assert holds(found, k, u, true), (name, [(a.c[k], a.s[k], a.r[k]) for a in arguments], u)
                    told += bool(np.isfinite(np.broadcast_to(found.r, COUNT)[k]))
    assert told > COUNT


def test_every_operation_is_tried() -> None:
    assert {row.name for row in OPERATIONS} == set(TRUTH) | NOT_HERE


@pytest.mark.parametrize("exponent", [-2.0, -0.5, 0.5, 1.4, 1.5, 2.0, 3.0, 7.0])
def test_powers(exponent: float) -> None:
    rng = random.Random(7)
    with mp.workdps(50), np.errstate(all="ignore"):
        for _ in range(4):
            one = some(rng, "pow")
            found = Forms().call("pow", exponent, [one])
            for k in range(COUNT):
                given = values(one, k, mpf(0.5), 1.0)
                if given > 0 or (exponent == int(exponent) and given != 0):
                    assert holds(found, k, mpf(0.5), given ** mpf(exponent))


def test_quarter_turns_are_exact() -> None:
    quarters = TimeForm(np.arange(-8.0, 9.0) * 90.0, np.zeros(17), np.zeros(17))
    sines = Forms().call("sind", None, [quarters])
    assert sines.c.tolist() == [0, 1, 0, -1] * 4 + [0]
    assert float(np.max(sines.r)) < 1e-299


def test_a_decimal_number_lies_in_its_form() -> None:
    for text in ("0.1", "40.1", "-3.3333333333333333333", "0.5", "12"):
        form = rational(Fraction(text))
        assert abs(Fraction(text) - Fraction(float(form.c[0]))) <= Fraction(float(form.r[0]))
    assert rational(Fraction("0.5")).r[0] == 0.0


def test_a_kink_is_no_jump_and_a_jump_is_told() -> None:
    zero, one = rational(Fraction(0)), rational(Fraction(1))
    across = TimeForm(np.array([0.3]), np.array([1.0]), np.array([0.0]))
    forms = Forms()
    forms.call("abs", None, [across])
    assert float(np.max(forms.jump)) < 1e-14
    forms.call("le", None, [across, zero, one, zero])
    assert float(np.max(forms.jump)) == pytest.approx(1.0)
