"""The writer's first stage: which moves of a toolpath are strokes, and whether this machine can
make them at all.

A stroke is what is cut between one plunge and the next raise of the tool; each becomes a job of
its own (L3938-3949). Everything above the stock is travel: the master goes home and to the first
point of each job by itself. What it cannot do is a PostError that names the move."""

from __future__ import annotations

from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import PostError
from camtool.findings import Finding, Sentence
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.toolpath.lower import arcs_to_lines, xy_then_z
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.refusals import refuse

from .dialect import MatlabRouterMachine, ResolvedDialect, cut_z_mm
from .findings import EVENT_LEFT_OUT_DWELL, EVENT_LEFT_OUT_SPEED, EVENT_LEFT_OUT_TOOL, MOVE_SPLIT

DEPTH_TOLERANCE_MM: Final = 0.005
"""A cut may lie this much above or below the one depth that the machine plunges to."""


class CutLines(Struct, frozen=True, eq=False):
    """The lines to be cut, in their order, L rows: `start`, `end` (L, 2) mm in the work frame;
    `feed` (L,) mm/min; `row` (L,) the row of the toolpath that each came from; `stroke` (L,)
    ascends from 0. Within a stroke each line starts where the one before it ended."""

    start: Floats
    end: Floats
    feed: Floats
    row: Ints
    stroke: Ints


def cuts_of(
    toolpath: Toolpath, machine: MatlabRouterMachine, dialect: ResolvedDialect
) -> tuple[CutLines, list[Finding]]:
    """Return the lines of all strokes of a toolpath, and the findings on rows that were left
    out."""
    findings = _events(toolpath)
    flat_and_deep = xy_then_z(toolpath)
    lowered_path = arcs_to_lines(
        flat_and_deep.toolpath, flat_and_deep.toolpath.is_arc, dialect.arc_tolerance_mm
    ).after(flat_and_deep)
    if split := len(flat_and_deep.row) - len(toolpath):
        first = int(np.argmax(np.bincount(flat_and_deep.row) > 1))
        findings.append(MOVE_SPLIT(where=toolpath.place(first), measured=split))
    path = lowered_path.toolpath
    below = np.asarray(path.end[:, 2] < -POSITION_EPS_MM)
    moves = path.is_motion & (path.end[:, :2] != path.starts[:, :2]).any(axis=1)
    cut = moves & below
    rows = lowered_path.row
    _refuse_moves(toolpath, path, cut, rows)
    _refuse_depths(toolpath, path.end[:, 2], cut, rows, machine, dialect)
    # Each time the tool is above the stock, another stroke begins.
    number: Ints = np.cumsum(~below, dtype=np.int64)
    _refuse_holes(toolpath, number, below & path.is_motion, cut, rows)
    stroke = np.unique(number[cut], return_inverse=True)[1].reshape(-1)
    lines = CutLines(path.starts[cut, :2], path.end[cut, :2], path.feed[cut], rows[cut], stroke)
    return lines, findings


def _refuse_moves(toolpath: Toolpath, path: Toolpath, cut: Bools, rows: Ints) -> None:
    rapid = cut & (path.kind == Kind.RAPID)
    refuse(
        toolpath, rapid, "a rapid below the top of the stock", "raise the tool first", rows=rows
    )
    with np.errstate(invalid="ignore"):
        has_no_feed = cut & ~((path.feed > 0.0) & np.isfinite(path.feed))
    refuse(
        toolpath, has_no_feed, "a cut without a feed above 0", "give each cut a feed", rows=rows
    )
    homing = np.isin(path.kind, (Kind.HOME_XY, Kind.HOME_Z))
    under = homing & (path.end != path.starts)[:, :2].any(axis=1) & (path.end[:, 2] < 0.0)
    refuse(toolpath, under, "X and Y go home below the top of the stock", rows=rows)
    is_ended = np.cumsum(path.kind == Kind.END) > 0
    after = is_ended & (path.kind != Kind.END)
    refuse(toolpath, after, "rows follow the end of the program", rows=rows)


def _refuse_depths(
    toolpath: Toolpath,
    z: Floats,
    cut: Bools,
    rows: Ints,
    machine: MatlabRouterMachine,
    dialect: ResolvedDialect,
) -> None:
    """Raise PostError for cuts at another depth than the one that the machine plunges to."""
    depth = cut_z_mm(machine, dialect)
    if depth >= 0.0:
        raise PostError(
            f"from home, {machine.controller.machine_zero_mm[2]:g} mm above the stock, a plunge of"
            f" {dialect.plunge_mm:g} mm does not reach it",
            mend="set the third number of controller.machine_zero_mm: plunge less depth",
        )
    is_bad = cut & ~(np.abs(z - depth) <= DEPTH_TOLERANCE_MM)
    slopes = toolpath.is_feed & (toolpath.end != toolpath.starts)[:, 2]
    slopes &= (toolpath.end != toolpath.starts)[:, :2].any(axis=1) | toolpath.is_arc
    refuse(
        toolpath,
        is_bad & slopes[rows],
        f"a slope in the stock: this machine only cuts at Z {depth:g} mm",
        "enter by a plunge, without tabs, and cut in one pass",
        rows=rows,
    )
    if is_bad.any():
        z_mm = float(z[int(np.argmax(is_bad))])
        x, y, _ = machine.controller.machine_zero_mm
        home = z_mm + dialect.plunge_mm
        refuse(
            toolpath,
            is_bad,
            f"a cut at Z {z_mm:g} mm: this machine always plunges {dialect.plunge_mm:g} mm from"
            f" home, to Z {depth:g} mm",
            f"place the stock {home:g} mm below the raised tool and use "
            f"--set controller.machine_zero_mm=[{x:g},{y:g},{home:g}]",
            rows=rows,
        )


def _refuse_holes(toolpath: Toolpath, number: Ints, below: Bools, cut: Bools, rows: Ints) -> None:
    """Refuse a plunge that no line follows: the master lowers the tool with the spindle off and
    switches it on with the first line (L6552-6560), so a job of one point drills nothing."""
    hole = below & ~np.isin(number, number[cut])
    refuse(
        toolpath,
        hole,
        "a plunge without a line behind it: this machine drills no holes, because its tool stands "
        "until the first line",
        "leave it out, or draw a line of 0.2 mm or more, in which the tool turns",
        rows=rows,
    )


def _events(toolpath: Toolpath) -> list[Finding]:
    """Refuse events that the machine cannot execute; return findings for events that are left
    out."""
    kind = toolpath.kind
    message = "the spindle of this machine turns one way only"
    refuse(toolpath, kind == Kind.SPINDLE_CCW, message, "turn it clockwise")
    is_moved = (toolpath.end != 0.0).any(axis=1)
    refuse(
        toolpath,
        (kind == Kind.SET_ZERO) & is_moved,
        "part zero can only be set at part zero",
        "set it first, before any move",
    )
    cutting = np.cumsum(toolpath.is_motion & (toolpath.end[:, 2] < 0.0)) > 0
    refuse(
        toolpath,
        (kind == Kind.TOOL_CHANGE) & cutting,
        "a tool change between cuts",
        "post a program for each tool (--split tool)",
    )
    has_speed = np.asarray((kind == Kind.SPINDLE_CW) & np.isfinite(toolpath.value))
    return [
        *_left_out(toolpath, kind == Kind.DWELL, EVENT_LEFT_OUT_DWELL),
        *_left_out(toolpath, kind == Kind.TOOL_CHANGE, EVENT_LEFT_OUT_TOOL),
        *_left_out(toolpath, has_speed, EVENT_LEFT_OUT_SPEED),
    ]


def _left_out(toolpath: Toolpath, rows: Bools, sentence: Sentence) -> list[Finding]:
    count = int(rows.sum())
    if not count:
        return []
    return [sentence(where=toolpath.place(int(np.argmax(rows))), measured=count)]
