"""The slaves of the Matlab router."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from camtool.machine.controllers.base import SlideStart

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
