"""TOML in, a frozen record out, strictly: every fault is named by file, table and key.

Machine files, job files and measurements come through here. `read_table` reads a file, `convert`
makes the record of it: an unknown key, a wrong type or a number out of its range is an error that
says what may stand there.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

import msgspec
import msgspec.inspect

from camtool.errors import MachineError
from camtool.patterns import guess

DEEPEST = 50
"""Deepest nesting of tables and lists; those of machines and jobs are five deep at most."""

_PARTS = re.compile(r"[=,{}\[\]\n]")
"""Between these a TOML text holds one key or one value."""

MOST_SHOWN = 40
"""Messages do not repeat numbers of more characters."""

Table = dict[str, Any]
_T = TypeVar("_T")


def read_table(path: Path) -> Table:
    """A TOML file as nested dicts; MachineError with line and column when it is none."""
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = getattr(error, "strerror", None) or error
        raise MachineError(
            f"cannot be read ({reason})", file=str(path), mend="check the path"
        ) from error
    try:
        return parsed_table(data.decode())
    except UnicodeDecodeError as error:
        raise MachineError("is not UTF-8 text", file=str(path)) from error
    except ValueError as error:  # TOMLDecodeError, or a whole number of too many digits
        raise MachineError(f"is no TOML: {error}", file=str(path)) from error


def parsed_table(text: str) -> Table:
    """TOML text as nested dicts; TOMLDecodeError for what is none or nested deeper than DEEPEST,
    ValueError for a whole number of too many digits."""
    # Of a key of n parts tomllib keeps all n beginnings: n²/2 parts.
    if any(part.count(".") > DEEPEST for part in _PARTS.split(text)):
        raise tomllib.TOMLDecodeError(f"a key has more than {DEEPEST} parts")
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("it is nested too deeply") from None
    level: list[Any] = [table]
    for _ in range(DEEPEST):
        level = [each for value in level for each in _within(value)]
        if not level:
            return table
    raise tomllib.TOMLDecodeError(f"it is nested more than {DEEPEST} deep")


def _within(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def convert(table: Mapping[str, Any], kind: type[_T], file: str, at: str = "") -> _T:
    """`table` as the record `kind`; MachineError naming file, table and key when it is not."""
    _finite(table, file, at)
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        message, _, path = str(error).partition(" - at `$")
        keys = [key for key in (at + path.rstrip("`")).split(".") if key]
        unknown = re.search(r"unknown field `(.+?)`", message)
        missing = re.search(r"missing required field `(.+?)`", message)
        if unknown:
            keys.append(unknown[1])
            message = "unknown key"
        elif missing:
            keys.append(missing[1])
            message = "key is missing"
        elif message.startswith(_OUT_OF_RANGE):
            message = _outside(kind, table, keys[1:] if at else keys) or message
        within = keys[1:] if at else keys
        if unknown:
            mend = _mend(kind, table, within[:-1], within[-1])
        else:
            mend = "" if missing else _choice(kind, table, within)
        *tables, key = keys or ["?"]
        where = (f"table [{'.'.join(tables)}], " if tables else "") + f"key {key}"
        raise MachineError(
            message.replace("Invalid enum value", "Invalid value"),
            file=file,
            where=where,
            mend=mend,
        ) from None


_OUT_OF_RANGE = (
    *(f"Expected `{of}` {than}" for of in ("int", "float") for than in "<>"),
    "Number out of range",  # a whole one that is no float
)
"""How msgspec begins to say that a number is outside of its range."""


def _outside(kind: type, table: Mapping[str, Any], keys: Sequence[str]) -> str:
    """What is wrong with the number at `keys` ("axes", "x", "travel_mm"; "play_mm[0][1]"); ""
    where its range has not both ends."""
    *_, (about, value) = _down(kind, table, keys)
    about = _fitting(about, value)
    if about.ge is None or about.le is None:
        return ""
    said = repr(value)
    if len(said) > MOST_SHOWN:
        said = f"a number of {len(said)} characters"
    ends = (str(end) if isinstance(end, int) else f"{end:g}" for end in (about.ge, about.le))
    return f"{said} is not between {' and '.join(ends)}"


def _choice(kind: type, table: Mapping[str, Any], keys: Sequence[str]) -> str:
    """The words that may stand at `keys`, and the one that was meant; "" where any may."""
    *above, (about, value) = _down(kind, table, keys)
    words = [
        word
        for one in getattr(about, "types", (about,))
        if isinstance(one, msgspec.inspect.LiteralType)
        for word in one.values
    ]
    if above:  # the key that says which of several models a table is of
        key = re.findall(r"[^.\[\]]+", ".".join(keys))[-1]
        words += [
            one.tag
            for one in getattr(above[-1][0], "types", (above[-1][0],))
            if isinstance(one, msgspec.inspect.StructType) and one.tag_field == key
        ]
    near = guess(value, map(str, words)) if isinstance(value, str) else ""
    return f"{near}use one of {', '.join(map(str, words))}" if words else ""


def _down(kind: type, table: Mapping[str, Any], keys: Sequence[str]) -> Iterator[tuple[Any, Any]]:
    """(what is known, value) of a table, and of what lies within it on the way along `keys`."""
    about: Any = msgspec.inspect.type_info(kind)
    value: Any = table
    yield about, value
    for name in re.findall(r"[^.\[\]]+", ".".join(keys)):
        key = int(name) if isinstance(value, list) else name
        about, value = _part(about, value, key), value[key]
        yield about, value


def _part(about: Any, value: Any, key: int | str) -> Any:
    """What is known of the part `key` of a table or a list of which `about` is known."""
    about = _fitting(about, value)
    if isinstance(about, msgspec.inspect.StructType):
        found = (field.type for field in about.fields if field.encode_name == key)
        return next(found, None)  # none is the key that names the model
    if isinstance(about, msgspec.inspect.TupleType):
        return about.item_types[int(key)]
    return getattr(about, "item_type", None)  # nothing is known of a table of no known model


def _fitting(about: Any, value: Any) -> Any:
    """Of what may stand in one place, that which such a value means: the table of its model, the
    number where there may be none."""
    for one in getattr(about, "types", (about,)):
        if isinstance(one, msgspec.inspect.StructType):
            if one.tag is None or value.get(one.tag_field) == one.tag:
                return one
        elif not isinstance(one, msgspec.inspect.NoneType):
            return one
    return about


def _mend(kind: type, values: Any, tables: list[str], key: str) -> str:
    """The key that was meant, and those that a table knows; where models have tables of their
    own, that of its model."""
    record: Any = kind
    for name in tables:
        fields = {f.name: f.type for f in msgspec.structs.fields(record)}
        record, values = fields.get(name), values.get(name, {})
        for model in get_args(record):
            config = getattr(model, "__struct_config__", None)
            if config is not None and values.get(config.tag_field) == config.tag:
                record = model
    try:
        known = [f.encode_name for f in msgspec.structs.fields(record)]
    except TypeError:
        return ""
    return f"{guess(key, known)}known keys: {', '.join(known)}"


def _finite(value: object, file: str, at: str) -> None:
    """TOML knows inf and nan; no machine does."""
    if isinstance(value, float) and not math.isfinite(value):
        raise MachineError("is not finite", file=file, where=f"key {at}")
    items: Callable[[], Any] | None = getattr(value, "items", None)
    if items is not None:
        for key, item in items():
            _finite(item, file, f"{at}.{key}" if at else str(key))
    elif isinstance(value, list):
        for item in value:
            _finite(item, file, at)
