"""The keys of job files: the field that each fills, and the flag that says the same.

    WHOLE, PLACE, STOCK, KEEP_OUT, SETUP, TOOL, OPERATION: every key, table by table
    FLAGS: those that are flags

Kinds of operations name the keys that they know, and may bring keys of their own
(`camtool.planning.kinds`). docs/jobs.md explains the keys; a test keeps the page and these tables
equal."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from camtool.errors import OptionError
from camtool.importers.options import TEXTS, colour_named
from camtool.keys import (
    ANGLE,
    COUNT,
    FACTOR,
    FEED,
    LENGTH,
    PATTERNS_OF_NAMES,
    SWITCH,
    TEXT,
    TIME,
    Given,
    Key,
    Table,
    Value,
    fraction,
    length,
    meant,
    number,
    number_text,
    one_of,
    patterns,
    plain,
    record_of,
    refuse_idle,
    text,
    whole_number,
    word,
)
from camtool.patterns import guess
from camtool.planning.job import (
    ALLOWED,
    COOLANTS,
    CORNERS,
    DIRECTIONS,
    ENTRIES,
    GOALS,
    JOINS,
    LEADS,
    ORIGINS,
    PATTERNS,
    SELECTED,
    SIDES,
    STARTS,
    TOOL_KINDS,
    ZEROS,
    Entry,
    Lead,
    Tabs,
)
from camtool.planning.kinds import broken_kinds, installed_kinds, kind_named

_T = TypeVar("_T")

_PAIR = re.compile(r"(.+?)\s*[x×]\s*([-+.\d].*)")
_UNIT = re.compile(r"[^\d\s.+/-].*$")
_COUNT = re.compile(r"\s*\d+\s*(:|$)")
_WILD = re.compile(r"[*?\[]")


def layers(value: object) -> tuple[str, ...]:
    """Return patterns from a list, or from a text with commas between them."""
    if isinstance(value, str):
        value = [word.strip() for word in value.split(",")]
    return patterns(value)


def words(value: object) -> tuple[str, ...]:
    """Return the words of `select` from a list, or from a text with commas between them."""
    return tuple(word(SELECTED)(Given(each, "")) for each in layers(value))


def names(value: object) -> tuple[str, ...]:
    """Return the operation names of a list; OptionError if it is empty or no list."""
    if not isinstance(value, list) or not value:
        raise OptionError(f"{value!r} is no list of names", mend='write it like ["holes", "edge"]')
    return tuple(text(each) for each in value)


def allowed(value: object) -> tuple[str, ...]:
    """Return the words of `allow` from a list, or from a text with commas between them."""
    return tuple(word(ALLOWED)(Given(each, "")) for each in layers(value))


def length_range(value: object) -> tuple[float, float]:
    """Read a range of lengths, such as ["3mm", "8mm"] or "3..8mm", and return its ends in mm. In a
    text one end may be missing (0 or inf), and a unit at the end holds for both."""
    return _range(value, length)


def number_range(value: object) -> tuple[float, float]:
    """Read a range of numbers, such as [10, 200] or "10..200"."""
    return _range(value, number)


def span(value: object) -> tuple[float, float]:
    """Read a range of coordinates, such as ["-5mm", "8mm"] or "-5..8mm", and return its ends in
    mm; a missing end is infinite."""
    return _range(value, length, -math.inf)


def _range(
    value: object, convert: Callable[[object], float], min_value: float = 0.0
) -> tuple[float, float]:
    if not isinstance(value, str):
        return _pair(value, convert, '["3mm", "8mm"]')
    one, dots, high = (part.strip() for part in value.partition(".."))
    if not dots or not (one or high):
        raise OptionError(f"{value!r} is no range", mend='write it like "3..8mm"')
    unit = _UNIT.search(high)
    if one and unit and not _UNIT.search(one):
        one += unit[0]
    return convert(one) if one else min_value, convert(high) if high else math.inf


def colours(value: object) -> tuple[str, ...]:
    """Return patterns of colours, written "#rrggbb" as in drawings; colour names and numbers are
    converted, wildcards kept."""
    if isinstance(value, list | tuple):
        value = [str(item) if type(item) is int else item for item in value]
    return tuple(
        each if not each or _WILD.search(each) else colour_named(each) for each in patterns(value)
    )


def lengths(value: object) -> tuple[float, float]:
    """Read two lengths, such as [12, "9mm"] or "12x9mm", and return them in mm; in a text a unit
    at the end holds for both."""
    if isinstance(value, str):
        match = _PAIR.fullmatch(value.strip())
        if match is None:
            raise OptionError(f"{value!r} is no pair of lengths", mend='write it like "12x9mm"')
        one, second = match.groups()
        unit = _UNIT.search(second)
        return length(one if unit is None or _UNIT.search(one) else one + unit[0]), length(second)
    return _pair(value, length, '["12mm", "9mm"]')


def counts(value: object) -> tuple[int, int]:
    """Read two whole numbers, such as [3, 2] or "3x2"."""
    if isinstance(value, str):
        match = _PAIR.fullmatch(value.strip())
        if match is None:
            raise OptionError(f"{value!r} is no pair of counts", mend='write it like "3x2"')
        return whole_number(match[1]), whole_number(match[2])
    return _pair(value, whole_number, "[3, 2]")


def origin(value: object) -> str | tuple[float, float]:
    """Read the key `origin`: one of ORIGINS, or a point [x, y] or "x,y", mm."""
    return _word_or_place(value, ORIGINS)


def start(value: object) -> str | tuple[float, float]:
    """Read the key `start`: one of STARTS, or a point [x, y] or "x,y", mm."""
    return _word_or_place(value, STARTS)


def zero(value: object) -> str | tuple[float, float]:
    """Read the key `zero`: one of ZEROS (places of the stock), or a point [x, y] or "x,y", mm."""
    return _word_or_place(value, tuple(ZEROS))


def places(value: object) -> tuple[tuple[float, float], ...]:
    """Read a list of points [x, y], mm."""
    if not isinstance(value, list | tuple):
        raise OptionError(f"{value!r} is no list of places", mend="write it like [[10, 5]]")
    return tuple(_pair(each, length, '["10mm", "5mm"]') for each in value)


def kind(raw: Given) -> str:
    """Read the name of a kind of operation; OptionError unless it is installed and loads."""
    if raw.value in broken_kinds():
        with raw.blamed():
            kind_named(raw.value)
    name: str = word(tuple(installed_kinds()))(raw)
    return name


def entry(raw: Given) -> Entry:
    """Read an entry move from a table, or from a text such as "ramp", "ramp:3deg" or
    "helix:3deg:1mm"."""
    return _record(Entry, ENTRY, _parts(raw, ENTRY, ("kind", "angle", "radius")))


def lead(raw: Given) -> Lead:
    """Read lead-in or lead-out from a table, or from a text such as "none", "line:1mm" or
    "arc:1mm"."""
    return _record(Lead, LEAD, _parts(raw, LEAD, ("kind", "length")))


def tabs(raw: Given) -> Tabs:
    """Read tabs from a table, or from a text: their count ("4") or spacing ("20mm"), optionally
    followed by ":width:height"."""
    value = raw.value
    is_count = type(value) is int or (isinstance(value, str) and _COUNT.match(value))
    first = "count" if is_count else "spacing"
    table = _parts(raw, TABS, (first, "width", "height"))
    base: dict[str, Any] = {"count": 1}
    if "spacing" in table.given:
        base = {"spacing_mm": 1.0}
    elif "at" in table.given:
        base = {"at_mm": ((0.0, 0.0),)}
    return record_of(Tabs, TABS, table, base)


def _record(make: Callable[..., _T], keys: Mapping[str, Key], table: Table) -> _T:
    record = record_of(make, keys, table)
    refuse_idle(keys, table, record)
    return record


def _part_of(raw: Given, known_keys: Iterable[str]) -> Table:
    """Convert an inline table that is the value of a key, such as `entry = {kind = "ramp"}`;
    OptionError for an unknown key in it."""
    parts = {}
    for name, value in raw.value.items():
        parts[name] = Given(value, f"{raw.where}.{name}", raw.file)
        if name not in known_keys:
            raise parts[name].refused("unknown key", meant(name, known_keys))
    return Table(parts, raw.where, raw.file)


def _parts(raw: Given, keys: Mapping[str, Key], names: Sequence[str]) -> Table:
    """Convert an inline table, or a text "a:b:c" whose parts are the values of `names` in
    order."""
    if isinstance(raw.value, dict):
        return _part_of(raw, keys)
    with raw.blamed():
        texts = number_text(raw.value).split(":")
        if len(texts) > len(names):
            raise OptionError(
                f"{raw.value!r} has too many parts", mend=f"write it like {':'.join(names)}"
            )
    parts = {
        name: Given(part, raw.where, raw.file) for name, part in zip(names, texts, strict=False)
    }
    return Table(parts, raw.where, raw.file)


def _word_or_place(value: object, words: Sequence[str]) -> str | tuple[float, float]:
    """Return the value if it is one of `words`; else read it as a point, from a list of two
    lengths or a text with a comma."""
    if isinstance(value, list | tuple):
        return _pair(value, length, '["10mm", "5mm"]')
    name = text(value)
    if name in words:
        return name
    places = name.split(",")
    if len(places) != 2:
        raise OptionError(
            f"{name!r} is no place",
            mend=f"{guess(name, words)}use one of {', '.join(words)}, or x,y",
        )
    return length(places[0]), length(places[1])


def _pair(value: object, convert: Callable[[object], _T], example: str) -> tuple[_T, _T]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise OptionError(f"{value!r} is no list of two", mend=f"write it like {example}")
    return convert(value[0]), convert(value[1])


# The values of keys.

LENGTHS = Value(plain(length_range), "RANGE")
NUMBERS = Value(plain(number_range), "RANGE")
SPAN = Value(plain(span), "RANGE")


# Tables that are values: `entry`, `lead_in` and `lead_out`, `tabs`.

ENTRY = {
    "kind": Key("kind", one_of(ENTRIES)),
    "angle": Key("angle_rad", ANGLE, only=("kind", ("ramp", "helix"))),
    "radius": Key("radius_mm", LENGTH, only=("kind", ("helix",))),
}
LEAD = {
    "kind": Key("kind", one_of(LEADS)),
    "length": Key("length_mm", LENGTH, only=("kind", ("line", "arc"))),
}
TABS = {
    "count": Key("count", COUNT),
    "spacing": Key("spacing_mm", LENGTH),
    "at": Key("at_mm", Value(plain(places))),
    "width": Key("width_mm", LENGTH),
    "height": Key("height_mm", LENGTH),
    "ramped": Key("ramped", SWITCH),
}

# The keys, table by table.

UNITS_OF_TABLES = ("mm", "in")

WHOLE = {
    "safe_z": Key("safe_z_mm", LENGTH, "Height of rapids above Z0.", '"1mm"'),
    "minimise": Key(
        "minimise",
        one_of(GOALS),
        "Order and starts for short rapids, or few reversals while cutting.",
        '"reversals"',
    ),
    "approach": Key(
        "approach", SWITCH, "Take up the backlash of X and Y before every cut.", "true"
    ),
    "compensate": Key(
        "compensate",
        SWITCH,
        "Compensate the path for the machine's backlash, scale and squareness.",
        "true",
    ),
    "allow": Key(
        "allow",
        Value(plain(allowed), "WORDS"),
        "What is no error here: long, off-stock.",
        '["off-stock"]',
    ),
    "frames": Key(
        "frames",
        Value(plain(layers), "PATTERNS"),
        "Layers that hold no edges of parts: frames, stock.",
        '["SHEET"]',
    ),
    "text": Key(
        "text",
        one_of(TEXTS),
        "How text of the drawing is read, where --text does not say it.",
        '"stroke"',
    ),
    "material": Key(
        "material", Value(plain(text), "NAME"), "What is cut: whose presets tools have."
    ),
    "tool_library": Key(
        "tool_library", Value(plain(text), "FILE"), "A library of tools.", '"tools.toml"'
    ),
    "tool_table": Key(
        "tool_table", Value(plain(text), "FILE"), "LinuxCNC's tool table.", '"tool.tbl"'
    ),
    "tool_table_units": Key(
        "tool_table_units", one_of(UNITS_OF_TABLES), "Of its lengths.  [mm]", '"mm"'
    ),
}

PLACE = {
    "origin": Key(
        "origin", Value(plain(origin), "PLACE"), "Part zero: drawing, lower-left, centre, or x,y."
    ),
    "mirror": Key("mirror", one_of(("x", "y")), "Turn the sign of x, or of y.", '"x"'),
    "rotate": Key("rotate_rad", ANGLE, "Counterclockwise, in degrees.", '"90deg"'),
    "scale": Key("scale", FACTOR, "Scale factor."),
    "fit": Key(
        "fit_mm", Value(plain(lengths), "WxH"), "As large as fits (8x6mm; 0: any).", '"8x6mm"'
    ),
    "copies": Key("copies", Value(plain(counts), "NxM"), "Columns and rows of copies.", '"3x2"'),
    "pitch": Key(
        "pitch_mm", Value(plain(lengths), "DXxDY"), "From copy to copy (12x9mm).", '"12x9mm"'
    ),
}
"""Keys of `[place]`, in the order in which they act, except that `origin` acts last."""

STOCK = {
    "corner": Key("corner_mm", Value(plain(lengths))),
    "size": Key("size_mm", Value(plain(lengths))),
    "thickness": Key("thickness_mm", LENGTH),
    "spoilboard": Key("spoilboard_mm", LENGTH),
}
"""Keys of `[stock]`; `thickness` is required."""

KEEP_OUT = {
    "name": Key("name", TEXT),
    "x": Key("x_mm", SPAN),
    "y": Key("y_mm", SPAN),
    "z": Key("z_mm", SPAN),
}
"""Keys of `[[keep_out]]`; `x` and `y` are required."""

SETUP = {
    "name": Key("name", TEXT),
    "operations": Key("operations", Value(plain(names))),
    "flip": Key("flip", one_of(("x", "y"))),
    "line": Key("line_mm", LENGTH),
    "pins": Key("pins_mm", Value(plain(places))),
    "flip_error": Key("flip_error_mm", LENGTH),
    "zero": Key("zero", Value(plain(zero))),
}
"""Keys of `[[setups]]`; `name` and `operations` are required."""

TOOL = {
    "diameter": Key("diameter_mm", LENGTH, "0 for a point (default)."),
    "kind": Key("kind", one_of(TOOL_KINDS), "Its shape.", '"v"'),
    "tip_angle": Key(
        "tip_angle_rad", ANGLE, "Of a V bit or drill.", '"60deg"', only=("kind", ("v", "drill"))
    ),
    "tip_diameter": Key(
        "tip_diameter_mm", LENGTH, "Of a V bit cut off.", '"0.1mm"', only=("kind", ("v",))
    ),
    "corner_radius": Key("corner_radius_mm", LENGTH, "Of a bull nose.", only=("kind", ("bull",))),
    "flutes": Key("flutes", COUNT, "How many edges it has.", "2"),
    "cutting_length": Key("cutting_length_mm", LENGTH, "How long they are.", '"12mm"'),
    "shank_diameter": Key("shank_diameter_mm", LENGTH),
    "stickout": Key("stickout_mm", LENGTH),
    "holder_diameter": Key("holder_diameter_mm", LENGTH),
    "holder_length": Key("holder_length_mm", LENGTH),
    "centre_cutting": Key("centre_cutting", SWITCH),
    "chip_load": Key("chip_load_mm", LENGTHS),
    "surface_speed": Key("surface_speed_m_min", NUMBERS),
    "number": Key("number", COUNT, example="1"),
}
"""Keys of `[tools.NAME]`; those with a help text are, with the prefix `tool_`, also keys of
operations."""

LIMITS = {name: TOOL[name] for name in ("chip_load", "surface_speed")}
"""Keys of a tool that its presets may have too."""

TOOL_NAME = "tool"
"""Key of an operation: the name of a tool of the file, or its number."""

FINISH_TOOL = "finish_tool"
"""Key of an operation: the tool of its finishing pass, by name or number."""

TOOL_KEYS = {f"tool_{name}": key for name, key in TOOL.items() if key.help}
"""Keys of an operation that describe its tool key by key, if it names none."""


OPERATION = {
    "name": Key("name", TEXT),
    "kind": Key("kind", Value(kind, choices=tuple(installed_kinds())), "What is done.  [profile]"),
    "layers": Key("layers", PATTERNS_OF_NAMES),
    "colours": Key("colours", Value(plain(colours))),
    "select": Key(
        "select",
        Value(plain(words), "WORDS"),
        "Only closed, open, outer, inner, circle, not circle, point; several: all of it.",
        '["inner", "circle"]',
    ),
    "select_size": Key("size_mm", LENGTHS, "And so large.", '"3..8mm"'),
    "select_area": Key("area_mm2", NUMBERS, "And of such an area, mm².", '"10..200"'),
    "select_entities": Key(
        "entities", Value(plain(layers), "NAMES"), "And these by handle or id.", '["2F"]'
    ),
    "side": Key(
        "side",
        Value(word(SIDES), choices=("auto", "on", "outside", "inside")),
        "Where the tool runs; auto: outside of parts, inside of holes.",
        '"auto"',
    ),
    "direction": Key("direction", one_of(DIRECTIONS), "Which way round.", '"climb"'),
    "chamfer": Key("chamfer_mm", LENGTH, "Its width from above.", '"0.5mm"'),
    "tip_offset": Key("tip_offset_mm", LENGTH, "Its bit's tip below it.", '"0.1mm"'),
    "allowance": Key(
        "allowance_mm", LENGTH, "Left on the wall; below 0: cut beyond the line.", '"0.1mm"'
    ),
    "finish": Key("finish_mm", LENGTH, "Left for a last pass.", '"0.1mm"'),
    "finish_feed": Key("finish_feed_mm_min", FEED, "Of that pass."),
    "finish_spindle": Key("finish_spindle_rpm", Value(plain(number), "SPEED"), "Of that pass."),
    FINISH_TOOL: Key("finish_tool", Value(lambda given: given.value, "NAME"), "Of that pass."),
    "feed": Key("feed_mm_min", FEED, "In mm/min.", '"90mm/min"'),
    "plunge_feed": Key("plunge_feed_mm_min", FEED, "In mm/min.", '"30mm/min"'),
    "spindle": Key(
        "spindle_rpm",
        Value(plain(number), "SPEED"),
        "In rev/min; 0: off.  [the machine's]",
        "12000",
    ),
    "coolant": Key("coolant", one_of(COOLANTS), "M7, M8 or both.", '"mist"'),
    "depth": Key("depth_mm", LENGTH, "Depth of cut below Z0.", '"1mm"'),
    "breakthrough": Key("breakthrough_mm", LENGTH, "Or so far below the stock."),
    "step_down": Key("step_down_mm", LENGTH, "Depth of a pass.", '"0.5mm"'),
    "last_pass": Key("last_pass_mm", LENGTH, "Depth of the last pass.", '"0.1mm"'),
    "entry": Key(
        "entry",
        Value(entry, "ENTRY", tables=True),
        "plunge, ramp:3deg, or helix:3deg:1mm in pockets.",
        '"ramp:3deg"',
    ),
    "lead_in": Key(
        "lead_in", Value(lead, "LEAD", tables=True), "none, line:1mm or arc:1mm.", '"arc:1mm"'
    ),
    "lead_out": Key(
        "lead_out", Value(lead, "LEAD", tables=True), "The same at the end.", '"arc:1mm"'
    ),
    "overlap": Key("overlap_mm", LENGTH, "Cut beyond the start.", '"0.2mm"'),
    "start": Key(
        "start",
        Value(plain(start), "START"),
        "nearest, longest-line, corner, or x,y.",
        '"longest-line"',
    ),
    "tabs": Key(
        "tabs",
        Value(tabs, "TABS", tables=True),
        "How many (4), or how far apart (20mm); 4:2mm:0.5mm.",
        '"4:2mm:0.5mm"',
    ),
    "corners": Key("corners", one_of(CORNERS), "Relief of inner corners.", '"dogbone"'),
    "joins": Key("joins", one_of(JOINS), "The tool's path around outer corners.", '"mitre"'),
    "mitre_limit": Key(
        "mitre_limit", FACTOR, "How long a mitre may be.", "2.0", only=("joins", ("mitre",))
    ),
    "pattern": Key("pattern", one_of(PATTERNS), "How a pocket is cleared."),
    "rest": Key("rest", TEXT),
    "step_over": Key(
        "step_over", Value(plain(fraction), "PART"), "Part of the diameter (0.4, 40%)."
    ),
    "angle": Key("angle_rad", ANGLE, "Of a zigzag.", only=("pattern", ("zigzag",))),
    "peck": Key("peck_mm", LENGTH, "How deep a drill goes at a time.", '"0.2mm"'),
    "dwell": Key("dwell_s", TIME, "At the bottom, in s.", '"0.5s"'),
    "max_hole": Key("max_hole_mm", LENGTH, "The largest circle that is drilled.", '"3mm"'),
}
for _contract in installed_kinds().values():
    OPERATION |= _contract.own
"""Keys of an operation, but for its tool; those that its kind alone has come last."""


def is_known(name: str, kind: str) -> bool:
    """Return True if operations of this kind have the key `name` of OPERATION."""
    contract = kind_named(kind)
    return name in contract.keys or name in contract.own


PRESET = {
    **{
        name: OPERATION[name]
        for name in ("feed", "plunge_feed", "spindle", "coolant", "step_down", "step_over", "peck")
    },
    **LIMITS,
}
"""Keys of `[tools.NAME.presets.MATERIAL]`."""

# The same keys by other names: as flags, and as fields from Python.

FLAGS: dict[str, dict[str, Key]] = {
    "Job (every key of docs/jobs.md is a flag)": {
        name: key for name, key in WHOLE.items() if name != "text"
    },
    "Where the drawing lies, in this order": {
        **{name: key for name, key in PLACE.items() if name != "origin"},
        "origin": PLACE["origin"],
    },
    "Tool": {
        TOOL_NAME: Key("tool", Value(plain(text), "NAME"), "A tool of the file, or its number."),
        **TOOL_KEYS,
    },
    "How it is cut": {name: key for name, key in OPERATION.items() if key.help},
}
"""The keys that are also flags, under the headings of the help. `--text` is a flag of drawings."""

_FLAGS_OF_OTHER_NAMES = {"tool_tip_angle": "--tool-angle"}

_FIELDS: dict[str, Key] = {
    **{key.field: key for keys in (OPERATION, WHOLE, PLACE) for key in keys.values()},
    **{f"tool_{key.field}": key for key in TOOL_KEYS.values()},
}


def flag_name(name: str) -> str:
    """Return the command-line flag for a key of job files."""
    return _FLAGS_OF_OTHER_NAMES.get(name, f"--{name.replace('_', '-')}")


def field_value(name: str, value: Any) -> Any:
    """Convert a value given in Python for a field of Operation, Job, Placement or (with the prefix
    `tool_`) Tool. Texts, lists and tables are read as in a job file, and so are numbers for fields
    that hold records; other values are returned unchanged."""
    key = _FIELDS.get(name)
    if name == "layers" and isinstance(value, str):
        return layers(value)
    if key is None or isinstance(value, bool):
        return value
    if isinstance(value, str | list | tuple | dict) or (
        key.value.tables and isinstance(value, int | float)
    ):
        return key.read(Given(value, name))
    return value
