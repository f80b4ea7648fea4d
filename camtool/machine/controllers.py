"""What every controller record says beside its own options."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from camtool.machine.ranges import Place, Rate, Slack, Tolerance


class SlideStart(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How the slides stand when a program begins, and where machine zero is.

    `machine_zero_mm` is its place in the work frame: homing goes there.
    """

    start_play: Literal["preloaded", "centred"] = "preloaded"
    start_direction: Literal["+", "-"] = "+"
    machine_zero_mm: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)


# The controller on the PIC18F8720.

Interpolator = Literal["dsm", "dda", "stairs"]
ArcEnd = Literal["equal", "final-quadrant", "nearest"]


class PicMmhController(SlideStart, frozen=True, tag_field="model", tag="pic-mmh"):
    """The PIC18F8720's firmware; each option is a point on which its thesis leaves a choice.

    `arc_end`: how an arc knows its end, see `camtool.kernels.arc_stops`.
    """

    arcs: Interpolator = "dsm"
    arc_end: ArcEnd = "final-quadrant"
    initial_error: Literal["zero", "rounded-radius"] = "zero"
    time_base: Literal["event", "iteration"] = "event"


# The controller that follows every path exactly.


class PathController(SlideStart, frozen=True, tag_field="model", tag="path"):
    """Any controller, as if it followed the programmed lines and arcs exactly.

    It stands in for controllers whose own arithmetic is not modelled. `grid` "steps": ends and
    arc centres lie on the axes' coded steps; "none": they are taken as programmed.
    """

    grid: Literal["steps", "none"] = "steps"


# The PC of the parallel-port machine.


class FlashcutController(SlideStart, frozen=True, tag_field="model", tag="flashcut"):
    """The PC of the parallel-port machine, whose millisecond timers move each axis on its own.

    Each option is a point on which its thesis (Lnnn) leaves a choice; docs/controllers/flashcut.md
    says why these defaults.

    `half_period_ms`: the "periodo medio" of the configuration window (L1404), the shortest that
    any move has (L1127); rapids have it, and a feed can only lengthen it.
    `single_axis_half_period_ms`: the shortest of a move of one axis alone, which may be shorter
    "sin afectar el resultado" (L1202); as for the others where left out.
    `compensation_half_period_ms` of the steps at a reversal: as the move's own where left out
    (they are issued by the same routine, L1147, L1388). `clock`: how a timer
    sees its half period go by: "whole-ms": every axis fires at the first whole millisecond above
    it; "late-longer": the longer axis a millisecond late at each step, the shorter one exactly;
    both give Tabla 3.8 (L1210-1214). `half_periods_per_step`: 2 fits the times of Tabla 4.1
    (L1583-1587). `rounding` of each displacement to steps (L1208). `goes_on_from`: a displacement
    (L1101) is counted from where the program was ("programmed") or from where the steps have led
    ("reached"). `chords_per_turn`: arcs become "una serie de puntos" (L1089), number not said.
    """

    half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] = 3
    single_axis_half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] | None = None
    compensation_half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] | None = None
    clock: Literal["whole-ms", "late-longer"] = "whole-ms"
    half_periods_per_step: Annotated[int, Meta(ge=1, le=2)] = 2
    rounding: Literal["nearest", "truncate"] = "nearest"
    goes_on_from: Literal["programmed", "reached"] = "programmed"
    chords_per_turn: Annotated[int, Meta(ge=4, le=10_000)] = 72


# The slaves of the Matlab router.

PlantGain = Annotated[float, Meta(ge=1e-6, le=1000.0)]
Seconds = Annotated[float, Meta(ge=1e-6, le=60.0)]
Pause = Annotated[float, Meta(ge=0.0, le=10.0)]
Percent = Annotated[float, Meta(ge=0.0, le=60.0)]
Gain = Annotated[float, Meta(ge=0.0, le=100_000.0)]
Speed = Annotated[int, Meta(ge=1, le=1023)]
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
    the others (L4294-4360).
    """

    slaves: Literal["listing", "text"] = "listing"
    plant_gain: tuple[PlantGain, PlantGain, PlantGain] = (8.896, 5.599, 9.767)
    time_constant_s: tuple[Seconds, Seconds, Seconds] = (0.0610, 0.0616, 0.0620)
    friction_percent: tuple[Percent, Percent, Percent] = (0.0, 0.0, 0.0)
    kid: tuple[Gain, Gain, Gain] | None = None
    kpd: tuple[Gain, Gain, Gain] | None = None
    table_counts: Speed = 480
    chunk_counts: tuple[Chunk, Chunk, Chunk] = (5120, 5120, 5954)
    home_counts: tuple[Speed, Speed, Speed] = (700, 550, 500)
    home_phase_counts: tuple[Phase, Phase, Phase] = (0, 0, 0)
    pause_s: Gap = 0.15
    turnaround_s: Gap = 0.0062
    start_lag_s: Annotated[float, Meta(ge=0.0, le=0.005)] = 0.0004
    header_pause_s: Pause = 0.01
    number_pause_s: Pause = 0.001


# The Intel 8751.


class I8751Controller(SlideStart, frozen=True, tag_field="model", tag="i8751"):
    """The Intel 8751.

    How its firmware counts and times pulses decides what its bytes mean too, so those options are
    said once, in `[dialect]`: `camtool_postprocessors.i8751.pulses`.
    """


# The PIC18F4550 of ValCNC.


class ValcncController(SlideStart, frozen=True, tag_field="model", tag="valcnc"):
    """The PIC18F4550 of ValCNC; most options are points on which its thesis is silent.

    `step_rate_hz`: pulses of the axis with more steps, one delay of 166.667 µs each (L1336).
    `rounding` of lengths to steps, and `counting`: whether a coordinate is turned into steps and
    then compared with the one before, or the difference of the two coordinates is ("un valor
    flotante ... convertido en una cantidad de pasos", L1226). Arcs: how long a piece of them is
    drawn as one line ("se divide el ángulo α en pequeños tramos", by "la longitud de su arco",
    L1330), or how many lines every arc has, where `arc_segments` says it; `arc_end`: whether the
    last one ends where the sum of the angles leads (L1330) or at the end that was programmed.
    """

    step_rate_hz: Rate = 6000.0
    rounding: Literal["nearest", "truncated"] = "nearest"
    counting: Literal["coordinates", "differences"] = "coordinates"
    arc_segment_mm: Annotated[float, Meta(ge=0.001, le=1000.0)] = 0.2
    arc_segments: Annotated[int, Meta(ge=1, le=100_000)] | None = None
    arc_end: Literal["computed", "programmed"] = "computed"


# A controller on grbl 1.1.


class GrblController(SlideStart, frozen=True, tag_field="model", tag="grbl"):
    """A controller on grbl 1.1, and the options of its model.

    `arc_tolerance_mm` is its $12 and `junction_deviation_mm` its $11 (defaults.h, general
    machine). `buffer_blocks`: places of its planner's ring, of which one stays empty
    (BLOCK_BUFFER_SIZE, planner.h). `arc_correction`: chords between two that it computes by sine
    and cosine (N_ARC_CORRECTION, config.h). `idle_delay_ms` is its $1: each stop holds what comes
    next for so long, 255 keeps the motors on and holds nothing (`st_go_idle`, stepper.c).
    `least_step_hz`: no axis that has the most steps makes fewer a second: 16 MHz / (65535 · 8),
    the longest tick of its timer at the highest smoothing (`st_prep_buffer`, stepper.c).
    """

    arc_tolerance_mm: Tolerance = 0.002
    junction_deviation_mm: Slack = 0.01
    buffer_blocks: Annotated[int, Meta(ge=3, le=10_000)] = 16
    arc_correction: Annotated[int, Meta(ge=1, le=10_000)] = 12
    idle_delay_ms: Annotated[int, Meta(ge=0, le=255)] = 25
    least_step_hz: Annotated[float, Meta(ge=0.01, le=10_000.0)] = 30.518


# LinuxCNC.


class LinuxcncController(SlideStart, frozen=True, tag_field="model", tag="linuxcnc"):
    """LinuxCNC 2.9 with its trapezoid planner, and the options of its model.

    How corners are met the program says; where it does not, `[dialect]`, keys `path` and
    `blend_tolerance_mm`. `servo_period_s`: SERVO_PERIOD of the ini file. `lookahead_moves`:
    ARC_BLEND_OPTIMIZATION_DEPTH, `kink_ratio`: ARC_BLEND_KINK_RATIO, the part of the highest
    acceleration that a bend may take up within one period and pass for straight (defaults of
    initraj.cc).
    """

    servo_period_s: Annotated[float, Meta(ge=1e-6, le=1.0)] = 0.001
    lookahead_moves: Annotated[int, Meta(ge=2, le=10_000)] = 50
    kink_ratio: Annotated[float, Meta(ge=0.001, le=0.7071)] = 0.1


# Controllers as a machine file may say them: one record per model, told apart by `model`.

__all__ = [
    "Controller",
    "FlashcutController",
    "GrblController",
    "I8751Controller",
    "Interpolator",
    "LinuxcncController",
    "MatlabRouterController",
    "PathController",
    "PicMmhController",
    "SlideStart",
    "ValcncController",
]

Controller = (
    PicMmhController
    | PathController
    | FlashcutController
    | MatlabRouterController
    | I8751Controller
    | ValcncController
    | GrblController
    | LinuxcncController
)
"""Any of them."""
