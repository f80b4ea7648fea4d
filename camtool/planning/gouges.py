"""Cuts that run into what is to stay, and sides that follow from uncut contours.

A profile keeps what is on the other side of its contour. Where the sweep of another cut comes over
that contour, it takes some of what was to stay: an error, because a strip that stays can be filed
off, and a gouge cannot be put back. It is a warning only where the other contour is not cut, for
that may be of the drawing alone; and where the job itself names the side, for contours of the same
operation, and for those that cross: whoever draws a notch beyond an edge wants it open.

An allowance below 0 takes a contour's wall back by as much, whatever cuts it: a tool that comes
from where that wall is free may come nearer by this. A pocket that is cut beyond its lines is
looked at like a profile.

A contour that encloses something else when ends that branch are joined in another way is no
region: to clear it, carve it, or cut beside it is an error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import tee

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding, Severity
from camtool.geometry.distance import each_approach, near_paths, nearest
from camtool.geometry.drawing import Branch
from camtool.geometry.measure import extents, path_lengths, sample
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.planning.findings import (
    BRANCHED_REGION,
    BRANCHED_REGION_MORE,
    GOUGE,
    GOUGE_AT_LEAST,
    GOUGE_BY_POCKET,
    GOUGE_BY_POCKET_MORE,
    GOUGE_MORE,
    GOUGE_OF_ALLOWANCE,
    GOUGE_OF_UNCUT,
    SIDE_BY_UNCUT,
    SIDE_BY_UNCUT_FRAME,
)
from camtool.planning.items import Chosen, Fixed, Item, Work
from camtool.planning.job import Operation
from camtool.planning.naming import at_place, operation_name, shortened_list, tool_name
from camtool.planning.paths import midpoints
from camtool.planning.sides import Sides, runs_beside

GOUGE_TOLERANCE_MM = 1e-4
"""Another contour may be cut into by this much before it is a gouge: a tenth of a micrometre."""

MAX_COUNTED = 100
"""After this many findings, only pairs that may be errors are examined: of hundreds of contours
that cross, each pair would be one."""

SAMPLES_ROUND = 500


def side_findings(work: Work, chosen: Chosen, sides: Sides, operation: Operation) -> list[Finding]:
    """Return the findings about the sides of an operation: gouges, and sides that depend on uncut
    contours."""
    if operation.contract.clears:
        cleared = list(_cleared_away(chosen, sides, operation))
        pocket_findings = list(_beside_pocket(sides, operation)) if operation.beyond_mm else []
        return [
            *shortened_list(cleared, GOUGE_BY_POCKET_MORE),
            *shortened_list(pocket_findings, GOUGE_MORE),
        ]
    # Nets are proved on the cut itself, and all else on a board lies below its copper.
    if not runs_beside(operation) or operation.contract.frees_nets:
        return []
    gouges = list(_gouges(work, chosen, sides, operation))
    more = GOUGE_MORE if len(gouges) < MAX_COUNTED else GOUGE_AT_LEAST
    findings = shortened_list(gouges, more)
    if operation.side == "auto":
        findings += by_uncut(sides, operation, chosen.source[chosen.lines.closed])
    return findings


def branch_findings(
    branches: Sequence[Branch], chosen: Chosen, sides: Sides, operation: Operation
) -> list[Finding]:
    """Return errors where an operation needs to know what its contours enclose, and one of them
    (or one that decides its sides) passes a branch, at which that is ambiguous. `branches`: those
    of the placed drawing."""
    is_beside = runs_beside(operation)
    if not (is_beside or operation.contract.cuts == "within"):
        return []
    is_asked = np.zeros(len(sides.lines), dtype=np.bool_)
    is_asked[chosen.source] = True
    if is_beside and operation.side == "auto":
        is_asked |= sides.seen_by(operation).bounds
    findings = [
        BRANCHED_REGION(
            where=at_place(sides.names[rows[0]], branch.at_mm),
            measured=branch.ends,
            limit=2.0,
            contour=sides.names[rows[0]],
        )
        for branch in branches
        if (rows := [row for row in branch.paths if is_asked[row]])
    ]
    return shortened_list(findings, BRANCHED_REGION_MORE)


def _centre_paths(work: Work) -> Iterator[tuple[Item, Polyline]]:
    """Yield each item that runs beside a wall with each path of its tool centre."""
    for item in work.items:
        if isinstance(item, Fixed):
            yield from ((item, path) for path in item.centre_lines or ())
        elif item.material_left is not None:
            yield item, item.path


def _gouges(work: Work, chosen: Chosen, sides: Sides, operation: Operation) -> Iterator[Finding]:
    """Yield a finding where the tool, running beside one contour, cuts into the wall of another
    contour, or into the allowance that is left on it."""
    radius, allowance = operation.wall_radius_mm, operation.allowance_mm
    if operation.stage == "rough":
        allowance = 0.0  # the finishing pass would remove it anyway
    bevel = operation.chamfer_mm or 0.0  # a bevel must not break the edges of other contours
    beside_items = list(_centre_paths(work))
    seen_sides, sided = sides.seen_by(operation), sides.sided()
    is_wall = sided | seen_sides.bounds
    # Contours of one operation with side = "auto" are offset together.
    own_rows = set(chosen.source.tolist())
    if operation.side == "auto":
        is_wall = is_wall.copy()
        is_wall[chosen.source] = False
    wall_rows = np.flatnonzero(is_wall)
    walls = sides.lines.select(wall_rows.tolist())
    paths = Polylines.of(path for _, path in beside_items)
    count, reported_pairs = 0, set[tuple[int, int]]()

    def is_measured(one: int, wall_row: int) -> bool:
        """Return True if the distance between a path and a wall must be computed: the wall is not
        the path's own contour. After MAX_COUNTED findings only possible errors are computed."""
        other = int(wall_rows[wall_row])
        is_error = sided[other] and (operation.side == "auto" or other not in own_rows)
        return beside_items[one][0].source != other and bool(is_error or count < MAX_COUNTED)

    near_pairs = near_paths(paths, walls, radius + bevel + max(allowance, 0.0))
    measured_pairs, pairs = tee(pair for pair in near_pairs if is_measured(*pair))
    distances = each_approach(paths, walls, measured_pairs)
    for (one, wall_row), nearest_approach in zip(pairs, distances, strict=True):
        (item, path), other = beside_items[one], int(wall_rows[wall_row])
        if (item.source, other) in reported_pairs or not is_measured(one, wall_row):
            continue
        # Where the job names the side, contours of the same operation are no error.
        is_asked = operation.side != "auto" and other in own_rows
        wall = walls[wall_row]
        reach = radius if other in own_rows else radius + bevel
        reach -= _taken_back(sides, other, path)
        if nearest_approach.distance >= reach - GOUGE_TOLERANCE_MM:
            if (
                other in own_rows
                and nearest_approach.distance < radius + allowance - GOUGE_TOLERANCE_MM
            ):
                count += 1
                yield GOUGE_OF_ALLOWANCE(
                    where=at_place(item.name, nearest_approach.point),
                    measured=nearest_approach.distance,
                    limit=radius + allowance,
                    severity=Severity.WARNING,
                    tool=tool_name(operation.tool),
                    contour=item.name,
                    amount=radius + allowance - nearest_approach.distance,
                    other=sides.names[other],
                )
            continue
        drawn = sides.lines[item.source]
        is_kept = bool(sided[other])
        if not is_kept and _lies_in(drawn, wall):
            continue  # the edge of the stock, or of a sheet: nothing says that it stays
        is_asked = is_asked or (operation.side != "auto" and _cross(drawn, wall))
        count += 1
        if isinstance(item, Fixed):
            reported_pairs.add((item.source, other))
        amount = reach - nearest_approach.distance
        if nearest_approach.distance <= POSITION_EPS_MM:
            amount = reach + _overshoot(path, wall, drawn)
        yield (GOUGE if is_kept else GOUGE_OF_UNCUT)(
            where=at_place(item.name, nearest_approach.point),
            measured=nearest_approach.distance,
            limit=reach,
            severity=Severity.ERROR if is_kept and not is_asked else Severity.WARNING,
            tool=tool_name(operation.tool),
            contour=item.name,
            amount=amount,
            other=sides.names[other],
        )


def _taken_back(sides: Sides, other: int, path: Polyline) -> float:
    """Return by how much (mm) the wall of contour `other` is taken back by operations that cut
    beyond its line, on the side on which `path` begins."""
    taken_outside, taken_inside = sides.beyond_mm[other].tolist()
    if not (taken_outside or taken_inside):
        return 0.0
    # What stays is on the other side of the wall.
    starts_inside = inside(np.array(path.vertices[:1, :2]), Segments.of(sides.lines[other]))[0]
    return float(taken_outside if starts_inside else taken_inside)


def _beside_pocket(sides: Sides, pocket: Operation) -> Iterator[Finding]:
    """Yield a finding where a pocket or bore that cuts beyond its lines cuts into a contour beside
    it that a profile follows. If it only opens towards the contour around it, nothing is lost."""
    cut = sides.cut_by(pocket) & sides.lines.closed
    rows, wall_rows = np.flatnonzero(cut), np.flatnonzero(sides.sided() & ~cut)
    lines, walls = (sides.lines.select(each.tolist()) for each in (rows, wall_rows))
    cleared = Segments.of(lines)
    measured_pairs, pairs = tee(near_paths(lines, walls, pocket.beyond_mm))
    distances = each_approach(lines, walls, measured_pairs)
    for (one, wall_row), nearest_approach in zip(pairs, distances, strict=True):
        line, wall = lines[one], walls[wall_row]
        if nearest_approach.distance >= pocket.beyond_mm - GOUGE_TOLERANCE_MM:
            continue
        places = _witnesses(wall)
        is_outside = nearest(places, cleared).distance > GOUGE_TOLERANCE_MM
        if not (is_outside & ~inside(places, cleared)).any():
            continue  # it goes through the floor
        if nearest_approach.distance <= GOUGE_TOLERANCE_MM and _lies_in(line, wall):
            continue
        yield GOUGE(
            where=at_place(sides.names[int(rows[one])], nearest_approach.point),
            measured=nearest_approach.distance,
            limit=pocket.beyond_mm,
            severity=Severity.WARNING,
            tool=tool_name(pocket.tool),
            contour=sides.names[int(rows[one])],
            amount=pocket.beyond_mm - nearest_approach.distance,
            other=sides.names[int(wall_rows[wall_row])],
        )


def _witnesses(path: Polyline) -> Floats:
    """Return (P, 2) the vertices of a path and the midpoints of its segments, as test points for
    its position."""
    return np.concatenate([path.vertices[:, :2], midpoints(Segments.of(path))])


def _parts(path: Polyline, wall: Polyline) -> tuple[Bools, Floats]:
    """Return for the witnesses of a path the mask (P,) of those inside the closed path `wall`, and
    their distances (P,) from it, mm."""
    return _side_and_distance(_witnesses(path), wall)


def _side_and_distance(points: Floats, wall: Polyline) -> tuple[Bools, Floats]:
    ring = Segments.of(wall)
    return inside(points, ring), nearest(points, ring).distance


def _lies_in(path: Polyline, wall: Polyline) -> bool:
    """Return True if `path` lies within the closed path `wall`."""
    is_inside, distances = _parts(path, wall)
    return bool((is_inside | (distances <= GOUGE_TOLERANCE_MM)).all())


def _cross(one: Polyline, other: Polyline) -> bool:
    """Return True if two closed paths cross, rather than only touch."""
    for path, wall in ((one, other), (other, one)):
        is_inside, distances = _parts(path, wall)
        clear = distances > GOUGE_TOLERANCE_MM
        if (is_inside & clear).any() and (~is_inside & clear).any():
            return True
    return False


def _overshoot(path: Polyline, wall: Polyline, drawn: Polyline) -> float:
    """Return how far the tool's centre goes across a closed line at most, mm; the side on which
    most of the drawn contour lies is this side of the line."""
    length = float(path_lengths(Polylines.of([path]))[0])
    is_inside, distances = _side_and_distance(sample(path, length / SAMPLES_ROUND), wall)
    home, clear = _parts(drawn, wall)
    mostly_in = bool((np.where(home, 1.0, -1.0) * (clear > GOUGE_TOLERANCE_MM)).sum() > 0.0)
    return float(distances[is_inside != mostly_in].max(initial=0.0))


def _cleared_away(chosen: Chosen, sides: Sides, pocket: Operation) -> Iterator[Finding]:
    """Yield a finding for parts that another operation keeps but that lie in what a pocket (or
    bore) clears at least as deep."""
    is_kept = sides.kept_from(pocket)
    is_kept[chosen.source] = False
    rows = np.flatnonzero(is_kept)
    if len(rows) == 0:
        return
    holds = sides.cut_by(pocket)
    levels = sides.nesting.levels_by(holds)
    for row in rows[levels.depth[rows] % 2 == 1].tolist():
        holder = sides.names[int(levels.parent[row])]
        width = float(np.ptp(extents(sides.lines.select([row])), axis=1).min())
        yield GOUGE_BY_POCKET(
            where=at_place(sides.names[row], sides.lines[row].start.tolist()),
            measured=width,
            limit=0.0,
            pocket=holder,
            contour=sides.names[row],
        )


def by_uncut(sides: Sides, operation: Operation, rows: Ints) -> Iterator[Finding]:
    """Yield findings for closed contours of the operation (`rows`) whose side depends on uncut
    contours: those that would be on the other side without them, and those that would be if
    contours on layers of frames counted."""
    seen_sides = sides.seen_by(operation)
    for sentence, is_turned, surrounding in (
        (SIDE_BY_UNCUT, seen_sides.by_uncut, sides.uncut),
        (SIDE_BY_UNCUT_FRAME, seen_sides.by_frames, sides.frames),
    ):
        affected = rows[is_turned[rows]]
        if len(affected) == 0:
            continue
        parent = sides.nesting.levels_by(surrounding).parent
        first = int(affected[0])
        name = sides.names[int(parent[first])]
        yield sentence(
            where=operation_name(operation),
            measured=len(affected),
            uncut=name,
            layer=name.partition("/")[0],
            first=sides.names[first],
            side="outside" if seen_sides.rim[first] else "inside",
        )
