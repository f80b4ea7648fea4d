"""Writing flashcut: a Toolpath to blocks that repeat every word but the feed.

    rows ──checked──▶ XY and Z apart ──units, arcs repaired──▶ blocks, F where it changes

The syntax has F in G01 of XY alone (L989-992). So a feed that changes before a Z move or an arc
is written as a G01 to where the tool is: X and Y "aún así es necesario", L985.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.errors import PostError
from camtool.findings import Finding
from camtool.kernels.lattice import to_steps
from camtool.toolpath.lower import MAX_PARTS, Lowered
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program
from camtool.toolpath.refusals import refuse

from ..gcode.checks import feed_units
from ..gcode.dialect import feed_decimals
from ..gcode.format import CODE, NumberStyle, format_units
from ..gcode.plain import (
    ArcRules,
    PlainRows,
    arc_findings,
    check_plain,
    left_out,
    plain_rows,
    split_z,
)
from .dialect import MOST_MM, STOP_TEXT, Dialect, FlashcutController, FlashcutMachine
from .findings import EVENT_LEFT_OUT_DWELL, EVENT_LEFT_OUT_STOP, VALUE_ROUNDED
from .timers import half_periods_ms

EVENT: Final = {
    Kind.SPINDLE_CW: "M03",
    Kind.SPINDLE_CCW: "M04",
    Kind.SPINDLE_OFF: "M05",
    Kind.TOOL_CHANGE: "M00",
}


def write_program(toolpath: Toolpath, machine: FlashcutMachine) -> Program:
    """The program of a toolpath; PostError names the move that cannot be written or done."""
    dialect = machine.dialect
    check_plain(toolpath, machine)
    feeds, rounded_feeds = feed_units(toolpath, machine)
    lowered, split = split_z(toolpath, machine)
    if dialect.slants == "split":
        lowered = _split_slants(lowered.toolpath, machine).after(lowered)
    rules = ArcRules(dialect.decimals, dialect.full_circles, MOST_MM)
    rows = plain_rows(lowered.toolpath, rules)
    of_row = lowered.row[rows.row]
    _check_reach(toolpath, rows, of_row, dialect)
    writer = _Writer(rows, dialect, machine)
    writer.run(_event_words(toolpath), of_row, feeds[of_row])
    ended = len(toolpath) > 0 and toolpath.kind[-1] == Kind.END
    first = toolpath.place(int(lowered.row[rows.first])) if rows.first >= 0 else ""
    findings = [
        *rounded_feeds,
        *split,
        *arc_findings(rows, first),
        *_event_findings(toolpath, dialect),
    ]
    return Program.of_lines(
        [*writer.blocks, dialect.program_end],
        machine,
        [*writer.rows, len(toolpath) - 1 if ended else -1],
        findings,
    )


def _split_slants(toolpath: Toolpath, machine: FlashcutMachine) -> Lowered:
    """Long slanted lines in pieces that the machine's timers do exactly; PostError when they would
    be too many. XY and Z are apart.

    The timers make the shorter axis too long where it has more steps than the half period P has
    milliseconds (docs/controllers/flashcut.md). A line of n and m ≤ n steps becomes
    K = ⌈m / (P − 1)⌉ pieces; piece k ends at the whole steps next to k·n/K and k·m/K from its
    start, so that the controller, which rounds the travel of each piece by itself, has nothing to
    round.
    """
    controller = machine.controller
    if not isinstance(controller, FlashcutController):
        return Lowered(toolpath, np.arange(len(toolpath)))
    q_mm = np.array([machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm])
    begin = toolpath.starts
    travel = toolpath.end[:, :2] - begin[:, :2]
    steps = np.column_stack([to_steps(travel[:, axis], float(q_mm[axis])) for axis in (0, 1)])
    feed = np.where(toolpath.is_feed, toolpath.feed, np.inf)
    alone = (steps == 0).any(axis=1)
    half_period = half_periods_ms(feed, float(q_mm.max()), alone, controller)
    exact = np.maximum(half_period - 1.0, 1.0)
    slanted = toolpath.kind == Kind.LINE
    pieces = np.where(slanted, np.ceil(np.abs(steps).min(axis=1) / exact), 1.0)
    count = np.maximum(pieces, 1.0)
    if count.sum() > MAX_PARTS:
        raise PostError(
            f"the program would have more than {MAX_PARTS} blocks",
            where=toolpath.place(int(count.argmax())),
            mend="use --set dialect.slants=whole",
        )
    return _cut(toolpath, count.astype(np.int64), steps, q_mm)


def _cut(toolpath: Toolpath, count: Ints, steps: Ints, q_mm: Floats) -> Lowered:
    """Each row in `count` (N,) pieces; `steps` (N, 2) of the whole row."""
    row = np.repeat(np.arange(len(count)), count)
    part = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    inner = np.flatnonzero(part + 1 < count[row])
    of = row[inner]
    share = ((part[inner] + 1) / count[of])[:, None]
    end = toolpath.end[row]
    end[inner, :2] = toolpath.starts[of, :2] + np.rint(share * steps[of]) * q_mm
    return Lowered(toolpath.picked(row, end=end), row)


def _check_reach(toolpath: Toolpath, rows: PlainRows, of_row: Ints, dialect: Dialect) -> None:
    far = (np.abs(rows.end) > MOST_MM * 10**dialect.decimals).any(axis=1)
    refuse(
        toolpath,
        far,
        f"a coordinate has more than four digits before the point (±{MOST_MM:g} mm)",
        "check the units",
        rows=of_row,
    )


def _texts(units: Ints, dialect: Dialect) -> list[str]:
    """Column of units (M,) as texts: "1.0", "-0.25"; zero has no minus."""
    texts = format_units(units, NumberStyle(dialect.decimals))
    if dialect.trailing_zeros:
        return texts
    return [text if text[-1] != "0" else _short(text) for text in texts]


def _short(text: str) -> str:
    """Without its last zeros, but for the first decimal."""
    short = text.rstrip("0")
    return f"{short}0" if short[-1] == "." else short


def _event_words(toolpath: Toolpath) -> dict[int, str]:
    """The block of each event that has one, by row."""
    words = {}
    for row in np.flatnonzero(~toolpath.is_motion).tolist():
        kind = Kind(int(toolpath.kind[row]))
        if kind in EVENT:
            words[row] = EVENT[kind]
        elif kind == Kind.MESSAGE and toolpath.texts[int(toolpath.value[row])] == STOP_TEXT:
            words[row] = "M00"
    return words


def _event_findings(toolpath: Toolpath, dialect: Dialect) -> Iterator[Finding]:
    """What the events lose."""
    yield from left_out(toolpath, [Kind.DWELL], EVENT_LEFT_OUT_DWELL)
    kinds = toolpath.kind
    spindles = np.isin(kinds, [int(Kind.SPINDLE_CW), int(Kind.SPINDLE_CCW)])
    speeds = int((spindles & ~np.isnan(toolpath.value)).sum())
    tools = int((kinds == Kind.TOOL_CHANGE).sum())
    if speeds or tools:
        yield VALUE_ROUNDED(speeds=speeds, tools=tools)
    if not dialect.spindle_stops:
        yield from left_out(toolpath, [Kind.SPINDLE_OFF], EVENT_LEFT_OUT_STOP)


class _Writer:
    """Blocks one by one; knows which feed is in force."""

    def __init__(self, rows: PlainRows, dialect: Dialect, machine: FlashcutMachine) -> None:
        self.blocks: list[str] = []
        self.rows: list[int] = []
        self._table = rows
        self._dialect = dialect
        self._feed_decimals = max(1, feed_decimals(machine))
        self._feed_scale = 10 ** feed_decimals(machine)
        self._feed_texts: dict[int, str] = {}
        self._feed = 0

    def run(self, events: dict[int, str], of_row: Ints, feeds: Ints) -> None:
        """All blocks; `of_row` (M,) names the toolpath's rows, `feeds` (M,) in units of F."""
        table, dialect = self._table, self._dialect
        sign = 1 if dialect.z_up == "+" else -1
        xy = self._xy_texts(table.end)
        z = _texts(table.end[:, 2] * sign, dialect)
        arc = table.is_arc
        i, j = (iter(_texts(table.offset[arc, axis], dialect)) for axis in (0, 1))
        begin = table.starts
        flat = (table.end[:, :2] != begin[:, :2]).any(axis=1)
        columns = zip(
            table.kind.tolist(),
            table.moves.tolist(),
            flat.tolist(),
            of_row.tolist(),
            feeds.tolist(),
            strict=True,
        )
        cornered = (table.end[:, 2] >= 0) & (dialect.rapids == "one-axis")
        at = self._xy_texts(table.start[None, :])[0]
        for index, (kind, moves, in_xy, row, feed) in enumerate(columns):
            if kind > Kind.ARC_CCW:
                if row in events:
                    self._send(events[row], row)
            elif moves:
                target = xy[index] if in_xy or kind >= Kind.ARC_CW else f"Z{z[index]}"
                if kind >= Kind.ARC_CW:
                    target += f" I{next(i)} J{next(j)}"
                if kind == Kind.RAPID and in_xy and cornered[index]:
                    self._corner(at, target, row)
                self._move(CODE[kind], target, row, feed, at)
            at = xy[index]

    def _xy_texts(self, units: Ints) -> list[str]:
        x, y = (_texts(units[:, axis], self._dialect) for axis in (0, 1))
        return [f"X{one} Y{two}" for one, two in zip(x, y, strict=True)]

    def _corner(self, at: str, target: str, row: int) -> None:
        """The part along X of a rapid of both axes, before that along Y."""
        corner = f"{target.partition(' ')[0]} {at.partition(' ')[2]}"
        if corner not in (at, target):
            self._send(f"{CODE[Kind.RAPID]} {corner}", row)

    def _move(self, word: str, target: str, row: int, feed: int, at: str) -> None:
        """One move, and a block in front that sets the feed where its own cannot."""
        tail = ""
        if word != "G00" and feed != self._feed:
            tail = f" {self._feed_word(feed)}"
            self._feed = feed
            here = word == "G01" and target[0] == "X"
            if not here and self._dialect.feed_words == "syntax":
                self._send(f"G01 {at}{tail}", row)
                tail = ""
        self._send(f"{word} {target}{tail}", row)

    def _feed_word(self, units: int) -> str:
        word = self._feed_texts.get(units)
        if word is None:
            word = f"F{units / self._feed_scale:.{self._feed_decimals}f}"
            self._feed_texts[units] = word
        return word

    def _send(self, block: str, row: int) -> None:
        self.blocks.append(block)
        self.rows.append(row)
