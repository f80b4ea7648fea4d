"""A stretch of signals as an oscilloscope shows it: a lane for each line, time to the right.

Beside each lane stands how long the line is high and low, the shortest and the longest time of the
complete ones in the stretch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.errors import OptionError
from camtool.pictures import text
from camtool.pictures.colours import FRAME, GRID, INK, LAYER_COLOURS, PLOT, QUIET
from camtool.pictures.options import AS_USUAL, SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import TICK, TICK_CAP, sheet, title_and_notes
from camtool.pictures.svg import Look, PathData, element, number, title
from camtool.pictures.text import TextStyle
from camtool.pictures.view import MARGIN, decimals_of, multiples, page_width, round_step
from camtool.target.signals import Board
from camtool.waveforms.levels import Line, LineLevels, lines_of

LANE, GAP, MOTOR_GAP = 26.0, 12.0, 16.0
"""Height of a lane, the gap below it, and the further gap between two motors."""

NAMES, TIMES_GAP = 116.0, 12.0
"""Room for the names of the lines, and gap before the times of their pulses."""

HEADER = "high / low"

NUMBER_SPACING = 90.0
"""Least distance of two numbers of the time axis."""

MAX_MOMENTS = 20_000

UNITS = (1.0, "s"), (1e-3, "ms"), (1e-6, "µs")


class Stretch(Struct, frozen=True, eq=False):
    """The levels of a board from `from_tick` to `to_tick`; the first moment is that of the
    start."""

    board: Board
    levels: LineLevels
    from_tick: int
    to_tick: int


class _Lane(Struct, frozen=True, eq=False):
    """A line of the picture: when it changes (E,), ticks, the level from there on (E,)."""

    line: Line
    colour: str
    tick: Ints
    level: Ints
    top: float


def scope_svg(
    name: str,
    stretch: Stretch,
    motors: Sequence[str] | None = None,
    options: PictureOptions = AS_USUAL,
) -> str:
    """Return a stretch as SVG text; equal input gives equal bytes. `motors`: names of those to
    show (None: those that move). OptionError for unknown motors, and for too many changes."""
    if len(stretch.levels.tick) > MAX_MOMENTS:
        raise OptionError(
            f"{len(stretch.levels.tick):,} changes are more than a picture shows, {MAX_MOMENTS:,}",
            mend="give a shorter --span",
        )
    width = page_width(options.size_px or SVG_WIDTH_PX)
    tick_s = stretch.board.tick_s
    unit_s, unit = _unit((stretch.to_tick - stretch.from_tick) * tick_s)
    start_s = stretch.from_tick * tick_s
    span = (stretch.to_tick - stretch.from_tick) * tick_s / unit_s
    note = f"{_text(span)} {unit} from {_text(start_s)} s on"
    head, head_end = title_and_notes(name, [note], width)
    lanes = _lanes(stretch, motors, head_end + 18.0)
    words = [HEADER, *(_pulse_times(lane, tick_s) for lane in lanes)]
    room = max(text.width(each, TICK_CAP) for each in words) + TIMES_GAP
    x_low, x_high = MARGIN + NAMES, width - MARGIN - room
    bottom = lanes[-1].top + LANE + GAP
    scale = (x_high - x_low) / (stretch.to_tick - stretch.from_tick)
    frame: Look = {"x": x_low, "y": head_end + 8.0, "width": x_high - x_low}
    height = bottom - head_end - 8.0
    small = TextStyle(TICK_CAP, QUIET)
    header = text.label(HEADER, (x_high + TIMES_GAP, head_end), small)
    grid, axis = _axis(stretch, (x_low, x_high), (head_end + 8.0, bottom), scale)
    parts = [element("rect", {**frame, "height": height, "fill": PLOT}), grid]
    for lane in lanes:
        parts += _lane(lane, stretch, (x_low, x_high), scale)
    parts.append(
        element(
            "rect",
            {**frame, "height": height, "fill": "none", "stroke": FRAME, "stroke-width": 1.4},
        )
    )
    return sheet(name, (width, round(bottom + 64.0)), options, head, *parts, header, axis)


def _unit(seconds: float) -> tuple[float, str]:
    """Return (seconds in the unit, its name) of the largest unit in which this time is at
    least 1."""
    return next((each for each in UNITS if seconds >= each[0]), UNITS[-1])


def _text(value: float) -> str:
    """Return a number with six digits, without an exponent."""
    return number(float(f"{value:.6g}"), 9)


def _lanes(stretch: Stretch, motors: Sequence[str] | None, top: float) -> list[_Lane]:
    """Return the lanes of these motors, one below the other."""
    board, levels = stretch.board, stretch.levels
    numbers = {motor.name.lower(): k for k, motor in enumerate(board.motors)}
    if motors is None:
        moving = np.flatnonzero(np.ptp(levels.places, axis=0)).tolist()
        chosen = [board.motors[k].name for k in moving]
        chosen = chosen or [motor.name for motor in board.motors]
    else:
        unknown = [name for name in motors if name.lower() not in numbers]
        if unknown:
            raise OptionError(
                f"there is no motor {unknown[0]!r}",
                mend=f"use {', '.join(motor.name for motor in board.motors)}",
            )
        names = {name.lower() for name in motors}
        chosen = [motor.name for motor in board.motors if motor.name.lower() in names]
    lanes: list[_Lane] = []
    for line in lines_of(board):
        if line.motor not in chosen:
            continue
        if lanes:
            top += LANE + GAP + (MOTOR_GAP if lanes[-1].line.motor != line.motor else 0.0)
        level = (levels.ports[:, line.column] >> line.bit & 1).astype(np.int64)
        index = np.flatnonzero(np.diff(level, prepend=level[0] + 1))
        colour = LAYER_COLOURS[numbers[line.motor.lower()] % len(LAYER_COLOURS)]
        lanes.append(_Lane(line, colour, levels.tick[index], level[index], top))
    return lanes


def _lane(lane: _Lane, stretch: Stretch, sides: tuple[float, float], scale: float) -> list[str]:
    """Return the SVG of a line: its name, its trace, and the times of its pulses."""
    x_low, x_high = sides
    path, foot = PathData(), lane.top + LANE

    def height(level: int) -> float:
        return lane.top if level else foot

    path.move(x_low, height(int(lane.level[0])))
    pairs = zip(lane.tick[1:].tolist(), lane.level[1:].tolist(), strict=True)
    for tick, level in pairs:
        x = x_low + (tick - stretch.from_tick) * scale
        path.line(x, height(1 - level))
        path.line(x, height(level))
    path.line(x_high, height(int(lane.level[-1])))
    pen: Look = {"d": str(path), "fill": "none", "stroke": lane.colour, "stroke-width": 2.0}
    name = lane.line.name.replace("_", " ")
    words = _pulse_times(lane, stretch.board.tick_s)
    middle = lane.top + (LANE + TICK_CAP) / 2.0
    parts = [
        element("path", pen, title(f"{name}: {words}" if words else name)),
        text.label(name, (x_low - 12.0, middle), TextStyle(15.0, INK, "end")),
    ]
    if words:
        place = x_high + TIMES_GAP, middle
        parts.append(text.label(words, place, TextStyle(TICK_CAP, QUIET)))
    return parts


def _pulse_times(lane: _Lane, tick_s: float) -> str:
    """Return the times for which the line is high and low as text, such as "4 / 4 ms"."""
    durations = np.diff(lane.tick[1:]) * tick_s
    parts = [durations[lane.level[1:-1] == level] for level in (1, 0) if len(durations)]
    if not all(map(len, parts)) or not parts:
        return ""
    unit_s, unit = _unit(max(float(part.max()) for part in parts))
    words = []
    for part in parts:
        low, high = (f"{float(value) / unit_s:.4g}" for value in (part.min(), part.max()))
        words.append(high if low == high else f"{low}–{high}")
    return f"{' / '.join(words)} {unit}"


def _axis(
    stretch: Stretch, sides: tuple[float, float], ends: tuple[float, float], scale: float
) -> tuple[str, str]:
    """Return the SVG of the grid lines, and of the numbers of the time axis, counted from the
    start of the stretch."""
    (x_low, x_high), (top, bottom) = sides, ends
    span_s = (stretch.to_tick - stretch.from_tick) * stretch.board.tick_s
    unit_s, unit = _unit(span_s)
    span = span_s / unit_s
    step = round_step(span * NUMBER_SPACING / (x_high - x_low))
    grid, parts = PathData(), []
    for value in multiples(0.0, span, step):
        x = x_low + value * unit_s / stretch.board.tick_s * scale
        grid.move(x, top)
        grid.line(x, bottom + TICK)
        words = number(value, decimals_of(step))
        parts.append(text.label(words, (x, bottom + 26.0), TextStyle(TICK_CAP, QUIET, "middle")))
    parts.append(
        text.label(f"time ({unit})", (x_high, bottom + 50.0), TextStyle(TICK_CAP, QUIET, "end"))
    )
    pen: Look = {"d": str(grid), "fill": "none", "stroke": GRID, "stroke-width": 1.4}
    return element("path", pen), element("g", {"id": "time"}, *parts)
