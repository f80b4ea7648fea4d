"""Writing flashcut and valcnc: what both refuse, split or leave out, and how their arcs survive.

Their theses give no rule for arcs whose radii differ, so both radii are equal to within a unit. A
*unit* is the last decimal that is written. Start, end and centre lie on whole units; what is sent
is the end and the offset centre − start. For each arc, by its rounded numbers:

    sagitta below half a unit        one line does as well
    a centre within RECENTRE_REACH units of the rounded one, from which start and end are equally
    far to within a unit, and about which the arc turns as wanted
                                     the one nearest to the wanted centre
    otherwise                        lines within a unit of the arc
"""

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
    """PostError for the first row that has no meaning there, named as the toolpath numbers it."""
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
    """XY and Z apart, slopes and helices as steps; and MOVE_SPLIT when a feed move had to be."""
    step_mm = slope_step_mm(machine)
    lowered = helices_to_steps(toolpath, step_mm)
    twice = np.bincount(lowered.row, minlength=len(toolpath)) > 1
    twice &= toolpath.is_feed
    if not twice.any():
        return lowered, []
    where = toolpath.place(int(twice.argmax()))
    return lowered, [MOVE_SPLIT(where=where, measured=step_mm, count=int(twice.sum()))]


def left_out(toolpath: Toolpath, kinds: Collection[Kind], sentence: Sentence) -> Iterator[Finding]:
    """Yield a finding with the number of rows of these kinds, which the program leaves out, if
    there are any."""
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
        """(M, 3) units: where each row begins."""
        return np.concatenate([self.start[None, :], self.end])[:-1]

    @property
    def is_arc(self) -> Bools:
        """(M,) true for ARC_CW and ARC_CCW."""
        return are_arcs(self.kind)

    @property
    def moves(self) -> Bools:
        """(M,) true for motions that leave their start, and for all arcs."""
        motion = self.kind <= Kind.ARC_CCW
        return np.asarray(self.is_arc | (motion & (self.end != self.starts).any(axis=1)))


def plain_rows(toolpath: Toolpath, rules: ArcRules) -> PlainRows:
    """The rows of a toolpath (in the program's own lengths) in units, arcs made consistent."""
    lowered = _halve_circles(toolpath, rules)
    path = lowered.toolpath
    rows = np.flatnonzero(path.is_arc)
    begin, stop = units_of(path.starts, rules.decimals), units_of(path.end, rules.decimals)
    wanted = WantedArcs(path, rows, begin[rows, :2], stop[rows, :2], rules)
    flat = wanted.sagitta < FLAT_UNITS
    centre, found, moved = _centres(wanted)
    bad, moved = ~flat & ~found, moved & ~flat & found
    changed = lowered.row[rows[bad | moved]]
    kind = path.kind.copy()
    kind[rows[flat]] = Kind.LINE
    # By row of `path`, so that they survive the rows that lines add.
    offset = np.zeros((len(path), 2), dtype=np.int64)
    kept = ~flat & found
    offset[rows[kept]] = centre[kept] - begin[rows[kept], :2]
    chosen = np.zeros(len(path), dtype=np.bool_)
    chosen[rows[bad]] = True
    unit = 10.0**-rules.decimals
    chords = arcs_to_lines(replace(path, kind=kind), chosen, LINE_SAGITTA_UNITS * unit)
    return PlainRows(
        kind=chords.toolpath.kind,
        end=units_of(chords.toolpath.end, rules.decimals),
        offset=offset[chords.row],
        start=units_of(toolpath.start, rules.decimals),
        row=lowered.row[chords.row],
        flat=int(flat.sum()),
        recentred=int(moved.sum()),
        lines=int(bad.sum()),
        first=int(changed[0]) if len(changed) else -1,
    )


def arc_findings(rows: PlainRows, place: str) -> Iterator[Finding]:
    """ARC_MENDED, and MOVE_COLLAPSED for what is smaller than a unit, where there is any."""
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
    """Full and nearly full circles, whose rounded ends coincide, in halves; other rows
    unchanged."""
    begin = units_of(toolpath.starts, rules.decimals)
    stop = units_of(toolpath.end, rules.decimals)
    full = toolpath.is_arc & (begin[:, :2] == stop[:, :2]).all(axis=1)
    full &= np.abs(toolpath.sweeps()) > math.pi
    if rules.full_circles == "whole" or not full.any():
        return LoweredToolpath(toolpath, np.arange(len(toolpath)))
    # Other arcs pass for lines meanwhile, so that these alone are cut.
    alone = np.where(toolpath.is_arc & ~full, int(Kind.LINE), toolpath.kind)
    halves = arcs_within(replace(toolpath, kind=alone), math.pi)
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

    def fits(self, which: Ints, centre: Floats) -> Bools:
        """Return the mask (L,) of arcs that satisfy the dialect's rules about these rounded
        centres (L, 2)."""
        begin, stop = self.begin[which], self.stop[which]
        out, back = begin - centre, stop - centre
        r1, r2 = np.hypot(*out.T), np.hypot(*back.T)
        turn = turns_of(out, back, self.clockwise[which])
        good = (np.abs(r1 - r2) <= SPREAD_UNITS) & (r1 >= MIN_RADIUS_UNITS)
        good &= (np.abs(turn - self.sweep[which]) < math.pi) & (
            np.abs(out).max(axis=1) <= self.most
        )
        if self.rules.chord_fits:
            good &= np.hypot(*(stop - begin).T) <= 2.0 * r1
        return np.asarray(good)


def _centres(wanted: WantedArcs) -> tuple[Ints, Bools, Bools]:
    """For each arc its centre (K, 2) in units, whether there is one, and whether it is another
    than the rounded one."""
    count = len(wanted.radius)
    in_range = wanted.radius <= wanted.most
    centre = np.zeros((count, 2), dtype=np.int64)
    centre[in_range] = np.rint(wanted.centre[in_range]).astype(np.int64)
    every = np.arange(count)
    found = in_range.copy()
    found[in_range] = wanted.fits(every[in_range], centre[in_range].astype(np.float64))
    moved = np.zeros(count, dtype=np.bool_)
    left = every[in_range & ~found & (wanted.radius >= MIN_RADIUS_UNITS - SPREAD_UNITS)]
    if not len(left):
        return centre, found, moved
    reach = np.arange(-RECENTRE_REACH, RECENTRE_REACH + 1)
    steps = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    tried = centre[left][:, None, :] + steps[None, :, :]
    far = np.hypot(*np.moveaxis(tried - wanted.centre[left][:, None, :], -1, 0))
    flat = tried.reshape(-1, 2).astype(np.float64)
    good = wanted.fits(np.repeat(left, len(steps)), flat).reshape(far.shape)
    best = np.where(good, far, np.inf).argmin(axis=1)
    any_good = good.any(axis=1)
    centre[left[any_good]] = tried[np.flatnonzero(any_good), best[any_good]]
    found[left[any_good]] = True
    moved[left[any_good]] = True
    return centre, found, moved
