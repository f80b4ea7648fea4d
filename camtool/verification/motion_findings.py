"""Findings about the motion: endless arcs, missed ends, travel, reversals, backlash."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from camtool.arrays import Floats
from camtool.findings import Finding, Severity
from camtool.machine.model import Machine
from camtool.planning.naming import own_numbers
from camtool.toolpath.moves import Kind, Toolpath, toolpath_extents
from camtool.units import UM_PER_MM
from camtool.verification.case import Case
from camtool.verification.coverage import at_point, block_name, first_items, holes_of
from camtool.verification.cuts import CutMoves, cut_moves, is_flat
from camtool.verification.figures import RowFigures, Tally
from camtool.verification.findings import (
    ARC_MISSES_END,
    ARC_MISSES_END_FAR,
    END_NOT_REACHED,
    MANY_REVERSALS,
    NO_MOTION,
    NO_MOTION_BELOW,
    OUT_OF_TRAVEL_IN_PROGRAM,
    PLAY_NOT_KNOWN,
    RETURN_TO_MACHINE_ZERO,
)

AXES = "XYZ"
TRAVEL_EPS_MM = 1e-6
"""A span may exceed the travel by this much, by rounding alone."""


def program_findings(case: Case) -> tuple[Finding, ...]:
    """Return the findings that need no simulation, only the decoded moves and the machine."""
    decoded, machine = case.decoded, case.machine
    quantised = case.target.model.quantised(decoded, machine)
    cuts = cut_moves(quantised, flat_cuts=is_flat(decoded))
    return (
        *case.target.model.findings(decoded, machine, case.simulation),
        *_out_of_travel(machine, toolpath_extents(decoded)),
        *_nothing_moves(cuts),
        *_homing(quantised, machine),
    )


def motion_findings(
    cuts: CutMoves, case: Case, tally: Tally, extents: Floats, rows: RowFigures
) -> tuple[Finding, ...]:
    """Return the findings that need the motion; `extents` (3, 2), mm, of the toolpath."""
    decoded, machine = cuts.toolpath, case.machine
    return (
        *_endless_arcs(decoded, machine, tally),
        *case.target.model.findings(case.decoded, machine, case.simulation),
        *_missed_ends(decoded, case, rows),
        *_out_of_travel(machine, extents),
        *_many_reversals(machine, tally, cuts),
        *_nothing_moves(cuts),
        *_homing(decoded, machine),
        *_unknown_backlash(machine, tally),
    )


def _endless_arcs(decoded: Toolpath, machine: Machine, tally: Tally) -> Iterator[Finding]:
    coded = np.array([machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm])
    for (row, place), other_count in first_items(list(tally.endless_arcs.items())):
        missed_steps = np.hypot(*((np.array(place) - decoded.end[row, :2]) / coded))
        yield (ARC_MISSES_END if math.isfinite(missed_steps) else ARC_MISSES_END_FAR)(
            where=f"{block_name(decoded, row)}, end {at_point(decoded.end[row])}",
            measured=missed_steps if math.isfinite(missed_steps) else None,
            limit=0.0,
            move="arc" if decoded.is_arc[row] else "move",
            more=other_count,
        )


def _missed_ends(quantised: Toolpath, case: Case, rows: RowFigures) -> Iterator[Finding]:
    """Yield END_NOT_REACHED for moves that end beside their programmed ends, except endless arcs.
    It is a remark if all are within the tolerance of coverage and of the corner rounding that the
    program allows (G64 P, Q)."""
    ends = rows.missed_by_others
    if ends.count == 0:
        return
    tolerances = (
        mode.tolerance_mm + mode.merging_mm for mode in quantised.modes if mode.tolerance_mm
    )
    meant_mm = case.coverage_mm + max(tolerances, default=0.0)
    yield END_NOT_REACHED(
        severity=Severity.WARNING if ends.most_mm > meant_mm else Severity.INFO,
        where=f"{block_name(quantised, ends.row)}, end {at_point(quantised.end[ends.row])}",
        measured=ends.most_mm * UM_PER_MM,
        limit=0.0,
        count=ends.count,
    )


def _out_of_travel(machine: Machine, extents: Floats) -> Iterator[Finding]:
    for name, axis, (low, high) in zip(AXES, machine.axes, extents, strict=True):
        span = float(high - low)
        if axis.travel_mm is not None and span > axis.travel_mm + TRAVEL_EPS_MM:
            yield OUT_OF_TRAVEL_IN_PROGRAM(
                where=f"axis {name}, {low:.3f} to {high:.3f} mm",
                measured=span,
                limit=axis.travel_mm,
                axis=name,
                mend=own_numbers(machine, [f"axes.{name.lower()}.travel_mm={math.ceil(span)}"]),
            )


def _many_reversals(machine: Machine, tally: Tally, cuts: CutMoves) -> Iterator[Finding]:
    """Yield MANY_REVERSALS if there are many for the size of the part: the error at each reversal
    does not shrink with the part."""
    count, limit = int(tally.cutting_reversals[:2].sum()), machine.limits.max_reversals
    if limit is None or count <= limit:
        return
    small_mm, size_mm = machine.limits.small_part_mm, _size_mm(cuts)
    if small_mm is not None and size_mm > small_mm:
        return
    yield MANY_REVERSALS(measured=count, limit=limit, size=size_mm)


def _size_mm(cuts: CutMoves) -> float:
    """Return the longer side of the bounding box of the ends of all cuts, mm."""
    if not len(cuts.rows):
        return 0.0
    toolpath = cuts.toolpath
    starts, ends = toolpath.starts_of(cuts.rows), toolpath.end[cuts.rows]
    low = np.minimum(starts.min(axis=0), ends.min(axis=0))
    high = np.maximum(starts.max(axis=0), ends.max(axis=0))
    return float((high - low)[:2].max())


def _nothing_moves(cuts: CutMoves) -> Iterator[Finding]:
    decoded = cuts.toolpath
    homes = np.isin(decoded.kind, (Kind.HOME_XY, Kind.HOME_Z))
    is_still = bool((decoded.end == decoded.start).all())
    if is_still and not decoded.is_arc.any() and not homes.any():
        yield NO_MOTION()
    elif len(cuts.rows) == 0 and len(holes_of(decoded)) == 0:
        yield NO_MOTION_BELOW()


def _homing(decoded: Toolpath, machine: Machine) -> Iterator[Finding]:
    rows = np.flatnonzero(np.isin(decoded.kind, (Kind.HOME_XY, Kind.HOME_Z)))
    if len(rows):
        zero = ", ".join(f"{value:g}" for value in machine.controller.machine_zero_mm)
        yield RETURN_TO_MACHINE_ZERO(where=block_name(decoded, int(rows[0])), zero=zero)


def _unknown_backlash(machine: Machine, tally: Tally) -> Iterator[Finding]:
    axis_items = zip(AXES, machine.axes, machine.play_map.used, tally.steps, strict=True)
    for name, axis, cells, steps in axis_items:
        has_data = cells is not None or axis.backlash_mm > 0.0 or axis.compensation_mm > 0.0
        if steps and not has_data:
            yield PLAY_NOT_KNOWN(where=f"axis {name}", axis=name)
