"""Values of job files and flags: what TOML or the command line gives becomes numbers and records.

Lengths, angles, feeds and times take units in texts; bare numbers are mm, degrees, mm/min and s.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from camtool.errors import OptionError
from camtool.jobs.given import Given, Key, Table, part_of, record_of, refuse_idle
from camtool.patterns import guess
from camtool.planning.job import ENTRIES, LEADS, ORIGINS, STARTS, Entry, Lead, Tabs
from camtool.units import parse_angle, parse_feed, parse_length, parse_time

Read = Callable[[Given], Any]
_T = TypeVar("_T")

_PAIR = re.compile(r"(.+?)\s*[x×]\s*([-+.\d].*)")
_UNIT = re.compile(r"[^\d\s.+/-].*$")
_COUNT = re.compile(r"\s*\d+\s*(:|$)")
_WILD = re.compile(r"[*?\[]")


def plain(convert: Callable[[object], Any]) -> Read:
    """Reads a value by a function that knows nothing of its place."""

    def read(given: Given) -> Any:
        with given.blamed():
            return convert(given.value)

    return read


def length(value: object) -> float:
    """mm."""
    return parse_length(_number_text(value))


def feed(value: object) -> float:
    """mm/min."""
    return parse_feed(_number_text(value))


def angle(value: object) -> float:
    """rad."""
    return parse_angle(_number_text(value))


def time(value: object) -> float:
    """s."""
    return parse_time(_number_text(value))


def number(value: object) -> float:
    """A number without a unit."""
    text = _number_text(value)
    try:
        return float(text)
    except ValueError:
        raise OptionError(f"{text!r} is no number", mend="give a number without a unit") from None


def fraction(value: object) -> float:
    """0.4 or "40%"."""
    text = _number_text(value).strip()
    return number(text[:-1]) / 100.0 if text.endswith("%") else number(text)


def whole(value: object) -> int:
    """A whole number."""
    text = _number_text(value).strip()
    if not re.fullmatch(r"[+-]?\d{1,9}", text):
        raise OptionError(f"{text!r} is no whole number", mend="write it like 4")
    return int(text)


def switch(value: object) -> bool:
    """true or false."""
    if not isinstance(value, bool):
        raise OptionError(f"{value!r} is neither true nor false", mend="write true or false")
    return value


def text(value: object) -> str:
    """Any text."""
    if not isinstance(value, str):
        raise OptionError(f"{value!r} is no text", mend=f'write it in quotes: "{value}"')
    return value


def word(known: Sequence[str]) -> Read:
    """One of the words that are known, with a guess which one was meant."""

    def convert(value: object) -> str:
        said = text(value)
        if said not in known:
            raise OptionError(
                f"unknown word {said!r}",
                mend=f"{guess(said, known)}use one of {', '.join(known)}",
            )
        return said

    return plain(convert)


def patterns(value: object) -> tuple[str, ...]:
    """A list of texts."""
    if not isinstance(value, list | tuple):
        raise OptionError(f"{value!r} is no list", mend=f'write it in brackets: ["{value}"]')
    if not value:
        raise OptionError("an empty list takes nothing", mend="leave it out to take all")
    return tuple(text(item) for item in value)


def layers(value: object) -> tuple[str, ...]:
    """A list of patterns, or one text with commas between them."""
    if isinstance(value, str):
        value = [word.strip() for word in value.split(",")]
    return patterns(value)


def colours(value: object) -> tuple[str, ...]:
    """Patterns of colours as drawings have them ("#rrggbb"); names and numbers are turned so."""
    from camtool.importers.select import colour_named

    if isinstance(value, list | tuple):
        value = [str(item) if type(item) is int else item for item in value]
    return tuple(
        each if not each or _WILD.search(each) else colour_named(each) for each in patterns(value)
    )


def lengths(value: object) -> tuple[float, float]:
    """[12, "9mm"] or "12x9mm": a unit behind both is that of both."""
    if isinstance(value, str):
        match = _PAIR.fullmatch(value.strip())
        if match is None:
            raise OptionError(f"{value!r} is no pair of lengths", mend='write it like "12x9mm"')
        one, two = match.groups()
        unit = _UNIT.search(two)
        return length(one if unit is None or _UNIT.search(one) else one + unit[0]), length(two)
    return _two(value, length, '["12mm", "9mm"]')


def counts(value: object) -> tuple[int, int]:
    """[3, 2] or "3x2"."""
    if isinstance(value, str):
        match = _PAIR.fullmatch(value.strip())
        if match is None:
            raise OptionError(f"{value!r} is no pair of counts", mend='write it like "3x2"')
        return whole(match[1]), whole(match[2])
    return _two(value, whole, "[3, 2]")


def origin(value: object) -> str | tuple[float, float]:
    """A word, [x, y] or "x,y"."""
    return _word_or_place(value, ORIGINS)


def start(value: object) -> str | tuple[float, float]:
    """A word, [x, y] or "x,y"."""
    return _word_or_place(value, STARTS)


def entry(given: Given) -> Entry:
    """A table, or "ramp", "ramp:3deg", "helix:3deg:1mm"."""
    return _record(Entry, ENTRY, _parts(given, ENTRY, ("kind", "angle", "radius")))


def lead(given: Given) -> Lead:
    """A table, or "none", "line:1mm", "arc:1mm"."""
    return _record(Lead, LEAD, _parts(given, LEAD, ("kind", "length")))


def tabs(given: Given) -> Tabs:
    """A table, or how many ("4") or how far apart ("20mm"), then ":width:height"."""
    value = given.value
    counted = type(value) is int or (isinstance(value, str) and _COUNT.match(value))
    first = "count" if counted else "spacing"
    table = _parts(given, TABS, (first, "width", "height"))
    base = {"spacing_mm": 1.0} if "spacing" in table.given else {"count": 1}
    return record_of(Tabs, TABS, table, base)


def _record(make: Callable[..., _T], keys: Mapping[str, Key], table: Table) -> _T:
    record = record_of(make, keys, table)
    refuse_idle(keys, table, record)
    return record


def _parts(given: Given, keys: Mapping[str, Key], names: Sequence[str]) -> Table:
    """The keys of a table that is a value, or of a text "a:b:c" that gives `names` in order."""
    if isinstance(given.value, dict):
        return part_of(given, keys)
    with given.blamed():
        texts = _number_text(given.value).split(":")
        if len(texts) > len(names):
            raise OptionError(
                f"{given.value!r} has too many parts", mend=f"write it like {':'.join(names)}"
            )
    parts = {
        name: Given(part, given.where, given.file)
        for name, part in zip(names, texts, strict=False)
    }
    return Table(parts, given.where, given.file)


def _word_or_place(value: object, known: Sequence[str]) -> str | tuple[float, float]:
    """One of the words, or a place as a list of two lengths or a text with a comma."""
    if isinstance(value, list | tuple):
        return _two(value, length, '["10mm", "5mm"]')
    said = text(value)
    if said in known:
        return said
    places = said.split(",")
    if len(places) != 2:
        raise OptionError(
            f"{said!r} is no place",
            mend=f"{guess(said, known)}use one of {', '.join(known)}, or x,y",
        )
    return length(places[0]), length(places[1])


def _two(value: object, convert: Callable[[object], _T], like: str) -> tuple[_T, _T]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise OptionError(f"{value!r} is no list of two", mend=f"write it like {like}")
    return convert(value[0]), convert(value[1])


def _number_text(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise OptionError(f"{value!r} is no number", mend='write it like 0.2 or "0.2mm"')
    return value if isinstance(value, str) else repr(value)


ENTRY = {
    "kind": Key("kind", word(ENTRIES)),
    "angle": Key("angle_rad", plain(angle), only=("kind", ("ramp", "helix"))),
    "radius": Key("radius_mm", plain(length), only=("kind", ("helix",))),
}
"""Keys of `entry`."""

LEAD = {
    "kind": Key("kind", word(LEADS)),
    "length": Key("length_mm", plain(length), only=("kind", ("line", "arc"))),
}
"""Keys of `lead_in` and `lead_out`."""

TABS = {
    "count": Key("count", plain(whole)),
    "spacing": Key("spacing_mm", plain(length)),
    "width": Key("width_mm", plain(length)),
    "height": Key("height_mm", plain(length)),
    "ramped": Key("ramped", plain(switch)),
}
"""Keys of `tabs`."""
