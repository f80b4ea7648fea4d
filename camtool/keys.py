"""Keys of tables and flags: what each may be, which field it fills, and how its value is read.

    Given     a value as a file or a flag gave it, with its place
    Table     several of them by key: one table of a file, or flags
    Value     what a key may be: how it is read, and what the help of its flag shows
    Key       the field that a key fills, its Value, the help of its flag, an example

Whatever is wrong is an OptionError that names the file, the table and the key (or the flag), and
says how to fix it. `camtool.jobs.keys` has the keys of jobs; an operation may bring keys of its
own (`camtool.planning.kinds`)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from msgspec import Struct, field

from camtool.errors import OptionError
from camtool.patterns import guess
from camtool.units import parse_angle, parse_feed, parse_length, parse_time

_T = TypeVar("_T")


class Given(Struct, frozen=True):
    """A value as the user wrote it; `where` names its key or flag, `file` its file, if any."""

    value: Any
    where: str
    file: str | None = None

    def refused(self, message: str, mend: str = "") -> OptionError:
        """Return an OptionError about this value, with its place."""
        return OptionError(message, file=self.file, where=self.where, mend=mend)

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Add the place of this value to any OptionError that the block raises."""
        try:
            yield
        except OptionError as error:
            raise self.refused(error.message, error.mend) from error


class Value(Struct, frozen=True):
    """The values that a key may have. `read` converts a given value to the value of the field; the
    help of the flag shows `metavar` or `choices` (a switch has neither). `tables`: the value may
    be given as a table too."""

    read: Callable[[Given], Any]
    metavar: str = ""
    choices: tuple[str, ...] = ()
    tables: bool = False


class Key(Struct, frozen=True):
    """A key of a table: the `field` of the record that it fills, and its possible `value`.

    `help` is the help text of its flag; a key without help has no flag. `example` appears in the
    files that `camtool job new` begins. `only`: (other key, its values): with other values of that
    key this one has no effect. `default`: the value of the field if the key is not given, for keys
    that only one kind of operation has; the defaults of all others are in their records."""

    field: str
    value: Value
    help: str = ""
    example: str = ""
    only: tuple[str, tuple[str, ...]] | None = None
    default: Any = None

    def read(self, raw: Given) -> Any:
        """Convert a given value to the value of the field."""
        return self.value.read(raw)


class Table(Struct, frozen=True):
    """The keys of one table of a file, or flags, as given; `where` and `file` name the table."""

    given: Mapping[str, Given] = field(default_factory=dict)
    where: str = ""
    file: str | None = None

    def refused(self, message: str, mend: str = "") -> OptionError:
        """Return an OptionError about the table as a whole, with its place."""
        return OptionError(message, file=self.file, where=self.where, mend=mend)

    def only(self, names: Iterable[str]) -> Table:
        """Return a table with only these keys."""
        name_set = set(names)
        chosen = {name: each for name, each in self.given.items() if name in name_set}
        return Table(chosen, self.where, self.file)

    def over(self, below: Table) -> Table:
        """Return a table with the keys of both; where both have a key, the value of this one
        counts."""
        first_table = self if self.given else below
        return Table({**below.given, **self.given}, first_table.where, first_table.file)


def table_of(values: object, known_keys: Iterable[str], table_place: str, file: str) -> Table:
    """Convert a TOML table whose keys must be among `known_keys`; `table_place` names it in
    errors, "" for the top level of the file."""
    if not isinstance(values, dict):
        raise OptionError(
            f"{values!r} is no table",
            file=file,
            where=table_place,
            mend=f"known keys: {_listed(known_keys)}",
        )
    entries = {}
    for name, value in values.items():
        place = f"{table_place}, key {name}" if table_place else f"key {name}"
        entries[name] = Given(value, place, file)
        if name not in known_keys:
            raise entries[name].refused("unknown key", meant(name, known_keys))
    return Table(entries, table_place, file)


def record_of(
    make: Callable[..., _T],
    keys: Mapping[str, Key],
    table: Table,
    base: Mapping[str, Any] | None = None,
) -> _T:
    """Make the record of a table's values. Each value is first tried alone, so that an error names
    its key.

    `base`: fields that the record cannot be made without, for these trials."""
    fields: dict[str, Any] = {}
    for name, raw in table.given.items():
        key = keys[name]
        fields[key.field] = key.read(raw)
        try:
            make(**{**(base or {}), key.field: fields[key.field]})
        except OptionError as error:
            # An error with a place of its own is a contradiction between keys, reported for the
            # whole table.
            if error.where is None:
                raise raw.refused(error.message, error.mend) from error
    try:
        return make(**fields)
    except OptionError as error:
        named = re.search(r"key (\w+)$", error.where or "")
        culprit = table.given.get(named[1] if named else "")
        raise (culprit or table).refused(error.message, error.mend) from error


def why_idle(keys: Mapping[str, Key], name: str, record: object) -> OptionError | None:
    """Return the reason why a key has no effect in this record, as an error without a place; None
    if it has an effect."""
    condition = keys[name].only
    if condition is None:
        return None
    other, values = condition
    field_name = keys[other].field
    own_values = dict(getattr(record, "own", ()))
    if own_values.get(field_name, getattr(record, field_name, None)) in values:
        return None
    needed = " or ".join(f'"{value}"' for value in values)
    return OptionError(
        f"has no effect without {other} = {needed}", mend=f"give {other} too, or leave {name} out"
    )


def refuse_idle(keys: Mapping[str, Key], table: Table, record: object) -> None:
    """Raise OptionError for a key that has no effect in the record made of its table."""
    for name, raw in table.given.items():
        error = why_idle(keys, name, record)
        if error is not None:
            raise raw.refused(error.message, error.mend)


def meant(name: str, known_names: Iterable[str]) -> str:
    """Return the end of the message about an unknown key: the most similar known name, and all
    known names."""
    return f"{guess(name, known_names)}known keys: {_listed(known_names)}"


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


# How values are read: what TOML or the command line gives becomes numbers and records. Lengths,
# angles, feeds and times take units in texts; bare numbers are mm, degrees, mm/min and s.


def plain(convert: Callable[[object], Any]) -> Callable[[Given], Any]:
    """Return a reader that converts the bare value; errors get the place of the value."""

    def read(raw: Given) -> Any:
        with raw.blamed():
            return convert(raw.value)

    return read


def length(value: object) -> float:
    """Read a length, mm."""
    return parse_length(number_text(value))


def feed(value: object) -> float:
    """Read a feed, mm/min."""
    return parse_feed(number_text(value))


def angle(value: object) -> float:
    """Read an angle, rad."""
    return parse_angle(number_text(value))


def time(value: object) -> float:
    """Read a time, s."""
    return parse_time(number_text(value))


def number(value: object) -> float:
    """Read a number without a unit."""
    text = number_text(value)
    try:
        return float(text)
    except ValueError:
        raise OptionError(f"{text!r} is no number", mend="give a number without a unit") from None


def fraction(value: object) -> float:
    """Read a fraction: 0.4 or "40%"."""
    text = number_text(value).strip()
    return number(text[:-1]) / 100.0 if text.endswith("%") else number(text)


def engagement_angle(value: object) -> float:
    """Read an engagement and return the angle in rad: given as an angle with its unit, or as the
    part a of the diameter that cuts along a straight wall, which is the angle acos(1 − 2 a).

    >>> [round(math.degrees(engagement_angle(text))) for text in ("50%", "60deg")]
    [90, 60]
    """
    text = str(value).strip()
    if isinstance(value, str) and text.endswith(("deg", "°", "rad")):
        return parse_angle(text)
    part = fraction(value)
    if not 0.0 <= part <= 1.0:
        raise OptionError(
            f"{text!r} is no part of a diameter",
            mend='give one such as "15%", or an angle such as "60deg"',
        )
    return math.acos(1.0 - 2.0 * part)


def whole_number(value: object) -> int:
    """Read a whole number."""
    text = number_text(value).strip()
    if not re.fullmatch(r"[+-]?\d{1,9}", text):
        raise OptionError(f"{text!r} is no whole number", mend="write it like 4")
    return int(text)


def switch(value: object) -> bool:
    """Read true or false."""
    if not isinstance(value, bool):
        raise OptionError(f"{value!r} is neither true nor false", mend="write true or false")
    return value


def text(value: object) -> str:
    """Read any text."""
    if not isinstance(value, str):
        raise OptionError(f"{value!r} is no text", mend=f'write it in quotes: "{value}"')
    return value


def word(words: Sequence[str]) -> Callable[[Given], Any]:
    """Return a reader that accepts only these words; for another word its OptionError suggests the
    most similar one."""

    def convert(value: object) -> str:
        name = text(value)
        if name not in words:
            raise OptionError(
                f"unknown word {name!r}", mend=f"{guess(name, words)}use one of {', '.join(words)}"
            )
        return name

    return plain(convert)


def patterns(value: object) -> tuple[str, ...]:
    """Read a list of texts."""
    if not isinstance(value, list | tuple):
        raise OptionError(f"{value!r} is no list", mend=f'write it in brackets: ["{value}"]')
    if not value:
        raise OptionError("an empty list takes nothing", mend="leave it out to take all")
    return tuple(text(item) for item in value)


def number_text(value: object) -> str:
    """Return a number, with or without a unit, as text; OptionError for other values."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise OptionError(f"{value!r} is no number", mend='write it like 0.2 or "0.2mm"')
    return value if isinstance(value, str) else repr(value)


# The values of keys.

LENGTH = Value(plain(length), "LENGTH")
ANGLE = Value(plain(angle), "ANGLE")
FEED = Value(plain(feed), "FEED")
TIME = Value(plain(time), "TIME")
COUNT = Value(plain(whole_number), "COUNT")
FACTOR = Value(plain(number), "FACTOR")
TEXT = Value(plain(text))
PATTERNS_OF_NAMES = Value(plain(patterns))
SWITCH = Value(plain(switch))


def one_of(words: tuple[str, ...]) -> Value:
    """Return the Value of a key that takes one of these words."""
    return Value(word(words), choices=words)
