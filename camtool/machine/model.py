"""A machine as frozen records: the keys of its TOML file, with types, units and ranges.

Field names carry their units. `msgspec` checks types and ranges and refuses unknown keys;
`camtool.tables` turns its complaints into errors that name file, table and key. The records of
`[controller]` and `[dialect]` are the target's: `Machine` is generic over both."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, overload

import msgspec
from msgspec import Meta
from typing_extensions import TypeVar

from camtool.errors import MachineError
from camtool.machine.ranges import (
    Acceleration,
    Depth,
    FeedRate,
    Length,
    Lost,
    Part,
    Place,
    Rate,
    Slack,
    Speed,
    Step,
    Tolerance,
)
from camtool.patterns import guess

if TYPE_CHECKING:
    from camtool.arrays import Bools, Floats


Grade = Literal["step-true", "timed", "path only"]
"""How exactly the model of a controller knows it: each step; times and corners; or the path
alone."""


class TargetNames(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Names of the machine and of its programs. `rests_on`: what its figures rest on, in words;
    `grade`: of its model on this machine, where that is not the target's own."""

    name: str
    title: str
    dialect: str
    extension: str
    rests_on: str = ""
    grade: Grade | None = None


FEED_TOLERANCE = 1e-9
"""A feed may exceed its limit by this share, from rounding alone."""

AS_CODED = 0.0
"""The value of `Axis.real_step_mm` before it is set to the coded step; no file can contain it."""


class Axis(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Axis of the machine. `coded_step_mm` is the length of a step for the controller,
    `real_step_mm` the travel of the slide in a step, as coded where left out; `backlash_mm` is the
    play of the mechanics, `compensation_mm` what the controller adds at each reversal;
    `repeatability_mm` is the standard deviation of the places where the slide arrives from one
    side. `resolution_mm` is the finest difference of places in a program, where that is coarser
    than the step. `travel_mm`, `max_rate_mm_min` and `acceleration_mm_s2` are None when they are
    not known."""

    coded_step_mm: Step
    real_step_mm: Step = AS_CODED
    resolution_mm: Step | None = None
    travel_mm: Length | None = None
    backlash_mm: Lost = 0.0
    compensation_mm: Lost = 0.0
    repeatability_mm: Lost = 0.0
    max_rate_mm_min: FeedRate | None = None
    acceleration_mm_s2: Acceleration | None = None

    def __post_init__(self) -> None:
        if self.real_step_mm == AS_CODED:
            msgspec.structs.force_setattr(self, "real_step_mm", self.coded_step_mm)


class Axes(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The three translational axes."""

    x: Axis
    y: Axis
    z: Axis

    def __iter__(self) -> Iterator[Axis]:
        return iter((self.x, self.y, self.z))


class Feed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Feeds in mm/min: the default, and the finest difference that the dialect can express."""

    default_mm_min: FeedRate
    unit_mm_min: FeedRate


class MotionLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of motion; None where not known.

    `max_step_rate_hz` bounds feed / coded step, `max_feed_mm_min` the feed itself; rapids run at
    `rapid_step_rate_hz` or `rapid_mm_min`; `max_reversals` is the count above which parts were
    seen to fail that are no larger in XY than `small_part_mm` (None: parts of any size)."""

    max_step_rate_hz: Rate | None = None
    rapid_step_rate_hz: Rate | None = None
    max_feed_mm_min: FeedRate | None = None
    rapid_mm_min: FeedRate | None = None
    max_reversals: Annotated[int, Meta(ge=0, le=1_000_000_000)] | None = None
    small_part_mm: Length | None = None


class Defaults(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Defaults of planning where the job gives no value, mm. `feed_z_mm`: the height above the
    stock down to which the tool comes as a rapid (None: it plunges from `safe_z_mm` on).
    `plunge_share`: the feed of a plunge as a part of that of the cut (None: the same). `park_mm`:
    where the tool goes when all is cut, in the work frame; `change_mm` and `change_z_mm`: where it
    goes between two operations to be changed (None: to `park_mm`, and up some times
    `safe_z_mm`)."""

    safe_z_mm: Length
    cut_depth_mm: Depth
    fit_tolerance_mm: Tolerance
    gap_mm: Slack = 0.01
    feed_z_mm: Length | None = None
    plunge_share: Part | None = None
    park_mm: tuple[Place, Place] = (0.0, 0.0)
    change_mm: tuple[Place, Place] | None = None
    change_z_mm: Length | None = None


class Spindle(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The spindle, and who switches it: the program, a hand, or nobody, where there is none.

    `default_rpm` is the speed of a job that says none; None: it is asked for. The range is that of
    the drive, None where it is not known. `spin_up_s` is waited until it is at speed.

    `turns`: it turns the tool, or the work, as that of a lathe does. Then camtool's X runs along
    its axis and its Y is the radius; `encoder`: feeds can follow its turns, as threads need."""

    turns: Literal["tool", "work"] = "tool"
    encoder: bool = False
    switched: Literal["program", "hand", "none"] = "program"
    default_rpm: Speed | None = None
    min_rpm: Annotated[float, Meta(ge=0.0, le=1e7)] = 0.0
    max_rpm: Speed | None = None
    direction: Literal["cw", "ccw"] = "cw"
    spin_up_s: Annotated[float, Meta(ge=0.0, le=600.0)] = 0.0

    def __post_init__(self) -> None:
        if self.max_rpm is not None and self.min_rpm > self.max_rpm:
            raise ValueError("min_rpm is above max_rpm")
        if self.default_rpm is not None and not self.reaches(self.default_rpm):
            raise ValueError("default_rpm is outside of min_rpm and max_rpm")

    def reaches(self, rpm: float) -> bool:
        """Return True if the drive can run at this speed, rev/min."""
        return self.min_rpm <= rpm and (self.max_rpm is None or rpm <= self.max_rpm)


class Coolant(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Coolants of the machine: mist (M7) and flood (M8)."""

    mist: bool = False
    flood: bool = False

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the coolants of the machine: "mist", "flood"."""
        return ("mist",) * self.mist + ("flood",) * self.flood


class SlideStart(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """State of the slides when a program begins, and the place of machine zero.

    `machine_zero_mm` is its place in the work frame: homing goes there."""

    start_play: Literal["preloaded", "centred"] = "preloaded"
    start_direction: Literal["+", "-"] = "+"
    machine_zero_mm: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)

    @property
    def compensates_by_region(self) -> bool:
        """True if the compensation of an axis is its play where it turns, by `[play_map]`."""
        return False


class PathController(SlideStart, frozen=True, tag_field="model", tag="path"):
    """Any controller, as if it followed the programmed lines and arcs exactly.

    It stands in for controllers whose own arithmetic is not modelled. `grid` "steps": ends and
    arc centres lie on the axes' coded steps; "none": they are taken as programmed."""

    grid: Literal["steps", "none"] = "steps"


class Link(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The line that the program comes down, where it costs time.

    `baud` None: not known, or the program is in the machine before it runs.
    `bits_per_character` counts start, stop and parity bits. `wait` "sequential": a block is sent
    when the one before has been cut, so that both times add up; "streamed": the next is sent
    meanwhile. A target whose line leaves more open extends it by its own keys."""

    baud: Rate | None = None
    bits_per_character: Annotated[float, Meta(ge=1.0, le=1000.0)] = 10.0
    wait: Literal["sequential", "streamed"] = "sequential"

    def seconds(self, characters: int, motion_s: float) -> float:
        """Return the time, s, by which sending these characters prolongs `motion_s` of motion."""
        if self.baud is None:
            return 0.0
        sending = characters * self.bits_per_character / self.baud
        return sending if self.wait == "sequential" else max(0.0, sending - motion_s)


# The mechanics beyond its single axes.

MAX_SQUARENESS_RAD = 0.1
"""Larger deviations from a right angle (5.7°) are refused: no machine has them, so that the number
is in a wrong unit."""


class PlayCells(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The play of one axis by region of the table, in mm.

    `x_mm` and `y_mm` are the edges of the cells, ascending, in table coordinates: those of the
    work frame less `controller.machine_zero_mm`. `play_mm[j][i]` holds from y_mm[j] up to
    y_mm[j + 1] and from x_mm[i] up to x_mm[i + 1]; outside of all edges holds the nearest cell."""

    x_mm: tuple[Place, ...]
    y_mm: tuple[Place, ...]
    play_mm: tuple[tuple[Lost, ...], ...]

    def __post_init__(self) -> None:
        for name, edges in (("x_mm", self.x_mm), ("y_mm", self.y_mm)):
            if len(edges) < 2 or any(a >= b for a, b in pairwise(edges)):
                raise ValueError(f"{name} must be two edges or more, each above the one before")
        rows, columns = len(self.y_mm) - 1, len(self.x_mm) - 1
        if len(self.play_mm) != rows or any(len(row) != columns for row in self.play_mm):
            raise ValueError(
                f"play_mm must be {rows} rows (along y_mm) of {columns} numbers (along x_mm)"
            )

    def play_at(self, x_mm: float, y_mm: float) -> float:
        """Return the play, mm, at a place in table coordinates."""
        row = bisect_right(self.y_mm[1:-1], y_mm)
        return self.play_mm[row][bisect_right(self.x_mm[1:-1], x_mm)]


class PlayMap(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The play of X and of Y by region, in place of their `backlash_mm` when `use` is true; an
    axis without cells keeps that."""

    use: bool = False
    x: PlayCells | None = None
    y: PlayCells | None = None

    def __post_init__(self) -> None:
        if self.use and self.x is None and self.y is None:
            raise ValueError("use is true, but neither play_map.x nor play_map.y is there")

    @property
    def used(self) -> tuple[PlayCells | None, PlayCells | None, None]:
        """The cells of X, Y and Z that hold; None where `backlash_mm` does."""
        return (self.x, self.y, None) if self.use else (None, None, None)


class MechanicsOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Properties of the mechanics as a whole.

    `squareness_rad`: by how much the angle between +X and +Y is less than a right angle. `seed`:
    of the random numbers for the repeatability of the axes."""

    squareness_rad: Annotated[float, Meta(ge=-MAX_SQUARENESS_RAD, le=MAX_SQUARENESS_RAD)] = 0.0
    seed: Annotated[int, Meta(ge=0, le=(1 << 32) - 1)] = 0


# How well its numbers are known.

CORRELATED_KEYS = (
    "x.backlash_mm",
    "x.scale",
    "x.compensation_mm",
    "y.backlash_mm",
    "y.scale",
    "y.compensation_mm",
    "z.backlash_mm",
    "z.scale",
    "z.compensation_mm",
    "z_zero_mm",
    "squareness_rad",
    "tool_diameter_mm",
    "runout_mm",
    "stock_thickness_mm",
    "temperature_k",
)
"""The keys of `[uncertainty]` that may be correlated: one error for all of a part. `process_mm` is
not among them, since each edge has an error of its own."""

SEMIDEFINITE = 1e-3
"""A correlation matrix has no eigenvalue below this, negative: rounding coefficients to four
decimals may make one of 0 a little less than 0."""

Coefficient = Annotated[float, Meta(ge=-1.0, le=1.0)]
"""Coefficient of a correlation."""

Relative = Annotated[float, Meta(ge=0.0, le=0.1)]
"""Standard uncertainty as a share of the value."""

Expansion = Annotated[float, Meta(ge=-1e-5, le=1e-3)]
"""Expansion of a length, 1/K: some ceramics shrink, plastics grow by 1e-4."""


class AxisUncertainty(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Standard uncertainties of one axis; None: not known, which is not 0.

    `backlash_mm`: of its play, where a map is used of each of its cells, which err together.
    `scale`: of `real_step_mm`, as a part of it. `compensation_mm`: of what the controller really
    adds; 0 where it adds what it is set to."""

    backlash_mm: Lost | None = None
    scale: Relative | None = None
    compensation_mm: Lost | None = None


class Uncertainty(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The standard uncertainties of the values of a machine; None: not known, which is not 0.

    `tool_diameter_mm`: of the tool as measured; `runout_mm`: of the diameter that it cuts, by
    run-out; `temperature_k`: of the room, about 20 °C, where machine and part grow by
    `machine_expansion_per_k` and `part_expansion_per_k`; `process_mm`: of the place of a machined
    edge or floor, for deflection and all else that is not modelled; `z_zero_mm`: of the height of
    zero, by touching off; `stock_thickness_mm`: of the stock as measured. `correlations`: two
    keys, such as "x.scale" and "squareness_rad", with their coefficient; pairs that are not named
    are not correlated. The scatter of an axis is its `repeatability_mm`."""

    x: AxisUncertainty = AxisUncertainty()
    y: AxisUncertainty = AxisUncertainty()
    z: AxisUncertainty = AxisUncertainty()
    squareness_rad: Annotated[float, Meta(ge=0.0, le=MAX_SQUARENESS_RAD)] | None = None
    tool_diameter_mm: Lost | None = None
    runout_mm: Lost | None = None
    temperature_k: Annotated[float, Meta(ge=0.0, le=100.0)] | None = None
    machine_expansion_per_k: Expansion | None = None
    part_expansion_per_k: Expansion | None = None
    process_mm: Lost | None = None
    z_zero_mm: Lost | None = None
    stock_thickness_mm: Lost | None = None
    correlations: tuple[tuple[str, str, Coefficient], ...] = ()

    def standard(self, key: str) -> float | None:
        """Return the standard uncertainty of the value with a key such as "x.scale"; None: not
        known."""
        record, _, name = key.rpartition(".")
        value: float | None = getattr(getattr(self, record) if record else self, name)
        return value

    def correlation(self, keys: Sequence[str]) -> Floats:
        """Return the correlation coefficients (P, P) between the values with these P keys."""
        import numpy as np

        matrix = np.eye(len(keys))
        for one, other, coefficient in self.correlations:
            if one in keys and other in keys:
                place = keys.index(one), keys.index(other)
                matrix[place] = matrix[place[::-1]] = coefficient
        return matrix

    def check(self) -> None:
        """Raise MachineError for correlations that are impossible, or that name a value of unknown
        uncertainty."""
        pairs = set[frozenset[str]]()
        for number, (one, other, _) in enumerate(self.correlations):
            for key in (one, other):
                if key not in CORRELATED_KEYS:
                    raise _wrong_correlation(
                        f"{key!r} is nothing that can be correlated",
                        f"{guess(key, CORRELATED_KEYS)}use {', '.join(CORRELATED_KEYS)}",
                        number,
                    )
                if self.standard(key) is None:
                    raise _wrong_correlation(
                        f"the uncertainty of {key} is not given",
                        f"give uncertainty.{key}, or leave the correlation out",
                        number,
                    )
            pair = frozenset((one, other))
            if len(pair) == 1 or pair in pairs:
                fault = "twice" if pair in pairs else "with itself"
                raise _wrong_correlation(
                    f"{one} is correlated {fault}" + (f" with {other}" if pair in pairs else ""),
                    "give each pair of different keys once",
                    number,
                )
            pairs.add(pair)
        self._check_semidefinite()

    def _check_semidefinite(self) -> None:
        """Raise MachineError, which names the keys, for correlations that contradict each other:
        their matrix is not positive semidefinite."""
        if len(self.correlations) < 2:
            return
        import numpy as np

        keys = [key for key in CORRELATED_KEYS if any(key in row for row in self.correlations)]
        sizes, directions = np.linalg.eigh(self.correlation(keys))
        min_size = float(sizes[0])
        if min_size >= -SEMIDEFINITE:
            return
        # With all coefficients times t the eigenvalues are 1 + t (λ - 1).
        factor = math.floor(100.0 / (1.0 - min_size)) / 100.0
        shares = np.abs(directions[:, 0])
        involved = [key for key, share in zip(keys, shares, strict=True) if share > SEMIDEFINITE]
        raise _wrong_correlation(
            f"those of {', '.join(involved)} contradict each other: the covariance is not "
            f"positive semidefinite (an eigenvalue of the correlations is {min_size:.2g})",
            f"multiply them by {factor:g} or less, or measure them again",
        )


def _wrong_correlation(message: str, mend: str, number: int | None = None) -> MachineError:
    place = "" if number is None else f"[{number}]"
    return MachineError(message, where=f"table [uncertainty], key correlations{place}", mend=mend)


# `Machine` alone, in an annotation, is a machine of any target. Python knows such defaults from
# 3.13 on.
ControllerT = TypeVar("ControllerT", bound=SlideStart, default=SlideStart, covariant=True)
DialectT = TypeVar("DialectT", bound=msgspec.Struct, default=msgspec.Struct, covariant=True)
LinkT = TypeVar("LinkT", bound=Link, default=Link, covariant=True)
_Record = TypeVar("_Record", bound=SlideStart)


class Machine(
    msgspec.Struct,
    Generic[ControllerT, DialectT, LinkT],
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
):
    """Everything known about one machine; its target says what `controller`, `dialect` and `link`
    are."""

    target: TargetNames
    axes: Axes
    feed: Feed
    limits: MotionLimits
    defaults: Defaults
    spindle: Spindle = Spindle()
    coolant: Coolant = Coolant()
    controller: ControllerT
    link: LinkT = Link()  # type: ignore[assignment]
    mechanics: MechanicsOptions = MechanicsOptions()
    play_map: PlayMap = PlayMap()
    uncertainty: Uncertainty = Uncertainty()
    dialect: DialectT

    @property
    def digest(self) -> str:
        """SHA-256, hex, of all that a file must say to get this machine: equal for equal machines,
        on every computer, wherever their records stand in the code. How well its numbers are known
        is no part of it: no program depends on that."""
        import hashlib

        values = {key: value for key, value in _given_values(self).items() if key != "uncertainty"}
        data = msgspec.json.encode(values, order="deterministic")
        return hashlib.sha256(data).hexdigest()

    @property
    def short_digest(self) -> str:
        """The first eight hexadecimal digits of the digest, which stand in programs."""
        return self.digest[:8]

    @property
    def max_feed_mm_min(self) -> float:
        """Highest feed, mm/min: the lowest of the limits that are given; inf where none is.

        The limits are `max_feed_mm_min`, `max_step_rate_hz` on the finest axis (feed / step), and
        the highest rates of X and Y."""
        return min(self._feed_limits(self.axes.x, self.axes.y))

    @property
    def max_programmable_mm_min(self) -> float:
        """Highest feed that a program may ask for, mm/min, inf where no limit is given: above the
        rates of the axes, controllers slow a move down by themselves."""
        return min(self._feed_limits())

    @property
    def max_plunge_mm_min(self) -> float:
        """Highest feed along Z, mm/min; like `max_feed_mm_min` with the highest rate of Z."""
        return min(self._feed_limits(self.axes.z))

    @property
    def rapid_mm_min(self) -> float:
        """Speed of a rapid, mm/min: the first of these that is given.

        `rapid_mm_min`; `rapid_step_rate_hz` on the slower axis of X and Y; the highest rate of
        the slower one; the highest feed. Inf where nothing is: rapids then take no time."""
        x, y, limits = self.axes.x, self.axes.y, self.limits
        if limits.rapid_mm_min is not None:
            return limits.rapid_mm_min
        if limits.rapid_step_rate_hz is not None:
            return limits.rapid_step_rate_hz * min(x.coded_step_mm, y.coded_step_mm) * 60.0
        if x.max_rate_mm_min is not None and y.max_rate_mm_min is not None:
            return min(x.max_rate_mm_min, y.max_rate_mm_min)
        return self.max_feed_mm_min

    def _feed_limits(self, *axes: Axis) -> Iterator[float]:
        yield math.inf
        if self.limits.max_feed_mm_min is not None:
            yield self.limits.max_feed_mm_min
        if self.limits.max_step_rate_hz is not None:
            step = min(axis.coded_step_mm for axis in self.axes)
            yield self.limits.max_step_rate_hz * step * 60.0
        yield from (axis.max_rate_mm_min for axis in axes if axis.max_rate_mm_min is not None)


def _given_values(record: msgspec.Struct) -> dict[str, Any]:
    """Return the values of a record that differ from its defaults, by name, with its tag."""
    config, values = record.__struct_config__, dict[str, Any]()
    if config.tag_field is not None:
        values[config.tag_field] = config.tag
    for field in msgspec.structs.fields(record):
        value = getattr(record, field.name)
        factory = field.default_factory
        if value == (field.default if factory is msgspec.NODEFAULT else factory()):
            continue
        if not isinstance(value, msgspec.Struct):
            values[field.encode_name] = value
        elif (inner := _given_values(value)) or not isinstance(field.default, msgspec.Struct):
            values[field.encode_name] = inner
    return values


def controller_of(machine: Machine, kind: type[_Record]) -> _Record:
    """Return the machine's controller, which must be of this kind; MachineError when it is not."""
    if not isinstance(machine.controller, kind):
        kind_name = kind.__struct_config__.tag
        raise MachineError(
            f"{machine.target.name} needs the controller {kind_name}",
            where="table [controller], key model",
            mend=f'write model = "{kind_name}"',
        )
    return machine.controller


@overload
def exceeds(feed_mm_min: float, limit_mm_min: float) -> bool: ...


@overload
def exceeds(feed_mm_min: Floats, limit_mm_min: float) -> Bools: ...


def exceeds(feed_mm_min: float | Floats, limit_mm_min: float) -> bool | Bools:
    """Return True if a feed, or each of several feeds (K,), is above its limit by more than
    rounding; False for NaN."""
    return feed_mm_min > limit_mm_min * (1.0 + FEED_TOLERANCE)
