"""What was drawn, for each row of a plan: how far off it lies, the edge it cuts, what must stay.

A row stands for the lines of its operation that are nearest to it: a tool that runs beside a line
has no other line nearer than that one. What was drawn lies off this line by as much as reading
says (`Drawing.off_mm`), and so does the wall that the tool leaves from the one that it should; and
all of it by as much as placing says (`Drawing.datum_off_mm`).

The edge that a contour or a run cuts is the drawn line. Its size, and that of what is left of it:

    tool             nominal     planned
    on the line      drawn       box of the tool's centre
    within it        drawn       box of all that it removes, as wide as it is at the surface
    round it         drawn       drawn, and the allowance all round; of one below 0 the box of the
                                 wall, which moves farther at a corner than along a side

What runs round several lines has all of them as its nominal edge. Round a line the box of the
centre would not do: sharp joins reach farther out than the radius. Chamfers break the edges that
other operations cut, and drills make what their own diameter says: they have no edge here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.geometry.boxes import moves_of, nearest_pairs
from camtool.geometry.measure import extents, path_extents
from camtool.geometry.polylines import Polylines, Segments, reverse, segment_rows
from camtool.planning.items import Contour, Runs, Setting, Step, contours_of
from camtool.planning.job import Operation, Stock, Tool
from camtool.planning.sides import regions_of, runs_beside
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.wanted import NO_EDGE, DrawnEdges, ProtectedRegion

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.geometry.nesting import Nesting


PLACES = (0.03, 0.25, 0.5, 0.75, 0.97)
"""Shares of a row's length at which the nearest lines are determined; not its ends, which
neighbouring rows share."""

ROWS_AT_ONCE = 1 << 14
"""Number of rows for which the nearest lines are determined at a time: some 10 MB."""

AS_NEAR_MM = 1e-4
"""Lines whose distances differ by no more than this count as equally near."""

OUTWARDS = np.array([-1.0, 1.0])
"""The signs by which the low and the high side of a box move when it grows."""

SAME_SIZE_MM = 1e-3
"""A contour whose size, without the tool, differs from that of its line by no more than this runs
round that line alone."""


def drawn_of(
    toolpath: Toolpath, runs: Ints, steps: Sequence[Step], placed: Drawing, stock: Stock | None
) -> DrawnEdges:
    """Return, for each row of a toolpath, what was drawn there. The rows belong to the runs (N,)
    of the steps, counted through all steps; `placed`: the drawing in the work frame, as the stock
    is."""
    # A broadcast constant until a row has another value.
    off_mm = np.broadcast_to(0.0, (len(toolpath), 2))
    edge = np.broadcast_to(np.int64(NO_EDGE), len(toolpath))
    columns = [(*np.empty((2, 0, 2, 2)), *np.empty((2, 0), dtype=np.bool_))]
    lines = [np.empty(0, dtype=np.int64)]
    first = 0
    before_of: dict[str | int, int] = {}
    for number, (step, later) in enumerate(zip_longest(steps, steps[1:])):
        rows = np.flatnonzero((runs >= first) & (runs < first + len(step.runs)))
        feed_rows = rows[toolpath.is_feed[rows]]
        for batch, values in _path_offsets(toolpath, feed_rows, step, placed):
            off_mm = off_mm if off_mm.flags.writeable else off_mm.copy()
            off_mm[batch] = values
        edges = _edges(step, later, placed)
        if len(rows):
            edge = edge if edge.flags.writeable else edge.copy()
            own_edges = edges.of_run[runs[rows] - first]
            edge[rows] = np.where(own_edges >= 0, own_edges + sum(map(len, lines)), own_edges)
        # An operation that clears a rest cuts the same lines as the operation that left it.
        before = max((int(line.max(initial=-1)) + 1 for line in lines), default=0)
        before = before_of.setdefault(step.operation.rest or step.operation.name or number, before)
        lines.append(edges.line + before)
        columns.append((edges.nominal, edges.planned_boxes, edges.followed, edges.cleared))
        first += len(step.runs)
    nominal, boxes, followed, cleared = map(np.concatenate, zip(*columns, strict=True))
    line = np.concatenate(lines)
    return DrawnEdges(
        off_mm,
        edge,
        nominal,
        boxes,
        line,
        followed,
        cleared,
        datum_off_mm=placed.datum_off_mm,
        stock_mm=None if stock is None else stock.box_mm,
    )


def _path_offsets(
    toolpath: Toolpath, rows: Ints, step: Step, placed: Drawing
) -> Iterator[tuple[Ints, Floats]]:
    """Yield (rows (R,), (R, 2) mm: how far the drawing lies from the lines that the rows were
    planned along) in batches. Rows that are left out have no such distance."""
    path_error = step.operation.contract.path_error_mm
    lines, drawn_off = step.chosen.lines, placed.off_mm
    if placed.datum_off_mm:
        drawn_off = drawn_off + placed.datum_off_mm
    if drawn_off.any() and lines.vertices is not placed.paths.vertices:
        drawn_off = drawn_off[_vertex_rows(placed.paths, step.chosen.source)]
    if not len(rows) or not drawn_off.any():
        if path_error:
            yield rows, np.full((len(rows), 2), path_error)
        return

    begin = segment_rows(lines)
    moves = moves_of(Segments.of(lines))
    for first in range(0, len(rows), ROWS_AT_ONCE):
        batch = slice(first, first + ROWS_AT_ONCE)
        points = _points(toolpath, rows[batch])
        _, point, segment = nearest_pairs(points, moves, 1.0, AS_NEAR_MM)
        max_off = np.zeros((len(points) // len(PLACES), 2))
        np.maximum.at(max_off, point // len(PLACES), drawn_off[begin[segment]])
        yield rows[batch], max_off + path_error


def _vertex_rows(lines: Polylines, selection: Ints) -> Ints:
    """Return the vertex rows of the chosen paths, in their order."""
    counts = np.diff(lines.offsets)[selection]
    begin = lines.offsets[:-1][selection]
    steps = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(np.repeat(begin, counts) + steps)


def _points(toolpath: Toolpath, rows: Ints) -> Floats:
    """Return (R · P, 2) mm: P sample points on each row, row by row."""
    share = np.array(PLACES)
    begin, end = toolpath.starts_of(rows)[:, None, :2], toolpath.end[rows, None, :2]
    points = begin + share[:, None] * (end - begin)
    arcs = np.flatnonzero(toolpath.is_arc[rows])
    turn = toolpath.sweeps_of(rows[arcs])[:, None] * share
    centre = toolpath.centre[rows[arcs]]
    x, y = (begin[arcs, 0] - centre).T[:, :, None]
    round_ = np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)])
    points[arcs] = centre[:, None] + np.moveaxis(round_, 0, 2)
    return np.asarray(points.reshape(-1, 2))


class _Edges(Struct, frozen=True, eq=False):
    """The edges that a step cuts, in the columns of `DrawnEdges`, `line` counted from 0; `of_run`
    (R,): the edge of each of its runs, or NO_EDGE."""

    of_run: Ints
    nominal: Floats
    planned_boxes: Floats
    line: Ints
    followed: Bools
    cleared: Bools


def _edges(step: Step, later: Step | None, placed: Drawing) -> _Edges:
    """Return the edges that a step cuts; `later`: the step after it. A roughing stage cuts none,
    since the finishing stage after it makes the edge."""
    no_rows = np.empty(0, dtype=np.bool_)
    operation = step.operation
    is_finished = operation.stage == "rough" and later and later.operation.stage == "finish"
    if not operation.contract.has_edge or is_finished or not len(step.runs):
        unsized, boxes = np.full(len(step.runs), NO_EDGE), np.empty((0, 2, 2))
        return _Edges(unsized, boxes, boxes, unsized[:0], no_rows, no_rows)
    drawn = path_extents(placed.paths)
    if contours := contours_of(step.items):
        return _beside_or_on(step, contours, drawn)
    source = np.array([item.source for item in step.items])[step.owner]
    line, planned_boxes = drawn[source], _cleared_boxes(step.runs, operation.tool)
    if operation.contract.leaves_walls:
        # Reliefs reach farther into corners than the walls are apart.
        low, high = np.moveaxis(line - operation.allowance_mm * OUTWARDS, 2, 0)
        planned_boxes = np.clip(planned_boxes, low[:, :, None], high[:, :, None])
    every = np.arange(len(step.runs))
    is_cleared = np.ones(len(every), dtype=np.bool_)
    return _Edges(every, line, planned_boxes, source, ~is_cleared, is_cleared)


def _beside_or_on(step: Step, contours: Sequence[Contour], drawn: Floats) -> _Edges:
    """Return the edges of contours beside or on their lines; `drawn` (M, 2, 2): the boxes of the
    drawn paths."""
    used_contours = distinct(step.owner).tolist()
    centres = path_extents(Polylines.of(contours[k].path for k in used_contours))
    source = np.array([contours[k].source for k in used_contours])
    nominal, planned_boxes = drawn[source], centres.copy()
    followed = np.zeros(len(used_contours), dtype=np.bool_)
    for row, k in enumerate(used_contours):
        if contours[k].material_left is None:
            followed[row] = _cut_radius(contours[k].setting) > 0.0
        else:
            nominal[row], planned_boxes[row] = _boxes(contours[k], nominal[row], centres[row])
    of_run = np.searchsorted(used_contours, step.owner)
    return _Edges(of_run, nominal, planned_boxes, source, followed, np.zeros_like(followed))


def _cut_radius(setting: Setting) -> float:
    """Return the radius of the tool's cut at the surface in its deepest pass, mm."""
    return setting.operation.tool.radius_at(-setting.levels_mm[-1])


def _boxes(contour: Contour, drawn: Floats, centre: Floats) -> tuple[Floats, Floats]:
    """Return the nominal and the planned box (2, 2), mm, of the edge that a contour beside its
    line cuts, as if the line were its only edge. `drawn`, `centre`: the boxes of the line and of
    the tool's centre."""
    operation = contour.setting.operation
    radius, allowance = operation.tool.radius_mm, operation.allowance_mm
    reach = _cut_radius(contour.setting)
    excess = np.diff(centre - drawn)[:, 0] - 2.0 * (radius + allowance)
    if excess.max() < -SAME_SIZE_MM:
        # Reliefs reach farther into corners than the walls are apart.
        low, high = (drawn - (allowance + radius - reach) * OUTWARDS).T
        return drawn, np.clip(centre + reach * OUTWARDS, low[:, None], high[:, None])
    wall = drawn + allowance * OUTWARDS if allowance >= 0.0 else _wall_box(contour, drawn)
    wall = wall + (radius - reach) * OUTWARDS
    # A sharp join reaches farther out than the tool is wide, as far as its limit lets it.
    spare = 0.0
    if operation.joins != "round":
        spare = 2.0 * (radius + allowance) * (operation.mitre_limit - 1.0)
    if excess.max() <= SAME_SIZE_MM + spare:
        return drawn, wall
    planned_box = centre - reach * OUTWARDS if allowance >= 0.0 else wall
    return centre - (radius + allowance) * OUTWARDS, planned_box


def _wall_box(contour: Contour, drawn: Floats) -> Floats:
    """Return (2, 2) mm: the box of the wall that the tool leaves on the side of a contour where
    material stays; the middle of the drawn box if nothing is left."""
    from camtool.geometry.offset import offset_shape

    path = contour.path if contour.material_left else reverse(contour.path)
    wall = offset_shape(Polylines.of([path]), contour.setting.operation.tool.radius_mm)
    if len(wall):
        return extents(wall)
    return np.repeat(drawn.mean(axis=1, keepdims=True), 2, axis=1)


def _cleared_boxes(runs: Runs, tool: Tool) -> Floats:
    """Return (R, 2, 2) mm: the box of what the tool removes at the surface in each run, exact on
    arcs.

    It is that of the discs as wide as the tool is at the surface. Along a move their radius
    changes evenly, by d over an arc of radius R and sweep s: seen in the direction a, their edge
    is farthest where the centre stands at the angle a + arcsin(d / (R s)) of the arc."""
    vertices, first = runs.vertices, runs.first[:-1]
    heights, height_index = np.unique(np.minimum(vertices[:, 2], 0.0), return_inverse=True)
    reach = np.array([tool.radius_at(-z) for z in heights.tolist()])[height_index.reshape(-1)]
    low = np.minimum.reduceat(vertices[:, :2] - reach[:, None], first)
    high = np.maximum.reduceat(vertices[:, :2] + reach[:, None], first)
    bent = vertices[:, 3] != 0.0
    bent[runs.first[1:] - 1] = False
    rows = np.flatnonzero(bent)
    arcs = Segments.between(vertices[rows, :2], vertices[rows + 1, :2], vertices[rows, 3])
    wider = reach[rows + 1] - reach[rows]
    lean = wider / (arcs.radius * arcs.sweep)
    lean = np.arcsin(np.where(np.abs(lean) < 1.0, lean, np.nan))
    run = np.searchsorted(runs.first, rows, side="right") - 1
    for quarter in range(4):
        axis, is_high = quarter % 2, quarter < 2
        turn = np.sign(arcs.sweep) * (0.5 * np.pi * quarter + lean - arcs.start_angle)
        part = np.mod(turn, 2.0 * np.pi) / np.abs(arcs.sweep)
        sloping = np.flatnonzero(part < 1.0)
        edge = (
            arcs.radius[sloping] * np.cos(lean[sloping])
            + reach[rows[sloping]]
            + part[sloping] * wider[sloping]
        )
        if is_high:
            np.maximum.at(high[:, axis], run[sloping], arcs.centre[sloping, axis] + edge)
        else:
            np.minimum.at(low[:, axis], run[sloping], arcs.centre[sloping, axis] - edge)
    return np.stack([low, high], axis=2)


def kept_of(steps: Sequence[Step]) -> tuple[ProtectedRegion, ...]:
    """Return all runs of a plan, together with the region of material that they must leave, as
    drawn.

    A profile leaves the part, a pocket and a carving what is outside of their region; engraving,
    drilling and chamfers leave nothing in particular. Where reliefs go into the corners of the
    part, they are meant to, and such an operation leaves nothing in particular."""
    return tuple(each for step in steps for each in _protected_regions(step))


def _protected_regions(step: Step) -> Iterator[ProtectedRegion]:
    operation, chosen = step.operation, step.chosen
    closed = np.flatnonzero(chosen.lines.closed)
    if operation.contract.takes == "circles":
        bored = [item.source for item in step.items]
        closed = closed[np.isin(chosen.source[closed], bored)]
    nesting = chosen.nesting.among(closed)
    depth = nesting.levels.depth
    if operation.contract.cuts == "within":
        order = np.argsort(depth, kind="stable")
        lines = chosen.lines.select(closed[order].tolist())
        runs = tuple(run.vertices for run in step.runs)
        yield ProtectedRegion(runs, lines, depth[order] % 2 == 1, True, operation.beyond_mm)
        return
    has_wall = operation.contract.leaves_walls and runs_beside(operation)
    has_wall = has_wall and operation.corners == "none"
    rim, judged = chosen.rim[closed], closed if has_wall else closed[:0]
    for region in _regions(operation, nesting, rim) if has_wall else ():
        order = np.flatnonzero(region)[np.argsort(depth[region], kind="stable")]
        rows, stays = closed[order], rim[order]
        # Beside a rim the rest of the stock is waste; beside a hole it is part.
        for is_rim in (True, False):
            runs = _runs_of(step, chosen.source[rows[stays == is_rim]])
            lines = chosen.lines.select(rows.tolist())
            yield ProtectedRegion(runs, lines, stays, not is_rim, operation.beyond_mm)
    # Open contours are cut on their lines, wherever these are; other runs leave nothing either.
    free = _runs_of(step, chosen.source[judged], others=True)
    yield ProtectedRegion(free, Polylines.of([]), np.empty(0, dtype=np.bool_), False)


def _regions(operation: Operation, nesting: Nesting, rim: Bools) -> Iterator[Bools]:
    """Yield masks of the closed contours that bound one region together. If the job names the
    side, each nesting depth is a region of its own: a contour within another one is then cut on
    that side too, whatever the outer one keeps."""
    if operation.side == "auto":
        yield from regions_of(nesting, rim)
        return
    depth = nesting.levels.depth
    for each in distinct(depth).tolist():
        yield depth == each


def _runs_of(step: Step, sources: Ints, *, others: bool = False) -> tuple[Floats, ...]:
    """Return the runs (n, 4) of a step that belong to these contours of the drawing, or (`others`)
    to all other contours."""
    source = np.array([item.source for item in step.items], dtype=np.int64)
    of_these = np.isin(source[step.owner], sources) != others
    return tuple(step.runs[row].vertices for row in np.flatnonzero(of_these).tolist())
