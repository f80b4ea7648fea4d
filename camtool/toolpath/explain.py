"""A program block by block in words: what the controller does there, from its decoded moves."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.toolpath.moves import Kind, Move, PathMode, Toolpath
from camtool.toolpath.program import Listing

MAX_MOVES = 4
"""At most this many moves of one block are explained one by one: a cycle has a few, a spline may
have thousands."""

_NO_WORDS = re.compile(r"\([^)]*\)|;.*|<[^>]*>|\s")
"""Pattern of comments, names of subroutines and parameters, and blanks."""

_WORD = re.compile(r"([A-Z])0*(\d+(?:\.\d+)?)")

_EVENTS: dict[Kind, str] = {
    Kind.DWELL: "wait {value:g} s",
    Kind.SPINDLE_CW: "spindle clockwise at {value:g} rev/min",
    Kind.SPINDLE_CCW: "spindle counter-clockwise at {value:g} rev/min",
    Kind.SPINDLE_OFF: "spindle off",
    Kind.TOOL_CHANGE: "change to tool {value:g}",
    Kind.SET_ZERO: "this place becomes part zero",
    Kind.HOME_XY: "return to machine zero in X and Y",
    Kind.HOME_Z: "return to machine zero in Z",
    Kind.END: "end of the program",
    Kind.COOLANT_MIST: "mist on",
    Kind.COOLANT_FLOOD: "flood on",
    Kind.COOLANT_OFF: "coolant off",
}


class ExplainedMove(Struct, frozen=True):
    """A move or an event of a block: `kind` as in `Kind`, in small letters; mm, degrees (clockwise
    is negative), mm/min; None for what it does not have."""

    kind: str
    to_mm: tuple[float, float, float]
    centre_mm: tuple[float, float] | None = None
    radius_mm: float | None = None
    sweep_deg: float | None = None
    feed_mm_min: float | None = None
    value: float | None = None


class ExplainedBlock(Struct, frozen=True):
    """A block, from 1, and the line of the file on which it stands, None where files have no
    lines; its text and what it does; how often the program comes to it from another block, and its
    moves the first time."""

    block: int
    line: int | None
    text: str
    words: tuple[str, ...]
    visits: int
    moves: tuple[ExplainedMove, ...]


def explain(
    toolpath: Toolpath,
    listing: Listing | None,
    meanings: Mapping[str, str],
    first: int = 1,
    last: int | None = None,
) -> Iterator[ExplainedBlock]:
    """Yield the blocks of a decoded program on the lines `first` to `last` (of the file; where its
    blocks have no lines, these blocks), in the order of the file.

    `meanings` are those of words that move nothing, such as "G21"."""
    highest = int(toolpath.block.max(initial=-1)) + 1
    count = highest if listing is None else len(listing.blocks)
    lines = () if listing is None else listing.lines
    numbers = lines or range(1, count + 1)
    order = np.argsort(toolpath.block, kind="stable")
    bounds = np.searchsorted(toolpath.block[order], np.arange(count + 1))
    teller = _Teller(toolpath)
    for block, number in enumerate(numbers):
        if number < first or (last is not None and number > last):
            continue
        rows = order[bounds[block] : bounds[block + 1]]
        text = "" if listing is None else listing.blocks[block]
        ends = np.flatnonzero(np.diff(rows) != 1) + 1
        own_rows = rows[: ends[0]] if len(ends) else rows
        words = [*_modal_words(text, meanings), *teller.words(own_rows)]
        visits = len(ends) + bool(len(rows))
        if visits > 1:
            words.append(f"the program comes here {visits} times; this is the first")
        yield ExplainedBlock(
            block + 1,
            number if lines else None,
            text,
            tuple(dict.fromkeys(words)) or ("nothing moves",),
            visits,
            tuple(teller.moves(own_rows)),
        )


def _modal_words(text: str, meanings: Mapping[str, str]) -> Iterator[str]:
    """Yield the meanings, from `meanings`, of the words of a block outside of its comments."""
    bare = _NO_WORDS.sub("", text).upper()
    for letter, number in _WORD.findall(bare) if meanings else ():
        meaning = meanings.get(f"{letter}{number}")
        if meaning is not None:
            yield meaning


class _Teller:
    """Explains the moves of one toolpath in sentences and records."""

    def __init__(self, toolpath: Toolpath) -> None:
        self._path = toolpath
        self._starts = toolpath.starts
        self._sweeps = toolpath.sweeps()
        fed = np.flatnonzero(toolpath.is_feed)
        is_new = np.ones(len(fed), dtype=bool)
        is_new[1:] = np.diff(toolpath.feed[fed]) != 0.0
        self._has_new_feed = np.zeros(len(toolpath), dtype=bool)
        self._has_new_feed[fed[is_new]] = True
        moving = np.flatnonzero(toolpath.is_motion)
        is_new = np.ones(len(moving), dtype=bool)
        is_new[1:] = np.diff(toolpath.mode[moving]) != 0
        self._has_new_mode = np.zeros(len(toolpath), dtype=bool)
        self._has_new_mode[moving[is_new]] = True

    def words(self, rows: Ints) -> Iterator[str]:
        """Yield a sentence for each of these rows, the first MAX_MOVES of them, and one that
        counts the others."""
        for row in rows[:MAX_MOVES].tolist():
            yield self._row_words(row)
        if len(rows) > MAX_MOVES:
            place = _place(self._path.end[rows[-1]].tolist(), "XYZ")
            yield f"and {len(rows) - MAX_MOVES} more moves, the last to {place} mm"

    def moves(self, rows: Ints) -> Iterator[ExplainedMove]:
        """Yield a record for each of these rows of the toolpath."""
        for row in rows.tolist():
            move = self._move(row)
            sweep = float(self._sweeps[row])
            yield ExplainedMove(
                move.kind.name.lower(),
                move.end,
                move.centre,
                None if move.centre is None else _radius(move, move.centre),
                math.degrees(sweep) if sweep else None,
                move.feed,
                move.value,
            )

    def _move(self, row: int) -> Move:
        path, kind = self._path, Kind(int(self._path.kind[row]))
        x, y, z = path.end[row].tolist()
        start_x, start_y, start_z = self._starts[row].tolist()
        centre = path.centre[row].tolist() if kind in (Kind.ARC_CW, Kind.ARC_CCW) else None
        feed, value = float(path.feed[row]), float(path.value[row])
        return Move(
            index=row,
            kind=kind,
            start=(start_x, start_y, start_z),
            end=(x, y, z),
            centre=None if centre is None else (centre[0], centre[1]),
            feed=None if math.isnan(feed) else feed,
            value=None if math.isnan(value) else value,
            source=path.text(row),
            block=int(path.block[row]),
        )

    def _row_words(self, row: int) -> str:
        move = self._move(row)
        if move.kind == Kind.MESSAGE:
            return f"message: {self._path.texts[int(move.value or 0)]}"
        if move.kind == Kind.DWELL and not move.value:
            return "come to rest"
        if move.kind > Kind.ARC_CCW:
            return _EVENTS[move.kind].format(value=move.value or 0.0)
        parts = [self._motion_words(move, float(self._sweeps[row]))]
        if self._has_new_feed[row] and move.feed is not None:
            parts.append(f"feed {move.feed:g} mm/min ({move.feed / 60.0:.3g} mm/s)")
        mode = int(self._path.mode[row])
        if self._has_new_mode[row] and mode >= 0:
            parts.append(_mode_words(self._path.modes[mode]))
        return ", ".join(parts)

    def _motion_words(self, move: Move, sweep: float) -> str:
        """Return a sentence for a move: line, rapid or arc, and its end on the axes that move."""
        axes = "".join(
            axis
            for axis, low, high in zip("XYZ", move.start, move.end, strict=True)
            if low != high
        )
        place = f"to {_place(move.end, axes)} mm" if axes else "that stays where it is"
        if move.centre is not None:
            turn = "clockwise" if sweep < 0.0 else "counter-clockwise"
            is_full = "X" not in axes and "Y" not in axes
            shape = "full circle" if is_full else "arc"
            end = "" if is_full and not axes else f" {place}"
            centre, radius = _place((*move.centre, 0.0), "XY"), _radius(move, move.centre)
            size = "" if is_full else f", {abs(math.degrees(sweep)):.4g}°"
            return f"{shape} {turn}{end} around {centre} mm, radius {_mm(radius)} mm{size}"
        name = "rapid" if move.kind == Kind.RAPID else "line"
        if axes == "Z":
            name += " down" if move.end[2] < move.start[2] else " up"
        return f"{name} {place}"


def _radius(move: Move, centre: tuple[float, float]) -> float:
    return math.hypot(move.start[0] - centre[0], move.start[1] - centre[1])


def _mode_words(mode: PathMode) -> str:
    if mode.corners == "exact-stop":
        return "with a stop at each corner"
    if mode.corners == "exact-path":
        return "corners met exactly"
    if not mode.tolerance_mm:
        return "corners rounded as far as the moves allow"
    return f"corners rounded within {mode.tolerance_mm:g} mm"


def _place(point: tuple[float, ...] | list[float], axes: str) -> str:
    pairs = zip("XYZ", point, strict=True)
    return " ".join(f"{axis} {_mm(value)}" for axis, value in pairs if axis in axes)


def _mm(value: float) -> str:
    """Format mm with up to four decimals, never −0."""
    text = f"{round(value, 4) or 0.0:.4f}".rstrip("0")
    return text.removesuffix(".")
