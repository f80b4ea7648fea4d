"""Records and copies of them.

A record is a frozen `msgspec.Struct`, or a frozen dataclass where users of the Python API hold it
(docs/decisions/0077-one-way-to-copy-a-record.md). `replace` copies both."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # mypy checks names and types of the changes by this function's name, for structs too.
    from dataclasses import replace as replace
else:

    def replace(record, /, **changes):
        """Return a copy of a struct or dataclass with these fields changed."""
        if hasattr(record, "__struct_fields__"):
            from msgspec import structs  # not for --help

            return structs.replace(record, **changes)
        return dataclasses.replace(record, **changes)


class FrozenRecord:
    """Text, equality and hash of a `@dataclass(frozen=True, repr=False, eq=False)`, as Python
    would write and compile them for each class at every start, at 0.1 to 0.5 ms each
    (docs/decisions/0115-start.md)."""

    __slots__ = ()

    @recursive_repr()
    def __repr__(self) -> str:
        shown = (each for each in dataclasses.fields(self) if each.repr)  # type: ignore[arg-type]
        values = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in shown)
        return f"{type(self).__qualname__}({values})"

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return _compared_values(self) == _compared_values(other)

    def __hash__(self) -> int:
        return hash(_compared_values(self))


def _compared_values(record: object) -> tuple[Any, ...]:
    """Return the values of the fields by which a record is compared."""
    kind: Any = type(record)
    return _columns(kind)(record)


@cache
def _columns(kind: Any) -> Callable[[object], tuple[Any, ...]]:
    """Return the function that extracts the compared values from records of this class."""
    names = [each.name for each in dataclasses.fields(kind) if each.compare]
    return attrgetter(*names) if len(names) > 1 else lambda record: (getattr(record, *names),)
