"""What the controllers of planners may be set to: the keys of `[controller]` for each `model`."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from camtool.machine.model import SlideStart
from camtool.machine.ranges import Acceleration, Slack

Speed = Annotated[float, Meta(ge=1e-4, le=1e5)]
"""mm/s: to 100 m/s."""

CornerSpeed = Annotated[float, Meta(ge=0.0, le=1e4)]
"""mm/s in a corner, or 0 for a stop."""

Jerk = Annotated[float, Meta(ge=1e-4, le=1e4)]
"""mm/s by which an axis may change its speed at once."""

ChordLength = Annotated[float, Meta(ge=1e-3, le=100.0)]
"""mm of the chords of an arc."""


class KlipperController(SlideStart, frozen=True, tag_field="model", tag="klipper"):
    """A machine on Klipper: the keys of `[printer]` of its printer.cfg, and of `[gcode_arcs]`.

    `max_z_velocity_mm_s`, `max_z_accel_mm_s2`: those of all axes where they are left out.
    `square_corner_velocity_mm_s`: the speed at which it takes a corner of 90°.
    `minimum_cruise_ratio`: the part of a short move that must be cruised. `arc_resolution_mm`:
    length of the chords."""

    max_velocity_mm_s: Speed
    max_accel_mm_s2: Acceleration
    max_z_velocity_mm_s: Speed | None = None
    max_z_accel_mm_s2: Acceleration | None = None
    square_corner_velocity_mm_s: CornerSpeed = 5.0
    minimum_cruise_ratio: Annotated[float, Meta(ge=0.0, le=0.999)] = 0.5
    arc_resolution_mm: ChordLength = 1.0


class MarlinController(SlideStart, frozen=True, tag_field="model", tag="marlin"):
    """A machine on Marlin 2: its settings (M503) and options of Configuration.h and _adv.h.

    Its M203 and M201 are the axes' `max_rate_mm_min` and `acceleration_mm_s2`.
    `travel_acceleration_mm_s2`: M204 T. `junction_deviation_mm`: M205 J, or `classic_jerk_mm_s`:
    M205 X Y Z of a firmware with CLASSIC_JERK, which then counts alone. `small_segments`:
    JD_HANDLE_SMALL_SEGMENTS. `mm_per_arc_segment`, `min_arc_segments`, `arc_correction`,
    `min_steps` and `buffer_blocks`: MM_PER_ARC_SEGMENT, MIN_ARC_SEGMENTS, N_ARC_CORRECTION,
    MIN_STEPS_PER_SEGMENT, BLOCK_BUFFER_SIZE. `min_step_hz`: MINIMAL_STEP_RATE.
    `min_segment_ms`: M205 B of a firmware with SLOWDOWN, 0 without."""

    travel_acceleration_mm_s2: Acceleration
    junction_deviation_mm: Slack = 0.013
    classic_jerk_mm_s: tuple[Jerk, Jerk, Jerk] | None = None
    small_segments: bool = True
    mm_per_arc_segment: ChordLength = 1.0
    min_arc_segments: Annotated[int, Meta(ge=1, le=10_000)] = 24
    arc_correction: Annotated[int, Meta(ge=1, le=127)] = 25
    min_steps: Annotated[int, Meta(ge=1, le=1000)] = 6
    buffer_blocks: Annotated[int, Meta(ge=4, le=1024)] = 16
    min_step_hz: Annotated[float, Meta(ge=1.0, le=10_000.0)] = 120.0
    min_segment_ms: Annotated[float, Meta(ge=0.0, le=1000.0)] = 20.0


class TrapezoidController(SlideStart, frozen=True, tag_field="model", tag="trapezoid"):
    """A controller by what was measured of it. The axes' `acceleration_mm_s2` and
    `max_rate_mm_min` are needed. `corner_mm_s`: the speed at which it takes a corner of 90°, 0
    where it stops at each. `buffer_blocks`: how many moves it looks ahead."""

    corner_mm_s: CornerSpeed = 0.0
    buffer_blocks: Annotated[int, Meta(ge=2, le=10_000)] = 100
