"""`FrozenRecord` does what a frozen dataclass does, by methods that no class has of its own."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest

import camtool.api
from camtool.planning.job import Job, Operation, Tool
from camtool.records import FrozenRecord, replace


@dataclass(frozen=True, repr=False, eq=False)
class Ours(FrozenRecord):
    """A record with all kinds of fields."""

    name: str
    parts: tuple[Any, ...] = ()
    seen: int = field(default=0, compare=False)
    secret: str = field(default="", repr=False)


@dataclass(frozen=True)
class PlainOurs:
    """The same as Python makes it."""

    name: str
    parts: tuple[Any, ...] = ()
    seen: int = field(default=0, compare=False)
    secret: str = field(default="", repr=False)


@dataclass(frozen=True, repr=False, eq=False)
class Alone(FrozenRecord):
    """A record of one field."""

    value: float


@dataclass(frozen=True)
class PlainAlone:
    """The same as Python makes it."""

    value: float


def some(ours: type, alone: type) -> list[Any]:
    """Return records of two kinds, some of which are equal."""
    parts = (1.5, "x")
    return [
        *(ours("a"), ours("a", parts, 1), ours("a", parts, 2), ours("a", parts, 1, "s")),
        *(alone(1.0), alone(1.0), alone(2.0)),
    ]


def test_text_equality_and_hash_are_those_of_a_dataclass() -> None:
    mine, plain = some(Ours, Alone), some(PlainOurs, PlainAlone)
    assert [f"Plain{each!r}" for each in mine] == list(map(repr, plain))
    assert list(map(hash, mine)) == list(map(hash, plain))
    equal = [[one == other for other in mine] for one in mine]
    assert equal == [[one == other for other in plain] for one in plain]
    assert sum(map(sum, equal)) == 11


def test_records_are_frozen_copied_and_no_other_type() -> None:
    one = Ours("a")
    with pytest.raises(dataclasses.FrozenInstanceError):
        one.name = "b"  # type: ignore[misc]
    assert replace(one, name="b") == Ours("b")
    assert dataclasses.replace(one, name="b") == Ours("b")  # noqa: TID251
    assert one != ("a", (), "")
    assert {Job(): 1}[Job()] == 1
    assert repr(Tool(diameter_mm=2.0)).startswith("Tool(diameter_mm=2.0, kind='flat', ")
    assert Operation() != Operation(name="x")


def test_a_record_that_holds_itself_has_a_text() -> None:
    held: list[Any] = []
    held.append(Ours("a", (held,)))
    assert "..." in repr(held[0])


def kinds_below(kind: type) -> Iterator[type]:
    """Yield all classes below a class that are loaded."""
    for each in kind.__subclasses__():
        yield each
        yield from kinds_below(each)


def test_no_record_has_methods_that_it_inherits() -> None:
    """A dataclass that forgets `eq=False` compiles its own."""
    assert camtool.api.post
    kinds = [each for each in kinds_below(FrozenRecord) if each.__module__.startswith("camtool")]
    assert len(kinds) > 20
    assert not [each for each in kinds if {"__eq__", "__hash__"} & set(vars(each))]
