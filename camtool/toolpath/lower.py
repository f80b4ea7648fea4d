"""Toolpaths made fit for a machine: moves that a dialect lacks, replaced by those that it has.

    xy_then_z           moves of XY and Z at once become two: up before XY, down after
    helices_to_steps    slopes and helices become flat pieces with small plunges between
    arcs_to_lines       chosen arcs become chords
    arcs_within         arcs of more than a given sweep become equal parts

Each of them gives a new Toolpath and, for each of its rows, the row that it came from. All new
points lie on the true arc, and the last one is the old end itself. Feed, provenance, block and
value of a row go on in all the rows that it becomes; events stay as they are. Arcs whose ends lie
at two radii are spirals (`PolarArcs`).

    carried_over        the program of one machine as what another one shall do
    at_feed             all cuts at one feed
    within_feeds        no cut faster than the machine's highest feed
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from msgspec import Struct, structs

from camtool.arrays import Bools, Codes, Floats, Ints
from camtool.errors import OptionError, PostError
from camtool.machine.model import Machine
from camtool.toolpath.findings import EVENT_LEFT_OUT_COOLANT, FEED_ABOVE_LIMIT_LOWERED
from camtool.toolpath.moves import Kind, PolarArcs, Toolpath, frozen

MAX_CHORD_SWEEP_RAD = 0.5 * math.pi
"""No chord replaces more of an arc than this, however wide the tolerance: a circle has four."""

SWEEP_EPS_RAD = 1e-9
"""A sweep may exceed the wanted one by this much, by rounding alone, without being split."""

STEP_EPS = 1e-9
"""A slope may exceed its number of whole steps by this part of one, by rounding alone."""

MAX_PARTS = 10_000_000
"""A toolpath that would become more rows than this is refused: its tolerance is far too fine."""


class Lowered(Struct, frozen=True, eq=False):
    """A toolpath of M rows and `row` (M,), the row of the given toolpath that each came from;
    `row` ascends, and every given row has at least one."""

    toolpath: Toolpath
    row: Ints

    def after(self, earlier: Lowered) -> Lowered:
        """The same with rows numbered as in what `earlier` was made of; this was made of it."""
        return structs.replace(self, row=earlier.row[self.row])


def xy_then_z(toolpath: Toolpath) -> Lowered:
    """Moves that change XY and Z at once become a move in XY and one in Z: up first, down last.

    The Z part of an arc (a helix) is a line at the arc's feed; both parts of a rapid are rapids.
    """
    begin, end = toolpath.starts, toolpath.end
    in_xy = toolpath.is_arc | (toolpath.is_motion & (end[:, :2] != begin[:, :2]).any(axis=1))
    both = in_xy & (end[:, 2] != begin[:, 2])
    if not both.any():
        return _unchanged(toolpath)
    row, part = _repeated(np.where(both, 2, 1))
    up = end[:, 2] > begin[:, 2]
    # First parts: Z of a climb, XY of a descent. Second parts end where the move ended.
    is_z = both[row] & (up[row] == (part == 0))
    points = end[row]
    first = both[row] & (part == 0)
    points[first & is_z, :2] = begin[row[first & is_z], :2]
    points[first & ~is_z, 2] = begin[row[first & ~is_z], 2]
    kind = toolpath.kind[row]
    z_of_arc = is_z & toolpath.is_arc[row]
    kind[z_of_arc] = Kind.LINE
    centre = np.where(z_of_arc[:, None], np.nan, toolpath.centre[row])
    return _built(toolpath, row, kind, points, centre)


def slope_step_mm(machine: Machine) -> float:
    """How high the steps may be that stand for a slope, mm: as far as curves may stray from what
    was drawn, and no less than a step of Z."""
    return max(machine.defaults.fit_tolerance_mm, machine.axes.z.coded_step_mm)


def helices_to_steps(toolpath: Toolpath, max_dz_mm: float) -> Lowered:
    """Slopes and helices for machines that cannot move XY and Z together: each becomes the fewest
    equal parts that rise or sink by `max_dz_mm` at most, and each part a flat move and one of Z.

    Down comes after XY and up before it, so the tool is nowhere deeper than on the true slope, and
    nowhere more than `max_dz_mm` above it. Rapids become two moves. Raises OptionError for a step
    that is not above 0 and PostError for an arc without a centre or beyond `MAX_PARTS`.
    """
    if not (math.isfinite(max_dz_mm) and max_dz_mm > 0.0):
        raise OptionError(f"step {max_dz_mm:g} mm of a slope is not above 0")
    rise = np.abs(toolpath.end[:, 2] - toolpath.starts[:, 2]) if len(toolpath) else np.zeros(0)
    flat = toolpath.end[:, :2] != toolpath.starts[:, :2]
    sloping = toolpath.is_feed & (rise > 0.0) & (toolpath.is_arc | flat.any(axis=1))
    parts = np.where(sloping, np.maximum(np.ceil(rise / max_dz_mm - STEP_EPS), 1.0), 1.0)
    arms = PolarArcs(toolpath, toolpath.is_arc & sloping)
    cut = _split(toolpath, arms, _Parts(parts, "use a larger step"))
    return xy_then_z(cut.toolpath).after(cut)


def arcs_to_lines(toolpath: Toolpath, rows: Bools, tolerance_mm: float) -> Lowered:
    """The arcs among `rows` (N,) as chords that stray from them by `tolerance_mm` at most.

    Raises OptionError for a tolerance that is not above 0 and PostError for an arc without a
    centre or beyond `MAX_PARTS`.

    A chord over the sweep t of a radius r strays by the sagitta r(1 − cos t/2) = 2r sin²(t/4),
    so t = 4 asin √(tolerance / 2r).
    """
    if not (math.isfinite(tolerance_mm) and tolerance_mm > 0.0):
        raise OptionError(f"tolerance {tolerance_mm:g} mm is not above 0")
    chosen = toolpath.is_arc & rows
    arms = PolarArcs(toolpath, chosen)
    largest = np.maximum(arms.radius, arms.end_radius)
    with np.errstate(divide="ignore"):
        half_sine = np.sqrt(np.minimum(tolerance_mm / (2.0 * largest), 1.0))
    chord = np.minimum(4.0 * np.arcsin(half_sine), MAX_CHORD_SWEEP_RAD)
    parts = _of_rows(toolpath, arms, np.ceil(np.abs(arms.sweep) / chord))
    return _split(toolpath, arms, parts, lines=True)


def arcs_within(toolpath: Toolpath, max_sweep_rad: float) -> Lowered:
    """Arcs of more than `max_sweep_rad` as equal parts of no more.

    Raises OptionError for a sweep that is not above 0 and PostError for an arc without a centre
    or beyond `MAX_PARTS`.
    """
    if not (math.isfinite(max_sweep_rad) and max_sweep_rad > 0.0):
        raise OptionError(f"sweep {max_sweep_rad:g} rad is not above 0")
    arms = PolarArcs(toolpath, toolpath.is_arc)
    excess = np.maximum(np.abs(arms.sweep) - SWEEP_EPS_RAD, 0.0)
    return _split(toolpath, arms, _of_rows(toolpath, arms, np.ceil(excess / max_sweep_rad)))


class _Parts(Struct, frozen=True, eq=False):
    """Into how many equal parts each row (N,) is cut; `mend` for when they are too many."""

    count: Floats
    mend: str = "use a wider tolerance"


def _of_rows(toolpath: Toolpath, arms: PolarArcs, parts: Floats) -> _Parts:
    """`parts` (J,) of the arcs, at least one; all other rows stay whole."""
    count = np.ones(len(toolpath))
    count[arms.row] = np.maximum(parts, 1.0)
    return _Parts(count)


def _split(toolpath: Toolpath, arms: PolarArcs, parts: _Parts, *, lines: bool = False) -> Lowered:
    """Each row in so many parts of equal length, arcs of `arms` in equal sweeps; `lines`: chords
    of these."""
    if float(parts.count.sum()) > MAX_PARTS:
        raise PostError(
            f"the toolpath would become more than {MAX_PARTS} moves",
            where=f"move {int(parts.count.argmax())}",
            mend=parts.mend,
        )
    counts = parts.count.astype(np.int64)
    if (counts == 1).all() and not (lines and len(arms.row)):
        return _unchanged(toolpath)
    row, part = _repeated(counts)
    points = toolpath.end[row]
    inner = np.flatnonzero(part + 1 < counts[row])
    share = (part[inner] + 1) / counts[row[inner]]
    begin = toolpath.starts[row[inner]]
    points[inner] = begin + share[:, None] * (points[inner] - begin)
    arm_of_row = np.full(len(toolpath), -1, dtype=np.int64)
    arm_of_row[arms.row] = np.arange(len(arms.row))
    arm = arm_of_row[row[inner]]
    on_arc = np.flatnonzero(arm >= 0)
    points[inner[on_arc]] = arms.points(arm[on_arc], share[on_arc])
    kind, centre = toolpath.kind.copy(), toolpath.centre.copy()
    if lines:
        kind[arms.row], centre[arms.row] = Kind.LINE, np.nan
    return _built(toolpath, row, kind[row], points, centre[row])


def _unchanged(toolpath: Toolpath) -> Lowered:
    """The very rows."""
    return Lowered(toolpath, np.arange(len(toolpath)))


def _repeated(counts: Ints) -> tuple[Ints, Ints]:
    """Each row so many times: the row, and which of its parts, from 0."""
    row = np.repeat(np.arange(len(counts)), counts)
    before = np.cumsum(counts) - counts
    return row, np.arange(len(row)) - before[row]


def _built(toolpath: Toolpath, row: Ints, kind: Codes, end: Floats, centre: Floats) -> Lowered:
    """Rows of new kinds, ends and centres, arrays that are theirs alone, with all else of the rows
    that they came from."""
    kind, end, centre = frozen(kind), frozen(end), frozen(centre)
    return Lowered(toolpath.picked(row, kind=kind, end=end, centre=centre), row)


def carried_over(decoded: Toolpath) -> Toolpath:
    """The moves and events of a program, free of what belongs to its own machine alone.

    Part zero set at the very beginning is left out: there every program begins. Homing becomes a
    rapid to where machine zero lay. Rows lose their block: the new program has blocks of its own.
    """
    first = 1 if len(decoded) and decoded.kind[0] == Kind.SET_ZERO else 0
    homes = (decoded.kind == Kind.HOME_XY) | (decoded.kind == Kind.HOME_Z)
    kind = np.where(homes, int(Kind.RAPID), decoded.kind)[first:]
    rows = np.arange(first, len(decoded))
    return decoded.picked(rows, kind=kind, block=np.full(len(rows), -1))


def without_coolant(toolpath: Toolpath) -> Toolpath:
    """The same without switching coolant, for a machine that has none; EVENT_LEFT_OUT where it was
    switched."""
    cools = np.isin(toolpath.kind, (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD, Kind.COOLANT_OFF))
    if not cools.any():
        return toolpath
    found = EVENT_LEFT_OUT_COOLANT(
        where=toolpath.place(int(cools.argmax())), count=int(cools.sum())
    )
    rest = toolpath.picked(np.flatnonzero(~cools))
    return replace(rest, findings=(*toolpath.findings, found))


def at_feed(toolpath: Toolpath, feed_mm_min: float) -> Toolpath:
    """The same moves, all cuts at one feed."""
    return replace(toolpath, feed=np.where(toolpath.is_feed, feed_mm_min, toolpath.feed))


def within_feeds(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The same moves with every cut at no more than the machine's highest feed; FEED_ABOVE_LIMIT
    where one was faster."""
    limit = machine.max_feed_mm_min
    with np.errstate(invalid="ignore"):
        fast = toolpath.is_feed & (toolpath.feed > limit)
    if not fast.any():
        return toolpath
    most = float(toolpath.feed[fast].max())
    found = FEED_ABOVE_LIMIT_LOWERED(
        measured=most, limit=limit, cuts=int(fast.sum()), machine=machine.target.name
    )
    return replace(
        toolpath,
        feed=np.where(fast, limit, toolpath.feed),
        findings=(*toolpath.findings, found),
    )
