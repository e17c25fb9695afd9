"""Records: dataclasses whose methods are generated when they are first used.

The package has some five hundred of them. The standard decorator compiles up to six methods for each on import, which
takes 0.4 ms, or 0.1 ms without any; that was most of the wait for a first `solve`. Here a class costs 0.02 ms, and only
classes that are instantiated compile their ``__init__``. `fields` and `field` work as usual. A record may only extend
records.
"""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Callable
from dataclasses import field as field
from dataclasses import fields as fields
from functools import cache
from types import MemberDescriptorType
from typing import TYPE_CHECKING, Any, TypeVar

T = TypeVar("T")


def record(
    *,
    frozen: bool = False,
    slots: bool = False,
    eq: bool = True,
    order: bool = False,
    repr: bool = True,  # noqa: A002
    kw_only: bool = False,
) -> Callable[[Any], Any]:
    """The decorator; its options are those of `dataclasses.dataclass`."""

    def made(given: Any) -> Any:
        cls: Any = _with_fields(given, slots, kw_only)
        own: dict[str, Any] = {**cls.__dict__}
        methods: dict[str, Any] = {"__init__": _written_later(cls, "__init__", _init, frozen)}
        if repr:
            methods["__repr__"] = _repr
        if eq:
            methods["__eq__"] = _written_later(cls, "__eq__", _eq, frozen)
            methods["__hash__"] = _written_later(cls, "__hash__", _hash, frozen) if frozen else None
        if order:
            methods |= {f"__{name}__": _ordering(getattr(operator, name)) for name in ("lt", "le", "gt", "ge")}
        for name, method in methods.items():
            if name not in own:
                setattr(cls, name, method)
        if frozen:
            cls.__setattr__, cls.__delattr__ = _refused, _refused
            if slots and "__getstate__" not in own:
                cls.__getstate__, cls.__setstate__ = _state, _restored
        return cls

    return made


def _with_fields(given: Any, slots: bool, kw_only: bool) -> Any:
    """The class with its fields as `dataclasses.fields` and ``match`` look for them, and with slots for those of its
    own.
    """
    inherited: dict[str, Any] = {}
    for base in reversed(given.__mro__[1:]):
        inherited |= getattr(base, _FIELDS, {})
    own: dict[str, Any] = {}
    body: dict[str, Any] = {**given.__dict__}
    for name, annotation in given.__annotations__.items():  # its own, also where they are computed late (PEP 649)
        if "ClassVar" in (annotation if isinstance(annotation, str) else repr(annotation)):
            continue
        value: Any = body.pop(name, dataclasses.MISSING)
        each: Any = value if isinstance(value, _STATED) else field(default=value)
        each.name, each.type = name, annotation
        each.kw_only = kw_only if each.kw_only is dataclasses.MISSING else each.kw_only
        each._field_type = _FIELD
        own[name] = each
        if each.default is not dataclasses.MISSING and not slots:
            body[name] = each.default
    body[_FIELDS] = found = inherited | own
    body["__match_args__"] = tuple(name for name, each in found.items() if each.init and not each.kw_only)
    if slots:
        body["__slots__"] = tuple(name for name in own if name not in inherited)
        for name in ("__dict__", "__weakref__"):
            body.pop(name, None)
        made = type(given)(given.__name__, given.__bases__, body)
        made.__qualname__ = given.__qualname__
        return made
    for name in own:
        if name not in body and name in given.__dict__:
            delattr(given, name)
    for name in (*own, _FIELDS, "__match_args__"):
        if name in body:
            setattr(given, name, body[name])
    return given


_STATED: Any = dataclasses.Field
_FIELDS = "__dataclass_fields__"
_FIELD: Any = getattr(dataclasses, "_FIELD")  # noqa: B009 - how `dataclasses.fields` tells fields from other variables


def replace(given: T, /, **changes: Any) -> T:
    """A record like the one ``given``, but for ``changes``; `dataclasses.replace` takes twice as long."""
    values = {name: getattr(given, name) for name in _arguments(type(given))}
    values.update(changes)
    return type(given)(**values)


@cache
def _arguments(cls: Any) -> tuple[str, ...]:
    return tuple(each.name for each in fields(cls) if each.init)


def _written_later(cls: type, name: str, write: Callable[[type, bool], Any], frozen: bool) -> Any:
    """A method that replaces itself by what ``write`` gives as soon as it is called."""

    def method(self: Any, *args: Any, **options: Any) -> Any:
        written = write(cls, frozen)
        written.__qualname__ = f"{cls.__qualname__}.{name}"
        setattr(cls, name, written)
        return written(self, *args, **options)

    method.__qualname__ = f"{cls.__qualname__}.{name}"
    return method


def _function(head: str, body: list[str], scope: dict[str, Any]) -> Any:
    exec("\n".join([f"def made({head}):", *(f" {line}" for line in body)]), scope)  # names of fields only
    return scope["made"]


def _init(cls: type, frozen: bool) -> Any:
    scope: dict[str, Any] = {"_set": object.__setattr__, "_missing": dataclasses.MISSING}
    slots: dict[str, Any] = {}
    for base in cls.__mro__:
        slots |= {name: each for name, each in vars(base).items() if isinstance(each, MemberDescriptorType)}
    places: list[str] = []
    named: list[str] = []
    body: list[str] = []
    for each in fields(cls):
        name, value = each.name, each.name
        given = each.default is not dataclasses.MISSING or each.default_factory is not dataclasses.MISSING
        scope[f"_default_{name}"] = each.default
        scope[f"_make_{name}"] = each.default_factory
        if each.default_factory is not dataclasses.MISSING:
            value = f"_make_{name}() if {name} is _missing else {name}" if each.init else f"_make_{name}()"
            scope[f"_default_{name}"] = dataclasses.MISSING
        elif not each.init:
            value = f"_default_{name}"
        if each.init:
            (named if each.kw_only else places).append(f"{name}=_default_{name}" if given else name)
        if each.init or given:
            if frozen and name in slots:  # half as long as `object.__setattr__`, which looks for the slot
                scope[f"_slot_{name}"] = slots[name].__set__
                body.append(f"_slot_{name}(self, {value})")
            else:
                body.append(f"_set(self, {name!r}, {value})" if frozen else f"self.{name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    return _function(", ".join(["self", *places, *(["*", *named] if named else [])]), body or ["pass"], scope)


def _compared(cls: type, owner: str) -> str:
    names = [each.name for each in fields(cls) if (each.compare if each.hash is None else each.hash)]
    return "(" + "".join(f"{owner}.{name}, " for name in names) + ")"


def _eq(cls: type, _: bool) -> Any:
    body = [
        "if other.__class__ is not self.__class__: return NotImplemented",
        f"return {_compared(cls, 'self')} == {_compared(cls, 'other')}",
    ]
    return _function("self, other", body, {})


def _hash(cls: type, _: bool) -> Any:
    return _function("self", [f"return hash({_compared(cls, 'self')})"], {})


def _ordering(compare: Callable[[Any, Any], bool]) -> Any:
    def method(self: Any, other: Any) -> Any:
        if other.__class__ is not self.__class__:
            return NotImplemented
        names = [each.name for each in fields(self) if each.compare]
        return compare([getattr(self, name) for name in names], [getattr(other, name) for name in names])

    return method


def _repr(self: Any) -> str:
    shown = (f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{type(self).__qualname__}({', '.join(shown)})"


def _refused(self: Any, name: str, *_: object) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot change field {name!r}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, each.name) for each in fields(self)]


def _restored(self: Any, state: list[Any]) -> None:
    for each, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, each.name, value)


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    dataclass = record
    """`record`, by the name that type checkers know."""
