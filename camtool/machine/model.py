"""A machine as frozen records: what its TOML file may say, with types, units and ranges.

Field names carry their units. `msgspec` checks types and ranges and refuses unknown keys;
`camtool.machine.loader` turns its complaints into errors that name file, table and key.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Positive = Annotated[float, Meta(gt=0.0)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Interpolator = Literal["dsm", "dda", "stairs"]


class Target(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the machine is called and what its programs are called."""

    name: str
    title: str
    dialect: str
    extension: str


class Axis(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One axis. `coded_step_mm` is what the controller believes a step to be, `real_step_mm`
    what the slide moves; `backlash_mm` is the play of the mechanics, `compensation_mm` what the
    controller adds at each reversal; `travel_mm` None when nobody has said."""

    coded_step_mm: Positive
    real_step_mm: Positive
    travel_mm: Positive | None = None
    backlash_mm: NotNegative = 0.0
    compensation_mm: NotNegative = 0.0


class Axes(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The three translational axes."""

    x: Axis
    y: Axis
    z: Axis

    def __iter__(self) -> Iterator[Axis]:
        return iter((self.x, self.y, self.z))


class Feed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Feeds in mm/min: the default, and the finest difference that the dialect can say."""

    default_mm_min: Positive
    unit_mm_min: Positive


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`max_step_rate_hz` bounds feed / coded step; `rapid_step_rate_hz` is what rapids run at;
    `max_reversals` is the count above which parts were seen to fail."""

    max_step_rate_hz: Positive
    rapid_step_rate_hz: Positive
    max_reversals: int | None = None


class Defaults(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What planning takes where the job says nothing, mm."""

    safe_z_mm: Positive
    cut_depth_mm: Positive
    fit_tolerance_mm: Positive
    gap_mm: NotNegative = 0.01


class PicMmhController(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="model", tag="pic-mmh"
):
    """The PIC18F8720's firmware; each option is a point on which its thesis leaves a choice."""

    arcs: Interpolator = "dsm"
    initial_error: Literal["zero", "rounded-radius"] = "zero"
    time_base: Literal["event", "iteration"] = "event"
    start_play: Literal["preloaded", "centred"] = "preloaded"
    start_direction: Literal["+", "-"] = "+"
    machine_zero_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where machine zero lies in the work frame: G28 goes there."""


Controller = PicMmhController
"""One record per controller model, told apart by `model`."""

Scalar = bool | int | float | str


class Machine(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything known about one machine. `dialect` is checked by its post-processor."""

    target: Target
    axes: Axes
    feed: Feed
    limits: Limits
    defaults: Defaults
    controller: Controller
    dialect: dict[str, Scalar] = {}

    @property
    def rapid_mm_min(self) -> float:
        """Speed of a rapid along one axis, mm/min: the slowest axis of X and Y decides."""
        step = min(self.axes.x.coded_step_mm, self.axes.y.coded_step_mm)
        return self.limits.rapid_step_rate_hz * step * 60.0

    @property
    def max_feed_mm_min(self) -> float:
        """Highest feed, mm/min: feed / step ≤ max_step_rate_hz on the finest axis."""
        step = min(axis.coded_step_mm for axis in self.axes)
        return self.limits.max_step_rate_hz * step * 60.0
