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
region: to clear it, carve it, or cut beside it is an error.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding, Severity
from camtool.geometry.distance import approach, near_paths, nearest
from camtool.geometry.drawing import Branch
from camtool.geometry.measure import extents, path_lengths, sample
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.planning.findings import (
    BRANCHED_REGION,
    BRANCHED_REGION_MORE,
    GOUGE,
    GOUGE_BY_POCKET,
    GOUGE_BY_POCKET_MORE,
    GOUGE_MORE,
    GOUGE_OF_ALLOWANCE,
    GOUGE_OF_UNCUT,
    SIDE_BY_UNCUT,
    SIDE_BY_UNCUT_FRAME,
)
from camtool.planning.items import Chosen, Work, contours_of
from camtool.planning.job import Operation
from camtool.planning.naming import at_place, operation_name, shortened_list, tool_name
from camtool.planning.paths import midpoints
from camtool.planning.sides import Sides, runs_beside

GOUGE_TOLERANCE_MM = 1e-4
"""Another contour may be cut into by this much before it is a gouge: a tenth of a micrometre."""

SAMPLES_ROUND = 500
"""Number of places of a path at which its distance across another one is measured."""


def side_findings(work: Work, chosen: Chosen, sides: Sides, operation: Operation) -> list[Finding]:
    """Findings on the sides of an operation: gouges, and sides that follow from uncut contours."""
    if operation.contract.clears:
        cleared = list(_cleared_away(chosen, sides, operation))
        beyond = list(_beside_pocket(sides, operation)) if operation.beyond_mm else []
        return [
            *shortened_list(cleared, GOUGE_BY_POCKET_MORE),
            *shortened_list(beyond, GOUGE_MORE),
        ]
    if not runs_beside(operation):
        return []
    gouges = list(_gouges(work, chosen, sides, operation))
    found = shortened_list(gouges, GOUGE_MORE)
    if operation.side == "auto":
        found += by_uncut(sides, operation, chosen.source[chosen.lines.closed])
    return found


def branch_findings(
    branches: Sequence[Branch], chosen: Chosen, sides: Sides, operation: Operation
) -> list[Finding]:
    """Errors where an operation needs to know what contours enclose that pass `branches` of the
    placed drawing at which that is a choice: its own, and those that decide its sides."""
    beside = runs_beside(operation)
    if not (beside or operation.contract.cuts == "within"):
        return []
    asked = np.zeros(len(sides.lines), dtype=np.bool_)
    asked[chosen.source] = True
    if beside and operation.side == "auto":
        asked |= sides.seen_by(operation).bounds
    found = [
        BRANCHED_REGION(
            where=at_place(sides.names[rows[0]], branch.at_mm),
            measured=branch.ends,
            limit=2.0,
            contour=sides.names[rows[0]],
        )
        for branch in branches
        if (rows := [row for row in branch.paths if asked[row]])
    ]
    return shortened_list(found, BRANCHED_REGION_MORE)


def _gouges(work: Work, chosen: Chosen, sides: Sides, operation: Operation) -> Iterator[Finding]:
    """Yield a finding where the tool, beside one contour, comes over another one, or into the
    allowance that its operation leaves on that."""
    radius, allowance = operation.wall_radius_mm, operation.allowance_mm
    if operation.stage == "rough":
        allowance = 0.0  # what roughing takes of it is not missed
    bevel = operation.chamfer_mm or 0.0  # edges of others are not to be broken
    beside = [item for item in contours_of(work.items) if item.material_left is not None]
    seen, sided = sides.seen_by(operation), sides.sided()
    wanted = sided | seen.bounds
    # Those of one operation with the side auto are offset together.
    own = set(chosen.source.tolist())
    if operation.side == "auto":
        wanted = wanted.copy()
        wanted[chosen.source] = False
    others = np.flatnonzero(wanted)
    walls = sides.lines.select(others.tolist())
    paths = Polylines.of(item.path for item in beside)
    for one, which in near_paths(paths, walls, radius + bevel + max(allowance, 0.0)):
        item, other = beside[one], int(others[which])
        wall = walls[which]
        if item.source == other:
            continue
        near = approach(item.path, wall)
        reach = radius if other in own else radius + bevel
        reach -= _taken_back(sides, other, item.path)
        if near.distance >= reach - GOUGE_TOLERANCE_MM:
            if other in own and near.distance < radius + allowance - GOUGE_TOLERANCE_MM:
                yield GOUGE_OF_ALLOWANCE(
                    where=at_place(item.name, near.point),
                    measured=near.distance,
                    limit=radius + allowance,
                    severity=Severity.WARNING,
                    tool=tool_name(operation.tool),
                    contour=item.name,
                    amount=radius + allowance - near.distance,
                    other=sides.names[other],
                )
            continue
        drawn = sides.lines[item.source]
        kept = bool(sided[other])
        if not kept and _lies_in(drawn, wall):
            continue  # the edge of the stock, or of a sheet: nothing says that it stays
        is_asked = operation.side != "auto" and (other in own or _cross(drawn, wall))
        amount = reach - near.distance
        if near.distance <= POSITION_EPS_MM:
            amount = reach + _beyond(item.path, wall, drawn)
        yield (GOUGE if kept else GOUGE_OF_UNCUT)(
            where=at_place(item.name, near.point),
            measured=near.distance,
            limit=reach,
            severity=Severity.ERROR if kept and not is_asked else Severity.WARNING,
            tool=tool_name(operation.tool),
            contour=item.name,
            amount=amount,
            other=sides.names[other],
        )


def _taken_back(sides: Sides, other: int, path: Polyline) -> float:
    """Distance by which the wall of a contour is taken back, mm, seen from where another path
    begins."""
    without, within = sides.beyond_mm[other].tolist()
    if not (without or within):
        return 0.0
    # What stays is on the other side of the wall.
    here = inside(np.array(path.vertices[:1, :2]), Segments.of(sides.lines[other]))[0]
    return float(without if here else within)


def _beside_pocket(sides: Sides, pocket: Operation) -> Iterator[Finding]:
    """Yield a finding where what is cut beyond the lines of a pocket, or a bore, comes over a
    contour beside it that a profile follows. Where it only opens towards the contour around it,
    nothing is lost."""
    cut = sides.cut_by(pocket) & sides.lines.closed
    rows, others = np.flatnonzero(cut), np.flatnonzero(sides.sided() & ~cut)
    lines, walls = (sides.lines.select(each.tolist()) for each in (rows, others))
    cleared = Segments.of(lines)
    for one, which in near_paths(lines, walls, pocket.beyond_mm):
        line, wall = lines[one], walls[which]
        near = approach(line, wall)
        if near.distance >= pocket.beyond_mm - GOUGE_TOLERANCE_MM:
            continue
        places = _witnesses(wall)
        aside = nearest(places, cleared).distance > GOUGE_TOLERANCE_MM
        if not (aside & ~inside(places, cleared)).any():
            continue  # it goes through the floor
        if near.distance <= GOUGE_TOLERANCE_MM and _lies_in(line, wall):
            continue
        yield GOUGE(
            where=at_place(sides.names[int(rows[one])], near.point),
            measured=near.distance,
            limit=pocket.beyond_mm,
            severity=Severity.WARNING,
            tool=tool_name(pocket.tool),
            contour=sides.names[int(rows[one])],
            amount=pocket.beyond_mm - near.distance,
            other=sides.names[int(others[which])],
        )


def _witnesses(path: Polyline) -> Floats:
    """(P, 2) the vertices of a path and the midpoints of its segments."""
    return np.concatenate([path.vertices[:, :2], midpoints(Segments.of(path))])


def _parts(path: Polyline, wall: Polyline) -> tuple[Bools, Floats]:
    """(P,), (P,) of the witnesses of a path: whether each is within a closed one, and how far
    from its line, mm."""
    return _within(_witnesses(path), wall)


def _within(points: Floats, wall: Polyline) -> tuple[Bools, Floats]:
    ring = Segments.of(wall)
    return inside(points, ring), nearest(points, ring).distance


def _lies_in(path: Polyline, wall: Polyline) -> bool:
    """True if a path lies within a closed one."""
    within, away = _parts(path, wall)
    return bool((within | (away <= GOUGE_TOLERANCE_MM)).all())


def _cross(one: Polyline, other: Polyline) -> bool:
    """True if two closed paths cross, and not only touch."""
    for path, wall in ((one, other), (other, one)):
        within, away = _parts(path, wall)
        clear = away > GOUGE_TOLERANCE_MM
        if (within & clear).any() and (~within & clear).any():
            return True
    return False


def _beyond(path: Polyline, wall: Polyline, drawn: Polyline) -> float:
    """Greatest distance of the tool's centre across a closed line, mm; the side on which most of
    the drawn contour lies is this side of it."""
    length = float(path_lengths(Polylines.of([path]))[0])
    within, away = _within(sample(path, length / SAMPLES_ROUND), wall)
    home, clear = _parts(drawn, wall)
    mostly_in = bool((np.where(home, 1.0, -1.0) * (clear > GOUGE_TOLERANCE_MM)).sum() > 0.0)
    return float(away[within != mostly_in].max(initial=0.0))


def _cleared_away(chosen: Chosen, sides: Sides, pocket: Operation) -> Iterator[Finding]:
    """Parts that another operation keeps, in what a pocket (or a bore) clears as deep as that, or
    deeper."""
    kept = sides.kept_from(pocket)
    kept[chosen.source] = False
    rows = np.flatnonzero(kept)
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
    """Yield findings of what follows from uncut closed contours, for those of the operation
    (`rows`): some have their side because of them, others in spite of those on the layers of
    frames."""
    seen = sides.seen_by(operation)
    for sentence, turned, around in (
        (SIDE_BY_UNCUT, seen.by_uncut, sides.uncut),
        (SIDE_BY_UNCUT_FRAME, seen.by_frames, sides.frames),
    ):
        found = rows[turned[rows]]
        if len(found) == 0:
            continue
        parent = sides.nesting.levels_by(around).parent
        first = int(found[0])
        name = sides.names[int(parent[first])]
        yield sentence(
            where=operation_name(operation),
            measured=len(found),
            uncut=name,
            layer=name.partition("/")[0],
            first=sides.names[first],
            side="outside" if seen.rim[first] else "inside",
        )
