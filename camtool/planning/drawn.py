"""What was drawn, for each row of a plan: how far off it lies, the edge it cuts, what must stay.

A row stands for the lines of its operation that are nearest to it: a tool that runs beside a line
has no other line nearer than that one. What was drawn lies off this line by as much as reading
says (`Drawing.off_mm`), and so does the wall that the tool leaves from the one that it should.

The edge of a closed contour is the drawn line. Its size, and that of what the tool leaves:

    tool             nominal     planned
    on the line      drawn       box of the tool's centre
    within it        drawn       that box and a tool's radius all round; of a V bit its radius at
                                 the surface, which depth makes
    round it         drawn       drawn, and the allowance all round; of one below 0 the box of the
                                 wall, which moves farther at a corner than along a side

where a line is cut by one contour alone; of contours that share a line, or that run round several
ones, both are what the tool leaves. Round a line the box of the centre would not do: sharp joins
reach farther out than the radius.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import extents, path_extents
from camtool.geometry.nesting import nesting
from camtool.geometry.polylines import Polylines, reverse
from camtool.planning.items import Contour, Contours, Fixed, Item, Step
from camtool.planning.job import Operation
from camtool.planning.sides import runs_beside
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.wanted import Drawn, Kept

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.planning.carve import Cone


PLACES = (0.03, 0.25, 0.5, 0.75, 0.97)
"""Where on a row it is asked which lines are nearest; its ends lie beside its neighbours' too."""

ROWS_AT_ONCE = 1 << 14
"""So many rows are asked at a time which lines are nearest to them: some 10 MB."""

AS_NEAR_MM = 1e-4
"""Lines whose distances differ by no more than this count as equally near."""

SAME_SIZE_MM = 1e-3
"""A contour whose size, without the tool, is that of its line within this runs round that line
alone."""


def drawn_of(toolpath: Toolpath, runs: Ints, steps: Sequence[Step], placed: Drawing) -> Drawn:
    """What is drawn for each row of a toolpath, whose rows are of the runs (N,) of these steps,
    counted through all of them; the drawing in the work frame."""
    # One number, seen as many, until there is another.
    off = np.broadcast_to(0.0, (len(toolpath), 2))
    edge = np.broadcast_to(np.int64(-1), len(toolpath))
    boxes: list[tuple[Floats, Floats]] = []
    first = 0
    for step, later in zip_longest(steps, steps[1:]):
        rows = np.flatnonzero((runs >= first) & (runs < first + len(step.runs)))
        mine = rows[toolpath.is_feed[rows]]
        for some, values in _off(toolpath, mine, step, placed):
            off = off if off.flags.writeable else off.copy()
            off[some] = values
        of_item = np.full(len(step.items), -1, dtype=np.int64)
        for index, box in _edges(step, later, placed):
            of_item[index] = len(boxes)
            boxes.append(box)
        if (of_item >= 0).any():
            edge = edge if edge.flags.writeable else edge.copy()
            edge[rows] = of_item[step.owner[runs[rows] - first]]
        first += len(step.runs)
    both = np.array(boxes, dtype=np.float64).reshape(-1, 2, 2, 2)
    return Drawn(off, edge, both[:, 0], both[:, 1])


def _off(
    toolpath: Toolpath, rows: Ints, step: Step, placed: Drawing
) -> Iterator[tuple[Ints, Floats]]:
    """Some of the rows (R,) at a time, and (R, 2) how far what was drawn lies from the lines that
    they were planned along, mm; rows that are left out lie on them."""
    made = 0.0
    if step.operation.kind == "vcarve":
        from camtool.planning.carve import CARVE_TOLERANCE_MM

        made = CARVE_TOLERANCE_MM
    lines, of = step.chosen.lines, placed.off_mm
    if of.any() and lines.vertices is not placed.paths.vertices:
        of = of[_vertex_rows(placed.paths, step.chosen.source)]
    if not len(rows) or not of.any():
        if made:
            yield rows, np.full((len(rows), 2), made)
        return
    from camtool.geometry.boxes import segment_tree
    from camtool.geometry.polylines import next_vertices, segment_rows
    from camtool.kernels.offsets import distances_from, segments_within

    begin = segment_rows(lines).astype(np.int32)
    end = next_vertices(lines.offsets)[begin].astype(np.int32)
    tree = segment_tree(lines.vertices, begin, end)
    for first in range(0, len(rows), ROWS_AT_ONCE):
        some = slice(first, first + ROWS_AT_ONCE)
        points = np.ascontiguousarray(_points(toolpath, rows[some]))
        pairs = segments_within(points, distances_from(points, tree) + AS_NEAR_MM, tree)
        most = np.zeros((len(points) // len(PLACES), 2))
        np.maximum.at(most, pairs[:, 0] // len(PLACES), of[begin[pairs[:, 1]]])
        yield rows[some], most + made


def _vertex_rows(lines: Polylines, chosen: Ints) -> Ints:
    """The vertices of the chosen paths, in their order."""
    counts = np.diff(lines.offsets)[chosen]
    begin = lines.offsets[:-1][chosen]
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(np.repeat(begin, counts) + within)


def _points(toolpath: Toolpath, rows: Ints) -> Floats:
    """(R · P, 2) mm: the places on each row, one row after the other."""
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


def _edges(
    step: Step, later: Step | None, placed: Drawing
) -> Iterator[tuple[int, tuple[Floats, Floats]]]:
    """The indices of items that cut an edge, each with its nominal and its planned box; `later` is
    the step after this one."""
    cut = step.owner[_cuts_edge(step)[step.owner]]
    index = list(dict.fromkeys(cut.tolist()))
    items = [step.items[k] for k in index]
    share = Counter(item.source for item in items)
    drawn = path_extents(placed.paths)
    boxes = _centre_boxes(items)
    # Another stage, or what it clears the rest of, makes the edge what it is.
    if step.operation.stage == "rough" or step.operation.rest_of is not None:
        finish = later.operation if later is not None else None
        maker = finish if finish and finish.stage == "finish" else step.operation.rest_of
        left = 0.0 if maker is None else maker.allowance_mm
        for k, item, centre in zip(index, items, boxes, strict=True):
            edge = drawn[item.source]
            within = isinstance(item, Fixed) or centre[0, 0] > edge[0, 0]
            yield k, (edge, edge + (-left if within else left) * np.array([-1.0, 1.0]))
        return
    for k, item, centre in zip(index, items, boxes, strict=True):
        nominal, planned = _boxes(item, drawn[item.source], centre)
        yield k, (nominal if share[item.source] == 1 else planned, planned)


def _cuts_edge(step: Step) -> Bools:
    """Which items of the step follow a closed line whose size they decide: chamfers none."""
    if step.operation.kind == "chamfer":
        return np.zeros(len(step.items), dtype=np.bool_)
    if isinstance(step.items, Contours):
        return step.items.lines.closed
    return np.full(len(step.items), step.operation.kind in ("pocket", "vcarve", "bore"))


def _centre_boxes(items: Sequence[Item]) -> Floats:
    """(E, 2, 2) mm: the box of the tool's centre on each item."""
    boxes = np.empty((len(items), 2, 2))
    contours = {k: item.path for k, item in enumerate(items) if isinstance(item, Contour)}
    boxes[list(contours)] = path_extents(Polylines.of(contours.values()))
    for k, item in enumerate(items):
        if isinstance(item, Fixed):
            points = _points_of(item)[:, :2]
            boxes[k] = np.column_stack([points.min(axis=0), points.max(axis=0)])
    return boxes


def _points_of(item: Fixed) -> Floats:
    """(N, 3) x, y, z of all vertices of its runs."""
    return np.concatenate([run.vertices[:, :3] for run in item.runs])


def _boxes(item: Item, drawn: Floats, centre: Floats) -> tuple[Floats, Floats]:
    """Nominal and planned box of the edge that an item cuts, as if its line were its own: those of
    its line and of the tool's centre."""
    operation = item.setting.operation
    radius, allowance = operation.tool.radius_mm, operation.allowance_mm
    if isinstance(item, Contour) and item.material_left is None:
        return drawn, centre
    if isinstance(item, Fixed) and operation.kind == "vcarve":
        from camtool.planning.carve import Cone

        return drawn, _carved(_points_of(item), Cone.of(operation))
    wider = np.array([-1.0, 1.0])
    more = np.diff(centre - drawn)[:, 0] - 2.0 * (radius + allowance)
    if isinstance(item, Fixed) or more.max() < -SAME_SIZE_MM:
        # Reliefs reach farther into corners than the walls are apart.
        low, high = (drawn - allowance * wider).T
        return drawn, np.clip(centre + radius * wider, low[:, None], high[:, None])
    wall = drawn + allowance * wider if allowance >= 0.0 else _wall_box(item, drawn)
    # A sharp join reaches farther out than the tool is wide, as far as its limit lets it.
    spare = 0.0
    if operation.joins != "round":
        spare = 2.0 * (radius + allowance) * (operation.mitre_limit - 1.0)
    if more.max() <= SAME_SIZE_MM + spare:
        return drawn, wall
    planned = centre - radius * wider if allowance >= 0.0 else wall
    return centre - (radius + allowance) * wider, planned


def _wall_box(contour: Contour, drawn: Floats) -> Floats:
    """(2, 2) mm: the box of the wall that the tool leaves on the side of a contour where material
    stays; the middle of what is drawn where nothing is left of it."""
    from camtool.geometry.offset import offset_shape

    path = contour.path if contour.material_left else reverse(contour.path)
    wall = offset_shape(Polylines.of([path]), contour.setting.operation.tool.radius_mm)
    if len(wall):
        return extents(wall)
    return np.repeat(drawn.mean(axis=1, keepdims=True), 2, axis=1)


def _carved(points: Floats, cone: Cone) -> Floats:
    """(2, 2) mm: the box of what a V bit cuts at the surface, its tip at these points (N, 3). The
    edge bounds an envelope of discs whose radius is even along each move, so that the widest
    place of a move is at one of its ends."""
    reach = np.array([cone.radius_at(-min(z, 0.0)) for z in points[:, 2].tolist()])[:, None]
    return np.column_stack(
        [(points[:, :2] - reach).min(axis=0), (points[:, :2] + reach).max(axis=0)]
    )


def kept_of(steps: Sequence[Step]) -> tuple[Kept, ...]:
    """All runs of a plan, with what they must leave of the material, as the drawing has it.

    A profile leaves the part, a pocket and a carving what is outside of their region; engraving,
    drilling and chamfers leave nothing in particular. Where reliefs go into the corners of the
    part, they are meant to, and such an operation leaves nothing in particular.
    """
    return tuple(each for step in steps for each in _kept(step))


def _kept(step: Step) -> Iterator[Kept]:
    operation, chosen = step.operation, step.chosen
    closed = np.flatnonzero(chosen.lines.closed)
    if operation.kind == "bore":
        bored = [item.source for item in step.items]
        closed = closed[np.isin(chosen.source[closed], bored)]
    nest = nesting(chosen.lines.select(closed.tolist()))
    order = np.argsort(nest.depth, kind="stable")
    rows, depth = closed[order], nest.depth[order]
    if operation.kind in ("pocket", "vcarve", "bore"):
        lines = chosen.lines.select(rows.tolist())
        runs = tuple(run.vertices for run in step.runs)
        yield Kept(runs, lines, depth % 2 == 1, True, operation.beyond_mm)
        return
    beside = operation.kind == "profile" and runs_beside(operation)
    beside = beside and operation.corners == "none"
    for level in _levels(operation, depth) if beside else ():
        mine = rows[level]
        lines, stays = chosen.lines.select(mine.tolist()), chosen.rim[mine]
        # Beside a rim the rest of the stock is waste; beside a hole it is part.
        for rim in (True, False):
            names = {chosen.names[row] for row in mine[stays == rim].tolist()}
            runs = _contour_runs(step, names)
            yield Kept(runs, lines, stays, not rim, operation.beyond_mm)
    judged = {chosen.names[row] for row in rows.tolist()} if beside else set()
    # Open contours are cut on their lines, wherever these are; other runs leave nothing either.
    free = tuple(run.vertices for run in step.runs if run.name not in judged)
    yield Kept(free, Polylines.of([]), np.empty(0, dtype=np.bool_), False)


def _levels(operation: Operation, depth: Ints) -> Iterator[Bools]:
    """Which closed contours make one region, of their depths of nesting. With the sides of the
    nesting all do. Where the job names the side, a contour in another one is cut on that side
    too, whatever the outer one keeps: those of each depth are a region of their own."""
    if operation.side == "auto":
        yield np.ones(len(depth), dtype=np.bool_)
        return
    for each in np.unique(depth).tolist():
        yield depth == each


def _contour_runs(step: Step, names: set[str]) -> tuple[Floats, ...]:
    """The runs of a step that are contours of these names."""
    return tuple(run.vertices for run in step.runs if run.name in names)
