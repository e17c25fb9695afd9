"""Numbers that know how they were computed, and that the drawing code uses like floats and arrays.

A `LiveNumber` has a value and the expression that gives it. Arithmetic on it, and NumPy functions on arrays of it, make
expressions; a comparison is a number, 1 or 0, by which `numpy.where` chooses. Where only a plain number will do, it
acts as one, and `settled` records that its value was used.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Any

import numpy as np

from movimentum.expressions import ONE, ZERO, Expr, add, call, const, div, mul, neg, power, sub

_LOOKED_AT: ContextVar[list[bool] | None] = ContextVar("_LOOKED_AT", default=None)


@contextmanager
def settled() -> Generator[list[bool]]:
    """Within it, numbers that are taken as plain ones are counted: the list is empty where there is none."""
    found: list[bool] = []
    token = _LOOKED_AT.set(found)
    try:
        yield found
    finally:
        _LOOKED_AT.reset(token)


def _look() -> None:
    seen = _LOOKED_AT.get()
    if seen is not None:
        seen.append(True)


@contextmanager
def spelled() -> Generator[list[tuple[LiveNumber, str]]]:
    """Within it, a live number that is written is a mark, chr(`FIRST_MARK` + n), for row n of the list, and so many
    `FILLING` behind it that the text is as long as it is now.
    """
    found: list[tuple[LiveNumber, str]] = []
    token = _WRITTEN.set(found)
    try:
        yield found
    finally:
        _WRITTEN.reset(token)


_WRITTEN: ContextVar[list[tuple[LiveNumber, str]] | None] = ContextVar("_WRITTEN", default=None)
FIRST_MARK, FILLING = 0xF0000, "\uf8ff"


class LiveNumber:
    """A number with its ``value`` now, and the expression ``expr`` that gives it at other times."""

    __slots__ = ("expr", "value")

    def __init__(self, expr: Expr, value: float) -> None:
        self.expr, self.value = expr, value

    def __repr__(self) -> str:
        return f"LiveNumber({self.value:g})"

    def __float__(self) -> float:
        _look()
        return self.value

    def written(self, sample: str, spec: str) -> str:
        """It in a text, by Python's format ``spec``; it is ``sample`` now."""
        found = _WRITTEN.get()
        if found is None:
            return sample
        found.append((self, spec))
        return chr(FIRST_MARK + len(found) - 1) + FILLING * (len(sample) - 1)

    def __round__(self, places: int | None = None) -> int:
        """How many hatches, say: a count stays what it is now."""
        return round(self.value)

    def __bool__(self) -> bool:
        return self.value != 0.0

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return _ufunc(ufunc, method, inputs, options)

    def __add__(self, other: Any) -> Any:
        return _operated(np.add, self, other)

    def __radd__(self, other: Any) -> Any:
        return _operated(np.add, other, self)

    def __sub__(self, other: Any) -> Any:
        return _operated(np.subtract, self, other)

    def __rsub__(self, other: Any) -> Any:
        return _operated(np.subtract, other, self)

    def __mul__(self, other: Any) -> Any:
        return _operated(np.multiply, self, other)

    def __rmul__(self, other: Any) -> Any:
        return _operated(np.multiply, other, self)

    def __truediv__(self, other: Any) -> Any:
        return _operated(np.divide, self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return _operated(np.divide, other, self)

    def __pow__(self, other: Any) -> Any:
        return _operated(np.power, self, other)

    def __and__(self, other: Any) -> Any:
        return _operated(np.logical_and, self, other)

    def __rand__(self, other: Any) -> Any:
        return _operated(np.logical_and, other, self)

    def __or__(self, other: Any) -> Any:
        return _operated(np.logical_or, self, other)

    def __neg__(self) -> LiveNumber:
        return LiveNumber(neg(self.expr), -self.value)

    def __abs__(self) -> LiveNumber:
        return _FUNCTIONS["absolute"](self)

    def __invert__(self) -> LiveNumber:
        return _FUNCTIONS["logical_not"](self)

    def __lt__(self, other: Any) -> Any:
        return _operated(np.less, self, other)

    def __le__(self, other: Any) -> Any:
        return _operated(np.less_equal, self, other)

    def __gt__(self, other: Any) -> Any:
        return _operated(np.greater, self, other)

    def __ge__(self, other: Any) -> Any:
        return _operated(np.greater_equal, self, other)


class LiveArray(np.ndarray):
    """An array of live and plain numbers."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return _ufunc(ufunc, method, inputs, options)

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if function is np.where:
            return _each(_where, *args)
        if function is np.nan_to_num:
            return args[0]
        if function is np.clip:
            return np.minimum(np.maximum(args[0], args[1]), args[2])
        return _viewed(super().__array_function__(function, [np.ndarray for _ in types], args, kwargs))

    def astype(self, *args: Any, **kwargs: Any) -> Any:
        """Itself: its numbers have the type that they have."""
        return self


def live_array(values: Any) -> Any:
    """An array of numbers, nested as the sequences are."""
    return np.array(values, dtype=object).view(LiveArray)


def number(value: Any) -> LiveNumber:
    """A number as a live one."""
    return value if isinstance(value, LiveNumber) else LiveNumber(const(float(value)), float(value))


def _operated(ufunc: Any, a: Any, b: Any) -> Any:
    if hasattr(a, "dtype") or hasattr(b, "dtype"):
        return _ufunc(ufunc, "__call__", (a, b), {})
    return _FUNCTIONS[ufunc.__name__](a, b)


def _viewed(found: Any) -> Any:
    if isinstance(found, list | tuple):
        parts: Any = found  # pyright: ignore[reportUnknownVariableType]
        return [_viewed(one) for one in parts]
    if getattr(getattr(found, "dtype", None), "kind", "") != "O":
        return found
    return found.view(LiveArray) if found.ndim else found.item()


def _each(function: Callable[..., Any], *inputs: Any) -> Any:
    plain = [np.asarray(each, None if hasattr(each, "shape") else object) for each in inputs]
    made: Any = np.frompyfunc(function, len(inputs), 1)
    return _viewed(np.asarray(made(*plain), dtype=object))


def _ufunc(ufunc: Any, method: str, inputs: Sequence[Any], options: dict[str, Any]) -> Any:
    function = _FUNCTIONS.get(ufunc.__name__)
    if function is None:
        return NotImplemented
    if method == "__call__":
        return _each(function, *inputs)
    if method == "reduce":
        axis: Any = options.get("axis", 0)
        kept = bool(options.get("keepdims", False))
        values = np.asarray(inputs[0], dtype=object)
        axes: list[int] = list(range(values.ndim)) if axis is None else np.atleast_1d(axis).tolist()
        for one in sorted((one % values.ndim for one in axes), reverse=True):
            rows = np.moveaxis(values, one, 0)
            found: Any = functools.reduce(np.frompyfunc(function, 2, 1), list(rows))
            values = np.expand_dims(np.asarray(found, dtype=object), one) if kept else np.asarray(found, dtype=object)
        return _viewed(values)
    return NotImplemented


def _lifted(plain: Callable[..., Any], made: Callable[..., Expr]) -> Callable[..., Any]:
    """A function of plain numbers, and what it is of expressions."""

    def function(*args: Any) -> Any:
        values = [each.value if isinstance(each, LiveNumber) else each for each in args]
        with np.errstate(all="ignore"):
            value = plain(*values)
        if not any(isinstance(each, LiveNumber) for each in args):
            return value
        return LiveNumber(made(*(number(each).expr for each in args)), float(value))

    return function


def _one(plain: Callable[..., Any], made: Callable[[Expr], Expr]) -> Callable[..., Any]:
    return _lifted(plain, made)


def _two(plain: Callable[..., Any], made: Callable[[Expr, Expr], Expr]) -> Callable[..., Any]:
    return _lifted(plain, made)


_DEGREES = const(180.0 / math.pi)
_RADIANS = const(math.pi / 180.0)


def _not(a: Expr) -> Expr:
    return sub(ONE, a)


def _le(a: Expr, b: Expr) -> Expr:
    return call("le", a, b, ONE, ZERO)


def _most(a: Expr, b: Expr) -> Expr:
    return call("le", a, b, b, a)


def _least(a: Expr, b: Expr) -> Expr:
    return call("le", a, b, a, b)


def _where(test: Any, a: Any, b: Any) -> Any:
    if not isinstance(test, LiveNumber):
        return a if test else b
    if a is b:
        return a
    x, y = number(a), number(b)
    return LiveNumber(call("le", test.expr, const(0.5), y.expr, x.expr), (x if test.value else y).value)


def _hypot(a: Expr, b: Expr) -> Expr:
    return call("sqrt", add(mul(a, a), mul(b, b)))


def _rint(a: Expr) -> Expr:
    return call("floor", add(a, const(0.5)))


def _sinh(a: Expr) -> Expr:
    return div(sub(call("exp", a), call("exp", neg(a))), const(2.0))


def _power(a: Any, b: Any) -> Any:
    exponent = float(b)
    return _one(partial(_raised, exponent), lambda e: power(e, exponent))(a)


def _raised(exponent: float, a: Any) -> Any:
    return a**exponent


def _same(a: Any) -> Any:
    return a


def _known(a: Any) -> bool:
    """Whether a number is finite: what is drawn is."""
    del a
    return True


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "add": _two(np.add, add),
    "subtract": _two(np.subtract, sub),
    "multiply": _two(np.multiply, mul),
    "divide": _two(np.divide, div),
    "negative": _one(np.negative, neg),
    "positive": _same,
    "power": _power,
    "square": _one(np.square, lambda a: mul(a, a)),
    "absolute": _one(np.absolute, lambda a: call("abs", a)),
    "sqrt": _one(np.sqrt, lambda a: call("sqrt", a)),
    "hypot": _two(np.hypot, _hypot),
    "sin": _one(np.sin, lambda a: call("sind", mul(_DEGREES, a))),
    "cos": _one(np.cos, lambda a: call("cosd", mul(_DEGREES, a))),
    "tan": _one(np.tan, lambda a: call("tand", mul(_DEGREES, a))),
    "arctan": _one(np.arctan, lambda a: mul(_RADIANS, call("atand", a))),
    "arctan2": _two(np.arctan2, lambda y, x: mul(_RADIANS, call("atan2d", y, x))),
    "degrees": _one(np.degrees, lambda a: mul(_DEGREES, a)),
    "radians": _one(np.radians, lambda a: mul(_RADIANS, a)),
    "exp": _one(np.exp, lambda a: call("exp", a)),
    "log1p": _one(np.log1p, lambda a: call("ln", add(ONE, a))),
    "sinh": _one(np.sinh, _sinh),
    "floor": _one(np.floor, lambda a: call("floor", a)),
    "rint": _one(np.rint, _rint),
    "remainder": _two(np.mod, lambda a, b: call("mod", a, b)),
    "maximum": _two(np.maximum, _most),
    "minimum": _two(np.minimum, _least),
    "fmax": _two(np.fmax, _most),
    "fmin": _two(np.fmin, _least),
    "less_equal": _two(np.less_equal, _le),
    "greater_equal": _two(np.greater_equal, lambda a, b: _le(b, a)),
    "less": _two(np.less, lambda a, b: _not(_le(b, a))),
    "greater": _two(np.greater, lambda a, b: _not(_le(a, b))),
    "logical_and": _two(np.logical_and, mul),
    "bitwise_and": _two(np.logical_and, mul),
    "logical_or": _two(np.logical_or, _most),
    "bitwise_or": _two(np.logical_or, _most),
    "logical_not": _one(np.logical_not, _not),
    "invert": _one(np.logical_not, _not),
    "isfinite": _known,
}
"""NumPy's functions of one number or two, by name; a test is 1 or 0."""
