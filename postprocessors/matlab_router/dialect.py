"""The keys of `[dialect]` and `[controller]` of a matlab-router machine.

The thesis's text, its listing and what is safe to send differ; `profile` chooses between them as
a whole, and each option of its own overrides its profile. `Lnnnn` are lines of the thesis."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta, Struct

from camtool.errors import MachineError
from camtool.machine.model import Link, Machine, SlideStart
from camtool.machine.ranges import Depth, FeedRate, Speed, Step, Tolerance

UNIT_MM: Final = 0.1
"""Positions and distances are whole tenths of a millimetre (L3202-3204, L4444-4445)."""

UNITS_PER_MM: Final = 10

GRID_TOLERANCE: Final = 1e-9
"""`grid_mm` is a whole multiple of the unit within this part of a unit."""

CHUNK_UNITS: Final = 2
"""The slaves run chunks of 0.2 mm: `factor = deci_mm / 2`, an integer division (L5589-5600)."""

FIXED_Y_UNITS: Final = 200
"""The listed master sends this to the Y slave instead of the first point (state 1, L4822)."""

MAX_NUMBER: Final = 32767
"""Every number is a signed int16 in the master (L4625-4635)."""

LineCount = Annotated[int, Meta(ge=1, le=255)]


class MatlabRouterDialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The `[dialect]` table as written; None leaves the choice to the profile."""

    profile: Literal["safe", "listing", "text"] = "safe"
    format: Literal["m", "stream"] = "m"
    speed: Literal["axis", "path"] = "axis"
    too_fast: Literal["refused", "limited"] = "refused"
    # Half the grid: with more, chords leave their arc farther than its snapped vertices may.
    arc_tolerance_mm: Annotated[float, Meta(ge=1e-6, le=0.1)] = 0.05
    bend_tolerance_mm: Tolerance = 0.1
    plunge_mm: Depth = 10.0
    plunge_mm_min: FeedRate = 234.375
    spindle_rpm: Speed | None = None
    grid_mm: Step | None = None
    max_lines: LineCount | None = None
    odd: Literal["truncated", "kept"] | None = None
    first_y: Literal["number", "character"] | None = None
    master_y: Literal["sent", "fixed"] | None = None
    end: Literal["off", "raise"] | None = None
    baud: Annotated[int, Meta(ge=1, le=1_000_000_000)] | None = None
    data_bits: Literal[7, 8] | None = None


PROFILES: Final[dict[str, dict[str, Any]]] = {
    # What the machine of the listing executes, with the faults of its transmission mended.
    "safe": {
        "grid_mm": 0.2,
        "max_lines": 128,
        "odd": "truncated",
        "first_y": "number",
        "master_y": "sent",
        "end": "off",
        "baud": 9600,
        "data_bits": 8,
    },
    # Appendix A as it stands (Matlab L4271-4515, master L4563-4985, slave X L5104-5729).
    "listing": {
        "grid_mm": 0.1,
        "max_lines": 128,
        "odd": "truncated",
        "first_y": "character",
        "master_y": "fixed",
        "end": "off",
        "baud": 9600,
        "data_bits": 7,
    },
    # What the chapters say (L3144-3181, L3202-3204, L3319-3321).
    "text": {
        "grid_mm": 0.1,
        "max_lines": 255,
        "odd": "kept",
        "first_y": "number",
        "master_y": "sent",
        "end": "raise",
        "baud": 921600,
        "data_bits": 8,
    },
}


class ResolvedDialect(Struct, frozen=True):
    """Every choice made, by the table or by its profile.

    `format` "m": the arrays as a Matlab file; "stream": the bytes of the serial line.
    `speed`: what a feed is: that of the faster axis, as the GUI computes ("axis"), or that of the
    tool along its line ("path").
    `too_fast`: a feed above the highest speed of an axis is refused, or becomes that speed.
    `grid_units`: positions are whole multiples of so many tenths of a millimetre.
    `odd`: distances lose their odd tenth in the slaves, or do not.
    `first_y`: y of the first point is sent as digits, or as one character (L4306).
    `master_y`: the master passes it on, or always takes `FIXED_Y_UNITS`.
    `end`: after its last line the tool is switched off where it stands, or also raised and sent
    home (L3319-3321).
    `max_lines` of one job; `arc_tolerance_mm` chords of arcs; `bend_tolerance_mm` how far whole
    speeds may bend a line. `plunge_mm` down from home, at `plunge_mm_min`. `spindle_rpm` is what
    the reader gives for the tool, which can only be switched."""

    profile: str
    format: str
    speed: str
    too_fast: str
    grid_units: int
    max_lines: int
    odd: str
    first_y: str
    master_y: str
    end: str
    baud: int
    data_bits: int
    arc_tolerance_mm: float
    bend_tolerance_mm: float
    plunge_mm: float
    plunge_mm_min: float
    spindle_rpm: float | None


PlantGain = Annotated[float, Meta(ge=1e-6, le=1000.0)]
Seconds = Annotated[float, Meta(ge=1e-6, le=60.0)]
Pause = Annotated[float, Meta(ge=0.0, le=10.0)]
Percent = Annotated[float, Meta(ge=0.0, le=60.0)]
Gain = Annotated[float, Meta(ge=0.0, le=100_000.0)]
ServoSpeed = Annotated[int, Meta(ge=1, le=1023)]
Phase = Annotated[int, Meta(ge=0, le=1023)]
Chunk = Annotated[int, Meta(ge=2048, le=32767)]
Gap = Annotated[float, Meta(ge=0.005, le=10.0)]


class MatlabRouterController(SlideStart, frozen=True, tag_field="model", tag="matlab-router"):
    """The slaves of the Matlab router, and the options of its model; X, Y, Z in threes.

    `slaves` "listing": slave X's program (L5104-5729) on all axes; "text": what the chapters say
    (equations 4.15-4.18, 4.27, 4.48, 4.49 and the gains of table 4.1).
    `plant_gain` (counts in 5 ms for a percent of drive) and `time_constant_s`: the motors, worked
    out of table 4.1 (L2872-2880). `friction_percent`: the drive that only just does not move them;
    the speed at 70 % (L2704) stays that of the gain.
    `kid`, `kpd`: gains in thousandths, whole ones for the listing's integers; None: 28 and 159
    (L5104-5106) or table 4.1, as `slaves` says.
    `table_counts`: the speed of the deceleration table 1000 counts before the end (not listed).
    `chunk_counts`: counts of 0.2 mm (L6169-6171). `home_counts`: speed of homing (L5741, L6275,
    L6829). `home_phase_counts`: what the encoders show at home, which homing does not clear.
    `pause_s`: behind homing, the first point and the plunge; `turnaround_s` between two lines,
    and `start_lag_s` from X to Y: the master's I2C messages at 50 kHz (L4718-4929).
    `header_pause_s` and `number_pause_s`: behind each of a job's first three numbers and behind
    the others (L4294-4360)."""

    slaves: Literal["listing", "text"] = "listing"
    plant_gain: tuple[PlantGain, PlantGain, PlantGain] = (8.896, 5.599, 9.767)
    time_constant_s: tuple[Seconds, Seconds, Seconds] = (0.0610, 0.0616, 0.0620)
    friction_percent: tuple[Percent, Percent, Percent] = (0.0, 0.0, 0.0)
    kid: tuple[Gain, Gain, Gain] | None = None
    kpd: tuple[Gain, Gain, Gain] | None = None
    table_counts: ServoSpeed = 480
    chunk_counts: tuple[Chunk, Chunk, Chunk] = (5120, 5120, 5954)
    home_counts: tuple[ServoSpeed, ServoSpeed, ServoSpeed] = (700, 550, 500)
    home_phase_counts: tuple[Phase, Phase, Phase] = (0, 0, 0)
    pause_s: Gap = 0.15
    turnaround_s: Gap = 0.0062
    start_lag_s: Annotated[float, Meta(ge=0.0, le=0.005)] = 0.0004
    header_pause_s: Pause = 0.01
    number_pause_s: Pause = 0.001


class MatlabRouterLink(Link, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options for what the thesis leaves open. `echo`: whether the master sends back what it
    takes, as the library of its compiler does; "detected": it is looked for behind the first
    number of a job. `reset`: who resets the master before the next job: the user by "hand", the
    "opening" of the port, or "none" where a master takes one job after the other. `margin_s`: how
    long a job is left alone beyond its simulated time."""

    echo: Literal["detected", "echo", "none"] = "detected"
    reset: Literal["hand", "opening", "none"] = "hand"
    margin_s: Annotated[float, Meta(ge=0.0, le=600.0)] = 2.0


MatlabRouterMachine = Machine[SlideStart, MatlabRouterDialect]


def dialect_of(machine: MatlabRouterMachine) -> ResolvedDialect:
    """Return every choice that the machine's `[dialect]` makes; MachineError where it makes
    none."""
    table = machine.dialect
    choices = {
        name: value
        for name, value in msgspec.structs.asdict(table).items()
        if name not in PROFILES["safe"] or value is not None
    }
    choices = {**PROFILES[table.profile], **choices}
    grid_mm = choices.pop("grid_mm")
    units = round(grid_mm * UNITS_PER_MM)
    if not math.isclose(units, grid_mm * UNITS_PER_MM, rel_tol=0.0, abs_tol=GRID_TOLERANCE):
        raise MachineError(
            f"{grid_mm:g} mm is no multiple of {UNIT_MM} mm, the unit of this machine",
            file=machine.target.name,
            where="table [dialect], key grid_mm",
            mend="use 0.2, the chunk that the slaves execute, or 0.1",
        )
    return ResolvedDialect(grid_units=units, **choices)


def cut_z_mm(machine: MatlabRouterMachine, dialect: ResolvedDialect) -> float:
    """Return the Z of all cuts, mm in the work frame: the plunge has one length and always starts
    from home."""
    return machine.controller.machine_zero_mm[2] - dialect.plunge_mm
