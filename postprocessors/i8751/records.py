"""The writer's stages before bytes: what this machine cannot do is refused, the rest made records.

A record moves X and Y, waits T1, moves Z, waits T2 (L4151-4167). Every end is rounded to whole
steps from part zero, never from the record before, so that rounding does not add up. Arcs become
chords, slopes become flat moves and small ones of Z, lines are cut where their dog-leg would stray
too far (`dogleg.py`) and where a motor would make more steps than two bytes can hold."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats, Ints
from camtool.errors import PostError
from camtool.toolpath.lower import arcs_to_lines, helices_to_steps, slope_step_mm
from camtool.toolpath.moves import Kind, Toolpath, mounted_before
from camtool.toolpath.refusals import refuse, refuse_start, refuse_two_radii

from .dialect import MAX_DWELL_BYTE_S, I8751Dialect, I8751Machine
from .dogleg import FREE, StepLine, elbows, reaches

MAX_STEPS: Final = 10_000_000

MAX_DWELL_S: Final = 36_000.0

MAX_RECORDS: Final = 2_000_000

REFUSED: Final = {
    Kind.HOME_XY: "this machine has no limit switches to go home to",
    Kind.HOME_Z: "this machine has no limit switches to go home to",
}
"""Homing was proposed and not built (L5267-5273)."""


def check_toolpath(toolpath: Toolpath, machine: I8751Machine, dialect: I8751Dialect) -> None:
    """Raise PostError for the first row that this machine cannot execute."""
    refuse_start(toolpath)
    _check_events(toolpath)
    _check_coordinates(toolpath, machine)
    with np.errstate(invalid="ignore"):
        bad_feed = toolpath.is_feed & ~((toolpath.feed > 0.0) & np.isfinite(toolpath.feed))
    refuse(
        toolpath,
        bad_feed,
        lambda row: f"a feed of {toolpath.feed[row]:g} mm/min",
        "give a feed above 0; this machine then moves at its own speed",
    )
    # Its chords end at its end, so that its radii may differ by its tolerance.
    refuse_two_radii(toolpath, dialect.arc_tolerance_mm)


def _check_events(toolpath: Toolpath) -> None:
    kind, value = toolpath.kind, toolpath.value
    refuse(
        toolpath,
        (kind == Kind.TOOL_CHANGE) & ~mounted_before(toolpath),
        "this machine has no stop for a tool change",
        "write a program for each tool (--split tool)",
    )
    for refused_kind, message in REFUSED.items():
        refuse(
            toolpath,
            kind == refused_kind,
            message,
            "leave it out, and do it by hand before the program",
        )
    refuse(
        toolpath,
        (kind == Kind.SET_ZERO) & toolpath.end.any(axis=1),
        "part zero is set away from where the program starts",
        "set it first, before any move",
    )
    with np.errstate(invalid="ignore"):
        is_bad = (kind == Kind.DWELL) & ~((value >= 0.0) & (value <= MAX_DWELL_S))
    refuse(
        toolpath,
        is_bad,
        lambda row: f"a dwell of {value[row]:g} s does not fit into the program",
        f"use 0 to {MAX_DWELL_S:g} s",
    )
    ends_before = np.cumsum(kind == Kind.END) - (kind == Kind.END)
    refuse(
        toolpath,
        ends_before > 0,
        "something follows the end of the program",
        "end the program once, in its last row",
    )


def _check_coordinates(toolpath: Toolpath, machine: I8751Machine) -> None:
    for axis, (name, axis_settings) in enumerate(zip("XYZ", machine.axes, strict=True)):
        most_mm = MAX_STEPS * axis_settings.coded_step_mm
        values = toolpath.end[:, axis]
        refuse(
            toolpath,
            np.abs(values) > most_mm,
            lambda row, name=name, values=values: (  # type: ignore[misc]
                f"{name} = {values[row]:.6g} mm is more than {MAX_STEPS} steps"
            ),
            "check the unit of the drawing and the machine's coded_step_mm",
        )


class Counts(Struct):
    """Counts of the writer's changes, for the findings; places name the first of each kind."""

    arcs: int = 0
    chords: int = 0
    slopes: int = 0
    slopes_place: str = ""
    slope_step_mm: float = 0.0
    cut_lines: int = 0
    cut_pieces: int = 0
    long_moves: int = 0
    dropped: int = 0
    dwells_rounded: int = 0
    spindle: int = 0
    spindle_place: str = ""
    tools: int = 0
    feeds: int = 0


class Records(Struct, frozen=True, eq=False):
    """R records: steps (R, 3), waits (R, 2) s, row (R,) of the toolpath that each came from;
    `messages` as (record that it precedes, text); `end_row` of the END, -1 without one."""

    steps: Ints
    waits: Ints
    row: Ints
    messages: tuple[tuple[int, str], ...]
    end_row: int
    counts: Counts = field(default_factory=Counts)

    def __len__(self) -> int:
        return len(self.steps)


def records_of(toolpath: Toolpath, machine: I8751Machine, dialect: I8751Dialect) -> Records:
    """Return the records of a checked toolpath; PostError when it moves nothing, or far too
    much."""
    counts = Counts()
    path, row = _lower(toolpath, slope_step_mm(machine), dialect, counts)
    deltas = np.diff(
        _nearest_steps(path, machine), axis=0, prepend=np.zeros((1, 3), dtype=np.int64)
    )
    refuse(
        path,
        ~path.is_motion & deltas.any(axis=1),
        lambda row: f"a {Kind(int(path.kind[row])).name} cannot move the tool",
        "give the row the position of the tool",
    )
    pieces = _cut_rows(path, deltas, machine, dialect, counts)
    # Parts of slopes may be small: only whole rows are missed.
    is_whole = np.bincount(row, minlength=len(toolpath))[row] == 1
    counts.dropped = int((path.is_motion & ~deltas.any(axis=1) & is_whole).sum())
    counts.feeds = int(toolpath.is_feed.sum())
    each = np.where(deltas.any(axis=1), 1, 0)
    for index, parts in pieces.items():
        each[index] = len(parts)
    owner = np.repeat(np.arange(len(path)), each)
    first = np.cumsum(each) - each
    steps = deltas[owner]
    del deltas
    for index, parts in pieces.items():
        steps[first[index] : first[index] + len(parts)] = parts
    if dialect.z_alone == "with-step":
        steps = _with_x_steps(steps)
    without_waits = _Plain(steps, owner, path, counts)
    records = without_waits.with_waits(row, first)
    if dialect.z_alone == "with-step" and not records.steps[:, :2].any(axis=1).all():
        raise PostError(
            "a dwell needs a record in which nothing moves, and this controller takes none",
            mend="dwell after a move and for 255 s at most, or use --set dialect.z_alone=plain",
        )
    return records


def _lower(
    toolpath: Toolpath, step_mm: float, dialect: I8751Dialect, counts: Counts
) -> tuple[Toolpath, Ints]:
    """Return the toolpath as lines of XY or of Z only, and the row of the given toolpath that each
    came from; count what was changed."""
    two_lines = helices_to_steps(toolpath, step_mm)
    # Splitting a rapid in two does no harm; a slope cut in steps differs from the wanted cut.
    cut = (np.bincount(two_lines.row, minlength=len(toolpath)) > 1) & toolpath.is_feed
    counts.slopes, counts.slope_step_mm = int(cut.sum()), step_mm
    counts.slopes_place = toolpath.place(int(cut.argmax())) if counts.slopes else ""
    arcs = two_lines.toolpath.is_arc
    lines = arcs_to_lines(two_lines.toolpath, arcs, dialect.arc_tolerance_mm)
    counts.arcs = int(arcs.sum())
    counts.chords = counts.arcs + len(lines.toolpath) - len(two_lines.toolpath)
    return lines.toolpath, two_lines.row[lines.row]


def _nearest_steps(toolpath: Toolpath, machine: I8751Machine) -> Ints:
    """Return the ends (N, 3) in whole steps, half away from zero."""
    scaled = toolpath.end / np.array([axis.coded_step_mm for axis in machine.axes])
    return np.asarray((np.sign(scaled) * np.floor(np.abs(scaled) + 0.5)).astype(np.int64))


def _cut_rows(
    toolpath: Toolpath, deltas: Ints, machine: I8751Machine, dialect: I8751Dialect, counts: Counts
) -> dict[int, Ints]:
    """Return the rows that need more than one record, each with the steps (k, 3) of its
    records."""
    xy = deltas[:, :2]
    # A step aside (`_with_x_steps`) comes on top.
    max_steps = dialect.most_steps - (1 if dialect.z_alone == "with-step" else 0)
    step_mm = (machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    reach = np.where(toolpath.is_feed, reaches(xy, step_mm, dialect.tolerance_mm), FREE)
    strays = (reach != FREE) & (elbows(xy) > reach)
    is_far = np.abs(deltas).max(axis=1, initial=0) > max_steps
    counts.long_moves = int((is_far & ~strays).sum())
    counts.cut_lines = int(strays.sum())
    of_elbows = np.where(strays, elbows(xy) / (2.0 * np.maximum(reach, 1)), 0.0)
    _refuse_too_many(np.abs(deltas).max(axis=1, initial=0) / max_steps + of_elbows)
    pieces = {}
    for row in np.flatnonzero(strays | is_far).tolist():
        dx, dy, dz = deltas[row].tolist()
        if dz:
            parts = [(0, 0, part) for part in _split_long(dz, max_steps)]
        else:
            line = StepLine(dx, dy, int(reach[row]))
            parts = [(*part, 0) for part in line.pieces(max_steps)]
        pieces[row] = np.array(parts, dtype=np.int64)
        counts.cut_pieces += len(parts) if strays[row] else 0
    return pieces


def _refuse_too_many(each: Floats) -> None:
    """Raise PostError if the rows together need more records than a program may have; `each` (N,):
    a lower bound of each row's number."""
    total = float(np.maximum(each, 1.0).sum())
    if total > MAX_RECORDS:
        raise PostError(
            f"the program would have about {total:.3g} records, more than {MAX_RECORDS}",
            mend="use a larger dialect.tolerance_mm, or check the unit of the drawing",
        )


def _split_long(steps: int, max_steps: int) -> list[int]:
    """Split `steps` into parts of at most `max_steps`, the rest last."""
    full_parts, last_part = divmod(abs(steps), max_steps)
    sign = 1 if steps > 0 else -1
    return [sign * max_steps] * full_parts + ([sign * last_part] if last_part else [])


def _with_x_steps(steps: Ints) -> Ints:
    """Return records in which Z never moves alone: X makes one step aside, and goes back in the
    next record.

    Only for controllers that take no record in which both X and Y stand still (the thesis shows
    none). The step aside is taken back as soon as a record moves X or Y anyway, or at the end."""
    result = steps.copy()
    x_offset = 0
    for record, (x, y, z) in enumerate(steps.tolist()):
        if not (x or y):
            next_offset = 1 - x_offset
        else:
            # If going back would leave a record without a step, a later one goes back.
            next_offset = x_offset if (x, y, z) == (x_offset, 0, 0) and x_offset else 0
        result[record, 0] += next_offset - x_offset
        x_offset = next_offset
    return np.concatenate([result, [[-1, 0, 0]]]) if x_offset else result


class _Plain(Struct, frozen=True, eq=False):
    """Records that move, before the waits are put between them."""

    steps: Ints
    owner: Ints
    lowered: Toolpath
    counts: Counts

    def with_waits(self, row: Ints, first: Ints) -> Records:
        """Return the records with waits, messages and end; `first` (N,) is the record of each row.

        A wait follows in T2 of the record before it. What exceeds T2, or comes before the first
        record, goes into additional records that move nothing."""
        if not len(self.steps):
            raise PostError(
                "nothing moves by a whole step: there is no program to write",
                mend="scale the drawing up",
            )
        # A step back at the end belongs to the last row that moved.
        owner_of_return = np.full(len(self.steps) - len(self.owner), self.owner[-1])
        owner = np.concatenate([self.owner, owner_of_return])
        waits = np.zeros((len(self.steps), 2), dtype=np.int64)
        extra_records: list[tuple[int, int, int]] = []
        messages: list[tuple[int, str]] = []
        end_row = -1
        for index in np.flatnonzero(~self.lowered.is_motion).tolist():
            kind, record = Kind(int(self.lowered.kind[index])), int(first[index])
            if kind == Kind.DWELL:
                remaining_s = self._whole_seconds(index)
                if record and not (extra_records and extra_records[-1][0] == record):
                    wait_s = min(remaining_s, MAX_DWELL_BYTE_S - int(waits[record - 1, 1]))
                    waits[record - 1, 1] += wait_s
                    remaining_s -= wait_s
                extra_records += [
                    (record, part, index) for part in _split_long(remaining_s, MAX_DWELL_BYTE_S)
                ]
            elif kind == Kind.MESSAGE:
                text = self.lowered.texts[int(self.lowered.value[index])]
                messages.append((record + len(extra_records), text))
            elif kind == Kind.END:
                end_row = int(row[index])
            elif kind == Kind.TOOL_CHANGE:
                self.counts.tools += 1
            elif kind != Kind.SET_ZERO:
                self._note_spindle(index)
        steps = self.steps
        if extra_records:
            places = [record for record, _, _ in extra_records]
            steps = np.insert(steps, places, 0, axis=0)
            waits = np.insert(
                waits, places, [[0, seconds] for _, seconds, _ in extra_records], axis=0
            )
            owner = np.insert(owner, places, [index for _, _, index in extra_records])
        return Records(
            steps=steps,
            waits=waits,
            row=row[owner],
            messages=tuple(messages),
            end_row=end_row,
            counts=self.counts,
        )

    def _whole_seconds(self, index: int) -> int:
        """Return a dwell in whole seconds, rounded up so that it is never shorter than wanted."""
        seconds = float(self.lowered.value[index])
        self.counts.dwells_rounded += seconds != math.floor(seconds)
        return math.ceil(seconds)

    def _note_spindle(self, index: int) -> None:
        if not self.counts.spindle:
            self.counts.spindle_place = self.lowered.place(index)
        self.counts.spindle += 1
