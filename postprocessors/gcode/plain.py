"""Writing flashcut and valcnc: what both refuse, split or leave out, and how their arcs survive.

Their theses give no rule for arcs whose radii differ, so both radii are equal to within a unit. A
*unit* is the last decimal that is written. Start, end and centre lie on whole units; what is sent
is the end and the offset centre − start. For each arc, by its rounded numbers:

    sagitta below half a unit        one line does as well
    a centre within RECENTRE_REACH units of the rounded one, from which start and end are equally
    far to within a unit, and about which the arc turns as wanted
                                     the one nearest to the wanted centre
    otherwise                        lines within a unit of the arc"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import Final, Literal

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Codes, Floats, Ints
from camtool.errors import PostError
from camtool.findings import Finding, Sentence
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.toolpath.lower import (
    LoweredToolpath,
    arcs_to_lines,
    arcs_within,
    helices_to_steps,
    slope_step_mm,
)
from camtool.toolpath.moves import Kind, Toolpath, are_arcs

from .arcs import FLAT_UNITS, LINE_SAGITTA_UNITS, sagitta_of, turns_of
from .checks import check
from .findings import ARC_MENDED_PLAIN, MOVE_COLLAPSED, MOVE_SPLIT
from .format import units_of

SPREAD_UNITS: Final = 1.0
"""The radii at start and end of a written arc differ by no more units."""

MIN_RADIUS_UNITS: Final = 4.0
"""Smaller arcs become lines: rounding alone would turn their ends by more than 20°."""

RECENTRE_REACH: Final = 2
"""Centres are tried up to this many units from the rounded one, in I and in J."""


def check_plain(toolpath: Toolpath, machine: Machine) -> None:
    """Raise PostError for the first row that the program cannot express, with its number in the
    toolpath."""
    check(toolpath, machine)
    for row in np.flatnonzero(~toolpath.is_motion).tolist():
        kind = Kind(int(toolpath.kind[row]))
        if kind in (Kind.HOME_XY, Kind.HOME_Z):
            raise PostError(
                "this machine has no code to go to machine zero",
                where=toolpath.place(row),
                mend="leave homing out and do it by hand",
            )
        if kind == Kind.SET_ZERO and toolpath.end[row].any():
            raise PostError(
                "part zero can only be set at part zero",
                where=toolpath.place(row),
                mend="set it first, before any move",
            )
        if kind == Kind.END and row < len(toolpath) - 1:
            raise PostError(
                "moves follow the end of the program",
                where=toolpath.place(row + 1),
                mend="end the program last",
            )


def split_z(toolpath: Toolpath, machine: Machine) -> tuple[LoweredToolpath, list[Finding]]:
    """Return the toolpath with moves in XY and in Z separate, and slopes and helices as steps; and
    MOVE_SPLIT if a move at a feed had to be split."""
    step_mm = slope_step_mm(machine)
    parts = helices_to_steps(toolpath, step_mm)
    is_split = np.bincount(parts.row, minlength=len(toolpath)) > 1
    is_split &= toolpath.is_feed
    if not is_split.any():
        return parts, []
    place = toolpath.place(int(is_split.argmax()))
    return parts, [MOVE_SPLIT(where=place, measured=step_mm, count=int(is_split.sum()))]


def left_out(toolpath: Toolpath, kinds: Collection[Kind], sentence: Sentence) -> Iterator[Finding]:
    """Yield one finding with the number of rows of these kinds, if there are any: the program
    leaves them out."""
    rows = np.flatnonzero(np.isin(toolpath.kind, [int(kind) for kind in kinds]))
    if len(rows):
        names = ", ".join(dict.fromkeys(Kind(kind).name for kind in toolpath.kind[rows].tolist()))
        yield sentence(where=toolpath.place(int(rows[0])), count=len(rows), kinds=names)


class ArcRules(Struct, frozen=True):
    """Rules of a dialect for arcs. `most_mm`: longest offset of a centre; `chord_fits`: the chord
    must not exceed twice the radius at the start (a controller that takes its arcsine)."""

    decimals: int
    full_circles: Literal["halves", "whole"]
    most_mm: float
    chord_fits: bool = False


class PlainRows(Struct, frozen=True, eq=False):
    """M rows in units: `kind` (M,), `end` (M, 3), `offset` (M, 2) of the centre from the start
    (0 where no arc), `start` (3,), and `row` (M,), the given toolpath's row of each."""

    kind: Codes
    end: Ints
    offset: Ints
    start: Ints
    row: Ints
    flat: int
    recentred: int
    lines: int
    first: int
    """Given row of the first arc that was re-centred or written as lines; −1 when none was."""

    @property
    def starts(self) -> Ints:
        """Starts (M, 3) of the rows, in units."""
        return np.concatenate([self.start[None, :], self.end])[:-1]

    @property
    def is_arc(self) -> Bools:
        """Mask (M,) of the arcs."""
        return are_arcs(self.kind)

    @property
    def moves(self) -> Bools:
        """Mask (M,) of motions that leave their start, and of all arcs."""
        motion = self.kind <= Kind.ARC_CCW
        return np.asarray(self.is_arc | (motion & (self.end != self.starts).any(axis=1)))


def plain_rows(toolpath: Toolpath, rules: ArcRules) -> PlainRows:
    """Return the rows of a toolpath, whose lengths are those of the program, in whole units, with
    arcs changed until the controller's rules hold for the rounded numbers."""
    halved = _halve_circles(toolpath, rules)
    path = halved.toolpath
    rows = np.flatnonzero(path.is_arc)
    begin, stop = units_of(path.starts, rules.decimals), units_of(path.end, rules.decimals)
    arcs = WantedArcs(path, rows, begin[rows, :2], stop[rows, :2], rules)
    flat = arcs.sagitta < FLAT_UNITS
    centre, has_centre, has_moved = _centres(arcs)
    has_no_centre, has_moved = ~flat & ~has_centre, has_moved & ~flat & has_centre
    changed_rows = halved.row[rows[has_no_centre | has_moved]]
    kind = path.kind.copy()
    kind[rows[flat]] = Kind.LINE
    # Indexed by row of `path`: replacing arcs by lines adds rows.
    offset = np.zeros((len(path), 2), dtype=np.int64)
    has_arc = ~flat & has_centre
    offset[rows[has_arc]] = centre[has_arc] - begin[rows[has_arc], :2]
    is_line = np.zeros(len(path), dtype=np.bool_)
    is_line[rows[has_no_centre]] = True
    unit = 10.0**-rules.decimals
    chords = arcs_to_lines(replace(path, kind=kind), is_line, LINE_SAGITTA_UNITS * unit)
    return PlainRows(
        kind=chords.toolpath.kind,
        end=units_of(chords.toolpath.end, rules.decimals),
        offset=offset[chords.row],
        start=units_of(toolpath.start, rules.decimals),
        row=halved.row[chords.row],
        flat=int(flat.sum()),
        recentred=int(has_moved.sum()),
        lines=int(has_no_centre.sum()),
        first=int(changed_rows[0]) if len(changed_rows) else -1,
    )


def arc_findings(rows: PlainRows, place: str) -> Iterator[Finding]:
    """Yield ARC_MENDED for arcs with another centre, and MOVE_COLLAPSED for moves smaller than a
    unit, if there are any."""
    if rows.recentred or rows.lines:
        yield ARC_MENDED_PLAIN(
            where=place,
            measured=rows.recentred + rows.lines,
            recentred=rows.recentred,
            lines=rows.lines,
        )
    dropped = int(((rows.kind <= Kind.ARC_CCW) & ~rows.moves).sum())
    if dropped or rows.flat:
        yield MOVE_COLLAPSED(measured=dropped + rows.flat, dropped=dropped, flat=rows.flat)


def _halve_circles(toolpath: Toolpath, rules: ArcRules) -> LoweredToolpath:
    """Return the toolpath with each full circle, and each arc whose rounded ends coincide, cut
    into two halves; other rows unchanged."""
    begin = units_of(toolpath.starts, rules.decimals)
    stop = units_of(toolpath.end, rules.decimals)
    is_full = toolpath.is_arc & (begin[:, :2] == stop[:, :2]).all(axis=1)
    is_full &= np.abs(toolpath.sweeps()) > math.pi
    if rules.full_circles == "whole" or not is_full.any():
        return LoweredToolpath(toolpath, np.arange(len(toolpath)))
    # Other arcs are marked as lines meanwhile, so that only these are cut.
    kinds = np.where(toolpath.is_arc & ~is_full, int(Kind.LINE), toolpath.kind)
    halves = arcs_within(replace(toolpath, kind=kinds), math.pi)
    kind = toolpath.kind[halves.row]
    return LoweredToolpath(replace(halves.toolpath, kind=kind), halves.row)


class WantedArcs:
    """K arcs as wanted and as rounded: all lengths in units."""

    def __init__(
        self, path: Toolpath, rows: Ints, begin: Ints, stop: Ints, rules: ArcRules
    ) -> None:
        scale = 10.0**rules.decimals
        arm = (path.starts[rows, :2] - path.centre[rows]) * scale
        self.begin, self.stop, self.rules = begin, stop, rules
        self.centre: Floats = path.centre[rows] * scale
        self.radius = np.hypot(arm[:, 0], arm[:, 1])
        self.sweep = np.abs(path.sweeps()[rows])
        self.clockwise = path.kind[rows] == Kind.ARC_CW
        self.sagitta = sagitta_of(self.radius, self.sweep)
        self.most = rules.most_mm * scale

    def fits(self, indices: Ints, centre: Floats) -> Bools:
        """Return a mask (L,), true for the arcs `indices` that satisfy the dialect's rules about
        these rounded centres (L, 2)."""
        begin, stop = self.begin[indices], self.stop[indices]
        start_arm, end_arm = begin - centre, stop - centre
        r1, r2 = np.hypot(*start_arm.T), np.hypot(*end_arm.T)
        turn = turns_of(start_arm, end_arm, self.clockwise[indices])
        is_fit = (np.abs(r1 - r2) <= SPREAD_UNITS) & (r1 >= MIN_RADIUS_UNITS)
        is_fit &= (np.abs(turn - self.sweep[indices]) < math.pi) & (
            np.abs(start_arm).max(axis=1) <= self.most
        )
        if self.rules.chord_fits:
            is_fit &= np.hypot(*(stop - begin).T) <= 2.0 * r1
        return np.asarray(is_fit)


def _centres(arcs: WantedArcs) -> tuple[Ints, Bools, Bools]:
    """Return for each of K arcs its centre (K, 2) in units, a mask (K,) of those that have one,
    and a mask (K,) of those whose centre is not simply the rounded one."""
    count = len(arcs.radius)
    in_range = arcs.radius <= arcs.most
    centre = np.zeros((count, 2), dtype=np.int64)
    centre[in_range] = np.rint(arcs.centre[in_range]).astype(np.int64)
    every = np.arange(count)
    has_centre = in_range.copy()
    has_centre[in_range] = arcs.fits(every[in_range], centre[in_range].astype(np.float64))
    has_moved = np.zeros(count, dtype=np.bool_)
    open_arcs = every[in_range & ~has_centre & (arcs.radius >= MIN_RADIUS_UNITS - SPREAD_UNITS)]
    if not len(open_arcs):
        return centre, has_centre, has_moved
    reach = np.arange(-RECENTRE_REACH, RECENTRE_REACH + 1)
    steps = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    candidates = centre[open_arcs][:, None, :] + steps[None, :, :]
    distances = np.hypot(*np.moveaxis(candidates - arcs.centre[open_arcs][:, None, :], -1, 0))
    flat = candidates.reshape(-1, 2).astype(np.float64)
    is_fit = arcs.fits(np.repeat(open_arcs, len(steps)), flat).reshape(distances.shape)
    best = np.where(is_fit, distances, np.inf).argmin(axis=1)
    any_good = is_fit.any(axis=1)
    centre[open_arcs[any_good]] = candidates[np.flatnonzero(any_good), best[any_good]]
    has_centre[open_arcs[any_good]] = True
    has_moved[open_arcs[any_good]] = True
    return centre, has_centre, has_moved
