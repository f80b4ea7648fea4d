"""The keys of job files, table by table; each is a flag too, by the same name with hyphens.

docs/jobs.md explains them; a test keeps the page and these tables equal.
"""

from __future__ import annotations

from camtool.jobs.given import Key
from camtool.jobs.values import (
    angle,
    colours,
    counts,
    entry,
    feed,
    fraction,
    layers,
    lead,
    length,
    lengths,
    number,
    origin,
    patterns,
    plain,
    start,
    switch,
    tabs,
    text,
    time,
    whole,
    word,
)
from camtool.planning.job import (
    CORNERS,
    DIRECTIONS,
    GOALS,
    JOINS,
    KINDS,
    PATTERNS,
    SIDES,
    TOOL_KINDS,
)

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
