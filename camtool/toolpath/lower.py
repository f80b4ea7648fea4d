"""Lowering: moves that a machine's dialect lacks are replaced by moves that it has.

    xy_then_z           moves of XY and Z at once become two: up before XY, down after
    helices_to_steps    slopes and helices become flat pieces with small plunges between
    arcs_to_lines       chosen arcs become chords
    arcs_within         arcs of more than a given sweep become equal parts

Each of them returns a new Toolpath and, for each of its rows, the row that it came from. All new
points lie on the true arc, and the last one is the old end itself. All rows that replace a row
keep its feed, provenance, block and value; events are not changed. An arc whose ends have
different radii is a spiral (`PolarArcs`).

    carried_over        a program decoded from one machine, without what only that machine needs
    at_feed             all cuts at one feed
    within_feeds        no cut faster than the machine's highest feed"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Codes, Floats, Ints
from camtool.errors import OptionError, PostError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.toolpath.findings import EVENT_LEFT_OUT_COOLANT, FEED_ABOVE_LIMIT_LOWERED
from camtool.toolpath.moves import Kind, PolarArcs, Toolpath, read_only

MAX_CHORD_SWEEP_RAD = 0.5 * math.pi
"""No chord replaces more of an arc than this, however wide the tolerance: a circle has four."""

SWEEP_EPS_RAD = 1e-9
"""A sweep may exceed the wanted one by this much, by rounding alone, without being split."""

STEP_EPS = 1e-9
"""A slope may exceed a whole number of steps by this fraction of a step, by rounding alone."""

MAX_PARTS = 10_000_000
"""Largest number of rows of a lowered toolpath; one that needs more has too fine a tolerance and
is refused."""


class LoweredToolpath(Struct, frozen=True, eq=False):
    """A toolpath of M rows and `row` (M,), the row of the given toolpath that each came from;
    `row` ascends, and every given row has at least one."""

    toolpath: Toolpath
    row: Ints

    def after(self, earlier: LoweredToolpath) -> LoweredToolpath:
        """Return this result with `row` traced back through `earlier`, the lowering before it, to
        the toolpath that `earlier` was made from."""
        return replace(self, row=earlier.row[self.row])


def xy_then_z(toolpath: Toolpath) -> LoweredToolpath:
    """Split moves that change XY and Z at once into a move in XY and one in Z: up first, down
    last.

    The Z part of an arc (a helix) is a line at the arc's feed; both parts of a rapid are rapids.
    """
    begin, end = toolpath.starts, toolpath.end
    in_xy = toolpath.is_arc | (toolpath.is_motion & (end[:, :2] != begin[:, :2]).any(axis=1))
    changes_both = in_xy & (end[:, 2] != begin[:, 2])
    if not changes_both.any():
        return _identity(toolpath)
    row, part = _repeat_rows(np.where(changes_both, 2, 1))
    goes_up = end[:, 2] > begin[:, 2]
    # First parts: Z of a climb, XY of a descent. Second parts end where the move ended.
    is_z = changes_both[row] & (goes_up[row] == (part == 0))
    points = end[row]
    first = changes_both[row] & (part == 0)
    points[first & is_z, :2] = begin[row[first & is_z], :2]
    points[first & ~is_z, 2] = begin[row[first & ~is_z], 2]
    kind = toolpath.kind[row]
    z_of_arc = is_z & toolpath.is_arc[row]
    kind[z_of_arc] = Kind.LINE
    centre = np.where(z_of_arc[:, None], np.nan, toolpath.centre[row])
    return _with_rows(toolpath, row, kind, points, centre)


def slope_step_mm(machine: Machine) -> float:
    """Return the largest height, mm, of the steps that replace a slope: the fit tolerance of
    curves, and at least one programmable step of Z."""
    return max(machine.defaults.fit_tolerance_mm, machine.axes.z.coded_step_mm)


def helices_to_steps(toolpath: Toolpath, max_dz_mm: float) -> LoweredToolpath:
    """Replace slopes and helices for machines that cannot move XY and Z together. Each becomes the
    fewest equal parts of at most `max_dz_mm` in Z, and each part a flat move and a move of Z.

    Down comes after XY and up before it, so the tool is nowhere deeper than on the true slope, and
    nowhere more than `max_dz_mm` above it. Rapids become two moves. Raises OptionError for a step
    that is not above 0 and PostError for an arc without a centre or beyond `MAX_PARTS`."""
    if not (math.isfinite(max_dz_mm) and max_dz_mm > 0.0):
        raise OptionError(f"step {max_dz_mm:g} mm of a slope is not above 0")
    rise = np.abs(toolpath.end[:, 2] - toolpath.starts[:, 2]) if len(toolpath) else np.zeros(0)
    flat = toolpath.end[:, :2] != toolpath.starts[:, :2]
    sloping = toolpath.is_feed & (rise > 0.0) & (toolpath.is_arc | flat.any(axis=1))
    parts = np.where(sloping, np.maximum(np.ceil(rise / max_dz_mm - STEP_EPS), 1.0), 1.0)
    arms = PolarArcs(toolpath, toolpath.is_arc & sloping)
    cut = _split(toolpath, arms, _Parts(parts, "use a larger step"))
    return xy_then_z(cut.toolpath).after(cut)


def arcs_to_lines(toolpath: Toolpath, rows: Bools, tolerance_mm: float) -> LoweredToolpath:
    """Replace the arcs among `rows` (N,) by chords that deviate by `tolerance_mm` at most.

    Raises OptionError for a tolerance that is not above 0 and PostError for an arc without a
    centre or beyond `MAX_PARTS`.

    A chord over the sweep t of a radius r deviates by the sagitta r(1 − cos t/2) = 2r sin²(t/4),
    so t = 4 asin √(tolerance / 2r)."""
    if not (math.isfinite(tolerance_mm) and tolerance_mm > 0.0):
        raise OptionError(f"tolerance {tolerance_mm:g} mm is not above 0")
    is_arc = toolpath.is_arc & rows
    arms = PolarArcs(toolpath, is_arc)
    largest = np.maximum(arms.radius, arms.end_radius)
    with np.errstate(divide="ignore"):
        half_sine = np.sqrt(np.minimum(tolerance_mm / (2.0 * largest), 1.0))
    chord = np.minimum(4.0 * np.arcsin(half_sine), MAX_CHORD_SWEEP_RAD)
    parts = _parts_of_rows(toolpath, arms, np.ceil(np.abs(arms.sweep) / chord))
    return _split(toolpath, arms, parts, lines=True)


def arcs_within(toolpath: Toolpath, max_sweep_rad: float) -> LoweredToolpath:
    """Split arcs that sweep more than `max_sweep_rad` into equal parts that do not.

    Raises OptionError for a sweep that is not above 0 and PostError for an arc without a centre
    or beyond `MAX_PARTS`."""
    if not (math.isfinite(max_sweep_rad) and max_sweep_rad > 0.0):
        raise OptionError(f"sweep {max_sweep_rad:g} rad is not above 0")
    arms = PolarArcs(toolpath, toolpath.is_arc)
    excess = np.maximum(np.abs(arms.sweep) - SWEEP_EPS_RAD, 0.0)
    return _split(toolpath, arms, _parts_of_rows(toolpath, arms, np.ceil(excess / max_sweep_rad)))


class _Parts(Struct, frozen=True, eq=False):
    """Number of equal parts (N,) of each row; `mend` is the advice when they are too many."""

    count: Floats
    mend: str = "use a wider tolerance"


def _parts_of_rows(toolpath: Toolpath, arms: PolarArcs, parts: Floats) -> _Parts:
    """Return the number of parts of each row: `parts` (J,) for the arcs, at least 1 each, and 1
    for every other row."""
    count = np.ones(len(toolpath))
    count[arms.row] = np.maximum(parts, 1.0)
    return _Parts(count)


def _split(
    toolpath: Toolpath, arms: PolarArcs, parts: _Parts, *, lines: bool = False
) -> LoweredToolpath:
    """Split each row into its number of parts of equal length, and the arcs of `arms` into equal
    sweeps; with `lines` the parts of the arcs become their chords."""
    if float(parts.count.sum()) > MAX_PARTS:
        raise PostError(
            f"the toolpath would become more than {MAX_PARTS} moves",
            where=f"move {int(parts.count.argmax())}",
            mend=parts.mend,
        )
    counts = parts.count.astype(np.int64)
    if (counts == 1).all() and not (lines and len(arms.row)):
        return _identity(toolpath)
    row, part = _repeat_rows(counts)
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
    return _with_rows(toolpath, row, kind[row], points, centre[row])


def _identity(toolpath: Toolpath) -> LoweredToolpath:
    """Return the toolpath unchanged; each of its rows comes from itself."""
    return LoweredToolpath(toolpath, np.arange(len(toolpath)))


def _repeat_rows(counts: Ints) -> tuple[Ints, Ints]:
    """Return each row index repeated by its count, and for each repetition its number, from 0."""
    row = np.repeat(np.arange(len(counts)), counts)
    before = np.cumsum(counts) - counts
    return row, np.arange(len(row)) - before[row]


def _with_rows(
    toolpath: Toolpath, row: Ints, kind: Codes, end: Floats, centre: Floats
) -> LoweredToolpath:
    """Return a toolpath with these kinds, ends and centres; its other columns are those of the
    rows `row` that the new rows came from.

    The three arrays become read-only and are not copied."""
    kind, end, centre = read_only(kind), read_only(end), read_only(centre)
    return LoweredToolpath(toolpath.picked(row, kind=kind, end=end, centre=centre), row)


def carried_over(decoded: Toolpath) -> Toolpath:
    """Return the moves and events of a program, without what only its own machine needs.

    Setting part zero in the first row is left out, since every program begins there. Homing
    becomes a rapid to where machine zero was. Rows lose their block: the new program has its own.
    """
    first = 1 if len(decoded) and decoded.kind[0] == Kind.SET_ZERO else 0
    homes = (decoded.kind == Kind.HOME_XY) | (decoded.kind == Kind.HOME_Z)
    kind = np.where(homes, int(Kind.RAPID), decoded.kind)[first:]
    rows = np.arange(first, len(decoded))
    return decoded.picked(rows, kind=kind, block=np.full(len(rows), -1))


def without_coolant(toolpath: Toolpath) -> Toolpath:
    """Remove the switching of coolant, for a machine that has none, with the finding
    EVENT_LEFT_OUT if anything was removed."""
    cools = np.isin(toolpath.kind, (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD, Kind.COOLANT_OFF))
    if not cools.any():
        return toolpath
    finding = EVENT_LEFT_OUT_COOLANT(
        where=toolpath.place(int(cools.argmax())), count=int(cools.sum())
    )
    remainder = toolpath.picked(np.flatnonzero(~cools))
    return replace(remainder, findings=(*toolpath.findings, finding))


def turned(toolpath: Toolpath, angle_deg: float) -> Toolpath:
    """Return the toolpath turned counter-clockwise about part zero. PostError where it homes,
    since machine zero does not turn."""
    homes = np.flatnonzero((toolpath.kind == Kind.HOME_XY) | (toolpath.kind == Kind.HOME_Z))
    if len(homes):
        raise PostError(
            "goes to machine zero, which cannot be turned",
            where=toolpath.place(int(homes[0])),
            mend="take that block out",
        )
    angle = math.radians(angle_deg)
    matrix = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    columns = {}
    for name in ("end", "start", "centre"):
        places = getattr(toolpath, name).copy()
        places[..., :2] = places[..., :2] @ matrix
        columns[name] = read_only(places)
    return replace(toolpath, **columns)


def at_feed(toolpath: Toolpath, feed_mm_min: float) -> Toolpath:
    """Return the toolpath with every cut at this feed."""
    return replace(toolpath, feed=np.where(toolpath.is_feed, feed_mm_min, toolpath.feed))


def within_feeds(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """Limit the feed of every cut to the machine's highest, with the finding FEED_ABOVE_LIMIT if
    one was faster."""
    limit = machine.max_feed_mm_min
    with np.errstate(invalid="ignore"):
        fast = toolpath.is_feed & (toolpath.feed > limit)
    if not fast.any():
        return toolpath
    max_feed = float(toolpath.feed[fast].max())
    finding = FEED_ABOVE_LIMIT_LOWERED(
        measured=max_feed, limit=limit, cuts=int(fast.sum()), machine=machine.target.name
    )
    return replace(
        toolpath, feed=np.where(fast, limit, toolpath.feed), findings=(*toolpath.findings, finding)
    )
