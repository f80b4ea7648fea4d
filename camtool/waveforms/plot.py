"""Plots over time of a judged program: speed, position, and distance from the wanted path.

The program runs once more, with the times that its controller gives each sample, and is reduced to
the columns of the picture on the way."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.errors import OptionError
from camtool.pictures.colours import BACK, FEED, LAYER_COLOURS, PLUNGE, QUIET, RAPID
from camtool.pictures.draw import rendered
from camtool.pictures.options import AS_USUAL, PictureOptions
from camtool.plain import one_line
from camtool.toolpath.moves import Kind, Toolpath
from camtool.units import UM_PER_MM
from camtool.verification.over_time import errors_over_time
from camtool.verification.verify import Verification
from camtool.waveforms.columns import Held, Peak, Speeds, TimeColumns
from camtool.waveforms.lanes import Lane, Strip, TimePlot, Trend, columns_for, lanes_svg

PlotKind = Literal["speed", "position", "error"]

KINDS: Final[tuple[PlotKind, ...]] = ("speed", "position", "error")

MIN_PER_S = 60.0

HIGH, MIDDLE, LOW = 240.0, 170.0, 110.0

AXES = "XYZ"


class TimeSpan(Struct, frozen=True):
    """The time that a plot shows: from `from_s` on, for `span_s`, None: up to the end."""

    from_s: float = 0.0
    span_s: float | None = None

    def within(self, seconds: float) -> tuple[float, float]:
        """Return begin and end, s, of the stretch in a program that takes `seconds`; OptionError
        if it lies outside the program."""
        if not seconds > 0.0:
            raise OptionError("the program takes no time, so there is nothing to plot")
        if not 0.0 <= self.from_s < seconds:
            raise OptionError(
                f"the program ends after {seconds:.6g} s; from {self.from_s:g} s on there is "
                "nothing",
                mend=f"give 0 to less than {seconds:.6g} s",
            )
        if self.span_s is None:
            return self.from_s, seconds
        if not 0.0 < self.span_s < math.inf:
            raise OptionError(f"a stretch of {self.span_s:g} s is none", mend="give more than 0 s")
        return self.from_s, min(self.from_s + self.span_s, seconds)


ALL_TIME = TimeSpan()


def plot_file(
    kind: PlotKind,
    verification: Verification,
    name: str,
    title: str,
    stretch: TimeSpan = ALL_TIME,
    options: PictureOptions | None = None,
) -> bytes:
    """Return the picture for a file `name`, .svg or .png. OptionError for a stretch outside of the
    program, OutputError for another kind of file."""

    def drawn(sized: PictureOptions) -> str:
        plot = time_plot(kind, verification, title, stretch, columns_for(sized))
        return lanes_svg(plot, sized)

    return rendered(drawn, name, options or AS_USUAL)


def time_plot(
    kind: PlotKind,
    verification: Verification,
    title: str,
    stretch: TimeSpan = ALL_TIME,
    columns: int = 1000,
) -> TimePlot:
    """Return the content of a plot with this number of columns."""
    seconds = float(verification.rows.seconds.sum())
    from_s, to_s = stretch.within(seconds)
    makers = {"speed": _speed_lanes, "position": _position_lanes, "error": _error_lanes}
    room = TimeColumns(from_s, to_s, columns, QUANTITIES[kind])
    lanes, note = makers[kind](verification, room)
    notes = [note]
    if (from_s, to_s) != (0.0, seconds):
        notes.append(f"{to_s - from_s:.6g} s from {from_s:.6g} s on, of {seconds:.6g} s")
    ribbon = ribbon_of(verification.case.decoded, verification.rows.seconds, room)
    name = f"{one_line(title)}: {kind} over time"
    return TimePlot(name, tuple(notes), from_s, to_s, lanes, ribbon)


QUANTITIES: Final = {"speed": 4, "position": 3, "error": 1}


def _speed_lanes(verification: Verification, columns: TimeColumns) -> tuple[tuple[Lane, ...], str]:
    """Return the lanes with the speed along the path, next to the programmed one, and with the
    speeds of the axes, and a text about the peak."""
    case = verification.case
    model, machine = case.target.model, case.machine
    samples, period_s = model.samples_per_speed, model.speed_period_s(machine)
    speeds = Speeds(columns, case.decoded.start, samples, period_s)
    for timed in case.target.timed(case.decoded, case.simulation):
        speeds.add(timed)
    speeds.finish(float(verification.rows.seconds.sum()))
    low, high = columns.low * MIN_PER_S, columns.high * MIN_PER_S
    programmed = _programmed(case.decoded, verification.rows.seconds, columns)
    along = Trend("predicted", FEED, low[0], high[0])
    mark = _mark(columns, columns.largest[0], MIN_PER_S)
    lanes = [
        Lane("along the path (mm/min)", (along, programmed), MIDDLE, from_zero=True, mark=mark),
        *(
            Lane(
                f"{name} (mm/min)",
                (Trend(name, LAYER_COLOURS[k], low[k + 1], high[k + 1]),),
                LOW,
                from_zero=True,
            )
            for k, name in enumerate(AXES)
        ),
    ]
    peak = columns.largest[0]
    note = f"fastest {peak.value * MIN_PER_S:.5g} mm/min {_place(peak, case.decoded)}"
    if samples > 1:
        note += f"; each over {samples} steps"
    return tuple(lanes), note


def _position_lanes(
    verification: Verification, columns: TimeColumns
) -> tuple[tuple[Lane, ...], str]:
    """Return the lanes with the predicted positions of the slides, and a text about them."""
    case, holder = verification.case, Held(columns)
    start = case.decoded.start
    holder.add(np.zeros(1), start[None, :], np.zeros(1, dtype=np.int64))
    for timed in case.target.timed(case.decoded, case.simulation):
        holder.add(timed.at_s, timed.chunk.slide, timed.chunk.row)
    holder.finish(float(verification.rows.seconds.sum()))
    lanes = tuple(
        Lane(
            f"{name} (mm)",
            (Trend(name, LAYER_COLOURS[k], columns.low[k], columns.high[k]),),
            MIDDLE,
        )
        for k, name in enumerate(AXES)
    )
    ways = (
        f"{name} {lowest.value:.6g} to {highest.value:.6g}"
        for name, lowest, highest in zip(AXES, columns.least, columns.largest, strict=True)
    )
    return lanes, f"{', '.join(ways)} mm"


def _error_lanes(verification: Verification, columns: TimeColumns) -> tuple[tuple[Lane, ...], str]:
    """Return the lane with the distance of the slides from the wanted path while cutting, and a
    text about the peak."""
    holder = Held(columns)
    for timed, errors_mm in errors_over_time(verification.case):
        holder.add(timed.at_s, errors_mm[:, None], timed.chunk.row)
    holder.finish(float(verification.rows.seconds.sum()))
    peak = columns.largest[0]
    if peak.row < 0:
        return (_error_lane(columns, None),), "nothing is cut, so there is no error"
    words = f"largest {peak.value * UM_PER_MM:.5g} µm"
    return (
        (_error_lane(columns, _mark(columns, peak, UM_PER_MM)),),
        f"{words} {_place(peak, verification.case.decoded)}",
    )


def _error_lane(columns: TimeColumns, mark: tuple[int, float] | None) -> Lane:
    low, high = columns.low[0] * UM_PER_MM, columns.high[0] * UM_PER_MM
    curve = Trend("distance from the wanted path", BACK, low, high)
    return Lane("distance from the wanted path (µm)", (curve,), HIGH, from_zero=True, mark=mark)


def _mark(columns: TimeColumns, peak: Peak, unit: float) -> tuple[int, float] | None:
    """Return (column, value in the lane's unit) of a peak, None if the plot shows no value
    at all."""
    if peak.row < 0:
        return None
    share = (max(peak.at_s, columns.from_s) - columns.from_s) / (columns.to_s - columns.from_s)
    return min(int(share * columns.count), columns.count - 1), peak.value * unit


def _place(peak: Peak, decoded: Toolpath) -> str:
    """Return text on when and in which block a peak occurs."""
    if peak.row < 0:
        return "at the end"
    block = int(decoded.block[peak.row])
    words = f"at {peak.at_s:.6g} s"
    return f"{words}, block {block + 1}" if block >= 0 else words


def ribbon_of(decoded: Toolpath, seconds: Floats, columns: TimeColumns) -> tuple[Strip, ...]:
    """Return the strips of feed moves, rapids and stops; `seconds` (N,): the time of each row."""
    kind = decoded.kind
    rapid = (kind == Kind.RAPID) | (kind == Kind.HOME_XY) | (kind == Kind.HOME_Z)
    stands = ~rapid & ~decoded.is_feed
    parts = (("feed", FEED, decoded.is_feed), ("rapid", RAPID, rapid), ("stands", QUIET, stands))
    strips = (
        Strip(name, colour, np.isfinite(_row_columns(seconds, is_on, columns).low[0]))
        for name, colour, is_on in parts
    )
    return tuple(strip for strip in strips if strip.on.any())


def _programmed(decoded: Toolpath, seconds: Floats, columns: TimeColumns) -> Trend:
    """Return the curve of the programmed feed, in feed moves only."""
    row = _row_columns(seconds, decoded.is_feed, columns, decoded.feed)
    return Trend("programmed", PLUNGE, row.low[0], row.high[0], is_wanted=True)


def _row_columns(
    seconds: Floats, is_on: Bools, columns: TimeColumns, values: Floats | None = None
) -> TimeColumns:
    """Return columns of the same stretch in which each row that `is_on` (N,) has its value while
    it runs."""
    end_s = np.cumsum(seconds)
    rows = np.flatnonzero(is_on & (seconds > 0.0))
    own = TimeColumns(columns.from_s, columns.to_s, columns.count, 1)
    value = np.ones(len(rows)) if values is None else values[rows]
    own.add(end_s[rows] - seconds[rows], end_s[rows], value[:, None], rows)
    return own
