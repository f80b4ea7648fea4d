"""What a user gave, with the place where it was given, and records made of it.

A `Given` is a value of a job file or a flag. A `Table` holds several by key; the `Key` of each
says which field of a record it fills, and how its text becomes a number. Whatever is wrong is an
OptionError that names the file, the table and the key (or the flag), and the mend.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from camtool.errors import OptionError
from camtool.patterns import guess

if TYPE_CHECKING:
    from collections.abc import Iterator

_T = TypeVar("_T")


@dataclass(frozen=True)
class Given:
    """A value as the user wrote it; `where` names its key or flag, `file` its file, if any."""

    value: Any
    where: str
    file: str | None = None

    def refused(self, message: str, mend: str = "") -> OptionError:
        """The error that says what is wrong with it."""
        return OptionError(message, file=self.file, where=self.where, mend=mend)

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """OptionErrors from within get the place of this value."""
        try:
            yield
        except OptionError as error:
            raise self.refused(error.message, error.mend) from error


@dataclass(frozen=True)
class Key:
    """How a key is read: the `field` of its record that it fills, and `read`, which makes the
    field's value of what was given.

    `kinds`: the kinds of operations that know it. `only`: another key of the table, and the
    values of it without which this one has no effect. `help`, and `metavar` or `choices`, are
    those of the flag that says the same; a key without `help` has none.
    """

    field: str
    read: Callable[[Given], Any]
    help: str = ""
    metavar: str = ""
    choices: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    only: tuple[str, tuple[str, ...]] | None = None


@dataclass(frozen=True)
class Table:
    """The keys of one table of a file, or flags, as given; `where` and `file` name the table."""

    given: Mapping[str, Given] = field(default_factory=dict)
    where: str = ""
    file: str | None = None

    def refused(self, message: str, mend: str = "") -> OptionError:
        """The error that says what is wrong with the table as a whole."""
        return OptionError(message, file=self.file, where=self.where, mend=mend)

    def only(self, names: Iterable[str]) -> Table:
        """The keys of these names."""
        known = set(names)
        given = {name: each for name, each in self.given.items() if name in known}
        return Table(given, self.where, self.file)

    def over(self, below: Table) -> Table:
        """The keys of both, those of this table where both have one."""
        where = self if self.given else below
        return Table({**below.given, **self.given}, where.where, where.file)


def table_of(values: object, known: Iterable[str], where: str, file: str) -> Table:
    """A TOML table, its keys checked; `where` is "" for the top of the file."""
    if not isinstance(values, dict):
        raise OptionError(
            f"{values!r} is no table", file=file, where=where, mend=f"known keys: {_listed(known)}"
        )
    given = {}
    for name, value in values.items():
        place = f"{where}, key {name}" if where else f"key {name}"
        given[name] = Given(value, place, file)
        if name not in known:
            raise given[name].refused("unknown key", _meant(name, known))
    return Table(given, where, file)


def part_of(given: Given, known: Iterable[str]) -> Table:
    """A table that is the value of a key, such as `entry = {kind = "ramp"}`."""
    parts = {}
    for name, value in given.value.items():
        parts[name] = Given(value, f"{given.where}.{name}", given.file)
        if name not in known:
            raise parts[name].refused("unknown key", _meant(name, known))
    return Table(parts, given.where, given.file)


def record_of(
    make: Callable[..., _T],
    keys: Mapping[str, Key],
    table: Table,
    base: Mapping[str, Any] | None = None,
) -> _T:
    """The record of a table's values: each is tried alone first, so that its key can be named.

    `base`: fields without which the record cannot be made.
    """
    fields: dict[str, Any] = {}
    for name, given in table.given.items():
        key = keys[name]
        fields[key.field] = key.read(given)
        try:
            make(**{**(base or {}), key.field: fields[key.field]})
        except OptionError as error:
            # An error with a place of its own says what contradicts what: that is for the whole.
            if error.where is None:
                raise given.refused(error.message, error.mend) from error
    try:
        return make(**fields)
    except OptionError as error:
        named = re.search(r"key (\w+)$", error.where or "")
        culprit = table.given.get(named[1] if named else "")
        raise (culprit or table).refused(error.message, error.mend) from error


def why_idle(keys: Mapping[str, Key], name: str, record: object) -> OptionError | None:
    """Why a key has no effect in this record, as an error without a place; None when it has."""
    only = keys[name].only
    if only is None:
        return None
    other, values = only
    if getattr(record, keys[other].field) in values:
        return None
    said = " or ".join(f'"{value}"' for value in values)
    return OptionError(
        f"has no effect without {other} = {said}", mend=f"give {other} too, or leave {name} out"
    )


def refuse_idle(keys: Mapping[str, Key], table: Table, record: object) -> None:
    """Refuse a key that has no effect in the record made of its table."""
    for name, given in table.given.items():
        why = why_idle(keys, name, record)
        if why is not None:
            raise given.refused(why.message, why.mend)


def _meant(name: str, known: Iterable[str]) -> str:
    return f"{guess(name, known)}known keys: {_listed(known)}"


def _listed(known: Iterable[str]) -> str:
    return ", ".join(known)
