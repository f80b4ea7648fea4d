"""The keys of `[dialect]` and `[controller]` of a grbl machine."""

from __future__ import annotations

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from camtool.machine.model import Machine, SlideStart
from camtool.machine.ranges import Place, Seconds, Slack, Tolerance

from ..gcode.dialect import GcodeDialect

MAX_TOOL: Final = 255
"""Tools beyond it are grbl's error 38 (`MAX_TOOL_NUMBER`, gcode.c)."""


Frame = Literal["G54", "G55", "G56", "G57", "G58", "G59"]

Home = Literal["G28", "G30"]

Spot = tuple[Place, Place, Place]


class GrblDialect(GcodeDialect, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """`tool_change`: grbl knows no M6, so between cuts the program says the tool and stops until
    the operator goes on ("stop": `T2 M0`), stops so for the first tool too ("pause"), or is
    refused ("refuse"). `most_dwell_s`: grbl counts longer dwells wrong. What a program that is
    read may ask of the machine: `work_offsets_mm`, where G54 to G59 have their zero on it, and
    `homes_mm`, where G28 and G30 go."""

    tool_change: Literal["stop", "pause", "refuse"] = "stop"
    most_dwell_s: Seconds
    work_offsets_mm: dict[Frame, Spot] = msgspec.field(default_factory=dict)
    homes_mm: dict[Home, Spot] = msgspec.field(default_factory=dict)


class GrblController(SlideStart, frozen=True, tag_field="model", tag="grbl"):
    """A controller on grbl 1.1 or a descendant of it, and the options of its model.

    `firmware`: whose arithmetic it has where they differ (docs/controllers/grbl.md). grbl 1.1
    computes arcs in 32-bit floats, counts dwells in 50 ms and waits `idle_delay_ms` at each stop.
    grblHAL has the radius of an arc in 64 bits and waits at no stop. FluidNC waits at none either,
    and counts dwells in ms.
    `arc_tolerance_mm` is its $12 and `junction_deviation_mm` its $11 (defaults.h, general
    machine). `buffer_blocks`: places of its planner's ring, of which one stays empty
    (BLOCK_BUFFER_SIZE, planner.h). `arc_correction`: chords between two that it computes by sine
    and cosine (N_ARC_CORRECTION, config.h). `idle_delay_ms` is its $1: each stop holds what comes
    next for so long, 255 keeps the motors on and holds nothing (`st_go_idle`, stepper.c).
    `least_step_hz`: no axis that has the most steps makes fewer a second: 16 MHz / (65535 · 8),
    the longest tick of its timer at the highest smoothing (`st_prep_buffer`, stepper.c).
    `laser_mode` is its $32: a laser instead of a spindle, whose power changes while it moves."""

    firmware: Literal["grbl", "grblHAL", "FluidNC"] = "grbl"
    arc_tolerance_mm: Tolerance = 0.002
    junction_deviation_mm: Slack = 0.01
    buffer_blocks: Annotated[int, Meta(ge=3, le=10_000)] = 16
    arc_correction: Annotated[int, Meta(ge=1, le=10_000)] = 12
    idle_delay_ms: Annotated[int, Meta(ge=0, le=255)] = 25
    least_step_hz: Annotated[float, Meta(ge=0.01, le=10_000.0)] = 30.518
    laser_mode: bool = False


GrblMachine = Machine[SlideStart, GrblDialect]
