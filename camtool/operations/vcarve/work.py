"""Carving with a V bit: the wider a place, the deeper the tip, so that both walls are cut at once.

    closed paths ──nesting──▶ regions ──medial trace──▶ discs ──bands of radii──▶ grooves, walls
                 ──graph──▶ walks ──depth by radius──▶ runs, one Fixed item per region

With the half angle α of the bit and the radius r of its flat tip, a disc of radius ρ is cut at the
surface when the tip is as deep as

    depth = (ρ − r) / tan α.

At convex corners ρ falls to 0 and the tip comes up to the surface, in the corner itself (a flat
tip stops where it no longer fits). Where the depth of the operation or the width of the bit does
not allow more, walls are cut at that depth, and the floor between them is left and reported: a
pocket with a flat tool clears it.

A disc of radius ρ in the region is what the bit cuts at the surface. `grooves` are pieces of
the medial axis with low ≤ ρ ≤ high; where discs are larger than `high`, the `walls` run beside the
boundary at that distance. Together they are where the centre of the largest disc allowed runs when
it rolls along the boundary.

What is cut is right to `CARVE_TOLERANCE_MM`: all vertices lie on the medial axis or on the
parallel curve, exact to rounding; lines and arcs between them leave the axis, sideways and in
radius together, by no more than the tolerance; side branches that reach no farther go."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice, pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import GeometryError, OptionError
from camtool.findings import Finding
from camtool.geometry.boxes import touching_boxes
from camtool.geometry.distance import points_to_segments
from camtool.geometry.intersect import MAX_PAIRS, meetings
from camtool.geometry.measure import segment_boxes, signed_area
from camtool.geometry.medial import (
    HALVINGS,
    Boundary,
    MedialTrace,
    concatenated,
    discs_at,
    medial_trace,
    off_chord,
)
from camtool.geometry.nesting import regions
from camtool.geometry.offset import merge_points
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.kernels.discs import SWEEP, frame
from camtool.operations.vcarve import VCARVE
from camtool.planning.findings import (
    CONTOUR_TOO_SMALL_FOR_TIP,
    DEPTH_LIMITED,
    SELF_CROSSING_CARVED,
    SELF_CROSSING_NO_REGION,
    UNREACHED_BY_TIP,
)
from camtool.planning.items import Chosen, CutRun, Fixed, Setting, Work
from camtool.planning.job import Operation
from camtool.planning.naming import at_place, key_of
from camtool.planning.paths import join_paths, reverse_vertices
from camtool.planning.ramps import feeds_along
from camtool.planning.reach import unreached
from camtool.planning.settings import Cone

CROSSINGS_SHOWN = 3

CARVE_TOLERANCE_MM = VCARVE.path_error_mm

LEVEL_EPS_MM = 1e-9
"""A radius nearer than this to a limit is the limit: rounding, along walls that are parallel."""

FIT_SHARE = 0.75
"""Share of the tolerance for lines and arcs through samples of the axis; the error between the
samples takes less than the rest."""

MIN_ARC_SAMPLES = 5
"""An arc is fitted through three of at least this many samples."""

MIN_SWEEP_RAD = 1e-4
"""Samples that turn by less do not become an arc: its centre would be too far away for exact
numbers."""

MAX_SWEEP_RAD = 2.0

MEET_MM = 1e-4
"""Ends of pieces that are nearer than this are the same place."""


class _Region(Struct, frozen=True, eq=False):
    """A region to carve: its paths, its name, and the index of its outer path in the drawing."""

    lines: Polylines
    name: str
    source: int


def vcarve(chosen: Chosen, setting: Setting) -> Work:
    """Return one Fixed item for each region that the closed paths enclose (even-odd).

    If paths cross, the regions are undefined: a finding of severity error, and no items.
    OptionError for an open path and for a tool that is no V bit."""
    cone = Cone.of(setting.operation)
    _refuse_open(chosen, setting.operation)
    crossing = list(islice(_crossings(chosen), CROSSINGS_SHOWN))
    if crossing:
        return Work((), tuple(crossing))
    items: list[Fixed] = []
    findings: list[Finding] = []
    for region in _regions(chosen):
        try:
            item, region_findings = _carved(region, setting, cone)
        except GeometryError as error:
            return Work((), (_no_region(region, error),))
        items.extend(item)
        findings.extend(region_findings)
    return Work(tuple(items), tuple(findings))


def _refuse_open(chosen: Chosen, operation: Operation) -> None:
    if not chosen.lines.closed.all():
        name = chosen.names[int(np.argmin(chosen.lines.closed))]
        raise OptionError(
            f"{name} is open and has no inside to carve",
            where=key_of(operation, "kind"),
            mend='close it, or take it with an operation of kind = "engrave"',
        )


def _crossings(chosen: Chosen) -> Iterator[Finding]:
    """Yield findings for the places where paths cross themselves or each other."""
    segments = Segments.of(chosen.lines)
    rows, zeros = np.arange(len(segments)), np.zeros(len(segments), dtype=np.int64)
    every = np.ones(len(segments), dtype=np.bool_)
    boxes = segment_boxes(segments)
    one, other = touching_boxes(boxes, zeros, rows, every, max_pairs=MAX_PAIRS)
    if len(one) == 0:
        return
    common, crosses = meetings(segments, one, other)
    for row in np.flatnonzero(crosses).tolist():
        a, b = (chosen.names[segments.path[i[row]]] for i in (common.row_a, common.row_b))
        x, y = common.point[row].tolist()
        yield SELF_CROSSING_CARVED(
            where=at_place(a, (x, y)), contour=a, other="itself" if a == b else b
        )


def _no_region(region: _Region, error: GeometryError) -> Finding:
    return SELF_CROSSING_NO_REGION(
        where=f"{region.name} at {error.where}", fault=error.message, mend=error.mend
    )


def _regions(chosen: Chosen) -> Iterator[_Region]:
    for row, lines in regions(chosen.nesting):
        yield _Region(lines, chosen.names[row], int(chosen.source[row]))


def _carved(region: _Region, setting: Setting, cone: Cone) -> tuple[list[Fixed], list[Finding]]:
    """Return the item of one region ([] if the tip fits nowhere) and its findings."""
    boundary, trace = medial_trace(region.lines, CARVE_TOLERANCE_MM)
    limits = [cone.tip_mm, *(cone.radius_at(-level) for level in setting.levels_mm)]
    for limit in sorted(set(limits)):
        trace = with_level(boundary, trace, limit)
    # Walking a piece twice takes no longer than coming down from safe z does.
    repeat_mm = setting.safe_z_mm * setting.feeds.cut_mm_min / setting.feeds.plunge_mm_min
    paths: list[Floats] = []
    floor: list[Floats] = []
    for low, high in pairwise(limits):
        if high > low:
            band = Band(low, high, CARVE_TOLERANCE_MM)
            floor = walls(boundary, trace, high)
            paths += _walks(trace, floor, band, repeat_mm)
    findings = [*_too_narrow(region, trace, cone), *_limited(region, trace, floor, limits[-1])]
    runs = tuple(_run(path, setting, cone, region.name) for path in paths)
    outline = region.lines[0]
    item = Fixed(runs, setting, region.name, region.source, outline)
    return [item] if runs else [], findings


def _walks(trace: MedialTrace, floor: list[Floats], band: Band, again_mm: float) -> list[Floats]:
    """Return the paths (n, 4) of the tip in one band of radii: walks over the grooves and walls,
    and a single point for a round region that these do not pass."""
    graph = pruned(graph_of([*grooves(trace, band), *floor]), band.tolerance_mm)
    largest = trace.discs[int(np.argmax(trace.rho))]
    is_cut = band.low_mm < largest[2] <= band.high_mm
    is_missed = is_cut and _passed_by(graph.pieces, largest[:2]) > band.tolerance_mm
    return [*walks(graph, again_mm), *([np.append(largest, 0.0)[None, :]] if is_missed else [])]


def _passed_by(pieces: list[Floats], point: Floats) -> float:
    """Return the distance in the plane from a point to the nearest piece, mm; inf if there are
    none."""
    rows = [np.column_stack([piece[:-1], piece[1:, :2]]) for piece in pieces]
    if not rows:
        return math.inf
    ends = np.concatenate(rows)
    segments = Segments.between(ends[:, :2], ends[:, 4:], ends[:, 3])
    return float(points_to_segments(point[None, :], segments).min())


def _run(path: Floats, setting: Setting, cone: Cone, name: str) -> CutRun:
    """Return the run of the tip along a path (n, 4) of x, y, disc radius, bulge."""
    vertices = np.column_stack([path[:, :2], 0.0 - cone.depth_of(path[:, 2]), path[:, 3]])
    return CutRun(
        vertices, feeds_along(vertices, setting.feeds), setting.feeds.plunge_mm_min, name
    )


def _too_narrow(region: _Region, trace: MedialTrace, cone: Cone) -> Iterator[Finding]:
    """Yield a finding for places that the flat tip of the bit cannot enter: the whole region, or
    its corners and narrow places."""
    tip, widest = 2.0 * cone.tip_mm, 2.0 * float(trace.rho.max())
    if widest <= tip:
        yield CONTOUR_TOO_SMALL_FOR_TIP(
            where=at_place(region.name, region.lines[0].start.tolist()), measured=widest, limit=tip
        )
        return
    pieces = unreached(region.lines, cone.tip_mm)
    if pieces:
        yield UNREACHED_BY_TIP(
            where=at_place(region.name, pieces[0].at_mm),
            measured=sum(piece.area_mm2 for piece in pieces),
            tip=tip,
            places=len(pieces),
        )


def _limited(
    region: _Region, trace: MedialTrace, floor: list[Floats], limit_mm: float
) -> Iterator[Finding]:
    if floor:
        row = int(np.argmax(trace.rho))
        yield DEPTH_LIMITED(
            where=at_place(region.name, (float(trace.x[row]), float(trace.y[row]))),
            measured=floor_area(floor),
            width=2.0 * trace.rho[row],
            allowed=2.0 * limit_mm,
        )


class Band(Struct, frozen=True):
    """The disc radii that one pass cuts, mm: above `low_mm`, which the pass before has cut, up to
    `high_mm`; and the tolerance of fitted arcs."""

    low_mm: float
    high_mm: float
    tolerance_mm: float


def with_level(boundary: Boundary, trace: MedialTrace, level_mm: float) -> MedialTrace:
    """Return the trace with a row added wherever its radius passes exactly `level_mm`."""
    is_level = np.abs(trace.rho - level_mm) <= LEVEL_EPS_MM
    trace = _with_radius(trace, np.where(is_level, level_mm, trace.rho))
    above = np.sign(trace.rho - level_mm)
    same_element = trace.element[1:] == trace.element[:-1]
    crossing_rows = np.flatnonzero(same_element & (above[1:] * above[:-1] < 0.0))
    guess = np.column_stack([trace.partner[crossing_rows], trace.partner[crossing_rows + 1]])
    low, high = trace.t[crossing_rows].copy(), trace.t[crossing_rows + 1].copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        rho = discs_at(boundary, trace.element[crossing_rows], middle, guess).rho
        is_low = np.sign(rho - level_mm) == above[crossing_rows]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    level_discs = discs_at(boundary, trace.element[crossing_rows], low, guess)
    merged = concatenated(
        [trace, _with_radius(level_discs, np.full(len(crossing_rows), level_mm))]
    )
    return merged.rows(np.lexsort((merged.t, merged.element)))


def _with_radius(trace: MedialTrace, rho: Floats) -> MedialTrace:
    return MedialTrace(trace.element, trace.t, trace.x, trace.y, rho, trace.partner, trace.u)


def grooves(trace: MedialTrace, band: Band) -> list[Floats]:
    """Return pieces (n, 4) of x, y, rho, bulge: the parts of the medial axis whose disc radius rho
    is within the band, each once. Along an arc the radius changes evenly with the sweep.

    `trace` must have rows at both limits of the band (`with_level`)."""
    rho = trace.rho
    low_rho, high_rho = np.minimum(rho[1:], rho[:-1]), np.maximum(rho[1:], rho[:-1])
    same_pair = (trace.element[1:] == trace.element[:-1]) & (
        trace.partner[1:] == trace.partner[:-1]
    )
    # Every piece is traced from both its sides: it is taken from the first one.
    is_first_pass = trace.element[1:] < trace.partner[1:]
    is_wanted = (
        same_pair
        & is_first_pass
        & (low_rho >= band.low_mm)
        & (high_rho <= band.high_mm)
        & (high_rho > band.low_mm)
    )
    tolerance = FIT_SHARE * band.tolerance_mm
    return [_fitted(trace.discs[i : j + 1], tolerance) for i, j in _index_runs(trace, is_wanted)]


def walls(boundary: Boundary, trace: MedialTrace, high_mm: float) -> list[Floats]:
    """Return pieces (2, 4) of x, y, rho, bulge: parallels of the boundary at the distance
    `high_mm`, wherever the discs are larger than that."""
    rho = trace.rho
    low_rho, high_rho = np.minimum(rho[1:], rho[:-1]), np.maximum(rho[1:], rho[:-1])
    same_element = trace.element[1:] == trace.element[:-1]
    is_wanted = same_element & (low_rho >= high_mm) & (high_rho > high_mm)
    return [
        _wall(boundary, int(trace.element[i]), (float(trace.t[i]), float(trace.t[j])), high_mm)
        for i, j in _index_runs(trace, is_wanted, partners=False)
    ]


def floor_area(pieces: list[Floats]) -> float:
    """Return the area of the floor between the walls, mm²; the walls run round it with the floor
    on their left."""
    total = 0.0
    for piece in pieces:
        (ax, ay, _, bulge), (bx, by, _, _) = piece.tolist()
        total += 0.5 * (ax * by - ay * bx)
        if bulge != 0.0 and math.hypot(bx - ax, by - ay) > POSITION_EPS_MM:
            lens = Polyline(np.array([[ax, ay, bulge], [bx, by, 0.0]]), closed=True)
            total += signed_area(lens)
    return total


def _index_runs(
    trace: MedialTrace, is_wanted: Bools, partners: bool = True
) -> list[tuple[int, int]]:
    """Return (first row, last row) of each run of consecutive wanted gaps between rows of the
    trace; a run stays on one element of the boundary (and with `partners` on one partner)."""
    is_joined = is_wanted[1:] & is_wanted[:-1] & (trace.element[2:] == trace.element[:-2])
    if partners:
        is_joined &= trace.partner[2:] == trace.partner[:-2]
    first = np.flatnonzero(is_wanted & ~np.append(False, is_joined))
    last = np.flatnonzero(is_wanted & ~np.append(is_joined, False))
    return list(zip(first.tolist(), (last + 1).tolist(), strict=True))


def _wall(
    boundary: Boundary, element: int, part: tuple[float, float], distance_mm: float
) -> Floats:
    """Return the parallel (2, 4) of a part of a boundary element: a line, or an arc of the same
    sweep."""
    rows = []
    for t in part:
        x, y, nx, ny = frame(boundary.table, element, t)
        rows.append([x + distance_mm * nx, y + distance_mm * ny, distance_mm, 0.0])
    rows[0][3] = float(np.tan(0.25 * (part[1] - part[0]) * boundary.table[element, SWEEP]))
    return np.array(rows)


def _fitted(discs: Floats, tolerance_mm: float) -> Floats:
    """Return lines and arcs (n, 4) through some of the discs (n, 3) x, y, rho; the others lie
    within the tolerance of these."""
    pieces, waiting = [], [(0, len(discs) - 1)]
    while waiting:
        i, j = waiting.pop()
        bulge = _bulge(discs[i : j + 1], tolerance_mm)
        if bulge is None:
            middle = (i + j) // 2
            waiting += [(middle, j), (i, middle)]
        else:
            pieces.append([*discs[i], bulge])
    return np.array([*pieces, [*discs[-1], 0.0]])


def _bulge(discs: Floats, tolerance_mm: float) -> float | None:
    """Return the bulge of the line (0) or arc from the first to the last disc that keeps the
    others within the tolerance; None if there is none."""
    inner = discs[1:-1]
    begin, end = discs[:1], discs[-1:]
    if len(inner) == 0 or off_chord(inner, begin, end).max() <= tolerance_mm:
        return 0.0
    if len(discs) < MIN_ARC_SAMPLES:
        return None
    # The arc through begin, a point P and end turns by 2·(π − angle at P); bulge = tan(turn / 4).
    middle = discs[len(discs) // 2, :2]
    to_begin, to_end = begin[0, :2] - middle, end[0, :2] - middle
    across = to_begin[0] * to_end[1] - to_begin[1] * to_end[0]
    sweep = 2.0 * (np.pi - abs(np.arctan2(across, to_begin @ to_end)))
    if not MIN_SWEEP_RAD <= sweep <= MAX_SWEEP_RAD:
        return None
    bulge = float(np.copysign(np.tan(0.25 * sweep), -across))
    return bulge if _off_arc(inner, begin[0], end[0], bulge) <= tolerance_mm else None


def _off_arc(inner: Floats, begin: Floats, end: Floats, bulge: float) -> float:
    """Return the distances of discs (x, y, rho) from an arc along which the radius changes evenly
    with the sweep."""
    chord = end[:2] - begin[:2]
    normal = np.array([-chord[1], chord[0]])
    centre = 0.5 * (begin[:2] + end[:2]) + (1.0 - bulge**2) / (4.0 * bulge) * normal
    arm, first = inner[:, :2] - centre, begin[:2] - centre
    angle = np.arctan2(first[0] * arm[:, 1] - first[1] * arm[:, 0], arm @ first)
    part = np.clip(angle / (4.0 * np.arctan(bulge)), 0.0, 1.0)
    radius = begin[2] + part * (end[2] - begin[2])
    deviations = np.abs(np.hypot(arm[:, 0], arm[:, 1]) - np.hypot(*first))
    return float((deviations + np.abs(inner[:, 2] - radius)).max())


class Graph(Struct, frozen=True, eq=False):
    """A graph of pieces of paths: P `pieces` between V `places` (V, 3) of x, y, rho; `ends` (P, 2)
    are the rows of the places where each piece begins and ends."""

    pieces: list[Floats]
    ends: Ints
    places: Floats


def graph_of(pieces: list[Floats]) -> Graph:
    """Return the graph of pieces (n, 4) of x, y, rho, bulge; pieces without length are
    left out."""
    pieces = [piece for piece in pieces if _extent(piece) > MEET_MM]
    if not pieces:
        return Graph([], np.empty((0, 2), dtype=np.int64), np.empty((0, 3)))
    discs = np.concatenate([piece[[0, -1], :3] for piece in pieces])
    place, _ = merge_points(discs[:, :2], MEET_MM)
    first = np.unique(place, return_index=True)[1]
    return Graph(pieces, place.reshape(-1, 2), discs[first])


def _extent(piece: Floats) -> float:
    """Return the greatest distance of the points of a piece from its start; for a full turn, which
    ends where it starts, this is still above 0."""
    return float(np.hypot(*(piece[1:, :2] - piece[0, :2]).T).max())


def pruned(graph: Graph, tolerance_mm: float) -> Graph:
    """Return the graph without side branches that cut almost nothing: those whose discs reach no
    farther than the tolerance out of the disc at the other end of the branch.

    A disc (m, ρ) reaches |m − m'| + ρ − ρ' out of another one (m', ρ'); along a branch of several
    pieces these add up at most."""
    degree = np.bincount(graph.ends.ravel(), minlength=len(graph.places))
    reach = np.zeros(len(graph.places))
    is_kept: Bools = np.ones(len(graph.pieces), dtype=np.bool_)
    at_place = _pieces_at(graph)
    waiting = sorted(np.flatnonzero(degree == 1).tolist(), key=lambda v: graph.places[v, 2])
    while waiting:
        leaf = waiting.pop(0)
        row = next((row for row in at_place[leaf] if is_kept[row]), None)
        if row is None:
            continue
        inner = int(graph.ends[row].sum()) - leaf
        step = graph.places[leaf] - graph.places[inner]
        total_reach = reach[leaf] + np.hypot(step[0], step[1]) + step[2]
        if total_reach > tolerance_mm:
            continue
        is_kept[row] = False
        reach[inner] = max(reach[inner], total_reach)
        degree[inner] -= 1
        if degree[inner] == 1:
            waiting.append(inner)
    rows = np.flatnonzero(is_kept)
    return Graph([graph.pieces[row] for row in rows], graph.ends[rows], graph.places)


def _pieces_at(graph: Graph) -> list[list[int]]:
    """Return the rows of the pieces that end at each place; a loop is listed twice."""
    at_place: list[list[int]] = [[] for _ in range(len(graph.places))]
    for row, (a, b) in enumerate(graph.ends.tolist()):
        at_place[a].append(row)
        at_place[b].append(row)
    return at_place


def walks(graph: Graph, again_mm: float) -> list[Floats]:
    """Join all pieces to as few walks (n, 4) of x, y, rho, bulge as possible, and return these.

    A connected graph with 2k places of odd degree needs k walks (one if k is 0). It is joined by k
    jumps between near places to one closed walk, which is found piece by piece (Hierholzer) and
    cut at the jumps, where the tool is lifted. Short pieces between two such places (up to
    `again_mm` long) are walked twice instead, into a corner and back, which saves a jump each. A
    walk begins at the end with the smaller disc."""
    graph = _doubled(graph, again_mm)
    ends = np.concatenate([graph.ends, _jumps(graph)])
    result = []
    for circuit in _circuits(ends, len(graph.places)):
        for rows in _cut(circuit, len(graph.pieces)):
            pieces = [(graph.pieces[row], is_reversed) for row, is_reversed in rows]
            walk = join_paths(
                [
                    reverse_vertices(piece) if is_reversed else piece
                    for piece, is_reversed in pieces
                ]
            )
            result.append(reverse_vertices(walk) if walk[-1, 2] < walk[0, 2] else walk)
    return result


def _doubled(graph: Graph, again_mm: float) -> Graph:
    """Return the graph with short pieces between two places of odd degree repeated, the shortest
    first and at most one piece for each place, so that these degrees become even."""
    odd = np.bincount(graph.ends.ravel(), minlength=len(graph.places)) % 2 == 1
    lengths = [float(lengths_of(piece).sum()) for piece in graph.pieces]
    repeated = []
    for row in sorted(range(len(lengths)), key=lambda row: (lengths[row], row)):
        a, b = graph.ends[row].tolist()
        if lengths[row] <= again_mm and a != b and odd[a] and odd[b]:
            odd[[a, b]] = False
            repeated.append(row)
    pieces = [*graph.pieces, *(graph.pieces[row] for row in repeated)]
    return Graph(pieces, np.concatenate([graph.ends, graph.ends[repeated]]), graph.places)


def lengths_of(path: Floats) -> Floats:
    """Return the lengths (n − 1,) in the plane of the lines and arcs of a path (n, 4), mm."""
    chord = np.hypot(*np.diff(path[:, :2], axis=0).T)
    bulge = path[:-1, 3]
    safe = np.where(bulge != 0.0, bulge, 1.0)
    factor = np.where(bulge != 0.0, (1.0 + safe**2) * np.arctan(safe) / safe, 1.0)
    return np.asarray(chord * factor)


def _jumps(graph: Graph) -> Ints:
    """Return (k, 2) pairs of places of odd degree, each with the nearest one of the same
    component."""
    degree = np.bincount(graph.ends.ravel(), minlength=len(graph.places))
    component = _components(graph)
    odd = np.flatnonzero(degree % 2).tolist()
    pairs = []
    while odd:
        one = odd.pop(0)
        mates = [v for v in odd if component[v] == component[one]]
        arms = graph.places[mates, :2] - graph.places[one, :2]
        mate = mates[int(np.argmin((arms**2).sum(axis=1)))]
        odd.remove(mate)
        pairs.append((one, mate))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _components(graph: Graph) -> list[int]:
    """Return the number of the connected component of each place."""
    root = list(range(len(graph.places)))

    def top(row: int) -> int:
        while root[row] != row:
            root[row] = root[root[row]]
            row = root[row]
        return row

    for a, b in graph.ends.tolist():
        one, other = top(a), top(b)
        root[max(one, other)] = min(one, other)
    return [top(row) for row in range(len(root))]


def _circuits(ends: Ints, count: int) -> Iterator[list[tuple[int, bool]]]:
    """Yield an Eulerian circuit for each component, as (row of the edge, True if walked
    backwards). All `count` places must have even degree."""
    edges: list[list[int]] = [[] for _ in range(count)]
    for row, (a, b) in enumerate(ends.tolist()):
        edges[a].append(row)
        edges[b].append(row)
    is_used = [False] * len(ends)
    for start in range(count):
        steps_done: list[tuple[int, bool]] = []
        stack: list[tuple[int, tuple[int, bool] | None]] = [(start, None)]
        while stack:
            place, arrival = stack[-1]
            while edges[place] and is_used[edges[place][-1]]:
                edges[place].pop()
            if edges[place]:
                row = edges[place].pop()
                is_used[row] = True
                a, b = ends[row].tolist()
                stack.append((b, (row, False)) if a == place else (a, (row, True)))
            else:
                stack.pop()
                if arrival is not None:
                    steps_done.append(arrival)
        if steps_done:
            yield steps_done[::-1]


def _cut(circuit: list[tuple[int, bool]], count: int) -> list[list[tuple[int, bool]]]:
    """Return the walks into which the jumps (rows from `count` on) divide a closed walk."""
    first = next((i for i, (row, _) in enumerate(circuit) if row >= count), None)
    if first is None:
        return [circuit]
    parts: list[list[tuple[int, bool]]] = [[]]
    for row, is_reversed in circuit[first + 1 :] + circuit[:first]:
        if row >= count:
            parts.append([])
        else:
            parts[-1].append((row, is_reversed))
    return [part for part in parts if part]
