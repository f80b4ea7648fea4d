"""Feeds, spindle, tool, dwells, clearance and end of a program, against what was asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import Floats, Ints
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.rapids import STOCK_TOP_MM
from camtool.verify.asked import Alike, Asked, Side
from camtool.verify.cuts import Bools, is_flat
from camtool.verify.places import at_point, block_name

FEED_SHARE = 0.5
"""A feed is another one when it is off by more than this part of the dialect's unit of feeds."""

DWELL_S = 0.0005
"""A dwell that is shorter by less is as long."""

OFF = 0.0
"""Stands for a spindle that does not turn, and for no tool."""


def hold_settings(
    mine: Side, other: Side, alike: Alike, pairs: Ints, asked: Asked
) -> tuple[Finding, ...]:
    """Compare how moves are made; `pairs` (P, 2) are rows of both sides that lie on each other
    besides those that are alike."""
    both = _Both.of(mine, other, alike, pairs)
    return (
        *_feeds(both, asked),
        *_spindle(both),
        *_tools(both),
        *_corners(both),
        *_dwells(mine.toolpath, other.toolpath, asked),
        *_clearance(mine, other, alike, asked),
        *_end(mine.toolpath, other.toolpath, asked),
    )


@dataclass(frozen=True, eq=False)
class _Both:
    """Rows (R,) of the decoded side that feed into the stock, and pairs (P, 2) of such a row with
    a written row that it may be compared with."""

    decoded: Toolpath
    written: Toolpath
    rows: Ints
    pairs: Ints

    @classmethod
    def of(cls, mine: Side, other: Side, alike: Alike, pairs: Ints) -> _Both:
        """The pairs that are given, all rows that are alike, and plunges that are not with every
        written plunge."""
        at_work, there = mine.cuts.is_cut | mine.plunges, other.cuts.is_cut | other.plunges
        rows, written = np.flatnonzero(at_work), np.flatnonzero(there)
        # Of written rows that are alike in every way one is enough.
        states = np.column_stack([alike.written, *_settings(other.toolpath)])[written]
        written = written[np.unique(states, axis=0, return_index=True)[1]]
        order = written[np.argsort(alike.written[written], kind="stable")]
        number = alike.written[order]
        low = np.searchsorted(number, alike.decoded[rows], side="left")
        high = np.searchsorted(number, alike.decoded[rows], side="right")
        count = high - low
        begin = np.repeat(low - (np.cumsum(count) - count), count)
        same = np.column_stack([np.repeat(rows, count), order[begin + np.arange(count.sum())]])
        lone = rows[(count == 0) & mine.plunges[rows]]
        plunges = written[other.plunges[written]]
        feeds = plunges[np.unique(other.toolpath.feed[plunges], return_index=True)[1]]
        entered = np.column_stack([np.repeat(lone, len(feeds)), np.tile(feeds, len(lone))])
        return cls(mine.toolpath, other.toolpath, rows, np.concatenate([same, pairs, entered]))

    def unlike(self, same: Bools) -> tuple[Ints, Ints]:
        """Rows none of whose pairs is the `same` (P,), and for each the written row of one."""
        fine = np.zeros(len(self.decoded), dtype=np.bool_)
        fine[self.pairs[same, 0]] = True
        rows, first = np.unique(self.pairs[:, 0], return_index=True)
        bad = ~fine[rows]
        return rows[bad], self.pairs[first[bad], 1]


def _settings(toolpath: Toolpath) -> tuple[Floats, Floats, Floats]:
    """(N,) each: feed, turns of the spindle (CCW negative, OFF where it does not turn), tool."""
    kind = toolpath.kind
    turning = np.where(kind == Kind.SPINDLE_CCW, -toolpath.value, toolpath.value)
    spindle = (kind >= Kind.SPINDLE_CW) & (kind <= Kind.SPINDLE_OFF)
    turns = _since(spindle, np.where(kind == Kind.SPINDLE_OFF, OFF, turning))
    return toolpath.feed, turns, _since(kind == Kind.TOOL_CHANGE, toolpath.value)


def _since(said: Bools, values: Floats) -> Floats:
    """(N,) the last value that was said up to each row, OFF before the first."""
    last = np.maximum.accumulate(np.where(said, np.arange(len(said)), -1))
    return np.where(last >= 0, np.nan_to_num(values[np.maximum(last, 0)]), OFF)


def _feeds(both: _Both, asked: Asked) -> Iterator[Finding]:
    """FEED_DIFFERS: an error for feeds that the job names; those that it leaves to the machine
    are told."""
    is_, wanted = both.decoded.feed[both.pairs[:, 0]], both.written.feed[both.pairs[:, 1]]
    off = np.abs(is_ - wanted) > FEED_SHARE * asked.feed_unit_mm_min
    rows, of = both.unlike(~off)
    said = asked.feed_said[of]
    for severity, which in ((Severity.ERROR, said), (Severity.WARNING, ~said)):
        if which.any():
            row, feed = int(rows[which][0]), float(both.written.feed[of][which][0])
            found = float(both.decoded.feed[row])
            named = "asked for" if severity == Severity.ERROR else "the machine's own"
            yield Finding(
                Code.FEED_DIFFERS,
                severity,
                f"{_moves(int(which.sum()))} at another feed: {found:g} mm/min, where {feed:g} is "
                + named,
                where=block_name(both.decoded, row),
                measured=found,
                limit=feed,
                unit="mm_min",
            )


def _spindle(both: _Both) -> Iterator[Finding]:
    """SPINDLE_DIFFERS: an error where the job has the spindle turn, else told."""
    is_, wanted = _settings(both.decoded)[1], _settings(both.written)[1]
    rows, of = both.unlike(is_[both.pairs[:, 0]] == wanted[both.pairs[:, 1]])
    asked = wanted[of] != OFF
    for severity, which in ((Severity.ERROR, asked), (Severity.INFO, ~asked)):
        if which.any():
            row, limit = int(rows[which][0]), float(wanted[of][which][0])
            named = "asked for" if severity == Severity.ERROR else "nobody asked for it"
            words = f"{_turning(float(is_[row]))}, where {_turning(limit)} is"
            yield Finding(
                Code.SPINDLE_DIFFERS,
                severity,
                f"{_moves(int(which.sum()))} with {words} {named}",
                where=block_name(both.decoded, row),
                measured=float(is_[row]),
                limit=limit,
                unit="rev_min",
            )


def _turning(turns: float) -> str:
    if turns == OFF:
        return "the spindle off"
    return f"the spindle at {abs(turns):g} rev/min {'CW' if turns > OFF else 'CCW'}"


def _tools(both: _Both) -> Iterator[Finding]:
    """SETTING_DIFFERS for cuts with another tool than the program of the job has in then."""
    is_, wanted = _settings(both.decoded)[2], _settings(both.written)[2]
    rows, of = both.unlike(is_[both.pairs[:, 0]] == wanted[both.pairs[:, 1]])
    asked = wanted[of] != OFF
    for severity, which in ((Severity.ERROR, asked), (Severity.INFO, ~asked)):
        if which.any():
            row, limit = int(rows[which][0]), float(wanted[of][which][0])
            wished = f"tool {limit:g} is asked for" if limit != OFF else "no tool is asked for"
            yield Finding(
                Code.SETTING_DIFFERS,
                severity,
                f"{_moves(int(which.sum()))} with tool {is_[row]:g}, where {wished}",
                where=block_name(both.decoded, row),
                measured=float(is_[row]),
                limit=limit,
            )


def _corners(both: _Both) -> Iterator[Finding]:
    """SETTING_DIFFERS for moves whose corners may be rounded farther than the written program
    lets the controller round them; what says nothing leaves them to the machine."""
    is_, wanted = _rooms(both.decoded), _rooms(both.written)
    looser = is_[both.pairs[:, 0]] > wanted[both.pairs[:, 1]]
    rows, of = both.unlike(~looser)
    if len(rows):
        row, limit = int(rows[0]), float(wanted[of][0])
        room = "as far as the moves allow" if np.isinf(is_[row]) else f"within {is_[row]:g} mm"
        yield Finding(
            Code.SETTING_DIFFERS,
            Severity.ERROR,
            f"{_moves(len(rows))} with corners rounded {room}, where "
            + (f"{limit:g} mm is asked for" if limit else "none is to be rounded"),
            where=block_name(both.decoded, row),
            measured=float(is_[row]) if np.isfinite(is_[row]) else None,
            limit=limit,
            unit="mm",
        )


def _rooms(toolpath: Toolpath) -> Floats:
    """(N,) mm by which the corner behind each row may be rounded, or lines merged; NaN where the
    program leaves that to the machine."""
    rooms = [
        max(mode.tolerance_mm or np.inf, mode.merging_mm) if mode.corners == "blend" else 0.0
        for mode in toolpath.modes
    ]
    return np.array([*rooms, np.nan])[toolpath.mode]


def _dwells(decoded: Toolpath, written: Toolpath, asked: Asked) -> Iterator[Finding]:
    """SETTING_DIFFERS for places where the tool does not wait as long as was asked."""
    wanted, found = (np.flatnonzero(each.kind == Kind.DWELL) for each in (written, decoded))
    limits = np.array([asked.limits_mm[0], asked.limits_mm[0], asked.limits_mm[1]])
    short = []
    for row in wanted.tolist():
        here = (np.abs(decoded.end[found] - written.end[row]) <= limits).all(axis=1)
        waited = float(decoded.value[found[here]].sum())
        if waited < float(written.value[row]) - DWELL_S:
            short.append((row, waited))
    if short:
        row, waited = short[0]
        yield Finding(
            Code.SETTING_DIFFERS,
            Severity.ERROR,
            f"the tool waits {waited:g} s, where {written.value[row]:g} s are asked for; "
            f"at {len(short)} places",
            where=f"at {at_point(written.end[row])}",
            measured=waited,
            limit=float(written.value[row]),
            unit="s",
        )


def _clearance(mine: Side, other: Side, alike: Alike, asked: Asked) -> Iterator[Finding]:
    """CLEARANCE_LOW for rapids in XY lower than asked, but for those that were asked for."""
    toolpath = mine.toolpath
    if is_flat(other.toolpath):
        return
    start, end = toolpath.starts, toolpath.end
    goes = (toolpath.kind == Kind.RAPID) & (start[:, :2] != end[:, :2]).any(axis=1)
    low = np.minimum(start[:, 2], end[:, 2])
    # Where the machine stands when the program begins is nobody's rapid.
    rising = (start[:, 2] == toolpath.start[2]) & (np.cumsum(toolpath.is_motion) == 1)
    low = np.where(rising, end[:, 2], low)
    least = asked.safe_z_mm - asked.limits_mm[1]
    bad = np.flatnonzero(goes & ~alike.in_written & (low < least))
    if len(bad) == 0:
        return
    row = int(bad[np.argmin(low[bad])])
    whose = "asked for" if asked.safe_z_said else "the machine's own"
    yield Finding(
        Code.CLEARANCE_LOW,
        _gravity(float(low[row]), asked),
        f"{len(bad)} rapids run lower than Z {asked.safe_z_mm:g} mm, {whose}: down to "
        f"Z {low[row]:g} mm",
        where=f"{block_name(toolpath, row)} near {at_point(end[row])}",
        measured=float(low[row]),
        limit=asked.safe_z_mm,
        unit="mm",
    )


def _gravity(low_mm: float, asked: Asked) -> Severity:
    """An error on the stock, and wherever the job names the height of rapids."""
    touching = low_mm <= STOCK_TOP_MM + asked.limits_mm[1]
    return Severity.ERROR if touching or asked.safe_z_said else Severity.WARNING


def _end(decoded: Toolpath, written: Toolpath, asked: Asked) -> Iterator[Finding]:
    """END_DIFFERS for a program without its end, or whose tool ends lower than was asked."""
    if (written.kind == Kind.END).any() and not (decoded.kind == Kind.END).any():
        yield Finding(
            Code.END_DIFFERS,
            Severity.ERROR,
            "the program has no end: no block says that it is over",
            where=block_name(decoded, len(decoded) - 1) if len(decoded) else "",
        )
    last, goal = _last(decoded), _last(written)
    if last[2] < min(goal[2], asked.safe_z_mm) - asked.limits_mm[1]:
        yield Finding(
            Code.END_DIFFERS,
            _gravity(float(last[2]), asked),
            f"the tool ends at Z {last[2]:g} mm, where Z {goal[2]:g} mm is asked for",
            where=f"at {at_point(last)}",
            measured=float(last[2]),
            limit=float(goal[2]),
            unit="mm",
        )
    elif np.hypot(*(last - goal)[:2]) > asked.limits_mm[0]:
        yield Finding(
            Code.END_DIFFERS,
            Severity.INFO,
            f"the tool ends at {at_point(last)}; camtool would end at {at_point(goal)}",
        )


def _last(toolpath: Toolpath) -> Floats:
    return toolpath.end[-1] if len(toolpath) else toolpath.start


def _moves(count: int) -> str:
    return f"{count} moves run" if count != 1 else "1 move runs"
