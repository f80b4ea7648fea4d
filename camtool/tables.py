"""TOML files as frozen records, read strictly: every error names file, table and key.

Machine files, job files and measurements come through here. `read_table` reads a file, `convert`
makes a record of it: an unknown key, a wrong type or a number out of range is an error that says
which values are allowed. `toml_lines` makes text of tables."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, get_args

import msgspec
import msgspec.inspect

from camtool.errors import MachineError
from camtool.patterns import guess

MAX_DEPTH = 50
"""Deepest nesting of tables and lists; those of machines and jobs are five deep at most."""

_PARTS = re.compile(r"[=,{}\[\]\n]")
"""The characters between keys and values of TOML text."""

MAX_SHOWN_CHARS = 40

Table = dict[str, Any]
_T = TypeVar("_T")


def read_table(path: Path, data: bytes | None = None) -> Table:
    """Read a TOML file as nested dicts; MachineError with line and column for a syntax error.
    `data`: its content, if it has been read already."""
    try:
        data = path.read_bytes() if data is None else data
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = getattr(error, "strerror", None) or error
        raise MachineError(
            f"cannot be read ({reason})", file=str(path), mend="check the path"
        ) from error
    try:
        return parse_table(data.decode())
    except UnicodeDecodeError as error:
        raise MachineError("is not UTF-8 text", file=str(path)) from error
    except ValueError as error:  # TOMLDecodeError, or an integer of too many digits
        raise MachineError(f"is no TOML: {error}", file=str(path)) from error


def parse_table(text: str) -> Table:
    """Parse TOML text to nested dicts; TOMLDecodeError for a syntax error and for nesting deeper
    than MAX_DEPTH, ValueError for an integer of too many digits."""
    # For a key of n parts tomllib keeps all its n beginnings, n²/2 parts.
    if any(part.count(".") > MAX_DEPTH for part in _PARTS.split(text)):
        raise tomllib.TOMLDecodeError(f"a key has more than {MAX_DEPTH} parts")
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("it is nested too deeply") from None
    level: list[Any] = [table]
    for _ in range(MAX_DEPTH):
        level = [each for value in level for each in _items_within(value)]
        if not level:
            return table
    raise tomllib.TOMLDecodeError(f"it is nested more than {MAX_DEPTH} deep")


def _items_within(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def convert(table: Mapping[str, Any], kind: type[_T], file: str, prefix: str = "") -> _T:
    """Convert `table` to the record `kind`; MachineError with file, table and key when it does not
    fit."""
    _refuse_infinite(table, file, prefix)
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        message, _, path = str(error).partition(" - at `$")
        keys = [key for key in (prefix + path.rstrip("`")).split(".") if key]
        unknown = re.search(r"unknown field `(.+?)`", message)
        missing = re.search(r"missing required field `(.+?)`", message)
        if unknown:
            keys.append(unknown[1])
            message = "unknown key"
        elif missing:
            keys.append(missing[1])
            message = "key is missing"
        elif message.startswith(_OUT_OF_RANGE):
            message = _out_of_range(kind, table, keys[1:] if prefix else keys) or message
        keys_within = keys[1:] if prefix else keys
        if unknown:
            mend = _mend(kind, table, keys_within[:-1], keys_within[-1])
        else:
            mend = "" if missing else _choice(kind, table, keys_within)
        *tables, key = keys or ["?"]
        place = (f"table [{'.'.join(tables)}], " if tables else "") + f"key {key}"
        raise MachineError(
            message.replace("Invalid enum value", "Invalid value"),
            file=file,
            where=place,
            mend=mend,
        ) from None


_OUT_OF_RANGE = (
    *(f"Expected `{of}` {than}" for of in ("int", "float") for than in "<>"),
    "Number out of range",  # a whole one that is no float
)
"""Beginnings of messages of msgspec about a number out of range."""


def _out_of_range(kind: type, table: Mapping[str, Any], keys: Sequence[str]) -> str:
    """Return the message for a number out of range at `keys` ("axes", "x", "travel_mm";
    "play_mm[0][1]"); "" if the range has only one end."""
    *_, (type_info, value) = _along(kind, table, keys)
    type_info = _fitting(type_info, value)
    if type_info.ge is None or type_info.le is None:
        return ""
    shown = repr(value)
    if len(shown) > MAX_SHOWN_CHARS:
        shown = f"a number of {len(shown)} characters"
    ends = (
        str(end) if isinstance(end, int) else f"{end:g}" for end in (type_info.ge, type_info.le)
    )
    return f"{shown} is not between {' and '.join(ends)}"


def _choice(kind: type, table: Mapping[str, Any], keys: Sequence[str]) -> str:
    """Return the end of a message that lists the allowed words at `keys` and suggests one; "" if
    any word is allowed."""
    *above, (type_info, value) = _along(kind, table, keys)
    words = [
        word
        for one in getattr(type_info, "types", (type_info,))
        if isinstance(one, msgspec.inspect.LiteralType)
        for word in one.values
    ]
    if above:  # the key that names the model of a table
        key = re.findall(r"[^.\[\]]+", ".".join(keys))[-1]
        words += [
            one.tag
            for one in getattr(above[-1][0], "types", (above[-1][0],))
            if isinstance(one, msgspec.inspect.StructType) and one.tag_field == key
        ]
    suggestion = guess(value, map(str, words)) if isinstance(value, str) else ""
    return f"{suggestion}use one of {', '.join(map(str, words))}" if words else ""


@cache
def _type_info(kind: type) -> msgspec.inspect.Type:
    """Return the type information of a record; msgspec makes it anew each time, in 2 ms."""
    return msgspec.inspect.type_info(kind)


def _along(kind: type, table: Mapping[str, Any], keys: Sequence[str]) -> Iterator[tuple[Any, Any]]:
    """Yield (type information, value) of a table, and then of each part of it along `keys`."""
    type_info: Any = _type_info(kind)
    value: Any = table
    yield type_info, value
    for name in re.findall(r"[^.\[\]]+", ".".join(keys)):
        key = int(name) if isinstance(value, list) else name
        type_info, value = _part(type_info, value, key), value[key]
        yield type_info, value


def _part(type_info: Any, value: Any, key: int | str) -> Any:
    """Return the type information of the item `key` in a table or list of type `type_info`."""
    type_info = _fitting(type_info, value)
    if isinstance(type_info, msgspec.inspect.StructType):
        field_types = (field.type for field in type_info.fields if field.encode_name == key)
        return next(field_types, None)  # None for the key that names the model
    if isinstance(type_info, msgspec.inspect.TupleType):
        return type_info.item_types[int(key)]
    return getattr(type_info, "item_type", None)  # None for a table of an unknown model


def _fitting(type_info: Any, value: Any) -> Any:
    """Return the type of a union that fits this value: the table of the model that it names, or
    the type beside None."""
    for one in getattr(type_info, "types", (type_info,)):
        if isinstance(one, msgspec.inspect.StructType):
            if one.tag is None or value.get(one.tag_field) == one.tag:
                return one
        elif not isinstance(one, msgspec.inspect.NoneType):
            return one
    return type_info


def _mend(kind: type, values: Any, tables: list[str], key: str) -> str:
    """Return the end of a message about an unknown key: a similar key, and all keys of the table
    (for models with tables of their own, those of that model)."""
    record: Any = kind
    for name in tables:
        fields = {f.name: f.type for f in msgspec.structs.fields(record)}
        record, values = fields.get(name), values.get(name, {})
        for model in get_args(record):
            config = getattr(model, "__struct_config__", None)
            if config is not None and values.get(config.tag_field) == config.tag:
                record = model
    try:
        known_keys = [f.encode_name for f in msgspec.structs.fields(record)]
    except TypeError:
        return ""
    return f"{guess(key, known_keys)}known keys: {', '.join(known_keys)}"


def _refuse_infinite(value: object, file: str, path: str) -> None:
    """Raise MachineError for inf and nan, which TOML allows and no machine has."""
    if isinstance(value, float) and not math.isfinite(value):
        raise MachineError("is not finite", file=file, where=f"key {path}", mend="write a number")
    items: Callable[[], Any] | None = getattr(value, "items", None)
    if items is not None:
        for key, item in items():
            _refuse_infinite(item, file, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list):
        for number, item in enumerate(value, 1):
            _refuse_infinite(item, file, f"{path} {number}" if isinstance(item, dict) else path)


# Tables as text again.

_SURROGATES = range(0xD800, 0xE000)

_BARE = re.compile(r"[A-Za-z0-9_-]+")
"""Keys that need no quotes."""


def toml_lines(
    table: Mapping[str, Any], notes: Mapping[str, str] | None = None, path: tuple[str, ...] = ()
) -> Iterator[str]:
    """Yield the lines of a table as TOML, its values before its tables and lists of tables;
    `notes` are comments after the values of these keys ("axes.x.backlash_mm")."""
    notes = notes or {}
    tables = {key: value for key, value in table.items() if isinstance(value, dict)}
    lists = {key: value for key, value in table.items() if _are_tables(value)}
    values = {key: table[key] for key in table if key not in tables and key not in lists}
    if path and (values or not table):
        yield ""
        yield f"[{'.'.join(map(_key, path))}]"
    yield from _values(values, notes, path)
    for key, value in tables.items():
        yield from toml_lines(value, notes, (*path, key))
    for key, rows in lists.items():
        for row in rows:
            yield ""
            yield f"[[{'.'.join(map(_key, (*path, key)))}]]"
            yield from _values(row, notes, (*path, key))


def _are_tables(value: Any) -> bool:
    return isinstance(value, list | tuple) and any(isinstance(each, dict) for each in value)


def _values(
    values: Mapping[str, Any], notes: Mapping[str, str], path: tuple[str, ...]
) -> Iterator[str]:
    for key, value in values.items():
        note = notes.get(".".join((*path, key)))
        yield f"{_key(key)} = {_value(value)}" + (f"    # {note}" if note else "")


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _value(name)


def _value(value: Any) -> str:
    """Format a value as TOML on one line: text, number, boolean, a list of these, or a table."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{_key(key)} = {_value(each)}' for key, each in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def toml_string(text: str) -> str:
    """Format any text as a TOML string. Halves of surrogate pairs, which TOML cannot hold, become
    "?"."""
    return '"' + "".join(map(_escaped, text)) + '"'


def _escaped(char: str) -> str:
    code = ord(char)
    if code in _SURROGATES:
        return "?"
    if char in '"\\':
        return f"\\{char}"
    if char.isprintable():
        return char
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
