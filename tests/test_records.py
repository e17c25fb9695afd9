"""A record behaves as the dataclass of the same fields."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle

import pytest

from movimentum import records


def pair(**options):
    """One class as a record and as a dataclass."""

    def body():
        class Place:
            """A place."""

            x: float
            y: float = 2.0
            names: list[str] = dataclasses.field(default_factory=list)
            note: str = dataclasses.field(default="", compare=False, repr=False)
            made: int = dataclasses.field(default=7, init=False)

        return Place

    return records.record(**options)(body()), dataclasses.dataclass(**options)(body())


OPTIONS = [
    {"frozen": frozen, "slots": slots, "eq": eq, "order": eq and frozen}
    for frozen in (True, False)
    for slots in (True, False)
    for eq in (True, False)
]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_a_record_is_a_dataclass(options):
    record, standard = pair(**options)
    for cls in (record, standard):
        first, same, other = cls(1.0), cls(x=1.0, note="else"), cls(2.0, 3.0, ["a"])
        assert repr(first).endswith("Place(x=1.0, y=2.0, names=[], made=7)")
        assert (first == same) is options["eq"]
        assert first != other
        assert dataclasses.replace(first, y=5.0).y == 5.0
        assert first.names is not same.names
        assert copy.copy(other).names is other.names
        assert (cls.__hash__ is None) is (options["eq"] and not options["frozen"])
        if options["order"]:
            assert first < other
            assert first <= same
        if options["frozen"]:
            with pytest.raises(dataclasses.FrozenInstanceError):
                first.x = 3.0
        with pytest.raises(TypeError, match=r"Place.__init__\(\) missing 1 required positional argument: 'x'"):
            cls()
        with pytest.raises(TypeError):
            cls(1.0, made=3)
    assert hasattr(record(1.0), "__dict__") is not options["slots"]
    assert record.__match_args__ == standard.__match_args__


@records.dataclass(frozen=True, slots=True)
class Base:
    """Extended below."""

    a: int

    def __post_init__(self):
        object.__setattr__(self, "a", abs(self.a))


@records.dataclass(frozen=True, slots=True, kw_only=True)
class Extended(Base):
    """With a keyword."""

    b: str = "b"


def test_a_record_extends_a_record_and_is_pickled():
    extended = Extended(-3, b="c")
    assert (extended.a, extended.b) == (3, "c")
    assert pickle.loads(pickle.dumps(extended)) == extended
    assert hash(extended) == hash(Extended(3, b="c"))
    assert extended != Base(3)


def test_fields_are_those_of_a_dataclass():
    for options in OPTIONS:
        record, standard = pair(**options)
        (names, kinds), (expected, as_expected) = (
            ([f.name for f in dataclasses.fields(c)], [(f.type, f.init, f.kw_only) for f in dataclasses.fields(c)])
            for c in (record, standard)
        )
        assert (names, kinds) == (expected, as_expected)
        assert dataclasses.asdict(record(1.0)) == dataclasses.asdict(standard(1.0))
        assert (record.__qualname__, record.__doc__) == (standard.__qualname__, standard.__doc__)
    assert [f.name for f in dataclasses.fields(Extended)] == ["a", "b"]
    assert Extended.__match_args__ == ("a",)
    assert Extended.__slots__ == ("b",)


def test_methods_are_written_when_they_are_used():
    record, _ = pair(frozen=True, eq=True)
    stub = record.__init__
    record(1.0)
    assert record.__init__ is not stub
    assert list(inspect.signature(record.__init__).parameters) == ["self", "x", "y", "names", "note"]
