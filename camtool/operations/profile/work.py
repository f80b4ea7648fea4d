"""Profiles: the paths of the tool centre beside and on the lines.

`auto` takes all closed paths together: the nesting of the whole drawing decides which of them are
edges of parts and which are edges of holes (`sides`), and the tool runs a tool's radius (and the
allowance, which below 0 brings it nearer) away: outside of parts and islands, inside of holes.
Where parts lie nearer to each other than the tool is wide, one contour runs round both. `outside`
and `inside` take each closed path on its own. Open paths have no inside: the tool runs on them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Ints
from camtool.findings import Finding
from camtool.geometry.distance import approaches, near_paths, nearest
from camtool.geometry.measure import extents, signed_areas
from camtool.geometry.offset import offset_each, offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse_lines,
)
from camtool.operations.engrave.work import run_together
from camtool.planning.findings import (
    CONTOUR_TOO_SMALL,
    CONTOUR_TOO_SMALL_ROUND,
    CORNER_FAR,
    CORNER_FAR_MORE,
    NOT_RELIEVED,
    OPEN_CONTOUR_ON_LINE,
    SLOT_AS_WIDE,
    UNREACHED_BETWEEN,
    UNREACHED_BETWEEN_MORE,
    PlanningCode,
)
from camtool.planning.items import NO_STARTS, Chosen, Contour, Setting, Work, contours_along
from camtool.planning.naming import at_place, shortened_list, tool_name, width_name
from camtool.planning.paths import joints, midpoints
from camtool.planning.sides import runs_beside
from camtool.records import replace

ROOM_TOLERANCE_MM = 1e-4
"""Two contours may be nearer than the tool is wide by this much before they count as joined."""

FAR_CORNER = 5.0
"""Joins that take the tool farther from a corner than this many times its distance from the wall
are reported: corners sharper than 23 degrees."""

SLOT_TOLERANCE_MM = 5e-4
"""A slot or hole narrower than the tool by this much or less counts as wide as the tool."""


class _Line(Struct, frozen=True, eq=False):
    """A path of the tool centre. The material that stays lies to its left (`is_left`) or right;
    `sources`: the chosen paths that it belongs to, the one it mostly follows first."""

    path: Polyline
    is_left: bool
    sources: tuple[int, ...]
    plain_path: Polyline | None = None
    """The line without its reliefs, when it has any."""


class _Found(Struct, eq=False):
    """The lines and findings that the functions of this module collect, changed in place."""

    lines: list[_Line] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def profile(chosen: Chosen, setting: Setting) -> Work:
    """Return the contours of an operation of the kind profile, in the order of their paths."""
    operation = setting.operation
    closed = np.flatnonzero(chosen.lines.closed).tolist()
    opens = np.flatnonzero(~chosen.lines.closed).tolist()
    lines = _Found()
    if operation.stage == "finish":  # open ones have no wall
        opens = []
    if not runs_beside(operation):
        opens = list(range(len(chosen.lines)))
    elif operation.side == "auto":
        _add_shapes(chosen, closed, setting, lines)
    else:
        _add_each(chosen, closed, setting, lines)
        lines.findings += (_no_side(chosen, k, operation.side) for k in opens)
    if not runs_beside(operation):
        lines.findings += run_together(chosen, setting)
    if operation.joins != "round":
        lines.findings += shortened_list(
            list(_far_corners(chosen, setting, lines.lines)), CORNER_FAR_MORE
        )
    if operation.corners != "none":
        lines.lines = [_relieved(line, chosen, setting, lines.findings) for line in lines.lines]
    if operation.makes_slots and operation.stage == "finish":
        from camtool.operations.profile.slots import without_feet

        tool_mm = operation.tool.radius_mm
        lines.lines = [
            replace(line, path=without_feet(line.path, tool_mm)) for line in lines.lines
        ]
    elif operation.makes_slots:
        from camtool.operations.profile.slots import SlotWall, slot_work

        walls = [SlotWall(line.path, line.sources[0]) for line in lines.lines]
        contours = _contours(lines.lines, opens, chosen, setting)
        return slot_work(walls, opens, contours, chosen, setting, lines.findings)
    items = _contours(lines.lines, opens, chosen, setting)
    return Work(sorted(items, key=lambda each: each.source), tuple(lines.findings))


def _add_shapes(chosen: Chosen, closed: list[int], setting: Setting, line_set: _Found) -> None:
    """Add to `line_set` the lines around all closed paths, taken together as the boundaries of
    shapes."""
    for path_rows in _shapes(chosen, closed):
        _add_shape(chosen, path_rows, setting, line_set)


def _shapes(chosen: Chosen, closed: list[int]) -> list[list[int]]:
    """Return the rows of the closed paths as the boundaries of one region, or of two.

    Two if contours that were not chosen reverse the side of some paths: the windows of a plate
    without the plate, or a part within a window without the window. These paths form the second
    region."""
    if not closed:
        return []
    is_even = chosen.nesting.levels.depth[closed] % 2 == 0
    is_reversed = is_even != chosen.rim[closed]
    rows = np.array(closed)
    return [each.tolist() for each in (rows[~is_reversed], rows[is_reversed]) if len(each)]


def _add_shape(chosen: Chosen, path_rows: list[int], setting: Setting, line_set: _Found) -> None:
    """Add to `line_set` the lines around one shape, whose boundary these paths are, and the
    findings about places that the tool cannot reach or cuts away."""
    from camtool.planning.reach import cut_away_findings, unreached_findings

    lines = chosen.lines.select(path_rows)
    ccw = signed_areas(lines) > 0.0
    shape = reverse_lines(lines, ccw != chosen.rim[path_rows])
    before = len(line_set.lines)
    _round(chosen, path_rows, shape, setting, line_set)
    lines_made = line_set.lines[before:]
    joined = _joined(chosen, [line.sources for line in lines_made], setting)
    line_set.findings += shortened_list(list(joined), UNREACHED_BETWEEN_MORE)
    free_side = reverse_lines(shape)
    line_set.findings += cut_away_findings(shape, setting.operation)
    if setting.operation.beyond_mm:  # the tool also reaches what it cuts beyond the lines
        free_side = offset_shape(free_side, -setting.operation.beyond_mm)
    as_wide = any(finding.code == PlanningCode.SLOT_AS_WIDE for finding in line_set.findings)
    hair_mm = 2.0 * SLOT_TOLERANCE_MM if as_wide else 0.0
    line_set.findings += unreached_findings(free_side, setting, hair_mm=hair_mm)


def _add_each(chosen: Chosen, closed: list[int], setting: Setting, line_set: _Found) -> None:
    """Add to `line_set` the lines outside or inside each closed path, each path taken alone."""
    from camtool.planning.reach import cut_away_findings

    lines = chosen.lines.select(closed)
    shapes = reverse_lines(lines, (signed_areas(lines) > 0.0) != chosen.rim[closed])
    operation = setting.operation
    paths, owners = offset_each(
        shapes, -operation.away_mm, joins=operation.joins, mitre_limit=operation.mitre_limit
    )
    ends = np.searchsorted(owners, np.arange(len(closed) + 1)).tolist()
    for place, k in enumerate(closed):
        line_set.findings += cut_away_findings(shapes.select([place]), operation)
        line_set.lines += (
            _Line(paths[row], True, (k,)) for row in range(ends[place], ends[place + 1])
        )
        if ends[place] == ends[place + 1]:
            _missing(chosen, [k], shapes.select([place]), {0}, setting, line_set)


def _round(
    chosen: Chosen, path_rows: list[int], shape: Polylines, setting: Setting, line_set: _Found
) -> None:
    """Add to `line_set` the lines around a shape: its offset by the tool's radius and allowance.
    The shape lies on the left of its paths, which are `path_rows` of the chosen ones."""
    paths = _offset(shape, setting.operation.away_mm, setting)
    sources = _sources(paths, shape)
    for path, along in zip(paths, sources, strict=True):
        line_set.lines.append(_Line(path, True, tuple(path_rows[k] for k in along)))
    missing = set(range(len(path_rows))).difference(*sources)
    missing -= {place for place in missing if _is_double(shape, place)}
    if missing:
        _missing(chosen, path_rows, shape, missing, setting, line_set)


def _missing(
    chosen: Chosen,
    path_rows: list[int],
    shape: Polylines,
    missing: set[int],
    setting: Setting,
    line_set: _Found,
) -> None:
    """Add lines along paths of a shape (`missing`, reduced in place) in which only a tool thinner
    by SLOT_TOLERANCE_MM has room, such as slots as wide as the tool, and findings for the paths
    that have no room even so."""
    # A slot as wide as the tool has room for a slightly thinner one.
    paths = _offset(shape, max(setting.operation.away_mm - SLOT_TOLERANCE_MM, 0.0), setting)
    for path, along in zip(paths, _sources(paths, shape), strict=True):
        if missing.issuperset(along):
            missing.difference_update(along)
            line_set.lines.append(_Line(path, True, tuple(path_rows[k] for k in along)))
            line_set.findings.append(_as_wide(chosen, path_rows[along[0]], setting))
    ccw = signed_areas(shape) > 0.0
    line_set.findings += (
        _no_room(chosen, path_rows[k], bool(ccw[k]), setting) for k in sorted(missing)
    )


def _offset(shape: Polylines, away_mm: float, setting: Setting) -> Polylines:
    """Return the offset of a shape by `away_mm`, with the operation's joins at corners."""
    operation = setting.operation
    return offset_shape(shape, -away_mm, joins=operation.joins, mitre_limit=operation.mitre_limit)


def _sources(paths: Polylines, shape: Polylines) -> list[tuple[int, ...]]:
    """Return, for each offset path, the paths of the shape that its segments are nearest to, the
    one nearest to most of them first."""
    if len(paths) == 0:
        return []
    source, segments = Segments.of(shape), Segments.of(paths)
    owners = source.path[nearest(midpoints(segments), source).segment]
    pairs, count = np.unique(segments.path * len(shape) + owners, return_counts=True)
    path, indices = np.divmod(pairs, len(shape))
    order = np.lexsort((indices, -count, path))
    sources: list[tuple[int, ...]] = []
    for begin, end in pairwise(np.searchsorted(path, np.arange(len(paths) + 1)).tolist()):
        sources.append(tuple(indices[order[begin:end]].tolist()))
    return sources


def _is_double(shape: Polylines, place: int) -> bool:
    """Return True if an earlier path of the shape covers this one, as contours that are drawn
    twice do."""
    segments = Segments.of(shape)
    own_segments, earlier = segments[segments.path == place], segments[segments.path < place]
    if len(earlier) == 0:
        return False
    points = np.concatenate([own_segments.start, midpoints(own_segments)])
    return bool((nearest(points, earlier).distance <= POSITION_EPS_MM).all())


def _as_wide(chosen: Chosen, k: int, setting: Setting) -> Finding:
    return SLOT_AS_WIDE(where=_box_centre(chosen, k), tool=width_name(setting.operation))


def _no_room(chosen: Chosen, k: int, outer: bool, setting: Setting) -> Finding:
    return (CONTOUR_TOO_SMALL_ROUND if outer else CONTOUR_TOO_SMALL)(
        where=_box_centre(chosen, k),
        measured=abs(float(signed_areas(chosen.lines.select([k]))[0])),
        tool=width_name(setting.operation),
    )


def _box_centre(chosen: Chosen, k: int) -> str:
    """Return the name of a path and the centre of its bounding box, as the place of a finding."""
    return at_place(chosen.names[k], extents(chosen.lines.select([k])).mean(axis=1))


def _joined(chosen: Chosen, runs: list[tuple[int, ...]], setting: Setting) -> Iterator[Finding]:
    """Yield findings about lines that run around several paths at once, since nothing is cut
    between these."""
    room = 2.0 * setting.operation.away_mm
    several = [run for run in runs if len(run) > 1]
    path_rows = [row for run in several for row in run]
    line_of = [number for number, run in enumerate(several) for _ in run]
    lines = chosen.lines.select(path_rows)
    pairs = [
        (one, other)
        for one, other in sorted(near_paths(lines, lines, room))
        if one < other and line_of[one] == line_of[other]
    ]
    for (one, other), nearest_approach in zip(pairs, approaches(lines, lines, pairs), strict=True):
        if nearest_approach.distance >= room - ROOM_TOLERANCE_MM:
            continue
        yield UNREACHED_BETWEEN(
            where=at_place(chosen.names[path_rows[one]], nearest_approach.point),
            measured=nearest_approach.distance,
            limit=room,
            tool=width_name(setting.operation),
            one=chosen.names[path_rows[one]],
            other=chosen.names[path_rows[other]],
        )


def _relieved(line: _Line, chosen: Chosen, setting: Setting, findings: list[Finding]) -> _Line:
    """Return the line with reliefs (dog bones) at the sharp inner corners of its paths; findings
    are appended."""
    from camtool.planning.reliefs import add_reliefs

    tool, path = setting.operation.tool, line.path
    for k in line.sources:
        is_other = (np.arange(len(chosen.lines)) != k) & chosen.lines.closed
        keep_out = chosen.lines.select(np.flatnonzero(is_other).tolist())
        kind, near_mm = setting.operation.corners, tool.radius_mm - setting.operation.beyond_mm
        relieved = add_reliefs(path, chosen.lines[k], near_mm, kind, keep_out)
        path = relieved.path
        findings += (
            NOT_RELIEVED(where=at_place(chosen.names[k], corner), tool=tool_name(tool))
            for corner in relieved.left.tolist()
        )
    return replace(line, path=path, plain_path=line.path)


def _contours(
    lines: list[_Line], opens: list[int], chosen: Chosen, setting: Setting
) -> list[Contour]:
    """Return the lines, and the chosen paths that are cut as they are drawn, as contours."""
    names, sources = [chosen.names[k] for k in opens], chosen.source[opens].tolist()
    on_line = contours_along(chosen.lines.select(opens), setting, names, sources)
    return [*_side_contours(lines, chosen, setting), *on_line]


def _side_contours(lines: list[_Line], chosen: Chosen, setting: Setting) -> list[Contour]:
    """Return the lines as contours in the operation's direction: with climb, the material that
    stays lies to the right."""
    direction = setting.operation.direction
    paths, left_flags = (
        Polylines.of(line.path for line in lines),
        np.array([line.is_left for line in lines], dtype=np.bool_),
    )
    first = [line.sources[0] for line in lines]
    if direction == "drawn":
        ccw = signed_areas(chosen.lines) > 0.0
        turn = (signed_areas(paths) > 0.0) != ccw[first]
    else:
        turn = left_flags == (direction == "climb")
    paths = reverse_lines(paths, turn)
    return [
        Contour(
            path,
            setting,
            chosen.names[line.sources[0]],
            int(chosen.source[line.sources[0]]),
            starts=_starts(path, line.plain_path),
            material_left=is_left,
        )
        for path, line, is_left in zip(paths, lines, (left_flags != turn).tolist(), strict=True)
    ]


def _starts(path: Polyline, plain_path: Polyline | None) -> Ints:
    """Return the indices of the vertices at which a path with reliefs may begin: joints outside
    the reliefs."""
    if plain_path is None:
        return NO_STARTS
    own_places = {tuple(place) for place in plain_path.vertices[:, :2].tolist()}
    joint = joints(Polylines.of([path]))
    places = enumerate(path.vertices[:, :2].tolist())
    return np.array(
        [k for k, place in places if joint[k] and tuple(place) in own_places], dtype=np.int64
    )


def _no_side(chosen: Chosen, k: int, side: str) -> Finding:
    return OPEN_CONTOUR_ON_LINE(
        where=at_place(chosen.names[k], chosen.lines[k].start.tolist()), side=side
    )


def _far_corners(chosen: Chosen, setting: Setting, lines: list[_Line]) -> Iterator[Finding]:
    """Yield findings for corners of the tool's path that lie far from the drawn corner, as sharp
    and mitred joins do.

    At a corner of angle α the straight sides of the path meet at away / sin(α/2) from it."""
    max_distance = FAR_CORNER * setting.operation.away_mm
    for line in lines:
        drawn = Segments.of(chosen.lines.select(line.sources))
        corners = line.path.vertices[:, :2]
        distance = nearest(corners, drawn).distance
        for k in np.flatnonzero(distance > max_distance).tolist():
            yield CORNER_FAR(
                where=at_place(chosen.names[line.sources[0]], corners[k].tolist()),
                measured=distance[k],
                limit=max_distance,
                joins=setting.operation.joins,
            )
