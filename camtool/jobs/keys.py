"""What a user gave, with the place where it was given, and records made of it.

A `Given` is a value of a job file or a flag. A `Table` holds several by key; the `Key` of each
says which field of a record it fills, and how its text becomes a number. Whatever is wrong is an
OptionError that names the file, the table and the key (or the flag), and the mend.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from camtool.errors import OptionError
from camtool.patterns import guess
from camtool.planning.job import (
    CORNERS,
    DIRECTIONS,
    ENTRIES,
    GOALS,
    JOINS,
    KINDS,
    LEADS,
    ORIGINS,
    PATTERNS,
    SIDES,
    STARTS,
    TOOL_KINDS,
    Entry,
    Lead,
    Tabs,
)
from camtool.units import parse_angle, parse_feed, parse_length, parse_time

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


# Values of job files and flags: what TOML or the command line gives becomes numbers and records.
#
# Lengths, angles, feeds and times take units in texts; bare numbers are mm, degrees, mm/min and s.

Read = Callable[[Given], Any]

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
    from camtool.importers.pieces import colour_named

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


# The keys of job files, table by table; each is a flag too, by the same name with hyphens.
#
# docs/jobs.md explains them; a test keeps the page and these tables equal.

UNITS_OF_TABLES = ("mm", "in")
"""Units that the lengths of a tool table may have."""

_LINES = ("profile", "pocket", "engrave")
_LAYERED = ("profile", "pocket", "engrave", "vcarve")
_CLEARING = ("profile", "pocket")
_PROFILE = ("profile",)
_POCKET = ("pocket",)
_DRILL = ("drill",)
_MIRRORS = ("x", "y")

WHOLE = {
    "safe_z": Key("safe_z_mm", plain(length), "Height of rapids above Z0.", "LENGTH"),
    "minimise": Key(
        "minimise",
        word(GOALS),
        "Order and starts for short rapids, or few reversals while cutting.",
        choices=GOALS,
    ),
    "approach": Key("approach", plain(switch), "Take up the play of X and Y before every cut."),
    "frames": Key(
        "frames",
        plain(layers),
        "Layers that hold no edges of parts: frames, stock.",
        "PATTERNS",
    ),
    "tool_table": Key("tool_table", plain(text), "LinuxCNC's tool table.", "FILE"),
    "tool_table_units": Key(
        "tool_table_units", word(UNITS_OF_TABLES), "Of its lengths.  [mm]", choices=UNITS_OF_TABLES
    ),
}
"""Keys of the job as a whole."""

PLACE = {
    "origin": Key(
        "origin", plain(origin), "Part zero: drawing, lower-left, centre, or x,y.", "PLACE"
    ),
    "mirror": Key("mirror", word(_MIRRORS), "Turn the sign of x, or of y.", choices=_MIRRORS),
    "rotate": Key("rotate_rad", plain(angle), "Counterclockwise, in degrees.", "ANGLE"),
    "scale": Key("scale", plain(number), "Times as large.", "FACTOR"),
    "fit": Key("fit_mm", plain(lengths), "As large as fits (8x6mm; 0: any).", "WxH"),
    "copies": Key("copies", plain(counts), "Columns and rows of copies.", "NxM"),
    "pitch": Key("pitch_mm", plain(lengths), "From copy to copy (12x9mm).", "DXxDY"),
}
"""Keys of `[place]`, in the order in which they act, but that the origin comes last."""

STOCK = {
    "corner": Key("corner_mm", plain(lengths)),
    "size": Key("size_mm", plain(lengths)),
    "thickness": Key("thickness_mm", plain(length)),
    "spoilboard": Key("spoilboard_mm", plain(length)),
}
"""Keys of `[stock]`: all but the last must be there."""

_TIPS = ("v", "drill")
TOOL = {
    "diameter": Key("diameter_mm", plain(length), "0 for a point (default).", "LENGTH"),
    "kind": Key("kind", word(TOOL_KINDS), "Its shape.", choices=TOOL_KINDS),
    "tip_angle": Key(
        "tip_angle_rad", plain(angle), "Of a V bit or drill.", "ANGLE", only=("kind", _TIPS)
    ),
    "tip_diameter": Key(
        "tip_diameter_mm", plain(length), "Of a V bit cut off.", "LENGTH", only=("kind", ("v",))
    ),
    "number": Key("number", plain(whole)),
}
"""Keys of `[tools.NAME]`; with `tool_` before them, keys of an operation."""

TOOL_KEYS = {f"tool_{name}": key for name, key in TOOL.items() if name != "number"}
"""The tool of an operation that names none, key by key."""

OPERATION = {
    "name": Key("name", plain(text), kinds=KINDS),
    "kind": Key("kind", word(KINDS), "What is done.  [profile]", choices=KINDS, kinds=KINDS),
    "layers": Key("layers", plain(patterns), kinds=KINDS),
    "colours": Key("colours", plain(colours), kinds=KINDS),
    "side": Key(
        "side",
        word(SIDES),
        "Where the tool runs; auto: outside of parts, inside of holes.",
        choices=("auto", "on", "outside", "inside"),
        kinds=_PROFILE,
    ),
    "direction": Key(
        "direction", word(DIRECTIONS), "Which way round.", choices=DIRECTIONS, kinds=_CLEARING
    ),
    "allowance": Key(
        "allowance_mm", plain(length), "Left on the wall.", "LENGTH", kinds=_CLEARING
    ),
    "feed": Key("feed_mm_min", plain(feed), "In mm/min.", "FEED", kinds=KINDS),
    "plunge_feed": Key("plunge_feed_mm_min", plain(feed), "In mm/min.", "FEED", kinds=KINDS),
    "spindle": Key("spindle_rpm", plain(number), "In rev/min; none: off.", "SPEED", kinds=KINDS),
    "depth": Key("depth_mm", plain(length), "Depth of cut below Z0.", "LENGTH", kinds=KINDS),
    "step_down": Key("step_down_mm", plain(length), "Depth of a pass.", "LENGTH", kinds=_LAYERED),
    "last_pass": Key(
        "last_pass_mm", plain(length), "Depth of the last pass.", "LENGTH", kinds=_LAYERED
    ),
    "entry": Key(
        "entry", entry, "plunge, ramp:3deg, or helix:3deg:1mm in pockets.", "ENTRY", kinds=_LINES
    ),
    "lead_in": Key("lead_in", lead, "none, line:1mm or arc:1mm.", "LEAD", kinds=_PROFILE),
    "lead_out": Key("lead_out", lead, "The same at the end.", "LEAD", kinds=_PROFILE),
    "overlap": Key(
        "overlap_mm",
        plain(length),
        "Cut beyond the start.",
        "LENGTH",
        kinds=("profile", "engrave"),
    ),
    "start": Key(
        "start",
        plain(start),
        "nearest, longest-line, corner, or x,y.",
        "START",
        kinds=("profile", "engrave"),
    ),
    "tabs": Key(
        "tabs", tabs, "How many (4), or how far apart (20mm); 4:2mm:0.5mm.", "TABS", kinds=_PROFILE
    ),
    "corners": Key(
        "corners", word(CORNERS), "Relief of inner corners.", choices=CORNERS, kinds=_PROFILE
    ),
    "joins": Key(
        "joins", word(JOINS), "The tool's way round outer corners.", choices=JOINS, kinds=_PROFILE
    ),
    "mitre_limit": Key(
        "mitre_limit",
        plain(number),
        "How long a mitre may be.",
        "FACTOR",
        kinds=_PROFILE,
        only=("joins", ("mitre",)),
    ),
    "pattern": Key(
        "pattern", word(PATTERNS), "How a pocket is cleared.", choices=PATTERNS, kinds=_POCKET
    ),
    "step_over": Key(
        "step_over", plain(fraction), "Part of the diameter (0.4, 40%).", "PART", kinds=_POCKET
    ),
    "angle": Key(
        "angle_rad",
        plain(angle),
        "Of a zigzag.",
        "ANGLE",
        kinds=_POCKET,
        only=("pattern", ("zigzag",)),
    ),
    "peck": Key(
        "peck_mm", plain(length), "How deep a drill goes at a time.", "LENGTH", kinds=_DRILL
    ),
    "dwell": Key("dwell_s", plain(time), "At the bottom, in s.", "TIME", kinds=_DRILL),
    "max_hole": Key(
        "max_hole_mm", plain(length), "The largest circle that is drilled.", "LENGTH", kinds=_DRILL
    ),
}
"""Keys of an operation, but for its tool."""

TOOL_NAME = "tool"
"""Key of an operation: the name of a tool of the file, or its number."""
